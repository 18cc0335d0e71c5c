//! The guard: no step lets a part of the cloth pass through another.
//!
//! A curtain that starts without crossings keeps without: of all that does not share a vertex, whatever moves by less than nine tenths of
//! its distance cannot touch (the bound of Wu et al. 2020 and of Chen et al. 2025, "Offset Geometric Contact", here on relative
//! motion, so that folds that fly together cost nothing). What moves by more is followed to its first contact and parted there,
//! inelastically and with friction; what still meets after some rounds goes the rest of the step as one piece (the rigid zones of
//! Provot 1997), which ends always: in the last resort the cloth stays where it was for this step.
//!
//! Distances are kept for pairs of patches of cells. A pair's distance is only looked up again when the patches' relative motion has used up
//! what was left of it, which for most takes tens of steps. What is used up decides when to look, never what is found: a resumed run has
//! the same bits.

use super::distance::{Hit, Near, Point, blend, close_end, dot, first_hit};
use super::glance::glance;
use super::net::Net;
use super::patches::{Pair, Patches};
use super::tiles::Look;
use crate::sheet::Field;
use crate::work::widest;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Nearer than this the guard pushes apart what comes nearer still, m: a hundred times what single precision needs to tell them apart.
pub(super) const CLOSE: f64 = 5e-5;
/// Speed of that push, m/s.
const PUSH: f64 = 0.1;
/// Distances are told apart up to so many times the motion of the step: what is farther is looked at again after as many steps.
const AHEAD: f64 = 24.0;
/// And up to this at least, m, so that what rests is left alone.
const FAR: f64 = 40.0 * CLOSE;
/// A glance at neighbours on the cloth is enough where what it finds lasts for so many steps like this one.
const GLANCES: f64 = 2.0;
/// Rounds in which things are parted one by one; after them they move as one piece.
const ROUNDS: usize = 6;
/// Rounds after which the cloth stays where it was.
const LAST: usize = 60;

/// Changes the places `x` at the end of a step of `hp` seconds so that nothing has passed through anything since its start.
pub(super) fn keep_apart(patches: &mut Patches, net: Net, x: &mut Field, step: Step) {
    let mut zones = Zones::default();
    for round in 0..=LAST {
        patches.take_motions(net.before, x, step.parallel);
        if round == 0 {
            patches.gather_if_moved(net.before);
        }
        let found = look(patches, net.before, x, step.parallel);
        if found.is_empty() {
            break;
        }
        let met = if round < ROUNDS {
            found.iter().filter(|n| part(net, x, n, step)).count()
        } else if round < LAST {
            zones.join(net, x, &found)
        } else {
            x.clone_from(net.before);
            1
        };
        if met == 0 {
            break;
        }
    }
    patches.advance();
}

/// What a step is: h' in s, Coulomb friction, whether there are threads to share the work.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Step {
    pub(crate) hp: f64,
    pub(crate) friction: f64,
    pub(crate) parallel: bool,
}

/// All that may meet in this step, in an order that depends on the places alone.
fn look(patches: &mut Patches, before: &Field, x: &Field, parallel: bool) -> Vec<Near> {
    let (grids, tiles, cap) = (&patches.grids, &patches.tiles, patches.cap);
    let mut due: Vec<&mut Pair> = patches
        .pairs
        .iter_mut()
        .filter(|p| p.motion > 0.85 * p.slack || p.slack < 1.1 * CLOSE)
        .collect();
    let one = |pair: &mut Pair| {
        let mut found = Vec::new();
        let (a, b) = (&tiles[pair.a as usize], &tiles[pair.b as usize]);
        let adjoin = a.adjoins(b);
        if adjoin {
            let bound = widest(
                #[inline(always)]
                || glance(a, b, &grids[a.grid], before),
            );
            if 0.85 * bound > GLANCES * pair.motion && bound > 1.1 * CLOSE {
                pair.slack = bound.min(cap);
                return found;
            }
        }
        // Neighbours on the cloth have near things to be told apart in any case.
        let far = if adjoin {
            cap
        } else {
            (AHEAD * pair.motion).max(FAR).min(cap)
        };
        let look = Look {
            grids,
            before,
            now: x,
            cap: far,
            near: (pair.motion / 0.89).max(CLOSE),
        };
        pair.slack = widest(
            #[inline(always)]
            || a.look(b, pair.a == pair.b, &look, &mut found),
        );
        found
    };
    if parallel && due.len() > 16 {
        due.par_iter_mut().flat_map_iter(|p| one(p)).collect()
    } else {
        due.iter_mut().flat_map(|p| one(p)).collect()
    }
}

/// Parts the two if they meet in the step or end too close; tells whether it moved them.
fn part(net: Net, x: &mut Field, near: &Near, step: Step) -> bool {
    let k = near.vertex.map(|k| k as usize);
    let w = k.map(|k| net.inv_mass[k]);
    let (p, way) = places(net.before, x, k);
    let hit = first_hit(near.edges, &p, &way);
    let Some(Hit {
        time,
        distance,
        weight,
        normal,
    }) = hit.or_else(|| close_end(near.edges, &p, &way, CLOSE))
    else {
        return false;
    };
    let mass: f64 = (0..4).map(|n| w[n] * weight[n] * weight[n]).sum();
    if mass <= 0.0 {
        return false;
    }
    let slip = blend(weight, &way);
    let along = dot(slip, normal);
    let out = (1.0 - time) * (-along).max(0.0) + (CLOSE - distance).clamp(0.0, PUSH * step.hp);
    let side: Point = std::array::from_fn(|c| slip[c] - along * normal[c]);
    let length = dot(side, side).sqrt();
    let hold = if length > 0.0 {
        (step.friction * out / length).min(1.0)
    } else {
        0.0
    };
    for n in 0..4 {
        for c in 0..3 {
            x[c][k[n]] += w[n] * weight[n] / mass * (out * normal[c] - hold * side[c]);
        }
    }
    true
}

/// Where four vertices were, and how far they went.
fn places(before: &Field, x: &Field, k: [usize; 4]) -> ([Point; 4], [Point; 4]) {
    let p = k.map(|k| [before[0][k], before[1][k], before[2][k]]);
    let way = std::array::from_fn(|n| std::array::from_fn(|c| x[c][k[n]] - p[n][c]));
    (p, way)
}

/// Vertices that go as one piece to the end of the step.
#[derive(Default)]
struct Zones {
    /// Each vertex and another of its zone, the zone's least vertex in the end.
    link: BTreeMap<usize, usize>,
}

impl Zones {
    fn root(&mut self, k: usize) -> usize {
        let up = *self.link.entry(k).or_insert(k);
        if up == k {
            return k;
        }
        let root = self.root(up);
        self.link.insert(k, root);
        root
    }

    /// Joins what meets and moves every zone as one; tells how many met.
    fn join(&mut self, net: Net, x: &mut Field, found: &[Near]) -> usize {
        let mut met = 0;
        for near in found {
            let k = near.vertex.map(|k| k as usize);
            let (p, way) = places(net.before, x, k);
            let pinned = k.iter().all(|&k| net.inv_mass[k] == 0.0);
            if pinned || first_hit(near.edges, &p, &way).is_none() {
                continue;
            }
            met += 1;
            for other in &k[1..] {
                let (a, b) = (self.root(k[0]), self.root(*other));
                self.link.insert(a.max(b), a.min(b));
            }
        }
        if met == 0 {
            return 0;
        }
        let members: Vec<usize> = self.link.keys().copied().collect();
        // Sum of mass times way; what is pinned weighs all.
        let mut sums: BTreeMap<usize, ([f64; 3], f64)> = BTreeMap::new();
        for &k in &members {
            let w = net.inv_mass[k];
            let mass = if w > 0.0 { 1.0 / w } else { 1e12 };
            let root = self.root(k);
            let sum = sums.entry(root).or_default();
            for c in 0..3 {
                sum.0[c] += mass * (x[c][k] - net.before[c][k]);
            }
            sum.1 += mass;
        }
        for &k in &members {
            let (way, mass) = sums[&self.root(k)];
            for c in 0..3 {
                x[c][k] = net.before[c][k] + way[c] / mass;
            }
        }
        met
    }
}
