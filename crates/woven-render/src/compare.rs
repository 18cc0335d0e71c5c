//! How much two pictures differ: for people (FLIP, ΔE2000) and for numbers (relMSE, RMSE, PSNR, mean).

pub mod color;
pub mod flip;
pub mod heat;

use crate::film::Curve;
use anyhow::{Result, ensure};
use serde::Serialize;

/// A picture to compare: linear Rec.709, row by row from the top left.
#[derive(Clone, Copy, Debug)]
pub struct Picture<'a> {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// `width * height` colours.
    pub pixels: &'a [[f32; 3]],
}

/// Every measure of one comparison. `a` is the test, `b` the reference.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Report {
    /// Mean HDR-FLIP (Andersson et al. 2021) for radiance, or LDR-FLIP for 8-bit pictures; 0 same, 1 worst.
    pub flip: f64,
    /// Mean LDR-FLIP (Andersson et al. 2020) of the pictures cut off at 1.
    pub flip_ldr: f64,
    /// mean((a - b)² / (b² + 0.01)) over pixels and channels.
    pub rel_mse: f64,
    /// mean((a - b)² / 2 / (m² + 0.01)), m = (a + b) / 2: the noise of one picture, when the two differ by their seeds alone.
    pub rel_mse_two_seeds: f64,
    /// sqrt(mean((a - b)²)).
    pub rmse: f64,
    /// -20 log10(rmse) of the pictures cut off at 0..1 and sRGB encoded \[dB\]; `None` when they are the same.
    pub psnr: Option<f64>,
    /// Mean ΔE2000 of the pictures cut off at 1.
    pub delta_e2000: f64,
    /// The ΔE2000 that 95 % of the pixels stay under.
    pub delta_e2000_p95: f64,
    /// Mean of the test over pixels and channels.
    pub mean_a: f64,
    /// Mean of the reference.
    pub mean_b: f64,
    /// `mean_a / mean_b - 1`, or 0 when both are black.
    pub mean_difference: f64,
    /// Largest absolute difference of one channel.
    pub largest: f64,
}

/// A comparison and its error map, one FLIP value a pixel.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// The numbers.
    pub report: Report,
    /// FLIP per pixel, 0..=1.
    pub map: Vec<f32>,
}

/// Compares the test `a` with the reference `b`; `hdr` when the pixels are radiance rather than a finished picture.
///
/// # Errors
/// When the sizes differ, a picture is empty, or a value is not finite (the sentence says where).
pub fn compare(a: Picture<'_>, b: Picture<'_>, hdr: bool) -> Result<Comparison> {
    ensure!(
        (a.width, a.height) == (b.width, b.height),
        "the pictures have different sizes: {} x {} and {} x {}; render both with the same --size",
        a.width,
        a.height,
        b.width,
        b.height
    );
    let n = a.width * a.height;
    ensure!(
        n > 0 && a.pixels.len() == n && b.pixels.len() == n,
        "the pictures have no pixels"
    );
    for (which, p) in [("first", a.pixels), ("second", b.pixels)] {
        if let Some(i) = p.iter().position(|c| c.iter().any(|v| !v.is_finite())) {
            anyhow::bail!(
                "the {which} picture is not finite at x = {}, y = {}",
                i % a.width,
                i / a.width
            );
        }
    }
    let mut sums = Sums::default();
    for (p, q) in a.pixels.iter().zip(b.pixels) {
        for (&x, &r) in p.iter().zip(q) {
            sums.add(f64::from(x), f64::from(r));
        }
    }
    let count = (n * 3) as f64;
    let clip =
        |p: &[[f32; 3]]| -> Vec<[f32; 3]> { p.iter().map(|&c| Curve::Clip.apply(c)).collect() };
    let (ca, cb) = (clip(a.pixels), clip(b.pixels));
    let ldr = flip::ldr(&ca, &cb, a.width, a.height, flip::DEFAULT_PPD);
    let flip_ldr = mean(&ldr);
    let map = if hdr {
        flip::hdr(a.pixels, b.pixels, a.width, a.height, flip::DEFAULT_PPD)
    } else {
        ldr
    };
    let mut delta: Vec<f64> = ca
        .iter()
        .zip(&cb)
        .map(|(&x, &r)| {
            color::delta_e2000(
                color::cielab(x.map(f64::from)),
                color::cielab(r.map(f64::from)),
            )
        })
        .collect();
    let delta_e2000 = delta.iter().sum::<f64>() / n as f64;
    delta.sort_by(f64::total_cmp);
    let delta_e2000_p95 = delta[((n - 1) as f64 * 0.95) as usize];
    let encoded: f64 = ca
        .iter()
        .zip(&cb)
        .flat_map(|(p, q)| p.iter().zip(q))
        .map(|(&x, &r)| {
            f64::from(crate::film::srgb_encode(x) - crate::film::srgb_encode(r)).powi(2)
        })
        .sum::<f64>()
        / count;
    let (mean_a, mean_b) = (sums.a / count, sums.b / count);
    let report = Report {
        flip: mean(&map),
        flip_ldr,
        rel_mse: sums.relative / count,
        rel_mse_two_seeds: sums.paired / count,
        rmse: (sums.square / count).sqrt(),
        psnr: (encoded > 0.0).then(|| -10.0 * encoded.log10()),
        delta_e2000,
        delta_e2000_p95,
        mean_a,
        mean_b,
        mean_difference: if mean_a == mean_b {
            0.0
        } else {
            mean_a / mean_b.abs().max(f64::MIN_POSITIVE) - 1.0
        },
        largest: sums.largest,
    };
    Ok(Comparison { report, map })
}

#[derive(Default)]
struct Sums {
    a: f64,
    b: f64,
    square: f64,
    relative: f64,
    paired: f64,
    largest: f64,
}

impl Sums {
    fn add(&mut self, x: f64, r: f64) {
        let d2 = (x - r) * (x - r);
        let m = (x + r) * 0.5;
        self.a += x;
        self.b += r;
        self.square += d2;
        self.relative += d2 / (r * r + 0.01);
        self.paired += d2 * 0.5 / (m * m + 0.01);
        self.largest = self.largest.max((x - r).abs());
    }
}

fn mean(map: &[f32]) -> f64 {
    map.iter().map(|&v| f64::from(v)).sum::<f64>() / map.len() as f64
}

/// relMSE = mean((x - r)² / (r² + 0.01)) over pixels and channels; the slices have one length.
pub fn rel_mse(test: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    let mut sums = Sums::default();
    test.iter()
        .zip(reference)
        .flat_map(|(p, q)| p.iter().zip(q))
        .for_each(|(&x, &r)| sums.add(x.into(), r.into()));
    sums.relative / (test.len().max(1) * 3) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_worked_out_by_hand() {
        let a = [[0.5_f32, 0.5, 0.5], [0.2, 0.2, 0.2]];
        let b = [[0.4_f32, 0.4, 0.4], [0.2, 0.2, 0.2]];
        let p = |pixels| Picture {
            width: 2,
            height: 1,
            pixels,
        };
        let r = compare(p(&a), p(&b), false).unwrap().report;
        assert!((r.rmse - (0.01_f64 / 2.0).sqrt()).abs() < 1e-8, "{r:?}");
        assert!((r.rel_mse - 0.01 / 0.17 / 2.0).abs() < 1e-8, "{r:?}");
        assert!(
            (r.mean_difference - (0.35 / 0.3 - 1.0)).abs() < 1e-6,
            "{r:?}"
        );
        // sRGB of 0.5 is 0.735357, of 0.4 it is 0.665185: the square of the difference, halved.
        assert!(
            (r.psnr.unwrap() - -10.0 * (0.070_172_f64.powi(2) / 2.0).log10()).abs() < 1e-3,
            "{r:?}"
        );
    }

    #[test]
    fn a_picture_equals_itself() {
        let a: Vec<[f32; 3]> = (0..64 * 48)
            .map(|i| [(i % 64) as f32 / 8.0, (i / 64) as f32 / 48.0, 0.3])
            .collect();
        let p = Picture {
            width: 64,
            height: 48,
            pixels: &a,
        };
        for hdr in [false, true] {
            let c = compare(p, p, hdr).unwrap();
            assert_eq!(
                (
                    c.report.flip,
                    c.report.rel_mse,
                    c.report.delta_e2000,
                    c.report.psnr
                ),
                (0.0, 0.0, 0.0, None)
            );
        }
    }

    #[test]
    fn what_cannot_be_compared_is_a_sentence() {
        let a = [[0.0_f32; 3]; 6];
        let mut nan = a;
        nan[4][1] = f32::NAN;
        let p = |width, height, pixels| Picture {
            width,
            height,
            pixels,
        };
        assert!(
            compare(p(3, 2, &a), p(2, 3, &a), true)
                .unwrap_err()
                .to_string()
                .contains("different sizes")
        );
        assert!(
            compare(p(3, 2, &a), p(3, 2, &nan), true)
                .unwrap_err()
                .to_string()
                .contains("x = 1, y = 1")
        );
    }
}
