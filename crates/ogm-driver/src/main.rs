//! `ogm`: simulates a goniometer, runs scans, merges logs.

use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use clap::{Parser, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};

use ogm_driver::design::Design;
use ogm_driver::detector::{Detector, SerialPhotodiode};
use ogm_driver::error::{Error, Result};
use ogm_driver::external::ExternalDetector;
use ogm_driver::log::{self, Reading, What};
use ogm_driver::merge;
use ogm_driver::plan::{Grid, MOST_POSES, Plan};
use ogm_driver::pose::Pose;
use ogm_driver::replay;
use ogm_driver::rig::{Language, Rig};
use ogm_driver::scan::{self, Watcher};
use ogm_driver::serial::SerialTransport;
use ogm_driver::sim::fabric::FabricSample;
use ogm_driver::sim::optics::{PlainCloth, Sample};
use ogm_driver::sim::{Bench, Device, FaultPlan, Imperfections, PtyRig};
use ogm_driver::transport::StopToken;
use woven_bsdf::fabric::Fabric;

/// Drives a four-axis goniometer, simulates one, and merges scan logs into measurements.
#[derive(Parser)]
#[command(
    name = "ogm",
    version,
    after_help = "Example, in two terminals:\n  ogm sim --fabric lace.toml --link rig0\n  ogm scan --port rig0 --plan plan.toml -o lace.ogm && ogm merge lace.ogm -o lace.csv"
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Simulates a rig behind a pseudo-terminal and prints the port's name.
    #[command(
        after_help = "Example: ogm sim --fabric assets/fabrics/lace.toml --fault drop@40 --fault delay:2@90\n\nFaults: drop duplicate corrupt delay split lose garble banner ng alarm limit stall overshoot vanish lamp-off clock-jump power-cycle,\neach as name@line, name~chance or name:seconds@line; lines are counted from 1 over everything the rig receives."
    )]
    Sim {
        /// The fabric in the beam; without it a plain cloth.
        #[arg(long)]
        fabric: Option<PathBuf>,
        /// The rig: shot, grbl, instant (arms that arrive at once), or a TOML file.
        #[arg(long, default_value = "shot")]
        rig: String,
        /// A mishap and its moment; may be given more than once.
        #[arg(long)]
        fault: Vec<String>,
        /// Seed of the noise and of random faults.
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// How many times faster than the wall clock the simulation runs.
        #[arg(long, default_value_t = 1.0)]
        speed: f64,
        /// Readings without noise, drift or dark counts.
        #[arg(long)]
        perfect: bool,
        /// Lamp drift, share per hour.
        #[arg(long, default_value_t = 0.0)]
        drift: f64,
        /// Minutes the lamp has been on at the start.
        #[arg(long, default_value_t = 120.0)]
        lamp_on_min: f64,
        /// Answers take the time of their bytes on the line.
        #[arg(long)]
        wire_time: bool,
        /// Also makes a symbolic link of this name to the port.
        #[arg(long)]
        link: Option<PathBuf>,
    },
    /// Runs a scan, or goes on with one whose log exists.
    #[command(
        after_help = "Example: ogm scan --port /dev/ttyUSB0 --plan crates/ogm-driver/plans/paper.toml -o lace.ogm\n\nCtrl-C stops the arms; the same command goes on from the last stored point."
    )]
    Scan {
        /// The port's name.
        #[arg(long)]
        port: String,
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
    },
    /// Checks a plan against a rig and tells its poses and its time, without a port (dry run).
    #[command(after_help = "Example: ogm plan crates/ogm-driver/plans/paper.toml --list")]
    Plan {
        /// The plan file.
        plan: PathBuf,
        /// The rig: shot, grbl, instant, or a TOML file.
        #[arg(long, default_value = "shot")]
        rig: String,
        /// Lists the poses in the order of the scan.
        #[arg(long)]
        list: bool,
    },
    /// Chooses the poses that tell most about a fabric's parameters, out of a plan's, and writes a plan of them.
    #[command(
        after_help = "Example: ogm next --fabric fit.toml --plan crates/ogm-driver/plans/paper.toml --known lace.ogm --count 100 -o more.toml"
    )]
    Next {
        /// The fit so far, as a fabric file.
        #[arg(long)]
        fabric: PathBuf,
        /// The plan whose poses are the choice.
        #[arg(long)]
        plan: PathBuf,
        /// A log whose readings are already known.
        #[arg(long)]
        known: Option<PathBuf>,
        /// How many poses.
        #[arg(long)]
        count: usize,
        /// Count rate of the direct beam, counts a millisecond.
        #[arg(long, default_value_t = 600_000.0)]
        beam: f64,
        /// The rig: shot, grbl, instant, or a TOML file.
        #[arg(long, default_value = "shot")]
        rig: String,
        /// The new plan.
        #[arg(short, long)]
        output: PathBuf,
    },
    /// Looks at a scan again without the rig: checks every record against its plan and rig, and recomputes the measurement.
    #[command(after_help = "Example: ogm replay lace.ogm")]
    Replay {
        /// The log.
        log: PathBuf,
    },
    /// Merges a scan log into a measurement: .csv, .txt (pgII text, one file for each incidence), or .xml (a whole Klems matrix).
    #[command(after_help = "Example: ogm merge lace.ogm -o lace.csv")]
    Merge {
        /// The log.
        log: PathBuf,
        /// The measurement.
        #[arg(short, long)]
        output: PathBuf,
        /// Uses what is readable of a damaged log.
        #[arg(long)]
        salvage: bool,
    },
}

fn main() -> ExitCode {
    match run(Cli::parse().command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("{e}");
            ExitCode::FAILURE
        }
    }
}

fn rig_named(name: &str) -> Result<Rig> {
    match name {
        "shot" => Ok(Rig::default()),
        "grbl" => Ok(Rig::grbl()),
        "instant" => Ok(Rig::default().with_instant_motors()),
        file => Rig::load(std::path::Path::new(file)),
    }
}

fn stop_on_signal() -> StopToken {
    let stop = StopToken::new();
    let token = stop.clone();
    if let Err(e) = ctrlc::set_handler(move || token.stop()) {
        eprintln!("Ctrl-C cannot be caught ({e}); stop the rig by its emergency switch.");
    }
    stop
}

fn run(command: Command) -> Result<()> {
    match command {
        Command::Sim {
            fabric,
            rig,
            fault,
            seed,
            speed,
            perfect,
            drift,
            lamp_on_min,
            wire_time,
            link,
        } => {
            let rig = rig_named(&rig)?;
            if !(speed > 0.0
                && speed <= 1e6
                && drift.abs() < 1.0
                && (0.0..=1e6).contains(&lamp_on_min))
            {
                return Err(Error::Rig(
                    "Give --speed in 0..1000000, --drift in -1..1 and --lamp-on-min in 0..1000000."
                        .into(),
                ));
            }
            let sample: Arc<dyn Sample> = match fabric {
                Some(path) => Arc::new(FabricSample::read(&path)?),
                None => Arc::new(PlainCloth),
            };
            let base = if perfect {
                Imperfections::none()
            } else {
                Imperfections::default()
            };
            let wrong = Imperfections {
                seed,
                drift_per_hour: drift,
                lamp_on_s: lamp_on_min * 60.0,
                ..base
            };
            eprintln!("Simulating {}, in the beam: {}.", rig.name, sample.name());
            let baud = rig.baud;
            let mut device = Device::new(
                Bench::new(rig, sample, wrong),
                FaultPlan::parse(&fault, seed)?,
            );
            device.wire_baud = wire_time.then_some(baud);
            serve(device, speed, link.as_deref())
        }
        Command::Scan {
            port,
            plan,
            output,
            rig,
            detector,
            verbose,
        } => {
            let (rig, plan) = (rig_named(&rig)?, Plan::load(&plan)?);
            let route = plan.route(&rig)?;
            tell_left_out(route.left_out);
            let transport = SerialTransport::open(&port, rig.baud, rig.rts_cts)?;
            let mut show = Show::new(route.poses.len(), verbose);
            let stop = stop_on_signal();
            let detector: Box<dyn Detector> = match detector {
                Some(command) => Box::new(ExternalDetector::start(&command)?),
                None => Box::new(SerialPhotodiode),
            };
            let outcome = scan::run_with(
                Box::new(transport),
                detector,
                &rig,
                &plan,
                &output,
                &stop,
                &mut show,
            )?;
            show.bar.finish_and_clear();
            eprintln!(
                "{} of {} poses are in {} ({} were there before).",
                outcome.stored,
                outcome.points,
                output.display(),
                outcome.found
            );
            Ok(())
        }
        Command::Plan { plan, rig, list } => {
            let (rig, plan) = (rig_named(&rig)?, Plan::load(&plan)?);
            let route = plan.route(&rig)?;
            tell_left_out(route.left_out);
            let language = if rig.language == Language::Shot {
                "SHOT"
            } else {
                "GRBL"
            };
            println!(
                "{}: {} poses, at most {:.1} min on {} ({language}), calibration apart.",
                plan.name,
                route.poses.len(),
                route.seconds / 60.0,
                rig.name
            );
            if list {
                for pose in &route.poses {
                    println!(
                        "{},{},{},{}",
                        pose.theta_l, pose.phi_l, pose.theta_v, pose.phi_v
                    );
                }
            }
            Ok(())
        }
        Command::Next {
            fabric,
            plan,
            known,
            count,
            beam,
            rig,
            output,
        } => {
            let (rig, mut plan) = (rig_named(&rig)?, Plan::load(&plan)?);
            let fabric = Fabric::read(&fabric)
                .map_err(|e| Error::Plan(format!("The fabric file cannot be used: {e}.")))?;
            if count == 0 || count > MOST_POSES {
                return Err(Error::Plan(format!("--count must be 1 to {MOST_POSES}.")));
            }
            let known: Vec<Pose> = match known {
                Some(path) => merge::merge_log(&path)?
                    .samples
                    .iter()
                    .map(|s| s.pose)
                    .collect(),
                None => Vec::new(),
            };
            let candidates = plan.route(&rig)?.poses;
            let design = Design::new(&fabric, &rig.detector, &plan.exposure, beam)?;
            let chosen = design.choose(&candidates, &known, count)?;
            let all: Vec<Pose> = known.iter().chain(&chosen).copied().collect();
            for ((name, before), after) in design
                .names()
                .iter()
                .zip(design.errors(&known))
                .zip(design.errors(&all))
            {
                println!("{name}: standard error {before:.3e} before, {after:.3e} after");
            }
            plan.name = format!("{}, next {count}", plan.name);
            plan.grid = Grid::List {
                poses: chosen.iter().map(Pose::angles).collect(),
            };
            let text = toml::to_string(&plan)
                .map_err(|e| Error::Plan(format!("The plan cannot be written: {e}.")))?;
            merge::write_whole(&output, text.as_bytes())
        }
        Command::Replay { log: path } => {
            let r = replay::replay(&log::read(&path)?)?;
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
        Command::Merge {
            log: path,
            output,
            salvage,
        } => {
            let measurement = if salvage {
                merge::merge_contents(&log::read(&path)?)?
            } else {
                merge::merge_log(&path)?
            };
            match output.extension().and_then(|e| e.to_str()) {
                Some("csv") => measurement.write_csv(&output)?,
                Some("txt") => {
                    for file in measurement.write_pab(&output)? {
                        println!("{}", file.display());
                    }
                }
                Some("xml") => measurement.write_klems(&output)?,
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
    }
}

fn tell_left_out(n: usize) {
    if n > 0 {
        eprintln!("{n} poses lie outside the limits or in the zone of the arms and are left out.");
    }
}

fn serve(device: Device, speed: f64, link: Option<&std::path::Path>) -> Result<()> {
    let stop = stop_on_signal();
    let rig =
        PtyRig::start(device, speed).map_err(|e| Error::io("open", "a pseudo-terminal", e))?;
    if let Some(link) = link {
        if link.is_symlink() {
            std::fs::remove_file(link).map_err(|e| Error::io("replace", link, e))?;
        }
        std::os::unix::fs::symlink(rig.port(), link)
            .map_err(|e| Error::io("make the link", link, e))?;
    }
    println!("{}", rig.port());
    std::io::stdout()
        .flush()
        .map_err(|e| Error::io("write", "the standard output", e))?;
    while !stop.is_set() && !rig.is_over() {
        std::thread::sleep(Duration::from_millis(50));
    }
    if let Some(link) = link {
        let _ = std::fs::remove_file(link);
    }
    Ok(())
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
