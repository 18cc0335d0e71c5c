//! `woven-fit rank`: many measurements, one table.

use super::{command_line, fit, prepare_folder, print};
use anyhow::Result;
use std::path::PathBuf;
use woven_fit::compare::Comparison;
use woven_fit::convert::write_atomically;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Measurements: Klems matrix or tensor tree (.xml), scattered points (.csv) or PAB text (.pab, .txt, .dat).
    #[arg(required = true)]
    data: Vec<PathBuf>,
    #[command(flatten)]
    how: fit::How,
    /// Folder for rank.csv and rank.json; without it nothing is written.
    #[arg(long)]
    out: Option<PathBuf>,
}

pub(super) fn run(args: &Args) -> Result<()> {
    let options = args.how.options()?;
    if let Some(out) = &args.out {
        prepare_folder(out)?;
    }
    let mut results = Vec::new();
    fit::fit_all(&args.data, &options, |_, result| {
        results.push(result);
        Ok(())
    })?;
    let table = Comparison::of(&results, options.seed);
    print(&table.to_text())?;
    if let Some(out) = &args.out {
        let command = command_line();
        let mut json = serde_json::to_value(&table)?;
        if let Some(map) = json.as_object_mut() {
            map.insert("command".into(), command.clone().into());
        }
        let csv = format!("# {command}\n{}", table.to_csv());
        write_atomically(&out.join("rank.csv"), csv.as_bytes())?;
        let json = serde_json::to_string_pretty(&json)? + "\n";
        write_atomically(&out.join("rank.json"), json.as_bytes())?;
        print(&format!(
            "written to {}: rank.csv, rank.json\n",
            out.display()
        ))?;
    }
    Ok(())
}
