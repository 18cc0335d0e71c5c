//! Many rays at once: the camera's through a block of pixels, and those that look from there at one point. Eight rays
//! side by side are tested against a box; a box that no ray of the beam can meet is found by one test for all.
//!
//! Each shadow ray meets the same triangles in the same order as alone ([`super::bvh`]), so that the product of its
//! gaps has the same bits. The loops over lanes are plain Rust, compiled once for the base instruction set and once
//! for AVX2; nothing is contracted, so both give the same bits too.
//!
//! After Boulos, Wald and Shirley 2006, "Geometric and arithmetic culling methods for entire ray packets", and Overbeck,
//! Ramamoorthi and Mark 2008, "Large ray packets for real-time Whitted ray tracing".

mod group;

use glam::Vec3;

use super::bvh::{Hit, Ray};
use crate::bvh::{EMPTY, LEAF, STACK};
use crate::table::Table;
use group::{Group, Hull, Lanes, used};

/// Rays side by side.
const LANES: usize = 8;
/// Most groups of them.
const GROUPS: usize = 16;
/// Most rays of a beam.
pub(super) const MOST: usize = LANES * GROUPS;

/// Rays side by side.
pub(super) struct Beam {
    groups: [Group; GROUPS],
    count: usize,
}

impl Beam {
    pub(super) fn new() -> Self {
        Self {
            groups: [Group::NONE; GROUPS],
            count: 0,
        }
    }

    /// Empties it.
    pub(super) fn clear(&mut self) {
        let used = self.count.div_ceil(LANES);
        self.groups[..used].fill(Group::NONE);
        self.count = 0;
    }

    /// Adds a ray between the distances `begin` and `end`; its number. At most [`MOST`].
    pub(super) fn add(&mut self, ray: &Ray, begin: f32, end: f32) -> usize {
        let n = self.count;
        let (group, lane) = (&mut self.groups[n / LANES], n % LANES);
        for axis in 0..3 {
            group.o[axis].0[lane] = ray.o[axis];
            group.d[axis].0[lane] = ray.d[axis];
            group.inv[axis].0[lane] = ray.inv()[axis];
        }
        group.begin.0[lane] = begin;
        group.end.0[lane] = end;
        self.count += 1;
        n
    }

    /// Rays in it.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// What passed along ray `n`.
    pub(super) fn passed(&self, n: usize) -> f32 {
        self.groups[n / LANES].product.0[n % LANES]
    }

    /// What ray `n` met first.
    pub(super) fn hit(&self, n: usize) -> Option<Hit> {
        let (group, lane) = (&self.groups[n / LANES], n % LANES);
        (group.place[lane] != EMPTY).then(|| Hit {
            t: group.end.0[lane],
            place: group.place[lane],
            u: group.u.0[lane],
            v: group.v.0[lane],
        })
    }

    #[inline(always)]
    fn hull(&self) -> Hull {
        let mut hull = Hull {
            o: [Vec3::ZERO; 2],
            inv: [Vec3::ZERO; 2],
            begin: 0.0,
            end: 0.0,
        };
        // Lane by lane, then over the lanes.
        let mut low = [Lanes([f32::MAX; LANES]); 7];
        let mut high = [Lanes([-f32::MAX; LANES]); 7];
        for (g, group) in self.groups[..self.count.div_ceil(LANES)].iter().enumerate() {
            let [ox, oy, oz] = &group.o;
            let [ix, iy, iz] = &group.inv;
            let least = [ox, oy, oz, ix, iy, iz, &group.begin];
            let most = [ox, oy, oz, ix, iy, iz, &group.end];
            let lanes = (self.count - g * LANES).min(LANES);
            for k in 0..7 {
                if lanes == LANES {
                    low[k].least(least[k], LANES);
                    high[k].most(most[k], LANES);
                } else {
                    low[k].least(least[k], lanes);
                    high[k].most(most[k], lanes);
                }
            }
        }
        for axis in 0..3 {
            hull.o[0][axis] = low[axis].lowest();
            hull.o[1][axis] = high[axis].highest();
            hull.inv[0][axis] = low[3 + axis].lowest();
            hull.inv[1][axis] = high[3 + axis].highest();
        }
        hull.begin = low[6].lowest();
        hull.end = high[6].highest().max(0.0);
        hull
    }

    /// Follows all rays to their ends through all gaps: as [`super::bvh::transmittance`], without its coin for faint light.
    pub(super) fn pass(&mut self, table: &Table) {
        pulp::Arch::new().dispatch(Widest::<false>(self, table));
    }

    /// Finds what each ray meets first: as [`super::bvh::nearest`].
    pub(super) fn nearest(&mut self, table: &Table) {
        pulp::Arch::new().dispatch(Widest::<true>(self, table));
    }

    /// Every triangle that a group of rays may meet; for the `NEAREST` the nearer boxes first.
    #[inline(always)]
    fn walk<const NEAREST: bool>(&mut self, table: &Table) {
        if self.count == 0 || table.bvh.nodes.is_empty() {
            return;
        }
        let hull = self.hull();
        let ways = hull.ways();
        let all = (1_u32 << self.count.div_ceil(LANES)) - 1;
        let mut stack = [(0_u32, 0_u32); STACK];
        stack[0] = (0, all);
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (child, groups) = stack[top];
            if child & LEAF != 0 {
                let packet = child & !LEAF;
                let leaf = &table.bvh.packets[packet as usize];
                let used = used(leaf);
                for g in Bits(groups) {
                    let group = &mut self.groups[g];
                    for k in 0..used {
                        if NEAREST {
                            group.keep(leaf, packet, k);
                        } else {
                            group.pass(table, leaf, packet, k);
                        }
                    }
                }
                continue;
            }
            let node = &table.bvh.nodes[child as usize];
            let (near, mask) = hull.boxes(node);
            let base = top;
            let mut entries = [0.0_f32; 4];
            for lane in Bits(mask) {
                let child = node.child[lane];
                if child == EMPTY {
                    continue;
                }
                let mut met = 0;
                for g in Bits(groups) {
                    met |= u32::from(self.groups[g].meets(node, lane, &ways)) << g;
                }
                if met == 0 {
                    continue;
                }
                // With an order, the farthest goes down first.
                let mut at = top;
                if NEAREST {
                    while at > base && entries[at - base - 1] < near[lane] {
                        stack[at] = stack[at - 1];
                        entries[at - base] = entries[at - base - 1];
                        at -= 1;
                    }
                    entries[at - base] = near[lane];
                }
                stack[at] = (child, met);
                top += 1;
            }
        }
    }
}

/// A walk to be compiled for the widest vectors. No closure: what calls a closure is not always compiled into the wide copy.
struct Widest<'a, const NEAREST: bool>(&'a mut Beam, &'a Table);

impl<const NEAREST: bool> pulp::NullaryFnOnce for Widest<'_, NEAREST> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        let Self(beam, table) = self;
        beam.walk::<NEAREST>(table);
    }
}

/// The bits that are set, from the lowest.
struct Bits(u32);

impl Iterator for Bits {
    type Item = usize;
    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let lowest = self.0.trailing_zeros();
        self.0 &= self.0.wrapping_sub(1);
        (lowest < 32).then_some(lowest as usize)
    }
}

#[cfg(test)]
mod tests;
