//! The GGX distribution, its masking, and a sampler of its visible normals.

use crate::real::Real;
use crate::term::power;
use crate::vec3::Vec3;
use std::f64::consts::PI;

/// Anisotropic GGX normal distribution: Walter et al. 2007, (33), the paper's (8) corrected (θ_h between n and h, and
/// an α² on top), stretched by `ax` along x and `ay` along y. ∫ D cosθ dω = 1.
///
/// α = 0.05 is a narrow peak of a few degrees, 0.3 to 0.7 are very broad.
#[inline(always)]
pub fn d<R: Real>(h: Vec3<R>, ax: R, ay: R) -> R {
    let e = (h.x / ax).sqr() + (h.y / ay).sqr() + h.z.sqr();
    (ax * ay * e.sqr() * R::of(PI)).max(R::of(1e-30)).recip()
}

/// Smith masking for one direction: Walter et al. 2007, (34); the paper's (6) with tanθ of `w` itself.
#[inline(always)]
pub fn g1<R: Real>(w: Vec3<R>, ax: R, ay: R) -> R {
    let t = ((w.x * ax).sqr() + (w.y * ay).sqr()) / w.z.sqr().max(R::of(1e-12));
    R::of(2.0) / (R::one() + (R::one() + t).sqrt())
}

/// The mirrored lobe M(l, v') without Fresnel: D G1(l) G1(v') / (4 (n·l)(n·v')), both arguments with z > 0.
/// Straight through the sheet for transmission when `v'` is the viewer mirrored back; the reflection lobe otherwise.
#[inline(always)]
pub fn lobe<R: Real>(l: Vec3<R>, v: Vec3<R>, ax: R, ay: R) -> R {
    let h = (l + v).normalize();
    d(h, ax, ay) * g1(l, ax, ay) * g1(v, ax, ay) / (l.z * v.z * R::of(4.0)).max(R::of(1e-7))
}

/// Density of [`sample`] per solid angle: D G1(v) / (4 (n·v)).
#[inline(always)]
pub fn pdf<R: Real>(l: Vec3<R>, v: Vec3<R>, ax: R, ay: R) -> R {
    let h = (l + v).normalize();
    d(h, ax, ay) * g1(v, ax, ay) / (v.z * R::of(4.0)).max(R::of(1e-7))
}

/// A normal visible from `v` (z > 0), density D G1(v) (v·h)/(n·v); spherical caps after Dupuy and Benyoub 2023.
#[inline(always)]
pub fn visible_normal<R: Real>(v: Vec3<R>, ax: R, ay: R, u1: R, u2: R) -> Vec3<R> {
    let std = Vec3::new(v.x * ax, v.y * ay, v.z).normalize();
    let phi = u1 * R::of(2.0 * PI);
    // z = (1 - u2)(1 + std.z) - std.z, and its sine from what it lacks of 1, which keeps its digits.
    let lack = u2 * (R::one() + std.z);
    let z = lack.one_minus();
    let sin = power::sine(lack);
    let cap = Vec3::new(sin * phi.cos(), sin * phi.sin(), z) + std;
    Vec3::new(cap.x * ax, cap.y * ay, cap.z.max(R::of(1e-6))).normalize()
}

/// Mirrors `v` (z > 0) at a [`visible_normal`]. May point below z = 0.
#[inline(always)]
pub fn sample<R: Real>(v: Vec3<R>, ax: R, ay: R, u1: R, u2: R) -> Vec3<R> {
    let h = visible_normal(v, ax, ay, u1, u2);
    h * (v.dot(h) * R::of(2.0)) - v
}
