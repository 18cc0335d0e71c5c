//! Numbers that take longer than a test may: global minima, coverage of intervals, speed of whole tables.
//!
//! `cargo bench -p woven-fit --bench evidence` prints them all; a word after `--` picks one of speed, global, coverage.

use rayon::prelude::*;
use std::time::Instant;
use woven_bsdf::model::{self, ModelInfo, Role};
use woven_fit::fit::Options;
use woven_fit::measurement::{Detail, Measurement, Points};
use woven_fit::problem::{Evaluator, Separable, Spec};
use woven_fit::search::fit_spec;
use woven_fit::solve::{Settings, solve};
use woven_fit::starts::{sobol, uniform};
use woven_fit::synth::{SETS, scan_of};

fn points(scan: woven_bsdf::measured::csv::Scan) -> Points {
    Measurement::from_scan("synthetic", scan).points(true, Detail::Full, false)
}

fn spec(name: &str, free: &[&str]) -> Spec {
    let spec = Spec::only(model::find(name).expect("in the list"), free);
    spec.isotropic().unwrap_or(spec)
}

/// The six models of the paper's table 2 with the parameters that one plane can see.
fn table2() -> Vec<(&'static str, Spec)> {
    let list: [(&str, &[&str]); 6] = [
        ("ggx-mirrored", &["k_d", "k_t", "alpha_x", "alpha_y"]),
        ("hgf", &["a_d", "g_d", "a_s", "g_s"]),
        ("ward", &["k_d", "k_s", "a_x", "a_y"]),
        ("cook-torrance", &["k_d", "k_s", "m"]),
        ("ashikhmin-shirley", &["k_d", "k_s", "n_u", "n_v"]),
        ("phong", &["k_s", "m"]),
    ];
    list.into_iter()
        .map(|(name, free)| (name, spec(name, free)))
        .collect()
}

fn best_of(rounds: usize, mut work: impl FnMut()) -> f64 {
    (0..rounds)
        .map(|_| {
            let clock = Instant::now();
            work();
            clock.elapsed().as_secs_f64() * 1e3
        })
        .fold(f64::INFINITY, f64::min)
}

fn speed() {
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a pool of one");
    one.install(|| {
        let small = points(SETS[0].scan(Some(0)));
        let specs = table2();
        let settings = Settings { max_evaluations: 50, polish: 0, offset_tol: 1e-4, ..Settings::default() };
        let time = best_of(9, || {
            for (_, spec) in &specs {
                let eval = Evaluator { spec, points: &small };
                for start in starts(spec, 32, 1) {
                    let mut problem = Separable::new(eval, vec![1.0; small.points.len()]);
                    std::hint::black_box(solve(&mut problem, &start, &settings));
                }
            }
        });
        println!("six models × 32 starts × 79 points: {time:.1} ms on one thread (goal 50)");
        let incidences: Vec<f64> = (0..31).map(|i| 2.0 * f64::from(i)).collect();
        let ward = model::find("ward").expect("in the list");
        let large = points(scan_of(ward, &[0.2, 0.3, 0.2, 0.35], &incidences, 0.01, 1));
        let options = Options::default();
        let time = best_of(2, || {
            for name in ["ggx-mirrored", "hgf", "ward", "cook-torrance", "ashikhmin-shirley", "phong"] {
                let spec = Spec::transmission(model::find(name).expect("in the list"), true, false);
                std::hint::black_box(fit_spec(&spec, &large, &large, &Options { starts: 2, ..options.clone() }).expect("fits"));
            }
        });
        println!("six models × {} points, two starts each, with cross-validation and error bars: {:.2} s on one thread (goal 2)", large.points.len(), time / 1e3);
    });
}

fn starts(spec: &Spec, count: usize, seed: u64) -> Vec<Vec<f64>> {
    let place = |c: usize, u: f64| {
        let (lo, hi) = spec.range(c);
        lo + u * (hi - lo)
    };
    let cube = sobol(count, spec.coordinates.len(), seed);
    cube.iter()
        .map(|u| u.iter().enumerate().map(|(c, &u)| place(c, u)).collect())
        .collect()
}

/// A random truth: shapes anywhere in the inner 80 % of their range, factors between 0.05 and 0.5.
fn truth(spec: &Spec, model: &ModelInfo, seed: u64) -> Vec<f64> {
    let x: Vec<f64> = (0..spec.coordinates.len())
        .map(|c| {
            let (lo, hi) = spec.range(c);
            lo + (0.1 + 0.8 * uniform(seed, c as u64)) * (hi - lo)
        })
        .collect();
    let k: Vec<f64> = (0..spec.linear.len())
        .map(|j| 0.05 + 0.45 * uniform(seed, 100 + j as u64))
        .collect();
    let values = spec.values(&k, &x);
    debug_assert!(
        model
            .params
            .iter()
            .filter(|p| p.role == Role::Linear)
            .count()
            >= k.len()
    );
    values
}

fn global() {
    const TRUTHS: u64 = 1000;
    let options = Options::default();
    for (name, spec) in table2() {
        let model = model::find(name).expect("in the list");
        let found = (0..TRUTHS)
            .into_par_iter()
            .filter(|&seed| {
                let points = points(scan_of(
                    model,
                    &truth(&spec, model, seed),
                    &[0.0],
                    0.01,
                    seed,
                ));
                let cost = |x: &[f64]| {
                    let mut problem = Separable::new(
                        Evaluator {
                            spec: &spec,
                            points: &points,
                        },
                        vec![1.0; points.points.len()],
                    );
                    solve(&mut problem, x, &Settings::default()).sse
                };
                let fit = fit_spec(&spec, &points, &points, &options).expect("fits");
                let reached = cost(&fit.state.1);
                // The dense scan: 64 starts of another sequence, each to its end.
                let scan = starts(&spec, 64, seed + 7)
                    .iter()
                    .map(|x| cost(x))
                    .fold(f64::INFINITY, f64::min);
                reached <= scan * 1.001
            })
            .count();
        println!(
            "{name}: global minimum of {found} of {TRUTHS} random truths ({} starts, against 64)",
            options.starts
        );
    }
}

fn coverage() {
    const SCANS: u64 = 1000;
    let options = Options {
        starts: 2,
        ..Options::default()
    };
    let all = |name: &str, diffuse| {
        Spec::transmission(model::find(name).expect("in the list"), diffuse, false)
    };
    let cases = [
        ("ward", vec![0.2, 0.3, 0.2, 0.35], all("ward", true)),
        ("hgf", vec![0.4, 0.4, 0.5, 0.85, 0.0], all("hgf", false)),
        (
            "ggx-mirrored",
            vec![0.2, 0.4, 0.2, 0.35],
            all("ggx-mirrored", true),
        ),
    ];
    for (name, values, spec) in cases {
        let model = model::find(name).expect("in the list");
        let names = spec.names();
        let hits: Vec<Vec<bool>> = (0..SCANS)
            .into_par_iter()
            .map(|seed| {
                let points = points(scan_of(model, &values, &[0.0, 25.0, 50.0], 0.01, seed));
                let fit = fit_spec(&spec, &points, &points, &options).expect("fits");
                let covers = |p: &woven_fit::fit::Parameter| {
                    let truth = values[model
                        .params
                        .iter()
                        .position(|q| q.name == p.name)
                        .expect("its own")];
                    p.interval95
                        .is_some_and(|(lo, hi)| lo <= truth && truth <= hi)
                };
                fit.parameters.iter().map(covers).collect()
            })
            .collect();
        for (j, parameter) in names.iter().enumerate() {
            let share = hits.iter().filter(|h| h[j]).count() as f64 / SCANS as f64;
            println!(
                "{name} {parameter}: {:.1} % of {SCANS} intervals of 95 % hold the truth",
                100.0 * share
            );
        }
    }
}

fn main() {
    let wanted: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| !a.starts_with('-'))
        .collect();
    for (name, run) in [
        ("speed", speed as fn()),
        ("global", global),
        ("coverage", coverage),
    ] {
        if wanted.is_empty() || wanted.iter().any(|w| w == name) {
            run();
        }
    }
}
