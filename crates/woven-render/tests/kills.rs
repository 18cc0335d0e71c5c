//! An animation that is killed at random goes on where it was, and ends with the bytes of one that was not.
//!
//! Two kills in the suite; the campaign of the issue is `WOVEN_KILLS=50 cargo test --release -p woven-render --test kills -- --nocapture`.

mod small;

use serde_json::json;
use small::corpus::Random;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A cloth of 9 x 9 vertices before a wall, under a lamp, and a point cache of `frames` frames in which it waves.
fn stage(dir: &Path, frames: u32) {
    let n = 9_u32;
    let at = |i: u32, j: u32, t: f32| {
        let (x, y) = (i as f32 / 8.0 - 0.5, j as f32 / 8.0 + 0.5);
        [x, y, 0.1 * (6.0 * x + t).sin()]
    };
    let floats = |v: Vec<[f32; 3]>| -> Vec<u8> {
        v.iter().flatten().flat_map(|x| x.to_le_bytes()).collect()
    };
    let grid = |t: f32| -> Vec<[f32; 3]> { (0..n * n).map(|k| at(k % n, k / n, t)).collect() };
    let mut bin = floats(grid(0.0));
    let points = bin.len();
    let mut count = 0;
    for j in 0..n - 1 {
        for i in 0..n - 1 {
            let a = j * n + i;
            for k in [a, a + 1, a + n + 1, a, a + n + 1, a + n] {
                bin.extend(k.to_le_bytes());
                count += 1;
            }
        }
    }
    let triangles = bin.len() - points;
    bin.extend(floats(vec![
        [-2.0, 0.0, -0.5],
        [2.0, 0.0, -0.5],
        [0.0, 3.0, -0.5],
    ]));
    let view = |offset: usize, length: usize| json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
    let doc = json!({
        "asset": { "version": "2.0" },
        "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "point", "intensity": 8.0 }] } },
        "scenes": [{ "nodes": [0, 1, 2, 3] }],
        "nodes": [{ "mesh": 0, "name": "cloth" }, { "mesh": 1, "name": "wall" }, { "camera": 0, "translation": [0, 1, 2.5] },
            { "translation": [0.7, 1.8, 1.5], "extensions": { "KHR_lights_punctual": { "light": 0 } } }],
        "meshes": [{ "name": "cloth", "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1, "material": 0 }] },
            { "name": "wall", "primitives": [{ "attributes": { "POSITION": 2 } }] }],
        "materials": [{ "alphaMode": "BLEND", "pbrMetallicRoughness": { "baseColorFactor": [0.8, 0.7, 0.5, 0.7], "metallicFactor": 0 } }],
        "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.7, "znear": 0.01 } }],
        "accessors": [{ "bufferView": 0, "componentType": 5126, "count": n * n, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5125, "count": count, "type": "SCALAR" },
            { "bufferView": 2, "componentType": 5126, "count": 3, "type": "VEC3" }],
        "bufferViews": [view(0, points), view(points, triangles), view(points + triangles, 36)],
        "buffers": [{ "byteLength": bin.len() }],
    });
    std::fs::write(dir.join("scene.glb"), small::glb(&doc, &bin)).unwrap();
    let mut cache = b"POINTCACHE2\0".to_vec();
    for word in [1, n * n, 0, 1_f32.to_bits(), frames] {
        cache.extend(word.to_le_bytes());
    }
    (0..frames).for_each(|k| cache.extend(floats(grid(k as f32 * 0.4))));
    std::fs::write(dir.join("cloth.pc2"), cache).unwrap();
}

fn animate(dir: &Path, out: &Path, frames: u32, spp: u32) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_woven-render"));
    command
        .arg("animate")
        .arg(dir.join("scene.glb"))
        .arg("--cloth")
        .arg(dir.join("cloth.pc2"))
        .args([
            "--mesh",
            "cloth",
            "--size",
            "96x72",
            "--backend",
            "cpu",
            "--aov",
            "--depth",
            "4",
            "--shutter",
            "0.5",
        ])
        .args([
            "--spp",
            &spp.to_string(),
            "--frames",
            &format!("0..{frames}"),
        ])
        .arg("-o")
        .arg(out)
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    command
}

/// The frames of a folder, and anything else that lies there but the ledger.
fn files(out: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = std::fs::read_dir(out).unwrap().map(|e| e.unwrap());
    entries
        .filter(|e| e.file_name() != "frames.json")
        .map(|e| {
            (
                e.file_name().into_string().unwrap(),
                std::fs::read(e.path()).unwrap(),
            )
        })
        .collect()
}

#[test]
fn killed_at_random_it_ends_with_the_same_bytes() {
    let kills: u32 = std::env::var("WOVEN_KILLS")
        .ok()
        .and_then(|n| n.parse().ok())
        .unwrap_or(2);
    let (frames, spp) = if kills > 2 { (24, 8) } else { (4, 8) };
    let dir = tempfile::tempdir().unwrap();
    stage(dir.path(), frames);
    let whole = dir.path().join("whole");
    let began = Instant::now();
    assert!(
        animate(dir.path(), &whole, frames, spp)
            .status()
            .unwrap()
            .success()
    );
    let one = began.elapsed() / frames;
    let want = files(&whole);
    assert_eq!(want.len(), frames as usize);

    let (mut r, mut done, mut torn, mut ends) = (Random(7), 0, 0, 0);
    while done < kills {
        let out = dir.path().join(format!("killed{ends}"));
        loop {
            let mut child = animate(dir.path(), &out, frames, spp).spawn().unwrap();
            // Up to a frame and a half: in the loading, in the middle of a frame, in the writing.
            std::thread::sleep(
                one.mul_f64(r.below(1500) as f64 / 1000.0) + Duration::from_millis(5),
            );
            if child.try_wait().unwrap().is_some() {
                break;
            }
            // SIGKILL on Unix: nothing can be tidied up.
            child.kill().unwrap();
            child.wait().unwrap();
            done += 1;
            if out.is_dir() {
                // No frame is half there under its name, and each that is there is right.
                for (name, bytes) in files(&out) {
                    match want.get(&name) {
                        Some(good) => assert!(*good == bytes, "{name} differs after kill {done}"),
                        None => {
                            assert!(name.starts_with(".woven-"), "{name} was left behind");
                            torn += 1;
                        }
                    }
                }
            }
            if done >= kills {
                break;
            }
        }
        assert!(
            animate(dir.path(), &out, frames, spp)
                .status()
                .unwrap()
                .success()
        );
        let got = files(&out);
        for (name, good) in &want {
            assert!(got.get(name) == Some(good), "{name} differs in the end");
        }
        assert_eq!(got.len(), want.len(), "the end leaves nothing else behind");
        ends += 1;
    }
    eprintln!(
        "{done} kills in {ends} animations of {frames} frames, {torn} looks saw a torn temporary file, all bytes the same"
    );
}
