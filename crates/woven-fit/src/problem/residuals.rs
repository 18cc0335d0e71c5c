//! The two problems that the solver sees: shape alone with the factors projected out, or factors and shape together.

use super::Metric;
use super::evaluate::{Evaluator, Table, combine};
use crate::linalg::{dot, forward_substitute_transposed, nnls_triangular, norm};
use crate::solve::Residuals;

/// Orthonormal columns spanning those of `columns` by modified Gram–Schmidt, twice; also the triangle.
fn orthonormal(columns: &[&[f64]], m: usize) -> (Vec<f64>, Vec<f64>) {
    let n = columns.len();
    let mut q = vec![0.0; m * n];
    let mut r = vec![0.0; n * n];
    for j in 0..n {
        q[j * m..(j + 1) * m].copy_from_slice(columns[j]);
        let (done, rest) = q.split_at_mut(j * m);
        let v = &mut rest[..m];
        for _ in 0..2 {
            for i in 0..j {
                let qi = &done[i * m..(i + 1) * m];
                let c = dot(qi, v);
                r[j * n + i] += c;
                v.iter_mut().zip(qi).for_each(|(v, q)| *v -= c * q);
            }
        }
        let length = norm(v);
        r[j * n + j] = length;
        if length > 0.0 {
            v.iter_mut().for_each(|v| *v /= length);
        }
    }
    (q, r)
}

/// The separated problem in the linear metric: the solver sees the shape only.
pub struct Separable<'a> {
    /// Model and points.
    pub eval: Evaluator<'a>,
    /// Factors on the residuals: square roots of the weights.
    pub weights: Vec<f64>,
    /// Best factors at the last evaluation, zeros where the bound k ≥ 0 holds them.
    pub k: Vec<f64>,
    table: Table,
}

impl<'a> Separable<'a> {
    /// The problem with the given square roots of weights.
    pub fn new(eval: Evaluator<'a>, weights: Vec<f64>) -> Self {
        Self {
            eval,
            weights,
            k: vec![0.0; eval.spec.linear.len()],
            table: Table::default(),
        }
    }

    /// Best factors at `x`, which must be a place that can be evaluated. A solver's last evaluation may have been a step that
    /// it refused, so `k` is not asked after it.
    pub fn factors_at(&mut self, x: &[f64]) -> Vec<f64> {
        let mut r = vec![0.0; self.rows()];
        self.evaluate(x, &mut r, None);
        self.k.clone()
    }
}

impl Residuals for Separable<'_> {
    fn rows(&self) -> usize {
        self.eval.m()
    }
    fn params(&self) -> usize {
        self.eval.spec.coordinates.len()
    }
    fn bounds(&self, j: usize) -> (f64, f64) {
        self.eval.spec.range(j)
    }

    fn evaluate(&mut self, x: &[f64], r: &mut [f64], jac: Option<&mut [f64]>) -> bool {
        if !self.eval.fill(x, jac.is_some(), &mut self.table) {
            return false;
        }
        let (m, n, w) = (r.len(), self.k.len(), &self.weights);
        let mut phi = self.table.phi.clone();
        for column in phi.chunks_exact_mut(m) {
            column.iter_mut().zip(w).for_each(|(c, w)| *c *= w);
        }
        let columns: Vec<&[f64]> = phi.chunks_exact(m).collect();
        // r = -(y - fixed), weighted: what the factors have to explain.
        for (i, p) in self.eval.points.points.iter().enumerate() {
            r[i] = w[i] * (self.table.fixed[i] - p.f);
        }
        let (q, triangle) = orthonormal(&columns, m);
        let target: Vec<f64> = q.chunks_exact(m).map(|q| -dot(q, r)).collect();
        let (k, passive) = nnls_triangular(&triangle, n, &target);
        let set: Vec<usize> = (0..n).filter(|&j| passive[j]).collect();
        for &j in &set {
            r.iter_mut()
                .zip(columns[j])
                .for_each(|(r, c)| *r += k[j] * c);
        }
        self.k = k;
        let Some(jac) = jac else { return true };
        // Golub–Pereyra: ∂r = P⊥(∂Φ k + ∂fixed) - (Φ⁺)ᵀ ∂Φᵀ r, over the positive factors.
        let used: Vec<&[f64]> = set.iter().map(|&j| columns[j]).collect();
        let (q, triangle) = orthonormal(&used, m);
        let p = set.len();
        for (s, out) in jac.chunks_exact_mut(m).enumerate() {
            out.copy_from_slice(&self.table.dfixed[s * m..(s + 1) * m]);
            let mut pull = vec![0.0; p];
            for (place, &j) in set.iter().enumerate() {
                let d = &self.table.dphi[(s * n + j) * m..(s * n + j + 1) * m];
                let k = self.k[j];
                out.iter_mut().zip(d).for_each(|(o, d)| *o += k * d);
                pull[place] = d.iter().zip(w).zip(&*r).map(|((d, w), r)| d * w * r).sum();
            }
            out.iter_mut().zip(w).for_each(|(o, w)| *o *= w);
            if forward_substitute_transposed(&triangle, p, &mut pull).is_none() {
                pull.fill(0.0);
            }
            for (place, qj) in q.chunks_exact(m).enumerate() {
                let c = dot(qj, out) + pull[place];
                out.iter_mut().zip(qj).for_each(|(o, q)| *o -= c * q);
            }
        }
        true
    }
}

/// Factors and shape together, in any metric; parameters are the factors, then the solver's coordinates.
pub struct Joint<'a> {
    /// Model and points.
    pub eval: Evaluator<'a>,
    /// Factors on the residuals: square roots of the weights.
    pub weights: Vec<f64>,
    /// In which measure misfits are squared.
    pub metric: Metric,
    /// Keeps the metric finite at zero.
    pub floor: f64,
    table: Table,
}

impl<'a> Joint<'a> {
    /// The problem in `metric` with the given square roots of weights.
    pub fn new(eval: Evaluator<'a>, weights: Vec<f64>, metric: Metric, floor: f64) -> Self {
        Self {
            eval,
            weights,
            metric,
            floor,
            table: Table::default(),
        }
    }
}

impl Residuals for Joint<'_> {
    fn rows(&self) -> usize {
        self.eval.m()
    }
    fn params(&self) -> usize {
        self.eval.spec.linear.len() + self.eval.spec.coordinates.len()
    }
    fn bounds(&self, j: usize) -> (f64, f64) {
        let n = self.eval.spec.linear.len();
        if j < n {
            (0.0, f64::INFINITY)
        } else {
            self.eval.spec.range(j - n)
        }
    }

    fn evaluate(&mut self, x: &[f64], r: &mut [f64], jac: Option<&mut [f64]>) -> bool {
        let n = self.eval.spec.linear.len();
        let (k, shape) = x.split_at(n);
        if !self.eval.fill(shape, jac.is_some(), &mut self.table) {
            return false;
        }
        let m = r.len();
        let f = combine(&self.table, k, m);
        let mut slope = vec![0.0; m];
        for (i, p) in self.eval.points.points.iter().enumerate() {
            let (t, d) = self.metric.apply(f[i], self.floor);
            r[i] = self.weights[i] * (t - self.metric.apply(p.f, self.floor).0);
            slope[i] = self.weights[i] * d;
        }
        let Some(jac) = jac else { return true };
        for (j, out) in jac.chunks_exact_mut(m).enumerate() {
            if j < n {
                out.copy_from_slice(&self.table.phi[j * m..(j + 1) * m]);
            } else {
                let s = j - n;
                out.copy_from_slice(&self.table.dfixed[s * m..(s + 1) * m]);
                for (a, &k) in k.iter().enumerate() {
                    let d = &self.table.dphi[(s * n + a) * m..(s * n + a + 1) * m];
                    out.iter_mut().zip(d).for_each(|(o, d)| *o += k * d);
                }
            }
            out.iter_mut().zip(&slope).for_each(|(o, s)| *o *= s);
        }
        true
    }
}
