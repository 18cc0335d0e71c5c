//! Creases that the grid can still tell from a knot: vertices that are two apart on the cloth, across a cell or a knight's move apart keep
//! half their distance, and so does a vertex from the middle of a triangle's side across its neighbour.
//!
//! A fold sharper than the grid resolves turns into a dimple of a few cells whose triangles lock into each other: the threads there stay
//! compressed by many percent for seconds, since nothing may pass through anything. Real cloth does not get there, because yarns jam long
//! before (Lahey, Heppler 2004). Held at half their distance on the flat cloth, three vertices of a thread make no angle below 60°, and an
//! edge stands by 45° or more on the triangles of its neighbours.

use super::net::Grid;
use crate::sheet::Field;

/// The least distance over that on the flat cloth.
const OPEN: f64 = 0.5;
/// A crease is looked at closely where a distance over that on the flat cloth is below this.
const WATCH: f64 = 0.8;
/// Speed at which what is nearer opens, m/s.
const PUSH: f64 = 0.1;
/// The share of what is missing that a step makes up for besides: threads pull at a crease with many times the cloth's weight.
const SHARE: f64 = 0.3;
/// Pairs looked at side by side.
const SIDE: usize = 16;

/// Vertices by their columns and rows relative to a first one.
type At = [usize; 2];

/// Pairs: two apart along either thread, and across a cell.
const PAIRS: [[At; 2]; 4] = [
    [[0, 0], [2, 0]],
    [[0, 0], [0, 2]],
    [[0, 0], [1, 1]],
    [[1, 0], [0, 1]],
];

/// Pairs a knight's move apart.
const KNIGHTS: [[At; 2]; 4] = [
    [[0, 0], [2, 1]],
    [[2, 0], [0, 1]],
    [[0, 0], [1, 2]],
    [[1, 0], [0, 2]],
];

/// Of the four neighbours of a vertex `[1, 1]` one and two that make a triangle with it on the other side; and the cell that tells whether
/// the one leans over.
const LEANING: [([At; 3], At); 8] = [
    ([[1, 0], [2, 1], [1, 2]], [1, 0]),
    ([[1, 0], [0, 1], [1, 2]], [0, 0]),
    ([[1, 2], [2, 1], [1, 0]], [1, 1]),
    ([[1, 2], [0, 1], [1, 0]], [0, 1]),
    ([[2, 1], [1, 0], [0, 1]], [1, 0]),
    ([[2, 1], [1, 2], [0, 1]], [1, 1]),
    ([[0, 1], [1, 0], [2, 1]], [0, 0]),
    ([[0, 1], [1, 2], [2, 1]], [0, 1]),
];

/// Holds the creases of `x` open, the places so far in a step of `hp` seconds from the places `before`.
#[inline(always)]
pub(super) fn hold_open(grids: &[Grid], inv_mass: &[f64], before: &Field, x: &mut Field, hp: f64) {
    for g in grids {
        let flat = |[a, b]: [At; 2]| {
            let apart = |c: usize, h: f64| a[c].abs_diff(b[c]) as f64 * h;
            apart(0, g.hx).hypot(apart(1, g.hy))
        };
        let watched = PAIRS.map(|pair| (pair, (WATCH * flat(pair)).powi(2)));
        let pairs: [_; 8] = std::array::from_fn(|n| {
            let pair = if n < 4 { PAIRS[n] } else { KNIGHTS[n - 4] };
            ([pair[0], pair[1], pair[1]], OPEN * flat(pair))
        });
        // From the middle of the side across: one and a half cells along the one thread, half a cell along the other.
        let leaning = LEANING.map(|(at, cell)| {
            let along = at[0][1].abs_diff(1) as f64;
            let away = ((1.5 - along) * g.hx).hypot((0.5 + along) * g.hy);
            (at, cell, OPEN * away)
        });
        // What is held does not move here, so one look at the heading does for all rows.
        let held: Vec<f64> = (0..g.nx)
            .step_by(SIDE)
            .map(|i| eased(g, inv_mass, x, i))
            .collect();
        for j in 0..g.ny {
            for (i, &ease) in (0..g.nx).step_by(SIDE).zip(&held) {
                let bent = |(pair, watch): &([At; 2], f64)| {
                    any_within(g, x, [i, j], [pair[0], pair[1], pair[1]], *watch)
                };
                if !watched.iter().any(bent) {
                    continue;
                }
                for (at, least) in pairs {
                    open(g, inv_mass, before, x, [i, j], at, [ease * least, hp]);
                }
                for (at, cell, least) in leaning {
                    if let Some(j) = j.checked_sub(cell[1]) {
                        let from = [i.saturating_sub(cell[0]), j];
                        open(g, inv_mass, before, x, from, at, [ease * least, hp]);
                    }
                }
            }
        }
    }
}

/// How far creases under the columns from `i` on may be held open, 0 to 1: no more than the held heading itself is.
#[inline(always)]
fn eased(g: &Grid, inv_mass: &[f64], x: &Field, i: usize) -> f64 {
    let least = OPEN * 2.0 * g.hx;
    let mut ease = 1.0;
    for k in i..(i + SIDE).min(g.nx.saturating_sub(2)) {
        let (a, b) = (g.first + k, g.first + k + 2);
        if inv_mass[a] == 0.0 && inv_mass[b] == 0.0 {
            let d2: f64 = (0..3).map(|c| (x[c][b] - x[c][a]).powi(2)).sum();
            ease = (d2.sqrt() / least).min(ease);
        }
    }
    ease
}

/// How many vertices of a row from `from` on have all of `at`, at most [`SIDE`].
#[inline(always)]
fn many<const N: usize>(g: &Grid, from: At, at: [At; N]) -> usize {
    let reach = |c: usize| at.iter().map(|a| a[c]).max().unwrap_or(0);
    if from[1] + reach(1) >= g.ny {
        return 0;
    }
    g.nx.saturating_sub(from[0] + reach(0)).min(SIDE)
}

/// Number of the vertex at `at` from `from` on.
#[inline(always)]
fn number(g: &Grid, from: At, at: At) -> usize {
    g.first + (from[1] + at[1]) * g.nx + from[0] + at[0]
}

/// Whether one of the squared distances, of the first of `at` from the middle of the other two, is below `limit`, from `from` on.
#[inline(always)]
fn any_within(g: &Grid, x: &Field, from: At, at: [At; 3], limit: f64) -> bool {
    let n = many(g, from, at);
    if n == 0 {
        return false;
    }
    let first = at.map(|at| number(g, from, at));
    // A whole stretch at once; where the row ends before, its other pairs are of no matter, but seldom near.
    if none_of_a_stretch(x, first, at[1] == at[2], limit) {
        return false;
    }
    (0..n).any(|k| squared(away(x, first, k)) < limit)
}

/// Whether all of [`SIDE`] squared distances are `limit` or more; not told where less is left of the cloth.
#[inline(always)]
fn none_of_a_stretch(x: &Field, [a, b, c]: [usize; 3], pairs: bool, limit: f64) -> bool {
    let mut d2 = [0.0; SIDE];
    for x in x {
        let stretch = |k: usize| x.get(k..).and_then(<[f64]>::first_chunk::<SIDE>);
        let (Some(p), Some(q), Some(r)) = (stretch(a), stretch(b), stretch(c)) else {
            return false;
        };
        for k in 0..SIDE {
            let d = p[k] - if pairs { q[k] } else { 0.5 * (q[k] + r[k]) };
            d2[k] += d * d;
        }
    }
    let mut near = false;
    for d2 in d2 {
        near |= d2 < limit;
    }
    !near
}

/// From the middle of `b` and `c` to `a`, all of them `k` further on.
#[inline(always)]
fn away(x: &Field, [a, b, c]: [usize; 3], k: usize) -> [f64; 3] {
    std::array::from_fn(|d| x[d][a + k] - 0.5 * (x[d][b + k] + x[d][c + k]))
}

#[inline(always)]
fn squared(d: [f64; 3]) -> f64 {
    d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
}

/// Opens what is nearer than `least`: the first of `at` and the middle of the other two, from `from` on.
#[inline(always)]
fn open(
    g: &Grid,
    inv_mass: &[f64],
    before: &Field,
    x: &mut Field,
    from: At,
    at: [At; 3],
    [least, hp]: [f64; 2],
) {
    let n = many(g, from, at);
    let first = at.map(|at| number(g, from, at));
    if n == 0 || none_of_a_stretch(x, first, at[1] == at[2], least * least) {
        return;
    }
    let [a, b, c] = first;
    let mut far = [0.0; SIDE];
    for k in 0..n {
        far[k] = squared(away(x, first, k));
    }
    for k in 0..n {
        if far[k] >= least * least {
            continue;
        }
        let (wa, wb, wc) = (inv_mass[a + k], inv_mass[b + k], inv_mass[c + k]);
        let mass = wa + if b == c { wb } else { 0.25 * (wb + wc) };
        let d = away(x, first, k);
        let length = squared(d).sqrt();
        if mass <= 0.0 || length < 1e-10 {
            continue;
        }
        let missing = least - length;
        let approach = (squared(away(before, first, k)).sqrt() - length).max(0.0);
        let out = missing.min(approach + PUSH * hp + SHARE * missing) / (length * mass);
        for (axis, d) in d.into_iter().enumerate() {
            x[axis][a + k] += wa * out * d;
            x[axis][b + k] -= 0.5 * wb * out * d;
            x[axis][c + k] -= 0.5 * wc * out * d;
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
        let sheet = Sheet::flat(3, 2, 0.2, 1.0, Mechanics::default());
        let mut x = sheet.x.clone();
        for k in [2, 5] {
            x[0][k] = x[0][k - 2];
            x[2][k] = 0.01;
        }
        let before = x.clone();
        let grids = Grid::of(&[&sheet]);
        hold_open(&grids, &sheet.inv_mass, &before, &mut x, 1e-3);
        // 0.1 m/s for a millisecond, and three tenths of the 9 cm that are missing.
        let opened = x[2][2] - x[2][0] - 0.01;
        assert!((opened - 1e-4 - 0.027).abs() < 1e-12, "{opened}");
    }

    #[test]
    fn an_edge_does_not_lie_down_on_the_triangle_beside_it() {
        let sheet = Sheet::flat(3, 3, 0.2, 0.2, Mechanics::default());
        let mut x = sheet.x.clone();
        // The upper neighbour of the middle comes over the middle of the side between its right and its lower neighbour.
        (x[0][1], x[1][1], x[2][1]) = (0.15, -0.15, 0.01);
        let grids = Grid::of(&[&sheet]);
        hold_open(&grids, &sheet.inv_mass, &sheet.x, &mut x, 1e-3);
        let away: f64 = (0..3)
            .map(|c| (x[c][1] - 0.5 * (x[c][5] + x[c][7])).powi(2))
            .sum();
        // Half of what it is on the flat cloth is 79 mm; what is opened after it changes it a little.
        assert!(away.sqrt() > 0.07, "{}", away.sqrt());
    }
}
