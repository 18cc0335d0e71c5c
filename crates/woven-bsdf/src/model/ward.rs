//! `ward`: Ward's anisotropic Gaussian lobe mirrored through the sheet.

use super::lambert::{self, K_D};
use super::{Linear, Model, Param, Shape, fold};
use crate::real::Real;
use crate::vec3::Vec3;
use std::f64::consts::PI;

/// See [`Model::DOC`].
pub struct Ward;

/// tan² of the angle of h against n, weighed by the widths along x and y.
#[inline(always)]
fn exponent<R: Real>(h: Vec3<R>, ax: R, ay: R) -> R {
    ((h.x / ax).sqr() + (h.y / ay).sqr()) / h.z.sqr().max(R::of(1e-8))
}

impl Model for Ward {
    const NAME: &'static str = "ward";
    const EQUATION: &'static str =
        "k_d/π + k_s/(4π a_x a_y √((n·l)(n·v'))) exp(-tan²δ (cos²φ_h/a_x² + sin²φ_h/a_y²))";
    const DOC: &'static str = "Ward 1992, as the paper compares it, on (l, v'). A Gaussian in the angle: it misses long tails. \
        Reciprocal; transmits about k_d + k_s along the normal, but grows without bound at grazing angles, so render with \
        `ggx-mirrored` instead.";
    const RECIPROCAL: bool = true;
    const PARAMS: &'static [Param] = &[
        K_D,
        Param::linear("k_s", "share of the light in the lobe", 1.0, 0.3),
        Param::shape("a_x", "rms slope along the weft: 0.1 falls to half its peak 9.6° from straight through, 0.3 at 29°", 0.01, 1.0, 0.15).log(),
        Param::shape("a_y", "rms slope along the warp, as a_x", 0.01, 1.0, 0.15).log(),
    ];

    #[inline(always)]
    fn basis<R: Real>(s: &Shape<R>, l: Vec3<R>, v: Vec3<R>) -> Linear<R> {
        let (lu, vu) = (fold::up(l), fold::up(v));
        let h = (lu + vu).normalize();
        let norm = s[0] * s[1] * (lu.z * vu.z).max(R::of(1e-8)).sqrt() * R::of(4.0 * PI);
        let mut b = [R::zero(); 8];
        b[0] = lambert::floor(l, v);
        b[1] = fold::transmitted(l, v, (-exponent(h, s[0], s[1])).exp() / norm);
        b
    }
    /// Ward 1992, (8) and (9): the half vector is drawn from the Gaussian of slopes.
    #[inline(always)]
    fn pdf<R: Real>(s: &Shape<R>, w: &Linear<R>, wo: Vec3<R>, wi: Vec3<R>) -> R {
        let (v, l) = (fold::up(wo), fold::up(wi));
        let h = (l + v).normalize();
        let density = (-exponent(h, s[0], s[1])).exp()
            / (s[0] * s[1] * (h.z.sqr() * h.z).max(R::of(1e-9)) * R::of(PI));
        let lobe = density / (v.dot(h) * R::of(4.0)).max(R::of(1e-7));
        w[0] * lambert::pdf(wo, wi) + w[1] * fold::transmitted(wo, wi, lobe)
    }
    #[inline(always)]
    fn sample<R: Real>(s: &Shape<R>, w: &Linear<R>, wo: Vec3<R>, u: [R; 3]) -> Vec3<R> {
        let r = (-(u[0].one_minus().max(R::of(1e-12)).ln())).sqrt_pos();
        let phi = u[1] * R::of(2.0 * PI);
        let h = Vec3::new(s[0] * r * phi.cos(), s[1] * r * phi.sin(), R::one()).normalize();
        let v = fold::up(wo);
        let d = v.dot(h);
        let l = h * (d * R::of(2.0)) - v;
        let lobe = Vec3::select(d.gt(R::zero()), fold::opposite(wo, l), Vec3::zero());
        Vec3::select(u[2].lt(w[0]), lambert::sample(wo, u[0], u[1]), lobe)
    }
}
