//! Small scenes that tests write themselves.
#![allow(dead_code, reason = "each test file uses a part")]

pub(crate) mod corpus;
pub(crate) mod pictures;

use serde_json::{Value, json};

/// A GLB from its JSON and binary chunk.
pub(crate) fn glb(json: &Value, bin: &[u8]) -> Vec<u8> {
    let mut text = serde_json::to_vec(json).unwrap();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut bin = bin.to_vec();
    bin.resize(bin.len().next_multiple_of(4), 0);
    let mut out = b"glTF".to_vec();
    let words = |out: &mut Vec<u8>, w: &[u32]| w.iter().for_each(|w| out.extend(w.to_le_bytes()));
    words(&mut out, &[2, (12 + 8 + text.len() + 8 + bin.len()) as u32]);
    words(&mut out, &[text.len() as u32, 0x4E4F_534A]);
    out.extend(&text);
    words(&mut out, &[bin.len() as u32, 0x004E_4942]);
    out.extend(&bin);
    out
}

/// A 2 x 2 PNG: red, green / blue, half-transparent white.
pub(crate) fn tiny_png() -> Vec<u8> {
    use image::ImageEncoder;
    let mut out = Vec::new();
    let pixels = [
        255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 255, 255, 255, 128,
    ];
    image::codecs::png::PngEncoder::new(&mut out)
        .write_image(&pixels, 2, 2, image::ExtendedColorType::Rgba8)
        .unwrap();
    out
}

/// One square metre at z = 0 that faces +Z, textured, with two morph targets and a sparse copy of its positions, under
/// a child node, with a camera at z = 3, a point light and an animation. Uses most of what the reader knows.
pub(crate) fn scene() -> (Value, Vec<u8>) {
    let mut bin = Vec::new();
    let mut views = Vec::new();
    let mut add = |bytes: &[u8]| {
        bin.resize(bin.len().next_multiple_of(4), 0);
        views.push(json!({ "buffer": 0, "byteOffset": bin.len(), "byteLength": bytes.len() }));
        bin.extend(bytes);
        views.len() - 1
    };
    let floats = |v: &[f32]| -> Vec<u8> { v.iter().flat_map(|x| x.to_le_bytes()).collect() };
    let position = add(&floats(&[
        -0.5, -0.5, 0.0, 0.5, -0.5, 0.0, 0.5, 0.5, 0.0, -0.5, 0.5, 0.0,
    ]));
    let normal = add(&floats(&[0.0, 0.0, 1.0].repeat(4)));
    let uv = add(&floats(&[0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]));
    let index = add(&[0_u16, 1, 2, 0, 2, 3]
        .iter()
        .flat_map(|i| i.to_le_bytes())
        .collect::<Vec<_>>());
    let morph_a = add(&floats(&[0.0; 12]));
    let morph_b = add(&floats(&[0.0, 0.0, 0.25].repeat(4)));
    let times = add(&floats(&[0.0, 0.5]));
    let weights = add(&floats(&[1.0, 0.0, 0.0, 1.0]));
    let sparse_index = add(&[2, 0, 0, 0]);
    let sparse_value = add(&floats(&[0.5, 0.75, 0.0]));
    let picture = add(&tiny_png());
    let vec3 = |view: usize| json!({ "bufferView": view, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, -1, -1], "max": [1, 1, 1] });
    let mut sparse = vec3(position);
    sparse["sparse"] = json!({
        "count": 1,
        "indices": { "bufferView": sparse_index, "componentType": 5121 },
        "values": { "bufferView": sparse_value },
    });
    let doc = json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": { "KHR_lights_punctual": { "lights": [
            { "type": "point", "intensity": 3.0, "color": [1.0, 0.5, 0.25] },
            { "type": "spot", "intensity": 2.0, "spot": { "innerConeAngle": 0.1, "outerConeAngle": 0.4 } },
            { "type": "directional", "intensity": 4.0 },
        ] } },
        "scene": 0,
        "scenes": [{ "nodes": [0, 2, 3] }],
        "nodes": [
            { "children": [1, 4], "translation": [0.0, 1.0, 0.0] },
            { "name": "cloth", "mesh": 0, "rotation": [0.0, 0.0, 0.0, 1.0], "scale": [2.0, 1.0, 1.0] },
            { "name": "eye", "camera": 0, "translation": [0.0, 1.0, 3.0] },
            { "name": "lamp", "translation": [1.0, 2.0, 3.0], "extensions": { "KHR_lights_punctual": { "light": 0 } } },
            { "name": "sun", "extensions": { "KHR_lights_punctual": { "light": 2 } } },
        ],
        "meshes": [{ "name": "cloth", "weights": [1.0, 0.0], "primitives": [
            { "attributes": { "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2 }, "indices": 3, "material": 0, "mode": 4,
              "targets": [{ "POSITION": 4 }, { "POSITION": 5 }] },
            { "attributes": { "POSITION": 8 }, "indices": 3 },
        ] }],
        "materials": [{
            "name": "lace", "doubleSided": true, "alphaMode": "BLEND",
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.8, 0.8, 0.8, 0.65], "metallicFactor": 0.0, "roughnessFactor": 1.0,
                "baseColorTexture": { "index": 0 } },
            "extensions": { "KHR_materials_specular": { "specularFactor": 0.0 },
                "KHR_materials_diffuse_transmission": { "diffuseTransmissionFactor": 0.5, "diffuseTransmissionColorFactor": [0.8, 0.8, 0.8] } },
        }],
        "textures": [{ "source": 0, "sampler": 0 }],
        "samplers": [{ "wrapS": 33071 }],
        "images": [{ "bufferView": picture, "mimeType": "image/png" }],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.01 } }],
        "animations": [{ "channels": [{ "sampler": 0, "target": { "node": 1, "path": "weights" } }],
            "samplers": [{ "input": 6, "output": 7, "interpolation": "LINEAR" }] }],
        "accessors": [
            vec3(position), vec3(normal),
            { "bufferView": uv, "componentType": 5126, "count": 4, "type": "VEC2" },
            { "bufferView": index, "componentType": 5123, "count": 6, "type": "SCALAR" },
            vec3(morph_a), vec3(morph_b),
            { "bufferView": times, "componentType": 5126, "count": 2, "type": "SCALAR" },
            { "bufferView": weights, "componentType": 5126, "count": 4, "type": "SCALAR" },
            sparse,
        ],
        "bufferViews": views,
        "buffers": [{ "byteLength": bin.len() }],
    });
    (doc, bin)
}
