// What a cluster of lights is expected to give at a place; the pair of cpu/tree.rs.

fn cluster_weight(at: Place, r: u32) -> f32 {
    let middle = lights[r].p;
    let half = lights[r].u;
    let apart = at.p - middle;
    // All behind a surface that lets nothing through.
    if (!at.transmits && dot(at.n, -apart) + dot(abs(at.n), half) <= 0.0) {
        return 0.0;
    }
    let radius2 = lights[r].area;
    let d2 = max(length2(apart), 1e-12);
    // Angle to the axis, less the spread of the normals.
    let spread = lights[r].v;
    let straight = clamp(dot(apart, lights[r].n) / sqrt(d2), -1.0, 1.0);
    let left = angle_less(straight, sqrt(max(1.0 - straight * straight, 0.0)), spread.x, spread.y);
    if (d2 > radius2) {
        // Less what the box subtends, it is still beyond what they reach.
        let sin_box2 = radius2 / d2;
        if (angle_less(left.x, left.y, sqrt(max(1.0 - sin_box2, 0.0)), sqrt(sin_box2)).x <= spread.z) {
            return 0.0;
        }
    }
    return box_shown(at, middle, half) * lights[r].radiance.x * (0.1 + 0.9 * max(left.x, 0.0)) / (d2 + radius2);
}

// cos and sin of one angle less another; 0 at least.
fn angle_less(c: f32, s: f32, other: f32, sin_other: f32) -> vec2<f32> {
    if (c >= other) {
        return vec2<f32>(1.0, 0.0);
    }
    return vec2<f32>(c * other + s * sin_other, s * other - c * sin_other);
}

fn box_shown(at: Place, middle: vec3<f32>, half: vec3<f32>) -> f32 {
    if (!at.inside) {
        return 1.0;
    }
    let first = frame.globals.lights;
    var sum = 0.0;
    var outside = false;
    for (var i = 0u; i < frame.globals.portals; i++) {
        let w = first + i;
        let n = lights[w].n;
        let along = dot(n, middle - lights[w].p);
        let wide = dot(abs(n), half);
        if (along + wide > 0.0) {
            // Before this window, or on both sides of its wall: then nobody knows.
            if (along - wide < 0.0) {
                return 1.0;
            }
            continue;
        }
        outside = true;
        let u = lights[w].u;
        let v = lights[w].v;
        let uu = dot(u, u);
        let uv = dot(u, v);
        let vv = dot(v, v);
        let det = 1.0 / (uu * vv - uv * uv);
        // Height above the window's plane and place along its sides, of the place and of ways from it.
        let a = (u * vv - v * uv) * det;
        let b = (v * uu - u * uv) * det;
        let start = at.p - lights[w].p;
        let eye = vec3<f32>(dot(n, start), dot(a, start), dot(b, start));
        let along_to = middle - at.p;
        let to = vec3<f32>(dot(n, along_to), dot(a, along_to), dot(b, along_to));
        let x = vec3<f32>(n.x, a.x, b.x) * half.x;
        let y = vec3<f32>(n.y, a.y, b.y) * half.y;
        let z = vec3<f32>(n.z, a.z, b.z) * half.z;
        var low = vec2<f32>(1e30);
        var high = vec2<f32>(-1e30);
        for (var k = 0u; k < 8u; k++) {
            let way = to + select(x, -x, (k & 1u) == 0u) + select(y, -y, (k & 2u) == 0u) + select(z, -z, (k & 4u) == 0u);
            // Where the ray to the corner crosses the window's plane.
            let place = eye.yz + way.yz * (eye.x / max(-way.x, eye.x));
            low = min(low, place);
            high = max(high, place);
        }
        // A hair wider, for boxes without width and for rounding.
        low -= vec2<f32>(1e-4);
        high += vec2<f32>(1e-4);
        let seen = max(min(high, vec2<f32>(1.0)) - max(low, vec2<f32>(0.0)), vec2<f32>(0.0)) / (high - low);
        sum += seen.x * seen.y;
    }
    return select(1.0, min(sum, 1.0), outside);
}
