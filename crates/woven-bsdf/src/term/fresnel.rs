//! Fresnel reflectance of an interface.

use crate::real::Real;

/// Walter et al. 2007, (22); the paper's (7) corrected (the print lacks the ½ and the square of the sine):
/// unpolarised reflectance of a smooth dielectric with relative index `eta`, `c` = |l·h|. 1 under total reflection.
#[inline(always)]
pub fn dielectric<R: Real>(c: R, eta: R) -> R {
    let g2 = eta.sqr() - R::one() + c.sqr();
    let total = g2.le(R::of(1e-12));
    let g = g2.max(R::of(1e-12)).sqrt();
    let a = (g - c) / (g + c);
    let b = (c * (g + c) - R::one()) / (c * (g - c) + R::one());
    let f = a.sqr() * (R::one() + b.sqr()) * R::of(0.5);
    R::select(total, R::one(), f)
}

/// Schlick 1994: reflectance `f0` at normal incidence rising to 1 at grazing, `c` = l·h.
#[inline(always)]
pub fn schlick<R: Real>(c: R, f0: R) -> R {
    let m = c.clamp(0.0, 1.0).one_minus();
    let m2 = m.sqr();
    f0 + f0.one_minus() * (m2 * m2 * m)
}
