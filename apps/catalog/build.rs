//! Hashes the sources that a catalog depends on, so that products of another build of the same version are not taken for current,
//! and lists the files of `assets/measurements` so that the program carries them.

use std::fs;
use std::path::{Path, PathBuf};

/// Folders, from this one, whose `.rs`, `.wgsl`, `.css` and `.js` files decide what a catalog looks like.
const SOURCES: [&str; 5] = [
    "src",
    "../../crates/woven-bsdf/src",
    "../../crates/woven-fit/src",
    "../../crates/woven-cloth/src",
    "../../crates/woven-render/src",
];

fn main() {
    let root = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let mut hash = Fnv(0xcbf2_9ce4_8422_2325);
    for folder in SOURCES {
        println!("cargo::rerun-if-changed={folder}");
        visit(&root, &root.join(folder), &mut hash);
    }
    println!("cargo::rustc-env=WOVEN_SOURCES={:016x}", hash.0);
    embed(&root.join("../../assets/measurements"));
}

/// Writes a table of (name, contents) of the files in `folder`, in the order of their names.
fn embed(folder: &Path) {
    println!("cargo::rerun-if-changed={}", folder.display());
    let mut paths: Vec<PathBuf> = fs::read_dir(folder)
        .map(|entries| entries.filter_map(|e| e.ok().map(|e| e.path())).collect())
        .unwrap_or_default();
    paths.retain(|p| {
        p.is_file()
            && !p
                .file_name()
                .is_some_and(|n| n.to_string_lossy().starts_with('.'))
    });
    paths.sort();
    let mut table = String::from("&[\n");
    for path in paths {
        let path = path.canonicalize().unwrap_or(path);
        let name = path
            .file_name()
            .map(|n| n.to_string_lossy().into_owned())
            .unwrap_or_default();
        table += &format!("    ({name:?}, include_bytes!({path:?}) as &[u8]),\n");
    }
    table += "]\n";
    let out = PathBuf::from(std::env::var_os("OUT_DIR").unwrap_or_default());
    fs::write(out.join("measurements.rs"), table).expect("the build folder can be written");
}

/// Takes in the files of a folder in the order of their names; `\r` is passed over, for checkouts with other line ends.
fn visit(root: &Path, folder: &Path, hash: &mut Fnv) {
    let Ok(entries) = fs::read_dir(folder) else {
        return;
    };
    let mut paths: Vec<PathBuf> = entries.filter_map(|e| e.ok().map(|e| e.path())).collect();
    paths.sort();
    for path in paths {
        if path.is_dir() {
            visit(root, &path, hash);
        } else if path
            .extension()
            .and_then(|e| e.to_str())
            .is_some_and(|e| ["rs", "wgsl", "css", "js"].contains(&e))
        {
            let name = path
                .strip_prefix(root)
                .unwrap_or(&path)
                .to_string_lossy()
                .replace('\\', "/");
            hash.take(name.as_bytes());
            hash.take(&fs::read(&path).unwrap_or_default());
        }
    }
}

/// Fowler, Noll, Vo: 64-bit FNV-1a. Not against malice; it tells one build from another.
struct Fnv(u64);

impl Fnv {
    fn take(&mut self, bytes: &[u8]) {
        for &byte in bytes.iter().filter(|b| **b != b'\r').chain(&[0]) {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}
