//! What a cluster of lights is expected to give at a place. The pair of `shader/tree.wgsl`; `table/tree.rs` builds the
//! clusters.

use glam::{Vec2, Vec3, Vec3Swizzles};

use super::light::Place;
use crate::table::{LightRow, Table};

/// About what the lights of cluster `r` give, not counting what stands between; 0 only where none of them can.
pub(super) fn weight(table: &Table, at: &Place, r: &LightRow) -> f32 {
    let (middle, half) = (Vec3::from(r.p), Vec3::from(r.u));
    let from = at.p - middle;
    // All behind a surface that lets nothing through.
    if !at.transmits && at.n.dot(-from) + at.n.abs().dot(half) <= 0.0 {
        return 0.0;
    }
    let radius2 = r.area;
    let d2 = from.length_squared().max(1e-12);
    // Angle to the axis, less the spread of the normals.
    let [spread, sin_spread, least] = r.v;
    let straight = (from.dot(Vec3::from(r.n)) / d2.sqrt()).clamp(-1.0, 1.0);
    let sin = (1.0 - straight * straight).max(0.0).sqrt();
    let (cos, sin) = less(straight, sin, spread, sin_spread);
    if d2 > radius2 {
        // Less what the box subtends, it is still beyond what they reach.
        let sin_box2 = radius2 / d2;
        let (cos, _) = less(cos, sin, (1.0 - sin_box2).max(0.0).sqrt(), sin_box2.sqrt());
        if cos <= least {
            return 0.0;
        }
    }
    let shown = shown(table, at, middle, half);
    shown * r.radiance[0] * (0.1 + 0.9 * cos.max(0.0)) / (d2 + radius2)
}

/// cos and sin of one angle less another; 0 at least.
fn less(cos: f32, sin: f32, other: f32, sin_other: f32) -> (f32, f32) {
    if cos >= other {
        return (1.0, 0.0);
    }
    (cos * other + sin * sin_other, sin * other - cos * sin_other)
}

/// Seen from a room with windows, the share of a box outside that shows through them, about; 0 only if nothing does. The
/// box's shadow on the window's plane is taken for a parallelogram along the window's sides.
fn shown(table: &Table, at: &Place, middle: Vec3, half: Vec3) -> f32 {
    if !at.inside {
        return 1.0;
    }
    let g = &table.globals;
    let (mut sum, mut outside) = (0.0, false);
    for i in 0..g.portals {
        let w = &table.lights[(g.lights + i) as usize];
        let (n, corner) = (Vec3::from(w.n), Vec3::from(w.p));
        let along = n.dot(middle - corner);
        let wide = n.abs().dot(half);
        if along + wide > 0.0 {
            // Before this window, or on both sides of its wall: then nobody knows.
            if along - wide < 0.0 {
                return 1.0;
            }
            continue;
        }
        outside = true;
        let (u, v) = (Vec3::from(w.u), Vec3::from(w.v));
        let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
        let det = 1.0 / (uu * vv - uv * uv);
        // Height above the window's plane and place along its sides, of the place and of ways from it.
        let (a, b) = ((u * vv - v * uv) * det, (v * uu - u * uv) * det);
        let eye = Vec3::new(
            n.dot(at.p - corner),
            a.dot(at.p - corner),
            b.dot(at.p - corner),
        );
        let to = middle - at.p;
        let to = Vec3::new(n.dot(to), a.dot(to), b.dot(to));
        let [x, y, z] = [0, 1, 2].map(|k| Vec3::new(n[k], a[k], b[k]) * half[k]);
        let mut low = Vec2::INFINITY;
        let mut high = Vec2::NEG_INFINITY;
        for k in 0..8 {
            let side = |bit: u32, x: Vec3| if k & bit == 0 { -x } else { x };
            let way = to + side(1, x) + side(2, y) + side(4, z);
            // Where the ray to the corner crosses the window's plane.
            let place = eye.yz() + way.yz() * (eye.x / (-way.x).max(eye.x));
            low = low.min(place);
            high = high.max(place);
        }
        // A hair wider, for boxes without width and for rounding.
        let hair = Vec2::splat(1e-4);
        (low, high) = (low - hair, high + hair);
        let seen = (high.min(Vec2::ONE) - low.max(Vec2::ZERO)).max(Vec2::ZERO) / (high - low);
        sum += seen.x * seen.y;
    }
    if outside { sum.min(1.0) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::super::light;
    use crate::scene::{Light, Material, Mesh, Scene};
    use crate::table::{NONE, Table};
    use glam::Vec3;

    /// A number in 0..1 of `k`.
    fn number(k: u32) -> f32 {
        crate::rng::hash(k) as f32 / 4_294_967_296.0
    }

    fn point(k: u32, size: f32) -> Vec3 {
        Vec3::new(
            number(3 * k) - 0.5,
            number(3 * k + 1) - 0.5,
            number(3 * k + 2) - 0.5,
        ) * size
    }

    /// Triangles, rectangles, points and cones of all sizes and directions in a cube of 10 m, and two suns.
    fn scene() -> Scene {
        let mut scene = Scene {
            materials: vec![
                Material::lamp("one side", [3.0; 3], false),
                Material::lamp("two sides", [1.0, 2.0, 0.5], true),
            ],
            ..Scene::default()
        };
        for k in 0..120 {
            let p = point(k, 10.0);
            let (u, v) = (point(k + 1000, 0.6), point(k + 2000, 0.6));
            let mut mesh = Mesh {
                name: "lamp".into(),
                positions: vec![p, p + u, p + u + v, p + v],
                indices: vec![[0, 1, 2], [0, 2, 3]],
                material: (k % 5 == 0).into(),
                ..Mesh::default()
            };
            mesh.indices.truncate(1 + (k % 2) as usize);
            scene.meshes.push(mesh);
            scene.lights.push(if k % 3 == 0 {
                Light::Point {
                    position: point(k + 3000, 10.0),
                    intensity: [number(k); 3],
                    layer: 2,
                }
            } else {
                Light::Spot {
                    position: point(k + 3000, 10.0),
                    direction: point(k + 4000, 1.0).normalize(),
                    intensity: [5.0 * number(k); 3],
                    inner_angle: 0.3 * number(k + 7),
                    outer_angle: 0.2 + number(k + 8),
                    layer: 2,
                }
            });
        }
        for k in 0..2 {
            scene.lights.push(Light::Sun {
                direction: point(k + 5000, 1.0).normalize(),
                irradiance: [0.01; 3],
                angular_radius: 0.01,
                layer: 0,
            });
        }
        scene
    }

    #[test]
    fn what_is_chosen_is_what_the_share_says() {
        let table = Table::new(&scene(), false).unwrap();
        let g = &table.globals;
        assert!(g.tree != NONE && g.lights == 242 && g.others == 240);
        let mut lit = 0;
        for k in 0..40 {
            let n = point(k + 7000, 1.0).normalize();
            let at = light::place(&table, point(k + 6000, 12.0), n, k % 2 == 0);
            // What a tree leaves out gives nothing.
            let shares: Vec<f32> = (0..g.lights)
                .map(|i| light::share(&table, &at, i))
                .collect();
            for i in 0..g.lights {
                let weighs = light::weight(&table, &at, i) > 0.0;
                assert_eq!(weighs, shares[i as usize] > 0.0, "light {i}, place {k}");
            }
            let sum: f32 = shares.iter().sum();
            // Where both halves of a cluster may give something by their boxes and no light in them does, nothing is chosen.
            assert!(sum < 1.0 + 1e-4, "{sum}");
            lit += u32::from(sum > 0.3);
            let (mut counts, mut none) = (vec![0_u32; g.lights as usize], 0);
            let n = 1 << 14;
            for j in 0..n {
                let Some((i, share)) = light::choose(&table, &at, (j as f32 + 0.5) / n as f32)
                else {
                    none += 1;
                    continue;
                };
                counts[i as usize] += 1;
                let want = shares[i as usize];
                assert!((share / want - 1.0).abs() < 1e-4, "{share} {want}");
            }
            for (i, &count) in counts.iter().enumerate() {
                // Each light has one stretch of the numbers, so that a count is off by one at most, and rounding.
                let off = count as f32 - shares[i] * n as f32;
                assert!(off.abs() < 2.0, "light {i}: {count} of {n}, {}", shares[i]);
            }
            assert!((none as f32 / n as f32 - (1.0 - sum)).abs() < 0.01);
        }
        assert!(
            lit > 15,
            "{lit} of 40 places find light more often than three times in ten"
        );
    }
}
