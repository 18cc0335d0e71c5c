//! Choosing a light and a direction to it, and the density with which that is done. The pair of `shader/light.wgsl`.
//!
//! With few lights each is weighed at the shading point; with many those that have a place are found through a tree of
//! clusters (`table/tree.rs`), whose root is weighed like one light. A matt surface takes the light of rectangles and of the
//! sky from these samples alone; triangles and glossy surfaces share them with scattering by multiple importance sampling
//! (Veach 1997, power heuristic).

mod sky;
mod weigh;

use glam::Vec3;
use std::f32::consts::TAU;

use super::math::sincos;
use super::rect::{self, Part, WHOLE};
use super::surface;
use crate::table::{DOUBLE_SIDED, NONE, POINT, RECT, SKY, SPOT, SUN, TRIANGLE, Table};
pub(crate) use sky::{discs, sky};
use sky::{sample_sky, sky_density};
pub(super) use weigh::weight;
use weigh::{part, weigh};

/// Up to this many lights are weighed one by one at each point.
pub(crate) const WEIGHED: u32 = 16;

/// A point that looks for light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub p: Vec3,
    /// Shading normal towards the viewer.
    pub n: Vec3,
    /// Light from behind counts too.
    pub transmits: bool,
    /// In front of every portal.
    pub inside: bool,
    /// Sum of the weights of all lights, or of the root and the lights without a place.
    pub total: f32,
    /// The brightest of these, its weight, and the part of it that can be seen.
    brightest: (u32, f32, Part),
}

impl Place {
    #[inline(always)]
    fn weight(&self, table: &Table, i: u32) -> f32 {
        if i == self.brightest.0 {
            self.brightest.1
        } else {
            weight(table, self, i)
        }
    }

    #[inline(always)]
    fn part(&self, table: &Table, i: u32) -> Part {
        if i == self.brightest.0 {
            self.brightest.2
        } else {
            part(table, self, &table.lights[i as usize])
        }
    }
}

/// A direction to a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub wi: Vec3,
    pub distance: f32,
    pub radiance: Vec3,
    /// Density per solid angle, the choice of the light included; for points and discs the radiance is scaled so
    /// that this is the density of the choice.
    pub pdf: f32,
    pub layer: u32,
    /// Scattering can meet it too (points and the sun it cannot).
    pub meets: bool,
    /// Every surface shares it with scattering, the matt ones too.
    pub shared: bool,
}

#[inline(always)]
pub(crate) fn place(table: &Table, p: Vec3, n: Vec3, transmits: bool) -> Place {
    let g = &table.globals;
    let mut inside = g.portals > 0;
    for i in 0..g.portals {
        let r = &table.lights[(g.lights + i) as usize];
        inside &= (p - Vec3::from(r.p)).dot(Vec3::from(r.n)) > 0.0;
    }
    let mut place = Place {
        p,
        n,
        transmits,
        inside,
        total: 0.0,
        brightest: (NONE, 0.0, WHOLE),
    };
    for k in 0..candidates(table) {
        let i = candidate(table, k);
        let (weight, part) = weigh(table, &place, i);
        place.total += weight;
        if weight > place.brightest.1 {
            place.brightest = (i, weight, part);
        }
    }
    place
}

/// How many rows are weighed at every point: all lights, or the root of the tree and the lights without a place.
#[inline(always)]
fn candidates(table: &Table) -> u32 {
    let g = &table.globals;
    if g.tree == NONE {
        g.lights
    } else {
        1 + g.lights - g.others
    }
}

#[inline(always)]
fn candidate(table: &Table, k: u32) -> u32 {
    let g = &table.globals;
    match (g.tree, k) {
        (NONE, _) => k,
        (root, 0) => root,
        _ => g.others + k - 1,
    }
}

/// Picks a light by `u[0]` and a direction to it by the other two.
#[inline(always)]
pub(crate) fn sample(table: &Table, at: &Place, u: [f32; 3]) -> Option<Sample> {
    let (chosen, share) = choose(table, at, u[0])?;
    towards(table, at, chosen, share, u[1], u[2])
}

/// A light by `u`, and the probability with which it is chosen.
#[inline(always)]
pub(super) fn choose(table: &Table, at: &Place, u: f32) -> Option<(u32, f32)> {
    let g = &table.globals;
    if g.lights == 0 || at.total <= 0.0 {
        return None;
    }
    let mut chosen = NONE;
    let mut share = 0.0;
    let mut rest = u * at.total;
    for k in 0..candidates(table) {
        let i = candidate(table, k);
        let w = at.weight(table, i);
        if w > 0.0 {
            chosen = i;
            share = w / at.total;
            if rest < w {
                rest /= w;
                break;
            }
        }
        rest -= w;
    }
    if chosen == NONE {
        return None;
    }
    // Down the tree; what is left of the number chooses on.
    while chosen >= g.lights {
        let r = &table.lights[chosen as usize];
        let (a, b) = (at.weight(table, r.place), at.weight(table, r.layer));
        if a + b <= 0.0 {
            return None;
        }
        let part = a / (a + b);
        rest = rest.clamp(0.0, 0.999_999_94);
        if rest < part {
            chosen = r.place;
            share *= part;
            rest /= part;
        } else {
            chosen = r.layer;
            share *= b / (a + b);
            rest = (rest - part) / (1.0 - part);
        }
    }
    (share > 0.0).then_some((chosen, share))
}

/// Light `i` is sampled by area, which is poor from near by: scattering helps even on matt surfaces.
pub(crate) fn soft(table: &Table, i: u32) -> bool {
    let r = &table.lights[i as usize];
    r.kind == TRIANGLE || (r.kind == RECT && r.area < 0.0)
}

/// Probability with which [`choose`] finds light `i`.
pub(super) fn share(table: &Table, at: &Place, i: u32) -> f32 {
    if at.total <= 0.0 {
        return 0.0;
    }
    // Up the tree.
    let mut me = i;
    let mut share = 1.0;
    loop {
        let mine = at.weight(table, me);
        let parent = table.lights[me as usize].parent;
        if mine <= 0.0 {
            return 0.0;
        }
        if parent == NONE {
            return share * mine / at.total;
        }
        let r = &table.lights[parent as usize];
        let other = if r.place == me { r.layer } else { r.place };
        share *= mine / (mine + at.weight(table, other));
        me = parent;
    }
}

/// A direction to light `i`, which was chosen with probability `share`.
#[inline(always)]
fn towards(table: &Table, at: &Place, i: u32, share: f32, u: f32, v: f32) -> Option<Sample> {
    let r = &table.lights[i as usize];
    let n = Vec3::from(r.n);
    let radiance = Vec3::from(r.radiance);
    let layer = r.layer;
    match r.kind {
        RECT | TRIANGLE => {
            let triangle = r.kind == TRIANGLE;
            let (mut a, mut b) = (u, v);
            if triangle && a + b > 1.0 {
                a = 1.0 - a;
                b = 1.0 - b;
            }
            let (wi, distance, pdf) = if triangle {
                rect::sample_triangle(r, at.p, a, b)
            } else {
                rect::sample(r, &at.part(table, i), at.p, a, b)
            };
            let material = &table.materials[table.shade[r.place as usize].material as usize];
            if pdf <= 0.0 || (material.flags & DOUBLE_SIDED == 0 && wi.dot(n) >= 0.0) {
                return None;
            }
            let radiance = if triangle {
                surface::emission_at(table, r.place, a, b)
            } else {
                radiance
            };
            let shared = soft(table, i);
            Some(Sample {
                wi,
                distance,
                radiance,
                pdf: share * pdf,
                layer,
                meets: true,
                shared,
            })
        }
        SUN => {
            // Even over the disc; its radiance is the irradiance over its solid angle, times that solid angle.
            let (sin, cos) = sincos(TAU * v);
            let radius = r.u[1] * u.sqrt();
            let x = if n.x.abs() < 0.7 { Vec3::X } else { Vec3::Y }
                .cross(n)
                .normalize();
            let y = n.cross(x);
            let wi = (n + (x * cos + y * sin) * radius).normalize();
            Some(Sample {
                wi,
                distance: 1e9,
                radiance,
                pdf: share,
                layer,
                meets: false,
                shared: false,
            })
        }
        SKY => {
            let (wi, pdf) = sample_sky(table, at, u, v);
            if pdf <= 0.0 {
                return None;
            }
            Some(Sample {
                wi,
                distance: 1e9,
                radiance: sky(table, wi),
                pdf: share * pdf,
                layer,
                meets: true,
                shared: false,
            })
        }
        POINT | SPOT => {
            let to = Vec3::from(r.p) - at.p;
            let distance = to.length().max(1e-6);
            let wi = to * (1.0 / distance);
            let mut radiance = radiance * (1.0 / (distance * distance));
            if r.kind == SPOT {
                let t = ((-wi.dot(n) - r.v[1]) / (r.v[0] - r.v[1])).clamp(0.0, 1.0);
                radiance *= t * t * (3.0 - 2.0 * t);
            }
            Some(Sample {
                wi,
                distance,
                radiance,
                pdf: share,
                layer,
                meets: false,
                shared: false,
            })
        }
        _ => None,
    }
}

/// Density with which [`sample`] finds light `i` in direction `wi` at `distance`.
pub(crate) fn density(table: &Table, at: &Place, i: u32, wi: Vec3, distance: f32) -> f32 {
    let share = share(table, at, i);
    if share <= 0.0 {
        return 0.0;
    }
    let r = &table.lights[i as usize];
    match r.kind {
        RECT | TRIANGLE => {
            let part = at.part(table, i);
            share * rect::density(r, &part, at.p, wi, distance, r.kind == TRIANGLE)
        }
        SKY => share * sky_density(table, at, wi),
        _ => 0.0,
    }
}
