//! Sixty and more URIs that must not open anything outside the scene's folder.

use std::fs;
use std::path::Path;
use woven_render::scene::gltf::{Options, load_bytes, resolve};

/// A folder with a scene folder inside and secrets around it.
struct Trap {
    dir: tempfile::TempDir,
}

const SECRET: &[u8] = b"SECRET--SECRET--SECRET--SECRET--SECRET--";

impl Trap {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        let scene = dir.path().join("scene");
        fs::create_dir_all(scene.join("sub")).unwrap();
        fs::write(dir.path().join("secret.bin"), SECRET).unwrap();
        // A sibling whose name begins like the scene's folder, and what odd decoders would look for inside.
        fs::create_dir(dir.path().join("scene2")).unwrap();
        fs::write(dir.path().join("scene2/secret.bin"), SECRET).unwrap();
        fs::write(scene.join("good.bin"), SECRET).unwrap();
        Trap { dir }
    }

    fn scene(&self) -> std::path::PathBuf {
        self.dir.path().join("scene")
    }

    fn kinds(&self) -> Vec<String> {
        let outside = self.dir.path().join("secret.bin").display().to_string();
        let plain = [
            "../secret.bin",
            "./../secret.bin",
            "sub/../../secret.bin",
            "sub/../good.bin",
            "../scene/good.bin",
            "..",
            ".",
            "./",
            "/",
            "sub",
            "sub/",
            "%2e%2e/secret.bin",
            "%2E%2E/secret.bin",
            ".%2e/secret.bin",
            "%2e./secret.bin",
            "..%2fsecret.bin",
            "..%2Fsecret.bin",
            "%2e%2e%2fsecret.bin",
            "%252e%252e/secret.bin",
            "%252e%252e%252fsecret.bin",
            "..%255csecret.bin",
            "..\\secret.bin",
            "..%5csecret.bin",
            "..%5Csecret.bin",
            "sub\\..\\..\\secret.bin",
            "%c0%ae%c0%ae/secret.bin",
            "%c0%af",
            "%e0%80%ae",
            "a%FF.bin",
            "%",
            "%2",
            "%zz",
            "good.bin%00",
            "good.bin%00.png",
            "%00",
            "good.bin\u{0}",
            "good.bin\n",
            "\r\n../secret.bin",
            "",
            "file:../secret.bin",
            "FILE:../secret.bin",
            "http://127.0.0.1/secret.bin",
            "https://127.0.0.1/secret.bin",
            "ftp://127.0.0.1/x",
            "//127.0.0.1/share/secret.bin",
            "\\\\127.0.0.1\\share\\secret.bin",
            "C:\\secret.bin",
            "C:/secret.bin",
            "c:secret.bin",
            "good.bin:stream",
            "good.bin::$DATA",
            "good.bin?x",
            "good.bin#x",
            "good.bin%3fx",
            "good.bin%23",
            "javascript:1",
            "blob:x",
            "data:",
            "data:;base64",
            "data:text/plain,abc",
            "data:;base64,####",
            "DATA:;base64,Zm9v",
            "/dev/zero",
            "/dev/stdin",
            "/proc/self/mem",
            "%2fetc%2fpasswd",
            "/etc/passwd",
            "~/secret.bin",
            "$HOME/secret.bin",
            "../scene2/secret.bin",
            "CON",
            "nul.bin",
            "aux.bin",
            "COM1",
            "lpt9.txt",
            "good.bin.",
            "good.bin ",
            "..../secret.bin",
            "sub/.../secret.bin",
            "\u{ff0e}\u{ff0e}/secret.bin",
            "\u{2024}\u{2024}/secret.bin",
        ];
        let mut all: Vec<String> = plain.iter().map(ToString::to_string).collect();
        all.push(outside.clone());
        all.push(format!("file://{outside}"));
        all.push(format!("file:{outside}"));
        all.push(format!("file://localhost{outside}"));
        all.push(outside.replace('/', "%2f"));
        all.push("a/".repeat(4000) + "x");
        all
    }
}

#[test]
fn none_of_them_opens_anything() {
    let trap = Trap::new();
    let kinds = trap.kinds();
    assert!(kinds.len() >= 60, "{}", kinds.len());
    assert!(
        resolve(&trap.scene(), "good.bin").is_ok(),
        "the good one must open, or the test proves nothing"
    );
    for uri in &kinds {
        let told = resolve(&trap.scene(), uri).expect_err(uri);
        let told = format!("{told:#}");
        assert!(
            told.contains("is refused") && !told.contains("SECRET"),
            "{uri}: {told}"
        );
        assert!(
            told.chars().count() < 700,
            "{uri}: a sentence of {} letters",
            told.chars().count()
        );
    }
}

#[test]
fn nor_as_a_buffer_a_picture_or_a_fabric_of_a_scene() {
    let trap = Trap::new();
    for uri in trap.kinds() {
        let scenes = [
            serde_json::json!({ "asset": { "version": "2.0" }, "buffers": [{ "byteLength": 12, "uri": uri }] }),
            serde_json::json!({ "asset": { "version": "2.0" }, "scenes": [{}], "images": [{ "uri": uri }], "textures": [{ "source": 0 }],
                "materials": [{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }] }),
            serde_json::json!({ "asset": { "version": "2.0" }, "scenes": [{}], "materials": [{ "extras": { "woven": uri } }] }),
        ];
        for scene in scenes {
            let bytes = serde_json::to_vec(&scene).unwrap();
            let told = load_bytes(&bytes, &trap.scene(), &Options::default()).expect_err(&uri);
            assert!(
                format!("{told:#}").contains("is refused"),
                "{uri}: {told:#}"
            );
        }
    }
}

#[cfg(unix)]
#[test]
fn links_may_stay_inside_but_not_lead_out() {
    use std::os::unix::fs::symlink;
    let trap = Trap::new();
    let scene = trap.scene();
    symlink("good.bin", scene.join("inside.bin")).unwrap();
    symlink("../secret.bin", scene.join("out.bin")).unwrap();
    symlink(trap.dir.path(), scene.join("up")).unwrap();
    symlink("loop.bin", scene.join("loop.bin")).unwrap();
    assert!(resolve(&scene, "inside.bin").is_ok());
    for uri in ["out.bin", "up/secret.bin", "loop.bin"] {
        assert!(resolve(&scene, uri).is_err(), "{uri}");
    }
    // A scene reached through a link is at home where the link leads.
    symlink(&scene, trap.dir.path().join("alias")).unwrap();
    assert!(resolve(&trap.dir.path().join("alias"), "good.bin").is_ok());
    assert!(resolve(Path::new("no/such/folder"), "good.bin").is_err());
}
