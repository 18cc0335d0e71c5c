//! The problem on which the peers were measured: 2.0 × 2.4 m on a 1 m rail in ten pleats, gusts of 3 m/s, 240 frames.
//!
//! `cargo run --release -p woven-cloth --example peers -- 128 [frames] [contact] [wind m/s] [substeps] [seconds of settling] [OUT.glb] [share of the
//! rail]` prints cost, strain, reach, crossings and memory; with a share the curtain is drawn to it in the first 2 s. `RAYON_NUM_THREADS=1` keeps it on one thread.

use std::time::Instant;
use woven_cloth::{CurtainClip, CurtainSpec, Simulation, crossings};

/// Largest resident memory of this process, MiB (Linux).
fn memory() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    status
        .lines()
        .find_map(|l| l.strip_prefix("VmHWM:"))
        .and_then(|l| l.trim().trim_end_matches(" kB").trim().parse::<f64>().ok())
        .map_or(0.0, |kib| kib / 1024.0)
}

/// CPU seconds of this process so far (Linux; elsewhere wall time would have to do).
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<f64> = stat
        .rsplit(')')
        .next()
        .unwrap_or("")
        .split_whitespace()
        .map(|f| f.parse().unwrap_or(0.0))
        .collect();
    // User and system time in ticks of 10 ms.
    fields
        .get(11)
        .zip(fields.get(12))
        .map_or(0.0, |(u, s)| (u + s) * 0.01)
}

/// A number that tells the places of all vertices apart to the last bit (FNV-1a).
fn bits(x: &[Vec<f64>; 3]) -> u64 {
    x.iter()
        .flatten()
        .flat_map(|v| v.to_bits().to_le_bytes())
        .fold(0xcbf2_9ce4_8422_2325, |h, b| {
            (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3)
        })
}

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let n: usize = args.get(1).and_then(|a| a.parse().ok()).unwrap_or(128);
    let frames: usize = args.get(2).and_then(|a| a.parse().ok()).unwrap_or(240);
    let contact = args.get(3).is_some_and(|a| a != "0");
    let speed: f64 = args.get(4).and_then(|a| a.parse().ok()).unwrap_or(2.1);
    let substeps = args
        .get(5)
        .filter(|a| *a != "0")
        .map_or(String::new(), |a| format!("substeps = {a}\n"));
    let text = substeps
        + &format!(
            "width = 1.0\nheight = 2.4\nfullness = 2.0\npleats = 10\nirregularity = 0.0\nhem = 0.0\ncolumns = {n}\nrows = {n}\nfps = 60.0\nframes = {frames}\nwarm_up = 0.0\nself_contact = {contact}\n\
         [mechanics]\nareal_density = 0.12\ntensile_warp = 2000.0\ntensile_weft = 2000.0\nshear = 20.0\nbending_warp = 5e-6\nbending_weft = 5e-6\nopenness = 0.0\n[wind]\nspeed = {speed:?}\ngust = 0.3\nturbulence = 0.15\n"
        );
    let text = match args.get(8) {
        Some(share) => {
            text + &format!(
                "[[draw]]\ntime = 0.0\nshare = 1.0\n[[draw]]\ntime = 2.0\nshare = {share}\n"
            )
        }
        None => text,
    };
    let spec: CurtainSpec = text.parse().expect("the problem is valid");
    let mut sim = Simulation::new(&spec).expect("the problem is valid");
    let start = Instant::now();
    let settle = args.get(6).and_then(|a| a.parse().ok()).unwrap_or(2.0);
    let rest = sim.settle(settle).expect("stays whole");
    println!(
        "rest: mean warp strain {:.4} %, largest {:.3} %, rail/weight {:.5}, {:.1} s",
        rest.mean_strain * 100.0,
        rest.max_strain * 100.0,
        rest.support_force[1] / rest.weight,
        start.elapsed().as_secs_f64()
    );
    let (mut seconds, mut wall) = (0.0, 0.0);
    let (mut worst, mut reach, mut mean) = (0.0f64, 0.0f64, 0.0);
    let (mut crossed, mut through) = (0, 0);
    let (mesh, mut kept) = (sim.mesh(), Vec::new());
    for f in 0..frames {
        let (cpu, clock) = (cpu_seconds(), Instant::now());
        sim.step_frame().expect("stays whole");
        seconds += cpu_seconds() - cpu;
        wall += clock.elapsed().as_secs_f64();
        let pierced = crossings(&sim.frame().positions, &sim.mesh());
        crossed += usize::from(pierced > 0);
        through += pierced;
        if args.get(7).is_some_and(|a| a != "0") {
            kept.push(sim.frame());
        }
        let r = sim.report();
        if r.max_strain > worst {
            worst = r.max_strain;
            let mut at = (false, 0.0f64, 0, 0);
            sim.sheet().for_each_strain(|w, s, i, j| {
                if s.abs() > at.1.abs() {
                    at = (w, s, i, j)
                }
            });
            if f % 8 == 7 {
                println!(
                    "frame {f}: strain {:+.2} % of {} at column {} row {}, fastest {:.2} m/s",
                    at.1 * 100.0,
                    if at.0 { "warp" } else { "weft" },
                    at.2,
                    at.3,
                    r.max_speed
                );
            }
        }
        mean += r.mean_strain / frames as f64;
        let s = sim.sheet();
        reach = s.x[2][(s.ny - 1) * s.nx..]
            .iter()
            .copied()
            .fold(reach, f64::max);
    }
    if let Some(path) = args.get(7).filter(|a| *a != "0") {
        let clip = CurtainClip {
            mesh,
            frames: kept,
            fps: 60.0,
        };
        clip.write(std::path::Path::new(path))
            .expect("the clip is written");
    }
    println!(
        "{n} x {n}, {frames} frames, contact {contact}: {:.1} CPU ms and {:.1} ms of wall time a frame, {} steps a second, largest strain {:.2} %, mean warp strain {:.3} %, hem reach {reach:.2} m, {through} crossings in {crossed} frames, {:.0} MiB, bits {:016x}",
        seconds * 1e3 / frames as f64,
        wall * 1e3 / frames as f64,
        sim.report().steps_per_second,
        worst * 100.0,
        mean * 100.0,
        memory(),
        bits(&sim.sheet().x)
    );
}
