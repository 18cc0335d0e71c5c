//! What a user can get wrong is answered with a sentence that names it, and with exit code 1, or 2 for a wrong command line.

mod common;

use std::fs;

use common::{catalog, run, said};

#[test]
fn mistakes_are_answered_with_sentences() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    catalog(here);
    let tiny = fs::read_to_string(here.join("tiny.toml")).unwrap();
    fs::write(here.join("broken.toml"), "title = \"T\n").unwrap();
    fs::write(
        here.join("unknown.toml"),
        tiny.replace("fps = 24", "fps = 24\nspeed = 3"),
    )
    .unwrap();
    fs::write(
        here.join("lost.toml"),
        tiny.replace("cloth.csv", "nowhere.xml"),
    )
    .unwrap();
    fs::write(
        here.join("model.toml"),
        tiny.replace("[\"sheet\"]", "[\"velcro\"]"),
    )
    .unwrap();
    fs::write(
        here.join("stuff.toml"),
        tiny.replace("id = \"cloth\"", "id = \"cloth\"\nmechanics = \"tinfoil\""),
    )
    .unwrap();
    fs::write(
        here.join("truncated.toml"),
        tiny.replace("cloth.csv", "cut.xml"),
    )
    .unwrap();
    fs::write(
        here.join("cut.xml"),
        "<?xml version=\"1.0\"?><WindowElement><Optical><Layer>",
    )
    .unwrap();
    fs::write(here.join("file"), "not a folder").unwrap();
    let cases: &[(&[&str], i32, &[&str])] = &[
        (&["missing.toml"], 1, &["missing.toml", "cannot be read"]),
        (&["broken.toml"], 1, &["broken.toml", "line 1"]),
        (&["unknown.toml"], 1, &["unknown.toml", "speed"]),
        (&["lost.toml"], 1, &["nowhere.xml", "cannot be read"]),
        (&["model.toml"], 1, &["velcro", "choose from"]),
        (&["stuff.toml"], 1, &["tinfoil", "voile"]),
        (&["truncated.toml", "--backend", "cpu"], 1, &["cut.xml"]),
        (
            &["tiny.toml", "-o", "file/page"],
            1,
            &["file/page", "cannot be written", "-o"],
        ),
        (&["tiny.toml", "--size", "33x32"], 2, &["odd side"]),
        (&["tiny.toml", "--size", "big"], 2, &["640x480"]),
        (&["tiny.toml", "--shard", "3/2"], 2, &["2/4"]),
        (&["tiny.toml", "--frames", "0"], 2, &["--frames"]),
        (&["tiny.toml", "--colour"], 2, &["--colour"]),
    ];
    for (words, code, parts) in cases {
        let output = run(here, words);
        let text = said(&output);
        assert_eq!(output.status.code(), Some(*code), "{words:?}: {text}");
        for part in *parts {
            assert!(
                text.contains(part),
                "{words:?} should name {part:?}: {text}"
            );
        }
        assert!(!text.contains("panicked"), "{words:?}: {text}");
    }
}

#[test]
fn a_folder_that_cannot_be_written_is_named() {
    // Not even the superuser can make a folder here.
    if !std::path::Path::new("/proc/self").exists() {
        println!("skipped: no /proc on this system");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    catalog(folder.path());
    let output = run(folder.path(), &["tiny.toml", "-o", "/proc/catalog"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        said(&output).contains("/proc/catalog cannot be written"),
        "{}",
        said(&output)
    );
}
