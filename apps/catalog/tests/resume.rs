//! A run that is killed, stopped or shared out ends with the same bytes as one that was left alone.

mod common;

use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

use common::{catalog, command, files, run, said};

const WORDS: [&str; 5] = ["tiny.toml", "--backend", "cpu", "-o", "out"];

/// The products of an undisturbed run in a folder of its own.
fn undisturbed() -> (
    tempfile::TempDir,
    std::collections::BTreeMap<String, Vec<u8>>,
) {
    let folder = tempfile::tempdir().unwrap();
    catalog(folder.path());
    let output = run(folder.path(), &WORDS);
    assert!(output.status.success(), "{}", said(&output));
    let products = files(&folder.path().join("out"));
    (folder, products)
}

fn same(products: &std::collections::BTreeMap<String, Vec<u8>>, folder: &Path) {
    let mut found = files(&folder.join("out"));
    // What was being written at the moment of a kill stays behind under a name of its own.
    found.retain(|name, _| !name.ends_with(".tmp"));
    assert_eq!(
        products.keys().collect::<Vec<_>>(),
        found.keys().collect::<Vec<_>>()
    );
    for (name, bytes) in products {
        assert!(found[name] == *bytes, "{name} differs");
    }
}

#[test]
fn killed_again_and_again_it_ends_with_the_same_bytes() {
    let (_keep, products) = undisturbed();
    assert!(
        products.contains_key("index.html")
            && products.contains_key("cloth/day.mp4")
            && products.contains_key("work/cloth/evening/0006.png")
    );

    let folder = tempfile::tempdir().unwrap();
    catalog(folder.path());
    let mut kills = 0;
    let mut patience = 60;
    loop {
        let mut child = command(folder.path(), &WORDS)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(patience));
        if let Some(status) = child.try_wait().unwrap() {
            assert!(status.success());
            break;
        }
        child.kill().unwrap(); // SIGKILL on Unix
        child.wait().unwrap();
        kills += 1;
        // Each time a little longer, so that fit and simulation, which start anew, are got over.
        patience += patience / 4;
    }
    assert!(
        kills >= 3,
        "only {kills} kills: the run is too short for this test"
    );
    same(&products, folder.path());

    // A torn product, as by a disk that lost its last writes, is made anew.
    let frame = folder.path().join("out/work/cloth/day/0003.png");
    std::fs::write(&frame, &products["work/cloth/day/0003.png"][..40]).unwrap();
    assert!(run(folder.path(), &WORDS).status.success());
    same(&products, folder.path());

    // Two shards, one after the other: the first makes no page, the second does.
    let folder = tempfile::tempdir().unwrap();
    catalog(folder.path());
    let shard = |part: &str| run(folder.path(), &[&WORDS[..], &["--shard", part]].concat());
    let first = shard("1/2");
    assert!(first.status.success() && String::from_utf8_lossy(&first.stdout).contains("missing"));
    assert!(!folder.path().join("out/index.html").exists());
    assert!(shard("2/2").status.success());
    for (name, bytes) in files(&folder.path().join("out"))
        .iter()
        .filter(|(name, _)| name.ends_with(".png") || name.ends_with(".mp4"))
    {
        assert!(products[name] == *bytes, "{name} differs");
    }
}

#[cfg(unix)]
#[test]
fn ctrl_c_stops_with_a_sentence_and_the_next_run_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    catalog(folder.path());
    // Enough samples that it surely is not done before the signal.
    let words = [&WORDS[..], &["--spp", "4096"]].concat();
    let child = command(folder.path(), &words)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let clip = folder.path().join("out/cloth/curtain.glb");
    for _ in 0..1200 {
        if clip.exists() {
            break;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    let signalled = std::process::Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(signalled.success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", said(&output));
    assert!(
        said(&output).contains("stopped on request"),
        "{}",
        said(&output)
    );
    assert!(clip.exists() && !folder.path().join("out/index.html").exists());
}
