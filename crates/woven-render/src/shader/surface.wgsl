// The sheet at a point: frame, textures, gap, scattering; the pair of cpu/surface.rs.

const TEXTURE_ROW: u32 = 12u;

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

fn surface(hit: Hit) -> Surface {
    let place = hit.place;
    let e1 = first_edge(place);
    let e2 = second_edge(place);
    let ng = unit(cross(e1, e2));
    let material = shades[place].material;
    var tint = vec3<f32>(1.0);
    var alpha = 1.0;
    var uv = vec2<f32>(0.0);
    if (materials[material].color_texture != NONE || materials[material].coverage_texture != NONE
        || materials[material].emission_texture != NONE) {
        uv = uv_at(place, hit.u, hit.v);
        if (materials[material].color_texture != NONE) {
            tint = texel(materials[material].color_texture, uv).xyz;
        }
        alpha = coverage(material, uv);
    }
    let f = shading_frame(place, hit.u, hit.v, ng);
    let p = corner(place) + e1 * hit.u + e2 * hit.v;
    return Surface(p, ng, f[0], f[1], f[2], uv, material, shades[place].light, tint, alpha);
}

fn gap_of(m: u32, s: Surface, d: vec3<f32>) -> f32 {
    if (materials[m].gap >= 0.0) {
        return materials[m].gap;
    }
    let open = openness(materials[m].shape[0], materials[m].shape[1], materials[m].shape[2], local(s, d));
    return clamp(1.0 - s.alpha * (1.0 - open), 0.0, 1.0);
}

fn gap_at(place: u32, u: f32, v: f32, d: vec3<f32>) -> f32 {
    let m = shades[place].material;
    var alpha = 1.0;
    if (materials[m].coverage_texture != NONE) {
        alpha = coverage(m, uv_at(place, u, v));
        if (alpha <= 0.0) {
            return 1.0;
        }
    }
    var w = vec3<f32>(0.0, 0.0, 1.0);
    if ((materials[m].flags & EVEN) == 0u) {
        let ng = unit(cross(first_edge(place), second_edge(place)));
        let f = shading_frame(place, u, v, ng);
        w = vec3<f32>(dot(d, f[0]), dot(d, f[1]), dot(d, f[2]));
    }
    let open = openness(materials[m].shape[0], materials[m].shape[1], materials[m].shape[2], w);
    return clamp(1.0 - alpha * (1.0 - open), 0.0, 1.0);
}

fn coverage(m: u32, uv: vec2<f32>) -> f32 {
    if (materials[m].coverage_texture == NONE) {
        return 1.0;
    }
    let alpha = texel(materials[m].coverage_texture, uv).w;
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

fn srgb1(x: f32) -> f32 {
    if (x <= 0.04045) {
        return x * (1.0 / 12.92);
    }
    return pow((x + 0.055) * (1.0 / 1.055), 2.4);
}

fn decode(word: u32, flags: u32) -> vec4<f32> {
    let c = vec4<f32>(
        f32(word & 255u),
        f32((word >> 8u) & 255u),
        f32((word >> 16u) & 255u),
        f32(word >> 24u),
    ) * (1.0 / 255.0);
    if ((flags & 16u) == 0u) {
        return c;
    }
    return vec4<f32>(srgb1(c.x), srgb1(c.y), srgb1(c.z), c.w);
}

fn texel_at(row: u32, x: i32, y: i32) -> vec4<f32> {
    let first = texels[row + 8u];
    let width = i32(texels[row + 9u]);
    let height = i32(texels[row + 10u]);
    let flags = texels[row + 11u];
    let i = wrapped(x, width, flags & 3u);
    let j = wrapped(y, height, (flags >> 2u) & 3u);
    return decode(texels[first + u32(j * width + i)], flags);
}

fn texel(number: u32, uv: vec2<f32>) -> vec4<f32> {
    let row = number * TEXTURE_ROW;
    let a = vec3<f32>(bitcast<f32>(texels[row]), bitcast<f32>(texels[row + 1u]), bitcast<f32>(texels[row + 2u]));
    let b = vec3<f32>(bitcast<f32>(texels[row + 4u]), bitcast<f32>(texels[row + 5u]), bitcast<f32>(texels[row + 6u]));
    let x = (a.x * uv.x + a.y * uv.y + a.z) * f32(texels[row + 9u]) - 0.5;
    let y = (b.x * uv.x + b.y * uv.y + b.z) * f32(texels[row + 10u]) - 0.5;
    let x0 = floor(x);
    let y0 = floor(y);
    let i = i32(x0);
    let j = i32(y0);
    let c00 = texel_at(row, i, j);
    let c10 = texel_at(row, i + 1, j);
    let c01 = texel_at(row, i, j + 1);
    let c11 = texel_at(row, i + 1, j + 1);
    let top = c00 + (c10 - c00) * (x - x0);
    let low = c01 + (c11 - c01) * (x - x0);
    return top + (low - top) * (y - y0);
}

fn emission(m: u32, s: Surface, wo: vec3<f32>) -> vec3<f32> {
    let flags = materials[m].flags;
    if ((flags & EMITS) == 0u || ((flags & DOUBLE_SIDED) == 0u && dot(s.ng, wo) <= 0.0)) {
        return vec3<f32>(0.0);
    }
    let e = materials[m].emission.xyz;
    if (materials[m].emission_texture == NONE) {
        return e;
    }
    return e * texel(materials[m].emission_texture, s.uv).xyz;
}

fn emission_at(place: u32, u: f32, v: f32) -> vec3<f32> {
    let m = shades[place].material;
    let e = materials[m].emission.xyz;
    if (materials[m].emission_texture == NONE) {
        return e;
    }
    return e * texel(materials[m].emission_texture, uv_at(place, u, v)).xyz;
}

fn evaluate(m: u32, s: Surface, wi: vec3<f32>, wo: vec3<f32>) -> vec3<f32> {
    let scale = s.tint * s.alpha;
    if ((materials[m].flags & (MATT | EVEN)) == (MATT | EVEN)) {
        let j = select(2u, 0u, wi.z * wo.z < 0.0);
        return materials[m].linear[j].xyz * scale * (materials[m].cover * FRAC_1_PI);
    }
    let b = sheet_basis(materials[m].shape, wi, wo);
    return (materials[m].linear[0].xyz * b[0] + materials[m].linear[1].xyz * b[1]
        + materials[m].linear[2].xyz * b[2] + materials[m].linear[3].xyz * b[3]) * scale;
}

fn density_of(m: u32, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    if ((materials[m].flags & MATT) != 0u) {
        return materials[m].weights[select(2u, 0u, wi.z * wo.z < 0.0)] * abs(wi.z) * FRAC_1_PI;
    }
    return sheet_pdf(materials[m].shape, materials[m].weights, wo, wi);
}

fn sample_sheet(m: u32, wo: vec3<f32>, u: vec3<f32>) -> vec3<f32> {
    if ((materials[m].flags & MATT) != 0u) {
        let r = sqrt(u.x);
        let sc = sincos_turn(u.y);
        let z = sqrt(max(1.0 - u.x, 0.0));
        let through = u.z < materials[m].weights[0];
        return vec3<f32>(r * sc.y, r * sc.x, select(z, -z, (wo.z > 0.0) == through));
    }
    return sheet_sample(materials[m].shape, materials[m].weights, wo, u);
}
