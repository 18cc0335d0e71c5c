// Choosing a light and a direction to it, and the density of that; the pair of cpu/light.rs.

struct Place {
    p: vec3<f32>,
    n: vec3<f32>,
    transmits: bool,
    inside: bool,
    total: f32,
}

struct LightSample {
    wi: vec3<f32>,
    distance: f32,
    radiance: vec3<f32>,
    // 0: nothing was found.
    pdf: f32,
    layer: u32,
    meets: bool,
    sampled_by_all: bool,
}

fn light_place(p: vec3<f32>, n: vec3<f32>, transmits: bool) -> Place {
    let first = frame.globals.lights;
    var inside = frame.globals.portals > 0u;
    for (var i = 0u; i < frame.globals.portals; i++) {
        inside = inside && dot(p - lights[first + i].p, lights[first + i].n) > 0.0;
    }
    var place = Place(p, n, transmits, inside, 0.0);
    let count = light_candidates();
    for (var k = 0u; k < count; k++) {
        place.total += light_weight(place, light_candidate(k));
    }
    return place;
}

// Rows that are weighed at every point: all lights, or the root of the tree and the lights without a place.
fn light_candidates() -> u32 {
    if (!CLUSTERS || frame.globals.tree == NONE) {
        return frame.globals.lights;
    }
    return 1u + frame.globals.lights - frame.globals.others;
}

fn light_candidate(k: u32) -> u32 {
    if (!CLUSTERS || frame.globals.tree == NONE) {
        return k;
    }
    return select(frame.globals.others + k - 1u, frame.globals.tree, k == 0u);
}

// The part of a rectangular light that can be seen at all: in a room with windows, of a light outside, what shows
// through them.
fn light_part(at: Place, i: u32) -> Part {
    if (!at.inside || lights[i].kind != RECT || lights[i].area < 0.0) {
        return whole();
    }
    let first = frame.globals.lights;
    var low = vec2<f32>(2.0);
    var high = vec2<f32>(-1.0);
    for (var k = 0u; k < frame.globals.portals; k++) {
        if (behind(i, first + k)) {
            let part = part_through(i, first + k, at.p);
            low = min(low, part.low);
            high = max(high, part.high);
        }
    }
    if (low.x > 1.0) {
        return whole();
    }
    return Part(low, high);
}

// Of a window through which light i, the sky, is sampled: all.
fn row_part(at: Place, i: u32, row: u32) -> Part {
    if (row != i) {
        return whole();
    }
    return light_part(at, i);
}

fn light_weight(at: Place, i: u32) -> f32 {
    let lum = luminance(lights[i].radiance);
    let n = lights[i].n;
    let kind = lights[i].kind;
    if (kind == RECT || kind == TRIANGLE) {
        let half = select(1.0 / 3.0, 0.5, kind == RECT);
        let part = light_part(at, i);
        let to = lights[i].p + part_point(part, i, half, half) - at.p;
        let two = (materials[shades[lights[i].place].material].flags & DOUBLE_SIDED) != 0u;
        if (!two && dot(at.p - lights[i].p, n) <= 0.0) {
            return 0.0;
        }
        // All of it behind a surface that lets nothing through.
        let u = max(dot(at.n, lights[i].u), 0.0);
        let v = max(dot(at.n, lights[i].v), 0.0);
        let rise = select(max(u, v), u + v, kind == RECT);
        if (!at.transmits && dot(at.n, lights[i].p - at.p) + rise <= 0.0) {
            return 0.0;
        }
        let d2 = max(length2(to), 1e-12);
        let c = abs(dot(to, n)) / sqrt(d2);
        let area = abs(lights[i].area) * part_size(part);
        return lum * area * (0.1 + 0.9 * c) / (d2 + 0.5 * area);
    }
    if (kind == SUN) {
        let c = dot(n, at.n);
        let reach = c + lights[i].u.y;
        if (!at.transmits && reach <= 0.0) {
            return 0.0;
        }
        if (at.inside && !leads_out(at.p, n, lights[i].u.y)) {
            return 0.0;
        }
        return lum * max(abs(c), 0.05);
    }
    if (SKIES && kind == SKY) {
        var angle = PI;
        if (at.inside) {
            angle = windows(at.p);
        }
        return frame.globals.sky_scale.w * angle;
    }
    if (CLUSTERS && kind == CLUSTER) {
        return cluster_weight(at, i);
    }
    let to = lights[i].p - at.p;
    let d2 = max(length2(to), 1e-6);
    let hidden = !at.transmits && dot(to, at.n) <= 0.0;
    // Outside of its cone.
    let dark = kind == SPOT && -dot(to, n) <= lights[i].v.y * sqrt(d2);
    return select(lum / d2, 0.0, hidden || dark);
}

fn leads_out(p: vec3<f32>, d: vec3<f32>, spread: f32) -> bool {
    let first = frame.globals.lights;
    for (var i = 0u; i < frame.globals.portals; i++) {
        let r = first + i;
        let along = dot(d, lights[r].n);
        if (along > -1e-4) {
            continue;
        }
        let t = dot(lights[r].p - p, lights[r].n) / along;
        let q = p + d * t - lights[r].p;
        let lu = sqrt(length2(lights[r].u));
        let lv = sqrt(length2(lights[r].v));
        let slack = 1e-3 + 2.0 * spread * t / abs(along);
        let a = dot(q, lights[r].u) / lu;
        let b = dot(q, lights[r].v) / lv;
        let skew = select(0.0, lu + lv, lights[r].area < 0.0);
        if (a > -slack - skew && b > -slack - skew && a < lu + slack + skew && b < lv + slack + skew) {
            return true;
        }
    }
    return false;
}

fn window(r: u32, p: vec3<f32>) -> f32 {
    let to = lights[r].p + (lights[r].u + lights[r].v) * 0.5 - p;
    let d2 = max(length2(to), 1e-12);
    let area = abs(lights[r].area);
    return area * (0.05 + 0.95 * abs(dot(to, lights[r].n)) / sqrt(d2)) / (d2 + 0.25 * area);
}

fn windows(p: vec3<f32>) -> f32 {
    let first = frame.globals.lights;
    var sum = 0.0;
    for (var i = 0u; i < frame.globals.portals; i++) {
        sum += window(first + i, p);
    }
    return sum;
}

fn no_light() -> LightSample {
    return LightSample(vec3<f32>(0.0, 0.0, 1.0), 1.0, vec3<f32>(0.0), 0.0, 0u, false, false);
}

fn light_sample(at: Place, u: vec3<f32>) -> LightSample {
    if (frame.globals.lights == 0u || at.total <= 0.0) {
        return no_light();
    }
    var chosen = NONE;
    var share = 0.0;
    var rest = u.x * at.total;
    let count = light_candidates();
    for (var k = 0u; k < count; k++) {
        let i = light_candidate(k);
        let w = light_weight(at, i);
        if (w > 0.0) {
            chosen = i;
            share = w / at.total;
            if (rest < w) {
                rest /= w;
                break;
            }
        }
        rest -= w;
    }
    if (chosen == NONE) {
        return no_light();
    }
    // Down the tree; what is left of the number chooses on.
    while (CLUSTERS && chosen >= frame.globals.lights) {
        let halves = vec2<u32>(lights[chosen].place, lights[chosen].layer);
        var w = vec2<f32>(0.0);
        for (var k = 0u; k < 2u; k++) {
            w[k] = light_weight(at, halves[k]);
        }
        let both = w.x + w.y;
        if (both <= 0.0) {
            return no_light();
        }
        let part = w.x / both;
        rest = clamp(rest, 0.0, 0.99999994);
        if (rest < part) {
            chosen = halves.x;
            share *= part;
            rest /= part;
        } else {
            chosen = halves.y;
            share *= w.y / both;
            rest = (rest - part) / (1.0 - part);
        }
    }
    if (share <= 0.0) {
        return no_light();
    }
    return light_towards(at, chosen, share, u.y, u.z);
}

fn soft(i: u32) -> bool {
    return lights[i].kind == TRIANGLE || (lights[i].kind == RECT && lights[i].area < 0.0);
}

// Probability with which light_sample chooses light i: up the tree, each half and its other.
fn light_share(at: Place, i: u32) -> f32 {
    var me = i;
    var other = i;
    var mine = 0.0;
    var share = 1.0;
    loop {
        let w = light_weight(at, other);
        if (other == me) {
            mine = w;
            if (mine <= 0.0) {
                return 0.0;
            }
            let parent = lights[me].parent;
            if (!CLUSTERS || parent == NONE) {
                break;
            }
            other = select(lights[parent].place, lights[parent].layer, lights[parent].place == me);
        } else {
            share *= mine / (mine + w);
            me = lights[me].parent;
            other = me;
        }
    }
    return share * mine / at.total;
}

fn light_towards(at: Place, i: u32, share: f32, u1: f32, v1: f32) -> LightSample {
    let n = lights[i].n;
    let layer = lights[i].layer;
    let kind = lights[i].kind;
    if (kind == RECT || kind == TRIANGLE || (SKIES && kind == SKY)) {
        let triangle = kind == TRIANGLE;
        var a = u1;
        var b = v1;
        if (triangle && a + b > 1.0) {
            a = 1.0 - a;
            b = 1.0 - b;
        }
        // The sky is sampled through a window's rectangle, or by its picture.
        var row = i;
        if (SKIES && kind == SKY) {
            let w = choose_window(at, u1);
            row = w.row;
            a = w.u;
        }
        var t: Towards;
        if (SKIES && row == NONE) {
            t = Towards(picture_sample(a, b), 1e9, 1.0);
        } else {
            t = rect_sample(row, row_part(at, i, row), at.p, a, b, triangle);
        }
        var radiance = lights[i].radiance;
        if (SKIES && kind == SKY) {
            t.distance = 1e9;
            radiance = sky(t.d);
        } else {
            let two = (materials[shades[lights[i].place].material].flags & DOUBLE_SIDED) != 0u;
            if (!two && dot(t.d, n) >= 0.0) {
                return no_light();
            }
            if (triangle) {
                radiance = emission_at(lights[i].place, a, b);
            }
        }
        let pdf = share * direction_density(at, i, t.d, t.distance);
        return LightSample(t.d, t.distance, radiance, pdf, layer, true, soft(i));
    }
    if (kind == SUN) {
        let sc = sincos(TAU * v1);
        let radius = lights[i].u.y * sqrt(u1);
        let x = any_tangent(n);
        let y = cross(n, x);
        let wi = unit(n + (x * sc.y + y * sc.x) * radius);
        return LightSample(wi, 1e9, lights[i].radiance, share, layer, false, false);
    }
    let to = lights[i].p - at.p;
    let distance = max(sqrt(length2(to)), 1e-6);
    let wi = to * (1.0 / distance);
    var radiance = lights[i].radiance * (1.0 / (distance * distance));
    if (kind == SPOT) {
        let t = clamp((-dot(wi, n) - lights[i].v.y) / (lights[i].v.x - lights[i].v.y), 0.0, 1.0);
        radiance *= t * t * (3.0 - 2.0 * t);
    }
    return LightSample(wi, distance, radiance, share, layer, false, false);
}

fn light_density(at: Place, i: u32, wi: vec3<f32>, distance: f32) -> f32 {
    if (at.total <= 0.0) {
        return 0.0;
    }
    let share = light_share(at, i);
    if (share <= 0.0) {
        return 0.0;
    }
    return share * direction_density(at, i, wi, distance);
}

// Density per solid angle with which light i is sampled in direction wi: through its own rectangle or triangle, or for
// the sky through the windows and by the picture.
fn direction_density(at: Place, i: u32, wi: vec3<f32>, distance: f32) -> f32 {
    let kind = lights[i].kind;
    if (kind != RECT && kind != TRIANGLE && kind != SKY) {
        return 0.0;
    }
    var first = i;
    var count = 1u;
    var all = 1.0;
    var picture = 0.0;
    if (SKIES && kind == SKY) {
        first = frame.globals.lights;
        count = select(0u, frame.globals.portals, at.inside);
        picture = 1.0;
        if (at.inside) {
            picture = 1.0 - frame.globals.portal_share;
            all = windows(at.p);
        }
    }
    var pdf = 0.0;
    for (var k = 0u; k < count; k++) {
        let row = first + k;
        var t = distance;
        var part = 1.0;
        if (SKIES && kind == SKY) {
            t = crossing(row, at.p, wi);
            part = frame.globals.portal_share * window(row, at.p) / all;
        }
        if (t > 0.0) {
            pdf += part * rect_density(row, row_part(at, i, row), at.p, wi, t, kind == TRIANGLE);
        }
    }
    if (SKIES && picture > 0.0) {
        pdf += picture * picture_density(wi);
    }
    return pdf;
}

fn sky_uv(d: vec3<f32>) -> vec2<f32> {
    let c = frame.globals.sky_turn.x;
    let s = frame.globals.sky_turn.y;
    let x = d.x * c - d.z * s;
    let z = d.x * s + d.z * c;
    return vec2<f32>(0.5 + arc2(x, -z) * (1.0 / TAU), arc_cos(d.y) * (1.0 / PI));
}

fn sky_pixel(x: i32, y: i32) -> vec3<f32> {
    let w = i32(frame.globals.sky_width);
    let h = i32(frame.globals.sky_height);
    return skies[u32(clamp(y, 0, h - 1) * w + (x + w) % w)].xyz;
}

fn sky(d: vec3<f32>) -> vec3<f32> {
    if (!SKIES || frame.globals.sky_width == 0u) {
        return vec3<f32>(0.0);
    }
    let uv = sky_uv(d);
    let x = uv.x * f32(frame.globals.sky_width) - 0.5;
    let y = uv.y * f32(frame.globals.sky_height) - 0.5;
    let x0 = floor(x);
    let y0 = floor(y);
    let i = i32(x0);
    let j = i32(y0);
    let c00 = sky_pixel(i, j);
    let c01 = sky_pixel(i, j + 1);
    let top = c00 + (sky_pixel(i + 1, j) - c00) * (x - x0);
    let low = c01 + (sky_pixel(i + 1, j + 1) - c01) * (x - x0);
    return (top + (low - top) * (y - y0)) * frame.globals.sky_scale.xyz;
}

// A row of windows and the number that is left, or no window: the picture is to be sampled.
struct Window {
    row: u32,
    u: f32,
}

fn choose_window(at: Place, u1: f32) -> Window {
    let first = frame.globals.lights;
    let portal_share = frame.globals.portal_share;
    if (at.inside && u1 < portal_share) {
        let u = min(u1 / portal_share, 0.99999994);
        var rest = u * windows(at.p);
        var chosen = first;
        var w = 1.0;
        for (var i = 0u; i < frame.globals.portals; i++) {
            chosen = first + i;
            w = window(chosen, at.p);
            if (rest < w || i + 1u == frame.globals.portals) {
                break;
            }
            rest -= w;
        }
        return Window(chosen, clamp(rest / w, 0.0, 1.0));
    }
    if (at.inside) {
        return Window(NONE, min((u1 - portal_share) / max(1.0 - portal_share, 1e-6), 0.99999994));
    }
    return Window(NONE, u1);
}

// First entry of `count` from `first` whose distribution, number `k` of it, exceeds u.
fn find(first: u32, count: u32, k: u32, u: f32) -> u32 {
    var lo = 0u;
    var hi = count - 1u;
    while (lo < hi) {
        let middle = (lo + hi) / 2u;
        if (skies[first + middle][k] > u) {
            hi = middle;
        } else {
            lo = middle + 1u;
        }
    }
    return lo;
}

fn row_before(y: u32) -> f32 {
    if (y == 0u) {
        return 0.0;
    }
    return skies[frame.globals.sky_width * frame.globals.sky_height + y - 1u].x;
}

fn column_before(x: u32, y: u32) -> f32 {
    if (x == 0u) {
        return 0.0;
    }
    return skies[y * frame.globals.sky_width + x - 1u].w;
}

fn picture_sample(u: f32, v: f32) -> vec3<f32> {
    let w = frame.globals.sky_width;
    let h = frame.globals.sky_height;
    let y = find(w * h, h, 0u, v);
    let x = find(y * w, w, 3u, u);
    let by = row_before(y);
    let fy = clamp((v - by) / (skies[w * h + y].x - by), 0.0, 1.0);
    let bx = column_before(x, y);
    let fx = clamp((u - bx) / (skies[y * w + x].w - bx), 0.0, 1.0);
    let theta = sincos(PI * (f32(y) + fy) / f32(h));
    let phi = sincos(TAU * ((f32(x) + fx) / f32(w) - 0.5));
    let lx = theta.x * phi.x;
    let lz = -theta.x * phi.y;
    let c = frame.globals.sky_turn.x;
    let s = frame.globals.sky_turn.y;
    return unit(vec3<f32>(lx * c + lz * s, theta.y, lz * c - lx * s));
}

fn picture_density(d: vec3<f32>) -> f32 {
    let w = frame.globals.sky_width;
    let h = frame.globals.sky_height;
    let uv = sky_uv(d);
    let x = min(u32(max(uv.x * f32(w), 0.0)), w - 1u);
    let y = min(u32(max(uv.y * f32(h), 0.0)), h - 1u);
    let row = skies[w * h + y].x - row_before(y);
    let column = skies[y * w + x].w - column_before(x, y);
    let sin_theta = sqrt(max(1.0 - d.y * d.y, 1e-8));
    return row * column * f32(w * h) / (2.0 * PI * PI * sin_theta);
}
