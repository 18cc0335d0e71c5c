//! The denoiser: led by what the renderer knows besides colour, and aware of the gaps in the cloth.
//!
//! 1. the picture is divided by the albedo, so that prints and weaves are not blurred;
//! 2. single bright specks (fireflies) are brought down to what their neighbourhood makes believable;
//! 3. light that was scattered at most once keeps its fine edges: every pixel becomes a weighted mean of a window, a
//!    weight is the smaller of the likeness of colours, measured in units of their own noise over small patches, and the
//!    likeness of albedo, normal, depth and gap (`patches`; after Rousselle, Manzi, Zwicker, "Robust Denoising using
//!    Feature and Color Information", 2013, simplified);
//! 4. light that was scattered before changes slowly, and its noise is shared by blocks of pixels: it is smoothed widely
//!    (`wide`). A film without the layer "indirect" goes through 3 as a whole.
//!
//! Last, a pixel that the filter found nothing alike for, as where an edge mixes two surfaces, and that is darker or brighter than
//! all around it within its noise, takes a neighbour's light (`specks`).
//!
//! What is seen through the gaps carries almost no noise (the renderer splits it off without a coin), so measured in
//! that noise its edges are steep and stay; the gap's own edges count as a feature. Each light layer gets the same weights,
//! so their sum stays the picture.
//!
//! The filters add weighted *differences* to a pixel: a constant picture comes back bit for bit.

mod patches;
mod specks;
mod wide;

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

/// One number a pixel, row by row.
type Plane = Vec<f32>;

/// Filters "beauty" and every "light.*" layer in place, and "indirect*" with them. Layers "albedo", "normal", "depth",
/// "gap", "indirect" and the variances lead it; those that are missing are done without.
pub fn denoise(film: &mut Film, settings: &Settings) {
    let size = [film.width, film.height];
    if film.layer(BEAUTY).is_none() {
        return;
    }
    let guides = guides(film);
    let divisor: Vec<[f32; 3]> = guides
        .iter()
        .map(|g| g.albedo.map(|a| if a > DARK { a } else { 1.0 }))
        .collect();
    let slow = part(film, "indirect", "indirect.", &Layers::new());
    let quick = part(film, BEAUTY, "light.", &slow);
    let variance = if slow.is_empty() {
        "variance"
    } else {
        "direct.variance"
    };
    let noise = noise(film.layer(variance), &quick[0].1, &divisor, size, 1);
    let quick = filtered(
        quick,
        &noise,
        &divisor,
        &guides,
        size,
        settings,
        patches::filter,
    );
    let slow = if slow.is_empty() {
        slow
    } else {
        // Blocks share their noise: without samples to tell it, only a wide neighbourhood does.
        let variance = film.layer("indirect.variance");
        let noise = self::noise(variance, &slow[0].1, &divisor, size, 8);
        filtered(
            slow,
            &noise,
            &divisor,
            &guides,
            size,
            settings,
            wide::filter,
        )
    };
    for (k, (name, pixels)) in quick.into_iter().enumerate() {
        let mut pixels = pixels;
        if let Some((_, slow)) = slow.get(k) {
            for (p, s) in pixels.iter_mut().zip(slow) {
                *p = [0, 1, 2].map(|c| p[c] + s[c]);
            }
        }
        film.push(&name, pixels);
    }
    for (name, pixels) in slow {
        film.push(&name, pixels);
    }
}

/// Layers by name.
type Layers = Vec<(String, Vec<[f32; 3]>)>;
/// A filter: sources, noise of the first, guides, width, height, settings; gives what is to be added to the sources.
type Filter = fn(&[&[[f32; 3]]], &[f32], &[Guide], usize, usize, &Settings) -> Vec<Vec<[f32; 3]>>;

/// The layer `whole` and those of single lights, less those of `other` in the same order; nothing without the whole.
fn part(film: &Film, whole: &str, of_light: &str, other: &Layers) -> Layers {
    let mut layers: Layers = film
        .layers
        .iter()
        .filter(|l| {
            l.name == whole || (l.name.starts_with(of_light) && !l.name.ends_with("variance"))
        })
        .map(|l| (l.name.clone(), l.pixels.clone()))
        .collect();
    layers.sort_by_key(|(name, _)| name != whole);
    for ((_, pixels), (_, less)) in layers.iter_mut().zip(other) {
        for (p, l) in pixels.iter_mut().zip(less) {
            *p = [0, 1, 2].map(|c| p[c] - l[c]);
        }
    }
    layers
}

/// The layers divided by the albedo, freed of specks, filtered, and multiplied again.
fn filtered(
    layers: Layers,
    noise: &[f32],
    divisor: &[[f32; 3]],
    guides: &[Guide],
    [width, height]: [usize; 2],
    settings: &Settings,
    filter: Filter,
) -> Layers {
    let divided: Vec<Vec<[f32; 3]>> = layers
        .iter()
        .map(|(_, p)| {
            let pairs = p.iter().zip(divisor);
            pairs.map(|(c, d)| [0, 1, 2].map(|k| c[k] / d[k])).collect()
        })
        .collect();
    let mut tamed = divided;
    let scale = specks::tame(&mut tamed[0], width, height);
    for layer in &mut tamed[1..] {
        for (p, s) in layer.iter_mut().zip(&scale) {
            *p = p.map(|c| c * s);
        }
    }
    let sources: Vec<&[[f32; 3]]> = tamed.iter().map(Vec::as_slice).collect();
    let mut changes = filter(&sources, noise, guides, width, height, settings);
    specks::mend(&sources, &mut changes, noise, width, height);
    layers
        .into_iter()
        .zip(changes)
        .map(|((name, mut pixels), change)| {
            for (i, p) in pixels.iter_mut().enumerate() {
                for c in 0..3 {
                    let v = p[c] * scale[i] + divisor[i][c] * change[i][c];
                    p[c] = if v.is_finite() { v.max(0.0) } else { p[c] };
                }
            }
            (name, pixels)
        })
        .collect()
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

/// Variance of the mean of each divided pixel (luminance), smoothed: from a layer, or else from how much a pixel differs
/// from its neighbours up to `reach`.
fn noise(
    variance: Option<&[[f32; 3]]>,
    pixels: &[[f32; 3]],
    divisor: &[[f32; 3]],
    [width, height]: [usize; 2],
    reach: usize,
) -> Vec<f32> {
    let raw: Vec<f32> = match variance {
        Some(v) => v
            .iter()
            .zip(divisor)
            .map(|(v, d)| v[0].clamp(0.0, 1e12) / luminance(*d).powi(2).max(1e-6))
            .collect(),
        None => {
            let lum: Vec<f32> = pixels
                .iter()
                .zip(divisor)
                .map(|(c, d)| luminance([0, 1, 2].map(|k| c[k] / d[k])))
                .collect();
            let mean = blur(&lum, width, height, reach);
            // The mean of n has an n-th of the noise in common with its middle.
            let n = ((2 * reach + 1) * (2 * reach + 1)) as f32;
            lum.iter()
                .zip(mean)
                .map(|(l, m)| (l - m) * (l - m) * (n / (n - 1.0)))
                .collect()
        }
    };
    // Few samples tell their own scatter badly, and a dark one among bright ones believes itself exact.
    let near = blur(&raw, width, height, 1 + reach);
    raw.iter()
        .zip(near)
        .map(|(a, b)| a.min(b * 4.0).max(b * 0.5))
        .collect()
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

#[cfg(test)]
mod tests;
