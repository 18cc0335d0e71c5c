//! `ogm plan` and `ogm next`: what a plan means on a rig, and which readings would tell most.

use std::path::PathBuf;

use clap::Args;

use super::{rig_named, tell_left_out};
use ogm_driver::design::Design;
use ogm_driver::error::{Error, Result};
use ogm_driver::merge;
use ogm_driver::plan::{Grid, MOST_POSES, Plan};
use ogm_driver::pose::Pose;
use ogm_driver::rig::Language;
use woven_bsdf::fabric::Fabric;

/// Which plan on which rig.
#[derive(Args)]
pub(crate) struct PlanArgs {
    /// The plan file.
    plan: PathBuf,
    /// The rig: shot, grbl, instant, or a TOML file.
    #[arg(long, default_value = "shot")]
    rig: String,
    /// Lists the poses in the order of the scan.
    #[arg(long)]
    list: bool,
}

/// What is known, and what is the choice.
#[derive(Args)]
pub(crate) struct NextArgs {
    /// The fit so far: the fabric file that `woven-fit fit --out` writes.
    #[arg(long, value_name = "FABRIC.toml")]
    fabric: PathBuf,
    /// The plan whose poses are the choice.
    #[arg(long, value_name = "PLAN.toml")]
    plan: PathBuf,
    /// A log whose readings are already known; may be given more than once.
    #[arg(long, value_name = "LOG")]
    known: Vec<PathBuf>,
    /// How many readings.
    #[arg(long, value_name = "N")]
    count: usize,
    /// Count only what these parameters gain, by name; without it all of them.
    #[arg(long = "for", value_delimiter = ',', value_name = "PARAMETER")]
    aims: Vec<String>,
    /// Count rate of the direct beam, counts a millisecond; that of the known log, or 600000.
    #[arg(long, value_name = "RATE")]
    beam: Option<f64>,
    /// The rig: shot, grbl, instant, or a TOML file.
    #[arg(long, default_value = "shot")]
    rig: String,
    /// The new plan.
    #[arg(short, long)]
    output: PathBuf,
}

/// Prints poses and time of a plan.
pub(crate) fn plan(args: &PlanArgs) -> Result<()> {
    let (rig, plan) = (rig_named(&args.rig)?, Plan::load(&args.plan)?);
    let route = plan.route(&rig)?;
    tell_left_out(route.left_out);
    let language = match rig.language {
        Language::Shot => "SHOT",
        Language::Grbl => "GRBL",
    };
    println!(
        "{}: {} poses, at most {:.1} min on {} ({language}), calibration apart.",
        plan.name,
        route.poses.len(),
        route.seconds / 60.0,
        rig.name
    );
    if args.list {
        for pose in &route.poses {
            let [a, b, c, d] = pose.angles();
            println!("{a},{b},{c},{d}");
        }
    }
    Ok(())
}

/// Writes a plan of the poses that tell most.
pub(crate) fn next(args: &NextArgs) -> Result<()> {
    let (rig, mut plan) = (rig_named(&args.rig)?, Plan::load(&args.plan)?);
    let fabric = Fabric::read(&args.fabric)
        .map_err(|e| Error::Plan(format!("The fabric file cannot be used: {e}.")))?;
    if args.count == 0 || args.count > MOST_POSES {
        return Err(Error::Plan(format!("--count must be 1 to {MOST_POSES}.")));
    }
    let known = match args.known.as_slice() {
        [] => None,
        logs => Some(merge::merge_logs(logs)?),
    };
    let logged = known.as_ref().map(|m| m.beam);
    let beam = args.beam.or(logged).unwrap_or(600_000.0);
    let known: Vec<Pose> = known
        .iter()
        .flat_map(|m| {
            let scattered = m.samples.iter().map(|s| s.pose);
            scattered.chain(m.direct.iter().map(|d| d.pose))
        })
        .collect();
    let candidates = plan.route(&rig)?.poses;
    let design = Design::new(&fabric, &rig.detector, &plan.exposure, beam)?;
    let chosen = design.choose(&candidates, &known, args.count, &args.aims)?;
    let all: Vec<Pose> = known.iter().chain(&chosen).copied().collect();
    let (before, after) = (design.errors(&known), design.errors(&all));
    for ((name, before), after) in design.names().iter().zip(before).zip(after) {
        let told = |sigma: f64| {
            if sigma.is_finite() {
                format!("{sigma:.3e}")
            } else {
                "not seen".into()
            }
        };
        println!(
            "{name}: standard error {} before, {} after",
            told(before),
            told(after)
        );
    }
    let mut places: Vec<Pose> = Vec::new();
    for pose in &chosen {
        if !places.contains(pose) {
            places.push(*pose);
        }
    }
    println!(
        "{} readings at {} poses; a pose that tells much is read more than once.",
        chosen.len(),
        places.len()
    );
    plan.name = format!("{}, next {}", plan.name, args.count);
    plan.grid = Grid::List {
        poses: chosen.iter().map(Pose::angles).collect(),
    };
    let text = toml::to_string(&plan)
        .map_err(|e| Error::Plan(format!("The plan cannot be written: {e}.")))?;
    merge::write_whole(&args.output, text.as_bytes())
}
