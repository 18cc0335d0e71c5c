//! Sums of samples, pixel by pixel: what a render has gathered so far, can be stopped with and resumed from.

use anyhow::{Result, ensure};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::cpu::math::luminance;
use crate::cpu::path::Sample;
use crate::film::{BEAUTY, Film};
use crate::render::Settings;
use crate::scene::{EVENT_NAMES, LAYER_NAMES, LAYERS};

/// Sums over the samples of one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct PixelSum {
    /// Radiance by light layer scattered at most once; the fourth numbers are the sums of: its squared luminance, gap,
    /// depth, nothing.
    pub direct: [[f32; 4]; LAYERS],
    /// Radiance by light layer scattered more often; the fourth numbers are the sums of: its squared luminance, the
    /// product of this luminance and that of the direct part, nothing, nothing.
    pub indirect: [[f32; 4]; LAYERS],
    /// Reflectance and transmittance of what is seen.
    pub albedo: [f32; 4],
    /// Shading normal of what is seen first.
    pub normal: [f32; 4],
}

impl PixelSum {
    /// Adds one sample.
    #[inline]
    pub(crate) fn add(&mut self, s: &Sample) {
        let part = |sums: &mut [[f32; 4]; LAYERS], light: &[Vec3; LAYERS]| {
            let mut all = Vec3::ZERO;
            for (sum, &l) in sums.iter_mut().zip(light) {
                // A sample that is not a number must not spoil the pixel; it counts as black.
                let l = if l.is_finite() { l } else { Vec3::ZERO };
                all += l;
                for c in 0..3 {
                    sum[c] += l[c];
                }
            }
            luminance(all)
        };
        let direct = part(&mut self.direct, &s.direct);
        let indirect = part(&mut self.indirect, &s.indirect);
        self.direct[0][3] += direct * direct;
        self.direct[1][3] += s.gap;
        self.direct[2][3] += s.depth;
        self.indirect[0][3] += indirect * indirect;
        self.indirect[1][3] += direct * indirect;
        for c in 0..3 {
            self.albedo[c] += s.albedo[c];
            self.normal[c] += s.normal[c];
        }
    }
}

/// A picture in the making. Two runs with the same scene, settings and backend hold the same bytes after the same
/// number of samples, however the work was cut.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Accumulation {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Samples a pixel that the sums hold.
    pub samples: u32,
    /// Rows from the top.
    pub pixels: Vec<PixelSum>,
}

impl Accumulation {
    /// Nothing yet.
    #[must_use]
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            samples: 0,
            pixels: vec![PixelSum::default(); width as usize * height as usize],
        }
    }

    /// The mean radiance of every pixel.
    pub(crate) fn means(&self) -> Vec<[f32; 3]> {
        let n = self.samples.max(1) as f32;
        let mean = |p: &PixelSum| {
            let all = || p.direct.iter().chain(&p.indirect);
            std::array::from_fn(|c| all().map(|l| l[c]).sum::<f32>() / n)
        };
        self.pixels.iter().map(mean).collect()
    }

    /// The sums as bytes, for a checkpoint file.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(16 + self.pixels.len() * size_of::<PixelSum>());
        bytes.extend(b"wovn");
        for n in [self.width, self.height, self.samples] {
            bytes.extend(n.to_le_bytes());
        }
        bytes.extend(bytemuck::cast_slice::<PixelSum, u8>(&self.pixels));
        bytes
    }

    /// Reads what [`Self::to_bytes`] wrote.
    ///
    /// # Errors
    /// A sentence when the bytes are not whole.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        ensure!(
            bytes.len() >= 16 && &bytes[..4] == b"wovn",
            "the checkpoint does not begin as one; start the render anew"
        );
        let number =
            |i: usize| u32::from_le_bytes([bytes[i], bytes[i + 1], bytes[i + 2], bytes[i + 3]]);
        let (width, height, samples) = (number(4), number(8), number(12));
        let count = (width as usize).saturating_mul(height as usize);
        ensure!(
            count.checked_mul(size_of::<PixelSum>()) == Some(bytes.len() - 16),
            "the checkpoint of {width} x {height} pixels is cut short ({} bytes); start the render anew",
            bytes.len()
        );
        let pixels = bytes[16..]
            .chunks_exact(size_of::<PixelSum>())
            .map(bytemuck::pod_read_unaligned)
            .collect();
        Ok(Self {
            width,
            height,
            samples,
            pixels,
        })
    }

    /// The means as a film: "beauty", with `light_layers` or `event_layers` one "light.NAME" each, with `aov` "albedo", "normal",
    /// "depth" \[m\], "gap", "variance" (of the mean of the luminance, from the samples' scatter, where there are at
    /// least two), and "indirect" and "indirect.NAME": the share of light that was scattered before it came to what is
    /// seen. "direct.variance" and "indirect.variance" are those of the two parts.
    #[must_use]
    pub fn film(&self, settings: &Settings) -> Film {
        let n = self.samples.max(1) as f32;
        let mut film = Film::new(self.width as usize, self.height as usize);
        let rgb = |v: &[f32; 4]| [v[0] / n, v[1] / n, v[2] / n];
        let all = |lights: &[[f32; 4]; LAYERS]| -> [f32; 3] {
            std::array::from_fn(|c| lights.iter().map(|l| l[c]).sum::<f32>() / n)
        };
        let direct = |p: &PixelSum| all(&p.direct);
        let indirect = |p: &PixelSum| all(&p.indirect);
        let sum = |p: &PixelSum| -> [f32; 3] {
            let (a, b) = (direct(p), indirect(p));
            std::array::from_fn(|c| a[c] + b[c])
        };
        // Variance of the mean of what has this mean and this sum of squares.
        let variance = |mean: [f32; 3], squares: f32| {
            let mean = luminance(Vec3::from(mean));
            let scatter = (squares / n - mean * mean).max(0.0);
            [scatter / (n - 1.0).max(1.0); 3]
        };
        let mut layer = |name: &str, f: &dyn Fn(&PixelSum) -> [f32; 3]| {
            film.push(name, self.pixels.iter().map(f).collect());
        };
        layer(BEAUTY, &sum);
        let names = if settings.event_layers {
            Some(EVENT_NAMES)
        } else {
            settings.light_layers.then_some(LAYER_NAMES)
        };
        if let Some(names) = &names {
            for (i, name) in names.iter().enumerate() {
                layer(&format!("light.{name}"), &|p| {
                    let (a, b) = (rgb(&p.direct[i]), rgb(&p.indirect[i]));
                    std::array::from_fn(|c| a[c] + b[c])
                });
            }
        }
        if settings.aov {
            layer("albedo", &|p| rgb(&p.albedo));
            layer("normal", &|p| {
                Vec3::new(p.normal[0], p.normal[1], p.normal[2])
                    .normalize_or_zero()
                    .into()
            });
            layer("depth", &|p| [p.direct[2][3] / n; 3]);
            layer("gap", &|p| [p.direct[1][3] / n; 3]);
            layer("indirect", &indirect);
            // One sample does not tell its own scatter.
            if self.samples > 1 {
                layer("variance", &|p| {
                    let [a, b] = [&p.direct, &p.indirect];
                    variance(sum(p), a[0][3] + b[0][3] + 2.0 * b[1][3])
                });
                layer("direct.variance", &|p| variance(direct(p), p.direct[0][3]));
                layer("indirect.variance", &|p| {
                    variance(indirect(p), p.indirect[0][3])
                });
            }
            if let Some(names) = &names {
                for (i, name) in names.iter().enumerate() {
                    layer(&format!("indirect.{name}"), &|p| rgb(&p.indirect[i]));
                }
            }
        }
        film.metadata
            .insert("samples".into(), self.samples.to_string());
        film.metadata
            .insert("seed".into(), settings.seed.to_string());
        film.metadata
            .insert("depth".into(), settings.depth.to_string());
        film.metadata
            .insert("version".into(), env!("CARGO_PKG_VERSION").into());
        film
    }
}
