//! `ogm`: simulates a goniometer, runs scans, merges logs.

mod commands;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use commands::{CameraArgs, MergeArgs, NextArgs, PlanArgs, ReplayArgs, ScanArgs, SimArgs};

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
        after_help = "Example: ogm sim --fabric lace.toml --fault drop@40 --fault delay:2@90\n\nFaults: drop duplicate corrupt delay split lose garble banner ng alarm limit stall overshoot vanish lamp-off clock-jump power-cycle,\neach as name@line, name~chance or name:seconds@line; lines are counted from 1 over everything the rig receives."
    )]
    Sim(SimArgs),
    /// Is the detector command of the camera that `ogm sim --camera` simulates.
    #[command(
        after_help = "Example: ogm sim --camera cam0 --link rig0 &\n  ogm scan --port rig0 --detector \"ogm camera cam0\" --plan plan.toml -o lace.ogm"
    )]
    Camera(CameraArgs),
    /// Runs a scan, or goes on with one whose log exists.
    #[command(
        after_help = "Example: ogm scan --port /dev/ttyUSB0 --plan crates/ogm-driver/plans/paper.toml -o lace.ogm\n\nCtrl-C stops the arms; the same command goes on from the last stored point."
    )]
    Scan(ScanArgs),
    /// Checks a plan against a rig and tells its poses and its time, without a port (dry run).
    #[command(after_help = "Example: ogm plan crates/ogm-driver/plans/paper.toml --list")]
    Plan(PlanArgs),
    /// Chooses the poses that tell most about a fabric's parameters, out of a plan's, and writes a plan of them.
    #[command(
        after_help = "Example: ogm next --fabric fit.toml --plan crates/ogm-driver/plans/paper.toml --known lace.ogm --for alpha_x,alpha_y --count 100 -o more.toml\n\nThen scan more.toml into more.ogm, and merge both logs into one measurement."
    )]
    Next(NextArgs),
    /// Looks at a scan again without the rig: checks every record against its plan and rig, and recomputes the measurement.
    #[command(after_help = "Example: ogm replay lace.ogm")]
    Replay(ReplayArgs),
    /// Merges scan logs into a measurement: .csv, .txt (pgII text, one file for each incidence), or .xml (a whole Klems matrix).
    #[command(after_help = "Example: ogm merge lace.ogm more.ogm -o lace.csv")]
    Merge(MergeArgs),
}

fn main() -> ExitCode {
    let outcome = match Cli::parse().command {
        Command::Sim(args) => commands::sim(args),
        Command::Camera(args) => commands::camera(&args),
        Command::Scan(args) => commands::scan(args),
        Command::Plan(args) => commands::plan(&args),
        Command::Next(args) => commands::next(&args),
        Command::Replay(args) => commands::replay(&args),
        Command::Merge(args) => commands::merge(&args),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("{e}");
            ExitCode::FAILURE
        }
    }
}
