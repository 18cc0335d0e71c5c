//! From cloth on the rig to its parameters: the simulated goniometer measures a fabric file, the log becomes a
//! measurement, the measurement is fitted, and the fabric's own numbers come back.

use ogm_driver::{merge, plan::Plan, rig::Rig, scan, sim, transport::StopToken};
use std::sync::{Arc, Mutex};
use woven_bsdf::fabric::Fabric;
use woven_fit::fit::{Options, fit_measurement, quiet};

const LACE: &str = r#"
    name = "lace of known parameters"
    [optics]
    model = "sheet"
    parameters = { t_d = 0.25, k_t = 0.20, r_d = 0.40, gamma_warp = 0.6, gamma_weft = 0.5, section = 1.0, alpha_x = 0.30, alpha_y = 0.15 }
"#;

const PLAN: &str = r#"
    name = "three incidences, two planes"
    [grid]
    kind = "uniform"
    theta_l = [0, 20, 40]
    phi_l = [0, 90]
    theta_v = { from = 110, to = 176, step = 6 }
    phi_v = [0, 90, 180, 270]
    [calibration]
    warm_up_min = 0
"#;

#[test]
fn the_rig_gives_the_cloth_back() {
    let folder = tempfile::tempdir().expect("a folder");
    let fabric = Fabric::from_toml(LACE).expect("a sound fabric");
    let rig = Rig::default();
    let cloth = Arc::new(sim::fabric::FabricSample::new(&fabric).expect("it can be measured"));
    let bench = sim::Bench::new(rig.clone(), cloth, sim::Imperfections::default());
    let device = Arc::new(Mutex::new(sim::Device::new(bench, sim::FaultPlan::none())));
    let plan = Plan::from_toml(&PLAN.replace(
        "\n    [grid]",
        "\n    forbidden = \"leave-out\"\n    [grid]",
    ))
    .expect("a plan");
    let log = folder.path().join("scan.ogm");
    let transport = Box::new(sim::MemoryTransport::new(device));
    let outcome = scan::run(
        transport,
        &rig,
        &plan,
        &log,
        &StopToken::new(),
        &mut scan::Quiet,
    )
    .expect("a scan");
    assert_eq!(outcome.stored, outcome.points);
    assert!(
        outcome.points > 100,
        "only {} poses were allowed",
        outcome.points
    );

    let csv = folder.path().join("lace.csv");
    merge::merge_log(&log)
        .expect("it merges")
        .write_csv(&csv)
        .expect("it is written");

    let options = Options {
        models: Some(vec!["sheet".into()]),
        ..Options::default()
    };
    let result = fit_measurement(&csv, &options, &quiet).expect("it fits");
    let sheet = &result.ranking[0];
    println!(
        "{:<12} {:>8} {:>10} {:>10}",
        "parameter", "truth", "fitted", "std err"
    );
    for p in &sheet.parameters {
        let Some(&truth) = fabric.optics.parameters.get(p.name) else {
            continue;
        };
        let error = p.standard_error.unwrap_or(f64::NAN);
        println!(
            "{:<12} {truth:>8.4} {:>10.4} {error:>10.5}",
            p.name, p.value
        );
        // The detector's 1° aperture is not in a pose's value and the straight-through pose is a flux, so a bias of a
        // few parts in a thousand may stand beside the noise: 1 % is allowed, or three standard errors.
        let allowed = (0.01 * truth).max(if error.is_finite() { 3.0 * error } else { 0.0 });
        assert!(
            (p.value - truth).abs() <= allowed,
            "{}: {} instead of {truth} ± {error}",
            p.name,
            p.value
        );
    }
    for name in [
        "t_d",
        "k_t",
        "alpha_x",
        "alpha_y",
        "gamma_warp",
        "gamma_weft",
    ] {
        assert!(
            sheet.parameters.iter().any(|p| p.name == name),
            "{name} was not fitted"
        );
    }
}
