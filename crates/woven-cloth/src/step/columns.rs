//! The part of a step that goes by columns: the warp threads, eight side by side; and the end of the step.

use crate::line::{Block, LANES, Lane, Springs, Work};
use crate::sheet::{Field, Sheet, half_at_ends};

/// One step's work on columns.
pub(super) struct Columns<'a> {
    pub(super) sheet: &'a Sheet,
    pub(super) x_old: &'a Field,
    pub(super) history: bool,
    pub(super) hp: f64,
    /// Retardation time of the threads over h'.
    pub(super) damping: f64,
}

/// Eight numbers of a row from column `i0` on; beyond the last column the last again.
#[inline(always)]
fn eight(row: &[f64], i0: usize) -> Lane {
    match row.get(i0..i0 + LANES).and_then(|r| Lane::try_from(r).ok()) {
        Some(lane) => lane,
        None => std::array::from_fn(|l| row[(i0 + l).min(row.len() - 1)]),
    }
}

impl Columns<'_> {
    /// The warp threads of block `k` from the places `q`; the result stays in the block.
    #[inline(always)]
    pub(super) fn solve(&self, k: usize, b: &mut Block, q: &Field, work: &mut Work) {
        let (sheet, hp) = (self.sheet, self.hp);
        let (nx, ny, i0) = (sheet.nx, sheet.ny, k * LANES);
        work.fit(ny);
        for (c, to) in [&mut b.x, &mut b.y, &mut b.z].into_iter().enumerate() {
            for (to, row) in to.iter_mut().zip(q[c].chunks_exact(nx)) {
                *to = eight(row, i0);
            }
        }
        if self.damping > 0.0 {
            let third = if self.history { 1.0 / 3.0 } else { 0.0 };
            let mut above = [[0.0; LANES]; 3];
            for j in 0..ny {
                let rows = j * nx..(j + 1) * nx;
                let mut square = [0.0; LANES];
                for c in 0..3 {
                    let x = eight(&sheet.x[c][rows.clone()], i0);
                    let old = eight(&self.x_old[c][rows.clone()], i0);
                    for l in 0..LANES {
                        let base = x[l] + (x[l] - old[l]) * third;
                        square[l] += (base - above[c][l]) * (base - above[c][l]);
                        above[c][l] = base;
                    }
                }
                if j > 0 {
                    b.before[j - 1] = square.map(f64::sqrt);
                }
            }
        }
        let alpha = std::array::from_fn(|l| {
            let share = half_at_ends((i0 + l).min(nx - 1), nx);
            sheet.hy / (sheet.mechanics.tensile_warp * sheet.hx * share * hp * hp)
        });
        b.solve::<true>(
            ny,
            &Springs {
                rest: sheet.hy,
                alpha,
                damping: self.damping,
                stiffening: sheet.mechanics.tensile_stiffening,
            },
            work,
        );
    }
}

/// Brings what the warp's blocks found back into rows from number `first` on.
pub(super) fn collect(warp: &[Block], first: usize, nx: usize, q: [&mut [f64]; 3]) {
    for (c, q) in q.into_iter().enumerate() {
        for (j, row) in q.chunks_exact_mut(nx).enumerate() {
            for (block, to) in warp.iter().zip(row.chunks_mut(LANES)) {
                let from = [&block.x, &block.y, &block.z][c][first + j];
                to.copy_from_slice(&from[..to.len()]);
            }
        }
    }
}

/// The end of a step for one coordinate: `x_old` becomes the new place and `v_old` the new velocity (x - base)/h'.
#[inline(always)]
pub(super) fn finish(
    x: &[f64],
    new: &[f64],
    x_old: &mut [f64],
    v_old: &mut [f64],
    third: f64,
    r: f64,
) {
    let n = x.len();
    let (new, x_old, v_old) = (&new[..n], &mut x_old[..n], &mut v_old[..n]);
    for k in 0..n {
        let base = x[k] + (x[k] - x_old[k]) * third;
        x_old[k] = new[k];
        v_old[k] = (new[k] - base) * r;
    }
}
