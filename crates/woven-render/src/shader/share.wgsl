// Pixels of a block share the second points of their paths; the pair of cpu/share.rs. A workgroup is a block.
//
// Three passes, each over all blocks of a range, in place of barriers: `start` follows the paths, `see` looks at the
// second points, `finish` adds what they scatter.

const BLOCK: u32 = 8u;
const GROUP: u32 = 64u;
const KEPT: f32 = 16.0;
const TOOTH: f32 = 0.01;
const GOLDEN: f32 = 0.618034;
const PATHS: u32 = 0x70617468u;

// A point of a sheet, as the passes leave it to each other.
struct Point {
    p: vec3<f32>,
    material: u32,
    ng: vec3<f32>,
    alpha: f32,
    fx: vec3<f32>,
    width: f32,
    fz: vec3<f32>,
    metal: f32,
    tint: vec3<f32>,
}

// What the passes leave to each other for one pixel.
struct Slot {
    // Where the camera ray is scattered.
    firsts: array<FirstRow, FIRSTS>,
    // Of the gaps on the own path's way to its second point, and where the path began.
    passed: f32,
    chosen: u32,
    // What the second point scatters, about.
    brightness: f32,
    second: SecondRow,
    taken: PixelSum,
    // Of the second points that are kept, in order, from each first point: density and what the pixel takes of their light.
    sights: array<array<vec4<f32>, FIRSTS>, GROUP>,
}

struct FirstRow {
    point: Point,
    wo: vec3<f32>,
    // Probability with which the path begins here; 0: there is no such point.
    share: f32,
    throughput: vec3<f32>,
    front: u32,
}

struct SecondRow {
    point: Point,
    lit_wi: vec3<f32>,
    pdf: f32,
    light: vec3<f32>,
    layer: u32,
    wi: vec3<f32>,
    // 1: who looks has it before him.
    side: u32,
    beyond: array<vec4<f32>, LAYERS>,
}

@group(0) @binding(9) var<storage, read_write> slots: array<Slot>;

fn brightness(y: Second) -> f32 {
    var sum = y.lit.light;
    for (var k = 0u; k < LAYERS; k++) {
        sum += y.beyond[k];
    }
    let l = luminance(sum) * materials[y.s.material].emission.w;
    return select(0.0, l, abs(l) < 1e30);
}

// Left upper corner of a block.
fn corner_of(block: u32) -> vec2<i32> {
    let columns = (frame.width + frame.left + BLOCK - 1u) / BLOCK;
    return vec2<i32>(vec2<u32>(block % columns, block / columns) * BLOCK) - vec2<i32>(vec2<u32>(frame.left, frame.above));
}

fn inside(pixel: vec2<i32>) -> bool {
    return all(pixel >= vec2<i32>(0)) && all(pixel < vec2<i32>(vec2<u32>(frame.width, frame.height)));
}

fn seed_of_paths() -> u32 {
    return hash2(frame.index, frame.seed ^ PATHS);
}

// Number of a block on the Z-curve along which the blocks draw from one set of points.
fn order_of(corner: vec2<i32>) -> u32 {
    let seed = seed_of_paths();
    let place = vec2<u32>(corner + i32(BLOCK)) / BLOCK;
    return morton(place.x + (seed & 31u), place.y + ((seed >> 5u) & 31u));
}

fn turn_of(order: u32) -> u32 {
    return hash2(order, seed_of_paths());
}

@compute @workgroup_size(64, 1, 1)
fn start(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) member: u32) {
    let slot = workgroup.x * GROUP + member;
    let corner = corner_of(frame.block + workgroup.x);
    let pixel = corner + vec2<i32>(vec2<u32>(member % BLOCK, member / BLOCK));
    for (var k = 0u; k < FIRSTS; k++) {
        slots[slot].firsts[k].share = 0.0;
    }
    slots[slot].brightness = 0.0;
    if (!inside(pixel)) {
        return;
    }
    let order = order_of(corner);
    var paths = rng_new(0u, 0u, order * GROUP + (member ^ (turn_of(order) % GROUP)), seed_of_paths());
    let b = begin(u32(pixel.x), u32(pixel.y), &paths);
    for (var k = 0u; k < LAYERS; k++) {
        slots[slot].taken.direct[k] = vec4<f32>(b.taken.direct[k], 0.0);
        slots[slot].taken.indirect[k] = vec4<f32>(b.taken.indirect[k], 0.0);
    }
    slots[slot].taken.direct[1].w = b.taken.gap;
    slots[slot].taken.direct[2].w = b.taken.depth;
    slots[slot].taken.albedo = vec4<f32>(b.taken.albedo, 0.0);
    slots[slot].taken.normal = vec4<f32>(b.taken.normal, 0.0);
    for (var k = 0u; k < FIRSTS; k++) {
        slots[slot].firsts[k].share = b.shares[k];
        slots[slot].firsts[k].point = point_of(b.firsts[k].s);
        slots[slot].firsts[k].wo = b.firsts[k].wo;
        slots[slot].firsts[k].throughput = b.firsts[k].throughput;
        slots[slot].firsts[k].front = u32(b.firsts[k].front);
    }
    slots[slot].chosen = b.chosen;
    if (!b.has_second) {
        return;
    }
    slots[slot].brightness = brightness(b.second);
    slots[slot].passed = b.second.passed;
    slots[slot].second.point = point_of(b.second.s);
    slots[slot].second.side = u32(dot(b.second.s.ng, b.second.s.p - b.firsts[b.chosen].s.p) < 0.0);
    slots[slot].second.layer = b.second.lit.layer;
    slots[slot].second.pdf = b.second.lit.pdf;
    slots[slot].second.lit_wi = b.second.lit.wi;
    slots[slot].second.light = b.second.lit.light;
    slots[slot].second.wi = b.second.wi;
    for (var k = 0u; k < LAYERS; k++) {
        slots[slot].second.beyond[k] = vec4<f32>(b.second.beyond[k], 0.0);
    }
}

// A comb for each row of second points laid side by side, each as long as it is bright; see cpu/share.rs.
struct Comb {
    total: f32,
    coin: f32,
    start: f32,
    sum: f32,
    before: f32,
}

fn under_teeth(x: f32) -> f32 {
    return floor(x) * TOOTH + min(x - floor(x), TOOTH);
}

fn comb_of(block: u32, base: u32) -> Comb {
    let coin = to_unit(turn_of(order_of(corner_of(frame.block + block))));
    return Comb(total_of(base), coin, 0.0, 0.0, 0.0);
}

// Weight of the next point, that of a slot; 0 if it is not kept.
fn keeping(comb: ptr<function, Comb>, slot: u32) -> f32 {
    let bright = slots[slot].brightness;
    let total = (*comb).total;
    if (total <= 0.0) {
        return 0.0;
    }
    if (slot % BLOCK == 0u) {
        let turned = (*comb).coin + GOLDEN * f32(slot / BLOCK % BLOCK);
        (*comb).start = turned - floor(turned);
        (*comb).before = under_teeth((*comb).start);
        (*comb).sum = 0.0;
    }
    (*comb).sum += bright;
    let now = under_teeth(KEPT * (*comb).sum / total + (*comb).start);
    let teeth = (now - (*comb).before) / TOOTH;
    (*comb).before = now;
    let length = KEPT * bright / total;
    return select(0.0, select(1.0, teeth / length, length < 1.0), teeth > 0.0);
}

fn total_of(base: u32) -> f32 {
    var total = 0.0;
    for (var k = 0u; k < GROUP; k++) {
        total += slots[base + k].brightness;
    }
    return total;
}

fn point_of(s: Surface) -> Point {
    return Point(s.p, s.material, s.ng, s.alpha, s.fx, s.gloss.x, s.fz, s.gloss.y, s.tint);
}

fn surface_of(point: Point) -> Surface {
    var s: Surface;
    s.p = point.p;
    s.ng = point.ng;
    s.fx = point.fx;
    s.fz = point.fz;
    s.fy = cross(point.fz, point.fx);
    s.material = point.material;
    s.tint = point.tint;
    s.alpha = point.alpha;
    s.gloss = vec2<f32>(point.width, point.metal);
    return s;
}

@compute @workgroup_size(64, 1, 1)
fn see(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) member: u32) {
    let base = workgroup.x * GROUP;
    let slot = base + member;
    var comb = comb_of(workgroup.x, base);
    // No coin is tossed on the way.
    var unused = Rng(0u, 0u, 0u);
    var n = 0u;
    for (var k = 0u; k < GROUP; k++) {
        let i = base + k;
        if (keeping(&comb, i) <= 0.0) {
            continue;
        }
        for (var which = 0u; which < FIRSTS; which++) {
            var sight = vec4<f32>(0.0);
            let share = slots[slot].firsts[which].share;
            if (share > 0.0) {
                let x = surface_of(slots[slot].firsts[which].point);
                let y = slots[i].second.point.p;
                let begin = leave(x, y - x.p);
                let to = y - begin;
                let distance2 = max(length2(to), 1e-12);
                let distance = sqrt(distance2);
                let d = to * (1.0 / distance);
                let c = dot(slots[i].second.point.ng, d);
                if ((c < 0.0) == (slots[i].second.side == 1u)) {
                    let wi = local(x, d);
                    let b = scattering(x.material, x, slots[slot].firsts[which].wo, wi, false, vec3<f32>(0.0));
                    let yarn = 1.0 - gap_of(slots[i].second.point.material, surface_of(slots[i].second.point), d);
                    let density = share * b.pdf * yarn;
                    if (density > 0.0) {
                        var passed = slots[slot].passed;
                        if (k != member || which != slots[slot].chosen) {
                            passed = transmittance(
                                ray_new(begin, d), distance - (1e-4 + 1e-4 * distance), 1e-12, true, &unused,
                            );
                        }
                        let seen = abs(c) / distance2 * passed;
                        let carry = slots[slot].firsts[which].throughput * b.f * (abs(wi.z) * seen);
                        sight = vec4<f32>(carry, density * seen);
                    }
                }
            }
            slots[slot].sights[n][which] = sight;
        }
        n += 1u;
    }
}

// A sample that is not a number must not spoil the pixel; it counts as black.
fn finite(l: vec3<f32>) -> vec3<f32> {
    return select(vec3<f32>(0.0), l, all(abs(l) < vec3<f32>(1e30)));
}

@compute @workgroup_size(64, 1, 1)
fn finish(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) member: u32) {
    let pixel = corner_of(frame.block + workgroup.x) + vec2<i32>(vec2<u32>(member % BLOCK, member / BLOCK));
    if (!inside(pixel)) {
        return;
    }
    let base = workgroup.x * GROUP;
    let slot = base + member;
    var comb = comb_of(workgroup.x, base);
    var light: array<vec3<f32>, LAYERS>;
    for (var k = 0u; k < LAYERS; k++) {
        light[k] = slots[slot].taken.indirect[k].xyz;
    }
    var n = 0u;
    for (var m = 0u; m < GROUP; m++) {
        let i = base + m;
        let weight = keeping(&comb, i);
        if (weight <= 0.0) {
            continue;
        }
        for (var which = 0u; which < FIRSTS; which++) {
            let sight = slots[slot].sights[n][which];
            if (sight.w <= 0.0) {
                continue;
            }
            var all_densities = 0.0;
            for (var k = 0u; k < GROUP; k++) {
                all_densities += slots[base + k].sights[n][0].w + slots[base + k].sights[n][1].w;
            }
            let carry = sight.xyz * (weight / all_densities);
            let s = surface_of(slots[i].second.point);
            let x = surface_of(slots[slot].firsts[which].point);
            let to = s.p - leave(x, s.p - x.p);
            let wo = local(s, to * (-1.0 / sqrt(max(length2(to), 1e-12))));
            // By event all that comes this way is of one layer.
            let event = event_of(slots[slot].firsts[which].front == 1u, local(x, to), slots[slot].firsts[which].wo);
            // Light that was sampled there, then what the path found beyond: one place for the scattering.
            for (var part = 0u; part < 2u; part++) {
                let wi = local(s, select(slots[i].second.wi, slots[i].second.lit_wi, part == 0u));
                let b = scattering(s.material, s, wo, wi, false, vec3<f32>(0.0));
                if (part == 0u) {
                    var value = b.f * slots[i].second.light;
                    if (slots[i].second.pdf > 0.0) {
                        value *= heuristic(slots[i].second.pdf, b.pdf);
                    }
                    light[layer_of(event, slots[i].second.layer)] += value * carry;
                } else {
                    let f = b.f * carry;
                    for (var k = 0u; k < LAYERS; k++) {
                        light[layer_of(event, k)] += f * slots[i].second.beyond[k].xyz;
                    }
                }
            }
        }
        n += 1u;
    }
    let place = u32(pixel.y) * frame.width + u32(pixel.x);
    var sum = vec3<f32>(0.0);
    var direct = vec3<f32>(0.0);
    for (var k = 0u; k < LAYERS; k++) {
        let l = finite(light[k]);
        sum += l;
        sums[place].indirect[k] += vec4<f32>(l, 0.0);
        let d = finite(slots[slot].taken.direct[k].xyz);
        direct += d;
        sums[place].direct[k] += vec4<f32>(d, slots[slot].taken.direct[k].w);
    }
    let lum = vec2<f32>(luminance(direct), luminance(sum));
    sums[place].direct[0].w += lum.x * lum.x;
    sums[place].indirect[0].w += lum.y * lum.y;
    sums[place].indirect[1].w += lum.x * lum.y;
    sums[place].albedo += slots[slot].taken.albedo;
    sums[place].normal += slots[slot].taken.normal;
}
