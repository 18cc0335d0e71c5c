//! What the pull does to the weave: local strain of warp and weft and the angle of shear, from which a renderer opens or closes it.

use crate::mesh::Mesh;

/// Strain of the warp, strain of the weft (length over rest length, minus 1) and shear (rad; how much the angle between weft and
/// warp is short of a right angle, positive when the thread pointing right and the one pointing up lean together) at every vertex of a
/// mesh whose vertices are now at `positions`. Mean over the two edges that meet at the vertex along each thread.
///
/// With strains e and a shear g the cells of the weave keep cos g (1 + e_warp)(1 + e_weft) of their area, and yarns lie
/// 1/(1 + e_weft) times as dense along the weft. Empty when the mesh has no grid.
#[must_use]
pub fn weave_strain(mesh: &Mesh, positions: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let [nx, ny] = mesh.grid;
    if nx < 2 || ny < 2 || positions.len() != nx * ny {
        return Vec::new();
    }
    let (hx, hy) = (
        f64::from(mesh.fabric_size[0]) / (nx - 1) as f64,
        f64::from(mesh.fabric_size[1]) / (ny - 1) as f64,
    );
    let edge = |a: usize, b: usize| -> [f64; 3] {
        std::array::from_fn(|c| f64::from(positions[b][c]) - f64::from(positions[a][c]))
    };
    let length = |d: [f64; 3]| (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
    // Mean strain of the edges before and after a vertex, and the direction from the one's start to the other's end.
    let thread = |k: usize, at: usize, n: usize, step: usize, h: f64| {
        let (a, b) = (
            if at > 0 { k - step } else { k },
            if at + 1 < n { k + step } else { k },
        );
        let edges = ((b - a) / step) as f64;
        let sum = length(edge(a, k)) + length(edge(k, b));
        (sum / (edges * h) - 1.0, edge(a, b))
    };
    (0..nx * ny)
        .map(|k| {
            let (weft, across) = thread(k, k % nx, nx, 1, hx);
            let (warp, down) = thread(k, k / nx, ny, nx, hy);
            let dot: f64 = (0..3).map(|c| -across[c] * down[c]).sum();
            let sine = dot / (length(across) * length(down)).max(1e-12);
            [
                warp as f32,
                weft as f32,
                sine.clamp(-1.0, 1.0).asin() as f32,
            ]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Mechanics, Sheet};

    #[test]
    fn a_pulled_and_sheared_sheet_tells_its_strains() {
        let mut sheet = Sheet::flat(7, 9, 0.6, 0.8, Mechanics::default());
        let mesh = Mesh::from_sheet(&sheet);
        let gamma = 0.1f64;
        for k in 0..sheet.len() {
            let p = sheet.position(k);
            // Weft 3 % longer; warp 1 % longer and leaning right at its upper end.
            let (u, v) = (1.03 * p[0], 1.01 * p[1]);
            sheet.set_position(k, [u + v * gamma.sin(), v * gamma.cos(), 0.0]);
        }
        for [warp, weft, shear] in weave_strain(&mesh, &Mesh::from_sheet(&sheet).positions) {
            // f32 positions of 1 m over edges of 0.1 m: 1e-6.
            assert!((warp - 0.01).abs() < 3e-6 && (weft - 0.03).abs() < 3e-6);
            assert!((shear - 0.1).abs() < 1e-5, "{shear}");
        }
    }
}
