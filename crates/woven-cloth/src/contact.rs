//! What the cloth cannot enter: floor, wall, sill, and itself.

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
    /// still has the one before.
    pub(crate) fn resolve(&self, sheet: &Sheet, x: &mut Field) {
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
            for (axis, plane) in [(1, self.floor), (2, self.wall)] {
                if let Some(plane) = plane {
                    let depth = x[axis][k] - plane - GAP;
                    if depth < 0.0 {
                        self.push(sheet, x, k, axis, depth);
                    }
                }
            }
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

/// Acceleration of vertices that touch, m/s².
const REPULSION: f64 = 150.0;

/// Contact of the cloth with itself: vertices of different folds keep their distance.
///
/// Two vertices that lie further apart on the cloth than `ring` cells repel each other inside `distance`, which is at least the
/// grid's spacing: then no vertex can slip between the corners of a cell. Friction holds them against sliding.
#[derive(Clone, Debug)]
pub struct SelfContact {
    distance: f64,
    friction: f64,
    margin: f64,
    pairs: Vec<(u32, u32)>,
    /// Where the vertices were when the pairs were gathered.
    seen: Field,
}

impl SelfContact {
    /// Contact that keeps `distance` metres, with Coulomb `friction`.
    #[must_use]
    pub fn new(distance: f64, friction: f64) -> Self {
        Self {
            distance,
            friction,
            margin: 0.5 * distance,
            pairs: Vec::new(),
            seen: Field::default(),
        }
    }

    /// Forgets the pairs, as after a jump.
    pub fn restart(&mut self) {
        self.seen = Field::default();
    }

    /// Separates close pairs in `x`; the sheet still has the places before the step.
    pub(crate) fn resolve(&mut self, sheet: &Sheet, x: &mut Field, hp: f64) {
        self.gather_if_moved(sheet, x);
        let d2 = self.distance * self.distance;
        for &(a, b) in &self.pairs {
            let (a, b) = (a as usize, b as usize);
            let d: [f64; 3] = std::array::from_fn(|c| x[c][b] - x[c][a]);
            let l2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            if l2 >= d2 || l2 < 1e-16 {
                continue;
            }
            let (wa, wb) = (sheet.inv_mass[a], sheet.inv_mass[b]);
            if wa + wb == 0.0 {
                continue;
            }
            let l = l2.sqrt();
            // Repulsion as an acceleration: enough to stop folds that meet at 1 m/s within a grid's spacing, too weak to stretch
            // threads when folds are caught in each other.
            let way_out = REPULSION * hp * hp * (1.0 - l / self.distance);
            let push = way_out / (l * (wa + wb));
            let before: [f64; 3] = std::array::from_fn(|c| sheet.x[c][b] - sheet.x[c][a]);
            let mut slip: [f64; 3] = std::array::from_fn(|c| d[c] - before[c]);
            let along = (slip[0] * d[0] + slip[1] * d[1] + slip[2] * d[2]) / l2;
            for c in 0..3 {
                slip[c] -= along * d[c];
            }
            let way = slip.iter().map(|s| s * s).sum::<f64>().sqrt();
            let hold = if way > 0.0 {
                (self.friction * way_out / way).min(1.0) / (wa + wb)
            } else {
                0.0
            };
            for c in 0..3 {
                let move_ = d[c] * push - slip[c] * hold;
                x[c][a] -= wa * move_;
                x[c][b] += wb * move_;
            }
        }
    }

    /// Gathers pairs anew when a vertex has moved more than half the margin.
    fn gather_if_moved(&mut self, sheet: &Sheet, x: &Field) {
        let limit = 0.25 * self.margin * self.margin;
        let fresh = self.seen[0].len() == x[0].len()
            && (0..x[0].len()).all(|k| {
                (0..3)
                    .map(|c| (x[c][k] - self.seen[c][k]).powi(2))
                    .sum::<f64>()
                    < limit
            });
        if fresh {
            return;
        }
        self.seen.clone_from(x);
        self.pairs.clear();
        let reach = self.distance + self.margin;
        let (cells, order, start) = sort_into_cells(x, reach);
        let ring = (reach / sheet.hx.min(sheet.hy)).ceil() as usize + 1;
        let nx = sheet.nx;
        for (a, &cell) in cells.iter().enumerate() {
            let (ia, ja) = (a % nx, a / nx);
            for dz in 0..3u64 {
                for dy in 0..3u64 {
                    for dx in 0..3u64 {
                        let other = cell
                            .wrapping_add(dx.wrapping_sub(1))
                            .wrapping_add(dy.wrapping_sub(1).wrapping_mul(1 << 21))
                            .wrapping_add(dz.wrapping_sub(1).wrapping_mul(1 << 42));
                        let first = start.partition_point(|&(c, _)| c < other);
                        let Some(&(c, from)) = start.get(first) else {
                            continue;
                        };
                        if c != other {
                            continue;
                        }
                        let to = start.get(first + 1).map_or(order.len(), |&(_, s)| s);
                        for &b in &order[from..to] {
                            let b = b as usize;
                            if b <= a
                                || (b / nx).abs_diff(ja) <= ring && (b % nx).abs_diff(ia) <= ring
                            {
                                continue;
                            }
                            let d2: f64 = (0..3).map(|c| (x[c][b] - x[c][a]).powi(2)).sum();
                            if d2 < reach * reach {
                                self.pairs.push((a as u32, b as u32));
                            }
                        }
                    }
                }
            }
        }
    }
}

/// The cell of every vertex, the vertices sorted by cell, and where each cell starts.
fn sort_into_cells(x: &Field, size: f64) -> (Vec<u64>, Vec<u32>, Vec<(u64, usize)>) {
    let n = x[0].len();
    let r = 1.0 / size;
    // 21 bits an axis, offset so that negative places stay positive.
    let coordinate =
        |v: f64| ((v * r).floor() + f64::from(1 << 20)).clamp(1.0, f64::from((1 << 21) - 2)) as u64;
    let cells: Vec<u64> = (0..n)
        .map(|k| coordinate(x[0][k]) | coordinate(x[1][k]) << 21 | coordinate(x[2][k]) << 42)
        .collect();
    let mut order: Vec<u32> = (0..n as u32).collect();
    order.sort_by_key(|&k| (cells[k as usize], k));
    let mut start: Vec<(u64, usize)> = Vec::new();
    for (at, &k) in order.iter().enumerate() {
        let cell = cells[k as usize];
        if start.last().is_none_or(|&(c, _)| c != cell) {
            start.push((cell, at));
        }
    }
    (cells, order, start)
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
        obstacles.resolve(&sheet, &mut x);
        assert!((x[1][3] + 0.95 - GAP).abs() < 1e-12);
        assert!(
            (x[0][3] - sheet.x[0][3]).abs() < 1e-12,
            "friction 1 over 5 cm holds a slip of 1 mm"
        );
        assert_eq!(x[1][0], 0.0);
    }

    #[test]
    fn folds_are_pushed_apart_and_neighbours_are_not() {
        let mut sheet = Sheet::flat(2, 21, 0.05, 1.0, Mechanics::default());
        // Folded in the middle: the lower half comes up 1 cm behind the upper.
        for j in 0..21 {
            for i in 0..2 {
                if j > 10 {
                    let up = sheet.x[1][(20 - j) * 2 + i];
                    sheet.set_position(j * 2 + i, [i as f64 * 0.05, up, 0.01]);
                }
            }
        }
        let mut contact = SelfContact::new(0.04, 0.0);
        let mut x = sheet.x.clone();
        contact.resolve(&sheet, &mut x, 1e-3);
        assert!(
            x[2][40] > 0.01 && x[2][0] < 0.0,
            "the ends part: {} {}",
            x[2][40],
            x[2][0]
        );
        assert_eq!(x[2][20], 0.0, "the bend itself is left alone");
    }
}
