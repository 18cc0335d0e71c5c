//! The drape meter of Cusick (1965, ISO 9073-9): a round piece of cloth on a smaller round table, and the share of the overhanging ring
//! that its shadow covers.
//!
//! DC = (A_shadow - A_table)/(A_cloth - A_table). The piece is cut from a square grid along the threads; cells that the circle cuts count
//! by the share of them that is left. Rest is found by dynamic relaxation with kinetic damping (Day 1965): masses are made up so that
//! every spring allows the same step, and motion is stopped whenever the kinetic energy has passed a maximum.

use crate::fabrics::{GRAVITY, Mechanics};
use crate::random::uniform;
use crate::sheet::Field;

/// Radius of the table, m.
pub const TABLE: f64 = 0.09;
/// Threads are taken this soft at most, N/m: the weight of a hand's breadth of cloth stretches them by less than a thousandth, and
/// the drape is a matter of bending and shear.
const THREAD: f64 = 300.0;
/// Parts of a cell's side that tell how much of it lies in the circle.
const PARTS: usize = 12;

/// What the drape meter shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drape {
    /// The drape coefficient, 0 to 1.
    pub coefficient: f64,
    /// Folds round the edge.
    pub folds: usize,
}

/// Three vertices in a row of a thread, or the four corners of a cell (upper left and right, lower left and right).
struct Springs {
    /// Ends and stiffness, N/m.
    edges: Vec<([usize; 2], f64)>,
    /// Middle vertices, distance of the neighbours in numbers, stiffness per second difference, N/m.
    bends: Vec<(usize, usize, f64)>,
    /// First corner, stiffness of shear (N m) and of twist (N/m).
    cells: Vec<(usize, f64, f64)>,
}

struct Piece {
    /// Vertices along a side.
    n: usize,
    h: f64,
    radius: f64,
    x: Field,
    v: Field,
    f: Field,
    /// Weight, N, and 1 / made-up mass (0 for what the table holds and what is no cloth).
    weight: Vec<f64>,
    inv_mass: Vec<f64>,
    springs: Springs,
}

impl Piece {
    fn new(m: &Mechanics, radius: f64, cells: usize, turn: f64) -> Self {
        let (n, h) = (cells + 1, 2.0 * radius / cells as f64);
        let share = |i: usize, j: usize| {
            let inside = (0..PARTS * PARTS).filter(|p| {
                let at = |cell: usize, part: usize| {
                    (cell as f64 + (part as f64 + 0.5) / PARTS as f64) * h - radius
                };
                at(i, p % PARTS).hypot(at(j, p / PARTS)) < radius
            });
            inside.count() as f64 / (PARTS * PARTS) as f64
        };
        let shares: Vec<f64> = (0..cells * cells)
            .map(|c| share(c % cells, c / cells))
            .collect();
        // The cell whose lower right corner has these numbers, and those beyond the ends.
        let cell = |i: isize, j: isize| {
            let inside = |k: isize| (0..cells as isize).contains(&k);
            if inside(i) && inside(j) {
                shares[j as usize * cells + i as usize]
            } else {
                0.0
            }
        };
        let [warp, weft] = m.bending();
        let zeros = || vec![0.0; n * n];
        let mut piece = Self {
            n,
            h,
            radius,
            x: std::array::from_fn(|_| zeros()),
            v: std::array::from_fn(|_| zeros()),
            f: std::array::from_fn(|_| zeros()),
            weight: zeros(),
            inv_mass: zeros(),
            springs: Springs {
                edges: Vec::new(),
                bends: Vec::new(),
                cells: Vec::new(),
            },
        };
        let mut stiff = zeros();
        let spread = m.shear.max(1.0);
        for j in 0..n {
            for i in 0..n {
                let (k, si, sj) = (j * n + i, i as isize, j as isize);
                let s = &mut piece.springs;
                let around = [
                    cell(si - 1, sj - 1),
                    cell(si, sj - 1),
                    cell(si - 1, sj),
                    cell(si, sj),
                ];
                let mean = around.iter().sum::<f64>() / 4.0;
                piece.weight[k] = mean * m.areal_density * GRAVITY * h * h;
                for (step, share, tensile) in [
                    (1, 0.5 * (around[1] + around[3]), m.tensile_weft),
                    (n, 0.5 * (around[2] + around[3]), m.tensile_warp),
                ] {
                    if share > 0.0 {
                        // Of two threads the softer keeps its share of the stiffer.
                        let soft =
                            THREAD.max(8.0 * spread) * tensile / m.tensile_warp.max(m.tensile_weft);
                        s.edges.push(([k, k + step], share * soft));
                        stiff[k] += 2.0 * share * soft;
                        stiff[k + step] += 2.0 * share * soft;
                    }
                }
                // A bend counts as far as there is cloth on both sides of its middle.
                for (step, share, b) in [(1, mean, weft), (n, mean, warp)] {
                    let ends = if step == 1 {
                        i > 0 && i + 1 < n
                    } else {
                        j > 0 && j + 1 < n
                    };
                    let both = if step == 1 {
                        (around[0] + around[2]).min(around[1] + around[3])
                    } else {
                        (around[0] + around[1]).min(around[2] + around[3])
                    };
                    if ends && both > 0.0 {
                        let stiffness = share * b / (h * h);
                        s.bends.push((k, step, stiffness));
                        stiff[k] += 8.0 * stiffness;
                        stiff[k - step] += 4.0 * stiffness;
                        stiff[k + step] += 4.0 * stiffness;
                    }
                }
                if around[3] > 0.0 {
                    let (shear, twist) = (
                        around[3] * m.shear * h * h,
                        around[3] * 2.0 * (warp * weft).sqrt() / (h * h),
                    );
                    s.cells.push((k, shear, twist));
                    for c in [k, k + 1, k + n, k + n + 1] {
                        stiff[c] += 2.0 * around[3] * m.shear + 4.0 * twist;
                    }
                }
            }
        }
        for j in 0..n {
            for i in 0..n {
                let k = j * n + i;
                let (x, y) = (i as f64 * h - radius, radius - j as f64 * h);
                let (r, angle) = (x.hypot(y), y.atan2(x) + turn);
                piece.x[0][k] = x;
                piece.x[1][k] = y;
                // What is held bends from the middle of its last free segment on, and the last vertex within a circle lies half a
                // segment inside it: both together, the cloth is held one segment beyond the table's edge.
                if stiff[k] > 0.0 && r > TABLE + h {
                    piece.inv_mass[k] = 1.0 / (0.3 * stiff[k]);
                    // Uneven enough to fold.
                    let wave: f64 = (2..10)
                        .map(|m| (f64::from(m) * angle + 6.3 * uniform(11, 0, m as u64)).cos())
                        .sum();
                    piece.x[2][k] = -(r - TABLE) * (0.2 + 0.03 * wave);
                }
            }
        }
        piece
    }

    fn forces(&mut self) {
        let (n, h) = (self.n, self.h);
        let (x, f) = (&self.x, &mut self.f);
        f[0].fill(0.0);
        f[1].fill(0.0);
        for (f, w) in f[2].iter_mut().zip(&self.weight) {
            *f = -w;
        }
        for &([a, b], k) in &self.springs.edges {
            let d: [f64; 3] = std::array::from_fn(|c| x[c][b] - x[c][a]);
            let length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
            let t = k * (1.0 - h / length);
            for c in 0..3 {
                f[c][a] += t * d[c];
                f[c][b] -= t * d[c];
            }
        }
        for &(k, step, stiffness) in &self.springs.bends {
            for c in 0..3 {
                let t = stiffness * (x[c][k - step] - 2.0 * x[c][k] + x[c][k + step]);
                f[c][k - step] -= t;
                f[c][k] += 2.0 * t;
                f[c][k + step] -= t;
            }
        }
        let r = 0.5 / h;
        for &(k, shear, twist) in &self.springs.cells {
            let corners = [k, k + 1, k + n, k + n + 1];
            let p: [[f64; 4]; 3] = std::array::from_fn(|c| corners.map(|k| x[c][k]));
            let e: [[f64; 2]; 3] = p.map(|[a, b, c, d]| [(d - a + b - c) * r, (d - a + c - b) * r]);
            let t = shear * r * (0..3).map(|c| e[c][0] * e[c][1]).sum::<f64>();
            for c in 0..3 {
                let [a, b, low, d] = p[c];
                let w = twist * (a - b - low + d);
                let (sum, difference) = (t * (e[c][0] + e[c][1]), t * (e[c][0] - e[c][1]));
                f[c][corners[0]] += sum - w;
                f[c][corners[1]] += w + difference;
                f[c][corners[2]] += w - difference;
                f[c][corners[3]] -= sum + w;
            }
        }
    }

    /// Runs until the shadow stays the same.
    fn relax(&mut self) {
        let (mut before, mut calm, mut last) = (0.0, 0, f64::INFINITY);
        for n in 1..=120_000 {
            self.forces();
            let mut kinetic = 0.0;
            for c in 0..3 {
                for k in 0..self.weight.len() {
                    let w = self.inv_mass[k];
                    if w > 0.0 {
                        self.v[c][k] += w * self.f[c][k];
                        kinetic += self.v[c][k] * self.v[c][k] / w;
                    }
                }
            }
            if kinetic < before {
                self.v.iter_mut().for_each(|v| v.fill(0.0));
                kinetic = 0.0;
            }
            before = kinetic;
            for (x, v) in self.x.iter_mut().zip(&self.v) {
                x.iter_mut().zip(v).for_each(|(x, v)| *x += v);
            }
            if n % 1000 == 0 {
                let now = self.shadow().0;
                // Two parts in ten thousand of the whole shadow, three times running.
                calm = if (now / last - 1.0).abs() < 2e-4 {
                    calm + 1
                } else {
                    0
                };
                if calm == 3 {
                    break;
                }
                last = now;
            }
        }
    }

    /// Area of the shadow, m², and the count of folds: the outline seen from above, star-shaped about the middle.
    fn shadow(&self) -> (f64, usize) {
        const DIRECTIONS: usize = 720;
        let tau = std::f64::consts::TAU;
        let mut reach = [TABLE; DIRECTIONS];
        let mut edge = [0.0; DIRECTIONS];
        for ring in 0..8 {
            let r = self.radius * (1.0 - 0.05 * f64::from(ring)) - 1e-9;
            let mut from: Option<[f64; 2]> = None;
            for k in 0..=4 * DIRECTIONS {
                let angle = tau * k as f64 / (4 * DIRECTIONS) as f64;
                let [x, y] = self.above(r * angle.cos(), r * angle.sin());
                let (at, out) = (
                    y.atan2(x).rem_euclid(tau) / tau * DIRECTIONS as f64,
                    x.hypot(y),
                );
                if let Some([at0, out0]) = from {
                    // From one point of the ring to the next, by the shorter way round.
                    let mut way = at - at0;
                    way -= (way / DIRECTIONS as f64).round() * DIRECTIONS as f64;
                    let steps = (2.0 * way.abs()).ceil().max(1.0) as usize;
                    for s in 0..=steps {
                        let t = s as f64 / steps as f64;
                        let d = (at0 + t * way).rem_euclid(DIRECTIONS as f64) as usize % DIRECTIONS;
                        let out = out0 + t * (out - out0);
                        reach[d] = f64::max(reach[d], out);
                        if ring == 0 {
                            edge[d] = out;
                        }
                    }
                }
                from = Some([at, out]);
            }
        }
        let area = reach
            .iter()
            .map(|r| 0.5 * r * r * tau / DIRECTIONS as f64)
            .sum();
        // A fold is a rise of the outline above its mean.
        let mean = reach.iter().sum::<f64>() / DIRECTIONS as f64;
        let margin = 0.02 * (self.radius - TABLE);
        let (mut folds, mut high) = (0usize, reach[0] > mean);
        for r in reach.iter().cycle().take(2 * DIRECTIONS).skip(1) {
            if high && *r < mean - margin {
                high = false;
            } else if !high && *r > mean + margin {
                high = true;
                folds += 1;
            }
        }
        (area, folds.div_ceil(2))
    }

    /// Where the point of the flat piece at (x, y) lies seen from above.
    fn above(&self, x: f64, y: f64) -> [f64; 2] {
        let most = (self.n - 1) as f64 - 1e-9;
        let (u, v) = (
            ((x + self.radius) / self.h).clamp(0.0, most),
            ((self.radius - y) / self.h).clamp(0.0, most),
        );
        let (i, j, s, t) = (u as usize, v as usize, u.fract(), v.fract());
        let k = j * self.n + i;
        std::array::from_fn(|c| {
            let x = &self.x[c];
            (1.0 - t) * ((1.0 - s) * x[k] + s * x[k + 1])
                + t * ((1.0 - s) * x[k + self.n] + s * x[k + self.n + 1])
        })
    }
}

/// The drape of a round piece of `diameter` m cut from a grid of `cells` along a side; `turn` (rad) turns the small unevenness that the
/// folds grow from.
#[must_use]
pub fn cusick(mechanics: &Mechanics, diameter: f64, cells: usize, turn: f64) -> Drape {
    let mut piece = Piece::new(mechanics, 0.5 * diameter, cells, turn);
    piece.relax();
    let (shadow, folds) = piece.shadow();
    let area = |r: f64| std::f64::consts::PI * r * r;
    Drape {
        coefficient: (shadow - area(TABLE)) / (area(0.5 * diameter) - area(TABLE)),
        folds,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_throws_its_whole_shadow_and_a_limp_cloth_next_to_none() {
        let with = |mm: f64| Mechanics {
            bending_length_warp_mm: Some(mm),
            bending_length_weft_mm: Some(mm),
            ..Mechanics::default()
        };
        let (board, limp) = (
            cusick(&with(90.0), 0.3, 24, 0.0),
            cusick(&with(9.0), 0.3, 24, 0.0),
        );
        assert!(
            board.coefficient > 0.9 && board.coefficient < 1.01,
            "{board:?}"
        );
        assert!(
            limp.coefficient < 0.5 * board.coefficient && limp.coefficient > 0.0,
            "{limp:?}"
        );
    }
}
