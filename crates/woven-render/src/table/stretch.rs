//! How cloth that is stretched or sheared opens its weave: a factor of the openness at every vertex.
//!
//! The strain is taken from the triangles themselves, as long as the mesh says how long its cloth is at rest
//! ([`Mesh::at_rest`]), so that it is there for every pose, of whatever made it.

use glam::{Vec2, Vec3};
use woven_bsdf::weave;

use super::rows::MaterialRow;
use crate::scene::Mesh;

/// Numbers of a vertex while its triangles are gone through: weight, then what is weighed.
type Sum = [f32; 4];

/// Strain of the warp, strain of the weft (length over rest length, less 1) and shear (rad; as `woven_cloth::weave_strain`, without
/// sign) at every vertex of a mesh whose cloth is `rest` metres long in a unit of u and of v: means over its triangles by their area.
/// None at a vertex without a triangle that has coordinates.
pub(super) fn strains(mesh: &Mesh, rest: [f32; 2]) -> Vec<[f32; 3]> {
    let mut sums = vec![Sum::default(); mesh.positions.len()];
    if mesh.uvs.len() != sums.len() {
        return vec![[0.0; 3]; sums.len()];
    }
    for t in &mesh.indices {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        let [ua, ub, uc] = t.map(|i| mesh.uvs[i as usize] * Vec2::from(rest));
        let (e1, e2, d1, d2): (Vec3, Vec3, Vec2, Vec2) = (b - a, c - a, ub - ua, uc - ua);
        let area = d1.perp_dot(d2);
        let weft = (e1 * d2.y - e2 * d1.y) / area;
        let warp = (e2 * d1.x - e1 * d2.x) / area;
        let (long, wide) = (warp.length(), weft.length());
        let lean = (warp.dot(weft) / (long * wide)).clamp(-1.0, 1.0).asin();
        if !(long * wide * lean).is_finite() {
            continue;
        }
        let weight = area.abs();
        for &i in t {
            let sum = &mut sums[i as usize];
            *sum = [
                sum[0] + weight,
                sum[1] + weight * (long - 1.0),
                sum[2] + weight * (wide - 1.0),
                sum[3] + weight * lean,
            ];
        }
    }
    sums.into_iter()
        .map(|[weight, warp, weft, lean]| {
            let mean = |sum: f32| if weight > 0.0 { sum / weight } else { 0.0 };
            [mean(warp), mean(weft), mean(lean).abs()]
        })
        .collect()
}

/// Factor of the openness at every vertex of a mesh with this material, as the rows hold it (see [`packed`]); `rest` as for
/// [`strains`].
pub(super) fn openings(mesh: &Mesh, rest: [f32; 2], material: &MaterialRow) -> Vec<u32> {
    let shape = &material.shape;
    let gammas = [f64::from(shape[0]), f64::from(shape[1])];
    let open = 1.0 - f64::from(material.cover);
    // As much cover as lets what is scattered stay below what comes in.
    let most = (0..3)
        .map(|c| {
            let back =
                |j: usize, behind: usize| material.linear[j][c].max(material.linear[behind][c]);
            material.linear[0][c] + material.linear[1][c] + back(2, 5) + back(3, 6) + back(4, 7)
        })
        .fold(0.0_f32, f32::max);
    let least =
        1.0 - (1.0 / f64::from(most.max(1e-3)) - 1.0).max(0.0) * (1.0 - open) / open.max(1e-6);
    strains(mesh, rest)
        .into_iter()
        .map(|strain| {
            let factor = weave::opened(gammas, strain.map(f64::from));
            number(factor.max(least).clamp(0.0, 1.0 / open.max(1e-6)))
        })
        .collect()
}

/// A factor in 10 bits, by its root: 0 to 4 in steps of 0.4 % at 1, which is kept exactly.
fn number(factor: f64) -> u32 {
    (factor.sqrt() * 512.0).round().clamp(1.0, 1023.0) as u32
}

/// The factors of three corners in one number, beside the lowest two bits.
pub(super) fn packed([a, b, c]: [u32; 3]) -> u32 {
    a << 2 | b << 12 | c << 22
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of a metre of cloth, sheared by `shear` and stretched.
    fn cloth(warp: f32, weft: f32, shear: f32) -> Mesh {
        let n = 4;
        let mut mesh = Mesh {
            at_rest: Some([2.0, 0.5]),
            ..Mesh::default()
        };
        for k in 0..n * n {
            let p = Vec2::new((k % n) as f32, (k / n) as f32) / (n - 1) as f32;
            let (x, y) = (p.x * (1.0 + weft), p.y * (1.0 + warp));
            let (sine, cosine) = shear.sin_cos();
            mesh.positions
                .push(Vec3::new(x + y * sine, y * cosine, 2.0));
            mesh.uvs.push(p * Vec2::new(0.5, 2.0));
        }
        for k in (0..n * (n - 1)).filter(|k| k % n + 1 < n).map(|k| k as u32) {
            let n = n as u32;
            mesh.indices.push([k, k + 1, k + n]);
            mesh.indices.push([k + 1, k + n + 1, k + n]);
        }
        mesh
    }

    #[test]
    fn strains_are_those_of_the_pull() {
        for [warp, weft, shear] in strains(&cloth(0.03, -0.01, 0.2), [2.0, 0.5]) {
            // f32 over edges of a third of a metre.
            assert!(
                (warp - 0.03).abs() < 3e-6 && (weft + 0.01).abs() < 3e-6,
                "{warp} {weft}"
            );
            assert!((shear - 0.2).abs() < 3e-6, "{shear}");
        }
    }

    #[test]
    fn cloth_at_rest_has_the_factor_one_exactly() {
        for strain in strains(&cloth(0.0, 0.0, 0.0), [2.0, 0.5]) {
            let factor = weave::opened([0.9, 0.8], strain.map(f64::from));
            assert_eq!(number(factor), 512);
        }
    }
}
