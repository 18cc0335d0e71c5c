//! One model against one set of points: residuals with exact slopes, linear factors separated.
//!
//! Every model is f = Σ_j k_j basis_j(shape), so for a given shape the best factors k ≥ 0 follow from a small
//! non-negative linear problem, and the solver only sees the shape: variable projection (Golub and Pereyra 1973, with
//! their full derivative, not Kaufman's short cut). A gap adds openness(shape) in the straight-through patches with
//! the fixed factor 1. In a metric that bends the values (log, cube root) nothing is linear any more; [`Joint`] then
//! fits factors and shape together.

use crate::linalg::{dot, nnls_triangular, norm};
use crate::measurement::{Point, Points};
use crate::solve::Residuals;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use woven_bsdf::dual::Dual;
use woven_bsdf::model::{D8, MAX_LINEAR, ModelInfo, Role};
use woven_bsdf::vec3::Vec3;
use woven_bsdf::weave;

/// In which measure misfits are squared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Metric {
    /// The values themselves, as in the paper's table 2.
    #[default]
    Linear,
    /// Their logarithms: the tail counts as much as the peak (Löw et al. 2012).
    Log,
    /// Their cube roots (Fores, Ferwerda and Gu 2012).
    Cbrt,
}

impl Metric {
    /// The transformed value and its slope; `floor` keeps logarithms finite.
    pub fn apply(self, f: f64, floor: f64) -> (f64, f64) {
        match self {
            Metric::Linear => (f, 1.0),
            Metric::Log => {
                let t = f.max(0.0) + floor;
                (t.ln(), 1.0 / t)
            }
            Metric::Cbrt => {
                let t = f.max(0.0) + floor;
                (t.cbrt(), 1.0 / (3.0 * t.cbrt().powi(2)))
            }
        }
    }

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Metric::Linear => "linear",
            Metric::Log => "log",
            Metric::Cbrt => "cbrt",
        }
    }
}

/// A parameter that the solver moves: where it lives, its range, whether its logarithm is moved.
#[derive(Clone, Debug)]
pub struct Coordinate {
    /// The parameter's name.
    pub name: &'static str,
    /// Where it lives.
    pub place: Place,
    /// Least value.
    pub min: f64,
    /// Greatest value.
    pub max: f64,
    /// Where the first start stands.
    pub start: f64,
    /// Whether the solver moves the logarithm.
    pub log: bool,
}

/// Where a [`Coordinate`] lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Number in the model's list of shape parameters.
    Shape(usize),
    /// Number among (gamma_warp, gamma_weft, section) of a gap added to a model that has none.
    Gap(usize),
    /// Two shape parameters tied together: an isotropic lobe.
    Tied(usize, usize),
}

/// What is fitted: a model, which of its parameters are free, and whether a gap is added.
#[derive(Clone, Debug)]
pub struct Spec {
    /// The model.
    pub model: &'static ModelInfo,
    /// How reports call it, for example "hgf without c".
    pub label: String,
    /// Numbers (in the model's list of linear parameters) of the free factors.
    pub linear: Vec<usize>,
    /// Fixed factors, in the model's order; used for those not free.
    pub fixed_linear: [f64; MAX_LINEAR],
    /// Free shape parameters.
    pub coordinates: Vec<Coordinate>,
    /// Values of the shape parameters that are not free.
    pub shape: Vec<f64>,
    /// Whether light passes through gaps: by the model itself (`sheet`) or added to it.
    pub gap: bool,
    /// (gamma_warp, gamma_weft, section) of an added gap where they are not free.
    pub held_gap: [f64; 3],
}

/// Names of the terms that do not depend on the direction.
const DIFFUSE: [&str; 4] = ["k_d", "c", "t_d", "r_d"];
/// Parameters of `sheet` that only reflection sees.
const REFLECTION: [&str; 5] = ["r_d", "k_r", "ralpha_x", "ralpha_y", "f0"];
/// Parameters that make the gap.
const GAP: [&str; 3] = ["gamma_warp", "gamma_weft", "section"];

impl Spec {
    /// The model's parameters that transmission sees; the constant term only with `diffuse`, a gap only with `gap`.
    pub fn transmission(model: &'static ModelInfo, diffuse: bool, gap: bool) -> Self {
        let own_gap = model.params.iter().any(|p| p.name == GAP[0]);
        let skip = |name: &str| {
            (own_gap && REFLECTION.contains(&name))
                || (!diffuse && DIFFUSE.contains(&name))
                || (own_gap && !gap && GAP.contains(&name))
        };
        let mut spec = Self::with(model, skip, gap);
        if own_gap && !gap {
            // Closed: whatever passes is scattered by the yarn.
            for (value, p) in spec.shape.iter_mut().zip(model.shape()) {
                if GAP[..2].contains(&p.name) {
                    *value = p.max;
                }
            }
        }
        if gap && !own_gap {
            let range = [(0.0, 1.0), (0.0, 1.0), (0.0, 2.0)];
            for (i, &name) in GAP.iter().enumerate() {
                spec.coordinates.push(Coordinate {
                    name,
                    place: Place::Gap(i),
                    min: range[i].0,
                    max: range[i].1,
                    start: 0.5,
                    log: false,
                });
            }
        }
        if !diffuse {
            let term = model.linear().find(|p| DIFFUSE.contains(&p.name));
            if let Some(p) = term {
                spec.label += &format!(" without {}", p.name);
            }
        }
        if gap && !own_gap {
            spec.label += " + gap";
        }
        spec
    }

    /// The parameters of `sheet` that reflection sees, on top of known `values` for all others.
    pub fn reflection(model: &'static ModelInfo, values: &[f64]) -> Self {
        // f0 multiplies k_r at all angles but grazing ones, so it keeps the value of a common fibre.
        let mut spec = Self::with(
            model,
            |name| !REFLECTION.contains(&name) || name == "f0",
            true,
        );
        let (linear, _) = model.split(values);
        spec.fixed_linear = linear;
        spec.shape = model
            .params
            .iter()
            .zip(values)
            .filter(|(p, _)| p.role == Role::Shape)
            .map(|(_, &v)| v)
            .collect();
        spec.label += ", reflection";
        spec
    }

    /// All parameters of a model but those that `skip` names.
    pub fn with(model: &'static ModelInfo, skip: impl Fn(&str) -> bool, gap: bool) -> Self {
        let linear = model
            .linear()
            .enumerate()
            .filter(|(_, p)| !skip(p.name))
            .map(|(i, _)| i)
            .collect();
        let coordinates = model
            .shape()
            .enumerate()
            .filter(|(_, p)| !skip(p.name))
            .map(|(i, p)| Coordinate {
                name: p.name,
                place: Place::Shape(i),
                min: p.min,
                max: p.max,
                start: p.start,
                log: p.log,
            })
            .collect();
        Self {
            model,
            label: model.name.to_owned(),
            linear,
            fixed_linear: [0.0; MAX_LINEAR],
            coordinates,
            shape: model.shape().map(|p| p.start).collect(),
            gap,
            held_gap: [0.0; 3],
        }
    }

    /// Only the named parameters; shapes not named stand at their start values, factors not named at zero.
    pub fn only(model: &'static ModelInfo, names: &[&str]) -> Self {
        Self::with(model, |name| !names.contains(&name), false)
    }

    /// Ties alpha_x to alpha_y: the isotropic version of an anisotropic lobe; `None` if there is no such pair.
    pub fn isotropic(&self) -> Option<Self> {
        let find = |suffix: &str| {
            self.coordinates
                .iter()
                .position(|c| c.name.ends_with(suffix) && matches!(c.place, Place::Shape(_)))
        };
        let (x, y) = find("_x")
            .zip(find("_y"))
            .or_else(|| find("_u").zip(find("_v")))?;
        let (Place::Shape(i), Place::Shape(j)) =
            (self.coordinates[x].place, self.coordinates[y].place)
        else {
            return None;
        };
        let mut spec = self.clone();
        spec.coordinates[x].place = Place::Tied(i, j);
        spec.coordinates.remove(y);
        spec.label += " isotropic";
        Some(spec)
    }

    /// Names of the free parameters: factors first, then shape.
    pub fn names(&self) -> Vec<&'static str> {
        let linear: Vec<&'static str> = self.model.linear().map(|p| p.name).collect();
        let factors = self.linear.iter().map(|&i| linear[i]);
        factors
            .chain(self.coordinates.iter().map(|c| c.name))
            .collect()
    }

    /// Shape values and gap values for solver coordinates `x`.
    pub fn shape_at(&self, x: &[f64]) -> (Vec<f64>, [f64; 3]) {
        let mut shape = self.shape.clone();
        let mut gap = self.held_gap;
        for (c, &x) in self.coordinates.iter().zip(x) {
            let value = if c.log { x.exp() } else { x };
            match c.place {
                Place::Shape(i) => shape[i] = value,
                Place::Gap(i) => gap[i] = value,
                Place::Tied(i, j) => {
                    shape[i] = value;
                    shape[j] = value;
                }
            }
        }
        (shape, gap)
    }

    /// All of the model's parameters in its own order, from factors and solver coordinates.
    pub fn values(&self, k: &[f64], x: &[f64]) -> Vec<f64> {
        let (shape, _) = self.shape_at(x);
        let mut linear = self.fixed_linear;
        for (&i, &k) in self.linear.iter().zip(k) {
            linear[i] = k;
        }
        let (mut i, mut j) = (0, 0);
        self.model
            .params
            .iter()
            .map(|p| {
                if p.role == Role::Linear {
                    i += 1;
                    linear[i - 1]
                } else {
                    j += 1;
                    shape[j - 1]
                }
            })
            .collect()
    }

    /// Whether coordinate `c` makes the gap.
    pub fn is_gap(&self, c: usize) -> bool {
        GAP.contains(&self.coordinates[c].name)
    }

    /// The same with the gap held at (gamma_warp, gamma_weft, section).
    pub fn holding_gap(&self, gap: [f64; 3]) -> Self {
        let mut spec = self.clone();
        for (c, coordinate) in self.coordinates.iter().enumerate() {
            let Some(i) = GAP.iter().position(|g| *g == coordinate.name) else {
                continue;
            };
            if let Place::Shape(place) = self.coordinates[c].place {
                spec.shape[place] = gap[i];
            }
        }
        spec.held_gap = gap;
        spec.coordinates.retain(|c| !GAP.contains(&c.name));
        spec
    }

    /// Factors that are not free and not zero: (number, value).
    fn held(&self) -> Vec<(usize, f64)> {
        let held = self.fixed_linear.iter().copied().enumerate();
        held.filter(|(i, k)| *k != 0.0 && !self.linear.contains(i))
            .collect()
    }

    /// Holds the factor `name` at `value`.
    pub fn hold(&mut self, name: &str, value: f64) {
        if let Some(i) = self.model.linear().position(|p| p.name == name) {
            self.linear.retain(|&j| j != i);
            self.fixed_linear[i] = value;
        }
    }

    /// The solver's range of coordinate `c`.
    pub fn range(&self, c: usize) -> (f64, f64) {
        let c = &self.coordinates[c];
        if c.log {
            (c.min.ln(), c.max.ln())
        } else {
            (c.min, c.max)
        }
    }
}

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
    fn m(&self) -> usize {
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

    /// Model values f = Σ k φ + fixed at all points.
    pub fn model(&self, k: &[f64], x: &[f64]) -> Vec<f64> {
        let mut table = Table::default();
        self.fill(x, false, &mut table);
        combine(&table, k, self.m())
    }
}

fn add(sum: &mut D8, term: &D8, weight: f64) {
    sum.v += weight * term.v;
    for (s, t) in sum.d.iter_mut().zip(&term.d) {
        *s += weight * t;
    }
}

/// Σ_j k_j φ_j + fixed.
fn combine(table: &Table, k: &[f64], m: usize) -> Vec<f64> {
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
            if crate::linalg::forward_substitute_transposed(&triangle, p, &mut pull).is_none() {
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
