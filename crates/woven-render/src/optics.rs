//! The sheet's optics of `woven-bsdf` in the scene's own types.

use glam::Vec3;
use woven_bsdf::model::Model;
use woven_bsdf::sheet::Sheet;

use crate::scene::{MAX_LINEAR, MAX_SHAPE};

/// A direction in the cloth's frame.
type Direction = woven_bsdf::vec3::Vec3<f32>;

#[inline(always)]
fn direction(v: Vec3) -> Direction {
    Direction::new(v.x, v.y, v.z)
}

/// Shape numbers of a sheet whose yarn covers the share `coverage` in every direction.
#[must_use]
pub fn constant_coverage(coverage: f32) -> [f32; MAX_SHAPE] {
    Sheet::constant_cover(f64::from(coverage)).map(|x| x as f32)
}

/// Sampling weights of a sheet with these linear factors: luminances that sum to 1 (all 0 for black).
#[must_use]
pub fn weights(linear: &[[f32; 3]; MAX_LINEAR], shape: &[f32; MAX_SHAPE]) -> [f32; MAX_LINEAR] {
    let linear = linear.map(|k| k.map(f64::from));
    let w = Sheet::weights(&linear, &shape.map(f64::from));
    let black = linear.iter().flatten().all(|&k| k <= 0.0);
    w.map(|x| if black { 0.0 } else { x as f32 })
}

/// Basis functions \[1/sr\] of the sheet for light from `l` to `v`; the cover by yarn is in them.
#[inline(always)]
#[must_use]
pub fn sheet_basis(s: &[f32; MAX_SHAPE], l: Vec3, v: Vec3) -> [f32; MAX_LINEAR] {
    Sheet::basis(s, direction(l), direction(v))
}

/// Density of [`sheet_sample`] per solid angle.
#[inline(always)]
#[must_use]
pub fn sheet_pdf(s: &[f32; MAX_SHAPE], w: &[f32; MAX_LINEAR], wo: Vec3, wi: Vec3) -> f32 {
    Sheet::pdf(s, w, direction(wo), direction(wi))
}

/// A direction in proportion to about f cos; `u` in 0..1.
#[inline(always)]
#[must_use]
pub fn sheet_sample(s: &[f32; MAX_SHAPE], w: &[f32; MAX_LINEAR], wo: Vec3, u: Vec3) -> Vec3 {
    let wi = Sheet::sample(s, w, direction(wo), [u.x, u.y, u.z]);
    Vec3::new(wi.x, wi.y, wi.z)
}

/// Share of light along `w` that passes straight through the gaps.
#[inline(always)]
#[must_use]
pub fn openness(s: &[f32; MAX_SHAPE], w: Vec3) -> f32 {
    Sheet::gap(s, direction(w))
}
