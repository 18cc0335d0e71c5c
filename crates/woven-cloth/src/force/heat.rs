//! Folds set by heat: the cloth is at ease where its weft has the curvature of its pleats, or a share of it.
//!
//! The second difference of a weft thread at ease is s n, with n the unit normal of the cloth and s a signed number per column, so that
//! the force of bending B/h^3 (d - s n) has beside its part for flat cloth one that only asks for the normal. That part is
//! explicit, at the predicted place.

use crate::rail::Pleats;
use crate::sheet::{Field, Sheet, half_at_ends};

/// The rest curvature of a sheet and what it pushes with.
#[derive(Clone, Debug)]
pub(crate) struct HeatSet {
    /// Second difference of every column at ease along the normal (weft x warp downwards), m.
    rest: Vec<f64>,
    /// The place that normals are taken at.
    at: Field,
    /// The force, N.
    pub(crate) force: Field,
}

impl HeatSet {
    /// Folds of these second differences, one a column of `sheet`, m.
    pub(crate) fn new(sheet: &Sheet, rest: Vec<f64>) -> Self {
        let zeros = || -> Field { std::array::from_fn(|_| vec![0.0; sheet.len()]) };
        Self {
            rest,
            at: zeros(),
            force: zeros(),
        }
    }

    /// The folds of a heading set to the `share` of their curvature; none when nothing is set.
    pub(crate) fn of_pleats(sheet: &Sheet, pleats: &Pleats, share: f64) -> Option<Self> {
        if share <= 0.0 {
            return None;
        }
        let row = pleats.row(sheet.nx, 0.0);
        let mut rest = vec![0.0; sheet.nx];
        for (p, rest) in row.windows(3).zip(&mut rest[1..]) {
            // The weft runs along (x, z), the warp downwards: their cross product is (z, -x).
            let (ex, ez) = (p[2][0] - p[0][0], p[2][1] - p[0][1]);
            let d = [0, 1].map(|c| p[0][c] - 2.0 * p[1][c] + p[2][c]);
            *rest = share * (d[0] * ez - d[1] * ex) / ex.hypot(ez).max(1e-12);
        }
        Some(Self::new(sheet, rest))
    }

    /// The force at the place that a step of `hp` seconds predicts.
    pub(crate) fn update(&mut self, sheet: &Sheet, x_old: &Field, third: f64, hp: f64) {
        let (nx, ny) = (sheet.nx, sheet.ny);
        for c in 0..3 {
            let (x, v, old) = (&sheet.x[c], &sheet.v[c], &x_old[c]);
            for (k, at) in self.at[c].iter_mut().enumerate() {
                *at = x[k] + (x[k] - old[k]) * third + hp * v[k];
            }
            self.force[c].fill(0.0);
        }
        let stiffness = sheet.mechanics.bending()[1] * sheet.hy / sheet.hx.powi(3);
        let at = &self.at;
        let between =
            |a: usize, b: usize| -> [f64; 3] { std::array::from_fn(|c| at[c][b] - at[c][a]) };
        for j in 0..ny {
            let (above, below) = (if j > 0 { nx } else { 0 }, if j + 1 < ny { nx } else { 0 });
            for i in 1..nx - 1 {
                let k = j * nx + i;
                let (e, f) = (between(k - 1, k + 1), between(k - above, k + below));
                let n = [
                    e[1] * f[2] - e[2] * f[1],
                    e[2] * f[0] - e[0] * f[2],
                    e[0] * f[1] - e[1] * f[0],
                ];
                let size = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
                let t = stiffness * half_at_ends(j, ny) * self.rest[i] / size.max(1e-12);
                for c in 0..3 {
                    let t = t * n[c];
                    self.force[c][k - 1] += t;
                    self.force[c][k] -= 2.0 * t;
                    self.force[c][k + 1] += t;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fabrics::Mechanics;
    use crate::step::{Stepper, stable_step};

    /// Five even waves of two metres of cloth on one of rail.
    fn waves() -> Pleats {
        Pleats {
            width: 1.0,
            fabric_width: 2.0,
            pleats: 5.0,
            heading: crate::rail::Heading::Wave,
            irregularity: 0.0,
            seed: 1,
        }
    }

    #[test]
    fn a_strip_at_ease_on_a_circle_rolls_up_to_it() {
        let m = Mechanics {
            bending_warp: 2e-4,
            bending_weft: 2e-4,
            ..Mechanics::default()
        };
        let mut sheet = Sheet::flat(21, 3, 0.2, 0.02, m);
        // Curvature 1/r with r = 0.1 m: over 0.2 m the strip turns by 2 rad.
        let (h, r) = (sheet.hx, 0.1);
        let mut stepper = Stepper::new(&sheet, stable_step(&sheet, 0.0), 0.0);
        stepper.settling = 20.0;
        stepper.heat_set = Some(HeatSet::new(&sheet, vec![h * h / r; 21]));
        for _ in 0..(1.5 / stepper.dt()) as usize {
            stepper.step(&mut sheet);
        }
        let (a, b) = (sheet.position(21), sheet.position(41));
        let chord = (0..3).map(|c| (b[c] - a[c]).powi(2)).sum::<f64>().sqrt();
        // The ends' outer segments stay straight: the arc that bends is one segment shorter. 2 % for that and the coarse polygon.
        let want = 2.0 * r * (0.5 * (0.2 - h) / r).sin() + h * (0.5 * (0.2 - h) / r).cos();
        assert!((chord / want - 1.0).abs() < 0.02, "{chord} for {want}");
    }

    #[test]
    fn pleats_at_ease_are_those_of_the_heading() {
        let sheet = Sheet::flat(61, 3, 2.0, 0.1, Mechanics::default());
        let pleats = waves();
        assert!(HeatSet::of_pleats(&sheet, &pleats, 0.0).is_none());
        let set = HeatSet::of_pleats(&sheet, &pleats, 0.5).unwrap();
        let row = pleats.row(61, 0.0);
        for i in 1..60 {
            let d = [0, 1].map(|c| row[i - 1][c] - 2.0 * row[i][c] + row[i + 1][c]);
            // Chords of one length: the second difference lies along the normal.
            assert!((set.rest[i].abs() - 0.5 * d[0].hypot(d[1])).abs() < 1e-9);
        }
        assert!(
            set.rest[3] * set.rest[9] < 0.0,
            "crest and trough bend to opposite sides"
        );
    }

    #[test]
    fn cloth_wholly_set_has_no_moment_in_its_pleats() {
        let mut sheet = Sheet::flat(61, 5, 2.0, 0.1, Mechanics::default());
        let pleats = waves();
        // As a curtain is hung: the weft along x and z, the warp down.
        for (i, p) in pleats.row(61, 0.0).into_iter().enumerate() {
            for j in 0..5 {
                sheet.set_position(j * 61 + i, [p[0], -(j as f64) * sheet.hy, p[1]]);
            }
        }
        let bending = crate::force::all_forces(&sheet);
        let mut set = HeatSet::of_pleats(&sheet, &pleats, 1.0).unwrap();
        let x = sheet.x.clone();
        set.update(&sheet, &x, 0.0, 0.0);
        let most = bending.iter().flatten().fold(0.0f64, |m, f| m.max(f.abs()));
        assert!(most > 1e-6);
        for (f, more) in bending.iter().flatten().zip(set.force.iter().flatten()) {
            // Rounding of the threads' stretch, 2000 N/m times 1e-16 m, is the most that is left.
            assert!(
                (f + more).abs() < 1e-6 * most + 1e-12,
                "{f} {more} of {most}"
            );
        }
    }
}
