//! The nodes of the ray structure as the shader reads them: boxes of 8 bits between the corners of the node's own, and where
//! its children begin. Three texels in place of seven; what a texel costs is in the address more than in its bytes.
//!
//! Ylitie, Karras and Laine 2017, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", with four
//! children. The boxes are never smaller than those they stand for, so a walk meets the same triangles in the same order.

use anyhow::{Context, Result};
use bytemuck::{Pod, Zeroable};
use glam::Vec4;
use rayon::prelude::*;

use crate::bvh::{EMPTY, LEAF, Node};

/// Four boxes and where the children begin that are in them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct Fork {
    /// Lower corner of the box around all four.
    pub corner: [f32; 3],
    /// By axis 8 bits, the exponent of the step as in a float; from bit 24 the lanes that are nodes, from bit 28 those that
    /// are leaves.
    pub spread: u32,
    /// Lower corners by axis, in steps, 8 bits a lane.
    pub lo: [u32; 3],
    /// The first child that is a node; the others follow it, in the order of their lanes.
    pub nodes: u32,
    /// Upper corners.
    pub hi: [u32; 3],
    /// The packet of the first child that is a leaf; the others follow.
    pub packets: u32,
}

/// The nodes, numbered so that the children of each follow each other.
///
/// # Errors
/// When the leaves of a node do not follow each other, which the builder of the tree sees to.
pub(super) fn forks(nodes: &[Node]) -> Result<Vec<Fork>> {
    // Nodes by the numbers that they get; the children of the first, of the second, and so on.
    let mut order: Vec<u32> = (0..nodes.len().min(1) as u32).collect();
    let mut first = Vec::with_capacity(nodes.len());
    let mut next = 0;
    while let Some(&n) = order.get(next) {
        first.push(order.len() as u32);
        order.extend(nodes[n as usize].child.iter().filter(|c| **c & LEAF == 0));
        next += 1;
    }
    let forks: Option<Vec<Fork>> = order
        .par_iter()
        .zip(&first)
        .map(|(&n, &first)| fork(&nodes[n as usize], first))
        .collect();
    forks.context("the ray structure has leaves that do not follow each other; use --backend cpu")
}

/// One node; `None` when its leaves do not follow each other.
fn fork(node: &Node, nodes: u32) -> Option<Fork> {
    let mut fork = Fork {
        nodes,
        ..Fork::default()
    };
    let mut leaves = 0;
    for (lane, &child) in node.child.iter().enumerate() {
        if child == EMPTY {
            continue;
        }
        if child & LEAF == 0 {
            fork.spread |= 1 << (24 + lane);
            continue;
        }
        fork.spread |= 1 << (28 + lane);
        if leaves == 0 {
            fork.packets = child & !LEAF;
        }
        if child & !LEAF != fork.packets + leaves {
            return None;
        }
        leaves += 1;
    }
    for axis in 0..3 {
        axis_of(&mut fork, node, axis);
    }
    Some(fork)
}

/// Writes the boxes' sides along an axis.
fn axis_of(fork: &mut Fork, node: &Node, axis: usize) {
    let filled = |lane: &usize| node.child[*lane] != EMPTY;
    let side = |v: &[Vec4; 3], lane: usize| v[axis][lane];
    let corner = (0..4)
        .filter(filled)
        .map(|lane| side(&node.lo, lane))
        .fold(f32::MAX, f32::min);
    let end = (0..4)
        .filter(filled)
        .map(|lane| side(&node.hi, lane))
        .fold(f32::MIN, f32::max);
    // Steps are powers of two, so that only the sum with the corner is rounded, here as in the shader. A step more than the
    // box needs, for that rounding.
    let mut exponent = (((end - corner).max(1e-30) / 254.0).to_bits() >> 23) + 1;
    while corner + 255.0 * f32::from_bits(exponent << 23) < end {
        exponent += 1;
    }
    let step = f32::from_bits(exponent << 23);
    fork.corner[axis] = corner;
    fork.spread |= exponent << (8 * axis);
    for lane in (0..4).filter(filled) {
        let (lo, hi) = (side(&node.lo, lane), side(&node.hi, lane));
        let mut low = ((lo - corner) / step).clamp(0.0, 255.0).floor();
        while low > 0.0 && corner + low * step > lo {
            low -= 1.0;
        }
        let mut high = ((hi - corner) / step).clamp(0.0, 255.0).ceil();
        while high < 255.0 && corner + high * step < hi {
            high += 1.0;
        }
        fork.lo[axis] |= (low as u32) << (8 * lane);
        fork.hi[axis] |= (high as u32) << (8 * lane);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::Bvh;
    use glam::Vec3;

    /// The boxes that a fork stands for hold those of its node, none by more than two steps, and its children are there.
    #[test]
    fn forks_hold_their_nodes() {
        // Far from the origin, where rounding is coarse beside the triangles, and one that is flat.
        let corners: Vec<[Vec3; 3]> = (0..3000)
            .map(|i| {
                let f = i as f32;
                let p = Vec3::new((f * 0.37).sin(), 0.002 * f, (f * 0.11).cos()) * 3.0
                    + Vec3::splat(700.0);
                [p, p + Vec3::X * 0.01, p + Vec3::Z * 0.02]
            })
            .collect();
        let tree = Bvh::build(&corners);
        let forks = forks(&tree.nodes).expect("leaves in a row");
        assert_eq!(forks.len(), tree.nodes.len());
        // Node and fork by node and fork.
        let mut open = vec![(0_usize, 0_usize)];
        let mut seen = 0;
        while let Some((n, f)) = open.pop() {
            let (node, fork) = (&tree.nodes[n], &forks[f]);
            seen += 1;
            let (mut nodes, mut leaves) = (0, 0);
            for lane in 0..4 {
                let child = node.child[lane];
                let bit = |first: u32| fork.spread >> (first + lane as u32) & 1 == 1;
                assert_eq!(bit(28), child != EMPTY && child & LEAF != 0);
                assert_eq!(bit(24), child & LEAF == 0);
                if child == EMPTY {
                    continue;
                }
                for axis in 0..3 {
                    let step = f32::from_bits((fork.spread >> (8 * axis) & 255) << 23);
                    let at = |q: u32| fork.corner[axis] + (q >> (8 * lane) & 255) as f32 * step;
                    let (lo, hi) = (at(fork.lo[axis]), at(fork.hi[axis]));
                    let (low, high) = (node.lo[axis][lane], node.hi[axis][lane]);
                    assert!(
                        lo <= low && hi >= high,
                        "{lo}..{hi} does not hold {low}..{high}"
                    );
                    let slack = 2.0 * step + 1e-4;
                    assert!(
                        low - lo <= slack && hi - high <= slack,
                        "too wide by {}",
                        low - lo
                    );
                }
                if child & LEAF == 0 {
                    open.push((child as usize, (fork.nodes + nodes) as usize));
                    nodes += 1;
                } else {
                    assert_eq!(child & !LEAF, fork.packets + leaves);
                    leaves += 1;
                }
            }
        }
        assert_eq!(seen, forks.len());
    }
}
