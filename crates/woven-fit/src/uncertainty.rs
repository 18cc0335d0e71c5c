//! Error bars that are true: covariance by QR, Student intervals, numerical rank, and the invisible combinations in words.
//!
//! Near the minimum the parameters scatter with s² (JᵀJ)⁻¹, s² = SSE / (m - n). It is computed from the triangle R of a
//! QR of J and never from JᵀJ, which would square the condition number. Where columns of J depend on each other
//! some combination of parameters changes nothing that was measured: it is named, and no error bar is given for the
//! parameters in it.

use crate::linalg::{PivotedR, norm};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// Singular values of the J with unit columns below this share of the largest count as zero. Exact dependence shows
/// at 1e-15 with exact derivatives; the most correlated certified NIST problem stands above 1e-9.
const RANK_TOL: f64 = 1e-10;
/// Two parameters with a correlation beyond this are reported as seen in combination only.
pub const STRONG: f64 = 0.995;

/// What the data say about the precision of a fit.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Uncertainty {
    /// Standard error of each parameter; none where the data cannot see it or a bound holds it.
    pub standard_error: Vec<Option<f64>>,
    /// Correlations, row by row; none where an error bar is missing.
    pub correlation: Vec<Option<f64>>,
    /// Numerical rank of the Jacobian over the parameters not held by bounds.
    pub rank: usize,
    /// Number of parameters not held by bounds.
    pub free: usize,
    /// Residual degrees of freedom: points minus rank.
    pub dof: usize,
    /// Combinations of parameters that change nothing that was measured, in words.
    pub invisible: Vec<String>,
    /// Pairs of parameters that are seen only together.
    pub entangled: Vec<String>,
}

/// From the Jacobian ∂r/∂x at the minimum, column-major m×n, with the weighted sum of squares `sse` of r.
///
/// `held[j]` takes a parameter out (held by its bound). `scaled` is false when r are already in units of their true
/// standard deviations, so that s² = 1.
pub fn uncertainty(
    jac: &[f64],
    m: usize,
    names: &[&str],
    values: &[f64],
    held: &[bool],
    sse: f64,
    scaled: bool,
) -> Uncertainty {
    let n = names.len();
    let free: Vec<usize> = (0..n).filter(|&j| !held[j]).collect();
    let p = free.len();
    let mut out = Uncertainty {
        standard_error: vec![None; n],
        correlation: vec![None; n * n],
        free: p,
        ..Uncertainty::default()
    };
    if p == 0 || m == 0 {
        out.dof = m;
        return out;
    }
    // Unit columns; a column of zeros stays and is found as invisible.
    let mut unit = Vec::with_capacity(m * p);
    let lengths: Vec<f64> = free
        .iter()
        .map(|&j| {
            let column = &jac[j * m..(j + 1) * m];
            let length = norm(column);
            let d = if length > 0.0 { 1.0 / length } else { 0.0 };
            unit.extend(column.iter().map(|v| v * d));
            length
        })
        .collect();
    let qr = PivotedR::new(&unit, m, p, &vec![0.0; m]);
    let svd = DMatrix::from_column_slice(p, p, &qr.r).svd(false, true);
    let v_t = svd.v_t.expect("asked for");
    let largest = svd.singular_values.max();
    // Rows of Vᵀ in the pivoted order; tells for each singular vector its components in the original order.
    let component = |row: usize, j: usize| {
        let place = qr
            .order
            .iter()
            .position(|&o| o == j)
            .expect("a permutation");
        v_t[(row, place)]
    };
    let seen: Vec<bool> = svd
        .singular_values
        .iter()
        .map(|&s| s > RANK_TOL * largest && s > 0.0)
        .collect();
    out.rank = seen.iter().filter(|&&s| s).count();
    out.dof = m.saturating_sub(out.rank);
    let variance = if !scaled {
        1.0
    } else if out.dof > 0 {
        sse / out.dof as f64
    } else {
        return out;
    };

    // Null space in relative changes d ln x: what share each parameter has in each invisible direction.
    let hidden: Vec<usize> = (0..p).filter(|&r| !seen[r]).collect();
    let mut null: Vec<Vec<f64>> = hidden
        .iter()
        .map(|&r| {
            (0..p)
                .map(|j| {
                    if lengths[j] > 0.0 {
                        component(r, j) / lengths[j]
                    } else {
                        component(r, j)
                    }
                })
                .collect()
        })
        .collect();
    let in_null: Vec<bool> = (0..p)
        .map(|j| hidden.iter().any(|&r| component(r, j).abs() > 1e-6))
        .collect();
    reduce(&mut null);
    for direction in &null {
        out.invisible
            .push(in_words(direction, &free, names, values));
    }

    // Covariance over the unit columns.
    let covariance = if out.rank == p {
        triangle_covariance(&qr)
    } else {
        None
    };
    let covariance = covariance.unwrap_or_else(|| {
        let mut c = vec![0.0; p * p];
        for a in 0..p {
            for b in 0..p {
                c[a * p + b] = (0..p)
                    .filter(|&r| seen[r])
                    .map(|r| component(r, a) * component(r, b) / svd.singular_values[r].powi(2))
                    .sum();
            }
        }
        c
    });
    for a in 0..p {
        if in_null[a] || lengths[a] == 0.0 {
            continue;
        }
        out.standard_error[free[a]] = Some((variance * covariance[a * p + a]).sqrt() / lengths[a]);
        for b in 0..p {
            if in_null[b] || lengths[b] == 0.0 {
                continue;
            }
            let c = covariance[a * p + b] / (covariance[a * p + a] * covariance[b * p + b]).sqrt();
            out.correlation[free[a] * n + free[b]] = Some(c.clamp(-1.0, 1.0));
            if b > a && c.abs() > STRONG {
                out.entangled.push(format!(
                    "{} and {} are seen only together (correlation {c:.4})",
                    names[free[a]], names[free[b]]
                ));
            }
        }
    }
    out
}

/// (RᵀR)⁻¹ in the original column order.
fn triangle_covariance(qr: &PivotedR) -> Option<Vec<f64>> {
    let p = qr.n;
    // Columns of R⁻¹, by rows of unit vectors.
    let mut inverse = vec![0.0; p * p];
    for j in 0..p {
        let mut e = vec![0.0; p];
        e[j] = 1.0;
        crate::linalg::back_substitute(&qr.r, p, &mut e)?;
        inverse[j * p..(j + 1) * p].copy_from_slice(&e);
    }
    let mut c = vec![0.0; p * p];
    for a in 0..p {
        for b in 0..p {
            // R⁻¹R⁻ᵀ, entry (a, b) in pivoted order.
            let sum: f64 = (0..p)
                .map(|j| inverse[j * p + a] * inverse[j * p + b])
                .sum();
            c[qr.order[a] * p + qr.order[b]] = sum;
        }
    }
    Some(c)
}

/// Gauss–Jordan on the null vectors, so that each names as few parameters as possible.
fn reduce(null: &mut [Vec<f64>]) {
    let Some(p) = null.first().map(Vec::len) else {
        return;
    };
    let mut used = vec![false; p];
    for row in 0..null.len() {
        let scale = null[row].iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let pivot = (0..p)
            .filter(|&j| !used[j])
            .max_by(|&a, &b| null[row][a].abs().total_cmp(&null[row][b].abs()));
        let Some(pivot) = pivot else { return };
        if null[row][pivot].abs() <= 1e-9 * scale {
            continue;
        }
        used[pivot] = true;
        let d = null[row][pivot];
        null[row].iter_mut().for_each(|v| *v /= d);
        let source = null[row].clone();
        for (other, target) in null.iter_mut().enumerate() {
            if other != row {
                let c = target[pivot];
                target
                    .iter_mut()
                    .zip(&source)
                    .for_each(|(t, s)| *t -= c * s);
            }
        }
    }
}

/// "raising rho by 1 % while k_d -1 %, k_s -1 % changes nothing": a null direction for a reader.
fn in_words(direction: &[f64], free: &[usize], names: &[&str], values: &[f64]) -> String {
    // Relative change of each parameter; a parameter that stands at zero is told in its own units.
    let relative: Vec<f64> = direction
        .iter()
        .zip(free)
        .map(|(&d, &j)| if values[j] == 0.0 { d } else { d / values[j] })
        .collect();
    let largest = relative.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let mut terms: Vec<(usize, f64)> = relative
        .iter()
        .enumerate()
        .map(|(k, v)| (free[k], v / largest))
        .filter(|(_, v)| v.abs() > 1e-4)
        .collect();
    if terms.first().is_some_and(|(_, v)| *v < 0.0) {
        terms.iter_mut().for_each(|(_, v)| *v = -*v);
    }
    match terms.as_slice() {
        [] => "no parameter in particular".to_owned(),
        [(j, _)] => format!("{} has no effect on what was measured", names[*j]),
        many => {
            let list: Vec<String> = many
                .iter()
                .map(|(j, v)| format!("{} {:+.3} %", names[*j], v))
                .collect();
            format!("{} changes nothing that was measured", list.join(", "))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_product_is_seen_but_not_its_factors() {
        // r_i = a b t_i + c: a and b only as a product.
        let (a, b) = (2.0, 5.0);
        let t = [0.1, 0.7, 1.3, 2.0, 2.2];
        let mut jac = Vec::new();
        jac.extend(t.map(|t| b * t));
        jac.extend(t.map(|t| a * t));
        jac.extend([1.0; 5]);
        let u = uncertainty(
            &jac,
            5,
            &["a", "b", "c"],
            &[a, b, 1.0],
            &[false; 3],
            0.01,
            true,
        );
        assert_eq!((u.rank, u.free), (2, 3));
        assert_eq!(
            u.invisible,
            ["a +1.000 %, b -1.000 % changes nothing that was measured"]
        );
        assert!(u.standard_error[0].is_none() && u.standard_error[1].is_none());
        // The constant's error does not care about the product: 0.01/3 · (1/n + mean²/Sxx).
        let mean = t.iter().sum::<f64>() / 5.0;
        let sxx: f64 = t.iter().map(|t| (t - mean).powi(2)).sum();
        let want = (0.01 / 3.0 * (0.2 + mean * mean / sxx)).sqrt();
        assert!((u.standard_error[2].unwrap() - want).abs() < 1e-12);
    }
}
