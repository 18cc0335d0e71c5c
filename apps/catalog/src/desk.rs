//! The light desk of the page: one picture a light, packed into a script, from which the page mixes any light.
//!
//! A layer is stored as an 8-bit picture of (radiance / scale)^(1/[`POWER`]), which keeps the shadows finer than the highlights, and the
//! page sums the layers in linear light and bends the sum by the same curve as the stills (sampled into a table). The pictures are
//! data URLs in a script because a page that is opened from a disk may not read the pixels of other files.

use anyhow::{Context as _, Result, ensure};
use image::{ExtendedColorType, ImageEncoder as _};
use woven_render::film::Curve;

use crate::page::Desk;
use crate::stage::{DUSK, LAMP_BOOST, Preset};

/// Exponent of the stored layers.
const POWER: f32 = 2.5;
/// The part of the curve that mixes channels before and after the bend; a test holds it against the film's own.
const MIX: [f32; 2] = [0.12, 0.09];
/// Range of the table of the curve, in log2 of radiance times exposure.
const RANGE: (f32, f32) = (-12.0, 5.0);
/// Entries of the table.
const ENTRIES: usize = 512;
/// Radiance above this much over white is cut off: lamps are stored [`LAMP_BOOST`] times too bright.
const HEADROOM: f32 = 24.0;

/// One light's picture.
pub struct Layer<'a> {
    /// "sun", "sky" or "lamps".
    pub name: &'a str,
    /// Linear radiance, row by row.
    pub pixels: &'a [[f32; 3]],
}

/// The script that holds the layers of the fabric `id`; `size` in pixels.
///
/// # Errors
/// When a layer does not have the size, or the PNG encoder fails.
pub fn script(id: &str, size: (u32, u32), layers: &[Layer<'_>]) -> Result<String> {
    let exposure = Preset::All.exposure();
    let mut entries = Vec::new();
    let mut images = Vec::new();
    for layer in layers {
        let (scale, png) = pack(layer.pixels, size, HEADROOM * (-exposure).exp2())?;
        let name = layer.name;
        images.push(format!(
            "const {name} = \"data:image/png;base64,{}\";\n",
            base64(&png)
        ));
        let entry = |called: &str, tint: [f32; 3]| {
            format!("{{name:\"{called}\",image:{name},scale:{scale},power:{POWER},tint:{tint:?}}}")
        };
        entries.push(entry(
            name,
            if name == "lamps" {
                [1.0 / LAMP_BOOST; 3]
            } else {
                [1.0; 3]
            },
        ));
        if name == "sky" {
            entries.push(entry("dusk", DUSK));
        }
    }
    let curve: Vec<String> = table().iter().map(|v| format!("{v:.5}")).collect();
    Ok(format!(
        "\"use strict\";\n{{\n{}(window.wovenLights ??= {{}})[\"{id}\"] = {{exposure:{exposure},least:{},most:{},mix:{MIX:?},curve:[{}],\nlayers:[{}]}};\n}}\n",
        images.concat(),
        RANGE.0,
        RANGE.1,
        curve.join(","),
        entries.join(",\n")
    ))
}

/// The sliders that go with [`script`].
#[must_use]
pub fn desk(id: &str, name: &str, size: (u32, u32)) -> Desk {
    let light = |name: &str, label: &str, share| (name.to_owned(), label.to_owned(), share);
    let evening = Preset::Evening.exposure() - Preset::All.exposure();
    let preset = |label: &str, [sun, sky, dusk, lamps, exposure]: [f32; 5]| {
        let shares = [
            ("sun", sun),
            ("sky", sky),
            ("dusk", dusk),
            ("lamps", lamps),
            ("exposure", exposure),
        ];
        (
            label.to_owned(),
            shares.map(|(n, s)| (n.to_owned(), s)).to_vec(),
        )
    };
    Desk {
        script: format!("{id}/lights.js"),
        lights: vec![
            light("sun", "Sun", 100),
            light("sky", "Sky", 100),
            light("dusk", "Dusk", 0),
            light("lamps", "Lamps", 0),
        ],
        presets: vec![
            preset("Day", [100.0, 100.0, 0.0, 0.0, 0.0]),
            preset("Overcast", [0.0, 100.0, 0.0, 0.0, 0.7]),
            preset("Lamps at noon", [100.0, 100.0, 0.0, 100.0, 0.0]),
            preset("Evening", [0.0, 0.0, 100.0, 100.0, evening]),
        ],
        size,
        alt: format!(
            "The curtain of {name} at rest, lit by the mix of lights chosen with the sliders"
        ),
    }
}

/// Scale and PNG of a layer; what is brighter than `cap` is cut off.
fn pack(pixels: &[[f32; 3]], size: (u32, u32), cap: f32) -> Result<(f32, Vec<u8>)> {
    ensure!(
        pixels.len() == (size.0 * size.1) as usize,
        "A light layer has {} pixels instead of {}x{}.",
        pixels.len(),
        size.0,
        size.1
    );
    let top = pixels
        .iter()
        .flatten()
        .copied()
        .filter(|c| c.is_finite())
        .fold(0.0_f32, f32::max)
        .min(cap)
        .max(1e-6);
    let bytes: Vec<u8> = pixels
        .iter()
        .flatten()
        .map(|c| ((c / top).clamp(0.0, 1.0).powf(1.0 / POWER) * 255.0).round() as u8)
        .collect();
    let mut png = Vec::new();
    let encoder = image::codecs::png::PngEncoder::new(&mut png);
    encoder
        .write_image(&bytes, size.0, size.1, ExtendedColorType::Rgb8)
        .context("A light layer could not be stored")?;
    Ok((top, png))
}

/// The film's curve for greys, from 2^[`RANGE`].0 to 2^[`RANGE`].1 in equal steps of the logarithm.
fn table() -> Vec<f32> {
    (0..ENTRIES)
        .map(|i| {
            let stops = RANGE.0 + (RANGE.1 - RANGE.0) * i as f32 / (ENTRIES - 1) as f32;
            Curve::Filmic.apply([stops.exp2(); 3])[1]
        })
        .collect()
}

/// RFC 4648.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let word = group
            .iter()
            .enumerate()
            .fold(0_u32, |w, (i, b)| w | u32::from(*b) << (16 - 8 * i));
        for i in 0..4 {
            out.push(if i <= group.len() {
                LETTERS[(word >> (18 - 6 * i) & 63) as usize] as char
            } else {
                '='
            });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_as_the_rfc_has_it() {
        for (plain, coded) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }

    /// What the page's script does, in Rust.
    fn page(rgb: [f32; 3], table: &[f32]) -> [f32; 3] {
        let mean = |c: [f32; 3]| 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
        let step = (ENTRIES - 1) as f32 / (RANGE.1 - RANGE.0);
        let m = mean(rgb);
        let bent = rgb.map(|c| {
            let at = ((c + (m - c) * MIX[0] + 1e-9).log2() - RANGE.0) * step;
            table[at.round().clamp(0.0, (ENTRIES - 1) as f32) as usize]
        });
        let m = mean(bent);
        bent.map(|c| ((c - m * MIX[1]) / (1.0 - MIX[1])).clamp(0.0, 1.0))
    }

    #[test]
    fn the_desk_bends_light_like_the_stills() {
        let table = table();
        for rgb in [
            [0.18; 3],
            [1.0, 0.5, 0.2],
            [0.02, 0.05, 0.3],
            [6.0, 5.0, 3.0],
            [0.004, 0.002, 0.001],
        ] {
            let (desk, film) = (page(rgb, &table), Curve::Filmic.apply(rgb));
            for (a, b) in desk.iter().zip(&film) {
                // A step of the table is 0.033 stops: 1.2 % of the display value where the curve is steepest.
                assert!(
                    (a - b).abs() < 0.012 * b + 0.002,
                    "{rgb:?}: {desk:?} instead of {film:?}"
                );
            }
        }
    }

    #[test]
    fn a_layer_comes_back_within_its_bits() {
        let pixels: Vec<[f32; 3]> = (0..64).map(|i| [i as f32 / 16.0, 0.5, 0.01]).collect();
        let (scale, png) = pack(&pixels, (8, 8), 100.0).unwrap();
        let image = image::load_from_memory(&png).unwrap().to_rgb8();
        for (p, q) in pixels.iter().zip(image.pixels()) {
            for (a, b) in p.iter().zip(q.0) {
                let back = scale * (f32::from(b) / 255.0).powf(POWER);
                // Half a step of 255 in the stored number is 2.5/2/255 of its value near the top, and more further down.
                assert!(
                    (a - back).abs() < 0.01 * scale.max(*a),
                    "{a} came back as {back}"
                );
            }
        }
        assert!(pack(&pixels, (9, 8), 1.0).is_err());
    }
}
