// Walks a ray through the ray structure; the pair of cpu/bvh.rs.

const FAINT: f32 = 1e-3;

// Not in the functions: there they would be cleared at every call.
var<private> stack: array<u32, STACK>;
var<private> entries: array<f32, STACK>;

struct Hit {
    t: f32,
    place: u32,
    u: f32,
    v: f32,
}

struct Ray {
    o: vec3<f32>,
    d: vec3<f32>,
    inv: vec3<f32>,
}

fn inverse1(x: f32) -> f32 {
    if (abs(x) < 1e-7) {
        return copysign1(1e7, x);
    }
    return 1.0 / x;
}

fn ray_new(o: vec3<f32>, d: vec3<f32>) -> Ray {
    return Ray(o, d, vec3<f32>(inverse1(d.x), inverse1(d.y), inverse1(d.z)));
}

struct Boxes {
    near: vec4<f32>,
    // Bits of the lanes that are met.
    hit: u32,
}

// Bits of the lanes that are true.
fn bits(lanes: vec4<bool>) -> u32 {
    return dot(select(vec4<u32>(0u), vec4<u32>(1u, 2u, 4u, 8u), lanes), vec4<u32>(1u));
}

fn boxes(n: u32, ray: Ray, tmin: f32, tmax: f32) -> Boxes {
    let ax = (nodes[n].lo[0] - ray.o.x) * ray.inv.x;
    let bx = (nodes[n].hi[0] - ray.o.x) * ray.inv.x;
    let ay = (nodes[n].lo[1] - ray.o.y) * ray.inv.y;
    let by = (nodes[n].hi[1] - ray.o.y) * ray.inv.y;
    let az = (nodes[n].lo[2] - ray.o.z) * ray.inv.z;
    let bz = (nodes[n].hi[2] - ray.o.z) * ray.inv.z;
    let near = max(
        max(select(ax, bx, ray.inv.x < 0.0), select(ay, by, ray.inv.y < 0.0)),
        max(select(az, bz, ray.inv.z < 0.0), vec4<f32>(tmin)),
    );
    let far = min(
        min(select(bx, ax, ray.inv.x < 0.0), select(by, ay, ray.inv.y < 0.0)),
        min(select(bz, az, ray.inv.z < 0.0), vec4<f32>(tmax)),
    );
    return Boxes(near, bits(near <= far));
}

struct Four {
    t: vec4<f32>,
    u: vec4<f32>,
    v: vec4<f32>,
    // Bits of the lanes that are met.
    hit: u32,
}

fn triangles(p: u32, ray: Ray, tmin: f32, tmax: f32) -> Four {
    let d = ray.d;
    let e1x = packets[p].e1[0];
    let e1y = packets[p].e1[1];
    let e1z = packets[p].e1[2];
    let e2x = packets[p].e2[0];
    let e2y = packets[p].e2[1];
    let e2z = packets[p].e2[2];
    let px = d.y * e2z - d.z * e2y;
    let py = d.z * e2x - d.x * e2z;
    let pz = d.x * e2y - d.y * e2x;
    let det = e1x * px + e1y * py + e1z * pz;
    // A lane without a triangle has determinant 0: its distance becomes 0, which is never met.
    let none = det == vec4<f32>(0.0);
    let inv = select(1.0 / select(det, vec4<f32>(1.0), none), vec4<f32>(0.0), none);
    let sx = ray.o.x - packets[p].v0[0];
    let sy = ray.o.y - packets[p].v0[1];
    let sz = ray.o.z - packets[p].v0[2];
    let u = (sx * px + sy * py + sz * pz) * inv;
    let qx = sy * e1z - sz * e1y;
    let qy = sz * e1x - sx * e1z;
    let qz = sx * e1y - sy * e1x;
    let v = (d.x * qx + d.y * qy + d.z * qz) * inv;
    let t = (e2x * qx + e2y * qy + e2z * qz) * inv;
    let inside = (u >= vec4<f32>(0.0)) & (v >= vec4<f32>(0.0)) & ((u + v) <= vec4<f32>(1.0));
    let between = (t > vec4<f32>(tmin)) & (t < vec4<f32>(tmax));
    return Four(t, u, v, bits(inside & between));
}

// The nearest hit between tmin and tmax; its place is EMPTY when there is none.
//
// Both walks go down to a leaf in a loop of its own and test its triangles outside of it (Aila and Laine 2009): where
// rays run side by side, those at nodes would else wait at every step for one at a leaf.
fn nearest(ray: Ray, tmin: f32, tmax: f32) -> Hit {
    var hit = Hit(tmax, EMPTY, 0.0, 0.0);
    stack[0] = 0u;
    entries[0] = tmin;
    var top = 1u;
    loop {
        var packet = EMPTY;
        while (top > 0u) {
            top -= 1u;
            let child = stack[top];
            if (entries[top] >= hit.t) {
                continue;
            }
            if ((child & LEAF) != 0u) {
                packet = child & ~LEAF;
                break;
            }
            let b = boxes(child, ray, tmin, hit.t);
            let base = top;
            var mask = b.hit;
            while (mask != 0u) {
                let lane = firstTrailingBit(mask);
                mask &= mask - 1u;
                let entry = b.near[lane];
                var at = top;
                while (at > base && entries[at - 1u] < entry) {
                    stack[at] = stack[at - 1u];
                    entries[at] = entries[at - 1u];
                    at -= 1u;
                }
                stack[at] = nodes[child].child[lane];
                entries[at] = entry;
                top += 1u;
            }
        }
        if (packet == EMPTY) {
            return hit;
        }
        let four = triangles(packet, ray, tmin, hit.t);
        var mask = four.hit;
        while (mask != 0u) {
            let lane = firstTrailingBit(mask);
            mask &= mask - 1u;
            if (four.t[lane] < hit.t) {
                hit = Hit(four.t[lane], packet * 4u + lane, four.u[lane], four.v[lane]);
            }
        }
    }
    return hit;
}

// Share of light that passes straight from the ray's origin to distance tmax. Below `faint` an even coin ends it; an
// exact one just ends there.
fn transmittance(ray: Ray, tmax: f32, faint: f32, exact: bool, rng: ptr<function, Rng>) -> f32 {
    var product = 1.0;
    var aside = rng_aside(rng);
    stack[0] = 0u;
    var top = 1u;
    loop {
        var packet = EMPTY;
        while (top > 0u) {
            top -= 1u;
            let child = stack[top];
            if ((child & LEAF) != 0u) {
                packet = child & ~LEAF;
                break;
            }
            let b = boxes(child, ray, 0.0, tmax);
            var mask = b.hit;
            while (mask != 0u) {
                let lane = firstTrailingBit(mask);
                mask &= mask - 1u;
                stack[top] = nodes[child].child[lane];
                top += 1u;
            }
        }
        if (packet == EMPTY) {
            return product;
        }
        let four = triangles(packet, ray, 0.0, tmax);
        // One copy of the code for the four lanes: what is asked of a sheet is long.
        var mask = four.hit;
        while (mask != 0u) {
            let lane = firstTrailingBit(mask);
            mask &= mask - 1u;
            var gap = packets[packet].gap[lane];
            if (gap < 0.0) {
                gap = gap_at(packet * 4u + lane, four.u[lane], four.v[lane], ray.d);
            }
            product *= gap;
            if (product <= 0.0) {
                return 0.0;
            }
            if (product < faint) {
                if (exact) {
                    return 0.0;
                }
                if (rng_coin(&aside) < 0.5) {
                    return 0.0;
                }
                product *= 2.0;
            }
        }
    }
    return product;
}
