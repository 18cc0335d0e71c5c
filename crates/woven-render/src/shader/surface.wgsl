// The sheet at a point: frame, textures, gap, scattering; the pair of cpu/surface.rs.

const TEXTURE_ROW: u32 = 12u;
// Words of the table of sRGB.
const SRGB: u32 = 256u;

struct Surface {
    p: vec3<f32>,
    ng: vec3<f32>,
    fx: vec3<f32>,
    fy: vec3<f32>,
    fz: vec3<f32>,
    uv: vec2<f32>,
    material: u32,
    light: u32,
    tint: vec3<f32>,
    alpha: f32,
    // Texture of the gloss: multiplies the widths of the reflection lobe; metalness.
    gloss: vec2<f32>,
}

fn local(s: Surface, w: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(dot(w, s.fx), dot(w, s.fy), dot(w, s.fz));
}

fn world(s: Surface, w: vec3<f32>) -> vec3<f32> {
    return s.fx * w.x + s.fy * w.y + s.fz * w.z;
}

fn leave(s: Surface, d: vec3<f32>) -> vec3<f32> {
    return s.p + s.ng * select(frame.globals.offset, -frame.globals.offset, dot(s.ng, d) < 0.0);
}

fn any_tangent(z: vec3<f32>) -> vec3<f32> {
    let a = select(vec3<f32>(0.0, 1.0, 0.0), vec3<f32>(1.0, 0.0, 0.0), abs(z.x) < 0.7);
    return unit(cross(a, z));
}

fn shading_frame(place: u32, u: f32, v: f32, ng: vec3<f32>) -> mat3x3<f32> {
    let sum = shades[place].n0.xyz * (1.0 - u - v) + shades[place].n1.xyz * u + shades[place].n2.xyz * v;
    var size = sqrt(length2(sum));
    var z = ng;
    if (size > 1e-6) {
        z = sum * (1.0 / size);
    }
    let weft = shades[place].weft.xyz;
    let along = weft - z * dot(weft, z);
    size = sqrt(length2(along));
    var x: vec3<f32>;
    if (size > 1e-4) {
        x = along * (1.0 / size);
    } else {
        x = any_tangent(z);
    }
    return mat3x3<f32>(x, cross(z, x), z);
}

fn uv_at(place: u32, u: f32, v: f32) -> vec2<f32> {
    let w = 1.0 - u - v;
    let s = shades[place].v;
    return vec2<f32>(
        w * shades[place].n0.w + u * shades[place].n1.w + v * shades[place].n2.w,
        w * s.x + u * s.y + v * s.z,
    );
}

fn corner(place: u32) -> vec3<f32> {
    let p = place / 4u;
    let lane = place % 4u;
    return vec3<f32>(packets[p].v0[0][lane], packets[p].v0[1][lane], packets[p].v0[2][lane]);
}

fn first_edge(place: u32) -> vec3<f32> {
    let p = place / 4u;
    let lane = place % 4u;
    return vec3<f32>(packets[p].e1[0][lane], packets[p].e1[1][lane], packets[p].e1[2][lane]);
}

fn second_edge(place: u32) -> vec3<f32> {
    let p = place / 4u;
    let lane = place % 4u;
    return vec3<f32>(packets[p].e2[0][lane], packets[p].e2[1][lane], packets[p].e2[2][lane]);
}

// The frame turned to the normal that the texture's colour means.
fn bent(f: mat3x3<f32>, hand: f32, scale: f32, c: vec4<f32>) -> mat3x3<f32> {
    let across = (c.x * 2.0 - 1.0) * scale;
    let up = (c.y * 2.0 - 1.0) * scale * hand;
    let out = max(c.z * 2.0 - 1.0, 0.05);
    let n = unit(f[0] * across + f[1] * up + f[2] * out);
    let along = f[0] - n * dot(f[0], n);
    let size = sqrt(length2(along));
    var x: vec3<f32>;
    if (size > 1e-4) {
        x = along * (1.0 / size);
    } else {
        x = any_tangent(n);
    }
    return mat3x3<f32>(x, cross(n, x), n);
}

fn surface(hit: Hit, wide: f32) -> Surface {
    let place = hit.place;
    let e1 = first_edge(place);
    let e2 = second_edge(place);
    let ng = unit(cross(e1, e2));
    let material = shades[place].material;
    var tint = vec3<f32>(1.0);
    var alpha = 1.0;
    var gloss = vec2<f32>(1.0, 0.0);
    var uv = vec2<f32>(0.0);
    var f = shading_frame(place, hit.u, hit.v, ng);
    if (TEXTURED && (materials[material].color_texture != NONE || materials[material].coverage_texture != NONE
        || materials[material].emission_texture != NONE || materials[material].normal_texture != NONE
        || materials[material].gloss_texture != NONE)) {
        uv = uv_at(place, hit.u, hit.v);
        let area = wide * wide * shades[place].v.w;
        if (materials[material].color_texture != NONE) {
            tint = texel(materials[material].color_texture, uv, area).xyz;
        }
        if (materials[material].normal_texture != NONE) {
            let c = texel(materials[material].normal_texture, uv, area);
            f = bent(f, shades[place].weft.w, materials[material].normal_scale, c);
        }
        if (materials[material].gloss_texture != NONE) {
            let c = texel(materials[material].gloss_texture, uv, area);
            gloss = vec2<f32>(c.y * c.y, c.z * materials[material].metal.w);
        }
        alpha = coverage(material, uv, area);
    }
    if (TEXTURED && shades[place].colors.w > 1u) {
        alpha = opened(material, shades[place].colors.w, hit.u, hit.v, alpha);
    }
    if (TEXTURED && (shades[place].colors.w & 1u) != 0u) {
        let w = vec3<f32>(1.0 - hit.u - hit.v, hit.u, hit.v);
        var sum = vec3<f32>(0.0);
        for (var k = 0u; k < 3u; k++) {
            sum += decode(shades[place].colors[k], true).xyz * w[k];
        }
        tint *= sum;
    }
    let p = corner(place) + e1 * hit.u + e2 * hit.v;
    return Surface(p, ng, f[0], f[1], f[2], uv, material, shades[place].light, tint, alpha, gloss);
}

fn open_along(m: u32, w: vec3<f32>) -> f32 {
    if (MEASURES && (materials[m].flags & MEASURED) != 0u) {
        return measured_gap(materials[m].measured, w);
    }
    let shape = materials[m].shape[0];
    return openness(shape.x, shape.y, shape.z, w);
}

fn covered(m: u32, alpha: f32, open: f32) -> f32 {
    let gap = select(1.0 - alpha * (1.0 - open), alpha * open, (materials[m].flags & MULTIPLIES) != 0u);
    return clamp(gap, 0.0, 1.0);
}

// Coverage where stretch and shear have opened the weave.
fn opened(m: u32, bits: u32, u: f32, v: f32, alpha: f32) -> f32 {
    let roots = vec3<f32>((vec3<u32>(bits) >> vec3<u32>(2u, 12u, 22u)) & vec3<u32>(1023u)) * (1.0 / 512.0);
    let c = roots * roots;
    let factor = c.x * (1.0 - u - v) + c.y * u + c.z * v;
    if ((materials[m].flags & MULTIPLIES) != 0u) {
        return min(alpha * factor, 1.0);
    }
    let cover = materials[m].cover;
    return alpha * max(1.0 - (factor - 1.0) * (1.0 - cover) / max(cover, 1e-6), 0.0);
}

fn gap_of(m: u32, s: Surface, d: vec3<f32>) -> f32 {
    if (!(TEXTURED || MEASURES || LOBES) || materials[m].gap >= 0.0) {
        return materials[m].gap;
    }
    return covered(m, s.alpha, open_along(m, local(s, d)));
}

fn gap_at(place: u32, u: f32, v: f32, d: vec3<f32>) -> f32 {
    let m = shades[place].material;
    var alpha = 1.0;
    if (TEXTURED && materials[m].coverage_texture != NONE) {
        alpha = coverage(m, uv_at(place, u, v), 0.0);
        if (alpha <= 0.0) {
            return covered(m, 0.0, 1.0);
        }
    }
    if (TEXTURED && shades[place].colors.w > 1u) {
        alpha = opened(m, shades[place].colors.w, u, v, alpha);
    }
    var w = vec3<f32>(0.0, 0.0, 1.0);
    if ((materials[m].flags & EVEN) == 0u) {
        let ng = unit(cross(first_edge(place), second_edge(place)));
        let f = shading_frame(place, u, v, ng);
        w = vec3<f32>(dot(d, f[0]), dot(d, f[1]), dot(d, f[2]));
    }
    return covered(m, alpha, open_along(m, w));
}

fn coverage(m: u32, uv: vec2<f32>, area: f32) -> f32 {
    if (materials[m].coverage_texture == NONE) {
        return 1.0;
    }
    let alpha = texel(materials[m].coverage_texture, uv, area).w;
    if (materials[m].alpha_cutoff < 0.0) {
        return alpha;
    }
    return select(1.0, 0.0, alpha < materials[m].alpha_cutoff);
}

fn wrapped(i: i32, n: i32, mode: u32) -> i32 {
    if (mode == 0u) {
        return ((i % n) + n) % n;
    }
    if (mode == 1u) {
        let m = ((i % (2 * n)) + 2 * n) % (2 * n);
        return select(2 * n - 1 - m, m, m < n);
    }
    return clamp(i, 0, n - 1);
}

// The first words of the buffer: sRGB decoded, for 0..255.
fn decode(word: u32, srgb: bool) -> vec4<f32> {
    let k = vec4<u32>(word & 255u, (word >> 8u) & 255u, (word >> 16u) & 255u, word >> 24u);
    var c = vec4<f32>(k) * (1.0 / 255.0);
    if (srgb) {
        c = vec4<f32>(bitcast<f32>(texels[k.x]), bitcast<f32>(texels[k.y]), bitcast<f32>(texels[k.z]), c.w);
    }
    return c;
}

// Averaged over the area of (u, v): trilinear between the copies whose texels are just smaller and just larger.
fn texel(number: u32, uv: vec2<f32>, area: f32) -> vec4<f32> {
    let row = SRGB + number * TEXTURE_ROW;
    let a = vec4<f32>(
        bitcast<f32>(texels[row]), bitcast<f32>(texels[row + 1u]), bitcast<f32>(texels[row + 2u]), bitcast<f32>(texels[row + 3u]),
    );
    let b = vec4<f32>(
        bitcast<f32>(texels[row + 4u]), bitcast<f32>(texels[row + 5u]), bitcast<f32>(texels[row + 6u]), bitcast<f32>(texels[row + 7u]),
    );
    var first = texels[row + 8u];
    var width = i32(texels[row + 9u]);
    var height = i32(texels[row + 10u]);
    let flags = texels[row + 11u];
    let level = min(0.5 * log2(max(area * a.w, 1.0)), b.w);
    let below = floor(level);
    for (var k = 0u; k < u32(below); k++) {
        first += u32(width * height);
        width = max(width / 2, 1);
        height = max(height / 2, 1);
    }
    let s = a.x * uv.x + a.y * uv.y + a.z;
    let t = b.x * uv.x + b.y * uv.y + b.z;
    var low = vec4<f32>(0.0);
    for (var k = 0u; k < 2u; k++) {
        let x = s * f32(width) - 0.5;
        let y = t * f32(height) - 0.5;
        let x0 = floor(x);
        let y0 = floor(y);
        var rows: array<vec4<f32>, 2>;
        // A bound that the compiler does not know keeps the four taps one piece of code.
        for (var tap = 0u; tap < frame.globals.taps; tap++) {
            let i = wrapped(i32(x0) + i32(tap & 1u), width, flags & 3u);
            let j = wrapped(i32(y0) + i32(tap >> 1u), height, (flags >> 2u) & 3u);
            let c = decode(texels[first + u32(j * width + i)], (flags & 16u) != 0u);
            if ((tap & 1u) == 0u) {
                rows[tap >> 1u] = c;
            } else {
                rows[tap >> 1u] += (c - rows[tap >> 1u]) * (x - x0);
            }
        }
        let c = rows[0] + (rows[1] - rows[0]) * (y - y0);
        if (k == 1u) {
            return low + (c - low) * (level - below);
        }
        if (level <= below) {
            return c;
        }
        low = c;
        first += u32(width * height);
        width = max(width / 2, 1);
        height = max(height / 2, 1);
    }
    return low;
}

fn emission(m: u32, s: Surface, wo: vec3<f32>) -> vec3<f32> {
    let flags = materials[m].flags;
    if ((flags & EMITS) == 0u || ((flags & DOUBLE_SIDED) == 0u && dot(s.ng, wo) <= 0.0)) {
        return vec3<f32>(0.0);
    }
    let e = materials[m].emission.xyz;
    if (!TEXTURED || materials[m].emission_texture == NONE) {
        return e;
    }
    return e * texel(materials[m].emission_texture, s.uv, 0.0).xyz;
}

fn emission_at(place: u32, u: f32, v: f32) -> vec3<f32> {
    let m = shades[place].material;
    let e = materials[m].emission.xyz;
    if (!TEXTURED || materials[m].emission_texture == NONE) {
        return e;
    }
    return e * texel(materials[m].emission_texture, uv_at(place, u, v), 0.0).xyz;
}

// Narrowest reflection lobe of a texture.
const LEAST_WIDTH: f32 = 0.02;

// A direction, f for it, its density.
struct Scattered {
    wi: vec3<f32>,
    f: vec3<f32>,
    pdf: f32,
}

// Value and density of wi, or of a direction drawn by u if `draw`: one function, so that the material's numbers are
// read once.
fn scattering(m: u32, s: Surface, wo: vec3<f32>, known: vec3<f32>, draw: bool, u: vec3<f32>) -> Scattered {
    let flags = materials[m].flags;
    let w0 = materials[m].weights[0];
    let scale = s.tint * s.alpha;
    // Reflection has factors of its own for a viewer behind.
    let back = select(0u, 3u, wo.z < 0.0);
    var wi = known;
    if ((flags & MATT) != 0u && draw) {
        let r = sqrt(u.x);
        let sc = sincos_turn(u.y);
        let z = sqrt(max(1.0 - u.x, 0.0));
        let through = u.z < w0.x;
        wi = vec3<f32>(r * sc.y, r * sc.x, select(z, -z, (wo.z > 0.0) == through));
    }
    var pdf = select(w0.z, w0.x, wi.z * wo.z < 0.0) * abs(wi.z) * FRAC_1_PI;
    if (!(MEASURES || LOBES) || (flags & (MATT | EVEN)) == (MATT | EVEN)) {
        let k = materials[m].linear[select(2u + back, 0u, wi.z * wo.z < 0.0)].xyz;
        return Scattered(wi, k * scale * (materials[m].cover * FRAC_1_PI), pdf);
    }
    if (MEASURES && (flags & MEASURED) != 0u) {
        let first = materials[m].measured;
        if (draw) {
            wi = measured_sample(first, wo, u);
        }
        let value = measured_value(first, wi, wo);
        return Scattered(wi, scale * value, value * abs(wi.z) / max(measured_albedo(first, wo), 1e-20));
    }
    let a = materials[m].shape[0];
    let b = materials[m].shape[1];
    let c = materials[m].shape[2];
    let d = materials[m].shape[3];
    let w1 = materials[m].weights[1];
    var shape = array<f32, 16>(a.x, a.y, a.z, a.w, b.x, b.y, b.z, b.w, c.x, c.y, c.z, c.w, d.x, d.y, d.z, d.w);
    var weights = array<f32, 8>(w0.x, w0.y, w0.z, w0.w, w1.x, w1.y, w1.z, w1.w);
    // Of gloss and of the rest; a texture mixes metal in, by Schlick's reflectance at normal incidence.
    let plain = (flags & PLAIN_GLOSS) != 0u;
    var rest = s.tint;
    var gloss = materials[m].linear[3u + back].xyz * select(s.tint, vec3<f32>(1.0), plain);
    if (TEXTURED && materials[m].gloss_texture != NONE) {
        let metal = s.gloss.y;
        let f0 = shape[7];
        shape[5] = max(shape[5] * s.gloss.x, LEAST_WIDTH);
        shape[6] = max(shape[6] * s.gloss.x, LEAST_WIDTH);
        shape[7] = f0 + (1.0 - f0) * metal;
        for (var k = 0u; k < 8u; k++) {
            weights[k] *= 1.0 - metal;
        }
        weights[3] += metal;
        rest *= 1.0 - metal;
        gloss = (materials[m].linear[3u + back].xyz * (f0 * (1.0 - metal)) + materials[m].metal.xyz * s.tint * metal)
            * (1.0 / max(shape[7], 1e-6));
    }
    if ((flags & MATT) == 0u) {
        if (draw) {
            wi = sheet_sample(shape, weights, wo, u);
        }
        pdf = sheet_pdf(shape, weights, wo, wi);
    }
    var f = vec3<f32>(0.0);
    var part = s.alpha;
    // The woven share, then the closed one where a map tells them apart: one copy of the code.
    let parts = select(1u, 2u, TEXTURED && (flags & MULTIPLIES) != 0u);
    for (var k = 0u; k < parts; k++) {
        let basis = sheet_basis(shape, wi, wo);
        f += (materials[m].linear[0].xyz * basis[0] + materials[m].linear[1].xyz * basis[1]
            + materials[m].linear[2u + back].xyz * basis[2] + materials[m].linear[4u + back].xyz * basis[4]) * (rest * part)
            + gloss * basis[3] * part;
        shape[0] = 1.0;
        shape[8] = 1.0;
        part = 1.0 - s.alpha;
    }
    return Scattered(wi, f, pdf);
}
