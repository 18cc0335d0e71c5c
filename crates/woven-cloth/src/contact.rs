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
/// Two vertices that are no neighbours repel each other inside `distance`, which is at least the grid's spacing, so that a vertex
/// hardly slips between the corners of a cell; vertices near each other on the cloth inside half their way on it. Friction holds
/// them against sliding. This keeps folds apart as the eye sees them; it is no proof that no triangle ever crosses another.
#[derive(Clone, Debug)]
pub struct SelfContact {
    distance: f64,
    friction: f64,
    margin: f64,
    /// Two vertices and the distance they keep, m.
    pairs: Vec<(u32, u32, f64)>,
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
        for &(a, b, keep) in &self.pairs {
            let (a, b) = (a as usize, b as usize);
            let d: [f64; 3] = std::array::from_fn(|c| x[c][b] - x[c][a]);
            let l2 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            if l2 >= keep * keep || l2 < 1e-16 {
                continue;
            }
            let (wa, wb) = (sheet.inv_mass[a], sheet.inv_mass[b]);
            if wa + wb == 0.0 {
                continue;
            }
            let l = l2.sqrt();
            let before: [f64; 3] = std::array::from_fn(|c| sheet.x[c][b] - sheet.x[c][a]);
            let mut slip: [f64; 3] = std::array::from_fn(|c| d[c] - before[c]);
            let along = (slip[0] * d[0] + slip[1] * d[1] + slip[2] * d[2]) / l2;
            // A cushion without spring: what the pair came nearer in this step is taken back, the more the deeper it is, so a
            // contact gives no energy and stretches no thread; a weak repulsion parts what lies close.
            let depth = 1.0 - l / keep;
            let way_out =
                REPULSION * hp * hp * depth + (-along * l).max(0.0) * (2.0 * depth).min(1.0);
            let push = way_out / (l * (wa + wb));
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
        let cells = sort_into_cells(x, reach);
        let nx = sheet.nx;
        for a in 0..cells.key.len() {
            let (ia, ja) = (a % nx, a / nx);
            let first = self.pairs.len();
            cells.near([x[0][a], x[1][a], x[2][a]], |b| {
                let (di, dj) = ((b % nx).abs_diff(ia), (b / nx).abs_diff(ja));
                if b <= a || (di <= 1 && dj <= 1) {
                    return;
                }
                // Vertices near each other on the cloth may come as near as a sharp crease brings them, no nearer.
                let on_cloth = (di as f64 * sheet.hx).hypot(dj as f64 * sheet.hy);
                let keep = self.distance.min(0.5 * on_cloth);
                let d2: f64 = (0..3).map(|c| (x[c][b] - x[c][a]).powi(2)).sum();
                if d2 < (keep + self.margin).powi(2).min((0.9 * on_cloth).powi(2)) {
                    self.pairs.push((a as u32, b as u32, keep));
                }
            });
            // The order of pairs must not depend on when they were gathered, or a resumed run would differ in its last bits.
            self.pairs[first..].sort_unstable_by_key(|&(_, b, _)| b);
        }
    }
}

/// Points sorted into cubic cells.
pub(crate) struct Cells {
    inv_size: f64,
    /// The cell of every point.
    key: Vec<u64>,
    /// The points sorted by cell, then by number.
    order: Vec<u32>,
    /// The cells that hold something, ascending, each with the place in `order` where it starts.
    start: Vec<(u64, usize)>,
}

impl Cells {
    /// 21 bits an axis, offset so that negative places stay positive.
    fn key_of(inv_size: f64, p: [f64; 3]) -> u64 {
        let [x, y, z] = p.map(|v| {
            ((v * inv_size).floor() + f64::from(1 << 20)).clamp(1.0, f64::from((1 << 21) - 2))
                as u64
        });
        x | y << 21 | z << 42
    }

    /// Calls `f` for every point in the cell of `p` and the 26 around it.
    pub(crate) fn near(&self, p: [f64; 3], mut f: impl FnMut(usize)) {
        let cell = Self::key_of(self.inv_size, p);
        for dz in [-1i64, 0, 1] {
            for dy in [-1i64, 0, 1] {
                // Three cells in a row along x are neighbours in the order too.
                let row = cell
                    .wrapping_add_signed(dy << 21)
                    .wrapping_add_signed(dz << 42);
                let mut at = self.start.partition_point(|&(c, _)| c < row - 1);
                while let Some(&(c, from)) = self.start.get(at) {
                    if c > row + 1 {
                        break;
                    }
                    let to = self.start.get(at + 1).map_or(self.order.len(), |&(_, s)| s);
                    for &k in &self.order[from..to] {
                        f(k as usize);
                    }
                    at += 1;
                }
            }
        }
    }
}

/// Sorts points into cells of edge `size`.
pub(crate) fn sort_into_cells(x: &Field, size: f64) -> Cells {
    let n = x[0].len();
    let inv_size = 1.0 / size;
    let key: Vec<u64> = (0..n)
        .map(|k| Cells::key_of(inv_size, [x[0][k], x[1][k], x[2][k]]))
        .collect();
    let mut order: Vec<u32> = (0..n as u32).collect();
    order.sort_unstable_by_key(|&k| (key[k as usize], k));
    let mut start: Vec<(u64, usize)> = Vec::new();
    for (at, &k) in order.iter().enumerate() {
        let cell = key[k as usize];
        if start.last().is_none_or(|&(c, _)| c != cell) {
            start.push((cell, at));
        }
    }
    Cells {
        inv_size,
        key,
        order,
        start,
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
