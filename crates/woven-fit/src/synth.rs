//! Measurements whose truth is known: the published sets and scans of any model, with seeded noise.
//!
//! The sets follow the paper's geometry: 79 directions in one plane, light along the normal. Their generator is none
//! of the fitted models exactly: f(θ) = (1 + (tan(|θ|/2)/tan 3°)²)^-p + k_d cosθ, averaged over ±1°, divided by its
//! greatest value, with noise y (1 + 0.01 N) + 0.002 N. p near 2 is the tail of the GGX family, p = 1.5 that of
//! Henyey and Greenstein, so each set builds in its winner: finding it proves the fitter right, not a model.

use crate::starts::normal;
use woven_bsdf::angles::radians;
use woven_bsdf::measured::csv::{Sample, Scan};
use woven_bsdf::model::ModelInfo;
use woven_bsdf::vec3::Vec3;

/// A published set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Set {
    /// Its name.
    pub name: &'static str,
    /// Exponent of the tail.
    pub p: f64,
    /// Even part.
    pub k_d: f64,
}

/// The sets: in the first the paper's winner wins, in the others it must lose.
pub const SETS: [Set; 3] = [
    Set {
        name: "paper79",
        p: 2.2,
        k_d: 0.02,
    },
    Set {
        name: "hgf79",
        p: 1.5,
        k_d: 0.02,
    },
    Set {
        name: "kd79",
        p: 2.0,
        k_d: 0.08,
    },
];

/// Number of directions of the paper's scans.
pub const POINTS: usize = 79;

/// The direction at the signed angle θ (degrees) from straight through, in the weft plane; light along the normal.
fn outgoing(theta_deg: f64, phi: f64) -> Vec3<f64> {
    let w = Vec3::from_angles(radians(theta_deg), phi);
    Vec3::new(w.x, w.y, -w.z)
}

/// Angles of the paper's scan, degrees: -80 to 80 in steps of 80/39.
pub fn angles() -> impl Iterator<Item = f64> {
    (0..POINTS).map(|i| -80.0 + 80.0 / 39.0 * i as f64)
}

impl Set {
    /// The set with the noise of `seed`; none for `None`.
    pub fn scan(&self, seed: Option<u64>) -> Scan {
        let width = radians(3.0).tan();
        let f = |theta_deg: f64| {
            let t = (radians(theta_deg.abs()) / 2.0).tan() / width;
            (1.0 + t * t).powf(-self.p) + self.k_d * radians(theta_deg).cos()
        };
        let window = |theta: f64| {
            (0..41)
                .map(|k| f(theta - 1.0 + 0.05 * f64::from(k)))
                .sum::<f64>()
                / 41.0
        };
        let clean: Vec<f64> = angles().map(window).collect();
        let peak = clean.iter().copied().fold(0.0, f64::max);
        let noise = |i: usize, y: f64| match seed {
            Some(seed) => {
                y * (1.0 + 0.01 * normal(seed, 2 * i as u64))
                    + 0.002 * normal(seed, 2 * i as u64 + 1)
            }
            None => y,
        };
        let samples = angles()
            .zip(&clean)
            .enumerate()
            .map(|(i, (theta, y))| Sample {
                l: Vec3::new(0.0, 0.0, 1.0),
                v: outgoing(theta, 0.0),
                f: noise(i, y / peak),
                sigma: None,
            });
        Scan {
            comments: vec![format!(
                "woven-fit synth {}{}: f = (1 + (tan(|theta|/2)/tan 3 deg)^2)^-{} + {} cos theta, mean over +-1 deg, peak 1",
                self.name,
                seed.map_or(" without noise".to_owned(), |s| format!(" --seed {s}")),
                self.p,
                self.k_d
            )],
            direct: Vec::new(),
            samples: samples.collect(),
        }
    }
}

/// A scan of `model` with known parameters: for each incidence (degrees in the weft plane) the 79 angles in the planes
/// along weft and warp; normal noise of standard deviation `noise` times the greatest value.
pub fn scan_of(
    model: &ModelInfo,
    values: &[f64],
    incidences_deg: &[f64],
    noise: f64,
    seed: u64,
) -> Scan {
    let (linear, shape) = model.split(values);
    let mut samples = Vec::new();
    for &incidence in incidences_deg {
        let l = Vec3::from_angles(radians(incidence), std::f64::consts::PI);
        for phi in [0.0, std::f64::consts::FRAC_PI_2] {
            for theta in angles() {
                let v = outgoing(theta, phi);
                let f = woven_bsdf::model::dot(&linear, &(model.f64.basis)(&shape, l, v));
                samples.push(Sample {
                    l,
                    v,
                    f,
                    sigma: None,
                });
            }
        }
    }
    let peak = samples.iter().map(|s| s.f).fold(0.0, f64::max);
    for (i, s) in samples.iter_mut().enumerate() {
        s.f += noise * peak * normal(seed, i as u64);
    }
    Scan {
        comments: vec![format!(
            "woven-fit synth: {} {values:?}, noise {noise}, seed {seed}",
            model.name
        )],
        direct: Vec::new(),
        samples,
    }
}
