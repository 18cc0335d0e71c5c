// A rectangle as seen from a point; the pair of cpu/rect.rs.

const SMALL: f32 = 0.02;

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

fn spherical(r: u32, p: vec3<f32>) -> Spherical {
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
    let x0 = dot(d, x);
    let y0 = dot(d, y);
    let x1 = x0 + lu;
    let y1 = y0 + lv;
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

fn by_area(r: u32, to: vec3<f32>) -> Towards {
    let distance = max(sqrt(length2(to)), 1e-9);
    let d = to * (1.0 / distance);
    let c = abs(dot(d, lights[r].n));
    if (c > 1e-6) {
        return Towards(d, distance, distance * distance / (abs(lights[r].area) * c));
    }
    return Towards(d, distance, 0.0);
}

fn rect_sample(r: u32, p: vec3<f32>, u: f32, v: f32, triangle: bool) -> Towards {
    if (lights[r].area > 0.0 && !triangle) {
        let s = spherical(r, p);
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
    return by_area(r, lights[r].p + lights[r].u * u + lights[r].v * v - p);
}

fn rect_density(r: u32, p: vec3<f32>, d: vec3<f32>, distance: f32, triangle: bool) -> f32 {
    if (lights[r].area > 0.0 && !triangle) {
        let s = spherical(r, p);
        if (s.solid_angle > SMALL) {
            return 1.0 / s.solid_angle;
        }
    }
    return by_area(r, d * distance).pdf;
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
