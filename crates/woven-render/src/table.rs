//! The scene as the transport reads it: flat arrays of rows, the same on CPU and GPU.
//!
//! Layouts are `repr(C)` with the alignment of WGSL's storage buffers; `tests/parity_layout.rs` compares them with
//! the offsets that naga computes from the shader's structs.

mod lights;
mod mips;
mod sky;

use anyhow::{Result, bail, ensure};
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::bvh::{Bvh, Corners, EMPTY, STACK};
use crate::optics;
use crate::scene::{
    Camera, LAYERS, MAX_LINEAR, MAX_SHAPE, Material, Mesh, Scene, Texture, TextureUse, Wrap,
};

/// No light, no texture.
pub const NONE: u32 = u32::MAX;

/// What shading needs of one triangle; row `i` belongs to place `i` of [`Bvh::order`].
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct Shade {
    /// Shading normal of the first corner, then its u.
    pub n0: [f32; 4],
    /// Of the second corner.
    pub n1: [f32; 4],
    /// Of the third corner.
    pub n2: [f32; 4],
    /// Direction of the weft (dp/du), then -1 where the texture is mirrored, else 1.
    pub weft: [f32; 4],
    /// v of the three corners, then the area of the triangle in (u, v) over its area in metres.
    pub v: [f32; 4],
    /// Colours of the corners, sRGB of 8 bits, red lowest; then 1 where there are any.
    pub colors: [u32; 4],
    /// Row of the material.
    pub material: u32,
    /// Row of the light that this triangle is (part of), or [`NONE`].
    pub light: u32,
    /// Number of the mesh.
    pub mesh: u32,
    /// Number of the triangle in its mesh.
    pub triangle: u32,
}

/// A material ready for use.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct MaterialRow {
    /// Linear factors, RGB and nothing.
    pub linear: [[f32; 4]; MAX_LINEAR],
    /// Shape numbers.
    pub shape: [f32; MAX_SHAPE],
    /// Sampling weights of the linear factors.
    pub weights: [f32; MAX_LINEAR],
    /// Radiance, then the luminance of the sum of the linear factors.
    pub emission: [f32; 4],
    /// See the constants of this file.
    pub flags: u32,
    /// Light layer of the emission.
    pub layer: u32,
    /// Row of the colour texture or [`NONE`].
    pub color_texture: u32,
    /// Row of the coverage texture or [`NONE`].
    pub coverage_texture: u32,
    /// Row of the emission's texture or [`NONE`].
    pub emission_texture: u32,
    /// Alpha below it is a hole; negative: alpha is coverage.
    pub alpha_cutoff: f32,
    /// Gap that is the same everywhere and in every direction, or negative.
    pub gap: f32,
    /// Cover by yarn in every direction, where [`EVEN`].
    pub cover: f32,
    /// Row of the texture that bends the normal or [`NONE`].
    pub normal_texture: u32,
    /// Multiplies its first two numbers.
    pub normal_scale: f32,
    /// Nothing.
    pub unused: [u32; 2],
}

/// [`MaterialRow::flags`]: no lobes, diffuse terms only.
pub const MATT: u32 = 1;
/// [`MaterialRow::flags`]: emits on both sides.
pub const DOUBLE_SIDED: u32 = 2;
/// [`MaterialRow::flags`]: some light passes through (transmission, not the gap).
pub const TRANSMITS: u32 = 4;
/// [`MaterialRow::flags`]: emits.
pub const EMITS: u32 = 8;
/// [`MaterialRow::flags`]: the same cover in every direction.
pub const EVEN: u32 = 16;
/// [`MaterialRow::flags`]: textures do not colour the reflection lobe.
pub const PLAIN_GLOSS: u32 = 32;

/// A texture and how to reach it.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct TextureRow {
    /// First row of the affine map of (u, v, 1), then texels a square of side 1 in (u, v).
    pub map_u: [f32; 4],
    /// Second row, then the number of smaller copies after the picture, each of half the side, down to one texel.
    pub map_v: [f32; 4],
    /// First texel; the smaller copies follow.
    pub first: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Bits 0-1 wrap of u (0 repeat, 1 mirror, 2 clamp), bits 2-3 of v, bit 4 sRGB.
    pub flags: u32,
}

/// [`LightRow::kind`]: a rectangle.
pub const RECT: u32 = 0;
/// [`LightRow::kind`]: a triangle.
pub const TRIANGLE: u32 = 1;
/// [`LightRow::kind`]: a disc at infinity.
pub const SUN: u32 = 2;
/// [`LightRow::kind`]: a point.
pub const POINT: u32 = 3;
/// [`LightRow::kind`]: a cone from a point.
pub const SPOT: u32 = 4;
/// [`LightRow::kind`]: the environment.
pub const SKY: u32 = 5;
/// [`LightRow::kind`]: a window; these rows come after the lights.
pub const PORTAL: u32 = 6;

/// A light (or a window).
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct LightRow {
    /// Corner, or place of a point.
    pub p: [f32; 3],
    /// Which of the kinds above.
    pub kind: u32,
    /// First edge; sun: cos and sin of the angular radius.
    pub u: [f32; 3],
    /// Light layer.
    pub layer: u32,
    /// Second edge; spot: cos of the inner and outer angle.
    pub v: [f32; 3],
    /// A triangle of it, for its texture, or [`NONE`].
    pub place: u32,
    /// Unit normal of the front; sun: direction to it; spot: its axis.
    pub n: [f32; 3],
    /// Area \[m²\]; for a rectangle that is not one (a parallelogram) negative.
    pub area: f32,
    /// Radiance; sun: irradiance; point and spot: intensity.
    pub radiance: [f32; 3],
    /// Share of the choice when lights are chosen by power, summed up to and including this row.
    pub cumulative: f32,
}

/// Numbers of the scene that are not rows.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct Globals {
    /// Multiplies the environment's pixels, then its mean luminance.
    pub sky_scale: [f32; 4],
    /// Rows of lights.
    pub lights: u32,
    /// Rows of portals, after the lights.
    pub portals: u32,
    /// Columns of the environment, 0 without one.
    pub sky_width: u32,
    /// Rows of the environment.
    pub sky_height: u32,
    /// cos and sin of the environment's rotation.
    pub sky_turn: [f32; 2],
    /// Share of environment samples through the portals, the rest by the picture.
    pub portal_share: f32,
    /// Row of the environment among the lights, or [`NONE`].
    pub sky_light: u32,
    /// Layer of the environment.
    pub sky_layer: u32,
    /// Some light is sampled so that scattering must meet it too (triangles, see `cpu/light.rs`).
    pub soft_lights: u32,
    /// Scale of the offset that keeps a ray off the surface it leaves [m].
    pub offset: f32,
    /// 4, the taps of a bilinear texture: a loop bound that shader compilers do not know.
    pub taps: u32,
    /// First light that is no surface: suns are looked for from there.
    pub others: u32,
    /// Nothing.
    pub spare: [u32; 3],
}

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
    /// RGBA, 8 bits each, red lowest.
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
        check(scene)?;
        let mut textures = Textures::default();
        let materials: Vec<MaterialRow> = scene
            .materials
            .iter()
            .map(|m| material_row(m, &mut textures, scene, light_layers))
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
            meshes: scene.meshes.clone(),
            corners,
            owners,
            first,
        };
        table.fill_shade(None);
        table.fill_colors(scene);
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
        let Some(old) = self.meshes.get_mut(mesh) else {
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
        old.positions.copy_from_slice(positions);
        old.normals = normals.to_vec();
        for (t, triangle) in old.indices.iter().enumerate() {
            self.corners[self.first[mesh] + t] = triangle.map(|i| positions[i as usize]);
        }
        self.bvh.refit(&self.corners);
        self.fill_shade(Some(mesh));
        lights::moved(self);
        Ok(())
    }

    /// Fills the rows of one mesh, or all.
    fn fill_shade(&mut self, only: Option<usize>) {
        let (owners, meshes) = (&self.owners, &self.meshes);
        let rows = self.shade.par_iter_mut().zip(&self.bvh.order);
        rows.for_each(|(row, &i)| {
            if i == EMPTY {
                return;
            }
            let (m, t) = owners[i as usize];
            if only.is_none_or(|o| o == m as usize) {
                *row = Shade {
                    light: row.light,
                    colors: row.colors,
                    mesh: m,
                    triangle: t,
                    ..shade_row(&meshes[m as usize], t as usize)
                };
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

fn shade_row(mesh: &Mesh, t: usize) -> Shade {
    let [a, b, c] = mesh.indices[t].map(|i| i as usize);
    let (p0, e1, e2) = (
        mesh.positions[a],
        mesh.positions[b] - mesh.positions[a],
        mesh.positions[c] - mesh.positions[a],
    );
    let flat = e1.cross(e2).try_normalize().unwrap_or(Vec3::Y);
    debug_assert!(p0.is_finite());
    let normal = |i: usize| {
        mesh.normals
            .get(i)
            .and_then(|n| n.try_normalize())
            .unwrap_or(flat)
    };
    let uv = |i: usize| mesh.uvs.get(i).copied().unwrap_or(Vec2::ZERO);
    let (n0, n1, n2) = (normal(a), normal(b), normal(c));
    let (t0, t1, t2) = (uv(a), uv(b), uv(c));
    let (d1, d2) = (t1 - t0, t2 - t0);
    let det = d1.x * d2.y - d1.y * d2.x;
    // dp/du from the texture coordinates; without them the weft runs horizontally.
    let weft = ((e1 * d2.y - e2 * d1.y) * det.signum())
        .try_normalize()
        .filter(|_| det.abs() > 1e-20)
        .or_else(|| Vec3::Y.cross(flat).try_normalize())
        .unwrap_or(Vec3::X);
    Shade {
        n0: n0.extend(t0.x).into(),
        n1: n1.extend(t1.x).into(),
        n2: n2.extend(t2.x).into(),
        // With v running down in the picture, a picture seen the right way round has a negative determinant.
        weft: weft.extend(if det > 0.0 { -1.0 } else { 1.0 }).into(),
        v: [
            t0.y,
            t1.y,
            t2.y,
            det.abs() / e1.cross(e2).length().max(1e-20),
        ],
        colors: [0; 4],
        material: mesh.material as u32,
        light: NONE,
        mesh: 0,
        triangle: t as u32,
    }
}

fn material_row(
    m: &Material,
    textures: &mut Textures,
    scene: &Scene,
    light_layers: bool,
) -> MaterialRow {
    let sum = |c: usize| m.linear.iter().map(|k| k[c]).sum::<f32>();
    let albedo = crate::cpu::math::luminance(Vec3::new(sum(0), sum(1), sum(2)));
    let black = |j: usize| m.linear[j].iter().all(|&k| k <= 0.0);
    let even = m.shape[2] == 0.0 || (m.shape[0] == 0.0 && m.shape[1] == 0.0);
    let mut flags = 0;
    let mut set = |on: bool, flag: u32| flags |= if on { flag } else { 0 };
    set(black(1) && black(3), MATT);
    set(m.double_sided, DOUBLE_SIDED);
    set(!black(0) || !black(1), TRANSMITS);
    set(m.emission.iter().any(|&e| e > 0.0), EMITS);
    set(even, EVEN);
    set(m.plain_gloss, PLAIN_GLOSS);
    MaterialRow {
        linear: m.linear.map(|k| [k[0], k[1], k[2], 0.0]),
        shape: m.shape,
        weights: optics::weights(&m.linear, &m.shape),
        emission: [m.emission[0], m.emission[1], m.emission[2], albedo],
        flags,
        layer: if light_layers {
            m.layer.min(LAYERS as u32 - 1)
        } else {
            0
        },
        color_texture: textures.row(m.color_texture, scene),
        coverage_texture: textures.row(m.coverage_texture, scene),
        emission_texture: textures.row(m.emission_texture, scene),
        alpha_cutoff: m.alpha_cutoff.unwrap_or(-1.0),
        gap: if even && m.coverage_texture.is_none() {
            optics::openness(&m.shape, Vec3::Z).clamp(0.0, 1.0)
        } else {
            -1.0
        },
        cover: 1.0 - optics::openness(&m.shape, Vec3::Z).clamp(0.0, 1.0),
        normal_texture: textures.row(m.normal_texture, scene),
        normal_scale: m.normal_scale,
        unused: [0; 2],
    }
}

/// Textures are copied once each, however often they are used.
#[derive(Default)]
struct Textures {
    rows: Vec<TextureRow>,
    texels: Vec<u32>,
    /// (number in the scene, first texel, smaller copies)
    there: Vec<(usize, u32, u32)>,
}

impl Textures {
    fn row(&mut self, used: Option<TextureUse>, scene: &Scene) -> u32 {
        let Some(used) = used else { return NONE };
        let texture = &scene.textures[used.texture];
        let (first, copies) = match self.there.iter().find(|t| t.0 == used.texture) {
            Some(&(_, first, copies)) => (first, copies),
            None => {
                let first = self.texels.len() as u32;
                let copies = mips::append(texture, &mut self.texels);
                self.there.push((used.texture, first, copies));
                (first, copies)
            }
        };
        let wrap = |w: Wrap| match w {
            Wrap::Repeat => 0,
            Wrap::Mirror => 1,
            Wrap::Clamp => 2,
        };
        let [[a, b, c], [d, e, f]] = used.transform;
        let density = (a * e - b * d).abs() * texture.width as f32 * texture.height as f32;
        self.rows.push(TextureRow {
            map_u: [a, b, c, density],
            map_v: [d, e, f, copies as f32],
            first,
            width: texture.width,
            height: texture.height,
            flags: wrap(texture.wrap_u) | wrap(texture.wrap_v) << 2 | u32::from(texture.srgb) << 4,
        });
        self.rows.len() as u32 - 1
    }
}

/// Everything that is named is there, every number is finite.
fn check(scene: &Scene) -> Result<()> {
    for mesh in &scene.meshes {
        let n = mesh.positions.len();
        let name = &mesh.name;
        ensure!(
            mesh.material < scene.materials.len(),
            "mesh \"{name}\" names material {}, but the scene has {}",
            mesh.material,
            scene.materials.len()
        );
        ensure!(
            mesh.indices.iter().flatten().all(|&i| (i as usize) < n),
            "mesh \"{name}\" names a vertex beyond its {n}"
        );
        ensure!(
            (mesh.normals.is_empty() || mesh.normals.len() == n)
                && (mesh.uvs.is_empty() || mesh.uvs.len() == n),
            "mesh \"{name}\" has {n} positions, {} normals and {} texture coordinates; the numbers must agree",
            mesh.normals.len(),
            mesh.uvs.len()
        );
        let finite = mesh
            .positions
            .iter()
            .chain(&mesh.normals)
            .all(|p| p.is_finite() && p.abs().max_element() < 1e9)
            && mesh.uvs.iter().all(|t| t.is_finite());
        ensure!(
            finite,
            "mesh \"{name}\" has a coordinate that is not a number or beyond 1e9 m"
        );
    }
    for m in &scene.materials {
        let finite = m
            .linear
            .iter()
            .flatten()
            .chain(&m.shape)
            .chain(&m.emission)
            .all(|x| x.is_finite());
        let positive = m
            .linear
            .iter()
            .flatten()
            .chain(&m.emission)
            .all(|&x| x >= 0.0);
        ensure!(
            finite && positive,
            "material \"{}\" has a factor that is negative or not a number",
            m.name
        );
        for used in [
            m.color_texture,
            m.coverage_texture,
            m.emission_texture,
            m.normal_texture,
        ]
        .into_iter()
        .flatten()
        {
            ensure!(
                used.texture < scene.textures.len(),
                "material \"{}\" names texture {}, but the scene has {}",
                m.name,
                used.texture,
                scene.textures.len()
            );
        }
    }
    for (mesh, colors) in &scene.colors {
        ensure!(
            scene
                .meshes
                .get(*mesh)
                .is_some_and(|m| m.positions.len() == colors.len())
                && colors.iter().flatten().all(|c| c.is_finite()),
            "there are colours of vertices for mesh {mesh}, which is not there or has another number of vertices"
        );
    }
    let whole = |t: &Texture| {
        t.width > 0 && t.height > 0 && t.pixels.len() == t.width as usize * t.height as usize
    };
    if let Some(t) = scene.textures.iter().find(|t| !whole(t)) {
        bail!(
            "texture \"{}\" says {} x {} but has {} pixels",
            t.name,
            t.width,
            t.height,
            t.pixels.len()
        );
    }
    if let Some(e) = &scene.environment {
        ensure!(
            e.width > 0 && e.height > 0 && e.pixels.len() == e.width as usize * e.height as usize,
            "the environment says {} x {} but has {} pixels",
            e.width,
            e.height,
            e.pixels.len()
        );
        ensure!(
            e.pixels
                .iter()
                .flatten()
                .all(|&x| x.is_finite() && x >= 0.0)
                && e.scale.iter().all(|&x| x >= 0.0),
            "the environment has a pixel that is negative or not a number"
        );
    }
    let c = &scene.camera;
    ensure!(
        c.transform.is_finite() && c.vfov > 1e-4 && c.vfov < 3.1 && c.aperture_radius >= 0.0,
        "the camera's matrix must be finite and its vertical angle between 0.0001 and 3.1 rad; it is {}",
        c.vfov
    );
    Ok(())
}
