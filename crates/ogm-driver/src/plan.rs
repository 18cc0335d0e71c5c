//! The plan of one measurement: which poses, which exposures, which calibration, in which order, and what it costs in time.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::exposure::Exposures;
use crate::pose::{AXES, Pose};
use crate::rig::Rig;

/// A plan file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Name for the log and the measurement.
    pub name: String,
    /// The sample, in the operator's words.
    #[serde(default)]
    pub sample: String,
    /// Who measures.
    #[serde(default)]
    pub operator: String,
    /// Where the detector goes.
    pub grid: Grid,
    /// What to do with poses outside the limits or in the zone of the arms.
    #[serde(default)]
    pub forbidden: Forbidden,
    /// The order of the poses.
    #[serde(default)]
    pub order: Order,
    /// Adds the straight-through pose of every incidence.
    #[serde(default = "yes")]
    pub straight_through: bool,
    /// Exposure ladder.
    #[serde(default)]
    pub exposure: Exposures,
    /// Calibration readings.
    #[serde(default)]
    pub calibration: Calibration,
}

fn yes() -> bool {
    true
}

/// What happens with a pose that the rig must not take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Forbidden {
    /// The whole plan is refused.
    #[default]
    Refuse,
    /// The pose is left out, and the number of those left out is told. It is never replaced by a nearby one.
    LeaveOut,
}

/// The order of the poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// From each pose to the one reached soonest, the light arm moving last.
    #[default]
    Travel,
    /// As the grid lists them.
    AsGiven,
}

/// Calibration readings of a scan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Calibration {
    /// The scan begins when the lamp has been on this long, minutes.
    pub warm_up_min: f64,
    /// Dark readings at every exposure, this many each.
    pub dark: u32,
    /// Direct-beam readings without the sample, this many.
    pub direct: u32,
    /// Brackets of the direct beam from a tenth of full scale to the end, which tell the detector's curvature; this many.
    pub linearity: u32,
    /// Measure the white standard.
    pub white: bool,
    /// A reference reading after this many poses; 0 = only at the start.
    pub reference_every: u32,
    /// What corrects the drift of the lamp.
    pub drift: Drift,
    /// After a resume the reference must agree with the first within this share.
    pub resume_tolerance: f64,
}

/// How the drift of the lamp is taken out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Drift {
    /// By the diode that watches the lamp during every reading.
    #[default]
    Diode,
    /// By straight lines in time between reference readings.
    Reference,
    /// Not at all.
    None,
}

impl Default for Calibration {
    fn default() -> Self {
        Calibration {
            warm_up_min: 30.0,
            dark: 4,
            direct: 4,
            linearity: 2,
            white: true,
            reference_every: 50,
            drift: Drift::Diode,
            resume_tolerance: 0.03,
        }
    }
}

/// A list of angles in degrees: given one by one, or from-to-step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Angles {
    /// One by one.
    List(Vec<f64>),
    /// Evenly, both ends included.
    Range {
        /// First angle.
        from: f64,
        /// Last angle.
        to: f64,
        /// Step, positive.
        step: f64,
    },
}

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
        #[serde(default = "yes")]
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

/// The adaptive grid: first `first_step` over each plane and some poses beside straight through, then halved intervals.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Adaptive {
    /// Light polar angles, degrees.
    pub theta_l: Angles,
    /// Light azimuths, degrees.
    pub phi_l: Angles,
    /// Azimuths of the detector's planes, degrees; each plane is run on both sides of the normal.
    pub planes: Angles,
    /// The planes end this far from straight behind the sample, degrees.
    pub reach: f64,
    /// First distance of the poses, degrees.
    pub first_step: f64,
    /// No interval is made shorter than this, degrees.
    pub least_step: f64,
    /// A straight line between neighbours may be off by this share of the value (and a fiftieth of the peak).
    pub tolerance: f64,
    /// At least this many poses within the full width at half maximum.
    pub per_fwhm: u32,
    /// Never more poses than this.
    pub most: u32,
}

impl Default for Adaptive {
    fn default() -> Self {
        Adaptive {
            theta_l: zero(),
            phi_l: zero(),
            planes: zero(),
            reach: 80.0,
            first_step: 16.0,
            least_step: 0.1,
            tolerance: 0.05,
            per_fwhm: 5,
            most: 10_000,
        }
    }
}

impl Adaptive {
    /// Every (theta_l, phi_l, plane).
    ///
    /// # Errors
    /// [`Error::Plan`].
    pub fn planes(&self) -> Result<Vec<(f64, f64, f64)>> {
        let (tl, pl) = (
            self.theta_l.values("grid.theta_l")?,
            self.phi_l.values("grid.phi_l")?,
        );
        let planes = self.planes.values("grid.planes")?;
        let mut out = Vec::new();
        for t in &tl {
            for p in &pl {
                out.extend(planes.iter().map(|plane| (*t, *p, *plane)));
            }
        }
        Ok(out)
    }

    /// The pose at the signed angle `t` (degrees from straight behind the sample) of a plane.
    pub fn pose(theta_l: f64, phi_l: f64, plane: f64, t: f64) -> Pose {
        let phi = if t >= 0.0 {
            plane
        } else if plane > 0.0 {
            plane - 180.0
        } else {
            plane + 180.0
        };
        Pose::new(theta_l, phi_l, 180.0 - t.abs(), phi)
    }

    /// The first poses: even over each plane, and closer and closer towards straight through.
    fn first(&self) -> Result<Vec<Pose>> {
        let positive = [self.reach, self.first_step, self.least_step, self.tolerance];
        if positive.iter().any(|x| x.is_nan() || *x <= 0.0)
            || self.reach > 89.0
            || self.per_fwhm > 1000
            || self.least_step < 0.01
        {
            return Err(refused(
                "an adaptive grid needs reach in 0..89, positive first_step and tolerance, least_step of at least 0.01, per_fwhm up to 1000",
            ));
        }
        let n = (self.reach / self.first_step).ceil().clamp(1.0, 1000.0);
        let mut out = Vec::new();
        for (theta_l, phi_l, plane) in self.planes()? {
            let mut angles: Vec<f64> = (0..=2 * n as u32)
                .map(|k| self.reach * (f64::from(k) / n - 1.0))
                .collect();
            // Straight through lies on this plane at +theta_l or -theta_l, if at all.
            let turn = (phi_l + 180.0 - plane).rem_euclid(360.0);
            let opposite = (90.0..=270.0).contains(&turn);
            let straight = if opposite { -theta_l } else { theta_l };
            for offset in [1.0, 2.0, 4.0, 8.0] {
                angles.extend([straight - offset, straight + offset]);
            }
            angles.retain(|t| t.abs() <= self.reach);
            angles.sort_by(f64::total_cmp);
            angles.dedup_by(|a, b| (*a - *b).abs() < 0.5);
            out.extend(
                angles
                    .into_iter()
                    .map(|t| Self::pose(theta_l, phi_l, plane, t)),
            );
        }
        Ok(out)
    }
}

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
fn zero() -> Angles {
    Angles::List(vec![0.0])
}
fn random_max() -> f64 {
    80.0
}

/// The Klems full basis: bounds of the rings in polar angle, degrees, and patches in each (Klems 1994, LBNL WINDOW).
pub const KLEMS_RINGS: [(f64, f64, u32); 9] = [
    (0.0, 5.0, 1),
    (5.0, 15.0, 8),
    (15.0, 25.0, 16),
    (25.0, 35.0, 20),
    (35.0, 45.0, 24),
    (45.0, 55.0, 24),
    (55.0, 65.0, 24),
    (65.0, 75.0, 16),
    (75.0, 90.0, 12),
];

/// More poses than this are a mistake.
pub const MOST_POSES: usize = 1_000_000;

fn refused(what: impl std::fmt::Display) -> Error {
    Error::Plan(format!("The plan cannot be used: {what}."))
}

impl Angles {
    fn values(&self, name: &str) -> Result<Vec<f64>> {
        match self {
            Angles::List(list) if list.is_empty() || list.len() > MOST_POSES => {
                Err(refused(format!("{name} has no angle or far too many")))
            }
            Angles::List(list) if list.iter().any(|a| !a.is_finite()) => {
                Err(refused(format!("{name} has an angle that is not a number")))
            }
            Angles::List(list) => Ok(list.clone()),
            Angles::Range { from, to, step } => {
                if !(from.is_finite() && to.is_finite() && *step > 0.0 && to >= from) {
                    return Err(refused(format!(
                        "{name} needs from <= to and a positive step"
                    )));
                }
                let n = ((to - from) / step + 1e-6).floor();
                if n > 100_000.0 {
                    return Err(refused(format!("{name} has {n} steps")));
                }
                Ok((0..=n as u32).map(|k| from + f64::from(k) * step).collect())
            }
        }
    }
}

impl Grid {
    /// The poses in the order of the grid, before any check against a rig.
    ///
    /// # Errors
    /// [`Error::Plan`].
    pub fn poses(&self) -> Result<Vec<Pose>> {
        let mut out = Vec::new();
        match self {
            Grid::Paper {
                camera,
                light_elevations,
                light_normal,
                light_azimuths,
            } => {
                let (n, step) = match camera {
                    PaperCamera::FortySamples => (40, 80.0 / 39.0),
                    PaperCamera::FortyIntervals => (41, 2.0),
                };
                for phi_l in light_azimuths.values("grid.light_azimuths")? {
                    for elevation in light_elevations.values("grid.light_elevations")? {
                        let theta_l = (elevation - light_normal).abs();
                        // Elevation 90 faces the sample from behind: theta_v = 90 + elevation. First azimuth 0, then back along 180 without the shared pose.
                        let theta_v = |k: i32| {
                            if k == n - 1 {
                                180.0
                            } else {
                                100.0 + f64::from(k) * step
                            }
                        };
                        out.extend((0..n).map(|k| Pose::new(theta_l, phi_l, theta_v(k), 0.0)));
                        out.extend(
                            (0..n - 1)
                                .rev()
                                .map(|k| Pose::new(theta_l, phi_l, theta_v(k), 180.0)),
                        );
                    }
                }
            }
            Grid::Uniform {
                theta_l,
                phi_l,
                theta_v,
                phi_v,
            } => {
                let lists = [
                    theta_l.values("grid.theta_l")?,
                    phi_l.values("grid.phi_l")?,
                    theta_v.values("grid.theta_v")?,
                    phi_v.values("grid.phi_v")?,
                ];
                let count = lists
                    .iter()
                    .try_fold(1_usize, |n, l| n.checked_mul(l.len()))
                    .filter(|n| *n <= MOST_POSES);
                if count.is_none() {
                    return Err(refused(format!(
                        "the grid has more than {MOST_POSES} poses"
                    )));
                }
                for &tl in &lists[0] {
                    for &pl in &lists[1] {
                        for &pv in &lists[3] {
                            out.extend(lists[2].iter().map(|&tv| Pose::new(tl, pl, tv, pv)));
                        }
                    }
                }
            }
            Grid::Klems {
                theta_l,
                phi_l,
                transmission,
                all_incidences,
            } => {
                let turn = |phi: f64| if phi > 180.0 { phi - 360.0 } else { phi };
                let centres = || {
                    KLEMS_RINGS.into_iter().flat_map(|(low, high, count)| {
                        let theta = if low == 0.0 { 0.0 } else { (low + high) / 2.0 };
                        (0..count).map(move |k| (theta, f64::from(k) * 360.0 / f64::from(count)))
                    })
                };
                let mut lights = Vec::new();
                if *all_incidences {
                    // A patch is named by the way the light travels: its light stands opposite.
                    lights.extend(centres().map(|(t, p)| (t, turn((p + 180.0) % 360.0))));
                } else {
                    for tl in theta_l.values("grid.theta_l")? {
                        lights.extend(phi_l.values("grid.phi_l")?.into_iter().map(|pl| (tl, pl)));
                    }
                }
                for (tl, pl) in lights {
                    for (theta, phi) in centres() {
                        let theta_v = if *transmission { 180.0 - theta } else { theta };
                        out.push(Pose::new(tl, pl, theta_v, turn(phi)));
                    }
                }
            }
            Grid::Random {
                count,
                seed,
                theta_max,
            } => {
                if !(*theta_max > 0.0 && *theta_max <= 90.0) || *count as usize > MOST_POSES {
                    return Err(refused(
                        "grid.theta_max must be in 0..90 and grid.count at most a million",
                    ));
                }
                let most = theta_max.to_radians().sin();
                for k in 0..*count {
                    let mut noise = crate::sim::noise::Noise::at(&[*seed, u64::from(k)]);
                    let mut direction = || {
                        (
                            (most * noise.uniform().sqrt()).asin().to_degrees(),
                            noise.uniform() * 360.0 - 180.0,
                        )
                    };
                    let ((tl, pl), (tv, pv)) = (direction(), direction());
                    out.push(Pose::new(tl, pl, 180.0 - tv, pv));
                }
            }
            Grid::Adaptive(a) => out = a.first()?,
            Grid::List { poses } => out.extend(poses.iter().map(|a| Pose::from_angles(*a))),
        }
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

/// The poses of a plan on a rig.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    /// In the order of the scan.
    pub poses: Vec<Pose>,
    /// How many were left out because the rig must not take them.
    pub left_out: usize,
    /// Time of all moves and of the longest exposures, seconds: an upper guess.
    pub seconds: f64,
}

impl Plan {
    /// Reads and checks a plan from TOML text.
    ///
    /// # Errors
    /// [`Error::Plan`] with the place in the file.
    pub fn from_toml(text: &str) -> Result<Self> {
        let plan: Plan = toml::from_str(text)
            .map_err(|e| refused(e.to_string().trim().trim_end_matches('.')))?;
        plan.validate()?;
        Ok(plan)
    }

    /// Reads and checks a plan file.
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::Plan`].
    pub fn load(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::io("read", path, e))?;
        Self::from_toml(&text)
    }

    /// Checks every number that does not depend on the rig.
    ///
    /// # Errors
    /// [`Error::Plan`].
    pub fn validate(&self) -> Result<()> {
        self.exposure.validate()?;
        let c = &self.calibration;
        if !((0.0..=1440.0).contains(&c.warm_up_min) && (0.0..=1.0).contains(&c.resume_tolerance)) {
            return Err(refused(
                "calibration.warm_up_min must be 0..1440 and calibration.resume_tolerance 0..1",
            ));
        }
        if c.direct == 0 || c.direct > 100 || c.dark > 100 || c.linearity > 100 {
            return Err(refused(
                "calibration.direct must be 1..100, calibration.dark and calibration.linearity 0..100; without the direct beam there is no scale",
            ));
        }
        if c.drift == Drift::Reference && c.reference_every == 0 {
            return Err(refused(
                "calibration.drift = \"reference\" needs calibration.reference_every",
            ));
        }
        Ok(())
    }

    /// The reference pose: normal incidence, straight through, without the sample.
    pub const REFERENCE: Pose = Pose::new(0.0, 0.0, 180.0, 0.0);
    /// The pose of the white standard: normal incidence, seen at 45° from the lamp's side.
    pub const WHITE: Pose = Pose::new(0.0, 0.0, 45.0, 0.0);

    /// The poses that the rig may take, in the order of the scan, with the time they cost.
    ///
    /// # Errors
    /// [`Error::Limit`] or [`Error::Zone`] for the first forbidden pose (with `forbidden = "refuse"`), [`Error::Plan`].
    pub fn route(&self, rig: &Rig) -> Result<Route> {
        let mut poses = self.grid.poses()?;
        if self.straight_through {
            let mut seen: Vec<(f64, f64)> = Vec::new();
            for p in poses.clone() {
                if !seen.contains(&(p.theta_l, p.phi_l)) && seen.len() < 10_000 {
                    seen.push((p.theta_l, p.phi_l));
                    let straight = Pose::straight_through(p.theta_l, p.phi_l);
                    if !poses
                        .iter()
                        .any(|q| q.light() == p.light() && q.from_straight() < 1e-6)
                    {
                        poses.push(straight);
                    }
                }
            }
        }
        let before = poses.len();
        if self.forbidden == Forbidden::LeaveOut {
            poses.retain(|p| rig.pulses(*p).is_ok());
        }
        let left_out = before - poses.len();
        if poses.is_empty() {
            return Err(refused(format!(
                "all of its {before} poses lie outside the limits or in the zone of the arms"
            )));
        }
        let targets: Vec<[i64; AXES]> = poses
            .iter()
            .map(|p| rig.pulses(*p))
            .collect::<Result<_>>()?;
        let order = match self.order {
            Order::AsGiven => (0..poses.len()).collect(),
            Order::Travel => travel_order(rig, &targets),
        };
        let (mut here, mut seconds) = (rig.pulses(Self::REFERENCE)?, 0.0);
        let exposures: f64 = self.exposure.ladder_ms[0]
            + self.exposure.ladder_ms.last().unwrap_or(&0.0) * f64::from(self.exposure.repeats);
        // Calibration and every resume go by the reference pose: all of that is tried before the first byte goes out.
        let reference = here;
        rig.way(&[0; AXES], Self::REFERENCE)?;
        if self.calibration.white {
            let white = rig.pulses(Self::WHITE)?;
            rig.way(&reference, Self::WHITE)?;
            rig.way(&white, Self::REFERENCE)?;
        }
        for &i in &order {
            rig.way(&reference, poses[i])?;
            rig.way(&targets[i], Self::REFERENCE)?;
            for leg in rig.way(&here, poses[i])? {
                seconds += rig.leg_seconds(&here, &leg) + rig.settle_ms as f64 / 1000.0;
                here = leg;
            }
            seconds += exposures / 1000.0;
        }
        Ok(Route {
            poses: order.into_iter().map(|i| poses[i]).collect(),
            left_out,
            seconds,
        })
    }
}

/// Groups poses by the light arm, then goes from each pose to the nearest in time; groups too large for that are run in rows to and fro.
fn travel_order(rig: &Rig, targets: &[[i64; AXES]]) -> Vec<usize> {
    const LARGEST_GROUP: usize = 2000;
    let mut all: Vec<usize> = (0..targets.len()).collect();
    all.sort_by_key(|&i| {
        (
            targets[i][0],
            targets[i][1],
            targets[i][3],
            targets[i][2],
            i,
        )
    });
    let mut out: Vec<usize> = Vec::with_capacity(all.len());
    for group in all.chunk_by(|&a, &b| targets[a][..2] == targets[b][..2]) {
        if group.len() > LARGEST_GROUP {
            for (row, indices) in group
                .chunk_by(|&a, &b| targets[a][3] == targets[b][3])
                .enumerate()
            {
                if row % 2 == 0 {
                    out.extend(indices);
                } else {
                    out.extend(indices.iter().rev());
                }
            }
            continue;
        }
        let mut left = group.to_vec();
        let mut here = out.last().map_or([0; AXES], |&i| targets[i]);
        while !left.is_empty() {
            let cost = |i: usize| rig.leg_seconds(&here, &targets[i]);
            let (k, _) = left
                .iter()
                .enumerate()
                .map(|(k, &i)| (k, cost(i)))
                .min_by(|a, b| a.1.total_cmp(&b.1))
                .unwrap_or((0, 0.0));
            let next = left.remove(k);
            here = targets[next];
            out.push(next);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert!(p.route(&Rig::default()).unwrap().seconds > 10.0);
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

    #[test]
    fn forbidden_poses_refuse_the_plan_or_are_left_out_and_counted() {
        let text = "[grid]\nkind = 'uniform'\ntheta_l = [30]\nphi_l = [0]\ntheta_v = { from = 0, to = 75, step = 15 }\nphi_v = [0]";
        let e = plan(text).route(&Rig::default()).unwrap_err();
        assert!(matches!(e, Error::Zone { .. }), "{e}");
        let mut p = plan(text);
        p.forbidden = Forbidden::LeaveOut;
        let route = p.route(&Rig::default()).unwrap();
        assert_eq!(
            (route.poses.len(), route.left_out),
            (6, 1),
            "five of six and the straight one"
        );
    }

    #[test]
    fn travel_order_is_not_slower_and_keeps_every_pose() {
        let text = "[grid]\nkind = 'random'\ncount = 200\nseed = 5";
        let mut p = plan(text);
        p.straight_through = false;
        let fast = p.route(&Rig::default()).unwrap();
        p.order = Order::AsGiven;
        let slow = p.route(&Rig::default()).unwrap();
        assert!(fast.seconds <= slow.seconds);
        let sort = |mut v: Vec<Pose>| {
            v.sort_by(|a, b| a.angles().partial_cmp(&b.angles()).unwrap());
            v
        };
        assert_eq!(sort(fast.poses), sort(slow.poses));
    }

    #[test]
    fn the_plans_beside_this_crate_can_be_run() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("plans");
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let route = Plan::load(&path).and_then(|p| p.route(&Rig::default()));
            assert!(
                route.is_ok_and(|r| r.poses.len() > 50 && r.left_out == 0),
                "{}",
                path.display()
            );
        }
    }

    #[test]
    fn bad_plans_are_sentences() {
        for text in [
            "",
            "name = 'x'",
            "name = 'x'\n[grid]\nkind = 'spiral'",
            "name = 'x'\n[grid]\nkind = 'list'\nposes = []",
            "name = 'x'\n[grid]\nkind = 'list'\nposes = [[0, 0, nan, 0]]",
            "name = 'x'\n[grid]\nkind = 'klems'\ntheta_l = { from = 0, to = 1, step = 0 }",
            "name = 'x'\n[grid]\nkind = 'random'\ncount = 4000000000\nseed = 1",
            "name = 'x'\ncolour = 1\n[grid]\nkind = 'klems'\ntheta_l = [0]",
            "name = 'x'\n[grid]\nkind = 'klems'\ntheta_l = [0]\n[exposure]\nladder_ms = [4, 2]",
            "name = 'x'\n[grid]\nkind = 'klems'\ntheta_l = [0]\n[calibration]\ndirect = 0",
        ] {
            let e = Plan::from_toml(text)
                .and_then(|p| p.route(&Rig::default()))
                .unwrap_err()
                .to_string();
            assert!(e.ends_with('.') && e.len() > 30, "{e}");
        }
    }
}
