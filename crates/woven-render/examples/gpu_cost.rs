//! What a sample of every pixel costs on the GPU (lavapipe is one) and on our CPU path, in processor time; the shader is
//! compiled before. Prints one line a round, the backends in turn.
//!
//! `cargo run --release -p woven-render --example gpu_cost -- SCENE.glb [WIDTHxHEIGHT] [SPP] [ROUNDS]`

#[path = "process/mod.rs"]
mod process;

use anyhow::{Context, Result};
use process::cpu_seconds;
use std::path::Path;
use std::time::Instant;
use woven_render::render::{Backend, Renderer, Settings};
use woven_render::scene::gltf;

fn main() -> Result<()> {
    let mut args = std::env::args().skip(1);
    let path = args
        .next()
        .context("name a scene: gpu_cost SCENE.glb [WIDTHxHEIGHT] [SPP] [ROUNDS]")?;
    let size = args.next().unwrap_or_else(|| "96x72".into());
    let (width, height) = size
        .split_once('x')
        .context("the size is written WIDTHxHEIGHT")?;
    let spp = args.next().map_or(Ok(4), |s| s.parse())?;
    let rounds: u32 = args.next().map_or(Ok(3), |s| s.parse())?;
    let scene = gltf::load(Path::new(&path), &gltf::Options::default())?.scene;
    let settings = Settings {
        width: width.parse()?,
        height: height.parse()?,
        spp,
        depth: 7,
        ..Settings::default()
    };
    let mut both = [
        Renderer::new(&scene, &settings, Backend::Cpu)?,
        Renderer::new(&scene, &settings, Backend::Gpu)?,
    ];
    for renderer in &mut both {
        let began = Instant::now();
        renderer.finish(&mut ())?;
        println!(
            "{}: first picture {:.1} s",
            renderer.device(),
            began.elapsed().as_secs_f64()
        );
    }
    let samples = f64::from(settings.width) * f64::from(settings.height) * f64::from(spp);
    for round in 0..rounds {
        let mut costs = [0.0; 2];
        for (renderer, cost) in both.iter_mut().zip(&mut costs) {
            renderer.set_seed(1 + round)?;
            let began = cpu_seconds();
            renderer.finish(&mut ())?;
            *cost = (cpu_seconds() - began) * 1e6 / samples;
        }
        let [cpu, gpu] = costs;
        let films = [both[0].film()?, both[1].film()?];
        let [a, b] = films
            .each_ref()
            .map(|f| f.beauty().unwrap_or(&[]).as_flattened());
        let close = |(p, q): &(&f32, &f32)| (*p - *q).abs() <= 1e-3 * (p.max(**q) + 0.01);
        let same = a.iter().zip(b).filter(close).count() as f64 / a.len() as f64;
        println!(
            "CPU {cpu:.2} us, GPU {gpu:.2} us of processor time a sample: {:.1} times; {:.2} % of the numbers within \
             1e-3; longest submit {:.0} ms",
            gpu / cpu,
            100.0 * same,
            both[1]
                .longest_submit()
                .map_or(0.0, |(t, _)| t.as_secs_f64() * 1e3)
        );
    }
    Ok(())
}
