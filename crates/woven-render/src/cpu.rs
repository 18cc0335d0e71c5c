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

use crate::accumulate::{Accumulation, PixelSum};
use crate::table::Table;
use path::{Sample, View};
use share::{BLOCK, GROUP, Room};

/// Adds `count` samples to every pixel; false when `stop` was set meanwhile: then only those that every pixel has got
/// are added. Each pixel's samples are added one by one in their order, so that neither threads nor steps change a bit.
/// The first sample takes the place of what is there. `fresh` is room to work in.
pub(crate) fn step(
    table: &Table,
    view: &View,
    sums: &mut Accumulation,
    fresh: &mut Vec<Sample>,
    count: u32,
    stop: &AtomicBool,
) -> bool {
    for index in sums.samples..sums.samples + count {
        let (left, above) = share::shift(index);
        let columns = (view.width + left).div_ceil(BLOCK);
        let rows = (view.height + above).div_ceil(BLOCK);
        fresh.resize(columns as usize * rows as usize * GROUP, Sample::default());
        let blocks = fresh.par_chunks_exact_mut(GROUP).enumerate();
        blocks.for_each_init(Room::new, |room, (block, out)| {
            if stop.load(Ordering::Relaxed) {
                return;
            }
            let block = block as u32;
            let x = (block % columns * BLOCK) as i32 - left as i32;
            let y = (block / columns * BLOCK) as i32 - above as i32;
            share::block(table, view, x, y, index, room, out);
        });
        if stop.load(Ordering::Relaxed) {
            return false;
        }
        let lines = sums.pixels.par_chunks_exact_mut(view.width as usize);
        lines.enumerate().for_each(|(y, line)| {
            for (x, sum) in line.iter_mut().enumerate() {
                if index == 0 {
                    *sum = PixelSum::default();
                }
                sum.add(&fresh[share::find(x as u32, y as u32, index, columns)]);
            }
        });
        sums.samples += 1;
    }
    true
}
