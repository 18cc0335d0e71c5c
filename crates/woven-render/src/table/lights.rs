//! The lights' rows: emissive meshes as rectangles and triangles, points, suns, the environment; then the windows, then
//! clusters of the lights with a place.

use crate::bvh::EMPTY;
use crate::cpu::light::WEIGHED;
use crate::scene::{LAYERS, Light, Portal, Scene};
use glam::Vec3;

use super::{
    CLUSTER, EMITS, LightRow, NONE, POINT, PORTAL, RECT, SKY, SPOT, SUN, TRIANGLE, Table, tree,
};

/// Fills `table.lights`, the light of each triangle, and the globals' counts.
pub(super) fn fill(table: &mut Table, scene: &Scene, light_layers: bool) {
    let layer = |l: u32| {
        if light_layers {
            l.min(LAYERS as u32 - 1)
        } else {
            0
        }
    };
    let mut rows = emitters(table);
    let sun = |l: &&Light| matches!(l, Light::Sun { .. });
    let lamps = scene.lights.iter().filter(|l| !sun(l));
    for light in lamps.chain(scene.lights.iter().filter(sun)) {
        rows.push(match *light {
            Light::Sun {
                direction,
                irradiance,
                angular_radius,
                layer: l,
            } => LightRow {
                kind: SUN,
                n: direction.try_normalize().unwrap_or(Vec3::Y).into(),
                u: [
                    angular_radius.clamp(0.0, 1.5).cos(),
                    angular_radius.clamp(0.0, 1.5).sin(),
                    0.0,
                ],
                radiance: irradiance,
                layer: layer(l),
                place: NONE,
                ..LightRow::default()
            },
            Light::Point {
                position,
                intensity,
                layer: l,
            } => LightRow {
                kind: POINT,
                p: position.into(),
                radiance: intensity,
                layer: layer(l),
                place: NONE,
                ..LightRow::default()
            },
            Light::Spot {
                position,
                direction,
                intensity,
                inner_angle,
                outer_angle,
                layer: l,
            } => LightRow {
                kind: SPOT,
                p: position.into(),
                n: direction.try_normalize().unwrap_or(Vec3::NEG_Y).into(),
                v: [
                    inner_angle.cos().max(outer_angle.cos() + 1e-4),
                    outer_angle.cos(),
                    0.0,
                ],
                radiance: intensity,
                layer: layer(l),
                place: NONE,
                ..LightRow::default()
            },
        });
    }
    if table.globals.sky_width > 0 {
        rows.push(LightRow {
            kind: SKY,
            layer: table.globals.sky_layer,
            place: NONE,
            ..LightRow::default()
        });
    }
    let windows = scene.portals.iter().map(portal).collect();
    arrange(table, rows, windows);
}

/// Counts the lights, gathers those with a place in clusters if they are many, and puts the rows in their order.
fn arrange(table: &mut Table, mut rows: Vec<LightRow>, windows: Vec<LightRow>) {
    let far = |r: &LightRow| r.kind == SUN || r.kind == SKY;
    let others = rows.iter().position(far).unwrap_or(rows.len()) as u32;
    table.globals.others = others;
    table.globals.sky_light = rows
        .iter()
        .position(|r| r.kind == SKY)
        .map_or(NONE, |row| row as u32);
    table.globals.lights = rows.len() as u32;
    table.globals.portals = windows.len() as u32;
    table.globals.soft_lights = soft(table, &rows);
    table.globals.tree = NONE;
    for row in &mut rows {
        row.parent = NONE;
    }
    let mut clusters = Vec::new();
    if table.globals.lights > WEIGHED && others > 1 {
        table.globals.tree = (rows.len() + windows.len()) as u32;
        clusters = tree::build(table, &mut rows, others, table.globals.tree);
    }
    rows.extend(windows);
    rows.extend(clusters);
    table.lights = rows;
}

/// Renews what depends on places after a mesh has moved.
pub(super) fn moved(table: &mut Table) {
    let mut rows = emitters(table);
    let before = |r: &&LightRow| r.kind == RECT || r.kind == TRIANGLE;
    let mut same = table.lights.iter().filter(before).count() == rows.len();
    for (row, old) in rows.iter_mut().zip(&table.lights) {
        row.parent = old.parent;
        same &= bytemuck::bytes_of(row) == bytemuck::bytes_of(old);
    }
    // No light has moved: the clusters stand.
    if same {
        return;
    }
    let fixed = table.lights.iter().copied().filter(|r| !before(&r));
    let (windows, others) = fixed
        .filter(|r| r.kind != CLUSTER)
        .partition(|r| r.kind == PORTAL);
    let others: Vec<LightRow> = others;
    rows.extend(others);
    arrange(table, rows, windows);
}

/// Whether scattering must meet some light too: triangles, and those whose texture was found black (see [`glow`]).
fn soft(table: &Table, rows: &[LightRow]) -> u32 {
    let textured = |m: &super::MaterialRow| m.flags & EMITS != 0 && m.emission_texture != NONE;
    let triangle = |r: &LightRow| r.kind == TRIANGLE || (r.kind == RECT && r.area < 0.0);
    u32::from(rows.iter().any(triangle) || table.materials.iter().any(textured))
}

/// Mean radiance of a triangle whose emission has a texture, at the middles of 64 smaller triangles. A place that they
/// miss is still seen, only not sampled.
fn glow(table: &Table, place: usize) -> Vec3 {
    const N: usize = 8;
    let mut sum = Vec3::ZERO;
    for i in 0..N {
        for j in 0..N - i {
            let at = |i: f32, j: f32| {
                crate::cpu::surface::emission_at(table, place as u32, i / N as f32, j / N as f32)
            };
            let (i, j) = (i as f32, j as f32);
            sum += at(i + 1.0 / 3.0, j + 1.0 / 3.0);
            if i + j < (N - 1) as f32 {
                sum += at(i + 2.0 / 3.0, j + 2.0 / 3.0);
            }
        }
    }
    sum / (N * N) as f32
}

/// Rows for the triangles that emit; two that form a parallelogram become one rectangle.
fn emitters(table: &mut Table) -> Vec<LightRow> {
    let mut glowing: Vec<(u32, u32, usize)> = Vec::new();
    for (place, &i) in table.bvh.order.iter().enumerate() {
        if i != EMPTY && table.materials[table.shade[place].material as usize].flags & EMITS != 0 {
            glowing.push((table.shade[place].mesh, table.shade[place].triangle, place));
        }
    }
    glowing.sort_unstable();
    let mut rows: Vec<LightRow> = Vec::new();
    let mut k = 0;
    while k < glowing.len() {
        let place = glowing[k].2;
        let next = glowing
            .get(k + 1)
            .map(|n| n.2)
            .filter(|&n| table.shade[n].mesh == table.shade[place].mesh);
        let material = table.materials[table.shade[place].material as usize];
        let plain = material.emission_texture == NONE;
        let quad = next
            .filter(|_| plain)
            .and_then(|n| quad(&corners(table, place), &corners(table, n)));
        let [p, a, b] = corners(table, place);
        let (p, u, v) = quad.unwrap_or((p, a - p, b - p));
        let cross = u.cross(v);
        let kind = if quad.is_some() { RECT } else { TRIANGLE };
        let square = u.dot(v).abs() < 1e-4 * u.length() * v.length();
        let area = cross.length() * if quad.is_some() { 1.0 } else { 0.5 };
        let radiance = if plain {
            Vec3::from_slice(&material.emission[..3])
        } else {
            glow(table, place)
        };
        table.shade[place].light = NONE;
        if area > 0.0 && radiance.max_element() > 0.0 {
            let row = rows.len() as u32;
            table.shade[place].light = row;
            if let (Some(n), true) = (next, quad.is_some()) {
                table.shade[n].light = row;
            }
            rows.push(LightRow {
                p: p.into(),
                kind,
                u: u.into(),
                layer: material.layer,
                v: v.into(),
                place: place as u32,
                n: cross.normalize().into(),
                area: if kind == RECT && !square { -area } else { area },
                radiance: radiance.into(),
                parent: NONE,
            });
        }
        k += if quad.is_some() { 2 } else { 1 };
    }
    rows
}

fn corners(table: &Table, place: usize) -> [Vec3; 3] {
    table.corners[table.bvh.order[place] as usize]
}

/// Corner and edges of the parallelogram that two triangles of the same winding form, if they do.
fn quad(a: &[Vec3; 3], b: &[Vec3; 3]) -> Option<(Vec3, Vec3, Vec3)> {
    let size = (a[1] - a[0]).length().max((a[2] - a[0]).length());
    let same = |p: Vec3, q: Vec3| (p - q).length() <= 1e-5 * size;
    for i in 0..3 {
        // The right angle is at a[i]; the diagonal runs from a[i+1] to a[i+2].
        let (p, q, r) = (a[i], a[(i + 1) % 3], a[(i + 2) % 3]);
        let far = q + r - p;
        let has = |x: Vec3| b.iter().any(|&y| same(x, y));
        let along = (b[1] - b[0]).cross(b[2] - b[0]).dot((q - p).cross(r - p)) > 0.0;
        if along && has(far) && has(q) && has(r) {
            return Some((p, q - p, r - p));
        }
    }
    None
}

fn portal(p: &Portal) -> LightRow {
    let n = p.edge_u.cross(p.edge_v);
    let square = p.edge_u.dot(p.edge_v).abs() < 1e-4 * p.edge_u.length() * p.edge_v.length();
    LightRow {
        p: p.corner.into(),
        kind: PORTAL,
        u: p.edge_u.into(),
        v: p.edge_v.into(),
        n: n.try_normalize().unwrap_or(Vec3::Z).into(),
        area: if square { n.length() } else { -n.length() },
        place: NONE,
        ..LightRow::default()
    }
}
