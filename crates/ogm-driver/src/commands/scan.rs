//! `ogm scan`: a scan over a port, with progress.

use std::io::{IsTerminal, Write};
use std::path::PathBuf;

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use super::{rig_named, stop_on_signal, tell_left_out};
use ogm_driver::detector::{Detector, ExternalDetector, SerialPhotodiode};
use ogm_driver::error::Result;
use ogm_driver::log::{Reading, What};
use ogm_driver::plan::Plan;
use ogm_driver::recorded::{Playback, Recorder};
use ogm_driver::rig::Rig;
use ogm_driver::scan::{self, Watcher};
use ogm_driver::serial::SerialTransport;
use ogm_driver::transport::Transport;

/// What to scan, and over which port.
#[derive(Args)]
pub(crate) struct ScanArgs {
    /// The port's name.
    #[arg(long, required_unless_present = "playback")]
    port: Option<String>,
    /// Writes every byte that passes over the port into a new file.
    #[arg(long)]
    record: Option<PathBuf>,
    /// Such a file, played back instead of a port: the same scan again, without the rig.
    #[arg(long, conflicts_with_all = ["port", "record"])]
    playback: Option<PathBuf>,
    /// The plan file.
    #[arg(long)]
    plan: PathBuf,
    /// The log; appended to if it exists.
    #[arg(short, long)]
    output: PathBuf,
    /// The rig: shot, grbl, instant, or a TOML file.
    #[arg(long, default_value = "shot")]
    rig: String,
    /// A command that is the detector and answers JSON lines, instead of the photodiode on the rig's line.
    #[arg(long)]
    detector: Option<String>,
    /// Prints a line for every stored reading.
    #[arg(long)]
    verbose: bool,
}

/// Runs or resumes a scan.
pub(crate) fn scan(args: ScanArgs) -> Result<()> {
    let (rig, plan) = (rig_named(&args.rig)?, Plan::load(&args.plan)?);
    let route = plan.route(&rig)?;
    tell_left_out(route.left_out);
    let transport = open(&args, &rig)?;
    let mut show = Show::new(route.poses.len(), args.verbose);
    let stop = stop_on_signal();
    let detector: Box<dyn Detector> = match &args.detector {
        Some(command) => Box::new(ExternalDetector::start(command)?),
        None => Box::new(SerialPhotodiode),
    };
    let outcome = scan::run_with(
        transport,
        detector,
        &rig,
        &plan,
        &args.output,
        &stop,
        &mut show,
    )?;
    show.bar.finish_and_clear();
    eprintln!(
        "{} of {} poses are in {} ({} were there before).",
        outcome.stored,
        outcome.points,
        args.output.display(),
        outcome.found
    );
    Ok(())
}

fn open(args: &ScanArgs, rig: &Rig) -> Result<Box<dyn Transport>> {
    let port = match (&args.playback, &args.port) {
        (Some(path), _) => return Ok(Box::new(Playback::open(path)?)),
        (None, port) => port.as_deref().unwrap_or_default(),
    };
    let port = Box::new(SerialTransport::open(port, rig.baud, rig.rts_cts)?);
    match &args.record {
        Some(path) => Ok(Box::new(Recorder::new(port, path)?)),
        None => Ok(port),
    }
}

/// Progress on a terminal, or a line for each reading with `--verbose`.
struct Show {
    bar: ProgressBar,
    verbose: bool,
}

impl Show {
    fn new(points: usize, verbose: bool) -> Self {
        let bar = if std::io::stderr().is_terminal() {
            ProgressBar::new(points as u64)
        } else {
            ProgressBar::hidden()
        };
        if let Ok(style) =
            ProgressStyle::with_template("{bar:30} {pos}/{len} poses, {per_sec}, {eta} left {msg}")
        {
            bar.set_style(style);
        }
        Show { bar, verbose }
    }
}

impl Watcher for Show {
    fn say(&mut self, text: &str) {
        if self.verbose || !self.bar.is_hidden() {
            self.bar.suspend(|| eprintln!("{text}"));
        }
    }

    fn stored(&mut self, reading: &Reading, done: usize, _total: usize) {
        if reading.what == What::Sample {
            self.bar.set_position(done as u64);
        }
        if self.verbose {
            println!("stored {:?} {}", reading.what, reading.index);
            let _ = std::io::stdout().flush();
        }
    }
}
