//! The command line as scripts rely on it: answers, exit codes, sentences for bad input.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn run(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_woven-fit"))
        .args(args)
        .output()
        .expect("the binary runs")
}

fn measurement() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../assets/measurements/mecho_6216_goniometer.xml")
}

/// A sentence on stderr, exit code 1, no panic.
fn refused(output: &Output, words: &[&str]) {
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(matches!(output.status.code(), Some(1 | 2)), "{text}");
    assert!(!text.contains("panicked"), "{text}");
    for word in words {
        assert!(text.contains(word), "no {word:?} in {text}");
    }
}

#[test]
fn a_truncated_file_is_a_sentence() {
    let dir = tempfile::tempdir().unwrap();
    let whole = std::fs::read(measurement()).unwrap();
    let path = dir.path().join("cut.xml");
    std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
    refused(&run(&["fit", path.to_str().unwrap()]), &["cut.xml", "XML"]);
    refused(&run(&["info", path.to_str().unwrap()]), &["cut.xml"]);
}

#[test]
fn unknown_names_are_sentences_that_help() {
    let path = measurement();
    let path = path.to_str().unwrap();
    refused(
        &run(&["fit", path, "--model", "velvet"]),
        &["velvet", "ggx-mirrored"],
    );
    refused(
        &run(&["eval", "--model", "lambert", "--param", "gloss=1", path]),
        &["gloss", "k_d"],
    );
    refused(&run(&["fit", path, "--metric", "cubic"]), &["cubic"]);
    refused(&run(&["fit"]), &["DATA"]);
    refused(&run(&["info", "nowhere.xml"]), &["nowhere.xml"]);
    refused(&run(&["info", "picture.jpeg"]), &["picture.jpeg"]);
}

#[test]
fn an_output_folder_that_cannot_be_made_is_a_sentence() {
    let dir = tempfile::tempdir().unwrap();
    // A file stands where the folder should be: also root cannot write there.
    let out = dir.path().join("taken");
    std::fs::write(&out, "a file").unwrap();
    let path = measurement();
    refused(
        &run(&[
            "fit",
            path.to_str().unwrap(),
            "--model",
            "lambert",
            "--out",
            out.to_str().unwrap(),
        ]),
        &["taken"],
    );
}

#[test]
fn eval_gives_the_lambert_floor() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("dirs.csv");
    std::fs::write(
        &path,
        "lx,ly,lz,vx,vy,vz\n0,0,1,0,0,-1\n0,0,2,0.6,0,-0.8\n0,0,1,0,0,1\n",
    )
    .unwrap();
    let output = run(&[
        "eval",
        "--model",
        "lambert",
        "--param",
        "k_d=0.5",
        path.to_str().unwrap(),
    ]);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let text = String::from_utf8(output.stdout).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "lx,ly,lz,vx,vy,vz,f,pdf");
    let f = |line: &str| line.split(',').nth(6).unwrap().parse::<f64>().unwrap();
    let floor = 0.5 / std::f64::consts::PI;
    assert!((f(lines[1]) - floor).abs() < 1e-12 && (f(lines[2]) - floor).abs() < 1e-12);
    assert_eq!(f(lines[3]), 0.0, "transmission only");
    std::fs::write(&path, "lx,ly,lz,vx,vy,vz\n0,0,zero,0,0,-1\n").unwrap();
    refused(
        &run(&["eval", "--model", "lambert", path.to_str().unwrap()]),
        &["line 2", "zero"],
    );
}

#[test]
fn models_as_json_list_every_parameter() {
    let output = run(&["models", "--json"]);
    let list: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let names: Vec<&str> = list
        .as_array()
        .unwrap()
        .iter()
        .map(|m| m["name"].as_str().unwrap())
        .collect();
    for name in ["lambert", "ward", "hgf", "ggx-mirrored", "sheet"] {
        assert!(names.contains(&name), "{names:?}");
    }
    assert!(list[0]["params"][0]["max"].as_f64().unwrap() > 0.0);
}

#[test]
fn info_tells_peak_skirt_and_floor_of_the_goniometer_file() {
    let path = measurement();
    let output = run(&["info", "--json", path.to_str().unwrap()]);
    let info: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let parts = &info["blocks"][0]["normal"];
    // The sums that come with the data: 0.0179 = 0.0128 + 0.0014 + 0.0037; within 5 %.
    for (part, want) in [("peak", 0.0128), ("skirt", 0.0014), ("floor", 0.0037)] {
        let found = parts[part].as_f64().unwrap();
        assert!(
            (found / want - 1.0).abs() < 0.05,
            "{part}: {found} for {want}"
        );
    }
}

#[test]
fn pab_text_is_read_like_the_scan_it_came_from() {
    let dir = tempfile::tempdir().unwrap();
    let ward = woven_bsdf::model::find("ward").unwrap();
    let scan = woven_fit::synth::scan_of(ward, &[0.2, 0.3, 0.2, 0.35], &[20.0], 0.0, 0);
    let pab = woven_bsdf::measured::pab::Pab::from_scan("ward", &scan);
    assert_eq!(pab.len(), 1, "one incidence, one file");
    let (csv, path) = (dir.path().join("ward.csv"), dir.path().join("ward.pab"));
    std::fs::write(&csv, scan.to_text()).unwrap();
    let output = run(&["convert", csv.to_str().unwrap(), path.to_str().unwrap()]);
    assert!(output.status.success(), "{output:?}");
    let lines = |text: &str| text.lines().count();
    let text = std::fs::read_to_string(&path).unwrap();
    assert_eq!(lines(&text), lines(&pab[0].to_text()));
    let data = woven_fit::measurement::Measurement::read(&path).unwrap();
    let points = data.points(true, woven_fit::measurement::Detail::Full, false);
    assert_eq!(points.points.len(), scan.samples.len());
    let output = run(&[
        "fit",
        path.to_str().unwrap(),
        "--model",
        "ward",
        "--out",
        dir.path().to_str().unwrap(),
    ]);
    assert!(output.status.success(), "{output:?}");
    let text = std::fs::read_to_string(dir.path().join("fit.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let alpha = json["ranking"][0]["parameters"].as_array().unwrap().iter();
    let alpha = alpha
        .filter(|p| p["name"] == "a_x")
        .map(|p| p["value"].as_f64().unwrap());
    // The text holds six digits or so.
    assert!(alpha.clone().count() == 1 && alpha.into_iter().all(|a| (a - 0.2).abs() < 1e-3));
}

#[test]
fn convert_to_csv_and_fit_that() {
    let dir = tempfile::tempdir().unwrap();
    let csv = dir.path().join("shade.csv");
    let path = measurement();
    let output = run(&["convert", path.to_str().unwrap(), csv.to_str().unwrap()]);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let out = dir.path().join("fit");
    let output = run(&[
        "fit",
        csv.to_str().unwrap(),
        "--model",
        "lambert",
        "--plane",
        "normal",
        "--plots",
        "--out",
        out.to_str().unwrap(),
    ]);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let json: serde_json::Value =
        serde_json::from_slice(&std::fs::read(out.join("fit.json")).unwrap()).unwrap();
    assert!(
        json["command"]
            .as_str()
            .unwrap()
            .starts_with("woven-fit fit")
    );
    assert!(json["notes"].to_string().contains("oblique"));
    assert!(
        std::fs::read_to_string(out.join("report.html"))
            .unwrap()
            .contains("</html>")
    );
    // Every figure in both forms, each with the command in its head.
    let mut figures = 0;
    for entry in std::fs::read_dir(&out).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "svg") {
            figures += 1;
            let svg = std::fs::read_to_string(&path).unwrap();
            assert!(svg.starts_with("<!-- woven-fit fit") && svg.ends_with("</svg>"));
            let png = std::fs::read(path.with_extension("png")).unwrap();
            assert!(png.starts_with(b"\x89PNG"), "{}", path.display());
            let head = b"woven-fit fit";
            assert!(png.windows(head.len()).any(|w| w == head));
        }
    }
    assert!(figures >= 5, "{figures}");
}

#[test]
fn many_files_make_one_table() {
    let dir = tempfile::tempdir().unwrap();
    let mut files = Vec::new();
    for seed in ["0", "1", "2"] {
        let path = dir.path().join(format!("set{seed}.csv"));
        let path = path.to_str().unwrap().to_owned();
        let output = run(&["synth", "paper79", "--seed", seed, "--out", &path]);
        assert!(output.status.success(), "{output:?}");
        files.push(path);
    }
    let out = dir.path().join("ranked");
    let mut args = vec![
        "rank",
        "--model",
        "ggx-mirrored,hgf,ward,phong",
        "--starts",
        "4",
    ];
    args.extend(files.iter().map(String::as_str));
    args.extend(["--out", out.to_str().unwrap()]);
    let output = run(&args);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let text = std::fs::read_to_string(out.join("rank.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert!(
        json["command"]
            .as_str()
            .unwrap()
            .starts_with("woven-fit rank")
    );
    assert_eq!(json["files"].as_array().unwrap().len(), 3);
    let rows = json["rows"].as_array().unwrap();
    let label = |i: usize| rows[i]["label"].as_str().unwrap();
    // The set is made so that the microfacet lobe wins and a bare cosine power loses.
    assert!(label(0).starts_with("ggx"), "{}", label(0));
    assert!(
        label(rows.len() - 1).starts_with("phong"),
        "{}",
        label(rows.len() - 1)
    );
    assert_eq!(rows[0]["first"], 3);
    let csv = std::fs::read_to_string(out.join("rank.csv")).unwrap();
    assert_eq!(csv.lines().count(), 2 + 3 * rows.len());
}

#[test]
fn synth_makes_scans_of_models_and_refuses_nonsense() {
    let output = run(&[
        "synth",
        "ward",
        "--param",
        "k_s=0.4",
        "--incidence",
        "0,30",
        "--seed",
        "5",
    ]);
    let text = String::from_utf8(output.stdout).unwrap();
    // Two comments, the header, and 79 angles in two planes at two incidences.
    assert_eq!(text.lines().count(), 3 + 4 * 79, "{text}");
    assert!(text.starts_with("# woven-fit synth ward"));
    refused(&run(&["synth", "velvet"]), &["velvet", "paper79", "ward"]);
    refused(&run(&["synth", "ward", "--incidence", "95"]), &["95"]);
}

#[test]
fn odd_rows_are_named_in_the_notes() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("odd.csv");
    let output = run(&["synth", "ward", "--out", path.to_str().unwrap()]);
    assert!(output.status.success(), "{output:?}");
    let mut text = std::fs::read_to_string(&path).unwrap();
    let last = text.lines().last().unwrap().to_owned();
    text += &format!("{last}\n0,0,90,0,0.1,\n");
    std::fs::write(&path, text).unwrap();
    let path = path.to_str().unwrap();
    for args in [vec!["fit", path, "--model", "lambert"], vec!["info", path]] {
        let text = String::from_utf8(run(&args).stdout).unwrap();
        assert!(
            text.contains("row 159 repeats row 158") && text.contains("row 160 left out"),
            "{text}"
        );
    }
}
