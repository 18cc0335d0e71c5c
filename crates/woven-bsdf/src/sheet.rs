//! `sheet`: the woven sheet used for rendering: a gap, a yarn lobe, diffuse transmission, reflection.
//!
//! Three parts are visible in real goniometer data of shade cloth: a straight-through peak, an anisotropic skirt and a
//! diffuse floor. The peak is the gap ([`Sheet::gap`]), a delta kept apart; the rest is this model's value. Light that
//! hits the yarn (the cover, 1 - gap) is shared between the five factors, so that
//! gap + R + T ≤ 1 in every direction whenever t_d + k_t + r_d + k_r + sheen ≤ 1, and = 1 (to the precision of the albedo's
//! closed form) whenever they sum to 1 without k_r and sheen. All terms are reciprocal. With c the cover, c0 its least value (at
//! normal incidence) and c̄ its mean: the diffuse terms carry c(l) c(v)/c̄; the forward lobe carries c0, what masking
//! takes from it comes back diffusely (Kulla and Conty 2017), and the cover that a tilt adds to c0 scatters diffusely
//! too, as (c(l) - c0)(c(v) - c0)/(c̄ - c0); the reflection lobe and the sheen carry min(c(l), c(v)).

use crate::model::{Linear, MAX_SHAPE, Model, Param, Shape, fold};
use crate::real::Real;
use crate::term::{albedo, fresnel, fuzz, ggx, warp};
use crate::vec3::Vec3;
use crate::weave;
use std::f64::consts::PI;

/// See the module's page.
pub struct Sheet;

/// Places of the linear factors.
pub mod linear {
    /// Diffuse transmission.
    pub const T_D: usize = 0;
    /// Forward yarn lobe.
    pub const K_T: usize = 1;
    /// Diffuse reflection.
    pub const R_D: usize = 2;
    /// Reflection lobe.
    pub const K_R: usize = 3;
    /// Sheen.
    pub const SHEEN: usize = 4;
}

/// Places of the shape parameters and derived constants.
pub mod shape {
    /// Diameter over pitch of the warp yarns.
    pub const GAMMA_WARP: usize = 0;
    /// Diameter over pitch of the weft yarns.
    pub const GAMMA_WEFT: usize = 1;
    /// Height over width of a yarn's section.
    pub const SECTION: usize = 2;
    /// Width of the forward lobe along the weft.
    pub const ALPHA_X: usize = 3;
    /// Width of the forward lobe along the warp.
    pub const ALPHA_Y: usize = 4;
    /// Width of the reflection lobe along the weft.
    pub const RALPHA_X: usize = 5;
    /// Width of the reflection lobe along the warp.
    pub const RALPHA_Y: usize = 6;
    /// Reflectance of the reflection lobe at normal incidence.
    pub const F0: usize = 7;
    /// Derived: 1 / mean cover.
    pub const INV_MEAN_COVER: usize = 8;
    /// Derived: 1 / (mean loss of the forward lobe).
    pub const INV_MEAN_LOSS: usize = 9;
    /// Derived: the first of six coefficients of the forward lobe's loss.
    pub const LOSS: usize = 10;
}

use shape::{
    ALPHA_X, ALPHA_Y, F0, GAMMA_WARP, GAMMA_WEFT, INV_MEAN_COVER, INV_MEAN_LOSS, LOSS, RALPHA_X,
    RALPHA_Y, SECTION,
};

/// Share of the forward lobe that masking takes from direction `w`; it is given back diffusely.
#[inline(always)]
fn loss<R: Real>(s: &Shape<R>, w: Vec3<R>) -> R {
    let c = std::array::from_fn(|i| s[LOSS + i]);
    albedo::lobe_loss(w, s[ALPHA_X], s[ALPHA_Y], c)
}

/// The yarn's share at normal incidence, the least of all directions.
#[inline(always)]
fn least_cover<R: Real>(s: &Shape<R>) -> R {
    (s[GAMMA_WARP].one_minus().pos() * s[GAMMA_WEFT].one_minus().pos()).one_minus()
}

/// 1 / (mean of the cover that tilting adds); a closed sheet adds none.
#[inline(always)]
fn inv_tilted_cover<R: Real>(s: &Shape<R>, least: R) -> R {
    (s[INV_MEAN_COVER].recip() - least).max(R::of(1e-6)).recip()
}

/// The chances of (diffuse transmission, forward lobe, diffuse reflection, sheen); the reflection lobe has the rest.
#[inline(always)]
fn chances<R: Real>(s: &Shape<R>, w: &Linear<R>, wo: Vec3<R>) -> [R; 4] {
    let cover = Sheet::gap(s, wo).one_minus().max(R::of(1e-6));
    let lobe = w[linear::K_T] * loss(s, wo).one_minus() * (least_cover(s) / cover);
    let even = w[linear::T_D] + w[linear::K_T] - lobe;
    [even, lobe, w[linear::R_D], w[linear::SHEEN]]
}

impl Sheet {
    /// The gap's share for a beam along `w`: passes straight on, uncoloured.
    #[inline(always)]
    pub fn gap<R: Real>(s: &Shape<R>, w: Vec3<R>) -> R {
        weave::openness(s[GAMMA_WARP], s[GAMMA_WEFT], s[SECTION], w)
    }
    /// A shape that has `cover` (glTF's alpha) in every direction and no lobes.
    pub fn constant_cover(cover: f64) -> Shape<f64> {
        let mut s = [0.0; MAX_SHAPE];
        s[GAMMA_WARP] = cover;
        s[ALPHA_X..=RALPHA_Y].fill(0.5);
        s[F0] = 0.04;
        Self::derive(&mut s);
        s
    }
    /// Sampling weights that sum to 1, from the luminances of RGB factors (Rec. 709); the reflection lobe counts with
    /// the mean of Schlick's reflectance, f0 + (1 - f0)/21, the sheen with its own mean.
    pub fn weights(k: &[[f64; 3]; 8], s: &Shape<f64>) -> Linear<f64> {
        let mut lum = k.map(|c| 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]);
        lum[linear::K_R] *= s[F0] + (1.0 - s[F0]) / 21.0;
        lum[linear::SHEEN] *= fuzz::MEAN_ALBEDO;
        crate::model::normalized(&lum)
    }
}

impl Model for Sheet {
    const NAME: &'static str = "sheet";
    const EQUATION: &'static str = "T: c_l c_v t_d/(π c̄) + k_t [c0 (M(l,v') + (1-E_l)(1-E_v)/(π(1-Ē))) + (c_l-c0)(c_v-c0)/(π(c̄-c0))]; \
        R: c_l c_v r_d/(π c̄) + min(c_l,c_v) (k_r M_r(l,v) F(f0) + sheen S(l,v)); c = 1 - openness, c0 at normal incidence, c̄ mean; gap: openness·δ";
    const DOC: &'static str = "The woven sheet: openness of the weave as a delta apart, forward GGX lobe along the yarns with its masking \
        loss given back, diffuse transmission, diffuse and glossy reflection, the sheen of standing fibres. Reciprocal by construction; \
        gap + R + T is at most 1 while the factors sum to at most 1. Not for pictures in which single yarns are seen (take the yarns \
        as geometry), nor for a lobe that is not along warp and weft (take the measured table).";
    const RECIPROCAL: bool = true;
    const PARAMS: &'static [Param] = &[
        Param::linear(
            "t_d",
            "share of the yarn's light transmitted evenly",
            1.0,
            0.2,
        ),
        Param::linear(
            "k_t",
            "share of the yarn's light in the forward lobe",
            1.0,
            0.2,
        ),
        Param::linear(
            "r_d",
            "share of the yarn's light reflected evenly",
            1.0,
            0.4,
        ),
        Param::linear("k_r", "strength of the reflection lobe", 1.0, 0.0),
        Param::linear(
            "sheen",
            "strength of the sheen of standing fibres: 0 smooth yarn, 1 a layer of clear fibres on all of it",
            1.0,
            0.0,
        ),
        Param::shape(
            "gamma_warp",
            "warp yarn diameter over pitch: 0.8 leaves a fifth open",
            0.0,
            1.0,
            0.75,
        ),
        Param::shape(
            "gamma_weft",
            "weft yarn diameter over pitch, as gamma_warp; the openness along the normal is (1 - gamma_warp)(1 - gamma_weft)",
            0.0,
            1.0,
            0.75,
        ),
        Param::shape(
            "section",
            "height of a yarn over its width: 1 round, 0 flat",
            0.0,
            2.0,
            0.5,
        ),
        Param::shape(
            "alpha_x",
            "width of the forward lobe along the weft: 0.05 falls to half its peak 3.7° from straight through, 0.1 at 7.5°, 0.3 at 25°",
            0.02,
            1.0,
            0.2,
        )
        .log(),
        Param::shape(
            "alpha_y",
            "width of the forward lobe along the warp, as alpha_x",
            0.02,
            1.0,
            0.2,
        )
        .log(),
        Param::shape(
            "ralpha_x",
            "width of the reflection lobe along the weft: 0.1 falls to half its peak 7.5° from the mirrored direction, 0.3 at 25°",
            0.02,
            1.0,
            0.4,
        )
        .log(),
        Param::shape(
            "ralpha_y",
            "width of the reflection lobe along the warp, as ralpha_x",
            0.02,
            1.0,
            0.4,
        )
        .log(),
        Param::shape(
            "f0",
            "reflectance of the yarn's surface at normal incidence: 0.04 for a refractive index of 1.5",
            0.0,
            1.0,
            0.04,
        ),
    ];

    fn derive<R: Real>(s: &mut Shape<R>) {
        s[INV_MEAN_COVER] = weave::mean_cover(s[GAMMA_WARP], s[GAMMA_WEFT], s[SECTION])
            .max(R::of(1e-6))
            .recip();
        let c = albedo::loss_coefficients(s[ALPHA_X], s[ALPHA_Y]);
        s[LOSS..].copy_from_slice(&c);
        s[INV_MEAN_LOSS] = albedo::mean_lobe_loss(s[ALPHA_X], s[ALPHA_Y], c)
            .max(R::of(1e-6))
            .recip();
    }

    #[inline(always)]
    fn basis<R: Real>(s: &Shape<R>, l: Vec3<R>, v: Vec3<R>) -> Linear<R> {
        let through = fold::transmits(l, v);
        let cover_l = Self::gap(s, l).one_minus();
        let cover_v = Self::gap(s, v).one_minus();
        let diffuse = cover_l * cover_v * s[INV_MEAN_COVER] * R::of(1.0 / PI);
        let ax = R::select(through, s[ALPHA_X], s[RALPHA_X]);
        let ay = R::select(through, s[ALPHA_Y], s[RALPHA_Y]);
        let (lu, vu) = (fold::up(l), fold::up(v));
        let lobe = ggx::lobe(lu, vu, ax, ay);
        let back = loss(s, l) * loss(s, v) * s[INV_MEAN_LOSS] * R::of(1.0 / PI);
        let fresnel = fresnel::schlick(lu.dot((lu + vu).normalize()), s[F0]);
        let least = least_cover(s);
        let tilted = (cover_l - least).pos() * (cover_v - least).pos() * inv_tilted_cover(s, least);
        let mut b = [R::zero(); 8];
        b[linear::T_D] = R::select(through, diffuse, R::zero());
        b[linear::K_T] = R::select(
            through,
            least * (lobe + back) + tilted * R::of(1.0 / PI),
            R::zero(),
        );
        b[linear::R_D] = R::select(through, R::zero(), diffuse);
        let both = cover_l.min(cover_v);
        b[linear::K_R] = R::select(through, R::zero(), both * lobe * fresnel);
        b[linear::SHEEN] = R::select(through, R::zero(), both * fuzz::lobe(lu, vu));
        b
    }

    #[inline(always)]
    fn pdf<R: Real>(s: &Shape<R>, w: &Linear<R>, wo: Vec3<R>, wi: Vec3<R>) -> R {
        let through = fold::transmits(wo, wi);
        let [td, tl, rd, sheen] = chances(s, w, wo);
        let ax = R::select(through, s[ALPHA_X], s[RALPHA_X]);
        let ay = R::select(through, s[ALPHA_Y], s[RALPHA_Y]);
        let lobe = ggx::pdf(fold::up(wi), fold::up(wo), ax, ay);
        let cosine = wi.z.abs() * R::of(1.0 / PI);
        let even = R::select(through, R::zero(), sheen * R::of(0.5 / PI));
        R::select(through, td, rd) * cosine + R::select(through, tl, w[linear::K_R]) * lobe + even
    }

    #[inline(always)]
    fn sample<R: Real>(s: &Shape<R>, w: &Linear<R>, wo: Vec3<R>, u: [R; 3]) -> Vec3<R> {
        let [td, tl, rd, sheen] = chances(s, w, wo);
        let diffuse = u[2].lt(td + rd);
        let through = u[2].lt(td) | (u[2].lt(td + rd + tl) & !diffuse);
        let ax = R::select(through, s[ALPHA_X], s[RALPHA_X]);
        let ay = R::select(through, s[ALPHA_Y], s[RALPHA_Y]);
        let lobe = ggx::sample(fold::up(wo), ax, ay, u[0], u[1]);
        let wi = Vec3::select(diffuse, warp::cosine(u[0], u[1]), lobe);
        let fuzz = !u[2].lt(td + rd + tl) & u[2].lt(td + rd + tl + sheen);
        let wi = Vec3::select(fuzz, warp::even(u[0], u[1]), wi);
        let there = fold::opposite(wo, wi);
        Vec3::select(through, there, Vec3::new(there.x, there.y, -there.z))
    }
}
