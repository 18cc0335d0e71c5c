//! How far the patches of the cloth move in a step, row of patches by row of patches.

use super::distance::{Point, dot, sub};
use super::net::Grid;
use super::tiles::SIDE;
use crate::sheet::Field;
use crate::work::widest;
use rayon::prelude::*;

/// What the halving of a patch's columns below relies on.
const _: () = assert!(SIDE == 4);

/// How a patch moves in a step: all its vertices go by `middle`, give or take `radius`, m.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Motion {
    pub(crate) middle: Point,
    pub(crate) radius: f64,
}

impl Motion {
    /// The most that a point of one patch moves relative to one of another, m.
    #[inline(always)]
    pub(crate) fn against(&self, other: &Self) -> f64 {
        let d = sub(self.middle, other.middle);
        dot(d, d).sqrt() + self.radius + other.radius
    }
}

/// Fills the motions of all patches (in the order of [`super::tiles::Tile::all`]) from `before` to `now`.
pub(crate) fn take(
    grids: &[Grid],
    before: &Field,
    now: &Field,
    motions: &mut [Motion],
    parallel: bool,
) {
    let mut rest = motions;
    for g in grids {
        let across = g.nx.div_ceil(SIDE);
        let (mine, others) = rest.split_at_mut(across * g.ny.div_ceil(SIDE));
        rest = others;
        let row = |(j, out): (usize, &mut [Motion])| {
            widest(
                #[inline(always)]
                || of_row(g, j * SIDE, before, now, out),
            );
        };
        if parallel {
            mine.par_chunks_mut(across).enumerate().for_each(row);
        } else {
            mine.chunks_mut(across).enumerate().for_each(row);
        }
    }
}

/// The motions of the patches whose first row is `j`: the least and the most of every column, then of the columns of each patch.
#[inline(always)]
fn of_row(g: &Grid, j: usize, before: &Field, now: &Field, out: &mut [Motion]) {
    let nx = g.nx;
    let mut columns = vec![0.0; 2 * nx];
    let (low, high) = columns.split_at_mut(nx);
    for m in out.iter_mut() {
        m.radius = 0.0;
    }
    for c in 0..3 {
        low.fill(f64::INFINITY);
        high.fill(f64::NEG_INFINITY);
        for j in j..(j + SIDE + 1).min(g.ny) {
            let first = g.first + j * nx;
            let (a, b) = (&before[c][first..][..nx], &now[c][first..][..nx]);
            // Lengths that the compiler sees to be the same let it work on many columns at once.
            let (low, high) = (&mut low[..nx], &mut high[..nx]);
            for i in 0..nx {
                let d = b[i] - a[i];
                low[i] = if d < low[i] { d } else { low[i] };
                high[i] = if d > high[i] { d } else { high[i] };
            }
        }
        // The least and the most of two neighbours, of four, and at last of the five columns of a patch.
        for step in [1, 2] {
            for i in 0..nx.saturating_sub(step) {
                let (a, b) = (low[i + step], high[i + step]);
                low[i] = if a < low[i] { a } else { low[i] };
                high[i] = if b > high[i] { b } else { high[i] };
            }
        }
        for (k, m) in out.iter_mut().enumerate() {
            let i = k * SIDE;
            let last = (i + 1).min(nx - 1);
            let (least, most) = (low[i].min(low[last]), high[i].max(high[last]));
            m.middle[c] = 0.5 * (least + most);
            m.radius += (most - least) * (most - least);
        }
    }
    for m in out {
        m.radius = 0.5 * m.radius.sqrt();
    }
}
