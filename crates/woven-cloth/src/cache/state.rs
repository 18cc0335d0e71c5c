//! What lies beside an unfinished clip: the state of the simulation and the frames so far.

use crate::cache::write_whole;
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::simulation::{Frame, Simulation};
use crate::spec::CurtainSpec;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// The two helper files of one output.
pub(crate) struct Saved {
    state: PathBuf,
    part: PathBuf,
}

impl Saved {
    pub(crate) fn beside(path: &Path) -> Self {
        let with = |tail: &str| {
            let mut name = path.as_os_str().to_owned();
            name.push(tail);
            PathBuf::from(name)
        };
        Self {
            state: with(".state"),
            part: with(".part"),
        }
    }

    /// Appends frames, then replaces the state: if the power goes between the two, the older state still fits the longer file.
    pub(crate) fn store(
        &self,
        sim: &Simulation,
        mesh: &Mesh,
        new: &[Frame],
        before: usize,
    ) -> Result<()> {
        let fail = |e: std::io::Error| Error::io(&self.part, e);
        let mut bytes = Vec::new();
        if before == 0 {
            put(&mut bytes, &mesh.positions);
            put(&mut bytes, &mesh.normals);
        }
        for frame in new {
            put(&mut bytes, &frame.positions);
            put(&mut bytes, &frame.normals);
            put(&mut bytes, &frame.velocities);
        }
        let mut file = std::fs::OpenOptions::new()
            .create(true)
            .truncate(false)
            .write(true)
            .open(&self.part)
            .map_err(fail)?;
        let at = if before == 0 {
            0
        } else {
            offset(mesh.positions.len(), before)
        };
        file.seek(SeekFrom::Start(at)).map_err(fail)?;
        file.write_all(&bytes).map_err(fail)?;
        file.sync_all().map_err(fail)?;
        write_whole(&self.state, &sim.save())
    }

    /// The simulation, rest mesh and frames saved for this curtain; none when there is nothing to go on with.
    pub(crate) fn load(
        &self,
        spec: &CurtainSpec,
    ) -> Result<Option<(Simulation, Mesh, Vec<Frame>)>> {
        let Ok(state) = std::fs::read(&self.state) else {
            return Ok(None);
        };
        let sim = Simulation::load(spec, &state)
            .map_err(|e| Error::Checkpoint(format!("{}: {e}", self.state.display())))?;
        let n = sim.count();
        let frames = sim.frame_index();
        let mut bytes = Vec::new();
        std::fs::File::open(&self.part)
            .and_then(|mut f| f.read_to_end(&mut bytes))
            .map_err(|e| Error::io(&self.part, e))?;
        if (bytes.len() as u64) < offset(n, frames) {
            return Err(Error::Checkpoint(format!(
                "{} is shorter than its state says; delete both to start anew",
                self.part.display()
            )));
        }
        let mut values = bytes.chunks_exact(12).map(|b| -> [f32; 3] {
            std::array::from_fn(|c| {
                f32::from_le_bytes([b[4 * c], b[4 * c + 1], b[4 * c + 2], b[4 * c + 3]])
            })
        });
        let mut take = || -> Vec<[f32; 3]> { values.by_ref().take(n).collect() };
        let mut mesh = sim.mesh();
        mesh.positions = take();
        mesh.normals = take();
        let frames = (0..frames)
            .map(|_| Frame {
                positions: take(),
                normals: take(),
                velocities: take(),
            })
            .collect();
        Ok(Some((sim, mesh, frames)))
    }

    pub(crate) fn remove(&self) {
        // Leaving a helper behind is no failure of the clip, which is already whole.
        let _ = std::fs::remove_file(&self.state);
        let _ = std::fs::remove_file(&self.part);
    }
}

fn put(out: &mut Vec<u8>, values: &[[f32; 3]]) {
    out.extend(values.iter().flatten().flat_map(|v| v.to_le_bytes()));
}

/// Where frame number `frames` begins.
fn offset(points: usize, frames: usize) -> u64 {
    (points * 12 * (2 + 3 * frames)) as u64
}
