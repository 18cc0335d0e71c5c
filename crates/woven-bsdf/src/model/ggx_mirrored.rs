//! `ggx-mirrored`: the reflection microfacet lobe mirrored through the sheet, anisotropic along the yarns.

use super::lambert::{self, K_D};
use super::{Linear, Model, Param, Shape, fold};
use crate::real::Real;
use crate::term::ggx;
use crate::vec3::Vec3;

/// See [`Model::DOC`].
pub struct GgxMirrored;

impl Model for GgxMirrored {
    const NAME: &'static str = "ggx-mirrored";
    const EQUATION: &'static str = "k_d/π + k_t D(h) G1(l) G1(v') / (4 (n·l)(n·v')), h = (l+v')/|l+v'|, v' = v mirrored back through the sheet";
    const DOC: &'static str = "Variant M: the whole hemisphere, reciprocal, peak straight through; the default lobe of a sheet. \
        Walter et al. 2007 (33), (34) used as Dai et al. 2009 use them for sheets. Loses light to masking at large alpha \
        (keeps 0.99 at 0.1, 0.59 at 0.6, normal incidence), so never more than k_d + k_t; where energy matters take `sheet`, which \
        gives it back.";
    const RECIPROCAL: bool = true;
    const PARAMS: &'static [Param] = &[
        K_D,
        Param::linear("k_t", "share of the light in the forward lobe", 1.0, 0.3),
        Param::shape(
            "alpha_x",
            "width of the lobe along the weft: 0.05 falls to half its peak 3.7° from straight through, 0.1 at 7.5°, 0.3 at 25°",
            0.01,
            1.0,
            0.15,
        )
        .log(),
        Param::shape(
            "alpha_y",
            "width of the lobe along the warp, as alpha_x",
            0.01,
            1.0,
            0.15,
        )
        .log(),
    ];

    #[inline(always)]
    fn basis<R: Real>(s: &Shape<R>, l: Vec3<R>, v: Vec3<R>) -> Linear<R> {
        let mut b = [R::zero(); 8];
        b[0] = lambert::floor(l, v);
        b[1] = fold::transmitted(l, v, ggx::lobe(fold::up(l), fold::up(v), s[0], s[1]));
        b
    }
    #[inline(always)]
    fn pdf<R: Real>(s: &Shape<R>, w: &Linear<R>, wo: Vec3<R>, wi: Vec3<R>) -> R {
        let lobe = fold::transmitted(wo, wi, ggx::pdf(fold::up(wi), fold::up(wo), s[0], s[1]));
        w[0] * lambert::pdf(wo, wi) + w[1] * lobe
    }
    #[inline(always)]
    fn sample<R: Real>(s: &Shape<R>, w: &Linear<R>, wo: Vec3<R>, u: [R; 3]) -> Vec3<R> {
        let lobe = fold::opposite(wo, ggx::sample(fold::up(wo), s[0], s[1], u[0], u[1]));
        Vec3::select(u[2].lt(w[0]), lambert::sample(wo, u[0], u[1]), lobe)
    }
}
