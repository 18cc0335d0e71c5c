//! Choosing a light and a direction to it, and the density with which that is done. The pair of `shader/light.wgsl`.
//!
//! With few lights each is weighed at the shading point; with many those that have a place are found through a tree of
//! clusters (`table/tree.rs`), whose root is weighed like one light. A matt surface takes the light of rectangles and of the
//! sky from these samples alone; triangles and glossy surfaces share them with scattering by multiple importance sampling
//! (Veach 1997, power heuristic).

use glam::Vec3;
use std::f32::consts::{PI, TAU};

use super::math::{acos, atan2, luminance, sincos};
use super::rect::{self, Part, WHOLE};
use super::{surface, tree};
use crate::table::{
    CLUSTER, DOUBLE_SIDED, LightRow, NONE, POINT, RECT, SKY, SPOT, SUN, TRIANGLE, Table,
};

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
    };
    for k in 0..candidates(table) {
        place.total += weight(table, &place, candidate(table, k));
    }
    place
}

/// How many rows are weighed at every point: all lights, or the root of the tree and the lights without a place.
fn candidates(table: &Table) -> u32 {
    let g = &table.globals;
    if g.tree == NONE {
        g.lights
    } else {
        1 + g.lights - g.others
    }
}

fn candidate(table: &Table, k: u32) -> u32 {
    let g = &table.globals;
    match (g.tree, k) {
        (NONE, _) => k,
        (root, 0) => root,
        _ => g.others + k - 1,
    }
}

/// The part of a rectangular light that can be seen at all: in a room with windows, of a light outside, what shows
/// through them.
fn part(table: &Table, at: &Place, r: &LightRow) -> Part {
    if !at.inside || r.kind != RECT || r.area < 0.0 {
        return WHOLE;
    }
    let g = &table.globals;
    let windows = &table.lights[g.lights as usize..(g.lights + g.portals) as usize];
    let parts = windows.iter().filter_map(|w| rect::part(r, w, at.p));
    parts
        .reduce(|a, b| Part {
            low: a.low.min(b.low),
            high: a.high.max(b.high),
        })
        .unwrap_or(WHOLE)
}

/// What the light is expected to give at the place, not counting what stands between.
pub(super) fn weight(table: &Table, at: &Place, i: u32) -> f32 {
    let g = &table.globals;
    let r = &table.lights[i as usize];
    let lum = luminance(Vec3::from(r.radiance));
    let n = Vec3::from(r.n);
    match r.kind {
        RECT | TRIANGLE => {
            let half = if r.kind == RECT { 0.5 } else { 1.0 / 3.0 };
            let part = part(table, at, r);
            let to = Vec3::from(r.p) + part.point(r, half, half) - at.p;
            let two = table.materials[table.shade[r.place as usize].material as usize].flags
                & DOUBLE_SIDED
                != 0;
            if !two && (at.p - Vec3::from(r.p)).dot(n) <= 0.0 {
                return 0.0;
            }
            // All of it behind a surface that lets nothing through.
            let (u, v) = (at.n.dot(Vec3::from(r.u)), at.n.dot(Vec3::from(r.v)));
            let rise = if r.kind == RECT {
                u.max(0.0) + v.max(0.0)
            } else {
                u.max(v).max(0.0)
            };
            if !at.transmits && at.n.dot(Vec3::from(r.p) - at.p) + rise <= 0.0 {
                return 0.0;
            }
            let d2 = to.length_squared().max(1e-12);
            let cos = to.dot(n).abs() / d2.sqrt();
            let area = r.area.abs() * part.size();
            lum * area * (0.1 + 0.9 * cos) / (d2 + 0.5 * area)
        }
        SUN => {
            let cos = n.dot(at.n);
            // A disc reaches a little beyond its centre's horizon.
            let reach = cos + r.u[1];
            if (!at.transmits && reach <= 0.0) || (at.inside && !through(table, at.p, n, r.u[1])) {
                return 0.0;
            }
            lum * cos.abs().max(0.05)
        }
        SKY => g.sky_scale[3] * if at.inside { windows(table, at.p) } else { PI },
        CLUSTER => tree::weight(table, at, r),
        _ => {
            let to = Vec3::from(r.p) - at.p;
            let d2 = to.length_squared().max(1e-6);
            let hidden = !at.transmits && to.dot(at.n) <= 0.0;
            // Outside of its cone.
            let dark = r.kind == SPOT && -to.dot(n) <= r.v[1] * d2.sqrt();
            if hidden || dark { 0.0 } else { lum / d2 }
        }
    }
}

/// The direction leads out through a window; `spread` widens the window for discs.
fn through(table: &Table, p: Vec3, d: Vec3, spread: f32) -> bool {
    let g = &table.globals;
    for i in 0..g.portals {
        let r = &table.lights[(g.lights + i) as usize];
        let along = d.dot(Vec3::from(r.n));
        if along > -1e-4 {
            continue;
        }
        let t = (Vec3::from(r.p) - p).dot(Vec3::from(r.n)) / along;
        let q = p + d * t - Vec3::from(r.p);
        let (u, v) = (Vec3::from(r.u), Vec3::from(r.v));
        let (lu, lv) = (u.length(), v.length());
        let slack = 1e-3 + 2.0 * spread * t / along.abs();
        let (a, b) = (q.dot(u) / lu, q.dot(v) / lv);
        let skew = if r.area < 0.0 { lu + lv } else { 0.0 };
        if a > -slack - skew && b > -slack - skew && a < lu + slack + skew && b < lv + slack + skew
        {
            return true;
        }
    }
    false
}

/// About the solid angle of one window.
fn window(r: &LightRow, p: Vec3) -> f32 {
    let to = Vec3::from(r.p) + (Vec3::from(r.u) + Vec3::from(r.v)) * 0.5 - p;
    let d2 = to.length_squared().max(1e-12);
    let area = r.area.abs();
    area * (0.05 + 0.95 * to.dot(Vec3::from(r.n)).abs() / d2.sqrt()) / (d2 + 0.25 * area)
}

/// About the solid angle of all windows.
fn windows(table: &Table, p: Vec3) -> f32 {
    let g = &table.globals;
    (0..g.portals)
        .map(|i| window(&table.lights[(g.lights + i) as usize], p))
        .sum()
}

/// Picks a light by `u[0]` and a direction to it by the other two.
pub(crate) fn sample(table: &Table, at: &Place, u: [f32; 3]) -> Option<Sample> {
    let (chosen, share) = choose(table, at, u[0])?;
    towards(table, at, chosen, share, u[1], u[2])
}

/// A light by `u`, and the probability with which it is chosen.
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
        let w = weight(table, at, i);
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
        let (a, b) = (weight(table, at, r.place), weight(table, at, r.layer));
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
        let mine = weight(table, at, me);
        let parent = table.lights[me as usize].parent;
        if mine <= 0.0 {
            return 0.0;
        }
        if parent == NONE {
            return share * mine / at.total;
        }
        let r = &table.lights[parent as usize];
        let other = if r.place == me { r.layer } else { r.place };
        share *= mine / (mine + weight(table, at, other));
        me = parent;
    }
}

/// A direction to light `i`, which was chosen with probability `share`.
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
                rect::sample(r, &part(table, at, r), at.p, a, b)
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
            let part = part(table, at, r);
            share * rect::density(r, &part, at.p, wi, distance, r.kind == TRIANGLE)
        }
        SKY => share * sky_density(table, at, wi),
        _ => 0.0,
    }
}

/// Latitude-longitude coordinates of a direction.
fn sky_uv(table: &Table, d: Vec3) -> (f32, f32) {
    let [c, s] = table.globals.sky_turn;
    let (x, z) = (d.x * c - d.z * s, d.x * s + d.z * c);
    (0.5 + atan2(x, -z) * (1.0 / TAU), acos(d.y) * (1.0 / PI))
}

/// Radiance of the environment in direction `d`, bilinear.
pub(crate) fn sky(table: &Table, d: Vec3) -> Vec3 {
    let g = &table.globals;
    if g.sky_width == 0 {
        return Vec3::ZERO;
    }
    let (w, h) = (g.sky_width as i32, g.sky_height as i32);
    let (u, v) = sky_uv(table, d);
    let (x, y) = (u * w as f32 - 0.5, v * h as f32 - 0.5);
    let (x0, y0) = (x.floor(), y.floor());
    let (fx, fy) = (x - x0, y - y0);
    let at = |dx: i32, dy: i32| {
        let i = (x0 as i32 + dx + w) % w;
        let j = (y0 as i32 + dy).clamp(0, h - 1);
        let p = &table.sky[(j * w + i) as usize];
        Vec3::new(p[0], p[1], p[2])
    };
    let top = at(0, 0) + (at(1, 0) - at(0, 0)) * fx;
    let low = at(0, 1) + (at(1, 1) - at(0, 1)) * fx;
    (top + (low - top) * fy) * Vec3::new(g.sky_scale[0], g.sky_scale[1], g.sky_scale[2])
}

fn sample_sky(table: &Table, at: &Place, u: f32, v: f32) -> (Vec3, f32) {
    let g = &table.globals;
    let mut u = u;
    let wi;
    if at.inside && u < g.portal_share {
        u = (u / g.portal_share).min(0.999_999_94);
        // Which window, in proportion to about its solid angle.
        let mut rest = u * windows(table, at.p);
        let mut chosen = g.lights;
        let mut w = 1.0;
        for i in 0..g.portals {
            chosen = g.lights + i;
            w = window(&table.lights[chosen as usize], at.p);
            if rest < w || i + 1 == g.portals {
                break;
            }
            rest -= w;
        }
        wi = rect::sample(
            &table.lights[chosen as usize],
            &WHOLE,
            at.p,
            (rest / w).clamp(0.0, 1.0),
            v,
        )
        .0;
    } else {
        if at.inside {
            u = ((u - g.portal_share) / (1.0 - g.portal_share).max(1e-6)).min(0.999_999_94);
        }
        wi = sample_picture(table, u, v);
    }
    (wi, sky_density(table, at, wi))
}

/// First entry of `count` from `first` whose distribution exceeds `u`; `row` tells in which number it stands.
fn find(table: &Table, first: usize, count: usize, number: usize, u: f32) -> usize {
    let (mut lo, mut hi) = (0, count - 1);
    while lo < hi {
        let middle = (lo + hi) / 2;
        if table.sky[first + middle][number] > u {
            hi = middle;
        } else {
            lo = middle + 1;
        }
    }
    lo
}

/// A direction by the picture's brightness.
fn sample_picture(table: &Table, u: f32, v: f32) -> Vec3 {
    let g = &table.globals;
    let (w, h) = (g.sky_width as usize, g.sky_height as usize);
    let y = find(table, w * h, h, 0, v);
    let x = find(table, y * w, w, 3, u);
    let before = if y > 0 {
        table.sky[w * h + y - 1][0]
    } else {
        0.0
    };
    let fy = ((v - before) / (table.sky[w * h + y][0] - before)).clamp(0.0, 1.0);
    let before = if x > 0 {
        table.sky[y * w + x - 1][3]
    } else {
        0.0
    };
    let fx = ((u - before) / (table.sky[y * w + x][3] - before)).clamp(0.0, 1.0);
    let (sin_theta, cos_theta) = sincos(PI * (y as f32 + fy) / h as f32);
    let (sin_phi, cos_phi) = sincos(TAU * ((x as f32 + fx) / w as f32 - 0.5));
    let (lx, lz) = (sin_theta * sin_phi, -sin_theta * cos_phi);
    let [c, s] = g.sky_turn;
    Vec3::new(lx * c + lz * s, cos_theta, lz * c - lx * s).normalize()
}

/// Density of [`sample_sky`] per solid angle.
fn sky_density(table: &Table, at: &Place, d: Vec3) -> f32 {
    let g = &table.globals;
    let mut pdf = 0.0;
    let mut picture = 1.0;
    if at.inside {
        picture = 1.0 - g.portal_share;
        let all = windows(table, at.p);
        for i in 0..g.portals {
            let r = &table.lights[(g.lights + i) as usize];
            let t = rect::crossing(r, at.p, d);
            if t > 0.0 {
                let part = g.portal_share * window(r, at.p) / all;
                pdf += part * rect::density(r, &WHOLE, at.p, d, t, false);
            }
        }
    }
    if picture > 0.0 {
        let (w, h) = (g.sky_width as usize, g.sky_height as usize);
        let (u, v) = sky_uv(table, d);
        let x = ((u * w as f32) as usize).min(w - 1);
        let y = ((v * h as f32) as usize).min(h - 1);
        let row = table.sky[w * h + y][0]
            - if y > 0 {
                table.sky[w * h + y - 1][0]
            } else {
                0.0
            };
        let column = table.sky[y * w + x][3]
            - if x > 0 {
                table.sky[y * w + x - 1][3]
            } else {
                0.0
            };
        let sin_theta = (1.0 - d.y * d.y).max(1e-8).sqrt();
        pdf += picture * row * column * (w * h) as f32 / (2.0 * PI * PI * sin_theta);
    }
    pdf
}

/// Radiance of sun discs in direction `d`, by layer, for rays that look straight at them.
pub(crate) fn discs(table: &Table, d: Vec3, mut add: impl FnMut(u32, Vec3)) {
    for r in &table.lights[table.globals.others as usize..table.globals.lights as usize] {
        if r.kind == SUN && r.u[1] > 1e-4 && d.dot(Vec3::from(r.n)) > r.u[0] {
            // Solid angle of the disc: the projected one, as it is sampled.
            add(
                r.layer,
                Vec3::from(r.radiance) * (1.0 / (PI * r.u[1] * r.u[1])),
            );
        }
    }
}
