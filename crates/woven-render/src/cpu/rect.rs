//! A rectangle as seen from a point: sampled evenly over its solid angle. The pair of `shader/rect.wgsl`.
//!
//! Ureña, Fajardo and King 2013, "An area-preserving parametrization for spherical rectangles". Where the solid angle
//! is too small for single precision, and for parallelograms, evenly over the area. What can only be seen through a
//! window is sampled on the [`Part`] that shows there.

use glam::{Vec2, Vec3, Vec4};
use std::f32::consts::TAU;

use super::math::{acos4, sincos};
use crate::table::LightRow;

/// Solid angles below this are sampled by area: four angles of some 2π in single precision carry an error of about
/// 1e-6 sr, 5e-5 of this.
const SMALL: f32 = 0.02;

/// The part of a rectangle between two corners, in shares of its edges.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Part {
    pub low: Vec2,
    pub high: Vec2,
}

/// All of a rectangle.
pub(crate) const WHOLE: Part = Part {
    low: Vec2::ZERO,
    high: Vec2::ONE,
};

impl Part {
    pub(crate) fn size(&self) -> f32 {
        let d = self.high - self.low;
        d.x.max(0.0) * d.y.max(0.0)
    }

    /// A point of the rectangle, from the corner: (0, 0) and (1, 1) are corners of the part.
    pub(crate) fn point(&self, r: &LightRow, u: f32, v: f32) -> Vec3 {
        let at = self.low + (self.high - self.low) * Vec2::new(u, v);
        Vec3::from(r.u) * at.x + Vec3::from(r.v) * at.y
    }

    /// Holds the point `q` from the corner; a hair wider, so that rounding loses no sample.
    fn holds(&self, r: &LightRow, q: Vec3) -> bool {
        let (u, v) = (Vec3::from(r.u), Vec3::from(r.v));
        let at = Vec2::new(q.dot(u) / u.length_squared(), q.dot(v) / v.length_squared());
        let hair = Vec2::splat(1e-4);
        at.cmpge(self.low - hair).all() && at.cmple(self.high + hair).all()
    }
}

/// What shows of a rectangle from `p` through a window at most: the corners of the window cast on its plane, and the
/// smallest part around them. Everything, unless the rectangle lies behind the window.
#[inline(always)]
pub(crate) fn part(r: &LightRow, window: &LightRow, p: Vec3) -> Option<Part> {
    let n = Vec3::from(r.n);
    let (u, v) = (Vec3::from(r.u), Vec3::from(r.v));
    let out = Vec3::from(window.n);
    let nearest = (Vec3::from(r.p) - Vec3::from(window.p)).dot(out)
        + u.dot(out).max(0.0)
        + v.dot(out).max(0.0);
    if nearest > 0.0 {
        return None;
    }
    let height = (Vec3::from(r.p) - p).dot(n);
    // The four corners side by side.
    let corner = Vec3::from(window.p) - p;
    let (wu, wv) = (Vec3::from(window.u), Vec3::from(window.v));
    let d: [Vec4; 3] = std::array::from_fn(|k| {
        Vec4::splat(corner[k])
            + Vec4::new(0.0, wu[k], 0.0, wu[k])
            + Vec4::new(0.0, 0.0, wv[k], wv[k])
    });
    let dot = |a: &[Vec4; 3], b: Vec3| a[0] * b.x + a[1] * b.y + a[2] * b.z;
    let along = dot(&d, n);
    // A ray past the corner that misses the plane, or runs along it: all of it may show.
    if (along * height)
        .cmple(Vec4::splat(1e-3 * height * height))
        .any()
    {
        return Some(WHOLE);
    }
    let far = height / along;
    let q: [Vec4; 3] = std::array::from_fn(|k| Vec4::splat(p[k]) + d[k] * far - r.p[k]);
    let (x, y) = (
        dot(&q, u) / u.length_squared(),
        dot(&q, v) / v.length_squared(),
    );
    let low = Vec2::new(x.min_element(), y.min_element());
    let high = Vec2::new(x.max_element(), y.max_element());
    Some(Part {
        low: low.clamp(Vec2::ZERO, Vec2::ONE),
        high: high.clamp(Vec2::ZERO, Vec2::ONE),
    })
}

/// A rectangle in the frame of its own sides, the point at the origin.
#[derive(Clone, Copy, Debug)]
struct Spherical {
    x: Vec3,
    y: Vec3,
    z: Vec3,
    x0: f32,
    x1: f32,
    y0: f32,
    y1: f32,
    /// Distance of the plane, negative.
    z0: f32,
    b0: f32,
    b1: f32,
    k: f32,
    solid_angle: f32,
}

#[inline(always)]
fn spherical(r: &LightRow, part: &Part, p: Vec3) -> Spherical {
    let (u, v) = (Vec3::from(r.u), Vec3::from(r.v));
    let (lu, lv) = (u.length(), v.length());
    let (x, y) = (u / lu, v / lv);
    let mut z = Vec3::from(r.n);
    let d = Vec3::from(r.p) - p;
    let mut z0 = d.dot(z);
    if z0 > 0.0 {
        z0 = -z0;
        z = -z;
    }
    let (x0, y0) = (d.dot(x) + part.low.x * lu, d.dot(y) + part.low.y * lv);
    let (x1, y1) = (d.dot(x) + part.high.x * lu, d.dot(y) + part.high.y * lv);
    let z2 = (z0 * z0).max(1e-20);
    // z of the normals of the four planes through the point and a side.
    let n0 = -y0 / (z2 + y0 * y0).sqrt();
    let n1 = x1 / (z2 + x1 * x1).sqrt();
    let n2 = y1 / (z2 + y1 * y1).sqrt();
    let n3 = -x0 / (z2 + x0 * x0).sqrt();
    let [g0, g1, g2, g3] = acos4(Vec4::new(-n0 * n1, -n1 * n2, -n2 * n3, -n3 * n0)).into();
    let k = TAU - g2 - g3;
    Spherical {
        x,
        y,
        z,
        x0,
        x1,
        y0,
        y1,
        z0,
        b0: n0,
        b1: n2,
        k,
        solid_angle: g0 + g1 - k,
    }
}

/// A direction from `p` to the rectangle, its distance, and the density per solid angle (0: none).
#[inline(always)]
pub(crate) fn sample(r: &LightRow, part: &Part, p: Vec3, u: f32, v: f32) -> (Vec3, f32, f32) {
    if r.area > 0.0 {
        let s = spherical(r, part, p);
        if s.solid_angle > SMALL {
            let (sin, cos) = sincos(u * s.solid_angle + s.k);
            let fu = (cos * s.b0 - s.b1)
                / if sin.abs() < 1e-9 {
                    1e-9_f32.copysign(sin)
                } else {
                    sin
                };
            let cu = (1.0 / (fu * fu + s.b0 * s.b0).sqrt().max(1e-20)).min(1.0)
                * if fu > 0.0 { 1.0 } else { -1.0 };
            let xu = (-(cu * s.z0) / (1.0 - cu * cu).max(1e-12).sqrt()).clamp(s.x0, s.x1);
            let d2 = xu * xu + s.z0 * s.z0;
            let h0 = s.y0 / (d2 + s.y0 * s.y0).sqrt();
            let h1 = s.y1 / (d2 + s.y1 * s.y1).sqrt();
            let hv = h0 + v * (h1 - h0);
            let yv = (hv * d2.sqrt() / (1.0 - hv * hv).max(1e-12).sqrt()).clamp(s.y0, s.y1);
            let to = s.x * xu + s.y * yv + s.z * s.z0;
            let distance = to.length();
            return (to * (1.0 / distance), distance, 1.0 / s.solid_angle);
        }
    }
    by_area(r, part.size(), Vec3::from(r.p) + part.point(r, u, v) - p)
}

/// The same for a triangle, always by area.
pub(crate) fn sample_triangle(r: &LightRow, p: Vec3, u: f32, v: f32) -> (Vec3, f32, f32) {
    by_area(r, 1.0, Vec3::from(r.p) + WHOLE.point(r, u, v) - p)
}

/// A direction along `to`, evenly over a share of the area.
fn by_area(r: &LightRow, share: f32, to: Vec3) -> (Vec3, f32, f32) {
    let distance = to.length().max(1e-9);
    let d = to * (1.0 / distance);
    let cos = d.dot(Vec3::from(r.n)).abs();
    (
        d,
        distance,
        if cos > 1e-6 {
            distance * distance / (r.area.abs() * share * cos)
        } else {
            0.0
        },
    )
}

/// Density of [`sample`] (or of [`sample_triangle`] with [`WHOLE`]) for direction `d` to a point of it at `distance`.
pub(crate) fn density(
    r: &LightRow,
    part: &Part,
    p: Vec3,
    d: Vec3,
    distance: f32,
    triangle: bool,
) -> f32 {
    if r.area > 0.0 && !triangle {
        if !part.holds(r, p + d * distance - Vec3::from(r.p)) {
            return 0.0;
        }
        let s = spherical(r, part, p);
        if s.solid_angle > SMALL {
            return 1.0 / s.solid_angle;
        }
    }
    by_area(r, part.size(), d * distance).2
}

/// Distance at which a ray from `p` along `d` crosses the parallelogram; negative when it does not.
pub(crate) fn crossing(r: &LightRow, p: Vec3, d: Vec3) -> f32 {
    let (n, u, v) = (Vec3::from(r.n), Vec3::from(r.u), Vec3::from(r.v));
    let along = d.dot(n);
    if along.abs() < 1e-9 {
        return -1.0;
    }
    let t = (Vec3::from(r.p) - p).dot(n) / along;
    let q = p + d * t - Vec3::from(r.p);
    // Coordinates in the (perhaps oblique) basis u, v.
    let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
    let det = uu * vv - uv * uv;
    let (qu, qv) = (q.dot(u), q.dot(v));
    let a = (qu * vv - qv * uv) / det;
    let b = (qv * uu - qu * uv) / det;
    let inside = t > 0.0 && (0.0..=1.0).contains(&a) && (0.0..=1.0).contains(&b);
    if inside { t } else { -1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::RECT;

    fn rect() -> LightRow {
        LightRow {
            p: [-1.0, 0.5, 0.2],
            kind: RECT,
            u: [2.0, 0.0, 0.0],
            v: [0.0, 1.0, 0.0],
            n: [0.0, 0.0, 1.0],
            area: 2.0,
            ..LightRow::default()
        }
    }

    #[test]
    fn solid_angle_is_that_of_the_area_integral() {
        let r = rect();
        for p in [
            Vec3::new(0.3, 0.2, 1.0),
            Vec3::new(2.0, 3.0, 1.5),
            Vec3::new(0.0, 1.0, -0.3),
        ] {
            let n = 400;
            let mut sum = 0.0;
            for i in 0..n * n {
                let (u, v) = (
                    ((i % n) as f32 + 0.5) / n as f32,
                    ((i / n) as f32 + 0.5) / n as f32,
                );
                let to = Vec3::from(r.p) + Vec3::from(r.u) * u + Vec3::from(r.v) * v - p;
                sum += f64::from(to.normalize().z.abs() / to.length_squared() * 2.0)
                    / f64::from(n * n);
            }
            let (_, _, pdf) = sample(&r, &WHOLE, p, 0.5, 0.5);
            // The midpoint rule is good to 1e-4 here.
            assert!(
                (sum * f64::from(pdf) - 1.0).abs() < 3e-4,
                "{p}: {sum} against {}",
                1.0 / pdf
            );
        }
    }

    #[test]
    fn samples_are_even_over_the_solid_angle() {
        // A function whose integral over the rectangle is known by area: cos at the light, 1/d².
        let r = rect();
        let p = Vec3::new(0.3, 0.2, 1.0);
        let n = 300;
        let (mut by_angle, mut by_area) = (0.0, 0.0);
        for i in 0..n * n {
            let (u, v) = (
                ((i % n) as f32 + 0.5) / n as f32,
                ((i / n) as f32 + 0.5) / n as f32,
            );
            let f = |d: Vec3| f64::from(d.x * d.x + 0.3 * d.y);
            let (d, t, pdf) = sample(&r, &WHOLE, p, u, v);
            assert!((d * t + p - Vec3::from(r.p)).dot(Vec3::from(r.n)).abs() < 1e-4);
            assert!(crossing(&r, p, d) > 0.0);
            by_angle += f(d) / f64::from(pdf);
            let to = Vec3::from(r.p) + Vec3::from(r.u) * u + Vec3::from(r.v) * v - p;
            by_area +=
                f(to.normalize()) * f64::from(to.normalize().z.abs() / to.length_squared() * 2.0);
        }
        assert!(
            (by_angle / by_area - 1.0).abs() < 1e-3,
            "{by_angle} {by_area}"
        );
    }
}
