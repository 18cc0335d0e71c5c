//! The curtain of the stage: hung on its rail, brought to rest, blown by the window's wind, and made to repeat.

use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Context as _, Result};
use glam::{Vec2, Vec3};
use woven_cloth::{
    CurtainClip, CurtainSpec, Frame, Heading, Obstacles, Opening, WindSpec, fabric, simulate,
};

use crate::catalog::{FabricSpec, Motion};
use crate::looping;
use crate::stage::{
    CURTAIN_SPAN, CurtainMesh, HEM_HEIGHT, OPENING, RAIL_DISTANCE, RAIL_HEIGHT, WALL,
};

/// Seconds beyond the loop's own length in which a stretch is looked for that meets itself.
const SEARCH: f64 = 1.5;

/// The description of the stage's curtain for the simulation: how it hangs from the fabric, how it moves from `motion`.
///
/// # Errors
/// When the fabric's mechanics are not in the table, or a value is outside its limits.
pub fn spec(cloth: &FabricSpec, openness: f64, motion: &Motion) -> Result<CurtainSpec> {
    let mut mechanics = fabric(&cloth.mechanics)
        .with_context(|| format!("Fabric \"{}\"", cloth.id))?
        .mechanics();
    if let Some(grams) = cloth.grams {
        mechanics.areal_density = grams * 1e-3;
    }
    mechanics.openness = openness.clamp(0.0, 0.9);
    let middle = f64::from(CURTAIN_SPAN.0 + CURTAIN_SPAN.1) * 0.5;
    let (low, high) = OPENING;
    let opening = Opening {
        x: [f64::from(low.x) - middle, f64::from(high.x) - middle],
        y: [f64::from(low.y), f64::from(high.y)],
        z: f64::from(-WALL - RAIL_DISTANCE),
    };
    let width = f64::from(CURTAIN_SPAN.1 - CURTAIN_SPAN.0);
    let extra = if motion.blend > 0 {
        f64::from(motion.blend) + SEARCH * f64::from(motion.fps)
    } else {
        0.0
    };
    let spec = CurtainSpec {
        width,
        height: f64::from(RAIL_HEIGHT - HEM_HEIGHT),
        rail_height: Some(f64::from(RAIL_HEIGHT)),
        fullness: 1.8,
        pleats: 11,
        heading: Heading::Wave,
        irregularity: 0.35,
        columns: motion.mesh[0] as usize + 1,
        rows: motion.mesh[1] as usize + 1,
        fabric: None,
        mechanics,
        hem: 0.03,
        wind: WindSpec {
            speed: motion.wind,
            // A little from the side, so that the folds do not all swing alike.
            direction: [-0.25, 0.0, 1.0],
            gust: motion.gusts,
            opening: Some(opening),
            ..WindSpec::default()
        },
        obstacles: Obstacles {
            floor: Some(0.0),
            wall: Some(f64::from(-RAIL_DISTANCE)),
            sill: Some([f64::from(low.y), f64::from(0.055 - RAIL_DISTANCE)]),
            friction: 0.3,
        },
        fps: f64::from(motion.fps),
        frames: motion.frames as usize + extra.round() as usize,
        warm_up: 1.5,
        settle: 2.5,
        seed: motion.seed,
        ..CurtainSpec::default()
    };
    spec.validate()
        .with_context(|| format!("Fabric \"{}\"", cloth.id))?;
    Ok(spec)
}

/// Simulates the curtain and closes the loop. `progress(share)` is called with the share done and answers false to stop.
///
/// # Errors
/// When the cloth blows up, or on request.
pub fn run(
    spec: &CurtainSpec,
    motion: &Motion,
    progress: &mut dyn FnMut(f64) -> bool,
) -> Result<CurtainClip> {
    let clip = simulate(spec, &mut |done, total| {
        if progress(done as f64 / total as f64) {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    })?;
    let frames: Vec<Vec<Vec3>> = clip
        .frames
        .iter()
        .map(|f| f.positions.iter().copied().map(Vec3::from).collect())
        .collect();
    let (count, blend) = (motion.frames as usize, motion.blend as usize);
    let start = looping::best_start(&frames, count, blend);
    let closed = looping::close(&frames, start, count, blend);
    let triangles = triangles(&clip);
    let frames = closed.into_iter().map(|positions| {
        let normals = looping::normals(&positions, &triangles)
            .into_iter()
            .map(|v| v.to_array())
            .collect();
        Frame {
            velocities: vec![[0.0; 3]; positions.len()],
            normals,
            positions: positions.into_iter().map(|v| v.to_array()).collect(),
        }
    });
    Ok(CurtainClip {
        frames: frames.collect(),
        mesh: clip.mesh,
        fps: clip.fps,
    })
}

/// The clip as the bytes of an animated `.glb`.
///
/// # Errors
/// When the clip does not fit the format, or there is no room for a temporary file.
pub fn bytes(clip: &CurtainClip) -> Result<Vec<u8>> {
    let folder = tempfile::tempdir().context("There is no room for temporary files")?;
    let path = folder.path().join("curtain.glb");
    clip.write(&path)?;
    Ok(std::fs::read(&path)?)
}

/// Reads a clip back.
///
/// # Errors
/// When the file is damaged.
pub fn read(path: &Path) -> Result<CurtainClip> {
    Ok(CurtainClip::read(path)?)
}

fn triangles(clip: &CurtainClip) -> Vec<[u32; 3]> {
    clip.mesh
        .indices
        .chunks_exact(3)
        .map(|t| [t[0], t[1], t[2]])
        .collect()
}

/// The curtain in the stage's world: at rest, or in one of its frames.
#[must_use]
pub fn mesh(clip: &CurtainClip, frame: Option<usize>) -> CurtainMesh {
    let place = Vec3::new((CURTAIN_SPAN.0 + CURTAIN_SPAN.1) * 0.5, 0.0, RAIL_DISTANCE);
    let (positions, normals) = match frame.and_then(|i| clip.frames.get(i)) {
        Some(frame) => (&frame.positions, &frame.normals),
        None => (&clip.mesh.positions, &clip.mesh.normals),
    };
    let size = Vec2::from(clip.mesh.fabric_size);
    CurtainMesh {
        positions: positions.iter().map(|p| Vec3::from(*p) + place).collect(),
        normals: normals.iter().copied().map(Vec3::from).collect(),
        uvs: clip
            .mesh
            .uvs
            .iter()
            .map(|uv| Vec2::from(*uv) * size)
            .collect(),
        indices: triangles(clip),
    }
}
