//! The grids a plan can name, and the poses they mean.

use serde::{Deserialize, Serialize};

use super::{Angles, product, refused, zero};
use crate::adaptive::Adaptive;
use crate::error::Result;
use crate::klems;
use crate::pose::{AXES, Pose};
use crate::sim::noise::Noise;

/// How the camera's 10°…90° of the paper are sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PaperCamera {
    /// "40 steps" as 40 samples, 80/39 = 2.0513° apart: 79 poses with the shared one. Agrees with the paper's count.
    #[default]
    FortySamples,
    /// "40 steps" as 40 intervals of 2°: 81 poses.
    FortyIntervals,
}

/// The grids a plan can name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Grid {
    /// Tobitani et al. 2013, section 4.2: camera elevation 10°…90° (90 = facing the sample) on the azimuths 0 and 180°, light behind the sample.
    Paper {
        /// Reading of "40 steps".
        #[serde(default)]
        camera: PaperCamera,
        /// Light elevations in degrees; the paper has 130…180 in "5 steps", read as six samples (10°) or five (12.5°).
        #[serde(default = "paper_light")]
        light_elevations: Angles,
        /// The light elevation that means normal incidence: 180 by section 4.2, 90 by the caption of figure 6.
        #[serde(default = "paper_normal")]
        light_normal: f64,
        /// Azimuths of the light, degrees (lost in the paper's text).
        #[serde(default = "zero")]
        light_azimuths: Angles,
    },
    /// Every combination of four lists.
    Uniform {
        /// Light polar angles.
        theta_l: Angles,
        /// Light azimuths.
        phi_l: Angles,
        /// Detector polar angles; above 90 is transmission.
        theta_v: Angles,
        /// Detector azimuths.
        phi_v: Angles,
    },
    /// The patch centres of the Klems basis (145), for some incident polar angles in the plane of azimuth 0.
    Klems {
        /// Light polar angles.
        #[serde(default = "zero")]
        theta_l: Angles,
        /// Light azimuths.
        #[serde(default = "zero")]
        phi_l: Angles,
        /// Measure the transmitted hemisphere (else the reflected one).
        #[serde(default = "super::yes")]
        transmission: bool,
        /// The light at every patch, too: the 21025 pairs of a whole matrix.
        #[serde(default)]
        all_incidences: bool,
    },
    /// Random directions, even over the projected hemispheres; light in front, detector behind.
    Random {
        /// How many.
        count: u32,
        /// Seed.
        seed: u64,
        /// Greatest polar angle from the normal (or its opposite), degrees.
        #[serde(default = "random_max")]
        theta_max: f64,
    },
    /// Planes through the normal that are refined where the light changes fast.
    Adaptive(Adaptive),
    /// One by one: [theta_l, phi_l, theta_v, phi_v] in degrees.
    List {
        /// The poses.
        poses: Vec<[f64; AXES]>,
    },
}

/// More poses than this are a mistake.
pub const MOST_POSES: usize = 1_000_000;

fn paper_light() -> Angles {
    Angles::Range {
        from: 130.0,
        to: 180.0,
        step: 10.0,
    }
}
fn paper_normal() -> f64 {
    180.0
}
fn random_max() -> f64 {
    80.0
}

impl Grid {
    /// The poses in the order of the grid, before any check against a rig.
    ///
    /// # Errors
    /// [`Error::Plan`](crate::error::Error::Plan).
    pub fn poses(&self) -> Result<Vec<Pose>> {
        let out = match self {
            Grid::Paper {
                camera,
                light_elevations,
                light_normal,
                light_azimuths,
            } => paper(
                *camera,
                &light_elevations.values("grid.light_elevations")?,
                *light_normal,
                &light_azimuths.values("grid.light_azimuths")?,
            ),
            Grid::Uniform {
                theta_l,
                phi_l,
                theta_v,
                phi_v,
            } => uniform([theta_l, phi_l, theta_v, phi_v])?,
            Grid::Klems {
                theta_l,
                phi_l,
                transmission,
                all_incidences,
            } => {
                let mut lights = Vec::new();
                if *all_incidences {
                    // A patch is named by the way the light travels: its light stands opposite.
                    lights.extend(
                        klems::patches().map(|p| (p.theta, turned((p.phi + 180.0) % 360.0))),
                    );
                } else {
                    let phis = phi_l.values("grid.phi_l")?;
                    for tl in theta_l.values("grid.theta_l")? {
                        lights.extend(phis.iter().map(|pl| (tl, *pl)));
                    }
                }
                klems_poses(&lights, *transmission)?
            }
            Grid::Random {
                count,
                seed,
                theta_max,
            } => random(*count, *seed, *theta_max)?,
            Grid::Adaptive(a) => a.first()?,
            Grid::List { poses } => poses.iter().map(|a| Pose::from_angles(*a)).collect(),
        };
        if out.is_empty() || out.len() > MOST_POSES {
            return Err(refused(format!(
                "it has {} poses, give 1 to {MOST_POSES}",
                out.len()
            )));
        }
        if out
            .iter()
            .any(|p| p.angles().iter().any(|a| !a.is_finite()))
        {
            return Err(refused("it has an angle that is not a number"));
        }
        Ok(out)
    }
}

/// Elevation 90 faces the sample from behind: theta_v = 90 + elevation. First azimuth 0, then back along 180 without the shared pose.
fn paper(camera: PaperCamera, elevations: &[f64], normal: f64, azimuths: &[f64]) -> Vec<Pose> {
    let (n, step) = match camera {
        PaperCamera::FortySamples => (40, 80.0 / 39.0),
        PaperCamera::FortyIntervals => (41, 2.0),
    };
    let theta_v = |k: i32| {
        if k == n - 1 {
            180.0
        } else {
            100.0 + f64::from(k) * step
        }
    };
    let mut out = Vec::new();
    for &phi_l in azimuths {
        for elevation in elevations {
            let pose = |k, phi_v| Pose::new((elevation - normal).abs(), phi_l, theta_v(k), phi_v);
            out.extend((0..n).map(|k| pose(k, 0.0)));
            out.extend((0..n - 1).rev().map(|k| pose(k, 180.0)));
        }
    }
    out
}

fn uniform(angles: [&Angles; AXES]) -> Result<Vec<Pose>> {
    let names = ["grid.theta_l", "grid.phi_l", "grid.theta_v", "grid.phi_v"];
    let mut lists = Vec::with_capacity(AXES);
    for (list, name) in angles.iter().zip(names) {
        lists.push(list.values(name)?);
    }
    product(lists.iter().map(Vec::len))?;
    let mut out = Vec::new();
    for &tl in &lists[0] {
        for &pl in &lists[1] {
            for &pv in &lists[3] {
                out.extend(lists[2].iter().map(|&tv| Pose::new(tl, pl, tv, pv)));
            }
        }
    }
    Ok(out)
}

fn klems_poses(lights: &[(f64, f64)], transmission: bool) -> Result<Vec<Pose>> {
    product([lights.len(), klems::patches().count()])?;
    let mut out = Vec::new();
    for &(tl, pl) in lights {
        out.extend(klems::patches().map(|p| {
            let theta_v = if transmission {
                180.0 - p.theta
            } else {
                p.theta
            };
            Pose::new(tl, pl, theta_v, turned(p.phi))
        }));
    }
    Ok(out)
}

fn random(count: u32, seed: u64, theta_max: f64) -> Result<Vec<Pose>> {
    if !(theta_max > 0.0 && theta_max <= 90.0) || count as usize > MOST_POSES {
        return Err(refused(
            "grid.theta_max must be in 0..90 and grid.count at most a million",
        ));
    }
    let most = theta_max.to_radians().sin();
    let pose = |k: u32| {
        let mut noise = Noise::at(&[seed, u64::from(k)]);
        let mut direction = || {
            // Even over the projected disc: the sine of theta grows as the root of a uniform number.
            let theta = (most * noise.uniform().sqrt()).asin().to_degrees();
            (theta, noise.uniform() * 360.0 - 180.0)
        };
        let ((tl, pl), (tv, pv)) = (direction(), direction());
        Pose::new(tl, pl, 180.0 - tv, pv)
    };
    Ok((0..count).map(pose).collect())
}

/// An azimuth of 0..360 as one of -180..180.
fn turned(phi: f64) -> f64 {
    if phi > 180.0 { phi - 360.0 } else { phi }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::Plan;

    fn plan(grid: &str) -> Plan {
        Plan::from_toml(&format!("name = 't'\n{grid}")).unwrap()
    }

    #[test]
    fn the_papers_grid_by_name() {
        let p = plan("[grid]\nkind = 'paper'\nlight_elevations = [180]");
        let poses = p.grid.poses().unwrap();
        assert_eq!(poses.len(), 79);
        assert_eq!(poses[0], Pose::new(0.0, 0.0, 100.0, 0.0));
        assert_eq!(poses[39], Pose::new(0.0, 0.0, 180.0, 0.0));
        assert!((poses[1].theta_v - 102.051_282).abs() < 1e-6);
        assert_eq!(
            plan("[grid]\nkind = 'paper'\ncamera = 'forty-intervals'\nlight_elevations = [180]")
                .grid
                .poses()
                .unwrap()
                .len(),
            81
        );
        assert_eq!(
            plan("[grid]\nkind = 'paper'").grid.poses().unwrap().len(),
            6 * 79
        );
        let caption = plan("[grid]\nkind = 'paper'\nlight_normal = 90\nlight_elevations = [90]");
        assert_eq!(caption.grid.poses().unwrap()[0].theta_l, 0.0);
        assert!(p.route(&crate::rig::Rig::default()).unwrap().seconds > 10.0);
    }

    #[test]
    fn klems_has_145_and_random_is_repeatable() {
        assert_eq!(
            plan("[grid]\nkind = 'klems'\ntheta_l = [0]")
                .grid
                .poses()
                .unwrap()
                .len(),
            145
        );
        let r = plan("[grid]\nkind = 'random'\ncount = 50\nseed = 3");
        assert_eq!(r.grid.poses().unwrap(), r.grid.poses().unwrap());
        assert!(
            r.grid
                .poses()
                .unwrap()
                .iter()
                .all(|p| p.theta_l <= 80.0 && p.theta_v >= 100.0)
        );
    }
}
