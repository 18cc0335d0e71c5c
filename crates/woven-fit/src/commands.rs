//! The commands of `woven-fit`, each in a file of its own, and what they share.

mod evaluate;
mod fit;
mod photos;
mod rank;
mod synth;

use anyhow::{Context, Result};
use clap::{Parser, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use woven_fit::convert::convert;
use woven_fit::info::info;
use woven_fit::measurement::Measurement;

/// Fits models of woven cloth to goniometer measurements.
#[derive(Debug, Parser)]
#[command(
    name = "woven-fit",
    version,
    after_help = "Example: woven-fit fit assets/measurements/mecho_6216_goniometer.xml --out fit/"
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Fit models to measurements; print the ranking, write fit.json, a fabric and a report.
    #[command(
        after_help = "Example: woven-fit fit lace.xml --model sheet,ggx-mirrored,hgf --out fit/"
    )]
    Fit(fit::Args),
    /// Fit models to many measurements and rank them in one table.
    #[command(after_help = "Example: woven-fit rank *.xml --model ward,hgf,ggx-mirrored")]
    Rank(rank::Args),
    /// First values for the sheet from one photo of reflected and one of transmitted light.
    #[command(
        after_help = "Example: woven-fit photos --reflection twill_R.png --transmission twill_T.png --out fit/"
    )]
    Photos(photos::Args),
    /// Make a measurement whose truth is known: one of the published sets, or a scan of any model.
    #[command(
        after_help = "Examples: woven-fit synth paper79 --seed 0 > paper79.csv\n          woven-fit synth ward --param k_d=0.2,k_s=0.3 --incidence 0,25,50 --out ward.csv"
    )]
    Synth(synth::Args),
    /// Evaluate a model at directions: columns lx,ly,lz,vx,vy,vz in; the same plus f,pdf out.
    #[command(
        after_help = "Example: woven-fit eval --model ggx-mirrored --param k_d=0.1,k_t=0.3,alpha_x=0.1,alpha_y=0.2 dirs.csv"
    )]
    Eval(evaluate::Args),
    /// List every model with its parameters, bounds, units and equation.
    #[command(after_help = "Example: woven-fit models --json")]
    Models {
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// What a measurement says by itself: transmittance per incidence, openness, peak, skirt and floor.
    #[command(after_help = "Example: woven-fit info assets/measurements/mecho_6216_goniometer.xml")]
    Info {
        /// The measurement.
        data: PathBuf,
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// Convert a measurement to scattered points (.csv) or PAB text (.pab, a file for each incidence).
    #[command(
        after_help = "Examples: woven-fit convert shade.xml shade.csv\n          woven-fit convert scan.csv scan.pab"
    )]
    Convert {
        /// What to read.
        input: PathBuf,
        /// What to write.
        output: PathBuf,
    },
}

/// Runs a command.
pub(crate) fn run(cli: Cli) -> Result<()> {
    match cli.command {
        Command::Fit(args) => fit::run(&args),
        Command::Rank(args) => rank::run(&args),
        Command::Photos(args) => photos::run(&args),
        Command::Synth(args) => synth::run(&args),
        Command::Eval(args) => evaluate::run(&args),
        Command::Models { json } => evaluate::models(json),
        Command::Info { data, json } => {
            let info = info(&Measurement::read(&data)?);
            print(&if json {
                serde_json::to_string_pretty(&info)? + "\n"
            } else {
                info.to_text()
            })
        }
        Command::Convert { input, output } => print(&convert(&input, &output)?),
    }
}

fn print(text: &str) -> Result<()> {
    Ok(std::io::stdout().lock().write_all(text.as_bytes())?)
}

/// The command as typed, without folders of this machine, for the heads of result files.
fn command_line() -> String {
    let mut words = vec!["woven-fit".to_owned()];
    words.extend(std::env::args().skip(1).map(|a| {
        let path = Path::new(&a);
        match path.file_name() {
            Some(name) if path.is_absolute() => name.to_string_lossy().into_owned(),
            _ => a,
        }
    }));
    words.join(" ")
}

/// Makes the folder and proves that it can be written, before minutes of work.
fn prepare_folder(out: &Path) -> Result<()> {
    std::fs::create_dir_all(out)
        .with_context(|| format!("cannot make the folder {}", out.display()))?;
    tempfile::NamedTempFile::new_in(out)
        .map(drop)
        .with_context(|| {
            format!(
                "cannot write into the folder {}; choose another with --out",
                out.display()
            )
        })
}

static STOP: AtomicBool = AtomicBool::new(false);

/// Ctrl-C ends the work after the model at hand; a second one ends the program at once.
fn stop_at_ctrl_c() {
    let _ = ctrlc::set_handler(|| {
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
}

fn stopped() -> bool {
    STOP.load(Ordering::Relaxed)
}

/// A bar on a terminal, nothing in a pipe.
fn progress_bar() -> ProgressBar {
    let bar = if std::io::stderr().is_terminal() {
        ProgressBar::new(1)
    } else {
        ProgressBar::hidden()
    };
    bar.set_style(
        ProgressStyle::with_template("{msg:28} {bar:24} {pos}/{len} models, {per_sec}, {eta} left")
            .expect("a fixed template"),
    );
    bar
}
