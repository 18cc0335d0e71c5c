//! The still as an anchor for the frames of the motion: what does not move keeps the still's quality.
//!
//! A frame takes few paths a pixel, the still of the same room takes many, and both begin with the same random numbers. So where a
//! frame shows the same surface as the still, frame + (still of many paths - still of few) has the frame's mean, since the bracket
//! has mean zero, and far less noise, since the frame's noise and that of the still of few paths are nearly the same (control
//! variates: Owen, Monte Carlo theory, 8.9). On the cloth, which moves, nothing is added.

use anyhow::{Result, ensure};
use woven_render::film::{BEAUTY, Film};

/// Numbers a pixel: the bracket, then albedo, normal and depth.
const WIDTH: usize = 10;
/// Differences of albedo, normal and (relative) depth above which a pixel shows something else.
const LIMITS: [f32; 3] = [0.02, 0.06, 0.004];
/// Share of its variance that is left of an anchored pixel for the denoiser to expect.
const LEFT: f32 = 0.4;

/// The difference that many paths make to the still, pixel by pixel, and what the still shows there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Anchor {
    pixels: Vec<[f32; WIDTH]>,
}

impl Anchor {
    /// From the still with few and with many paths a pixel, both with the layers "albedo", "normal" and "depth".
    #[must_use]
    pub fn new(few: &Film, many: &Film) -> Self {
        let (Some(a), Some(b), Some(guide)) = (few.beauty(), many.beauty(), guide(few)) else {
            return Self::default();
        };
        let pixels = a.iter().zip(b).zip(guide).map(|((a, b), g)| {
            let mut all = [0.0; WIDTH];
            for c in 0..3 {
                let bracket = b[c] - a[c];
                all[c] = if bracket.is_finite() { bracket } else { 0.0 };
            }
            all[3..].copy_from_slice(&g);
            all
        });
        Self {
            pixels: pixels.collect(),
        }
    }

    /// Steadies a frame that was begun with the same random numbers as the still.
    pub fn steady(&self, film: &mut Film) {
        let Some(guide) = guide(film).filter(|g| g.len() == self.pixels.len()) else {
            return;
        };
        let same: Vec<bool> = self
            .pixels
            .iter()
            .zip(&guide)
            .map(|(a, g)| same(&a[3..], g))
            .collect();
        for layer in &mut film.layers {
            for ((pixel, anchor), _) in layer
                .pixels
                .iter_mut()
                .zip(&self.pixels)
                .zip(&same)
                .filter(|(_, same)| **same)
            {
                match layer.name.as_str() {
                    BEAUTY => *pixel = [0, 1, 2].map(|c| (pixel[c] + anchor[c]).max(0.0)),
                    "variance" => *pixel = pixel.map(|v| v * LEFT),
                    _ => {}
                }
            }
        }
    }

    /// For a file; read back by [`Self::from_bytes`].
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        self.pixels
            .iter()
            .flatten()
            .flat_map(|v| v.to_le_bytes())
            .collect()
    }

    /// Reads a file.
    ///
    /// # Errors
    /// When the file is not whole.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        ensure!(
            bytes.len() % (4 * WIDTH) == 0,
            "An anchor in the output folder is not whole; remove the folder's \"work\" and start again."
        );
        let pixel = |b: &[u8]| {
            std::array::from_fn(|i| {
                f32::from_le_bytes([b[4 * i], b[4 * i + 1], b[4 * i + 2], b[4 * i + 3]])
            })
        };
        Ok(Self {
            pixels: bytes.chunks_exact(4 * WIDTH).map(pixel).collect(),
        })
    }
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

    fn film(light: [f32; 2], depth: [f32; 2]) -> Film {
        let mut film = Film::of_beauty(2, 1, light.map(|l| [l; 3]).to_vec());
        film.push("albedo", vec![[0.5; 3]; 2]);
        film.push("normal", vec![[0.0, 0.0, 1.0]; 2]);
        film.push("depth", depth.map(|d| [d; 3]).to_vec());
        film
    }

    #[test]
    fn what_stays_is_steadied_and_what_moved_is_not() {
        // Noise of +0.3 in the first samples of both pixels; the true still is 1.
        let anchor = Anchor::new(&film([1.3, 1.3], [2.0, 2.0]), &film([1.0, 1.0], [2.0, 2.0]));
        let mut frame = film([1.35, 1.35], [2.0, 1.9]);
        anchor.steady(&mut frame);
        let light = frame.beauty().unwrap();
        assert!(
            (light[0][0] - 1.05).abs() < 1e-6,
            "the same surface loses the shared noise"
        );
        assert_eq!(light[1][0], 1.35, "the cloth came nearer: nothing is added");
    }

    #[test]
    fn it_survives_its_file() {
        let anchor = Anchor::new(&film([1.3, 0.2], [2.0, 3.0]), &film([1.0, 0.1], [2.0, 3.0]));
        let bytes = anchor.to_bytes();
        assert_eq!(Anchor::from_bytes(&bytes).unwrap(), anchor);
        assert!(Anchor::from_bytes(&bytes[1..]).is_err());
    }
}
