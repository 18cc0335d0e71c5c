//! Cloth as it was measured: a table over Klems patches, see `Tabulated::packed`. The pair of `shader/measured.wgsl`.

use glam::Vec3;
use std::f32::consts::TAU;

use super::math::{atan2, sincos_turn};
use crate::table::Table;

/// Words of a ring of patches.
const RING: usize = 3;

/// The places of a table's parts.
#[derive(Clone, Copy)]
struct Parts<'a> {
    words: &'a [u32],
    /// Patches.
    n: usize,
    rings: usize,
    /// First words.
    values: usize,
    gaps: usize,
    sums: usize,
}

impl<'a> Parts<'a> {
    #[inline(always)]
    fn new(table: &'a Table, first: u32) -> Self {
        let words = &table.texels[first as usize..];
        let (n, rings) = (words[0] as usize, words[1] as usize);
        let values = 2 + RING * rings;
        let gaps = values + 4 * n * n;
        Self {
            words,
            n,
            rings,
            values,
            gaps,
            sums: gaps + 2 * n,
        }
    }

    #[inline(always)]
    fn number(&self, at: usize) -> f32 {
        f32::from_bits(self.words[at])
    }

    /// The patch of the point (x, y) of the unit disc.
    #[inline(always)]
    fn patch(&self, x: f32, y: f32) -> usize {
        let sin2 = x * x + y * y;
        let mut ring = 2;
        for _ in 1..self.rings {
            if sin2 <= self.number(ring) {
                break;
            }
            ring += RING;
        }
        let (first, count) = (self.words[ring + 1] as usize, self.words[ring + 2]);
        let turn = atan2(y, x) * (1.0 / TAU);
        let place = (turn - turn.floor()) * count as f32 + 0.5;
        first + (place as u32 % count) as usize
    }

    /// Light comes in the patch of the way it travels.
    #[inline(always)]
    fn incident(&self, l: Vec3) -> usize {
        self.patch(-l.x, -l.y)
    }

    #[inline(always)]
    fn outgoing(&self, v: Vec3) -> usize {
        self.patch(v.x, v.y)
    }

    /// First word of the running sums for a viewer.
    #[inline(always)]
    fn row(&self, wo: Vec3) -> usize {
        self.sums + (behind(wo) * self.n + self.outgoing(wo)) * 2 * self.n
    }
}

#[inline(always)]
fn behind(w: Vec3) -> usize {
    usize::from(w.z < 0.0)
}

/// Share of the light from `w` that passes straight on.
pub(crate) fn gap(table: &Table, first: u32, w: Vec3) -> f32 {
    let p = Parts::new(table, first);
    p.number(p.gaps + behind(w) * p.n + p.incident(w))
}

/// f(wi, wo), the gap apart.
pub(crate) fn evaluate(table: &Table, first: u32, wi: Vec3, wo: Vec3) -> f32 {
    let p = Parts::new(table, first);
    let kind = behind(wi) * 2 + usize::from(behind(wi) == behind(wo));
    p.number(p.values + (kind * p.n + p.outgoing(wo)) * p.n + p.incident(wi))
}

/// Density of [`sample`]: f cos over what of an even light the viewer sees.
pub(crate) fn density(table: &Table, first: u32, wo: Vec3, wi: Vec3) -> f32 {
    let p = Parts::new(table, first);
    let all = p.number(p.row(wo) + 2 * p.n - 1);
    evaluate(table, first, wi, wo) * wi.z.abs() / all.max(1e-20)
}

/// A direction in proportion to f cos; (0, 0, 0) where the table is black.
pub(crate) fn sample(table: &Table, first: u32, wo: Vec3, u: Vec3) -> Vec3 {
    let p = Parts::new(table, first);
    let row = p.row(wo);
    let (mut lo, mut hi) = (0, 2 * p.n - 1);
    let wanted = u.z * p.number(row + hi);
    if p.number(row + hi) <= 0.0 {
        return Vec3::ZERO;
    }
    // The first sum above what is wanted.
    while lo < hi {
        let middle = (lo + hi) / 2;
        if p.number(row + middle) <= wanted {
            lo = middle + 1;
        } else {
            hi = middle;
        }
    }
    let patch = lo % p.n;
    let mut ring = 2;
    let mut inner = 0.0;
    for _ in 1..p.rings {
        let end = (p.words[ring + 1] + p.words[ring + 2]) as usize;
        if patch < end {
            break;
        }
        inner = p.number(ring);
        ring += RING;
    }
    let (begin, count) = (p.words[ring + 1] as usize, p.words[ring + 2] as f32);
    let sin2 = inner + u.x * (p.number(ring) - inner);
    let turn = ((patch - begin) as f32 + u.y - 0.5) / count;
    let (sin, cos) = sincos_turn(turn - turn.floor());
    let r = sin2.sqrt();
    let z = (1.0 - sin2).max(1e-12).sqrt();
    // Transmitted light comes from the other side.
    let below = (lo < p.n) != (wo.z < 0.0);
    Vec3::new(-r * cos, -r * sin, if below { -z } else { z })
}
