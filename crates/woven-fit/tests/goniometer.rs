//! The real goniometer file of a shade cloth: what is known of it must come out of the fit.

use std::path::Path;
use woven_fit::fit::{FitResult, Options, fit_measurement, quiet};

fn fit(models: &[&str]) -> FitResult {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../assets/measurements/mecho_6216_goniometer.xml");
    let options = Options {
        models: Some(models.iter().map(|m| (*m).to_owned()).collect()),
        starts: 2,
        ..Options::default()
    };
    fit_measurement(&path, &options, &quiet).unwrap()
}

#[test]
fn the_sheet_finds_gap_skirt_and_reflection() {
    let result = fit(&["sheet", "lambert"]);
    let straight = result.straight.as_ref().unwrap();
    let share = straight.measured_share.unwrap();
    assert!((0.65..0.75).contains(&share), "{share}");
    // The fitted weave lets through at normal incidence what was measured, within 5 %.
    let openness = straight.openness.unwrap();
    assert!(
        (openness / straight.measured - 1.0).abs() < 0.05,
        "{openness} {}",
        straight.measured
    );
    let sheet = result.ranking.iter().find(|f| f.label == "sheet").unwrap();
    let get = |name: &str| sheet.parameters.iter().find(|p| p.name == name).unwrap();
    // The skirt exists across one thread direction only: 14.3 against 2.2 at 10 degrees.
    let (x, y) = (get("alpha_x"), get("alpha_y"));
    assert!(
        x.value > 2.0 * y.value && x.interval95.unwrap().0 > y.interval95.unwrap().1,
        "{x:?} {y:?}"
    );
    let places = |label: &str| {
        result
            .ranking
            .iter()
            .find(|f| f.label == label)
            .unwrap()
            .place
    };
    assert!(
        places("sheet") < places("sheet isotropic")
            && places("sheet isotropic") < places("lambert")
    );
    // Reflectance of the front, 0.40 in the file at all angles up to 60 degrees, from the fabric that is written.
    let fabric = result.fabric("test").unwrap();
    let optics = fabric.optics().unwrap();
    let sum: f64 = optics.linear.iter().map(|k| k[0]).sum();
    assert!(sum <= 1.0 + 1e-6, "{sum}");
    let r_d = fabric.optics.parameters["r_d"];
    assert!((0.33..0.45).contains(&r_d), "{r_d}");
}
