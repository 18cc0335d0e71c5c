//! What a curtain is doing, in numbers.

use super::{Simulation, TICKS};
use crate::fabrics::GRAVITY;
use crate::sheet::Energy;

/// What a curtain is doing, in numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Report {
    /// Time since the wind began, s.
    pub time: f64,
    /// Largest absolute strain of a thread segment now.
    pub max_strain: f64,
    /// Mean strain of the warp.
    pub mean_strain: f64,
    /// Force of the rail on the cloth, N.
    pub support_force: [f64; 3],
    /// Weight of the cloth, N.
    pub weight: f64,
    /// Energies, J.
    pub energy: Energy,
    /// Largest speed of a vertex, m/s.
    pub max_speed: f64,
    /// Steps a second of simulated time.
    pub steps_per_second: f64,
}

impl Simulation {
    pub(super) fn max_speed(&self) -> f64 {
        let mut most = 0.0f64;
        for k in 0..self.sheet.len() {
            let v2: f64 = self.sheet.velocity(k).iter().map(|c| c * c).sum();
            if v2.is_nan() {
                return f64::NAN;
            }
            most = most.max(v2);
        }
        most.sqrt()
    }

    /// Strain, force, energy and speed now.
    #[must_use]
    pub fn report(&self) -> Report {
        Report {
            time: self.time(),
            max_strain: self.sheet.max_strain(),
            mean_strain: self.sheet.mean_warp_strain(),
            support_force: self.sheet.support_force(GRAVITY),
            weight: self.sheet.total_mass() * GRAVITY,
            energy: self.sheet.energy(GRAVITY),
            max_speed: self.max_speed(),
            steps_per_second: TICKS * f64::from(self.substeps),
        }
    }
}
