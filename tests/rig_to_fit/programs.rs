//! The workspace's programs, run as a user runs them.

use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::time::SystemTime;

/// A program of the workspace beside this test; built first when it is not there or older than its sources.
pub(crate) fn program(name: &str, package: &str) -> PathBuf {
    let test = std::env::current_exe().expect("a path");
    let profile = test.ancestors().nth(2).expect("target/profile/deps/test");
    let path = profile.join(name);
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let sources =
        ["ogm-driver", "woven-fit", "woven-bsdf"].map(|c| root.join("crates").join(c).join("src"));
    let newest = sources.iter().filter_map(|s| newest(s)).max();
    let built = std::fs::metadata(&path).and_then(|m| m.modified()).ok();
    if built.is_none() || built < newest {
        let target = profile.parent().expect("target");
        let mut cargo = Command::new(env!("CARGO"));
        cargo.args([
            "build",
            "--offline",
            "-p",
            package,
            "--bin",
            name,
            "--target-dir",
        ]);
        cargo.arg(target).current_dir(root);
        if profile.ends_with("release") {
            cargo.arg("--release");
        }
        assert!(
            cargo.status().expect("cargo runs").success(),
            "{name} cannot be built"
        );
    }
    path
}

/// When the newest file below a folder was changed.
fn newest(folder: &Path) -> Option<SystemTime> {
    let entries = std::fs::read_dir(folder).ok()?.flatten();
    let each = entries.map(|e| match e.metadata() {
        Ok(m) if m.is_dir() => newest(&e.path()),
        Ok(m) => m.modified().ok(),
        Err(_) => None,
    });
    each.max().flatten()
}

/// Ends a program when the test ends, however that is.
pub(crate) struct Ended(pub(crate) Child);

impl Drop for Ended {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Runs a program to its end; it must succeed.
pub(crate) fn run(program: &Path, folder: &Path, arguments: &[&str]) {
    let done = Command::new(program)
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("it runs");
    let error = String::from_utf8_lossy(&done.stderr);
    assert!(
        done.status.success(),
        "{} {arguments:?}: {error}",
        program.display()
    );
}
