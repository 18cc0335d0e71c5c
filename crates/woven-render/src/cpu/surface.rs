//! The sheet at a point: frame, textures, gap, scattering. The pair of `shader/surface.wgsl`.

use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

use super::bvh::Hit;
use super::math::sincos_turn;
use super::measured;
use crate::optics;
use woven_bsdf::sheet::shape::{F0, GAMMA_WARP, INV_MEAN_COVER, RALPHA_X, RALPHA_Y};

use crate::table::{
    DOUBLE_SIDED, EMITS, EVEN, MATT, MEASURED, MULTIPLIES, MaterialRow, NONE, PLAIN_GLOSS, Table,
    TextureRow,
};

/// A point of a sheet, seen along a ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surface {
    /// The point.
    pub p: Vec3,
    /// Unit normal of the triangle.
    pub ng: Vec3,
    /// Weft, warp and shading normal.
    pub frame: [Vec3; 3],
    /// Texture coordinates.
    pub uv: [f32; 2],
    /// Row of the material.
    pub material: u32,
    /// Row of the light or `NONE`.
    pub light: u32,
    /// Colour texture: multiplies the linear factors.
    pub tint: Vec3,
    /// Coverage texture.
    pub alpha: f32,
    /// Texture of the gloss: multiplies the widths of the reflection lobe; metalness.
    pub gloss: [f32; 2],
}

impl Surface {
    #[inline(always)]
    pub(crate) fn local(&self, w: Vec3) -> Vec3 {
        Vec3::new(
            w.dot(self.frame[0]),
            w.dot(self.frame[1]),
            w.dot(self.frame[2]),
        )
    }

    #[inline(always)]
    pub(crate) fn world(&self, w: Vec3) -> Vec3 {
        self.frame[0] * w.x + self.frame[1] * w.y + self.frame[2] * w.z
    }

    /// Where a ray towards `d` starts: off the surface, on the side it leaves to.
    #[inline(always)]
    pub(crate) fn leave(&self, table: &Table, d: Vec3) -> Vec3 {
        let away = if self.ng.dot(d) < 0.0 {
            -table.globals.offset
        } else {
            table.globals.offset
        };
        self.p + self.ng * away
    }
}

/// Shading normal at barycentric (u, v), turned to the side of the triangle's normal.
#[inline(always)]
fn frame(table: &Table, place: usize, u: f32, v: f32, ng: Vec3) -> [Vec3; 3] {
    let s = &table.shade[place];
    let n = |r: &[f32; 4]| Vec3::new(r[0], r[1], r[2]);
    let sum = n(&s.n0) * (1.0 - u - v) + n(&s.n1) * u + n(&s.n2) * v;
    let length = sum.length();
    let z = if length > 1e-6 {
        sum * (1.0 / length)
    } else {
        ng
    };
    let weft = n(&s.weft);
    let along = weft - z * weft.dot(z);
    let length = along.length();
    let x = if length > 1e-4 {
        along * (1.0 / length)
    } else {
        any_tangent(z)
    };
    [x, z.cross(x), z]
}

#[inline(always)]
fn any_tangent(z: Vec3) -> Vec3 {
    let a = if z.x.abs() < 0.7 { Vec3::X } else { Vec3::Y };
    a.cross(z).normalize()
}

/// Texture coordinates at barycentric (u, v).
#[inline(always)]
fn uv_at(table: &Table, place: usize, u: f32, v: f32) -> [f32; 2] {
    let s = &table.shade[place];
    let w = 1.0 - u - v;
    [
        w * s.n0[3] + u * s.n1[3] + v * s.n2[3],
        w * s.v[0] + u * s.v[1] + v * s.v[2],
    ]
}

/// The frame turned to the normal that the texture's colour means, see [`crate::scene::Material::normal_texture`].
#[inline(always)]
fn bent([x, y, z]: [Vec3; 3], hand: f32, scale: f32, c: [f32; 4]) -> [Vec3; 3] {
    let across = (c[0] * 2.0 - 1.0) * scale;
    let up = (c[1] * 2.0 - 1.0) * scale * hand;
    // Never turned to the other side.
    let out = (c[2] * 2.0 - 1.0).max(0.05);
    let n = (x * across + y * up + z * out).normalize();
    let along = x - n * x.dot(n);
    let length = along.length();
    let weft = if length > 1e-4 {
        along * (1.0 / length)
    } else {
        any_tangent(n)
    };
    [weft, n.cross(weft), n]
}

/// Everything about the hit that scattering needs; textures are averaged over a square of side `wide` \[m\].
#[inline(always)]
pub(crate) fn surface(table: &Table, hit: &Hit, wide: f32) -> Surface {
    let place = hit.place as usize;
    let packet = &table.bvh.packets[place / 4];
    let lane = place % 4;
    let at = |v: &[glam::Vec4; 3]| Vec3::new(v[0][lane], v[1][lane], v[2][lane]);
    let (v0, e1, e2) = (at(&packet.v0), at(&packet.e1), at(&packet.e2));
    let ng = e1.cross(e2).normalize();
    let s = &table.shade[place];
    let material = &table.materials[s.material as usize];
    let mut tint = Vec3::ONE;
    let mut alpha = 1.0;
    let mut gloss = [1.0, 0.0];
    let mut uv = [0.0; 2];
    let mut turned = frame(table, place, hit.u, hit.v, ng);
    if material.color_texture != NONE
        || material.coverage_texture != NONE
        || material.emission_texture != NONE
        || material.normal_texture != NONE
        || material.gloss_texture != NONE
    {
        uv = uv_at(table, place, hit.u, hit.v);
        let area = wide * wide * s.v[3];
        if material.color_texture != NONE {
            let c = texel(table, material.color_texture, uv, area);
            tint = Vec3::new(c[0], c[1], c[2]);
        }
        if material.normal_texture != NONE {
            let c = texel(table, material.normal_texture, uv, area);
            turned = bent(turned, s.weft[3], material.normal_scale, c);
        }
        if material.gloss_texture != NONE {
            let c = texel(table, material.gloss_texture, uv, area);
            gloss = [c[1] * c[1], c[2] * material.metal[3]];
        }
        alpha = coverage(table, material, uv, area);
    }
    if s.colors[3] > 1 {
        alpha = opened(material, s.colors[3], hit.u, hit.v, alpha);
    }
    if s.colors[3] & 1 != 0 {
        let c = |k: usize| {
            let c = decode(s.colors[k], true);
            Vec3::new(c[0], c[1], c[2])
        };
        tint *= c(0) * (1.0 - hit.u - hit.v) + c(1) * hit.u + c(2) * hit.v;
    }
    Surface {
        p: v0 + e1 * hit.u + e2 * hit.v,
        ng,
        frame: turned,
        uv,
        material: s.material,
        light: s.light,
        tint,
        alpha,
        gloss,
    }
}

/// Openness of the sheet along `w`, by its weave or its table.
#[inline(always)]
fn open_along(table: &Table, m: &MaterialRow, w: Vec3) -> f32 {
    if m.flags & MEASURED != 0 {
        return measured::gap(table, m.measured, w);
    }
    optics::openness(&m.shape, w)
}

/// The gap of a sheet with this openness under a coverage texture.
#[inline(always)]
fn covered(m: &MaterialRow, alpha: f32, open: f32) -> f32 {
    let gap = if m.flags & MULTIPLIES != 0 {
        alpha * open
    } else {
        1.0 - alpha * (1.0 - open)
    };
    gap.clamp(0.0, 1.0)
}

/// Coverage `alpha` where stretch and shear have opened the weave by the factor in `bits` (see [`crate::table::Shade::colors`]): a map of
/// holes is multiplied; else as much less covers as the openness along the normal has grown, along which it is exact.
#[inline(always)]
fn opened(m: &MaterialRow, bits: u32, u: f32, v: f32, alpha: f32) -> f32 {
    let corner = |k: u32| {
        let root = ((bits >> (2 + 10 * k)) & 1023) as f32 * (1.0 / 512.0);
        root * root
    };
    let factor = corner(0) * (1.0 - u - v) + corner(1) * u + corner(2) * v;
    if m.flags & MULTIPLIES != 0 {
        return (alpha * factor).min(1.0);
    }
    alpha * (1.0 - (factor - 1.0) * (1.0 - m.cover) / m.cover.max(1e-6)).max(0.0)
}

/// Share of the light along `d` that passes straight through the sheet.
#[inline(always)]
pub(crate) fn gap(table: &Table, material: &MaterialRow, s: &Surface, d: Vec3) -> f32 {
    if material.gap >= 0.0 {
        return material.gap;
    }
    covered(material, s.alpha, open_along(table, material, s.local(d)))
}

/// The same for a triangle that a shadow ray along `d` meets at barycentric (u, v).
pub(crate) fn gap_at(table: &Table, place: u32, u: f32, v: f32, d: Vec3) -> f32 {
    let place = place as usize;
    let material = &table.materials[table.shade[place].material as usize];
    let mut alpha = 1.0;
    if material.coverage_texture != NONE {
        alpha = coverage(table, material, uv_at(table, place, u, v), 0.0);
        if alpha <= 0.0 {
            return covered(material, 0.0, 1.0);
        }
    }
    let bits = table.shade[place].colors[3];
    if bits > 1 {
        alpha = opened(material, bits, u, v, alpha);
    }
    let mut local = Vec3::Z;
    if material.flags & EVEN == 0 {
        let packet = &table.bvh.packets[place / 4];
        let lane = place % 4;
        let at = |v: &[glam::Vec4; 3]| Vec3::new(v[0][lane], v[1][lane], v[2][lane]);
        let ng = at(&packet.e1).cross(at(&packet.e2)).normalize();
        let [x, y, z] = frame(table, place, u, v, ng);
        local = Vec3::new(d.dot(x), d.dot(y), d.dot(z));
    }
    covered(material, alpha, open_along(table, material, local))
}

/// Coverage by the texture's alpha.
fn coverage(table: &Table, material: &MaterialRow, uv: [f32; 2], area: f32) -> f32 {
    if material.coverage_texture == NONE {
        return 1.0;
    }
    let alpha = texel(table, material.coverage_texture, uv, area)[3];
    if material.alpha_cutoff < 0.0 {
        alpha
    } else if alpha < material.alpha_cutoff {
        0.0
    } else {
        1.0
    }
}

/// Linear RGBA of a texture at the mesh's coordinates, bilinear; averaged over the area `area` of (u, v): trilinear
/// between the copies whose texels are just smaller and just larger.
fn texel(table: &Table, row: u32, uv: [f32; 2], area: f32) -> [f32; 4] {
    let t = &table.textures[row as usize];
    // Half the logarithm of the texels in the area.
    let level = (0.5 * (area * t.map_u[3]).max(1.0).log2()).min(t.map_v[3]);
    let below = level.floor();
    let mut low = [0.0; 4];
    let (mut first, mut w, mut h) = (t.first, t.width, t.height);
    for k in 0..=t.map_v[3] as u32 {
        if k as f32 >= below {
            let c = taps(table, t, [first, w, h], uv);
            if k as f32 > below {
                let mix = level - below;
                return std::array::from_fn(|i| low[i] + (c[i] - low[i]) * mix);
            }
            low = c;
            if level <= below {
                break;
            }
        }
        first += w * h;
        (w, h) = ((w / 2).max(1), (h / 2).max(1));
    }
    low
}

/// Bilinear in the copy that begins at texel `first` and has `w` by `h`.
#[inline(always)]
fn taps(table: &Table, t: &TextureRow, [first, w, h]: [u32; 3], uv: [f32; 2]) -> [f32; 4] {
    let x = (t.map_u[0] * uv[0] + t.map_u[1] * uv[1] + t.map_u[2]) * w as f32 - 0.5;
    let y = (t.map_v[0] * uv[0] + t.map_v[1] * uv[1] + t.map_v[2]) * h as f32 - 0.5;
    let (x0, y0) = (x.floor(), y.floor());
    let (fx, fy) = (x - x0, y - y0);
    let at = |dx: i32, dy: i32| {
        let i = wrapped(x0 as i32 + dx, w as i32, t.flags & 3);
        let j = wrapped(y0 as i32 + dy, h as i32, (t.flags >> 2) & 3);
        decode(
            table.texels[(first as i32 + j * w as i32 + i) as usize],
            t.flags & 16 != 0,
        )
    };
    let (a, b, c, d) = (at(0, 0), at(1, 0), at(0, 1), at(1, 1));
    std::array::from_fn(|k| {
        let top = a[k] + (b[k] - a[k]) * fx;
        let low = c[k] + (d[k] - c[k]) * fx;
        top + (low - top) * fy
    })
}

fn wrapped(i: i32, n: i32, mode: u32) -> i32 {
    match mode {
        0 => ((i % n) + n) % n,
        1 => {
            let m = ((i % (2 * n)) + 2 * n) % (2 * n);
            if m < n { m } else { 2 * n - 1 - m }
        }
        _ => i.clamp(0, n - 1),
    }
}

fn decode(texel: u32, srgb: bool) -> [f32; 4] {
    let c: [f32; 4] = std::array::from_fn(|k| ((texel >> (8 * k)) & 255) as f32 * (1.0 / 255.0));
    if !srgb {
        return c;
    }
    let linear = |k: u32| SRGB[((texel >> (8 * k)) & 255) as usize];
    [linear(0), linear(1), linear(2), c[3]]
}

/// sRGB decoded (IEC 61966-2-1), for 0..255.
pub(crate) static SRGB: std::sync::LazyLock<[f32; 256]> = std::sync::LazyLock::new(|| {
    std::array::from_fn(|i| {
        let x = i as f64 / 255.0;
        (if x <= 0.04045 {
            x / 12.92
        } else {
            ((x + 0.055) / 1.055).powf(2.4)
        }) as f32
    })
});

/// Radiance that the surface gives off towards `wo`.
pub(crate) fn emission(table: &Table, material: &MaterialRow, s: &Surface, wo: Vec3) -> Vec3 {
    if material.flags & EMITS == 0 || (material.flags & DOUBLE_SIDED == 0 && s.ng.dot(wo) <= 0.0) {
        return Vec3::ZERO;
    }
    let e = Vec3::new(
        material.emission[0],
        material.emission[1],
        material.emission[2],
    );
    if material.emission_texture == NONE {
        return e;
    }
    let c = texel(table, material.emission_texture, s.uv, 0.0);
    e * Vec3::new(c[0], c[1], c[2])
}

/// The same for a light that was sampled at barycentric (u, v) of a triangle.
pub(crate) fn emission_at(table: &Table, place: u32, u: f32, v: f32) -> Vec3 {
    let material = &table.materials[table.shade[place as usize].material as usize];
    let e = Vec3::new(
        material.emission[0],
        material.emission[1],
        material.emission[2],
    );
    if material.emission_texture == NONE {
        return e;
    }
    let c = texel(
        table,
        material.emission_texture,
        uv_at(table, place as usize, u, v),
        0.0,
    );
    e * Vec3::new(c[0], c[1], c[2])
}

/// Rows of the factors for diffuse reflection, reflection lobe and sheen, less 2, on the side of `w`.
#[inline(always)]
pub(crate) fn side(w: Vec3) -> usize {
    if w.z < 0.0 { 3 } else { 0 }
}

/// f(wi, wo), both in the sheet's frame.
#[inline(always)]
pub(crate) fn evaluate(table: &Table, m: &MaterialRow, s: &Surface, wi: Vec3, wo: Vec3) -> Vec3 {
    let k = |j: usize| Vec3::new(m.linear[j][0], m.linear[j][1], m.linear[j][2]);
    let back = side(wo);
    let scale = s.tint * s.alpha;
    if even(m) {
        let j = if wi.z * wo.z < 0.0 { 0 } else { 2 + back };
        return k(j) * scale * (m.cover * FRAC_1_PI);
    }
    if m.flags & MEASURED != 0 {
        return scale * measured::evaluate(table, m.measured, wi, wo);
    }
    if m.gloss_texture != NONE {
        let b = optics::sheet_basis(&glossed(m, s), wi, wo);
        let even = k(0) * b[0] + k(1) * b[1] + k(2 + back) * b[2] + k(4 + back) * b[4];
        let metal = s.gloss[1];
        let base = Vec3::new(m.metal[0], m.metal[1], m.metal[2]) * s.tint;
        // By Schlick's reflectance at normal incidence, white or tinted gloss and metal mix evenly.
        let f0 = m.shape[F0];
        let gloss = (k(3 + back) * (f0 * (1.0 - metal)) + base * metal)
            * (1.0 / (f0 + (1.0 - f0) * metal).max(1e-6));
        return (even * s.tint * (1.0 - metal) + gloss * b[3]) * s.alpha;
    }
    let plain = m.flags & PLAIN_GLOSS != 0;
    let value = |shape: &[f32; crate::scene::MAX_SHAPE], share: f32| {
        let b = optics::sheet_basis(shape, wi, wo);
        let scale = s.tint * share;
        let gloss = if plain { Vec3::splat(share) } else { scale };
        (k(0) * b[0] + k(1) * b[1] + k(2 + back) * b[2] + k(4 + back) * b[4]) * scale
            + k(3 + back) * b[3] * gloss
    };
    let woven = value(&m.shape, s.alpha);
    if m.flags & MULTIPLIES == 0 {
        return woven;
    }
    woven + value(&closed(m.shape), 1.0 - s.alpha)
}

/// Narrowest reflection lobe of a texture; narrower ones are not told apart from it.
const LEAST_WIDTH: f32 = 0.02;

/// The shape with the gloss of the texture.
fn glossed(m: &MaterialRow, s: &Surface) -> [f32; crate::scene::MAX_SHAPE] {
    let mut shape = m.shape;
    let [width, metal] = s.gloss;
    shape[RALPHA_X] = (shape[RALPHA_X] * width).max(LEAST_WIDTH);
    shape[RALPHA_Y] = (shape[RALPHA_Y] * width).max(LEAST_WIDTH);
    shape[F0] += (1.0 - shape[F0]) * metal;
    shape
}

/// Sampling weights with the gloss of the texture: metal has nothing else.
fn glossed_weights(m: &MaterialRow, s: &Surface) -> [f32; crate::scene::MAX_LINEAR] {
    let mut weights = m.weights.map(|w| w * (1.0 - s.gloss[1]));
    weights[3] += s.gloss[1];
    weights
}

/// The same sheet without a gap.
fn closed(mut shape: [f32; crate::scene::MAX_SHAPE]) -> [f32; crate::scene::MAX_SHAPE] {
    shape[GAMMA_WARP] = 1.0;
    shape[INV_MEAN_COVER] = 1.0;
    shape
}

/// What is scattered to one side is the same in all its directions.
#[inline(always)]
pub(crate) fn even(m: &MaterialRow) -> bool {
    m.flags & (MATT | EVEN) == MATT | EVEN
}

/// Density of [`sample`].
#[inline(always)]
pub(crate) fn density(table: &Table, m: &MaterialRow, s: &Surface, wo: Vec3, wi: Vec3) -> f32 {
    if m.flags & MATT != 0 {
        return m.weights[if wi.z * wo.z < 0.0 { 0 } else { 2 }] * wi.z.abs() * FRAC_1_PI;
    }
    if m.flags & MEASURED != 0 {
        return measured::density(table, m.measured, wo, wi);
    }
    if m.gloss_texture != NONE {
        return optics::sheet_pdf(&glossed(m, s), &glossed_weights(m, s), wo, wi);
    }
    optics::sheet_pdf(&m.shape, &m.weights, wo, wi)
}

/// A direction to go on in, in the sheet's frame.
#[inline(always)]
pub(crate) fn sample(table: &Table, m: &MaterialRow, s: &Surface, wo: Vec3, u: Vec3) -> Vec3 {
    if m.flags & MATT != 0 {
        let r = u.x.sqrt();
        let (sin, cos) = sincos_turn(u.y);
        let z = (1.0 - u.x).max(0.0).sqrt();
        let through = u.z < m.weights[0];
        return Vec3::new(
            r * cos,
            r * sin,
            if (wo.z > 0.0) == through { -z } else { z },
        );
    }
    if m.flags & MEASURED != 0 {
        return measured::sample(table, m.measured, wo, u);
    }
    if m.gloss_texture != NONE {
        return optics::sheet_sample(&glossed(m, s), &glossed_weights(m, s), wo, u);
    }
    optics::sheet_sample(&m.shape, &m.weights, wo, u)
}
