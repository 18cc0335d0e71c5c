//! `woven-render animate`: a scene in which one mesh moves, frame by frame; a frame that is there is not made again.

use super::progress::{Bar, stop_flag};
use super::{RenderArgs, setup};
use anyhow::{Context, Result, bail, ensure};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Instant;
use woven_render::atomic::write_atomically;
use woven_render::render::Renderer;
use woven_render::scene::gltf::{Limits, motion};
use woven_render::scene::{Mesh, Scene};
use woven_render::shutter::Pose;

/// Render a scene in which one mesh moves.
#[derive(clap::Args, Debug)]
#[command(after_help = "Examples:
  woven-render animate room.glb --cloth wind.glb --frames 0..48 -o frames
  woven-render animate room.glb --cloth wind.pc2 --mesh curtain --frames 0..=9 -o frames --format png --denoise --spp 16
  woven-render animate room.glb --cloth wind.glb --frames 0..48 -o frames --shutter 0.5

A frame that exists and was made with the same settings is kept, so the same command goes on where it was stopped.")]
pub(crate) struct AnimateArgs {
    /// The scene, .glb or .gltf.
    scene: PathBuf,
    /// The moving mesh: an animated .glb (one morph target a frame) or a .pc2 point cache, in world space.
    #[arg(long, value_name = "CACHE")]
    cloth: PathBuf,
    /// Name of the scene's mesh that moves; the cache's own name without.
    #[arg(long, value_name = "NAME")]
    mesh: Option<String>,
    /// Frames to render: A..B without B, A..=B with it.
    #[arg(long, value_name = "A..B")]
    frames: Frames,
    /// Folder for frame_0000.exr, ...; made if it is not there.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// How long the shutter is open, as a share of the time from frame to frame, around the frame's own moment; the mesh
    /// blurs. 0.5 is a film camera's 180 degrees.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0)]
    shutter: f32,
    /// Format of the frames.
    #[arg(long, value_parser = ["exr", "png"], default_value = "exr")]
    format: String,
    #[command(flatten)]
    render: RenderArgs,
}

/// `A..B` or `A..=B`, at least one frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Frames {
    first: usize,
    end: usize,
}

impl FromStr for Frames {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let parse = || -> Option<Frames> {
            let (a, b) = text.split_once("..")?;
            let (b, extra) = match b.strip_prefix('=') {
                Some(b) => (b, 1),
                None => (b, 0),
            };
            let (first, end) = (
                a.trim().parse().ok()?,
                b.trim().parse::<usize>().ok()?.checked_add(extra)?,
            );
            (first < end && end <= 1_000_000).then_some(Frames { first, end })
        };
        parse().ok_or_else(|| {
            format!("'{text}' is no range of frames; write 0..48 (48 is left out) or 0..=47")
        })
    }
}

/// What is known about the frames in a folder; kept in `frames.json` beside them.
#[derive(Default, Serialize, Deserialize)]
struct Ledger {
    /// File name to the hash of the settings that made it.
    frames: BTreeMap<String, String>,
}

/// Renders all frames that are not there yet.
pub(crate) fn run(args: &AnimateArgs) -> Result<()> {
    ensure!(
        (0.0..=1.0).contains(&args.shutter),
        "--shutter {} is no share of the time from frame to frame; give a number from 0 to 1",
        args.shutter
    );
    std::fs::create_dir_all(&args.output)
        .with_context(|| format!("cannot make the folder {}", args.output.display()))?;
    let ledger_path = args.output.join("frames.json");
    tidy(&args.output);
    setup::check_writable(&ledger_path)?;
    let mut job = setup::prepare(&args.scene, &args.render)?;
    let cache = motion::open(&args.cloth, &Limits::default())?;
    let Frames { first, end } = args.frames;
    ensure!(
        end <= cache.frames,
        "{} has {} frames (0..{}); {first}..{end} asks for more",
        args.cloth.display(),
        cache.frames,
        cache.frames
    );
    let moving = find_mesh(
        &job.scene,
        args.mesh.as_deref().unwrap_or(&cache.name),
        args.mesh.is_some(),
    )?;
    job.metadata
        .insert("cloth.sha256".to_owned(), cache.hash.clone());
    if args.shutter > 0.0 {
        job.metadata
            .insert("shutter".to_owned(), args.shutter.to_string());
    }

    // The ray structure is built for the cache's first frame and refitted from there, wherever a run begins: the same
    // frame has the same bytes in every run.
    cache.apply(0, &mut job.scene.meshes[moving])?;
    let mut ledger: Ledger = std::fs::read(&ledger_path)
        .ok()
        .and_then(|b| serde_json::from_slice(&b).ok())
        .unwrap_or_default();
    let todo: Vec<usize> = (first..end)
        .filter(|&k| {
            let name = file_name(k, &args.format);
            ledger.frames.get(&name)
                != Some(&frame_hash(
                    &job.hash,
                    &cache.hash,
                    &job.scene.meshes[moving].name,
                    args.shutter,
                    k,
                ))
                || !args.output.join(&name).is_file()
        })
        .collect();
    let kept = end - first - todo.len();
    if kept > 0 {
        eprintln!("{kept} of {} frames are there already", end - first);
    }
    if todo.is_empty() {
        return Ok(());
    }
    let mut bar = Bar::new("frame", stop_flag()?);
    let started = Instant::now();
    let mut renderer = Renderer::new(&job.scene, &job.settings, job.backend)?;
    let mut frame: Mesh = job.scene.meshes[moving].clone();
    let mut other: Mesh = frame.clone();
    for (done, &k) in todo.iter().enumerate() {
        let left = left(started, done, todo.len());
        bar.word(&format!("frame {k} ({} of {}{left})", done + 1, todo.len()));
        cache.apply(k, &mut frame)?;
        if args.shutter > 0.0 {
            let poses = poses(&cache, k, &frame, &mut other, args.shutter)?;
            renderer.open_shutter(moving, poses)?;
        } else {
            renderer.move_mesh(moving, &frame.positions, &frame.normals)?;
        }
        renderer.set_seed(job.settings.seed.wrapping_add(k as u32))?;
        renderer.finish(&mut bar)?;
        if bar.stopped() && renderer.samples() < job.settings.spp {
            bar.finish();
            bail!(
                "stopped before frame {k}; {} frames are done, the same command goes on from there",
                kept + done
            );
        }
        let hash = frame_hash(&job.hash, &cache.hash, &frame.name, args.shutter, k);
        let mut film = renderer.film()?;
        if args.render.aov {
            // From the frame before in the cache, whether this run has rendered it or not.
            cache.apply(k.saturating_sub(1), &mut other)?;
            if args.shutter > 0.0 {
                // The last moment of the shutter is another one.
                renderer.move_mesh(moving, &frame.positions, &frame.normals)?;
            }
            film.push("motion", renderer.motion(moving, &other.positions)?);
        }
        setup::finish(&mut film, &args.render, &job.metadata, &hash)?;
        film.metadata.insert("frame".to_owned(), k.to_string());
        let name = file_name(k, &args.format);
        setup::write(
            &film,
            &args.output.join(&name),
            &args.render,
            job.scene.camera.exposure,
        )?;
        ledger.frames.insert(name, hash);
        write_ledger(&ledger_path, &ledger)?;
    }
    bar.finish();
    if let Some(note) = renderer.note() {
        bar.say(&format!("note: {note}"));
    }
    eprintln!(
        "{} frames in {:.1} s on {} ({:.2} s a frame){}",
        todo.len(),
        started.elapsed().as_secs_f64(),
        renderer.device(),
        started.elapsed().as_secs_f64() / todo.len() as f64,
        setup::log(&renderer)
    );
    Ok(())
}

/// Takes away what a run that was killed in the middle of writing has left.
fn tidy(folder: &Path) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if name.starts_with(".woven-") && name.ends_with(".part") {
            std::fs::remove_file(entry.path()).ok();
        }
    }
}

fn left(started: Instant, done: usize, of: usize) -> String {
    if done == 0 {
        return String::new();
    }
    let seconds = started.elapsed().as_secs_f64() / done as f64 * (of - done) as f64;
    format!(", {seconds:.0} s left in all")
}

fn file_name(k: usize, format: &str) -> String {
    format!("frame_{k:04}.{format}")
}

fn frame_hash(settings: &str, cache: &str, mesh: &str, shutter: f32, k: usize) -> String {
    use sha2::Digest;
    setup::hex(&sha2::Sha256::digest(format!(
        "{settings} {cache} {mesh} {shutter} {k}"
    )))
}

/// Where the mesh is when the shutter opens, at the frame's own moment, and when it closes: half of `shutter` before and
/// after, on the straight way to the frames beside. Before the first frame and after the last one it goes on as it went.
fn poses(
    cache: &motion::Motion,
    k: usize,
    frame: &Mesh,
    other: &mut Mesh,
    shutter: f32,
) -> Result<Vec<Pose>> {
    let pose = |m: &Mesh| Pose {
        positions: m.positions.clone(),
        normals: m.normals.clone(),
    };
    let now = pose(frame);
    let mut beside = |there: Option<usize>, back: Option<usize>| -> Result<Pose> {
        let (k, t) = match (there, back) {
            (Some(k), _) => (k, 0.5 * shutter),
            (None, Some(k)) => (k, -0.5 * shutter),
            (None, None) => return Ok(now.clone()),
        };
        cache.apply(k, other)?;
        Ok(now.towards(&pose(other), t))
    };
    let (before, after) = (k.checked_sub(1), Some(k + 1).filter(|&k| k < cache.frames));
    let (opens, closes) = (beside(before, after)?, beside(after, before)?);
    Ok(vec![opens, now, closes])
}

fn write_ledger(path: &Path, ledger: &Ledger) -> Result<()> {
    write_atomically(path, |out| Ok(serde_json::to_writer_pretty(out, ledger)?))
}

fn find_mesh(scene: &Scene, name: &str, asked: bool) -> Result<usize> {
    let mut hits = scene
        .meshes
        .iter()
        .enumerate()
        .filter(|(_, m)| m.name == name)
        .map(|(i, _)| i);
    match (hits.next(), hits.next()) {
        (Some(i), None) => Ok(i),
        (Some(_), Some(_)) => bail!(
            "the scene has more than one mesh '{name}'; give the moving one a name of its own"
        ),
        (None, _) => {
            let mut names: Vec<_> = scene.meshes.iter().map(|m| m.name.as_str()).collect();
            names.dedup();
            let who = if asked {
                ""
            } else {
                " (the name in the cache)"
            };
            bail!(
                "the scene has no mesh '{name}'{who}; it has {}: choose one with --mesh NAME",
                names.join(", ")
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_of_frames() {
        assert_eq!("0..48".parse(), Ok(Frames { first: 0, end: 48 }));
        assert_eq!("3..=3".parse(), Ok(Frames { first: 3, end: 4 }));
        for bad in [
            "",
            "5",
            "5..5",
            "7..3",
            "a..b",
            "0..",
            "-1..4",
            "0..=18446744073709551615",
        ] {
            assert!(bad.parse::<Frames>().is_err(), "{bad}");
        }
    }
}
