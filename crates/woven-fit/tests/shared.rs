//! Errors that all rows of a scan share: with the lines that name them intervals hold the truth, without them they do not.

use rayon::prelude::*;
use woven_bsdf::angles::radians;
use woven_bsdf::measured::csv::{Direct, Sample, Scan};
use woven_bsdf::model;
use woven_bsdf::vec3::Vec3;
use woven_bsdf::weave::openness;
use woven_fit::fit::{Options, Parameter};
use woven_fit::measurement::{Detail, Measurement};
use woven_fit::problem::Spec;
use woven_fit::search::fit_spec;
use woven_fit::starts::normal;

const SETS: u64 = 60;
/// 95 % less three times the binomial scatter of 60 sets.
const LEAST: f64 = 0.866;

/// A narrow lobe over a floor: k_d, k_t, alpha_x, alpha_y.
const TRUTH: [f64; 4] = [0.2, 0.4, 0.12, 0.25];
/// gamma_warp, gamma_weft, section.
const GAP: [f64; 3] = [0.6, 0.7, 0.9];

fn at(theta: f64, phi: f64) -> Vec3<f64> {
    Vec3::from_angles(radians(theta), radians(phi))
}

/// A scan whose axes stand off by `light` and `view` degrees of polar angle, with a factor and a dark level.
fn scan(seed: u64, scale: f64, floor: f64, light: f64, view: f64) -> Scan {
    let ggx = model::find("ggx-mirrored").unwrap();
    let mut scan = Scan::default();
    for (i, (theta_l, phi_l)) in [(10.0, 180.0), (30.0, 180.0), (50.0, 180.0), (30.0, 90.0)]
        .into_iter()
        .enumerate()
    {
        for (j, (theta_v, phi_v)) in (0..60)
            .flat_map(|n| {
                let theta = 178.0 - 1.5 * f64::from(n % 30) * 1.8;
                [(theta, 0.0), (theta, 90.0), (theta, 180.0), (theta, 270.0)]
            })
            .take(120)
            .enumerate()
        {
            let (l, v) = (at(theta_l + light, phi_l), at(theta_v + view, phi_v));
            let nominal = at(theta_v, phi_v).z;
            let f = scale * ggx.eval(&TRUTH, l, v) * (v.z / nominal).abs() + floor / nominal.abs();
            let noise = 1e-3 * normal(seed, (1000 * i + j) as u64);
            scan.samples.push(Sample {
                l: at(theta_l, phi_l),
                v: at(theta_v, phi_v),
                f: f + noise,
                sigma: None,
            });
        }
    }
    scan
}

fn fitted(spec: &Spec, scan: Scan) -> Vec<Parameter> {
    let options = Options {
        starts: 2,
        ..Options::default()
    };
    let points = Measurement::from_scan("made", scan).points(true, Detail::Full, false);
    fit_spec(spec, &points, &points, &options)
        .unwrap()
        .parameters
}

/// How often the 95 % intervals hold the truth, and the mean standard error, of each parameter.
fn coverage(spec: &Spec, truth: &[f64], make: impl Fn(u64) -> Scan + Sync) -> Vec<(f64, f64)> {
    let fits: Vec<Vec<Parameter>> = (0..SETS)
        .into_par_iter()
        .map(|seed| fitted(spec, make(seed)))
        .collect();
    let one = |(j, want): (usize, &f64)| {
        let holds = |f: &&Vec<Parameter>| {
            let (lo, hi) = f[j].interval95.expect("it is seen");
            (lo..=hi).contains(want)
        };
        let errors: f64 = fits.iter().filter_map(|f| f[j].standard_error).sum();
        (
            fits.iter().filter(holds).count() as f64 / SETS as f64,
            errors / SETS as f64,
        )
    };
    truth.iter().enumerate().map(one).collect()
}

/// The coverage with the lines and without them; with them it holds for every parameter.
fn compared<S: Fn(u64) -> Scan + Sync>(
    spec: &Spec,
    truth: &[f64],
    make: impl Fn(bool) -> S,
) -> [Vec<(f64, f64)>; 2] {
    let [with, without] = [true, false].map(|named| coverage(spec, truth, make(named)));
    println!("with    {with:?}\nwithout {without:?}");
    assert!(with.iter().all(|(share, _)| *share >= LEAST), "{with:?}");
    [with, without]
}

fn lobe() -> Spec {
    Spec::transmission(model::find("ggx-mirrored").unwrap(), true, false)
}

#[test]
fn a_shared_scale_and_floor_widen_what_they_move() {
    let make = |named: bool| {
        move |seed: u64| {
            let z = |k| normal(seed ^ 0xabc, k);
            let mut scan = scan(seed, 1.0 + 0.02 * z(0), 2e-3 * z(1), 0.0, 0.0);
            if named {
                scan.comments = vec!["shared,scale,0.02".into(), "shared,floor,0.002".into()];
            }
            scan
        }
    };
    let [with, without] = compared(&lobe(), &TRUTH, make);
    // Factors are known as well as the scale, not better; widths do not care.
    assert!(without[0].0 < 0.5 && without[1].0 < 0.5, "{without:?}");
    assert!(
        (with[1].1 / (0.02 * TRUTH[1]) - 1.0).abs() < 0.1,
        "{with:?}"
    );
    assert!(with[2].1 < 1.2 * without[2].1, "{with:?} {without:?}");
}

#[test]
fn axes_that_are_off_are_found_and_do_not_mislead() {
    let make = |named: bool| {
        move |seed: u64| {
            let z = |k| normal(seed ^ 0xdef, k);
            let mut scan = scan(seed, 1.0, 0.0, 0.1 * z(0), 0.1 * z(1));
            if named {
                scan.comments = vec![
                    "shared,light_theta_deg,0.1".into(),
                    "shared,view_theta_deg,0.1".into(),
                ];
            }
            scan
        }
    };
    let [with, without] = compared(&lobe(), &TRUTH, make);
    assert!(without.iter().any(|(share, _)| *share < 0.8), "{without:?}");
    // Knowing what is off makes the error bars of the lobe shorter, not longer.
    assert!(with[2].1 < 0.8 * without[2].1, "{with:?} {without:?}");
}

#[test]
fn rows_count_by_what_is_their_own() {
    // Total errors as a merge writes them: noise, and the slope times the axes' standard deviation.
    let slope = {
        let [up, down] = [0.1, -0.1].map(|d| scan(1, 1.0, 0.0, d, 0.0).samples);
        move |i: usize| 0.5 * (up[i].f - down[i].f)
    };
    let make = |told: bool| {
        let slope = &slope;
        move |seed: u64| {
            let z = |k| normal(seed ^ 0x777, k);
            let mut scan = scan(seed, 1.0, 0.0, 0.1 * z(0), 0.0);
            let mut shares = Vec::new();
            for (i, s) in scan.samples.iter_mut().enumerate() {
                // Three rows of four are twenty times as noisy.
                let noise = if i % 4 == 0 { 1e-3 } else { 2e-2 };
                s.f += (noise * noise - 1e-6_f64).max(0.0).sqrt() * normal(seed ^ 0x778, i as u64);
                let total = f64::hypot(noise, slope(i));
                s.sigma = Some(total);
                shares.push((noise / total).to_string());
            }
            scan.comments = vec!["shared,light_theta_deg,0.1".into()];
            if told {
                let lines = shares.chunks(16).enumerate();
                let line = |(n, c): (usize, &[String])| format!("own,{},{}", 16 * n, c.join(","));
                scan.comments.extend(lines.map(line));
            }
            scan
        }
    };
    let [told, untold] = compared(&lobe(), &TRUTH, make);
    assert!(told[2].1 < 0.8 * untold[2].1, "{told:?} {untold:?}");
}

#[test]
fn the_gap_knows_of_a_shared_scale() {
    let spec = Spec::transmission(model::find("ggx-mirrored").unwrap(), true, true);
    let make = |named: bool| {
        move |seed: u64| {
            let scale = 1.0 + 0.03 * normal(seed ^ 0x123, 0);
            let angle = 1.0 + 0.02 * normal(seed ^ 0x123, 1);
            let mut scan = scan(seed, scale * angle, 0.0, 0.0, 0.0);
            scan.samples.iter_mut().for_each(|s| s.sigma = Some(1e-3));
            for (i, theta) in [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0]
                .into_iter()
                .enumerate()
            {
                for (j, phi) in [0.0, 90.0].into_iter().enumerate() {
                    let l = at(theta, phi);
                    let sigma = if i % 2 == 0 { 1e-4 } else { 1e-3 };
                    let noise = sigma * normal(seed ^ 0x321, (2 * i + j) as u64);
                    scan.direct.push(Direct {
                        l,
                        transmittance: scale * openness(GAP[0], GAP[1], GAP[2], l) + noise,
                        sigma: Some(sigma),
                    });
                }
            }
            if named {
                scan.comments = vec!["shared,scale,0.03".into(), "shared,solid_angle,0.02".into()];
            }
            scan
        }
    };
    let truth: Vec<f64> = TRUTH.into_iter().chain(GAP).collect();
    let [_, without] = compared(&spec, &truth, make);
    assert!(without[4].0 < 0.5 && without[5].0 < 0.5, "{without:?}");
}

#[test]
fn a_line_that_cannot_be_read_is_a_sentence() {
    let mut scan = scan(0, 1.0, 0.0, 0.0, 0.0);
    scan.comments = vec!["shared,scale,many".into()];
    let data = Measurement::from_scan("made", scan.clone());
    let error = woven_fit::fit::fit(&data, &Options::default(), &woven_fit::fit::quiet);
    let error = error.unwrap_err().to_string();
    assert!(error.contains("shared,scale,many"), "{error}");
    scan.comments = vec!["shared,scale,0.01".into(), "shared,dust,1".into()];
    let told = Measurement::from_scan("made", scan).remarks().join(" ");
    assert!(
        told.contains("scale 0.0100") && told.contains("dust"),
        "{told}"
    );
}
