// One sample of one pixel; the pair of cpu/path.rs.

const CROSSINGS: u32 = 64u;
const BOUNCES: u32 = 65u;

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
    var value = evaluate(m, s, wi, wo) * l.radiance * (abs(wi.z) / l.pdf);
    if (l.meets && (l.sampled_by_all || shares(m))) {
        value *= heuristic(l.pdf, density_of(m, wo, wi));
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

fn take(x: u32, y: u32, index: u32) -> Taken {
    var out: Taken;
    var rng = rng_new(x, y, index, frame.seed);
    let ray = camera_ray(x, y, rng_set(&rng, 0u));
    var passed = 1.0;
    var tmin = 0.0;
    var found = false;
    var chosen: Vertex;
    var chosen_weight = 1.0;
    var all_weights = 0.0;
    var pick = rng_coin(&rng);
    for (var number = 0u; number < CROSSINGS; number++) {
        let hit = nearest(ray, tmin, FAR);
        if (hit.place == EMPTY) {
            add_light(&out, frame.globals.sky_layer, sky(ray.d) * passed);
            for (var i = 0u; i < frame.globals.lights; i++) {
                if (lights[i].kind == SUN && lights[i].u.y > 1e-4 && dot(ray.d, lights[i].n) > lights[i].u.x) {
                    add_light(&out, lights[i].layer, lights[i].radiance * (1.0 / (PI * lights[i].u.y * lights[i].u.y)) * passed);
                }
            }
            break;
        }
        let s = surface(hit);
        let m = s.material;
        let wo = local(s, -ray.d);
        let gap = gap_of(m, s, ray.d);
        add_light(&out, materials[m].layer, emission(m, s, -ray.d) * (passed * (1.0 - gap)));
        let albedo = materials[m].emission.w * luminance(s.tint);
        if (number == 0u) {
            out.normal = towards_eye(s, ray.d);
            out.depth = hit.t;
        }
        out.albedo += reflectance(m, s) * (passed * (1.0 - gap));
        let weight = passed * (1.0 - gap) * albedo;
        if (weight > 0.0 && frame.depth > 0u) {
            let at = place_of(m, s, ray.d);
            let lit = direct(m, s, at, wo, rng_set(&rng, 1u + number), &rng);
            add_light(&out, lit.layer, lit.value * passed);
            // Reservoir of one: each crossing is kept in proportion to its weight.
            all_weights += weight;
            let keep = weight / all_weights;
            if (pick < keep) {
                pick /= keep;
                found = true;
                chosen = Vertex(s, at, wo, vec3<f32>(passed));
                chosen_weight = weight;
            } else {
                pick = (pick - keep) / (1.0 - keep);
            }
        }
        passed *= gap;
        if (passed <= 0.0) {
            break;
        }
        out.gap = passed;
        if (passed < FAINT) {
            if (rng_coin(&rng) < 0.5) {
                out.gap = 0.0;
                break;
            }
            passed *= 2.0;
        }
        tmin = hit.t * (1.0 + 2e-6) + frame.globals.offset;
    }
    if (found) {
        chosen.throughput *= all_weights / chosen_weight;
        follow(chosen, &rng, &out);
    }
    return out;
}

fn follow(start: Vertex, rng: ptr<function, Rng>, out: ptr<function, Taken>) {
    var v = start;
    for (var bounce = 1u; bounce <= frame.depth; bounce++) {
        let m = v.s.material;
        let mixed = shares(m);
        // The last ray could only meet lights that sampling has already counted.
        if (bounce == frame.depth && !mixed && frame.globals.soft_lights == 0u) {
            return;
        }
        let u = rng_set(rng, BOUNCES + 2u * bounce);
        let wi = sample_sheet(m, v.wo, u.xyz);
        let pdf = density_of(m, v.wo, wi);
        if (pdf <= 1e-12) {
            return;
        }
        v.throughput *= evaluate(m, v.s, wi, v.wo) * (abs(wi.z) / pdf);
        let q = max3(v.throughput);
        if (q <= 0.0) {
            return;
        }
        if (bounce > 1u && q < 1.0) {
            if (u.w >= q) {
                return;
            }
            v.throughput *= 1.0 / q;
        }
        let d = world(v.s, wi);
        let ray = ray_new(leave(v.s, d), d);
        var tmin = 0.0;
        var hit: Hit;
        var s: Surface;
        // Straight on through gaps, each by a coin.
        loop {
            hit = nearest(ray, tmin, FAR);
            if (hit.place == EMPTY) {
                let row = frame.globals.sky_light;
                if (row != NONE) {
                    let met = light_density(v.at, row, d, 1e9);
                    var share = 0.0;
                    if (met <= 0.0) {
                        share = 1.0;
                    } else if (mixed) {
                        share = heuristic(pdf, met);
                    }
                    add_light(out, frame.globals.sky_layer, sky(d) * v.throughput * share);
                }
                return;
            }
            s = surface(hit);
            let gap = gap_of(s.material, s, d);
            if (gap <= 0.0) {
                break;
            }
            if (gap < 1.0 && rng_coin(rng) >= gap) {
                break;
            }
            tmin = hit.t * (1.0 + 2e-6) + frame.globals.offset;
        }
        let n = s.material;
        let emitted = emission(n, s, -d);
        if (max3(emitted) > 0.0) {
            var share = 1.0;
            if (s.light != NONE) {
                let met = light_density(v.at, s.light, d, hit.t);
                if (met > 0.0) {
                    share = 0.0;
                    if (mixed || soft(s.light)) {
                        share = heuristic(pdf, met);
                    }
                }
            }
            add_light(out, materials[n].layer, emitted * v.throughput * share);
        }
        if (bounce == frame.depth || materials[n].emission.w <= 0.0) {
            return;
        }
        let at = place_of(n, s, d);
        let wo = local(s, -d);
        let w = rng_set(rng, BOUNCES + 2u * bounce + 1u);
        // What is scattered here is the yarn's share; the coin above has already chosen the yarn.
        let gap = gap_of(n, s, d);
        v.throughput *= 1.0 / max(1.0 - gap, 1e-6);
        let lit = direct(n, s, at, wo, w, rng);
        add_light(out, lit.layer, lit.value * v.throughput);
        v = Vertex(s, at, wo, v.throughput);
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
