//! The arrows between crates go down only, and big dependencies are named in one place.

use std::collections::BTreeMap;
use woven_tests::{root, sources};

/// Who may use whom inside the workspace (`dev-dependencies` of a crate may use nothing more).
const ARROWS: &[(&str, &str, &[&str])] = &[
    ("crates/woven-bsdf", "woven-bsdf", &[]),
    ("crates/woven-cloth", "woven-cloth", &[]),
    ("crates/woven-fit", "woven-fit", &["woven-bsdf"]),
    ("crates/woven-render", "woven-render", &["woven-bsdf"]),
    ("crates/ogm-driver", "ogm-driver", &["woven-bsdf"]),
    (
        "apps/catalog",
        "woven-catalog",
        &["woven-bsdf", "woven-cloth", "woven-fit", "woven-render"],
    ),
    (
        "apps/viewer",
        "woven-viewer",
        &[
            "woven-bsdf",
            "woven-catalog",
            "woven-cloth",
            "woven-fit",
            "woven-render",
        ],
    ),
];

/// A crate and the only places whose sources may name it.
const NAMED_IN: &[(&str, &[&str])] = &[
    ("wgpu", &["crates/woven-render/src/gpu", "apps/viewer"]),
    ("serialport", &["crates/ogm-driver/src/serial.rs"]),
    ("egui", &["apps/viewer"]),
    ("obvhs", &["crates/woven-render/src"]),
    ("openh264", &["apps/catalog"]),
    ("roxmltree", &["crates/woven-bsdf/src/measured"]),
];

fn manifest(folder: &str) -> toml::Table {
    let path = root().join(folder).join("Cargo.toml");
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    text.parse()
        .unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

#[test]
fn crates_depend_downwards_only() {
    let ours: BTreeMap<&str, &[&str]> = ARROWS
        .iter()
        .map(|(_, name, allowed)| (*name, *allowed))
        .collect();
    for (folder, name, allowed) in ARROWS {
        let manifest = manifest(folder);
        for table in ["dependencies", "dev-dependencies", "build-dependencies"] {
            let Some(dependencies) = manifest.get(table).and_then(|t| t.as_table()) else {
                continue;
            };
            for used in dependencies
                .keys()
                .filter(|k| ours.contains_key(k.as_str()) && k != name)
            {
                assert!(
                    allowed.contains(&used.as_str()),
                    "{name} must not use {used} ({folder}/Cargo.toml, [{table}])"
                );
            }
        }
    }
}

#[test]
fn every_member_is_guarded() {
    let members = manifest(".")["workspace"]["members"]
        .as_array()
        .expect("a list")
        .clone();
    for member in members
        .iter()
        .filter_map(|m| m.as_str())
        .filter(|m| *m != "tests")
    {
        assert!(
            ARROWS.iter().any(|(folder, _, _)| *folder == member),
            "{member} has no line in ARROWS"
        );
    }
}

#[test]
fn versions_live_in_the_workspace_table() {
    for (folder, name, _) in ARROWS {
        let manifest = manifest(folder);
        for table in ["dependencies", "dev-dependencies"] {
            for (dependency, value) in manifest
                .get(table)
                .and_then(|t| t.as_table())
                .into_iter()
                .flatten()
            {
                let inherits = value.get("workspace").and_then(|w| w.as_bool()) == Some(true);
                assert!(inherits, "{name}: {dependency} must be `workspace = true`");
            }
        }
    }
}

/// Whether a line of code (not of documentation) names the crate as a path or an import.
fn names(line: &str, krate: &str) -> bool {
    let code = line.trim_start();
    if code.starts_with("//") {
        return false;
    }
    let path = format!("{krate}::");
    let at_start =
        |i: usize| i == 0 || !code[..i].ends_with(|c: char| c.is_alphanumeric() || c == '_');
    code.match_indices(&path).any(|(i, _)| at_start(i))
        || code.starts_with(&format!("use {krate};"))
}

#[test]
fn big_dependencies_are_named_in_one_place() {
    for (krate, places) in NAMED_IN {
        for path in sources("crates").into_iter().chain(sources("apps")) {
            let shown = path
                .strip_prefix(root())
                .expect("below the root")
                .to_string_lossy()
                .into_owned();
            if places.iter().any(|p| shown.starts_with(p)) {
                continue;
            }
            let text = std::fs::read_to_string(&path).expect("a source reads");
            if let Some(n) = text.lines().position(|l| names(l, krate)) {
                panic!(
                    "{shown}:{} names {krate}, which belongs into {}",
                    n + 1,
                    places.join(", ")
                );
            }
        }
    }
}

#[test]
fn the_guard_sees() {
    assert!(names("use wgpu::Device;", "wgpu"));
    assert!(names("    let d: wgpu::Device = x;", "wgpu"));
    assert!(!names("use egui_wgpu::Device;", "wgpu"));
    assert!(!names("/// wgpu::Device", "wgpu"));
    assert!(!names("let x = egui_wgpu::wgpu_core();", "wgpu"));
}
