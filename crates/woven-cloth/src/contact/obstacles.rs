//! Floor, wall, window and sill: what stands still around the curtain.

use crate::sheet::{Field, Sheet};
use serde::{Deserialize, Serialize};

/// Obstacles around the curtain, m. Up is y, the room is at z > wall.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Obstacles {
    /// Height of the floor; none lets the cloth hang on.
    pub floor: Option<f64>,
    /// Plane of the wall behind the curtain (z).
    pub wall: Option<f64>,
    /// A window sill: `[height, z]`, a block that reaches from the wall to `z` and from the floor up to `height`.
    pub sill: Option<[f64; 2]>,
    /// Coulomb friction on obstacles.
    pub friction: f64,
}

/// Distance that a vertex keeps from obstacles, m.
const GAP: f64 = 0.002;

impl Obstacles {
    /// Moves vertices out of the obstacles along the shortest way and holds them by friction; `x` is the new place, the sheet
    /// still has the one before. `window` is the
    /// hole in the wall, `[left, right, bottom, top]`.
    pub(crate) fn resolve(&self, window: Option<[f64; 4]>, sheet: &Sheet, x: &mut Field) {
        if self.floor.is_none() && self.wall.is_none() && self.sill.is_none() {
            return;
        }
        for k in 0..sheet.len() {
            if sheet.inv_mass[k] == 0.0 {
                continue;
            }
            if let Some([height, front]) = self.sill {
                let (above, before) = (x[1][k] - height - GAP, x[2][k] - front - GAP);
                if above < 0.0 && before < 0.0 {
                    let (axis, depth) = if above > before {
                        (1, above)
                    } else {
                        (2, before)
                    };
                    self.push(sheet, x, k, axis, depth);
                }
            }
            if let Some(floor) = self.floor
                && x[1][k] - floor < GAP
            {
                self.push(sheet, x, k, 1, x[1][k] - floor - GAP);
            }
            if let Some(wall) = self.wall
                && x[2][k] - wall < GAP
            {
                self.wall_or_window(window, sheet, x, k, x[2][k] - wall - GAP);
            }
        }
    }

    /// A vertex behind the wall's face: out of the wall again, or back into the window's hole that it came through.
    fn wall_or_window(
        &self,
        window: Option<[f64; 4]>,
        sheet: &Sheet,
        x: &mut Field,
        k: usize,
        depth: f64,
    ) {
        let Some([left, right, bottom, top]) = window else {
            return self.push(sheet, x, k, 2, depth);
        };
        // How far outside the hole, per axis; in the hole nothing is in the way.
        let outside = |v: f64, lo: f64, hi: f64| (v - lo).min(0.0) + (v - hi).max(0.0);
        let (dx, dy) = (outside(x[0][k], left, right), outside(x[1][k], bottom, top));
        if dx == 0.0 && dy == 0.0 {
            return;
        }
        // The shortest way out: through the face or sideways to the reveal.
        if dx.hypot(dy) < -depth {
            x[0][k] -= dx;
            x[1][k] -= dy;
        } else {
            self.push(sheet, x, k, 2, depth);
        }
    }

    /// Out along `axis` by `-depth`; the slip along the plane loses up to friction × the same way.
    fn push(&self, sheet: &Sheet, x: &mut Field, k: usize, axis: usize, depth: f64) {
        x[axis][k] -= depth;
        let slip: [f64; 3] = std::array::from_fn(|c| {
            if c == axis {
                0.0
            } else {
                x[c][k] - sheet.x[c][k]
            }
        });
        let length = slip.iter().map(|s| s * s).sum::<f64>().sqrt();
        if length > 0.0 {
            let hold = (self.friction * -depth / length).min(1.0);
            for c in 0..3 {
                x[c][k] -= hold * slip[c];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fabrics::Mechanics;

    #[test]
    fn a_vertex_under_the_floor_comes_back_and_is_held_by_friction() {
        let sheet = Sheet::flat(2, 2, 1.0, 1.0, Mechanics::default());
        let mut x = sheet.x.clone();
        x[0][3] += 0.001;
        let obstacles = Obstacles {
            floor: Some(-0.95),
            friction: 1.0,
            ..Obstacles::default()
        };
        obstacles.resolve(None, &sheet, &mut x);
        assert!((x[1][3] + 0.95 - GAP).abs() < 1e-12);
        assert!(
            (x[0][3] - sheet.x[0][3]).abs() < 1e-12,
            "friction 1 over 5 cm holds a slip of 1 mm"
        );
        assert_eq!(x[1][0], 0.0);
    }

    #[test]
    fn the_wall_holds_the_cloth_and_its_window_lets_it_through() {
        let sheet = Sheet::flat(3, 2, 1.0, 1.0, Mechanics::default());
        let obstacles = Obstacles {
            wall: Some(-0.1),
            ..Obstacles::default()
        };
        let mut x = sheet.x.clone();
        // Columns at x = 0, 0.5 and 1: in the hole, in the hole near its side, before the wall.
        x[2].fill(-0.15);
        x[0][1] = 0.72;
        obstacles.resolve(Some([-0.2, 0.7, -2.0, 1.0]), &sheet, &mut x);
        assert_eq!(x[2][0], -0.15, "the window is open");
        assert!(
            (x[0][1] - 0.7).abs() < 1e-12,
            "the reveal turns it back: {}",
            x[0][1]
        );
        assert!(
            (x[2][2] + 0.1 - GAP).abs() < 1e-12,
            "the wall is not: {}",
            x[2][2]
        );
    }
}
