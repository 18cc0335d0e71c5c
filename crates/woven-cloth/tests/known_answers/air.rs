//! Air: V11, V12, V16 and V18.

use super::{Row, cloth};
use std::f64::consts::TAU;
use woven_cloth::*;

fn plane_angle(density: f64, u: f64, rows: usize, dt: f64) -> f64 {
    let m = Mechanics {
        areal_density: density,
        ..cloth()
    };
    let mut sheet = Sheet::flat(3, rows, 0.3, 2.4, m);
    sheet.pin_top();
    let mut stepper = Stepper::new(&sheet, dt, GRAVITY);
    stepper.settling = 2.0;
    for n in 0..(12.0 / dt) as usize {
        if n % 2 == 0 {
            stepper.air = uniform_wind_forces(&sheet, [0.0, 0.0, u], 1.0);
        }
        stepper.step(&mut sheet);
    }
    let hem = sheet.position(sheet.len() - 2);
    hem[2].atan2(-hem[1]).to_degrees()
}

pub(crate) fn planes() -> Vec<Row> {
    // sin f / cos² f = rho C U² / (2 rho_s g); absolute tolerance 0.3°.
    let exact = |density: f64, u: f64| {
        let q = AIR_DENSITY * u * u / (2.0 * density * GRAVITY);
        ((-1.0 + (1.0 + 4.0 * q * q).sqrt()) / (2.0 * q))
            .asin()
            .to_degrees()
    };
    assert!((exact(0.12, 0.5) - 7.205).abs() < 0.01 && (exact(0.12, 1.0) - 24.825).abs() < 0.01);
    let mut rows = vec![
        Row::new(
            "V11",
            "plane in a wind of 0.5 m/s: angle, °",
            7.205,
            plane_angle(0.12, 0.5, 32, 1.0 / 1200.0),
            0.3 / 7.205,
        ),
        Row::new(
            "V11",
            "  1.0 m/s",
            24.825,
            plane_angle(0.12, 1.0, 32, 1.0 / 1200.0),
            0.3 / 24.825,
        ),
        Row::new(
            "V15",
            "  1.0 m/s, 64 rows",
            24.825,
            plane_angle(0.12, 1.0, 64, 1.0 / 1200.0),
            0.01,
        ),
        Row::new(
            "V14",
            "  1.0 m/s, half the step",
            24.825,
            plane_angle(0.12, 1.0, 32, 1.0 / 2400.0),
            0.01,
        ),
        Row::new(
            "V18",
            "  1.0 m/s, four times the mass",
            exact(0.48, 1.0),
            plane_angle(0.48, 1.0, 32, 1.0 / 1200.0),
            0.005,
        ),
    ];
    // A sheet that falls flat in still air.
    let mut sheet = Sheet::flat(9, 9, 0.4, 0.4, cloth());
    for k in 0..sheet.len() {
        let p = sheet.position(k);
        sheet.set_position(k, [p[0], 0.0, p[1]]);
    }
    let mut stepper = Stepper::new(&sheet, 1.0 / 1200.0, GRAVITY);
    for _ in 0..2400 {
        stepper.air = uniform_wind_forces(&sheet, [0.0; 3], 1.0);
        stepper.step(&mut sheet);
    }
    rows.push(Row::new(
        "V12",
        "sheet falling flat: speed, m/s",
        1.4007,
        -sheet.v[1][40],
        0.005,
    ));
    rows
}

/// The Fourier transform of a power of two of complex numbers (Cooley and Tukey 1965).
fn fourier(x: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let n = x.len();
    if n == 1 {
        return x;
    }
    let half = |k: usize| fourier(x.iter().skip(k).step_by(2).copied().collect());
    let (even, odd) = (half(0), half(1));
    let mut out = vec![[0.0; 2]; n];
    for k in 0..n / 2 {
        let (s, c) = (-TAU * k as f64 / n as f64).sin_cos();
        let t = [c * odd[k][0] - s * odd[k][1], s * odd[k][0] + c * odd[k][1]];
        out[k] = [even[k][0] + t[0], even[k][1] + t[1]];
        out[k + n / 2] = [even[k][0] - t[0], even[k][1] - t[1]];
    }
    out
}

pub(crate) fn wind_statistics() -> Vec<Row> {
    let spec = WindSpec {
        speed: 2.0,
        gust: 0.25,
        gust_length: 2.0,
        turbulence: 0.0,
        ramp: 0.0,
        ..WindSpec::default()
    };
    let wind = Wind::new(&spec, 4);
    // 1024 s at 128 Hz. A decade of the inertial range (f L/U >> 0.1): power in half an octave at either end.
    let (n, rate) = (1 << 17, 128.0);
    let series: Vec<f64> = (0..n).map(|k| wind.gust(f64::from(k) / rate)).collect();
    let sigma = (series.iter().map(|g| g * g).sum::<f64>() / f64::from(n)).sqrt();
    let windowed = series
        .iter()
        .enumerate()
        .map(|(k, g)| [g * (0.5 - 0.5 * (TAU * k as f64 / f64::from(n)).cos()), 0.0]);
    let spectrum = fourier(windowed.collect());
    let band = |lo: f64, hi: f64| {
        let bins = (lo * f64::from(n) / rate) as usize..(hi * f64::from(n) / rate) as usize;
        let count = bins.len() as f64;
        bins.map(|m| spectrum[m][0].powi(2) + spectrum[m][1].powi(2))
            .sum::<f64>()
            / count
    };
    let slope = (band(5.0, 10.0) / band(0.5, 1.0)).log10();
    vec![
        Row::new(
            "V16",
            "gusts: deviation over mean speed",
            0.25,
            sigma / 2.0,
            0.02,
        ),
        Row::new(
            "V16",
            "  slope of the spectrum over a decade",
            -5.0 / 3.0,
            slope,
            0.1 / (5.0 / 3.0),
        ),
    ]
}
