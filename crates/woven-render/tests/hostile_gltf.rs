//! Broken and malicious scenes: each a sentence, none a panic, none a large allocation.

mod small;

use serde_json::{Value, json};
use small::{glb, scene};
use std::path::Path;
use woven_render::scene::gltf::{Limits, Options, load_bytes, motion};

/// Loads and hands back the sentence; fails when the second net had to catch a panic.
fn load(bytes: &[u8]) -> Result<(), String> {
    let told = load_bytes(bytes, Path::new("."), &Options::default())
        .map(drop)
        .map_err(|e| format!("{e:#}"));
    if let Err(e) = &told {
        assert!(
            !e.contains("gave up"),
            "a panic reached the second net: {e}"
        );
    }
    told
}

/// splitmix64: the same mutations in every run.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % n as u64) as usize
    }
}

#[test]
fn the_untouched_scene_is_read() {
    let (doc, bin) = scene();
    load(&glb(&doc, &bin)).unwrap();
}

#[test]
fn every_truncation_is_a_sentence() {
    let (doc, bin) = scene();
    let bytes = glb(&doc, &bin);
    for n in 0..bytes.len() {
        assert!(load(&bytes[..n]).is_err(), "cut to {n} bytes");
    }
}

#[test]
fn mutated_digits_never_panic() {
    let (doc, bin) = scene();
    let text = serde_json::to_vec(&doc).unwrap();
    let digits: Vec<usize> = (0..text.len())
        .filter(|&i| text[i].is_ascii_digit())
        .collect();
    let mut random = Random(1);
    let (mut good, mut bad) = (0, 0);
    for _ in 0..10_000 {
        let mut text = text.clone();
        for _ in 0..=random.below(3) {
            text[digits[random.below(digits.len())]] = b'0' + random.below(10) as u8;
        }
        let Ok(doc) = serde_json::from_slice::<Value>(&text) else {
            continue;
        };
        *(if load(&glb(&doc, &bin)).is_ok() {
            &mut good
        } else {
            &mut bad
        }) += 1;
    }
    // Both must happen, or the mutations test nothing.
    assert!(good > 100 && bad > 100, "{good} read, {bad} refused");
}

#[test]
fn mutated_bytes_never_panic() {
    let (doc, bin) = scene();
    let bytes = glb(&doc, &bin);
    let mut random = Random(2);
    for _ in 0..10_000 {
        let mut bytes = bytes.clone();
        for _ in 0..=random.below(8) {
            let at = random.below(bytes.len());
            match random.below(4) {
                0 => bytes[at] = random.below(256) as u8,
                1 => bytes[at] ^= 1 << random.below(8),
                2 => {
                    bytes.remove(at);
                }
                _ => bytes.insert(at, b"0123456789-e.[]{},:\""[random.below(20)]),
            }
        }
        let _ = load(&bytes);
    }
}

#[test]
fn replaced_values_never_panic() {
    let (doc, bin) = scene();
    let paths = pointers(&doc);
    let odd = [
        json!(null),
        json!(true),
        json!(-1),
        json!(0),
        json!(1),
        json!(7),
        json!(255),
        json!(65_536),
        json!(1e30),
        json!(-0.5),
        json!(u64::MAX),
        json!(i64::MIN),
        json!(u32::MAX),
        json!(1_u64 << 53),
        json!(""),
        json!("VEC3"),
        json!([]),
        json!({}),
        json!([0]),
        json!([[[]]]),
    ];
    for path in &paths {
        for value in &odd {
            let mut doc = doc.clone();
            *doc.pointer_mut(path).unwrap() = value.clone();
            let bytes = glb(&doc, &bin);
            let _ = load(&bytes);
            read_motion(&bytes);
        }
    }
}

fn read_motion(bytes: &[u8]) {
    if let Err(e) = motion::from_bytes(bytes, Path::new("."), &Limits::default()) {
        assert!(!format!("{e:#}").contains("gave up"), "{e:#}");
    }
}

/// JSON pointers of every value in a document.
fn pointers(doc: &Value) -> Vec<String> {
    fn walk(v: &Value, at: &str, out: &mut Vec<String>) {
        out.push(at.to_owned());
        match v {
            Value::Array(a) => a
                .iter()
                .enumerate()
                .for_each(|(i, v)| walk(v, &format!("{at}/{i}"), out)),
            Value::Object(o) => o.iter().for_each(|(k, v)| {
                walk(
                    v,
                    &format!("{at}/{}", k.replace('~', "~0").replace('/', "~1")),
                    out,
                )
            }),
            _ => {}
        }
    }
    let mut out = Vec::new();
    walk(doc, "", &mut out);
    out
}

/// Puts `value` at `path` of the good scene and expects a refusal that contains `word`.
fn refused(path: &str, value: Value, word: &str) {
    let (mut doc, bin) = scene();
    let (parent, key) = path.rsplit_once('/').unwrap();
    match doc
        .pointer_mut(parent)
        .unwrap_or_else(|| panic!("{parent}"))
    {
        Value::Array(a) => match key.parse::<usize>() {
            Ok(i) => a[i] = value,
            Err(_) => a.push(value),
        },
        Value::Object(o) => {
            o.insert(key.to_owned(), value);
        }
        other => panic!("{other}"),
    }
    let told = load(&glb(&doc, &bin)).expect_err(path);
    assert!(told.contains(word), "{path}: {told}");
}

#[test]
fn each_rule_has_its_sentence() {
    refused("/asset/version", json!("1.0"), "only glTF 2");
    refused(
        "/extensionsRequired",
        json!(["KHR_draco_mesh_compression"]),
        "KHR_draco_mesh_compression",
    );
    refused("/buffers/0/byteLength", json!(1_u64 << 40), "byteLength");
    refused("/buffers/0/byteLength", json!(100_000), "says 100000 bytes");
    refused("/bufferViews/0/byteOffset", json!(u64::MAX), "byteOffset");
    refused(
        "/bufferViews/0/byteLength",
        json!(1_000_000),
        "beyond the buffer",
    );
    refused("/bufferViews/0/byteStride", json!(8), "stride");
    refused("/accessors/0/count", json!(100), "accessors[0]");
    refused("/accessors/0/count", json!(1_u64 << 40), "count");
    refused("/accessors/3/componentType", json!(5126), "accessors[3]");
    refused("/accessors/8/sparse/count", json!(9), "sparse.count");
    refused(
        "/meshes/0/primitives/0/attributes/POSITION",
        json!(99),
        "POSITION = 99",
    );
    refused(
        "/meshes/0/primitives/0/attributes/POSITION",
        json!(2),
        "type that glTF does not allow",
    );
    refused("/meshes/0/primitives/0/material", json!(5), "material = 5");
    refused(
        "/materials/0/pbrMetallicRoughness/baseColorTexture/index",
        json!(3),
        "baseColorTexture",
    );
    refused("/nodes/1/children", json!([0]), "ancestors");
    refused("/nodes/1/children", json!([1]), "two parents");
    refused("/nodes/2/children", json!([1]), "two parents");
    refused("/scenes/0/nodes", json!([0, 0]), "twice");
    refused("/scenes/0/nodes", json!([1]), "has a parent");
    refused("/cameras/0/perspective/yfov", json!(3.5), "yfov");
    refused("/nodes/0/translation", json!([1e39, 0, 0]), "too large");
    refused("/nodes/0/scale", json!([3e38, 3e38, 3e38]), "finite");
    refused("/images/0/mimeType", json!(7), "mimeType");
}

#[test]
fn sparse_accessors_and_indices_are_checked_by_content_too() {
    let (doc, bin) = scene();
    // The index buffer names vertex 3 at most; let it name vertex 9.
    let at = doc["bufferViews"][3]["byteOffset"].as_u64().unwrap() as usize;
    let mut spoiled = bin.clone();
    spoiled[at] = 9;
    assert!(
        load(&glb(&doc, &spoiled))
            .unwrap_err()
            .contains("beyond the 4 vertices")
    );
    let at = doc["bufferViews"][0]["byteOffset"].as_u64().unwrap() as usize;
    let mut spoiled = bin;
    spoiled[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(
        load(&glb(&doc, &spoiled))
            .unwrap_err()
            .contains("not finite")
    );
}

#[test]
fn instances_cannot_multiply_without_end() {
    let (mut doc, bin) = scene();
    let copies: Vec<Value> = (0..400).map(|_| json!({ "mesh": 0 })).collect();
    let first = doc["nodes"].as_array().unwrap().len();
    doc["nodes"].as_array_mut().unwrap().extend(copies);
    doc["scenes"][0]["nodes"]
        .as_array_mut()
        .unwrap()
        .extend((first..first + 400).map(|i| json!(i)));
    let options = Options {
        limits: Limits {
            triangles: 1000,
            ..Limits::default()
        },
        ..Options::default()
    };
    let told = load_bytes(&glb(&doc, &bin), Path::new("."), &options).unwrap_err();
    assert!(
        format!("{told:#}").contains("more than 1000 triangles"),
        "{told:#}"
    );
}

#[test]
fn a_picture_bomb_is_refused_by_its_header() {
    // A PNG header that claims 60000 x 60000, with a right checksum, and nothing behind it.
    let mut png = b"\x89PNG\r\n\x1a\n".to_vec();
    let mut ihdr = b"IHDR".to_vec();
    ihdr.extend(60_000_u32.to_be_bytes());
    ihdr.extend(60_000_u32.to_be_bytes());
    ihdr.extend([8, 6, 0, 0, 0]);
    png.extend(13_u32.to_be_bytes());
    png.extend(&ihdr);
    png.extend(crc(&ihdr).to_be_bytes());
    // Readers look at the header when the data begin.
    png.extend([0, 0, 0, 0]);
    png.extend(b"IDAT");
    png.extend(crc(b"IDAT").to_be_bytes());
    let (mut doc, mut bin) = scene();
    doc["bufferViews"]
        .as_array_mut()
        .unwrap()
        .push(json!({ "buffer": 0, "byteOffset": bin.len(), "byteLength": png.len() }));
    bin.extend(&png);
    doc["buffers"][0]["byteLength"] = json!(bin.len());
    doc["images"][0]["bufferView"] = json!(doc["bufferViews"].as_array().unwrap().len() - 1);
    let begun = std::time::Instant::now();
    let told = load(&glb(&doc, &bin)).unwrap_err();
    assert!(told.contains("60000 x 60000"), "{told}");
    assert!(begun.elapsed().as_millis() < 1000, "{:?}", begun.elapsed());
}

/// CRC-32 as PNG uses it.
fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |c, b| {
        (0..8).fold(c ^ u32::from(*b), |c, _| {
            if c & 1 == 1 {
                0xEDB8_8320 ^ (c >> 1)
            } else {
                c >> 1
            }
        })
    })
}
