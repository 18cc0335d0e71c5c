//! Walks a ray through the ray structure: the nearest hit, and the share of light that passes all gaps between two
//! points. The pair of `shader/bvh.wgsl`.

use glam::{Vec3, Vec4};

use crate::bvh::{EMPTY, LEAF, Node, Packet, STACK};
use crate::rng::Rng;
use crate::table::Table;

/// Below this product a shadow ray goes on only by a fair coin at each further sheet.
pub(crate) const FAINT: f32 = 1e-3;

/// Below this product nothing passes where no coin is tossed.
pub(crate) const FAINTEST: f32 = 1e-12;

/// Farther than anything.
pub(crate) const FAR: f32 = 3.0e38;

/// The nearest hit of a ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    /// Distance along the ray (in units of its direction, which has length 1).
    pub t: f32,
    /// Place of the triangle, row of `Table::shade`.
    pub place: u32,
    /// Barycentric coordinate of the second corner.
    pub u: f32,
    /// Barycentric coordinate of the third corner.
    pub v: f32,
}

/// A ray with what the boxes need.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ray {
    pub o: Vec3,
    pub d: Vec3,
    inv: Vec3,
}

impl Ray {
    /// One over the direction, without infinities.
    #[inline(always)]
    pub(crate) fn inv(&self) -> Vec3 {
        self.inv
    }

    #[inline(always)]
    pub(crate) fn new(o: Vec3, d: Vec3) -> Self {
        let inverse = |x: f32| {
            if x.abs() < 1e-7 {
                1e7_f32.copysign(x)
            } else {
                1.0 / x
            }
        };
        Self {
            o,
            d,
            inv: Vec3::new(inverse(d.x), inverse(d.y), inverse(d.z)),
        }
    }
}

/// Entry distances of the four boxes, and which of them the ray meets between 0 and `tmax`.
#[inline(always)]
fn boxes(node: &Node, ray: &Ray, tmax: f32) -> (Vec4, u32) {
    let side = |axis: usize| {
        let (o, inv) = (Vec4::splat(ray.o[axis]), Vec4::splat(ray.inv[axis]));
        let (lo, hi) = ((node.lo[axis] - o) * inv, (node.hi[axis] - o) * inv);
        if ray.inv[axis] < 0.0 {
            (hi, lo)
        } else {
            (lo, hi)
        }
    };
    let (nx, fx) = side(0);
    let (ny, fy) = side(1);
    let (nz, fz) = side(2);
    let near = nx.max(ny).max(nz.max(Vec4::ZERO));
    let far = fx.min(fy).min(fz.min(Vec4::splat(tmax)));
    (near, near.cmple(far).bitmask())
}

/// Distances and barycentric coordinates of the four triangles, and which of them the ray meets in (tmin, tmax).
#[inline(always)]
fn triangles(p: &Packet, ray: &Ray, tmin: f32, tmax: f32) -> (Vec4, Vec4, Vec4, u32) {
    let (dx, dy, dz) = (
        Vec4::splat(ray.d.x),
        Vec4::splat(ray.d.y),
        Vec4::splat(ray.d.z),
    );
    let px = dy * p.e2[2] - dz * p.e2[1];
    let py = dz * p.e2[0] - dx * p.e2[2];
    let pz = dx * p.e2[1] - dy * p.e2[0];
    let det = p.e1[0] * px + p.e1[1] * py + p.e1[2] * pz;
    // A lane without a triangle has determinant 0: its distance becomes 0, which is never met.
    let inv = Vec4::select(det.cmpeq(Vec4::ZERO), Vec4::ZERO, Vec4::ONE / det);
    let sx = Vec4::splat(ray.o.x) - p.v0[0];
    let sy = Vec4::splat(ray.o.y) - p.v0[1];
    let sz = Vec4::splat(ray.o.z) - p.v0[2];
    let u = (sx * px + sy * py + sz * pz) * inv;
    let qx = sy * p.e1[2] - sz * p.e1[1];
    let qy = sz * p.e1[0] - sx * p.e1[2];
    let qz = sx * p.e1[1] - sy * p.e1[0];
    let v = (dx * qx + dy * qy + dz * qz) * inv;
    let t = (p.e2[0] * qx + p.e2[1] * qy + p.e2[2] * qz) * inv;
    let inside = u.cmpge(Vec4::ZERO) & v.cmpge(Vec4::ZERO) & (u + v).cmple(Vec4::ONE);
    let between = t.cmpgt(Vec4::splat(tmin)) & t.cmplt(Vec4::splat(tmax));
    (t, u, v, (inside & between).bitmask())
}

/// The nearest hit between `tmin` and `tmax`.
#[inline(always)]
pub(crate) fn nearest(table: &Table, ray: &Ray, tmin: f32, tmax: f32) -> Option<Hit> {
    let mut hit = Hit {
        t: tmax,
        place: EMPTY,
        u: 0.0,
        v: 0.0,
    };
    if table.bvh.nodes.is_empty() {
        return None;
    }
    let mut stack = [(0_u32, 0.0_f32); STACK];
    let mut top = 1;
    while top > 0 {
        top -= 1;
        let (mut child, entry) = stack[top];
        if entry >= hit.t {
            continue;
        }
        // Straight on where one box is met.
        while child & LEAF == 0 {
            let node = &table.bvh.nodes[child as usize];
            let (near, mut mask) = boxes(node, ray, hit.t);
            if mask.is_power_of_two() {
                child = node.child[mask.trailing_zeros() as usize];
                continue;
            }
            // The farthest goes down first: insertion into the part of the stack that this node fills.
            let base = top;
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize;
                mask &= mask - 1;
                let entry = (node.child[lane], near[lane]);
                let mut at = top;
                while at > base && stack[at - 1].1 < entry.1 {
                    stack[at] = stack[at - 1];
                    at -= 1;
                }
                stack[at] = entry;
                top += 1;
            }
            if top == base {
                break;
            }
            top -= 1;
            child = stack[top].0;
        }
        if child & LEAF != 0 {
            let packet = child & !LEAF;
            let (t, u, v, mut mask) =
                triangles(&table.bvh.packets[packet as usize], ray, tmin, hit.t);
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize;
                mask &= mask - 1;
                if t[lane] < hit.t {
                    hit = Hit {
                        t: t[lane],
                        place: packet * 4 + lane as u32,
                        u: u[lane],
                        v: v[lane],
                    };
                }
            }
        }
    }
    (hit.place != EMPTY).then_some(hit)
}

/// Share of light that passes straight from the ray's origin to distance `tmax`: the product of the gaps of every
/// sheet between, in the order in which they are found.
#[inline(always)]
pub(crate) fn transmittance(table: &Table, ray: &Ray, tmax: f32, rng: &mut Rng) -> f32 {
    let mut aside = rng.aside();
    product(table, ray, tmax, FAINT, || aside.coin())
}

/// The same without a coin for faint light: what a beam does for each of its rays.
#[cfg(test)]
pub(crate) fn transmittance_exact(table: &Table, ray: &Ray, tmax: f32) -> f32 {
    product(table, ray, tmax, FAINTEST, || 0.0)
}

/// The product of the gaps; below `faint` it ends with an even coin.
#[inline(always)]
fn product(table: &Table, ray: &Ray, tmax: f32, faint: f32, mut coin: impl FnMut() -> f32) -> f32 {
    let mut product = 1.0;
    if table.bvh.nodes.is_empty() {
        return product;
    }
    let mut stack = [0_u32; STACK];
    let mut top = 1;
    while top > 0 {
        top -= 1;
        let mut child = stack[top];
        while child & LEAF == 0 {
            let node = &table.bvh.nodes[child as usize];
            let mut mask = boxes(node, ray, tmax).1;
            if mask == 0 {
                break;
            }
            // The last one at once, the others wait.
            loop {
                child = node.child[mask.trailing_zeros() as usize];
                mask &= mask - 1;
                if mask == 0 {
                    break;
                }
                stack[top] = child;
                top += 1;
            }
        }
        if child & LEAF == 0 {
            continue;
        }
        let packet = child & !LEAF;
        let leaf = &table.bvh.packets[packet as usize];
        let (_, u, v, mut mask) = triangles(leaf, ray, 0.0, tmax);
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize;
            mask &= mask - 1;
            let mut gap = leaf.gap[lane];
            if gap < 0.0 {
                gap = super::surface::gap_at(
                    table,
                    packet * 4 + lane as u32,
                    u[lane],
                    v[lane],
                    ray.d,
                );
            }
            product *= gap;
            if product <= 0.0 {
                return 0.0;
            }
            if product < faint {
                if coin() < 0.5 {
                    return 0.0;
                }
                product *= 2.0;
            }
        }
    }
    product
}
