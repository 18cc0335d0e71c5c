//! How far what a pixel sees has moved over the picture since the frame before, for compositing and reprojection.

use anyhow::{Context, Result, ensure};
use glam::Vec3;
use rayon::prelude::*;

use super::bvh::{FAR, nearest};
use super::camera::camera_ray;
use super::path::View;
use crate::table::Table;

/// To the right and down in pixels, row by row; a pixel's own middle decides, through a pinhole.
///
/// # Errors
/// When the mesh is not there or has another number of vertices.
pub(crate) fn motion(
    table: &Table,
    view: &View,
    mesh: usize,
    before: &[Vec3],
) -> Result<Vec<[f32; 3]>> {
    let now = table
        .mesh(mesh)
        .with_context(|| format!("the scene has no mesh {mesh}"))?;
    ensure!(
        now.positions.len() == before.len(),
        "mesh \"{}\" has {} vertices, the frame before {}",
        now.name,
        now.positions.len(),
        before.len()
    );
    let pixel = |i: usize| {
        let (x, y) = (i % view.width as usize, i / view.width as usize);
        let ray = camera_ray(view, x as u32, y as u32, [0.5, 0.5, 0.0, 0.0]);
        let hit = nearest(table, &ray, 0.0, FAR)?;
        let shade = &table.shade[hit.place as usize];
        if shade.mesh as usize != mesh {
            return None;
        }
        let corners = now.indices[shade.triangle as usize];
        let [a, b, c] = corners.map(|k| before[k as usize]);
        let was = a + (b - a) * hit.u + (c - a) * hit.v;
        let (px, py) = project(view, was)?;
        Some([x as f32 + 0.5 - px, y as f32 + 0.5 - py, 0.0])
    };
    let count = view.width as usize * view.height as usize;
    Ok((0..count)
        .into_par_iter()
        .map(|i| pixel(i).unwrap_or([0.0; 3]))
        .collect())
}

/// Where a point is seen, in pixels; nothing behind the eye.
fn project(view: &View, p: Vec3) -> Option<(f32, f32)> {
    let d = p - view.eye;
    let depth = d.dot(view.forward);
    if depth <= 1e-6 {
        return None;
    }
    let sx = d.dot(view.right) / (depth * view.right.length_squared());
    let sy = d.dot(view.up) / (depth * view.up.length_squared());
    Some((
        (sx + 1.0) * 0.5 * view.width as f32,
        (1.0 - sy) * 0.5 * view.height as f32,
    ))
}
