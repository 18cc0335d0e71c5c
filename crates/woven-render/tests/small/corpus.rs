//! Broken scenes and pictures by number: small whole files, and changes to them that a number alone decides.
//!
//! Scenes are changed where it matters: values swapped for odd ones or for each other, members dropped and doubled,
//! digits turned, and the binary part spoiled behind a sound JSON, so that most inputs get past the parser. Pictures
//! keep their checksums right most of the time, for the same reason.
#![allow(dead_code, reason = "each user takes a part")]

use super::pictures;
use super::{glb, scene};
use serde_json::{Value, json};
use std::ops::Range;
use std::path::PathBuf;
use woven_render::scene::gltf::{Limits, Options, decode_picture, load_bytes, motion};
use woven_render::{exr_io, scene::environment};

/// splitmix64: a number of the input decides everything about it.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    pub(crate) fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.next()) * n.max(1) as u128) >> 64) as usize
    }
}

/// Reads bytes; true when they were understood.
type Read = Box<dyn Fn(&[u8]) -> bool>;

/// Something that reads bytes nobody vouches for.
pub(crate) struct Target {
    pub(crate) name: &'static str,
    seeds: Vec<Seed>,
    read: Read,
}

/// A whole file to start from.
enum Seed {
    Scene(SceneSeed),
    Bytes(Vec<u8>),
    Png(Vec<u8>),
}

struct SceneSeed {
    text: Vec<u8>,
    /// Where values stand in the text, and which of them are members of arrays or objects.
    values: Vec<Range<usize>>,
    keys: Vec<Range<usize>>,
    digits: Vec<usize>,
    bin: Vec<u8>,
}

impl Target {
    /// Number of whole files behind it.
    pub(crate) fn seeds(&self) -> usize {
        self.seeds.len()
    }

    /// Makes input `k` and reads it.
    pub(crate) fn execute(&self, k: u64, bytes: &mut Vec<u8>) -> bool {
        self.input(k, bytes);
        (self.read)(bytes)
    }

    /// Input `k`.
    pub(crate) fn input(&self, k: u64, out: &mut Vec<u8>) {
        let mut r = Random(k.wrapping_mul(0xD134_2543_DE82_EF95).wrapping_add(1));
        out.clear();
        // The last seed of a target is its largest and comes seldom.
        let last = self.seeds.len() - 1;
        let which = if r.below(64) == 0 {
            last
        } else {
            r.below(last.max(1))
        };
        match &self.seeds[which] {
            Seed::Scene(s) => s.change(&mut r, out),
            Seed::Bytes(b) => {
                out.extend(b);
                spoil(&mut r, out);
            }
            Seed::Png(b) => {
                out.extend(b);
                pictures::spoil_png(&mut r, out);
            }
        }
    }

    /// The untouched files.
    pub(crate) fn whole(&self) -> Vec<Vec<u8>> {
        let plain = |s: &Seed| match s {
            Seed::Scene(s) => wrapped(&s.text, &s.bin),
            Seed::Bytes(b) | Seed::Png(b) => b.clone(),
        };
        self.seeds.iter().map(plain).collect()
    }

    /// Reads bytes that were not made here.
    pub(crate) fn read(&self, bytes: &[u8]) -> bool {
        (self.read)(bytes)
    }
}

/// Every target; scenes relative to a folder that holds nothing.
pub(crate) fn targets() -> Vec<Target> {
    let nowhere = PathBuf::from(".");
    let options = Options::default();
    let scenes = || {
        let mut seeds: Vec<Seed> = small_scenes()
            .into_iter()
            .chain([scene()])
            .map(|(doc, bin)| Seed::Scene(SceneSeed::new(&doc, bin)))
            .collect();
        // One in eight is spoiled as bytes, its container included.
        seeds.insert(
            0,
            Seed::Bytes(glb(&small_scenes()[0].0, &small_scenes()[0].1)),
        );
        seeds
    };
    let caches = vec![
        Seed::Scene(SceneSeed::new(&scene().0, scene().1)),
        Seed::Bytes(pictures::pc2()),
        Seed::Bytes(glb(&scene().0, &scene().1)),
    ];
    let here = nowhere.clone();
    let bytes = |files: Vec<Vec<u8>>| files.into_iter().map(Seed::Bytes).collect();
    vec![
        Target {
            name: "gltf",
            seeds: scenes(),
            read: Box::new(move |b| load_bytes(b, &nowhere, &options).is_ok()),
        },
        Target {
            name: "motion",
            seeds: caches,
            read: Box::new(move |b| motion::from_bytes(b, &here, &Limits::default()).is_ok()),
        },
        Target {
            name: "exr",
            seeds: bytes(pictures::exrs()),
            read: Box::new(|b| exr_io::decode(b, exr_io::DEFAULT_LIMIT).is_ok()),
        },
        Target {
            name: "hdr",
            seeds: bytes(pictures::hdrs()),
            read: Box::new(|b| environment::decode_hdr(b).is_ok()),
        },
        Target {
            name: "png",
            seeds: pictures::pngs().into_iter().map(Seed::Png).collect(),
            read: Box::new(|b| decode_picture(b).is_ok()),
        },
        Target {
            name: "jpeg",
            seeds: bytes(pictures::jpegs()),
            read: Box::new(|b| decode_picture(b).is_ok()),
        },
    ]
}

fn floats(v: &[f32]) -> Vec<u8> {
    v.iter().flat_map(|x| x.to_le_bytes()).collect()
}

/// Scenes of a few hundred bytes, each with one thing of its own.
fn small_scenes() -> Vec<(Value, Vec<u8>)> {
    let triangle = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let base = |extra: Value| {
        let mut doc = json!({
            "asset": { "version": "2.0" }, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
            "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
            "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }],
            "bufferViews": [{ "buffer": 0, "byteLength": 36 }], "buffers": [{ "byteLength": 36 }],
        });
        if let (Some(d), Some(e)) = (doc.as_object_mut(), extra.as_object()) {
            d.extend(e.clone());
        }
        doc
    };
    let mut out = vec![(base(json!({})), triangle.clone())];
    let mut indexed = triangle.clone();
    indexed.extend([0_u8, 1, 2, 0]);
    out.push((
        base(json!({
            "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1, "mode": 5 }] }],
            "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" },
                { "bufferView": 1, "componentType": 5121, "count": 3, "type": "SCALAR" }],
            "bufferViews": [{ "buffer": 0, "byteLength": 36, "byteStride": 12 }, { "buffer": 0, "byteOffset": 36, "byteLength": 4 }],
            "buffers": [{ "byteLength": 40 }] })),
        indexed.clone(),
    ));
    out.push((
        base(json!({ "nodes": [{ "children": [1, 2], "scale": [2, 1, -1] }, { "mesh": 0, "rotation": [0, 0, 0, 1] },
            { "camera": 0, "children": [3], "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 3, 1] }, { "mesh": 0, "name": "b" }],
            "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.1 } }], "scene": 0 })),
        triangle.clone(),
    ));
    out.push((
        base(json!({ "materials": [{ "alphaMode": "MASK", "alphaCutoff": 0.5, "emissiveFactor": [1, 0.5, 0], "extensions": {
                "KHR_materials_transmission": { "transmissionFactor": 0.5 }, "KHR_materials_ior": { "ior": 1.4 },
                "KHR_materials_emissive_strength": { "emissiveStrength": 5 }, "KHR_materials_sheen": { "sheenColorFactor": [0.5, 0.2, 0.1], "sheenRoughnessFactor": 0.4 } },
                "pbrMetallicRoughness": { "metallicFactor": 0.5, "roughnessFactor": 0.05 } }],
            "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "material": 0 }] }] })),
        triangle.clone(),
    ));
    out.push((
        base(json!({ "nodes": [{ "mesh": 0, "extensions": { "KHR_lights_punctual": { "light": 0 } } }],
            "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "spot", "spot": { "innerConeAngle": 0.1, "outerConeAngle": 0.4 } }] } } })),
        triangle.clone(),
    ));
    // Every attribute, whole numbers for coordinates and colours; a sparse patch.
    let mut rich = triangle.clone();
    rich.extend(floats(&[0.0, 0.0, 1.0].repeat(3)));
    rich.extend([0_u8, 0, 255, 0, 255, 255, 0, 0]);
    rich.extend([255_u8, 0, 0, 255, 0, 255, 0, 128, 9, 9, 9, 0]);
    rich.extend([1_u8, 0, 0, 0]);
    rich.extend(floats(&[0.5, 0.5, 0.5]));
    let view = |at: usize, len: usize| json!({ "buffer": 0, "byteOffset": at, "byteLength": len });
    out.push((
        base(json!({
            "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "COLOR_0": 3 } }] }],
            "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "sparse": { "count": 1,
                    "indices": { "bufferView": 4, "componentType": 5121 }, "values": { "bufferView": 5 } } },
                { "bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC3" },
                { "bufferView": 2, "componentType": 5121, "count": 3, "type": "VEC2", "normalized": true },
                { "bufferView": 3, "componentType": 5121, "count": 3, "type": "VEC4", "normalized": true }],
            "bufferViews": [view(0, 36), view(36, 36), view(72, 6), view(80, 12), view(92, 1), view(96, 12)],
            "buffers": [{ "byteLength": rich.len() }] })),
        rich,
    ));
    // A picture, written into the file.
    let mut painted = triangle;
    let png = super::tiny_png();
    painted.extend(&png);
    let texture = json!({ "index": 0, "texCoord": 0, "extensions": { "KHR_texture_transform": { "offset": [0.1, 0], "scale": [2, 2], "rotation": 0.3 } } });
    out.push((
        base(json!({ "materials": [{ "alphaMode": "BLEND", "normalTexture": { "index": 0, "scale": 0.5 },
                "pbrMetallicRoughness": { "baseColorTexture": texture, "metallicRoughnessTexture": { "index": 0 } } }],
            "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "material": 0 }] }],
            "textures": [{ "source": 0, "sampler": 0 }], "samplers": [{ "wrapS": 33648, "wrapT": 33071 }],
            "images": [{ "bufferView": 1, "mimeType": "image/png" }],
            "bufferViews": [view(0, 36), view(36, png.len())], "buffers": [{ "byteLength": painted.len() }] })),
        painted,
    ));
    // The buffer inside the JSON.
    let coded =
        "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    out.push((
        base(json!({ "buffers": [{ "byteLength": 36, "uri": coded }] })),
        Vec::new(),
    ));
    out
}

/// The file of a text and its binary part: a GLB, or the bare JSON.
fn wrapped(text: &[u8], bin: &[u8]) -> Vec<u8> {
    if bin.is_empty() {
        return text.to_vec();
    }
    let mut out = b"glTF".to_vec();
    let (t, b) = (text.len() as u32, bin.len() as u32);
    for w in [2, 28 + t + b, t, 0x4E4F_534A] {
        out.extend(w.to_le_bytes());
    }
    out.extend(text);
    for w in [b, 0x004E_4942] {
        out.extend(w.to_le_bytes());
    }
    out.extend(bin);
    out
}

/// Values that sit at the edge of some rule.
const ODD: &[&str] = &[
    "null",
    "true",
    "-1",
    "0",
    "1",
    "2",
    "3",
    "7",
    "36",
    "255",
    "256",
    "65535",
    "65536",
    "1e30",
    "-0.5",
    "1e-40",
    "5120",
    "5121",
    "5122",
    "5123",
    "5125",
    "5126",
    "4294967295",
    "18446744073709551615",
    "9007199254740992",
    "1099511627776",
    "33071",
    "\"\"",
    "\"VEC3\"",
    "\"SCALAR\"",
    "\"MAT4\"",
    "\"BLEND\"",
    "\"MASK\"",
    "\"portal\"",
    "\"../x\"",
    "\"a%00\"",
    "\"data:,x\"",
    "[]",
    "{}",
    "[0]",
    "[[]]",
    "[0,0]",
    "{\"index\":0}",
    "[1e38,1e38,1e38]",
    "{\"woven\":\"portal\"}",
    "16777216",
    "1048576",
];

const KEYS: &[&str] = &[
    "mode",
    "indices",
    "material",
    "sparse",
    "byteOffset",
    "byteStride",
    "byteLength",
    "count",
    "children",
    "extras",
    "matrix",
    "uri",
    "targets",
    "extensions",
    "alphaMode",
    "name",
    "NORMAL",
    "TEXCOORD_0",
    "TEXCOORD_1",
    "COLOR_0",
    "TANGENT",
    "JOINTS_0",
    "skin",
    "weights",
    "normalized",
    "emissiveTexture",
    "occlusionTexture",
    "doubleSided",
    "camera",
    "scale",
];

impl SceneSeed {
    fn new(doc: &Value, bin: Vec<u8>) -> Self {
        let text = serde_json::to_vec(doc).unwrap_or_default();
        let (mut values, mut keys) = (Vec::new(), Vec::new());
        spans(&text, 0, &mut values, &mut keys);
        let digits = (0..text.len())
            .filter(|&i| text[i].is_ascii_digit())
            .collect();
        Self {
            text,
            values,
            keys,
            digits,
            bin,
        }
    }

    fn change(&self, r: &mut Random, out: &mut Vec<u8>) {
        let mut text = self.text.clone();
        let mut bin = self.bin.clone();
        if r.below(4) == 0 && !bin.is_empty() {
            for _ in 0..=r.below(3) {
                let at = r.below(bin.len());
                bin[at] = [0, 1, 3, 127, 128, 255, r.next() as u8][r.below(7)];
            }
            if r.below(8) == 0 {
                bin.truncate(r.below(bin.len() + 1));
            }
        }
        match r.below(8) {
            0 => {}
            1 | 2 => {
                for _ in 0..=r.below(3) {
                    text[self.digits[r.below(self.digits.len())]] = b'0' + r.below(10) as u8;
                }
            }
            3 => spoil(r, &mut text),
            _ => {
                // From the back, so that what is before stays where it is.
                let mut end = text.len();
                for _ in 0..=r.below(3) {
                    let Some(span) = self.pick(r, end) else { break };
                    end = span.start;
                    self.swap(r, span, &mut text);
                }
            }
        }
        *out = wrapped(&text, &bin);
        if !bin.is_empty() && r.below(32) == 0 {
            let at = r.below(28).min(out.len() - 1);
            out[at] = r.next() as u8;
        }
    }

    fn pick(&self, r: &mut Random, end: usize) -> Option<Range<usize>> {
        (0..4)
            .map(|_| {
                let from = if r.below(5) == 0 {
                    &self.keys
                } else {
                    &self.values
                };
                from[r.below(from.len())].clone()
            })
            .find(|s| s.end <= end)
    }

    fn swap(&self, r: &mut Random, span: Range<usize>, text: &mut Vec<u8>) {
        let key = text.get(span.end) == Some(&b':');
        let other = self.values[r.below(self.values.len())].clone();
        let new: Vec<u8> = match r.below(6) {
            _ if key => format!("\"{}\"", KEYS[r.below(KEYS.len())]).into_bytes(),
            0 => self.text[other].to_vec(),
            // Twice, as a member of an array (or as nonsense).
            1 => {
                let mut twice = text[span.clone()].to_vec();
                twice.push(b',');
                twice.extend(&text[span.clone()]);
                twice
            }
            2 => match std::str::from_utf8(&text[span.clone()])
                .ok()
                .and_then(|t| t.parse::<i64>().ok())
            {
                Some(n) => (n + r.below(9) as i64 - 4).to_string().into_bytes(),
                None => ODD[r.below(ODD.len())].into(),
            },
            _ => ODD[r.below(ODD.len())].into(),
        };
        text.splice(span, new);
    }
}

/// Where values and keys of a JSON text stand; returns the end of the value at `at`. The text is our own.
fn spans(
    text: &[u8],
    at: usize,
    values: &mut Vec<Range<usize>>,
    keys: &mut Vec<Range<usize>>,
) -> usize {
    let string_end = |from: usize| {
        let mut i = from + 1;
        while text[i] != b'"' {
            i += if text[i] == b'\\' { 2 } else { 1 };
        }
        i + 1
    };
    let end = match text[at] {
        b'"' => string_end(at),
        open @ (b'{' | b'[') => {
            let mut i = at + 1;
            while !matches!(text[i], b'}' | b']') {
                if open == b'{' {
                    let end = string_end(i);
                    keys.push(i..end);
                    i = end + 1;
                }
                i = spans(text, i, values, keys);
                if text[i] == b',' {
                    i += 1;
                }
            }
            i + 1
        }
        _ => (at..text.len())
            .find(|&i| matches!(text[i], b',' | b'}' | b']'))
            .unwrap_or(text.len()),
    };
    values.push(at..end);
    end
}

/// One to eight changed, dropped or doubled bytes, sometimes a cut.
pub(crate) fn spoil(r: &mut Random, bytes: &mut Vec<u8>) {
    for _ in 0..=r.below(4) {
        if bytes.is_empty() {
            return;
        }
        let at = r.below(bytes.len());
        match r.below(8) {
            0 => bytes[at] = r.next() as u8,
            1 => bytes[at] ^= 1 << r.below(8),
            2 => bytes[at] = [0, 255, 127, 128, 1][r.below(5)],
            3 => {
                bytes.remove(at);
            }
            4 => bytes.insert(at, r.next() as u8),
            5 => {
                // A word at its edge.
                let word = [0_u32, 1, u32::MAX, 1 << 31, 1 << 16, (1 << 31) - 1][r.below(6)];
                for (i, b) in word.to_le_bytes().into_iter().enumerate() {
                    if let Some(x) = bytes.get_mut(at + i) {
                        *x = b;
                    }
                }
            }
            6 => {
                let from = r.below(bytes.len());
                let n = r.below(16).min(bytes.len() - from).min(bytes.len() - at);
                bytes.copy_within(from..from + n, at);
            }
            _ if r.below(8) == 0 => bytes.truncate(at),
            _ => bytes[at] = bytes[at].wrapping_add(1),
        }
    }
}
