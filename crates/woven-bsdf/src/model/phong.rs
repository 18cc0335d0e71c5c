//! `phong`: a power of the cosine around the straight direction.

use super::lambert::{self, K_D};
use super::{Linear, Model, Param, Shape, fold};
use crate::real::Real;
use crate::term::warp;
use crate::vec3::Vec3;
use std::f64::consts::PI;

/// See [`Model::DOC`].
pub struct Phong;

/// max(0, v·t)^m with a floor that keeps the logarithm finite: (1e-4)^m is nothing.
#[inline(always)]
fn power<R: Real>(l: Vec3<R>, v: Vec3<R>, m: R) -> R {
    let cos = -l.dot(v);
    let value = cos.max(R::of(1e-4)).powf(m);
    R::select(cos.gt(R::of(1e-4)), value, R::zero())
}

impl Model for Phong {
    const NAME: &'static str = "phong";
    const EQUATION: &'static str = "k_d/π + k_s (m+2)/(2π) max(0, v·t)^m, t = -l";
    const DOC: &'static str = "Phong 1975 around the straight direction, normalised as Lewis 1994 does for reflection: a light along the \
        normal gives k_s. The lobe does not widen towards grazing angles as cloth's does, and part of it falls behind the sheet \
        there: transmits less than k_s, never more. Reciprocal. A comparison model; do not render with it.";
    const RECIPROCAL: bool = true;
    const PARAMS: &'static [Param] = &[
        K_D,
        Param::linear(
            "k_s",
            "share of the light in the lobe at normal incidence",
            1.0,
            0.3,
        ),
        Param::shape(
            "m",
            "exponent: 1 is broad (half at 60°), 100 falls to half at 6.7°, 10000 at 0.67°",
            1.0,
            10_000.0,
            50.0,
        )
        .log(),
    ];

    #[inline(always)]
    fn basis<R: Real>(s: &Shape<R>, l: Vec3<R>, v: Vec3<R>) -> Linear<R> {
        let lobe = power(l, v, s[0]) * (s[0] + R::of(2.0)) * R::of(0.5 / PI);
        let mut b = [R::zero(); 8];
        b[0] = lambert::floor(l, v);
        b[1] = fold::transmitted(l, v, lobe);
        b
    }
    #[inline(always)]
    fn pdf<R: Real>(s: &Shape<R>, w: &Linear<R>, wo: Vec3<R>, wi: Vec3<R>) -> R {
        let lobe = power(wi, wo, s[0]) * (s[0] + R::one()) * R::of(0.5 / PI);
        w[0] * lambert::pdf(wo, wi) + w[1] * fold::transmitted(wo, wi, lobe)
    }
    #[inline(always)]
    fn sample<R: Real>(s: &Shape<R>, w: &Linear<R>, wo: Vec3<R>, u: [R; 3]) -> Vec3<R> {
        let cos = u[0].max(R::of(1e-12)).powf((s[0] + R::one()).recip());
        let wi = warp::around(-wo, cos.clamp(0.0, 1.0), u[1]);
        let lobe = Vec3::select(fold::transmits(wo, wi), wi, Vec3::zero());
        Vec3::select(u[2].lt(w[0]), lambert::sample(wo, u[0], u[1]), lobe)
    }
}
