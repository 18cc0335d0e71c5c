//! `paper`: half refracted, half straight through, with one width: the Woven Cloth Microfacet BSDF.

use super::ggx_walter::{self, ALPHA, INDEX};
use super::lambert::{self, K_D};
use super::{Linear, Model, Param, Shape, fold};
use crate::real::Real;
use crate::term::ggx;
use crate::vec3::Vec3;

/// See [`Model::DOC`].
pub struct Paper;

impl Model for Paper {
    const NAME: &'static str = "paper";
    const EQUATION: &'static str = "k_d/π + k_t [½ W(alpha, n) + ½ M(alpha)]";
    const DOC: &'static str = "Variant P: the paper's (4) with the gap taken apart and k_t = ρ e^-τ k_t of the print. Its L_t part is the \
        refracted lobe W of `ggx-walter`, its L_p part the straight lobe M of `ggx-mirrored`; both have the same alpha, so M is \
        about six times wider than W at n = 1.5. Not reciprocal, because W is not; transmits at most k_d + k_t. It \
        reproduces the paper; do not render with it.";
    const RECIPROCAL: bool = false;
    const PARAMS: &'static [Param] = &[
        K_D,
        Param::linear("k_t", "share of the light in both lobes together", 1.0, 0.3),
        ALPHA,
        INDEX,
    ];

    #[inline(always)]
    fn basis<R: Real>(s: &Shape<R>, l: Vec3<R>, v: Vec3<R>) -> Linear<R> {
        let straight = ggx::lobe(fold::up(l), fold::up(v), s[0], s[0]);
        let both = (ggx_walter::lobe(l, v, s[0], s[1]) + straight) * R::of(0.5);
        let mut b = [R::zero(); 8];
        b[0] = lambert::floor(l, v);
        b[1] = fold::transmitted(l, v, both);
        b
    }
    #[inline(always)]
    fn pdf<R: Real>(s: &Shape<R>, w: &Linear<R>, wo: Vec3<R>, wi: Vec3<R>) -> R {
        let straight = ggx::pdf(fold::up(wi), fold::up(wo), s[0], s[0]);
        let both = (ggx_walter::pdf(wo, wi, s[0], s[1]) + straight) * R::of(0.5);
        w[0] * lambert::pdf(wo, wi) + w[1] * fold::transmitted(wo, wi, both)
    }
    #[inline(always)]
    fn sample<R: Real>(s: &Shape<R>, w: &Linear<R>, wo: Vec3<R>, u: [R; 3]) -> Vec3<R> {
        let refracted = ggx_walter::sample(wo, s[0], s[1], u[0], u[1]);
        let straight = fold::opposite(wo, ggx::sample(fold::up(wo), s[0], s[0], u[0], u[1]));
        let lobe = Vec3::select(u[2].lt(w[0] + w[1] * R::of(0.5)), refracted, straight);
        Vec3::select(u[2].lt(w[0]), lambert::sample(wo, u[0], u[1]), lobe)
    }
}
