//! `woven-fit`: the command line.

mod commands;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    match commands::run(commands::Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            // Pipes that close early (`| head`) are not errors.
            let closed = |e: &anyhow::Error| {
                e.downcast_ref::<std::io::Error>()
                    .is_some_and(|e| e.kind() == std::io::ErrorKind::BrokenPipe)
            };
            if closed(&e) {
                return ExitCode::SUCCESS;
            }
            eprintln!("woven-fit: {e:#}");
            ExitCode::FAILURE
        }
    }
}
