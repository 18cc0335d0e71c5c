//! `woven-cloth`: simulates a curtain into a cache that Blender and woven-render open.

mod commands;

use anyhow::Context;
use clap::{Parser, Subcommand};
use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use woven_cloth::{CurtainClip, CurtainSpec, FABRICS, Simulation, bending_length};

#[derive(Parser)]
#[command(
    name = "woven-cloth",
    version,
    about = "A mass-spring curtain on a rail, at rest and in wind"
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Simulate a curtain into a cache (.glb, .pc2, .mdd or .usda)
    #[command(
        after_help = "Example:\n  woven-cloth simulate curtain.toml -o curtain.glb --frames 96 --fps 24\n\nStopped in the middle, the same command goes on where it was."
    )]
    Simulate {
        /// The curtain's description
        curtain: PathBuf,
        /// The cache to write; the extension decides the format
        #[arg(short, long)]
        output: PathBuf,
        /// Number of frames, instead of the description's
        #[arg(long)]
        frames: Option<usize>,
        /// Frames a second, instead of the description's
        #[arg(long)]
        fps: Option<f64>,
        /// Write only the curtain at rest
        #[arg(long)]
        rest: bool,
        /// Frames between two saved states; 0 saves none
        #[arg(long, default_value_t = 8)]
        every: usize,
        /// Print a report as JSON on stdout
        #[arg(long)]
        json: bool,
    },
    /// A strip of simply shaded frames of a cache, as PNG
    #[command(after_help = "Example:\n  woven-cloth preview curtain.glb -o strip.png --count 6")]
    Preview {
        /// A cache that `simulate` wrote as .glb
        cache: PathBuf,
        /// The PNG to write
        #[arg(short, long)]
        output: PathBuf,
        /// Number of pictures: the rest pose and frames evenly over the clip
        #[arg(long, default_value_t = 6)]
        count: usize,
        /// Height in pixels
        #[arg(long, default_value_t = 480)]
        height: usize,
        /// The cache of a second curtain, to be shown with it
        #[arg(long)]
        with: Option<PathBuf>,
    },
    /// The virtual cantilever (Peirce, ASTM D1388) and drape meter (Cusick) of a fabric, beside the fabric's own numbers
    #[command(
        name = "test-fabric",
        after_help = "Examples:\n  woven-cloth test-fabric voile\n  woven-cloth test-fabric curtain.toml"
    )]
    TestFabric {
        /// A built-in fabric's name, or a curtain's description
        fabric: String,
        /// Segments of the strip
        #[arg(long, default_value_t = 48)]
        segments: usize,
        /// Cells across the round piece of the drape meter
        #[arg(long, default_value_t = 48)]
        cells: usize,
    },
    /// Look through a cache for places where the cloth passes through itself, and for its largest strain
    #[command(after_help = "Example:\n  woven-cloth check curtain.glb")]
    Check {
        /// A cache that `simulate` wrote as .glb
        cache: PathBuf,
        /// The cache of a second curtain, to be looked at with it
        #[arg(long)]
        with: Option<PathBuf>,
    },
    /// List the built-in fabrics
    #[command(after_help = "Example:\n  woven-cloth fabrics")]
    Fabrics,
    /// Print a description with every field at its default
    #[command(after_help = "Example:\n  woven-cloth template > curtain.toml")]
    Template,
}

fn main() -> ExitCode {
    match run(Cli::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("woven-cloth: {e:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(cli: Cli) -> anyhow::Result<()> {
    match cli.command {
        Command::Simulate {
            curtain,
            output,
            frames,
            fps,
            rest,
            every,
            json,
        } => {
            let mut spec =
                CurtainSpec::read(&curtain).with_context(|| format!("in {}", curtain.display()))?;
            spec.frames = frames.unwrap_or(spec.frames);
            spec.fps = fps.unwrap_or(spec.fps);
            spec.validate()?;
            if rest {
                simulate_rest(&spec, &output, json)
            } else {
                simulate(&spec, &output, every, json)
            }
        }
        Command::Preview {
            cache,
            output,
            count,
            height,
            with,
        } => commands::preview(
            &commands::read(&cache, with.as_deref())?,
            &output,
            count,
            height,
        ),
        Command::TestFabric {
            fabric,
            segments,
            cells,
        } => commands::test_fabric(&fabric, segments, cells),
        Command::Check { cache, with } => {
            commands::check(&commands::read(&cache, with.as_deref())?, &cache)
        }
        Command::Fabrics => {
            println!(
                "{:<10} {:>6} {:>10} {:>10} {:>8} {:>8} {:>8}  about",
                "name", "g/m2", "Y warp N/m", "Y weft N/m", "G N/m", "c warp", "c weft"
            );
            for f in FABRICS {
                let m = f.mechanics();
                let [a, b] = m
                    .bending()
                    .map(|b| bending_length(b, m.areal_density) * 1e3);
                println!(
                    "{:<10} {:>6.0} {:>10.0} {:>10.0} {:>8.0} {a:>5.1} mm {b:>5.1} mm  {} ({})",
                    f.name, f.grams, m.tensile_warp, m.tensile_weft, m.shear, f.about, f.source
                );
            }
            Ok(())
        }
        Command::Template => {
            print!("{}", toml::to_string(&CurtainSpec::default())?);
            Ok(())
        }
    }
}

fn simulate_rest(spec: &CurtainSpec, output: &std::path::Path, json: bool) -> anyhow::Result<()> {
    let mut sim = Simulation::new(spec)?;
    let report = sim.settle(spec.settle)?;
    CurtainClip {
        mesh: sim.mesh(),
        frames: Vec::new(),
        fps: spec.fps,
    }
    .write(output)?;
    let ratio = report.support_force[1] / report.weight;
    if json {
        println!(
            "{}",
            serde_json::json!({ "max_strain": report.max_strain, "mean_warp_strain": report.mean_strain, "support_over_weight": ratio, "kinetic_energy": report.energy.kinetic })
        );
    } else {
        eprintln!(
            "{}: at rest, largest strain {:.3} %, the rail carries {:.2} % of the weight of {:.2} N",
            output.display(),
            report.max_strain * 100.0,
            ratio * 100.0,
            report.weight
        );
    }
    Ok(())
}

fn simulate(
    spec: &CurtainSpec,
    output: &std::path::Path,
    every: usize,
    json: bool,
) -> anyhow::Result<()> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed))
        .context("cannot listen for Ctrl-C")?;
    let bar = if std::io::stderr().is_terminal() {
        let style = indicatif::ProgressStyle::with_template(
            "{bar:30} {pos}/{len} frames, {per_sec}, {eta} left",
        )?;
        indicatif::ProgressBar::new(spec.frames as u64).with_style(style)
    } else {
        indicatif::ProgressBar::hidden()
    };
    let start = std::time::Instant::now();
    let clip = woven_cloth::simulate_to(spec, output, every, &mut |done, _| {
        bar.set_position(done as u64);
        if stop.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    })?;
    bar.finish_and_clear();
    let seconds = start.elapsed().as_secs_f64();
    if json {
        println!(
            "{}",
            serde_json::json!({ "frames": clip.frames.len(), "vertices": clip.mesh.positions.len(), "fps": clip.fps, "seconds": seconds })
        );
    } else {
        eprintln!(
            "{}: {} frames of {} vertices in {seconds:.1} s",
            output.display(),
            clip.frames.len(),
            clip.mesh.positions.len()
        );
    }
    Ok(())
}
