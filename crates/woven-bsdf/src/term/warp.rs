//! From the unit square to directions.

use crate::real::Real;
use crate::term::power;
use crate::vec3::Vec3;
use std::f64::consts::PI;

/// A direction of the upper hemisphere with density cosθ/π, from two numbers in [0, 1).
#[inline(always)]
pub fn cosine<R: Real>(u1: R, u2: R) -> Vec3<R> {
    let r = u1.pos().sqrt_pos();
    let phi = u2 * R::of(2.0 * PI);
    Vec3::new(r * phi.cos(), r * phi.sin(), u1.one_minus().sqrt_pos())
}

/// A direction of the upper hemisphere with density 1/2π: all of them alike.
#[inline(always)]
pub fn even<R: Real>(u1: R, u2: R) -> Vec3<R> {
    let phi = u2 * R::of(2.0 * PI);
    // z = 1 - u1, its sine from what it lacks of 1.
    let r = power::sine(u1);
    Vec3::new(r * phi.cos(), r * phi.sin(), u1.one_minus())
}

/// The direction at the angle with cosine `cos` from the unit vector `axis`, turned by `u` of a full turn about it.
#[inline(always)]
pub fn around<R: Real>(axis: Vec3<R>, cos: R, u: R) -> Vec3<R> {
    around_by(axis, cos.sqr().one_minus().sqrt_pos(), cos, u)
}

/// [`around`] for an angle of which sine and cosine are known.
#[inline(always)]
pub fn around_by<R: Real>(axis: Vec3<R>, sin: R, cos: R, u: R) -> Vec3<R> {
    let phi = u * R::of(2.0 * PI);
    let (x, y) = (sin * phi.cos(), sin * phi.sin());
    // Frame about the axis after Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
    let sign = R::select(axis.z.lt(R::zero()), R::of(-1.0), R::one());
    let a = -(sign + axis.z).recip();
    let b = axis.x * axis.y * a;
    let t = Vec3::new(
        R::one() + sign * axis.x.sqr() * a,
        sign * b,
        -(sign * axis.x),
    );
    let s = Vec3::new(b, sign + axis.y.sqr() * a, -axis.y);
    t * x + s * y + axis * cos
}
