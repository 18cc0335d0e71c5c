//! The gap, decided by the rows that see it.
//!
//! A gap's law misses real peaks by more than a lobe is high, so in one common sum of squares the peaks would bend
//! the lobe, and the thousands of other values would bend the gap. Therefore the straight-through rows alone decide the gap, the
//! other rows alone decide the scattering, each given the other, in turn until both stand.

use crate::finish::{Finished, at_bounds, base_weights, finish, finish_with_profiles};
use crate::fit::Options;
use crate::measurement::Points;
use crate::problem::{Evaluator, GAP, Joint, Spec};
use crate::search::search;
use crate::solve::{Residuals, Settings, solve};
use woven_bsdf::dual::Dual;
use woven_bsdf::vec3::Vec3;
use woven_bsdf::weave::openness;

/// Gap and scattering in turn; then one Jacobian with each row counting for what it decides.
pub(crate) fn with_gap(
    spec: &Spec,
    coarse: &Points,
    full: &Points,
    options: &Options,
    floor: f64,
) -> Option<Finished> {
    let off = |points: &Points| points.filter(|p| !p.is_peak());
    let (coarse_off, full_off) = (off(coarse), off(full));
    let mut gap = gap_alone(full, None);
    let mut held = spec.holding_gap(gap);
    let (mut x, agreeing) = search(&held, &coarse_off, &full_off, options, floor);
    let mut part = None;
    for last in [false, true] {
        let fit = if last {
            finish_with_profiles(&held, &full_off, options, floor, &x)?
        } else {
            finish(&held, &full_off, options, floor, &x)?
        };
        // What the yarns scatter into the straight-through patches is not the gap's.
        let mut scattering = held.clone();
        scattering.gap = false;
        let peaks = full.filter(|p| p.is_peak());
        let scattered = Evaluator {
            spec: &scattering,
            points: &peaks,
        }
        .model(&fit.k, &fit.x);
        gap = gap_alone(full, Some(&scattered));
        held = spec.holding_gap(gap);
        x.clone_from(&fit.x);
        part = Some(fit);
    }
    let part = part?;
    // Put the coordinates together in the spec's order.
    let (factors, shapes) = part.ranges.split_at(part.k.len());
    let mut rest = part.x.iter().copied().zip(shapes.iter().copied());
    let (x, of_shape): (Vec<f64>, Vec<_>) = (0..spec.coordinates.len())
        .map(
            |c| match GAP.iter().position(|g| *g == spec.coordinates[c].name) {
                Some(i) => (gap[i], None),
                None => rest.next().unwrap_or((0.0, None)),
            },
        )
        .unzip();
    let ranges = factors.iter().copied().chain(of_shape).collect();
    let (k, m, n) = (part.k.clone(), full.points.len(), part.k.len() + x.len());
    let mut joint = Joint::new(
        Evaluator { spec, points: full },
        base_weights(full, options),
        options.metric,
        floor,
    );
    let start: Vec<f64> = k.iter().chain(&x).copied().collect();
    let (mut r, mut jacobian) = (vec![0.0; m], vec![0.0; m * n]);
    joint.evaluate(&start, &mut r, Some(&mut jacobian));
    // Each group in units of its own scatter; with hardly more rows than parameters 2 % of the level is taken for it.
    let sum = |peaks: bool, value: &dyn Fn(usize) -> f64| {
        let rows = (0..m).filter(|&i| full.points[i].is_peak() == peaks);
        rows.fold((0usize, 0.0), |(n, s), i| (n + 1, s + value(i) * value(i)))
    };
    let scatter = |peaks: bool, spent: usize| {
        let (rows, squares) = sum(peaks, &|i| r[i]);
        let level = sum(peaks, &|i| full.points[i].f).1 / rows.max(1) as f64;
        let variance = if rows > 2 * spent {
            (squares / (rows - spent) as f64).max(1e-24 * level)
        } else {
            4e-4 * level
        };
        variance.max(f64::MIN_POSITIVE).sqrt()
    };
    let scales = [scatter(false, n - 3), scatter(true, 3)];
    for (j, column) in jacobian.chunks_exact_mut(m).enumerate() {
        let of_gap = j >= k.len() && spec.is_gap(j - k.len());
        for (value, p) in column.iter_mut().zip(&full.points) {
            *value = if p.is_peak() == of_gap {
                *value / scales[usize::from(of_gap)]
            } else {
                0.0
            };
        }
    }
    let dof = m.saturating_sub(n).max(1) as f64;
    let at_bound = at_bounds(&joint, &start);
    Some(Finished {
        x,
        jacobian,
        sse: dof,
        at_bound,
        agreeing,
        ranges,
        ..part
    })
}

/// The weave whose openness comes nearest to the straight-through rows, less what is `scattered` into them.
fn gap_alone(points: &Points, scattered: Option<&[f64]>) -> [f64; 3] {
    struct Rows(Vec<(Vec3<f64>, f64)>);
    impl Residuals for Rows {
        fn rows(&self) -> usize {
            self.0.len()
        }
        fn params(&self) -> usize {
            3
        }
        fn bounds(&self, j: usize) -> (f64, f64) {
            (0.0, if j == 2 { 2.0 } else { 1.0 })
        }
        fn evaluate(&mut self, x: &[f64], r: &mut [f64], mut jac: Option<&mut [f64]>) -> bool {
            let m = r.len();
            let x: [Dual<3>; 3] = std::array::from_fn(|i| Dual::variable(x[i], i));
            for (i, (l, t)) in self.0.iter().enumerate() {
                let o = openness(x[0], x[1], x[2], l.cast());
                r[i] = o.v - t;
                if let Some(jac) = jac.as_deref_mut() {
                    for (j, d) in o.d.iter().enumerate() {
                        jac[j * m + i] = *d;
                    }
                }
            }
            true
        }
    }
    let peaks = points.points.iter().filter(|p| p.is_peak()).enumerate();
    let value =
        |i: usize, f: f64, direct: bool| f - scattered.filter(|_| !direct).map_or(0.0, |s| s[i]);
    let mut rows = Rows(
        peaks
            .map(|(i, p)| (p.l, value(i, p.f, p.direct_only) / p.gap_density))
            .collect(),
    );
    let near = rows
        .0
        .iter()
        .max_by(|a, b| a.0.z.abs().total_cmp(&b.0.z.abs()));
    let Some(&(_, t)) = near else { return [0.5; 3] };
    // A square weave of this openness, and two that are closer along one yarn.
    let g = 1.0 - t.clamp(0.0, 1.0).sqrt();
    let tries = [0.2, 0.5, 1.0]
        .into_iter()
        .flat_map(|s| [[g, g, s], [0.9 * g, g, s], [g, 0.9 * g, s]]);
    let settings = Settings {
        max_evaluations: 300,
        ..Settings::default()
    };
    let best = tries
        .map(|x| solve(&mut rows, &x, &settings))
        .min_by(|a, b| a.sse.total_cmp(&b.sse));
    best.map_or([g, g, 0.5], |s| [s.x[0], s.x[1], s.x[2]])
}
