//! Non-local means over small patches: for noise that is each pixel's own.

use rayon::prelude::*;

use super::{Guide, Plane, Settings, fall, planes};

/// Rows that one task filters.
const BAND: usize = 16;

/// Everything the weights are made of, as planes, so that the loops over a row run on several pixels at once.
struct Lead {
    /// Divided colour.
    colour: [Plane; 3],
    noise: Plane,
    /// Albedo, normal, log depth and gap, each divided by the difference that counts as another surface.
    guides: [Plane; 8],
    /// Forgiven standard deviations, squared.
    k2: f32,
}

impl Lead {
    fn new(pixels: &[[f32; 3]], noise: &[f32], guides: &[Guide], s: &Settings) -> Self {
        let plane = |f: &dyn Fn(&Guide) -> f32| -> Plane { guides.iter().map(f).collect() };
        Lead {
            colour: planes(pixels),
            noise: noise.to_vec(),
            guides: [
                plane(&|g| g.albedo[0] / s.albedo),
                plane(&|g| g.albedo[1] / s.albedo),
                plane(&|g| g.albedo[2] / s.albedo),
                plane(&|g| g.normal[0] / s.normal),
                plane(&|g| g.normal[1] / s.normal),
                plane(&|g| g.normal[2] / s.normal),
                // A difference of logarithms is a relative difference.
                plane(&|g| (g.depth + 1e-6).ln() / s.depth),
                plane(&|g| g.gap / s.gap),
            ],
            k2: s.strength * s.strength,
        }
    }

    /// Squared differences of the pixels `a..a + n` and `b..b + n` in units of their noise, the part that noise alone
    /// explains taken off; Rousselle et al. (1).
    fn distances(&self, a: usize, b: usize, out: &mut [f32]) {
        let n = out.len();
        let [r, g, bl] = &self.colour;
        let (ra, ga, ba, va) = (
            &r[a..a + n],
            &g[a..a + n],
            &bl[a..a + n],
            &self.noise[a..a + n],
        );
        let (rb, gb, bb, vb) = (
            &r[b..b + n],
            &g[b..b + n],
            &bl[b..b + n],
            &self.noise[b..b + n],
        );
        for i in 0..n {
            let (dr, dg, db) = (ra[i] - rb[i], ga[i] - gb[i], ba[i] - bb[i]);
            let d2 = (dr * dr + dg * dg + db * db) * (1.0 / 3.0);
            // The floor lets rounding differences of flat, noiseless regions pass.
            let floor = 1e-6 + 1e-5 * (ga[i] * ga[i] + gb[i] * gb[i]);
            out[i] = (d2 - (va[i] + va[i].min(vb[i]))) / (floor + self.k2 * (va[i] + vb[i]));
        }
    }

    /// Turns patch distances of the pixels `a..` against `b..` into weights: the smaller of both likenesses.
    fn weights(&self, a: usize, b: usize, patches: &mut [f32]) {
        let n = patches.len();
        let [a0, a1, a2, n0, n1, n2, z, o] = &self.guides;
        let (pa0, pa1, pa2, pz) = (&a0[a..a + n], &a1[a..a + n], &a2[a..a + n], &z[a..a + n]);
        let (qa0, qa1, qa2, qz) = (&a0[b..b + n], &a1[b..b + n], &a2[b..b + n], &z[b..b + n]);
        let (pn0, pn1, pn2, po) = (&n0[a..a + n], &n1[a..a + n], &n2[a..a + n], &o[a..a + n]);
        let (qn0, qn1, qn2, qo) = (&n0[b..b + n], &n1[b..b + n], &n2[b..b + n], &o[b..b + n]);
        for i in 0..n {
            let square3 = |x: f32, y: f32, z: f32| x * x + y * y + z * z;
            let albedo = square3(pa0[i] - qa0[i], pa1[i] - qa1[i], pa2[i] - qa2[i]);
            let normal = square3(pn0[i] - qn0[i], pn1[i] - qn1[i], pn2[i] - qn2[i]);
            let (far, gap) = (pz[i] - qz[i], po[i] - qo[i]);
            let worst = albedo.max(normal).max(far * far).max(gap * gap);
            patches[i] = fall(patches[i].max(0.0).max(worst));
        }
    }
}

/// For every source the weighted mean difference of each pixel to its window. Weights come from `sources[0]`.
pub(super) fn filter(
    sources: &[&[[f32; 3]]],
    noise: &[f32],
    guides: &[Guide],
    width: usize,
    height: usize,
    s: &Settings,
) -> Vec<Vec<[f32; 3]>> {
    let lead = Lead::new(sources[0], noise, guides, s);
    let sources: Vec<[Plane; 3]> = sources.iter().map(|p| planes(p)).collect();
    let bands: Vec<Vec<Plane>> = (0..height.div_ceil(BAND))
        .into_par_iter()
        .map(|band| {
            let rows = band * BAND..((band + 1) * BAND).min(height);
            filter_band(&lead, &sources, rows, width, height, s.radius as isize)
        })
        .collect();
    (0..sources.len())
        .map(|k| {
            bands
                .iter()
                .flat_map(|band| {
                    let [r, g, b] = [&band[3 * k], &band[3 * k + 1], &band[3 * k + 2]];
                    (0..r.len()).map(|i| [r[i], g[i], b[i]])
                })
                .collect()
        })
        .collect()
}

/// The mean differences of some rows: three planes a source.
fn filter_band(
    lead: &Lead,
    sources: &[[Plane; 3]],
    rows: std::ops::Range<usize>,
    width: usize,
    height: usize,
    radius: isize,
) -> Vec<Plane> {
    let (top, count) = (rows.start, rows.len());
    let mut sums = vec![vec![0.0_f32; count * width]; sources.len() * 3];
    let mut total = vec![1.0_f32; count * width];
    // One row more on each side, for the patches.
    let mut single = vec![0.0_f32; width];
    let mut lines = vec![0.0_f32; (count + 2) * width];
    let mut weight = vec![0.0_f32; width];
    let clamp_row = |y: isize| y.clamp(0, height as isize - 1) as usize;
    for dy in -radius..=radius {
        for dx in -radius..=radius {
            if (dx, dy) == (0, 0) || dx.unsigned_abs() >= width {
                continue;
            }
            // Pixels whose partner lies in the picture.
            let from = (-dx).max(0) as usize;
            let n = width - dx.unsigned_abs();
            let shifted = (from as isize + dx) as usize;
            for row in 0..count + 2 {
                let y = (top + row) as isize - 1;
                let (y0, y1) = (clamp_row(y), clamp_row(y + dy));
                let single = &mut single[..n];
                lead.distances(y0 * width + from, y1 * width + shifted, single);
                // Patches of 3 x 3: first along the row.
                let line = &mut lines[row * width..row * width + n];
                line[0] = single[0] + single[0] + single[1.min(n - 1)];
                line[n - 1] = single[n.saturating_sub(2)] + single[n - 1] + single[n - 1];
                for x in 1..n.saturating_sub(1) {
                    line[x] = single[x - 1] + single[x] + single[x + 1];
                }
            }
            for row in 0..count {
                let y1 = (top + row) as isize + dy;
                if y1 < 0 || y1 >= height as isize {
                    continue;
                }
                let (p, q) = ((top + row) * width + from, y1 as usize * width + shifted);
                let w = &mut weight[..n];
                let (l0, l1, l2) = (
                    &lines[row * width..][..n],
                    &lines[(row + 1) * width..][..n],
                    &lines[(row + 2) * width..][..n],
                );
                for x in 0..n {
                    w[x] = (l0[x] + l1[x] + l2[x]) * (1.0 / 9.0);
                }
                lead.weights(p, q, w);
                let at = row * width + from;
                total[at..at + n]
                    .iter_mut()
                    .zip(&*w)
                    .for_each(|(t, w)| *t += w);
                for (sum, plane) in sums.iter_mut().zip(sources.iter().flatten()) {
                    let sum = &mut sum[at..at + n];
                    let (a, b) = (&plane[p..p + n], &plane[q..q + n]);
                    for x in 0..n {
                        sum[x] += w[x] * (b[x] - a[x]);
                    }
                }
            }
        }
    }
    for sum in &mut sums {
        sum.iter_mut().zip(&total).for_each(|(v, t)| *v /= t);
    }
    sums
}
