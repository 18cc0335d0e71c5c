//! Contact of the cloth with itself: every vertex carries a small disc of the sheet around it, and no vertex of another fold may
//! pass through that disc.
//!
//! The disc lies in the tangent plane and reaches a little beyond the middle of the grid's cells, so discs leave no hole. When a
//! vertex comes near a disc, the side on which it came is remembered; it is kept on that side until it has left over the rim. A
//! vertex that slipped through within a step is so brought back instead of being held on the wrong side. Between folds lies a soft
//! cushion of nearly the grid's spacing, so that they part before their edges can cross, and a thin hard core; stacked pleats press
//! the cushion together.
//!
//! It is no proof that no triangle ever crosses another. Measured with `woven-cloth check`: none while a curtain is drawn to a fifth of
//! its rail; in the gusts of the built-in catalog (satin, 97 × 61 vertices, 48 frames) edges pierce triangles in 3 frames.

use super::sort_into_cells;
use crate::sheet::{Field, Sheet};

/// Acceleration that parts what lies closer than the gap, m/s².
const REPULSION: f64 = 150.0;
/// Cushion between folds, in spacings of the grid.
const CUSHION: f64 = 0.8;
/// Share of the cushion that is kept hard, at the end of a step.
const CORE: f64 = 0.4;
/// Share of the way into the core that is taken back within the step. A compromise, like the core and the neighbours' share: 0.8 of
/// it, or more of the neighbours, stretches threads by over 6 % where folds meet hard; 0.5 of it with a core of 0.25 and half for the
/// neighbours lets edges cross in 28 of the catalog's 48 frames. These three: 3 frames, strain below 4 % in 600 frames of gusts.
const TAKEN: f64 = 0.65;
/// Share of such a push that the four neighbours of a vertex get, so that the threads between are pulled less.
const SHARED: f64 = 0.25;
/// Speed at which what is inside that core is moved out, m/s.
const WAY_OUT: f64 = 0.3;
/// Beyond so many cushions from the plane a vertex is free, and its side is taken anew.
const FREE: f64 = 1.25;

/// When in a step contact is looked after.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stage {
    /// Before the threads are solved: a cushion without spring takes the approach back, the more the deeper.
    Cushion,
    /// After: what is still closer than the hard core is parted.
    Part,
}

/// Two vertices of different folds, and for the disc of each the side on which the other is (0: not over the disc).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Pair {
    pub(crate) a: u32,
    pub(crate) b: u32,
    pub(crate) side: [i8; 2],
}

/// Contact of the cloth with itself, with Coulomb friction.
#[derive(Clone, Debug)]
pub struct SelfContact {
    /// Thickness of the cushion between folds, m.
    gap: f64,
    /// Radius of a disc, m.
    radius: f64,
    friction: f64,
    margin: f64,
    pairs: Vec<Pair>,
    /// Where the vertices were when the pairs were gathered.
    seen: Field,
}

impl SelfContact {
    /// Contact for the grid and the thickness of `sheet`, with Coulomb `friction`.
    #[must_use]
    pub fn new(sheet: &Sheet, friction: f64) -> Self {
        let spacing = sheet.hx.min(sheet.hy);
        Self {
            gap: (CUSHION * spacing).max(sheet.mechanics.thickness),
            // Half the diagonal of a cell and a little more for a stretched one. On a mesh of long cells discs would reach over
            // many vertices (the cost grows with the square of that): there they leave holes instead.
            radius: (0.53 * sheet.hx.hypot(sheet.hy)).min(1.2 * spacing),
            friction,
            margin: 0.5 * spacing,
            pairs: Vec::new(),
            seen: Field::default(),
        }
    }

    /// Thickness of the cushion between folds, m.
    #[must_use]
    pub fn gap(&self) -> f64 {
        self.gap
    }

    /// Forgets the pairs, as after a jump.
    pub fn restart(&mut self) {
        self.seen = Field::default();
        self.pairs.clear();
    }

    /// The pairs that have a side, for a saved state.
    pub(crate) fn active(&self) -> impl Iterator<Item = &Pair> {
        self.pairs.iter().filter(|p| p.side != [0; 2])
    }

    /// Takes up the sides of a saved state.
    pub(crate) fn resume(&mut self, pairs: Vec<Pair>) {
        self.seen = Field::default();
        self.pairs = pairs;
    }

    /// Looks after all pairs in `x`, the place so far; the sheet still has the places before the step.
    pub(crate) fn resolve(&mut self, sheet: &Sheet, x: &mut Field, hp: f64, stage: Stage) {
        if stage == Stage::Cushion {
            self.gather_if_moved(sheet, x);
        }
        let reach2 = self.radius.powi(2) + (FREE * self.gap).powi(2);
        let mut pairs = std::mem::take(&mut self.pairs);
        for pair in &mut pairs {
            let (a, b) = (pair.a as usize, pair.b as usize);
            let d = between(x, a, b);
            if dot(d, d) >= reach2 {
                pair.side = [0; 2];
                continue;
            }
            if sheet.inv_mass[a] + sheet.inv_mass[b] == 0.0 {
                continue;
            }
            self.over(sheet, x, [a, b], &mut pair.side[0], hp, stage);
            self.over(sheet, x, [b, a], &mut pair.side[1], hp, stage);
        }
        self.pairs = pairs;
    }

    /// Vertex `v` over the disc of vertex `o`.
    fn over(
        &self,
        sheet: &Sheet,
        x: &mut Field,
        [o, v]: [usize; 2],
        side: &mut i8,
        hp: f64,
        stage: Stage,
    ) {
        let d = between(x, o, v);
        let n = normal(sheet, x, o);
        let height = dot(n, d);
        if dot(d, d) - height * height > self.radius * self.radius {
            *side = 0;
            return;
        }
        if *side == 0 {
            *side = if height < 0.0 { -1 } else { 1 };
        }
        let sign = f64::from(*side);
        let away = height * sign;
        let (wo, wv) = (sheet.inv_mass[o], sheet.inv_mass[v]);
        let keep = if stage == Stage::Part {
            CORE * self.gap
        } else {
            self.gap
        };
        if away >= keep || wo + wv == 0.0 {
            return;
        }
        let before = between(&sheet.x, o, v);
        let mut slip: [f64; 3] = std::array::from_fn(|c| d[c] - before[c]);
        let along = dot(slip, n);
        let approach = (-along * sign).max(0.0);
        let out = match stage {
            Stage::Cushion => {
                let depth = 1.0 - away / keep;
                REPULSION * hp * hp * depth.min(1.0) + approach * (4.0 * depth).min(1.0)
            }
            Stage::Part => (keep - away).min(TAKEN * approach + WAY_OUT * hp),
        };
        let push = out * sign / (wo + wv);
        for c in 0..3 {
            slip[c] -= along * n[c];
        }
        let way = dot(slip, slip).sqrt();
        let hold = if way > 0.0 {
            (self.friction * out / way).min(1.0) / (wo + wv)
        } else {
            0.0
        };
        let shift: [f64; 3] = std::array::from_fn(|c| n[c] * push - slip[c] * hold);
        for c in 0..3 {
            x[c][o] -= wo * shift[c];
            x[c][v] += wv * shift[c];
        }
        if stage == Stage::Part {
            // The neighbours on the cloth come along, so that the threads between are pulled less.
            for (k, sign) in [(o, -SHARED), (v, SHARED)] {
                let (i, j) = (k % sheet.nx, k / sheet.nx);
                let near = [
                    (i > 0, k.wrapping_sub(1)),
                    (i + 1 < sheet.nx, k + 1),
                    (j > 0, k.wrapping_sub(sheet.nx)),
                    (j + 1 < sheet.ny, k + sheet.nx),
                ];
                for (there, k) in near {
                    if there {
                        for c in 0..3 {
                            x[c][k] += sign * sheet.inv_mass[k] * shift[c];
                        }
                    }
                }
            }
        }
    }

    /// Gathers pairs anew when a vertex has moved more than half the margin; pairs keep their sides.
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
        let old: Vec<Pair> = self.active().copied().collect();
        self.pairs.clear();
        let reach = self.radius.hypot(FREE * self.gap) + self.margin;
        let cells = sort_into_cells(x, reach);
        let nx = sheet.nx;
        for a in 0..x[0].len() {
            let (ia, ja) = (a % nx, a / nx);
            let first = self.pairs.len();
            let p = [x[0][a], x[1][a], x[2][a]];
            cells.near(p, |b| {
                if b <= a {
                    return;
                }
                let d2: f64 = (0..3).map(|c| (x[c][b] - p[c]).powi(2)).sum();
                if d2 >= reach * reach {
                    return;
                }
                let (di, dj) = ((b % nx).abs_diff(ia), (b / nx).abs_diff(ja));
                if di <= 1 && dj <= 1 {
                    return;
                }
                // Neighbours on the cloth meet only in a sharp crease.
                let on_cloth2 = (di as f64 * sheet.hx).powi(2) + (dj as f64 * sheet.hy).powi(2);
                if d2 < 0.81 * on_cloth2 {
                    self.pairs.push(Pair {
                        a: a as u32,
                        b: b as u32,
                        side: [0; 2],
                    });
                }
            });
            // The order of pairs must not depend on when they were gathered, or a resumed run would differ in its last bits.
            self.pairs[first..].sort_unstable_by_key(|p| p.b);
        }
        let mut old = old.iter().peekable();
        for pair in &mut self.pairs {
            while old.next_if(|o| (o.a, o.b) < (pair.a, pair.b)).is_some() {}
            if let Some(o) = old.peek()
                && (o.a, o.b) == (pair.a, pair.b)
            {
                pair.side = o.side;
            }
        }
    }
}

#[inline(always)]
fn between(x: &Field, a: usize, b: usize) -> [f64; 3] {
    [x[0][b] - x[0][a], x[1][b] - x[1][a], x[2][b] - x[2][a]]
}

#[inline(always)]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The sheet's unit normal at vertex `k`, from its neighbours along weft and warp.
#[inline(always)]
fn normal(sheet: &Sheet, x: &Field, k: usize) -> [f64; 3] {
    let (nx, ny) = (sheet.nx, sheet.ny);
    let (i, j) = (k % nx, k / nx);
    let e = between(x, k - usize::from(i > 0), k + usize::from(i + 1 < nx));
    let f = between(
        x,
        if j > 0 { k - nx } else { k },
        if j + 1 < ny { k + nx } else { k },
    );
    let n = [
        e[1] * f[2] - e[2] * f[1],
        e[2] * f[0] - e[0] * f[2],
        e[0] * f[1] - e[1] * f[0],
    ];
    let inv = 1.0 / dot(n, n).max(1e-30).sqrt();
    n.map(|c| c * inv)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fabrics::Mechanics;

    /// A strip folded in the middle: its lower half hangs `gap` metres behind the upper.
    fn folded(gap: f64) -> Sheet {
        let mut sheet = Sheet::flat(3, 21, 0.1, 1.0, Mechanics::default());
        for k in 33..63 {
            let (i, j) = (k % 3, k / 3);
            let up = sheet.x[1][(20 - j) * 3 + i];
            sheet.set_position(k, [i as f64 * 0.05, up, gap]);
        }
        sheet
    }

    #[test]
    fn folds_are_pushed_apart_and_a_flat_sheet_is_left_alone() {
        let sheet = folded(0.006);
        let mut contact = SelfContact::new(&sheet, 0.0);
        assert!((contact.gap() - 0.04).abs() < 1e-12);
        let mut x = sheet.x.clone();
        contact.resolve(&sheet, &mut x, 1e-3, Stage::Cushion);
        assert!(
            x[2][61] > 0.006 && x[2][1] < 0.0,
            "the ends part: {} {}",
            x[2][61],
            x[2][1]
        );
        let flat = Sheet::flat(3, 21, 0.1, 1.0, Mechanics::default());
        let mut x = flat.x.clone();
        let mut contact = SelfContact::new(&flat, 0.0);
        contact.resolve(&flat, &mut x, 1e-3, Stage::Cushion);
        contact.resolve(&flat, &mut x, 1e-3, Stage::Part);
        assert_eq!(x, flat.x);
        assert!(contact.pairs.is_empty());
    }

    #[test]
    fn what_slipped_through_is_brought_back_to_its_side() {
        let mut sheet = folded(0.006);
        let mut contact = SelfContact::new(&sheet, 0.0);
        let mut x = sheet.x.clone();
        contact.resolve(&sheet, &mut x, 1e-3, Stage::Cushion);
        // One step later the lower half is 2 mm on the other side.
        let mut x = sheet.x.clone();
        for k in 33..63 {
            x[2][k] = -0.002;
        }
        for _ in 0..200 {
            contact.resolve(&sheet, &mut x, 1e-3, Stage::Part);
            sheet.x.clone_from(&x);
        }
        let apart = x[2][61] - x[2][1];
        // The core is a quarter of a cushion of 40 mm.
        assert!(apart > 0.0095, "{apart}");
    }
}
