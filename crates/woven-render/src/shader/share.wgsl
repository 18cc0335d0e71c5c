// Pixels of a block share the second points of their paths; the pair of cpu/share.rs. A workgroup is a block.
//
// Passes over all blocks of a range, in place of barriers: `start` follows the paths, `keep` chooses second points, `see`
// looks at them, `weigh` adds up how likely each was, `finish` adds what they scatter.

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
    // Of the second point that is kept as the n-th, in slot n of the block: its pixel, its weight, and with how much
    // density all pixels of the block see it.
    kept: u32,
    weight: f32,
    densities: f32,
    // How many are kept; in the block's first slot.
    count: u32,
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
    p: vec3<f32>,
    material: u32,
    ng: vec3<f32>,
    alpha: f32,
    fx: vec3<f32>,
    width: f32,
    fz: vec3<f32>,
    metal: f32,
    tint: vec3<f32>,
    lit_wi: vec3<f32>,
    pdf: f32,
    light: vec3<f32>,
    layer: u32,
    wi: vec3<f32>,
    // 1: who looks has it before him.
    side: u32,
    beyond: array<vec4<f32>, 4>,
}

@group(0) @binding(10) var<storage, read_write> slots: array<Slot>;
// The second points as `start` writes them, and a copy that is made after it for the passes that read them.
@group(0) @binding(11) var<storage, read_write> seconds: array<SecondRow>;
@group(0) @binding(8) var<storage, read> looks: array<SecondRow>;

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

// The pixel of its block that a lane looks after: lanes side by side have neighbours above and below too, whose rays stay
// together longer than those of a row.
fn member_of(lane: u32) -> u32 {
    return (lane & 35u) | ((lane & 4u) << 1u) | ((lane & 8u) >> 1u) | (lane & 16u);
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
fn start(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let member = member_of(lane);
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
    let y = b.second.s;
    seconds[slot].p = y.p;
    seconds[slot].material = y.material;
    seconds[slot].ng = y.ng;
    seconds[slot].alpha = y.alpha;
    seconds[slot].fx = y.fx;
    seconds[slot].width = y.gloss.x;
    seconds[slot].fz = y.fz;
    seconds[slot].metal = y.gloss.y;
    seconds[slot].tint = y.tint;
    seconds[slot].side = u32(dot(y.ng, y.p - b.firsts[b.chosen].s.p) < 0.0);
    seconds[slot].layer = b.second.lit.layer;
    seconds[slot].pdf = b.second.lit.pdf;
    seconds[slot].lit_wi = b.second.lit.wi;
    seconds[slot].light = b.second.lit.light;
    seconds[slot].wi = b.second.wi;
    for (var k = 0u; k < LAYERS; k++) {
        seconds[slot].beyond[k] = vec4<f32>(b.second.beyond[k], 0.0);
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
    var total = 0.0;
    for (var k = 0u; k < GROUP; k++) {
        total += slots[base + k].brightness;
    }
    return Comb(total, coin, 0.0, 0.0, 0.0);
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

// One lane a block.
@compute @workgroup_size(8, 1, 1)
fn keep(@builtin(global_invocation_id) id: vec3<u32>) {
    let base = id.x * GROUP;
    if (base >= arrayLength(&slots)) {
        return;
    }
    var comb = comb_of(id.x, base);
    var n = 0u;
    for (var k = 0u; k < GROUP; k++) {
        let weight = keeping(&comb, base + k);
        if (weight > 0.0) {
            slots[base + n].kept = k;
            slots[base + n].weight = weight;
            n += 1u;
        }
    }
    slots[base].count = n;
}

// A second point that is kept, of those of its block, each by a lane.
@compute @workgroup_size(64, 1, 1)
fn weigh(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) n: u32) {
    let base = workgroup.x * GROUP;
    if (n >= slots[base].count) {
        return;
    }
    var densities = 0.0;
    for (var k = 0u; k < GROUP; k++) {
        densities += slots[base + k].sights[n][0].w + slots[base + k].sights[n][1].w;
    }
    slots[base + n].densities = densities;
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

fn surface_of_look(i: u32) -> Surface {
    return surface_of(Point(
        looks[i].p, looks[i].material, looks[i].ng, looks[i].alpha, looks[i].fx, looks[i].width, looks[i].fz, looks[i].metal,
        looks[i].tint,
    ));
}

@compute @workgroup_size(64, 1, 1)
fn see(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let member = member_of(lane);
    let base = workgroup.x * GROUP;
    let slot = base + member;
    let count = slots[base].count;
    let chosen = slots[slot].chosen;
    let own = slots[slot].passed;
    // No coin is tossed on the way.
    var unused = Rng(0u, 0u, 0u);
    for (var which = 0u; which < FIRSTS; which++) {
        let share = slots[slot].firsts[which].share;
        if (share <= 0.0) {
            for (var n = 0u; n < count; n++) {
                slots[slot].sights[n][which].w = 0.0;
            }
        } else {
            let x = surface_of(slots[slot].firsts[which].point);
            let eye = slots[slot].firsts[which].wo;
            let throughput = slots[slot].firsts[which].throughput;
            for (var n = 0u; n < count; n++) {
                let k = slots[base + n].kept;
                let i = base + k;
                var sight = vec4<f32>(0.0);
                let y = looks[i].p;
                let begin = leave(x, y - x.p);
                let to = y - begin;
                let distance2 = max(length2(to), 1e-12);
                let distance = sqrt(distance2);
                let d = to * (1.0 / distance);
                let c = dot(looks[i].ng, d);
                if ((c < 0.0) == (looks[i].side == 1u)) {
                    let wi = local(x, d);
                    let b = scattering(x.material, x, eye, wi, false, vec3<f32>(0.0));
                    let yarn = 1.0 - gap_of(looks[i].material, surface_of_look(i), d);
                    let density = share * b.pdf * yarn;
                    if (density > 0.0) {
                        var passed = own;
                        if (k != member || which != chosen) {
                            passed = transmittance(
                                ray_new(begin, d), distance - (1e-4 + 1e-4 * distance), 1e-12, true, &unused,
                            );
                        }
                        let seen = abs(c) / distance2 * passed;
                        sight = vec4<f32>(throughput * b.f * (abs(wi.z) * seen), density * seen);
                    }
                }
                slots[slot].sights[n][which] = sight;
            }
        }
    }
}

// A sample that is not a number must not spoil the pixel; it counts as black.
fn finite(l: vec3<f32>) -> vec3<f32> {
    return select(vec3<f32>(0.0), l, all(abs(l) < vec3<f32>(1e30)));
}

@compute @workgroup_size(64, 1, 1)
fn finish(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let member = member_of(lane);
    let pixel = corner_of(frame.block + workgroup.x) + vec2<i32>(vec2<u32>(member % BLOCK, member / BLOCK));
    if (!inside(pixel)) {
        return;
    }
    let base = workgroup.x * GROUP;
    let slot = base + member;
    let count = slots[base].count;
    var light: array<vec3<f32>, LAYERS>;
    for (var k = 0u; k < LAYERS; k++) {
        light[k] = slots[slot].taken.indirect[k].xyz;
    }
    // The sights in order, which are looked for in a loop of its own: what follows is long, and where lanes run side by side
    // it would be done for those that see nothing.
    var at = 0u;
    loop {
        while (at < FIRSTS * count) {
            if (slots[slot].sights[at / FIRSTS][at % FIRSTS].w > 0.0) {
                break;
            }
            at += 1u;
        }
        if (at >= FIRSTS * count) {
            break;
        }
        let n = at / FIRSTS;
        let which = at % FIRSTS;
        at += 1u;
        let i = base + slots[base + n].kept;
        let carry = slots[slot].sights[n][which].xyz * (slots[base + n].weight / slots[base + n].densities);
        let s = surface_of_look(i);
        let x = surface_of(slots[slot].firsts[which].point);
        let to = s.p - leave(x, s.p - x.p);
        let wo = local(s, to * (-1.0 / sqrt(max(length2(to), 1e-12))));
        // By event all that comes this way is of one layer.
        let event = event_of(slots[slot].firsts[which].front == 1u, local(x, to), slots[slot].firsts[which].wo);
        // Light that was sampled there, then what the path found beyond: one place for the scattering.
        for (var part = 0u; part < 2u; part++) {
            var wi = looks[i].wi;
            if (part == 0u) {
                wi = looks[i].lit_wi;
            }
            let b = scattering(s.material, s, wo, local(s, wi), false, vec3<f32>(0.0));
            if (part == 0u) {
                var value = b.f * looks[i].light;
                if (looks[i].pdf > 0.0) {
                    value *= heuristic(looks[i].pdf, b.pdf);
                }
                light[layer_of(event, looks[i].layer)] += value * carry;
            } else {
                let f = b.f * carry;
                for (var k = 0u; k < LAYERS; k++) {
                    light[layer_of(event, k)] += f * looks[i].beyond[k].xyz;
                }
            }
        }
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
