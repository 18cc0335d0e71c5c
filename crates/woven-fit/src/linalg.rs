//! Small dense linear algebra for least squares: Householder QR, triangular solves, non-negative least squares.
//!
//! Matrices are column-major slices. The systems here have up to tens of thousands of rows and at most a
//! dozen columns, so plain loops over columns are as fast as anything and always give the same bytes.

#![expect(
    clippy::needless_range_loop,
    reason = "matrix indices read like the algorithms' papers"
)]

/// Dot product with eight running sums: fast, and the same bits for the same input.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (ca, cb) = (a.chunks_exact(8), b.chunks_exact(8));
    let tail: f64 = ca
        .remainder()
        .iter()
        .zip(cb.remainder())
        .map(|(x, y)| x * y)
        .sum();
    for (x, y) in ca.zip(cb) {
        for k in 0..8 {
            sums[k] += x[k] * y[k];
        }
    }
    let [s0, s1, s2, s3, s4, s5, s6, s7] = sums;
    ((s0 + s4) + (s1 + s5)) + ((s2 + s6) + (s3 + s7)) + tail
}

/// Euclidean norm; scaled when the plain sum of squares would leave the range of f64.
pub fn norm(a: &[f64]) -> f64 {
    let plain = dot(a, a);
    if plain.is_finite() && plain > 1e-280 {
        return plain.sqrt();
    }
    let largest = a.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    if largest == 0.0 || !largest.is_finite() {
        return if a.iter().any(|v| v.is_nan()) {
            f64::NAN
        } else {
            largest
        };
    }
    let sum: f64 = a.iter().map(|v| (v / largest) * (v / largest)).sum();
    largest * sum.sqrt()
}

/// Householder QR of the first `n` columns of the `rows`×`cols` matrix `a`, in place.
///
/// Columns `n..cols` are multiplied by Qᵀ. Below the diagonal the first `n` columns hold rubbish afterwards;
/// the upper triangle is R.
pub fn qr_in_place(a: &mut [f64], rows: usize, n: usize, cols: usize) {
    for k in 0..n.min(rows) {
        let (head, tail) = a.split_at_mut((k + 1) * rows);
        let v = &mut head[k * rows + k..];
        let alpha = norm(v);
        if alpha == 0.0 {
            continue;
        }
        let alpha = if v[0] > 0.0 { -alpha } else { alpha };
        // v = x - alpha e1; H = I - v vᵀ / (-alpha v0).
        v[0] -= alpha;
        let scale = -1.0 / (alpha * v[0]);
        for column in tail.chunks_exact_mut(rows).take(cols - k - 1) {
            let column = &mut column[k..];
            let factor = dot(v, column) * scale;
            for (c, h) in column.iter_mut().zip(v.iter()) {
                *c -= factor * h;
            }
        }
        v[0] = alpha;
    }
}

/// An upper triangular factor with its column permutation, from a column-pivoted QR.
#[derive(Clone, Debug)]
pub struct PivotedR {
    /// n×n column-major; only the upper triangle has a meaning.
    pub r: Vec<f64>,
    /// `order[k]` is the original column that stands at place k.
    pub order: Vec<usize>,
    /// First n entries of Qᵀ times the right-hand side.
    pub qtb: Vec<f64>,
    /// Number of columns n.
    pub n: usize,
}

impl PivotedR {
    /// Column-pivoted QR of the `rows`×`n` matrix `a`; `b` has `rows` entries. Rows may be fewer than columns.
    pub fn new(a: &[f64], rows: usize, n: usize, b: &[f64]) -> Self {
        // Pad with zero rows, so that the triangle below is always square.
        let padded = rows.max(n);
        let mut work = vec![0.0; padded * (n + 1)];
        for j in 0..n {
            work[j * padded..j * padded + rows].copy_from_slice(&a[j * rows..(j + 1) * rows]);
        }
        work[n * padded..n * padded + rows].copy_from_slice(b);
        let rows = padded;
        let mut order: Vec<usize> = (0..n).collect();
        for k in 0..n {
            let length = |j: usize| norm(&work[j * rows + k..(j + 1) * rows]);
            let mut best = (k, length(k));
            for j in k + 1..n {
                let l = length(j);
                if l > best.1 {
                    best = (j, l);
                }
            }
            if best.0 != k {
                order.swap(k, best.0);
                let (left, right) = work.split_at_mut(best.0 * rows);
                left[k * rows..(k + 1) * rows].swap_with_slice(&mut right[..rows]);
            }
            // One Householder step on the columns k.. (the slice trick keeps `qr_in_place` single-purpose).
            let (head, tail) = work.split_at_mut((k + 1) * rows);
            let v = &mut head[k * rows + k..];
            let alpha = norm(v);
            if alpha == 0.0 {
                continue;
            }
            let alpha = if v[0] > 0.0 { -alpha } else { alpha };
            v[0] -= alpha;
            let scale = -1.0 / (alpha * v[0]);
            for column in tail.chunks_exact_mut(rows) {
                let column = &mut column[k..];
                let factor = dot(v, column) * scale;
                for (c, h) in column.iter_mut().zip(v.iter()) {
                    *c -= factor * h;
                }
            }
            v[0] = alpha;
        }
        let mut r = vec![0.0; n * n];
        for j in 0..n {
            for i in 0..=j {
                r[j * n + i] = work[j * rows + i];
            }
        }
        let qtb = work[n * rows..n * rows + n].to_vec();
        Self { r, order, qtb, n }
    }

    /// Number of columns that stand out of the noise: abs(R_kk) > `tol`·abs(R_00).
    pub fn rank(&self, tol: f64) -> usize {
        let first = self.r.first().map_or(0.0, |v| v.abs());
        (0..self.n)
            .take_while(|&k| {
                let d = self.r[k * self.n + k].abs();
                d > tol * first && d > 0.0
            })
            .count()
    }

    /// Least-squares solution of A x = b, in the original column order; `None` when a diagonal entry is zero.
    pub fn solve(&self) -> Option<Vec<f64>> {
        let mut y = self.qtb.clone();
        back_substitute(&self.r, self.n, &mut y)?;
        Some(self.unpermute(&y))
    }

    /// Puts a vector in pivoted order back into the original one.
    pub fn unpermute(&self, y: &[f64]) -> Vec<f64> {
        let mut x = vec![0.0; self.n];
        for (k, &j) in self.order.iter().enumerate() {
            x[j] = y[k];
        }
        x
    }
}

/// Solves R y = b in place for an upper triangular n×n column-major R; `None` for a zero on the diagonal.
pub fn back_substitute(r: &[f64], n: usize, b: &mut [f64]) -> Option<()> {
    for k in (0..n).rev() {
        let d = r[k * n + k];
        if d == 0.0 {
            return None;
        }
        b[k] /= d;
        let bk = b[k];
        for i in 0..k {
            b[i] -= r[k * n + i] * bk;
        }
    }
    Some(())
}

/// Solves Rᵀ y = b in place for an upper triangular n×n column-major R; `None` for a zero on the diagonal.
pub fn forward_substitute_transposed(r: &[f64], n: usize, b: &mut [f64]) -> Option<()> {
    for k in 0..n {
        let d = r[k * n + k];
        if d == 0.0 {
            return None;
        }
        let s = dot(&r[k * n..k * n + k], &b[..k]);
        b[k] = (b[k] - s) / d;
    }
    Some(())
}

/// Non-negative least squares, min |A x - b| with x ≥ 0: Lawson and Hanson 1974, chapter 23.
///
/// Takes the triangle of a QR of the columns (`r`, n×n) and Qᵀb, so its cost does not grow with the rows.
/// Returns x and the set of positive entries. Deterministic; ends after at most 3n exchanges.
pub fn nnls_triangular(r: &[f64], n: usize, qtb: &[f64]) -> (Vec<f64>, Vec<bool>) {
    let column = |j: usize| &r[j * n..(j + 1) * n];
    let mut x = vec![0.0; n];
    let mut passive = vec![false; n];
    // A column is judged dependent or useless relative to these scales.
    let scale_b = norm(qtb);
    for _ in 0..3 * n + 3 {
        // w = Aᵀ(b - A x), scaled per column so that units do not matter.
        let mut residual = qtb.to_vec();
        for j in 0..n {
            for i in 0..n {
                residual[i] -= column(j)[i] * x[j];
            }
        }
        let mut enter: Option<(usize, f64)> = None;
        for j in 0..n {
            let length = norm(column(j));
            if passive[j] || length == 0.0 {
                continue;
            }
            let w = dot(column(j), &residual) / length;
            if w > 1e-14 * scale_b && enter.is_none_or(|(_, best)| w > best) {
                enter = Some((j, w));
            }
        }
        let Some((j, _)) = enter else { break };
        passive[j] = true;
        loop {
            let set: Vec<usize> = (0..n).filter(|&k| passive[k]).collect();
            let mut sub = Vec::with_capacity(set.len() * n);
            for &k in &set {
                sub.extend_from_slice(column(k));
            }
            let qr = PivotedR::new(&sub, n, set.len(), qtb);
            let solution = (qr.rank(1e-13) == set.len()).then(|| qr.solve()).flatten();
            let Some(s) = solution else {
                // The new column depends on those already in: leave it out for good.
                passive[j] = false;
                return (x, passive);
            };
            if s.iter().all(|&v| v > 0.0) {
                x.fill(0.0);
                for (&k, &v) in set.iter().zip(&s) {
                    x[k] = v;
                }
                break;
            }
            // Walk from x towards s until the first entry reaches zero, and drop it.
            let mut alpha = 1.0_f64;
            for (&k, &v) in set.iter().zip(&s) {
                if v <= 0.0 {
                    alpha = alpha.min(x[k] / (x[k] - v));
                }
            }
            for (&k, &v) in set.iter().zip(&s) {
                x[k] += alpha * (v - x[k]);
                if v <= 0.0 && x[k] <= 1e-15 * (v.abs() + f64::MIN_POSITIVE) || x[k] <= 0.0 {
                    x[k] = 0.0;
                    passive[k] = false;
                }
            }
            if set.iter().all(|&k| passive[k]) {
                // Rounding kept everything above zero: drop the smallest to be sure of progress.
                if let Some(&k) = set.iter().min_by(|&&a, &&b| x[a].total_cmp(&x[b])) {
                    x[k] = 0.0;
                    passive[k] = false;
                }
            }
        }
    }
    (x, passive)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn qr_solves_a_hilbert_like_system() {
        let (rows, n) = (7, 3);
        let a: Vec<f64> = (0..rows * n)
            .map(|i| 1.0 / ((i % rows) as f64 + (i / rows) as f64 + 1.0))
            .collect();
        let truth = [1.0, -2.0, 3.0];
        let b: Vec<f64> = (0..rows)
            .map(|i| (0..n).map(|j| a[j * rows + i] * truth[j]).sum())
            .collect();
        let x = PivotedR::new(&a, rows, n, &b).solve().unwrap();
        for (found, want) in x.iter().zip(truth) {
            // Condition number about 5e2 times machine epsilon, with room.
            assert!((found - want).abs() < 1e-11, "{x:?}");
        }
    }

    #[test]
    fn rank_of_a_repeated_column_is_seen() {
        let a = [1.0, 2.0, 3.0, 2.0, 4.0, 6.0, 1.0, 0.0, 0.0];
        assert_eq!(PivotedR::new(&a, 3, 3, &[0.0; 3]).rank(1e-12), 2);
    }

    #[test]
    fn nnls_meets_its_optimality_conditions() {
        let mut seed = 1u64;
        let mut random = || {
            seed = seed
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        for _ in 0..200 {
            let (rows, n) = (12, 5);
            let mut a: Vec<f64> = (0..rows * n).map(|_| random()).collect();
            let b: Vec<f64> = (0..rows).map(|_| random()).collect();
            let original = a.clone();
            a.extend_from_slice(&b);
            qr_in_place(&mut a, rows, n, n + 1);
            let mut r = vec![0.0; n * n];
            for j in 0..n {
                r[j * n..=j * n + j].copy_from_slice(&a[j * rows..=j * rows + j]);
            }
            let (x, passive) = nnls_triangular(&r, n, &a[n * rows..n * rows + n]);
            let residual: Vec<f64> = (0..rows)
                .map(|i| b[i] - (0..n).map(|j| original[j * rows + i] * x[j]).sum::<f64>())
                .collect();
            for j in 0..n {
                let w = dot(&original[j * rows..(j + 1) * rows], &residual);
                assert!(x[j] >= 0.0);
                // Kuhn-Tucker: no gain left in a direction that is allowed.
                if passive[j] {
                    assert!(w.abs() < 1e-12, "{w}");
                } else {
                    assert!(w < 1e-12, "{w}");
                }
            }
        }
    }
}
