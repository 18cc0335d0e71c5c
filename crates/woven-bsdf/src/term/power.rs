//! Powers and logarithms near 1, for lobes so narrow that the rounding of a cosine, raised to a power, shows.
//!
//! A cosine near 1 is kept as what it lacks, x = 1 - cosθ, which single precision holds to seven digits however small
//! it is; and its logarithm is a series, because the logarithm of a GPU is exact to some 1e-7 of 1, not of itself: to the
//! power of 10,000 that is a thousandth.

use crate::real::Real;

/// ln(1 - x) for 0 ≤ x ≤ 1, kept finite at 1: -2 artanh(x/(2-x)), eight terms below 0.2 (to 1e-16 of itself).
#[inline(always)]
pub fn ln_one_minus<R: Real>(x: R) -> R {
    let z = x / (R::of(2.0) - x);
    let q = z.sqr();
    let mut sum = R::of(1.0 / 15.0);
    for k in (0..7).rev() {
        sum = sum * q + R::of(1.0 / f64::from(2 * k + 1));
    }
    let far = x.one_minus().max(R::of(1e-12)).ln();
    R::select(x.lt(R::of(0.2)), -(z * sum * R::of(2.0)), far)
}

/// (1 - x)^e for 0 ≤ x ≤ 1.
#[inline(always)]
pub fn of_one_minus<R: Real>(x: R, e: R) -> R {
    (ln_one_minus(x) * e).exp()
}

/// 1 - exp(-t) for t ≥ 0: by its series below 0.1 (to 1e-12 of itself).
#[inline(always)]
pub fn one_minus_exp<R: Real>(t: R) -> R {
    let mut sum = R::one();
    for k in (2..9).rev() {
        sum = (t * sum * R::of(1.0 / f64::from(k))).one_minus();
    }
    R::select(t.lt(R::of(0.1)), t * sum, (-t).exp().one_minus())
}

/// Sine of the angle whose cosine is 1 - x.
#[inline(always)]
pub fn sine<R: Real>(x: R) -> R {
    (x * (R::of(2.0) - x)).sqrt_pos()
}
