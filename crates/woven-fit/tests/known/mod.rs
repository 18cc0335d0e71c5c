//! Measurements with a known truth and what fits make of them: shared by a quick test and by the evidence bench.

#![allow(
    dead_code,
    unreachable_pub,
    reason = "used in parts by a test and by a bench"
)]

use rayon::prelude::*;
use woven_bsdf::measured::csv::Scan;
use woven_bsdf::model;
use woven_fit::fit::{ModelFit, Options, Parameter, Profiles};
use woven_fit::measurement::{Detail, Measurement, Points};
use woven_fit::problem::Spec;
use woven_fit::robust::Loss;
use woven_fit::search::fit_spec;
use woven_fit::starts::{hash, uniform};
use woven_fit::synth::scan_of;

pub fn points(scan: Scan) -> Points {
    Measurement::from_scan("synthetic", scan).points(true, Detail::Full, false)
}

/// A model with only the named parameters, isotropic where it can be.
pub fn spec(name: &str, free: &[&str]) -> Spec {
    let mut spec = Spec::only(model::find(name).expect("in the list"), free);
    spec = spec.isotropic().unwrap_or(spec);
    spec.label = name.to_owned();
    spec
}

/// The six models of the paper's table 2 with the parameters that one plane can see.
pub fn table2() -> Vec<Spec> {
    vec![
        spec("ggx-mirrored", &["k_d", "k_t", "alpha_x", "alpha_y"]),
        spec("hgf", &["a_d", "g_d", "a_s", "g_s"]),
        spec("ward", &["k_d", "k_s", "a_x", "a_y"]),
        spec("cook-torrance", &["k_d", "k_s", "m"]),
        spec("ashikhmin-shirley", &["k_d", "k_s", "n_u", "n_v"]),
        spec("phong", &["k_s", "m"]),
    ]
}

pub fn fit(spec: &Spec, points: &Points, options: &Options) -> ModelFit {
    fit_spec(spec, points, points, options).expect("it can be evaluated")
}

/// A model with known parameters, scanned at three incidences in two planes with noise of 1 % of the peak.
pub struct Truth {
    pub name: &'static str,
    /// In the model's own order.
    pub values: Vec<f64>,
    /// Added to seeds, so that no two truths share their noise.
    seeds: u64,
    pub spec: Spec,
}

impl Truth {
    fn new(name: &'static str, values: &[f64], diffuse: bool, number: u64) -> Self {
        let model = model::find(name).expect("in the list");
        Self {
            name,
            values: values.to_vec(),
            seeds: number << 32,
            spec: Spec::transmission(model, diffuse, false),
        }
    }

    pub fn scan(&self, seed: u64) -> Scan {
        let model = model::find(self.name).expect("in the list");
        scan_of(
            model,
            &self.values,
            &[0.0, 25.0, 50.0],
            0.01,
            self.seeds + seed,
        )
    }

    pub fn value(&self, name: &str) -> f64 {
        let mut params = self.spec.model.params.iter();
        self.values[params.position(|p| p.name == name).expect("its own")]
    }
}

/// Truths that AICc can tell apart.
pub fn truths() -> Vec<Truth> {
    vec![
        Truth::new("ward", &[0.2, 0.3, 0.2, 0.35], true, 1),
        Truth::new("hgf", &[0.4, 0.3, 0.5, 0.85, 0.0], false, 2),
        Truth::new("ggx-mirrored", &[0.2, 0.4, 0.2, 0.35], true, 3),
    ]
}

/// The six models of the paper's table 2, for the coverage of their error bars.
pub fn six() -> Vec<Truth> {
    let mut all = truths();
    all.extend([
        Truth::new("cook-torrance", &[0.2, 5.0, 0.25, 1.5], true, 5),
        Truth::new("ashikhmin-shirley", &[0.2, 0.5, 40.0, 15.0, 0.5], true, 6),
        Truth::new("phong", &[0.2, 0.3, 30.0], true, 7),
    ]);
    // The lobe's strength and what Fresnel takes of it are one number here: index and f0 are held where they stand.
    for truth in &mut all {
        truth
            .spec
            .coordinates
            .retain(|c| !["n", "f0"].contains(&c.name));
    }
    all
}

/// The hard one: a broad lobe and an even floor are hardly told apart, and in many sets one of them ends at its bound.
pub fn entangled_truth() -> Truth {
    Truth::new("hgf", &[0.4, 0.3, 0.5, 0.85, 0.1], true, 4)
}

/// How often the intervals of one parameter hold the truth.
#[derive(Clone, Debug, Default)]
pub struct Coverage {
    pub name: &'static str,
    /// Shares at 68.27, 95 and 99.73 %, of the sets with an interval.
    pub shares: [f64; 3],
    /// Share of the sets in which the value is within three standard errors, of those with one.
    pub three_sigma: f64,
    /// Share of the sets in which the interval ends at a bound.
    pub limits: f64,
    /// Share of the sets without any interval.
    pub unseen: f64,
    /// Share of the sets in which the profile was needed.
    pub profiled: f64,
    /// Mean of (value - truth) / standard error: what bias there is, in standard errors.
    pub bias: f64,
}

impl Coverage {
    /// Seen from both sides in at least nine of ten sets.
    pub fn identifiable(&self) -> bool {
        self.limits + self.unseen < 0.1
    }
}

/// Over the sets from number `first` on.
pub fn coverage(truth: &Truth, first: u64, sets: u64) -> Vec<Coverage> {
    let options = Options {
        starts: 2,
        ..Options::default()
    };
    let fits: Vec<Vec<Parameter>> = (first..first + sets)
        .into_par_iter()
        .map(|seed| fit(&truth.spec, &points(truth.scan(seed)), &options).parameters)
        .collect();
    let names = truth.spec.names();
    let one = |(j, &name): (usize, &&'static str)| {
        let want = truth.value(name);
        let share = |hit: &dyn Fn(&Parameter) -> Option<bool>| {
            let known: Vec<bool> = fits.iter().filter_map(|f| hit(&f[j])).collect();
            known.iter().filter(|&&h| h).count() as f64 / known.len().max(1) as f64
        };
        let mean = |value: &dyn Fn(&Parameter) -> Option<f64>| {
            let known: Vec<f64> = fits.iter().filter_map(|f| value(&f[j])).collect();
            known.iter().sum::<f64>() / known.len().max(1) as f64
        };
        let holds = |i: Option<(f64, f64)>| i.map(|(lo, hi)| (lo..=hi).contains(&want));
        let limit = |p: &Parameter| p.remark.contains("at most") || p.remark.contains("at least");
        Coverage {
            name,
            shares: [
                share(&|p| holds(p.interval68)),
                share(&|p| holds(p.interval95)),
                share(&|p| holds(p.interval997)),
            ],
            three_sigma: share(&|p| {
                p.standard_error
                    .map(|se| (p.value - want).abs() <= 3.0 * se)
            }),
            limits: share(&|p| Some(limit(p))),
            unseen: share(&|p| Some(p.interval95.is_none() && !limit(p))),
            profiled: share(&|p| Some(p.profiled)),
            bias: mean(&|p| p.standard_error.map(|se| (p.value - want) / se)),
        }
    };
    names.iter().enumerate().map(one).collect()
}

/// In how many of the sets the truth has the least AICc among `candidates`, and in how many it has no rival within 2.
pub fn found_by_aicc(truth: &Truth, candidates: &[Truth], sets: u64) -> usize {
    let options = Options {
        starts: 4,
        profiles: Profiles::Never,
        ..Options::default()
    };
    let wins = |seed: &u64| {
        let points = points(truth.scan(1_000_000 + seed));
        let aicc = |c: &Truth| fit(&c.spec, &points, &options).aicc;
        let own = aicc(truth);
        candidates
            .iter()
            .filter(|c| c.name != truth.name)
            .all(|c| aicc(c) > own)
    };
    (0..sets).into_par_iter().filter(wins).count()
}

/// Mean over the sets of (value - truth) / standard error of a clean fit, the worst parameter, with 5 % gross outliers: up
/// to a peak too high, anywhere.
pub fn outlier_bias(truth: &Truth, loss: Loss, sets: u64) -> f64 {
    let options = Options {
        starts: 2,
        loss,
        profiles: Profiles::Never,
        ..Options::default()
    };
    let off: Vec<Vec<f64>> = (0..sets)
        .into_par_iter()
        .map(|seed| {
            let mut scan = truth.scan(2_000_000 + seed);
            let clean = fit(
                &truth.spec,
                &points(scan.clone()),
                &Options {
                    loss: Loss::Squares,
                    ..options.clone()
                },
            );
            let peak = scan.samples.iter().map(|s| s.f).fold(0.0, f64::max);
            for (i, s) in scan.samples.iter_mut().enumerate() {
                if hash(seed ^ 0x0117, i as u64).is_multiple_of(20) {
                    s.f += peak * (0.2 + 0.8 * uniform(seed ^ 0x0f, i as u64));
                }
            }
            let spoiled = fit(&truth.spec, &points(scan), &options);
            let one = |(s, c): (&Parameter, &Parameter)| {
                (s.value - truth.value(s.name)) / c.standard_error.unwrap_or(f64::INFINITY)
            };
            spoiled
                .parameters
                .iter()
                .zip(&clean.parameters)
                .map(one)
                .collect()
        })
        .collect();
    (0..off[0].len())
        .map(|j| (off.iter().map(|o| o[j]).sum::<f64>() / sets as f64).abs())
        .fold(0.0, f64::max)
}
