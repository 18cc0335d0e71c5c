//! `paper-literal`: the paper's (5) to (8) as printed, kept to show what is wrong with them.

use super::ggx_walter::{self, ALPHA, INDEX};
use super::{Linear, Model, Param, Shape, fold, lambert};
use crate::real::Real;
use crate::term::warp;
use crate::vec3::Vec3;
use std::f64::consts::PI;

/// See [`Model::DOC`].
pub struct PaperLiteral;

/// (7) as printed: no ½, and the angle between n and h. "sin θ²" is read as (sin θ)², the reading that gives the known
/// transmittance 7.22; reaches 1.81 at 89°.
#[inline(always)]
pub(crate) fn fresnel<R: Real>(cos_nh: R, n: R) -> R {
    let c = cos_nh.clamp(0.0, 1.0);
    let g = (n.sqr() - R::one() + c.sqr()).max(R::of(1e-12)).sqrt();
    let a = (g - c) / (g + c);
    let b = (c * (g + c) - R::one()) / (c * (g - c) + R::one());
    a.sqr() * (R::one() + b.sqr())
}

/// (8) as printed: tan⁴ where tan² should be, and the angle between h and l. ∫ D cosθ = π/(4α) instead of 1.
#[inline(always)]
pub(crate) fn d<R: Real>(cos_hl: R, alpha: R) -> R {
    let c2 = cos_hl.sqr().max(R::of(1e-6));
    let tan2 = c2.one_minus() / c2;
    alpha.sqr() / ((c2 * (alpha.sqr() + tan2.sqr())).sqr() * R::of(PI))
}

impl Model for PaperLiteral {
    const NAME: &'static str = "paper-literal";
    const EQUATION: &'static str = "k_t |l·h||v·h|/(|n·l||n·v|) n² (1-F(θ_nh)) G D(θ_hl) / (l·h + n v·h)² with F without ½, \
        D with tan⁴, G = min(1, 2 n·h n·v/|v·h|, 2 n·h n·l/|v·h|)";
    const DOC: &'static str = "The paper's (5) to (8) typed in as they stand (signs of the denominator as they must be, for else it \
        is nowhere finite). Not reciprocal. Passes 7.22 times the light it gets at alpha = 0.1, n = 1.5, normal incidence; what is \
        negative, where F exceeds 1, is cut to 0. Never use it but to see this; `ggx-walter` and `paper` are the corrected forms.";
    const RECIPROCAL: bool = false;
    const PARAMS: &'static [Param] = &[
        Param::linear("k_t", "strength of the lobe", 1.0, 0.1),
        ALPHA,
        INDEX,
    ];

    #[inline(always)]
    fn basis<R: Real>(s: &Shape<R>, l: Vec3<R>, v: Vec3<R>) -> Linear<R> {
        let (lu, vd) = (ggx_walter::upright(l, l), ggx_walter::upright(l, v));
        let h = ggx_walter::half(lu, vd, s[1]);
        let (lh, vh) = (lu.dot(h), vd.dot(h));
        let outer = (lh * vh).abs() / (l.z * v.z).abs().max(R::of(1e-7));
        // (6) as printed: both terms divided by cos θ_vh, the form for reflection.
        let groove = h.z * R::of(2.0) / vh.abs().max(R::of(1e-7));
        let shadow = (groove * l.z.abs().min(v.z.abs())).min(R::one());
        let pass = fresnel(h.z, s[1]).one_minus().pos();
        let den = (lh + s[1] * vh).sqr().max(R::of(1e-7));
        let value = outer * s[1].sqr() * pass * shadow * d(lh, s[0]) / den;
        let facing = h.z.gt(R::zero()) & lh.gt(R::zero()) & vh.lt(R::zero());
        let mut b = [R::zero(); 8];
        b[0] = fold::transmitted(l, v, R::select(facing, value, R::zero()));
        b
    }
    /// Its D is no density and peaks where h = l, which is straight through: a GGX around -wo is sampled, and a floor.
    #[inline(always)]
    fn pdf<R: Real>(s: &Shape<R>, _: &Linear<R>, wo: Vec3<R>, wi: Vec3<R>) -> R {
        let a2 = deviation(s[0], s[1]).sqr();
        let c2 = wo.dot(wi).sqr();
        let e = c2.one_minus().pos() + c2 * a2;
        // GGX D(δ) cosδ.
        let cos = (-wo.dot(wi)).max(R::of(1e-5));
        let lobe = a2 * cos / (e.sqr() * R::of(PI)).max(R::of(1e-12));
        let ahead = wo.dot(wi).lt(R::of(-1e-5));
        let lobe = fold::transmitted(wo, wi, R::select(ahead, lobe, R::zero()));
        (lobe + lambert::pdf(wo, wi)) * R::of(0.5)
    }
    #[inline(always)]
    fn sample<R: Real>(s: &Shape<R>, _: &Linear<R>, wo: Vec3<R>, u: [R; 3]) -> Vec3<R> {
        let a2 = deviation(s[0], s[1]).sqr();
        let tan2 = a2 * u[0] / u[0].one_minus().max(R::of(1e-9));
        let wi = warp::around(-wo, (tan2 + R::one()).sqrt().recip(), u[1]);
        let lobe = Vec3::select(fold::transmits(wo, wi), wi, Vec3::zero());
        Vec3::select(u[2].lt(R::of(0.5)), lambert::sample(wo, u[0], u[1]), lobe)
    }
}

/// How far the printed lobe reaches around the straight direction: tan⁴θ_hl = α² at √α, and h turns n/(n-1) times as
/// far as the viewer does.
#[inline(always)]
fn deviation<R: Real>(alpha: R, n: R) -> R {
    alpha.sqrt() * (n - R::one()) / n
}
