//! Contact of the cloth with itself: a soft cushion between folds, and the guard behind it.
//!
//! Every vertex carries a small disc of the sheet around it. A vertex of another fold that comes near such a disc is held off by a
//! cushion without spring: it takes the approach back, the more the deeper, with Coulomb friction. The disc lies in the tangent plane and
//! reaches a little beyond the middle of the grid's cells. The cushion parts folds before they meet, so that nothing stops at once and
//! threads stay short; that nothing passes through anything is the guard's part (`guard`).
//!
//! An earlier form also moved vertices out of a hard core after the threads were solved: it stretched threads by 8 % where this leaves
//! 2 % (64 x 64, gusts of 3 m/s), and edges still crossed.

use super::creases::hold_open;
use super::guard::{Step, keep_apart};
use super::net::{Grid, Net};
use super::patches::{Patches, Touch};
use crate::sheet::{Field, Sheet};
use crate::work::widest;

/// Acceleration that parts what lies closer than the gap, m/s².
const REPULSION: f64 = 150.0;
/// Cushion between folds, in spacings of the grid.
const CUSHION: f64 = 0.5;
/// Beyond so many cushions from the plane a vertex is free.
const FREE: f64 = 1.25;
/// How far patches may move against each other before their vertices are listed anew, in spacings of the grid.
const MARGIN: f64 = 0.5;

/// Contact of the cloth with itself, with Coulomb friction.
#[derive(Clone, Debug)]
pub struct SelfContact {
    /// Thickness of the cushion between folds, m.
    gap: f64,
    /// Radius of a disc, m.
    radius: f64,
    friction: f64,
    margin: f64,
    patches: Patches,
}

impl SelfContact {
    /// Contact for the grid and the thickness of `sheet`, with Coulomb `friction`.
    #[must_use]
    pub fn new(sheet: &Sheet, friction: f64) -> Self {
        Self::among(&[sheet], friction)
    }

    /// Contact of several sheets, each with itself and with the others; their vertices are numbered one sheet after the other.
    pub(crate) fn among(sheets: &[&Sheet], friction: f64) -> Self {
        let grids = Grid::of(sheets);
        let least = |of: &dyn Fn(&Grid) -> f64| grids.iter().map(of).fold(f64::INFINITY, f64::min);
        let spacing = least(&|g| g.hx.min(g.hy));
        let diagonal = least(&|g| g.hx.hypot(g.hy));
        let thickness = sheets.iter().map(|s| s.mechanics.thickness);
        let gap = (CUSHION * spacing).max(thickness.fold(0.0, f64::max));
        // Half the diagonal of a cell and a little more for a stretched one. On a mesh of long cells discs would reach over many vertices
        // (the cost grows with the square of that): there they leave holes, which the guard closes.
        let radius = (0.53 * diagonal).min(1.2 * spacing);
        Self {
            gap,
            radius,
            friction,
            margin: MARGIN * spacing,
            patches: Patches::new(&grids, radius.hypot(FREE * gap)),
        }
    }

    /// Thickness of the cushion between folds, m.
    #[must_use]
    pub fn gap(&self) -> f64 {
        self.gap
    }

    /// Forgets all distances, as after a jump.
    pub fn restart(&mut self) {
        self.patches.restart();
    }

    /// The cushion, before the threads are solved: changes `x`, the places so far in a step of `hp` seconds from the places `before`.
    pub(crate) fn cushion(&mut self, inv_mass: &[f64], before: &Field, x: &mut Field, hp: f64) {
        if self.patches.is_new() {
            self.patches.gather_if_moved(before);
        }
        widest(
            #[inline(always)]
            || hold_open(&self.patches.grids, inv_mass, before, x, hp),
        );
        let reach = self.patches.cap;
        for at in 0..self.patches.pairs.len() {
            if self.patches.pairs[at].slack >= reach {
                continue;
            }
            if self.patches.pairs[at].budget < 0.0 {
                self.list(at, before);
            }
            let net = Net {
                grids: &self.patches.grids,
                inv_mass,
                before,
            };
            // Pairs are chosen by where they were, so that it does not matter when they were listed.
            for &Touch { a, b, near } in &self.patches.touch[at] {
                let (a, b) = (a as usize, b as usize);
                let d = between(before, a, b);
                if dot(d, d) < near && inv_mass[a] + inv_mass[b] > 0.0 {
                    self.over(net, x, [a, b], hp);
                    self.over(net, x, [b, a], hp);
                }
            }
        }
    }

    /// Lets nothing have passed through anything at the end of a step of `hp` seconds from the places `before`.
    pub(crate) fn keep_apart(
        &mut self,
        inv_mass: &[f64],
        before: &Field,
        x: &mut Field,
        hp: f64,
        parallel: bool,
    ) {
        let grids = self.patches.grids.clone();
        let net = Net {
            grids: &grids,
            inv_mass,
            before,
        };
        let step = Step {
            hp,
            friction: self.friction,
            parallel,
        };
        keep_apart(&mut self.patches, net, x, step);
    }

    /// Lists the vertices of pair number `at` that may come near before its patches have moved by the margin.
    fn list(&mut self, at: usize, before: &Field) {
        let patches = &mut self.patches;
        let pair = &mut patches.pairs[at];
        let touch = &mut patches.touch[at];
        let (mine, theirs) = (
            &patches.tiles[pair.a as usize],
            &patches.tiles[pair.b as usize],
        );
        let reach2 = (patches.cap + self.margin).powi(2);
        let net = Net {
            grids: &patches.grids,
            inv_mass: &[],
            before,
        };
        touch.clear();
        mine.for_each_vertex(&patches.grids, |a| {
            let p = [before[0][a], before[1][a], before[2][a]];
            theirs.for_each_vertex(&patches.grids, |b| {
                let d = [
                    before[0][b] - p[0],
                    before[1][b] - p[1],
                    before[2][b] - p[2],
                ];
                if dot(d, d) < reach2 && (pair.a != pair.b || a < b) && net.apart_on_cloth(a, b) {
                    let near = net.meet_within(a, b).min(patches.cap * patches.cap);
                    let (a, b) = (a as u32, b as u32);
                    touch.push(Touch { a, b, near });
                }
            });
        });
        pair.budget = self.margin;
    }

    /// Vertex `v` over the disc of vertex `o`, on the side where it was before the step.
    fn over(&self, net: Net, x: &mut Field, [o, v]: [usize; 2], hp: f64) {
        let d = between(x, o, v);
        let n = normal(net.grid(o), x, o);
        let height = dot(n, d);
        if dot(d, d) - height * height > self.radius * self.radius {
            return;
        }
        let before = between(net.before, o, v);
        let sign = if dot(normal(net.grid(o), net.before, o), before) < 0.0 {
            -1.0
        } else {
            1.0
        };
        let away = height * sign;
        let (wo, wv) = (net.inv_mass[o], net.inv_mass[v]);
        if away >= self.gap {
            return;
        }
        let mut slip: [f64; 3] = std::array::from_fn(|c| d[c] - before[c]);
        let along = dot(slip, n);
        let approach = (-along * sign).max(0.0);
        let depth = 1.0 - away / self.gap;
        let out = REPULSION * hp * hp * depth.min(1.0) + approach * (4.0 * depth).min(1.0);
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
        for c in 0..3 {
            let shift = n[c] * push - slip[c] * hold;
            x[c][o] -= wo * shift;
            x[c][v] += wv * shift;
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
fn normal(grid: &Grid, x: &Field, k: usize) -> [f64; 3] {
    let (nx, ny) = (grid.nx, grid.ny);
    let (i, j) = ((k - grid.first) % nx, (k - grid.first) / nx);
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
    use crate::crossing::crossings;
    use crate::fabrics::Mechanics;
    use crate::mesh::Mesh;

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
        assert!((contact.gap() - 0.025).abs() < 1e-12);
        let mut x = sheet.x.clone();
        contact.cushion(&sheet.inv_mass, &sheet.x, &mut x, 1e-3);
        assert!(
            x[2][61] > 0.006 && x[2][1] < 0.0,
            "the ends part: {} {}",
            x[2][61],
            x[2][1]
        );
        let flat = Sheet::flat(3, 21, 0.1, 1.0, Mechanics::default());
        let mut x = flat.x.clone();
        let mut contact = SelfContact::new(&flat, 0.0);
        contact.cushion(&flat.inv_mass, &flat.x, &mut x, 1e-3);
        contact.keep_apart(&flat.inv_mass, &flat.x, &mut x, 1e-3, false);
        assert_eq!(x, flat.x);
    }

    #[test]
    fn what_would_pass_through_in_one_step_is_stopped_before() {
        for fast in [0.01, 0.2] {
            let sheet = folded(0.006);
            let mut contact = SelfContact::new(&sheet, 0.0);
            // The lower half, hung behind the upper, goes to its other side in one step, edges slanting.
            let mut x = sheet.x.clone();
            for k in 33..63 {
                x[2][k] -= fast;
                x[0][k] += 0.003;
            }
            contact.keep_apart(&sheet.inv_mass, &sheet.x, &mut x, 1e-3, false);
            let mesh = Mesh::from_sheet(&sheet);
            let places: Vec<[f32; 3]> = (0..63)
                .map(|k| std::array::from_fn(|c| x[c][k] as f32))
                .collect();
            assert_eq!(crossings(&places, &mesh), 0, "{fast} m");
            if fast < 0.1 {
                for k in 36..63 {
                    let (i, j) = (k % 3, k / 3);
                    let apart = x[2][k] - x[2][(20 - j) * 3 + i];
                    // A tenth of the distance is always left.
                    assert!(apart > 0.0005, "vertex {k}, {fast} m: {apart}");
                }
            }
        }
    }
}
