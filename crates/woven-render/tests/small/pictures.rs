//! Small whole pictures in every format that is read, and changes to a PNG that keep its checksums right.
#![allow(dead_code, reason = "each user takes a part")]

use super::corpus::{Random, spoil};
use exr::prelude::*;
use image::ImageEncoder;
use std::io::Cursor;

/// CRC-32 as PNG uses it.
pub(crate) fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |c, b| {
        (0..8).fold(c ^ u32::from(*b), |c, _| {
            if c & 1 == 1 {
                0xEDB8_8320 ^ (c >> 1)
            } else {
                c >> 1
            }
        })
    })
}

fn adler(bytes: &[u8]) -> u32 {
    let (a, b) = bytes.iter().fold((1_u32, 0_u32), |(a, b), x| {
        let a = (a + u32::from(*x)) % 65_521;
        (a, (b + a) % 65_521)
    });
    b << 16 | a
}

/// A chunk with its length and checksum.
pub(crate) fn chunk(kind: &[u8; 4], body: &[u8]) -> Vec<u8> {
    let mut out = (body.len() as u32).to_be_bytes().to_vec();
    out.extend(kind);
    out.extend(body);
    out.extend(crc(&out[4..]).to_be_bytes());
    out
}

/// zlib without compression, so that a changed byte stays one changed byte of the picture.
fn stored(raw: &[u8]) -> Vec<u8> {
    let mut out = vec![0x78, 0x01, 1];
    out.extend((raw.len() as u16).to_le_bytes());
    out.extend((!(raw.len() as u16)).to_le_bytes());
    out.extend(raw);
    out.extend(adler(raw).to_be_bytes());
    out
}

/// A PNG of `w` x `h` with this depth, colour type and interlacing, and more chunks before its data.
pub(crate) fn png(
    w: u32,
    h: u32,
    form: [u8; 3],
    more: &[(&[u8; 4], &[u8])],
    raw: &[u8],
) -> Vec<u8> {
    let mut header = w.to_be_bytes().to_vec();
    header.extend(h.to_be_bytes());
    header.extend([form[0], form[1], 0, 0, form[2]]);
    let mut out = b"\x89PNG\r\n\x1a\n".to_vec();
    out.extend(chunk(b"IHDR", &header));
    for (kind, body) in more {
        out.extend(chunk(kind, body));
    }
    out.extend(chunk(b"IDAT", &stored(raw)));
    out.extend(chunk(b"IEND", &[]));
    out
}

/// One PNG of each colour type, some interlaced, some compressed.
pub(crate) fn pngs() -> Vec<Vec<u8>> {
    let palette = [1_u8, 2, 3, 200, 100, 50, 9, 9, 9, 255, 255, 255];
    let mut out = vec![
        png(
            2,
            2,
            [8, 6, 0],
            &[],
            &[0, 1, 2, 3, 4, 5, 6, 7, 8, 1, 9, 8, 7, 6, 5, 4, 3, 2],
        ),
        png(
            3,
            2,
            [8, 2, 0],
            &[(b"gAMA", &[0, 0, 177, 143])],
            &[2, 1, 2, 3, 4, 5, 6, 7, 8, 9, 4, 1, 1, 1, 1, 1, 1, 1, 1, 1],
        ),
        png(
            4,
            2,
            [2, 3, 0],
            &[(b"PLTE", &palette), (b"tRNS", &[0, 128])],
            &[0, 0b0001_1011, 3, 0b1110_0100],
        ),
        png(
            2,
            2,
            [16, 0, 0],
            &[(b"tRNS", &[0, 7])],
            &[0, 0, 7, 1, 2, 1, 200, 1, 2, 3],
        ),
        png(2, 2, [8, 4, 1], &[], &[0, 1, 2, 0, 3, 4, 0, 5, 6, 7, 8]),
        png(8, 1, [1, 0, 0], &[(b"tEXt", b"a\0b")], &[0, 0b1010_0101]),
        super::tiny_png(),
    ];
    let mut large = Vec::new();
    let pixels: Vec<u8> = (0..16 * 16 * 4).map(|i| (i * 7 % 256) as u8).collect();
    image::codecs::png::PngEncoder::new(&mut large)
        .write_image(&pixels, 16, 16, image::ExtendedColorType::Rgba8)
        .unwrap_or_default();
    out.push(large);
    out
}

/// Spoils a body and puts its checksum right, or drops, doubles or swaps chunks; at times spoils plain bytes.
pub(crate) fn spoil_png(r: &mut Random, bytes: &mut Vec<u8>) {
    if r.below(6) == 0 {
        spoil(r, bytes);
        return;
    }
    let mut parts: Vec<([u8; 4], Vec<u8>)> = Vec::new();
    let mut at = 8;
    while let Some(head) = bytes.get(at..at + 8) {
        let n = u32::from_be_bytes([head[0], head[1], head[2], head[3]]) as usize;
        let kind = [head[4], head[5], head[6], head[7]];
        let Some(body) = bytes.get(at + 8..at + 8 + n) else {
            break;
        };
        parts.push((kind, body.to_vec()));
        at += 12 + n;
    }
    for _ in 0..=r.below(2) {
        let which = r.below(parts.len());
        match r.below(10) {
            0 => {
                parts.remove(which);
            }
            1 => {
                let twice = parts[which].clone();
                parts.insert(which, twice);
            }
            2 => {
                let other = r.below(parts.len());
                parts.swap(which, other);
            }
            3 => {
                let body: Vec<u8> = (0..r.below(20)).map(|_| r.next() as u8).collect();
                let kind = [
                    b"PLTE", b"tRNS", b"iCCP", b"zTXt", b"gAMA", b"cHRM", b"sRGB", b"acTL",
                    b"fcTL", b"fdAT", b"eXIf",
                ][r.below(11)];
                parts.insert(which, (*kind, body));
            }
            4 | 5 => {
                // The header: sides and form near those that exist.
                if let Some((_, body)) = parts
                    .iter_mut()
                    .find(|p| &p.0 == b"IHDR")
                    .filter(|p| p.1.len() == 13)
                {
                    match r.below(4) {
                        0 => body[3] = r.below(20) as u8,
                        1 => body[7] = r.below(20) as u8,
                        2 => body[r.below(8)] = r.next() as u8,
                        _ => {
                            body[8] = [1, 2, 4, 8, 16][r.below(5)];
                            body[9] = [0, 2, 3, 4, 6][r.below(5)];
                            body[12] = r.below(2) as u8;
                        }
                    }
                }
            }
            _ => {
                let (kind, body) = &mut parts[which];
                spoil(r, body);
                // Stored data keep their sum, where the frame of the code is whole.
                if kind == b"IDAT" && body.len() > 11 && body[2] == 1 {
                    let n = body.len();
                    let sum = adler(&body[7..n - 4]).to_be_bytes();
                    body[n - 4..].copy_from_slice(&sum);
                }
            }
        }
        if parts.is_empty() {
            break;
        }
    }
    bytes.truncate(8);
    for (kind, body) in &parts {
        bytes.extend(chunk(kind, body));
    }
}

/// A JPEG in grey and one in colour.
pub(crate) fn jpegs() -> Vec<Vec<u8>> {
    let make = |w: u32, h: u32, form: image::ExtendedColorType, n: u32| {
        let mut out = Vec::new();
        let pixels: Vec<u8> = (0..w * h * n).map(|i| (i * 37 % 256) as u8).collect();
        image::codecs::jpeg::JpegEncoder::new_with_quality(&mut out, 60)
            .write_image(&pixels, w, h, form)
            .unwrap_or_default();
        out
    };
    vec![
        make(8, 8, image::ExtendedColorType::L8, 1),
        make(17, 9, image::ExtendedColorType::Rgb8, 3),
    ]
}

/// Radiance pictures: flat, run-length coded, with other sides first and another colour form.
pub(crate) fn hdrs() -> Vec<Vec<u8>> {
    let head = |more: &str, sides: &str| format!("#?RADIANCE\n{more}\n{sides}\n").into_bytes();
    let flat = |mut h: Vec<u8>, n: u8| {
        (0..n).for_each(|i| h.extend([i, 2 * i, 255 - i, 120 + i]));
        h
    };
    let mut coded = head("FORMAT=32-bit_rle_rgbe\n", "-Y 2 +X 8");
    for _ in 0..2 {
        coded.extend([2, 2, 0, 8]);
        for c in 0..4_u8 {
            coded.extend([130, 50 * c + 9, 6, 1, 2, 3, 4, 5, 129]);
        }
    }
    let mut old = head("FORMAT=32-bit_rle_rgbe\n", "-Y 1 +X 8");
    old.extend([9, 9, 9, 128, 1, 1, 1, 6, 7, 7, 7, 128]);
    vec![
        flat(head("FORMAT=32-bit_rle_rgbe\n", "-Y 2 +X 2"), 4),
        flat(
            head(
                "# a word\nEXPOSURE=2.5\nGAMMA=1\nFORMAT=32-bit_rle_xyze\n",
                "+Y 1 -X 3",
            ),
            3,
        ),
        flat(
            b"#?RGBE\nFORMAT=32-bit_rle_rgbe\nCOLORCORR=1 2 3\nPIXASPECT=1\n\n-Y 3 +X 1\n".to_vec(),
            3,
        ),
        old,
        coded,
    ]
}

/// OpenEXR in every compression that is written, by lines and by tiles, with several parts.
pub(crate) fn exrs() -> Vec<Vec<u8>> {
    let pixel = |p: Vec2<usize>| {
        (
            p.x() as f32 * 0.25,
            1.0 / (p.y() + 1) as f32,
            f16::from_f32(p.x() as f32),
        )
    };
    let written = |encoding: Encoding, w: usize, h: usize| {
        let mut out = Cursor::new(Vec::new());
        let layer = Layer::new(
            (w, h),
            LayerAttributes::named("a"),
            encoding,
            SpecificChannels::rgb(pixel),
        );
        Image::from_layer(layer)
            .write()
            .non_parallel()
            .to_buffered(&mut out)
            .map_or(Vec::new(), |()| out.into_inner())
    };
    let lines = |compression| Encoding {
        compression,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let mut out = vec![
        written(lines(Compression::Uncompressed), 2, 2),
        written(lines(Compression::RLE), 3, 2),
        written(lines(Compression::ZIP1), 2, 3),
        written(lines(Compression::ZIP16), 4, 2),
        written(lines(Compression::PIZ), 3, 3),
        written(lines(Compression::PXR24), 3, 2),
        written(lines(Compression::B44), 5, 4),
        written(
            Encoding {
                compression: Compression::RLE,
                blocks: Blocks::Tiles(Vec2(4, 4)),
                line_order: LineOrder::Increasing,
            },
            6,
            5,
        ),
    ];
    // What this crate writes: many layers, metadata.
    let mut film = woven_render::film::Film::of_beauty(3, 2, vec![[0.5, 1.0, 2.0]; 6]);
    film.push("normal", vec![[0.0, 1.0, 0.0]; 6]);
    film.push("depth", vec![[3.0; 3]; 6]);
    film.metadata.insert("seed".into(), "1".into());
    let whole = tempfile::tempdir().ok().and_then(|dir| {
        let path = dir.path().join("a.exr");
        woven_render::exr_io::write(&film, &path).ok()?;
        std::fs::read(path).ok()
    });
    out.extend(whole);
    out.retain(|b| !b.is_empty());
    out
}

/// A point cache of three points and two frames.
pub(crate) fn pc2() -> Vec<u8> {
    let mut out = b"POINTCACHE2\0".to_vec();
    out.extend(1_u32.to_le_bytes());
    out.extend(3_u32.to_le_bytes());
    out.extend(0_f32.to_le_bytes());
    out.extend(1_f32.to_le_bytes());
    out.extend(2_u32.to_le_bytes());
    (0..18).for_each(|i| out.extend((i as f32 * 0.1).to_le_bytes()));
    out
}
