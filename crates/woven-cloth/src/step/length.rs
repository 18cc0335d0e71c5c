//! How long a step of the production solver may be.

use crate::force::{RISE, Shape};
use crate::sheet::Sheet;
use crate::simulation::TICKS;

/// How far a step may go: the largest h'²ω² of shear, bending and tension waves.
const STABLE: f64 = 0.75;
/// Retardation time of the threads below which they ring in gusts, s.
const LITTLE_DAMPING: f64 = 5e-4;

/// The longest stable step, s, for a sheet: shear, bending and the waves of a tension of three times its weight.
#[must_use]
pub fn stable_step(sheet: &Sheet, gravity: f64) -> f64 {
    let height = sheet.hy * (sheet.ny - 1) as f64;
    let tension = 4.0 * 3.0 * gravity * height / sheet.hx.min(sheet.hy).powi(2);
    let more = |limit: f64| if limit > 0.0 { 1.0 + RISE } else { 1.0 };
    let m = &sheet.mechanics;
    let omega2 = more(m.shear_hysteresis) * Shape::shear_omega2(sheet)
        + more(m.bending_hysteresis) * Shape::bending_omega2(sheet)
        + tension;
    1.5 * (STABLE / omega2).sqrt()
}

/// The longest step, s, that also holds in gusts. Threads without damping ring when a fold cracks like a whip, and warp and weft, solved one
/// after the other, drive each other up unless the step is half as long: a sheet of 25 x 49 vertices in gusts of 3 m/s came to strains
/// of 50 % at the full step, and in 20 runs of 4 s to 9 % at worst at half of it (4 % in the explicit reference); at the full step with
/// a retardation time of 0.5 ms one such run stayed below 3 %.
#[must_use]
pub fn gust_step(sheet: &Sheet, gravity: f64) -> f64 {
    let step = stable_step(sheet, gravity);
    if sheet.mechanics.stretch_damping < LITTLE_DAMPING {
        // Half of what would be taken: never more than a fourth of a tick.
        0.5 * step.min(0.5 / TICKS)
    } else {
        step
    }
}
