//! Simple solids as triangle meshes: boards, cushions, turned pieces, foliage. Everything in the room is made of them.

use glam::{Vec2, Vec3};
use woven_render::scene::Mesh;

/// Triangles being put together; several solids of one material make one mesh.
#[derive(Clone, Debug, Default)]
pub(super) struct Shape {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
    indices: Vec<[u32; 3]>,
}

impl Shape {
    /// The mesh, with the number of its material in the scene.
    #[must_use]
    pub(super) fn mesh(self, name: &str, material: usize) -> Mesh {
        let Self {
            positions,
            normals,
            uvs,
            indices,
        } = self;
        Mesh {
            name: name.to_owned(),
            positions,
            normals,
            uvs,
            indices,
            material,
            moving: false,
            at_rest: None,
        }
    }

    fn vertex(&mut self, position: Vec3, normal: Vec3, uv: Vec2) -> u32 {
        self.positions.push(position);
        self.normals.push(normal);
        self.uvs.push(uv);
        (self.positions.len() - 1) as u32
    }

    /// A parallelogram `corner + a u + b v`; its front is where `u × v` points. Texture coordinates are metres along u and v.
    #[must_use]
    pub(super) fn quad(mut self, corner: Vec3, u: Vec3, v: Vec3) -> Self {
        let normal = u.cross(v).normalize_or_zero();
        let (lu, lv) = (u.length(), v.length());
        let a = self.vertex(corner, normal, Vec2::ZERO);
        let b = self.vertex(corner + u, normal, Vec2::new(lu, 0.0));
        let c = self.vertex(corner + u + v, normal, Vec2::new(lu, lv));
        let d = self.vertex(corner + v, normal, Vec2::new(0.0, lv));
        self.indices.extend([[a, b, c], [a, c, d]]);
        self
    }

    /// A board with sharp edges between two opposite corners.
    #[must_use]
    pub(super) fn board(self, min: Vec3, max: Vec3) -> Self {
        let (x, y, z) = (
            Vec3::X * (max.x - min.x),
            Vec3::Y * (max.y - min.y),
            Vec3::Z * (max.z - min.z),
        );
        self.quad(min, y, x)
            .quad(max, -x, -y)
            .quad(min, x, z)
            .quad(max, -z, -x)
            .quad(min, z, y)
            .quad(max, -y, -z)
    }

    /// A board whose edges are rounded by `radius`, turned by `turn` radians about the vertical through `pivot`.
    #[must_use]
    pub(super) fn cushion(mut self, min: Vec3, max: Vec3, radius: f32, turn: (f32, Vec3)) -> Self {
        const STEPS: u32 = 8;
        let center = (min + max) * 0.5;
        let half = (max - min) * 0.5;
        let core = (half - Vec3::splat(radius)).max(Vec3::ZERO);
        let rotation = glam::Quat::from_rotation_y(turn.0);
        // Six grids of a cube, pulled to the rounded board: a point is its nearest core point plus radius along the way out.
        for (n, a, b) in [
            (Vec3::X, Vec3::Y, Vec3::Z),
            (Vec3::NEG_X, Vec3::Z, Vec3::Y),
            (Vec3::Y, Vec3::Z, Vec3::X),
            (Vec3::NEG_Y, Vec3::X, Vec3::Z),
            (Vec3::Z, Vec3::X, Vec3::Y),
            (Vec3::NEG_Z, Vec3::Y, Vec3::X),
        ] {
            let first = self.positions.len() as u32;
            for i in 0..=STEPS {
                for j in 0..=STEPS {
                    // Rows crowd at the rim, where the rounding is.
                    let spread = |k: u32| {
                        (std::f32::consts::FRAC_PI_4 * (2.0 * k as f32 / STEPS as f32 - 1.0)).tan()
                    };
                    let out = (n + a * spread(i) + b * spread(j)).normalize();
                    let cube = n + a * spread(i).clamp(-1.0, 1.0) + b * spread(j).clamp(-1.0, 1.0);
                    let local = (cube * core) + out * radius;
                    let placed = turn.1 + rotation * (center + local - turn.1);
                    self.vertex(placed, rotation * out, Vec2::new(cube.dot(a), cube.dot(b)));
                }
            }
            self.grid(first, STEPS, STEPS);
        }
        self
    }

    /// Two triangles for every cell of a grid of (rows + 1) × (columns + 1) vertices.
    fn grid(&mut self, first: u32, rows: u32, columns: u32) {
        for i in 0..rows {
            for j in 0..columns {
                let a = first + i * (columns + 1) + j;
                let (b, c, d) = (a + columns + 1, a + columns + 2, a + 1);
                self.indices.extend([[a, b, c], [a, c, d]]);
            }
        }
    }

    /// A piece turned about the vertical through `foot`: radius and height of the profile from below to above, the outside to the right.
    #[must_use]
    pub(super) fn turned(mut self, foot: Vec3, profile: &[(f32, f32)], around: u32) -> Self {
        for pair in profile.windows(2) {
            let ((r0, y0), (r1, y1)) = (pair[0], pair[1]);
            let slope = Vec2::new(y1 - y0, r0 - r1).normalize_or_zero();
            let first = self.positions.len() as u32;
            for k in 0..=around {
                let turn = k as f32 / around as f32;
                let (sin, cos) = (turn * std::f32::consts::TAU).sin_cos();
                let normal = Vec3::new(cos * slope.x, slope.y, -sin * slope.x);
                for (r, y, v) in [(r0, y0, 0.0), (r1, y1, 1.0)] {
                    self.vertex(
                        foot + Vec3::new(cos * r, y, -sin * r),
                        normal,
                        Vec2::new(turn, v),
                    );
                }
            }
            self.grid(first, around, 1);
        }
        self
    }

    /// A lumpy ball: `lumps` is the height of its bumps as a share of the radii; `seed` chooses them.
    #[must_use]
    pub(super) fn ball(mut self, center: Vec3, radii: Vec3, lumps: f32, seed: u32) -> Self {
        const RINGS: u32 = 18;
        const AROUND: u32 = 28;
        let point = |i: u32, j: u32| {
            let theta = std::f32::consts::PI * i as f32 / RINGS as f32;
            let phi = std::f32::consts::TAU * (j % AROUND) as f32 / AROUND as f32;
            let d = Vec3::new(
                theta.sin() * phi.cos(),
                theta.cos(),
                -theta.sin() * phi.sin(),
            );
            let bump = (0..3)
                .map(|k| bump(d, seed.wrapping_add(k), 2.5 + 2.5 * k as f32))
                .sum::<f32>()
                / 3.0;
            center + d * radii * (1.0 + lumps * bump)
        };
        let first = self.positions.len() as u32;
        for i in 0..=RINGS {
            for j in 0..=AROUND {
                let p = point(i, j);
                let east = point(i, (j + 1) % AROUND) - point(i, (j + AROUND - 1) % AROUND);
                let south = point((i + 1).min(RINGS), j) - point(i.saturating_sub(1), j);
                let normal = south
                    .cross(east)
                    .try_normalize()
                    .unwrap_or((p - center).normalize_or_zero());
                self.vertex(
                    p,
                    normal,
                    Vec2::new(j as f32 / AROUND as f32, i as f32 / RINGS as f32),
                );
            }
        }
        self.grid(first, RINGS, AROUND);
        self
    }

    /// A leaf on an arching stalk from `root`: it leans by `lean` (horizontal, metres at the tip), rises to `rise` and droops after.
    #[must_use]
    pub(super) fn leaf(mut self, root: Vec3, lean: Vec3, rise: f32, width: f32) -> Self {
        const STEPS: u32 = 10;
        let side = Vec3::Y.cross(lean).normalize_or_zero();
        let at = |t: f32| {
            root + lean * t + Vec3::Y * rise * (1.0 - (1.0 - 1.6 * t).powi(2)) / (1.0 - 0.36)
        };
        let first = self.positions.len() as u32;
        for i in 0..=STEPS {
            let t = i as f32 / STEPS as f32;
            let along = (at(t + 0.01) - at(t - 0.01)).normalize_or_zero();
            let blade = ((t - 0.15).max(0.0) / 0.85 * std::f32::consts::PI)
                .sin()
                .max(0.06)
                * width;
            let normal = along.cross(side).normalize_or_zero();
            for s in [-1.0_f32, 0.0, 1.0] {
                let fold = Vec3::Y * (s.abs() * blade * 0.35);
                self.vertex(
                    at(t) + side * (s * blade) + fold,
                    (normal + side * s * -0.3).normalize(),
                    Vec2::new(s, t),
                );
            }
        }
        self.grid(first, STEPS, 2);
        self
    }
}

/// Smooth bumps in -1..1 over directions: a few sine waves whose ways are chosen by `seed`.
fn bump(d: Vec3, seed: u32, frequency: f32) -> f32 {
    let axis = Vec3::new(
        noise(seed, 0) - 0.5,
        noise(seed, 1) - 0.5,
        noise(seed, 2) - 0.5,
    )
    .try_normalize()
    .unwrap_or(Vec3::X);
    let other = axis.any_orthonormal_vector();
    (axis.dot(d) * frequency + 6.0 * noise(seed, 3)).sin()
        * (other.dot(d) * frequency * 1.3 + 6.0 * noise(seed, 4)).cos()
}

/// A number in 0..1 that depends on the two given ones alone.
pub(super) fn noise(seed: u32, index: u32) -> f32 {
    let mut h = seed.wrapping_mul(0x9e37_79b9) ^ index.wrapping_mul(0x85eb_ca6b);
    for m in [0x7feb_352d_u32, 0x846c_a68b] {
        h = (h ^ (h >> 16)).wrapping_mul(m);
    }
    ((h ^ (h >> 16)) >> 8) as f32 / (1 << 24) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Signed volume by the divergence theorem: positive when all triangles face outwards.
    fn volume(shape: &Shape) -> f32 {
        shape
            .indices
            .iter()
            .map(|t| t.map(|i| shape.positions[i as usize]))
            .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
            .sum()
    }

    #[test]
    fn solids_face_outwards_and_hold_what_they_should() {
        let board = Shape::default().board(Vec3::new(1.0, 2.0, 3.0), Vec3::new(2.0, 4.0, 6.0));
        assert!((volume(&board) - 6.0).abs() < 1e-3);
        let turned = Shape::default().turned(
            Vec3::ZERO,
            &[(0.0, 0.0), (1.0, 0.0), (1.0, 2.0), (0.0, 2.0)],
            64,
        );
        // A 64-gon has 0.16 % less area than its circle.
        assert!((volume(&turned) - std::f32::consts::TAU).abs() < 0.02);
        let ball = Shape::default().ball(Vec3::ZERO, Vec3::ONE, 0.0, 1);
        assert!((volume(&ball) / 4.19 - 1.0).abs() < 0.03);
        let cushion = Shape::default().cushion(Vec3::ZERO, Vec3::ONE, 0.1, (0.7, Vec3::ZERO));
        // The faces swell from 0.971 at the edges to 1 in the middle (radius / √2 there), and the edges are rounded.
        assert!(
            (0.86..0.93).contains(&volume(&cushion)),
            "{}",
            volume(&cushion)
        );
    }

    #[test]
    fn normals_agree_with_the_triangles() {
        let shapes = [
            Shape::default().board(Vec3::ZERO, Vec3::ONE),
            Shape::default().cushion(Vec3::ZERO, Vec3::ONE, 0.2, (0.3, Vec3::ZERO)),
            Shape::default().turned(Vec3::ZERO, &[(0.5, 0.0), (0.3, 1.0)], 16),
            Shape::default().ball(Vec3::ZERO, Vec3::new(1.0, 2.0, 1.0), 0.1, 7),
            Shape::default().leaf(Vec3::ZERO, Vec3::new(0.3, 0.0, 0.1), 0.5, 0.05),
        ];
        for (k, shape) in shapes.iter().enumerate() {
            for t in &shape.indices {
                let [a, b, c] = t.map(|i| shape.positions[i as usize]);
                let face = (b - a).cross(c - a);
                let mean: Vec3 = t.iter().map(|&i| shape.normals[i as usize]).sum();
                assert!(
                    face.length() < 1e-7 || face.dot(mean) > 0.0,
                    "shape {k}, triangle {t:?}"
                );
            }
        }
    }
}
