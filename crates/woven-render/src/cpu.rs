//! The reference path tracer on the CPU. Its files pair with those of `shader/`, by name and line of thought.

pub(crate) mod beam;
pub(crate) mod bvh;
pub(crate) mod camera;
pub(crate) mod light;
pub(crate) mod math;
pub(crate) mod measured;
pub(crate) mod motion;
pub(crate) mod path;
pub(crate) mod rect;
pub(crate) mod share;
pub(crate) mod surface;
mod tree;

use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::accumulate::Accumulation;
use crate::table::Table;
use path::View;
use share::BLOCK;

/// Adds `count` samples to every pixel; false when `stop` was set meanwhile: then only those that every pixel has got
/// are added. Each pixel's samples are added one by one in their order, so that neither threads nor steps change a bit.
pub(crate) fn step(
    table: &Table,
    view: &View,
    sums: &mut Accumulation,
    count: u32,
    stop: &AtomicBool,
) -> bool {
    for index in sums.samples..sums.samples + count {
        let (left, above) = share::shift(index);
        let columns = (view.width + left).div_ceil(BLOCK);
        let rows = (view.height + above).div_ceil(BLOCK);
        let blocks: Vec<_> = (0..columns * rows)
            .into_par_iter()
            .map(|block| {
                if stop.load(Ordering::Relaxed) {
                    return Vec::new();
                }
                let x = (block % columns * BLOCK) as i32 - left as i32;
                let y = (block / columns * BLOCK) as i32 - above as i32;
                share::block(table, view, x, y, index)
            })
            .collect();
        if stop.load(Ordering::Relaxed) {
            return false;
        }
        for (pixel, sample) in blocks.iter().flatten() {
            sums.pixels[*pixel].add(sample);
        }
        sums.samples += 1;
    }
    true
}
