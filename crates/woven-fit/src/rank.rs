//! Scores and their order: table 2 of the paper and beyond, with ties called ties.

use crate::fit::{ModelFit, Options};
use crate::measurement::{Point, Points};
use crate::problem::Metric;
use crate::starts::hash;

/// Samples of the bootstrap that judges the order.
const BOOTSTRAP: u64 = 400;

/// A place as a table says it: "=" behind one like the `last`.
pub(crate) fn place_or_tie(place: usize, last: &mut usize) -> String {
    if std::mem::replace(last, place) == place {
        "=".to_owned()
    } else {
        place.to_string()
    }
}

/// Fills the scores of a fit that do not depend on the others.
pub fn score(fit: &mut ModelFit, points: &Points, metric: Metric, floor: f64) {
    let scattered = || {
        points
            .points
            .iter()
            .zip(&fit.fitted)
            .filter(|(p, _)| !p.direct_only)
    };
    let peak = scattered()
        .map(|(p, _)| p.f)
        .fold(f64::MIN_POSITIVE, f64::max);
    let (mut sse, mut n, mut off, mut n_off) = (0.0, 0.0, 0.0, 0.0);
    for (p, f) in scattered() {
        let e = p.share * ((f - p.f) / peak).powi(2);
        sse += e;
        n += p.share;
        if p.gap_density == 0.0 {
            off += e;
            n_off += p.share;
        }
    }
    fit.sse_e4 = sse * 1e4;
    fit.rms_e4 = (sse / n.max(1e-300)).sqrt() * 1e4;
    fit.rms_off_peak_e4 = (off / n_off.max(1e-300)).sqrt() * 1e4;
    // One scatter for the straight-through rows, one for the rest: each counts as a parameter.
    let squares = squares(fit, points, metric, floor);
    let (mut likelihood, mut groups) = (0.0, 0.0);
    for peaks in [true, false] {
        let (n, sum) = group(points, &squares, peaks);
        if n > 0.0 {
            let least = least_scatter(points, peaks, metric, floor);
            likelihood += n * (sum / n).max(least).ln();
            groups += 1.0;
        }
    }
    let k = fit.uncertainty.rank as f64 + groups;
    let m = fit.points as f64;
    fit.rms_metric = (squares.iter().sum::<f64>() / m.max(1.0)).sqrt();
    let correction = if m > k + 1.0 {
        2.0 * k * (k + 1.0) / (m - k - 1.0)
    } else {
        f64::INFINITY
    };
    fit.aicc = likelihood + 2.0 * k + correction;
    fit.bic = likelihood + k * m.ln();
}

/// Squared misfits in the metric, each with its point's share.
fn squares(fit: &ModelFit, points: &Points, metric: Metric, floor: f64) -> Vec<f64> {
    let one = |(p, f): (&Point, &f64)| {
        p.share * (metric.apply(*f, floor).0 - metric.apply(p.f, floor).0).powi(2)
    };
    points.points.iter().zip(&fit.fitted).map(one).collect()
}

/// Number and sum of the straight-through rows, or of the others. A model without gap is not asked for rows that hold
/// straight-through light alone.
fn group(points: &Points, squares: &[f64], peaks: bool) -> (f64, f64) {
    let rows = points
        .points
        .iter()
        .zip(squares)
        .filter(|(p, _)| (p.gap_density > 0.0) == peaks);
    rows.fold((0.0, 0.0), |(n, s), (_, e)| (n + 1.0, s + e))
}

/// The least scatter of a group that is believed. A few rows tell none by themselves: a model that meets a single peak exactly
/// would gain without end. 2 % of their level is taken for them.
fn least_scatter(points: &Points, peaks: bool, metric: Metric, floor: f64) -> f64 {
    const FEW: usize = 6;
    let rows: Vec<&Point> = points
        .points
        .iter()
        .filter(|p| p.is_peak() == peaks)
        .collect();
    if rows.len() > FEW {
        return f64::MIN_POSITIVE;
    }
    let value = |f: f64| metric.apply(f, floor).0;
    let one = |p: &&Point| p.share * (value(1.02 * p.f) - value(p.f)).powi(2);
    let sum: f64 = rows.iter().map(one).sum();
    (sum / rows.len().max(1) as f64).max(f64::MIN_POSITIVE)
}

/// Sorts by misfit and gives places; neighbours that the data cannot tell apart share a place.
///
/// Two models tie when their AICc differ by less than 2, or when the sign of the difference of their misfits is not
/// settled (95 %) by resampling whole incidences; with fewer than five of them, points.
pub fn sort(fits: &mut [ModelFit], points: &Points, options: &Options) {
    let floor = floor_of(points, options.metric);
    let rows: Vec<Vec<f64>> = fits
        .iter()
        .map(|f| squares(f, points, options.metric, floor))
        .collect();
    // Scatter of the best model, apart for peaks and the rest.
    let scatter = |peaks: bool| {
        let means = rows.iter().map(|r| {
            let (n, sum) = group(points, r, peaks);
            sum / n.max(1.0)
        });
        let least = least_scatter(points, peaks, options.metric, floor);
        means.fold(f64::INFINITY, f64::min).max(least)
    };
    let (peak, rest) = (scatter(true), scatter(false));
    let many = points.incidences.len() >= 5;
    let n = if many {
        points.incidences.len()
    } else {
        points.points.len()
    };
    let mut scored: Vec<(usize, f64, Vec<f64>)> = rows
        .iter()
        .enumerate()
        .map(|(i, rows)| {
            let mut sums = vec![0.0; n];
            for (row, (p, s)) in points.points.iter().zip(rows).enumerate() {
                sums[if many { p.incidence } else { row }] +=
                    s / if p.gap_density > 0.0 { peak } else { rest };
            }
            (i, sums.iter().sum(), sums)
        })
        .collect();
    scored.sort_by(|a, b| {
        a.1.total_cmp(&b.1)
            .then(fits[a.0].aicc.total_cmp(&fits[b.0].aicc))
    });
    let draws: Vec<Vec<usize>> = (0..BOOTSTRAP)
        .map(|b| {
            let draw = |i: u64| (hash(options.seed ^ 0xb007, b * n as u64 + i) % n as u64) as usize;
            (0..n as u64).map(draw).collect()
        })
        .collect();
    let totals: Vec<Vec<f64>> = scored
        .iter()
        .map(|(_, _, s)| {
            draws
                .iter()
                .map(|d| d.iter().map(|&i| s[i]).sum())
                .collect()
        })
        .collect();
    let tie = |a: usize, b: usize| {
        let worse = totals[a]
            .iter()
            .zip(&totals[b])
            .filter(|(a, b)| a >= b)
            .count() as f64
            / BOOTSTRAP as f64;
        let aicc = |i: usize| fits[scored[i].0].aicc;
        (aicc(a) - aicc(b)).abs() < 2.0 || (0.025..=0.975).contains(&worse)
    };
    let mut order = Vec::with_capacity(fits.len());
    // A group goes on as long as its members tie with the group's first.
    let mut first = 0;
    for i in 0..fits.len() {
        if i > 0 && !tie(first, i) {
            first = i;
        }
        let keeps = |d: usize| totals.iter().filter(|t| t[d] < totals[i][d]).count() <= i;
        let stability =
            (0..BOOTSTRAP as usize).filter(|&d| keeps(d)).count() as f64 / BOOTSTRAP as f64;
        order.push((scored[i].0, first + 1, stability));
    }
    for (&(fit, place, stability), (_, misfit, _)) in order.iter().zip(&scored) {
        let fit = &mut fits[fit];
        (fit.place, fit.stability, fit.misfit) = (place, stability, *misfit);
    }
    fits.sort_by(|a, b| a.place.cmp(&b.place).then(a.misfit.total_cmp(&b.misfit)));
}

/// What keeps logarithms finite: a tenth of the median of the positive values; 0 in the linear metric.
pub fn floor_of(points: &Points, metric: Metric) -> f64 {
    let scattered = points.points.iter().filter(|p| !p.direct_only);
    let mut positive: Vec<f64> = scattered.map(|p| p.f).filter(|f| *f > 0.0).collect();
    positive.sort_by(f64::total_cmp);
    match metric {
        Metric::Linear => 0.0,
        _ => 0.1 * positive.get(positive.len() / 2).copied().unwrap_or(1.0),
    }
}
