//! The gap: how much of the light passes between the yarns, for every direction; and drafts of weaves.

pub mod draft;
pub mod map;
pub mod wif;
pub mod yarns;

use crate::real::Real;
use crate::term::albedo::GAUSS8;
use crate::vec3::Vec3;
use std::f64::consts::FRAC_PI_2;

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

/// Factor by which the openness along the normal changes when cloth whose yarns are `gammas` (warp, weft) of their pitch wide is strained:
/// strain of the warp, of the weft (length over rest length, less 1), and shear (rad). Yarns keep their width; a pull along the
/// weft moves the warp's yarns apart, and shear brings all of them nearer by its cosine. 1 for cloth without gaps at rest.
#[must_use]
pub fn opened(gammas: [f64; 2], [warp, weft, shear]: [f64; 3]) -> f64 {
    let rest = (1.0 - gammas[0]) * (1.0 - gammas[1]);
    if rest <= 0.0 || !rest.is_finite() {
        return 1.0;
    }
    let gap =
        |gamma: f64, along: f64| (1.0 - gamma / ((1.0 + along) * shear.cos()).max(1e-3)).max(0.0);
    gap(gammas[0], weft) * gap(gammas[1], warp) / rest
}

/// The yarn's share averaged over the cosine-weighted hemisphere: (1/π) ∫ (1 - openness) cosθ dω.
///
/// Eight Gauss points in cosθ on each of four panels, narrower towards grazing where sparse or flat yarns close, times ten
/// azimuths of one quadrant: within 6e-4 of the converged value, relative, also with the kinks of cut-off angles. What a
/// tilt adds to the cover, the mean less the cover along the normal, is right to 7e-4 of a beam even for tapes, of which it is
/// a thousandth: the sheet divides by it. (With three panels from 0.15 on it was wrong by 5e-3 for a section of 0.02.)
pub fn mean_cover<R: Real>(gamma_warp: R, gamma_weft: R, section: R) -> R {
    const PANELS: [(f64, f64); 4] = [(0.0, 0.02), (0.02, 0.1), (0.1, 0.35), (0.35, 1.0)];
    const AZIMUTHS: usize = 10;
    let mut sum = R::zero();
    for (lo, hi) in PANELS {
        for (x, weight) in GAUSS8 {
            let cos = lo + (hi - lo) * x;
            let sin = (1.0 - cos * cos).sqrt();
            let mut ring = R::zero();
            for j in 0..AZIMUTHS {
                let phi = (j as f64 + 0.5) / AZIMUTHS as f64 * FRAC_PI_2;
                let w = Vec3::new(sin * phi.cos(), sin * phi.sin(), cos);
                ring = ring + openness(gamma_warp, gamma_weft, section, w.cast()).one_minus();
            }
            sum = sum + ring * R::of(2.0 * cos * weight * (hi - lo) / AZIMUTHS as f64);
        }
    }
    sum
}
