//! A quick filter for the first pictures, of a few samples a pixel: it spreads light within surfaces and keeps its sum.
//!
//! The à-trous wavelet of Dammertz, Sewtz, Hanika, Lensch, "Edge-Avoiding À-Trous Wavelet Transform for fast Global
//! Illumination Filtering" (2010): a 5 × 5 spline again and again with doubled gaps, stopped at edges of normal, depth and
//! albedo. Colour does not stop it: a single sample's colour says nothing. The renderer's own filter takes over when there
//! are samples enough to know their noise.

use rayon::prelude::*;
use woven_render::film::{BEAUTY, Film};

/// The B3 spline by distance from the middle.
const SPLINE: [f32; 3] = [3.0 / 8.0, 1.0 / 4.0, 1.0 / 16.0];
/// Albedo below which a pixel is not divided by it: lamps, sky.
const DARK: f32 = 0.03;

/// See [`tame`]: a curtain in the sun is a few times as bright as the mean of its room.
const BRIGHTEST: f32 = 12.0;

/// What leads the filter at one pixel.
#[derive(Clone, Copy, Default)]
struct Guide {
    albedo: [f32; 3],
    normal: [f32; 3],
    depth: f32,
    /// Share of the filtered value: less where one looks through the cloth, whose background has no guide.
    share: f32,
}

/// Filters "beauty" in place in `levels` rounds, led by "albedo", "normal", "depth" and "gap"; without them nothing is done.
pub fn smooth(film: &mut Film, levels: u32) {
    let (width, height) = (film.width, film.height);
    let Some(guides) = guides(film) else { return };
    let Some(beauty) = film.layer(BEAUTY).map(<[_]>::to_vec) else {
        return;
    };
    let divisor = |g: &Guide| g.albedo.map(|a| if a > DARK { a } else { 1.0 });
    let divide = |(c, g): (&[f32; 3], &Guide)| {
        let d = divisor(g);
        [0, 1, 2].map(|k| if c[k].is_finite() { c[k] / d[k] } else { 0.0 })
    };
    let mut light: Vec<[f32; 3]> = beauty.iter().zip(&guides).map(divide).collect();
    tame(&mut light, &guides);
    let tamed = light.clone();
    for level in 0..levels {
        light = round(&light, &guides, width, height, 1 << level);
    }
    let picture = tamed
        .iter()
        .zip(&light)
        .zip(&guides)
        .map(|((old, new), g)| {
            let d = divisor(g);
            [0, 1, 2].map(|k| (old[k] + (new[k] - old[k]) * g.share) * d[k])
        });
    film.push(BEAUTY, picture.collect());
}

/// Brings single samples that outshine everything down to [`BRIGHTEST`] times the mean of what is lit.
fn tame(light: &mut [[f32; 3]], guides: &[Guide]) {
    let lit = |g: &Guide| g.albedo.iter().any(|a| *a > DARK);
    let top = |c: &[f32; 3]| c[0].max(c[1]).max(c[2]);
    let (sum, count) = light
        .iter()
        .zip(guides)
        .filter(|(_, g)| lit(g))
        .fold((0.0_f64, 0_u32), |(s, n), (c, _)| {
            (s + f64::from(top(c)), n + 1)
        });
    let cap = BRIGHTEST * (sum / f64::from(count.max(1))) as f32;
    for (c, _) in light.iter_mut().zip(guides).filter(|(_, g)| lit(g)) {
        let top = top(c);
        if top > cap {
            *c = c.map(|k| k * (cap / top));
        }
    }
}

fn guides(film: &Film) -> Option<Vec<Guide>> {
    let (albedo, normal, depth) = (
        film.layer("albedo")?,
        film.layer("normal")?,
        film.layer("depth")?,
    );
    let gap = film.layer("gap")?;
    let guide = |i: usize| Guide {
        albedo: albedo[i],
        normal: normal[i],
        depth: depth[i][0],
        // Through a gap of a tenth and less the background is too faint to be missed in a first picture.
        share: (1.25 - 2.5 * gap[i][0]).clamp(0.0, 1.0),
    };
    Some((0..film.width * film.height).map(guide).collect())
}

/// How much two pixels have in common, 0…1; `step` pixels lie between neighbours of this round.
fn likeness(a: &Guide, b: &Guide, step: f32) -> f32 {
    let dot: f32 = (0..3).map(|k| a.normal[k] * b.normal[k]).sum();
    let albedo: f32 = (0..3).map(|k| (a.albedo[k] - b.albedo[k]).powi(2)).sum();
    // Of the sky there is neither normal nor depth.
    if (a.depth > 0.0) != (b.depth > 0.0) {
        return 0.0;
    }
    let normal = if a.depth > 0.0 {
        dot.max(0.0).powi(16)
    } else {
        1.0
    };
    let depth = (a.depth - b.depth).abs() / (0.01 * step.max(2.0) * a.depth.max(1e-3));
    normal * (-depth - albedo / 0.01).exp()
}

fn round(
    light: &[[f32; 3]],
    guides: &[Guide],
    width: usize,
    height: usize,
    step: usize,
) -> Vec<[f32; 3]> {
    let mut out = vec![[0.0; 3]; light.len()];
    out.par_chunks_mut(width.max(1))
        .enumerate()
        .for_each(|(y, row)| {
            for (x, pixel) in row.iter_mut().enumerate() {
                let guide = &guides[y * width + x];
                let (mut sum, mut weights) = ([0.0; 3], 0.0);
                for dy in -2_isize..=2 {
                    let Some(v) = y
                        .checked_add_signed(dy * step as isize)
                        .filter(|v| *v < height)
                    else {
                        continue;
                    };
                    for dx in -2_isize..=2 {
                        let Some(u) = x
                            .checked_add_signed(dx * step as isize)
                            .filter(|u| *u < width)
                        else {
                            continue;
                        };
                        let i = v * width + u;
                        let spline = SPLINE[dx.unsigned_abs()] * SPLINE[dy.unsigned_abs()];
                        let weight = spline * likeness(guide, &guides[i], step as f32);
                        weights += weight;
                        for (s, c) in sum.iter_mut().zip(&light[i]) {
                            *s += weight * c;
                        }
                    }
                }
                // The middle is always like itself, so the weights are never 0.
                *pixel = sum.map(|s| s / weights);
            }
        });
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two grey walls side by side, lit by single bright samples.
    fn walls() -> Film {
        let (w, h) = (64, 48);
        let left = |i: usize| i % w < w / 2;
        let mut film = Film::of_beauty(
            w,
            h,
            (0..w * h)
                .map(|i| {
                    if left(i) && i % 5 == 0 {
                        [5.0, 2.5, 0.5]
                    } else {
                        [0.0; 3]
                    }
                })
                .collect(),
        );
        film.push("albedo", vec![[0.5; 3]; w * h]);
        film.push(
            "normal",
            (0..w * h)
                .map(|i| {
                    if left(i) {
                        [1.0, 0.0, 0.0]
                    } else {
                        [0.0, 0.0, 1.0]
                    }
                })
                .collect(),
        );
        film.push("depth", vec![[3.0; 3]; w * h]);
        film.push("gap", vec![[0.0; 3]; w * h]);
        film
    }

    #[test]
    fn light_is_spread_but_neither_lost_nor_carried_over_an_edge() {
        let mut film = walls();
        smooth(&mut film, 4);
        let beauty = film.beauty().expect("it has one");
        let mean = |part: &dyn Fn(usize) -> bool| -> f32 {
            let chosen: Vec<_> = (0..beauty.len()).filter(|i| part(*i)).collect();
            chosen.iter().map(|&i| beauty[i][0]).sum::<f32>() / chosen.len() as f32
        };
        let left = mean(&|i| i % 64 < 32);
        // A fifth of the samples at 5; the borders of the picture are weighted anew, which moves a few percent.
        assert!((left - 1.0).abs() < 0.08, "{left}");
        assert!(mean(&|i| i % 64 >= 32) < 1e-6);
        let middle = beauty[24 * 64 + 16];
        assert!(
            (middle[0] - 1.0).abs() < 0.15 && (middle[1] / middle[0] - 0.5).abs() < 1e-3,
            "{middle:?}"
        );
    }

    #[test]
    fn an_even_picture_and_one_without_guides_stay() {
        let mut film = walls();
        film.push(BEAUTY, vec![[0.25; 3]; 64 * 48]);
        smooth(&mut film, 3);
        assert!(
            film.beauty()
                .is_some_and(|b| b.iter().flatten().all(|c| (c - 0.25).abs() < 1e-5))
        );
        let mut bare = Film::of_beauty(2, 1, vec![[1.0; 3], [0.0; 3]]);
        smooth(&mut bare, 3);
        assert_eq!(bare, Film::of_beauty(2, 1, vec![[1.0; 3], [0.0; 3]]));
    }
}
