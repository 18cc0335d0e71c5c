//! The production solver: small steps of BDF2, shear and bending at the predicted place, threads solved directly.
//!
//! One step of length dt, with h' = 2 dt/3:
//! 1. predict: base = (4x - x₋)/3, ṽ = (4v - v₋)/3, x̃ = base + h' ṽ (the second-order backward difference formula);
//! 2. x̃ += h'² (g + M⁻¹ f(x̃)) with shear, bending and air. Evaluated at x̃ this equals the implicit formula with a frequency
//!    ω² / (1 - h'²ω²): stable while h'ω < 1, dissipative at high and neutral at low frequencies;
//! 3. contact of the cloth with itself;
//! 4. all weft threads, then all warp threads, each by one exact tridiagonal solve (`line`);
//! 5. obstacles; v = (x - base)/h'.
//!
//! The first step after a start is backward Euler (h' = dt, base = x). Damping acts on the rate of deformation only: forces are
//! taken at x̃ + tau ṽ.

use crate::contact::{Obstacles, SelfContact};
use crate::force::Shape;
use crate::line::{Block, LANES, Springs};
use crate::sheet::{Field, Sheet, half_at_ends};

/// How far a step may go: the largest h'²ω² of shear, bending and tension waves.
const STABLE: f64 = 0.6;

/// The state of the production solver beside the sheet itself.
#[derive(Clone, Debug)]
pub struct Stepper {
    dt: f64,
    gravity: f64,
    shape: Shape,
    tau_shear: f64,
    tau_bending: f64,
    /// Positions and velocities one step back.
    pub(crate) x_old: Field,
    pub(crate) v_old: Field,
    /// lambda of every warp edge, at the index of its upper vertex, and of every weft edge, at its left vertex: the forces of the
    /// step before (times h'²), which this step starts from.
    pub(crate) lambda: [Vec<f64>; 2],
    /// False until there are two steps to look back on.
    pub(crate) history: bool,
    /// Force of the air, held over the steps of a tick, N.
    pub air: [Vec<f64>; 3],
    /// Damping of the absolute velocity, 1/s: 0 but while settling.
    pub settling: f64,
    /// Planes and boxes that the cloth cannot enter.
    pub obstacles: Obstacles,
    /// Contact of the cloth with itself.
    pub self_contact: Option<SelfContact>,
    pins: Vec<usize>,
    base: Field,
    vt: Field,
    pred: Field,
    probe: Field,
    f: Field,
    block: Block,
}

/// The longest stable step, s, for a sheet: shear, bending and the waves of a tension of three times its weight.
#[must_use]
pub fn stable_step(sheet: &Sheet, gravity: f64) -> f64 {
    let height = sheet.hy * (sheet.ny - 1) as f64;
    let tension = 4.0 * 3.0 * gravity * height / sheet.hx.min(sheet.hy).powi(2);
    let omega2 = Shape::shear_omega2(sheet) + Shape::bending_omega2(sheet) + tension;
    1.5 * (STABLE / omega2).sqrt()
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
            tau_shear: tau.min(limit(Shape::shear_omega2(sheet))),
            tau_bending: tau.min(limit(Shape::bending_omega2(sheet))),
            x_old: zeros(n),
            v_old: zeros(n),
            lambda: [vec![0.0; n], vec![0.0; n]],
            history: false,
            air: zeros(n),
            settling: 0.0,
            obstacles: Obstacles::default(),
            self_contact: None,
            pins: (0..n).filter(|&k| sheet.inv_mass[k] == 0.0).collect(),
            base: zeros(n),
            vt: zeros(n),
            pred: zeros(n),
            probe: zeros(n),
            f: zeros(n),
            block: Block::new(sheet.nx.max(sheet.ny)),
        }
    }

    /// Length of a step, s.
    #[must_use]
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// Forgets the past, as after a jump of positions or velocities.
    pub fn restart(&mut self) {
        self.history = false;
    }

    /// One step.
    pub fn step(&mut self, sheet: &mut Sheet) {
        let (nx, ny) = (sheet.nx, sheet.ny);
        let hp = if self.history {
            self.dt * 2.0 / 3.0
        } else {
            self.dt
        };
        if !self.history {
            self.lambda.iter_mut().for_each(|l| l.fill(0.0));
        }
        self.predict(sheet, hp);
        self.add_forces(sheet, hp);
        // Before the threads are solved: contact may push folds apart but never leaves a thread stretched.
        if let Some(contact) = &mut self.self_contact {
            contact.resolve(sheet, &mut self.pred, hp);
        }
        let damping = sheet.mechanics.stretch_damping / hp;
        for j0 in (0..ny).step_by(LANES) {
            self.weft_block(sheet, j0, hp, damping);
        }
        for i0 in (0..nx).step_by(LANES) {
            self.warp_block(sheet, i0, hp, damping);
        }
        self.obstacles.resolve(sheet, &mut self.pred);
        for &k in &self.pins {
            for c in 0..3 {
                self.pred[c][k] = sheet.x[c][k];
            }
        }
        let r = 1.0 / hp;
        for c in 0..3 {
            std::mem::swap(&mut self.x_old[c], &mut sheet.x[c]);
            std::mem::swap(&mut self.v_old[c], &mut sheet.v[c]);
            std::mem::swap(&mut self.pred[c], &mut sheet.x[c]);
            let (v, x, base) = (&mut sheet.v[c], &sheet.x[c], &self.base[c]);
            for ((v, x), b) in v.iter_mut().zip(x).zip(base) {
                *v = (x - b) * r;
            }
        }
        for &k in &self.pins {
            for c in 0..3 {
                sheet.v[c][k] = 0.0;
                self.v_old[c][k] = 0.0;
                self.x_old[c][k] = sheet.x[c][k];
            }
        }
        if !self.history {
            // The next step has h' = 2/3 of this one's.
            self.lambda
                .iter_mut()
                .flatten()
                .for_each(|l| *l *= 4.0 / 9.0);
        }
        self.history = true;
    }

    fn predict(&mut self, sheet: &Sheet, hp: f64) {
        const THIRD: f64 = 1.0 / 3.0;
        for c in 0..3 {
            let n = sheet.len();
            let (x, v) = (&sheet.x[c][..n], &sheet.v[c][..n]);
            let (xo, vo) = (&self.x_old[c][..n], &self.v_old[c][..n]);
            let (base, vt, pred) = (
                &mut self.base[c][..n],
                &mut self.vt[c][..n],
                &mut self.pred[c][..n],
            );
            if self.history {
                for k in 0..n {
                    // x + (x - x₋)/3 rounds better than (4x - x₋)/3.
                    base[k] = x[k] + (x[k] - xo[k]) * THIRD;
                    vt[k] = v[k] + (v[k] - vo[k]) * THIRD;
                    pred[k] = base[k] + hp * vt[k];
                }
            } else {
                for k in 0..n {
                    base[k] = x[k];
                    vt[k] = v[k];
                    pred[k] = base[k] + hp * vt[k];
                }
            }
        }
    }

    fn add_forces(&mut self, sheet: &Sheet, hp: f64) {
        let (nx, ny) = (sheet.nx, sheet.ny);
        for c in 0..3 {
            self.f[c].copy_from_slice(&self.air[c]);
        }
        self.start_from_last_tension(nx, ny, 1.0 / (hp * hp));
        self.probe_at(self.tau_shear);
        self.shape.add_shear(nx, ny, &self.probe, &mut self.f);
        self.probe_at(self.tau_bending);
        self.shape.add_bending(nx, ny, &self.probe, &mut self.f);
        let h2 = hp * hp;
        for c in 0..3 {
            let g = if c == 1 { -self.gravity } else { 0.0 };
            let (pred, f, vt, w) = (&mut self.pred[c], &self.f[c], &self.vt[c], &sheet.inv_mass);
            let settling = self.settling;
            for ((p, f), (v, w)) in pred.iter_mut().zip(f).zip(vt.iter().zip(w)) {
                *p += h2 * (g + w * f - settling * v);
            }
        }
        for &k in &self.pins {
            for c in 0..3 {
                self.pred[c][k] = sheet.x[c][k];
            }
        }
    }

    /// Adds the thread forces of the step before, along the predicted directions. The solves below then only correct them: what
    /// warp and weft do to each other, which one pass would leave too soft, is made up over a few steps.
    fn start_from_last_tension(&mut self, nx: usize, ny: usize, r: f64) {
        let [x, y, z] = &self.pred;
        let [fx, fy, fz] = &mut self.f;
        let mut edges = |lambda: &[f64], a0: usize, b0: usize, count: usize| {
            for k in 0..count {
                let (a, b) = (a0 + k, b0 + k);
                let (dx, dy, dz) = (x[b] - x[a], y[b] - y[a], z[b] - z[a]);
                let t = lambda[a] * r / (dx * dx + dy * dy + dz * dz).sqrt().max(1e-12);
                fx[a] -= t * dx;
                fx[b] += t * dx;
                fy[a] -= t * dy;
                fy[b] += t * dy;
                fz[a] -= t * dz;
                fz[b] += t * dz;
            }
        };
        for j in 0..ny {
            if j + 1 < ny {
                edges(&self.lambda[0], j * nx, (j + 1) * nx, nx);
            }
            edges(&self.lambda[1], j * nx, j * nx + 1, nx - 1);
        }
    }

    fn probe_at(&mut self, tau: f64) {
        for c in 0..3 {
            for ((y, p), v) in self.probe[c].iter_mut().zip(&self.pred[c]).zip(&self.vt[c]) {
                *y = p + tau * v;
            }
        }
    }

    fn warp_block(&mut self, sheet: &Sheet, i0: usize, hp: f64, damping: f64) {
        let (nx, ny) = (sheet.nx, sheet.ny);
        let lanes = LANES.min(nx - i0);
        let b = &mut self.block;
        for j in 0..ny {
            let r = j * nx + i0;
            b.x[j][..lanes].copy_from_slice(&self.pred[0][r..r + lanes]);
            b.y[j][..lanes].copy_from_slice(&self.pred[1][r..r + lanes]);
            b.z[j][..lanes].copy_from_slice(&self.pred[2][r..r + lanes]);
            b.w[j][..lanes].copy_from_slice(&sheet.inv_mass[r..r + lanes]);
            b.lambda[j][..lanes].copy_from_slice(&self.lambda[0][r..r + lanes]);
            b.fill_spare(j, lanes);
            if damping > 0.0 {
                for c in 0..3 {
                    for l in 0..lanes {
                        b.d[c][j][l] = self.pred[c][r + l] - self.base[c][r + l];
                    }
                }
            }
        }
        let mut alpha = [0.0; LANES];
        for (l, a) in alpha.iter_mut().enumerate() {
            *a = 1.0
                / (sheet.mechanics.tensile_warp
                    * sheet.hx
                    * half_at_ends((i0 + l).min(nx - 1), nx)
                    / sheet.hy
                    * hp
                    * hp);
        }
        b.solve(
            ny,
            &Springs {
                rest: sheet.hy,
                alpha,
                damping,
                stiffening: sheet.mechanics.tensile_stiffening,
            },
        );
        for j in 0..ny {
            let r = j * nx + i0;
            self.pred[0][r..r + lanes].copy_from_slice(&b.x[j][..lanes]);
            self.pred[1][r..r + lanes].copy_from_slice(&b.y[j][..lanes]);
            self.pred[2][r..r + lanes].copy_from_slice(&b.z[j][..lanes]);
            self.lambda[0][r..r + lanes].copy_from_slice(&b.lambda[j][..lanes]);
        }
    }

    fn weft_block(&mut self, sheet: &Sheet, j0: usize, hp: f64, damping: f64) {
        let (nx, ny) = (sheet.nx, sheet.ny);
        let lanes = LANES.min(ny - j0);
        let b = &mut self.block;
        for l in 0..lanes {
            let r = (j0 + l) * nx;
            for i in 0..nx {
                b.x[i][l] = self.pred[0][r + i];
                b.y[i][l] = self.pred[1][r + i];
                b.z[i][l] = self.pred[2][r + i];
                b.w[i][l] = sheet.inv_mass[r + i];
                b.lambda[i][l] = self.lambda[1][r + i];
            }
            if damping > 0.0 {
                for c in 0..3 {
                    for i in 0..nx {
                        b.d[c][i][l] = self.pred[c][r + i] - self.base[c][r + i];
                    }
                }
            }
        }
        if lanes < LANES {
            for i in 0..nx {
                b.fill_spare(i, lanes);
            }
        }
        let mut alpha = [0.0; LANES];
        for (l, a) in alpha.iter_mut().enumerate() {
            *a = 1.0
                / (sheet.mechanics.tensile_weft
                    * sheet.hy
                    * half_at_ends((j0 + l).min(ny - 1), ny)
                    / sheet.hx
                    * hp
                    * hp);
        }
        b.solve(
            nx,
            &Springs {
                rest: sheet.hx,
                alpha,
                damping,
                stiffening: sheet.mechanics.tensile_stiffening,
            },
        );
        for l in 0..lanes {
            let r = (j0 + l) * nx;
            for i in 0..nx {
                self.pred[0][r + i] = b.x[i][l];
                self.pred[1][r + i] = b.y[i][l];
                self.pred[2][r + i] = b.z[i][l];
                self.lambda[1][r + i] = b.lambda[i][l];
            }
        }
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
