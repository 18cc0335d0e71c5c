//! The ray structure: a tree of boxes four children wide, built from obvhs' binary tree, with leaves of up to four
//! triangles side by side. CPU and GPU walk the same arrays in the same order.
//!
//! obvhs also has an 8-wide tree with boxes of 8 bits. Four full boxes fill one SSE register exactly and need no
//! unpacking, they are refitted in place, and the shader can read the same rows; the two have not been timed against
//! each other here.

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec3A, Vec4};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use rayon::prelude::*;

/// A child that is not there.
pub const EMPTY: u32 = u32::MAX;
/// Set in a child that is a leaf; the other bits are the number of its packet.
pub const LEAF: u32 = 1 << 31;
/// Most nodes that can wait while a ray walks; trees that need more are refused (degenerate input).
pub const STACK: usize = 64;

/// Four boxes and what is in them.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct Node {
    /// Lower corners by axis, one lane a child.
    pub lo: [Vec4; 3],
    /// Upper corners by axis.
    pub hi: [Vec4; 3],
    /// Node number, [`LEAF`] | packet number, or [`EMPTY`].
    pub child: [u32; 4],
}

/// Up to four triangles: a corner and two edges by axis, one lane a triangle. A lane that is not used has no area.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct Packet {
    /// First corner.
    pub v0: [Vec4; 3],
    /// Second corner - first.
    pub e1: [Vec4; 3],
    /// Third corner - first.
    pub e2: [Vec4; 3],
    /// Share that passes straight through: 0 opaque, in (0, 1] the same in every direction, negative: depends on
    /// direction or place and has to be asked for.
    pub gap: Vec4,
}

/// A triangle as three corners.
pub type Corners = [Vec3; 3];

/// The tree. Triangle `i` of the order below is lane `i % 4` of packet `i / 4`.
#[derive(Clone, Debug, Default)]
pub struct Bvh {
    /// Nodes; the root is the first, children come after their parents.
    pub nodes: Vec<Node>,
    /// Triangles of the leaves.
    pub packets: Vec<Packet>,
    /// For each place (4 a packet) the number of the triangle that was given, or [`EMPTY`].
    pub order: Vec<u32>,
}

impl Bvh {
    /// Builds the tree over `corners`.
    #[must_use]
    pub fn build(corners: &[Corners]) -> Self {
        let boxes: Vec<Aabb> = corners.iter().map(bounds).collect();
        if boxes.is_empty() {
            return Self::default();
        }
        let indices = (0..boxes.len() as u32).collect();
        let mut binary = PlocBuilder::with_capacity(boxes.len()).build(
            PlocSearchDistance::Medium,
            &boxes,
            indices,
            SortPrecision::U64,
            3,
        );
        ReinsertionOptimizer::default().run(&mut binary, 0.05, None);
        let mut tree = Self::default();
        let mut build = Collapse {
            binary: &binary,
            counts: counts(&binary),
            tree: &mut tree,
        };
        build.root();
        tree.refit(corners);
        tree
    }

    /// Puts moved triangles (the same number as built with) into the tree and fits the boxes to them.
    pub fn refit(&mut self, corners: &[Corners]) {
        let leaves: Vec<Aabb> = self
            .packets
            .par_iter_mut()
            .zip(self.order.par_chunks_exact(4))
            .map(|(packet, order)| {
                let mut all = Aabb::INVALID;
                for (lane, &i) in order.iter().enumerate() {
                    let mut triangle = [Vec3::ZERO; 3];
                    if i != EMPTY {
                        triangle = corners[i as usize];
                        all = all.union(&bounds(&triangle));
                    }
                    let [a, b, c] = triangle;
                    for axis in 0..3 {
                        packet.v0[axis][lane] = a[axis];
                        packet.e1[axis][lane] = b[axis] - a[axis];
                        packet.e2[axis][lane] = c[axis] - a[axis];
                    }
                }
                all
            })
            .collect();
        for n in (0..self.nodes.len()).rev() {
            for lane in 0..4 {
                let child = self.nodes[n].child[lane];
                let b = self.child_bounds(child, &leaves);
                for axis in 0..3 {
                    self.nodes[n].lo[axis][lane] = b.min[axis];
                    self.nodes[n].hi[axis][lane] = b.max[axis];
                }
            }
        }
    }

    /// The box of a child: of its triangles, or of the four boxes of its node.
    fn child_bounds(&self, child: u32, leaves: &[Aabb]) -> Aabb {
        if child == EMPTY {
            // A box that no ray meets, without infinities.
            return Aabb {
                min: Vec3A::splat(1e30),
                max: Vec3A::splat(-1e30),
            };
        }
        if child & LEAF != 0 {
            return leaves[(child & !LEAF) as usize];
        }
        // A child that is not there takes nothing away and adds nothing.
        let node = &self.nodes[child as usize];
        let [x, y, z] = node.lo.map(Vec4::min_element);
        let [u, v, w] = node.hi.map(Vec4::max_element);
        Aabb {
            min: Vec3A::new(x, y, z),
            max: Vec3A::new(u, v, w),
        }
    }

    /// Most entries of the stack that a walk can need.
    #[must_use]
    pub fn stack_needed(&self) -> usize {
        // Three children wait at each level while the fourth is walked.
        let mut depth = vec![0usize; self.nodes.len()];
        for (n, node) in self.nodes.iter().enumerate() {
            for &child in node.child.iter().filter(|&&c| c & LEAF == 0) {
                depth[child as usize] = depth[n] + 1;
            }
        }
        4 + 3 * depth.iter().max().copied().unwrap_or(0)
    }

    /// The box around everything.
    #[must_use]
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let Some(root) = self.nodes.first() else {
            return (Vec3::ZERO, Vec3::ZERO);
        };
        let corner = |v: &[Vec4; 3], f: fn(f32, f32) -> f32, start: f32| {
            let lanes = (0..4).filter(|&lane| root.child[lane] != EMPTY);
            lanes.fold(Vec3::splat(start), |b, lane| {
                Vec3::new(f(b.x, v[0][lane]), f(b.y, v[1][lane]), f(b.z, v[2][lane]))
            })
        };
        (
            corner(&root.lo, f32::min, f32::INFINITY),
            corner(&root.hi, f32::max, f32::NEG_INFINITY),
        )
    }
}

fn bounds(c: &Corners) -> Aabb {
    // A hair wider than the triangle: a ray that lies in a box's side must not slip past it by rounding.
    let b = Aabb::from_points(&c.map(Vec3A::from));
    let hair = Vec3A::splat(1e-6) + b.min.abs().max(b.max.abs()) * 2e-7;
    Aabb {
        min: b.min - hair,
        max: b.max + hair,
    }
}

/// Triangles below each node of the binary tree.
fn counts(binary: &Bvh2) -> Vec<u32> {
    let mut counts = vec![0; binary.nodes.len()];
    let mut open = vec![(0usize, false)];
    while let Some((n, seen)) = open.pop() {
        let node = &binary.nodes[n];
        let first = node.first_index as usize;
        if node.is_leaf() {
            counts[n] = node.prim_count;
        } else if seen {
            counts[n] = counts[first] + counts[first + 1];
        } else {
            open.extend([(n, true), (first, false), (first + 1, false)]);
        }
    }
    counts
}

/// Turns the binary tree into the wide one.
struct Collapse<'a> {
    binary: &'a Bvh2,
    counts: Vec<u32>,
    tree: &'a mut Bvh,
}

impl Collapse<'_> {
    fn root(&mut self) {
        // (binary node, where the number of its wide node goes)
        let mut open: Vec<(usize, Option<(usize, usize)>)> = vec![(0, None)];
        while let Some((n, place)) = open.pop() {
            let mine = self.tree.nodes.len();
            self.tree.nodes.push(Node {
                child: [EMPTY; 4],
                ..Node::default()
            });
            if let Some((parent, lane)) = place {
                self.tree.nodes[parent].child[lane] = mine as u32;
            }
            let children = self.children(n);
            for (lane, &child) in children.iter().enumerate() {
                if self.counts[child] <= 4 {
                    let packet = self.leaf(child);
                    self.tree.nodes[mine].child[lane] = LEAF | packet;
                } else {
                    open.push((child, Some((mine, lane))));
                }
            }
        }
    }

    /// Up to four descendants of `n`: the one with the largest surface is opened until there are four.
    fn children(&self, n: usize) -> Vec<usize> {
        let mut found = vec![n];
        while found.len() < 4 {
            let open = |&&i: &&usize| {
                self.counts[i] > 4 || (found.len() == 1 && !self.binary.nodes[i].is_leaf())
            };
            let area = |i: usize| self.binary.nodes[i].aabb().half_area();
            let Some(&widest) = found
                .iter()
                .filter(open)
                .max_by(|&&a, &&b| area(a).total_cmp(&area(b)))
            else {
                break;
            };
            let first = self.binary.nodes[widest].first_index as usize;
            found.retain(|&i| i != widest);
            found.extend([first, first + 1]);
            if self.counts[n] <= 4 {
                break;
            }
        }
        found
    }

    /// Writes the triangles below `n` as one packet and returns its number.
    fn leaf(&mut self, n: usize) -> u32 {
        let packet = self.tree.packets.len() as u32;
        self.tree.packets.push(Packet::default());
        let mut places = [EMPTY; 4];
        let mut filled = 0;
        let mut open = vec![n];
        while let Some(n) = open.pop() {
            let node = &self.binary.nodes[n];
            let first = node.first_index as usize;
            if node.is_leaf() {
                for i in 0..node.prim_count as usize {
                    places[filled] = self.binary.primitive_indices[first + i];
                    filled += 1;
                }
            } else {
                open.extend([first + 1, first]);
            }
        }
        self.tree.order.extend(places);
        packet
    }
}
