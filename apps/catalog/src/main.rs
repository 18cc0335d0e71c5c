//! `woven-catalog`: from measurements to a moving catalog page.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context as _, Result};
use clap::Parser;
use woven_catalog::catalog::Catalog;
use woven_catalog::jobs::{self, Order, Outcome};
use woven_catalog::picture::Choice;

/// Makes a moving catalog page: fits each fabric to its measurement, hangs it as a curtain, lets it blow in the wind, renders it by day
/// and by lamplight, and writes a page that opens offline.
///
/// A run that was stopped goes on where it was: start it again with the same words.
#[derive(Parser)]
#[command(version = woven_catalog::store::version(), after_help = EXAMPLES)]
struct Arguments {
    /// The catalog to make; without one, the built-in catalog of two fabrics.
    #[arg(value_name = "CATALOG.toml")]
    catalog: Option<PathBuf>,
    /// Folder for the page and everything it shows.
    #[arg(short, long, value_name = "DIR", default_value = "catalog")]
    out: PathBuf,
    /// A small, coarse page within two minutes, to see whether everything works.
    #[arg(long)]
    quick: bool,
    /// Where to render: `auto` takes a graphics card if there is one.
    #[arg(long, value_enum, default_value = "auto")]
    backend: Choice,
    /// Render only the i-th of n parts of the pictures; run all parts (on one folder, on any machines), the last to finish makes the page.
    #[arg(long, value_name = "i/n", value_parser = shard)]
    shard: Option<(u32, u32)>,
    /// Width and height of the pictures, instead of the catalog's.
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<[u32; 2]>,
    /// Paths a pixel in the frames of the videos, instead of the catalog's; stills take four times as many.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=16384))]
    spp: Option<u32>,
    /// Frames of each video, instead of the catalog's.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=240))]
    frames: Option<u32>,
}

const EXAMPLES: &str = "Examples:
  woven-catalog                              the built-in catalog, into ./catalog
  woven-catalog --quick -o /tmp/look         the same, small and coarse
  woven-catalog my.toml -o my-page --size 960x720 --spp 256
  woven-catalog --shard 2/4                  the second of four parts";

fn size(text: &str) -> Result<[u32; 2], String> {
    let parts = text
        .split_once(['x', 'X'])
        .and_then(|(w, h)| Some([w.trim().parse().ok()?, h.trim().parse().ok()?]));
    let size: [u32; 2] = parts.ok_or("write width and height like 640x480")?;
    woven_catalog::video::check_size(size[0], size[1]).map_err(|e| e.to_string())?;
    Ok(size)
}

fn shard(text: &str) -> Result<(u32, u32), String> {
    let parts = text
        .split_once('/')
        .and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
    match parts {
        Some((i, n)) if 1 <= i && i <= n => Ok((i, n)),
        _ => Err("write the part and the number of parts like 2/4, counted from 1".to_owned()),
    }
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("woven-catalog: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<ExitCode> {
    let (mut catalog, folder) = match &arguments.catalog {
        Some(path) => (
            Catalog::load(path)?,
            path.parent().map(PathBuf::from).unwrap_or_default(),
        ),
        None => (Catalog::builtin()?, PathBuf::new()),
    };
    if arguments.quick {
        catalog.quicken();
    }
    if let Some(size) = arguments.size {
        catalog.picture.size = size;
    }
    if let Some(spp) = arguments.spp {
        catalog.picture.samples = spp;
        catalog.picture.still_samples = spp.saturating_mul(4).min(65_536);
    }
    if let Some(frames) = arguments.frames {
        catalog.motion.frames = frames;
        catalog.motion.blend = catalog.motion.blend.min(frames / 3);
    }
    catalog.check()?;

    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || {
        // The second time the user is in a hurry; everything on the disk is whole at any moment.
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    })
    .context("Ctrl-C cannot be caught")?;

    let order = Order {
        out: arguments.out.clone(),
        backend: arguments.backend,
        shard: arguments.shard,
        command: command(),
    };
    match jobs::run(&catalog, &folder, &order, stop)? {
        Outcome::Complete { page } => println!("The catalog is ready: open {}", page.display()),
        Outcome::Partial { missing } => {
            println!(
                "This part is done; {missing} pictures of other parts are missing. The last part to finish makes the page, or run once more without --shard."
            );
        }
        Outcome::Stopped => {
            eprintln!(
                "woven-catalog: stopped on request. What is finished is kept in {}; start again with the same words to go on.",
                arguments.out.display()
            );
            return Ok(ExitCode::from(130));
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// The command as it was typed, without the folder of the program.
fn command() -> String {
    let words = std::env::args().skip(1).map(|w| {
        if w.contains([' ', '"', '\'']) {
            format!("{w:?}")
        } else {
            w
        }
    });
    std::iter::once("woven-catalog".to_owned())
        .chain(words)
        .collect::<Vec<_>>()
        .join(" ")
}
