//! A glTF material as a sheet: metallic-roughness, alpha, transmission, diffuse transmission, specular, ior, emission, unlit.
//!
//! The sheet has one openness and four factors (diffuse transmission t_d, forward lobe k_t, diffuse reflection r_d, glossy
//! reflection k_r). With base colour c, metalness m, roughness r (alpha = r²), transmission t, diffuse transmission d:
//!
//! * coverage by yarn is glTF's alpha: a surface of alpha 0.65 lets 0.35 of the light straight through;
//! * k_r and f0 follow from ior, specular and m: at normal incidence k_r f0 is the glTF mixture of both kinds of surface;
//! * r_d = c (1-m)(1-t)(1-d) and t_d = c_d (1-m)(1-t) d, both less the mean share that the glossy lobe reflects;
//! * k_t = c (1-m) t; a smooth clear pane (r < 0.1) passes the part of c that is common to the channels as a gap instead,
//!   since a lobe that narrow is a delta: light then comes straight through a window.
//!
//! Metalness and roughness come from the texture's mean where there is one: a sheet has one shape.
//!
//! * sheen (KHR_materials_sheen) has no lobe of its own in the sheet. Its colour joins the diffuse reflection with the share that
//!   the sheen's lobe reflects on the mean, and dims what lies below by as much: the colour and the energy are right, the bright rim is not.
//! * the gloss of what is no metal stays white where a texture colours the rest.

use super::images::Pictures;
use crate::scene::{LAYER_LAMPS, MAX_LINEAR, Material, TextureUse};
use anyhow::Result;
use gltf::material::AlphaMode;
use gltf::texture::Info;
use serde_json::Value;
use woven_bsdf::model::Model;
use woven_bsdf::sheet::{Sheet, linear, shape};

/// Under this roughness a transmitting surface is a clear pane.
const CLEAR: f32 = 0.1;
/// Lobes narrower than this are not told apart from it.
const LEAST_ALPHA: f32 = 0.02;

/// Turns one material; pictures it uses are loaded by `pictures`.
///
/// # Errors
/// A sentence when a picture cannot be read.
pub(super) fn convert(
    m: &gltf::Material<'_>,
    pictures: &mut Pictures<'_>,
    notes: &mut Vec<String>,
) -> Result<(Material, u32)> {
    let name = m.name().map_or_else(
        || {
            m.index()
                .map_or("default".into(), |i| format!("material {i}"))
        },
        str::to_owned,
    );
    let pbr = m.pbr_metallic_roughness();
    let [r, g, b, alpha] = pbr.base_color_factor().map(|v| v.clamp(0.0, 1.0));
    let base = [r, g, b];
    let (mut metallic, mut roughness) = (
        pbr.metallic_factor().clamp(0.0, 1.0),
        pbr.roughness_factor().clamp(0.0, 1.0),
    );
    if let Some(info) = pbr.metallic_roughness_texture() {
        let mean = pictures.mean(&info.texture())?;
        roughness *= mean[1];
        metallic *= mean[2];
    }
    let specular = m.specular();
    let weight = specular
        .as_ref()
        .map_or(1.0, |s| s.specular_factor().clamp(0.0, 1.0));
    let tint = specular
        .as_ref()
        .map_or([1.0; 3], |s| s.specular_color_factor().map(|v| v.max(0.0)));
    let ior = m.ior().unwrap_or(1.5).max(1.0);
    let f0_plain = ((ior - 1.0) / (ior + 1.0)).powi(2);
    let transmission = match m.transmission() {
        None => 0.0,
        Some(t) => {
            let mean = t
                .transmission_texture()
                .map(|i| pictures.mean(&i.texture()))
                .transpose()?
                .map_or(1.0, |v| v[0]);
            (t.transmission_factor() * mean).clamp(0.0, 1.0)
        }
    };
    let (diffuse_through, through_colour) = diffuse_transmission(m, pictures)?;

    // The glossy lobe: one f0 for all channels, the rest in its colour.
    let f0 = if weight == 0.0 && metallic == 0.0 {
        f0_plain
    } else {
        f0_plain + (1.0 - f0_plain) * metallic
    };
    let at_normal =
        |c: usize| (1.0 - metallic) * weight * (f0_plain * tint[c]).min(1.0) + metallic * base[c];
    let k_r: [f32; 3] = [0, 1, 2].map(|c| {
        if f0 > 0.0 {
            (at_normal(c) / f0).min(1.0)
        } else {
            0.0
        }
    });
    let f_mean = f0 + (1.0 - f0) / 21.0;

    // What the gloss lets in, and where it goes.
    let enters = |c: usize| (1.0 - metallic) * (1.0 - k_r[c] * f_mean);
    let clear = transmission > 0.0 && roughness < CLEAR;
    let common = if clear {
        (0..3).map(|c| base[c] * enters(c)).fold(1.0, f32::min) * transmission
    } else {
        0.0
    };
    let body = (1.0 - common).max(1e-6);
    let sheen = sheen(m, pictures)?;
    let below = 1.0 - sheen.iter().fold(0.0_f32, |a, s| a.max(*s));
    let mut k = [[0.0; 3]; MAX_LINEAR];
    for c in 0..3 {
        let diffuse = enters(c) * (1.0 - transmission);
        k[linear::R_D][c] =
            (base[c] * diffuse * (1.0 - diffuse_through) / body * below + sheen[c]).min(1.0);
        k[linear::T_D][c] = through_colour[c] * diffuse * diffuse_through / body * below;
        k[linear::K_T][c] = ((base[c] * enters(c) * transmission - common) / body).max(0.0);
        // A clear pane's gloss stays on its whole area; the sheet's lobes cover only its yarn.
        k[linear::K_R][c] = (k_r[c] / body)
            .min((1.0 - k[linear::R_D][c] - k[linear::T_D][c] - k[linear::K_T][c]).max(k_r[c]));
    }
    let cutoff = (m.alpha_mode() == AlphaMode::Mask).then(|| m.alpha_cutoff().unwrap_or(0.5));
    let alpha = match m.alpha_mode() {
        AlphaMode::Opaque => 1.0,
        AlphaMode::Blend => alpha,
        AlphaMode::Mask => 1.0,
    };
    let width = (roughness * roughness).clamp(LEAST_ALPHA, 1.0);
    let mut material = Material {
        linear: k,
        shape: sheet_shape(alpha * (1.0 - common), width, f0),
        double_sided: m.double_sided(),
        layer: LAYER_LAMPS,
        ..Material::matt(&name, [0.0; 3])
    };
    // Metal reflects its own colour, everything else white.
    material.plain_gloss = metallic < 0.5;
    let mut sets = Vec::new();
    material.color_texture = pbr
        .base_color_texture()
        .map(|i| pictures.used(&i, true, &mut sets))
        .transpose()?;
    if let Some(used) = material.color_texture.as_mut().filter(|_| below < 1.0) {
        // The sheen lies on top of the picture and must not be coloured by it.
        let under = [0, 1, 2].map(|c| (k[linear::R_D][c] - sheen[c]).max(0.0));
        used.texture = pictures.veiled(used.texture, under, sheen)?;
    }
    if m.alpha_mode() != AlphaMode::Opaque {
        material.coverage_texture = material.color_texture;
    }
    if let Some(cutoff) = cutoff {
        // glTF compares factor * texture with the cut-off; without a texture the answer is one for all.
        let factor = pbr.base_color_factor()[3].max(1e-6);
        if material.coverage_texture.is_some() {
            material.alpha_cutoff = Some(cutoff / factor);
        } else if factor < cutoff {
            material.shape = sheet_shape(0.0, width, f0);
        }
    }
    let strength = m.emissive_strength().unwrap_or(1.0).max(0.0);
    material.emission = m.emissive_factor().map(|v| v.max(0.0) * strength);
    material.emission_texture = m
        .emissive_texture()
        .filter(|_| material.emission.iter().any(|e| *e > 0.0))
        .map(|i| pictures.used(&i, true, &mut sets))
        .transpose()?;
    if let Some(t) = m.normal_texture() {
        // The crate does not tell the transform of a normal texture; the JSON does.
        let place = t.extension_value("KHR_texture_transform");
        material.normal_texture =
            Some(pictures.placed(&t.texture(), t.tex_coord(), place, &mut sets)?);
        material.normal_scale = t.scale();
    }
    if m.unlit() {
        material.linear = [[0.0; 3]; MAX_LINEAR];
        material.emission = base;
        material.emission_texture = material.color_texture.take();
        material.normal_texture = None;
    }
    // A mesh has one set of coordinates here: the one that its colour asks for.
    let set = sets.first().copied().unwrap_or(0);
    if sets.iter().any(|s| *s != set) {
        notes.push(format!(
            "the textures of material '{name}' use several sets of coordinates; set {set} is used for all"
        ));
    }
    Ok((material, set))
}

/// KHR_materials_sheen: what the sheen reflects on the mean, by channel. The share of a white sheen over both directions is 0.42 r - 0.18 r²
/// within 0.006 (Charlie's distribution, Estevez and Kulla 2017, with the visibility of Neubelt and Pettineo 2013, integrated numerically).
fn sheen(m: &gltf::Material<'_>, pictures: &mut Pictures<'_>) -> Result<[f32; 3]> {
    let Some(e) = m.extension_value("KHR_materials_sheen") else {
        return Ok([0.0; 3]);
    };
    let number = |v: &Value| v.as_f64().unwrap_or(0.0).clamp(0.0, 1.0) as f32;
    let index = |key: &str| {
        e.get(key)
            .and_then(|t| t.get("index"))
            .and_then(Value::as_u64)
    };
    let mut r = e.get("sheenRoughnessFactor").map_or(0.0, number);
    if let Some(t) = index("sheenRoughnessTexture") {
        r *= pictures.mean_of(t as usize)?[3];
    }
    let mut colour = [0.0_f32; 3];
    if let Some(list) = e.get("sheenColorFactor").and_then(Value::as_array) {
        colour
            .iter_mut()
            .zip(list)
            .for_each(|(c, v)| *c = number(v));
    }
    if let Some(t) = index("sheenColorTexture") {
        let mean = pictures.mean_of(t as usize)?;
        colour
            .iter_mut()
            .zip(mean)
            .for_each(|(c, v)| *c *= crate::film::srgb_decode(v));
    }
    Ok(colour.map(|c| c * (0.42 - 0.18 * r) * r))
}

/// KHR_materials_diffuse_transmission: factor and colour, each with the mean of its texture.
fn diffuse_transmission(
    m: &gltf::Material<'_>,
    pictures: &mut Pictures<'_>,
) -> Result<(f32, [f32; 3])> {
    let Some(e) = m.extension_value("KHR_materials_diffuse_transmission") else {
        return Ok((0.0, [1.0; 3]));
    };
    let number = |v: &Value| v.as_f64().unwrap_or(0.0).clamp(0.0, 1.0) as f32;
    let mut factor = e.get("diffuseTransmissionFactor").map_or(0.0, number);
    let mut colour = [1.0_f32; 3];
    if let Some(list) = e
        .get("diffuseTransmissionColorFactor")
        .and_then(Value::as_array)
    {
        colour
            .iter_mut()
            .zip(list)
            .for_each(|(c, v)| *c = number(v));
    }
    let index = |key: &str| {
        e.get(key)
            .and_then(|t| t.get("index"))
            .and_then(Value::as_u64)
    };
    if let Some(t) = index("diffuseTransmissionTexture") {
        factor *= pictures.mean_of(t as usize)?[3];
    }
    if let Some(t) = index("diffuseTransmissionColorTexture") {
        let mean = pictures.mean_of(t as usize)?;
        colour
            .iter_mut()
            .zip(mean)
            .for_each(|(c, v)| *c *= crate::film::srgb_decode(v));
    }
    Ok((factor, colour))
}

/// Shape of a sheet with constant coverage and one width for both lobes.
fn sheet_shape(coverage: f32, alpha: f32, f0: f32) -> [f32; crate::scene::MAX_SHAPE] {
    let mut s = Sheet::constant_cover(f64::from(coverage.clamp(0.0, 1.0)));
    s[shape::ALPHA_X..=shape::RALPHA_Y].fill(f64::from(alpha));
    s[shape::F0] = f64::from(f0.clamp(0.0, 1.0));
    Sheet::derive(&mut s);
    s.map(|v| v as f32)
}

impl Pictures<'_> {
    /// The texture of `info` for use as a colour or a coverage; its set of coordinates goes to `sets`.
    fn used(&mut self, info: &Info<'_>, srgb: bool, sets: &mut Vec<u32>) -> Result<TextureUse> {
        let texture = self.texture(&info.texture(), srgb)?;
        let mut set = info.tex_coord();
        let mut transform = TextureUse::plain(0).transform;
        if let Some(t) = info.texture_transform() {
            set = t.tex_coord().unwrap_or(set);
            transform = affine(t.offset(), t.rotation(), t.scale());
        }
        sets.push(set);
        Ok(TextureUse { texture, transform })
    }

    /// The same for a normal texture, whose transform is given as JSON.
    fn placed(
        &mut self,
        texture: &gltf::Texture<'_>,
        set: u32,
        place: Option<&Value>,
        sets: &mut Vec<u32>,
    ) -> Result<TextureUse> {
        let texture = self.texture(texture, false)?;
        let Some(place) = place else {
            sets.push(set);
            return Ok(TextureUse::plain(texture));
        };
        let number =
            |v: Option<&Value>, or: f32| v.and_then(Value::as_f64).map_or(or, |v| v as f32);
        let pair = |key: &str, or: f32| {
            let list = place.get(key);
            [0, 1].map(|i| number(list.and_then(|l| l.get(i)), or))
        };
        sets.push(
            place
                .get("texCoord")
                .and_then(Value::as_u64)
                .map_or(set, |n| n.min(99) as u32),
        );
        Ok(TextureUse {
            texture,
            transform: affine(
                pair("offset", 0.0),
                number(place.get("rotation"), 0.0),
                pair("scale", 1.0),
            ),
        })
    }
}

/// KHR_texture_transform: translation * rotation * scale.
fn affine([ox, oy]: [f32; 2], rotation: f32, [sx, sy]: [f32; 2]) -> [[f32; 3]; 2] {
    let (sin, cos) = rotation.sin_cos();
    [[cos * sx, sin * sy, ox], [-sin * sx, cos * sy, oy]]
}
