//! `cook-torrance`: Beckmann facets with V-shaped grooves and Fresnel, mirrored through the sheet.

use super::lambert::{self, K_D};
use super::{Linear, Model, Param, Shape, fold};
use crate::real::Real;
use crate::term::{beckmann, fresnel};
use crate::vec3::Vec3;

/// See [`Model::DOC`].
pub struct CookTorrance;

impl Model for CookTorrance {
    const NAME: &'static str = "cook-torrance";
    const EQUATION: &'static str = "k_d/π + k_s D_Beckmann(m) G F(n, l·h) / (4 (n·l)(n·v')), \
        G = min(1, 2 n·h n·v'/(v'·h), 2 n·h n·l/(v'·h)), h = (l+v')/|l+v'|";
    const DOC: &'static str = "Cook and Torrance 1982, as the paper compares it, on (l, v'), with the denominator 4 that follows from the \
        facet geometry (the original prints π). F is exact for a dielectric of index n: 0.04 at 1.5, so k_s of a fit may well be \
        large. k_s and n are nearly one parameter at normal incidence. Reciprocal; energy at most k_s. A comparison model.";
    const RECIPROCAL: bool = true;
    const PARAMS: &'static [Param] = &[
        K_D,
        Param::linear("k_s", "strength of the lobe before Fresnel", 25.0, 5.0),
        Param::shape(
            "m",
            "rms slope of the facets: 0.1 falls to half its peak 9.7° from straight through, 0.3 at 34°",
            0.01,
            1.0,
            0.15,
        )
        .log(),
        Param::shape(
            "n",
            "refractive index: textile fibres have 1.46 to 1.72",
            1.05,
            3.0,
            1.5,
        ),
    ];

    #[inline(always)]
    fn basis<R: Real>(s: &Shape<R>, l: Vec3<R>, v: Vec3<R>) -> Linear<R> {
        let (lu, vu) = (fold::up(l), fold::up(v));
        let h = (lu + vu).normalize();
        let cos_d = lu.dot(h);
        // G/(c_l c_v) with the smaller cosine cancelled, so that grazing angles stay finite.
        let groove = h.z * R::of(2.0) / cos_d.max(R::of(1e-7));
        let (least, most) = (lu.z.min(vu.z), lu.z.max(vu.z).max(R::of(1e-7)));
        let shadow = groove.min(least.max(R::of(1e-7)).recip()) / most;
        let lobe = beckmann::d(h.z, s[0]) * shadow * fresnel::dielectric(cos_d, s[1]) * R::of(0.25);
        let mut b = [R::zero(); 8];
        b[0] = lambert::floor(l, v);
        b[1] = fold::transmitted(l, v, lobe);
        b
    }
    /// Facets are drawn with density D·cosθ (Walter 2007, (28)).
    #[inline(always)]
    fn pdf<R: Real>(s: &Shape<R>, w: &Linear<R>, wo: Vec3<R>, wi: Vec3<R>) -> R {
        let (v, l) = (fold::up(wo), fold::up(wi));
        let h = (l + v).normalize();
        let lobe = beckmann::d(h.z, s[0]) * h.z / (v.dot(h) * R::of(4.0)).max(R::of(1e-7));
        w[0] * lambert::pdf(wo, wi) + w[1] * fold::transmitted(wo, wi, lobe)
    }
    #[inline(always)]
    fn sample<R: Real>(s: &Shape<R>, w: &Linear<R>, wo: Vec3<R>, u: [R; 3]) -> Vec3<R> {
        let h = beckmann::sample(s[0], u[0], u[1]);
        let v = fold::up(wo);
        let d = v.dot(h);
        let l = h * (d * R::of(2.0)) - v;
        let lobe = Vec3::select(d.gt(R::zero()), fold::opposite(wo, l), Vec3::zero());
        Vec3::select(u[2].lt(w[0]), lambert::sample(wo, u[0], u[1]), lobe)
    }
}
