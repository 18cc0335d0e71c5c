//! A beam against its rays one by one.

use super::*;
use crate::cpu::bvh::{FAR, nearest, transmittance_exact};
use crate::rng::Rng;
use crate::scene::{Material, Mesh, Scene};

/// Triangles strewn about, each of one of four materials: opaque, two even gaps, one that asks for the direction.
fn strewn(count: u32) -> Table {
    let sheet = |shape: [f32; 3]| {
        let mut m = Material::default();
        m.shape[..3].copy_from_slice(&shape);
        m
    };
    let mut scene = Scene {
        materials: vec![
            Material::default(),
            sheet([0.9, 0.0, 0.0]),
            sheet([0.4, 0.0, 0.0]),
            sheet([0.7, 0.6, 0.5]),
        ],
        ..Scene::default()
    };
    for material in 0..4 {
        let mut mesh = Mesh {
            material,
            ..Mesh::default()
        };
        for i in 0..count {
            let mut rng = Rng::new(i, material as u32, 0, 3);
            let mut point =
                |size: f32| Vec3::new(rng.coin() - 0.5, rng.coin() - 0.5, rng.coin() - 0.5) * size;
            let middle = point(2.0);
            let n = mesh.positions.len() as u32;
            for _ in 0..3 {
                mesh.positions.push(middle + point(0.3));
            }
            mesh.indices.push([n, n + 1, n + 2]);
        }
        scene.meshes.push(mesh);
    }
    Table::new(&scene, false).expect("the scene is sound")
}

/// Rays from about one place towards about another; `wide` 0 is a pencil, 1 every way.
fn rays(count: u32, seed: u32, wide: f32) -> Vec<Ray> {
    let mut rng = Rng::new(7, 9, seed, 1);
    let mut point =
        |size: f32| Vec3::new(rng.coin() - 0.5, rng.coin() - 0.5, rng.coin() - 0.5) * size;
    let (from, to) = (point(3.0), point(1.0));
    (0..count)
        .map(|_| {
            let o = from + point(wide);
            Ray::new(o, (to + point(2.0 * wide) - o).normalize())
        })
        .collect()
}

#[test]
fn a_beam_sees_what_each_of_its_rays_sees_alone() {
    let table = strewn(200);
    let (mut hits, mut partly) = (0, 0);
    let mut beam = Beam::new();
    for seed in 0..60 {
        let count = 1 + seed * 37 % MOST as u32;
        let rays = rays(count, seed, [0.01, 0.3, 2.0][seed as usize % 3]);
        let begin = 0.2 * (seed % 4) as f32;
        beam.clear();
        for ray in &rays {
            beam.add(ray, begin, FAR);
        }
        beam.nearest(&table);
        for (n, ray) in rays.iter().enumerate() {
            let alone = nearest(&table, ray, begin, FAR).map(|h| (h.t, h.place, h.u, h.v));
            assert_eq!(beam.hit(n).map(|h| (h.t, h.place, h.u, h.v)), alone);
            hits += u32::from(alone.is_some());
        }
        beam.clear();
        for ray in &rays {
            beam.add(ray, 0.0, 2.5);
        }
        beam.pass(&table);
        for (n, ray) in rays.iter().enumerate() {
            let alone = transmittance_exact(&table, ray, 2.5);
            assert_eq!(
                beam.passed(n).to_bits(),
                alone.to_bits(),
                "ray {n} of {seed}"
            );
            partly += u32::from(alone > 0.0 && alone < 1.0);
        }
    }
    // The rays do meet things, and some get through.
    assert!(hits > 500 && partly > 100, "{hits} {partly}");
}
