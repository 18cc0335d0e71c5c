//! What a sample costs as the work grows: folds 1 to 64, triangles 10^3 to 10^7, lights 1 to 1000, on the CPU.
//!
//! `cargo run --release -p woven-render --example scaling -- [PLOT.svg] [MOST_TRIANGLES] [SERIES]` prints one table and draws it;
//! SERIES is folds, triangles or lights, all of them without.
//! Times are processor time of all threads over samples of pixels; the best of three runs is taken, since other
//! programs only ever add to it. Noise is relMSE of two seeds at the samples rendered.

#[path = "../tests/common/mod.rs"]
mod common;
#[path = "process/mod.rs"]
mod process;

use anyhow::{Context, Result};
use glam::Vec3;
use process::cpu_seconds;
use std::fmt::Write;
use std::time::Instant;
use woven_render::render::{Backend, Integrator, Renderer, Settings};
use woven_render::scene::{Mesh, Scene};

/// One measured point.
struct Point {
    n: usize,
    /// Microseconds of processor time a sample: direct light, everything.
    micros: [f64; 2],
    /// relMSE of everything.
    noise: f64,
    /// Seconds for the table and the ray structure, and for moving the curtain (refit).
    build: f64,
    refit: f64,
}

/// A sheet 2 m wide in nine pleats before the window, or a flat one.
fn sheet(columns: usize, rows: usize, z: f32, pleat: f32) -> Mesh {
    let mut mesh = Mesh {
        name: "curtain".into(),
        material: 3,
        moving: true,
        ..Mesh::default()
    };
    for j in 0..=rows {
        for i in 0..=columns {
            let (u, v) = (i as f32 / columns as f32, j as f32 / rows as f32);
            let wave = pleat * (std::f32::consts::TAU * 9.0 * u + v).sin();
            mesh.positions
                .push(Vec3::new(2.0 * u - 1.0, 2.4 - 1.85 * v, z + wave));
        }
    }
    let across = columns as u32 + 1;
    for j in 0..rows as u32 {
        for i in 0..columns as u32 {
            let a = j * across + i;
            mesh.indices.push([a, a + across, a + across + 1]);
            mesh.indices.push([a, a + across + 1, a + 1]);
        }
    }
    mesh
}

/// A room with a window and `panels` lamps of the same light together outside of it, with gaps between so that no two are one;
/// the cloth is what is asked for.
fn room(cloth: Vec<Mesh>, panels: usize) -> Scene {
    let mut scene = common::curtain_room(common::even_lace(), 2);
    scene.meshes.retain(|m| m.name != "curtain");
    common::cut_panel(&mut scene, panels, 0.9);
    scene.meshes.extend(cloth);
    scene
}

fn measure(scene: &Scene, n: usize) -> Result<Point> {
    let settings = Settings {
        width: 96,
        height: 72,
        spp: 8,
        depth: 7,
        ..Settings::default()
    };
    let began = Instant::now();
    let mut renderer = Renderer::new(scene, &settings, Backend::Cpu)?;
    let build = began.elapsed().as_secs_f64();
    let moving = scene.meshes.len() - 1;
    let began = Instant::now();
    renderer.move_mesh(moving, &scene.meshes[moving].positions, &[])?;
    let refit = began.elapsed().as_secs_f64();
    drop(renderer);
    let mut micros = [f64::INFINITY; 2];
    let mut films = Vec::new();
    for (i, integrator) in [Integrator::Direct, Integrator::Path]
        .into_iter()
        .enumerate()
    {
        let mut renderer = Renderer::new(
            scene,
            &Settings {
                integrator,
                ..settings
            },
            Backend::Cpu,
        )?;
        for run in 0..3 {
            renderer.set_seed(run)?;
            let began = cpu_seconds();
            renderer.finish(&mut ())?;
            let samples = f64::from(settings.width * settings.height * settings.spp);
            micros[i] = micros[i].min((cpu_seconds() - began) / samples * 1e6);
            if i == 1 && run < 2 {
                films.push(renderer.film()?);
            }
        }
    }
    let pair = films[0]
        .beauty()
        .unwrap_or(&[])
        .iter()
        .flatten()
        .zip(films[1].beauty().unwrap_or(&[]).iter().flatten());
    let (mut sum, mut count) = (0.0, 0);
    for (a, b) in pair {
        let m = f64::from(a + b) * 0.5;
        sum += f64::from(a - b).powi(2) / 2.0 / (m * m + 0.01);
        count += 1;
    }
    Ok(Point {
        n,
        micros,
        noise: sum / f64::from(count.max(1)),
        build,
        refit,
    })
}

fn main() -> Result<()> {
    let mut args = std::env::args().skip(1);
    let plot = args.next();
    let most: usize = args
        .next()
        .map_or(Ok(10_000_000), |n| n.parse())
        .context("the second word is a number of triangles")?;
    let only = args.next();
    let mut series: Vec<(&str, Vec<Point>)> = Vec::new();
    println!(
        "| what | n | direct, µs a sample | everything, µs | relMSE of everything, 8 spp | build, s | refit, s |\n|---|---|---|---|---|---|---|"
    );
    let mut add =
        |name: &'static str, points: &mut dyn Iterator<Item = (usize, Scene)>| -> Result<()> {
            let mut list = Vec::new();
            if only.as_deref().is_some_and(|o| o != name) {
                return Ok(());
            }
            for (n, scene) in points {
                let p = measure(&scene, n)?;
                println!(
                    "| {name} | {} | {:.2} | {:.2} | {:.5} | {:.4} | {:.4} |",
                    p.n, p.micros[0], p.micros[1], p.noise, p.build, p.refit
                );
                list.push(p);
            }
            series.push((name, list));
            Ok(())
        };
    // Sheets one behind the other, 1 cm apart: a ray to the window crosses all of them.
    let folds = [1, 2, 4, 8, 16, 32, 64];
    add(
        "folds",
        &mut folds.into_iter().map(|n| {
            (
                n,
                room(
                    (0..n)
                        .map(|k| sheet(8, 8, 0.05 + 0.01 * k as f32, 0.0))
                        .collect(),
                    1,
                ),
            )
        }),
    )?;
    let sides = [(32, 16), (100, 50), (316, 158), (1000, 500), (3162, 1581)];
    let sides = sides.into_iter().filter(|(c, r)| 2 * c * r <= most);
    add(
        "triangles",
        &mut sides.map(|(c, r)| (2 * c * r, room(vec![sheet(c, r, 0.08, 0.03)], 1))),
    )?;
    let lights = [1, 3, 10, 30, 100, 300, 1000];
    add(
        "lights",
        &mut lights
            .into_iter()
            .map(|n| (n, room(vec![sheet(100, 50, 0.08, 0.03)], n))),
    )?;
    if let Some(path) = plot {
        std::fs::write(&path, draw(&series))
            .with_context(|| format!("{path} cannot be written"))?;
    }
    Ok(())
}

/// Both axes in powers of ten; one panel a series, microseconds a sample over n.
fn draw(series: &[(&str, Vec<Point>)]) -> String {
    let (w, h, left, top) = (300.0, 220.0, 46.0, 30.0);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{:.0}\" height=\"{:.0}\" font-family=\"sans-serif\" font-size=\"11\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
        (w + left) * series.len() as f64 + 20.0,
        h + top + 50.0
    );
    let all = || {
        series
            .iter()
            .flat_map(|s| s.1.iter().flat_map(|p| p.micros))
    };
    let (lo, hi) = (
        all().fold(f64::INFINITY, f64::min).log10().floor(),
        all().fold(0.0, f64::max).log10().ceil(),
    );
    for (k, (name, points)) in series.iter().enumerate() {
        let x0 = left + (w + left) * k as f64;
        let most = points
            .iter()
            .map(|p| p.n as f64)
            .fold(1.0, f64::max)
            .log10();
        let least = points
            .iter()
            .map(|p| p.n as f64)
            .fold(f64::INFINITY, f64::min)
            .log10();
        let x = |n: f64| x0 + (n.log10() - least) / (most - least).max(1e-9) * (w - 20.0);
        let y = |v: f64| top + h - (v.log10() - lo) / (hi - lo).max(1e-9) * h;
        let _ = writeln!(
            svg,
            "<rect x=\"{x0:.1}\" y=\"{top}\" width=\"{:.1}\" height=\"{h}\" fill=\"none\" stroke=\"#888\"/>",
            w - 20.0
        );
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{name}</text>",
            x0 + w * 0.5 - 10.0,
            top + h + 34.0
        );
        for e in lo as i32..=hi as i32 {
            let at = y(10_f64.powi(e));
            let _ = writeln!(
                svg,
                "<line x1=\"{x0:.1}\" x2=\"{:.1}\" y1=\"{at:.1}\" y2=\"{at:.1}\" stroke=\"#ddd\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                x0 + w - 20.0,
                x0 - 4.0,
                at + 4.0,
                10_f64.powi(e)
            );
        }
        for p in points {
            let at = x(p.n as f64);
            let _ = writeln!(
                svg,
                "<text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\" font-size=\"8\">{}</text>",
                top + h + 14.0,
                p.n
            );
        }
        for (i, (colour, label)) in [
            ("#1f77b4", "direct light"),
            ("#d62728", "everything, depth 7"),
        ]
        .into_iter()
        .enumerate()
        {
            let line: Vec<String> = points
                .iter()
                .map(|p| format!("{:.1},{:.1}", x(p.n as f64), y(p.micros[i])))
                .collect();
            let _ = writeln!(
                svg,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>",
                line.join(" ")
            );
            for p in &line {
                let (px, py) = p.split_once(',').unwrap_or(("0", "0"));
                let _ = writeln!(
                    svg,
                    "<circle cx=\"{px}\" cy=\"{py}\" r=\"3\" fill=\"{colour}\"/>"
                );
            }
            if k == 0 {
                let _ = writeln!(
                    svg,
                    "<text x=\"{:.1}\" y=\"{:.1}\" fill=\"{colour}\">{label}</text>",
                    x0 + 8.0,
                    top + 16.0 + 14.0 * i as f64
                );
            }
        }
    }
    let _ = writeln!(
        svg,
        "<text x=\"{left}\" y=\"18\">µs of processor time a sample</text>\n</svg>"
    );
    svg
}
