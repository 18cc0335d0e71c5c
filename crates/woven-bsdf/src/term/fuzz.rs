//! The sheen of a thin layer of standing fibres: light that they scatter once, in closed form.
//!
//! The layer is the kind that Zeltner, Burley and Chiang 2022, "Practical Multiple-Scattering Sheen Using Linearly
//! Transformed Cosines", fit their sheen to: microflakes (SGGX, Heitz et al. 2015) whose normals lie across fibres that
//! stand on the cloth. Their fit, a transformed cosine, is not reciprocal. What the flakes of a layer of optical depth τ
//! scatter once needs no fit: with σ(w) the area of the flakes seen from w and D their normals' distribution,
//!
//! f = D(h)/4 · (1 - exp(-τ (σ(l)/μ_l + σ(v)/μ_v))) / (σ(l) μ_v + σ(v) μ_l).
//!
//! It is the same when l and v change places, and gives back no more than the layer meets, 1 - exp(-τ σ(l)/μ_l). What
//! is scattered more often is left out; a Monte Carlo of the layer with all orders says how much that is (the test
//! `sheen_of_a_layer_of_fibres`).

use crate::real::Real;
use crate::term::power;
use crate::vec3::Vec3;
use std::f64::consts::PI;

/// Area of a flake's fibre seen from its end over that seen from its side: how disorderly the fibres stand.
pub const ALPHA: f64 = 0.5;
/// Optical depth of the layer for light along it: how dense the fibres stand.
pub const DEPTH: f64 = 1.0;
/// (1/π) ∫∫ f μ_l μ_v: the share of an even light that [`lobe`] gives back.
pub const MEAN_ALBEDO: f64 = 0.0763;

/// Area of the flakes seen from `w`: √(wᵀ S w), S = diag(1, 1, α²).
#[inline(always)]
pub fn area<R: Real>(w: Vec3<R>) -> R {
    (w.x.sqr() + w.y.sqr() + w.z.sqr() * R::of(ALPHA * ALPHA)).sqrt()
}

/// Distribution of the flakes' normals: 1/(π √|S| (hᵀ S⁻¹ h)²).
#[inline(always)]
pub fn d<R: Real>(h: Vec3<R>) -> R {
    let e = h.x.sqr() + h.y.sqr() + h.z.sqr() * R::of(1.0 / (ALPHA * ALPHA));
    (e.sqr() * R::of(PI * ALPHA)).recip()
}

/// See the module's page; both directions with z > 0.
#[inline(always)]
pub fn lobe<R: Real>(l: Vec3<R>, v: Vec3<R>) -> R {
    let (sl, sv) = (area(l), area(v));
    let both = (sl * v.z + sv * l.z).max(R::of(1e-9));
    let met = power::one_minus_exp(both * R::of(DEPTH) / (l.z * v.z).max(R::of(1e-9)));
    d((l + v).normalize()) * met / both * R::of(0.25)
}
