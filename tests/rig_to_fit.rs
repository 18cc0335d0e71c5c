//! From cloth on the rig to its parameters: the simulated goniometer measures a fabric, the log becomes a measurement, the measurement is fitted, and
//! the fabric's own numbers come back within the error bars; then how many poses that takes.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::SystemTime;

use ogm_driver::design::Design;
use ogm_driver::plan::{Grid, Plan};
use ogm_driver::pose::Pose;
use ogm_driver::rig::Rig;
use ogm_driver::transport::StopToken;
use ogm_driver::{merge, scan, sim};
use woven_bsdf::fabric::Fabric;
use woven_fit::fit::{Options, Parameter, fit_measurement, quiet};

const LACE: &str = r#"
    name = "lace of known parameters"
    [optics]
    model = "sheet"
    parameters = { t_d = 0.25, k_t = 0.20, r_d = 0.40, gamma_warp = 0.6, gamma_weft = 0.5, section = 1.0, alpha_x = 0.30, alpha_y = 0.15 }
"#;

const PLAN: &str = r#"
    name = "five incidences in three planes: thirteen straight-through readings for the three numbers of the gap"
    forbidden = "leave-out"
    [grid]
    kind = "uniform"
    theta_l = [0, 10, 20, 30, 40]
    phi_l = [0, 45, 90]
    theta_v = { from = 112, to = 176, step = 8 }
    phi_v = [-90, 0, 90, 180]
"#;

/// A fitted parameter: name, value, 95 % interval.
type Row = (String, f64, (f64, f64));

/// How many of a fabric's own numbers lie in the intervals, and how many intervals there are; prints the table.
fn covered(fabric: &Fabric, rows: &[Row]) -> (usize, usize) {
    let (mut inside, mut all) = (0, 0);
    println!(
        "{:<12} {:>9} {:>9}   95 % interval",
        "parameter", "truth", "fitted"
    );
    for (name, value, (low, high)) in rows {
        let Some(&truth) = fabric.optics.parameters.get(name.as_str()) else {
            continue;
        };
        // The fit's interval comes from the scatter of the values about the model. What all values share (the direct beam, the dark level, the light
        // under the straight beam) is not in it: 0.2 % of the number are allowed for that, twice the largest seen.
        let shared = 0.002 * truth;
        let here = (low - shared..=high + shared).contains(&truth);
        let word = if here { "" } else { "  outside" };
        println!("{name:<12} {truth:>9.5} {value:>9.5}   {low:.5}..{high:.5}{word}");
        inside += usize::from(here);
        all += 1;
        // An interval as wide as the number itself would hold anything.
        assert!(
            high - low < 0.2 * truth,
            "{name}: {low}..{high} tells nothing"
        );
    }
    (inside, all)
}

/// Measures a fabric in memory, on virtual time; returns the measurement's file.
fn measure(fabric: &Fabric, rig: &Rig, plan: &Plan, seed: u64, folder: &Path) -> PathBuf {
    let cloth = Arc::new(sim::fabric::FabricSample::new(fabric).expect("it can be measured"));
    let wrong = sim::Imperfections {
        seed,
        ..sim::Imperfections::default()
    };
    let bench = sim::Bench::new(rig.clone(), cloth, wrong);
    let device = Arc::new(Mutex::new(sim::Device::new(bench, sim::FaultPlan::none())));
    let transport = Box::new(sim::MemoryTransport::new(device));
    let log = folder.join("scan.ogm");
    let _ = std::fs::remove_file(&log);
    let outcome = scan::run(
        transport,
        rig,
        plan,
        &log,
        &StopToken::new(),
        &mut scan::Quiet,
    )
    .expect("a scan");
    assert_eq!(outcome.stored, outcome.points);
    let csv = folder.join("scan.csv");
    let measurement = merge::merge_log(&log).expect("it merges");
    measurement.write_csv(&csv).expect("it is written");
    csv
}

fn fit(csv: &Path, model: &str) -> Vec<Parameter> {
    let options = Options {
        models: Some(vec![model.into()]),
        starts: 4,
        ..Options::default()
    };
    let result = fit_measurement(csv, &options, &quiet).expect("it fits");
    result.ranking[0].parameters.clone()
}

/// A program of the workspace beside this test; built first when it is not there or older than its sources.
fn program(name: &str, package: &str) -> PathBuf {
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
struct Ended(Child);

impl Drop for Ended {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn run(program: &Path, folder: &Path, arguments: &[&str]) {
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

/// Names, values and intervals out of `fit.json`: each parameter has its fields in alphabetical order.
fn rows_of(json: &str) -> Vec<Row> {
    let numbers = |text: &str| -> Vec<f64> {
        let words = text.split([',', '[', ']', '{', '}', '\n']);
        words.filter_map(|w| w.trim().parse().ok()).collect()
    };
    let mut rows = Vec::new();
    // The first model of the ranking alone.
    let best = json.split("\"parameters\":").nth(1).expect("parameters");
    for part in best.split("\"interval95\":").skip(1) {
        let (interval, rest) = part.split_once("\"name\":").expect("a name");
        let name = rest.split('"').nth(1).expect("a word").to_string();
        let (_, value) = rest.split_once("\"value\":").expect("a value");
        if let [low, high, ..] = numbers(interval)[..] {
            rows.push((name, numbers(value)[0], (low, high)));
        }
    }
    rows
}

#[test]
fn the_programs_give_the_cloth_back() {
    let (ogm, woven_fit) = (
        program("ogm", "ogm-driver"),
        program("woven-fit", "woven-fit"),
    );
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    std::fs::write(folder.join("lace.toml"), LACE).expect("a file");
    std::fs::write(folder.join("plan.toml"), PLAN).expect("a file");
    let mut sim = Command::new(&ogm)
        .args([
            "sim",
            "--fabric",
            "lace.toml",
            "--rig",
            "instant",
            "--speed",
            "1000",
            "--link",
            "rig0",
        ])
        .current_dir(folder)
        .stdout(Stdio::piped())
        .spawn()
        .expect("it runs");
    let mut port = String::new();
    let out = sim.stdout.take().expect("its output");
    let _sim = Ended(sim);
    BufReader::new(out)
        .read_line(&mut port)
        .expect("the port's name");
    assert!(port.starts_with("/dev/"), "{port:?} is no pseudo-terminal");
    let scan = [
        "scan",
        "--rig",
        "instant",
        "--port",
        "rig0",
        "--plan",
        "plan.toml",
        "-o",
        "lace.ogm",
    ];
    run(&ogm, folder, &scan);
    run(&ogm, folder, &["merge", "lace.ogm", "-o", "lace.csv"]);
    run(
        &woven_fit,
        folder,
        &["fit", "lace.csv", "--model", "sheet", "--out", "fit"],
    );
    let json = std::fs::read_to_string(folder.join("fit").join("fit.json")).expect("a result");
    let fabric = Fabric::from_toml(LACE).expect("a sound fabric");
    let (inside, all) = covered(&fabric, &rows_of(&json));
    assert!(all >= 7, "only {all} parameters have an interval");
    assert_eq!(
        inside, all,
        "a true parameter lies outside its 95 % interval and 0.2 %"
    );
}

/// A forward lobe of the given width on a low floor, symmetric about the normal, and a rig with an aperture fine enough for it.
fn narrow(alpha: f64) -> (Fabric, Rig) {
    let text = format!(
        "name = 'narrow'\n[optics]\nmodel = 'ggx-mirrored'\nparameters = {{ k_d = 0.1, k_t = 0.3, alpha_x = {alpha}, alpha_y = {alpha} }}"
    );
    let mut rig = Rig::default();
    rig.detector.aperture_deg = 0.2;
    rig.detector.beam_half_deg = 0.05;
    (Fabric::from_toml(&text).expect("a sound fabric"), rig)
}

/// Root mean square of the relative errors of both widths over some scans, the mean stated standard error, and the poses of one scan.
fn width_error(fabric: &Fabric, rig: &Rig, plan: &Plan, folder: &Path) -> (f64, f64, usize) {
    let (mut square, mut stated, mut n, mut poses) = (0.0, 0.0, 0.0, 0);
    for seed in 0..4 {
        let csv = measure(fabric, rig, plan, seed, folder);
        let text = std::fs::read_to_string(&csv).expect("a file");
        poses = text.lines().filter(|l| !l.starts_with('#')).count() - 1;
        for p in fit(&csv, "ggx-mirrored")
            .iter()
            .filter(|p| p.name.starts_with("alpha"))
        {
            let truth = fabric.optics.parameters[p.name];
            square += (p.value / truth - 1.0).powi(2);
            stated += p.standard_error.expect("an error bar") / truth;
            n += 1.0;
        }
    }
    ((square / n).sqrt(), stated / n, poses)
}

#[test]
fn an_adaptive_plan_gives_the_width_with_half_of_the_poses() {
    let folder = tempfile::tempdir().expect("a folder");
    let common = "straight_through = false\nname = 'w'\n[exposure]\nladder_ms = [1, 16, 256, 4096]\n[calibration]\nwhite = false\n[grid]\n";
    // The camera steps of the paper on two planes: 4 × 39 poses beside the normal.
    let uniform = format!(
        "{common}kind = 'uniform'\ntheta_l = [0]\nphi_l = [0]\ntheta_v = {{ from = 100, to = 178, step = 2.0512820512820513 }}\nphi_v = [0, 90, 180, -90]"
    );
    let adaptive = format!("{common}kind = 'adaptive'\nplanes = [0, 90]\nmost = 78");
    for fwhm in [2.0_f64, 3.0, 5.0] {
        // GGX falls to a half where tan²θ_h = α² (√2 - 1); the lobe turns twice as far as its half vector.
        let alpha = (fwhm / 4.0).to_radians().tan() / (2.0_f64.sqrt() - 1.0).sqrt();
        let (fabric, rig) = narrow(alpha);
        let plan = |text: &str| Plan::from_toml(text).expect("a plan");
        let (eu, su, nu) = width_error(&fabric, &rig, &plan(&uniform), folder.path());
        let (ea, sa, na) = width_error(&fabric, &rig, &plan(&adaptive), folder.path());
        println!(
            "FWHM {fwhm}°, alpha {alpha:.4}: uniform {nu} poses, error {:.3} % (stated {:.3} %); adaptive {na} poses, error {:.3} % (stated {:.3} %)",
            eu * 100.0,
            su * 100.0,
            ea * 100.0,
            sa * 100.0
        );
        assert!(2 * na <= nu, "{na} of {nu} poses");
        assert!(ea <= eu && sa <= su, "FWHM {fwhm}°");
    }
}

#[test]
fn the_next_best_poses_give_the_intervals_with_half_of_the_grid() {
    let folder = tempfile::tempdir().expect("a folder");
    let text = "name = 'n'\n[optics]\nmodel = 'ggx-mirrored'\nparameters = { k_d = 0.2, k_t = 0.3, alpha_x = 0.06, alpha_y = 0.1 }";
    let fabric = Fabric::from_toml(text).expect("a sound fabric");
    let rig = Rig::default();
    let grid = "straight_through = false\nname = 'n'\n[calibration]\nwhite = false\n[grid]\nkind = 'uniform'\ntheta_l = [0]\nphi_l = [0]\ntheta_v = { from = 100, to = 178.8, step = 0.7959 }\nphi_v = [0, 90, 180, -90]";
    let grid = Plan::from_toml(grid).expect("a plan");
    let poses: Vec<Pose> = grid.grid.poses().expect("poses");
    assert_eq!(poses.len(), 400);
    // A first look of 20 poses is fitted; that fit chooses the other 180 out of the grid.
    let list = |poses: &[Pose]| Plan {
        grid: Grid::List {
            poses: poses.iter().map(Pose::angles).collect(),
        },
        ..grid.clone()
    };
    let look: Vec<Pose> = poses.iter().copied().step_by(20).collect();
    let first = fit(
        &measure(&fabric, &rig, &list(&look), 9, folder.path()),
        "ggx-mirrored",
    );
    let mut guess = fabric.clone();
    for p in &first {
        guess.optics.parameters.insert(p.name.into(), p.value);
    }
    let aims: Vec<String> = ["alpha_x", "alpha_y"].map(String::from).to_vec();
    let design = Design::new(&guess, &rig.detector, &grid.exposure, 6e5).expect("a design");
    let more = design.choose(&poses, &look, 180, &aims).expect("poses");
    let half: Vec<Pose> = look.iter().chain(&more).copied().collect();
    let width = |plan: &Plan, name: &str| {
        let parameters = fit(
            &measure(&fabric, &rig, plan, 3, folder.path()),
            "ggx-mirrored",
        );
        let p = parameters
            .iter()
            .find(|p| p.name == name)
            .expect("a parameter");
        let (low, high) = p.interval95.expect("an interval");
        println!(
            "{} poses, {name}: {low:.6}..{high:.6}",
            plan.grid.poses().expect("poses").len()
        );
        high - low
    };
    for name in ["alpha_x", "alpha_y"] {
        let (whole, chosen) = (width(&grid, name), width(&list(&half), name));
        assert!(
            chosen <= whole,
            "{name}: {chosen} with half of the poses, {whole} with the grid"
        );
    }
}
