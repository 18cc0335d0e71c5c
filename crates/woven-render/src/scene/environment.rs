//! Environment maps: latitude-longitude pictures in Radiance `.hdr` or OpenEXR.

use super::{Environment, LAYER_SKY};
use crate::exr_io;
use anyhow::{Context, Result, anyhow, bail, ensure};
use std::io::Cursor;
use std::path::Path;

/// Decoded pixels of one map take at most this many bytes: 16384 x 8192.
pub const LIMIT: u64 = 16_384 * 8_192 * 12;

/// A file may unfold to this many bytes however small it is, and to [`UNFOLDS`] times its own beside.
const FREE: u64 = 256 << 20;
/// See [`FREE`].
const UNFOLDS: u64 = 64;

/// Radiance above this is cut off: the largest half-precision number. Some writers store the sun as infinity.
const BRIGHTEST: f32 = 65_504.0;

/// Loads a map by its ending.
///
/// Negative values become 0 and values over 65504 (infinity too) 65504.
///
/// # Errors
/// A sentence when the file is neither, is broken, too large, or holds something that is no number.
pub fn load(path: &Path) -> Result<Environment> {
    let told = || format!("cannot read the environment map {}", path.display());
    let (width, height, mut pixels) = match path
        .extension()
        .and_then(|e| e.to_str())
        .map(str::to_ascii_lowercase)
        .as_deref()
    {
        Some("exr") => {
            let film = exr_io::read_limited(path, LIMIT * 2).with_context(told)?;
            let pixels = film.beauty().unwrap_or(&[]).to_vec();
            (film.width as u32, film.height as u32, pixels)
        }
        Some("hdr" | "pic" | "rgbe") => {
            let bytes = super::gltf::read_file(path, LIMIT).with_context(told)?;
            decode_hdr(&bytes).with_context(told)?
        }
        _ => bail!(
            "{} is neither .hdr nor .exr; other formats do not hold radiance",
            path.display()
        ),
    };
    if let Some(i) = pixels.iter().position(|p| p.iter().any(|v| v.is_nan())) {
        bail!(
            "the environment map {} is not a number at x = {}, y = {}",
            path.display(),
            i % width as usize,
            i / width as usize
        );
    }
    pixels
        .iter_mut()
        .for_each(|p| *p = p.map(|v| v.clamp(0.0, BRIGHTEST)));
    Ok(Environment {
        width,
        height,
        pixels,
        rotation: 0.0,
        scale: [1.0; 3],
        layer: LAYER_SKY,
    })
}

/// Width, height and pixels.
type Pixels = (u32, u32, Vec<[f32; 3]>);

/// Decodes a Radiance picture; its header is measured before anything is allocated.
///
/// # Errors
/// A sentence when it is broken or larger than [`LIMIT`].
pub fn decode_hdr(bytes: &[u8]) -> Result<Pixels> {
    use image::ImageDecoder;
    let decoder = image::codecs::hdr::HdrDecoder::new(Cursor::new(bytes))
        .map_err(|e| anyhow!("it is no Radiance picture: {e}"))?;
    let (w, h) = decoder.dimensions();
    let need = (u64::from(w) * u64::from(h)).saturating_mul(12);
    ensure!(w > 0 && h > 0, "it has no pixels");
    ensure!(
        need <= LIMIT,
        "its header claims {w} x {h} pixels, {} MiB; at most {} MiB are read",
        need >> 20,
        LIMIT >> 20
    );
    // A run-length code packs at most 127 numbers of one byte into two; a sky that somebody photographed is not packed at all.
    ensure!(
        need / 12 * 4 / 64 <= bytes.len() as u64 && need * 2 <= FREE + UNFOLDS * bytes.len() as u64,
        "its header claims {w} x {h} pixels, more than {} bytes can hold",
        bytes.len()
    );
    let mut raw = vec![0_u8; usize::try_from(decoder.total_bytes())?];
    decoder
        .read_image(&mut raw)
        .map_err(|e| anyhow!("its data are broken: {e}"))?;
    let number = |b: &[u8]| f32::from_ne_bytes([b[0], b[1], b[2], b[3]]);
    let pixels = raw
        .chunks_exact(12)
        .map(|p| [number(&p[..4]), number(&p[4..8]), number(&p[8..])])
        .collect();
    Ok((w, h, pixels))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_radiance_picture_written_by_hand() {
        // One row of two pixels, not run-length coded: (128, 64, 0) * 2^(129 - 136), and black.
        let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n".to_vec();
        bytes.extend([128, 64, 0, 129, 0, 0, 0, 0]);
        let (w, h, pixels) = decode_hdr(&bytes).unwrap();
        assert_eq!((w, h), (2, 1));
        assert_eq!(pixels, [[1.0, 0.5, 0.0], [0.0; 3]]);
    }

    #[test]
    fn a_bomb_is_refused_by_its_header() {
        let bomb = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 60000\n";
        assert!(format!("{:#}", decode_hdr(bomb).unwrap_err()).contains("MiB"));
        let small = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8000 +X 8000\n\x02\x02";
        assert!(format!("{:#}", decode_hdr(small).unwrap_err()).contains("can hold"));
    }

    #[test]
    fn an_exr_map_is_cleaned() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.exr");
        let film = crate::film::Film::of_beauty(2, 1, vec![[f32::INFINITY, -1.0, 2.0], [0.5; 3]]);
        exr_io::write(&film, &path).unwrap();
        assert_eq!(
            load(&path).unwrap().pixels,
            [[BRIGHTEST, 0.0, 2.0], [0.5; 3]]
        );
        exr_io::write(
            &crate::film::Film::of_beauty(2, 1, vec![[0.0; 3], [f32::NAN; 3]]),
            &path,
        )
        .unwrap();
        assert!(format!("{:#}", load(&path).unwrap_err()).contains("x = 1"));
    }
}
