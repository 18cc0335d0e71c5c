//! An independent look at contact: how many edges of the mesh pierce a triangle they do not belong to.

use crate::contact::sort_into_cells;
use crate::mesh::Mesh;

/// Number of edge-triangle pairs of the mesh that cross, pairs with a common vertex left out. 0 means that the cloth does not pass
/// through itself.
#[must_use]
pub fn crossings(positions: &[[f32; 3]], mesh: &Mesh) -> usize {
    let p = |k: u32| positions[k as usize].map(f64::from);
    let triangles: Vec<[u32; 3]> = mesh
        .indices
        .chunks_exact(3)
        .map(|t| [t[0], t[1], t[2]])
        .collect();
    let mut edges: Vec<[u32; 2]> = triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    edges.sort_unstable();
    edges.dedup();
    let length = |[a, b]: [u32; 2]| {
        p(a).iter()
            .zip(p(b))
            .map(|(a, b)| (a - b).powi(2))
            .sum::<f64>()
            .sqrt()
    };
    let longest = edges.iter().map(|&e| length(e)).fold(0.0, f64::max);
    // Middles of an edge and of a triangle that touch are nearer than half an edge and two thirds of one.
    let reach = 1.2 * longest.max(1e-9);
    let middle = |t: &[u32; 3]| -> [f64; 3] {
        std::array::from_fn(|c| t.iter().map(|&k| p(k)[c]).sum::<f64>() / 3.0)
    };
    let middles: Vec<[f64; 3]> = triangles.iter().map(middle).collect();
    let field = std::array::from_fn(|c| middles.iter().map(|m| m[c]).collect());
    let cells = sort_into_cells(&field, reach);
    let mut count = 0;
    for e in &edges {
        let (a, b) = (p(e[0]), p(e[1]));
        let at = std::array::from_fn(|c| 0.5 * (a[c] + b[c]));
        cells.near(at, |t| {
            let t = triangles[t];
            let corners = t.map(p);
            // Most are told apart by their boxes.
            let apart = (0..3).any(|c| {
                let [u, v, w] = corners.map(|q| q[c]);
                a[c].max(b[c]) < u.min(v).min(w) || a[c].min(b[c]) > u.max(v).max(w)
            });
            if !apart && !t.contains(&e[0]) && !t.contains(&e[1]) && pierces(a, b, corners) {
                count += 1;
            }
        });
    }
    count
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| a[c] - b[c])
}

/// Six times the volume of the tetrahedron a b c d.
fn volume(a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]) -> f64 {
    let (u, v, w) = (sub(b, a), sub(c, a), sub(d, a));
    u[0] * (v[1] * w[2] - v[2] * w[1])
        + u[1] * (v[2] * w[0] - v[0] * w[2])
        + u[2] * (v[0] * w[1] - v[1] * w[0])
}

/// Whether the segment a b passes through the triangle: its ends lie on either side, and its line inside the three edges.
fn pierces(a: [f64; 3], b: [f64; 3], [p, q, r]: [[f64; 3]; 3]) -> bool {
    if volume(p, q, r, a) * volume(p, q, r, b) >= 0.0 {
        return false;
    }
    let (s, t, u) = (volume(a, b, p, q), volume(a, b, q, r), volume(a, b, r, p));
    (s > 0.0 && t > 0.0 && u > 0.0) || (s < 0.0 && t < 0.0 && u < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Mechanics, Sheet};

    #[test]
    fn a_flat_sheet_has_none_and_a_folded_through_one_has_some() {
        let mut sheet = Sheet::flat(5, 9, 0.4, 0.8, Mechanics::default());
        let mesh = Mesh::from_sheet(&sheet);
        assert_eq!(crossings(&mesh.positions, &mesh), 0);
        // The lower half is folded up and stuck slantwise through the upper.
        for k in 25..45 {
            let p = sheet.position(k);
            sheet.set_position(k, [p[0] + 0.03, -0.8 - p[1] - 0.05, 0.3 * (p[1] + 0.6)]);
        }
        let through = Mesh::from_sheet(&sheet);
        assert!(crossings(&through.positions, &through) > 3);
    }
}
