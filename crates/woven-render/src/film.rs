//! The film: what a render leaves behind, as named layers of linear radiance, and the curve that turns it into a PNG.

use crate::atomic::write_atomically;
use anyhow::{Context, Result, ensure};
use std::collections::BTreeMap;
use std::path::Path;

/// One layer of a film. Single-valued layers ("depth", "variance") hold the same number three times or use `[0]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// "beauty", "light.sun", "albedo", "normal", "depth", "variance", "gap", ...
    pub name: String,
    /// `width * height` values, row by row from the top left; linear Rec.709 radiance where the layer is light.
    pub pixels: Vec<[f32; 3]>,
}

/// A rendered frame: layers of equal size and what is known about how it was made.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Film {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Layers in the order they were added; "beauty" is the picture.
    pub layers: Vec<Layer>,
    /// Seed, samples, hashes, version: written into the EXR's comments, sorted by key.
    pub metadata: BTreeMap<String, String>,
}

/// The layer that is the picture.
pub const BEAUTY: &str = "beauty";

impl Film {
    /// A film without layers.
    pub fn new(width: usize, height: usize) -> Self {
        Film {
            width,
            height,
            ..Film::default()
        }
    }

    /// A film with one layer, "beauty".
    pub fn of_beauty(width: usize, height: usize, pixels: Vec<[f32; 3]>) -> Self {
        let mut film = Film::new(width, height);
        film.push(BEAUTY, pixels);
        film
    }

    /// Adds a layer, or replaces the one of the same name. Panics when the size is not the film's.
    pub fn push(&mut self, name: &str, pixels: Vec<[f32; 3]>) {
        assert_eq!(
            pixels.len(),
            self.width * self.height,
            "layer {name} does not have the film's size"
        );
        match self.layers.iter_mut().find(|l| l.name == name) {
            Some(layer) => layer.pixels = pixels,
            None => self.layers.push(Layer {
                name: name.to_string(),
                pixels,
            }),
        }
    }

    /// The pixels of a layer, if the film has it.
    pub fn layer(&self, name: &str) -> Option<&[[f32; 3]]> {
        self.layers
            .iter()
            .find(|l| l.name == name)
            .map(|l| l.pixels.as_slice())
    }

    /// The picture: "beauty", or the first layer of a film that does not name one.
    pub fn beauty(&self) -> Option<&[[f32; 3]]> {
        self.layer(BEAUTY)
            .or_else(|| self.layers.first().map(|l| l.pixels.as_slice()))
    }

    /// The picture as 8-bit sRGB, three bytes a pixel; `exposure` in stops (EV).
    pub fn to_rgb8(&self, curve: Curve, exposure: f32) -> Vec<u8> {
        let gain = exposure.exp2();
        let pixels = self.beauty().unwrap_or(&[]);
        pixels
            .iter()
            .flat_map(|p| curve.apply(p.map(|c| c * gain)).map(encode8))
            .collect()
    }

    /// Writes the picture as an 8-bit sRGB PNG, atomically; `exposure` in stops (EV).
    ///
    /// # Errors
    /// When the film has no layer, or the file cannot be written.
    pub fn write_png(&self, path: &Path, curve: Curve, exposure: f32) -> Result<()> {
        ensure!(
            self.beauty().is_some(),
            "the film has no layer, so {} is not written",
            path.display()
        );
        write_png8(
            path,
            self.width,
            self.height,
            &self.to_rgb8(curve, exposure),
        )
    }
}

/// Writes `width * height * 3` bytes of sRGB as a PNG, atomically.
///
/// # Errors
/// When the file cannot be written.
pub fn write_png8(path: &Path, width: usize, height: usize, rgb: &[u8]) -> Result<()> {
    use image::ImageEncoder;
    write_atomically(path, |out| {
        image::codecs::png::PngEncoder::new(out)
            .write_image(
                rgb,
                width as u32,
                height as u32,
                image::ExtendedColorType::Rgb8,
            )
            .context("the PNG encoder refused the picture")
    })
}

/// How linear radiance becomes a displayable value in 0..=1 (still linear; the sRGB encoding follows).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Curve {
    /// Cut off at 1: numbers stay what they were. For comparing, and for renders already graded.
    Clip,
    /// A film-like curve in the manner of AgX; see [`filmic`].
    #[default]
    Filmic,
}

impl Curve {
    /// Maps one linear Rec.709 colour into 0..=1.
    pub fn apply(self, rgb: [f32; 3]) -> [f32; 3] {
        let finite = rgb.map(|c| if c.is_finite() { c.max(0.0) } else { 0.0 });
        match self {
            Curve::Clip => finite.map(|c| c.min(1.0)),
            Curve::Filmic => filmic(finite),
        }
    }
}

/// Share of each primary that is spread over the other two before the curve, and gathered again, in part, after it.
const INSET: f32 = 0.12;
/// The part of [`INSET`] taken back after the curve: the difference is what lets very bright colours go to white.
const OUTSET: f32 = 0.09;
/// Stops below and above middle grey that the curve spans.
const STOPS_BELOW: f32 = 10.0;
/// See [`STOPS_BELOW`].
const STOPS_ABOVE: f32 = 6.5;
/// Middle grey, kept in its place by the curve.
const GREY: f32 = 0.18;

/// A film-like curve after the structure of AgX (T. Sobotka 2022), with constants of our own:
///
/// 1. *inset*: each channel gives 12 % of itself to the common mean, so that a saturated light never clips one channel alone;
/// 2. *log*: x = log2(c / 0.18), from -10 to +6.5 stops, brought to 0..1;
/// 3. *sigmoid* through middle grey: two power arms, slope 2.4 in the middle, that reach 0 and 1 with slope near 0;
/// 4. *power 2.2* back to linear display light;
/// 5. *outset*: 9 % of the mixing is undone.
///
/// A grey of 0.18 stays 0.18, grey stays grey, the curve is monotone, and 6.5 stops over grey (16.3) is white.
pub fn filmic(rgb: [f32; 3]) -> [f32; 3] {
    let mean = |c: [f32; 3]| 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
    let m = mean(rgb);
    let inset = rgb.map(|c| c + (m - c) * INSET);
    let curved = inset.map(|c| {
        let stops = (c.max(1e-10) / GREY)
            .log2()
            .clamp(-STOPS_BELOW, STOPS_ABOVE);
        sigmoid((stops + STOPS_BELOW) / (STOPS_BELOW + STOPS_ABOVE)).powf(2.2)
    });
    let m = mean(curved);
    curved.map(|c| (m + (c - m) / (1.0 - OUTSET)).clamp(0.0, 1.0))
}

/// Both arms are y = s d / (1 + (d s / reach)^p)^(1/p), d the distance to the pivot: slope s there, `reach` at the end.
fn sigmoid(x: f32) -> f32 {
    const SLOPE: f32 = 2.4;
    let pivot_x = STOPS_BELOW / (STOPS_BELOW + STOPS_ABOVE);
    let pivot_y = GREY.powf(1.0 / 2.2);
    let d = x - pivot_x;
    // `scale` makes the arm meet its end exactly at x = 0 or 1 (AgX's "base" curve does the same).
    let (end_x, end_y, power) = if d < 0.0 {
        (pivot_x, pivot_y, 3.0)
    } else {
        (1.0 - pivot_x, 1.0 - pivot_y, 3.25)
    };
    let scale = ((SLOPE * end_x).powf(-power) * ((SLOPE * end_x / end_y).powf(power) - 1.0))
        .powf(-1.0 / power);
    let t = SLOPE * d.abs();
    let arm = t / (1.0 + (t / scale).powf(power)).powf(1.0 / power);
    (pivot_y + arm.copysign(d)).clamp(0.0, 1.0)
}

/// Linear 0..=1 to the sRGB encoding (IEC 61966-2-1).
pub fn srgb_encode(linear: f32) -> f32 {
    if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// sRGB-encoded 0..=1 to linear (IEC 61966-2-1).
pub fn srgb_decode(encoded: f32) -> f32 {
    if encoded <= 0.040_45 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

fn encode8(linear: f32) -> u8 {
    (srgb_encode(linear.clamp(0.0, 1.0)) * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grey_keeps_its_place_and_the_ends_are_black_and_white() {
        for c in filmic([GREY; 3]) {
            assert!((c - GREY).abs() < 1e-4, "{c}");
        }
        assert!(filmic([0.0; 3])[0] < 1e-4);
        assert!(filmic([20.0; 3])[0] > 0.999);
    }

    #[test]
    fn the_curve_never_falls_and_keeps_grey_neutral() {
        let mut last = -1.0;
        for i in 0..2000 {
            let [r, g, b] = filmic([(i as f32 * 0.01 - 12.0).exp2(); 3]);
            assert!(
                r >= last && (r - g).abs() < 1e-5 && (r - b).abs() < 1e-5,
                "step {i}: {r} {g} {b}"
            );
            last = r;
        }
    }

    #[test]
    fn nothing_unfinite_reaches_the_picture() {
        let film = Film::of_beauty(
            2,
            1,
            vec![[f32::NAN, f32::INFINITY, -3.0], [1e30, 0.5, 0.0]],
        );
        for curve in [Curve::Clip, Curve::Filmic] {
            let bytes = film.to_rgb8(curve, 2.0);
            assert_eq!(&bytes[..3], &[0, 0, 0]);
            assert_eq!(bytes[3], 255);
        }
    }

    #[test]
    fn all_256_bytes_survive_decoding_and_encoding() {
        for b in 0..=255_u8 {
            assert_eq!(encode8(srgb_decode(f32::from(b) / 255.0)), b);
        }
    }

    #[test]
    fn a_png_is_read_back_as_it_was_written() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("ramp.png");
        let film = Film::of_beauty(
            16,
            2,
            (0..32).map(|i| [i as f32 / 31.0, 0.25, 1.0]).collect(),
        );
        film.write_png(&path, Curve::Clip, 0.0).unwrap();
        let back = image::open(&path).unwrap().to_rgb8();
        assert_eq!(back.into_raw(), film.to_rgb8(Curve::Clip, 0.0));
    }
}
