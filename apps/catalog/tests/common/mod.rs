//! A tiny catalog with a measurement made up by formula, for tests of the whole run.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const CATALOG: &str = r#"
title = "Tiny"
[fit]
models = ["sheet"]
starts = 2
[motion]
frames = 6
fps = 24
blend = 2
wind = 1.0
mesh = [66, 10]
[picture]
size = [40, 32]
samples = 2
still_samples = 4
depth = 2
[[fabric]]
id = "cloth"
name = "A cloth"
measurement = "cloth.csv"
"#;

/// Writes `tiny.toml` and its measurement into `folder`: a diffuse cloth, 8 % open, seen from 30 directions at two incidences.
pub(crate) fn catalog(folder: &Path) {
    fs::write(folder.join("tiny.toml"), CATALOG).unwrap();
    let mut csv = String::from(
        "# made by formula for a test\n# direct,0,0,0.08,0.001\n# direct,30,0,0.06,0.001\ntheta_l_deg,phi_l_deg,theta_v_deg,phi_v_deg,f,sigma\n",
    );
    for theta_l in [0.0, 30.0] {
        for step in 0..30_u32 {
            let (theta_v, phi_v) = (100.0 + 2.5 * f64::from(step), 72.0 * f64::from(step % 5));
            let f = 0.25 / std::f64::consts::PI + 0.05 * (-(180.0 - theta_v) / 25.0_f64).exp();
            let _ = writeln!(csv, "{theta_l},0,{theta_v},{phi_v},{f:.6},0.001");
        }
    }
    fs::write(folder.join("cloth.csv"), csv).unwrap();
}

/// `woven-catalog` with these words, started in `folder`.
pub(crate) fn command(folder: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_woven-catalog"));
    command.current_dir(folder).args(words);
    command
}

/// Runs it to its end.
pub(crate) fn run(folder: &Path, words: &[&str]) -> Output {
    command(folder, words).output().unwrap()
}

/// What it said on stderr.
pub(crate) fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[allow(dead_code, reason = "each test program uses its part of this file")]
/// All files below `folder` by their relative names.
pub(crate) fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    fn visit(root: &Path, folder: &Path, out: &mut BTreeMap<String, Vec<u8>>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                visit(root, &path, out);
            } else {
                out.insert(
                    path.strip_prefix(root)
                        .unwrap()
                        .to_string_lossy()
                        .into_owned(),
                    fs::read(&path).unwrap(),
                );
            }
        }
    }
    let mut out = BTreeMap::new();
    visit(folder, folder, &mut out);
    out
}
