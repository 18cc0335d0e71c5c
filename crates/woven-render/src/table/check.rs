//! Whether a scene can be rendered at all.

use anyhow::{Result, bail, ensure};

use crate::scene::{Scene, Texture};

/// Everything that is named is there, every number is finite.
pub(super) fn check(scene: &Scene) -> Result<()> {
    for mesh in &scene.meshes {
        let n = mesh.positions.len();
        let name = &mesh.name;
        ensure!(
            mesh.material < scene.materials.len(),
            "mesh \"{name}\" names material {}, but the scene has {}",
            mesh.material,
            scene.materials.len()
        );
        ensure!(
            mesh.indices.iter().flatten().all(|&i| (i as usize) < n),
            "mesh \"{name}\" names a vertex beyond its {n}"
        );
        ensure!(
            (mesh.normals.is_empty() || mesh.normals.len() == n)
                && (mesh.uvs.is_empty() || mesh.uvs.len() == n),
            "mesh \"{name}\" has {n} positions, {} normals and {} texture coordinates; the numbers must agree",
            mesh.normals.len(),
            mesh.uvs.len()
        );
        let finite = mesh
            .positions
            .iter()
            .chain(&mesh.normals)
            .all(|p| p.is_finite() && p.abs().max_element() < 1e9)
            && mesh.uvs.iter().all(|t| t.is_finite());
        ensure!(
            finite,
            "mesh \"{name}\" has a coordinate that is not a number or beyond 1e9 m"
        );
    }
    for m in &scene.materials {
        let finite = m
            .linear
            .iter()
            .chain(m.back.iter().flatten())
            .flatten()
            .chain(&m.shape)
            .chain(&m.emission)
            .all(|x| x.is_finite());
        let positive = m
            .linear
            .iter()
            .chain(m.back.iter().flatten())
            .flatten()
            .chain(&m.emission)
            .all(|&x| x >= 0.0);
        ensure!(
            finite && positive,
            "material \"{}\" has a factor that is negative or not a number",
            m.name
        );
        for used in [
            m.color_texture,
            m.coverage_texture,
            m.emission_texture,
            m.normal_texture,
        ]
        .into_iter()
        .flatten()
        {
            ensure!(
                used.texture < scene.textures.len(),
                "material \"{}\" names texture {}, but the scene has {}",
                m.name,
                used.texture,
                scene.textures.len()
            );
        }
    }
    for (mesh, colors) in &scene.colors {
        ensure!(
            scene
                .meshes
                .get(*mesh)
                .is_some_and(|m| m.positions.len() == colors.len())
                && colors.iter().flatten().all(|c| c.is_finite()),
            "there are colours of vertices for mesh {mesh}, which is not there or has another number of vertices"
        );
    }
    let whole = |t: &Texture| {
        t.width > 0 && t.height > 0 && t.pixels.len() == t.width as usize * t.height as usize
    };
    if let Some(t) = scene.textures.iter().find(|t| !whole(t)) {
        bail!(
            "texture \"{}\" says {} x {} but has {} pixels",
            t.name,
            t.width,
            t.height,
            t.pixels.len()
        );
    }
    if let Some(e) = &scene.environment {
        ensure!(
            e.width > 0 && e.height > 0 && e.pixels.len() == e.width as usize * e.height as usize,
            "the environment says {} x {} but has {} pixels",
            e.width,
            e.height,
            e.pixels.len()
        );
        ensure!(
            e.pixels
                .iter()
                .flatten()
                .all(|&x| x.is_finite() && x >= 0.0)
                && e.scale.iter().all(|&x| x >= 0.0),
            "the environment has a pixel that is negative or not a number"
        );
    }
    let c = &scene.camera;
    ensure!(
        c.transform.is_finite() && c.vfov > 1e-4 && c.vfov < 3.1 && c.aperture_radius >= 0.0,
        "the camera's matrix must be finite and its vertical angle between 0.0001 and 3.1 rad; it is {}",
        c.vfov
    );
    Ok(())
}
