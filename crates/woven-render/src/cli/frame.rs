//! `woven-render frame`: one picture.

use super::progress::{Bar, stop_flag};
use super::{RenderArgs, setup};
use anyhow::{Result, bail};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use woven_render::accumulate::Accumulation;
use woven_render::atomic::write_atomically;
use woven_render::render::Renderer;

/// A power cut costs at most this much work.
const KEEP: Duration = Duration::from_secs(60);

/// Render one picture of a glTF scene.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  woven-render frame room.glb -o room.exr
  woven-render frame room.glb -o room.png --spp 16 --denoise --exposure 1
  woven-render frame room.glb -o noon.exr --sky 2026-06-21T12:00+02:00 --place 52.52,13.40 --light-layers --aov

Once a minute, and when stopped by Ctrl-C, it keeps what it has in OUT.checkpoint; the same command goes on from there.")]
pub(crate) struct FrameArgs {
    /// The scene, .glb or .gltf.
    scene: PathBuf,
    /// The picture to write, .exr or .png.
    #[arg(short, long, value_name = "OUT.exr")]
    output: PathBuf,
    #[command(flatten)]
    render: RenderArgs,
}

/// Renders and writes.
pub(crate) fn run(args: &FrameArgs) -> Result<()> {
    setup::kind(&args.output)?;
    setup::check_writable(&args.output)?;
    let job = setup::prepare(&args.scene, &args.render)?;
    let mut bar = Bar::new("rendering", stop_flag()?);
    let started = Instant::now();
    let mut renderer = Renderer::new(&job.scene, &job.settings, job.backend)?;
    let checkpoint = checkpoint_path(&args.output);
    let mut key = job.hash.clone();
    key.push_str(&renderer.device().starts_with("CPU").to_string());
    if let Some(sums) = read_checkpoint(&checkpoint, &key) {
        eprintln!("going on from {} samples a pixel", sums.samples);
        renderer.resume(sums)?;
    }
    renderer.finish_keeping(&mut bar, KEEP, &mut |sums| {
        write_checkpoint(&checkpoint, &key, sums)
    })?;
    bar.finish();
    if let Some(note) = renderer.note() {
        eprintln!("note: {note}");
    }
    if bar.stopped() && renderer.samples() < job.settings.spp {
        let sums = renderer.sums()?;
        write_checkpoint(&checkpoint, &key, sums)?;
        bail!(
            "stopped after {} of {} samples a pixel; kept in {}; the same command goes on from there",
            sums.samples,
            job.settings.spp,
            checkpoint.display()
        );
    }
    let (samples, device) = (renderer.samples(), renderer.device());
    let mut film = renderer.film()?;
    setup::finish(&mut film, &args.render, &job.metadata, &job.hash)?;
    setup::write(&film, &args.output, &args.render, job.scene.camera.exposure)?;
    std::fs::remove_file(&checkpoint).ok();
    eprintln!(
        "{}: {samples} samples a pixel in {:.2} s on {device}{}",
        args.output.display(),
        started.elapsed().as_secs_f64(),
        setup::log(&renderer)
    );
    Ok(())
}

fn checkpoint_path(output: &Path) -> PathBuf {
    let mut name = output.file_name().unwrap_or_default().to_os_string();
    name.push(".checkpoint");
    output.with_file_name(name)
}

/// The sums of a stopped run with the same settings; anything else is as if there were none.
fn read_checkpoint(path: &Path, key: &str) -> Option<Accumulation> {
    let bytes = std::fs::read(path).ok()?;
    let rest = bytes.strip_prefix(key.as_bytes())?;
    Accumulation::from_bytes(rest).ok()
}

fn write_checkpoint(path: &Path, key: &str, sums: &Accumulation) -> Result<()> {
    use std::io::Write;
    write_atomically(path, |out| {
        out.write_all(key.as_bytes())?;
        Ok(out.write_all(&sums.to_bytes())?)
    })
}
