//! A catalog of a fabric file: nothing is fitted, and its map of openness is hung, rendered and put beside the page.

mod common;

use std::fs;
use std::path::Path;

use common::{catalog, run, said};

/// A close cloth with a hole of a third of its area in each repeat of the map.
const LACE: &str = "
name = \"the maker's lace\"
[weave]
warp_diameter_mm = 0.2
warp_pitch_mm = 0.2
weft_diameter_mm = 0.2
weft_pitch_mm = 0.2
openness_map = \"holes.png\"
map_repeats = [4, 4]
[optics]
model = \"sheet\"
[optics.parameters]
t_d = 0.2
r_d = 0.5
[provenance]
card = \"pattern card 12\"
";

/// The page and the still of a catalog in `folder` whose cloth is the lace, with the map as it is there.
fn made(folder: &Path) -> (String, Vec<u8>) {
    let output = run(folder, &["lace.toml", "--backend", "cpu", "-o", "out"]);
    assert!(output.status.success(), "{}", said(&output));
    let out = folder.join("out");
    (
        fs::read_to_string(out.join("index.html")).unwrap(),
        fs::read(out.join("cloth/day-rest.png")).unwrap(),
    )
}

#[test]
fn a_fabric_file_is_hung_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    catalog(here);
    let tiny = fs::read_to_string(here.join("tiny.toml")).unwrap();
    let lace = tiny
        .replace(
            "measurement = \"cloth.csv\"",
            "fabric_file = \"cloth.toml\"",
        )
        .replace("frames = 6", "frames = 1")
        .replace("blend = 2", "blend = 0");
    fs::write(here.join("lace.toml"), &lace).unwrap();
    fs::write(here.join("cloth.toml"), LACE).unwrap();

    let missing = run(here, &["lace.toml"]);
    assert_eq!(missing.status.code(), Some(1));
    let text = said(&missing);
    assert!(
        text.contains("holes.png") && text.contains("cannot be read"),
        "{text}"
    );

    let holes = |white: bool| {
        let rows = (0..6 * 6).map(|i| if white && i % 3 == 0 { 255 } else { 0 });
        let map = image::GrayImage::from_raw(6, 6, rows.collect()).unwrap();
        map.save(here.join("holes.png")).unwrap();
    };
    holes(true);
    let (page, open) = made(here);
    // A third of the area by the map, nothing by the yarns, which touch.
    for part in [
        "33 % open",
        "pattern card 12",
        "cloth/holes.png",
        "Made from the fabric file",
    ] {
        assert!(page.contains(part), "{part:?} is missing in the page");
    }
    for part in ["Measured and fitted", "fit.html", "Ranking"] {
        assert!(
            !page.contains(part),
            "{part:?} in the page of what was not fitted"
        );
    }
    assert_eq!(
        fs::read(here.join("out/cloth/holes.png")).unwrap(),
        fs::read(here.join("holes.png")).unwrap()
    );

    // Another map under the same name: other pictures, in the same folder.
    holes(false);
    let (page, closed) = made(here);
    assert!(!page.contains("33 % open"));
    let luma = |png: &[u8]| image::load_from_memory(png).unwrap().into_luma8();
    let (open, closed) = (luma(&open), luma(&closed));
    let changed = open.iter().zip(closed.iter());
    let changed = changed.filter(|(a, b)| a.abs_diff(**b) > 8).count();
    // The curtain takes about a sixth of the picture; the same picture twice would differ nowhere.
    assert!(changed * 12 > open.len(), "holes change {changed} pixels");
}

#[test]
fn one_source_a_fabric() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    catalog(here);
    let tiny = fs::read_to_string(here.join("tiny.toml")).unwrap();
    let words = |line: &str| {
        fs::write(
            here.join("lace.toml"),
            tiny.replace("measurement = \"cloth.csv\"", line),
        )
        .unwrap();
        let output = run(here, &["lace.toml"]);
        assert_eq!(output.status.code(), Some(1), "{line}");
        said(&output)
    };
    let both = words("measurement = \"cloth.csv\"\nfabric_file = \"cloth.toml\"");
    for text in [both, words("")] {
        assert!(text.contains("either a `measurement`"), "{text}");
    }
    assert!(words("fabric_file = \"gone.toml\"").contains("gone.toml"));
    fs::write(
        here.join("matt.toml"),
        "name = \"m\"\n[optics]\nmodel = \"lambert\"\n",
    )
    .unwrap();
    let text = words("fabric_file = \"matt.toml\"");
    assert!(text.contains("\"cloth\" cannot be rendered"), "{text}");
}
