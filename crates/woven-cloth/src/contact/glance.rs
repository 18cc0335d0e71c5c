//! A glance at two patches that are neighbours on the cloth (or one and the same): a bound of the distance of what does not share a
//! vertex, some ten times cheaper than the distance itself.
//!
//! Cells that do not touch are told apart by their boxes. Cells that do, by how little the cloth bends there: where the edges along weft and
//! warp of 2 x 2 cells differ from a linear map A by at most e (the largest of the differences of every triangle's derivative), two points
//! that are d apart on the flat cloth are (s - e) d apart in space, s the lesser singular value of A, since the straight way between
//! them lies within the cells. What bends too much for that is left to [`Tile::look`].

use super::distance::{Point, dot};
use super::net::Grid;
use super::tiles::{Bounds, SIDE, Tile};
use crate::sheet::Field;

/// Cells of a patch.
const ALL: usize = SIDE * SIDE;

/// A lower bound, m, of the distance at `x` of what does not share a vertex in two patches of the grid `g` that adjoin; no more than 0 where
/// the cloth bends too much to tell.
#[inline(always)]
pub(super) fn glance(a: &Tile, b: &Tile, g: &Grid, x: &Field) -> f64 {
    if g.nx < 3 || g.ny < 3 {
        return 0.0;
    }
    touching_cells(a, b, g, x).min(other_cells(a, b, g, x))
}

/// The bound for cells that share a corner.
#[inline(always)]
fn touching_cells(a: &Tile, b: &Tile, g: &Grid, x: &Field) -> f64 {
    // What has no vertex in common is a triangle's least height apart on the flat cloth, here that over a cell's diagonal.
    let apart = g.hx * g.hy / g.hx.hypot(g.hy);
    let mut least = f64::INFINITY;
    for j in corners(&a.j, &b.j, g.ny) {
        for i in corners(&a.i, &b.i, g.nx) {
            least = least.min(stiffness(g, x, [i, j]));
        }
    }
    least * apart
}

/// First columns (or rows) of the 2 x 2 cells which hold all that touches in patches of columns (or rows) `a` and `b`.
#[inline(always)]
fn corners(
    a: &std::ops::Range<usize>,
    b: &std::ops::Range<usize>,
    n: usize,
) -> std::ops::Range<usize> {
    let (from, to) = if a.start == b.start {
        (a.start, (a.end - 1).max(a.start + 1))
    } else {
        let border = a.start.max(b.start);
        (border - 1, border)
    };
    // Three vertices are there in any case.
    let last = n - 3;
    from.min(last)..to.min(last + 1)
}

/// How far points of 2 x 2 cells are apart in space, at least, over their distance on the flat cloth.
#[inline(always)]
fn stiffness(g: &Grid, x: &Field, [i, j]: [usize; 2]) -> f64 {
    let k = g.first + j * g.nx + i;
    let (mut weft, mut warp) = (Bounds::EMPTY, Bounds::EMPTY);
    for c in 0..3 {
        let row = |j: usize| -> Point {
            let k = k + j * g.nx;
            std::array::from_fn(|i| x[c][k + i])
        };
        let p = [row(0), row(1), row(2)];
        for n in 0..3 {
            weft.widen(c, p[n][1] - p[n][0]);
            weft.widen(c, p[n][2] - p[n][1]);
            warp.widen(c, p[1][n] - p[0][n]);
            warp.widen(c, p[2][n] - p[1][n]);
        }
    }
    let (a, b) = (
        weft.middle().map(|d| d * (1.0 / g.hx)),
        warp.middle().map(|d| d * (1.0 / g.hy)),
    );
    let apart2 = weft.radius2() / (g.hx * g.hx) + warp.radius2() / (g.hy * g.hy);
    let (p, q, r) = (dot(a, a), dot(a, b), dot(b, b));
    let s2 = 0.5 * (p + r) - (0.25 * (p - r) * (p - r) + q * q).sqrt();
    s2.max(0.0).sqrt() - apart2.sqrt()
}

/// The bound for cells that do not touch on the cloth.
#[inline(always)]
fn other_cells(a: &Tile, b: &Tile, g: &Grid, x: &Field) -> f64 {
    let (mine, theirs) = (Boxes::of(a, g, x), Boxes::of(b, g, x));
    let mut least = [f64::INFINITY; SIDE];
    for (n, row) in theirs.rows.iter().enumerate() {
        for (m, low, high) in mine.cells() {
            let (j, i) = (a.j.start + m / SIDE, a.i.start + m % SIDE);
            let beside = j.abs_diff(b.j.start + n) <= 1;
            let mut d2 = [0.0; SIDE];
            for c in 0..3 {
                for l in 0..SIDE {
                    let (above, below) = (row.low[c][l] - high[c], low[c] - row.high[c][l]);
                    let gap = if above > below { above } else { below };
                    let gap = if gap > 0.0 { gap } else { 0.0 };
                    d2[l] += gap * gap;
                }
            }
            if beside {
                for l in 0..SIDE {
                    if i.abs_diff(b.i.start + l) <= 1 {
                        d2[l] = f64::INFINITY;
                    }
                }
            }
            for l in 0..SIDE {
                least[l] = if d2[l] < least[l] { d2[l] } else { least[l] };
            }
        }
    }
    least.into_iter().fold(f64::INFINITY, f64::min).sqrt()
}

/// The boxes of a row of cells.
#[derive(Clone, Copy)]
struct Row {
    low: [[f64; SIDE]; 3],
    high: [[f64; SIDE]; 3],
}

/// The boxes of a patch's cells, row by row; those beyond the cloth's border are empty and far from all.
struct Boxes {
    rows: [Row; SIDE],
}

impl Boxes {
    #[inline(always)]
    fn of(tile: &Tile, g: &Grid, x: &Field) -> Self {
        let empty = Row {
            low: [[f64::INFINITY; SIDE]; 3],
            high: [[f64::NEG_INFINITY; SIDE]; 3],
        };
        let mut rows = [empty; SIDE];
        let wide = tile.i.len();
        for c in 0..3 {
            let mut last = ([0.0; SIDE], [0.0; SIDE]);
            // From the row below the last up, each cell with the row below it.
            for n in (0..=tile.j.len()).rev() {
                let j = (tile.j.start + n).min(g.ny - 1);
                let k = g.first + j * g.nx + tile.i.start;
                let mut p = [x[c][k]; SIDE + 1];
                for (l, p) in p.iter_mut().enumerate() {
                    *p = x[c][k + l.min(g.nx - 1 - tile.i.start)];
                }
                let mut now = ([0.0; SIDE], [0.0; SIDE]);
                for l in 0..SIDE {
                    now.0[l] = if p[l] < p[l + 1] { p[l] } else { p[l + 1] };
                    now.1[l] = if p[l] > p[l + 1] { p[l] } else { p[l + 1] };
                }
                if n < tile.j.len() {
                    for l in 0..wide {
                        rows[n].low[c][l] = now.0[l].min(last.0[l]);
                        rows[n].high[c][l] = now.1[l].max(last.1[l]);
                    }
                }
                last = now;
            }
        }
        Self { rows }
    }

    /// Number, least and largest coordinates of every cell.
    #[inline(always)]
    fn cells(&self) -> impl Iterator<Item = (usize, Point, Point)> {
        (0..ALL).map(|m| {
            let row = &self.rows[m / SIDE];
            let at = |all: &[[f64; SIDE]; 3]| std::array::from_fn(|c| all[c][m % SIDE]);
            (m, at(&row.low), at(&row.high))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::tiles::Look;
    use super::*;
    use crate::fabrics::Mechanics;
    use crate::random::uniform;
    use crate::sheet::Sheet;

    /// Sheets from flat to crumpled, turned in space.
    fn places(seed: u64, crumpled: f64) -> (Vec<Grid>, Field) {
        let mut sheet = Sheet::flat(11, 9, 0.5, 0.5, Mechanics::default());
        let (sin, cos) = (0.7 * seed as f64).sin_cos();
        for k in 0..sheet.len() {
            let [x, y, _] = sheet.position(k);
            let noise = |c: u64| crumpled * 0.1 * (uniform(seed, k as u64, c) - 0.5);
            let bend = crumpled * 0.1 * (30.0 * x).sin();
            let p = [x + noise(0), y + noise(1), bend + noise(2)];
            let (u, v) = (cos * p[0] - sin * p[2], sin * p[0] + cos * p[2]);
            sheet.set_position(k, [cos * u - sin * p[1], sin * u + cos * p[1], v]);
        }
        (Grid::of(&[&sheet]), sheet.x)
    }

    #[test]
    fn a_glance_never_tells_more_than_the_distance_and_most_of_it_where_cloth_is_nearly_flat() {
        let (mut told, mut of) = ([0; 2], [0; 2]);
        for seed in 0..60 {
            let kind = (seed % 2) as usize;
            let crumpled = [0.05, 0.3 + seed as f64 / 60.0][kind];
            let (grids, x) = places(seed, crumpled);
            let tiles = Tile::all(&grids);
            for (n, a) in tiles.iter().enumerate() {
                for b in tiles[n..].iter().filter(|b| a.adjoins(b)) {
                    let look = Look {
                        grids: &grids,
                        before: &x,
                        now: &x,
                        // A cell.
                        cap: 0.05,
                        near: 0.0,
                    };
                    let same = a.i == b.i && a.j == b.j;
                    let exact = a.look(b, same, &look, &mut Vec::new());
                    let bound = glance(a, b, &grids[0], &x).min(look.cap);
                    assert!(bound <= exact * (1.0 + 1e-12), "{seed}: {bound} {exact}");
                    of[kind] += 1;
                    told[kind] += usize::from(bound > 0.3 * exact);
                }
            }
        }
        // Where cloth is nearly flat the bound is of use everywhere; where it is crumpled it need not be.
        assert_eq!(told[0], of[0]);
        assert!(told[1] < of[1], "{told:?} of {of:?}");
    }
}
