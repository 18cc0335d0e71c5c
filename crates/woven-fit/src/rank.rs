//! Scores and their order: table 2 of the paper and beyond, with ties called ties.

use crate::fit::{ModelFit, Options};
use crate::measurement::Points;
use crate::problem::Metric;
use crate::starts::hash;

/// Samples of the bootstrap that judges the order.
const BOOTSTRAP: u64 = 400;

/// Fills the scores of a fit.
pub fn score(fit: &mut ModelFit, points: &Points, options: &Options, floor: f64) {
    let scattered = || points.points.iter().zip(&fit.fitted).filter(|(p, _)| !p.direct_only);
    let peak = scattered().map(|(p, _)| p.f).fold(f64::MIN_POSITIVE, f64::max);
    let (mut sse, mut n, mut off, mut n_off) = (0.0, 0usize, 0.0, 0usize);
    for (p, f) in scattered() {
        let e = ((f - p.f) / peak).powi(2);
        sse += e;
        n += 1;
        if p.gap_density == 0.0 {
            off += e;
            n_off += 1;
        }
    }
    fit.sse_e4 = sse * 1e4;
    fit.rms_e4 = (sse / n.max(1) as f64).sqrt() * 1e4;
    fit.rms_off_peak_e4 = (off / n_off.max(1) as f64).sqrt() * 1e4;
    fit.sse_metric = squares(fit, points, options.metric, floor).iter().sum();
    let k = (fit.uncertainty.rank + 1) as f64;
    let m = fit.points as f64;
    let likelihood = m * (fit.sse_metric.max(f64::MIN_POSITIVE) / m).ln();
    let correction = if m > k + 1.0 { 2.0 * k * (k + 1.0) / (m - k - 1.0) } else { f64::INFINITY };
    fit.aicc = likelihood + 2.0 * k + correction;
    fit.bic = likelihood + k * m.ln();
}

/// Squared misfits of the scattered rows in the metric, unweighted.
fn squares(fit: &ModelFit, points: &Points, metric: Metric, floor: f64) -> Vec<f64> {
    points
        .points
        .iter()
        .zip(&fit.fitted)
        .map(|(p, f)| {
            if p.direct_only {
                return 0.0;
            }
            (metric.apply(*f, floor).0 - metric.apply(p.f, floor).0).powi(2)
        })
        .collect()
}

/// Sorts by the sum of squares in the fitted metric and gives places; neighbours that the data cannot tell apart share
/// a place.
///
/// Two models tie when their AICc differ by less than 2, or when the sign of the difference of their sums of squares is not settled
/// (95 %) by resampling whole incidences; with a single incidence, points.
pub fn sort(fits: &mut [ModelFit], points: &Points, options: &Options) {
    fits.sort_by(|a, b| a.sse_metric.total_cmp(&b.sse_metric).then(a.aicc.total_cmp(&b.aicc)));
    let floor = floor_of(points, options.metric);
    let clusters = |fit: &ModelFit| -> Vec<f64> {
        let rows = squares(fit, points, options.metric, floor);
        if points.incidences.len() < 5 {
            return rows;
        }
        let mut sums = vec![0.0; points.incidences.len()];
        for (p, s) in points.points.iter().zip(rows) {
            sums[p.incidence] += s;
        }
        sums
    };
    let sums: Vec<Vec<f64>> = fits.iter().map(clusters).collect();
    let Some(n) = sums.first().map(Vec::len) else { return };
    let draws: Vec<Vec<usize>> = (0..BOOTSTRAP)
        .map(|b| {
            let draw = |i: u64| (hash(options.seed ^ 0xb007, b * n as u64 + i) % n as u64) as usize;
            (0..n as u64).map(draw).collect()
        })
        .collect();
    let totals: Vec<Vec<f64>> = sums
        .iter()
        .map(|s| draws.iter().map(|d| d.iter().map(|&i| s[i]).sum()).collect())
        .collect();
    let tie = |a: usize, b: usize| {
        let worse = totals[a].iter().zip(&totals[b]).filter(|(a, b)| a >= b).count() as f64 / BOOTSTRAP as f64;
        (fits[a].aicc - fits[b].aicc).abs() < 2.0 || (0.025..=0.975).contains(&worse)
    };
    let mut places = vec![1; fits.len()];
    // A group goes on as long as its members tie with the group's first.
    let mut first = 0;
    for i in 1..fits.len() {
        if tie(first, i) {
            places[i] = places[first];
        } else {
            first = i;
            places[i] = i + 1;
        }
    }
    let stability: Vec<f64> = (0..fits.len())
        .map(|i| {
            let keeps = |d: usize| totals.iter().filter(|t| t[d] < totals[i][d]).count() <= i;
            (0..BOOTSTRAP as usize).filter(|&d| keeps(d)).count() as f64 / BOOTSTRAP as f64
        })
        .collect();
    for (fit, (place, stability)) in fits.iter_mut().zip(places.into_iter().zip(stability)) {
        fit.place = place;
        fit.stability = stability;
    }
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
