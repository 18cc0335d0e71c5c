//! The cloth of the validation suite.

use woven_cloth::Mechanics;

/// The suite's cloth: 0.12 kg/m², 2000 N/m, 5e-6 N·m, no damping.
pub(crate) fn cloth() -> Mechanics {
    Mechanics {
        areal_density: 0.12,
        tensile_warp: 2000.0,
        tensile_weft: 2000.0,
        shear: 20.0,
        bending_warp: 5e-6,
        bending_weft: 5e-6,
        stretch_damping: 0.0,
        bending_damping: 0.0,
        openness: 0.0,
        ..Mechanics::default()
    }
}
