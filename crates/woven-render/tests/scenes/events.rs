//! Light kept apart by what happened at the first sheet in view: scattered back, scattered through, let pass, given off.
//!
//! Seen to fail: with reflected and transmitted exchanged in the shader, and on the CPU with every crossing taken for the first.

use crate::common::{backends, curtain_room, even_lace, furnace, picture, sheet};
use glam::Vec3;
use woven_render::film::Film;
use woven_render::render::{Backend, Renderer, Settings};
use woven_render::scene::{Camera, EVENT_NAMES, Light, Material, Scene};

fn settings(spp: u32) -> Settings {
    Settings {
        width: 24,
        height: 16,
        spp,
        depth: 4,
        event_layers: true,
        ..Settings::default()
    }
}

/// Means of the four layers, after a look whether they sum to the picture.
fn layers(film: &Film) -> [f64; 4] {
    let beauty = film.beauty().unwrap();
    let all = EVENT_NAMES.map(|n| film.layer(&format!("light.{n}")).unwrap());
    for (i, p) in beauty.iter().enumerate() {
        let sum: f32 = all.iter().map(|l| l[i][1]).sum();
        assert!(
            (sum - p[1]).abs() <= 1e-5 * (1.0 + p[1]),
            "pixel {i}: {sum} {p:?}"
        );
    }
    all.map(|l| l.iter().map(|p| f64::from(p[1])).sum::<f64>() / l.len() as f64)
}

/// A camera that sees nothing but the sheet.
fn before(material: Material) -> Scene {
    Scene {
        materials: vec![material],
        meshes: vec![sheet(0)],
        camera: Camera::look_at(Vec3::new(0.3, 0.2, 3.0), Vec3::ZERO, Vec3::Y, 0.3),
        ..Scene::default()
    }
}

#[test]
fn a_sheet_in_an_even_light_shows_its_reflectance_transmittance_and_gap() {
    let cloth = Material::diffuse_sheet("cloth", [0.5; 3], [0.2; 3], 0.3);
    let scene = Scene {
        environment: Some(furnace()),
        ..before(cloth)
    };
    for backend in backends() {
        let got = layers(&picture(&scene, &settings(64), backend));
        eprintln!("{backend:?}: {got:?}");
        let want = [0.7 * 0.5, 0.7 * 0.2, 0.3, 0.0];
        for k in 0..4 {
            // Sampling of the even sky by its picture leaves some 1e-3.
            assert!(
                (got[k] - want[k]).abs() < 5e-3,
                "{backend:?}: {got:?} {want:?}"
            );
        }
    }
}

#[test]
fn a_lamp_before_is_reflected_one_behind_transmitted_and_one_in_view_emitted() {
    let cloth = Material::diffuse_sheet("cloth", [0.5; 3], [0.3; 3], 0.0);
    for backend in backends() {
        for (z, layer) in [(2.0, 0), (-2.0, 1)] {
            let scene = Scene {
                lights: vec![Light::Point {
                    position: Vec3::Z * z,
                    intensity: [5.0; 3],
                    layer: 2,
                }],
                ..before(cloth.clone())
            };
            let got = layers(&picture(&scene, &settings(4), backend));
            for (k, &x) in got.iter().enumerate() {
                assert!((x > 0.01) == (k == layer), "{backend:?} {z}: {got:?}");
            }
        }
        let scene = before(Material::lamp("lamp", [2.0; 3], true));
        let got = layers(&picture(&scene, &settings(1), backend));
        assert!(
            (got[3] - 2.0).abs() < 1e-5 && got[..3] == [0.0; 3],
            "{backend:?}: {got:?}"
        );
    }
}

#[test]
fn a_curtain_is_taken_apart_alike_and_the_picture_does_not_change() {
    let scene = curtain_room(even_lace(), 40);
    let usual = Settings {
        event_layers: false,
        ..settings(8)
    };
    let mut means = Vec::new();
    for backend in backends() {
        let film = picture(&scene, &settings(8), backend);
        let got = layers(&film);
        eprintln!("{backend:?}: {got:?}");
        // A window behind a curtain, walls beside it: all but lamps in view.
        assert!(got[0] > 0.01 && got[1] > 0.01 && got[2] > 0.01, "{got:?}");
        means.push(got);
        // Only the order of the sums changes.
        let whole = picture(&scene, &usual, backend);
        let pairs = film.beauty().unwrap().iter().zip(whole.beauty().unwrap());
        for (a, b) in pairs {
            assert!(
                (a[1] - b[1]).abs() <= 1e-5 * (1.0 + b[1]),
                "{backend:?}: {a:?} {b:?}"
            );
        }
    }
    for gpu in &means[1..] {
        for k in 0..3 {
            // Strays of the two roundings, as in tests/parity.rs.
            assert!((gpu[k] / means[0][k] - 1.0).abs() < 1e-3, "{means:?}");
        }
    }
}

#[test]
fn lamps_and_events_at_once_are_a_sentence() {
    let both = Settings {
        light_layers: true,
        ..settings(1)
    };
    let said = Renderer::new(&Scene::default(), &both, Backend::Cpu)
        .err()
        .unwrap();
    assert!(said.to_string().contains("not by both"), "{said}");
}
