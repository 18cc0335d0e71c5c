//! The reference solver: symplectic Euler in f64 with every force explicit, fully resolved. Slow, simple, second to none in
//! trust: the production solver is compared with it.

use crate::force::{Shape, add_stretch};
use crate::sheet::{Field, Sheet};

/// The explicit solver; its step must resolve the fastest spring.
#[derive(Clone, Debug)]
pub struct Reference {
    dt: f64,
    gravity: f64,
    shape: Shape,
    f: Field,
    /// Force of the air, N, as the caller last set it.
    pub air: [Vec<f64>; 3],
    /// Damping of the absolute velocity, 1/s, to find a rest.
    pub settling: f64,
}

/// The longest safe step of the explicit solver, s: half of 2/ω of the fastest mode.
#[must_use]
pub fn explicit_step(sheet: &Sheet) -> f64 {
    let m = &sheet.mechanics;
    let stretch = 4.0 * (m.tensile_warp / sheet.hy.powi(2) + m.tensile_weft / sheet.hx.powi(2))
        / m.areal_density;
    let omega2 = stretch + Shape::shear_omega2(sheet) + Shape::bending_omega2(sheet);
    1.0 / omega2.sqrt()
}

impl Reference {
    /// A solver with steps of `dt` seconds.
    #[must_use]
    pub fn new(sheet: &Sheet, dt: f64, gravity: f64) -> Self {
        let zeros = || vec![0.0; sheet.len()];
        Self {
            dt,
            gravity,
            shape: Shape::new(sheet),
            f: [zeros(), zeros(), zeros()],
            air: [zeros(), zeros(), zeros()],
            settling: 0.0,
        }
    }

    /// Puts the velocities half a step before the positions (leapfrog), which makes the scheme second order; called once at the
    /// start with velocities that belong to the positions.
    pub fn begin(&mut self, sheet: &mut Sheet) {
        self.forces(sheet);
        self.kick(sheet, -0.5 * self.dt);
    }

    /// Brings the velocities to the time of the positions, to ask for the energy; `begin` again before going on.
    pub fn finish(&mut self, sheet: &mut Sheet) {
        self.forces(sheet);
        self.kick(sheet, 0.5 * self.dt);
    }

    /// One step: kick, then drift.
    pub fn step(&mut self, sheet: &mut Sheet) {
        self.forces(sheet);
        self.kick(sheet, self.dt);
        for c in 0..3 {
            for (x, v) in sheet.x[c].iter_mut().zip(&sheet.v[c]) {
                *x += self.dt * v;
            }
        }
    }

    fn forces(&mut self, sheet: &Sheet) {
        for c in 0..3 {
            self.f[c].copy_from_slice(&self.air[c]);
        }
        add_stretch(sheet, sheet.mechanics.stretch_damping, &mut self.f);
        self.shape
            .add_shear(sheet.nx, sheet.ny, &sheet.x, &mut self.f);
        self.shape
            .add_bending(sheet.nx, sheet.ny, &sheet.x, &mut self.f);
    }

    fn kick(&self, sheet: &mut Sheet, dt: f64) {
        for c in 0..3 {
            let g = if c == 1 { -self.gravity } else { 0.0 };
            for ((v, f), w) in sheet.v[c].iter_mut().zip(&self.f[c]).zip(&sheet.inv_mass) {
                if *w > 0.0 {
                    *v += dt * (g + w * f - self.settling * *v);
                }
            }
        }
    }
}
