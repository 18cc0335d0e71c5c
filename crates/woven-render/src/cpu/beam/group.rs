//! Eight rays of a beam against one box or one triangle, and the bounds of all its rays against four boxes.

use glam::{Vec3, Vec4};

use super::LANES;
use crate::bvh::{EMPTY, Node, Packet};
use crate::cpu::bvh::FAINTEST;
use crate::cpu::surface;
use crate::table::Table;

#[derive(Clone, Copy)]
#[repr(align(32))]
pub(super) struct Lanes(pub [f32; LANES]);

impl Lanes {
    pub(super) const ZERO: Self = Self([0.0; LANES]);

    /// The lesser of both in each of the first lanes.
    #[inline(always)]
    pub(super) fn least(&mut self, other: &Self, lanes: usize) {
        for i in 0..lanes {
            self.0[i] = lesser(self.0[i], other.0[i]);
        }
    }

    /// The greater of both in each of the first lanes.
    #[inline(always)]
    pub(super) fn most(&mut self, other: &Self, lanes: usize) {
        for i in 0..lanes {
            self.0[i] = greater(self.0[i], other.0[i]);
        }
    }

    #[inline(always)]
    pub(super) fn lowest(&self) -> f32 {
        let mut all = self.0[0];
        for i in 1..LANES {
            all = lesser(all, self.0[i]);
        }
        all
    }

    #[inline(always)]
    pub(super) fn highest(&self) -> f32 {
        let mut all = self.0[0];
        for i in 1..LANES {
            all = greater(all, self.0[i]);
        }
        all
    }
}

/// As the processor's own instruction: no care is taken of what is not a number.
#[inline(always)]
fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Eight rays. A lane whose end lies before its beginning meets nothing.
#[derive(Clone, Copy)]
pub(super) struct Group {
    pub o: [Lanes; 3],
    pub d: [Lanes; 3],
    pub inv: [Lanes; 3],
    pub begin: Lanes,
    /// The nearest hit so far, or how far a shadow ray goes.
    pub end: Lanes,
    /// Of the gaps on the way.
    pub product: Lanes,
    /// Barycentric coordinates and place of the nearest hit.
    pub u: Lanes,
    pub v: Lanes,
    pub place: [u32; LANES],
}

/// Where a triangle is met, by lanes.
struct Met {
    /// Distance; [`NOWHERE`] where it is not met.
    t: Lanes,
    u: Lanes,
    v: Lanes,
    /// Some ray meets it.
    any: bool,
}

/// Which way all rays of a beam go along an axis.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Way {
    Up,
    Down,
    Both,
}

/// Farther than anything.
const NOWHERE: f32 = f32::MAX;

impl Group {
    pub(super) const NONE: Self = Self {
        o: [Lanes::ZERO; 3],
        d: [Lanes::ZERO; 3],
        inv: [Lanes::ZERO; 3],
        begin: Lanes::ZERO,
        end: Lanes([-1.0; LANES]),
        product: Lanes([1.0; LANES]),
        u: Lanes::ZERO,
        v: Lanes::ZERO,
        place: [EMPTY; LANES],
    };

    /// Whether some ray meets the box of lane `k` of the node, which holds something.
    #[inline(always)]
    pub(super) fn meets(&self, node: &Node, k: usize, ways: &[Way; 3]) -> bool {
        let (mut near, mut far) = (self.begin, self.end);
        for axis in 0..3 {
            let (lo, hi) = (node.lo[axis][k], node.hi[axis][k]);
            let (o, inv) = (&self.o[axis].0, &self.inv[axis].0);
            if ways[axis] == Way::Both {
                for i in 0..LANES {
                    let (a, b) = ((lo - o[i]) * inv[i], (hi - o[i]) * inv[i]);
                    near.0[i] = greater(near.0[i], lesser(a, b));
                    far.0[i] = lesser(far.0[i], greater(a, b));
                }
            } else {
                let (enter, leave) = if ways[axis] == Way::Up {
                    (lo, hi)
                } else {
                    (hi, lo)
                };
                for i in 0..LANES {
                    near.0[i] = greater(near.0[i], (enter - o[i]) * inv[i]);
                    far.0[i] = lesser(far.0[i], (leave - o[i]) * inv[i]);
                }
            }
        }
        let mut any = false;
        for i in 0..LANES {
            any |= near.0[i] <= far.0[i];
        }
        any
    }

    /// Where the triangle in lane `k` is met. The same steps as for a single ray.
    #[inline(always)]
    fn triangle(&self, p: &Packet, k: usize) -> Met {
        let v0 = [p.v0[0][k], p.v0[1][k], p.v0[2][k]];
        let e1 = [p.e1[0][k], p.e1[1][k], p.e1[2][k]];
        let e2 = [p.e2[0][k], p.e2[1][k], p.e2[2][k]];
        let [dx, dy, dz] = &self.d;
        let [ox, oy, oz] = &self.o;
        let mut met = Met {
            t: Lanes::ZERO,
            u: Lanes::ZERO,
            v: Lanes::ZERO,
            any: false,
        };
        for i in 0..LANES {
            let (dx, dy, dz) = (dx.0[i], dy.0[i], dz.0[i]);
            let px = dy * e2[2] - dz * e2[1];
            let py = dz * e2[0] - dx * e2[2];
            let pz = dx * e2[1] - dy * e2[0];
            let det = e1[0] * px + e1[1] * py + e1[2] * pz;
            let inv = 1.0 / det;
            let inv = if det == 0.0 { 0.0 } else { inv };
            let (sx, sy, sz) = (ox.0[i] - v0[0], oy.0[i] - v0[1], oz.0[i] - v0[2]);
            let u = (sx * px + sy * py + sz * pz) * inv;
            let qx = sy * e1[2] - sz * e1[1];
            let qy = sz * e1[0] - sx * e1[2];
            let qz = sx * e1[1] - sy * e1[0];
            let v = (dx * qx + dy * qy + dz * qz) * inv;
            let t = (e2[0] * qx + e2[1] * qy + e2[2] * qz) * inv;
            let inside = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0);
            let between = (t > self.begin.0[i]) & (t < self.end.0[i]);
            met.t.0[i] = if inside & between { t } else { NOWHERE };
            met.u.0[i] = u;
            met.v.0[i] = v;
        }
        for i in 0..LANES {
            met.any |= met.t.0[i] < NOWHERE;
        }
        met
    }

    /// Keeps the triangle where it is the nearest so far.
    #[inline(always)]
    pub(super) fn keep(&mut self, leaf: &Packet, packet: u32, k: usize) {
        let met = self.triangle(leaf, k);
        if !met.any {
            return;
        }
        for i in 0..LANES {
            let here = met.t.0[i] < self.end.0[i];
            self.end.0[i] = if here { met.t.0[i] } else { self.end.0[i] };
            self.u.0[i] = if here { met.u.0[i] } else { self.u.0[i] };
            self.v.0[i] = if here { met.v.0[i] } else { self.v.0[i] };
            self.place[i] = if here {
                packet * 4 + k as u32
            } else {
                self.place[i]
            };
        }
    }

    /// Multiplies what passes by the gap of the triangle, where it is met.
    #[inline(always)]
    pub(super) fn pass(&mut self, table: &Table, leaf: &Packet, packet: u32, k: usize) {
        let met = self.triangle(leaf, k);
        if !met.any {
            return;
        }
        let mut gaps = Lanes([leaf.gap[k]; LANES]);
        if leaf.gap[k] < 0.0 {
            for i in 0..LANES {
                if met.t.0[i] < NOWHERE {
                    let d = Vec3::new(self.d[0].0[i], self.d[1].0[i], self.d[2].0[i]);
                    let place = packet * 4 + k as u32;
                    gaps.0[i] = surface::gap_at(table, place, met.u.0[i], met.v.0[i], d);
                }
            }
        }
        for i in 0..LANES {
            let product = self.product.0[i] * gaps.0[i];
            let product = if product < FAINTEST { 0.0 } else { product };
            let here = met.t.0[i] < NOWHERE;
            self.product.0[i] = if here { product } else { self.product.0[i] };
            self.end.0[i] = if self.product.0[i] > 0.0 {
                self.end.0[i]
            } else {
                -1.0
            };
        }
    }
}

/// Bounds of all rays of a beam, to leave out boxes that none of them meets.
pub(super) struct Hull {
    /// Least and greatest origin and inverse direction.
    pub o: [Vec3; 2],
    pub inv: [Vec3; 2],
    pub begin: f32,
    pub end: f32,
}

impl Hull {
    /// The way of the rays along each axis.
    #[inline(always)]
    pub(super) fn ways(&self) -> [Way; 3] {
        std::array::from_fn(|axis| {
            if self.inv[0][axis] > 0.0 {
                Way::Up
            } else if self.inv[1][axis] < 0.0 {
                Way::Down
            } else {
                Way::Both
            }
        })
    }

    /// About where the rays enter the boxes, never too late, and bits of the boxes that some ray might meet; an axis along which rays go
    /// both ways tells nothing.
    #[inline(always)]
    pub(super) fn boxes(&self, node: &Node) -> (Vec4, u32) {
        let mut near = Vec4::splat(self.begin);
        let mut far = Vec4::splat(self.end);
        for axis in 0..3 {
            let (i0, i1) = (self.inv[0][axis], self.inv[1][axis]);
            let (o0, o1) = (Vec4::splat(self.o[0][axis]), Vec4::splat(self.o[1][axis]));
            let (enter, leave) = if i0 > 0.0 {
                (node.lo[axis] - o1, node.hi[axis] - o0)
            } else if i1 < 0.0 {
                (node.hi[axis] - o0, node.lo[axis] - o1)
            } else {
                continue;
            };
            near = near.max((enter * i0).min(enter * i1));
            far = far.min((leave * i0).max(leave * i1));
        }
        (near, near.cmple(far).bitmask())
    }
}

/// Lanes of the packet up to the last that holds a triangle.
#[inline(always)]
pub(super) fn used(leaf: &Packet) -> usize {
    let edges = leaf.e1[0].abs() + leaf.e1[1].abs() + leaf.e1[2].abs();
    32 - edges.cmpgt(Vec4::ZERO).bitmask().leading_zeros() as usize
}
