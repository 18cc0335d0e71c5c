//! Pictures painted by formula for the room: oak boards, a woven rug, a framed print.

use woven_render::scene::{Texture, Wrap};

use super::shape::noise;

/// Smooth value noise in 0..1 that repeats every `period` cells.
fn smooth(seed: u32, x: f32, y: f32, period: u32) -> f32 {
    let (cx, cy) = (x.floor(), y.floor());
    let ease = |t: f32| t * t * (3.0 - 2.0 * t);
    let (fx, fy) = (ease(x - cx), ease(y - cy));
    let cell = |i: f32, j: f32| {
        noise(
            seed,
            (i as i64).rem_euclid(i64::from(period)) as u32 * 733
                + (j as i64).rem_euclid(i64::from(period)) as u32,
        )
    };
    let row = |j: f32| cell(cx, j) * (1.0 - fx) + cell(cx + 1.0, j) * fx;
    row(cy) * (1.0 - fy) + row(cy + 1.0) * fy
}

fn paint(name: &str, width: u32, height: u32, color: impl Fn(f32, f32) -> [f32; 3]) -> Texture {
    let mut pixels = Vec::with_capacity((width * height) as usize);
    for y in 0..height {
        for x in 0..width {
            let [r, g, b] = color(
                (x as f32 + 0.5) / width as f32,
                (y as f32 + 0.5) / height as f32,
            )
            .map(|v| (v.clamp(0.0, 1.0) * 255.0).round() as u8);
            pixels.push([r, g, b, 255]);
        }
    }
    Texture {
        name: name.to_owned(),
        width,
        height,
        pixels,
        srgb: true,
        wrap_u: Wrap::Repeat,
        wrap_v: Wrap::Repeat,
    }
}

fn mix(a: [f32; 3], b: [f32; 3], t: f32) -> [f32; 3] {
    [0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * t)
}

/// Oak boards, 0.15 m wide, that run along v; one repeat is 1.2 m by 2.4 m. Values are sRGB.
pub(super) fn oak() -> Texture {
    const BOARDS: f32 = 8.0;
    paint("oak", 512, 1024, |u, v| {
        let board = (u * BOARDS).floor();
        let across = u * BOARDS - board;
        let shift = noise(11, board as u32);
        let length = (v * 2.0 + shift * 2.0).rem_euclid(2.0);
        let piece = board as u32 * 2 + length as u32;
        let along = length.fract();
        let grain = smooth(piece, u * 96.0, v * 6.0 + 40.0 * noise(5, piece), 96) * 0.6
            + smooth(piece + 99, u * 256.0, v * 12.0, 256) * 0.4;
        let tone = 0.35 * noise(3, piece) + 0.5 * grain;
        let color = mix([0.74, 0.60, 0.45], [0.55, 0.41, 0.28], tone);
        // The joint: a dark line of 2 mm between boards and at their ends.
        let joint = (across.min(1.0 - across) * 0.15 / 0.002)
            .min(along.min(1.0 - along) * 1.2 / 0.003)
            .min(1.0);
        color.map(|c| c * (0.55 + 0.45 * joint))
    })
}

/// A flat-woven rug of undyed wool with bands; one repeat is the whole rug. Values are sRGB.
pub(super) fn rug() -> Texture {
    paint("rug", 512, 512, |u, v| {
        let weave = 0.5 + 0.5 * ((u * 512.0 * 0.9).sin() * (v * 512.0 * 0.9).sin());
        let blotch = smooth(21, u * 14.0, v * 14.0, 14);
        let band = |at: f32, half: f32| {
            ((u - at).abs() < half || (1.0 - u - at).abs() < half) as u32 as f32
        };
        let stripe = (band(0.10, 0.018) + band(0.16, 0.006) + band(0.055, 0.006)).min(1.0);
        let ground = mix([0.80, 0.76, 0.68], [0.72, 0.67, 0.59], blotch);
        mix(ground, [0.36, 0.40, 0.42], stripe * 0.8).map(|c| c * (0.9 + 0.1 * weave))
    })
}

/// A print for the wall: two quiet hills and a pale sun. Values are sRGB.
pub(super) fn print() -> Texture {
    paint("print", 128, 160, |u, v| {
        let sun = ((u - 0.64).powi(2) + ((v - 0.3) * 1.25).powi(2)).sqrt() < 0.11;
        let near = v > 0.74 + 0.05 * (u * 5.0).sin();
        let far = v > 0.56 + 0.07 * (u * 3.3 + 1.9).sin();
        let color = match (near, far, sun) {
            (true, ..) => [0.29, 0.38, 0.36],
            (_, true, _) => [0.55, 0.62, 0.56],
            (.., true) => [0.89, 0.62, 0.42],
            _ => [0.93, 0.89, 0.81],
        };
        color.map(|c: f32| c * (0.97 + 0.03 * smooth(4, u * 64.0, v * 64.0, 64)))
    })
}
