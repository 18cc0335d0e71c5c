//! Cache files of a clip, for renderers, Blender, Maya and the web.
//!
//! **`.glb`** One mesh with one primitive (TRIANGLES): POSITION, NORMAL, TEXCOORD_0, u32 indices, and one morph target per frame with
//! POSITION and NORMAL differences from the rest pose, all f32 in one buffer. A LINEAR `weights` animation sets target k to 1 at k/fps
//! seconds, so two neighbouring targets at most are not zero. At most 240 targets, because viewers abort beyond 256.
//! `mesh.extras.woven` = `{ "fabric_size": [w, h] m, "grid": [columns, rows], "fps", "frames" }`. UV: u along the weft, v along
//! the warp from the heading down, 0 to 1. Vertex (i, j) is number j × columns + i; +Y is up, metres.
//!
//! `_WOVEN_STRETCH` (an attribute of the mesh and of every target, VEC3 of normalised 16-bit integers, so ±1 in steps of 3e-5):
//! strain of the warp, strain of the weft and shear in rad, as [`crate::weave_strain`] tells them; in a target the difference
//! from the rest pose, so that weights blend it as they blend positions. Viewers pass over it; a renderer opens the weave by it.
//!
//! **`.pc2`** `POINTCACHE2\0`, then little-endian i32 version 1, i32 points, f32 start 0, f32 rate 1, i32 samples, then f32 x y z for every
//! point of every sample, in the same order of vertices. **`.mdd`** the same big-endian, with its times in seconds. **`.usda`** a Mesh with time samples of points and
//! velocities.

pub(crate) mod glb;
pub(crate) mod points;
pub(crate) mod state;
pub(crate) mod usd;

use crate::clip::CurtainClip;
use crate::error::{Error, Result};
use std::io::Write;
use std::path::Path;

/// Most morph targets in a `.glb`.
pub const MAX_TARGETS: usize = 240;

fn extension(path: &Path) -> String {
    path.extension()
        .and_then(|e| e.to_str())
        .unwrap_or("")
        .to_ascii_lowercase()
}

/// Refuses before the work begins what could not be written at its end.
pub(crate) fn check_extension(path: &Path, frames: usize) -> Result<()> {
    match extension(path).as_str() {
        "glb" if frames > MAX_TARGETS => Err(Error::Cache(format!(
            "a .glb holds at most {MAX_TARGETS} frames (viewers abort beyond 256 morph targets) and this clip has {frames}; write a .pc2, or fewer frames"
        ))),
        "glb" | "pc2" | "mdd" | "usda" => Ok(()),
        other => Err(Error::Cache(format!(
            "the extension `{other}` of {} is not one of glb, pc2, mdd, usda",
            path.display()
        ))),
    }
}

/// Writes a clip by extension.
pub(crate) fn write(clip: &CurtainClip, path: &Path) -> Result<()> {
    check_extension(path, clip.frames.len())?;
    let bytes = match extension(path).as_str() {
        "glb" => glb::encode(clip)?,
        "pc2" => points::pc2(clip),
        "usda" => usd::encode(clip).into_bytes(),
        _ => points::mdd(clip),
    };
    write_whole(path, &bytes)
}

/// Reads a clip by extension.
pub(crate) fn read(path: &Path) -> Result<CurtainClip> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, e))?;
    match extension(path).as_str() {
        "glb" => glb::decode(&bytes),
        "pc2" => points::read_pc2(&bytes),
        other => Err(Error::Cache(format!(
            "cannot read the extension `{other}` of {}; .glb and .pc2 can be read",
            path.display()
        ))),
    }
}

/// Writes a file through a temporary one in the same folder: it appears whole or not at all.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let folder = path
        .parent()
        .filter(|p| !p.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let fail = |e: std::io::Error| Error::io(path, e);
    let mut file = tempfile::NamedTempFile::new_in(folder).map_err(fail)?;
    file.write_all(bytes).map_err(fail)?;
    file.as_file().sync_all().map_err(fail)?;
    file.persist(path).map_err(|e| fail(e.error))?;
    Ok(())
}
