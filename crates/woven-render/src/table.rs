//! The scene as the transport reads it: flat arrays of rows, the same on CPU and GPU.
//!
//! Layouts are `repr(C)` with the alignment of WGSL's storage buffers; `tests/parity_layout.rs` compares them with
//! the offsets that naga computes from the shader's structs.

mod check;
mod lights;
mod material;
mod mips;
mod rows;
mod sky;
mod stretch;
mod tree;

use anyhow::{Result, bail, ensure};
use glam::{Vec2, Vec3, Vec4};
use rayon::prelude::*;

use crate::bvh::{Bvh, Corners, EMPTY, STACK};
use crate::scene::{Camera, Mesh, Scene};

pub use rows::*;

/// The whole table.
#[derive(Clone, Debug)]
pub struct Table {
    /// Ray structure.
    pub bvh: Bvh,
    /// One row a place of the ray structure.
    pub shade: Vec<Shade>,
    /// Materials.
    pub materials: Vec<MaterialRow>,
    /// Uses of textures.
    pub textures: Vec<TextureRow>,
    /// RGBA, 8 bits each, red lowest; and the words of measured tables.
    pub texels: Vec<u32>,
    /// Lights, then portals.
    pub lights: Vec<LightRow>,
    /// Environment: radiance and, in the fourth number, the distribution along the row; then one entry a row whose
    /// first number is the distribution of rows.
    pub sky: Vec<[f32; 4]>,
    /// Everything else.
    pub globals: Globals,
    /// The eye.
    pub camera: Camera,
    /// Copies of what a moved mesh needs to be put in again.
    meshes: Vec<Mesh>,
    corners: Vec<Corners>,
    owners: Vec<(u32, u32)>,
    /// First triangle of each mesh in `corners`.
    first: Vec<usize>,
}

impl Table {
    /// Reads a scene into rows and builds its ray structure.
    ///
    /// # Errors
    /// A sentence when the scene names what is not there or has numbers that are not finite.
    pub fn new(scene: &Scene, light_layers: bool) -> Result<Self> {
        check::check(scene)?;
        let mut textures = material::Textures::default();
        let materials: Vec<MaterialRow> = scene
            .materials
            .iter()
            .map(|m| material::row(m, &mut textures, scene, light_layers))
            .collect();
        let mut corners = Vec::new();
        let mut owners = Vec::new();
        let mut first = Vec::new();
        for (m, mesh) in scene.meshes.iter().enumerate() {
            first.push(corners.len());
            for (t, triangle) in mesh.indices.iter().enumerate() {
                corners.push(triangle.map(|i| mesh.positions[i as usize]));
                owners.push((m as u32, t as u32));
            }
        }
        ensure!(
            corners.len() < (1 << 28),
            "the scene has {} triangles; at most {} can be rendered",
            corners.len(),
            (1 << 28) - 1
        );
        let bvh = Bvh::build(&corners);
        ensure!(
            bvh.stack_needed() <= STACK,
            "the ray structure needs a stack of {} entries where {STACK} are there; the scene's triangles are degenerate",
            bvh.stack_needed()
        );
        let mut table = Self {
            shade: vec![
                Shade {
                    material: NONE,
                    light: NONE,
                    ..Shade::default()
                };
                bvh.order.len()
            ],
            bvh,
            materials,
            textures: textures.rows,
            texels: textures.texels,
            lights: Vec::new(),
            sky: Vec::new(),
            globals: Globals::default(),
            camera: scene.camera,
            meshes: scene.meshes.iter().map(with_unit_normals).collect(),
            corners,
            owners,
            first,
        };
        table.fill_shade();
        table.fill_colors(scene);
        table.fill_openings();
        table.fill_gaps();
        sky::fill(&mut table, scene, light_layers);
        lights::fill(&mut table, scene, light_layers);
        let (lo, hi) = table.bvh.bounds();
        let size = lo.abs().max(hi.abs()).max_element();
        table.globals.offset = 1e-5 * size.clamp(0.01, 1e6);
        table.globals.taps = 4;
        Ok(table)
    }

    /// Triangles of the scene.
    #[must_use]
    pub fn triangles(&self) -> usize {
        self.corners.len()
    }

    /// A mesh as it is now.
    pub(crate) fn mesh(&self, mesh: usize) -> Option<&Mesh> {
        self.meshes.get(mesh)
    }

    /// Moves the vertices of mesh `mesh`: refits the ray structure and renews normals and lights. `normals` may be
    /// empty.
    ///
    /// # Errors
    /// When the mesh is not there, or has another number of vertices.
    pub fn move_mesh(&mut self, mesh: usize, positions: &[Vec3], normals: &[Vec3]) -> Result<()> {
        self.fits(mesh, positions, normals)?;
        let old = &mut self.meshes[mesh];
        old.positions.copy_from_slice(positions);
        old.normals.clear();
        old.normals.extend(normals.iter().map(unit));
        let corners = &mut self.corners[self.first[mesh]..];
        for (corners, triangle) in corners.iter_mut().zip(&old.indices) {
            *corners = triangle.map(|i| positions[i as usize]);
        }
        self.bvh.refit(&self.corners);
        self.renew_shade(mesh);
        if let Some(rest) = self.rest(mesh) {
            self.open_weave(mesh, rest);
        }
        // Lights stay where they are when a mesh without light moves.
        if self.materials[self.meshes[mesh].material].flags & EMITS != 0 {
            lights::moved(self);
        }
        Ok(())
    }

    /// Whether mesh `mesh` can be moved there.
    ///
    /// # Errors
    /// As [`Self::move_mesh`].
    pub(crate) fn fits(&self, mesh: usize, positions: &[Vec3], normals: &[Vec3]) -> Result<()> {
        let Some(old) = self.meshes.get(mesh) else {
            bail!(
                "the scene has {} meshes and cannot move number {mesh}",
                self.meshes.len()
            );
        };
        ensure!(
            old.positions.len() == positions.len()
                && (normals.is_empty() || normals.len() == positions.len()),
            "mesh \"{}\" has {} vertices and cannot be moved to {} positions with {} normals",
            old.name,
            old.positions.len(),
            positions.len(),
            normals.len()
        );
        ensure!(
            positions.iter().chain(normals).all(|p| p.is_finite()),
            "mesh \"{}\" was moved to a place that is not a number",
            old.name
        );
        Ok(())
    }

    /// Fills all rows but their lights and colours.
    fn fill_shade(&mut self) {
        let (owners, meshes) = (&self.owners, &self.meshes);
        let rows = self.shade.par_iter_mut().zip(&self.bvh.order);
        rows.for_each(|(row, &i)| {
            if i == EMPTY {
                return;
            }
            let (m, t) = owners[i as usize];
            *row = Shade {
                mesh: m,
                triangle: t,
                ..shade_row(&meshes[m as usize], t as usize)
            };
        });
    }

    /// Renews in the rows of a mesh what changes when it moves, from the edges in the ray structure.
    fn renew_shade(&mut self, mesh: usize) {
        let moved = &self.meshes[mesh];
        let rows = self.shade.par_chunks_exact_mut(4).zip(&self.bvh.packets);
        rows.with_min_len(256).for_each(|(rows, packet)| {
            for (lane, row) in rows.iter_mut().enumerate() {
                if row.mesh as usize == mesh && row.material != NONE {
                    let edge = |e: &[Vec4; 3]| Vec3::new(e[0][lane], e[1][lane], e[2][lane]);
                    let corners = moved.indices[row.triangle as usize];
                    let uvs =
                        [0, 1, 2].map(|k| Vec2::new([row.n0, row.n1, row.n2][k][3], row.v[k]));
                    let turned = turned(
                        &moved.normals,
                        corners,
                        edge(&packet.e1),
                        edge(&packet.e2),
                        uvs,
                    );
                    (row.n0, row.n1, row.n2) = (turned.n0, turned.n1, turned.n2);
                    (row.weft, row.v) = (turned.weft, turned.v);
                }
            }
        });
    }

    fn fill_colors(&mut self, scene: &Scene) {
        if scene.colors.is_empty() {
            return;
        }
        let byte = |v: f32| (crate::film::srgb_encode(v.clamp(0.0, 1.0)) * 255.0 + 0.5) as u32;
        let packed = |c: &[f32; 3]| byte(c[0]) | byte(c[1]) << 8 | byte(c[2]) << 16 | 255 << 24;
        let mut lists = vec![None; self.meshes.len()];
        for (mesh, colors) in &scene.colors {
            lists[*mesh] = Some(colors.iter().map(packed).collect::<Vec<_>>());
        }
        for shade in self.shade.iter_mut().filter(|s| s.material != NONE) {
            if let Some(list) = &lists[shade.mesh as usize] {
                let corners = self.meshes[shade.mesh as usize].indices[shade.triangle as usize];
                let [a, b, c] = corners.map(|i| list[i as usize]);
                shade.colors = [a, b, c, 1];
            }
        }
    }

    /// Openness changes from place to place where cloth knows its rest.
    fn fill_openings(&mut self) {
        for mesh in 0..self.meshes.len() {
            if let Some(rest) = self.rest(mesh) {
                self.materials[self.meshes[mesh].material].gap = -1.0;
                self.open_weave(mesh, rest);
            }
        }
    }

    /// [`Mesh::at_rest`] where the weave opens when the cloth is pulled; a measured table's does not.
    fn rest(&self, mesh: usize) -> Option<[f32; 2]> {
        let Mesh {
            at_rest, material, ..
        } = self.meshes[mesh];
        at_rest.filter(|_| self.materials[material].flags & MEASURED == 0)
    }

    /// Renews the factors of the openness in the rows of a mesh.
    fn open_weave(&mut self, mesh: usize, rest: [f32; 2]) {
        let moved = &self.meshes[mesh];
        let openings = stretch::openings(moved, rest, &self.materials[moved.material]);
        let rows = self.shade.par_iter_mut().with_min_len(1024);
        rows.filter(|row| row.mesh as usize == mesh && row.material != NONE)
            .for_each(|row| {
                let corners = moved.indices[row.triangle as usize].map(|i| openings[i as usize]);
                row.colors[3] = row.colors[3] & 1 | stretch::packed(corners);
            });
    }

    fn fill_gaps(&mut self) {
        for (place, shade) in self.shade.iter().enumerate() {
            let gap = if shade.material == NONE {
                0.0
            } else {
                self.materials[shade.material as usize].gap
            };
            self.bvh.packets[place / 4].gap[place % 4] = gap;
        }
    }
}

/// Normals of length 1; 0 stands for one that cannot be had, then the triangle's own is taken.
fn unit(normal: &Vec3) -> Vec3 {
    normal.try_normalize().unwrap_or(Vec3::ZERO)
}

fn with_unit_normals(mesh: &Mesh) -> Mesh {
    Mesh {
        name: mesh.name.clone(),
        positions: mesh.positions.clone(),
        normals: mesh.normals.iter().map(unit).collect(),
        uvs: mesh.uvs.clone(),
        indices: mesh.indices.clone(),
        ..*mesh
    }
}

fn shade_row(mesh: &Mesh, t: usize) -> Shade {
    let corners = mesh.indices[t];
    let [a, b, c] = corners.map(|i| mesh.positions[i as usize]);
    debug_assert!(a.is_finite());
    let uv = |i: u32| mesh.uvs.get(i as usize).copied().unwrap_or(Vec2::ZERO);
    Shade {
        colors: [0; 4],
        material: mesh.material as u32,
        light: NONE,
        mesh: 0,
        triangle: t as u32,
        ..turned(&mesh.normals, corners, b - a, c - a, corners.map(uv))
    }
}

/// Normals, weft and texture coordinates of a triangle with the edges `e1` and `e2` from its first corner.
#[inline(always)]
fn turned(normals: &[Vec3], corners: [u32; 3], e1: Vec3, e2: Vec3, uvs: [Vec2; 3]) -> Shade {
    let cross = e1.cross(e2);
    let flat = || cross.try_normalize().unwrap_or(Vec3::Y);
    let normal = |i: u32| {
        let known = normals.get(i as usize).copied();
        known.filter(|n| *n != Vec3::ZERO).unwrap_or_else(flat)
    };
    let [n0, n1, n2] = corners.map(normal);
    let [t0, t1, t2] = uvs;
    let (d1, d2) = (t1 - t0, t2 - t0);
    let det = d1.x * d2.y - d1.y * d2.x;
    // dp/du from the texture coordinates; without them the weft runs horizontally.
    let weft = ((e1 * d2.y - e2 * d1.y) * det.signum())
        .try_normalize()
        .filter(|_| det.abs() > 1e-20)
        .or_else(|| Vec3::Y.cross(flat()).try_normalize())
        .unwrap_or(Vec3::X);
    Shade {
        n0: n0.extend(t0.x).into(),
        n1: n1.extend(t1.x).into(),
        n2: n2.extend(t2.x).into(),
        // With v running down in the picture, a picture seen the right way round has a negative determinant.
        weft: weft.extend(if det > 0.0 { -1.0 } else { 1.0 }).into(),
        v: [t0.y, t1.y, t2.y, det.abs() / cross.length().max(1e-20)],
        ..Shade::default()
    }
}

#[cfg(test)]
mod tests;
