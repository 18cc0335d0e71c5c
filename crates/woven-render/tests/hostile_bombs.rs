//! Small files that want to become large: each is refused (or read small) within 100 ms and 512 MiB.

#[path = "../examples/process/mod.rs"]
mod process;
mod small;

use serde_json::{Value, json};
use small::pictures::{chunk, crc};
use std::path::Path;
use std::time::{Duration, Instant};
use woven_render::scene::environment::decode_hdr;
use woven_render::scene::gltf::{Options, decode_picture, load_bytes};

/// What the issue allows.
const TIME: Duration = Duration::from_millis(100);
/// See [`TIME`]; resident at the peak, the bombs themselves included.
const MEMORY: f64 = 512.0;

/// zlib of `n` zeros: one fixed block of matches of 258 bytes at distance 1 (RFC 1951, 3.2.6), 158 to 1.
fn zeros(n: usize) -> Vec<u8> {
    let (mut out, mut held, mut bits) = (vec![0x78, 0x01], 0_u64, 0);
    let mut put = |out: &mut Vec<u8>, code: u64, count: u32| {
        held |= code << bits;
        bits += count;
        while bits >= 8 {
            out.push(held as u8);
            held >>= 8;
            bits -= 8;
        }
    };
    put(&mut out, 0b011, 3);
    // Literal 0 is 00110000, length 258 is 11000101, both from the highest bit; distance 1 is 00000.
    put(&mut out, 0b0000_1100, 8);
    for _ in 0..n.div_ceil(258) {
        put(&mut out, 0b1010_0011, 8);
        put(&mut out, 0, 5);
    }
    put(&mut out, 0, 7 + 7);
    out.extend([0; 4]);
    out
}

fn png(side: u32, extra: Option<(&[u8; 4], Vec<u8>)>, data: &[u8]) -> Vec<u8> {
    let mut header = side.to_be_bytes().repeat(2);
    header.extend([8, 6, 0, 0, 0]);
    let mut out = b"\x89PNG\r\n\x1a\n".to_vec();
    out.extend(chunk(b"IHDR", &header));
    if let Some((kind, body)) = extra {
        out.extend(fast_chunk(kind, &body));
    }
    out.extend(fast_chunk(b"IDAT", data));
    out.extend(chunk(b"IEND", &[]));
    out
}

/// A chunk whose checksum is worked out by a table, for the large ones.
fn fast_chunk(kind: &[u8; 4], body: &[u8]) -> Vec<u8> {
    let table: Vec<u32> = (0..=255_u8)
        .map(|b| {
            // The checksum of one byte without its two complements.
            (0..8).fold(u32::from(b), |c, _| {
                if c & 1 == 1 {
                    0xEDB8_8320 ^ (c >> 1)
                } else {
                    c >> 1
                }
            })
        })
        .collect();
    let mut out = (body.len() as u32).to_be_bytes().to_vec();
    out.extend(kind);
    out.extend(body);
    let sum = out[4..].iter().fold(!0_u32, |c, b| {
        table[((c ^ u32::from(*b)) & 255) as usize] ^ (c >> 8)
    });
    out.extend((!sum).to_be_bytes());
    out
}

/// Processor time of this thread: a busy machine may take a test off its core for longer than [`TIME`].
fn spent() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(Duration::from_nanos(
        text.split_whitespace().next()?.parse().ok()?,
    ))
}

/// Runs `read` on the bomb and holds it to [`TIME`]; a sentence is expected unless it may be `harmless`.
fn defuse(name: &str, harmless: bool, read: impl FnOnce() -> anyhow::Result<()>) {
    let (begun, before) = (Instant::now(), spent());
    let told = read();
    let took = spent()
        .zip(before)
        .map_or(begun.elapsed(), |(now, before)| now - before);
    eprintln!(
        "{name}: {took:?}, {}",
        told.as_ref()
            .map_or_else(|e| format!("{e:#}"), |()| "read".into())
    );
    assert!(harmless || told.is_err(), "{name} was read");
    assert!(took < TIME, "{name} took {took:?}");
}

fn scene(text: &Value) -> Vec<u8> {
    serde_json::to_vec(text).unwrap()
}

fn load(bytes: &[u8]) -> anyhow::Result<()> {
    load_bytes(bytes, Path::new("."), &Options::default()).map(drop)
}

#[test]
fn bombs_are_refused_at_once() {
    assert_eq!(fast_chunk(b"abcd", b"efgh"), chunk(b"abcd", b"efgh"));
    assert_ne!(crc(b"a"), crc(b"b"));
    // A picture that is what it says, and unfolds 158 times: small it is read, large it is refused.
    let flat = |side: usize| png(side as u32, None, &zeros((1 + side * 4) * side));
    let (w, _, pixels) = decode_picture(&flat(64)).unwrap();
    assert_eq!((w, pixels.len(), pixels[9]), (64, 4096, [0; 4]));
    let bomb = flat(16_384);
    defuse("flat png 16384 x 16384", false, || {
        decode_picture(&bomb).map(drop)
    });
    let bomb = png(60_000, None, &[]);
    defuse("png header 60000 x 60000", false, || {
        decode_picture(&bomb).map(drop)
    });
    // 256 MiB behind a picture of 2 x 2, as a colour profile and as a text.
    for kind in [b"iCCP", b"zTXt", b"iTXt"] {
        let mut body = b"a\0\0".to_vec();
        if kind == b"iTXt" {
            body = b"a\0\x01\0\0\0".to_vec();
        }
        body.extend(zeros(256 << 20));
        let bomb = png(2, Some((kind, body)), &zeros(18));
        defuse(
            &format!("png with {}", String::from_utf8_lossy(kind)),
            true,
            || decode_picture(&bomb).map(drop),
        );
    }
    // More data than the picture has room for.
    let bomb = png(2, None, &zeros(256 << 20));
    defuse("png with 256 MiB for 2 x 2", true, || {
        decode_picture(&bomb).map(drop)
    });

    // A JPEG header that claims 65500 x 65500 in three colours.
    let mut bomb = vec![0xFF, 0xD8, 0xFF, 0xC0, 0, 17, 8];
    bomb.extend([
        0xFF, 0xDC, 0xFF, 0xDC, 3, 1, 0x11, 0, 2, 0x11, 0, 3, 0x11, 0,
    ]);
    bomb.extend([
        0xFF, 0xDA, 0, 12, 3, 1, 0, 2, 0, 3, 0, 0, 63, 0, 0, 0, 0xFF, 0xD9,
    ]);
    defuse("jpeg header 65500 x 65500", false, || {
        decode_picture(&bomb).map(drop)
    });

    for text in [
        "-Y 60000 +X 60000",
        "-Y 8000 +X 8000",
        "-Y 2147483647 +X 2147483647",
    ] {
        let bomb = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{text}\n\x02\x02").into_bytes();
        defuse(&format!("hdr header {text}"), false, || {
            decode_hdr(&bomb).map(drop)
        });
    }
    // A black sky that is coded 31 to 1.
    let mut bomb = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4096 +X 8192\n".to_vec();
    let mut line = vec![2, 2, 0x20, 0];
    for _ in 0..4 {
        (0..64).for_each(|_| line.extend([255, 0]));
        line.extend([128 + 64, 0]);
    }
    (0..4096).for_each(|_| bomb.extend(&line));
    defuse("black hdr 8192 x 4096", false, || {
        decode_hdr(&bomb).map(drop)
    });

    // A black OpenEXR picture of 4000 x 3000 halves.
    let bomb = black_exr(4000, 3000);
    defuse(
        &format!("black exr 4000 x 3000 in {} KiB", bomb.len() >> 10),
        false,
        || woven_render::exr_io::decode(&bomb, woven_render::exr_io::DEFAULT_LIMIT).map(drop),
    );

    bombs_in_scenes();
    let peak = process::peak_memory();
    eprintln!("peak {peak:.0} MiB");
    assert!(peak < MEMORY, "{peak} MiB");
}

fn black_exr(w: usize, h: usize) -> Vec<u8> {
    use exr::prelude::*;
    let black = |_: Vec2<usize>| (f16::ZERO, f16::ZERO, f16::ZERO);
    let layer = Layer::new(
        (w, h),
        LayerAttributes::named("black"),
        Encoding::SMALL_LOSSLESS,
        SpecificChannels::rgb(black),
    );
    let mut out = std::io::Cursor::new(Vec::new());
    Image::from_layer(layer)
        .write()
        .to_buffered(&mut out)
        .unwrap();
    out.into_inner()
}

fn bombs_in_scenes() {
    let deep = format!("{{\"asset\":{}", "[".repeat(1 << 20));
    defuse("a million brackets", false, || load(deep.as_bytes()));
    let triangle =
        "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    let base = json!({
        "asset": { "version": "2.0" }, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }], "buffers": [{ "byteLength": 36, "uri": triangle }],
    });
    load(&scene(&base)).unwrap();
    let with = |key: &str, value: Value| {
        let mut doc = base.clone();
        doc[key] = value;
        scene(&doc)
    };
    let zeros = json!([{ "componentType": 5126, "count": 16_000_000, "type": "VEC3" }]);
    let bomb = with("accessors", zeros);
    defuse("sixteen million vertices of nothing", false, || load(&bomb));
    // One triangle from a list of zeros, a thousand times, in each of a thousand nodes.
    let mut doc = base.clone();
    doc["accessors"] = json!([{ "componentType": 5126, "count": 1_000_000, "type": "VEC3" }]);
    doc["meshes"] =
        json!([{ "primitives": vec![json!({ "attributes": { "POSITION": 0 } }); 1000] }]);
    doc["nodes"] = json!(vec![json!({ "mesh": 0 }); 1000]);
    doc["scenes"] = json!([{ "nodes": (0..1000).collect::<Vec<_>>() }]);
    let bomb = scene(&doc);
    defuse(
        "a million copies of a third of a million triangles",
        false,
        || load(&bomb),
    );
    for (name, piece) in [
        ("zeros", "0,"),
        ("objects", "{\"\":0},"),
        ("texts", "\"\","),
    ] {
        let mut bomb = "{\"asset\":{\"version\":\"2.0\"},\"extras\":[".to_owned();
        while bomb.len() < 40 << 20 {
            bomb.push_str(piece);
        }
        bomb.push_str("0]}");
        defuse(&format!("40 MiB of {name}"), false, || {
            load(bomb.as_bytes())
        });
    }
    // The same picture named by many images: each counts.
    let side = 4096;
    let flat = png(
        side,
        None,
        &self::zeros((1 + side as usize * 4) * side as usize),
    );
    let mut bin = vec![0_u8; 36];
    bin.extend(&flat);
    let mut doc = base;
    doc["buffers"] = json!([{ "byteLength": bin.len() }]);
    doc["bufferViews"] = json!([{ "buffer": 0, "byteLength": 36 }, { "buffer": 0, "byteOffset": 36, "byteLength": flat.len() }]);
    doc["images"] = json!(vec![
        json!({ "bufferView": 1, "mimeType": "image/png" });
        40
    ]);
    doc["textures"] = json!((0..40).map(|i| json!({ "source": i })).collect::<Vec<_>>());
    doc["materials"] = json!(
        (0..40)
            .map(|i| json!({ "emissiveFactor": [1, 1, 1], "emissiveTexture": { "index": i } }))
            .collect::<Vec<_>>()
    );
    let bomb = small::glb(&doc, &bin);
    // Decoding what is still allowed takes its time; the memory is what this one is about.
    let told = format!("{:#}", load(&bomb).unwrap_err());
    assert!(told.contains("MiB when decoded"), "{told}");
}
