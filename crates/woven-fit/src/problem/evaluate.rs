//! Basis functions and gap at all points, averaged over the instrument's kernels, with slopes by dual numbers.

use super::spec::{Coordinate, Place, Spec};
use crate::measurement::{Point, Points};
use rayon::prelude::*;
use woven_bsdf::dual::Dual;
use woven_bsdf::model::{D8, MAX_LINEAR};
use woven_bsdf::vec3::Vec3;
use woven_bsdf::weave;

/// Basis functions and gap of all points for one shape, by columns, with slopes along the solver's coordinates.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// `phi[j * m + i]`: basis j at point i.
    pub phi: Vec<f64>,
    /// The gap's part (and that of fixed factors) at each point.
    pub fixed: Vec<f64>,
    /// `dphi[(s * J + j) * m + i]`.
    pub dphi: Vec<f64>,
    /// `dfixed[s * m + i]`.
    pub dfixed: Vec<f64>,
}

/// Evaluates a [`Spec`] on [`Points`].
#[derive(Clone, Copy, Debug)]
pub struct Evaluator<'a> {
    /// What is fitted.
    pub spec: &'a Spec,
    /// To what.
    pub points: &'a Points,
}

/// Rows per parallel task; results do not depend on it.
const CHUNK: usize = 128;
/// Below this many nodes a parallel loop costs more than it gains.
const PARALLEL: usize = 4000;

impl Evaluator<'_> {
    pub(super) fn m(&self) -> usize {
        self.points.points.len()
    }

    /// Fills the table at solver coordinates `x`; false if any number is not finite.
    pub fn fill(&self, x: &[f64], slopes: bool, table: &mut Table) -> bool {
        let (m, j, s) = (
            self.m(),
            self.spec.linear.len(),
            self.spec.coordinates.len(),
        );
        let stride = if slopes { (j + 1) * (s + 1) } else { j + 1 };
        let mut rows = vec![0.0; m * stride];
        let (shape, gap) = self.spec.shape_at(x);
        let work = |first: usize, out: &mut [f64], row: &dyn Fn(&Point, &mut [f64])| {
            for (p, out) in self.points.points[first..]
                .iter()
                .zip(out.chunks_exact_mut(stride))
            {
                row(p, out);
            }
        };
        let value;
        let dual;
        let row: &(dyn Fn(&Point, &mut [f64]) + Sync) = if slopes {
            let prepared = self.spec.model.prepare_dual(&shape);
            let gap: [D8; 3] = std::array::from_fn(|i| D8::variable(gap[i], i));
            dual = move |p: &Point, out: &mut [f64]| self.row_dual(&prepared, &gap, x, p, out);
            &dual
        } else {
            let prepared = self.spec.model.prepare(&shape);
            value = move |p: &Point, out: &mut [f64]| self.row_value(&prepared, &gap, p, out);
            &value
        };
        if self.points.nodes.len() < PARALLEL {
            work(0, &mut rows, row);
        } else {
            rows.par_chunks_mut(CHUNK * stride)
                .enumerate()
                .for_each(|(c, out)| work(c * CHUNK, out, row));
        }
        if rows.iter().any(|v| !v.is_finite()) {
            return false;
        }
        let column = |out: &mut Vec<f64>, at: &dyn Fn(usize) -> usize, columns: usize| {
            out.clear();
            out.reserve(columns * m);
            for c in 0..columns {
                let at = at(c);
                out.extend((0..m).map(|i| rows[i * stride + at]));
            }
        };
        column(&mut table.phi, &|c| c, j);
        column(&mut table.fixed, &|_| j, 1);
        if slopes {
            column(&mut table.dphi, &|c| (c / j + 1) * (j + 1) + c % j, s * j);
            column(&mut table.dfixed, &|c| (c + 1) * (j + 1) + j, s);
        }
        true
    }

    /// One row: basis functions, then the fixed part.
    fn row_value(&self, shape: &[f64; 16], gap: &[f64; 3], p: &Point, out: &mut [f64]) {
        let spec = self.spec;
        let own = spec.model.name == "sheet";
        let n = spec.linear.len();
        let held = spec.held();
        for node in &self.points.nodes[p.nodes.0..p.nodes.1] {
            if !p.direct_only {
                let b = (spec.model.f64.basis)(shape, node.l, node.v);
                for (o, &i) in out.iter_mut().zip(&spec.linear) {
                    *o += node.weight * b[i];
                }
                for &(i, k) in &held {
                    out[n] += node.weight * k * b[i];
                }
            }
            if spec.gap && p.gap_density > 0.0 {
                let [a, b, c] = if own {
                    [shape[0], shape[1], shape[2]]
                } else {
                    *gap
                };
                out[n] += node.weight * p.gap_density * weave::openness(a, b, c, node.l);
            }
        }
    }

    /// One row with slopes: for the value and for each coordinate, basis functions and the fixed part.
    fn row_dual(&self, shape: &[D8; 16], gap: &[D8; 3], x: &[f64], p: &Point, out: &mut [f64]) {
        let spec = self.spec;
        let own = spec.model.name == "sheet";
        let n = spec.linear.len();
        let zero = Dual {
            v: 0.0,
            d: [0.0; 8],
        };
        let mut sums = [zero; MAX_LINEAR];
        let mut through = zero;
        let mut fixed = zero;
        let held = spec.held();
        for node in &self.points.nodes[p.nodes.0..p.nodes.1] {
            let (l, v): (Vec3<D8>, Vec3<D8>) = (node.l.cast(), node.v.cast());
            if !p.direct_only {
                let b = (spec.model.dual)(shape, l, v);
                for (sum, &i) in sums.iter_mut().zip(&spec.linear) {
                    add(sum, &b[i], node.weight);
                }
                for &(i, k) in &held {
                    add(&mut fixed, &b[i], node.weight * k);
                }
            }
            if spec.gap && p.gap_density > 0.0 {
                let [a, b, c] = if own {
                    [shape[0], shape[1], shape[2]]
                } else {
                    *gap
                };
                add(
                    &mut through,
                    &weave::openness(a, b, c, l),
                    node.weight * p.gap_density,
                );
            }
        }
        let slope = |d: &D8, c: &Coordinate, x: f64, of_gap: bool| {
            let raw = match c.place {
                Place::Shape(i) if !of_gap || own => d.d[i],
                Place::Tied(i, j) if !of_gap || own => d.d[i] + d.d[j],
                Place::Gap(i) if of_gap && !own => d.d[i],
                _ => 0.0,
            };
            if c.log { raw * x.exp() } else { raw }
        };
        for (k, sum) in sums[..n].iter().enumerate() {
            out[k] = sum.v;
        }
        out[n] = through.v + fixed.v;
        for (s, (c, &x)) in spec.coordinates.iter().zip(x).enumerate() {
            let block = &mut out[(s + 1) * (n + 1)..(s + 2) * (n + 1)];
            for (o, sum) in block.iter_mut().zip(&sums[..n]) {
                *o = slope(sum, c, x, false);
            }
            block[n] = slope(&through, c, x, true) + slope(&fixed, c, x, false);
        }
    }

    /// Model values f = Σ k φ + fixed at all points; none if a number is not finite.
    pub fn values(&self, k: &[f64], x: &[f64]) -> Option<Vec<f64>> {
        let mut table = Table::default();
        self.fill(x, false, &mut table)
            .then(|| combine(&table, k, self.m()))
    }

    /// [`Self::values`] where a fit has shown that they are finite, and zeros otherwise.
    pub fn model(&self, k: &[f64], x: &[f64]) -> Vec<f64> {
        self.values(k, x).unwrap_or_else(|| vec![0.0; self.m()])
    }
}

fn add(sum: &mut D8, term: &D8, weight: f64) {
    sum.v += weight * term.v;
    for (s, t) in sum.d.iter_mut().zip(&term.d) {
        *s += weight * t;
    }
}

/// Σ_j k_j φ_j + fixed.
pub(super) fn combine(table: &Table, k: &[f64], m: usize) -> Vec<f64> {
    let mut f = table.fixed.clone();
    for (j, &k) in k.iter().enumerate() {
        if k != 0.0 {
            for (f, phi) in f.iter_mut().zip(&table.phi[j * m..(j + 1) * m]) {
                *f += k * phi;
            }
        }
    }
    f
}
