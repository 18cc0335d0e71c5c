//! `ogm replay` and `ogm merge`: what a log holds.

use std::path::PathBuf;

use clap::Args;

use ogm_driver::error::{Error, Result};
use ogm_driver::log;
use ogm_driver::merge::Measurement;
use ogm_driver::{merge as merging, replay as replaying};

/// Which log.
#[derive(Args)]
pub(crate) struct ReplayArgs {
    /// The log.
    log: PathBuf,
}

/// Which log, and what becomes of it.
#[derive(Args)]
pub(crate) struct MergeArgs {
    /// The logs; several of one sample become one measurement.
    #[arg(required = true)]
    logs: Vec<PathBuf>,
    /// The measurement.
    #[arg(short, long)]
    output: PathBuf,
    /// Uses what is readable of damaged logs.
    #[arg(long)]
    salvage: bool,
}

/// Prints what a log holds and whether it agrees with its plan.
pub(crate) fn replay(args: &ReplayArgs) -> Result<()> {
    let r = replaying::replay(&log::read(&args.log)?)?;
    let counts: Vec<String> = r.readings.iter().map(|(k, n)| format!("{n} {k}")).collect();
    println!(
        "{} sessions, {}; {} poses missing, {} saturated.",
        r.sessions,
        counts.join(", "),
        r.missing,
        r.saturated
    );
    println!(
        "{}",
        if r.complete {
            "The scan is complete."
        } else {
            "The scan is not complete; `ogm scan` goes on."
        }
    );
    if let Some(m) = &r.measurement {
        println!(
            "{} values and {} straight-through transmittances.",
            m.samples.len(),
            m.direct.len()
        );
        for c in &m.comments {
            println!("  {c}");
        }
    }
    match r.findings.as_slice() {
        [] => Ok(()),
        all => Err(Error::Log(format!(
            "{} findings: {}",
            all.len(),
            all.join(" ")
        ))),
    }
}

/// Writes the measurement of a log.
pub(crate) fn merge(args: &MergeArgs) -> Result<()> {
    let measurement = if args.salvage {
        let mut whole: Option<Measurement> = None;
        for path in &args.logs {
            let one = merging::merge_contents(&log::read(path)?)?;
            match &mut whole {
                Some(m) => m.append(one),
                None => whole = Some(one),
            }
        }
        whole.unwrap_or_default()
    } else {
        merging::merge_logs(&args.logs)?
    };
    let output = &args.output;
    match output.extension().and_then(|e| e.to_str()) {
        Some("csv") => measurement.write_csv(output)?,
        Some("txt") => {
            for file in measurement.write_pab(output)? {
                println!("{}", file.display());
            }
        }
        Some("xml") => {
            let [_, sigma] = measurement.write_klems(output)?;
            println!("{}", sigma.display());
        }
        _ => {
            return Err(Error::Merge(format!(
                "{} should end in .csv, in .txt for pgII text, or in .xml for a Klems matrix; choose one.",
                output.display()
            )));
        }
    }
    eprintln!(
        "{} values and {} straight-through transmittances in {}.",
        measurement.samples.len(),
        measurement.direct.len(),
        output.display()
    );
    Ok(())
}
