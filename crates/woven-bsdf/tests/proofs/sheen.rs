//! The sheen against a Monte Carlo of the layer of fibres that it stands for.

use crate::support::{Rng, flux};
use std::f64::consts::TAU;
use woven_bsdf::term::fuzz::{self, ALPHA, DEPTH};
use woven_bsdf::vec3::Vec3;

/// A flake's normal in proportion to what is seen of it from `w`, by trial: the distribution times (m·w), nothing of
/// `fuzz` in it but its shape S = diag(1, 1, α²).
fn flake(rng: &mut Rng, w: Vec3<f64>) -> Vec3<f64> {
    loop {
        let c = 2.0 * rng.unit() - 1.0;
        let (r, phi) = ((1.0 - c * c).sqrt(), TAU * rng.unit());
        let m = Vec3::new(r * phi.cos(), r * phi.sin(), c);
        let seen = m.dot(w).max(0.0) / (r * r + c * c / (ALPHA * ALPHA)).powi(2);
        if rng.unit() < seen {
            return m;
        }
    }
}

/// Shares of a beam from `l` that leave the top of the layer after one bounce, and after any number.
fn layer(rng: &mut Rng, l: Vec3<f64>, paths: usize) -> [f64; 2] {
    let mut out = [0.0; 2];
    for _ in 0..paths {
        // Depth from 0, the top, to DEPTH; the way on, and back to where the light came from.
        let (mut depth, mut way) = (0.0, -l);
        for bounce in 0..1000 {
            // The mean free path is 1/σ.
            depth += (1.0 - rng.unit()).ln() / fuzz::area(way) * way.z;
            if depth < 0.0 {
                out[1] += 1.0;
                out[0] += f64::from(u8::from(bounce == 1));
                break;
            }
            if depth > DEPTH {
                break;
            }
            let m = flake(rng, -way);
            way = way - m * (2.0 * way.dot(m));
        }
    }
    out.map(|n| n / paths as f64)
}

#[test]
fn sheen_of_a_layer_of_fibres() {
    let mut rng = Rng::new(71);
    println!("    θ  closed form  once   any number");
    for deg in [0.0f64, 30.0, 60.0, 75.0, 85.0] {
        let l = Vec3::from_angles(deg.to_radians(), 0.4);
        const PATHS: usize = 60_000;
        let [once, any] = layer(&mut rng, l, PATHS);
        let form = flux(&|v: Vec3<f64>| fuzz::lobe(l, v), l, false, None, (300, 48));
        println!("{deg:>5}    {form:.4}     {once:.4}  {any:.4}");
        // Four standard deviations of the count, and 2e-4 for the grid.
        let noise = 4.0 * (once * (1.0 - once) / PATHS as f64).sqrt() + 2e-4;
        assert!((form - once).abs() < noise, "{deg}: {form} {once}");
        assert!(any >= once && form < 1.0 - (-DEPTH * fuzz::area(l) / l.z).exp());
    }
}

#[test]
fn flakes_are_a_distribution() {
    // ∫ D (m·w)+ dm is the area seen from w, and the sheen's mean is what the sampler is told.
    let mut rng = Rng::new(72);
    for _ in 0..5 {
        let w = rng.direction(0.1);
        let (n, mut sum) = (400, 0.0);
        for i in 0..n * n {
            let z = -1.0 + 2.0 * ((i / n) as f64 + 0.5) / n as f64;
            let m = Vec3::from_angles(z.acos(), TAU * ((i % n) as f64 + 0.5) / n as f64);
            sum += fuzz::d(m) * m.dot(w).max(0.0);
        }
        let seen = sum * 2.0 * TAU / (n * n) as f64;
        assert!((seen / fuzz::area(w) - 1.0).abs() < 1e-3, "{seen}");
    }
    let (n, mut mean) = (200, 0.0);
    for i in 0..n {
        // Even in sin²θ, which is even in projected solid angle.
        let l = Vec3::from_angles(((i as f64 + 0.5) / n as f64).sqrt().asin(), 0.0);
        mean += flux(&|v: Vec3<f64>| fuzz::lobe(l, v), l, false, None, (100, 16)) / n as f64;
    }
    assert!((mean - fuzz::MEAN_ALBEDO).abs() < 1e-3, "{mean}");
}
