//! A whole clip: simulated in memory, or into a file with checkpoints that survive a power cut.

use crate::cache::{self, state};
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::simulation::{Frame, Simulation};
use crate::spec::CurtainSpec;
use std::ops::ControlFlow;
use std::path::Path;

/// A curtain's mesh at rest and its frames.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CurtainClip {
    /// The mesh at rest in still air.
    pub mesh: Mesh,
    /// The frames; each has as many vertices as the mesh.
    pub frames: Vec<Frame>,
    /// Frames a second.
    pub fps: f64,
}

impl CurtainClip {
    /// Writes the clip; the extension decides: `.glb`, `.pc2`, `.mdd` or `.usda`. The file appears whole or not at all.
    ///
    /// # Errors
    /// When the extension is unknown, the clip does not fit the format, or writing fails.
    pub fn write(&self, path: &Path) -> Result<()> {
        cache::write(self, path)
    }

    /// Reads a clip that `write` made as `.glb`, or the positions of a `.pc2` (whose mesh has no faces).
    ///
    /// # Errors
    /// When the file is not one of these or is damaged.
    pub fn read(path: &Path) -> Result<Self> {
        cache::read(path)
    }
}

/// Simulates a whole clip in memory. `progress(done, total)` is called after every frame and may stop the work.
///
/// # Errors
/// When the description makes no sense, the cloth blows up, or `progress` breaks.
pub fn simulate(
    spec: &CurtainSpec,
    progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<CurtainClip> {
    let mut sim = Simulation::new(spec)?;
    sim.settle(spec.settle)?;
    let mesh = sim.mesh();
    let mut frames = Vec::with_capacity(spec.frames);
    for done in 0..spec.frames {
        sim.step_frame()?;
        frames.push(sim.frame());
        if progress(done + 1, spec.frames).is_break() {
            return Err(Error::Stopped { frames: done + 1 });
        }
    }
    Ok(CurtainClip {
        mesh,
        frames,
        fps: spec.fps,
    })
}

/// Simulates into `path` and writes it. Every `every` frames the state is put beside it (`.state`, `.part`); called again after a
/// stop, it goes on from there and ends with the same bytes. The helpers are removed at the end.
///
/// # Errors
/// As [`simulate`], and when files cannot be written.
pub fn simulate_to(
    spec: &CurtainSpec,
    path: &Path,
    every: usize,
    progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<CurtainClip> {
    cache::check_extension(path, spec.frames)?;
    let saved = state::Saved::beside(path);
    let (mut sim, mesh, mut frames) = match saved.load(spec)? {
        Some(found) => found,
        None => {
            let mut sim = Simulation::new(spec)?;
            sim.settle(spec.settle)?;
            let mesh = sim.mesh();
            (sim, mesh, Vec::new())
        }
    };
    frames.truncate(spec.frames);
    let mut stored = frames.len();
    while frames.len() < spec.frames {
        sim.step_frame()?;
        frames.push(sim.frame());
        let stop = progress(frames.len(), spec.frames).is_break();
        if stop || (every > 0 && frames.len().is_multiple_of(every)) {
            saved.store(&sim, &mesh, &frames[stored..], stored)?;
            stored = frames.len();
        }
        if stop && frames.len() < spec.frames {
            return Err(Error::Stopped {
                frames: frames.len(),
            });
        }
    }
    let clip = CurtainClip {
        mesh,
        frames,
        fps: spec.fps,
    };
    clip.write(path)?;
    saved.remove();
    Ok(clip)
}
