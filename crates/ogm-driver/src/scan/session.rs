//! One session of a scan: warm up, home, what calibration the log lacks, then every pose that it lacks, with more poses where the plan is adaptive.

use std::time::Duration;

use super::bench::{Bench, Task, wall_seconds};
use super::{Start, Watcher};
use crate::adaptive;
use crate::error::{Error, Result};
use crate::log::{Reading, Record, What};
use crate::plan::Plan;
use crate::pose::Pose;
use crate::rig::{Holder, output_bits};

/// From warming up to the end or the first failure; returns the number of sample poses, all of them stored then.
pub(super) fn run(
    bench: &mut Bench<'_>,
    mut poses: Vec<Pose>,
    mut start: Start,
    torn_bytes: u64,
    watcher: &mut dyn Watcher,
) -> Result<usize> {
    // Answers to an earlier session that died, or the welcome of a board that opening the port has reset, may still be on their way.
    bench.link.wait(Duration::from_millis(20))?;
    let controller = bench.controller.identify(&mut bench.link, bench.rig)?;
    let detector = bench.detector.identify(&mut bench.link, bench.rig)?;
    let lamp_s = warm_up(bench, watcher)?;
    watcher.say("Homing.");
    bench.home()?;
    bench.append(&Record::Session {
        number: start.sessions,
        wall_s: wall_seconds(),
        scan_s: start.scan_s,
        controller,
        detector,
        lamp_s,
        torn_bytes,
    })?;
    calibrate(bench, &mut start, poses.len(), watcher)?;
    let mut next = 0;
    loop {
        while next < poses.len() {
            sample(bench, &mut start, &poses, next, watcher)?;
            next += 1;
        }
        // From the readings alone, so that a resumed scan chooses the same poses.
        let more = adaptive::refine(bench.plan, bench.rig, &start.readings, &poses)?;
        if more.is_empty() {
            break;
        }
        watcher.say(&format!(
            "{} poses more, where the light changes fast.",
            more.len()
        ));
        poses.extend(more);
    }
    bench.append(&Record::End {
        points: start.done.len(),
    })?;
    bench.set_outputs(output_bits(false, Holder::Sample))?;
    Ok(poses.len())
}

/// One pose of the sample, with the reference reading that is due before it.
fn sample(
    bench: &mut Bench<'_>,
    start: &mut Start,
    poses: &[Pose],
    index: usize,
    watcher: &mut dyn Watcher,
) -> Result<()> {
    if start.done.contains(&index) {
        return Ok(());
    }
    let every = bench.plan.calibration.reference_every as usize;
    if every > 0 && index > 0 && index.is_multiple_of(every) && !start.had(What::Reference, index) {
        let task = Task::new(What::Reference, index, Plan::REFERENCE);
        let reading = bench.reading(task, watcher, (start.done.len(), poses.len()))?;
        start.readings.push(reading);
    }
    let task = Task::new(What::Sample, index, poses[index]);
    let reading = bench.reading(task, watcher, (start.done.len() + 1, poses.len()))?;
    start.readings.push(reading);
    start.done.insert(index);
    Ok(())
}

/// Waits for the lamp. A lamp that is off is an error, not something to wait for.
fn warm_up(bench: &mut Bench<'_>, watcher: &mut dyn Watcher) -> Result<Option<f64>> {
    let needed = bench.plan.calibration.warm_up_min * 60.0;
    let mut told = false;
    loop {
        let Some(on) = bench.detector.lamp_seconds(&mut bench.link, bench.rig)? else {
            return Ok(None);
        };
        if on >= needed && on > 0.0 {
            return Ok(Some(on));
        }
        if on <= 0.0 {
            return Err(Error::Lamp(
                "The lamp is off; switch it on and start again, the scan waits until it is warm."
                    .into(),
            ));
        }
        if !told {
            told = true;
            watcher.say(&format!(
                "The lamp has been on for {:.0} min; waiting until it has been {:.0} min.",
                on / 60.0,
                needed / 60.0
            ));
        }
        bench
            .link
            .wait(Duration::from_secs_f64((needed - on).clamp(0.1, 5.0)))?;
    }
}

/// Dark, direct, linearity and white readings that the log does not have yet; after a resume one check of the direct beam.
fn calibrate(
    bench: &mut Bench<'_>,
    start: &mut Start,
    points: usize,
    watcher: &mut dyn Watcher,
) -> Result<()> {
    let first = start.readings.iter().find(|r| r.what == What::Direct);
    let first = first.map(rough_rate);
    let c = &bench.plan.calibration;
    let kinds = [
        (What::Dark, c.dark, Plan::REFERENCE),
        (What::Direct, c.direct, Plan::REFERENCE),
        (What::Linearity, c.linearity, Plan::REFERENCE),
        (What::White, u32::from(c.white), Plan::WHITE),
    ];
    for (what, count, pose) in kinds {
        for index in 0..count as usize {
            if start.had(what, index) {
                continue;
            }
            let mut task = Task::new(what, index, pose);
            match what {
                What::Dark => task.exposures.clone_from(&bench.plan.exposure.ladder_ms),
                What::Linearity => task.exposures = linearity_exposures(bench, start),
                _ => {}
            }
            let reading = bench.reading(task, watcher, (start.done.len(), points))?;
            start.readings.push(reading);
        }
    }
    let Some(first) = first else { return Ok(()) };
    let task = Task::new(What::Check, start.sessions as usize, Plan::REFERENCE);
    let check = bench.reading(task, watcher, (start.done.len(), points))?;
    let ratio = rough_rate(&check) / first;
    let tolerance = bench.plan.calibration.resume_tolerance;
    start.readings.push(check);
    if (ratio - 1.0).abs() <= tolerance {
        return Ok(());
    }
    Err(Error::Lamp(format!(
        "After the resume the reference reads {ratio:.3} of what it read at the start, more than {tolerance} away; see to the lamp and the alignment, or begin a new log."
    )))
}

/// Exposures that bring the direct beam from a tenth of full scale to 0.85 of it.
fn linearity_exposures(bench: &Bench<'_>, start: &Start) -> Vec<f64> {
    let shot = start.readings.iter().find(|r| r.what == What::Direct);
    let shot = shot.and_then(|r| r.shots.iter().find(|s| !s.saturated));
    let end = shot.map_or(1.0, |s| {
        s.exposure_ms * 0.85 * bench.rig.detector.full_scale / s.counts.max(1.0)
    });
    [0.12, 0.25, 0.4, 0.55, 0.7, 0.85, 1.0]
        .map(|share| (share * end * 1000.0).round().clamp(1.0, 6e8) / 1000.0)
        .to_vec()
}

/// Counts a millisecond of the longest unsaturated shot over the reference diode: good enough to compare two direct beams.
fn rough_rate(reading: &Reading) -> f64 {
    let best = reading
        .shots
        .iter()
        .filter(|s| !s.saturated)
        .max_by(|a, b| a.exposure_ms.total_cmp(&b.exposure_ms));
    best.map_or(0.0, |s| s.counts / s.exposure_ms / s.reference.max(1.0))
}
