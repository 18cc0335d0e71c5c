//! `woven-fit synth`: measurements whose truth is known.

use super::{command_line, print};
use crate::commands::evaluate::values_of;
use anyhow::{Result, bail};
use std::path::PathBuf;
use woven_bsdf::model::{self, MODELS};
use woven_fit::convert::write_atomically;
use woven_fit::synth::{SETS, scan_of};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// paper79, hgf79 or kd79, or the name of a model.
    what: String,
    /// For a model: parameters that differ from their start values.
    #[arg(long, value_delimiter = ',', value_name = "KEY=VALUE")]
    param: Vec<String>,
    /// For a model: angles of incidence in the weft plane, degrees.
    #[arg(long, value_delimiter = ',', default_value = "0")]
    incidence: Vec<f64>,
    /// For a model: standard deviation of the noise, as a share of the greatest value.
    #[arg(long, default_value_t = 0.01)]
    noise: f64,
    /// Seed of the noise.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// A set without noise.
    #[arg(long)]
    clean: bool,
    /// The file; without it the text goes to standard output.
    #[arg(long)]
    out: Option<PathBuf>,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let mut scan = if let Some(set) = SETS.iter().find(|s| s.name == args.what) {
        set.scan((!args.clean).then_some(args.seed))
    } else if let Some(model) = model::find(&args.what) {
        let values = values_of(model, &args.param)?;
        if let Some(theta) = args.incidence.iter().find(|t| !(0.0..90.0).contains(*t)) {
            bail!("--incidence {theta}: angles of incidence lie between 0 and 90 degrees");
        }
        if !(0.0..=1.0).contains(&args.noise) {
            bail!("--noise {}: a share between 0 and 1", args.noise);
        }
        let noise = if args.clean { 0.0 } else { args.noise };
        scan_of(model, &values, &args.incidence, noise, args.seed)
    } else {
        let sets = SETS.iter().map(|s| s.name);
        let known: Vec<&str> = sets.chain(MODELS.iter().map(|m| m.name)).collect();
        bail!(
            "there is neither a set nor a model {:?}; choose from {}",
            args.what,
            known.join(", ")
        );
    };
    scan.comments.insert(0, command_line());
    match &args.out {
        Some(out) => write_atomically(out, scan.to_text().as_bytes()),
        None => print(&scan.to_text()),
    }
}
