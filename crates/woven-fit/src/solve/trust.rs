//! One step inside the trust region: Newton's method on the secular equation (Moré 1978).

use crate::linalg::{
    PivotedR, back_substitute, dot, forward_substitute_transposed, norm, qr_in_place,
};

/// Minimises |A s - b| with |s| ≤ delta, A given by its pivoted QR (columns already scaled).
///
/// Returns the step, whether it is the full Gauss–Newton step, and the triangle of the (damped) system in pivoted order.
pub(super) fn trust_region_step(qr: &PivotedR, delta: f64) -> (Vec<f64>, bool, Vec<f64>) {
    let n = qr.n;
    let full_rank = qr.rank(1e-15) == n;
    let mut lower = 0.0;
    if full_rank && let Some(s) = qr.solve() {
        let length = norm(&s);
        if length <= 1.1 * delta {
            return (s, true, qr.r.clone());
        }
        // Slope of the secular function at 0 gives a lower bound of the multiplier.
        let mut w: Vec<f64> = qr.order.iter().map(|&j| s[j] / length).collect();
        if forward_substitute_transposed(&qr.r, n, &mut w).is_some() {
            lower = (length - delta) / (delta * dot(&w, &w));
        }
    }
    // g = Rᵀ qtb; |g| / delta bounds the multiplier from above.
    let g: Vec<f64> = (0..n)
        .map(|j| dot(&qr.r[j * n..=j * n + j], &qr.qtb[..=j]))
        .collect();
    let g_length = norm(&g);
    if g_length == 0.0 {
        return (vec![0.0; n], false, qr.r.clone());
    }
    let mut upper = g_length / delta;
    let mut lambda = if lower > 0.0 { lower } else { 1e-3 * upper };
    let mut best = vec![0.0; n];
    let mut last = qr.r.clone();
    for _ in 0..12 {
        if !(lambda > lower && lambda < upper) {
            lambda = (1e-3 * upper).max((lower * upper).sqrt());
        }
        let (y, triangle) = damped_solve(qr, lambda);
        let length = norm(&y);
        best = y;
        last = triangle;
        if (length - delta).abs() <= 0.1 * delta || !length.is_finite() {
            break;
        }
        let mut w: Vec<f64> = best.iter().map(|v| v / length).collect();
        if forward_substitute_transposed(&last, n, &mut w).is_none() {
            break;
        }
        let newton = (length - delta) / (delta * dot(&w, &w));
        if length > delta {
            lower = lower.max(lambda);
        } else {
            upper = upper.min(lambda);
        }
        lambda = (lambda + newton).max(lower);
    }
    (qr.unpermute(&best), false, last)
}

/// Solves min |R y - qtb|² + λ|y|² in pivoted order; also the triangle of the augmented system.
fn damped_solve(qr: &PivotedR, lambda: f64) -> (Vec<f64>, Vec<f64>) {
    let n = qr.n;
    let rows = 2 * n;
    let mut a = vec![0.0; rows * (n + 1)];
    for j in 0..n {
        a[j * rows..=j * rows + j].copy_from_slice(&qr.r[j * n..=j * n + j]);
        a[j * rows + n + j] = lambda.sqrt();
    }
    a[n * rows..n * rows + n].copy_from_slice(&qr.qtb);
    qr_in_place(&mut a, rows, n, n + 1);
    let mut triangle = vec![0.0; n * n];
    for j in 0..n {
        triangle[j * n..=j * n + j].copy_from_slice(&a[j * rows..=j * rows + j]);
    }
    let mut y = a[n * rows..n * rows + n].to_vec();
    if back_substitute(&triangle, n, &mut y).is_none() {
        y.fill(0.0);
    }
    (y, triangle)
}
