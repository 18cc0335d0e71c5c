//! Distances between a vertex and a triangle and between two edges, and the first time at which two that move come close.
//!
//! The time is found by conservative advancement (Li, Kaufman, Jiang 2021, "additive CCD"): two things that are `d` apart and whose
//! points move by at most `m` towards each other cannot touch before the share d/m of the way.

/// A vertex and a triangle (vertex first), or two edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Near {
    pub(crate) vertex: [u32; 4],
    pub(crate) edges: bool,
}

/// Where two things are closest: the vector from the second to the first is the sum of weight times vertex.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Closest {
    pub(crate) squared: f64,
    pub(crate) weight: [f64; 4],
}

/// The moment at which two things come close.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    /// Share of the step.
    pub(crate) time: f64,
    /// Distance then, m.
    pub(crate) distance: f64,
    pub(crate) weight: [f64; 4],
    /// Unit vector from the second to the first.
    pub(crate) normal: [f64; 3],
}

pub(crate) type Point = [f64; 3];

#[inline(always)]
pub(crate) fn sub(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(crate) fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Sum of weight times vector.
#[inline(always)]
pub(crate) fn blend(w: [f64; 4], p: &[Point; 4]) -> Point {
    std::array::from_fn(|c| w[0] * p[0][c] + w[1] * p[1][c] + w[2] * p[2][c] + w[3] * p[3][c])
}

/// Closest point of the triangle `a b c` to `p` (Ericson 2005, "Real-Time Collision Detection", 5.1.5).
#[inline(always)]
fn point_triangle([p, a, b, c]: &[Point; 4]) -> [f64; 4] {
    let (ab, ac, ap) = (sub(*b, *a), sub(*c, *a), sub(*p, *a));
    let (d1, d2) = (dot(ab, ap), dot(ac, ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, -1.0, 0.0, 0.0];
    }
    let bp = sub(*p, *b);
    let (d3, d4) = (dot(ab, bp), dot(ac, bp));
    if d3 >= 0.0 && d4 <= d3 {
        return [1.0, 0.0, -1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let v = d1 / (d1 - d3);
        return [1.0, v - 1.0, -v, 0.0];
    }
    let cp = sub(*p, *c);
    let (d5, d6) = (dot(ab, cp), dot(ac, cp));
    if d6 >= 0.0 && d5 <= d6 {
        return [1.0, 0.0, 0.0, -1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let w = d2 / (d2 - d6);
        return [1.0, w - 1.0, 0.0, -w];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [1.0, 0.0, w - 1.0, -w];
    }
    let inv = 1.0 / (va + vb + vc);
    let (v, w) = (vb * inv, vc * inv);
    [1.0, v + w - 1.0, -v, -w]
}

/// Closest points of the segments `a b` and `c d` (the same, 5.1.9).
#[inline(always)]
fn segments([a, b, c, d]: &[Point; 4]) -> [f64; 4] {
    let (u, v, r) = (sub(*b, *a), sub(*d, *c), sub(*a, *c));
    let (uu, vv, vr) = (dot(u, u).max(1e-300), dot(v, v).max(1e-300), dot(v, r));
    let (ur, uv) = (dot(u, r), dot(u, v));
    let area = uu * vv - uv * uv;
    let mut s = if area > 1e-12 * uu * vv {
        ((uv * vr - ur * vv) / area).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let mut t = (uv * s + vr) / vv;
    if t < 0.0 {
        t = 0.0;
        s = (-ur / uu).clamp(0.0, 1.0);
    } else if t > 1.0 {
        t = 1.0;
        s = ((uv - ur) / uu).clamp(0.0, 1.0);
    }
    [1.0 - s, s, t - 1.0, -t]
}

/// Where the two are closest.
#[inline(always)]
pub(crate) fn closest(edges: bool, p: &[Point; 4]) -> Closest {
    let weight = if edges {
        segments(p)
    } else {
        point_triangle(p)
    };
    let d = blend(weight, p);
    Closest {
        squared: dot(d, d),
        weight,
    }
}

/// The largest way, m, that a point of the one goes relative to a point of the other when the vertices go by `way`.
#[inline(always)]
pub(crate) fn relative(edges: bool, way: &[Point; 4]) -> f64 {
    let squared = |a: usize, b: usize| {
        let d = sub(way[a], way[b]);
        dot(d, d)
    };
    let most = if edges {
        squared(0, 2)
            .max(squared(0, 3))
            .max(squared(1, 2))
            .max(squared(1, 3))
    } else {
        squared(0, 1).max(squared(0, 2)).max(squared(0, 3))
    };
    most.sqrt()
}

/// When, on the way from `p` to `p + way`, the two come nearer than a tenth of their distance; none when they do not, or touch already.
pub(crate) fn first_hit(edges: bool, p: &[Point; 4], way: &[Point; 4]) -> Option<Hit> {
    let start = closest(edges, p).squared.sqrt();
    let most = relative(edges, way);
    if start < 1e-9 || most <= 0.9 * start {
        return None;
    }
    let (mut time, mut distance) = (0.0, start);
    for _ in 0..64 {
        time += (distance - 0.1 * start) / most;
        if time >= 1.0 {
            return None;
        }
        let now = at(p, way, time);
        let near = closest(edges, &now);
        distance = near.squared.sqrt();
        if distance < 0.12 * start {
            return Some(hit(time, near, &now));
        }
    }
    let now = at(p, way, time);
    Some(hit(time, closest(edges, &now), &now))
}

/// The end of the way, when the two are nearer there than `least` and than at the start.
pub(crate) fn close_end(edges: bool, p: &[Point; 4], way: &[Point; 4], least: f64) -> Option<Hit> {
    let end = at(p, way, 1.0);
    let near = closest(edges, &end);
    let start = closest(edges, p).squared;
    (near.squared < least * least && near.squared < start && near.squared > 1e-20)
        .then(|| hit(1.0, near, &end))
}

fn at(p: &[Point; 4], way: &[Point; 4], time: f64) -> [Point; 4] {
    std::array::from_fn(|k| std::array::from_fn(|c| p[k][c] + time * way[k][c]))
}

fn hit(time: f64, near: Closest, p: &[Point; 4]) -> Hit {
    let distance = near.squared.sqrt();
    let inv = 1.0 / distance.max(1e-30);
    Hit {
        time,
        distance,
        weight: near.weight,
        normal: blend(near.weight, p).map(|c| c * inv),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::uniform;

    fn random(seed: u64, n: u64) -> [Point; 4] {
        std::array::from_fn(|k| std::array::from_fn(|c| uniform(seed, n, (3 * k + c) as u64) - 0.5))
    }

    #[test]
    fn no_point_of_the_two_is_nearer_than_the_closest() {
        for n in 0..400 {
            let p = random(1, n);
            for edges in [false, true] {
                let near = closest(edges, &p);
                let mut least = f64::INFINITY;
                for i in 0..=60 {
                    for j in 0..=60 {
                        let (s, t) = (f64::from(i) / 60.0, f64::from(j) / 60.0);
                        let w = if edges {
                            [1.0 - s, s, t - 1.0, -t]
                        } else {
                            [1.0, s - 1.0, -s * (1.0 - t), -s * t]
                        };
                        let d = blend(w, &p);
                        least = least.min(dot(d, d));
                    }
                }
                // A grid of 1/60 over lengths of about 1 comes within 0.02 of the least distance.
                let (found, grid) = (near.squared.sqrt(), least.sqrt());
                assert!(
                    found <= grid + 1e-12 && found > grid - 0.02,
                    "{found} {grid}"
                );
            }
        }
    }

    #[test]
    fn what_moves_through_is_hit_and_what_passes_by_is_not() {
        let triangle = [
            [0.0, 0.0, 1.0],
            [-1.0, -1.0, 0.0],
            [1.0, -1.0, 0.0],
            [0.0, 1.5, 0.0],
        ];
        let still = [0.0; 3];
        let hit = first_hit(false, &triangle, &[[0.0, 0.0, -3.0], still, still, still]).unwrap();
        // A tenth of the distance is left when 0.9 of 3 m is done.
        assert!((hit.time - 0.3).abs() < 0.01 && (hit.normal[2] - 1.0).abs() < 1e-9);
        assert!(first_hit(false, &triangle, &[[5.0, 0.0, -3.0], still, still, still]).is_none());
        let cross = [
            [-1.0, 0.0, 0.2],
            [1.0, 0.0, 0.2],
            [0.0, -1.0, 0.0],
            [0.0, 1.0, 0.0],
        ];
        let down = [0.0, 0.0, -1.0];
        assert!(first_hit(true, &cross, &[down, down, still, still]).is_some());
        assert!(first_hit(true, &cross, &[down, down, down, down]).is_none());
    }
}
