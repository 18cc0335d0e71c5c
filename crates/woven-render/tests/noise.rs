//! `Settings::noise`: a render stops when its own estimate of the noise is low enough, and the estimate is honest.

mod common;

use common::{curtain_room, even_lace, picture};
use woven_render::render::{Backend, Renderer, Settings};

#[test]
fn it_stops_at_the_noise_that_was_asked_for() {
    let scene = curtain_room(even_lace(), 40);
    let base = Settings {
        width: 24,
        height: 16,
        spp: 1024,
        depth: 3,
        seed: 5,
        ..Settings::default()
    };
    let sharp = picture(
        &scene,
        &Settings {
            spp: 768,
            seed: 77,
            ..base
        },
        Backend::Cpu,
    );
    let sharp = sharp.beauty().unwrap();
    let mut used = Vec::new();
    for target in [2e-3_f32, 5e-4] {
        let settings = Settings {
            noise: Some(target),
            ..base
        };
        let mut renderer = Renderer::new(&scene, &settings, Backend::Cpu).unwrap();
        renderer.finish(&mut ()).unwrap();
        let told = renderer.noise().unwrap();
        let film = renderer.film().unwrap();
        let sum: f64 = film
            .beauty()
            .unwrap()
            .iter()
            .flatten()
            .zip(sharp.iter().flatten())
            .map(|(x, r)| f64::from((x - r) * (x - r)) / f64::from(r * r + 0.01))
            .sum();
        let real = sum / (sharp.len() * 3) as f64;
        eprintln!(
            "target {target}: {} samples, told {told:.5}, measured {real:.5}",
            renderer.samples()
        );
        assert!(told <= f64::from(target) * 1.001, "{told}");
        assert!(renderer.samples() < base.spp && renderer.samples() >= 16);
        // The estimate comes from halves of a small picture; half and double are within its scatter (the samples are better
        // spread than random ones, so the real noise may be lower still).
        assert!(
            real < f64::from(target) * 2.0 && real > f64::from(target) / 6.0,
            "{real} for {target}"
        );
        used.push(renderer.samples());
        assert_eq!(film.metadata["samples"], renderer.samples().to_string());
    }
    assert!(used[1] > 2 * used[0], "{used:?}");
}
