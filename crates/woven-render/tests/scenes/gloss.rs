//! A texture of roughness and metalness is, at each place, the material of these numbers.
//!
//! Seen to fail: with the green channel not squared 1,016 of 1,152 pixels differ.

use crate::common::{backends, furnace, picture, sheet};
use glam::Vec3;
use woven_render::render::Settings;
use woven_render::scene::{Camera, Light, Material, Scene, Texture, TextureUse};

/// Shape of an opaque gloss with this width and reflectance at normal incidence.
fn shape(width: f32, f0: f32) -> [f32; 16] {
    let mut s = [0.0; 16];
    s[0] = 1.0;
    s[3..7].fill(f64::from(width));
    s[7] = f64::from(f0);
    use woven_bsdf::model::Model;
    woven_bsdf::sheet::Sheet::derive(&mut s);
    s.map(|x| x as f32)
}

const BASE: [f32; 3] = [0.8, 0.5, 0.2];
const F0: f32 = 0.04;

/// Lacquer of width 0.64 at most.
fn lacquer(width: f32) -> Material {
    let mut m = Material::matt("lacquer", BASE);
    m.shape = shape(width, F0);
    m.linear[3] = [1.0; 3];
    m.plain_gloss = true;
    m
}

fn metal(width: f32) -> Material {
    let mut m = Material::matt("metal", [0.0; 3]);
    m.shape = shape(width, 1.0);
    m.linear[3] = BASE;
    m
}

fn scene(material: Material, textures: Vec<Texture>) -> Scene {
    Scene {
        materials: vec![material],
        meshes: vec![sheet(0)],
        textures,
        lights: vec![Light::Point {
            position: Vec3::new(0.5, 0.3, 1.5),
            intensity: [4.0; 3],
            layer: 2,
        }],
        environment: Some(furnace()),
        camera: Camera::look_at(Vec3::new(0.2, -0.9, 2.5), Vec3::ZERO, Vec3::Y, 0.8),
        ..Scene::default()
    }
}

#[test]
fn each_place_has_its_own_gloss() {
    // Rough lacquer and smoother metal, one texel each; the mesh sees the middle of one of them.
    let texture = Texture {
        name: "gloss".into(),
        width: 2,
        height: 1,
        pixels: vec![[9, 255, 0, 255], [200, 128, 255, 255]],
        ..Texture::default()
    };
    let mut both = lacquer(0.64);
    both.metal = [BASE[0], BASE[1], BASE[2], 1.0];
    let s = Settings {
        width: 48,
        height: 24,
        spp: 16,
        depth: 2,
        ..Settings::default()
    };
    let green = (128.0_f32 / 255.0).powi(2);
    for backend in backends() {
        for (u, like) in [(0.25, lacquer(0.64)), (0.75, metal(0.64 * green))] {
            let mut m = both.clone();
            m.gloss_texture = Some(TextureUse {
                texture: 0,
                transform: [[0.0, 0.0, u], [0.0, 0.0, 0.5]],
            });
            let got = picture(&scene(m, vec![texture.clone()]), &s, backend);
            let want = picture(&scene(like, Vec::new()), &s, backend);
            let pairs = got.beauty().unwrap().iter().zip(want.beauty().unwrap());
            let far = pairs
                .filter(|(a, b)| {
                    (0..3).any(|c| (a[c] - b[c]).abs() > 2e-3 * (a[c].max(b[c]) + 0.01))
                })
                .count();
            // The same random numbers: only roundings differ, and a coin now and then.
            assert!(
                far <= 12,
                "{backend:?}, {u}: {far} of {} pixels",
                s.width * s.height
            );
        }
    }
}
