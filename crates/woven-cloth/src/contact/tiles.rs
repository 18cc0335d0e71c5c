//! Patches of cells of the cloth: their boxes, their motion in a step, and the exact distance of two of them.

use super::distance::{Near, Point, closest, dot, relative, sub};
use super::net::Grid;
use crate::sheet::Field;

/// Cells of a patch along either thread.
pub(super) const SIDE: usize = 4;

/// A patch: the vertices of columns `i` and rows `j`, and the edges and triangles that lie right of and below them.
#[derive(Clone, Debug)]
pub(crate) struct Tile {
    pub(super) grid: usize,
    pub(super) i: std::ops::Range<usize>,
    pub(super) j: std::ops::Range<usize>,
}

/// A box along the axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    low: Point,
    high: Point,
}

impl Bounds {
    pub(super) const EMPTY: Self = Self {
        low: [f64::INFINITY; 3],
        high: [f64::NEG_INFINITY; 3],
    };

    #[inline(always)]
    fn add(&mut self, x: &Field, k: usize) {
        for c in 0..3 {
            self.widen(c, x[c][k]);
        }
    }

    /// Takes in a point's coordinate `d` along axis `c`.
    #[inline(always)]
    pub(super) fn widen(&mut self, c: usize, d: f64) {
        self.low[c] = if d < self.low[c] { d } else { self.low[c] };
        self.high[c] = if d > self.high[c] { d } else { self.high[c] };
    }

    #[inline(always)]
    pub(crate) fn squared_distance(&self, other: &Self) -> f64 {
        (0..3)
            .map(|c| {
                let gap = (self.low[c] - other.high[c])
                    .max(other.low[c] - self.high[c])
                    .max(0.0);
                gap * gap
            })
            .sum()
    }

    #[inline(always)]
    pub(crate) fn middle(&self) -> Point {
        std::array::from_fn(|c| 0.5 * (self.low[c] + self.high[c]))
    }

    /// Its square, m².
    #[inline(always)]
    pub(super) fn radius2(&self) -> f64 {
        let d = sub(self.high, self.low);
        0.25 * dot(d, d)
    }

    /// Half the diagonal, m.
    pub(crate) fn radius(&self) -> f64 {
        self.radius2().sqrt()
    }
}

/// A cell: its first vertex, whether there are cells right of it and below it, whether its diagonal falls to the right.
#[derive(Clone, Copy)]
struct Cell {
    k: usize,
    nx: usize,
    right: bool,
    below: bool,
    falls: bool,
    bounds: Bounds,
}

impl Cell {
    /// Edges that belong to the cell.
    #[inline(always)]
    fn edges(&self) -> ([[usize; 2]; 3], usize) {
        let (k, nx) = (self.k, self.nx);
        let mut edges = [[0; 2]; 3];
        let mut n = 0;
        for (there, edge) in [
            (self.right, [k, k + 1]),
            (self.below, [k, k + nx]),
            (
                self.right && self.below,
                if self.falls {
                    [k, k + nx + 1]
                } else {
                    [k + nx, k + 1]
                },
            ),
        ] {
            if there {
                edges[n] = edge;
                n += 1;
            }
        }
        (edges, n)
    }

    /// Its two triangles, if it has any.
    #[inline(always)]
    fn triangles(&self) -> Option<[[usize; 3]; 2]> {
        let (k, nx) = (self.k, self.nx);
        let (right, below, across) = (k + 1, k + nx, k + nx + 1);
        (self.right && self.below).then_some(if self.falls {
            [[k, below, across], [k, across, right]]
        } else {
            [[k, below, right], [right, below, across]]
        })
    }
}

/// What [`Tile::look`] works on.
pub(crate) struct Look<'a> {
    pub(crate) grids: &'a [Grid],
    pub(crate) before: &'a Field,
    pub(crate) now: &'a Field,
    /// Distances beyond this are not told apart, m.
    pub(crate) cap: f64,
    /// Whatever is nearer than this is told, m.
    pub(crate) near: f64,
}

impl Tile {
    /// The patches of all grids.
    pub(crate) fn all(grids: &[Grid]) -> Vec<Self> {
        let mut tiles = Vec::new();
        for (grid, g) in grids.iter().enumerate() {
            for j in (0..g.ny).step_by(SIDE) {
                for i in (0..g.nx).step_by(SIDE) {
                    tiles.push(Self {
                        grid,
                        i: i..(i + SIDE).min(g.nx),
                        j: j..(j + SIDE).min(g.ny),
                    });
                }
            }
        }
        tiles
    }

    /// Calls `f` for the patch's vertices and those that its edges and triangles reach: runs of a row.
    #[inline(always)]
    fn rows(&self, grids: &[Grid], mut f: impl FnMut(std::ops::Range<usize>)) {
        let g = &grids[self.grid];
        for j in self.j.start..(self.j.end + 1).min(g.ny) {
            let row = g.first + j * g.nx;
            f(row + self.i.start..row + (self.i.end + 1).min(g.nx));
        }
    }

    /// Whether the two share vertices: the same patch, or neighbours on the cloth.
    pub(crate) fn adjoins(&self, other: &Self) -> bool {
        self.grid == other.grid
            && self.i.start.abs_diff(other.i.start) <= SIDE
            && self.j.start.abs_diff(other.j.start) <= SIDE
    }

    /// Calls `f` for the vertices that belong to the patch.
    #[inline(always)]
    pub(crate) fn for_each_vertex(&self, grids: &[Grid], mut f: impl FnMut(usize)) {
        let g = &grids[self.grid];
        for j in self.j.clone() {
            let row = g.first + j * g.nx;
            (row + self.i.start..row + self.i.end).for_each(&mut f);
        }
    }

    pub(crate) fn bounds(&self, grids: &[Grid], x: &Field) -> Bounds {
        let mut b = Bounds::EMPTY;
        self.rows(grids, |row| row.for_each(|k| b.add(x, k)));
        b
    }

    #[inline(always)]
    fn cells(&self, grids: &[Grid], x: &Field) -> ([Cell; SIDE * SIDE], usize) {
        let g = &grids[self.grid];
        let none = Cell {
            k: 0,
            nx: 0,
            right: false,
            below: false,
            falls: false,
            bounds: Bounds::EMPTY,
        };
        let (mut cells, mut n) = ([none; SIDE * SIDE], 0);
        for j in self.j.clone() {
            for i in self.i.clone() {
                let k = g.first + j * g.nx + i;
                let (right, below) = (i + 1 < g.nx, j + 1 < g.ny);
                let mut bounds = Bounds::EMPTY;
                bounds.add(x, k);
                if right {
                    bounds.add(x, k + 1);
                }
                if below {
                    bounds.add(x, k + g.nx);
                }
                if right && below {
                    bounds.add(x, k + g.nx + 1);
                }
                cells[n] = Cell {
                    k,
                    nx: g.nx,
                    right,
                    below,
                    falls: (i + j) % 2 == 0,
                    bounds,
                };
                n += 1;
            }
        }
        (cells, n)
    }

    /// The distance at `before` of what does not share a vertex, at most the cap; things that may meet on the way to `now` or are
    /// very near go to `found`.
    #[inline(always)]
    pub(crate) fn look(&self, other: &Self, same: bool, look: &Look, found: &mut Vec<Near>) -> f64 {
        let (mut mine, mut m) = self.cells(look.grids, look.before);
        let (mut theirs, mut n) = other.cells(look.grids, look.before);
        let mut least = Least {
            look,
            best: look.cap * look.cap,
            reach: look.cap.max(look.near).powi(2),
            found,
        };
        if !same {
            let (a, b) = (around(&mine[..m]), around(&theirs[..n]));
            m = keep_near(&mut mine, m, &b, least.reach);
            n = keep_near(&mut theirs, n, &a, least.reach);
        }
        for (p, a) in mine[..m].iter().enumerate() {
            let from = if same { p } else { 0 };
            for b in &theirs[from..n] {
                if a.bounds.squared_distance(&b.bounds) >= least.reach {
                    continue;
                }
                if let Some(triangles) = b.triangles() {
                    for t in triangles {
                        least.vertex(a.k, t);
                    }
                }
                if a.k == b.k {
                    continue;
                }
                if let Some(triangles) = a.triangles() {
                    for t in triangles {
                        least.vertex(b.k, t);
                    }
                }
                let ((ea, na), (eb, nb)) = (a.edges(), b.edges());
                for p in &ea[..na] {
                    for q in &eb[..nb] {
                        least.edge(*p, *q);
                    }
                }
            }
        }
        least.best.sqrt()
    }
}

/// The box around all of some cells.
#[inline(always)]
fn around(cells: &[Cell]) -> Bounds {
    cells.iter().fold(Bounds::EMPTY, |mut all, cell| {
        for c in 0..3 {
            all.low[c] = all.low[c].min(cell.bounds.low[c]);
            all.high[c] = all.high[c].max(cell.bounds.high[c]);
        }
        all
    })
}

/// Of the first `n` cells leaves those whose squared distance from `other` is below `reach`, in their order; tells how many.
#[inline(always)]
fn keep_near(cells: &mut [Cell], n: usize, other: &Bounds, reach: f64) -> usize {
    let mut kept = 0;
    for k in 0..n {
        if cells[k].bounds.squared_distance(other) < reach {
            cells[kept] = cells[k];
            kept += 1;
        }
    }
    kept
}

/// The search for the least distance.
struct Least<'a, 'b> {
    look: &'a Look<'a>,
    best: f64,
    /// Square of the distance beyond which nothing is of interest.
    reach: f64,
    found: &'b mut Vec<Near>,
}

impl Least<'_, '_> {
    #[inline(always)]
    fn vertex(&mut self, v: usize, [a, b, c]: [usize; 3]) {
        if v != a && v != b && v != c {
            self.test(false, [v, a, b, c]);
        }
    }

    #[inline(always)]
    fn edge(&mut self, [a, b]: [usize; 2], [c, d]: [usize; 2]) {
        if a != c && a != d && b != c && b != d {
            self.test(true, [a, b, c, d]);
        }
    }

    #[inline(always)]
    fn test(&mut self, edges: bool, vertex: [usize; 4]) {
        let x = self.look.before;
        let at = |k: usize| [x[0][k], x[1][k], x[2][k]];
        let p = [at(vertex[0]), at(vertex[1]), at(vertex[2]), at(vertex[3])];
        let d2 = closest(edges, &p).squared;
        if d2 < self.best {
            self.best = d2;
            self.reach = d2.max(self.look.near * self.look.near);
        }
        if d2 < self.look.near * self.look.near {
            let y = self.look.now;
            let way: [Point; 4] = std::array::from_fn(|n| {
                let k = vertex[n];
                [y[0][k] - p[n][0], y[1][k] - p[n][1], y[2][k] - p[n][2]]
            });
            let d = d2.sqrt();
            if d < super::guard::CLOSE || relative(edges, &way) > 0.9 * d {
                self.found.push(Near {
                    vertex: vertex.map(|k| k as u32),
                    edges,
                });
            }
        }
    }
}
