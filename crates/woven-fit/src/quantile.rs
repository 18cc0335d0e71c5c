//! Quantiles of Student's distribution, by the incomplete beta function.

use libm::lgamma;

/// Two-sided Student quantile: half-width of the interval of coverage `level`, in standard errors.
pub fn student(level: f64, dof: usize) -> f64 {
    if dof == 0 {
        return f64::INFINITY;
    }
    let nu = dof as f64;
    // P(|t| > x) = I_{ν/(ν+x²)}(ν/2, 1/2); bisection on x.
    let tail = |x: f64| incomplete_beta(nu / (nu + x * x), 0.5 * nu, 0.5);
    let (mut lo, mut hi) = (0.0, 2.0);
    while tail(hi) > 1.0 - level && hi < 1e12 {
        hi *= 2.0;
    }
    for _ in 0..100 {
        let mid = 0.5 * (lo + hi);
        if tail(mid) > 1.0 - level {
            lo = mid
        } else {
            hi = mid
        }
    }
    0.5 * (lo + hi)
}

/// Upper quantile of F with (1, dof) degrees of freedom at coverage `level`: the square of [`student`].
pub fn fisher_one(level: f64, dof: usize) -> f64 {
    student(level, dof).powi(2)
}

/// Regularised incomplete beta function by its continued fraction (Lentz; Press et al., 6.4).
pub fn incomplete_beta(x: f64, a: f64, b: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    if x >= 1.0 {
        return 1.0;
    }
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - incomplete_beta(1.0 - x, b, a);
    }
    let front = (a * x.ln() + b * (1.0 - x).ln() + lgamma(a + b) - lgamma(a) - lgamma(b)).exp() / a;
    let guard = |v: f64| if v.abs() < 1e-300 { 1e-300 } else { v };
    let (mut c, mut d) = (1.0, 1.0 / guard(1.0 - (a + b) * x / (a + 1.0)));
    let mut f = d;
    for m in 1..400 {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        for step in [even, odd] {
            d = 1.0 / guard(1.0 + step * d);
            c = guard(1.0 + step / c);
            f *= c * d;
        }
        if (c * d - 1.0).abs() < 1e-15 {
            break;
        }
    }
    front * f
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn student_quantiles_are_those_of_the_tables() {
        // Abramowitz and Stegun, table 26.10, and the normal limit.
        for (level, dof, want) in [
            (0.95, 1, 12.7062),
            (0.95, 10, 2.2281),
            (0.99, 5, 4.0321),
            (0.95, 100_000, 1.95999),
        ] {
            assert!(
                (student(level, dof) - want).abs() < 1e-4,
                "{level} {dof} {}",
                student(level, dof)
            );
        }
    }
}
