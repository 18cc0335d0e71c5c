//! Wide smoothing of light that changes slowly over a surface: what was scattered before it came to what is seen.
//!
//! Its noise is shared by the pixels of a block (`cpu/share.rs`), so that neighbours do not tell it; only blocks far
//! apart do. An edge-avoiding à-trous wavelet (Dammertz et al. 2010) with a limit in units of the noise (Schied et al.
//! 2017, "Spatiotemporal variance-guided filtering", without time) reaches there at the price of 25 pixels a level.

use rayon::prelude::*;

use super::{Guide, Plane, Settings, fall, planes};

/// Levels: the last reaches over 2 (1 + 2 + 4 + 8 + 16) pixels.
const LEVELS: u32 = 5;
/// Levels whose steps stay within a block of pixels that share their noise: it does not fall there.
const SHARED: u32 = 3;
/// Differences are forgiven up to about this many standard deviations. FLIP (HDR) on the bench scene at 320 x 240 with 2 and
/// 8 samples a pixel, against 160: 1 gives 0.091 and 0.062, 1.7 0.080 and 0.057, 3 0.085 and 0.065.
const FORGIVEN: f32 = 1.8;
/// The B3 spline.
const SPLINE: [f32; 3] = [3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0];

/// What leads the weights, as planes.
struct Lead {
    /// Albedo, normal and gap, each divided by the difference that counts as another surface.
    guides: [Plane; 7],
    depth: Plane,
    /// Change of depth from pixel to pixel along the surface, and what is forgiven beside it.
    slope: Plane,
    slack: Plane,
}

impl Lead {
    fn new(guides: &[Guide], width: usize, height: usize, s: &Settings) -> Self {
        let plane = |f: &dyn Fn(&Guide) -> f32| -> Plane { guides.iter().map(f).collect() };
        let depth = plane(&|g| g.depth);
        let slope = (0..depth.len())
            .map(|i| {
                let (x, y) = (i % width, i / width);
                // The flatter side: at a silhouette the other one leaves the surface.
                let side = |here: usize, count: usize, stride: usize| {
                    let low = if here > 0 {
                        (depth[i] - depth[i - stride]).abs()
                    } else {
                        f32::INFINITY
                    };
                    let high = if here + 1 < count {
                        (depth[i + stride] - depth[i]).abs()
                    } else {
                        f32::INFINITY
                    };
                    let least = low.min(high);
                    if least.is_finite() { least } else { 0.0 }
                };
                side(x, width, 1).max(side(y, height, width))
            })
            .collect();
        Self {
            guides: [
                // Light that is divided by the albedo changes little with it.
                plane(&|g| g.albedo[0] / (4.0 * s.albedo)),
                plane(&|g| g.albedo[1] / (4.0 * s.albedo)),
                plane(&|g| g.albedo[2] / (4.0 * s.albedo)),
                plane(&|g| g.normal[0] / s.normal),
                plane(&|g| g.normal[1] / s.normal),
                plane(&|g| g.normal[2] / s.normal),
                plane(&|g| g.gap / (2.0 * s.gap)),
            ],
            slack: plane(&|g| 0.5 * s.depth * g.depth + 1e-6),
            depth,
            slope,
        }
    }

    /// Adds to `out` the unlikeness of the pixels `a..` and `b..`, `steps` apart.
    fn unlike(&self, a: usize, b: usize, steps: f32, out: &mut [f32]) {
        let n = out.len();
        for guide in &self.guides {
            let (p, q) = (&guide[a..a + n], &guide[b..b + n]);
            for i in 0..n {
                out[i] += (p[i] - q[i]) * (p[i] - q[i]);
            }
        }
        let (p, q) = (&self.depth[a..a + n], &self.depth[b..b + n]);
        let (slope, slack) = (&self.slope[a..a + n], &self.slack[a..a + n]);
        for i in 0..n {
            let off = (p[i] - q[i]) / (slope[i] * steps + slack[i]);
            out[i] += off * off;
        }
    }
}

/// The difference that smoothing makes to each source. `sources[0]` and the variance of its luminance lead the weights.
pub(super) fn filter(
    sources: &[&[[f32; 3]]],
    noise: &[f32],
    guides: &[Guide],
    width: usize,
    height: usize,
    s: &Settings,
) -> Vec<Vec<[f32; 3]>> {
    let lead = Lead::new(guides, width, height, s);
    let mut all: Vec<Plane> = sources.iter().flat_map(|p| planes(p)).collect();
    let mut noise = noise.to_vec();
    for level in 0..LEVELS {
        let step = 1_usize << level;
        if 2 * step >= width.min(height) {
            break;
        }
        let luminance: Plane = (0..noise.len())
            .map(|i| super::luminance([all[0][i], all[1][i], all[2][i]]))
            .collect();
        let rows: Vec<Row> = (0..height)
            .into_par_iter()
            .map(|y| smooth_row(&lead, &all, &luminance, &noise, [width, height], y, step))
            .collect();
        for (y, row) in rows.iter().enumerate() {
            let at = y * width..(y + 1) * width;
            for (plane, change) in all.iter_mut().zip(&row.changes) {
                plane[at.clone()]
                    .iter_mut()
                    .zip(change)
                    .for_each(|(p, c)| *p += c);
            }
            if level >= SHARED {
                noise[at]
                    .iter_mut()
                    .zip(&row.less)
                    .for_each(|(n, l)| *n *= l);
            }
        }
    }
    let start: Vec<[Plane; 3]> = sources.iter().map(|p| planes(p)).collect();
    (0..sources.len())
        .map(|k| {
            let after = &all[3 * k..3 * k + 3];
            (0..noise.len())
                .map(|i| std::array::from_fn(|c| after[c][i] - start[k][c][i]))
                .collect()
        })
        .collect()
}

/// What one level makes of a row.
struct Row {
    /// What is added, a plane of the row for each of all planes.
    changes: Vec<Vec<f32>>,
    /// Share of the variance that is left where noise is each pixel's own.
    less: Vec<f32>,
}

fn smooth_row(
    lead: &Lead,
    all: &[Plane],
    luminance: &[f32],
    noise: &[f32],
    [width, height]: [usize; 2],
    y: usize,
    step: usize,
) -> Row {
    let mut changes = vec![vec![0.0_f32; width]; all.len()];
    let mut total = vec![SPLINE[0] * SPLINE[0]; width];
    let mut squares = vec![total[0] * total[0]; width];
    let mut weight = vec![0.0_f32; width];
    for dy in -2_isize..=2 {
        let row = y as isize + dy * step as isize;
        if row < 0 || row >= height as isize {
            continue;
        }
        for dx in -2_isize..=2 {
            let shift = dx.unsigned_abs() * step;
            if (dx, dy) == (0, 0) || shift >= width {
                continue;
            }
            let from = if dx < 0 { shift } else { 0 };
            let n = width - shift;
            let a = y * width + from;
            let b = row as usize * width + if dx > 0 { shift } else { 0 };
            let w = &mut weight[..n];
            for (i, w) in w.iter_mut().enumerate() {
                let off = luminance[a + i] - luminance[b + i];
                let floor = 1e-12 + 1e-6 * luminance[a + i] * luminance[a + i];
                *w = off * off / (FORGIVEN * FORGIVEN * noise[a + i].max(noise[b + i]) + floor);
            }
            let steps = (dx.unsigned_abs() + dy.unsigned_abs()) * step;
            lead.unlike(a, b, steps as f32, w);
            let kernel = SPLINE[dx.unsigned_abs()] * SPLINE[dy.unsigned_abs()];
            for (i, w) in w.iter_mut().enumerate() {
                *w = kernel * fall(*w);
                total[from + i] += *w;
                squares[from + i] += *w * *w;
            }
            for (change, plane) in changes.iter_mut().zip(all) {
                for (i, w) in w.iter().enumerate() {
                    change[from + i] += w * (plane[b + i] - plane[a + i]);
                }
            }
        }
    }
    for change in &mut changes {
        change.iter_mut().zip(&total).for_each(|(c, t)| *c /= t);
    }
    let less = squares
        .iter()
        .zip(&total)
        .map(|(s, t)| s / (t * t))
        .collect();
    Row { changes, less }
}
