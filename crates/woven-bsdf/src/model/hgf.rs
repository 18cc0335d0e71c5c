//! `hgf`: two Henyey–Greenstein lobes and a floor, the paper's Woven Cloth HGF.

use super::lambert;
use super::{Linear, Model, Param, Shape, fold};
use crate::real::Real;
use crate::term::hg;
use crate::vec3::Vec3;

/// See [`Model::DOC`].
pub struct Hgf;

impl Model for Hgf {
    const NAME: &'static str = "hgf";
    const EQUATION: &'static str = "a_d HG(g_d) + a_s HG(g_s) + c/π, HG(g) = (1-g²)/(4π(1+g²-2g cosθ)^1.5), θ between v and -l";
    const DOC: &'static str = "The paper's (3) with the gap taken apart: a_d = ρ e^-τ k_d, a_s = ρ e^-τ k_s, which is all that a \
        measurement can see. Reciprocal; not bounded in energy (a phase function has no cosine: at grazing incidence more \
        may leave than came); transmission only. For comparison with the paper and for fits; do not render with it.";
    const RECIPROCAL: bool = true;
    const PARAMS: &'static [Param] = &[
        Param::linear("a_d", "strength of the broad lobe", 4.0, 0.3),
        Param::shape(
            "g_d",
            "mean cosine of the broad lobe: 0 even, 0.3 falls to half its peak at 59°, 1 straight on",
            0.0,
            0.95,
            0.3,
        ),
        Param::linear("a_s", "strength of the narrow lobe", 4.0, 0.3),
        Param::shape(
            "g_s",
            "mean cosine of the narrow lobe: 0.9 falls to half its peak at 4.6°, 0.99 at 0.44°",
            0.3,
            hg::G_MAX,
            0.9,
        ),
        Param::linear("c", "diffuse floor", 1.0, 0.05),
    ];

    #[inline(always)]
    fn basis<R: Real>(s: &Shape<R>, l: Vec3<R>, v: Vec3<R>) -> Linear<R> {
        let cos = -l.dot(v);
        let mut b = [R::zero(); 8];
        b[0] = fold::transmitted(l, v, hg::hg(cos, s[0]));
        b[1] = fold::transmitted(l, v, hg::hg(cos, s[1]));
        b[2] = lambert::floor(l, v);
        b
    }
    #[inline(always)]
    fn pdf<R: Real>(s: &Shape<R>, w: &Linear<R>, wo: Vec3<R>, wi: Vec3<R>) -> R {
        let cos = -wo.dot(wi);
        let lobes = w[0] * hg::hg(cos, s[0]) + w[1] * hg::hg(cos, s[1]);
        fold::transmitted(wo, wi, lobes) + w[2] * lambert::pdf(wo, wi)
    }
    #[inline(always)]
    fn sample<R: Real>(s: &Shape<R>, w: &Linear<R>, wo: Vec3<R>, u: [R; 3]) -> Vec3<R> {
        let g = R::select(u[2].lt(w[0]), s[0], s[1]);
        let wi = hg::sample(-wo, g, u[0], u[1]);
        let lobe = Vec3::select(fold::transmits(wo, wi), wi, Vec3::zero());
        Vec3::select(u[2].lt(w[0] + w[1]), lobe, lambert::sample(wo, u[0], u[1]))
    }
}
