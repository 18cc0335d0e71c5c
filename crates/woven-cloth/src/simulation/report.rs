//! What a curtain is doing, in numbers.

use super::{Simulation, TICKS};
use crate::fabrics::GRAVITY;
use crate::sheet::{Energy, Sheet};

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
        for sheet in self.layers.iter().map(|l| &l.sheet) {
            for k in 0..sheet.len() {
                let v2: f64 = sheet.velocity(k).iter().map(|c| c * c).sum();
                if v2.is_nan() {
                    return f64::NAN;
                }
                most = most.max(v2);
            }
        }
        most.sqrt()
    }

    /// Strain, force, energy and speed now. Of two curtains: the first's mean strain, the larger strain and speed, the sums of the rest.
    #[must_use]
    pub fn report(&self) -> Report {
        let mut report = self.of(&self.layers[0].sheet);
        for layer in &self.layers[1..] {
            let more = self.of(&layer.sheet);
            report.max_strain = report.max_strain.max(more.max_strain);
            report.weight += more.weight;
            for c in 0..3 {
                report.support_force[c] += more.support_force[c];
            }
            report.energy.kinetic += more.energy.kinetic;
            report.energy.gravity += more.energy.gravity;
            report.energy.stretch += more.energy.stretch;
            report.energy.shape += more.energy.shape;
        }
        report
    }

    fn of(&self, sheet: &Sheet) -> Report {
        Report {
            time: self.time(),
            max_strain: sheet.max_strain(),
            mean_strain: sheet.mean_warp_strain(),
            support_force: sheet.support_force(GRAVITY),
            weight: sheet.total_mass() * GRAVITY,
            energy: sheet.energy(GRAVITY),
            max_speed: self.max_speed(),
            steps_per_second: TICKS * f64::from(self.substeps),
        }
    }
}
