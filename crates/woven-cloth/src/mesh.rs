//! The mesh of a curtain: triangles over the grid, UV along weft and warp, normals from the cells.

use crate::sheet::Sheet;

/// A triangle mesh whose vertex (i, j) is number `j * columns + i`, row 0 at the heading.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Positions, m.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals; at rest they point into the room (+z) on average.
    pub normals: Vec<[f32; 3]>,
    /// u along the weft and v along the warp from the heading down, both 0 to 1; times `fabric_size` they are metres.
    pub uvs: Vec<[f32; 2]>,
    /// Three vertices a triangle, counter-clockwise seen from the side of the normals.
    pub indices: Vec<u32>,
    /// Width and height of the flat fabric, m.
    pub fabric_size: [f32; 2],
    /// Columns and rows of vertices.
    pub grid: [usize; 2],
    /// Columns and rows, and width and height (m), of a second curtain whose vertices follow the first's.
    pub second: Option<([usize; 2], [f32; 2])>,
}

impl Mesh {
    /// The mesh of a sheet as it hangs now.
    #[must_use]
    pub fn from_sheet(sheet: &Sheet) -> Self {
        let (nx, ny) = (sheet.nx, sheet.ny);
        let mut uvs = Vec::with_capacity(nx * ny);
        let mut indices = Vec::with_capacity(6 * (nx - 1) * (ny - 1));
        for j in 0..ny {
            for i in 0..nx {
                uvs.push([i as f32 / (nx - 1) as f32, j as f32 / (ny - 1) as f32]);
                if i + 1 < nx && j + 1 < ny {
                    let k = (j * nx + i) as u32;
                    let (right, below, across) = (k + 1, k + nx as u32, k + nx as u32 + 1);
                    // The diagonal alternates, so that folds have no favourite slant.
                    if (i + j) % 2 == 0 {
                        indices.extend([k, below, across, k, across, right]);
                    } else {
                        indices.extend([k, below, right, right, below, across]);
                    }
                }
            }
        }
        Self {
            positions: positions(sheet),
            normals: normals(sheet),
            uvs,
            indices,
            fabric_size: [
                (sheet.hx * (nx - 1) as f64) as f32,
                (sheet.hy * (ny - 1) as f64) as f32,
            ],
            grid: [nx, ny],
            second: None,
        }
    }

    /// The mesh of two curtains: the vertices of `other` follow.
    #[must_use]
    pub fn with(mut self, other: &Self) -> Self {
        let first = self.positions.len() as u32;
        self.positions.extend(&other.positions);
        self.normals.extend(&other.normals);
        self.uvs.extend(&other.uvs);
        self.indices.extend(other.indices.iter().map(|k| k + first));
        self.second = Some((other.grid, other.fabric_size));
        self
    }

    /// The two curtains of a mesh that `with` made, with the number of the first's vertices; the mesh itself and none otherwise.
    #[must_use]
    pub fn split(&self) -> (Self, Option<Self>) {
        let n = self.grid[0] * self.grid[1];
        let Some((grid, fabric_size)) = self.second else {
            return (self.clone(), None);
        };
        let at = self.indices.partition_point(|&k| (k as usize) < n);
        let part = |from: usize, to: usize, indices: Vec<u32>| Self {
            positions: self.positions[from..to].to_vec(),
            normals: self.normals[from..to].to_vec(),
            uvs: self.uvs[from..to].to_vec(),
            indices,
            ..Self::default()
        };
        let first = Self {
            fabric_size: self.fabric_size,
            grid: self.grid,
            ..part(0, n, self.indices[..at].to_vec())
        };
        let later = self.indices[at..].iter().map(|k| k - n as u32).collect();
        let second = Self {
            fabric_size,
            grid,
            ..part(n, self.positions.len(), later)
        };
        (first, Some(second))
    }
}

/// Positions of a sheet as f32, m.
pub(crate) fn positions(sheet: &Sheet) -> Vec<[f32; 3]> {
    (0..sheet.len())
        .map(|k| sheet.position(k).map(|c| c as f32))
        .collect()
}

/// Area-weighted unit normals at the vertices of a grid.
pub(crate) fn normals(sheet: &Sheet) -> Vec<[f32; 3]> {
    let (nx, ny) = (sheet.nx, sheet.ny);
    let mut sum = vec![[0.0f64; 3]; nx * ny];
    for j in 0..ny - 1 {
        for i in 0..nx - 1 {
            let k = j * nx + i;
            let d = |a: usize, b: usize| -> [f64; 3] {
                std::array::from_fn(|c| sheet.x[c][b] - sheet.x[c][a])
            };
            let (p, q) = (d(k, k + nx + 1), d(k + nx, k + 1));
            // (lower right - upper left) x (upper right - lower left): towards +z for a flat curtain, the triangles' own side.
            let n = [
                p[1] * q[2] - p[2] * q[1],
                p[2] * q[0] - p[0] * q[2],
                p[0] * q[1] - p[1] * q[0],
            ];
            for v in [k, k + 1, k + nx, k + nx + 1] {
                for c in 0..3 {
                    sum[v][c] += n[c];
                }
            }
        }
    }
    sum.iter()
        .map(|n| {
            let l = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
            if l > 1e-20 {
                n.map(|c| (c / l) as f32)
            } else {
                [0.0, 0.0, 1.0]
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fabrics::Mechanics;

    #[test]
    fn a_flat_sheet_faces_the_room_with_normals_and_triangles_alike() {
        let mesh = Mesh::from_sheet(&Sheet::flat(4, 5, 1.0, 1.0, Mechanics::default()));
        assert!(
            mesh.normals.iter().all(|n| n[2] > 0.999),
            "{:?}",
            mesh.normals[0]
        );
        for t in mesh.indices.chunks(3) {
            let p = |q: usize| mesh.positions[t[q] as usize];
            let (a, b, c) = (p(0), p(1), p(2));
            let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            assert!(area > 0.0);
        }
        assert_eq!(mesh.indices.len(), 6 * 3 * 4);
    }
}
