//! Swinging: V5 to V7, V13 and V14.

use super::{Row, cloth};
use std::f64::consts::PI;
use woven_cloth::*;

/// Bessel J0 by its integral; 400 points are exact to rounding for small arguments.
fn j0(x: f64) -> f64 {
    (0..400)
        .map(|k| (x * (PI * (f64::from(k) + 0.5) / 400.0).sin()).cos())
        .sum::<f64>()
        / 400.0
}

/// Period (s) and amplitude kept per period of mode `zero` (a zero of J0) of a hanging sheet, with the energy at start and end.
struct Swing {
    period: f64,
    kept: f64,
    loss: f64,
    gain: f64,
}

fn swing(rows: usize, zero: f64, dt: f64, seconds: f64, explicit: bool) -> Swing {
    let height = 2.4;
    let mut sheet = Sheet::flat(3, rows, 0.2, height, cloth());
    sheet.pin_top();
    let dt = if explicit {
        explicit_step(&sheet).min(dt)
    } else {
        dt
    };
    let mut stepper = Stepper::new(&sheet, dt, GRAVITY);
    let mut reference = Reference::new(&sheet, dt, GRAVITY);
    // Start from the stretched rest: every segment keeps its stretched length, so that only the swing moves.
    let place = |sheet: &mut Sheet, amplitude: f64| {
        let (h, mut y, mut z_before) = (sheet.hy, 0.0, 0.0);
        for j in 0..rows {
            let s = j as f64 * h;
            let z = if j == 0 {
                0.0
            } else {
                amplitude * j0(zero * ((height - s) / height).max(0.0).sqrt())
            };
            if j > 0 {
                let below = 0.12 * GRAVITY * (height - s + 0.5 * h);
                let length = h * (1.0 + below / 2000.0);
                y -= (length * length - (z - z_before) * (z - z_before)).sqrt();
            }
            z_before = z;
            for k in 3 * j..3 * j + 3 {
                let x = sheet.x[0][k];
                sheet.set_position(k, [x, y, z]);
            }
        }
    };
    place(&mut sheet, 0.05);
    let hem = sheet.len() - 2;
    let energy = |s: &Sheet| s.energy(GRAVITY).total();
    // The rest's energy is what the swing's is measured from: the same sheet with z = 0.
    let mut flat = sheet.clone();
    place(&mut flat, 0.0);
    let (rest, start) = (energy(&flat), energy(&sheet));
    let scale = start - rest;
    if explicit {
        reference.begin(&mut sheet);
    }
    let (mut crossings, mut peaks, mut t) = (Vec::new(), Vec::new(), 0.0);
    let (mut z1, mut z2) = (sheet.x[2][hem], sheet.x[2][hem]);
    let mut most = 0.0f64;
    let count = (seconds / dt) as usize;
    for n in 0..count {
        if explicit {
            reference.step(&mut sheet)
        } else {
            stepper.step(&mut sheet)
        }
        t += dt;
        let z = sheet.x[2][hem];
        if z1 > 0.0 && z <= 0.0 {
            crossings.push(t - dt * z / (z - z1));
        }
        if z1 > z2 && z1 >= z && z1 > 0.0 {
            peaks.push(z1);
        }
        if n % 50 == 49 && !explicit {
            most = most.max((energy(&sheet) - start) / scale);
        }
        (z2, z1) = (z1, z);
    }
    let cycles = crossings.len() - 1;
    let period = (crossings[cycles] - crossings[0]) / cycles as f64;
    let kept = if peaks.len() > 1 {
        (peaks[peaks.len() - 1] / peaks[0]).powf(1.0 / (peaks.len() - 1) as f64)
    } else {
        1.0
    };
    if explicit {
        // Bring the velocity to the same time as the positions before asking for the energy.
        reference.finish(&mut sheet);
        let loss = (start - energy(&sheet)) / scale;
        return Swing {
            period,
            kept,
            loss,
            gain: 0.0,
        };
    }
    Swing {
        period,
        kept,
        loss: (start - energy(&sheet)) / scale,
        gain: most,
    }
}

pub(crate) fn swings() -> Vec<Row> {
    let first = swing(32, 2.404_825_557_7, 1.0 / 1200.0, 10.4, false);
    let second = swing(32, 5.520_078_110_3, 1.0 / 1200.0, 6.0, false);
    let fine = swing(96, 2.404_825_557_7, 1.0 / 1200.0, 8.0, false);
    let reference = swing(32, 2.404_825_557_7, 1e-3, 10.4, true);
    vec![
        Row::new(
            "V5",
            "swing of a hung sheet, 32 rows: T1, s",
            2.58462,
            first.period,
            0.003,
        ),
        Row::new(
            "V5",
            "  amplitude kept in a period (0.99 asked for)",
            1.0,
            first.kept,
            0.01,
        ),
        Row::new("V5", "  T2, s", 1.12599, second.period, 0.01),
        Row::new("V15", "  T1 with 96 rows, s", 2.58462, fine.period, 0.003),
        Row::new(
            "V5",
            "  T1 by the reference, s",
            2.58462,
            reference.period,
            0.003,
        ),
        Row::new(
            "V13",
            "energy lost in 10 s of that swing (2 % allowed)",
            0.0,
            first.loss,
            0.02,
        ),
        Row::new("V13", "  most ever gained", 0.0, first.gain.max(0.0), 0.001),
        Row::new(
            "V13",
            "  drift of the reference",
            0.0,
            reference.loss.abs(),
            0.001,
        ),
    ]
}

fn pendulum_period(degrees: f64, dt: f64) -> f64 {
    let m = Mechanics {
        tensile_warp: 1e5,
        shear: 0.0,
        bending_warp: 0.0,
        bending_weft: 0.0,
        ..cloth()
    };
    let mut sheet = Sheet::flat(2, 2, 0.1, 1.0, m);
    sheet.pin_top();
    let a = degrees.to_radians();
    for k in 2..4 {
        let x = sheet.x[0][k];
        sheet.set_position(k, [x, -a.cos(), a.sin()]);
    }
    let mut stepper = Stepper::new(&sheet, dt, GRAVITY);
    let (mut crossings, mut t, mut before) = (Vec::new(), 0.0, sheet.x[2][2]);
    while crossings.len() < 3 {
        stepper.step(&mut sheet);
        t += dt;
        let z = sheet.x[2][2];
        if before > 0.0 && z <= 0.0 {
            crossings.push(t - dt * z / (z - before));
        }
        before = z;
    }
    (crossings[2] - crossings[0]) / 2.0
}

pub(crate) fn pendulum() -> Vec<Row> {
    let mut rows = Vec::new();
    for (degrees, factor) in [
        (5.0, 1.000_476),
        (30.0, 1.017_409),
        (60.0, 1.073_182),
        (90.0, 1.180_341),
    ] {
        rows.push(Row::new(
            "V6",
            format!("pendulum from {degrees}°: period, s"),
            2.006_067 * factor,
            pendulum_period(degrees, 1.0 / 1200.0),
            1e-3,
        ));
    }
    // Observed order of the production solver on the 60° pendulum.
    let exact = 2.006_067 * 1.073_182;
    let error = |n: f64| (pendulum_period(60.0, 1.0 / n) - exact).abs();
    let order = (error(100.0) / error(200.0)).log2();
    rows.push(Row::new(
        "V14",
        "order in the step, pendulum from 60° at 1/100 and 1/200 s (1 asked for)",
        2.0,
        order,
        0.5,
    ));
    rows
}

pub(crate) fn axial() -> Vec<Row> {
    let mut sheet = Sheet::flat(3, 65, 0.1, 2.4, cloth());
    sheet.pin_top();
    for k in 0..sheet.len() {
        let s = (k / 3) as f64 * sheet.hy;
        sheet.x[1][k] -= 1e-4 * (PI * s / 4.8).sin();
    }
    let dt = explicit_step(&sheet);
    let mut reference = Reference::new(&sheet, dt, 0.0);
    let (mut crossings, mut t, hem) = (Vec::new(), 0.0, sheet.len() - 2);
    let mut before = -1e-4;
    while t < 0.6 {
        reference.step(&mut sheet);
        t += dt;
        let y = sheet.x[1][hem] + 2.4;
        if before < 0.0 && y >= 0.0 {
            crossings.push(t - dt * y / (y - before));
        }
        before = y;
    }
    let n = crossings.len() - 1;
    vec![Row::new(
        "V7",
        "axial vibration, reference: frequency, Hz",
        13.448,
        n as f64 / (crossings[n] - crossings[0]),
        0.01,
    )]
}
