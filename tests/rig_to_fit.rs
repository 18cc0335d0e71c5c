//! From cloth on the rig to its parameters: the simulated goniometer measures a fabric, the log becomes a measurement, the measurement is fitted, and
//! the fabric's own numbers come back within the error bars; then how many poses that takes.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};

use ogm_driver::design::Design;
use ogm_driver::plan::{Grid, Plan};
use ogm_driver::pose::Pose;
use ogm_driver::rig::Rig;
use ogm_driver::sim::noise::Noise;
use ogm_driver::transport::StopToken;
use ogm_driver::{merge, scan, sim};
use woven_bsdf::fabric::Fabric;
use woven_fit::fit::{Options, Parameter, fit_measurement, quiet};

#[path = "rig_to_fit/programs.rs"]
mod programs;

use programs::{Ended, program, run};

const LACE: &str = r#"
    name = "lace of known parameters"
    [optics]
    model = "sheet"
    parameters = { t_d = 0.25, k_t = 0.20, r_d = 0.40, gamma_warp = 0.6, gamma_weft = 0.5, section = 1.0, alpha_x = 0.30, alpha_y = 0.15 }
"#;

const PLAN: &str = r#"
    name = "five incidences in three planes: fifteen straight-through readings for the three numbers of the gap"
    forbidden = "leave-out"
    [grid]
    kind = "uniform"
    theta_l = [4, 12, 20, 28, 36]
    phi_l = [0, 45, 90]
    theta_v = { from = 112, to = 176, step = 8 }
    phi_v = [-90, 0, 90, 180]
"#;

/// A fitted parameter: name, value, 95 % interval.
type Row = (String, f64, (f64, f64));

/// A rig as a careful builder states it: axes known to 0.1° (even within that: standard deviation 0.1°/√3), the aperture's size to 0.1 %.
fn honest_rig() -> Rig {
    let mut rig = Rig::default().with_instant_motors();
    rig.detector.angle_deg = 0.1 / 3_f64.sqrt();
    rig.detector.aperture_sigma_deg = 0.001;
    rig
}

/// How many of a fabric's own numbers lie in the 95 % intervals, and how many intervals there are; prints the table.
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
        let here = (*low..=*high).contains(&truth);
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

/// A good instrument on a quiet day, with the noise of `seed`.
fn good(seed: u64) -> sim::Imperfections {
    sim::Imperfections {
        seed,
        ..sim::Imperfections::default()
    }
}

/// Measures a fabric in memory, on virtual time; returns the measurement's file.
fn measure(
    fabric: &Fabric,
    rig: &Rig,
    plan: &Plan,
    wrong: sim::Imperfections,
    folder: &Path,
) -> PathBuf {
    let cloth = Arc::new(sim::fabric::FabricSample::new(fabric).expect("it can be measured"));
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
    let rig = toml::to_string(&honest_rig()).expect("a text");
    std::fs::write(folder.join("rig.toml"), rig).expect("a file");
    let mut sim = Command::new(&ogm)
        .args([
            "sim",
            "--fabric",
            "lace.toml",
            "--rig",
            "rig.toml",
            "--speed",
            "1000",
            "--link",
            "rig0",
        ])
        .args(["--misaligned", "0.07,-0.05,-0.08,0.04", "--seed", "4"])
        .args(["--curved", "0.005", "--aperture-error", "0.001"])
        .args(["--drift", "0.01", "--lamp-on-min", "40"])
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
        "rig.toml",
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
    // Seven intervals of 95 % hold all seven numbers in two rigs of three, and this is such a rig; how often they hold is asked below.
    assert_eq!(
        inside, all,
        "a true parameter lies outside its 95 % interval"
    );
}

#[test]
fn the_intervals_hold_the_truth_as_often_as_they_say() {
    let rigs: u64 = std::env::var("OGM_FITS")
        .ok()
        .and_then(|s| s.parse().ok())
        .unwrap_or(4);
    let folder = tempfile::tempdir().expect("a folder");
    let fabric = Fabric::from_toml(LACE).expect("a sound fabric");
    let plan = Plan::from_toml(PLAN).expect("a plan");
    let rig = honest_rig();
    let (mut inside, mut all) = (0, 0);
    for seed in 0..rigs {
        let mut noise = Noise::at(&[seed, 0xf17]);
        let mut within = |limit: f64| limit * (2.0 * noise.uniform() - 1.0);
        let wrong = sim::Imperfections {
            lamp_on_s: 2400.0,
            drift_per_hour: within(0.01),
            dark_offset: 300.0,
            dark_rate: 0.2,
            nonlinearity: within(0.005),
            misalignment_deg: std::array::from_fn(|_| within(0.1)),
            aperture_error_deg: within(0.001 * 3_f64.sqrt()),
            ..good(seed)
        };
        println!("rig {seed}: {:?}", wrong.misalignment_deg);
        let parameters = fit(
            &measure(&fabric, &rig, &plan, wrong, folder.path()),
            "sheet",
        );
        let rows: Vec<Row> = parameters
            .iter()
            .filter_map(|p| Some((p.name.to_string(), p.value, p.interval95?)))
            .collect();
        let (i, n) = covered(&fabric, &rows);
        (inside, all) = (inside + i, all + n);
    }
    println!("{inside} of {all} true parameters inside their 95 % intervals, {rigs} rigs");
    // The parameters of one rig hang together, so few rigs scatter more than independent draws of 95 % would.
    let least = if rigs >= 20 { 0.90 } else { 0.85 };
    assert!(all as u64 >= 7 * rigs && inside as f64 >= least * all as f64);
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
        let csv = measure(fabric, rig, plan, good(seed), folder);
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
        &measure(&fabric, &rig, &list(&look), good(9), folder.path()),
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
            &measure(&fabric, &rig, plan, good(3), folder.path()),
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
