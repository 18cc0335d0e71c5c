//! The denoiser: non-local means led by what the renderer knows besides colour, and aware of the gaps in the cloth.
//!
//! After Rousselle, Manzi, Zwicker, "Robust Denoising using Feature and Color Information" (2013), simplified:
//!
//! 1. the picture is divided by the albedo, so that prints and weaves are not blurred;
//! 2. single bright specks (fireflies) are brought down to what their neighbourhood makes believable;
//! 3. every pixel becomes a weighted mean of a window; a weight is the smaller of the likeness of colours, measured in
//!    units of their own noise over small patches, and the likeness of albedo, normal, depth and gap.
//!
//! What is seen through the gaps carries almost no noise (the renderer splits it off without a coin), so measured in
//! that noise its edges are steep and stay; the gap's own edges count as a feature. Each light layer gets the same weights,
//! so their sum stays the picture.
//!
//! The filter adds weighted *differences* to a pixel: a constant picture comes back bit for bit.

use crate::film::{BEAUTY, Film};
use rayon::prelude::*;

/// How strongly to filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Half the window in pixels.
    pub radius: usize,
    /// Differences are forgiven up to about this many standard deviations.
    pub strength: f32,
    /// Difference of albedo that counts as another surface.
    pub albedo: f32,
    /// Difference of unit normals that counts as another surface.
    pub normal: f32,
    /// Relative difference of depth that counts as another surface.
    pub depth: f32,
    /// Difference of the see-through share that counts as another surface.
    pub gap: f32,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            radius: 8,
            strength: 0.6,
            albedo: 0.06,
            normal: 0.25,
            depth: 0.02,
            gap: 0.06,
        }
    }
}

/// Albedo below which a pixel is not divided by it (lamps, sky, black cloth).
const DARK: f32 = 0.03;

/// What leads the filter at one pixel.
#[derive(Clone, Copy, Default)]
struct Guide {
    albedo: [f32; 3],
    normal: [f32; 3],
    depth: f32,
    gap: f32,
}

/// Filters "beauty" and every "light.*" layer in place. Layers "albedo", "normal", "depth", "gap" and "variance" lead it;
/// those that are missing are done without.
pub fn denoise(film: &mut Film, settings: &Settings) {
    let (width, height) = (film.width, film.height);
    let Some(beauty) = film.layer(BEAUTY).map(<[_]>::to_vec) else {
        return;
    };
    let guides = guides(film);
    let divisor: Vec<[f32; 3]> = guides
        .iter()
        .map(|g| g.albedo.map(|a| if a > DARK { a } else { 1.0 }))
        .collect();
    let mut plain: Vec<[f32; 3]> = beauty
        .iter()
        .zip(&divisor)
        .map(|(c, d)| [c[0] / d[0], c[1] / d[1], c[2] / d[2]])
        .collect();
    let noise = noise(film, &plain, &divisor, width, height);
    let scale = tame(&mut plain, width, height);
    let others: Vec<(String, Vec<[f32; 3]>)> = film
        .layers
        .iter()
        .filter(|l| l.name.starts_with("light."))
        .map(|l| {
            let tamed = l
                .pixels
                .iter()
                .zip(&divisor)
                .zip(&scale)
                .map(|((c, d), s)| [0, 1, 2].map(|k| c[k] / d[k] * s))
                .collect();
            (l.name.clone(), tamed)
        })
        .collect();
    let mut sources: Vec<&[[f32; 3]]> = vec![&plain];
    sources.extend(others.iter().map(|(_, p)| p.as_slice()));
    let filtered = filter(&sources, &noise, &guides, width, height, settings);
    let names = std::iter::once(BEAUTY).chain(others.iter().map(|(n, _)| n.as_str()));
    for (name, delta) in names.zip(filtered) {
        let Some(layer) = film.layers.iter_mut().find(|l| l.name == name) else {
            continue;
        };
        for (i, p) in layer.pixels.iter_mut().enumerate() {
            for c in 0..3 {
                let v = p[c] * scale[i] + divisor[i][c] * delta[i][c];
                p[c] = if v.is_finite() { v.max(0.0) } else { p[c] };
            }
        }
    }
}

fn guides(film: &Film) -> Vec<Guide> {
    let mut out = vec![Guide::default(); film.width * film.height];
    if let Some(l) = film.layer("albedo") {
        out.iter_mut().zip(l).for_each(|(g, v)| {
            g.albedo = v.map(|c| {
                if c.is_finite() {
                    c.clamp(0.0, 1.0)
                } else {
                    0.0
                }
            });
        });
    }
    if let Some(l) = film.layer("normal") {
        out.iter_mut()
            .zip(l)
            .for_each(|(g, v)| g.normal = v.map(|c| if c.is_finite() { c } else { 0.0 }));
    }
    if let Some(l) = film.layer("depth") {
        out.iter_mut()
            .zip(l)
            .for_each(|(g, v)| g.depth = if v[0].is_finite() { v[0].max(0.0) } else { 0.0 });
    }
    if let Some(l) = film.layer("gap") {
        out.iter_mut()
            .zip(l)
            .for_each(|(g, v)| g.gap = if v[0].is_finite() { v[0] } else { 0.0 });
    }
    out
}

fn luminance(c: [f32; 3]) -> f32 {
    0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]
}

/// Variance of the mean of each divided pixel (luminance), smoothed: from the layer "variance", or else from how much
/// a pixel differs from its neighbours.
fn noise(
    film: &Film,
    plain: &[[f32; 3]],
    divisor: &[[f32; 3]],
    width: usize,
    height: usize,
) -> Vec<f32> {
    let raw: Vec<f32> = match film.layer("variance") {
        Some(v) => v
            .iter()
            .zip(divisor)
            .map(|(v, d)| v[0].clamp(0.0, 1e12) / luminance(*d).powi(2).max(1e-6))
            .collect(),
        None => {
            let lum: Vec<f32> = plain.iter().map(|c| luminance(*c)).collect();
            let mean = blur(&lum, width, height, 1);
            // The mean of 9 has a ninth of the noise in common with its middle.
            lum.iter()
                .zip(mean)
                .map(|(l, m)| (l - m) * (l - m) * (9.0 / 8.0))
                .collect()
        }
    };
    // Few samples tell their own scatter badly, and a dark one among bright ones believes itself exact.
    let near = blur(&raw, width, height, 2);
    raw.iter()
        .zip(near)
        .map(|(a, b)| a.min(b * 4.0).max(b * 0.5))
        .collect()
}

/// Brings single specks down to the brightest believable value; returns the factor for each pixel.
fn tame(plain: &mut [[f32; 3]], width: usize, height: usize) -> Vec<f32> {
    let lum: Vec<f32> = plain.iter().map(|c| luminance(*c)).collect();
    let factors: Vec<f32> = (0..plain.len())
        .into_par_iter()
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let mut near = [0.0_f32; 24];
            let mut n = 0;
            for yy in y.saturating_sub(2)..(y + 3).min(height) {
                for xx in x.saturating_sub(2)..(x + 3).min(width) {
                    if (xx, yy) != (x, y) {
                        near[n] = lum[yy * width + xx];
                        n += 1;
                    }
                }
            }
            if n < 8 {
                return 1.0;
            }
            near[..n].sort_by(|a, b| b.total_cmp(a));
            // The third brightest neighbour: an edge has more bright pixels than that, a speck with its shadow fewer.
            let limit = near[2] * 1.5 + 1e-6;
            if lum[i] > limit { limit / lum[i] } else { 1.0 }
        })
        .collect();
    plain
        .iter_mut()
        .zip(&factors)
        .for_each(|(p, f)| *p = p.map(|c| c * f));
    factors
}

/// Mean over a square of half-width `r`, cut at the border.
fn blur(source: &[f32], width: usize, height: usize, r: usize) -> Vec<f32> {
    let pass = |src: &[f32], along_x: bool| -> Vec<f32> {
        (0..src.len())
            .into_par_iter()
            .map(|i| {
                let (x, y) = (i % width, i / width);
                let (at, end) = if along_x { (x, width) } else { (y, height) };
                let range = at.saturating_sub(r)..(at + r + 1).min(end);
                let n = range.len() as f32;
                range
                    .map(|k| {
                        src[if along_x {
                            y * width + k
                        } else {
                            k * width + x
                        }]
                    })
                    .sum::<f32>()
                    / n
            })
            .collect()
    };
    pass(&pass(source, true), false)
}

/// Rows that one task filters.
const BAND: usize = 16;

/// One number a pixel, row by row.
type Plane = Vec<f32>;

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

/// (1 - x/8)^8, which is exp(-x) to the eye, ends at 8 and needs no table.
#[inline]
fn fall(x: f32) -> f32 {
    let t = (1.0 - x * 0.125).max(0.0);
    let t = t * t;
    let t = t * t;
    t * t
}

fn planes(pixels: &[[f32; 3]]) -> [Plane; 3] {
    [0, 1, 2].map(|c| pixels.iter().map(|p| p[c]).collect())
}

/// For every source the weighted mean difference of each pixel to its window. Weights come from `sources[0]`.
fn filter(
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A small generator for test noise (PCG-like hash), uniform in 0..1.
    fn random(i: usize) -> f32 {
        let mut h = (i as u32)
            .wrapping_mul(747_796_405)
            .wrapping_add(2_891_336_453);
        h = ((h >> ((h >> 28) + 4)) ^ h).wrapping_mul(277_803_737);
        ((h >> 22) ^ h) as f32 / u32::MAX as f32
    }

    /// Two walls under a soft gradient, and beside them a bright noiseless view through gaps with fine stripes.
    fn scene(noisy: bool) -> Film {
        let (w, h) = (64, 48);
        let mut film = Film::new(w, h);
        let (mut beauty, mut albedo, mut gap, mut variance) = (vec![], vec![], vec![], vec![]);
        for i in 0..w * h {
            let (x, y) = (i % w, i / w);
            let a = if x < 24 { 0.7 } else { 0.2 };
            let light = 0.5 + y as f32 / 96.0;
            let view = x >= 44;
            let n = if noisy && !view {
                (random(i) + random(i + 90_001) + random(i + 700_001) - 1.5) * 0.4
            } else {
                0.0
            };
            let v = if view {
                if x % 2 == 0 { 2.0 } else { 0.5 }
            } else {
                a * light * (1.0 + n)
            };
            beauty.push([v; 3]);
            albedo.push([if view { 0.0 } else { a }; 3]);
            gap.push([if view { 0.9 } else { 0.0 }; 3]);
            let sigma = if view { 0.0 } else { a * light * 0.2 };
            variance.push([sigma * sigma; 3]);
        }
        film.push(BEAUTY, beauty);
        film.push("albedo", albedo);
        film.push("gap", gap);
        film.push("variance", variance);
        film
    }

    #[test]
    fn noise_falls_and_the_view_through_the_gaps_stays() {
        let truth = scene(false);
        let mut film = scene(true);
        let before = crate::compare::rel_mse(film.beauty().unwrap(), truth.beauty().unwrap());
        denoise(&mut film, &Settings::default());
        let after = crate::compare::rel_mse(film.beauty().unwrap(), truth.beauty().unwrap());
        // Seen: 30 times less; a tenth is asked for.
        assert!(
            after < before * 0.1,
            "relMSE {before} before, {after} after"
        );
        for (i, (p, t)) in film
            .beauty()
            .unwrap()
            .iter()
            .zip(truth.beauty().unwrap())
            .enumerate()
        {
            assert!(i % 64 < 44 || p == t, "pixel {i}: {p:?}, not {t:?}");
        }
    }

    #[test]
    fn a_constant_picture_comes_back_bit_for_bit() {
        let mut film = Film::of_beauty(33, 21, vec![[0.1, 0.7, 3.3]; 33 * 21]);
        film.push("albedo", vec![[0.3, 0.5, 0.7]; 33 * 21]);
        film.push("variance", vec![[0.2; 3]; 33 * 21]);
        let before = film.clone();
        denoise(&mut film, &Settings::default());
        assert_eq!(film, before);
    }

    #[test]
    fn light_layers_still_add_up_to_the_picture() {
        let mut film = scene(true);
        let sun: Vec<[f32; 3]> = film
            .beauty()
            .unwrap()
            .iter()
            .map(|p| p.map(|c| c * 0.25))
            .collect();
        let sky: Vec<[f32; 3]> = film
            .beauty()
            .unwrap()
            .iter()
            .map(|p| p.map(|c| c * 0.75))
            .collect();
        film.push("light.sun", sun);
        film.push("light.sky", sky);
        denoise(&mut film, &Settings::default());
        for i in 0..64 * 48 {
            let (a, b, c) = (
                film.layer("light.sun").unwrap()[i],
                film.layer("light.sky").unwrap()[i],
                film.beauty().unwrap()[i],
            );
            assert!(
                (a[0] + b[0] - c[0]).abs() < 1e-4 * c[0].max(0.1),
                "pixel {i}"
            );
        }
    }

    #[test]
    fn a_firefly_goes_and_nothing_unfinite_comes() {
        let mut film = scene(false);
        let mut pixels = film.beauty().unwrap().to_vec();
        pixels[20 * 64 + 10] = [5000.0; 3];
        film.push(BEAUTY, pixels);
        denoise(&mut film, &Settings::default());
        assert!(film.beauty().unwrap()[20 * 64 + 10][0] < 2.0);
        assert!(
            film.beauty()
                .unwrap()
                .iter()
                .flatten()
                .all(|v| v.is_finite())
        );
    }
}
