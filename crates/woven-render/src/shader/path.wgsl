// One sample of one pixel; the pair of cpu/path.rs.

const CROSSINGS: u32 = 64u;
const BOUNCES: u32 = 65u;
const ROULETTE: f32 = 3.0;

struct Vertex {
    s: Surface,
    at: Place,
    wo: vec3<f32>,
    throughput: vec3<f32>,
}

// What one sample adds.
struct Taken {
    light: array<vec3<f32>, LAYERS>,
    albedo: vec3<f32>,
    normal: vec3<f32>,
    depth: f32,
    gap: f32,
}

fn add_light(out: ptr<function, Taken>, layer: u32, value: vec3<f32>) {
    (*out).light[min(layer, LAYERS - 1u)] += value;
}

fn towards_eye(s: Surface, d: vec3<f32>) -> vec3<f32> {
    return select(s.fz, -s.fz, dot(s.fz, d) > 0.0);
}

fn place_of(m: u32, s: Surface, d: vec3<f32>) -> Place {
    return light_place(s.p, towards_eye(s, d), (materials[m].flags & TRANSMITS) != 0u);
}

fn heuristic(a: f32, b: f32) -> f32 {
    let r = b / max(a, 1e-30);
    return 1.0 / (1.0 + r * r);
}

fn shares(m: u32) -> bool {
    return (materials[m].flags & MATT) == 0u;
}

struct Direct {
    layer: u32,
    value: vec3<f32>,
}

fn direct(m: u32, s: Surface, at: Place, wo: vec3<f32>, u: vec4<f32>, rng: ptr<function, Rng>) -> Direct {
    let l = light_sample(at, u.xyz);
    if (l.pdf <= 0.0) {
        return Direct(0u, vec3<f32>(0.0));
    }
    let wi = local(s, l.wi);
    let b = scattering(m, s, wo, wi, false, vec3<f32>(0.0));
    var value = b.f * l.radiance * (abs(wi.z) / l.pdf);
    if (l.meets && (l.sampled_by_all || shares(m))) {
        value *= heuristic(l.pdf, b.pdf);
    }
    if (max3(value) <= 0.0) {
        return Direct(0u, vec3<f32>(0.0));
    }
    let ray = ray_new(leave(s, l.wi), l.wi);
    let passed = transmittance(ray, l.distance - (1e-4 + 1e-4 * l.distance), rng);
    return Direct(l.layer, value * passed);
}

fn camera_ray(x: u32, y: u32, u: vec4<f32>) -> Ray {
    let sx = (f32(x) + u.x) / f32(frame.width) * 2.0 - 1.0;
    let sy = 1.0 - (f32(y) + u.y) / f32(frame.height) * 2.0;
    let d = frame.forward + frame.right * sx + frame.up * sy;
    if (frame.aperture <= 0.0) {
        return ray_new(frame.eye, unit(d));
    }
    let sc = sincos_turn(u.z);
    let r = frame.aperture * sqrt(u.w);
    let lens = frame.lens_x * (r * sc.y) + frame.lens_y * (r * sc.x);
    return ray_new(frame.eye + lens, unit(d * frame.focus - lens));
}

fn reflectance(m: u32, s: Surface) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    for (var j = 0u; j < 8u; j++) {
        sum += materials[m].linear[j].xyz;
    }
    return sum * s.tint;
}

// Sample `index` of pixel (x, y). One loop for camera and path: each heavy function is called at one place, because
// shader compilers copy functions to where they are called.
fn take(x: u32, y: u32, index: u32) -> Taken {
    var out: Taken;
    var rng = rng_new(x, y, index, frame.seed);
    var ray = camera_ray(x, y, rng_set(&rng, 0u));
    var tmin = 0.0;
    // Straight from the eye: `carry` is the product of the gaps so far, `bounce` counts crossings.
    var camera = true;
    var carry = vec3<f32>(1.0);
    var bounce = 0u;
    // What the camera ray's crossings leave for the indirect part.
    var found = false;
    var chosen: Vertex;
    var chosen_weight = 1.0;
    var all_weights = 0.0;
    var pick = rng_coin(&rng);
    // The vertex that the path left last, and the density with which it did.
    var v: Vertex;
    var pdf = 0.0;
    loop {
        let hit = nearest(ray, tmin, FAR);
        let miss = hit.place == EMPTY;
        var s: Surface;
        var gap = 0.0;
        var given: vec3<f32>;
        var layer = frame.globals.sky_layer;
        var row = frame.globals.sky_light;
        if (miss) {
            given = sky(ray.d);
        } else {
            s = surface(hit);
            gap = gap_of(s.material, s, ray.d);
            // A path goes straight on through gaps, each by a coin.
            if (!camera && gap > 0.0) {
                var pass_on = gap >= 1.0;
                if (!pass_on) {
                    pass_on = rng_coin(&rng) < gap;
                }
                if (pass_on) {
                    tmin = hit.t * (1.0 + 2e-6) + frame.globals.offset;
                    continue;
                }
            }
            given = emission(s.material, s, -ray.d);
            layer = materials[s.material].layer;
            row = s.light;
        }
        // What is given off there; scattering shares it with the sampling of lights.
        if (max3(given) > 0.0) {
            var share = 1.0;
            if (camera) {
                share = 1.0 - gap;
            } else if (row != NONE) {
                let met = light_density(v.at, row, ray.d, select(hit.t, 1e9, miss));
                if (met > 0.0) {
                    share = 0.0;
                    if (shares(v.s.material) || (!miss && soft(row))) {
                        share = heuristic(pdf, met);
                    }
                }
            }
            add_light(&out, layer, given * carry * share);
        }
        var scatter = false;
        if (miss) {
            if (camera) {
                add_discs(&out, ray.d, carry.x);
            }
        } else {
            if (camera && bounce == 0u) {
                out.normal = towards_eye(s, ray.d);
                out.depth = hit.t;
            }
            let albedo = materials[s.material].emission.w * luminance(s.tint);
            let weight = carry.x * (1.0 - gap) * albedo;
            var lit_here = bounce < frame.depth && materials[s.material].emission.w > 0.0;
            if (camera) {
                out.albedo += reflectance(s.material, s) * (carry.x * (1.0 - gap));
                lit_here = weight > 0.0 && frame.depth > 0u;
            }
            if (lit_here) {
                let at = place_of(s.material, s, ray.d);
                let wo = local(s, -ray.d);
                let u = rng_set(&rng, select(BOUNCES + 2u * bounce + 1u, 1u + bounce, camera));
                if (!camera) {
                    // What is scattered here is the yarn's share; the coin above has already chosen the yarn.
                    carry *= 1.0 / max(1.0 - gap, 1e-6);
                }
                let lit = direct(s.material, s, at, wo, u, &rng);
                add_light(&out, lit.layer, lit.value * carry);
                if (camera) {
                    // Reservoir of one: each crossing is kept in proportion to its weight.
                    all_weights += weight;
                    let keep = weight / all_weights;
                    if (pick < keep) {
                        pick /= keep;
                        found = true;
                        chosen = Vertex(s, at, wo, carry);
                        chosen_weight = weight;
                    } else {
                        pick = (pick - keep) / (1.0 - keep);
                    }
                } else {
                    v = Vertex(s, at, wo, carry);
                    scatter = true;
                }
            }
        }
        if (camera) {
            var passed = select(carry.x * gap, 0.0, miss);
            if (passed > 0.0) {
                out.gap = passed;
                if (passed < FAINT) {
                    if (rng_coin(&rng) < 0.5) {
                        out.gap = 0.0;
                        passed = 0.0;
                    }
                    passed *= 2.0;
                }
                bounce += 1u;
                if (passed > 0.0 && bounce < CROSSINGS) {
                    carry = vec3<f32>(passed);
                    tmin = hit.t * (1.0 + 2e-6) + frame.globals.offset;
                    continue;
                }
            }
            // The camera ray has ended; the path begins at the crossing that was kept.
            camera = false;
            bounce = 0u;
            v = chosen;
            carry = chosen.throughput * (all_weights / chosen_weight);
            scatter = found;
        }
        if (!scatter) {
            break;
        }
        bounce += 1u;
        let m = v.s.material;
        // The last ray could only meet lights that sampling has already counted.
        if (bounce > frame.depth || (bounce == frame.depth && !shares(m) && frame.globals.soft_lights == 0u)) {
            break;
        }
        let u = rng_set(&rng, BOUNCES + 2u * bounce);
        let b = scattering(m, v.s, v.wo, vec3<f32>(0.0), true, u.xyz);
        pdf = b.pdf;
        if (pdf <= 1e-12) {
            break;
        }
        carry *= b.f * (abs(b.wi.z) / pdf);
        let q = max3(carry) * ROULETTE;
        if (q <= 0.0) {
            break;
        }
        if (bounce > 1u && q < 1.0) {
            if (u.w >= q) {
                break;
            }
            carry *= 1.0 / q;
        }
        let d = world(v.s, b.wi);
        ray = ray_new(leave(v.s, d), d);
        tmin = 0.0;
    }
    return out;
}

fn add_discs(out: ptr<function, Taken>, d: vec3<f32>, passed: f32) {
    for (var i = 0u; i < frame.globals.lights; i++) {
        if (lights[i].kind == SUN && lights[i].u.y > 1e-4 && dot(d, lights[i].n) > lights[i].u.x) {
            add_light(out, lights[i].layer, lights[i].radiance * (1.0 / (PI * lights[i].u.y * lights[i].u.y)) * passed);
        }
    }
}

fn finite(v: vec3<f32>) -> bool {
    return all(abs(v) < vec3<f32>(1e30));
}

@compute @workgroup_size(8, 8, 1)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) inner: vec3<u32>) {
    let block = frame.block + group.x;
    let columns = (frame.width + 7u) / 8u;
    let x = (block % columns) * 8u + inner.x;
    let y = (block / columns) * 8u + inner.y;
    if (x >= frame.width || y >= frame.height) {
        return;
    }
    let pixel = y * frame.width + x;
    var sum = sums[pixel];
    for (var index = frame.first; index < frame.first + frame.count; index++) {
        let s = take(x, y, index);
        var all = vec3<f32>(0.0);
        for (var k = 0u; k < LAYERS; k++) {
            let l = select(vec3<f32>(0.0), s.light[k], finite(s.light[k]));
            all += l;
            sum.light[k] += vec4<f32>(l, 0.0);
        }
        let lum = luminance(all);
        sum.light[0].w += lum * lum;
        sum.light[1].w += s.gap;
        sum.light[2].w += s.depth;
        sum.albedo += vec4<f32>(s.albedo, 0.0);
        sum.normal += vec4<f32>(s.normal, 0.0);
    }
    sums[pixel] = sum;
}
