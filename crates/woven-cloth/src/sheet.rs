//! The sheet: a grid of point masses with the springs of a woven cloth, its state in structure-of-arrays form.
//!
//! Vertex (i, j) has index `j * nx + i`; i counts along the weft (x), j along the warp, row 0 is the heading. Masses are
//! lumped by area: half at an edge, a quarter at a corner. That makes the stretch of a hanging sheet exact for any count of rows.

use crate::fabrics::Mechanics;

/// Three arrays, one per coordinate.
pub(crate) type Field = [Vec<f64>; 3];

/// A rectangular sheet of `nx` × `ny` vertices with its material, state and pins.
#[derive(Clone, Debug)]
pub struct Sheet {
    /// Vertices along the weft.
    pub nx: usize,
    /// Vertices along the warp.
    pub ny: usize,
    /// Rest distance along the weft, m.
    pub hx: f64,
    /// Rest distance along the warp, m.
    pub hy: f64,
    /// The fabric.
    pub mechanics: Mechanics,
    /// Positions, m.
    pub x: [Vec<f64>; 3],
    /// Velocities, m/s.
    pub v: [Vec<f64>; 3],
    /// Masses, kg.
    pub mass: Vec<f64>,
    /// Inverse masses, 1/kg; 0 for a pinned vertex.
    pub inv_mass: Vec<f64>,
}

/// The energies of a sheet, J.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// Kinetic.
    pub kinetic: f64,
    /// Potential in gravity, relative to y = 0.
    pub gravity: f64,
    /// Stretch of warp and weft.
    pub stretch: f64,
    /// Shear, bending and twist.
    pub shape: f64,
}

impl Energy {
    /// The sum.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.kinetic + self.gravity + self.stretch + self.shape
    }
}

impl Sheet {
    /// A flat sheet in the plane z = 0, hanging from (0, 0, 0): width along x, warp along −y. Nothing is pinned.
    ///
    /// # Panics
    /// With fewer than two vertices along a side.
    #[must_use]
    pub fn flat(nx: usize, ny: usize, width: f64, height: f64, mechanics: Mechanics) -> Self {
        assert!(nx >= 2 && ny >= 2, "a sheet needs at least 2 x 2 vertices");
        let n = nx * ny;
        let (hx, hy) = (width / (nx - 1) as f64, height / (ny - 1) as f64);
        let mut sheet = Self {
            nx,
            ny,
            hx,
            hy,
            mechanics,
            x: [vec![0.0; n], vec![0.0; n], vec![0.0; n]],
            v: [vec![0.0; n], vec![0.0; n], vec![0.0; n]],
            mass: vec![0.0; n],
            inv_mass: vec![0.0; n],
        };
        for j in 0..ny {
            for i in 0..nx {
                let k = j * nx + i;
                sheet.x[0][k] = i as f64 * hx;
                sheet.x[1][k] = -(j as f64) * hy;
                let share = half_at_ends(i, nx) * half_at_ends(j, ny);
                sheet.mass[k] = sheet.mechanics.areal_density * hx * hy * share;
                sheet.inv_mass[k] = 1.0 / sheet.mass[k];
            }
        }
        sheet
    }

    /// Number of vertices.
    #[must_use]
    pub fn len(&self) -> usize {
        self.nx * self.ny
    }

    /// True for a sheet without vertices, which cannot be built.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Position of vertex `k`, m.
    #[must_use]
    pub fn position(&self, k: usize) -> [f64; 3] {
        [self.x[0][k], self.x[1][k], self.x[2][k]]
    }

    /// Velocity of vertex `k`, m/s.
    #[must_use]
    pub fn velocity(&self, k: usize) -> [f64; 3] {
        [self.v[0][k], self.v[1][k], self.v[2][k]]
    }

    /// Moves vertex `k`.
    pub fn set_position(&mut self, k: usize, p: [f64; 3]) {
        for c in 0..3 {
            self.x[c][k] = p[c];
        }
    }

    /// Holds vertex `k` where it is.
    pub fn pin(&mut self, k: usize) {
        self.inv_mass[k] = 0.0;
    }

    /// Holds the whole heading.
    pub fn pin_top(&mut self) {
        for i in 0..self.nx {
            self.pin(i);
        }
    }

    /// Adds the weight of a lead band or a hem to the last row; `line_density` in kg per metre of fabric width.
    pub fn add_hem(&mut self, line_density: f64) {
        for i in 0..self.nx {
            let k = (self.ny - 1) * self.nx + i;
            self.mass[k] += line_density * self.hx * half_at_ends(i, self.nx);
            if self.inv_mass[k] > 0.0 {
                self.inv_mass[k] = 1.0 / self.mass[k];
            }
        }
    }

    /// Stiffness of the warp edge in column `i`, N/m: tensile stiffness × width it stands for / rest length.
    #[must_use]
    pub fn warp_stiffness(&self, i: usize) -> f64 {
        self.mechanics.tensile_warp * self.hx * half_at_ends(i, self.nx) / self.hy
    }

    /// Stiffness of the weft edge in row `j`, N/m.
    #[must_use]
    pub fn weft_stiffness(&self, j: usize) -> f64 {
        self.mechanics.tensile_weft * self.hy * half_at_ends(j, self.ny) / self.hx
    }

    fn edge_length(&self, a: usize, b: usize) -> f64 {
        (0..3)
            .map(|c| (self.x[c][b] - self.x[c][a]).powi(2))
            .sum::<f64>()
            .sqrt()
    }

    /// Calls `f(is_warp, strain, column, row)` for every warp and weft edge.
    pub fn for_each_strain(&self, mut f: impl FnMut(bool, f64, usize, usize)) {
        for j in 0..self.ny {
            for i in 0..self.nx {
                let k = j * self.nx + i;
                if j + 1 < self.ny {
                    f(true, self.edge_length(k, k + self.nx) / self.hy - 1.0, i, j);
                }
                if i + 1 < self.nx {
                    f(false, self.edge_length(k, k + 1) / self.hx - 1.0, i, j);
                }
            }
        }
    }

    /// The largest absolute strain of a warp or weft edge.
    #[must_use]
    pub fn max_strain(&self) -> f64 {
        let mut most = 0.0f64;
        self.for_each_strain(|_, s, _, _| most = most.max(s.abs()));
        most
    }

    /// Mean strain of the warp edges.
    #[must_use]
    pub fn mean_warp_strain(&self) -> f64 {
        let (mut sum, mut n) = (0.0, 0.0);
        self.for_each_strain(|warp, s, _, _| {
            if warp {
                sum += s;
                n += 1.0;
            }
        });
        sum / n
    }

    /// Kinetic, gravity, stretch and shape energy, J.
    #[must_use]
    pub fn energy(&self, gravity: f64) -> Energy {
        let mut e = Energy::default();
        for k in 0..self.len() {
            e.kinetic += 0.5 * self.mass[k] * self.velocity(k).iter().map(|c| c * c).sum::<f64>();
            e.gravity += self.mass[k] * gravity * self.x[1][k];
        }
        let beta = self.mechanics.tensile_stiffening;
        self.for_each_strain(|warp, s, i, j| {
            let (k, h) = if warp {
                (self.warp_stiffness(i), self.hy)
            } else {
                (self.weft_stiffness(j), self.hx)
            };
            e.stretch += 0.5 * k * h * h * s * s * (1.0 + beta * s.max(0.0) / 3.0);
        });
        e.shape = crate::force::shape_energy(self);
        e
    }

    /// The force that holds the pinned vertices, N: their own weight and all springs that pull at them.
    #[must_use]
    pub fn support_force(&self, gravity: f64) -> [f64; 3] {
        let force = crate::force::all_forces(self);
        let mut sum = [0.0; 3];
        for k in (0..self.len()).filter(|&k| self.inv_mass[k] == 0.0) {
            for c in 0..3 {
                sum[c] -= force[c][k];
            }
            sum[1] += self.mass[k] * gravity;
        }
        sum
    }

    /// Total mass, kg.
    #[must_use]
    pub fn total_mass(&self) -> f64 {
        self.mass.iter().sum()
    }

    /// Whether every speed is below `most` m/s and every place nearer than `most` metres along each axis; NaN is not.
    #[must_use]
    pub fn is_within(&self, most: f64) -> bool {
        // Whole numbers are counted, which the compiler does side by side; a search would stop at every vertex.
        let within = |a: &Vec<f64>| a.iter().map(|c| i64::from(c.abs() < most)).sum::<i64>();
        let all = self.len() as i64;
        self.x.iter().chain(&self.v).all(|a| within(a) == all)
    }

    /// False as soon as one number of the state is not finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.x
            .iter()
            .chain(&self.v)
            .all(|a| a.iter().all(|c| c.is_finite()))
    }
}

/// One half at the first and last of `n`, one between: the share of a cell's length that a vertex or an edge stands for.
pub(crate) fn half_at_ends(i: usize, n: usize) -> f64 {
    if i == 0 || i + 1 == n { 0.5 } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mass_of_a_sheet_is_density_times_area() {
        let sheet = Sheet::flat(
            7,
            11,
            2.0,
            2.4,
            Mechanics {
                areal_density: 0.12,
                ..Mechanics::default()
            },
        );
        assert!((sheet.total_mass() - 0.12 * 2.0 * 2.4).abs() < 1e-12);
        assert!(sheet.max_strain() < 1e-12);
    }
}
