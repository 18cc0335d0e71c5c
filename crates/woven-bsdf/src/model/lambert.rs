//! `lambert`: the same radiance in every direction behind the sheet.

use super::fold;
use super::{Linear, Model, Param, Shape};
use crate::real::Real;
use crate::term::warp;
use crate::vec3::Vec3;
use std::f64::consts::PI;

/// See [`Model::DOC`].
pub struct Lambert;

/// 1/π where light is transmitted, else 0: the diffuse term that all lobes stand on.
#[inline(always)]
pub(crate) fn floor<R: Real>(l: Vec3<R>, v: Vec3<R>) -> R {
    fold::transmitted(l, v, R::of(1.0 / PI))
}
/// Density of [`sample`]: |cosθ|/π on the side opposite to `wo`.
#[inline(always)]
pub(crate) fn pdf<R: Real>(wo: Vec3<R>, wi: Vec3<R>) -> R {
    fold::transmitted(wo, wi, wi.z.abs() * R::of(1.0 / PI))
}
/// A cosine-distributed direction on the side opposite to `wo`.
#[inline(always)]
pub(crate) fn sample<R: Real>(wo: Vec3<R>, u1: R, u2: R) -> Vec3<R> {
    fold::opposite(wo, warp::cosine(u1, u2))
}

/// The parameter k_d that most models carry.
pub(crate) const K_D: Param = Param::linear(
    "k_d",
    "diffuse transmittance: the flux spread evenly behind the sheet; 0.3 is a white curtain, 0.01 a dark shade",
    1.0,
    0.2,
);

impl Model for Lambert {
    const NAME: &'static str = "lambert";
    const EQUATION: &'static str = "k_d/π";
    const DOC: &'static str = "Lambert 1760. The floor of every fit: what a cloth with no structure would do. Reciprocal; transmits k_d at every \
        incidence. Not for cloth that one can see through: it has neither a peak nor a gap.";
    const RECIPROCAL: bool = true;
    const PARAMS: &'static [Param] = &[K_D];

    #[inline(always)]
    fn basis<R: Real>(_: &Shape<R>, l: Vec3<R>, v: Vec3<R>) -> Linear<R> {
        let mut b = [R::zero(); 8];
        b[0] = floor(l, v);
        b
    }
    #[inline(always)]
    fn pdf<R: Real>(_: &Shape<R>, _: &Linear<R>, wo: Vec3<R>, wi: Vec3<R>) -> R {
        pdf(wo, wi)
    }
    #[inline(always)]
    fn sample<R: Real>(_: &Shape<R>, _: &Linear<R>, wo: Vec3<R>, u: [R; 3]) -> Vec3<R> {
        sample(wo, u[0], u[1])
    }
}
