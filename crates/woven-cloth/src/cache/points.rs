//! Point caches: PC2 (Blender, 3ds Max) and MDD (Maya, LightWave).

use crate::clip::CurtainClip;
use crate::error::{Error, Result};
use crate::simulation::Frame;

const PC2: &[u8; 12] = b"POINTCACHE2\0";

/// The clip as PC2.
pub(crate) fn pc2(clip: &CurtainClip) -> Vec<u8> {
    let points = clip.mesh.positions.len();
    let mut out = Vec::with_capacity(32 + clip.frames.len() * points * 12);
    out.extend_from_slice(PC2);
    out.extend_from_slice(&1i32.to_le_bytes());
    out.extend_from_slice(&(points as i32).to_le_bytes());
    out.extend_from_slice(&0f32.to_le_bytes());
    out.extend_from_slice(&1f32.to_le_bytes());
    out.extend_from_slice(&(clip.frames.len() as i32).to_le_bytes());
    for frame in &clip.frames {
        for c in frame.positions.iter().flatten() {
            out.extend_from_slice(&c.to_le_bytes());
        }
    }
    out
}

/// The clip as MDD: big-endian counts, times in seconds, positions.
pub(crate) fn mdd(clip: &CurtainClip) -> Vec<u8> {
    let points = clip.mesh.positions.len();
    let mut out = Vec::with_capacity(8 + clip.frames.len() * (4 + points * 12));
    out.extend_from_slice(&(clip.frames.len() as i32).to_be_bytes());
    out.extend_from_slice(&(points as i32).to_be_bytes());
    for k in 0..clip.frames.len() {
        out.extend_from_slice(&((k as f64 / clip.fps) as f32).to_be_bytes());
    }
    for frame in &clip.frames {
        for c in frame.positions.iter().flatten() {
            out.extend_from_slice(&c.to_be_bytes());
        }
    }
    out
}

/// Positions of a PC2; a mesh has to come from elsewhere.
pub(crate) fn read_pc2(bytes: &[u8]) -> Result<CurtainClip> {
    let bad = |what: &str| Error::Cache(format!("this is no PC2 of ours: {what}"));
    if bytes.len() < 32 || &bytes[..12] != PC2 {
        return Err(bad("the header is missing"));
    }
    let word = |at: usize| -> [u8; 4] { bytes[at..at + 4].try_into().expect("four bytes") };
    let (points, frames) = (i32::from_le_bytes(word(16)), i32::from_le_bytes(word(28)));
    let (Ok(points), Ok(frames)) = (usize::try_from(points), usize::try_from(frames)) else {
        return Err(bad("negative counts"));
    };
    let size = points
        .checked_mul(frames)
        .and_then(|n| n.checked_mul(12))
        .and_then(|n| n.checked_add(32));
    if points == 0 || size != Some(bytes.len()) {
        return Err(bad("its length does not fit its counts"));
    }
    let mut clip = CurtainClip {
        fps: 24.0,
        ..CurtainClip::default()
    };
    for f in 0..frames {
        let at = |p: usize, c: usize| f32::from_le_bytes(word(32 + ((f * points + p) * 3 + c) * 4));
        let positions = (0..points)
            .map(|p| [at(p, 0), at(p, 1), at(p, 2)])
            .collect();
        clip.frames.push(Frame {
            positions,
            ..Frame::default()
        });
    }
    clip.mesh.positions = clip
        .frames
        .first()
        .map(|f| f.positions.clone())
        .unwrap_or_default();
    Ok(clip)
}
