//! How fast and how noisy the CPU path is on a curtain in a window: million samples per CPU-second, and
//! relMSE × CPU-seconds from two seeds, for direct light and for everything. Prints one line each.
//!
//! `cargo run --release -p woven-render --example measure -- SCENE.glb [WIDTHxHEIGHT] [SPP] [OUT.png]`

#[path = "process/mod.rs"]
mod process;

use anyhow::{Context, Result};
use process::cpu_seconds;
use std::path::Path;
use std::time::Instant;
use woven_render::film::Curve;
use woven_render::render::{Backend, Integrator, Settings, render};
use woven_render::scene::Scene;

/// relMSE of one of two pictures, from the difference of a pixel in both.
fn error(p: [f32; 3], q: [f32; 3]) -> f64 {
    let channel = |c: usize| {
        let (p, q) = (f64::from(p[c]), f64::from(q[c]));
        let m = 0.5 * (p + q);
        (p - q) * (p - q) / 2.0 / (m * m + 0.01) / 3.0
    };
    (0..3).map(channel).sum()
}

fn load(path: &Path) -> Result<Scene> {
    let loaded =
        woven_render::scene::gltf::load(path, &woven_render::scene::gltf::Options::default())?;
    Ok(loaded.scene)
}

fn main() -> Result<()> {
    let mut args = std::env::args().skip(1);
    let scene = load(Path::new(&args.next().context(
        "name a scene: measure SCENE.glb [WIDTHxHEIGHT] [SPP] [OUT.png]",
    )?))?;
    let size = args.next().unwrap_or_else(|| "320x240".into());
    let (width, height) = size
        .split_once('x')
        .context("the size is written WIDTHxHEIGHT")?;
    let spp = args.next().map_or(Ok(16), |s| s.parse())?;
    let settings = Settings {
        width: width.parse()?,
        height: height.parse()?,
        spp,
        depth: 7,
        ..Settings::default()
    };
    let out = args.next();
    for (name, integrator) in [
        ("direct", Integrator::Direct),
        ("everything", Integrator::Path),
    ] {
        let (began, wall) = (cpu_seconds(), Instant::now());
        let first = render(
            &scene,
            &Settings {
                integrator,
                ..settings
            },
            Backend::Cpu,
            &mut (),
        )?;
        let (cpu, wall) = (cpu_seconds() - began, wall.elapsed().as_secs_f64());
        let second = render(
            &scene,
            &Settings {
                integrator,
                seed: 1,
                ..settings
            },
            Backend::Cpu,
            &mut (),
        )?;
        let (a, b) = (
            first.beauty().unwrap_or(&[]),
            second.beauty().unwrap_or(&[]),
        );
        let errors: Vec<f64> = a.iter().zip(b).map(|(p, q)| error(*p, *q)).collect();
        let noise = errors.iter().sum::<f64>() / errors.len() as f64;
        let values = a.iter().chain(b).flatten();
        let mean = values.map(|&x| f64::from(x)).sum::<f64>() / (a.len() * 6) as f64;
        let samples = f64::from(settings.width * settings.height * spp) / 1e6;
        println!(
            "{name}: {size}, {spp} spp, {wall:.2} s, {cpu:.2} CPU-s, {:.3} M samples per CPU-s, mean {mean:.6}, relMSE {noise:.6}, relMSE x CPU-s {:.5}",
            samples / cpu,
            noise * cpu
        );
        if let Some(path) = &out {
            let noise = errors
                .iter()
                .map(|e| [(*e as f32 * spp as f32 * 2.0).min(4.0); 3])
                .collect();
            woven_render::film::Film::of_beauty(first.width, first.height, noise).write_png(
                &Path::new(path).with_extension(format!("{name}.png")),
                Curve::Clip,
                1.0,
            )?;
            first.write_png(Path::new(path), Curve::default(), scene.camera.exposure)?;
        }
    }
    Ok(())
}
