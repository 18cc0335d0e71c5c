//! The gap, decided by the rows that see it.
//!
//! A gap's law misses real peaks by more than a lobe is high, so in one common sum of squares the peaks would bend
//! the lobe, and the thousands of other values would bend the gap. Therefore the straight-through rows alone decide the gap, the
//! other rows alone decide the scattering, each given the other, in turn until both stand.

use crate::finish::{Finished, at_bounds, base_weights, finish, finish_with_profiles, sigmas};
use crate::fit::Options;
use crate::measurement::shared::{Kind, shifted};
use crate::measurement::{Point, Points};
use crate::problem::{Evaluator, GAP, Joint, Spec};
use crate::search::search;
use crate::solve::{Residuals, Settings, solve};
use crate::whiten::{Whitened, Whitening, columns};
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
    let weighted = sigmas(full, options.metric).is_some();
    let mut gap = gap_alone(full, None, weighted);
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
        gap = gap_alone(full, Some(&scattered), weighted);
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
    let mut weights = base_weights(full, options);
    let off = (0..m).filter(|&i| !full.points[i].is_peak());
    for (i, w) in off.zip(&part.weights) {
        weights[i] = *w;
    }
    if weighted {
        let rows = weights.iter_mut().zip(&full.points);
        rows.filter(|(_, p)| p.is_peak())
            .for_each(|(w, p)| *w /= p.own);
    }
    let eval = Evaluator { spec, points: full };
    let mut joint = Joint::new(eval, weights, options.metric, floor);
    let start: Vec<f64> = k.iter().chain(&x).copied().collect();
    let (mut r, mut jacobian) = (vec![0.0; m], vec![0.0; m * n]);
    joint.evaluate(&start, &mut r, Some(&mut jacobian));
    // Each group in units of its own scatter; with hardly more rows than parameters their standard errors are taken for it, or
    // where they have none 2 % of the level.
    let sum = |peaks: bool, value: &dyn Fn(usize) -> f64| {
        let rows = (0..m).filter(|&i| full.points[i].is_peak() == peaks);
        rows.fold((0usize, 0.0), |(n, s), i| (n + 1, s + value(i) * value(i)))
    };
    let scatter = |peaks: bool, spent: usize| {
        let (rows, own) = sum(peaks, &|i| r[i]);
        let squares = if peaks { own } else { part.sse };
        let level = sum(peaks, &|i| full.points[i].f).1 / rows.max(1) as f64;
        let variance = if rows > 2 * spent {
            (squares / (rows - spent) as f64).max(1e-24 * level)
        } else if weighted {
            1.0
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
    // The errors that all rows share, for each group by itself.
    let shared = columns(&joint, &start).unwrap_or_default();
    let both: Vec<f64> = [false, true]
        .into_iter()
        .flat_map(|peaks| {
            let points = full.points.iter().cycle();
            let row = move |(v, p): (&f64, &Point)| match p.is_peak() == peaks {
                true => v / scales[usize::from(peaks)],
                false => 0.0,
            };
            shared.iter().zip(points).map(row)
        })
        .collect();
    if let Some(whitening) = Whitening::new(&both, m, 1.0) {
        jacobian
            .chunks_exact_mut(m)
            .for_each(|column| whitening.apply(column));
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

/// What a straight-through row counts for, in transmittance: by its own standard error, or as the others.
fn weight(p: &Point, weighted: bool) -> f64 {
    match p.sigma {
        Some(sigma) if weighted => p.gap_density / (p.own * sigma),
        _ => 1.0,
    }
}

/// The weave whose openness comes nearest to the straight-through rows, less what is `scattered` into them.
fn gap_alone(points: &Points, scattered: Option<&[f64]>, weighted: bool) -> [f64; 3] {
    /// Direction, transmittance, weight.
    struct Rows(Vec<(Vec3<f64>, f64, f64)>);
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
            for (i, (l, t, w)) in self.0.iter().enumerate() {
                let o = openness(x[0], x[1], x[2], l.cast());
                r[i] = w * (o.v - t);
                if let Some(jac) = jac.as_deref_mut() {
                    for (j, d) in o.d.iter().enumerate() {
                        jac[j * m + i] = w * d;
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
            .map(|(i, p)| {
                let t = value(i, p.f, p.direct_only) / p.gap_density;
                (p.l, t, weight(p, weighted))
            })
            .collect(),
    );
    let near = rows
        .0
        .iter()
        .max_by(|a, b| a.0.z.abs().total_cmp(&b.0.z.abs()));
    let Some(&(_, t, _)) = near else {
        return [0.5; 3];
    };
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
    let Some(mut best) = best else {
        return [g, g, 0.5];
    };
    if let Some(whitening) = shared_by_peaks(points, &best.x, best.sse, weighted) {
        let inner = &mut rows;
        best = solve(
            &mut Whitened {
                inner,
                whitening: &whitening,
            },
            &best.x,
            &settings,
        );
    }
    [best.x[0], best.x[1], best.x[2]]
}

/// How straight-through rows become independent of the errors that they share; none where there are none.
fn shared_by_peaks(points: &Points, x: &[f64], sse: f64, weighted: bool) -> Option<Whitening> {
    let peaks = points.filter(Point::is_peak);
    let m = peaks.points.len();
    let open = |points: &Points| -> Vec<f64> {
        let rows = points.points.iter();
        rows.map(|p| openness(x[0], x[1], x[2], p.l)).collect()
    };
    let here = open(&peaks);
    let mut columns = Vec::new();
    for s in &points.shared {
        match s.kind {
            Kind::Scale => columns.extend(here.iter().map(|t| t * s.sigma)),
            Kind::SolidAngle => columns.extend(
                here.iter()
                    .zip(&peaks.points)
                    .map(|(t, p)| if p.direct_only { 0.0 } else { t * s.sigma }),
            ),
            Kind::Floor => columns.extend(peaks.points.iter().map(|p| match p.direct_only {
                true => 0.0,
                false => s.sigma / p.v.z.abs() / p.gap_density,
            })),
            Kind::LightTheta | Kind::LightPhi => {
                let [up, down] = [s.sigma, -s.sigma].map(|d| open(&shifted(&peaks, s.kind, d).0));
                columns.extend(up.iter().zip(down).map(|(a, b)| 0.5 * (a - b)));
            }
            Kind::ViewTheta | Kind::ViewPhi => {}
        }
    }
    if columns.is_empty() {
        return None;
    }
    let weights: Vec<f64> = peaks.points.iter().map(|p| weight(p, weighted)).collect();
    for (value, w) in columns.iter_mut().zip(weights.iter().cycle()) {
        *value *= w;
    }
    let level = here.iter().map(|t| t * t).sum::<f64>() / m as f64;
    let variance = if m > 6 {
        sse / (m - 3) as f64
    } else if weighted {
        1.0
    } else {
        4e-4 * level
    };
    Whitening::new(&columns, m, variance.sqrt())
}
