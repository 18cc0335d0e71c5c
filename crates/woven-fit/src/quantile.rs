//! Quantiles of Student's distribution, by the incomplete beta function.

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
    let front =
        (a * x.ln() + b * (1.0 - x).ln() + ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b)).exp() / a;
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

/// Logarithm of the gamma function for positive arguments (Lanczos, g = 7, n = 9).
fn ln_gamma(x: f64) -> f64 {
    const C: [f64; 9] = [
        0.999_999_999_999_809_9,
        676.520_368_121_885_1,
        -1_259.139_216_722_402_8,
        771.323_428_777_653_1,
        -176.615_029_162_140_6,
        12.507_343_278_686_905,
        -0.138_571_095_265_720_12,
        9.984_369_578_019_572e-6,
        1.505_632_735_149_311_6e-7,
    ];
    if x < 0.5 {
        return (std::f64::consts::PI / (std::f64::consts::PI * x).sin()).ln() - ln_gamma(1.0 - x);
    }
    let x = x - 1.0;
    let t = x + 7.5;
    let sum: f64 = C[1..]
        .iter()
        .enumerate()
        .map(|(i, c)| c / (x + i as f64 + 1.0))
        .sum::<f64>()
        + C[0];
    0.5 * std::f64::consts::TAU.ln() + (x + 0.5) * t.ln() - t + sum.ln()
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
