// Pixels of a block share the second points of their paths; the pair of cpu/share.rs. A workgroup is a block.

const BLOCK: u32 = 8u;
const GROUP: u32 = 64u;
const KEPT: f32 = 16.0;
const PATHS: u32 = 0x70617468u;
// So many second points are looked at between two barriers.
const BATCH: u32 = 4u;

// What the others need of a second point.
struct Shared {
    p: vec3<f32>,
    material: u32,
    ng: vec3<f32>,
    // 1: the points that may look have it before them.
    side: u32,
    fx: vec3<f32>,
    alpha: f32,
    fz: vec3<f32>,
    layer: u32,
    tint: vec3<f32>,
    pdf: f32,
    lit_wi: vec3<f32>,
    q: f32,
    light: vec3<f32>,
    brightness: f32,
    wi: vec3<f32>,
    place: u32,
    beyond: array<vec4<f32>, LAYERS>,
}

var<workgroup> seconds: array<Shared, GROUP>;
// Numbers of those that are kept, in their order, and how many.
var<workgroup> order: array<u32, GROUP>;
var<workgroup> count: u32;
var<workgroup> densities: array<f32, 256>;

fn finite(v: vec3<f32>) -> bool {
    return all(abs(v) < vec3<f32>(1e30));
}

fn brightness(y: Second) -> f32 {
    var sum = y.lit.light;
    for (var k = 0u; k < LAYERS; k++) {
        sum += y.beyond[k];
    }
    let l = luminance(sum) * materials[y.s.material].emission.w;
    return select(0.0, l, abs(l) < 1e30);
}

struct Sight {
    density: f32,
    carry: vec3<f32>,
    d: vec3<f32>,
}

fn look(x: Vertex, i: u32, own: bool, own_passed: f32, rng: ptr<function, Rng>) -> Sight {
    var none: Sight;
    let start = leave(x.s, seconds[i].p - x.s.p);
    let to = seconds[i].p - start;
    let distance2 = max(length2(to), 1e-12);
    let distance = sqrt(distance2);
    let d = to * (1.0 / distance);
    let c = dot(seconds[i].ng, d);
    if ((c < 0.0) != (seconds[i].side == 1u)) {
        return none;
    }
    let wi = local(x.s, d);
    let b = scattering(x.s.material, x.s, x.wo, wi, false, vec3<f32>(0.0));
    let yarn = 1.0 - gap_of(seconds[i].material, second_surface(i), d);
    let density = b.pdf * yarn;
    if (density <= 0.0) {
        return none;
    }
    var passed = own_passed;
    if (!own) {
        passed = transmittance(ray_new(start, d), distance - (1e-4 + 1e-4 * distance), 1e-12, true, rng);
    }
    let seen = abs(c) / distance2 * passed;
    return Sight(density * seen, x.throughput * b.f * (abs(wi.z) * seen), d);
}

fn second_surface(i: u32) -> Surface {
    var s: Surface;
    s.p = seconds[i].p;
    s.ng = seconds[i].ng;
    s.fx = seconds[i].fx;
    s.fz = seconds[i].fz;
    s.fy = cross(s.fz, s.fx);
    s.material = seconds[i].material;
    s.tint = seconds[i].tint;
    s.alpha = seconds[i].alpha;
    return s;
}

// Adds the light of second point i, seen along d, to the sample.
fn add_second(out: ptr<function, Taken>, i: u32, d: vec3<f32>, carry: vec3<f32>) {
    let s = second_surface(i);
    let wo = local(s, -d);
    // Light that was sampled there, then what the path found beyond: one place for the scattering.
    for (var part = 0u; part < 2u; part++) {
        let wi = local(s, select(seconds[i].wi, seconds[i].lit_wi, part == 0u));
        let b = scattering(s.material, s, wo, wi, false, vec3<f32>(0.0));
        if (part == 0u) {
            var value = b.f * seconds[i].light;
            if (seconds[i].pdf > 0.0) {
                value *= heuristic(seconds[i].pdf, b.pdf);
            }
            add_light(out, seconds[i].layer, value * carry);
        } else {
            let f = b.f * carry;
            for (var k = 0u; k < LAYERS; k++) {
                (*out).light[k] += f * seconds[i].beyond[k].xyz;
            }
        }
    }
}

@compute @workgroup_size(64, 1, 1)
fn main(@builtin(workgroup_id) workgroup: vec3<u32>, @builtin(local_invocation_index) member: u32) {
    let block = frame.block + workgroup.x;
    let columns = (frame.width + frame.left + BLOCK - 1u) / BLOCK;
    let x0 = i32((block % columns) * BLOCK) - i32(frame.left);
    let y0 = i32((block / columns) * BLOCK) - i32(frame.above);
    let x = x0 + i32(member % BLOCK);
    let y = y0 + i32(member / BLOCK);
    let inside = x >= 0 && y >= 0 && x < i32(frame.width) && y < i32(frame.height);
    let here = hash2((bitcast<u32>(x0) & 0xffffu) | (bitcast<u32>(y0) << 16u), frame.seed ^ PATHS);
    let turn = hash2(frame.index, here) % GROUP;
    var paths = rng_new(0u, 0u, frame.index * GROUP + (member ^ turn), here);
    var begun: Begun;
    var mine: Shared;
    var coin = 2.0;
    if (inside) {
        begun = begin(u32(x), u32(y), &paths);
        coin = rng_coin(&paths);
        if (begun.has_second) {
            let y = begun.second;
            mine.p = y.s.p;
            mine.material = y.s.material;
            mine.ng = y.s.ng;
            mine.side = u32(dot(y.s.ng, y.s.p - begun.first.s.p) < 0.0);
            mine.fx = y.s.fx;
            mine.fz = y.s.fz;
            mine.alpha = y.s.alpha;
            mine.tint = y.s.tint;
            mine.layer = y.lit.layer;
            mine.pdf = y.lit.pdf;
            mine.lit_wi = y.lit.wi;
            mine.light = y.lit.light;
            mine.wi = y.wi;
            mine.brightness = brightness(y);
            for (var k = 0u; k < LAYERS; k++) {
                mine.beyond[k] = vec4<f32>(y.beyond[k], 0.0);
            }
        }
    }
    seconds[member] = mine;
    workgroupBarrier();
    var total = 0.0;
    for (var k = 0u; k < GROUP; k++) {
        total += seconds[k].brightness;
    }
    let q = min(KEPT * mine.brightness / total, 1.0);
    let stays = total > 0.0 && coin < q;
    workgroupBarrier();
    seconds[member].q = select(0.0, q, stays);
    workgroupBarrier();
    var before = 0u;
    var all_kept = 0u;
    for (var k = 0u; k < GROUP; k++) {
        let one = u32(seconds[k].q > 0.0);
        all_kept += one;
        before += select(0u, one, k < member);
    }
    if (stays) {
        order[before] = member;
    }
    if (member == 0u) {
        count = all_kept;
    }
    let kept = workgroupUniformLoad(&count);
    var taken = begun.taken;
    for (var first = 0u; first < kept; first += BATCH) {
        var sights: array<Sight, BATCH>;
        for (var n = 0u; n < BATCH; n++) {
            var sight: Sight;
            if (first + n < kept && begun.has_first) {
                let i = order[first + n];
                sight = look(begun.first, i, i == member, begun.second.passed, &paths);
            }
            sights[n] = sight;
            densities[n * GROUP + member] = sight.density;
        }
        workgroupBarrier();
        for (var n = 0u; n < BATCH; n++) {
            if (sights[n].density > 0.0) {
                let i = order[first + n];
                var sum = 0.0;
                for (var k = 0u; k < GROUP; k++) {
                    sum += densities[n * GROUP + k];
                }
                add_second(&taken, i, sights[n].d, sights[n].carry * (1.0 / (seconds[i].q * sum)));
            }
        }
        workgroupBarrier();
    }
    if (inside) {
        store(u32(y) * frame.width + u32(x), taken);
    }
}

fn store(pixel: u32, s: Taken) {
    var sum = sums[pixel];
    var every = vec3<f32>(0.0);
    for (var k = 0u; k < LAYERS; k++) {
        let l = select(vec3<f32>(0.0), s.light[k], finite(s.light[k]));
        every += l;
        sum.light[k] += vec4<f32>(l, 0.0);
    }
    let lum = luminance(every);
    sum.light[0].w += lum * lum;
    sum.light[1].w += s.gap;
    sum.light[2].w += s.depth;
    sum.albedo += vec4<f32>(s.albedo, 0.0);
    sum.normal += vec4<f32>(s.normal, 0.0);
    sums[pixel] = sum;
}
