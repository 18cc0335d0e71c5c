//! Falling and hanging: V1 to V4.

use super::{Row, cloth, run, step_of};
use std::f64::consts::TAU;
use woven_cloth::*;

pub(crate) fn free_fall() -> Vec<Row> {
    let mut rows = Vec::new();
    let mut sheet = Sheet::flat(9, 12, 0.5, 0.6, cloth());
    let mut stepper = Stepper::new(&sheet, 1.0 / 1200.0, GRAVITY);
    run(&mut stepper, &mut sheet, 1.0);
    rows.push(Row::new(
        "V1",
        "free fall of 1 s, m",
        -4.905,
        sheet.x[1][3],
        5e-4,
    ));
    rows.push(Row::new(
        "V1",
        "  strain of the falling sheet",
        0.0,
        sheet.max_strain(),
        1e-6,
    ));
    let mut sheet = Sheet::flat(9, 12, 0.5, 0.6, cloth());
    let dt = explicit_step(&sheet).min(1e-4);
    let mut reference = Reference::new(&sheet, dt, GRAVITY);
    let steps = (1.0 / dt).round();
    reference.begin(&mut sheet);
    for _ in 0..steps as usize {
        reference.step(&mut sheet);
    }
    rows.push(Row::new(
        "V1",
        "  the same, reference",
        -0.5 * GRAVITY * (steps * dt).powi(2),
        sheet.x[1][3],
        1e-4,
    ));
    rows
}

pub(crate) fn hang() -> Vec<Row> {
    let mut rows = Vec::new();
    for ny in [32, 64, 128, 256] {
        let mut sheet = Sheet::flat(4, ny, 0.3, 2.4, cloth());
        sheet.pin_top();
        let dt = step_of(&sheet);
        let mut stepper = Stepper::new(&sheet, dt, GRAVITY);
        // Axial waves of 13 Hz die within a tenth of a second.
        stepper.settling = 40.0;
        run(&mut stepper, &mut sheet, 0.6);
        let hem = -sheet.x[1][(ny - 1) * 4 + 1] - 2.4;
        rows.push(Row::new(
            "V2",
            format!("hang, {ny} rows: hem below its rest, mm"),
            1.69517,
            hem * 1e3,
            0.01,
        ));
        rows.push(Row::new(
            "V2",
            "  mean warp strain, %",
            0.070632,
            sheet.mean_warp_strain() * 100.0,
            0.01,
        ));
        if ny == 64 {
            let weight = 0.12 * 0.3 * 2.4 * GRAVITY;
            rows.push(Row::new(
                "V3",
                "force of the rail over the weight",
                1.0,
                sheet.support_force(GRAVITY)[1] / weight,
                1e-3,
            ));
        }
    }
    rows
}

/// Impulse of all outer forces against the change of momentum over 4 s of gusts.
pub(crate) fn impulse() -> Vec<Row> {
    let mut sheet = Sheet::flat(17, 33, 0.8, 1.2, cloth());
    sheet.pin_top();
    let mut stepper = Stepper::new(&sheet, 1.0 / 2400.0, GRAVITY);
    let weight = sheet.total_mass() * GRAVITY;
    let (mut sum, mut air_sum, mut t) = ([0.0; 3], 0.0, 0.0);
    let dt = stepper.dt();
    let momentum = |s: &Sheet, c: usize| (0..s.len()).map(|k| s.mass[k] * s.v[c][k]).sum::<f64>();
    for _ in 0..(4.0 / dt) as usize {
        let u = 1.5 + 0.8 * (TAU * 0.7 * t).sin();
        stepper.air = uniform_wind_forces(&sheet, [0.2 * u, 0.0, u], 1.0);
        // What the pinned row takes of the wind goes into the rail.
        let push: [f64; 3] =
            std::array::from_fn(|c| (17..sheet.len()).map(|k| stepper.air[c][k]).sum());
        let before = sheet.support_force(GRAVITY);
        stepper.step(&mut sheet);
        let after = sheet.support_force(GRAVITY);
        for c in 0..3 {
            sum[c] += dt * (push[c] + 0.5 * (before[c] + after[c]));
        }
        sum[1] -= dt * weight;
        air_sum += dt * push[2];
        t += dt;
    }
    let worst = (0..3)
        .map(|c| (momentum(&sheet, c) - sum[c]).abs())
        .fold(0.0, f64::max);
    vec![Row::new(
        "V3",
        "impulse minus momentum over 4 s of gusts, share of the wind's impulse",
        0.0,
        worst / air_sum,
        1e-3,
    )]
}

pub(crate) fn catenary() -> Vec<Row> {
    let mut rows = Vec::new();
    for (length, sag) in [(1.05, 0.13930), (1.2, 0.29234), (2.0, 0.79639)] {
        let n = 65;
        let m = Mechanics {
            tensile_warp: 1e5,
            bending_warp: 0.0,
            bending_weft: 0.0,
            shear: 0.0,
            ..cloth()
        };
        let mut sheet = Sheet::flat(2, n, 0.03, length, m);
        // A V of the right length.
        let depth = (length * length / 4.0 - 0.25f64).sqrt();
        for k in 0..sheet.len() {
            let s = (k / 2) as f64 / (n - 1) as f64;
            sheet.set_position(
                k,
                [
                    s,
                    -depth * (1.0 - (2.0 * s - 1.0).abs()),
                    (k % 2) as f64 * 0.03,
                ],
            );
        }
        for k in [0, 1, 2 * n - 2, 2 * n - 1] {
            sheet.pin(k);
        }
        let mut stepper = Stepper::new(&sheet, 1.0 / 1200.0, GRAVITY);
        stepper.settling = 8.0;
        run(&mut stepper, &mut sheet, 3.0);
        let lowest = sheet.x[1].iter().copied().fold(0.0, f64::min);
        rows.push(Row::new(
            "V4",
            format!("catenary of length {length} m over 1 m: sag, m"),
            sag,
            -lowest,
            0.005,
        ));
    }
    rows
}
