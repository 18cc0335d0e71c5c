//! `woven-render compare`: how much two pictures differ.

use anyhow::{Context, Result, anyhow, bail, ensure};
use std::path::{Path, PathBuf};
use woven_render::compare::{Picture, compare, heat};
use woven_render::film::{Film, srgb_decode, write_png8};
use woven_render::{exr_io, scene::environment};

/// Measure how much two pictures differ.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  woven-render compare ours.exr reference.exr
  woven-render compare ours.exr reference.exr --json --heat where.png

.exr and .hdr hold radiance and are compared by HDR-FLIP, .png and .jpg by LDR-FLIP.")]
pub(crate) struct CompareArgs {
    /// The picture to judge.
    a: PathBuf,
    /// The reference.
    b: PathBuf,
    /// Print the numbers as JSON.
    #[arg(long)]
    json: bool,
    /// Write where they differ: FLIP from black (same) to pale yellow (worst).
    #[arg(long, value_name = "MAP.png")]
    heat: Option<PathBuf>,
    /// Compare this layer of two EXR files instead of the picture.
    #[arg(long, value_name = "NAME")]
    layer: Option<String>,
}

/// Reads, compares, prints.
pub(crate) fn run(args: &CompareArgs) -> Result<()> {
    let ((a, hdr_a), (b, hdr_b)) = (read(&args.a)?, read(&args.b)?);
    let pick = |film: &'_ Film, path: &Path| -> Result<Vec<[f32; 3]>> {
        let found = match &args.layer {
            Some(name) => film.layer(name),
            None => film.beauty(),
        };
        let names = || {
            film.layers
                .iter()
                .map(|l| l.name.as_str())
                .collect::<Vec<_>>()
                .join(", ")
        };
        Ok(found
            .with_context(|| {
                format!(
                    "{} has no layer '{}'; it has {}",
                    path.display(),
                    args.layer.as_deref().unwrap_or("beauty"),
                    names()
                )
            })?
            .to_vec())
    };
    let (pa, pb) = (pick(&a, &args.a)?, pick(&b, &args.b)?);
    ensure!(
        hdr_a == hdr_b,
        "one picture holds radiance and the other finished colours; compare two of a kind"
    );
    let picture = |film: &Film, pixels| Picture {
        width: film.width,
        height: film.height,
        pixels,
    };
    let result = compare(picture(&a, &pa), picture(&b, &pb), hdr_a).with_context(|| {
        format!(
            "cannot compare {} with {}",
            args.a.display(),
            args.b.display()
        )
    })?;
    if let Some(path) = &args.heat {
        write_png8(path, a.width, a.height, &heat::colours(&result.map))?;
    }
    let r = &result.report;
    if args.json {
        println!("{}", serde_json::to_string_pretty(r)?);
    } else {
        let kind = if hdr_a { "HDR" } else { "LDR" };
        println!("FLIP ({kind})   {:.5}   0 same, 1 worst", r.flip);
        println!("FLIP (LDR)   {:.5}   cut off at 1", r.flip_ldr);
        println!(
            "relMSE       {:.6}   as two seeds of one picture: {:.6}",
            r.rel_mse, r.rel_mse_two_seeds
        );
        println!("RMSE         {:.6}   largest {:.6}", r.rmse, r.largest);
        match r.psnr {
            Some(db) => println!("PSNR         {db:.2} dB"),
            None => println!("PSNR         infinite"),
        }
        println!(
            "dE2000       {:.4}    95 % of the pixels under {:.4}",
            r.delta_e2000, r.delta_e2000_p95
        );
        println!(
            "mean         {:.6} against {:.6} ({:+.4} %)",
            r.mean_a,
            r.mean_b,
            r.mean_difference * 100.0
        );
    }
    Ok(())
}

/// A picture file as a film, and whether it holds radiance.
fn read(path: &Path) -> Result<(Film, bool)> {
    match path
        .extension()
        .and_then(|e| e.to_str())
        .map(str::to_ascii_lowercase)
        .as_deref()
    {
        Some("exr") => Ok((exr_io::read(path)?, true)),
        Some("hdr") => {
            let e = environment::load(path)?;
            Ok((
                Film::of_beauty(e.width as usize, e.height as usize, e.pixels),
                true,
            ))
        }
        Some("png" | "jpg" | "jpeg") => {
            let picture = image::ImageReader::open(path)
                .with_context(|| format!("cannot open {}", path.display()))?
                .decode()
                .map_err(|e| anyhow!("cannot read {}: {e}", path.display()))?
                .to_rgb8();
            let pixels = picture
                .pixels()
                .map(|p| p.0.map(|v| srgb_decode(f32::from(v) / 255.0)))
                .collect();
            Ok((
                Film::of_beauty(picture.width() as usize, picture.height() as usize, pixels),
                false,
            ))
        }
        _ => bail!("{} is no .exr, .hdr, .png or .jpg", path.display()),
    }
}
