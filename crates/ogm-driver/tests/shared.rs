//! What the merge calls shared and what it calls a row's own, against rigs of known truth: over many rigs the rows move together by the shared errors,
//! and about that common move each scatters by its own.

mod common;

use std::sync::Arc;

use common::measure;
use ogm_driver::merge::Measurement;
use ogm_driver::plan::Plan;
use ogm_driver::rig::Rig;
use ogm_driver::sim::Imperfections;
use ogm_driver::sim::noise::Noise;
use ogm_driver::sim::optics::FnSample;

/// An even cloth: neither the aperture nor a tilted axis changes what is read of it.
const F: f64 = 0.3;
const GAP: f64 = 0.2;

/// Root of the mean square.
fn rms(all: &[f64]) -> f64 {
    (all.iter().map(|x| x * x).sum::<f64>() / all.len() as f64).sqrt()
}

/// Weighted mean of relative errors (error, own standard error).
fn common_move(rows: &[(f64, f64)]) -> f64 {
    let weight = |r: &(f64, f64)| r.1.powi(-2);
    rows.iter().map(|r| weight(r) * r.0).sum::<f64>() / rows.iter().map(weight).sum::<f64>()
}

fn samples(m: &Measurement) -> Vec<(f64, f64)> {
    m.samples
        .iter()
        .map(|s| (s.f / F - 1.0, s.own / F))
        .collect()
}

fn direct(m: &Measurement) -> Vec<(f64, f64)> {
    let of = |t: f64| t / GAP;
    m.direct
        .iter()
        .map(|d| (of(d.transmittance) - 1.0, of(d.own)))
        .collect()
}

#[test]
fn rows_move_together_by_the_shared_errors_and_scatter_by_their_own() {
    let mut rig = Rig::default().with_instant_motors();
    rig.detector.aperture_sigma_deg = 0.002;
    let plan = Plan::from_toml("name = 's'\nforbidden = 'leave-out'\n[grid]\nkind = 'uniform'\ntheta_l = [0, 10, 20, 30, 40, 50]\nphi_l = [0]\ntheta_v = { from = 112, to = 176, step = 8 }\nphi_v = [0, 90]").unwrap();
    let (mut moves, mut of_direct, mut own) = (Vec::new(), Vec::new(), Vec::new());
    for seed in 0..60 {
        let mut noise = Noise::at(&[seed, 0x5ba]);
        let wrong = Imperfections {
            seed,
            nonlinearity: 0.005 * (2.0 * noise.uniform() - 1.0),
            aperture_error_deg: rig.detector.aperture_sigma_deg * noise.normal(),
            ..Imperfections::default()
        };
        let cloth = FnSample {
            bsdf: |_, _| F,
            direct: |_| GAP,
        };
        let m = measure(&rig, Arc::new(cloth), wrong, &plan);
        let (rows, straight) = (samples(&m), direct(&m));
        assert!(rows.len() > 90 && straight.len() >= 6);
        let shared = common_move(&rows);
        let of_rows = (1.0 / rows.iter().map(|r| r.1.powi(-2)).sum::<f64>()).sqrt();
        moves.push(shared / m.shared.scale.hypot(m.shared.solid_angle).hypot(of_rows));
        own.extend(rows.iter().map(|r| (r.0 - shared) / r.1));
        // The straight-through light knows no solid angle.
        let shared = common_move(&straight);
        let of_rows = (1.0 / straight.iter().map(|r| r.1.powi(-2)).sum::<f64>()).sqrt();
        of_direct.push(shared / m.shared.scale.hypot(of_rows));
    }
    let (moves, of_direct, own) = (rms(&moves), rms(&of_direct), rms(&own));
    println!(
        "in units of what is stated: rows move together by {moves:.2}, straight-through light by {of_direct:.2}, rows scatter by {own:.2}"
    );
    // 60 rigs: the root mean square of as many normal numbers is 1 ± 0.09; three of that. The stated scale holds the curvature's part of the scattered
    // light, which is read from a tenth of the detector's range on; the straight-through light stands nearer to the direct beam, so it moves less. The rows
    // are thousands: a tenth allows for the noise being taken at each reading's mean.
    assert!((0.73..1.27).contains(&moves) && (0.6..1.27).contains(&of_direct));
    assert!((0.9..1.1).contains(&own));
}
