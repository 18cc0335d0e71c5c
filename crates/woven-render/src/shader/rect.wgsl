// A rectangle as seen from a point; the pair of cpu/rect.rs.

const SMALL: f32 = 0.02;

// The part of a rectangle between two corners, in shares of its edges.
struct Part {
    low: vec2<f32>,
    high: vec2<f32>,
}

fn whole() -> Part {
    return Part(vec2<f32>(0.0), vec2<f32>(1.0));
}

fn part_size(part: Part) -> f32 {
    let d = part.high - part.low;
    return max(d.x, 0.0) * max(d.y, 0.0);
}

fn part_point(part: Part, r: u32, u: f32, v: f32) -> vec3<f32> {
    let at = part.low + (part.high - part.low) * vec2<f32>(u, v);
    return lights[r].u * at.x + lights[r].v * at.y;
}

fn on_rect(r: u32, q: vec3<f32>) -> vec2<f32> {
    return vec2<f32>(dot(q, lights[r].u) / length2(lights[r].u), dot(q, lights[r].v) / length2(lights[r].v));
}

fn part_holds(part: Part, r: u32, q: vec3<f32>) -> bool {
    let at = on_rect(r, q);
    let hair = vec2<f32>(1e-4);
    return all(at >= part.low - hair) && all(at <= part.high + hair);
}

fn behind(r: u32, window: u32) -> bool {
    let out = lights[window].n;
    let first = dot(lights[r].p - lights[window].p, out);
    return first + max(dot(lights[r].u, out), 0.0) + max(dot(lights[r].v, out), 0.0) <= 0.0;
}

// What shows of rectangle r from p through a window at most; r is behind it.
fn part_through(r: u32, window: u32, p: vec3<f32>) -> Part {
    let n = lights[r].n;
    let height = dot(lights[r].p - p, n);
    var low = vec2<f32>(3.0e38);
    var high = vec2<f32>(-3.0e38);
    for (var corner = 0u; corner < 4u; corner++) {
        var d = lights[window].p - p;
        if ((corner & 1u) != 0u) {
            d += lights[window].u;
        }
        if ((corner & 2u) != 0u) {
            d += lights[window].v;
        }
        let along = dot(d, n);
        if (along * height <= 1e-3 * height * height) {
            return whole();
        }
        let at = on_rect(r, p + d * (height / along) - lights[r].p);
        low = min(low, at);
        high = max(high, at);
    }
    return Part(clamp(low, vec2<f32>(0.0), vec2<f32>(1.0)), clamp(high, vec2<f32>(0.0), vec2<f32>(1.0)));
}

struct Spherical {
    x: vec3<f32>,
    y: vec3<f32>,
    z: vec3<f32>,
    x0: f32,
    x1: f32,
    y0: f32,
    y1: f32,
    z0: f32,
    b0: f32,
    b1: f32,
    k: f32,
    solid_angle: f32,
}

// A direction, the distance, the density per solid angle (0: none).
struct Towards {
    d: vec3<f32>,
    distance: f32,
    pdf: f32,
}

fn spherical(r: u32, part: Part, p: vec3<f32>) -> Spherical {
    let lu = sqrt(length2(lights[r].u));
    let lv = sqrt(length2(lights[r].v));
    let x = lights[r].u / lu;
    let y = lights[r].v / lv;
    var z = lights[r].n;
    let d = lights[r].p - p;
    var z0 = dot(d, z);
    if (z0 > 0.0) {
        z0 = -z0;
        z = -z;
    }
    let x0 = dot(d, x) + part.low.x * lu;
    let y0 = dot(d, y) + part.low.y * lv;
    let x1 = dot(d, x) + part.high.x * lu;
    let y1 = dot(d, y) + part.high.y * lv;
    let z2 = max(z0 * z0, 1e-20);
    let n0 = -y0 / sqrt(z2 + y0 * y0);
    let n1 = x1 / sqrt(z2 + x1 * x1);
    let n2 = y1 / sqrt(z2 + y1 * y1);
    let n3 = -x0 / sqrt(z2 + x0 * x0);
    let g0 = arc_cos(-n0 * n1);
    let g1 = arc_cos(-n1 * n2);
    let g2 = arc_cos(-n2 * n3);
    let g3 = arc_cos(-n3 * n0);
    let k = TAU - g2 - g3;
    return Spherical(x, y, z, x0, x1, y0, y1, z0, n0, n2, k, g0 + g1 - k);
}

fn by_area(r: u32, share: f32, to: vec3<f32>) -> Towards {
    let distance = max(sqrt(length2(to)), 1e-9);
    let d = to * (1.0 / distance);
    let c = abs(dot(d, lights[r].n));
    if (c > 1e-6) {
        return Towards(d, distance, distance * distance / (abs(lights[r].area) * share * c));
    }
    return Towards(d, distance, 0.0);
}

fn rect_sample(r: u32, part: Part, p: vec3<f32>, u: f32, v: f32, triangle: bool) -> Towards {
    if (lights[r].area > 0.0 && !triangle) {
        let s = spherical(r, part, p);
        if (s.solid_angle > SMALL) {
            let sc = sincos(u * s.solid_angle + s.k);
            let fu = (sc.y * s.b0 - s.b1) / select(sc.x, copysign1(1e-9, sc.x), abs(sc.x) < 1e-9);
            let cu = min(1.0 / max(sqrt(fu * fu + s.b0 * s.b0), 1e-20), 1.0) * select(-1.0, 1.0, fu > 0.0);
            let xu = clamp(-(cu * s.z0) / sqrt(max(1.0 - cu * cu, 1e-12)), s.x0, s.x1);
            let d2 = xu * xu + s.z0 * s.z0;
            let h0 = s.y0 / sqrt(d2 + s.y0 * s.y0);
            let h1 = s.y1 / sqrt(d2 + s.y1 * s.y1);
            let hv = h0 + v * (h1 - h0);
            let yv = clamp(hv * sqrt(d2) / sqrt(max(1.0 - hv * hv, 1e-12)), s.y0, s.y1);
            let to = s.x * xu + s.y * yv + s.z * s.z0;
            let distance = sqrt(length2(to));
            return Towards(to * (1.0 / distance), distance, 1.0 / s.solid_angle);
        }
    }
    return by_area(r, part_size(part), lights[r].p + part_point(part, r, u, v) - p);
}

fn rect_density(r: u32, part: Part, p: vec3<f32>, d: vec3<f32>, distance: f32, triangle: bool) -> f32 {
    if (lights[r].area > 0.0 && !triangle) {
        if (!part_holds(part, r, p + d * distance - lights[r].p)) {
            return 0.0;
        }
        let s = spherical(r, part, p);
        if (s.solid_angle > SMALL) {
            return 1.0 / s.solid_angle;
        }
    }
    return by_area(r, part_size(part), d * distance).pdf;
}

fn crossing(r: u32, p: vec3<f32>, d: vec3<f32>) -> f32 {
    let n = lights[r].n;
    let u = lights[r].u;
    let v = lights[r].v;
    let along = dot(d, n);
    if (abs(along) < 1e-9) {
        return -1.0;
    }
    let t = dot(lights[r].p - p, n) / along;
    let q = p + d * t - lights[r].p;
    let uu = dot(u, u);
    let uv = dot(u, v);
    let vv = dot(v, v);
    let det = uu * vv - uv * uv;
    let qu = dot(q, u);
    let qv = dot(q, v);
    let a = (qu * vv - qv * uv) / det;
    let b = (qv * uu - qu * uv) / det;
    let inside = t > 0.0 && a >= 0.0 && a <= 1.0 && b >= 0.0 && b <= 1.0;
    return select(-1.0, t, inside);
}
