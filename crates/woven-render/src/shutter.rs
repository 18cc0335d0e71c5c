//! An open shutter: the samples of a picture are spread over poses of a moving mesh, so that it blurs.
//!
//! A run of samples is gathered with the mesh at one moment, the next run at another, into the same sums. The moments
//! are the multiples of the golden ratio modulo 1: evenly spread however early the render is stopped, and without the
//! powers of two in which the samples of a pixel repeat their patterns.

use anyhow::{Result, ensure};
use glam::Vec3;

use crate::render::Settings;

/// A mesh at one moment.
#[derive(Clone, Debug, Default)]
pub struct Pose {
    /// Vertices \[m\].
    pub positions: Vec<Vec3>,
    /// Shading normals, one a vertex; empty: the triangle's own.
    pub normals: Vec<Vec3>,
}

impl Pose {
    /// The pose at `t` in 0..1 of the straight way to `other`.
    #[must_use]
    pub fn towards(&self, other: &Self, t: f32) -> Self {
        let mix = |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).map(|(a, b)| a.lerp(*b, t)).collect();
        Self {
            positions: mix(&self.positions, &other.positions),
            normals: mix(&self.normals, &other.normals),
        }
    }
}

/// Moments that a picture is spread over where its samples allow it: ghosts of an edge that moves over 32 pixels lie a
/// pixel apart.
const MOMENTS: u32 = 32;
/// Samples a moment where nobody knows how many there will be.
const UNKNOWN: u32 = 4;

/// A mesh that moves while the shutter is open.
#[derive(Clone, Debug)]
pub(crate) struct Shutter {
    pub(crate) mesh: usize,
    poses: Vec<Pose>,
    /// Samples a moment.
    length: u32,
    /// Number of the run for which the mesh stands now.
    stands: Option<u32>,
}

impl Shutter {
    pub(crate) fn new(mesh: usize, poses: Vec<Pose>, settings: &Settings) -> Result<Self> {
        ensure!(
            poses.len() > 1,
            "a mesh needs at least two poses to move while the shutter is open"
        );
        let first = &poses[0];
        for pose in &poses[1..] {
            ensure!(
                pose.positions.len() == first.positions.len()
                    && pose.normals.len() == first.normals.len(),
                "the poses of a moving mesh have {} and {} vertices; they must be the same",
                first.positions.len(),
                pose.positions.len()
            );
        }
        let known = settings.noise.is_none() && settings.time_limit.is_none();
        Ok(Self {
            mesh,
            poses,
            length: if known {
                settings.spp.div_ceil(MOMENTS)
            } else {
                UNKNOWN
            },
            stands: None,
        })
    }

    /// How many samples from sample `index` on belong to the same moment.
    pub(crate) fn left(&self, index: u32) -> u32 {
        self.length - index % self.length
    }

    /// Where the mesh is to be moved before sample `index`; nothing if it stands there.
    pub(crate) fn turn(&mut self, index: u32) -> Option<Pose> {
        let run = index / self.length;
        if self.stands == Some(run) {
            return None;
        }
        self.stands = Some(run);
        // The middle, then steps of the golden ratio.
        let turn = 0x8000_0000_u32.wrapping_add(run.wrapping_mul(0x9e37_79b9));
        let at = crate::rng::unit(turn) * (self.poses.len() - 1) as f32;
        let k = (at as usize).min(self.poses.len() - 2);
        Some(self.poses[k].towards(&self.poses[k + 1], at - k as f32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shutter(spp: u32, noise: Option<f32>) -> Shutter {
        let pose = |x: f32| Pose {
            positions: vec![Vec3::X * x],
            normals: Vec::new(),
        };
        let settings = Settings {
            spp,
            noise,
            ..Settings::default()
        };
        Shutter::new(0, vec![pose(0.0), pose(1.0), pose(3.0)], &settings).unwrap()
    }

    #[test]
    fn moments_are_spread_evenly_and_follow_the_poses() {
        for (spp, noise) in [(64, None), (5, None), (4096, Some(0.1))] {
            let mut s = shutter(spp, noise);
            let mut places = Vec::new();
            let mut index = 0;
            while index < spp.min(128) {
                if let Some(pose) = s.turn(index) {
                    let x = pose.positions[0].x;
                    // Back to the time: one unit in the first half, two in the second.
                    places.push(if x < 1.0 { 0.5 * x } else { 0.25 * (x + 1.0) });
                }
                assert!(s.turn(index).is_none());
                index += s.left(index);
            }
            let n = places.len();
            places.sort_by(f32::total_cmp);
            for (i, t) in places.iter().enumerate() {
                // The points of the golden ratio lie within 1.6 steps of where even ones would.
                let even = (i as f32 + 0.5) / n as f32;
                assert!(
                    (t - even).abs() < 1.6 / n as f32,
                    "{spp}: {i} of {n} at {t}"
                );
            }
            assert!(n == 32.min(spp as usize), "{n}");
        }
    }

    #[test]
    fn poses_that_do_not_fit_are_a_sentence() {
        let two = Pose {
            positions: vec![Vec3::ZERO; 2],
            normals: Vec::new(),
        };
        let settings = Settings::default();
        let said = Shutter::new(0, vec![two.clone(), Pose::default()], &settings).unwrap_err();
        assert!(said.to_string().contains("2 and 0 vertices"), "{said}");
        assert!(Shutter::new(0, vec![two], &settings).is_err());
    }
}
