//! `woven-fit photos`: first values for the sheet from a pair of photos.

use super::{command_line, prepare_folder, print};
use anyhow::{Context, Result, bail};
use std::path::PathBuf;
use woven_fit::convert::write_atomically;
use woven_fit::fit::Options;
use woven_fit::photos::{Photo, Setup, fit};
use woven_fit::text;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Photo of the cloth lit from the camera's side (PNG or JPEG).
    #[arg(long)]
    reflection: PathBuf,
    /// Photo of the cloth lit from behind.
    #[arg(long)]
    transmission: PathBuf,
    /// Height of the camera above the middle of the cloth; lengths are in any one unit.
    #[arg(long, default_value_t = Setup::default().camera)]
    camera: f64,
    /// Width of cloth that a photo shows.
    #[arg(long, default_value_t = Setup::default().width)]
    width: f64,
    /// Lamp of the reflection photo, x,y,z from the middle of the cloth, z towards the camera.
    #[arg(long, value_delimiter = ',', num_args = 3, default_values_t = Setup::default().light_r, allow_hyphen_values = true)]
    light_r: Vec<f64>,
    /// Lamp of the transmission photo.
    #[arg(long, value_delimiter = ',', num_args = 3, default_values_t = Setup::default().light_t, allow_hyphen_values = true)]
    light_t: Vec<f64>,
    /// Exponent from pixel values to light.
    #[arg(long, default_value_t = 2.2)]
    gamma: f64,
    /// Standard deviation of the vignette in pixels; 0 for none.
    #[arg(long, default_value_t = 0.0)]
    vignette: f64,
    /// Side of the cells over which pixels are averaged: a few yarns wide.
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=512))]
    cell: u32,
    /// Degrees around straight through that are left out.
    #[arg(long, default_value_t = Setup::default().skip_deg)]
    skip: f64,
    /// Assumed share of light that passes the yarns, for the fabric file; photos cannot tell.
    #[arg(long, default_value_t = 0.3)]
    transmitted: f64,
    /// Assumed share of light that comes back, for the fabric file.
    #[arg(long, default_value_t = 0.5)]
    reflected: f64,
    /// Starts.
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u16).range(1..=4096))]
    starts: u16,
    /// Folder for photos.json and the fabric; without it nothing is written.
    #[arg(long)]
    out: Option<PathBuf>,
}

/// Three finite numbers.
fn place(values: &[f64], name: &str) -> Result<[f64; 3]> {
    match values {
        [x, y, z] if values.iter().all(|v| v.is_finite()) => Ok([*x, *y, *z]),
        _ => bail!("--{name}: three numbers x,y,z are needed"),
    }
}

pub(super) fn run(args: &Args) -> Result<()> {
    let setup = Setup {
        camera: args.camera,
        width: args.width,
        light_r: place(&args.light_r, "light-r")?,
        light_t: place(&args.light_t, "light-t")?,
        gamma: args.gamma,
        vignette_px: args.vignette,
        cell_px: args.cell,
        skip_deg: args.skip,
    };
    for (name, value) in [
        ("camera", args.camera),
        ("width", args.width),
        ("gamma", args.gamma),
    ] {
        if !(value > 0.0 && value.is_finite()) {
            bail!("--{name} {value}: a positive number is needed");
        }
    }
    let shares = [args.transmitted, args.reflected];
    if shares.iter().any(|s| !(0.0..=1.0).contains(s)) || shares.iter().sum::<f64>() > 1.0 {
        bail!(
            "--transmitted and --reflected are shares of the light: between 0 and 1, and together at most 1"
        );
    }
    if let Some(out) = &args.out {
        prepare_folder(out)?;
    }
    let reflection = Photo::read(&args.reflection)?;
    let transmission = Photo::read(&args.transmission)?;
    let options = Options {
        starts: usize::from(args.starts),
        ..Options::default()
    };
    let found = fit(&reflection, &transmission, &setup, &options)?;
    let share = |rest: f64, lobe: f64| 100.0 * lobe / (rest + lobe).max(f64::MIN_POSITIVE);
    let (even, shine) = found.reflected_light();
    let mut s = String::from("factors are relative, apart for each photo\n");
    for fit in [&found.transmission, &found.reflection] {
        s += &text::parameters(fit);
        s += &format!(
            "    {} cells, misfit {:.1} % (mean square of logarithms)\n",
            fit.points,
            100.0 * fit.rms_metric
        );
    }
    s += &format!(
        "the forward lobe has {:.1} % of the transmitted light, the reflected lobe {:.1} % of the reflected\n",
        share(found.value("t_d"), found.value("k_t")),
        share(even, shine)
    );
    for line in found.cannot_tell() {
        s += &format!("cannot tell: {line}\n");
    }
    print(&s)?;
    if let Some(out) = &args.out {
        let command = command_line();
        let json = serde_json::json!({
            "command": command,
            "transmission": found.transmission,
            "reflection": found.reflection,
            "cannot_tell": found.cannot_tell(),
        });
        let stem = args.transmission.file_stem().context("a file name")?;
        let name = stem.to_string_lossy();
        let fabric = found.fabric(&name, args.transmitted, args.reflected, &command);
        let file = format!("{name}.toml");
        let head = format!("# {command}\n");
        write_atomically(
            &out.join("photos.json"),
            (serde_json::to_string_pretty(&json)? + "\n").as_bytes(),
        )?;
        write_atomically(&out.join(&file), (head + &fabric.to_toml()).as_bytes())?;
        print(&format!(
            "written to {}: photos.json, {file}\n",
            out.display()
        ))?;
    }
    Ok(())
}
