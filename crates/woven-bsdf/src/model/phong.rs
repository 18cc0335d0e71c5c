//! `phong`: a power of the cosine around the straight direction.

use super::lambert::{self, K_D};
use super::{Linear, Model, Param, Shape, fold};
use crate::real::Real;
use crate::term::{power, warp};
use crate::vec3::Vec3;
use std::f64::consts::PI;

/// See [`Model::DOC`].
pub struct Phong;

/// max(0, v·t)^m, from what the cosine lacks of 1: half the squared distance of v and t. Beyond 89.99° it is nothing.
#[inline(always)]
fn lobe<R: Real>(l: Vec3<R>, v: Vec3<R>, m: R) -> R {
    let lack = (l + v).length_sqr() * R::of(0.5);
    let value = power::of_one_minus(lack.min(R::one()), m);
    R::select(lack.lt(R::of(1.0 - 1e-4)), value, R::zero())
}

impl Model for Phong {
    const NAME: &'static str = "phong";
    const EQUATION: &'static str = "k_d/π + k_s (m+2)/(2π) max(0, v·t)^m, t = -l";
    const DOC: &'static str = "Phong 1975 around the straight direction, normalised as Lewis 1994 does for reflection: a light along the \
        normal gives k_s. The lobe does not widen towards grazing angles as cloth's does, and part of it falls behind the sheet \
        there: transmits at most k_d + k_s. Reciprocal. A comparison model; do not render with it.";
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
        let lobe = lobe(l, v, s[0]) * (s[0] + R::of(2.0)) * R::of(0.5 / PI);
        let mut b = [R::zero(); 8];
        b[0] = lambert::floor(l, v);
        b[1] = fold::transmitted(l, v, lobe);
        b
    }
    #[inline(always)]
    fn pdf<R: Real>(s: &Shape<R>, w: &Linear<R>, wo: Vec3<R>, wi: Vec3<R>) -> R {
        let lobe = lobe(wi, wo, s[0]) * (s[0] + R::one()) * R::of(0.5 / PI);
        w[0] * lambert::pdf(wo, wi) + w[1] * fold::transmitted(wo, wi, lobe)
    }
    #[inline(always)]
    fn sample<R: Real>(s: &Shape<R>, w: &Linear<R>, wo: Vec3<R>, u: [R; 3]) -> Vec3<R> {
        // cosθ = (1 - u)^(1/(m+1)).
        let lack = power::one_minus_exp(-(power::ln_one_minus(u[0]) / (s[0] + R::one())));
        let wi = warp::around_by(-wo, power::sine(lack), lack.one_minus(), u[1]);
        let lobe = Vec3::select(fold::transmits(wo, wi), wi, Vec3::zero());
        Vec3::select(u[2].lt(w[0]), lambert::sample(wo, u[0], u[1]), lobe)
    }
}
