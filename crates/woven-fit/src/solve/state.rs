//! Where a descent stands: point, triangle of its Jacobian, scales, and the steps that the bounds allow from there.

#![expect(
    clippy::needless_range_loop,
    reason = "matrix indices read like the algorithms' papers"
)]

use super::Residuals;
use super::trust::trust_region_step;
use crate::linalg::{
    PivotedR, back_substitute, dot, forward_substitute_transposed, norm, qr_in_place,
};

pub(super) struct State {
    pub(super) m: usize,
    pub(super) n: usize,
    pub(super) x: Vec<f64>,
    pub(super) r: Vec<f64>,
    pub(super) jac: Vec<f64>,
    pub(super) fnorm: f64,
    pub(super) bounds: Vec<(f64, f64)>,
    pub(super) scale: Vec<f64>,
    pub(super) work: Vec<f64>,
    /// n×n upper triangle of the QR of the Jacobian at x, and Qᵀr.
    pub(super) rr: Vec<f64>,
    pub(super) z: Vec<f64>,
    pub(super) evaluations: usize,
    pub(super) finite: bool,
}

impl State {
    pub(super) fn new<P: Residuals + ?Sized>(problem: &mut P, start: &[f64]) -> Self {
        let (m, n) = (problem.rows(), problem.params());
        let bounds: Vec<(f64, f64)> = (0..n).map(|j| problem.bounds(j)).collect();
        let x: Vec<f64> = start
            .iter()
            .zip(&bounds)
            .map(|(&v, &(lo, hi))| v.max(lo).min(hi))
            .collect();
        let mut r = vec![0.0; m];
        let mut jac = vec![0.0; m * n];
        let ok = problem.evaluate(&x, &mut r, Some(&mut jac));
        let fnorm = norm(&r);
        let finite = ok && fnorm.is_finite() && jac.iter().all(|v| v.is_finite());
        Self {
            m,
            n,
            x,
            r,
            jac,
            fnorm,
            bounds,
            scale: vec![0.0; n],
            work: Vec::with_capacity(m * (n + 1)),
            rr: vec![0.0; n * n],
            z: vec![0.0; n],
            evaluations: 1,
            finite,
        }
    }

    /// QR of [J | r]; updates the scales with the column norms.
    pub(super) fn factorise(&mut self) {
        let (m, n) = (self.m, self.n);
        for j in 0..n {
            let length = norm(&self.jac[j * m..(j + 1) * m]);
            self.scale[j] = self.scale[j].max(length);
        }
        // With fewer residuals than parameters, rows of zeros make the triangle square.
        let rows = m.max(n);
        self.work.clear();
        self.work.resize(rows * (n + 1), 0.0);
        for j in 0..n {
            self.work[j * rows..j * rows + m].copy_from_slice(&self.jac[j * m..(j + 1) * m]);
        }
        self.work[n * rows..n * rows + m].copy_from_slice(&self.r);
        qr_in_place(&mut self.work, rows, n, n + 1);
        self.rr.fill(0.0);
        for j in 0..n {
            self.rr[j * n..=j * n + j].copy_from_slice(&self.work[j * rows..=j * rows + j]);
        }
        self.z.copy_from_slice(&self.work[n * rows..n * rows + n]);
    }

    pub(super) fn scale_of(&self, j: usize) -> f64 {
        if self.scale[j] > 0.0 {
            self.scale[j]
        } else {
            1.0
        }
    }

    pub(super) fn scaled_norm(&self, v: &[f64]) -> f64 {
        norm(
            &(0..self.n)
                .map(|j| self.scale_of(j) * v[j])
                .collect::<Vec<_>>(),
        )
    }

    /// Indices that may move: not at a bound with the gradient pointing out.
    pub(super) fn free(&self) -> Vec<usize> {
        (0..self.n)
            .filter(|&j| {
                let (lo, hi) = self.bounds[j];
                // Jᵀr = Rᵀz.
                let slope = dot(&self.rr[j * self.n..=j * self.n + j], &self.z[..=j]);
                !((self.x[j] <= lo && slope >= 0.0) || (self.x[j] >= hi && slope <= 0.0))
            })
            .collect()
    }

    pub(super) fn triangle_of(&self, free: &[usize], z: &[f64]) -> PivotedR {
        let n = self.n;
        let mut sub = Vec::with_capacity(free.len() * n);
        for &j in free {
            // Scaled columns: the pivots then tell the rank, whatever the units.
            let d = 1.0 / self.scale_of(j);
            sub.extend(self.rr[j * n..(j + 1) * n].iter().map(|v| v * d));
        }
        let b: Vec<f64> = z.iter().map(|v| -v).collect();
        PivotedR::new(&sub, n, free.len(), &b)
    }

    /// Step within the trust region and the bounds, whether it is a full Gauss–Newton step, and, where no bound cut it,
    /// the triangle it was solved with.
    pub(super) fn step(&self, free: &[usize], delta: f64) -> (Vec<f64>, bool, Option<PivotedR>) {
        let n = self.n;
        let mut p = vec![0.0; n];
        let mut free = free.to_vec();
        let mut z = self.z.clone();
        let mut full = true;
        let asked = free.len();
        while !free.is_empty() {
            let qr = self.triangle_of(&free, &z);
            let (scaled, newton, triangle) = trust_region_step(&qr, delta);
            full &= newton;
            let mut cut = Vec::new();
            for (k, &j) in free.iter().enumerate() {
                p[j] = scaled[k] / self.scale_of(j);
                let (lo, hi) = self.bounds[j];
                let target = self.x[j] + p[j];
                if target < lo || target > hi {
                    p[j] = target.max(lo).min(hi) - self.x[j];
                    cut.push(j);
                }
            }
            if cut.is_empty() {
                let whole = free.len() == asked;
                let damped = PivotedR { r: triangle, ..qr };
                return (p, full, whole.then_some(damped));
            }
            full = false;
            for &j in &cut {
                for i in 0..n {
                    z[i] += self.rr[j * n + i] * p[j];
                }
            }
            free.retain(|j| !cut.contains(j));
        }
        (p, full, None)
    }

    /// Bends the step along the valley (geodesic acceleration, Transtrum and Sethna 2012): half the second derivative of the
    /// residuals along the step, from one more evaluation, solved with the step's own triangle. None when the curvature is
    /// too large to be trusted or the bent step would leave the bounds.
    pub(super) fn bend<P: Residuals + ?Sized>(
        &mut self,
        problem: &mut P,
        free: &[usize],
        p: &[f64],
        damped: &PivotedR,
        trial_r: &mut [f64],
    ) -> Option<Vec<f64>> {
        const H: f64 = 0.1;
        let ahead: Vec<f64> = self.x.iter().zip(p).map(|(x, p)| x + H * p).collect();
        self.evaluations += 1;
        if !problem.evaluate(&ahead, trial_r, None) {
            return None;
        }
        // r'' ≈ (2/h) ((r(x + h p) - r)/h - J p).
        for (t, r) in trial_r.iter_mut().zip(&self.r) {
            *t = (*t - r) / H;
        }
        for (column, p) in self.jac.chunks_exact(self.m).zip(p) {
            if *p != 0.0 {
                trial_r
                    .iter_mut()
                    .zip(column)
                    .for_each(|(t, c)| *t -= c * p);
            }
        }
        let slope = |j: usize| {
            let column = &self.jac[j * self.m..(j + 1) * self.m];
            -2.0 / H * dot(column, trial_r) / self.scale_of(j)
        };
        let mut y: Vec<f64> = damped.order.iter().map(|&k| slope(free[k])).collect();
        forward_substitute_transposed(&damped.r, damped.n, &mut y)?;
        back_substitute(&damped.r, damped.n, &mut y)?;
        let scaled = damped.unpermute(&y);
        let mut bent = p.to_vec();
        for (k, &j) in free.iter().enumerate() {
            bent[j] += 0.5 * scaled[k] / self.scale_of(j);
            let target = self.x[j] + bent[j];
            if !(self.bounds[j].0..=self.bounds[j].1).contains(&target) {
                return None;
            }
        }
        (2.0 * norm(&scaled) <= 0.75 * self.scaled_norm(p)).then_some(bent)
    }

    /// The relative gain that the linear model promises for the step p.
    pub(super) fn predicted(&self, p: &[f64]) -> f64 {
        let n = self.n;
        let mut rp = vec![0.0; n];
        for j in 0..n {
            for i in 0..=j {
                rp[i] += self.rr[j * n + i] * p[j];
            }
        }
        let f = self.fnorm;
        let scaled = |v: f64| v / f;
        let mut gain = 0.0;
        for i in 0..n {
            gain -= scaled(rp[i]) * (2.0 * scaled(self.z[i]) + scaled(rp[i]));
        }
        gain
    }
}
