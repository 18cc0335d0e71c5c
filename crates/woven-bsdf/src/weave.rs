//! The gap: how much of the light passes between the yarns, for every direction.

use crate::real::Real;
use crate::vec3::Vec3;

/// Share of a beam along `w` that passes between the yarns of a weave, uncoloured and undeviated.
///
/// `gamma_warp`, `gamma_weft` are yarn diameter over pitch; the warp runs along y, so that a tilt along x closes the
/// warp's gaps. `section` is the height of a yarn over its width: 1 round, 0 a flat tape (a constant gap), between
/// them elliptic. For round yarns this is FORMULAS' T(w) = Π max(0, 1 - γ_k / cosθ'_k): the shadow of an ellipse with
/// half-axes a, b under the angle θ' is 2 √(a² + b² tan²θ') wide on the sheet.
#[inline(always)]
pub fn openness<R: Real>(gamma_warp: R, gamma_weft: R, section: R, w: Vec3<R>) -> R {
    let k = section.sqr() / w.z.sqr().max(R::of(1e-10));
    let warp = (gamma_warp * (R::one() + w.x.sqr() * k).sqrt())
        .one_minus()
        .pos();
    let weft = (gamma_weft * (R::one() + w.y.sqr() * k).sqrt())
        .one_minus()
        .pos();
    warp * weft
}

/// The yarn's share averaged over the cosine-weighted hemisphere: (1/π) ∫ (1 - openness) cosθ dω.
///
/// 16 × 16 midpoints over (sin²θ, φ) of one quadrant: within 5e-4 of the converged value, also with the kinks of
/// cut-off angles.
pub fn mean_cover<R: Real>(gamma_warp: R, gamma_weft: R, section: R) -> R {
    const N: usize = 16;
    let mut sum = R::zero();
    for i in 0..N {
        let sin2 = (i as f64 + 0.5) / N as f64;
        for j in 0..N {
            let phi = (j as f64 + 0.5) / N as f64 * std::f64::consts::FRAC_PI_2;
            let w = Vec3::new(
                sin2.sqrt() * phi.cos(),
                sin2.sqrt() * phi.sin(),
                (1.0 - sin2).sqrt(),
            );
            sum = sum + openness(gamma_warp, gamma_weft, section, w.cast()).one_minus();
        }
    }
    sum * R::of(1.0 / (N * N) as f64)
}
