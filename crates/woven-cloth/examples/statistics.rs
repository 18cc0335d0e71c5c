//! The production solver against the explicit reference in gusts: two exact solvers part within seconds, so statistics are compared.
//!
//! `cargo run --release -p woven-cloth --example statistics -- 8` hangs a sheet of 1.0 m x 2.4 m in gusts of eight seeds with either
//! solver, 4 s each, and prints mean and rms reach of the hem and rms speed over the last 2 s, and the largest strain.

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

fn sheet() -> Sheet {
    let mut sheet = Sheet::flat(25, 49, 1.0, 2.4, cloth());
    for k in 0..sheet.len() {
        // Two soft folds, so that the motion is not that of a plane.
        let [x, y, _] = sheet.position(k);
        sheet.set_position(k, [x, y, 0.01 * (12.0 * x).sin()]);
    }
    sheet.pin_top();
    sheet
}

fn run(seed: u64, explicit: bool, sums: &mut Sums) {
    let spec = WindSpec {
        speed: 2.1,
        gust: 0.3,
        turbulence: 0.0,
        ..WindSpec::default()
    };
    let wind = Wind::new(&spec, seed);
    let mut sheet = sheet();
    let tick = 1.0 / 600.0;
    let longest = if explicit {
        explicit_step(&sheet)
    } else {
        gust_step(&sheet, GRAVITY)
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

fn main() {
    let seeds: u64 = std::env::args()
        .nth(1)
        .and_then(|a| a.parse().ok())
        .unwrap_or(8);
    let mut found = Vec::new();
    for explicit in [true, false] {
        let each: Vec<[f64; 4]> = (1..=seeds)
            .map(|seed| {
                let mut s = Sums::default();
                run(seed, explicit, &mut s);
                [
                    s.reach / s.n,
                    s.reach2 / s.n,
                    s.speed2 / s.n,
                    s.strain * 100.0,
                ]
            })
            .collect();
        let n = each.len() as f64;
        let mean = |k: usize| each.iter().map(|v| v[k]).sum::<f64>() / n;
        // Standard error of a mean over the seeds, as a share of it.
        let error = |k: usize| {
            let squares = each.iter().map(|v| (v[k] - mean(k)).powi(2)).sum::<f64>();
            (squares / (n - 1.0).max(1.0) / n).sqrt() / mean(k) * 100.0
        };
        let values = [mean(0), mean(1).sqrt(), mean(2).sqrt()];
        let strain = each.iter().map(|v| v[3]).fold(0.0, f64::max);
        println!(
            "{}: hem reach mean {:.4} m (+-{:.1} %), rms {:.4} m (+-{:.1} %); rms speed {:.4} m/s (+-{:.1} %); largest strain {strain:.2} %",
            if explicit { "reference " } else { "production" },
            values[0],
            error(0),
            values[1],
            0.5 * error(1),
            values[2],
            0.5 * error(2),
        );
        found.push(values);
    }
    let off = |k: usize| (found[1][k] / found[0][k] - 1.0) * 100.0;
    println!(
        "{seeds} seeds, production against reference: mean reach {:+.2} %, rms reach {:+.2} %, rms speed {:+.2} %",
        off(0),
        off(1),
        off(2)
    );
}
