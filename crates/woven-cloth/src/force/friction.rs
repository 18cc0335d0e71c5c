//! Friction between yarns: the hysteresis of bending and of shear that Kawabata's tests show (2HB and 2HG).
//!
//! Beside its elastic part each bend and each cell carries a spring in series with a slider (Prandtl 1928): the moment follows the
//! curvature with a few times the fabric's own stiffness until the slider gives way at half of 2HB, and the other way round after
//! a turn. So a cycle of bending encloses a loop of height 2HB, and cloth at rest may keep a part of a fold. Lahey and Heppler (2004)
//! trace the measured loops to the friction of yarns.

use crate::sheet::{Field, Sheet, half_at_ends};

/// Stiffness of the springs before the sliders, in the fabric's own.
pub(crate) const RISE: f64 = 3.0;

/// The sliders of a sheet.
#[derive(Clone, Debug)]
pub(crate) struct Friction {
    /// Curvature, 1/m, along warp and weft at which the slider of each vertex has no moment.
    pub(crate) bend: [Field; 2],
    /// The same for the shear of each cell, rad.
    pub(crate) shear: Vec<f64>,
    /// Where the sliders are looked at, and what they push with, N.
    at: Field,
    pub(crate) force: Field,
}

impl Friction {
    /// The sliders of a flat sheet at ease; none for a fabric without hysteresis.
    pub(crate) fn new(sheet: &Sheet) -> Option<Self> {
        let m = &sheet.mechanics;
        let zeros = || -> Field { std::array::from_fn(|_| vec![0.0; sheet.len()]) };
        (m.bending_hysteresis > 0.0 || m.shear_hysteresis > 0.0).then(|| Self {
            bend: [zeros(), zeros()],
            shear: vec![0.0; (sheet.nx - 1) * (sheet.ny - 1)],
            at: zeros(),
            force: zeros(),
        })
    }

    /// All state in one row, for a saved run.
    pub(crate) fn state(&self) -> impl Iterator<Item = &f64> {
        self.bend.iter().flatten().flatten().chain(&self.shear)
    }

    /// The same, to be set.
    pub(crate) fn state_mut(&mut self) -> impl Iterator<Item = &mut f64> {
        let bend = self.bend.iter_mut().flatten().flatten();
        bend.chain(&mut self.shear)
    }

    /// Moves the sliders to the places x + (x - x₋)/3 + h' ṽ of a step's prediction and takes up what they push with.
    pub(crate) fn update(&mut self, sheet: &Sheet, old: [&Field; 2], third: f64, hp: f64) {
        for c in 0..3 {
            let (x, v) = (&sheet.x[c], &sheet.v[c]);
            for (k, at) in self.at[c].iter_mut().enumerate() {
                let faster = v[k] + (v[k] - old[1][c][k]) * third;
                *at = x[k] + (x[k] - old[0][c][k]) * third + hp * faster;
            }
            self.force[c].fill(0.0);
        }
        let m = &sheet.mechanics;
        let [warp, weft] = m.bending();
        let (nx, ny) = (sheet.nx, sheet.ny);
        for j in 0..ny {
            for i in 0..nx {
                let k = j * nx + i;
                if j > 0 && j + 1 < ny {
                    let width = sheet.hx * half_at_ends(i, nx);
                    self.bend(0, k, nx, sheet.hy, width, [warp, m.bending_hysteresis]);
                }
                if i > 0 && i + 1 < nx {
                    let width = sheet.hy * half_at_ends(j, ny);
                    self.bend(1, k, 1, sheet.hx, width, [weft, m.bending_hysteresis]);
                }
                if i + 1 < nx && j + 1 < ny && m.shear_hysteresis > 0.0 {
                    self.slide(sheet, j * (nx - 1) + i, k);
                }
            }
        }
    }

    /// One bend at vertex `k` between the vertices `step` numbers before and after it, `h` m away, `width` m wide.
    fn bend(
        &mut self,
        thread: usize,
        k: usize,
        step: usize,
        h: f64,
        width: f64,
        [stiffness, limit]: [f64; 2],
    ) {
        let rise = RISE * stiffness;
        if limit <= 0.0 || rise <= 0.0 {
            return;
        }
        let at = &self.at;
        let kappa: [f64; 3] =
            std::array::from_fn(|c| (at[c][k - step] - 2.0 * at[c][k] + at[c][k + step]) / (h * h));
        let slider = &mut self.bend[thread];
        let mut moment: [f64; 3] = std::array::from_fn(|c| rise * (kappa[c] - slider[c][k]));
        let size = moment.iter().map(|m| m * m).sum::<f64>().sqrt();
        if size > limit {
            moment = moment.map(|m| m * limit / size);
            for c in 0..3 {
                slider[c][k] = kappa[c] - moment[c] / rise;
            }
        }
        for c in 0..3 {
            let t = moment[c] * width / h;
            self.force[c][k - step] -= t;
            self.force[c][k] += 2.0 * t;
            self.force[c][k + step] -= t;
        }
    }

    /// The shear of a cell whose first vertex is `k`.
    fn slide(&mut self, sheet: &Sheet, cell: usize, k: usize) {
        let (nx, hx, hy) = (sheet.nx, sheet.hx, sheet.hy);
        let limit = sheet.mechanics.shear_hysteresis;
        let rise = RISE * sheet.mechanics.shear;
        if rise <= 0.0 {
            return;
        }
        let corners = [k, k + 1, k + nx, k + nx + 1];
        let e: [[f64; 2]; 3] = std::array::from_fn(|c| {
            let [a, b, low, d] = corners.map(|k| self.at[c][k]);
            [(d - a + b - low) * 0.5 / hx, (d - a + low - b) * 0.5 / hy]
        });
        let gamma: f64 = e.iter().map(|e| e[0] * e[1]).sum();
        let mut stress = rise * (gamma - self.shear[cell]);
        if stress.abs() > limit {
            stress = limit.copysign(stress);
            self.shear[cell] = gamma - stress / rise;
        }
        let t = stress * hx * hy;
        let (p, q) = (0.5 * t / hx, 0.5 * t / hy);
        for c in 0..3 {
            let (sum, difference) = (p * e[c][1] + q * e[c][0], q * e[c][0] - p * e[c][1]);
            self.force[c][corners[0]] += sum;
            self.force[c][corners[1]] += difference;
            self.force[c][corners[2]] -= difference;
            self.force[c][corners[3]] -= sum;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fabrics::Mechanics;

    /// Work done by the sliders over one cycle of bending between curvatures -K and K, J per m² of cloth.
    #[test]
    fn a_cycle_of_bending_encloses_a_loop_of_twice_the_limit() {
        let mechanics = Mechanics {
            bending_warp: 5e-6,
            bending_weft: 5e-6,
            bending_hysteresis: 1.25e-4,
            ..Mechanics::default()
        };
        let mut sheet = Sheet::flat(3, 12, 0.02, 0.11, mechanics);
        let mut friction = Friction::new(&sheet).unwrap();
        let (h, most) = (sheet.hy, 100.0);
        let width = 0.02;
        let mut loop_work = 0.0;
        // Down the middle of the strip, one bend in its interior; the moment is the force on its neighbour times h / width.
        let mut last = 0.0;
        let cycle = |n: i32| most * (f64::from(n) * std::f64::consts::TAU / 400.0).sin();
        let mut seen = [0.0f64; 2];
        for n in 0..=800 {
            let kappa = cycle(n);
            for k in 0..sheet.len() {
                let s = (k / 3) as f64 * h;
                let x = sheet.x[0][k];
                sheet.set_position(k, [x, -s, 0.5 * kappa * s * s]);
            }
            let (x, v) = (sheet.x.clone(), sheet.v.clone());
            friction.update(&sheet, [&x, &v], 0.0, 0.0);
            // Force on the hem's end of a straight run of bends: only the last bend acts there.
            let moment = -friction.force[2][11 * 3 + 1] * h / (0.5 * width);
            if n >= 400 {
                loop_work += moment * (kappa - last);
                // Passing through no curvature on the way down and up.
                if n == 600 {
                    seen[0] = moment;
                }
                if n == 800 {
                    seen[1] = moment;
                }
            }
            last = kappa;
        }
        assert!(
            ((seen[1] - seen[0]) / 2.5e-4 - 1.0).abs() < 1e-9,
            "2HB: {seen:?}"
        );
        // A loop of height 2HB between -K and K less its slanting ends: 4 HB (K - HB/(3 B)).
        let want = 4.0 * 1.25e-4 * (most - 1.25e-4 / 1.5e-5);
        assert!(
            (loop_work / want - 1.0).abs() < 0.02,
            "{loop_work} for {want}"
        );
    }

    #[test]
    fn sheared_cloth_keeps_a_part_of_its_shear_and_inner_forces_sum_to_nothing() {
        let mechanics = Mechanics {
            shear: 20.0,
            shear_hysteresis: 0.5,
            ..Mechanics::default()
        };
        let mut sheet = Sheet::flat(4, 4, 0.3, 0.3, mechanics);
        let mut friction = Friction::new(&sheet).unwrap();
        let flat = sheet.clone();
        for gamma in [0.2, 0.0] {
            for k in 0..sheet.len() {
                let p = flat.position(k);
                sheet.set_position(k, [p[0] + gamma * p[1], p[1], 0.0]);
            }
            let (x, v) = (sheet.x.clone(), sheet.v.clone());
            friction.update(&sheet, [&x, &v], 0.0, 0.0);
        }
        // Slid to 0.2 - 0.5/60, so that at 0 it pulls back with its full limit.
        assert!(
            (friction.shear[0].abs() - 0.5 / 60.0).abs() < 1e-9,
            "{}",
            friction.shear[0]
        );
        for f in &friction.force {
            assert!(f.iter().sum::<f64>().abs() < 1e-12);
        }
        assert!(friction.force[0].iter().any(|f| f.abs() > 1e-3));
    }
}
