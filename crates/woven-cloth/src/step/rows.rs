//! The part of a step that goes by rows: prediction, forces and the weft, in bands that fit the processor's cache.

use super::Stepper;
use crate::force::{Slab, Terms};
use crate::line::{Block, LANES, Springs, Work};
use crate::sheet::{Sheet, half_at_ends};
use std::cell::RefCell;

/// Rows of a band.
pub(super) const BAND: usize = 2 * LANES;
/// Rows beyond a band that its forces depend on: bending reaches over two.
const HALO: usize = 2;

/// Work space of one thread.
#[derive(Default)]
pub(super) struct Scratch {
    vt: [Vec<f64>; 3],
    pred: [Vec<f64>; 3],
    probe: [Vec<f64>; 3],
    f: [Vec<f64>; 3],
    base: [Vec<f64>; 3],
    lambda: Vec<f64>,
    length: Vec<f64>,
    terms: Terms,
    lanes: Block,
    pub(super) work: Work,
    columns: usize,
    longest: usize,
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

/// Gives `f` this thread's work space.
pub(super) fn with_scratch(f: impl FnOnce(&mut Scratch)) {
    SCRATCH.with_borrow_mut(f);
}

impl Scratch {
    /// Makes room for a sheet of `nx` × `ny`.
    pub(super) fn fit(&mut self, nx: usize, ny: usize) {
        if self.columns != nx {
            self.columns = nx;
            let n = (BAND + 2 * HALO) * nx;
            for field in [&mut self.vt, &mut self.pred, &mut self.probe, &mut self.f] {
                for v in field {
                    v.resize(n, 0.0);
                }
            }
            for v in &mut self.base {
                v.resize(nx, 0.0);
            }
            self.lambda.resize(nx.next_multiple_of(LANES), 0.0);
            self.length.resize(LANES * nx, 0.0);
            // Zero beyond its ends, so made anew.
            self.terms = Terms::new(nx);
            self.lanes = Block::new(nx);
        }
        if self.longest < nx.max(ny) {
            self.longest = nx.max(ny);
            self.work.fit(self.longest);
        }
    }
}

/// One step's work on rows.
pub(super) struct Rows<'a> {
    pub(super) stepper: &'a Stepper,
    pub(super) sheet: &'a Sheet,
    pub(super) warp: &'a [Block],
    pub(super) hp: f64,
    /// Retardation time of the threads over h'.
    pub(super) damping: f64,
}

impl Rows<'_> {
    /// Prediction and forces of a band: `q` becomes the place without the weft's pull and with the warp's of the step before.
    #[inline(always)]
    pub(super) fn forces(&self, band: usize, q: &mut [&mut [f64]; 3], s: &mut Scratch) {
        let (sheet, t, hp) = (self.sheet, self.stepper, self.hp);
        let (nx, ny) = (sheet.nx, sheet.ny);
        s.fit(nx, ny);
        let (j0, j1) = (band * BAND, (band * BAND + BAND).min(ny));
        let (lo, hi) = (j0.saturating_sub(HALO), (j1 + HALO).min(ny));
        let (k0, n) = (lo * nx, (hi - lo) * nx);
        let third = if t.history { 1.0 / 3.0 } else { 0.0 };
        for c in 0..3 {
            let (x, v) = (&sheet.x[c][k0..k0 + n], &sheet.v[c][k0..k0 + n]);
            let (xo, vo) = (&t.x_old[c][k0..k0 + n], &t.v_old[c][k0..k0 + n]);
            let (vt, pred) = (&mut s.vt[c][..n], &mut s.pred[c][..n]);
            for k in 0..n {
                // x + (x - x₋)/3 rounds better than (4x - x₋)/3.
                vt[k] = v[k] + (v[k] - vo[k]) * third;
                pred[k] = x[k] + (x[k] - xo[k]) * third + hp * vt[k];
            }
            s.f[c][..n].copy_from_slice(&t.air[c][k0..k0 + n]);
            let sliders = t.friction.iter().map(|friction| &friction.force);
            for force in sliders.chain(t.heat_set.iter().map(|folds| &folds.force)) {
                for (f, more) in s.f[c][..n].iter_mut().zip(&force[c][k0..k0 + n]) {
                    *f += more;
                }
            }
        }
        self.add_tension(lo..hi, j0.max(lo + 1) - 1..j1.min(hi - 1), s);
        let slab = Slab {
            nx,
            first: lo,
            rows: hi - lo,
            ny,
        };
        let cells = j0.max(lo + 1) - 1 - lo..j1.min(hi - 1) - lo;
        for stage in 0..2 {
            for c in 0..3 {
                let (y, p, v) = (&mut s.probe[c][..n], &s.pred[c][..n], &s.vt[c][..n]);
                let tau = t.tau[stage];
                for k in 0..n {
                    y[k] = p[k] + tau * v[k];
                }
            }
            let x = [&s.probe[0][..n], &s.probe[1][..n], &s.probe[2][..n]];
            let [fx, fy, fz] = &mut s.f;
            let f = [&mut fx[..n], &mut fy[..n], &mut fz[..n]];
            if stage == 0 {
                t.shape.shear_slab(nx, cells.clone(), x, f, &mut s.terms);
            } else {
                t.shape
                    .bending_slab(slab, j0 - lo..j1 - lo, x, f, &mut s.terms);
            }
        }
        let h2 = hp * hp;
        let (a, m) = ((j0 - lo) * nx, (j1 - j0) * nx);
        let w = &sheet.inv_mass[j0 * nx..j0 * nx + m];
        for c in 0..3 {
            let g = if c == 1 { -t.gravity } else { 0.0 };
            let (p, f, v) = (&s.pred[c][a..a + m], &s.f[c][a..a + m], &s.vt[c][a..a + m]);
            let (q, settling) = (&mut q[c][..m], t.settling);
            for k in 0..m {
                q[k] = p[k] + h2 * (g + w[k] * f[k] - settling * v[k]);
            }
        }
        let first = t.pins.partition_point(|&k| k < j0 * nx);
        let last = t.pins.partition_point(|&k| k < j1 * nx);
        for at in first..last {
            let k = t.pins[at];
            let place = t
                .pin_places
                .get(at)
                .copied()
                .unwrap_or_else(|| sheet.position(k));
            for c in 0..3 {
                q[c][k - j0 * nx] = place[c];
            }
        }
    }

    /// Adds the warp forces of the step before along the predicted directions, at the edges below rows `edges`. The solves then
    /// only correct them: what warp and weft do to each other, which one pass would leave too soft, is made up over a few steps.
    #[inline(always)]
    fn add_tension(
        &self,
        slab: std::ops::Range<usize>,
        edges: std::ops::Range<usize>,
        s: &mut Scratch,
    ) {
        let nx = self.sheet.nx;
        let r = 1.0 / (self.hp * self.hp);
        for j in edges {
            for (block, l) in self.warp.iter().zip(s.lambda.chunks_exact_mut(LANES)) {
                l.copy_from_slice(&block.lambda[j]);
            }
            let at = (j - slab.start) * nx;
            let pair = |c: usize| s.pred[c][at..at + 2 * nx].split_at(nx);
            let ((xa, xb), (ya, yb), (za, zb)) = (pair(0), pair(1), pair(2));
            let [fx, fy, fz] = &mut s.f;
            let (fxa, fxb) = fx[at..at + 2 * nx].split_at_mut(nx);
            let (fya, fyb) = fy[at..at + 2 * nx].split_at_mut(nx);
            let (fza, fzb) = fz[at..at + 2 * nx].split_at_mut(nx);
            let lambda = &s.lambda[..nx];
            for i in 0..nx {
                let (dx, dy, dz) = (xb[i] - xa[i], yb[i] - ya[i], zb[i] - za[i]);
                let t = lambda[i] * r / (dx * dx + dy * dy + dz * dz).max(1e-24).sqrt();
                fxa[i] -= t * dx;
                fxb[i] += t * dx;
                fya[i] -= t * dy;
                fyb[i] += t * dy;
                fza[i] -= t * dz;
                fzb[i] += t * dz;
            }
        }
    }

    /// The weft threads of a band, eight rows side by side.
    #[inline(always)]
    pub(super) fn weft(&self, band: usize, q: &mut [&mut [f64]; 3], s: &mut Scratch) {
        let (sheet, hp) = (self.sheet, self.hp);
        let (nx, ny) = (sheet.nx, sheet.ny);
        s.fit(nx, ny);
        let (j0, j1) = (band * BAND, (band * BAND + BAND).min(ny));
        for first in (j0..j1).step_by(LANES) {
            let lanes = LANES.min(j1 - first);
            if self.damping > 0.0 {
                for l in 0..lanes {
                    self.lengths_before(first + l, l, s);
                }
            }
            let b = &mut s.lanes;
            for (c, to) in [&mut b.x, &mut b.y, &mut b.z].into_iter().enumerate() {
                // Spare lanes hold a copy of the first, so that they hold ordinary numbers.
                let row: [&[f64]; LANES] = std::array::from_fn(|l| {
                    let l = if l < lanes { l } else { 0 };
                    &q[c][(first - j0 + l) * nx..][..nx]
                });
                for (i, to) in to[..nx].iter_mut().enumerate() {
                    *to = std::array::from_fn(|l| row[l][i]);
                }
            }
            if self.damping > 0.0 {
                let row: [&[f64]; LANES] = std::array::from_fn(|l| {
                    let l = if l < lanes { l } else { 0 };
                    &s.length[l * nx..][..nx]
                });
                for (i, to) in b.before[..nx].iter_mut().enumerate() {
                    *to = std::array::from_fn(|l| row[l][i]);
                }
            }
            b.w[..nx].copy_from_slice(&self.stepper.weft_w[first / LANES]);
            if lanes < LANES {
                for w in &mut b.w[..nx] {
                    for l in lanes..LANES {
                        w[l] = w[0];
                    }
                }
            }
            let alpha = std::array::from_fn(|l| {
                let j = if l < lanes { first + l } else { first };
                sheet.hx / (sheet.mechanics.tensile_weft * sheet.hy * half_at_ends(j, ny) * hp * hp)
            });
            b.solve::<false>(
                nx,
                &Springs {
                    rest: sheet.hx,
                    alpha,
                    damping: self.damping,
                    stiffening: sheet.mechanics.tensile_stiffening,
                },
                &mut s.work,
            );
            for (c, from) in [&b.x, &b.y, &b.z].into_iter().enumerate() {
                for l in 0..lanes {
                    let row = &mut q[c][(first - j0 + l) * nx..][..nx];
                    for (to, from) in row.iter_mut().zip(from) {
                        *to = from[l];
                    }
                }
            }
        }
    }

    /// Lengths of the weft edges of row `j` at the start of the step, into lane `l` of the work space.
    #[inline(always)]
    fn lengths_before(&self, j: usize, l: usize, s: &mut Scratch) {
        let (sheet, t) = (self.sheet, self.stepper);
        let (nx, k0) = (sheet.nx, j * sheet.nx);
        let third = if t.history { 1.0 / 3.0 } else { 0.0 };
        for c in 0..3 {
            let (x, xo) = (&sheet.x[c][k0..k0 + nx], &t.x_old[c][k0..k0 + nx]);
            let base = &mut s.base[c][..nx];
            for i in 0..nx {
                base[i] = x[i] + (x[i] - xo[i]) * third;
            }
        }
        let [bx, by, bz] = [&s.base[0][..nx], &s.base[1][..nx], &s.base[2][..nx]];
        let to = &mut s.length[l * nx..][..nx];
        for i in 0..nx - 1 {
            let (dx, dy, dz) = (bx[i + 1] - bx[i], by[i + 1] - by[i], bz[i + 1] - bz[i]);
            to[i] = (dx * dx + dy * dy + dz * dz).sqrt();
        }
    }
}
