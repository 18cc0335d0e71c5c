//! The Beckmann distribution of facet slopes.

use crate::real::Real;
use crate::term::power;
use crate::vec3::Vec3;
use std::f64::consts::PI;

/// Beckmann D, normalised so that ∫ D cosθ dω = 1; `m` is the rms slope (Cook and Torrance 1982, Walter 2007 (25)).
#[inline(always)]
pub fn d<R: Real>(cos_h: R, m: R) -> R {
    let c2 = cos_h.max(R::of(1e-4)).sqr();
    let tan2 = c2.one_minus() / c2;
    (-(tan2 / m.sqr())).exp() / (m.sqr() * c2.sqr() * R::of(PI))
}

/// A facet normal drawn with density D·cosθ (Walter 2007, (28)).
#[inline(always)]
pub fn sample<R: Real>(m: R, u1: R, u2: R) -> Vec3<R> {
    let tan2 = -(m.sqr() * power::ln_one_minus(u1));
    let cos = (R::one() + tan2).sqrt().recip();
    let sin = tan2.sqrt_pos() * cos;
    let phi = u2 * R::of(2.0 * PI);
    Vec3::new(sin * phi.cos(), sin * phi.sin(), cos)
}
