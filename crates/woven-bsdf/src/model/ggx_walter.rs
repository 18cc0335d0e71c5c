//! `ggx-walter`: refraction at one rough interface, the literature's GGX transmission lobe.

use super::lambert::{self, K_D};
use super::{Linear, Model, Param, Shape, fold};
use crate::real::Real;
use crate::term::{fresnel, ggx};
use crate::vec3::Vec3;

/// See [`Model::DOC`].
pub struct GgxWalter;

/// Width of the facets' slopes.
pub(crate) const ALPHA: Param = Param::shape(
    "alpha",
    "width of the facets' slopes; at n = 1.5, 0.1 falls to half its peak 1.2° from the refracted direction, 0.3 at 3.7°; \
     two interfaces (slab): 3.1° and 8.5°",
    0.02,
    1.0,
    0.2,
)
.log();
/// Refractive index.
pub(crate) const INDEX: Param = Param::shape(
    "n",
    "refractive index behind the light's side: textile fibres have 1.46 to 1.72",
    1.1,
    3.0,
    1.5,
);

/// The facet that refracts `l` (z > 0, index 1) into `v` (z < 0, index `n`): -(l + n v)/|…|, which points to l's side.
#[inline(always)]
pub(crate) fn half<R: Real>(l: Vec3<R>, v: Vec3<R>, n: R) -> Vec3<R> {
    -(l + v * n).normalize()
}

/// `w` seen with `l` above: z turned round when the light is below, because the sheet has no preferred side.
#[inline(always)]
pub(crate) fn upright<R: Real>(l: Vec3<R>, w: Vec3<R>) -> Vec3<R> {
    Vec3::new(w.x, w.y, R::select(l.z.lt(R::zero()), -w.z, w.z))
}

/// Walter et al. 2007, (21), the paper's (5): outer cosines absolute, those of the denominator signed.
#[inline(always)]
pub(crate) fn lobe<R: Real>(l: Vec3<R>, v: Vec3<R>, alpha: R, n: R) -> R {
    let (l, v) = (upright(l, l), upright(l, v));
    let h = half(l, v, n);
    let (lh, vh) = (l.dot(h), v.dot(h));
    let den = lh + n * vh;
    let outer = (lh * vh).abs() / (l.z * v.z).abs().max(R::of(1e-7));
    let shadow = ggx::g1(l, alpha, alpha) * ggx::g1(v, alpha, alpha);
    let pass = fresnel::dielectric(lh.abs(), n).one_minus();
    let value =
        outer * n.sqr() * pass * shadow * ggx::d(h, alpha, alpha) / den.sqr().max(R::of(1e-7));
    let facing = h.z.gt(R::zero()) & lh.gt(R::zero()) & vh.lt(R::zero());
    R::select(facing, value, R::zero())
}

/// Density of [`sample`]: visible facets from `wo` (the dense side), D G1 |v·h|/|n·v|, times |l·h|/(l·h + n v·h)².
#[inline(always)]
pub(crate) fn pdf<R: Real>(wo: Vec3<R>, wi: Vec3<R>, alpha: R, n: R) -> R {
    let (l, v) = (upright(wi, wi), upright(wi, wo));
    let h = half(l, v, n);
    let (lh, vh) = (l.dot(h), v.dot(h));
    let visible =
        ggx::d(h, alpha, alpha) * ggx::g1(v, alpha, alpha) * vh.abs() / v.z.abs().max(R::of(1e-7));
    let value = visible * lh / (lh + n * vh).sqr().max(R::of(1e-7));
    let facing = h.z.gt(R::zero()) & lh.gt(R::zero()) & vh.lt(R::zero());
    R::select(facing, value, R::zero())
}

/// Refracts `wo`, which lies in the medium of index `n`, at a visible facet into air; nothing under total reflection.
#[inline(always)]
pub(crate) fn sample<R: Real>(wo: Vec3<R>, alpha: R, n: R, u1: R, u2: R) -> Vec3<R> {
    let v = fold::up(wo);
    let m = ggx::visible_normal(v, alpha, alpha, u1, u2);
    let c = v.dot(m);
    let cos2 = (n.sqr() * c.sqr().one_minus()).one_minus();
    // Below the facet: -n v + (n c - cosθ_t) m in the frame with v above.
    let down = m * (n * c - cos2.sqrt_pos()) - v * n;
    let good = cos2.gt(R::of(1e-9)) & c.gt(R::zero());
    Vec3::select(
        good,
        fold::opposite(wo, Vec3::new(down.x, down.y, -down.z)),
        Vec3::zero(),
    )
}

impl Model for GgxWalter {
    const NAME: &'static str = "ggx-walter";
    const EQUATION: &'static str = "k_d/π + k_t |l·h||v·h|/(|n·l||n·v|) n² (1-F) G1(l) G1(v) D(h) / (l·h + n v·h)², \
        h = -(l + n v)/|l + n v|, light on the side of index 1";
    const DOC: &'static str = "Variant W: Walter et al. 2007, (21), the paper's (5) to (8) corrected. One interface is not a sheet: light \
        reaches only acos(1/n) around the facets' normals (48.2° for n = 1.5), 30° in leaves at 19.6°, and f(l,v) = n² f(v,l): not \
        reciprocal. Transmits at most k_d + k_t: of k_t 0.959, 0.953, 0.931 for alpha 0.1, 0.3, 0.6 at n = 1.5, along the normal. For \
        comparison with the literature; do not render a sheet in air with it, which needs `ggx-mirrored`, `slab` or `sheet`.";
    const RECIPROCAL: bool = false;
    const PARAMS: &'static [Param] = &[
        K_D,
        Param::linear("k_t", "share of the light in the refracted lobe", 1.0, 0.3),
        ALPHA,
        INDEX,
    ];

    #[inline(always)]
    fn basis<R: Real>(s: &Shape<R>, l: Vec3<R>, v: Vec3<R>) -> Linear<R> {
        let mut b = [R::zero(); 8];
        b[0] = lambert::floor(l, v);
        b[1] = fold::transmitted(l, v, lobe(l, v, s[0], s[1]));
        b
    }
    #[inline(always)]
    fn pdf<R: Real>(s: &Shape<R>, w: &Linear<R>, wo: Vec3<R>, wi: Vec3<R>) -> R {
        let lobe = fold::transmitted(wo, wi, pdf(wo, wi, s[0], s[1]));
        w[0] * lambert::pdf(wo, wi) + w[1] * lobe
    }
    #[inline(always)]
    fn sample<R: Real>(s: &Shape<R>, w: &Linear<R>, wo: Vec3<R>, u: [R; 3]) -> Vec3<R> {
        let lobe = sample(wo, s[0], s[1], u[0], u[1]);
        Vec3::select(u[2].lt(w[0]), lambert::sample(wo, u[0], u[1]), lobe)
    }
}
