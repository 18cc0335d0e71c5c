//! The environment's rows: radiance and the distribution by which it is sampled.

use crate::cpu::math::luminance;
use crate::scene::{LAYERS, Scene};

use super::{NONE, Table};
use glam::Vec3;

/// Fills `table.sky` and what the globals say of it.
pub(super) fn fill(table: &mut Table, scene: &Scene, light_layers: bool) {
    table.globals.sky_light = NONE;
    let Some(sky) = &scene.environment else {
        return;
    };
    let (w, h) = (sky.width as usize, sky.height as usize);
    let lum = |i: usize| luminance(Vec3::from(sky.pixels[i]) * Vec3::from(sky.scale));
    let solid = |row: usize| {
        let angle = |r: usize| std::f64::consts::PI * r as f64 / h as f64;
        ((angle(row).cos() - angle(row + 1).cos()) * std::f64::consts::TAU / w as f64) as f32
    };
    let mean = (0..w * h)
        .map(|i| f64::from(lum(i) * solid(i / w)))
        .sum::<f64>()
        / (2.0 * std::f64::consts::TAU);
    // A tenth of the mean everywhere: pixels between a bright and a black one are interpolated and not black.
    let floor = 0.1 * mean.max(1e-30);
    let weight = |x: usize, y: usize| (f64::from(lum(y * w + x)) + floor) * f64::from(solid(y));
    let mut rows = Vec::with_capacity(h);
    let mut pixels = Vec::with_capacity(w * h + h);
    for y in 0..h {
        let total: f64 = (0..w).map(|x| weight(x, y)).sum();
        let mut sum = 0.0;
        for x in 0..w {
            sum += weight(x, y);
            let [r, g, b] = sky.pixels[y * w + x];
            pixels.push([
                r,
                g,
                b,
                if x + 1 == w {
                    1.0
                } else {
                    (sum / total) as f32
                },
            ]);
        }
        rows.push(total);
    }
    let total: f64 = rows.iter().sum();
    let mut sum = 0.0;
    for (y, row) in rows.iter().enumerate() {
        sum += row;
        pixels.push([
            if y + 1 == h {
                1.0
            } else {
                (sum / total) as f32
            },
            0.0,
            0.0,
            0.0,
        ]);
    }
    // How far the picture is from even: mean of squares over square of the mean. A smooth sky is best sampled through
    // the windows alone; one with a bright spot needs the spot to be sampled too.
    let squares: f64 = (0..w * h)
        .map(|i| f64::from(lum(i)).powi(2) * f64::from(solid(i / w)))
        .sum::<f64>()
        / (2.0 * std::f64::consts::TAU);
    let peaks = squares / (mean * mean).max(1e-30);
    let g = &mut table.globals;
    g.sky_scale = [sky.scale[0], sky.scale[1], sky.scale[2], mean as f32];
    g.sky_width = sky.width;
    g.sky_height = sky.height;
    g.sky_turn = [sky.rotation.cos(), sky.rotation.sin()];
    g.portal_share = if peaks > 8.0 { 0.5 } else { 1.0 };
    g.sky_layer = if light_layers {
        sky.layer.min(LAYERS as u32 - 1)
    } else {
        0
    };
    table.sky = pixels;
}
