//! The environment and discs at infinity: their radiance, and directions to the environment through windows or by its
//! brightness.

use glam::Vec3;
use std::f32::consts::{PI, TAU};

use super::Place;
use super::weigh::{window, windows};
use crate::cpu::math::{acos, atan2, sincos};
use crate::cpu::rect::{self, WHOLE};
use crate::table::{SUN, Table};

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

pub(super) fn sample_sky(table: &Table, at: &Place, u: f32, v: f32) -> (Vec3, f32) {
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
pub(super) fn sky_density(table: &Table, at: &Place, d: Vec3) -> f32 {
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
