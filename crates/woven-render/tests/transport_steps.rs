//! The same bytes however the work is cut: by threads, by steps, by a stop and a resume; and moving a mesh gives the
//! picture of a scene that was built with it there.

mod common;

use common::{curtain_room, even_lace, mean, pleats};
use glam::Vec3;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use woven_render::accumulate::Accumulation;
use woven_render::render::{Backend, Progress, Renderer, Settings, render};
use woven_render::scene::Scene;

fn scene() -> Scene {
    curtain_room(even_lace(), 40)
}

fn settings() -> Settings {
    Settings {
        width: 40,
        height: 24,
        spp: 6,
        aov: true,
        light_layers: true,
        seed: 7,
        ..Settings::default()
    }
}

/// The sums after `steps`, gathered by `threads` threads.
fn sums(steps: &[u32], threads: usize) -> Accumulation {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .expect("threads");
    pool.install(|| {
        let mut r = Renderer::new(&scene(), &settings(), Backend::Cpu).expect("a renderer");
        for &count in steps {
            assert!(r.step(count, &AtomicBool::new(false)).expect("a step"));
        }
        r.sums().expect("sums").clone()
    })
}

#[test]
fn threads_and_steps_do_not_change_a_bit() {
    let once = sums(&[6], 1);
    assert_eq!(once, sums(&[6], 3));
    assert_eq!(once, sums(&[1, 2, 3], 2));
}

#[test]
fn a_resumed_render_is_the_undisturbed_one() {
    let whole = sums(&[6], 2);
    let bytes = sums(&[2], 2).to_bytes();
    let mut r = Renderer::new(&scene(), &settings(), Backend::Cpu).expect("a renderer");
    r.resume(Accumulation::from_bytes(&bytes).expect("a checkpoint"))
        .expect("the same size");
    r.finish(&mut ()).expect("the rest");
    assert_eq!(r.sums().expect("sums"), &whole);
    // A checkpoint that is cut short, or of another size, is a sentence.
    let cut = Accumulation::from_bytes(&bytes[..bytes.len() - 5])
        .expect_err("cut short")
        .to_string();
    assert!(cut.contains("cut short"), "{cut}");
    assert!(Accumulation::from_bytes(b"PNG").is_err());
    let other = r
        .resume(Accumulation::new(8, 8))
        .expect_err("another size")
        .to_string();
    assert!(other.contains("8 x 8"), "{other}");
}

struct StopAfter(Arc<AtomicBool>, u64);

impl Progress for StopAfter {
    fn advance(&mut self, done: u64, total: u64) {
        assert!(done <= total);
        if done >= self.1 {
            self.0.store(true, Ordering::Relaxed);
        }
    }
    fn stop(&self) -> Option<Arc<AtomicBool>> {
        Some(Arc::clone(&self.0))
    }
}

#[test]
fn a_stopped_render_keeps_what_it_has_and_a_limit_of_time_holds() {
    let many = Settings {
        spp: 1_000_000,
        ..settings()
    };
    let film = render(
        &scene(),
        &many,
        Backend::Cpu,
        &mut StopAfter(Arc::default(), 40 * 24 * 2),
    )
    .expect("a film");
    let samples: u32 = film.metadata["samples"].parse().expect("a number");
    assert!((2..100_000).contains(&samples), "{samples}");
    let limited = Settings {
        time_limit: Some(Duration::from_millis(300)),
        ..many
    };
    let began = std::time::Instant::now();
    let film = render(&scene(), &limited, Backend::Cpu, &mut ()).expect("a film");
    assert!(film.metadata["samples"] != "0");
    // Generous, for a busy machine: a million samples would take hours.
    assert!(began.elapsed() < Duration::from_secs(20));
}

#[test]
fn a_moved_mesh_gives_the_picture_of_a_scene_built_there() {
    let mut moved = pleats(40, 3);
    for p in &mut moved.positions {
        *p += Vec3::new(0.3, 0.1, 0.25 * (2.4 - p.y));
    }
    let there = {
        let mut s = scene();
        *s.meshes.last_mut().expect("the curtain") = moved.clone();
        render(
            &s,
            &Settings {
                spp: 16,
                ..settings()
            },
            Backend::Cpu,
            &mut (),
        )
        .expect("a film")
    };
    let mut r = Renderer::new(
        &scene(),
        &Settings {
            spp: 16,
            ..settings()
        },
        Backend::Cpu,
    )
    .expect("a renderer");
    let curtain = scene().meshes.len() - 1;
    r.step(1, &AtomicBool::new(false)).expect("a step");
    r.move_mesh(curtain, &moved.positions, &moved.normals)
        .expect("moved");
    r.finish(&mut ()).expect("a picture");
    let film = r.film().expect("a film");
    // Another tree meets the same triangles: the pictures differ by the order of products and the numbers of coins.
    let (a, b) = (mean(&film), mean(&there));
    assert!(
        (0..3).all(|c| (a[c] / b[c] - 1.0).abs() < 2e-3),
        "{a:?} {b:?}"
    );
    let wrong = r
        .move_mesh(curtain, &moved.positions[1..], &[])
        .expect_err("one vertex less")
        .to_string();
    assert!(wrong.contains("curtain"), "{wrong}");
}

#[test]
fn what_cannot_be_rendered_is_a_sentence() {
    let mut broken = scene();
    broken.meshes[0].material = 99;
    let said = |s: &Scene, t: &Settings| {
        format!(
            "{:#}",
            render(s, t, Backend::Cpu, &mut ()).expect_err("refused")
        )
    };
    assert!(said(&broken, &settings()).contains("material 99"));
    let mut broken = scene();
    broken.meshes[0].indices[0][1] = 77;
    assert!(said(&broken, &settings()).contains("vertex beyond"));
    let mut broken = scene();
    broken.meshes[0].positions[0].x = f32::NAN;
    assert!(said(&broken, &settings()).contains("not a number"));
    assert!(
        said(
            &scene(),
            &Settings {
                spp: 0,
                ..settings()
            }
        )
        .contains("0 samples")
    );
    assert!(
        said(
            &scene(),
            &Settings {
                width: 0,
                ..settings()
            }
        )
        .contains("no pixel")
    );
    // Nothing at all is a black picture, not an error.
    let film = render(&Scene::default(), &settings(), Backend::Cpu, &mut ()).expect("black");
    assert_eq!(mean(&film), [0.0; 3]);
}
