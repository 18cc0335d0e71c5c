//! `ashikhmin-shirley`: the anisotropic Phong lobe of half vectors, mirrored through the sheet.

use super::lambert::{self, K_D};
use super::{Linear, Model, Param, Shape, fold};
use crate::real::Real;
use crate::term::{fresnel, power};
use crate::vec3::Vec3;
use std::f64::consts::PI;

/// See [`Model::DOC`].
pub struct AshikhminShirley;

/// √((n_u+1)(n_v+1)) (n·h)^(n_u cos²φ_h + n_v sin²φ_h), the numerator that f and the density share.
#[inline(always)]
fn numerator<R: Real>(h: Vec3<R>, n_u: R, n_v: R) -> R {
    let sin2 = (h.x.sqr() + h.y.sqr()).max(R::of(1e-14));
    // 1 - n·h without the rounding of a cosine near 1.
    let lack = sin2 / (h.z + R::one());
    let exponent = (n_u * h.x.sqr() + n_v * h.y.sqr()) / sin2;
    let norm = ((n_u + R::one()) * (n_v + R::one())).sqrt();
    norm * power::of_one_minus(lack.min(R::of(1.0 - 1e-5)), exponent)
}

impl Model for AshikhminShirley {
    const NAME: &'static str = "ashikhmin-shirley";
    const EQUATION: &'static str = "k_d/π + k_s √((n_u+1)(n_v+1))/(8π) (n·h)^(n_u cos²φ_h + n_v sin²φ_h) / ((h·l) max(n·l, n·v')) \
        (f0 + (1-f0)(1-h·l)^5), h = (l+v')/|l+v'|";
    const DOC: &'static str = "Ashikhmin and Shirley 2000, (4), as the paper compares it, on (l, v'). Gaussian-like: at small angles n = 2/a² \
        of `ward`. k_s and f0 nearly form a product (only its rise towards grazing tells them apart), so a fit at normal incidence \
        sees k_s·f0. Reciprocal, bounded by k_s in energy. A comparison model; `ggx-mirrored` has the tails that cloth has.";
    const RECIPROCAL: bool = true;
    const PARAMS: &'static [Param] = &[
        K_D,
        Param::linear("k_s", "strength of the lobe before Fresnel", 1.0, 0.5),
        Param::shape(
            "n_u",
            "exponent along the weft: 10 falls to half its peak 44° from straight through, 100 at 13.5°, 1000 at 4.3°",
            1.0,
            10_000.0,
            90.0,
        )
        .log(),
        Param::shape("n_v", "exponent along the warp, as n_u", 1.0, 10_000.0, 90.0).log(),
        Param::shape(
            "f0",
            "share of the lobe at normal incidence: 0.04 for a surface of refractive index 1.5",
            0.0,
            1.0,
            0.5,
        ),
    ];

    #[inline(always)]
    fn basis<R: Real>(s: &Shape<R>, l: Vec3<R>, v: Vec3<R>) -> Linear<R> {
        let (lu, vu) = (fold::up(l), fold::up(v));
        let h = (lu + vu).normalize();
        let cos_d = lu.dot(h);
        let den = (cos_d * lu.z.max(vu.z) * R::of(8.0 * PI)).max(R::of(1e-7));
        let lobe = numerator(h, s[0], s[1]) * fresnel::schlick(cos_d, s[2]) / den;
        let mut b = [R::zero(); 8];
        b[0] = lambert::floor(l, v);
        b[1] = fold::transmitted(l, v, lobe);
        b
    }
    /// The paper's (8): p(h) = √((n_u+1)(n_v+1))/(2π) (n·h)^…, over 4 (v·h).
    #[inline(always)]
    fn pdf<R: Real>(s: &Shape<R>, w: &Linear<R>, wo: Vec3<R>, wi: Vec3<R>) -> R {
        let (v, l) = (fold::up(wo), fold::up(wi));
        let h = (l + v).normalize();
        let lobe = numerator(h, s[0], s[1]) / (v.dot(h) * R::of(8.0 * PI)).max(R::of(1e-7));
        w[0] * lambert::pdf(wo, wi) + w[1] * fold::transmitted(wo, wi, lobe)
    }
    /// The paper's (9), (10) in slopes: with both numbers turned to a point of the circle, no quadrants are needed.
    #[inline(always)]
    fn sample<R: Real>(s: &Shape<R>, w: &Linear<R>, wo: Vec3<R>, u: [R; 3]) -> Vec3<R> {
        // tanφ_h = √((n_u+1)/(n_v+1)) tan(2π u): the direction (cos/√(n_u+1), sin/√(n_v+1)) scaled to length 1.
        let turn = u[1] * R::of(2.0 * PI);
        let x = turn.cos() / (s[0] + R::one()).sqrt();
        let y = turn.sin() / (s[1] + R::one()).sqrt();
        let len2 = (x.sqr() + y.sqr()).max(R::of(1e-20));
        let exponent = (s[0] * x.sqr() + s[1] * y.sqr()) / len2;
        // cosθ_h = (1 - u)^(1/(exponent+1)).
        let lack = power::one_minus_exp(-(power::ln_one_minus(u[0]) / (exponent + R::one())));
        let r = power::sine(lack) / len2.sqrt();
        let h = Vec3::new(x * r, y * r, lack.one_minus());
        let v = fold::up(wo);
        let d = v.dot(h);
        let l = h * (d * R::of(2.0)) - v;
        let lobe = Vec3::select(d.gt(R::zero()), fold::opposite(wo, l), Vec3::zero());
        Vec3::select(u[2].lt(w[0]), lambert::sample(wo, u[0], u[1]), lobe)
    }
}
