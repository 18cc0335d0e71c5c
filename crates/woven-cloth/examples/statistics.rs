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
        stable_step(&sheet, GRAVITY)
    };
    let steps = (tick / longest).ceil().max(2.0);
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
        let mut s = Sums::default();
        for seed in 1..=seeds {
            run(seed, explicit, &mut s);
        }
        let values = [
            s.reach / s.n,
            (s.reach2 / s.n).sqrt(),
            (s.speed2 / s.n).sqrt(),
            s.strain * 100.0,
        ];
        println!(
            "{}: hem reach mean {:.4} m, rms {:.4} m; rms speed {:.4} m/s; largest strain {:.2} %",
            if explicit { "reference " } else { "production" },
            values[0],
            values[1],
            values[2],
            values[3]
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
