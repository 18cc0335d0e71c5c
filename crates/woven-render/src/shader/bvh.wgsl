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
    // Which lanes are met.
    hit: vec4<bool>,
    children: vec4<u32>,
}

// Bits of the lanes that are true.
fn bits(lanes: vec4<bool>) -> u32 {
    return dot(select(vec4<u32>(0u), vec4<u32>(1u, 2u, 4u, 8u), lanes), vec4<u32>(1u));
}

// Distances to the four sides of the boxes along an axis.
fn sides(places: u32, step: f32, corner: f32, o: f32, inv: f32) -> vec4<f32> {
    let q = vec4<i32>((vec4<u32>(places) >> vec4<u32>(0u, 8u, 16u, 24u)) & vec4<u32>(255u));
    return (corner + vec4<f32>(q) * step - o) * inv;
}

fn boxes(n: u32, ray: Ray, tmin: f32, tmax: f32) -> Boxes {
    let spread = forks[n].spread;
    let corner = forks[n].corner;
    let step = bitcast<vec3<f32>>(((vec3<u32>(spread) >> vec3<u32>(0u, 8u, 16u)) & vec3<u32>(255u)) << vec3<u32>(23u));
    let back = ray.inv < vec3<f32>(0.0);
    let lo = forks[n].lo;
    let hi = forks[n].hi;
    let first = select(lo, hi, back);
    let last = select(hi, lo, back);
    let near = max(
        max(sides(first.x, step.x, corner.x, ray.o.x, ray.inv.x), sides(first.y, step.y, corner.y, ray.o.y, ray.inv.y)),
        max(sides(first.z, step.z, corner.z, ray.o.z, ray.inv.z), vec4<f32>(tmin)),
    );
    let far = min(
        min(sides(last.x, step.x, corner.x, ray.o.x, ray.inv.x), sides(last.y, step.y, corner.y, ray.o.y, ray.inv.y)),
        min(sides(last.z, step.z, corner.z, ray.o.z, ray.inv.z), vec4<f32>(tmax)),
    );
    // The nodes follow each other, and the leaves.
    let node = (vec4<u32>(spread) >> vec4<u32>(24u, 25u, 26u, 27u)) & vec4<u32>(1u);
    let leaf = (vec4<u32>(spread) >> vec4<u32>(28u, 29u, 30u, 31u)) & vec4<u32>(1u);
    let nodes = forks[n].nodes + vec4<u32>(0u, node.x, node.x + node.y, node.x + node.y + node.z);
    let leaves = (forks[n].packets | LEAF) + vec4<u32>(0u, leaf.x, leaf.x + leaf.y, leaf.x + leaf.y + leaf.z);
    let children = select(nodes, leaves, leaf == vec4<u32>(1u));
    return Boxes(near, (near <= far) & ((node | leaf) == vec4<u32>(1u)), children);
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

// Both walks go on with one child and leave the others on the stack, and they go down to a leaf in a loop of its own and
// test its triangles outside of it (Aila and Laine 2009): where rays run side by side, those at nodes would else wait at
// every step for one at a leaf.

// The child of a node that is in lane `lane`.
fn child_of(children: vec4<u32>, lane: u32) -> u32 {
    let low = select(children.x, children.y, (lane & 1u) != 0u);
    let high = select(children.z, children.w, (lane & 1u) != 0u);
    return select(low, high, (lane & 2u) != 0u);
}

// The nearest hit between tmin and tmax; its place is EMPTY when there is none.
fn nearest(ray: Ray, tmin: f32, tmax: f32) -> Hit {
    var hit = Hit(tmax, EMPTY, 0.0, 0.0);
    var child = 0u;
    var top = 0u;
    while (child != EMPTY) {
        while ((child & LEAF) == 0u) {
            let b = boxes(child, ray, tmin, hit.t);
            let children = b.children;
            // The order of the distances, which are not negative, is that of their bits; the last two give way to the
            // lane, of equals the highest first.
            var keys = (bitcast<vec4<u32>>(b.near) & vec4<u32>(~3u)) | vec4<u32>(3u, 2u, 1u, 0u);
            keys = select(vec4<u32>(EMPTY), keys, b.hit);
            let low = min(keys.xz, keys.yw);
            let high = max(keys.xz, keys.yw);
            let first = min(low.x, low.y);
            let last = max(high.x, high.y);
            let inner = vec2<u32>(max(low.x, low.y), min(high.x, high.y));
            let second = min(inner.x, inner.y);
            let third = max(inner.x, inner.y);
            if (last != EMPTY) {
                stack[top] = child_of(children, 3u - (last & 3u));
                entries[top] = bitcast<f32>(last & ~3u);
                top += 1u;
            }
            if (third != EMPTY) {
                stack[top] = child_of(children, 3u - (third & 3u));
                entries[top] = bitcast<f32>(third & ~3u);
                top += 1u;
            }
            if (second != EMPTY) {
                stack[top] = child_of(children, 3u - (second & 3u));
                entries[top] = bitcast<f32>(second & ~3u);
                top += 1u;
            }
            if (first != EMPTY) {
                child = child_of(children, 3u - (first & 3u));
                continue;
            }
            child = EMPTY;
            while (top > 0u && child == EMPTY) {
                top -= 1u;
                child = select(EMPTY, stack[top], entries[top] < hit.t);
            }
        }
        if (child != EMPTY) {
            let packet = child & ~LEAF;
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
        child = EMPTY;
        while (top > 0u && child == EMPTY) {
            top -= 1u;
            child = select(EMPTY, stack[top], entries[top] < hit.t);
        }
    }
    return hit;
}

// Share of light that passes straight from the ray's origin to distance tmax. Below `faint` an even coin ends it; an
// exact one just ends there.
fn transmittance(ray: Ray, tmax: f32, faint: f32, exact: bool, rng: ptr<function, Rng>) -> f32 {
    var product = 1.0;
    var aside = rng_aside(rng);
    var child = 0u;
    var top = 0u;
    var packet = 0u;
    var met = Four();
    loop {
        // On to the next sheet that is met: what is asked of one is long, so it is asked in one place, and never for a leaf
        // that is not met.
        while (met.hit == 0u && child != EMPTY) {
            while ((child & LEAF) == 0u) {
                let b = boxes(child, ray, 0.0, tmax);
                // The highest lane that is met is the next; the others wait.
                child = EMPTY;
                if (b.hit.x) {
                    child = b.children.x;
                }
                if (b.hit.y) {
                    if (child != EMPTY) {
                        stack[top] = child;
                        top += 1u;
                    }
                    child = b.children.y;
                }
                if (b.hit.z) {
                    if (child != EMPTY) {
                        stack[top] = child;
                        top += 1u;
                    }
                    child = b.children.z;
                }
                if (b.hit.w) {
                    if (child != EMPTY) {
                        stack[top] = child;
                        top += 1u;
                    }
                    child = b.children.w;
                }
                if (child == EMPTY && top > 0u) {
                    top -= 1u;
                    child = stack[top];
                }
            }
            if (child != EMPTY) {
                packet = child & ~LEAF;
                met = triangles(packet, ray, 0.0, tmax);
                child = EMPTY;
                if (top > 0u) {
                    top -= 1u;
                    child = stack[top];
                }
            }
        }
        if (met.hit == 0u) {
            break;
        }
        let lane = firstTrailingBit(met.hit);
        met.hit &= met.hit - 1u;
        var gap = packets[packet].gap[lane];
        if ((TEXTURED || MEASURES || LOBES) && gap < 0.0) {
            gap = gap_at(packet * 4u + lane, met.u[lane], met.v[lane], ray.d);
        }
        product *= gap;
        if (product < faint) {
            if (product <= 0.0 || exact) {
                return 0.0;
            }
            if (rng_coin(&aside) < 0.5) {
                return 0.0;
            }
            product *= 2.0;
        }
    }
    return product;
}
