//! A mesh that was moved against one that was there from the start.

use glam::{Vec2, Vec3};

use super::Table;
use crate::bvh::EMPTY;
use crate::rng::Rng;
use crate::scene::{Material, Mesh, Scene};

/// Triangles strewn about; some normals are missing, some too long, some texture coordinates fall together.
fn mesh(seed: u32, normals: bool) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..300 {
        let mut rng = Rng::new(i, 1, 0, seed);
        let mut point = || Vec3::new(rng.coin(), rng.coin(), rng.coin()) * 2.0 - 1.0;
        for k in 0..3 {
            mesh.positions.push(point());
            let there = i % 7 != k;
            mesh.normals.push(if there { point() } else { Vec3::ZERO });
            // The same at every seed.
            let uv = Rng::new(i, k, 0, 5).set(0);
            mesh.uvs.push(Vec2::new(uv[0], uv[1]) * (i % 11) as f32);
        }
        mesh.indices.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    if !normals {
        mesh.normals.clear();
    }
    mesh
}

fn table(seed: u32, normals: bool) -> Table {
    let still = mesh(9, true);
    let scene = Scene {
        meshes: vec![still, mesh(seed, normals)],
        materials: vec![Material::default()],
        ..Scene::default()
    };
    Table::new(&scene, false).expect("the scene is sound")
}

/// The rows by mesh and triangle, with the corners and edges of their places.
fn rows(table: &Table) -> Vec<(u32, u32, Vec<u32>)> {
    let mut rows = Vec::new();
    for (place, shade) in table.shade.iter().enumerate() {
        if table.bvh.order[place] == EMPTY {
            continue;
        }
        let packet = &table.bvh.packets[place / 4];
        let of = packet.v0.iter().chain(&packet.e1).chain(&packet.e2);
        let numbers = of.map(|v| v[place % 4].to_bits());
        let shade_words: &[u32] = bytemuck::cast_slice(bytemuck::bytes_of(shade));
        let words = numbers.chain(shade_words.iter().copied()).collect();
        rows.push((shade.mesh, shade.triangle, words));
    }
    rows.sort();
    rows
}

#[test]
fn a_moved_mesh_is_as_if_it_had_been_there() {
    for normals in [true, false] {
        let there = table(2, normals);
        let mut moved = table(1, normals);
        let to = mesh(2, normals);
        moved.move_mesh(1, &to.positions, &to.normals).unwrap();
        assert_eq!(rows(&moved), rows(&there));
        let before = table(1, normals);
        assert_ne!(rows(&moved), rows(&before));
        // The boxes around them too.
        assert_eq!(moved.bvh.bounds(), there.bvh.bounds());
    }
}
