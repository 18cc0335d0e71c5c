//! The production solver: small steps of BDF2, shear and bending at the predicted place, threads solved directly.
//!
//! One step of length dt, with h' = 2 dt/3:
//! 1. predict: base = (4x - x₋)/3, ṽ = (4v - v₋)/3, x̃ = base + h' ṽ (the second-order backward difference formula);
//! 2. x̃ += h'² (g + M⁻¹ f(x̃)) with shear, bending, air and the warp's tension of the step before. Evaluated at x̃ this equals the
//!    implicit formula with a frequency ω² / (1 - h'²ω²): stable while h'ω < 1, dissipative at high and neutral at low frequencies;
//! 3. contact of the cloth with itself, as a cushion;
//! 4. all weft threads, then all warp threads, each by one exact tridiagonal solve (`line`);
//! 5. obstacles; the guard, which lets nothing have passed through anything; v = (x - base)/h'.
//!
//! The first step after a start is backward Euler (h' = dt, base = x). Damping acts on the rate of deformation only: forces are
//! taken at x̃ + tau ṽ.
//!
//! Work is cut into bands of rows (1 to 4) and blocks of eight columns (4) that never write the same number; their size does
//! not depend on the count of threads, so neither do the bits.

mod columns;
mod length;
mod rows;

pub use length::{gust_step, stable_step};

use crate::contact::{Obstacles, SelfContact};
use crate::force::{Friction, HeatSet, Shape};
use crate::line::{Block, LANES, Lane};
use crate::sheet::{Field, Sheet};
use crate::work::{over_bands, widest, worth_threads};
use rayon::prelude::*;

/// The state of the production solver beside the sheet itself.
#[derive(Clone, Debug)]
pub struct Stepper {
    dt: f64,
    gravity: f64,
    shape: Shape,
    /// Friction between yarns, for a fabric that has it.
    pub(crate) friction: Option<Friction>,
    /// Folds that are set by heat.
    pub(crate) heat_set: Option<HeatSet>,
    /// Retardation times of shear and of bending, s.
    tau: [f64; 2],
    /// Positions and velocities one step back.
    pub(crate) x_old: Field,
    pub(crate) v_old: Field,
    /// False until there are two steps to look back on.
    pub(crate) history: bool,
    /// Force of the air, held over the steps of a tick, N.
    pub air: [Vec<f64>; 3],
    /// Damping of the absolute velocity, 1/s: 0 but while settling.
    pub settling: f64,
    /// Planes and boxes that the cloth cannot enter.
    pub obstacles: Obstacles,
    /// The hole in the obstacles' wall, `[left, right, bottom, top]` in m: an open window.
    pub window: Option<[f64; 4]>,
    /// Contact of the cloth with itself.
    pub self_contact: Option<SelfContact>,
    /// The pinned vertices, ascending.
    pub(crate) pins: Vec<usize>,
    /// Where the pinned vertices are after the next step, m; they stay where they are when this is empty.
    pub(crate) pin_places: Vec<[f64; 3]>,
    /// h' of the present step, s.
    hp: f64,
    /// The place that a step works on.
    q: Field,
    /// The warp threads, eight at a time; their lambda is the force of the step before (times h'²), which a step starts from.
    warp: Vec<Block>,
    /// Inverse masses of the weft threads, eight rows at a time.
    weft_w: Vec<Vec<Lane>>,
}

fn zeros(n: usize) -> Field {
    [vec![0.0; n], vec![0.0; n], vec![0.0; n]]
}

impl Stepper {
    /// A solver for `sheet` with steps of `dt` seconds under `gravity` m/s².
    #[must_use]
    pub fn new(sheet: &Sheet, dt: f64, gravity: f64) -> Self {
        let n = sheet.len();
        // Explicit damping is stable while h' tau ω² stays small.
        let limit = |omega2: f64| 0.3 / (dt * omega2).max(1e-9);
        let tau = sheet.mechanics.bending_damping;
        Self {
            dt,
            gravity,
            shape: Shape::new(sheet),
            friction: Friction::new(sheet),
            heat_set: None,
            tau: [
                tau.min(limit(Shape::shear_omega2(sheet))),
                tau.min(limit(Shape::bending_omega2(sheet))),
            ],
            x_old: zeros(n),
            v_old: zeros(n),
            history: false,
            air: zeros(n),
            settling: 0.0,
            obstacles: Obstacles::default(),
            window: None,
            self_contact: None,
            pins: (0..n).filter(|&k| sheet.inv_mass[k] == 0.0).collect(),
            pin_places: Vec::new(),
            hp: dt,
            q: zeros(n),
            warp: vec![Block::new(sheet.ny); sheet.nx.div_ceil(LANES)],
            weft_w: vec![vec![[0.0; LANES]; sheet.nx]; sheet.ny.div_ceil(LANES)],
        }
    }

    /// Length of a step, s.
    #[must_use]
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// Forgets the past, as after a jump of positions or velocities or a change of masses.
    pub fn restart(&mut self) {
        self.history = false;
        if let Some(contact) = &mut self.self_contact {
            contact.restart();
        }
    }

    /// Takes the masses of the sheet and forgets the tensions.
    fn begin(&mut self, sheet: &Sheet) {
        let (nx, ny) = (sheet.nx, sheet.ny);
        for (k, block) in self.warp.iter_mut().enumerate() {
            for j in 0..ny {
                block.lambda[j] = [0.0; LANES];
                block.w[j] =
                    std::array::from_fn(|l| sheet.inv_mass[j * nx + (k * LANES + l).min(nx - 1)]);
            }
        }
        for (k, w) in self.weft_w.iter_mut().enumerate() {
            for (i, w) in w.iter_mut().enumerate() {
                *w = std::array::from_fn(|l| sheet.inv_mass[(k * LANES + l).min(ny - 1) * nx + i]);
            }
        }
    }

    /// The tension of every warp edge at the index of its upper vertex (times h'², negative is tension), kg m.
    pub(crate) fn tensions(&self, nx: usize, ny: usize) -> Vec<f64> {
        (0..nx * ny)
            .map(|k| self.warp[k % nx / LANES].lambda[k / nx][k % nx % LANES])
            .collect()
    }

    /// Sets what `tensions` told, on a solver that goes on with a saved state.
    pub(crate) fn set_tensions(&mut self, sheet: &Sheet, tensions: &[f64]) {
        self.begin(sheet);
        let nx = sheet.nx;
        for (k, block) in self.warp.iter_mut().enumerate() {
            for (j, lambda) in block.lambda.iter_mut().enumerate() {
                *lambda = std::array::from_fn(|l| tensions[j * nx + (k * LANES + l).min(nx - 1)]);
            }
        }
    }

    /// One step.
    pub fn step(&mut self, sheet: &mut Sheet) {
        let mut contact = self.self_contact.take();
        self.predict(sheet, contact.is_none());
        if let Some(contact) = &mut contact {
            contact.cushion(&sheet.inv_mass, &sheet.x, &mut self.q, self.hp);
            self.weft(sheet);
        }
        self.hold(sheet);
        if let Some(contact) = &mut contact {
            let (masses, before) = (&sheet.inv_mass, &sheet.x);
            contact.keep_apart(masses, before, &mut self.q, self.hp, worth_threads(sheet));
        }
        self.finish(sheet);
        self.self_contact = contact;
    }

    /// h' of the step that `predict` began, s.
    pub(crate) fn effective_step(&self) -> f64 {
        self.hp
    }

    /// The place that the step has found so far.
    pub(crate) fn place(&mut self) -> &mut Field {
        &mut self.q
    }

    /// The first part of a step: prediction and forces, and the weft too when nothing comes between.
    pub(crate) fn predict(&mut self, sheet: &Sheet, weft_too: bool) {
        self.hp = if self.history {
            self.dt * 2.0 / 3.0
        } else {
            self.begin(sheet);
            self.dt
        };
        if let Some(folds) = &mut self.heat_set {
            let third = if self.history { 1.0 / 3.0 } else { 0.0 };
            folds.update(sheet, &self.x_old, third, self.hp);
        }
        if let Some(friction) = &mut self.friction {
            let third = if self.history { 1.0 / 3.0 } else { 0.0 };
            friction.update(sheet, [&self.x_old, &self.v_old], third, self.hp);
        }
        self.by_rows(sheet, true, weft_too);
    }

    /// The weft's threads, when `predict` has left them out.
    pub(crate) fn weft(&mut self, sheet: &Sheet) {
        self.by_rows(sheet, false, true);
    }

    fn by_rows(&mut self, sheet: &Sheet, forces: bool, weft: bool) {
        let mut q = std::mem::take(&mut self.q);
        let warp = std::mem::take(&mut self.warp);
        let job = rows::Rows {
            stepper: self,
            sheet,
            warp: &warp,
            hp: self.hp,
            damping: sheet.mechanics.stretch_damping / self.hp,
        };
        over_bands(
            &mut q,
            rows::BAND * sheet.nx,
            worth_threads(sheet),
            |band, mut q| {
                rows::with_scratch(|s| {
                    widest(
                        #[inline(always)]
                        || {
                            if forces {
                                job.forces(band, &mut q, s);
                            }
                            if weft {
                                job.weft(band, &mut q, s);
                            }
                        },
                    );
                });
            },
        );
        (self.q, self.warp) = (q, warp);
    }

    /// The warp's threads, then what stands in the way.
    pub(crate) fn hold(&mut self, sheet: &Sheet) {
        let (nx, parallel) = (sheet.nx, worth_threads(sheet));
        let mut q = std::mem::take(&mut self.q);
        let mut warp = std::mem::take(&mut self.warp);
        let job = columns::Columns {
            sheet,
            x_old: &self.x_old,
            history: self.history,
            hp: self.hp,
            damping: sheet.mechanics.stretch_damping / self.hp,
        };
        let solve = |(k, block): (usize, &mut Block)| {
            rows::with_scratch(|s| {
                widest(
                    #[inline(always)]
                    || job.solve(k, block, &q, &mut s.work),
                );
            });
        };
        if parallel {
            warp.par_iter_mut().enumerate().for_each(solve);
        } else {
            warp.iter_mut().enumerate().for_each(solve);
        }
        over_bands(&mut q, rows::BAND * nx, parallel, |band, q| {
            columns::collect(&warp, band * rows::BAND, nx, q);
        });
        self.obstacles.resolve(self.window, sheet, &mut q);
        (self.q, self.warp) = (q, warp);
    }

    /// The end of a step: the new place and velocity.
    pub(crate) fn finish(&mut self, sheet: &mut Sheet) {
        let third = if self.history { 1.0 / 3.0 } else { 0.0 };
        for c in 0..3 {
            let (x, xo, vo) = (&sheet.x[c], &mut self.x_old[c], &mut self.v_old[c]);
            let (q, r) = (&self.q[c], 1.0 / self.hp);
            widest(
                #[inline(always)]
                || columns::finish(x, q, xo, vo, third, r),
            );
            // `x_old` now holds the new place and `v_old` the new velocity.
            std::mem::swap(&mut sheet.x[c], xo);
            std::mem::swap(&mut sheet.v[c], vo);
        }
        if !self.history {
            // The next step has h' = 2/3 of this one's.
            for lambda in self.warp.iter_mut().flat_map(|b| &mut b.lambda).flatten() {
                *lambda *= 4.0 / 9.0;
            }
        }
        self.history = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fabrics::{GRAVITY, Mechanics};

    #[test]
    fn a_free_sheet_falls_as_galileo_says() {
        let mut sheet = Sheet::flat(9, 12, 0.5, 0.6, Mechanics::default());
        let mut stepper = Stepper::new(&sheet, 1.0 / 1200.0, GRAVITY);
        for _ in 0..1200 {
            stepper.step(&mut sheet);
        }
        // First step is backward Euler, the rest second order: error g dt/2 × a part of a step.
        assert!(
            (sheet.x[1][0] + 0.5 * GRAVITY).abs() < 0.0005 * 4.905,
            "{}",
            sheet.x[1][0]
        );
        assert!(sheet.max_strain() < 1e-9, "{}", sheet.max_strain());
    }

    #[test]
    fn a_hung_sheet_stretches_as_its_weight_asks_at_every_count_of_rows() {
        for ny in [17, 49] {
            let m = Mechanics {
                areal_density: 0.12,
                tensile_warp: 2000.0,
                tensile_weft: 2000.0,
                ..Mechanics::default()
            };
            let mut sheet = Sheet::flat(9, ny, 0.4, 2.4, m);
            sheet.pin_top();
            let dt = stable_step(&sheet, GRAVITY).min(1.0 / 1200.0);
            let mut stepper = Stepper::new(&sheet, dt, GRAVITY);
            stepper.settling = 8.0;
            for _ in 0..(2.0 / dt) as usize {
                stepper.step(&mut sheet);
            }
            // rho g H / (2 Y) = 7.063e-4, 1 % is the goal.
            let strain = sheet.mean_warp_strain();
            assert!(
                (strain / 7.0632e-4 - 1.0).abs() < 0.01,
                "{ny} rows: {strain}"
            );
            let weight = sheet.total_mass() * GRAVITY;
            assert!((sheet.support_force(GRAVITY)[1] / weight - 1.0).abs() < 1e-3);
        }
    }
}
