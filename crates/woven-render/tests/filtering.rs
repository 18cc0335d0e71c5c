//! Textures seen from far away: no moiré at few samples, and the mean that many samples find.

mod common;

use common::{backends, mean, picture, quad};
use glam::Vec3;
use woven_render::film::Film;
use woven_render::render::Settings;
use woven_render::scene::{Camera, LAYER_SUN, Light, Material, Scene, Texture, TextureUse};

/// A fine weave of black and white threads, forty repeats of 16 pixels, on a wall that a sun lights evenly.
fn scene(shift: f32) -> Scene {
    let thread = |x: u32, y: u32| {
        if (x / 4 + y / 4).is_multiple_of(2) {
            [240, 230, 210, 255]
        } else {
            [20, 20, 30, 255]
        }
    };
    let mut wall = Material::matt("weave", [1.0; 3]);
    wall.color_texture = Some(TextureUse {
        texture: 0,
        transform: [[40.0, 0.0, shift], [0.0, 40.0, 0.0]],
    });
    Scene {
        meshes: vec![quad(
            "wall",
            Vec3::new(-1.0, -1.0, 0.0),
            Vec3::X * 2.0,
            Vec3::Y * 2.0,
            0,
        )],
        materials: vec![wall],
        textures: vec![Texture {
            name: "weave".into(),
            width: 16,
            height: 16,
            pixels: (0..256).map(|i| thread(i % 16, i / 16)).collect(),
            srgb: true,
            ..Texture::default()
        }],
        lights: vec![Light::Sun {
            direction: Vec3::Z,
            irradiance: [3.0; 3],
            angular_radius: 0.0,
            layer: LAYER_SUN,
        }],
        camera: Camera::look_at(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, Vec3::Y, 0.3),
        ..Scene::default()
    }
}

fn scatter(film: &Film) -> f64 {
    let m = mean(film)[1];
    let pixels = film.beauty().expect("a picture");
    let sum: f64 = pixels
        .iter()
        .map(|p| (f64::from(p[1]) / m - 1.0).powi(2))
        .sum();
    (sum / pixels.len() as f64).sqrt()
}

#[test]
fn a_fine_weave_far_away_is_even_and_keeps_its_mean() {
    for backend in backends() {
        // A pixel holds four squares of the pattern a side: one sample without filtering is black or white.
        let settings = |spp| Settings {
            width: 32,
            height: 24,
            spp,
            ..Settings::default()
        };
        let one = picture(&scene(0.0), &settings(1), backend);
        let many = picture(&scene(0.0), &settings(256), backend);
        let (a, b) = (mean(&one)[1], mean(&many)[1]);
        // Half of the light of the two threads, whatever the number of samples.
        let threads = [230.0_f64, 20.0].map(|v| ((v / 255.0 + 0.055) / 1.055).powf(2.4));
        let want = (threads[0] + threads[1]) * 0.5 * 3.0 / std::f64::consts::PI;
        assert!(
            (b / want - 1.0).abs() < 0.01,
            "{backend:?}: {b} instead of {want}"
        );
        assert!(
            (a / b - 1.0).abs() < 0.02,
            "{backend:?}: {a} at one sample, {b} at 256"
        );
        // Unfiltered, one sample scatters by 0.98 (two values, equally often); with the copies by a quarter of that or less.
        let noise = scatter(&one);
        assert!(noise < 0.25, "{backend:?}: scatter {noise}");
        // The pattern moved by a third of a repeat, as from frame to frame: pixels stay as they were.
        let moved = picture(&scene(0.33), &settings(1), backend);
        let pairs = one.beauty().unwrap().iter().zip(moved.beauty().unwrap());
        let change = pairs
            .map(|(p, q)| f64::from((p[1] - q[1]).abs()))
            .sum::<f64>()
            / (32.0 * 24.0)
            / b;
        assert!(change < 0.25, "{backend:?}: {change}");
        eprintln!(
            "{backend:?}: mean {a:.4} and {b:.4}, scatter {noise:.3}, change between frames {change:.3}"
        );
    }
}
