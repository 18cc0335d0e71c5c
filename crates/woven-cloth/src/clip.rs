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
    /// Writes the clip; the extension decides: `.glb`, `.pc2`, `.mdd` or `.usda`. The file appears whole or not at all. A second curtain
    /// goes into a file of its own, `NAME.second.EXTENSION`.
    ///
    /// # Errors
    /// When the extension is unknown, the clip does not fit the format, or writing fails.
    pub fn write(&self, path: &Path) -> Result<()> {
        let (first, second) = self.layers();
        if let Some(second) = second {
            cache::write(&second, &second_path(path))?;
        }
        cache::write(&first, path)
    }

    /// The clip of the first curtain, and that of the second if there is one.
    #[must_use]
    pub fn layers(&self) -> (Self, Option<Self>) {
        let (first, second) = self.mesh.split();
        let n = first.positions.len();
        let part = |mesh: Mesh, range: std::ops::Range<usize>| Self {
            mesh,
            frames: self
                .frames
                .iter()
                .map(|f| Frame {
                    positions: f.positions[range.clone()].to_vec(),
                    normals: f.normals[range.clone()].to_vec(),
                    velocities: f.velocities[range.clone()].to_vec(),
                })
                .collect(),
            fps: self.fps,
        };
        let all = self.mesh.positions.len();
        match second {
            Some(second) => (part(first, 0..n), Some(part(second, n..all))),
            None => (self.clone(), None),
        }
    }

    /// This clip and another of the same length as one.
    ///
    /// # Errors
    /// When they have not as many frames.
    pub fn with(mut self, other: &Self) -> Result<Self> {
        if self.frames.len() != other.frames.len() {
            return Err(Error::Cache(format!(
                "one clip has {} frames, the other {}; they do not belong together",
                self.frames.len(),
                other.frames.len()
            )));
        }
        self.mesh = self.mesh.with(&other.mesh);
        for (a, b) in self.frames.iter_mut().zip(&other.frames) {
            a.positions.extend(&b.positions);
            a.normals.extend(&b.normals);
            a.velocities.extend(&b.velocities);
        }
        Ok(self)
    }

    /// Reads a clip that `write` made as `.glb`, or the positions of a `.pc2` (whose mesh has no faces).
    ///
    /// # Errors
    /// When the file is not one of these or is damaged.
    pub fn read(path: &Path) -> Result<Self> {
        cache::read(path)
    }
}

/// Where the second curtain of a clip at `path` is written.
#[must_use]
pub fn second_path(path: &Path) -> std::path::PathBuf {
    let extension = path.extension().unwrap_or_default().to_owned();
    let mut tail = std::ffi::OsString::from("second.");
    tail.push(extension);
    path.with_extension(tail)
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
