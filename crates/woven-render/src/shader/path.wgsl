// One sample of one pixel, as far as a pixel goes alone; the pair of cpu/camera.rs and cpu/path.rs.

const CROSSINGS: u32 = 64u;
const ROULETTE: f32 = 3.0;

struct Vertex {
    s: Surface,
    at: Place,
    wo: vec3<f32>,
    throughput: vec3<f32>,
    // The first sheet that the camera's ray meets.
    front: bool,
}

// Layer of what comes from direction wi (in the sheet's frame) and is scattered towards wo, with Globals.events.
fn event_of(front: bool, wi: vec3<f32>, wo: vec3<f32>) -> u32 {
    return select(PASSED, select(TRANSMITTED, REFLECTED, wi.z * wo.z > 0.0), front);
}

// The layer by event if these are asked for, else that of the light.
fn layer_of(event: u32, light: u32) -> u32 {
    return select(event, light, frame.globals.events == 0u);
}

struct Second {
    s: Surface,
    passed: f32,
    lit: Incident,
    wi: vec3<f32>,
    beyond: array<vec3<f32>, LAYERS>,
}

// Where a camera ray is scattered: its first sheet, and one of those behind for all of them.
const FIRSTS: u32 = 2u;

struct Begun {
    taken: Taken,
    firsts: array<Vertex, FIRSTS>,
    // Probability with which the path begins there; 0: there is no such point.
    shares: array<f32, FIRSTS>,
    chosen: u32,
    has_second: bool,
    second: Second,
}

// What one sample adds.
struct Taken {
    direct: array<vec3<f32>, LAYERS>,
    indirect: array<vec3<f32>, LAYERS>,
    albedo: vec3<f32>,
    normal: vec3<f32>,
    depth: f32,
    gap: f32,
}

fn add_light(out: ptr<function, Taken>, indirect: bool, layer: u32, value: vec3<f32>) {
    if (indirect) {
        (*out).indirect[min(layer, LAYERS - 1u)] += value;
    } else {
        (*out).direct[min(layer, LAYERS - 1u)] += value;
    }
}

fn towards_eye(s: Surface, d: vec3<f32>) -> vec3<f32> {
    return select(s.fz, -s.fz, dot(s.fz, d) > 0.0);
}

fn add_beyond(y: ptr<function, Second>, layer: u32, value: vec3<f32>) {
    (*y).beyond[min(layer, LAYERS - 1u)] += value;
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

struct Incident {
    wi: vec3<f32>,
    // Radiance times cosine over density.
    light: vec3<f32>,
    // Density of the sampling if scattering shares the light with it, else 0.
    pdf: f32,
    layer: u32,
    // What is scattered towards the own path.
    value: vec3<f32>,
}

fn incident(m: u32, s: Surface, at: Place, wo: vec3<f32>, u: vec4<f32>, rng: ptr<function, Rng>) -> Incident {
    var found: Incident;
    let l = light_sample(at, u.xyz);
    if (l.pdf <= 0.0) {
        return found;
    }
    let wi = local(s, l.wi);
    let b = scattering(m, s, wo, wi, false, vec3<f32>(0.0));
    let light = l.radiance * (abs(wi.z) / l.pdf);
    var value = b.f * light;
    var pdf = 0.0;
    if (l.meets && (l.sampled_by_all || shares(m))) {
        pdf = l.pdf;
        value *= heuristic(l.pdf, b.pdf);
    }
    if (max3(value) <= 0.0) {
        return found;
    }
    let ray = ray_new(leave(s, l.wi), l.wi);
    let passed = transmittance(ray, l.distance - (1e-4 + 1e-4 * l.distance), FAINT, false, rng);
    return Incident(l.wi, light * passed, pdf, l.layer, value * passed);
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

// Sum of the factors on the side of wo.
fn reflectance(m: u32, s: Surface, wo: vec3<f32>) -> vec3<f32> {
    let back = select(0u, 3u, wo.z < 0.0);
    let k = materials[m].linear[0].xyz + materials[m].linear[1].xyz + materials[m].linear[2u + back].xyz
        + materials[m].linear[3u + back].xyz + materials[m].linear[4u + back].xyz;
    return k * s.tint;
}

// A sample of pixel (x, y); `paths` are the random numbers of its path. One loop for camera and path: each heavy
// function is called at few places, because shader compilers copy functions to where they are called.
fn begin(x: u32, y: u32, paths: ptr<function, Rng>) -> Begun {
    var begun: Begun;
    var out: Taken;
    var second: Second;
    var rng = rng_new(x, y, frame.index, frame.seed);
    var ray = camera_ray(x, y, rng_set(&rng, 0u));
    var tmin = 0.0;
    // Straight from the eye: `carry` is the product of the gaps so far, `bounce` counts crossings.
    var camera = true;
    var carry = vec3<f32>(1.0);
    var bounce = 0u;
    // What the camera ray's crossings leave for the indirect part.
    var firsts: array<Vertex, FIRSTS>;
    var front = 0.0;
    var rest = 0.0;
    var kept_weight = 1.0;
    var pick = rng_coin(&rng);
    // The vertex that the path left last, and the density with which it did.
    var v: Vertex;
    var pdf = 0.0;
    // What the path carries from the second point on, whether other paths may have it, the gaps on the way.
    var tail = vec3<f32>(1.0);
    var lent = false;
    var passed = 1.0;
    var event = PASSED;
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
            s = surface(hit, select(0.0, hit.t * sqrt(length2(frame.up)) / f32(frame.height), camera));
            gap = gap_of(s.material, s, ray.d);
            // A path goes straight on through gaps, each by a coin.
            if (!camera && gap > 0.0) {
                var pass_on = gap >= 1.0;
                if (!pass_on) {
                    pass_on = rng_coin(paths) < gap;
                }
                if (pass_on) {
                    passed *= gap;
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
            if (camera) {
                event = select(PASSED, EMITTED, bounce == 0u && !miss);
            }
            if (lent) {
                add_beyond(&second, layer, given * tail * share);
            } else {
                add_light(&out, begun.has_second, layer_of(event, layer), given * carry * share);
            }
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
                out.albedo += reflectance(s.material, s, local(s, -ray.d)) * (carry.x * (1.0 - gap));
                lit_here = weight > 0.0 && frame.depth > 0u;
            }
            if (lit_here) {
                let at = place_of(s.material, s, ray.d);
                let wo = local(s, -ray.d);
                // The camera and the path draw from numbers of their own.
                var numbers = rng;
                if (!camera) {
                    numbers = *paths;
                }
                let u = rng_set(&numbers, select(2u * bounce + 1u, 1u + bounce, camera));
                let lit = incident(s.material, s, at, wo, u, &numbers);
                if (camera) {
                    rng = numbers;
                    event = event_of(bounce == 0u, local(s, lit.wi), wo);
                } else {
                    *paths = numbers;
                    // What is scattered here is the yarn's share; the coin above has already chosen the yarn.
                    let yarn = 1.0 / max(1.0 - gap, 1e-6);
                    carry *= yarn;
                    tail *= yarn;
                }
                if (!camera && bounce == 1u) {
                    begun.has_second = true;
                    second.s = s;
                    second.passed = passed;
                    second.lit = lit;
                    second.wi = ray.d;
                    lent = !shares(s.material);
                } else if (lent) {
                    add_beyond(&second, lit.layer, lit.value * tail);
                } else {
                    add_light(&out, begun.has_second, layer_of(event, lit.layer), lit.value * carry);
                }
                if (camera) {
                    let vertex = Vertex(s, at, wo, carry, bounce == 0u);
                    if (front <= 0.0) {
                        firsts[0] = vertex;
                        front = weight;
                    } else {
                        // Reservoir of one: each crossing is kept in proportion to its weight.
                        rest += weight;
                        let keep = weight / rest;
                        if (pick < keep) {
                            pick /= keep;
                            firsts[1] = vertex;
                            kept_weight = weight;
                        } else {
                            pick = (pick - keep) / (1.0 - keep);
                        }
                    }
                } else {
                    v = Vertex(s, at, wo, carry, false);
                    scatter = true;
                }
            }
        }
        if (camera) {
            var left = select(carry.x * gap, 0.0, miss);
            if (left > 0.0) {
                out.gap = left;
                if (left < FAINT) {
                    if (rng_coin(&rng) < 0.5) {
                        out.gap = 0.0;
                        left = 0.0;
                    }
                    left *= 2.0;
                }
                bounce += 1u;
                if (left > 0.0 && bounce < CROSSINGS) {
                    carry = vec3<f32>(left);
                    tmin = hit.t * (1.0 + 2e-6) + frame.globals.offset;
                    continue;
                }
            }
            // The camera ray has ended; the path begins at the crossing that was kept.
            camera = false;
            bounce = 0u;
            scatter = front > 0.0;
            firsts[1].throughput *= rest / kept_weight;
            let share = front / max(front + rest, 1e-30);
            v = firsts[0];
            carry = v.throughput / max(share, 1e-30);
            if (pick >= share && rest > 0.0) {
                begun.chosen = 1u;
                v = firsts[1];
                carry = v.throughput / (1.0 - share);
            }
            v.throughput = carry;
            begun.firsts = firsts;
            begun.shares[0] = share;
            begun.shares[1] = select(0.0, 1.0 - share, rest > 0.0);
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
        let u = rng_set(paths, 2u * bounce);
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
        var kept = 1.0;
        if (bounce > 1u && q < 1.0) {
            if (u.w >= q) {
                break;
            }
            kept = 1.0 / q;
            carry *= kept;
        }
        let d = world(v.s, b.wi);
        if (bounce == 1u) {
            event = event_of(v.front, b.wi, v.wo);
        }
        let away = abs(b.wi.z) / pdf * kept;
        if (bounce == 2u) {
            second.wi = d;
            tail = vec3<f32>(away);
        } else {
            tail *= b.f * away;
        }
        ray = ray_new(leave(v.s, d), d);
        tmin = 0.0;
    }
    begun.taken = out;
    begun.second = second;
    return begun;
}

fn add_discs(out: ptr<function, Taken>, d: vec3<f32>, passed: f32) {
    for (var i = frame.globals.others; i < frame.globals.lights; i++) {
        if (lights[i].kind == SUN && lights[i].u.y > 1e-4 && dot(d, lights[i].n) > lights[i].u.x) {
            add_light(out, false, layer_of(PASSED, lights[i].layer), lights[i].radiance * (1.0 / (PI * lights[i].u.y * lights[i].u.y)) * passed);
        }
    }
}
