//! `woven-render`: frames, animations, comparisons, adapters on the command line.

mod cli;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    match cli::run(cli::Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("woven-render: {error:#}");
            ExitCode::from(1)
        }
    }
}
