//! FLIP: the difference a person sees when flipping between two pictures. LDR after Andersson et al., "FLIP: A Difference
//! Evaluator for Alternating Images" (2020); HDR after Andersson et al., "Visualizing Errors in Rendered High Dynamic
//! Range Images" (2021). Written from the papers; equation numbers are theirs.

use super::color::{rgb_of_ycxcz, white, xyz, ycxcz};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Pixels per degree of the papers' viewer: 0.7 m from a 0.7 m wide monitor of 3840 pixels.
pub const DEFAULT_PPD: f64 = 0.7 * 3840.0 / 0.7 * PI / 180.0;

/// Exponent of the colour difference, (2020) section 4.1.
const Q_C: f64 = 0.7;
/// Part of the greatest colour difference that is spread over [0, `P_T`].
const P_C: f64 = 0.4;
/// See [`P_C`].
const P_T: f64 = 0.95;
/// Width of the feature detectors in degrees, (2020) section 4.2.
const FEATURE_WIDTH: f64 = 0.082;

/// LDR-FLIP per pixel of two linear pictures with values in 0..=1; `ppd` is pixels per degree of visual angle.
pub fn ldr(
    test: &[[f32; 3]],
    reference: &[[f32; 3]],
    width: usize,
    height: usize,
    ppd: f64,
) -> Vec<f32> {
    let kernels = Kernels::new(ppd);
    let of = |p: &[[f32; 3]]| Seen::new(p, width, height, &kernels);
    let (t, r) = rayon::join(|| of(test), || of(reference));
    let c_max = hyab(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0])).powf(Q_C);
    (0..width * height)
        .into_par_iter()
        .map(|i| {
            // Colour pipeline, (2020) section 4.1.
            let d = hyab(t.lab[i], r.lab[i]).powf(Q_C);
            let split = P_C * c_max;
            let color = if d < split {
                P_T / split * d
            } else {
                P_T + (d - split) / (c_max - split) * (1.0 - P_T)
            };
            // Feature pipeline, (2020) (6).
            let edge = (t.edge[i] - r.edge[i]).abs();
            let point = (t.point[i] - r.point[i]).abs();
            let feature = (edge.max(point) / 2.0_f64.sqrt()).sqrt();
            // (7).
            color.clamp(0.0, 1.0).powf(1.0 - feature.clamp(0.0, 1.0)) as f32
        })
        .collect()
}

/// HDR-FLIP per pixel of two pictures of radiance: the greatest LDR-FLIP over a range of exposures that is found from
/// the reference, after an ACES-like tone curve.
pub fn hdr(
    test: &[[f32; 3]],
    reference: &[[f32; 3]],
    width: usize,
    height: usize,
    ppd: f64,
) -> Vec<f32> {
    let (start, stop) = exposures(reference);
    let count = ((stop - start).ceil() as usize).clamp(2, MAX_EXPOSURES);
    let mut worst = vec![0.0_f32; width * height];
    for k in 0..count {
        let gain = (start + (stop - start) * k as f64 / (count - 1) as f64).exp2();
        let expose = |p: &[[f32; 3]]| -> Vec<[f32; 3]> {
            p.par_iter()
                .map(|c| c.map(|v| tone(f64::from(v) * gain) as f32))
                .collect()
        };
        let map = ldr(&expose(test), &expose(reference), width, height, ppd);
        worst.iter_mut().zip(map).for_each(|(w, m)| *w = w.max(m));
    }
    worst
}

/// The range is found from light itself; a picture of one bright point in the dark must not cost hours.
const MAX_EXPOSURES: usize = 64;

/// ACES approximated by a quotient of two parabolas (Hill's fit, simplified by Narkowicz), as in the 2021 paper:
/// numerator and denominator coefficients.
const ACES: [f64; 6] = [
    0.6 * 0.6 * 2.51,
    0.6 * 0.03,
    0.0,
    0.6 * 0.6 * 2.43,
    0.6 * 0.59,
    0.14,
];

fn tone(x: f64) -> f64 {
    let x = x.max(0.0);
    let [a, b, c, d, e, f] = ACES;
    ((a * x * x + b * x + c) / (d * x * x + e * x + f)).clamp(0.0, 1.0)
}

/// First and last exposure in stops, (2021) section 3: where the brightest, and where the median, pixel reaches 0.85.
pub fn exposures(reference: &[[f32; 3]]) -> (f64, f64) {
    let [a, b, c, d, e, f] = ACES;
    let t = 0.85;
    // Solve tone(x) = t for the larger root.
    let (qa, qb, qc) = (a - t * d, b - t * e, c - t * f);
    let x = (-qb + (qb * qb - 4.0 * qa * qc).sqrt()) / (2.0 * qa);
    let mut luminance: Vec<f64> = reference.iter().map(|p| xyz(p.map(f64::from))[1]).collect();
    luminance.sort_by(f64::total_cmp);
    let n = luminance.len();
    if n == 0 || luminance[n - 1] <= 0.0 {
        return (0.0, 1.0);
    }
    let brightest = luminance[n - 1].max(1e-10);
    // The upper of the two middle ones, as in the authors' program.
    let median = luminance[n / 2];
    (
        (x / brightest).log2(),
        (x / median.max(brightest * 1e-10).max(1e-10)).log2(),
    )
}

/// What a viewer takes from one picture.
struct Seen {
    lab: Vec<[f64; 3]>,
    edge: Vec<f64>,
    point: Vec<f64>,
}

impl Seen {
    fn new(pixels: &[[f32; 3]], width: usize, height: usize, kernels: &Kernels) -> Self {
        let opponent: Vec<[f64; 3]> = pixels.par_iter().map(|p| ycxcz(p.map(f64::from))).collect();
        let plane = |k: usize| -> Vec<f64> { opponent.iter().map(|c| c[k]).collect() };
        let smooth = |k: usize| -> Vec<f64> {
            let source = plane(k);
            let mut sum = vec![0.0; source.len()];
            for (weight, kernel) in &kernels.contrast[k] {
                let part = convolve(&source, width, height, kernel, kernel);
                sum.iter_mut().zip(part).for_each(|(s, p)| *s += weight * p);
            }
            sum
        };
        let (y, (cx, cz)) = rayon::join(|| smooth(0), || rayon::join(|| smooth(1), || smooth(2)));
        let lab = (0..pixels.len())
            .into_par_iter()
            .map(|i| hunt_lab(rgb_of_ycxcz([y[i], cx[i], cz[i]]).map(|c| c.clamp(0.0, 1.0))))
            .collect();
        // Features are sought in the unfiltered, normalised Y.
        let light: Vec<f64> = opponent.iter().map(|c| (c[0] + 16.0) / 116.0).collect();
        let norm = |along: &[f64]| -> Vec<f64> {
            let (x, y) = rayon::join(
                || convolve(&light, width, height, along, &kernels.bell),
                || convolve(&light, width, height, &kernels.bell, along),
            );
            x.iter().zip(y).map(|(x, y)| x.hypot(y)).collect()
        };
        Seen {
            lab,
            edge: norm(&kernels.edge),
            point: norm(&kernels.point),
        }
    }
}

/// Separable kernels for one number of pixels per degree.
struct Kernels {
    /// For Y, Cx, Cz: Gaussians whose weighted sum is the contrast sensitivity.
    contrast: [Vec<(f64, Vec<f64>)>; 3],
    bell: Vec<f64>,
    edge: Vec<f64>,
    point: Vec<f64>,
}

impl Kernels {
    fn new(ppd: f64) -> Self {
        // (2020) table 1: (a1, b1), (a2, b2) of achromatic, red-green and blue-yellow channels.
        let table: [&[(f64, f64)]; 3] = [
            &[(1.0, 0.0047)],
            &[(1.0, 0.0053)],
            &[(34.1, 0.04), (13.5, 0.025)],
        ];
        let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * ppd).ceil() as i64;
        let contrast = table.map(|terms| {
            // Each term a sqrt(pi/b) exp(-pi² (x² + y²) / b), x and y in degrees, is a product of two lines.
            let lines: Vec<(f64, Vec<f64>)> = terms
                .iter()
                .map(|&(a, b)| {
                    let line = (-radius..=radius)
                        .map(|i| (-PI * PI * (i as f64 / ppd).powi(2) / b).exp())
                        .collect();
                    (a * (PI / b).sqrt(), line)
                })
                .collect();
            let total: f64 = lines
                .iter()
                .map(|(a, line)| a * line.iter().sum::<f64>().powi(2))
                .sum();
            lines
                .into_iter()
                .map(|(a, line)| (a / total, line))
                .collect()
        });
        let sigma = 0.5 * FEATURE_WIDTH * ppd;
        let radius = (3.0 * sigma).ceil() as i64;
        let xs = || (-radius..=radius).map(|i| i as f64);
        let gauss = |x: f64| (-x * x / (2.0 * sigma * sigma)).exp();
        let bell: Vec<f64> = xs().map(gauss).collect();
        let across: f64 = bell.iter().sum();
        // In two dimensions the positive weights sum to 1 and the negative ones to -1.
        let balance = |line: Vec<f64>| -> Vec<f64> {
            let positive: f64 = line.iter().filter(|v| **v > 0.0).sum();
            let negative: f64 = -line.iter().filter(|v| **v < 0.0).sum::<f64>();
            line.into_iter()
                .map(|v| v / if v > 0.0 { positive } else { negative })
                .collect()
        };
        Kernels {
            contrast,
            edge: balance(xs().map(|x| -x * gauss(x)).collect()),
            point: balance(
                xs().map(|x| (x * x / (sigma * sigma) - 1.0) * gauss(x))
                    .collect(),
            ),
            bell: bell.iter().map(|v| v / across).collect(),
        }
    }
}

/// Convolves with `along_x` in x and `along_y` in y; beyond the border the edge pixel goes on.
fn convolve(
    source: &[f64],
    width: usize,
    height: usize,
    along_x: &[f64],
    along_y: &[f64],
) -> Vec<f64> {
    let mut rows = vec![0.0; source.len()];
    let rx = along_x.len() / 2;
    rows.par_chunks_mut(width)
        .zip(source.par_chunks(width))
        .for_each(|(out, line)| {
            for (x, o) in out.iter_mut().enumerate() {
                *o = along_x
                    .iter()
                    .enumerate()
                    .map(|(k, w)| w * line[(x + k).saturating_sub(rx).min(width - 1)])
                    .sum();
            }
        });
    let mut out = vec![0.0; source.len()];
    let ry = along_y.len() / 2;
    out.par_chunks_mut(width).enumerate().for_each(|(y, line)| {
        for (k, w) in along_y.iter().enumerate() {
            let from = (y + k).saturating_sub(ry).min(height - 1) * width;
            line.iter_mut()
                .zip(&rows[from..from + width])
                .for_each(|(o, v)| *o += w * v);
        }
    });
    out
}

/// L*a*b* with Hunt's adjustment: chroma fades with lightness, (2020) section 4.1.
fn hunt_lab(rgb: [f64; 3]) -> [f64; 3] {
    debug_assert!(white()[1] > 0.999);
    let [l, a, b] = super::color::cielab(rgb);
    [l, 0.01 * l * a, 0.01 * l * b]
}

/// HyAB: city-block in lightness, Euclidean in chroma.
fn hyab(p: [f64; 3], q: [f64; 3]) -> f64 {
    (p[0] - q[0]).abs() + (p[1] - q[1]).hypot(p[2] - q[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn black_against_white_is_worst_and_equal_is_none() {
        let (w, h) = (24, 16);
        let (black, white) = (vec![[0.0_f32; 3]; w * h], vec![[1.0_f32; 3]; w * h]);
        assert!(
            ldr(&black, &black, w, h, DEFAULT_PPD)
                .iter()
                .all(|&v| v == 0.0)
        );
        // The authors' program (PyPI flip-evaluator 1.7) gives 0.967387 for this pair: HyAB of black and white is 100, below the greatest.
        let v = ldr(&black, &white, w, h, DEFAULT_PPD)[w * h / 2];
        // Their program works in f32 and differs by 7e-6.
        assert!((v - 0.967_387).abs() < 2e-5, "{v}");
    }

    #[test]
    fn exposures_of_a_known_picture() {
        let (start, stop) = exposures(&[[4.0; 3], [1.0; 3], [0.25; 3]]);
        assert!((stop - start - 2.0).abs() < 1e-9, "{start} {stop}");
        assert!((tone(start.exp2() * 4.0) - 0.85).abs() < 1e-9);
        let (start, stop) = exposures(&[[0.0; 3]; 4]);
        assert!(start.is_finite() && stop.is_finite());
    }
}
