//! A strip of simply shaded frames: to see at a glance how a curtain hangs and moves, without a renderer.

use crate::clip::CurtainClip;

/// A picture of `width` × `height` pixels, three bytes each, rows from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Red, green and blue of every pixel.
    pub rgb: Vec<u8>,
}

/// The rest pose and `count - 1` frames evenly over the clip, side by side, each `tile` pixels high, seen from the room a little
/// from the left and above.
#[must_use]
pub fn strip(clip: &CurtainClip, count: usize, tile: usize) -> Picture {
    let count = count.clamp(1, clip.frames.len() + 1);
    let shots: Vec<&[[f32; 3]]> = (0..count)
        .map(|k| match k {
            0 => clip.mesh.positions.as_slice(),
            _ => clip.frames[(clip.frames.len() - 1) * k / (count - 1).max(1)]
                .positions
                .as_slice(),
        })
        .collect();
    // One frame for all shots, so that sizes compare.
    let (mut lo, mut hi) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
    for p in shots.iter().flat_map(|s| s.iter()) {
        let q = project(*p);
        for c in 0..2 {
            lo[c] = lo[c].min(q[c]);
            hi[c] = hi[c].max(q[c]);
        }
    }
    let scale = (tile as f32 - 16.0) / (hi[1] - lo[1]).max(1e-3);
    let width = ((hi[0] - lo[0]) * scale) as usize + 16;
    let mut picture = Picture {
        width: width * count,
        height: tile,
        rgb: vec![28; width * count * tile * 3],
    };
    for (k, shot) in shots.iter().enumerate() {
        let mut depth = vec![f32::NEG_INFINITY; width * tile];
        let place = |p: [f32; 3]| {
            let q = project(p);
            [
                (q[0] - lo[0]) * scale + 8.0,
                (hi[1] - q[1]) * scale + 8.0,
                q[2],
            ]
        };
        let corners: Vec<[f32; 3]> = shot.iter().map(|p| place(*p)).collect();
        let normals = smooth_normals(shot, &clip.mesh.indices);
        for t in clip.mesh.indices.chunks_exact(3) {
            let (a, b, c) = (t[0] as usize, t[1] as usize, t[2] as usize);
            triangle(
                [corners[a], corners[b], corners[c]],
                width,
                tile,
                &mut depth,
                |pixel, bary| {
                    let n: [f32; 3] = std::array::from_fn(|q| {
                        normals[a][q] * bary[0] + normals[b][q] * bary[1] + normals[c][q] * bary[2]
                    });
                    let at = (pixel / width * picture.width + k * width + pixel % width) * 3;
                    picture.rgb[at..at + 3].copy_from_slice(&shade(n));
                },
            );
        }
    }
    picture
}

/// Turned by 20° about the vertical and tilted by 8°; x right, y up, z towards the eye.
fn project(p: [f32; 3]) -> [f32; 3] {
    let (s, c) = 20f32.to_radians().sin_cos();
    let (x, z) = (c * p[0] + s * p[2], c * p[2] - s * p[0]);
    let (s, c) = 8f32.to_radians().sin_cos();
    [x, c * p[1] - s * z, s * p[1] + c * z]
}

fn smooth_normals(points: &[[f32; 3]], indices: &[u32]) -> Vec<[f32; 3]> {
    let mut sum = vec![[0.0f32; 3]; points.len()];
    for t in indices.chunks_exact(3) {
        let [a, b, c] = [t[0], t[1], t[2]].map(|k| points[k as usize]);
        let (p, q): ([f32; 3], [f32; 3]) = (
            std::array::from_fn(|k| b[k] - a[k]),
            std::array::from_fn(|k| c[k] - a[k]),
        );
        let n = [
            p[1] * q[2] - p[2] * q[1],
            p[2] * q[0] - p[0] * q[2],
            p[0] * q[1] - p[1] * q[0],
        ];
        for v in t {
            for k in 0..3 {
                sum[*v as usize][k] += n[k];
            }
        }
    }
    sum
}

/// Two-sided cloth under a light from the upper left and a softer one from behind the eye; sRGB bytes.
fn shade(n: [f32; 3]) -> [u8; 3] {
    let l = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt().max(1e-20);
    let dot = |d: [f32; 3]| (n[0] * d[0] + n[1] * d[1] + n[2] * d[2]) / l;
    let (key, fill) = (dot([-0.64, 0.38, 0.66]), dot([0.30, 0.1, 0.95]));
    let light = 0.08
        + 0.62
            * if fill >= 0.0 {
                key.max(0.0)
            } else {
                0.7 * (-key).max(0.0)
            }
        + 0.10 * fill.abs();
    // The far side a little bluer, so that turned folds show.
    let tint = if fill >= 0.0 {
        [1.0, 0.96, 0.88]
    } else {
        [0.72, 0.8, 0.95]
    };
    tint.map(|t| ((light * t).clamp(0.0, 1.0).powf(1.0 / 2.2) * 255.0) as u8)
}

/// Calls `set(pixel, barycentric)` for every pixel of a triangle that is nearer than what is there.
fn triangle(
    p: [[f32; 3]; 3],
    width: usize,
    height: usize,
    depth: &mut [f32],
    mut set: impl FnMut(usize, [f32; 3]),
) {
    let area =
        (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[2][0] - p[0][0]) * (p[1][1] - p[0][1]);
    if area.abs() < 1e-9 {
        return;
    }
    let range = |c: usize, most: usize| {
        let lo = p
            .iter()
            .map(|q| q[c])
            .fold(f32::INFINITY, f32::min)
            .floor()
            .max(0.0) as usize;
        let hi = p
            .iter()
            .map(|q| q[c])
            .fold(f32::NEG_INFINITY, f32::max)
            .ceil()
            .clamp(0.0, most as f32) as usize;
        lo..hi
    };
    for y in range(1, height) {
        for x in range(0, width) {
            let (px, py) = (x as f32 + 0.5, y as f32 + 0.5);
            let edge = |a: [f32; 3], b: [f32; 3]| {
                ((b[0] - a[0]) * (py - a[1]) - (px - a[0]) * (b[1] - a[1])) / area
            };
            let bary = [edge(p[1], p[2]), edge(p[2], p[0]), edge(p[0], p[1])];
            if bary.iter().any(|b| *b < 0.0) {
                continue;
            }
            let z = bary[0] * p[0][2] + bary[1] * p[1][2] + bary[2] * p[2][2];
            let pixel = y * width + x;
            if z > depth[pixel] {
                depth[pixel] = z;
                set(pixel, bary);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Mechanics, Mesh, Sheet};

    #[test]
    fn a_flat_sheet_fills_its_tile() {
        let mesh = Mesh::from_sheet(&Sheet::flat(5, 5, 1.0, 1.0, Mechanics::default()));
        let picture = strip(
            &CurtainClip {
                mesh,
                frames: Vec::new(),
                fps: 24.0,
            },
            3,
            100,
        );
        let lit = picture.rgb.chunks(3).filter(|p| p[0] > 60).count();
        assert!(
            lit > picture.width * picture.height / 2,
            "{lit} of {}",
            picture.width * picture.height
        );
    }
}
