//! Numbers that take longer than a test may: global minima, coverage of intervals, truths found, speed of whole tables.
//!
//! `cargo bench -p woven-fit --bench evidence` prints them all; words after `--` pick some of speed, global, coverage, truth,
//! outliers; a number is the count of synthetic sets instead of 1,000, a second one the number of the first set.

#[path = "../tests/known/mod.rs"]
mod known;

use known::{Coverage, Truth, coverage, entangled_truth, points, six, table2, truths};
use rayon::prelude::*;
use std::hint::black_box;
use std::time::Instant;
use woven_bsdf::model;
use woven_fit::fit::Options;
use woven_fit::problem::{Evaluator, Separable, Spec};
use woven_fit::robust::Loss;
use woven_fit::search::{fit_spec, start_points};
use woven_fit::solve::{Settings, solve};
use woven_fit::starts::uniform;
use woven_fit::synth::{SETS, scan_of};

/// Milliseconds that this thread has spent on a processor, so that other work on the machine does not count; none where the
/// system does not tell.
fn processor_ms() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let spent: f64 = text.split(' ').next()?.parse().ok()?;
    Some(spent * 1e-6)
}

/// Least time of several rounds in milliseconds, of the processor where known.
fn best_of(rounds: usize, mut work: impl FnMut()) -> f64 {
    (0..rounds)
        .map(|_| {
            let (clock, before) = (Instant::now(), processor_ms());
            work();
            match (before, processor_ms()) {
                (Some(before), Some(after)) => after - before,
                _ => clock.elapsed().as_secs_f64() * 1e3,
            }
        })
        .fold(f64::INFINITY, f64::min)
}

fn speed(_first: u64, _sets: u64) {
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a pool of one");
    one.install(|| {
        let small = points(SETS[0].scan(Some(0)));
        let specs = table2();
        let settings = Settings {
            max_evaluations: 50,
            polish: 0,
            offset_tol: 1e-4,
            ..Settings::default()
        };
        let time = best_of(15, || {
            for spec in &specs {
                let eval = Evaluator { spec, points: &small };
                for start in start_points(spec, 32, 1) {
                    let mut problem = Separable::new(eval, vec![1.0; small.points.len()]);
                    black_box(solve(&mut problem, &start, &settings));
                }
            }
        });
        println!("six models × 32 starts × 79 points: {time:.1} ms on one thread (goal 50)");
        let whole = Options {
            starts: 32,
            ..Options::default()
        };
        let time = best_of(15, || {
            for spec in &specs {
                black_box(fit_spec(spec, &small, &small, &whole).expect("fits"));
            }
        });
        println!("the same with last digits, error bars and scores: {time:.1} ms");
        let incidences: Vec<f64> = (0..31).map(|i| 2.0 * f64::from(i)).collect();
        let ward = model::find("ward").expect("in the list");
        let large = points(scan_of(ward, &[0.2, 0.3, 0.2, 0.35], &incidences, 0.01, 1));
        let options = Options {
            starts: 2,
            ..Options::default()
        };
        let mut time = 0.0;
        for spec in &specs {
            let spec = Spec::transmission(spec.model, true, false);
            let one = best_of(3, || {
                black_box(fit_spec(&spec, &large, &large, &options).expect("fits"));
            });
            println!("    {}: {one:.0} ms", spec.label);
            time += one;
        }
        println!(
            "six models × {} points, two starts each, with cross-validation and error bars: {:.2} s on one thread (goal 2)",
            large.points.len(),
            time / 1e3
        );
    });
}

/// A random truth: shapes anywhere in the inner 80 % of their range, factors between 0.05 and 0.5.
fn random_truth(spec: &Spec, seed: u64) -> Vec<f64> {
    let x: Vec<f64> = (0..spec.coordinates.len())
        .map(|c| {
            let (lo, hi) = spec.range(c);
            lo + (0.1 + 0.8 * uniform(seed, c as u64)) * (hi - lo)
        })
        .collect();
    let k: Vec<f64> = (0..spec.linear.len())
        .map(|j| 0.05 + 0.45 * uniform(seed, 100 + j as u64))
        .collect();
    spec.values(&k, &x)
}

fn global(first: u64, sets: u64) {
    let options = Options::default();
    for spec in table2() {
        let reaches = |seed: &u64| {
            let scan = scan_of(spec.model, &random_truth(&spec, *seed), &[0.0], 0.01, *seed);
            let points = points(scan);
            let cost = |x: &[f64]| {
                let eval = Evaluator {
                    spec: &spec,
                    points: &points,
                };
                let mut problem = Separable::new(eval, vec![1.0; points.points.len()]);
                solve(&mut problem, x, &Settings::default()).sse
            };
            let fit = fit_spec(&spec, &points, &points, &options).expect("fits");
            let reached = cost(&fit.state.1);
            // The dense scan: 64 starts of another sequence, each to its end.
            let starts = start_points(&spec, 64, seed + 7);
            let least = starts.iter().map(|x| cost(x)).fold(f64::INFINITY, f64::min);
            reached <= least * 1.001
        };
        let found = (first..first + sets)
            .into_par_iter()
            .filter(reaches)
            .count();
        println!(
            "{}: global minimum of {found} of {sets} random truths ({} starts, against 64)",
            spec.label, options.starts
        );
    }
}

fn print_coverage(truth: &Truth, rows: &[Coverage]) {
    for c in rows {
        println!(
            "{} {:8}: {:5.1} {:5.1} {:5.1} % of the intervals of 68, 95, 99.7 % hold the truth, {:.1} % within three standard errors, bias {:+.2} of them; profile in {:.0} %, a limit only in {:.1} %, unseen in {:.1} %{}",
            truth.spec.label,
            c.name,
            100.0 * c.shares[0],
            100.0 * c.shares[1],
            100.0 * c.shares[2],
            100.0 * c.three_sigma,
            c.bias,
            100.0 * c.profiled,
            100.0 * c.limits,
            100.0 * c.unseen,
            if c.identifiable() {
                ""
            } else {
                " (not identifiable)"
            }
        );
    }
}

fn covered(first: u64, sets: u64) {
    for truth in six().iter().chain([&entangled_truth()]) {
        print_coverage(truth, &coverage(truth, first, sets));
    }
}

fn truth(_first: u64, sets: u64) {
    let all = truths();
    for truth in &all {
        let found = known::found_by_aicc(truth, &all, sets);
        println!("{}: AICc finds it in {found} of {sets} sets", truth.name);
    }
}

fn outliers(_first: u64, sets: u64) {
    for truth in &truths() {
        for loss in [Loss::Squares, Loss::Huber, Loss::Cauchy] {
            println!(
                "{}: 5 % gross outliers move the worst parameter by {:.2} standard errors with {loss:?}, mean over sets",
                truth.name,
                known::outlier_bias(truth, loss, sets.min(100))
            );
        }
    }
}

fn main() {
    let wanted: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| !a.starts_with('-'))
        .collect();
    let numbers: Vec<u64> = wanted.iter().filter_map(|w| w.parse().ok()).collect();
    let (sets, first) = (numbers.first(), numbers.get(1));
    let all = wanted.iter().all(|w| w.parse::<u64>().is_ok());
    for (name, run) in [
        ("speed", speed as fn(u64, u64)),
        ("global", global),
        ("coverage", covered),
        ("truth", truth),
        ("outliers", outliers),
    ] {
        if all || wanted.iter().any(|w| w == name) {
            run(first.copied().unwrap_or(0), sets.copied().unwrap_or(1000));
        }
    }
}
