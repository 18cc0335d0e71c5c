//! The vertices that can touch each other: the grid of one sheet, or of several, numbered through.

use crate::sheet::{Field, Sheet};

/// One sheet's grid among all vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Grid {
    /// Number of its first vertex.
    pub(crate) first: usize,
    pub(crate) nx: usize,
    pub(crate) ny: usize,
    pub(crate) hx: f64,
    pub(crate) hy: f64,
}

impl Grid {
    /// The grids of sheets whose vertices are numbered one sheet after the other.
    pub(crate) fn of(sheets: &[&Sheet]) -> Vec<Self> {
        let mut first = 0;
        sheets
            .iter()
            .map(|s| {
                let grid = Self {
                    first,
                    nx: s.nx,
                    ny: s.ny,
                    hx: s.hx,
                    hy: s.hy,
                };
                first += s.len();
                grid
            })
            .collect()
    }
}

/// All vertices at the start of a step.
#[derive(Clone, Copy)]
pub(crate) struct Net<'a> {
    pub(crate) grids: &'a [Grid],
    pub(crate) inv_mass: &'a [f64],
    /// Places before the step, m.
    pub(crate) before: &'a Field,
}

impl Net<'_> {
    /// The grid that vertex `k` belongs to.
    #[inline(always)]
    pub(crate) fn grid(&self, k: usize) -> &Grid {
        let later = self.grids[1..].iter().rposition(|g| k >= g.first);
        &self.grids[later.map_or(0, |n| n + 1)]
    }

    /// Whether two vertices are not corners of one cell.
    #[inline(always)]
    pub(crate) fn apart_on_cloth(&self, a: usize, b: usize) -> bool {
        let g = self.grid(a);
        if b < g.first || b >= g.first + g.nx * g.ny {
            return true;
        }
        let (a, b) = (a - g.first, b - g.first);
        (a % g.nx).abs_diff(b % g.nx) > 1 || (a / g.nx).abs_diff(b / g.nx) > 1
    }

    /// The squared distance, m², below which two vertices that are not corners of one cell belong to different folds: neighbours on the
    /// cloth meet only in a sharp crease.
    #[inline(always)]
    pub(crate) fn meet_within(&self, a: usize, b: usize) -> f64 {
        let g = self.grid(a);
        if b < g.first || b >= g.first + g.nx * g.ny {
            return f64::INFINITY;
        }
        let (a, b) = (a - g.first, b - g.first);
        let (di, dj) = ((a % g.nx).abs_diff(b % g.nx), (a / g.nx).abs_diff(b / g.nx));
        0.81 * ((di as f64 * g.hx).powi(2) + (dj as f64 * g.hy).powi(2))
    }
}
