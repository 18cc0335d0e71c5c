//! The Henyey–Greenstein phase function.

use crate::real::Real;
use crate::term::warp;
use crate::vec3::Vec3;
use std::f64::consts::PI;

/// |g| is kept below this: at 1 the function is a delta.
pub const G_MAX: f64 = 0.999;

/// Henyey and Greenstein 1941; the paper's (2): density per steradian of scattering by the angle whose cosine is
/// `cos_theta` (1 is straight on); `g` is the mean of that cosine.
#[inline(always)]
pub fn hg<R: Real>(cos_theta: R, g: R) -> R {
    let g = g.clamp(-G_MAX, G_MAX);
    let b = (R::one() + g.sqr() - g * cos_theta * R::of(2.0)).max(R::of(1e-9));
    g.sqr().one_minus() / (b * b.sqrt() * R::of(4.0 * PI))
}

/// A direction drawn with density [`hg`] around the unit vector `axis`.
#[inline(always)]
pub fn sample<R: Real>(axis: Vec3<R>, g: R, u1: R, u2: R) -> Vec3<R> {
    let g = g.clamp(-G_MAX, G_MAX);
    let tiny = g.abs().lt(R::of(1e-3));
    let safe = R::select(tiny, R::of(1e-3), g);
    let s = safe.sqr().one_minus() / (safe.one_minus() + safe * u1 * R::of(2.0));
    let cos = R::select(
        tiny,
        u1 * R::of(2.0) - R::one(),
        (R::one() + safe.sqr() - s.sqr()) / (safe * R::of(2.0)),
    );
    warp::around(axis, cos.clamp(-1.0, 1.0), u2)
}
