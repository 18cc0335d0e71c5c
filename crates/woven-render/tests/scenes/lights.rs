//! Many lights: the tree of clusters finds those that matter, without bias and nearly as well as weighing each.
//!
//! Seen to fail: with both halves of a cluster taken at even odds the noise of 400 panels is 7.2 times that of 9.

use crate::common::{backends, curtain_room, cut_panel, even_lace, mean, picture};
use woven_render::film::Film;
use woven_render::render::{Backend, Settings};
use woven_render::scene::Scene;

fn room(count: usize, fill: f32) -> Scene {
    let mut scene = curtain_room(even_lace(), 40);
    cut_panel(&mut scene, count, fill);
    scene
}

const SMALL: Settings = Settings {
    width: 32,
    height: 24,
    spp: 16,
    depth: 3,
    seed: 1,
    integrator: woven_render::render::Integrator::Path,
    light_layers: false,
    event_layers: false,
    aov: false,
    time_limit: None,
    noise: None,
};

/// relMSE of one of two pictures.
fn noise(a: &Film, b: &Film) -> f64 {
    let pixels = |f: &Film| f.beauty().unwrap().concat();
    let (a, b) = (pixels(a), pixels(b));
    let error = |(a, b): (&f32, &f32)| {
        let m = f64::from(a + b) * 0.5;
        f64::from(a - b).powi(2) / 2.0 / (m * m + 0.01)
    };
    a.iter().zip(&b).map(error).sum::<f64>() / a.len() as f64
}

#[test]
fn a_panel_cut_into_pieces_gives_the_same_light() {
    for backend in backends() {
        let whole = mean(&picture(&room(1, 1.0), &SMALL, backend));
        let cut = mean(&picture(&room(49, 1.0), &SMALL, backend));
        eprintln!("{backend:?}: whole {whole:?}, cut {cut:?}");
        for c in 0..3 {
            // The noise of a mean of 12,288 samples is some 1e-3 here.
            assert!((cut[c] / whole[c] - 1.0).abs() < 5e-3, "{backend:?}");
        }
    }
}

#[test]
fn the_noise_of_hundreds_is_near_that_of_a_few() {
    let of = |count: usize| {
        let scene = room(count, 0.9);
        let film = |seed| picture(&scene, &Settings { seed, ..SMALL }, Backend::Cpu);
        noise(&film(1), &film(2))
    };
    let (few, many) = (of(9), of(400));
    eprintln!("relMSE of 9 panels {few:.5}, of 400 {many:.5}");
    // By power alone it is more than 3 times as much; the tree's boxes are coarser than the panels, and of few panels
    // the points that blocks side by side share out among them leave less noise (0.0020 against 0.0033).
    assert!(many < 2.0 * few, "{many} against {few}");
}
