//! An open shutter: what moves blurs, and the mean over the samples is the mean over the time.
//!
//! Seen to fail: with every moment in the middle of the time the lamp leaves no stripe.

use crate::common::{backends, curtain_room, even_lace, mean, quad};
use glam::Vec3;
use std::sync::atomic::AtomicBool;
use woven_render::accumulate::Accumulation;
use woven_render::film::Film;
use woven_render::render::{Backend, Renderer, Settings};
use woven_render::scene::{Camera, Material, Scene};
use woven_render::shutter::Pose;

fn settings() -> Settings {
    Settings {
        width: 40,
        height: 8,
        spp: 64,
        depth: 1,
        ..Settings::default()
    }
}

/// A lamp 0.4 m wide that runs from x = -1.4 to x = 1.4 before a dark room, seen straight on: 3.2 m of width in the picture.
fn runner() -> (Scene, Vec<Pose>) {
    let lamp = quad(
        "lamp",
        Vec3::new(-1.4, -1.0, 0.0),
        Vec3::X * 0.4,
        Vec3::Y * 2.0,
        0,
    );
    let at = |x: f32| Pose {
        positions: lamp.positions.iter().map(|p| *p + Vec3::X * x).collect(),
        normals: Vec::new(),
    };
    let poses = vec![at(0.0), at(1.2), at(2.4)];
    let scene = Scene {
        meshes: vec![lamp],
        materials: vec![Material::lamp("lamp", [1.0, 2.0, 3.0], true)],
        camera: Camera::look_at(Vec3::Z * 8.0, Vec3::ZERO, Vec3::Y, 2.0 * 0.04_f32.atan()),
        ..Scene::default()
    };
    (scene, poses)
}

fn blurred(scene: &Scene, mesh: usize, poses: Vec<Pose>, s: &Settings, backend: Backend) -> Film {
    let mut r = Renderer::new(scene, s, backend).unwrap_or_else(|e| panic!("{e:#}"));
    r.open_shutter(mesh, poses).unwrap();
    r.finish(&mut ()).unwrap();
    r.film().unwrap()
}

#[test]
fn a_lamp_that_runs_across_is_a_stripe_of_the_mean_light() {
    let (scene, poses) = runner();
    for backend in backends() {
        let film = blurred(&scene, 0, poses.clone(), &settings(), backend);
        let row = &film.beauty().unwrap()[4 * 40..5 * 40];
        for (i, p) in row.iter().enumerate() {
            // 0.08 m a pixel. The lamp's edges pass x for the time in which it lies above it: 0.4 m of its way of 2.4 m.
            let x = -1.6 + 0.08 * (i as f32 + 0.5);
            let share = ((x + 1.4).min(1.4 - x).clamp(0.0, 0.4)) / 2.4;
            // 32 moments: one more or less at each edge of the time.
            assert!(
                (p[1] / 2.0 - share).abs() < 1.7 / 32.0,
                "{backend:?} {i}: {p:?} {share}"
            );
            assert!((p[2] - 3.0 * p[0]).abs() < 1e-5);
        }
        // All together: its light for the whole time.
        let all = mean(&film)[0];
        assert!((all / (0.4 / 3.2) - 1.0).abs() < 0.01, "{backend:?}: {all}");
    }
}

/// A curtain that hangs still for half of the time and sways by 30 cm in the other half.
fn swaying() -> (Scene, usize, Vec<Pose>) {
    let scene = curtain_room(even_lace(), 40);
    let mesh = scene.meshes.len() - 1;
    let rest = scene.meshes[mesh].clone();
    let at = |sway: f32| Pose {
        positions: rest
            .positions
            .iter()
            .map(|p| *p + Vec3::Z * (sway * (2.4 - p.y)))
            .collect(),
        normals: rest.normals.clone(),
    };
    (scene, mesh, vec![at(0.0), at(0.0), at(0.16)])
}

#[test]
fn a_blurred_curtain_is_the_mean_of_still_ones() {
    let (scene, mesh, poses) = swaying();
    let s = Settings {
        width: 32,
        height: 24,
        spp: 32,
        depth: 3,
        ..settings()
    };
    let blurred = mean(&blurred(&scene, mesh, poses.clone(), &s, Backend::Cpu));
    let mut still = [0.0; 3];
    let mut ends = Vec::new();
    for k in 0..8 {
        let mut r = Renderer::new(&scene, &s, Backend::Cpu).unwrap();
        let sway = ((k as f32 + 0.5) / 4.0 - 1.0).max(0.0);
        let pose = poses[0].towards(&poses[2], sway);
        r.move_mesh(mesh, &pose.positions, &pose.normals).unwrap();
        r.finish(&mut ()).unwrap();
        let one = mean(&r.film().unwrap());
        (0..3).for_each(|c| still[c] += one[c] / 8.0);
        ends.push(one[1]);
    }
    eprintln!(
        "blurred {blurred:?}, mean of 8 stills {still:?}, from {} to {}",
        ends[0], ends[7]
    );
    // The stills differ by more than what is allowed, so that one of them would not do.
    assert!((ends[0] / ends[7] - 1.0).abs() > 0.02);
    for c in 0..3 {
        assert!((blurred[c] / still[c] - 1.0).abs() < 4e-3);
    }
}

fn sums(steps: &[u32], threads: usize, backend: Backend, pause: bool) -> Accumulation {
    let (scene, mesh, poses) = swaying();
    let s = Settings {
        width: 24,
        height: 16,
        spp: 40,
        depth: 2,
        ..settings()
    };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap();
    pool.install(|| {
        let go = AtomicBool::new(false);
        let mut r = Renderer::new(&scene, &s, backend).unwrap();
        r.open_shutter(mesh, poses.clone()).unwrap();
        for (k, &count) in steps.iter().enumerate() {
            if pause && k == 1 {
                let kept = r.sums().unwrap().to_bytes();
                r = Renderer::new(&scene, &s, backend).unwrap();
                r.open_shutter(mesh, poses.clone()).unwrap();
                r.resume(Accumulation::from_bytes(&kept).unwrap()).unwrap();
            }
            assert!(r.step(count, &go).unwrap());
        }
        r.sums().unwrap().clone()
    })
}

#[test]
fn threads_steps_and_pauses_change_no_bit() {
    let once = sums(&[40], 1, Backend::Cpu, false);
    assert_eq!(once, sums(&[3, 37], 3, Backend::Cpu, false));
    assert_eq!(once, sums(&[7, 14, 19], 2, Backend::Cpu, true));
}

#[test]
fn the_gpu_blurs_alike() {
    if !backends().contains(&Backend::Gpu) {
        return;
    }
    let once = sums(&[40], 1, Backend::Gpu, false);
    assert_eq!(once, sums(&[7, 14, 19], 1, Backend::Gpu, true));
    let cpu = sums(&[40], 1, Backend::Cpu, false);
    let light = |p: &woven_render::accumulate::PixelSum| p.direct[0][1] + p.indirect[0][1];
    let close = |(a, b): (&_, &_)| {
        let (a, b): (f32, f32) = (light(a), light(b));
        (a - b).abs() <= 1e-3 * (a.max(b) + 0.4)
    };
    let pairs = cpu.pixels.iter().zip(&once.pixels);
    let share = pairs.filter(|&p| close(p)).count() as f32 / cpu.pixels.len() as f32;
    eprintln!("{:.2} % of the pixels within 1e-3", 100.0 * share);
    assert!(share > 0.98, "{share}");
}
