//! The production solver against the explicit reference in gusts: two exact solvers part within seconds, so statistics are compared.
//!
//! `cargo run --release -p woven-cloth --example statistics -- 8 [ms] [finer] [left out]` hangs a sheet of 1.0 m x 2.4 m in gusts of eight seeds
//! with either solver, 4 s each, and prints mean and rms reach of the hem and rms speed over the last 2 s, the largest strain, and the
//! differences seed by seed with their standard errors: `ms` is the retardation time of the threads, 0 unless given; `finer` divides
//! the production solver's step; with anything `left out` it is compared with itself at the full step instead of the reference.

#[path = "../tests/known_answers/cloth.rs"]
mod cloth;

use cloth::cloth;
use woven_cloth::*;

/// Sums over samples: count, reach, reach², speed²; the largest strain.
#[derive(Default)]
struct Sums {
    n: f64,
    reach: f64,
    reach2: f64,
    speed2: f64,
    strain: f64,
}

fn sheet(damping: f64) -> Sheet {
    let mechanics = Mechanics {
        stretch_damping: damping,
        ..cloth()
    };
    let mut sheet = Sheet::flat(25, 49, 1.0, 2.4, mechanics);
    for k in 0..sheet.len() {
        // Two soft folds, so that the motion is not that of a plane.
        let [x, y, _] = sheet.position(k);
        sheet.set_position(k, [x, y, 0.01 * (12.0 * x).sin()]);
    }
    sheet.pin_top();
    sheet
}

fn run(seed: u64, explicit: bool, [damping, finer]: [f64; 2], sums: &mut Sums) {
    let spec = WindSpec {
        speed: 2.1,
        gust: 0.3,
        turbulence: 0.0,
        ..WindSpec::default()
    };
    let wind = Wind::new(&spec, seed);
    let mut sheet = sheet(damping);
    let tick = 1.0 / 600.0;
    let longest = if explicit {
        // Explicit damping of the stiffest mode, ω = 1 / step, is stable while tau ω² step stays below 2.
        let step = explicit_step(&sheet);
        step.min(step * step / damping.max(1e-12))
    } else {
        gust_step(&sheet, GRAVITY) / finer
    };
    let steps = (tick / longest - 1e-9).ceil().max(2.0);
    let dt = tick / steps;
    let mut stepper = Stepper::new(&sheet, dt, GRAVITY);
    let mut reference = Reference::new(&sheet, dt, GRAVITY);
    let hem = (sheet.ny - 1) * sheet.nx;
    for n in 0..2400 {
        let t = f64::from(n) * tick;
        let u = wind.mean_speed(t);
        let air = uniform_wind_forces(&sheet, [0.15 * u, 0.0, u], 1.0);
        stepper.air.clone_from(&air);
        reference.air = air;
        for _ in 0..steps as usize {
            if explicit {
                reference.step(&mut sheet);
            } else {
                stepper.step(&mut sheet);
            }
        }
        if n % 10 == 9 {
            sums.strain = sums.strain.max(sheet.max_strain());
        }
        if n >= 1200 && n % 10 == 9 {
            let reach = sheet.x[2][hem..].iter().sum::<f64>() / sheet.nx as f64;
            let speed2 = (0..sheet.len())
                .map(|k| sheet.velocity(k).iter().map(|v| v * v).sum::<f64>())
                .sum::<f64>()
                / sheet.len() as f64;
            sums.n += 1.0;
            sums.reach += reach;
            sums.reach2 += reach * reach;
            sums.speed2 += speed2;
        }
    }
}

/// Mean, and its standard error, of value `k` of the seeds.
fn mean(each: &[[f64; 4]], k: usize) -> (f64, f64) {
    let n = each.len() as f64;
    let mean = each.iter().map(|v| v[k]).sum::<f64>() / n;
    let squares = each.iter().map(|v| (v[k] - mean).powi(2)).sum::<f64>();
    (mean, (squares / (n - 1.0).max(1.0) / n).sqrt())
}

fn main() {
    let arg = |n: usize, or: f64| {
        let given = std::env::args().nth(n);
        given.and_then(|a| a.parse().ok()).unwrap_or(or)
    };
    let (seeds, damping, finer) = (arg(1, 8.0) as u64, arg(2, 0.0) / 1000.0, arg(3, 1.0));
    let itself = std::env::args().len() > 4;
    let mut found = Vec::new();
    for first in [true, false] {
        let explicit = first && !itself;
        let each: Vec<[f64; 4]> = (1..=seeds)
            .map(|seed| {
                let mut s = Sums::default();
                let finer = if first { 1.0 } else { finer };
                run(seed, explicit, [damping, finer], &mut s);
                let rms = |sum: f64| (sum / s.n).sqrt();
                [
                    s.reach / s.n,
                    rms(s.reach2),
                    rms(s.speed2),
                    s.strain * 100.0,
                ]
            })
            .collect();
        let strain = each.iter().map(|v| v[3]).fold(0.0, f64::max);
        let [a, b, c] = [0, 1, 2].map(|k| mean(&each, k));
        println!(
            "{}: hem reach mean {:.4} +- {:.4} m, rms {:.4} +- {:.4} m; rms speed {:.4} +- {:.4} m/s; largest strain {strain:.2} %",
            if explicit { "reference " } else { "production" },
            a.0,
            a.1,
            b.0,
            b.1,
            c.0,
            c.1,
        );
        found.push(each);
    }
    let [first, second] = [&found[0], &found[1]];
    let off: Vec<[f64; 4]> = first
        .iter()
        .zip(second)
        .map(|(a, b)| std::array::from_fn(|k| b[k] - a[k]))
        .collect();
    for (k, name) in ["mean reach", "rms reach", "rms speed"].iter().enumerate() {
        let (of, (off, error)) = (mean(first, k).0 / 100.0, mean(&off, k));
        println!(
            "{seeds} seeds, second against first, seed by seed: {name} {:+.2} % +- {:.2}",
            off / of,
            error / of
        );
    }
}
