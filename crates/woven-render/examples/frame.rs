//! What a frame of a moving curtain costs and how clean it is: the moving of the mesh with its ray structure, the
//! sampling, the filter, in CPU seconds, with the most memory that was held meanwhile; then, when all frames are done, FLIP
//! against a frame of many samples.
//!
//! `cargo run --release -p woven-render --example frame -- SCENE.glb [MESH] [WIDTHxHEIGHT] [FRAMES] [CONVERGED_SPP]`

#[path = "process/mod.rs"]
mod process;

use anyhow::{Context, Result};
use glam::Vec3;
use process::{cpu_seconds, forget_peak, peak_memory, scheduled_seconds};
use std::path::Path;
use std::time::Instant;
use woven_render::compare::{Picture, compare};
use woven_render::denoise::{self, denoise};
use woven_render::film::Film;
use woven_render::render::{Backend, Integrator, Renderer, Settings};
use woven_render::scene::gltf;

/// The curtain at frame `k`: a wave that runs across it, stronger towards the hem.
fn swayed(rest: &[Vec3], k: u32) -> Vec<Vec3> {
    let top = rest.iter().map(|p| p.y).fold(f32::MIN, f32::max);
    rest.iter()
        .map(|p| *p + Vec3::Z * (0.04 * (top - p.y) * (1.0 + (3.0 * p.x + 0.4 * k as f32).sin())))
        .collect()
}

fn normals(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut sums = vec![Vec3::ZERO; positions.len()];
    for t in triangles {
        let [a, b, c] = t.map(|i| positions[i as usize]);
        for &i in t {
            sums[i as usize] += (b - a).cross(c - a);
        }
    }
    sums.into_iter().map(Vec3::normalize_or_zero).collect()
}

fn flip(film: &Film, reference: &Film) -> Result<[f64; 2]> {
    let picture = |film: &'_ Film| -> Result<Vec<[f32; 3]>> {
        Ok(film.beauty().context("a picture")?.to_vec())
    };
    let (a, b) = (picture(film)?, picture(reference)?);
    let as_picture = |pixels| Picture {
        width: film.width,
        height: film.height,
        pixels,
    };
    let report = compare(as_picture(&a), as_picture(&b), true)?.report;
    Ok([report.flip, report.flip_ldr])
}

fn main() -> Result<()> {
    let mut args = std::env::args().skip(1);
    let path = args
        .next()
        .context("name a scene: frame SCENE.glb [MESH] [WIDTHxHEIGHT] [FRAMES] [CONVERGED_SPP]")?;
    let name = args.next().unwrap_or_else(|| "curtain".into());
    let size = args.next().unwrap_or_else(|| "640x480".into());
    let frames: u32 = args.next().map_or(Ok(4), |s| s.parse())?;
    let converged: u32 = args.next().map_or(Ok(128), |s| s.parse())?;
    let (width, height) = size
        .split_once('x')
        .context("the size is written WIDTHxHEIGHT")?;
    let scene = gltf::load(Path::new(&path), &gltf::Options::default())?.scene;
    let moving = scene
        .meshes
        .iter()
        .position(|m| m.name == name)
        .with_context(|| {
            let names: Vec<&str> = scene.meshes.iter().map(|m| m.name.as_str()).collect();
            format!("{path} has no mesh {name}; it has {}", names.join(", "))
        })?;
    let mesh = scene.meshes[moving].clone();
    println!(
        "{size}, {} triangles move, {} threads",
        mesh.indices.len(),
        rayon::current_num_threads()
    );
    let last = {
        let positions = swayed(&mesh.positions, frames - 1);
        let normals = normals(&positions, &mesh.indices);
        (positions, normals)
    };
    let base = Settings {
        width: width.parse()?,
        height: height.parse()?,
        depth: 7,
        ..Settings::default()
    };
    // All frames first, so that no picture of many samples lies beside them in memory.
    let mut done: Vec<(Integrator, String, Film)> = Vec::new();
    for (what, integrator, counts) in [
        ("direct", Integrator::Direct, vec![2, 4]),
        ("everything", Integrator::Path, vec![1, 2, 4]),
    ] {
        for spp in counts {
            let settings = Settings {
                spp,
                aov: integrator == Integrator::Path,
                integrator,
                ..base
            };
            forget_peak();
            let mut renderer = Renderer::new(&scene, &settings, Backend::Cpu)?;
            let (mut update, mut sampling, mut filter) = (0.0, 0.0, 0.0);
            let (began, wall) = (cpu_seconds(), Instant::now());
            let mut film = None;
            for k in 0..frames {
                let positions = swayed(&mesh.positions, k);
                let normals = normals(&positions, &mesh.indices);
                let at = scheduled_seconds();
                renderer.move_mesh(moving, &positions, &normals)?;
                let moved = scheduled_seconds();
                renderer.finish(&mut ())?;
                let mut picture = renderer.film()?;
                let sampled = scheduled_seconds();
                // Direct light is clean enough without.
                if integrator == Integrator::Path {
                    denoise(&mut picture, &denoise::Settings::default());
                }
                update += moved - at;
                sampling += sampled - moved;
                filter += scheduled_seconds() - sampled;
                film = Some(picture);
            }
            let each = f64::from(frames);
            let (cpu, wall) = (
                (cpu_seconds() - began) / each,
                wall.elapsed().as_secs_f64() / each,
            );
            let sum = update + sampling + filter;
            let film = film.context("no frame")?;
            let beauty = film.beauty().context("a picture")?.to_vec();
            let line = format!(
                "{what}, {spp} spp: {cpu:.2} CPU-s and {wall:.2} s a frame (update {:.1} ms of processor time, {:.1} %; sampling {:.1} %, filter {:.1} %), at most {:.0} MiB",
                1e3 * update / each,
                100.0 * update / sum,
                100.0 * sampling / sum,
                100.0 * filter / sum,
                peak_memory()
            );
            println!("{line}");
            let film = Film::of_beauty(film.width, film.height, beauty);
            done.push((integrator, format!("{what}, {spp} spp"), film));
        }
    }
    for integrator in [Integrator::Direct, Integrator::Path] {
        let settings = Settings {
            spp: converged,
            seed: 77,
            integrator,
            ..base
        };
        let mut reference = Renderer::new(&scene, &settings, Backend::Cpu)?;
        reference.move_mesh(moving, &last.0, &last.1)?;
        reference.finish(&mut ())?;
        let reference = reference.film()?;
        for (_, what, film) in done.iter().filter(|d| d.0 == integrator) {
            let [hdr, ldr] = flip(film, &reference)?;
            println!("{what}: mean FLIP {hdr:.4} (HDR), {ldr:.4} (LDR) against {converged} spp");
        }
    }
    Ok(())
}
