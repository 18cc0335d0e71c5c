//! Measurements with a known truth: orders, ties, ranks, error bars, outliers.

mod known;

use known::{coverage, entangled_truth, fit, found_by_aicc, points, spec, table2, truths};
use rayon::prelude::*;
use woven_fit::fit::{ModelFit, Options, Profiles};
use woven_fit::identify::printed;
use woven_fit::problem::Spec;
use woven_fit::rank;
use woven_fit::robust::Loss;
use woven_fit::synth::SETS;

/// Scores need no profiles.
fn scores() -> Options {
    Options {
        profiles: Profiles::Never,
        ..Options::default()
    }
}

#[test]
fn the_sets_give_their_known_orders_in_100_of_100_seeds() {
    let specs = table2();
    let options = scores();
    for set in SETS {
        let all: Vec<Vec<f64>> = (0..100u64)
            .into_par_iter()
            .map(|seed| {
                let points = points(set.scan(Some(seed)));
                let rms = |s| fit(s, &points, &options).rms_e4;
                specs.iter().map(rms).collect()
            })
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
fn a_lobe_with_two_widths_fits_no_worse_than_with_one() {
    // One plane sees k_t/alpha_y only: with the factor projected out nothing depends on alpha_y.
    let sheet = woven_bsdf::model::find("sheet").expect("in the list");
    let two = Spec::transmission(sheet, true, false);
    let one = two.isotropic().expect("it has two widths");
    for (set, seed) in SETS.iter().flat_map(|s| (0..4).map(move |i| (s, i))) {
        let points = points(set.scan(Some(seed)));
        let [two, one] = [&two, &one].map(|s| fit(s, &points, &scores()));
        assert_ne!(two.outcome, "stuck at a kink", "{} {seed}", set.name);
        assert!(
            two.sse_e4 < 1.001 * one.sse_e4 && two.uncertainty.rank == 3,
            "{} {seed}: {} for {}, rank {}",
            set.name,
            two.sse_e4,
            one.sse_e4,
            two.uncertainty.rank
        );
    }
}

#[test]
fn gaussians_of_the_angle_are_a_tie_in_100_of_100() {
    let specs = [
        spec("phong", &["k_d", "k_s", "m"]),
        spec("ward", &["k_d", "k_s", "a_x", "a_y"]),
        spec("cook-torrance", &["k_d", "k_s", "m"]),
    ];
    let options = scores();
    let tied = (0..100u64)
        .into_par_iter()
        .filter(|&seed| {
            let points = points(SETS[0].scan(Some(seed)));
            let mut fits: Vec<ModelFit> = specs.iter().map(|s| fit(s, &points, &options)).collect();
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
    let of = |name: &str, free: &[&str]| {
        let fit = fit(&spec(name, free), &points, &Options::default());
        let printed = printed(&fit, &points).unwrap();
        println!("{}", printed.to_text());
        printed
    };
    let hgf = of("hgf", &["a_d", "g_d", "a_s", "g_s"]);
    assert_eq!((hgf.uncertainty.rank, hgf.uncertainty.free), (4, 6));
    let error = |name: &str| {
        hgf.uncertainty.standard_error[hgf.names.iter().position(|n| *n == name).unwrap()]
    };
    assert!(error("g_d").is_some() && error("g_s").is_some());
    let hidden = ["k_d", "k_s", "tau", "rho"];
    assert!(hidden.iter().all(|n| error(n).is_none()));

    let ggx = of("ggx-walter", &["k_t", "alpha", "n"]);
    assert_eq!((ggx.uncertainty.rank, ggx.uncertainty.free), (3, 5));
    let entangled = &ggx.uncertainty.entangled;
    assert!(
        entangled.iter().any(|s| s.starts_with("r and n")),
        "{entangled:?}"
    );
}

#[test]
fn intervals_cover_the_truth_as_often_as_they_say() {
    // The evidence bench takes 1,000 scans a model. Here the binomial scatter of 95 % of 100 is 2.2 %: three of them are
    // allowed; that of 68.27 % is 4.7 %.
    const SETS: u64 = 100;
    for (truth, sets) in truths()
        .iter()
        .map(|t| (t, SETS))
        .chain([(&entangled_truth(), SETS)])
    {
        for c in coverage(truth, 0, sets) {
            println!("{} {c:?}", truth.spec.label);
            let [c68, c95, c997] = c.shares;
            assert!(c.three_sigma > 0.96, "{} {c:?}", truth.name);
            if c.identifiable() {
                assert!((0.54..0.83).contains(&c68), "{} {c:?}", truth.name);
                assert!((0.884..=1.0).contains(&c95), "{} {c:?}", truth.name);
                assert!(c997 > 0.96, "{} {c:?}", truth.name);
            } else {
                // A limit may be cautious, but not bold.
                assert!(c95 > 0.884, "{} {c:?}", truth.name);
            }
        }
    }
}

#[test]
fn aicc_finds_the_truth_among_separable_models() {
    let all = truths();
    for truth in &all {
        let found = found_by_aicc(truth, &all, 30);
        println!("{}: found in {found} of 30", truth.name);
        assert_eq!(found, 30, "{}", truth.name);
    }
}

#[test]
fn gross_outliers_hardly_move_a_robust_fit() {
    for truth in &truths() {
        let squares = known::outlier_bias(truth, Loss::Squares, 8);
        let cauchy = known::outlier_bias(truth, Loss::Cauchy, 8);
        println!(
            "{}: squares {squares:.1}, cauchy {cauchy:.2} standard errors",
            truth.name
        );
        // The mean of eight scatters by 0.35 standard errors.
        assert!(cauchy < 1.35 && squares > 2.0 * cauchy, "{}", truth.name);
    }
}
