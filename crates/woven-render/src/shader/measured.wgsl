// Cloth as it was measured: a table over Klems patches among the texels; the pair of cpu/measured.rs.

const RING: u32 = 3u;

fn number(at: u32) -> f32 {
    return bitcast<f32>(texels[at]);
}

// Patch of the point (x, y) of the unit disc.
fn patch_of(first: u32, x: f32, y: f32) -> u32 {
    let sin2 = x * x + y * y;
    var ring = first + 2u;
    for (var i = 1u; i < texels[first + 1u]; i++) {
        if (sin2 <= number(ring)) {
            break;
        }
        ring += RING;
    }
    let count = texels[ring + 2u];
    let turn = arc2(y, x) * (1.0 / TAU);
    let place = (turn - floor(turn)) * f32(count) + 0.5;
    return texels[ring + 1u] + u32(place) % count;
}

fn other_side(w: vec3<f32>) -> u32 {
    return select(0u, 1u, w.z < 0.0);
}

// First words of the values, the gaps and the sums.
fn measured_parts(first: u32) -> vec3<u32> {
    let n = texels[first];
    let values = first + 2u + RING * texels[first + 1u];
    let gaps = values + 4u * n * n;
    return vec3<u32>(values, gaps, gaps + 2u * n);
}

fn measured_gap(first: u32, w: vec3<f32>) -> f32 {
    return number(measured_parts(first).y + other_side(w) * texels[first] + patch_of(first, -w.x, -w.y));
}

fn measured_value(first: u32, wi: vec3<f32>, wo: vec3<f32>) -> f32 {
    let n = texels[first];
    let kind = other_side(wi) * 2u + select(0u, 1u, other_side(wi) == other_side(wo));
    let row = kind * n + patch_of(first, wo.x, wo.y);
    return number(measured_parts(first).x + row * n + patch_of(first, -wi.x, -wi.y));
}

// First word of the running sums for a viewer.
fn measured_row(first: u32, wo: vec3<f32>) -> u32 {
    let n = texels[first];
    return measured_parts(first).z + (other_side(wo) * n + patch_of(first, wo.x, wo.y)) * 2u * n;
}

fn measured_albedo(first: u32, wo: vec3<f32>) -> f32 {
    return number(measured_row(first, wo) + 2u * texels[first] - 1u);
}

fn measured_sample(first: u32, wo: vec3<f32>, u: vec3<f32>) -> vec3<f32> {
    let n = texels[first];
    let row = measured_row(first, wo);
    var lo = 0u;
    var hi = 2u * n - 1u;
    let all = number(row + hi);
    if (all <= 0.0) {
        return vec3<f32>(0.0);
    }
    // The first sum above what is wanted.
    while (lo < hi) {
        let middle = (lo + hi) / 2u;
        if (number(row + middle) <= u.z * all) {
            lo = middle + 1u;
        } else {
            hi = middle;
        }
    }
    let patch_number = lo % n;
    var ring = first + 2u;
    var inner = 0.0;
    for (var i = 1u; i < texels[first + 1u]; i++) {
        if (patch_number < texels[ring + 1u] + texels[ring + 2u]) {
            break;
        }
        inner = number(ring);
        ring += RING;
    }
    let sin2 = inner + u.x * (number(ring) - inner);
    let turn = (f32(patch_number - texels[ring + 1u]) + u.y - 0.5) / f32(texels[ring + 2u]);
    let sc = sincos_turn(turn - floor(turn));
    let r = sqrt(sin2);
    let z = sqrt(max(1.0 - sin2, 1e-12));
    // Transmitted light comes from the other side.
    let below = (lo < n) != (wo.z < 0.0);
    return vec3<f32>(-r * sc.y, -r * sc.x, select(z, -z, below));
}
