//! The still as an anchor for the frames of the motion: what does not move nears the still's quality.
//!
//! A frame takes few paths a pixel, the still of the same room takes many, and both begin with the same random numbers. So where a
//! frame shows the same surface as the still, frame + b (still of many paths - still of few) has the frame's mean, since the bracket
//! has mean zero, and less noise, as far as the frame's noise is that of the still of few paths (control variates: Owen, Monte Carlo
//! theory, 8.9). The best b is the regression of one noise on the other; it is taken from the pixels around, whose noise is told
//! from their light as the difference to their local mean, for direct and indirect light apart. On the cloth, which moves,
//! nothing is added.

use anyhow::{Result, ensure};
use woven_render::film::{BEAUTY, Film};

/// Numbers a pixel: of direct light the bracket and the still of few paths, the same of indirect light, then albedo, normal
/// and depth.
const WIDTH: usize = 19;
/// Where the numbers of direct and of indirect light begin, half the window in which their noises are compared, and the
/// layers of their variance. Pixels of a block share the noise of indirect light, so that more of them must be looked at.
const PARTS: [(usize, usize, [&str; 2]); 2] = [
    (0, 5, ["variance", "direct.variance"]),
    (6, 16, ["indirect.variance"; 2]),
];
/// Where the numbers of the surface begin.
const GUIDE: usize = 12;
/// The least share of the variance that the denoiser is told is left: what a few samples say of their own noise is not believed further.
const LEAST: f32 = 0.6;
/// Standard deviations of the still's noise that are believed of a single pixel.
const SPECK: f32 = 3.0;
/// Differences of albedo, normal and (relative) depth above which a pixel shows something else.
const LIMITS: [f32; 3] = [0.02, 0.06, 0.004];
/// The difference that many paths make to the still, pixel by pixel, and what the still shows there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Anchor {
    pixels: Vec<[f32; WIDTH]>,
    /// Few over many: the share of the noise that the still keeps.
    rest: f32,
}

impl Anchor {
    /// From the still with few and with many paths a pixel, both with the layers "albedo", "normal" and "depth"; `rest` is few over many.
    #[must_use]
    pub fn new(few: &Film, many: &Film, rest: f32) -> Self {
        let (Some(a), Some(b), Some(guide)) = (parts(few), parts(many), guide(few)) else {
            return Self::default();
        };
        let pixel = |(i, g): (usize, [f32; 7])| {
            let mut all = [0.0; WIDTH];
            for ((at, ..), (a, b)) in PARTS.iter().zip(a.iter().zip(&b)) {
                for c in 0..3 {
                    let bracket = b[i][c] - a[i][c];
                    all[at + c] = if bracket.is_finite() { bracket } else { 0.0 };
                    all[at + 3 + c] = if a[i][c].is_finite() { a[i][c] } else { 0.0 };
                }
            }
            all[GUIDE..].copy_from_slice(&g);
            all
        };
        Self {
            pixels: guide.into_iter().enumerate().map(pixel).collect(),
            rest,
        }
    }

    /// Steadies a frame that was begun with the same random numbers as the still.
    pub fn steady(&self, film: &mut Film) {
        let Some(guide) = guide(film).filter(|g| g.len() == self.pixels.len()) else {
            return;
        };
        let Some(mut parts) = parts(film) else { return };
        let same: Vec<f32> = self
            .pixels
            .iter()
            .zip(&guide)
            .map(|(a, g)| if same(&a[GUIDE..], g) { 1.0 } else { 0.0 })
            .collect();
        for (part, (at, reach, variances)) in parts.iter_mut().zip(PARTS) {
            let size = [film.width, film.height];
            let weights = self.weights(part, at, &same, size, reach);
            for ((pixel, anchor), (b, _)) in part.iter_mut().zip(&self.pixels).zip(&weights) {
                *pixel = [0, 1, 2].map(|c| (pixel[c] + b * anchor[at + c]).max(0.0));
            }
            for layer in &mut film.layers {
                if variances.contains(&layer.name.as_str()) {
                    for (pixel, (_, left)) in layer.pixels.iter_mut().zip(&weights) {
                        *pixel = pixel.map(|v| v * left);
                    }
                }
            }
        }
        let [direct, indirect] = &parts;
        for layer in &mut film.layers {
            for ((pixel, d), i) in layer.pixels.iter_mut().zip(direct).zip(indirect) {
                match layer.name.as_str() {
                    BEAUTY => *pixel = [0, 1, 2].map(|c| d[c] + i[c]),
                    "indirect" => *pixel = *i,
                    _ => {}
                }
            }
        }
    }

    /// What share of the bracket is to be added to each pixel of a part of the light, and what share of its variance is left.
    fn weights(
        &self,
        part: &[[f32; 3]],
        at: usize,
        same: &[f32],
        [width, height]: [usize; 2],
        reach: usize,
    ) -> Vec<(f32, f32)> {
        let frame: Vec<f32> = part
            .iter()
            .zip(same)
            .map(|(p, s)| s * luminance(p))
            .collect();
        let still: Vec<f32> = self
            .pixels
            .iter()
            .zip(same)
            .map(|(a, s)| s * luminance(&a[at + 3..at + 6]))
            .collect();
        let window = |values: &[f32]| window(values, width, height, reach);
        let count = window(same);
        let noise = |values: &[f32]| -> Vec<f32> {
            let sums = window(values);
            (0..values.len())
                .map(|i| same[i] * (values[i] - sums[i] / count[i].max(1.0)))
                .collect()
        };
        let (f, r) = (noise(&frame), noise(&still));
        let sum =
            |a: &[f32], b: &[f32]| window(&a.iter().zip(b).map(|(a, b)| a * b).collect::<Vec<_>>());
        let (fr, rr, ff) = (sum(&f, &r), sum(&r, &r), sum(&f, &f));
        (0..same.len())
            .map(|i| {
                // A speck of the still that the frame does not have would leave a hole: no more than the noise around.
                let sigma = (rr[i] / count[i].max(1.0)).sqrt();
                let speck = luminance(&self.pixels[i][at..at + 3]).abs().max(1e-20);
                let b = same[i]
                    * (fr[i] / rr[i].max(1e-20)).clamp(0.0, 1.0)
                    * (SPECK * sigma / speck).min(1.0);
                let explained = (fr[i] * fr[i] / (rr[i] * ff[i]).max(1e-30)).clamp(0.0, 1.0);
                let left = (1.0 - same[i] * explained + b * b * self.rest).clamp(LEAST, 1.0);
                (b, left)
            })
            .collect()
    }

    /// For a file; read back by [`Self::from_bytes`].
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let numbers = std::iter::once(&self.rest).chain(self.pixels.iter().flatten());
        numbers.flat_map(|v| v.to_le_bytes()).collect()
    }

    /// Reads a file.
    ///
    /// # Errors
    /// When the file is not whole.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        ensure!(
            bytes.len() % (4 * WIDTH) == 4,
            "An anchor in the output folder is not whole; remove the folder's \"work\" and start again."
        );
        let number = |b: &[u8], i: usize| {
            f32::from_le_bytes([b[4 * i], b[4 * i + 1], b[4 * i + 2], b[4 * i + 3]])
        };
        let pixels = bytes[4..]
            .chunks_exact(4 * WIDTH)
            .map(|b| std::array::from_fn(|i| number(b, i)));
        Ok(Self {
            pixels: pixels.collect(),
            rest: number(bytes, 0),
        })
    }
}

fn luminance(c: &[f32]) -> f32 {
    0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]
}

/// Sums over the window of `reach` pixels around each pixel, cut at the border.
fn window(values: &[f32], width: usize, height: usize, reach: usize) -> Vec<f32> {
    let line = |from: &[f32], n: usize, at: &dyn Fn(usize) -> usize, to: &mut [f32]| {
        for i in 0..n {
            to[at(i)] = (i.saturating_sub(reach)..(i + reach + 1).min(n))
                .map(|k| from[at(k)])
                .sum();
        }
    };
    let (mut rows, mut out) = (vec![0.0; values.len()], vec![0.0; values.len()]);
    for y in 0..height {
        line(values, width, &|x| y * width + x, &mut rows);
    }
    for x in 0..width {
        line(&rows, height, &|y| y * width + x, &mut out);
    }
    out
}

/// Direct and indirect light of each pixel; a film that does not tell them apart has direct light only.
fn parts(film: &Film) -> Option<[Vec<[f32; 3]>; 2]> {
    let mut direct = film.beauty()?.to_vec();
    let indirect = film
        .layer("indirect")
        .map_or_else(|| vec![[0.0; 3]; direct.len()], <[_]>::to_vec);
    for (d, i) in direct.iter_mut().zip(&indirect) {
        *d = [0, 1, 2].map(|c| d[c] - i[c]);
    }
    Some([direct, indirect])
}

/// Albedo, normal and depth of each pixel, if the film knows them.
fn guide(film: &Film) -> Option<Vec<[f32; 7]>> {
    let (albedo, normal, depth) = (
        film.layer("albedo")?,
        film.layer("normal")?,
        film.layer("depth")?,
    );
    Some(
        albedo
            .iter()
            .zip(normal)
            .zip(depth)
            .map(|((a, n), d)| [a[0], a[1], a[2], n[0], n[1], n[2], d[0]])
            .collect(),
    )
}

fn same(a: &[f32], b: &[f32]) -> bool {
    let far =
        |range: std::ops::Range<usize>| range.map(|i| (a[i] - b[i]).abs()).fold(0.0, f32::max);
    far(0..3) < LIMITS[0]
        && far(3..6) < LIMITS[1]
        && far(6..7) < LIMITS[2] * a[6].max(b[6]).max(1e-3)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 24;

    /// Noise in -1..1 that depends on the pixel and the seed alone.
    fn noise(i: usize, seed: u32) -> f32 {
        let mut h = (i as u32 + 7919 * seed).wrapping_mul(0x9e37_79b9);
        h = (h ^ (h >> 15)).wrapping_mul(0x85eb_ca6b);
        ((h ^ (h >> 13)) >> 8) as f32 / (1 << 23) as f32 - 1.0
    }

    /// A grey wall of light 1 with some noise; the right half lies at `depth`.
    fn film(light: impl Fn(usize) -> f32, depth: f32) -> Film {
        let mut film = Film::of_beauty(
            SIDE,
            SIDE,
            (0..SIDE * SIDE).map(|i| [light(i); 3]).collect(),
        );
        film.push("albedo", vec![[0.5; 3]; SIDE * SIDE]);
        film.push("normal", vec![[0.0, 0.0, 1.0]; SIDE * SIDE]);
        film.push(
            "depth",
            (0..SIDE * SIDE)
                .map(|i| [if i % SIDE < SIDE / 2 { 2.0 } else { depth }; 3])
                .collect(),
        );
        film.push("variance", vec![[0.01; 3]; SIDE * SIDE]);
        film
    }

    /// The same film with half of its light indirect.
    fn halved(film: &Film) -> Film {
        let mut halved = film.clone();
        let half = film.beauty().unwrap().iter().map(|p| p.map(|c| 0.5 * c));
        halved.push("indirect", half.collect());
        halved
    }

    fn error(film: &Film, half: usize) -> f32 {
        let pixels = film.beauty().unwrap();
        let of = (0..pixels.len())
            .filter(|i| (i % SIDE < SIDE / 2) == (half == 0))
            .map(|i| (pixels[i][0] - 1.0).powi(2));
        (of.sum::<f32>() / (pixels.len() / 2) as f32).sqrt()
    }

    #[test]
    fn shared_noise_goes_and_what_moved_is_left_alone() {
        let anchor = Anchor::new(
            &film(|i| 1.0 + 0.3 * noise(i, 1), 2.0),
            &film(|_| 1.0, 2.0),
            0.1,
        );
        let mut frame = film(|i| 1.0 + 0.3 * noise(i, 1) + 0.03 * noise(i, 2), 1.9);
        let before = frame.clone();
        anchor.steady(&mut frame);
        // The noise of its own, a tenth, stays.
        assert!(
            error(&frame, 0) < 0.2 * error(&before, 0),
            "{} of {}",
            error(&frame, 0),
            error(&before, 0)
        );
        assert_eq!(
            error(&frame, 1),
            error(&before, 1),
            "the cloth came nearer: nothing is added"
        );
        assert!(frame.layer("variance").unwrap()[0][0] < 0.0065);
    }

    #[test]
    fn indirect_light_is_steadied_by_its_own_noise() {
        let (few, many) = (film(|i| 1.0 + 0.3 * noise(i, 1), 2.0), film(|_| 1.0, 2.0));
        let anchor = Anchor::new(&halved(&few), &halved(&many), 0.1);
        let mut frame = halved(&film(|i| 1.0 + 0.3 * noise(i, 1) + 0.03 * noise(i, 2), 2.0));
        let before = frame.clone();
        anchor.steady(&mut frame);
        assert!(error(&frame, 0) < 0.2 * error(&before, 0));
        let indirect = frame.layer("indirect").unwrap();
        let worst = indirect.iter().map(|p| (p[0] - 0.5).abs());
        assert!(worst.fold(0.0, f32::max) < 0.05, "{indirect:?}");
    }

    #[test]
    fn a_speck_of_the_still_leaves_no_hole() {
        let at = SIDE * SIDE / 2 + 5;
        let shared = |i: usize| 1.0 + 0.3 * noise(i, 1);
        let few = film(|i| shared(i) + if i == at { 1.5 } else { 0.0 }, 2.0);
        let anchor = Anchor::new(&few, &film(|_| 1.0, 2.0), 0.1);
        let mut frame = film(shared, 2.0);
        anchor.steady(&mut frame);
        let hole = frame.beauty().unwrap()[at][0];
        assert!(hole > 0.4, "{hole}");
    }

    #[test]
    fn strange_noise_does_no_harm() {
        let anchor = Anchor::new(
            &film(|i| 1.0 + 0.3 * noise(i, 1), 2.0),
            &film(|_| 1.0, 2.0),
            0.1,
        );
        let mut frame = film(|i| 1.0 + 0.3 * noise(i, 3), 2.0);
        let before = error(&frame, 0);
        anchor.steady(&mut frame);
        // A regression over 121 pixels finds by chance about 1/sqrt(121) of a likeness.
        assert!(
            error(&frame, 0) < 1.05 * before,
            "{} of {before}",
            error(&frame, 0)
        );
        assert!(frame.layer("variance").unwrap()[0][0] > 0.008);
    }

    #[test]
    fn it_survives_its_file() {
        let anchor = Anchor::new(
            &film(|i| noise(i, 1), 2.0),
            &film(|i| noise(i, 2), 2.0),
            0.25,
        );
        let bytes = anchor.to_bytes();
        assert_eq!(Anchor::from_bytes(&bytes).unwrap(), anchor);
        assert!(Anchor::from_bytes(&bytes[1..]).is_err());
    }
}
