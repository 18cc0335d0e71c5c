//! Smaller copies of a texture, each of half the side, for what is seen from far away.

use crate::cpu::surface::SRGB;
use crate::film::srgb_encode;
use crate::scene::Texture;

/// Appends the picture and its copies down to one texel; gives the number of copies. Light is averaged, not its code.
pub(super) fn append(texture: &Texture, texels: &mut Vec<u32>) -> u32 {
    let (mut w, mut h) = (texture.width as usize, texture.height as usize);
    texels.extend(texture.pixels.iter().map(|&p| u32::from_le_bytes(p)));
    let mut level: Vec<[f32; 4]> = Vec::new();
    let mut copies = 0;
    while w > 1 || h > 1 {
        if level.is_empty() {
            let decoded = |p: &[u8; 4]| -> [f32; 4] {
                std::array::from_fn(|c| {
                    if texture.srgb && c < 3 {
                        SRGB[p[c] as usize]
                    } else {
                        f32::from(p[c]) / 255.0
                    }
                })
            };
            level = texture.pixels.iter().map(decoded).collect();
        }
        let (w2, h2) = ((w / 2).max(1), (h / 2).max(1));
        let mut next = Vec::with_capacity(w2 * h2);
        for y in 0..h2 {
            for x in 0..w2 {
                // Of odd sides the last row or column takes part in the last texel.
                let (x0, x1) = (x * w / w2, ((x + 1) * w / w2).max(x * w / w2 + 1));
                let (y0, y1) = (y * h / h2, ((y + 1) * h / h2).max(y * h / h2 + 1));
                let mut sum = [0.0; 4];
                for j in y0..y1 {
                    for i in x0..x1 {
                        (0..4).for_each(|c| sum[c] += level[j * w + i][c]);
                    }
                }
                let n = ((x1 - x0) * (y1 - y0)) as f32;
                next.push(sum.map(|s| s / n));
            }
        }
        (w, h, level) = (w2, h2, next);
        texels.extend(level.iter().map(|p| {
            let bytes: [u8; 4] = std::array::from_fn(|c| {
                let v = if texture.srgb && c < 3 {
                    srgb_encode(p[c])
                } else {
                    p[c]
                };
                (v * 255.0 + 0.5) as u8
            });
            u32::from_le_bytes(bytes)
        }));
        copies += 1;
    }
    copies
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn black_and_white_squares_become_the_grey_that_reflects_half() {
        let texture = Texture {
            width: 4,
            height: 3,
            pixels: (0..12)
                .map(|i| {
                    if (i % 4 + i / 4) % 2 == 0 {
                        [255; 4]
                    } else {
                        [0, 0, 0, 255]
                    }
                })
                .collect(),
            srgb: true,
            ..Texture::default()
        };
        let mut texels = vec![7];
        assert_eq!(append(&texture, &mut texels), 2);
        // 4 x 3, 2 x 1, 1 x 1.
        assert_eq!(texels.len(), 1 + 12 + 2 + 1);
        // Half of the light is 188 of 255 in sRGB, not 128.
        let last = texels[15].to_le_bytes();
        assert_eq!((last[0], last[3]), (188, 255));
    }
}
