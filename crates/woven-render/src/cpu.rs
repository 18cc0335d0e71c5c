//! The reference path tracer on the CPU. Its files pair with those of `shader/`, by name and line of thought.

pub(crate) mod bvh;
pub(crate) mod light;
pub(crate) mod math;
pub(crate) mod path;
pub(crate) mod rect;
pub(crate) mod surface;

use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::accumulate::{Accumulation, PixelSum};
use crate::table::Table;
use path::View;

/// Side of a tile in pixels.
const TILE: u32 = 16;

/// Adds `count` samples to every pixel; false, and nothing added, when `stop` was set meanwhile. Each pixel's samples
/// are added one by one in their order, so that neither threads nor steps change a bit.
pub(crate) fn step(
    table: &Table,
    view: &View,
    sums: &mut Accumulation,
    count: u32,
    stop: &AtomicBool,
) -> bool {
    let (columns, rows) = (view.width.div_ceil(TILE), view.height.div_ceil(TILE));
    let first = sums.samples;
    let old = &sums.pixels;
    let tiles: Vec<Vec<PixelSum>> = (0..columns * rows)
        .into_par_iter()
        .map(|tile| {
            let mut pixels = Vec::with_capacity((TILE * TILE) as usize);
            each_pixel(view, tile, |x, y| {
                if stop.load(Ordering::Relaxed) {
                    return;
                }
                let mut sum = old[(y * view.width + x) as usize];
                for index in first..first + count {
                    sum.add(&path::sample(table, view, x, y, index));
                }
                pixels.push(sum);
            });
            pixels
        })
        .collect();
    if stop.load(Ordering::Relaxed) {
        return false;
    }
    for (tile, pixels) in tiles.iter().enumerate() {
        let mut i = 0;
        each_pixel(view, tile as u32, |x, y| {
            sums.pixels[(y * view.width + x) as usize] = pixels[i];
            i += 1;
        });
    }
    sums.samples += count;
    true
}

/// The pixels of a tile, row by row.
fn each_pixel(view: &View, tile: u32, mut f: impl FnMut(u32, u32)) {
    let columns = view.width.div_ceil(TILE);
    let (x0, y0) = (tile % columns * TILE, tile / columns * TILE);
    for y in y0..(y0 + TILE).min(view.height) {
        for x in x0..(x0 + TILE).min(view.width) {
            f(x, y);
        }
    }
}
