//! Measurements with a known truth: orders, ties, ranks, error bars, outliers.

use rayon::prelude::*;
use woven_bsdf::model;
use woven_fit::fit::{ModelFit, Options};
use woven_fit::identify::printed;
use woven_fit::measurement::{Detail, Measurement, Points};
use woven_fit::problem::Spec;
use woven_fit::rank;
use woven_fit::robust::Loss;
use woven_fit::search::fit_spec;
use woven_fit::synth::{SETS, scan_of};

fn points(scan: woven_bsdf::measured::csv::Scan) -> Points {
    Measurement::from_scan("synthetic", scan).points(true, Detail::Full, false)
}

fn spec(name: &str, free: &[&str]) -> Spec {
    let mut spec = Spec::only(model::find(name).unwrap(), free);
    spec = spec.isotropic().unwrap_or(spec);
    spec.label = name.to_owned();
    spec
}

/// The six models of the paper's table 2 with the parameters that one plane can see.
fn table2() -> Vec<Spec> {
    vec![
        spec("ggx-mirrored", &["k_d", "k_t", "alpha_x", "alpha_y"]),
        spec("hgf", &["a_d", "g_d", "a_s", "g_s"]),
        spec("ward", &["k_d", "k_s", "a_x", "a_y"]),
        spec("cook-torrance", &["k_d", "k_s", "m"]),
        spec("ashikhmin-shirley", &["k_d", "k_s", "n_u", "n_v"]),
        spec("phong", &["k_s", "m"]),
    ]
}

fn fits(specs: &[Spec], points: &Points, options: &Options) -> Vec<ModelFit> {
    specs
        .iter()
        .map(|s| fit_spec(s, points, points, options).unwrap())
        .collect()
}

fn rms(fits: &[ModelFit]) -> Vec<f64> {
    fits.iter().map(|f| f.rms_e4).collect()
}

#[test]
fn the_sets_give_their_known_orders_in_100_of_100_seeds() {
    let specs = table2();
    let options = Options::default();
    for set in SETS {
        let all: Vec<Vec<f64>> = (0..100u64)
            .into_par_iter()
            .map(|seed| rms(&fits(&specs, &points(set.scan(Some(seed))), &options)))
            .collect();
        let mean: Vec<f64> = (0..specs.len())
            .map(|i| all.iter().map(|r| r[i]).sum::<f64>() / 100.0)
            .collect();
        let [ggx, hgf, ward, ct, shirley, phong] = mean[..] else {
            unreachable!()
        };
        println!(
            "{}: ggx {ggx:.1} hgf {hgf:.1} ward {ward:.1} cook-torrance {ct:.1} ashikhmin-shirley {shirley:.1} phong {phong:.1}",
            set.name
        );
        let ordered = all.iter().filter(|r| {
            let gaussian = [r[2], r[3], r[4]];
            let least = gaussian.iter().copied().fold(f64::INFINITY, f64::min);
            let greatest = gaussian.iter().copied().fold(0.0, f64::max);
            match set.name {
                "paper79" => r[0] < r[1] && r[1] < least && greatest < r[5],
                // The counter-sets: Henyey and Greenstein must win.
                _ => (0..6).all(|i| i == 1 || r[1] < r[i]),
            }
        });
        let ordered = ordered.count();
        println!("{}: expected order in {ordered} of 100", set.name);
        assert_eq!(ordered, 100, "{}", set.name);
    }
}

#[test]
fn gaussians_of_the_angle_are_a_tie_in_100_of_100() {
    let specs = [
        spec("phong", &["k_d", "k_s", "m"]),
        spec("ward", &["k_d", "k_s", "a_x", "a_y"]),
        spec("cook-torrance", &["k_d", "k_s", "m"]),
    ];
    let options = Options::default();
    let tied = (0..100u64)
        .into_par_iter()
        .filter(|&seed| {
            let points = points(SETS[0].scan(Some(seed)));
            let mut fits = fits(&specs, &points, &options);
            rank::sort(&mut fits, &points, &options);
            fits.iter().all(|f| f.place == 1)
        })
        .count();
    println!("tie in {tied} of 100");
    assert_eq!(tied, 100);
}

#[test]
fn printed_parameters_have_the_known_ranks() {
    let points = points(SETS[0].scan(Some(0)));
    let hgf = fit_spec(
        &spec("hgf", &["a_d", "g_d", "a_s", "g_s"]),
        &points,
        &points,
        &Options::default(),
    )
    .unwrap();
    let hgf = printed(&hgf, &points).unwrap();
    println!("{}", hgf.to_text());
    assert_eq!((hgf.uncertainty.rank, hgf.uncertainty.free), (4, 6));
    let error = |name: &str| {
        hgf.uncertainty.standard_error[hgf.names.iter().position(|n| *n == name).unwrap()]
    };
    assert!(error("g_d").is_some() && error("g_s").is_some());
    assert!(
        ["k_d", "k_s", "tau", "rho"]
            .iter()
            .all(|n| error(n).is_none())
    );

    let ggx = fit_spec(
        &spec("ggx-walter", &["k_t", "alpha", "n"]),
        &points,
        &points,
        &Options::default(),
    )
    .unwrap();
    let ggx = printed(&ggx, &points).unwrap();
    println!("{}", ggx.to_text());
    assert_eq!((ggx.uncertainty.rank, ggx.uncertainty.free), (3, 5));
    assert!(
        ggx.uncertainty
            .entangled
            .iter()
            .any(|s| s.starts_with("r and n")),
        "{:?}",
        ggx.uncertainty.entangled
    );
}

/// Parameters of the truths, in the models' own order, of scans over three incidences and two planes.
fn truths() -> Vec<(&'static str, Vec<f64>, Spec)> {
    let all = |name: &str| Spec::transmission(model::find(name).unwrap(), true, false);
    vec![
        ("ward", vec![0.2, 0.3, 0.2, 0.35], all("ward")),
        // Without c: at 1 % of noise a broad lobe and an even floor are hardly told apart, and where one of them ends at its
        // bound the other's interval is no longer a normal one.
        (
            "hgf",
            vec![0.4, 0.3, 0.5, 0.85, 0.0],
            Spec::transmission(model::find("hgf").unwrap(), false, false),
        ),
        (
            "ggx-mirrored",
            vec![0.2, 0.4, 0.2, 0.35],
            all("ggx-mirrored"),
        ),
    ]
}

#[test]
fn intervals_cover_the_truth_as_often_as_they_say() {
    // The evidence bench takes 1,000 scans a model; here 150, whose binomial scatter of 95 % is 1.8 %: three of them are allowed.
    const SETS: u64 = 150;
    let options = Options {
        starts: 2,
        ..Options::default()
    };
    for (name, values, spec) in truths() {
        let model = model::find(name).unwrap();
        let names = spec.names();
        let hits: Vec<Vec<bool>> = (0..SETS)
            .into_par_iter()
            .map(|seed| {
                let points = points(scan_of(model, &values, &[0.0, 25.0, 50.0], 0.01, seed));
                let fit = fit_spec(&spec, &points, &points, &options).unwrap();
                let covers = |name: &str| {
                    let truth = values[model.params.iter().position(|p| p.name == name).unwrap()];
                    let p = fit.parameters.iter().find(|p| p.name == name).unwrap();
                    p.interval95
                        .is_some_and(|(lo, hi)| lo <= truth && truth <= hi)
                };
                names.iter().map(|n| covers(n)).collect()
            })
            .collect();
        for (j, parameter) in names.iter().enumerate() {
            let share = hits.iter().filter(|h| h[j]).count() as f64 / SETS as f64;
            println!(
                "{name} {parameter}: {:.1} % of {SETS} intervals hold the truth",
                100.0 * share
            );
            assert!(
                (0.896..=1.0).contains(&share),
                "{name} {parameter}: {share}"
            );
        }
    }
}

#[test]
fn aicc_finds_the_truth_among_separable_models() {
    let candidates = truths();
    let options = Options {
        starts: 4,
        ..Options::default()
    };
    for (name, values, _) in &candidates {
        let found = (0..40u64)
            .into_par_iter()
            .filter(|&seed| {
                let points = points(scan_of(
                    model::find(name).unwrap(),
                    values,
                    &[0.0, 25.0, 50.0],
                    0.01,
                    1000 + seed,
                ));
                let aicc = |spec: &Spec| fit_spec(spec, &points, &points, &options).unwrap().aicc;
                let best = candidates
                    .iter()
                    .min_by(|a, b| aicc(&a.2).total_cmp(&aicc(&b.2)))
                    .unwrap();
                best.0 == *name
            })
            .count();
        println!("{name}: found in {found} of 40");
        assert_eq!(found, 40, "{name}");
    }
}

#[test]
fn gross_outliers_hardly_move_a_robust_fit() {
    let (name, values, spec) = truths().swap_remove(2);
    let model = model::find(name).unwrap();
    let mut scan = scan_of(model, &values, &[0.0, 25.0, 50.0], 0.01, 5);
    let clean = points(scan.clone());
    let options = Options::default();
    let reference = fit_spec(&spec, &clean, &clean, &options).unwrap();
    let peak = scan.samples.iter().map(|s| s.f).fold(0.0, f64::max);
    // Every twentieth value reads half a peak too high.
    scan.samples
        .iter_mut()
        .step_by(20)
        .for_each(|s| s.f += 0.5 * peak);
    let spoiled = points(scan);
    let bias = |loss: Loss| {
        let fit = fit_spec(
            &spec,
            &spoiled,
            &spoiled,
            &Options {
                loss,
                ..options.clone()
            },
        )
        .unwrap();
        let off = |(a, b): (&woven_fit::fit::Parameter, &woven_fit::fit::Parameter)| {
            ((a.value - b.value) / b.standard_error.unwrap()).abs()
        };
        fit.parameters
            .iter()
            .zip(&reference.parameters)
            .map(off)
            .fold(0.0, f64::max)
    };
    let (squares, cauchy) = (bias(Loss::Squares), bias(Loss::Cauchy));
    println!("bias in standard errors: squares {squares:.1}, cauchy {cauchy:.2}");
    assert!(cauchy < 1.0 && squares > 5.0, "{cauchy} {squares}");
}
