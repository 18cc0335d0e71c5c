//! Random rigs and random plans: whatever the plan asks, no move on the wire leaves the limits or enters the zone where the arms touch.
//! The wire is read by a second account of both languages and of the geometry, so that an error in ours does not hide itself.
//!
//! `OGM_PLANS` sets the number of plans (the suite: 3000).

mod common;

use std::sync::{Arc, Mutex};

use ogm_driver::axis::Axis;
use ogm_driver::error::Error;
use ogm_driver::plan::Plan;
use ogm_driver::rig::Rig;
use ogm_driver::scan::{self, Quiet};
use ogm_driver::sim::noise::Noise;
use ogm_driver::sim::optics::PlainCloth;
use ogm_driver::sim::{Bench, Device, FaultPlan, Imperfections, MemoryTransport};
use ogm_driver::transport::StopToken;

fn random_rig(noise: &mut Noise) -> Rig {
    let mut rig = if noise.below(2) == 0 {
        Rig::default()
    } else {
        Rig::grbl()
    };
    rig.zone_deg = noise.uniform() * 30.0;
    rig.park_deg = 180.0;
    for (i, axis) in rig.axes.iter_mut().enumerate() {
        let theta = i % 2 == 0;
        let wide = if theta { 90.0 } else { 180.0 };
        // Limits that hold the reference pose (0, 0, 180, 0), else every plan would be refused.
        let home = if i == 2 { 180.0 } else { 0.0 };
        axis.min_deg = home - noise.uniform() * if i == 0 { 20.0 } else { 2.0 * wide };
        axis.max_deg = home + noise.uniform() * if i == 2 { 20.0 } else { 2.0 * wide };
        if rig.language == ogm_driver::rig::Language::Shot {
            axis.degrees_per_pulse = [0.0025, 0.005, 0.001, -0.0025, 0.02][noise.below(5) as usize];
        }
    }
    rig.with_instant_motors()
}

fn random_plan(noise: &mut Noise, rig: &Rig) -> Plan {
    let noise_of_grid = noise.below(300);
    let angle = |noise: &mut Noise, axis: &Axis| {
        let (a, b) = (axis.min_deg, axis.max_deg);
        match noise.below(8) {
            0 => a,
            1 => b,
            2 => a - 0.01,
            3 => 0.0,
            _ => a + (b - a) * noise.uniform(),
        }
    };
    let mut one = |axis: usize| angle(noise, &rig.axes[axis]);
    // Mostly a few poses anywhere; now and then the grids that users name.
    let grid = match noise_of_grid {
        0 => format!(
            "kind = 'paper'\nlight_elevations = [{}]",
            180.0 - one(0).abs()
        ),
        1 => format!(
            "kind = 'klems'\ntheta_l = [{}]\nphi_l = [{}]",
            one(0),
            one(1)
        ),
        2 => format!(
            "kind = 'adaptive'\ntheta_l = [{}]\nplanes = [{}]\nfirst_step = 40\nmost = 30",
            one(0),
            one(3)
        ),
        3..12 => format!(
            "kind = 'uniform'\ntheta_l = [{}, {}]\nphi_l = [{}]\ntheta_v = [{}, {}]\nphi_v = [{}]",
            one(0),
            one(0),
            one(1),
            one(2),
            one(2),
            one(3)
        ),
        12..22 => format!(
            "kind = 'random'\ncount = 3\nseed = {noise_of_grid}\ntheta_max = {}",
            1.0 + one(0).abs().min(80.0)
        ),
        _ => {
            let poses: Vec<String> = (0..=noise_of_grid % 4)
                .map(|_| format!("[{},{},{},{}]", one(0), one(1), one(2), one(3)))
                .collect();
            format!("kind = 'list'\nposes = [{}]", poses.join(","))
        }
    };
    let leave = if noise.below(4) > 0 {
        "leave-out"
    } else {
        "refuse"
    };
    Plan::from_toml(&format!(
        "name = 'r'\nforbidden = '{leave}'\n[grid]\n{grid}\n[exposure]\nladder_ms = [1]\n[calibration]\ndark = 0\ndirect = 1\nwhite = {}",
        noise.below(2) == 0
    ))
    .unwrap()
}

/// The angles a line on the wire sends the arms to, in degrees: written from the manuals, not from the driver.
fn target(line: &str, rig: &Rig) -> Option<[f64; 4]> {
    let numbers: Vec<f64> = if let Some(rest) = line.strip_prefix("A:W") {
        let rest = rest.replace('P', "");
        let mut out = Vec::new();
        let mut word = String::new();
        for c in rest.chars() {
            if (c == '+' || c == '-') && !word.is_empty() {
                out.push(word.parse::<f64>().unwrap());
                word.clear();
            }
            word.push(c);
        }
        out.push(word.parse::<f64>().unwrap());
        out
    } else if let Some(rest) = line.strip_prefix("$J=G90G21") {
        let words = rest
            .split(|c: char| c.is_ascii_uppercase())
            .filter(|w| !w.is_empty());
        words
            .take(4)
            .map(|w| w.parse::<f64>().unwrap() / 0.001)
            .collect()
    } else {
        // Nothing else may move an arm, homing apart.
        assert!(
            !["M:", "J:", "G0", "G1", "G90"]
                .iter()
                .any(|m| line.starts_with(m)),
            "{line}"
        );
        return None;
    };
    assert_eq!(numbers.len(), 4, "{line}");
    let per_pulse = |i: usize| {
        if line.starts_with('$') {
            0.001
        } else {
            rig.axes[i].degrees_per_pulse
        }
    };
    Some(std::array::from_fn(|i| {
        numbers[i] * per_pulse(i) + rig.axes[i].home_deg
    }))
}

fn separation(a: [f64; 4]) -> f64 {
    let unit = |t: f64, p: f64| {
        let (t, p) = (t.to_radians(), p.to_radians());
        [t.sin() * p.cos(), t.sin() * p.sin(), t.cos()]
    };
    let (l, v) = (unit(a[0], a[1]), unit(a[2], a[3]));
    (l[0] * v[0] + l[1] * v[1] + l[2] * v[2])
        .clamp(-1.0, 1.0)
        .acos()
        .to_degrees()
}

#[test]
fn no_byte_on_the_wire_leaves_the_limits_or_enters_the_zone() {
    let count: u64 = std::env::var("OGM_PLANS")
        .ok()
        .and_then(|s| s.parse().ok())
        .unwrap_or(3000);
    let first: u64 = std::env::var("OGM_FIRST_PLAN")
        .ok()
        .and_then(|s| s.parse().ok())
        .unwrap_or(0);
    let folder = common::quick_folder();
    let (mut moves, mut done, mut refused) = (0_u64, 0_u64, 0_u64);
    for seed in first..first + count {
        let mut noise = Noise::at(&[seed, 0x7a6f]);
        let rig = random_rig(&mut noise);
        let plan = random_plan(&mut noise, &rig);
        let mut device = Device::new(
            Bench::new(rig.clone(), Arc::new(PlainCloth), Imperfections::none()),
            FaultPlan::none(),
        );
        device.journal = Some(Vec::new());
        let device = Arc::new(Mutex::new(device));
        let log = folder.path().join("x.ogm");
        let result = scan::run(
            Box::new(MemoryTransport::new(device.clone())),
            &rig,
            &plan,
            &log,
            &StopToken::new(),
            &mut Quiet,
        );
        let complete = result.is_ok();
        match result {
            Ok(_) => done += 1,
            Err(Error::Limit { .. } | Error::Zone { .. } | Error::Plan(_)) => refused += 1,
            Err(e) => panic!("plan {seed}: {e}"),
        }
        let _ = std::fs::remove_file(&log);
        let mut here: [f64; 4] = std::array::from_fn(|i| rig.axes[i].home_deg);
        let journal = device.lock().unwrap().journal.take().unwrap();
        let said = journal.iter().filter(|l| l.to_rig).count();
        assert!(
            complete || said == 0,
            "plan {seed}: refused after {said} lines had gone out"
        );
        for line in journal.iter().filter(|l| l.to_rig) {
            let Some(to) = target(&line.text, &rig) else {
                continue;
            };
            moves += 1;
            for (axis, to) in rig.axes.iter().zip(to) {
                let (min, max) = (axis.min_deg, axis.max_deg);
                assert!(
                    to >= min - 1e-7 && to <= max + 1e-7,
                    "plan {seed}: {} to {to} of {min}..{max}",
                    axis.name
                );
            }
            // Each axis runs at its own pace: any mixture of the ways is possible.
            for k in 0..40 {
                let mixed: [f64; 4] = std::array::from_fn(|i| {
                    let t = if k < 16 {
                        f64::from(k >> i & 1)
                    } else {
                        noise.uniform()
                    };
                    here[i] + t * (to[i] - here[i])
                });
                // The pulses are whole, so half a pulse of each axis is allowed for the end; 1e-5 is the cosine's rounding near 0°.
                assert!(
                    separation(mixed) >= rig.zone_deg - 1e-5,
                    "plan {seed}: {:.4} deg of {} at {mixed:?}",
                    separation(mixed),
                    rig.zone_deg
                );
            }
            here = to;
        }
    }
    println!(
        "{count} plans: {done} done, {refused} refused before the first byte, {moves} moves on the wire, all within limits and clear"
    );
    assert!(done > count / 20 && refused > count / 20 && moves > count / 4);
}
