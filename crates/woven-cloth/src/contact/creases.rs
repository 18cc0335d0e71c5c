//! Creases that the grid can still tell from a knot: vertices that are two apart on the cloth, or across a cell, keep half their distance.
//!
//! A fold sharper than the grid resolves turns into a dimple of a few cells whose triangles lock into each other: the threads there stay
//! compressed by many percent for seconds, since nothing may pass through anything. Real cloth does not get there, because yarns jam long
//! before (Lahey, Heppler 2004). Held at half their distance on the flat cloth, three vertices of a thread make no angle below 60°, and an
//! edge stands by 45° or more on the triangles of its neighbours.

use super::net::Grid;
use crate::sheet::Field;

/// The least distance over that on the flat cloth.
const OPEN: f64 = 0.5;
/// Speed at which what is nearer opens, m/s.
const PUSH: f64 = 0.1;
/// Pairs looked at side by side.
const SIDE: usize = 16;

/// Holds the creases of `x` open, the places so far in a step of `hp` seconds from the places `before`.
#[inline(always)]
pub(super) fn hold_open(grids: &[Grid], inv_mass: &[f64], before: &Field, x: &mut Field, hp: f64) {
    for g in grids {
        let (nx, ny) = (g.nx, g.ny);
        for j in 0..ny {
            let row = g.first + j * nx;
            let mut along = |a: usize, b: usize, n: usize, rest: f64| {
                run(inv_mass, before, x, [a, b], n, [OPEN * rest, PUSH * hp]);
            };
            if nx > 2 {
                along(row, row + 2, nx - 2, 2.0 * g.hx);
            }
            if j + 2 < ny {
                along(row, row + 2 * nx, nx, 2.0 * g.hy);
            }
            if j + 1 < ny {
                let across = g.hx.hypot(g.hy);
                along(row, row + nx + 1, nx - 1, across);
                along(row + 1, row + nx, nx - 1, across);
            }
        }
    }
}

/// The pairs `a + k` and `b + k` for `k` below `n`.
#[inline(always)]
fn run(
    inv_mass: &[f64],
    before: &Field,
    x: &mut Field,
    [a, b]: [usize; 2],
    n: usize,
    [least, push]: [f64; 2],
) {
    let squared = |x: &Field, k: usize| {
        let d: [f64; 3] = std::array::from_fn(|c| x[c][b + k] - x[c][a + k]);
        d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    };
    for start in (0..n).step_by(SIDE) {
        let many = SIDE.min(n - start);
        let (p, q) = (a + start, b + start);
        let mut nearest = f64::INFINITY;
        {
            let [px, py, pz] = [0, 1, 2].map(|c| &x[c][p..p + many]);
            let [qx, qy, qz] = [0, 1, 2].map(|c| &x[c][q..q + many]);
            for k in 0..many {
                let (dx, dy, dz) = (qx[k] - px[k], qy[k] - py[k], qz[k] - pz[k]);
                let d2 = dx * dx + dy * dy + dz * dz;
                nearest = if d2 < nearest { d2 } else { nearest };
            }
        }
        if nearest >= least * least {
            continue;
        }
        for k in start..start + many {
            let d2 = squared(x, k);
            let mass = inv_mass[a + k] + inv_mass[b + k];
            if d2 >= least * least || mass <= 0.0 || d2 < 1e-20 {
                continue;
            }
            let d = d2.sqrt();
            let approach = (squared(before, k).sqrt() - d).max(0.0);
            let out = (least - d).min(approach + push) / (d * mass);
            for c in 0..3 {
                let shift = out * (x[c][b + k] - x[c][a + k]);
                x[c][a + k] -= inv_mass[a + k] * shift;
                x[c][b + k] += inv_mass[b + k] * shift;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fabrics::Mechanics;
    use crate::sheet::Sheet;

    #[test]
    fn a_crease_that_closes_in_one_step_stays_half_open() {
        let mut sheet = Sheet::flat(5, 5, 0.4, 0.4, Mechanics::default());
        sheet.pin(10);
        let inv_mass = sheet.inv_mass.clone();
        let before = sheet.x.clone();
        let mut x = before.clone();
        // The middle row folds upon itself: vertex 12 comes within a millimetre of the pinned vertex 10, two to its left.
        x[0][12] = x[0][10] + 0.001;
        let grids = Grid::of(&[&sheet]);
        hold_open(&grids, &inv_mass, &before, &mut x, 1e-3);
        let apart = x[0][12] - x[0][10];
        // 0.2 m apart on the cloth; what is pinned does not move. The corners of its cells push vertex 12 a little further.
        assert!(apart > 0.0999 && apart < 0.12, "{apart}");
        assert_eq!(x[0][10], before[0][10]);
        let mut flat = before.clone();
        hold_open(&grids, &inv_mass, &before, &mut flat, 1e-3);
        assert_eq!(flat, before);
    }

    #[test]
    fn what_was_closed_opens_slowly() {
        let sheet = Sheet::flat(3, 2, 0.2, 0.1, Mechanics::default());
        let mut x = sheet.x.clone();
        for k in [2, 5] {
            x[0][k] = x[0][k - 2];
            x[2][k] = 0.01;
        }
        let before = x.clone();
        let grids = Grid::of(&[&sheet]);
        hold_open(&grids, &sheet.inv_mass, &before, &mut x, 1e-3);
        // 0.1 m/s for a millisecond, shared by both.
        let opened = x[2][2] - x[2][0] - 0.01;
        assert!((opened - 1e-4).abs() < 1e-12, "{opened}");
    }
}
