//! What each light is expected to give at a place: by this one is chosen.

use glam::Vec3;
use std::f32::consts::PI;

use super::Place;
use crate::cpu::math::luminance;
use crate::cpu::rect::{self, Part, WHOLE};
use crate::cpu::tree;
use crate::table::{CLUSTER, DOUBLE_SIDED, LightRow, RECT, SKY, SPOT, SUN, TRIANGLE, Table};

/// The part of a rectangular light that can be seen at all: in a room with windows, of a light outside, what shows
/// through them.
#[inline(always)]
pub(super) fn part(table: &Table, at: &Place, r: &LightRow) -> Part {
    if !at.inside || r.kind != RECT || r.area < 0.0 {
        return WHOLE;
    }
    let g = &table.globals;
    let mut all: Option<Part> = None;
    for w in &table.lights[g.lights as usize..(g.lights + g.portals) as usize] {
        if let Some(b) = rect::part(r, w, at.p) {
            all = Some(match all {
                None => b,
                Some(a) => Part {
                    low: a.low.min(b.low),
                    high: a.high.max(b.high),
                },
            });
        }
    }
    all.unwrap_or(WHOLE)
}

/// What the light is expected to give at the place, not counting what stands between.
pub(in crate::cpu) fn weight(table: &Table, at: &Place, i: u32) -> f32 {
    weigh(table, at, i).0
}

/// The same, and the part of it that can be seen.
#[inline(always)]
pub(super) fn weigh(table: &Table, at: &Place, i: u32) -> (f32, Part) {
    if let RECT | TRIANGLE = table.lights[i as usize].kind {
        area(table, at, i)
    } else {
        (distant(table, at, i), WHOLE)
    }
}

/// Of a rectangle or a triangle.
#[inline(always)]
fn area(table: &Table, at: &Place, i: u32) -> (f32, Part) {
    let r = &table.lights[i as usize];
    let lum = luminance(Vec3::from(r.radiance));
    let n = Vec3::from(r.n);
    let two =
        table.materials[table.shade[r.place as usize].material as usize].flags & DOUBLE_SIDED != 0;
    if !two && (at.p - Vec3::from(r.p)).dot(n) <= 0.0 {
        return (0.0, WHOLE);
    }
    // All of it behind a surface that lets nothing through.
    let (u, v) = (at.n.dot(Vec3::from(r.u)), at.n.dot(Vec3::from(r.v)));
    let rise = if r.kind == RECT {
        u.max(0.0) + v.max(0.0)
    } else {
        u.max(v).max(0.0)
    };
    if !at.transmits && at.n.dot(Vec3::from(r.p) - at.p) + rise <= 0.0 {
        return (0.0, WHOLE);
    }
    let half = if r.kind == RECT { 0.5 } else { 1.0 / 3.0 };
    let part = part(table, at, r);
    let to = Vec3::from(r.p) + part.point(r, half, half) - at.p;
    let d2 = to.length_squared().max(1e-12);
    let cos = to.dot(n).abs() / d2.sqrt();
    let area = r.area.abs() * part.size();
    (lum * area * (0.1 + 0.9 * cos) / (d2 + 0.5 * area), part)
}

/// Of anything else.
fn distant(table: &Table, at: &Place, i: u32) -> f32 {
    let g = &table.globals;
    let r = &table.lights[i as usize];
    let lum = luminance(Vec3::from(r.radiance));
    let n = Vec3::from(r.n);
    match r.kind {
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
pub(super) fn window(r: &LightRow, p: Vec3) -> f32 {
    let to = Vec3::from(r.p) + (Vec3::from(r.u) + Vec3::from(r.v)) * 0.5 - p;
    let d2 = to.length_squared().max(1e-12);
    let area = r.area.abs();
    area * (0.05 + 0.95 * to.dot(Vec3::from(r.n)).abs() / d2.sqrt()) / (d2 + 0.25 * area)
}

/// About the solid angle of all windows.
pub(super) fn windows(table: &Table, p: Vec3) -> f32 {
    let g = &table.globals;
    (0..g.portals)
        .map(|i| window(&table.lights[(g.lights + i) as usize], p))
        .sum()
}
