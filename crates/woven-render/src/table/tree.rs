//! A tree over the lights that have a place, so that one of thousands is found in a few steps.
//!
//! Conty Estevez and Kulla 2018, "Importance sampling of many lights with adaptive tree splitting": each cluster of
//! lights knows its box, its power and a cone around the directions it shines in; clusters are split where power, size and
//! spread of the halves are least. The stochastic cuts of that paper are left out. `cpu/tree.rs` walks through it.

use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, PI};

use super::{CLUSTER, DOUBLE_SIDED, LightRow, NONE, RECT, SPOT, TRIANGLE, Table};
use crate::cpu::math::luminance;

/// Parts of a side among which a split is looked for.
const BINS: usize = 12;

/// What is known about some lights together.
#[derive(Clone, Copy)]
struct Bound {
    lo: Vec3,
    hi: Vec3,
    /// Axis of the cone that holds all normals (of lamps: axes), and its half angle [rad].
    axis: Vec3,
    spread: f32,
    /// How far beyond that cone the lights shine [rad].
    reach: f32,
    /// Radiance times area, or intensity.
    power: f32,
}

#[derive(Clone, Copy)]
struct Item {
    row: u32,
    bound: Bound,
}

impl Bound {
    fn of(table: &Table, r: &LightRow) -> Self {
        let p = Vec3::from(r.p);
        let (u, v) = (Vec3::from(r.u), Vec3::from(r.v));
        let lum = luminance(Vec3::from(r.radiance));
        let point = Self {
            lo: p,
            hi: p,
            axis: Vec3::Z,
            spread: PI,
            reach: PI,
            power: lum,
        };
        match r.kind {
            RECT | TRIANGLE => {
                let mut corners = vec![p, p + u, p + v];
                if r.kind == RECT {
                    corners.push(p + u + v);
                }
                let material = table.shade[r.place as usize].material as usize;
                let two = table.materials[material].flags & DOUBLE_SIDED != 0;
                Self {
                    lo: corners.iter().copied().fold(p, Vec3::min),
                    hi: corners.iter().copied().fold(p, Vec3::max),
                    axis: r.n.into(),
                    spread: if two { PI } else { 0.0 },
                    reach: FRAC_PI_2,
                    power: lum * r.area.abs(),
                }
            }
            SPOT => Self {
                axis: r.n.into(),
                spread: 0.0,
                // A hair more than where it ends, for rounding.
                reach: (r.v[1].clamp(-1.0, 1.0).acos() + 1e-3).min(PI),
                ..point
            },
            _ => point,
        }
    }

    fn with(self, b: Self) -> Self {
        let (axis, spread) = cone(self.axis, self.spread, b.axis, b.spread);
        Self {
            lo: self.lo.min(b.lo),
            hi: self.hi.max(b.hi),
            axis,
            spread,
            reach: self.reach.max(b.reach),
            power: self.power + b.power,
        }
    }

    fn middle(&self) -> Vec3 {
        (self.lo + self.hi) * 0.5
    }

    /// Power times the square of the size times the solid angle shone into: the measure of the paper's (10), with the
    /// diagonal in place of the surface so that lights in a row have a size too.
    fn cost(&self) -> f32 {
        let o = self.spread;
        let w = (o + self.reach).min(PI);
        let (sin, cos) = o.sin_cos();
        let angle = 2.0 * PI * (1.0 - cos)
            + FRAC_PI_2 * (2.0 * w * sin - (o - 2.0 * w).cos() - 2.0 * o * sin + cos);
        self.power * (self.hi - self.lo).length_squared() * angle
    }
}

/// The smallest cone around two.
fn cone(a: Vec3, spread_a: f32, b: Vec3, spread_b: f32) -> (Vec3, f32) {
    if spread_b > spread_a {
        return cone(b, spread_b, a, spread_a);
    }
    let between = a.dot(b).clamp(-1.0, 1.0).acos();
    if (between + spread_b).min(PI) <= spread_a {
        return (a, spread_a);
    }
    let spread = 0.5 * (spread_a + between + spread_b);
    if spread >= PI {
        return (a, PI);
    }
    let towards = (b - a * a.dot(b))
        .try_normalize()
        .unwrap_or_else(|| a.any_orthonormal_vector());
    let (sin, cos) = (spread - spread_a).sin_cos();
    ((a * cos + towards * sin).normalize(), spread)
}

/// Clusters of the first `count` of `rows`, whose parents are noted there; `first` is the number that the first cluster
/// gets, which is the root.
pub(super) fn build(table: &Table, rows: &mut [LightRow], count: u32, first: u32) -> Vec<LightRow> {
    let mut items: Vec<Item> = (0..count)
        .map(|row| Item {
            row,
            bound: Bound::of(table, &rows[row as usize]),
        })
        .collect();
    let mut clusters = Vec::with_capacity(count as usize);
    if count > 1 {
        branch(&mut items, NONE, rows, first, &mut clusters);
    }
    clusters
}

fn branch(
    items: &mut [Item],
    parent: u32,
    rows: &mut [LightRow],
    first: u32,
    clusters: &mut Vec<LightRow>,
) -> u32 {
    if let [one] = items {
        rows[one.row as usize].parent = parent;
        return one.row;
    }
    let all = items[1..]
        .iter()
        .fold(items[0].bound, |sum, i| sum.with(i.bound));
    let half = (all.hi - all.lo) * 0.5;
    // A hair wider than the normals lie apart, so that rounding loses no light.
    let spread = (all.spread + 1e-3).min(PI);
    let me = clusters.len();
    clusters.push(LightRow {
        p: all.middle().into(),
        kind: CLUSTER,
        u: half.into(),
        v: [spread.cos(), spread.sin(), all.reach.cos()],
        n: all.axis.into(),
        area: half.length_squared(),
        radiance: [all.power, 0.0, 0.0],
        parent,
        ..LightRow::default()
    });
    let first_half = split(items);
    let (a, b) = items.split_at_mut(first_half);
    let number = first + me as u32;
    clusters[me].place = branch(a, number, rows, first, clusters);
    clusters[me].layer = branch(b, number, rows, first, clusters);
    number
}

/// Puts the items in order and tells how many belong to the first half.
fn split(items: &mut [Item]) -> usize {
    let middles = || items.iter().map(|i| i.bound.middle());
    let lo = middles().fold(Vec3::INFINITY, Vec3::min);
    let size = middles().fold(Vec3::NEG_INFINITY, Vec3::max) - lo;
    let mut best = (f32::INFINITY, 0, 0);
    let bin = |i: &Item, axis: usize| {
        let at = (i.bound.middle()[axis] - lo[axis]) / size[axis];
        ((at * BINS as f32) as usize).min(BINS - 1)
    };
    for axis in (0..3).filter(|&k| size[k] > 0.0) {
        let mut bins: [Option<Bound>; BINS] = [None; BINS];
        let join = |a: Option<Bound>, b: Option<Bound>| match (a, b) {
            (Some(a), Some(b)) => Some(a.with(b)),
            (a, b) => a.or(b),
        };
        for i in items.iter() {
            let slot = &mut bins[bin(i, axis)];
            *slot = join(*slot, Some(i.bound));
        }
        // Costs of all that lies behind each border.
        let mut behind = [None; BINS];
        for k in (0..BINS - 1).rev() {
            behind[k] = join(behind[k + 1], bins[k + 1]);
        }
        let mut before = None;
        for k in 0..BINS - 1 {
            before = join(before, bins[k]);
            if let (Some(a), Some(b)) = (before, behind[k]) {
                // Long boxes are cut across.
                let cost = (a.cost() + b.cost()) * size.max_element() / size[axis];
                if cost < best.0 {
                    best = (cost, axis, k);
                }
            }
        }
    }
    if best.0 == f32::INFINITY {
        return items.len() / 2;
    }
    items.sort_by_key(|i| bin(i, best.1) > best.2);
    items.partition_point(|i| bin(i, best.1) <= best.2)
}
