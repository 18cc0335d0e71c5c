//! Forces of the cloth: shear and bending for both solvers, stretch for the explicit reference.
//!
//! * Stretch, per edge: E = k/2 (|d| - h)² (1 + beta s / 3 in tension), k = Y × width / h.
//! * Shear, per cell: E = G A/2 (e1·e2)² with e1, e2 the cell's mean weft and warp direction. Unlike a diagonal spring it
//!   carries none of the weight, so a hanging sheet stretches as rho g H²/(2Y) says, and no diagonal is preferred.
//! * Bending, per three vertices of a thread: E = B A/2 |second difference / h²|² (constant matrix, exact for small strain);
//!   per cell the twist: E = B_t A |x_ij mixed difference / (hx hy)|², B_t = sqrt(B_warp B_weft).

mod friction;
mod heat;
mod slab;

pub(crate) use friction::{Friction, RISE};
pub(crate) use heat::HeatSet;
pub(crate) use slab::{Slab, Terms};

use crate::sheet::{Field, Sheet, half_at_ends};
use slab::{views, views_mut};

/// Stiffness numbers of shear and bending, made once from the fabric and the grid.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    /// Shear, N·m per cell: G hx hy.
    shear: f64,
    /// 1/(2 hx), 1/(2 hy).
    rx: f64,
    ry: f64,
    /// Bending along the warp per second difference, N/m (interior column).
    bend_warp: f64,
    /// Bending along the weft, N/m (interior row).
    bend_weft: f64,
    /// Twist per cell, N/m.
    twist: f64,
}

impl Shape {
    pub(crate) fn new(sheet: &Sheet) -> Self {
        let (hx, hy, m) = (sheet.hx, sheet.hy, &sheet.mechanics);
        let [warp, weft] = m.bending();
        Self {
            shear: m.shear * hx * hy,
            rx: 0.5 / hx,
            ry: 0.5 / hy,
            bend_warp: warp * hx / hy.powi(3),
            bend_weft: weft * hy / hx.powi(3),
            twist: 2.0 * (warp * weft).sqrt() / (hx * hy),
        }
    }

    /// An upper bound of the squared angular frequency of shear, 1/s²: 4 G/(rho h²) inside, up to half more at an edge.
    pub(crate) fn shear_omega2(sheet: &Sheet) -> f64 {
        let h2 = sheet.hx.min(sheet.hy).powi(2);
        6.0 * sheet.mechanics.shear / (sheet.mechanics.areal_density * h2)
    }

    /// An upper bound of the squared angular frequency of bending, 1/s²: 16 B/(rho h⁴) per direction and the twist.
    pub(crate) fn bending_omega2(sheet: &Sheet) -> f64 {
        let [warp, weft] = sheet.mechanics.bending();
        let (x2, y2) = (sheet.hx.powi(2), sheet.hy.powi(2));
        let sum = 16.0 * warp / (y2 * y2)
            + 16.0 * weft / (x2 * x2)
            + 32.0 * (warp * weft).sqrt() / (x2 * y2);
        sum / sheet.mechanics.areal_density
    }

    /// Adds shear forces at positions `x` of a whole sheet to `f`.
    pub(crate) fn add_shear(&self, nx: usize, ny: usize, x: &Field, f: &mut Field) {
        let mut terms = Terms::new(nx);
        self.shear_slab(nx, 0..ny - 1, views(x), views_mut(f), &mut terms);
    }

    /// Adds bending and twist forces at positions `x` of a whole sheet to `f`.
    pub(crate) fn add_bending(&self, nx: usize, ny: usize, x: &Field, f: &mut Field) {
        let mut terms = Terms::new(nx);
        let slab = Slab {
            nx,
            first: 0,
            rows: ny,
            ny,
        };
        self.bending_slab(slab, 0..ny, views(x), views_mut(f), &mut terms);
    }

    fn energy(&self, sheet: &Sheet) -> f64 {
        let (nx, ny) = (sheet.nx, sheet.ny);
        let at = |c: usize, i: usize, j: usize| sheet.x[c][j * nx + i];
        let mut e = 0.0;
        for j in 0..ny {
            for i in 0..nx {
                for c in 0..3 {
                    if j > 0 && j + 1 < ny {
                        let t = at(c, i, j - 1) - 2.0 * at(c, i, j) + at(c, i, j + 1);
                        e += 0.5 * self.bend_warp * half_at_ends(i, nx) * t * t;
                    }
                    if i > 0 && i + 1 < nx {
                        let t = at(c, i - 1, j) - 2.0 * at(c, i, j) + at(c, i + 1, j);
                        e += 0.5 * self.bend_weft * half_at_ends(j, ny) * t * t;
                    }
                    if i + 1 < nx && j + 1 < ny {
                        let t =
                            at(c, i, j) - at(c, i + 1, j) - at(c, i, j + 1) + at(c, i + 1, j + 1);
                        e += 0.5 * self.twist * t * t;
                    }
                }
                if i + 1 < nx && j + 1 < ny {
                    e += 0.5 * self.shear * self.shear_angle(sheet, i, j).powi(2);
                }
            }
        }
        e
    }

    /// e1·e2 of a cell: the sine of its shear angle for small strain.
    fn shear_angle(&self, sheet: &Sheet, i: usize, j: usize) -> f64 {
        let k = j * sheet.nx + i;
        sheet.x.iter().fold(0.0, |sum, x| {
            let (s, t) = (x[k + sheet.nx + 1] - x[k], x[k + 1] - x[k + sheet.nx]);
            sum + (s + t) * self.rx * (s - t) * self.ry
        })
    }
}

/// Shear, bending and twist energy of a sheet, J.
pub(crate) fn shape_energy(sheet: &Sheet) -> f64 {
    Shape::new(sheet).energy(sheet)
}

/// Adds the stretch of all warp and weft edges at the sheet's positions to `f`, with optional damping.
pub(crate) fn add_stretch(sheet: &Sheet, damping: f64, f: &mut Field) {
    let (nx, ny) = (sheet.nx, sheet.ny);
    let beta = sheet.mechanics.tensile_stiffening;
    let mut edge = |a: usize, b: usize, k: f64, h: f64| {
        let d: [f64; 3] = std::array::from_fn(|c| sheet.x[c][b] - sheet.x[c][a]);
        let l2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        let l = l2.sqrt();
        let s = l / h - 1.0;
        // Tangent stiffness k (1 + beta s) in tension: force k h (s + beta s²/2).
        let mut t = k * h * s * (1.0 + 0.5 * beta * s.max(0.0));
        if damping > 0.0 {
            let dv: f64 = (0..3).map(|c| (sheet.v[c][b] - sheet.v[c][a]) * d[c]).sum();
            t += k * damping * dv / l;
        }
        for c in 0..3 {
            let fc = t * d[c] / l;
            f[c][a] += fc;
            f[c][b] -= fc;
        }
    };
    for j in 0..ny {
        for i in 0..nx {
            let k = j * nx + i;
            if j + 1 < ny {
                edge(k, k + nx, sheet.warp_stiffness(i), sheet.hy);
            }
            if i + 1 < nx {
                edge(k, k + 1, sheet.weft_stiffness(j), sheet.hx);
            }
        }
    }
}

/// All elastic forces at the sheet's positions, N.
pub(crate) fn all_forces(sheet: &Sheet) -> Field {
    let n = sheet.len();
    let mut f = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
    let shape = Shape::new(sheet);
    add_stretch(sheet, 0.0, &mut f);
    shape.add_shear(sheet.nx, sheet.ny, &sheet.x, &mut f);
    shape.add_bending(sheet.nx, sheet.ny, &sheet.x, &mut f);
    f
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fabrics::Mechanics;
    use crate::random::uniform;

    fn crumpled() -> Sheet {
        let mechanics = Mechanics {
            bending_warp: 3e-3,
            bending_weft: 1e-3,
            tensile_stiffening: 20.0,
            ..Mechanics::default()
        };
        let mut sheet = Sheet::flat(5, 6, 0.4, 0.5, mechanics);
        for k in 0..sheet.len() {
            for c in 0..3 {
                sheet.x[c][k] += 0.02 * (uniform(1, c as u64, k as u64) - 0.5);
            }
        }
        sheet
    }

    #[test]
    fn force_is_minus_the_slope_of_energy() {
        let mut sheet = crumpled();
        let force = all_forces(&sheet);
        let energy = |s: &Sheet| {
            let e = s.energy(0.0);
            e.stretch + e.shape
        };
        let step = 1e-6;
        for k in 0..sheet.len() {
            for c in 0..3 {
                let x = sheet.x[c][k];
                sheet.x[c][k] = x + step;
                let up = energy(&sheet);
                sheet.x[c][k] = x - step;
                let down = energy(&sheet);
                sheet.x[c][k] = x;
                let slope = (up - down) / (2.0 * step);
                // Central difference of 1e-6 m on stiffnesses of 1e3 N/m: error about 1e-6 N.
                assert!(
                    (force[c][k] + slope).abs() < 2e-5 * (1.0 + slope.abs()),
                    "vertex {k} axis {c}: {} {slope}",
                    force[c][k]
                );
            }
        }
    }

    #[test]
    fn inner_forces_sum_to_nothing() {
        let force = all_forces(&crumpled());
        for f in &force {
            assert!(f.iter().sum::<f64>().abs() < 1e-10);
        }
    }
}
