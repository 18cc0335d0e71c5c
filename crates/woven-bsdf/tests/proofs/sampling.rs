//! Every sampler against its density: χ², lost mass, bounded weights.

use crate::support::{Rng, chi2_exceeds, integrate};
use std::f64::consts::TAU;
use woven_bsdf::model::{MODELS, ModelInfo, dot, normalized};
use woven_bsdf::vec3::Vec3;

const Z_BINS: usize = 20;
const PHI_BINS: usize = 20;
const SAMPLES: usize = 60_000;
const SETTINGS: u64 = 4;

/// Expected counts per bin, and last the samples that find nothing.
fn expected(pdf: &dyn Fn(Vec3<f64>) -> f64) -> Vec<f64> {
    let mut out = Vec::with_capacity(Z_BINS * PHI_BINS + 1);
    for i in 0..Z_BINS {
        let z = [i, i + 1].map(|k| -1.0 + 2.0 * k as f64 / Z_BINS as f64);
        for j in 0..PHI_BINS {
            let phi = [j, j + 1].map(|k| TAU * k as f64 / PHI_BINS as f64);
            out.push(integrate(pdf, z, phi, 7));
        }
    }
    out.push(1.0 - out.iter().sum::<f64>());
    out
}

fn bin(w: Vec3<f64>) -> usize {
    if w == Vec3::zero() {
        return Z_BINS * PHI_BINS;
    }
    let i = ((w.z + 1.0) * 0.5 * Z_BINS as f64) as usize;
    let phi = w.y.atan2(w.x).rem_euclid(TAU) / TAU;
    let j = (phi * PHI_BINS as f64) as usize;
    i.min(Z_BINS - 1) * PHI_BINS + j.min(PHI_BINS - 1)
}

/// How far the weight f cosθ / (pdf Σk) of a model's sampler may rise.
fn weight_bound(model: &ModelInfo, wo: Vec3<f64>) -> f64 {
    match model.name {
        // Ward 1992: the weight is (h·v) (n·h)³ √(c_l/c_v) and more; it grows at grazing viewers, hence its warning.
        "ward" => 1.0 / wo.z.abs().sqrt() + 1.0,
        // Single-scattering weight G1 ≤ 1, the diffuse terms carry cover(l)/mean cover ≤ 1/mean cover.
        "sheet" => 4.0,
        // (m+2)/(m+1) cosθ.
        "phong" => 1.5,
        // F G (v·h)/((n·v)(n·h)), and G ≤ 2 (n·h)(n·v)/(v·h).
        "cook-torrance" => 2.0,
        // n² (1-F) G1: radiance grows by n² where light leaves the dense side.
        "ggx-walter" | "paper" => 9.0,
        // The printed D is no density; 7.22 is its mean already at normal incidence.
        "paper-literal" => 60.0 / wo.z.abs(),
        // G1 ≤ 1, F ≤ 1 or a cosine.
        _ => 1.0 + 1e-9,
    }
}

#[test]
fn samplers_follow_their_densities() {
    let tests = MODELS.len() as f64 * SETTINGS as f64;
    // Šidák: all of the tests together fail by chance with 1 %.
    let threshold = 1.0 - 0.99f64.powf(1.0 / tests);
    for model in MODELS {
        for setting in 0..SETTINGS {
            let mut rng = Rng::new(31 + setting);
            // Widths from 0.06: below, the bins are too coarse to see anything of the lobe.
            let values = rng.parameters(model, 0.06);
            let (k, shape) = model.split(&values);
            let w = normalized(&k);
            let wo = rng.direction(0.1);
            let pdf = |wi| (model.f64.pdf)(&shape, &w, wo, wi);
            let expected = expected(&pdf);
            let lost = expected[Z_BINS * PHI_BINS];
            assert!(
                lost > -2e-4,
                "{}: the density integrates to {}",
                model.name,
                1.0 - lost
            );
            let mut counts = vec![0.0; Z_BINS * PHI_BINS + 1];
            for _ in 0..SAMPLES {
                let wi = (model.f64.sample)(&shape, &w, wo, rng.three());
                counts[bin(wi)] += 1.0;
                if wi == Vec3::zero() {
                    continue;
                }
                assert!(
                    (wi.length_sqr() - 1.0).abs() < 1e-6,
                    "{}: |wi|² = {}",
                    model.name,
                    wi.length_sqr()
                );
                let p = pdf(wi);
                let f = dot(&k, &(model.f64.basis)(&shape, wi, wo));
                let weight = f * wi.z.abs() / (p * k.iter().sum::<f64>());
                assert!(
                    p > 0.0 && weight <= weight_bound(model, wo),
                    "{}: weight {weight}, pdf {p} at wo {wo:?}, wi {wi:?}, {values:?}",
                    model.name
                );
            }
            // Bins that expect few samples are pooled, so that χ² is χ².
            let (mut x2, mut bins, mut pool) = (0.0, 0usize, (0.0, 0.0));
            for (c, e) in counts.iter().zip(&expected) {
                let e = e * SAMPLES as f64;
                if e < 10.0 {
                    pool = (pool.0 + c, pool.1 + e);
                } else {
                    x2 += (c - e) * (c - e) / e;
                    bins += 1;
                }
            }
            if pool.1 > 1.0 {
                x2 += (pool.0 - pool.1).powi(2) / pool.1;
                bins += 1;
            } else {
                assert!(
                    pool.0 < 12.0,
                    "{}: {} samples where none are expected",
                    model.name,
                    pool.0
                );
            }
            let p = chi2_exceeds(x2, bins - 1);
            println!(
                "{} {setting}: χ² {x2:.0} of {bins} bins, p = {p:.3}, lost {lost:.5}",
                model.name
            );
            assert!(
                p > threshold,
                "{}: p = {p:e} below {threshold:e} ({values:?}, wo {wo:?})",
                model.name
            );
        }
    }
}
