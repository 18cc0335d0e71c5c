//! The video files: what a decoder sees in them is what was put in, and a player finds its index first.

use image::{Rgb, RgbImage};
use openh264::decoder::Decoder;
use openh264::formats::YUVSource as _;
use woven_catalog::video;

const SIZE: (u32, u32) = (96, 64);

/// A warm wall with a bright square that moves by three pixels a frame.
fn frame(n: u32) -> RgbImage {
    RgbImage::from_fn(SIZE.0, SIZE.1, |x, y| {
        let inside = (8 + 3 * n..28 + 3 * n).contains(&x) && (20..44).contains(&y);
        if inside {
            Rgb([236, 228, 200])
        } else {
            Rgb([120 + (x / 4) as u8, 90 + (y / 4) as u8, 70])
        }
    })
}

/// The boxes of one level as (kind, contents).
fn boxes(mut bytes: &[u8]) -> Vec<(String, &[u8])> {
    let mut out = Vec::new();
    while bytes.len() >= 8 {
        let length = u32::from_be_bytes(bytes[..4].try_into().unwrap()) as usize;
        out.push((
            String::from_utf8(bytes[4..8].to_vec()).unwrap(),
            &bytes[8..length],
        ));
        bytes = &bytes[length..];
    }
    assert!(bytes.is_empty(), "bytes are left over after the last box");
    out
}

/// The contents of a box found by a path of kinds.
fn find<'a>(bytes: &'a [u8], path: &[&str]) -> &'a [u8] {
    let (_, inner) = boxes(bytes)
        .into_iter()
        .find(|(kind, _)| kind == path[0])
        .unwrap_or_else(|| panic!("no {} box", path[0]));
    if path.len() == 1 {
        inner
    } else {
        find(inner, &path[1..])
    }
}

fn word(bytes: &[u8], at: usize) -> usize {
    u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()) as usize
}

#[test]
fn a_decoder_sees_the_frames_that_went_in() {
    let count = 30;
    let file = video::encode((0..count).map(|n| Ok(frame(n % 12))), 24).unwrap();
    let kinds: Vec<String> = boxes(&file).into_iter().map(|(kind, _)| kind).collect();
    assert_eq!(
        kinds,
        ["ftyp", "moov", "mdat"],
        "the index must come before the pictures"
    );

    let table = ["moov", "trak", "mdia", "minf", "stbl"];
    let stbl = find(&file, &table);
    let (stsz, stco, stss, stsd) = (
        find(stbl, &["stsz"]),
        find(stbl, &["stco"]),
        find(stbl, &["stss"]),
        find(stbl, &["stsd"]),
    );
    assert_eq!(word(stsz, 8), count as usize);
    let sync: Vec<usize> = (0..word(stss, 4)).map(|i| word(stss, 8 + 4 * i)).collect();
    assert_eq!(sync, [1, 13, 25], "one can seek every half second");
    // avc1 holds 78 bytes of its own before its boxes; stsd has 8 before it.
    let avcc = find(&stsd[8 + 8 + 78..], &["avcC"]);
    let sps_length = u16::from_be_bytes([avcc[6], avcc[7]]) as usize;
    let sps = &avcc[8..8 + sps_length];
    let pps_length = u16::from_be_bytes([avcc[9 + sps_length], avcc[10 + sps_length]]) as usize;
    let pps = &avcc[11 + sps_length..11 + sps_length + pps_length];

    let mut stream = Vec::new();
    let mut at = word(stco, 8);
    let mut decoder = Decoder::new().unwrap();
    for n in 0..count {
        stream.clear();
        if n == 0 {
            for set in [sps, pps] {
                stream.extend_from_slice(&[0, 0, 0, 1]);
                stream.extend_from_slice(set);
            }
        }
        let end = at + word(stsz, 12 + 4 * n as usize);
        while at < end {
            let length = word(&file, at);
            stream.extend_from_slice(&[0, 0, 0, 1]);
            stream.extend_from_slice(&file[at + 4..at + 4 + length]);
            at += 4 + length;
        }
        let picture = decoder
            .decode(&stream)
            .unwrap()
            .expect("every sample is one picture");
        assert_eq!(picture.dimensions(), (SIZE.0 as usize, SIZE.1 as usize));
        let expected = frame(n % 12);
        let mut squares = 0.0;
        for (x, y, p) in expected.enumerate_pixels() {
            let luma =
                0.2126 * f64::from(p[0]) + 0.7152 * f64::from(p[1]) + 0.0722 * f64::from(p[2]);
            let seen = f64::from(picture.y()[y as usize * picture.strides().0 + x as usize]);
            squares += (seen - (16.0 + luma * 219.0 / 255.0)).powi(2);
        }
        let psnr = 10.0 * (255.0_f64.powi(2) / (squares / f64::from(SIZE.0 * SIZE.1))).log10();
        // Quantisers 14..24 give 40 dB and more on such plain pictures; a wrong frame order gives about 20.
        assert!(psnr > 38.0, "frame {n}: {psnr:.1} dB");
        // Colour at the wall, far from the square (Rec.709: blue difference below, red difference above the middle).
        let (u, v) = (
            picture.u()[2 * picture.strides().1 + 46],
            picture.v()[2 * picture.strides().2 + 46],
        );
        let p = expected.get_pixel(92, 4).0.map(f64::from);
        let luma = 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2];
        let cb = 128.0 + (p[2] - luma) / 1.8556 * 224.0 / 255.0;
        let cr = 128.0 + (p[0] - luma) / 1.5748 * 224.0 / 255.0;
        assert!(
            (f64::from(u) - cb).abs() < 4.0 && (f64::from(v) - cr).abs() < 4.0,
            "frame {n}: colour {u},{v} instead of {cb:.0},{cr:.0}"
        );
    }
    assert_eq!(at, file.len());
}

#[test]
fn the_same_frames_give_the_same_bytes() {
    let once = || video::encode((0..8).map(|n| Ok(frame(n))), 24).unwrap();
    assert!(once() == once());
}

#[test]
fn unsuitable_pictures_are_refused_with_a_sentence() {
    let say = |size: (u32, u32)| {
        video::encode([Ok(RgbImage::new(size.0, size.1))], 24)
            .unwrap_err()
            .to_string()
    };
    assert!(say((33, 64)).contains("odd side"));
    assert!(say((16, 64)).contains("too small"));
    assert!(say((4000, 64)).contains("too large"));
    assert!(
        video::encode([], 24)
            .unwrap_err()
            .to_string()
            .contains("at least one frame")
    );
    let mixed =
        video::encode([Ok(RgbImage::new(64, 64)), Ok(RgbImage::new(64, 32))], 24).unwrap_err();
    assert!(mixed.to_string().contains("Frame 1"));
}
