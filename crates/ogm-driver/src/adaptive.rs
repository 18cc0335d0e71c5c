//! More poses where the light changes fast: intervals of a plane are halved until a straight line between neighbours is good enough.
//!
//! What is chosen follows from the readings in the log alone, so a resumed scan goes the same way.

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::log::{Reading, What};
use crate::merge::{Value, merge_readings};
use crate::plan::{Angles, Grid, Plan, product, refused, zero};
use crate::pose::Pose;
use crate::rig::Rig;

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
        product([tl.len(), pl.len(), planes.len()])?;
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
    ///
    /// # Errors
    /// [`Error::Plan`](crate::error::Error::Plan) for numbers that make no grid.
    pub(crate) fn first(&self) -> Result<Vec<Pose>> {
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
        let planes = self.planes()?;
        product([planes.len(), 2 * n as usize + 9])?;
        let mut out = Vec::new();
        for (theta_l, phi_l, plane) in planes {
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

/// The poses that an adaptive plan wants next, given the readings so far; none when it is content, or not adaptive.
///
/// # Errors
/// Those of merging the readings.
pub fn refine(plan: &Plan, rig: &Rig, readings: &[Reading], poses: &[Pose]) -> Result<Vec<Pose>> {
    let Grid::Adaptive(a) = &plan.grid else {
        return Ok(Vec::new());
    };
    if poses.len() >= a.most as usize {
        return Ok(Vec::new());
    }
    // Up to the last of these poses: what was read later must not change a choice that was made before it.
    let of_these = |r: &Reading| r.what == What::Sample && r.index < poses.len();
    let end = readings.iter().rposition(of_these).map_or(0, |i| i + 1);
    let all: Vec<&Reading> = readings[..end].iter().collect();
    let merged = merge_readings(&all, plan, rig)?;
    let mut out = Vec::new();
    for (theta_l, phi_l, plane) in a.planes()? {
        let mut line: Vec<(f64, f64)> = merged
            .samples
            .iter()
            .filter_map(|v| Some((on_plane(v, theta_l, phi_l, plane)?, v.f)))
            .collect();
        line.sort_by(|p, q| p.0.total_cmp(&q.0));
        line.dedup_by(|p, q| (p.0 - q.0).abs() < 1e-3);
        let blind = rig.detector.blind_deg();
        for (t, need) in halve(&line, a, straight_at(theta_l, phi_l, plane), blind) {
            let pose = Adaptive::pose(theta_l, phi_l, plane, t);
            let mut known = poses.iter().chain(out.iter().map(|(_, p)| p));
            if !known.any(|p| same(p, &pose)) && rig.pulses(pose).is_ok() {
                out.push((need, pose));
            }
        }
    }
    // Where not all may be taken, those that are needed most; then again in the order of the planes.
    let room = a.most as usize - poses.len();
    if out.len() > room {
        let mut needs: Vec<f64> = out.iter().map(|(need, _)| *need).collect();
        needs.sort_by(|p, q| q.total_cmp(p));
        let least = needs[room];
        out.retain(|(need, _)| *need > least);
    }
    Ok(out.into_iter().map(|(_, pose)| pose).collect())
}

fn same(a: &Pose, b: &Pose) -> bool {
    a.angles()
        .iter()
        .zip(b.angles())
        .all(|(x, y)| (x - y).abs() < 1e-4)
}

/// The signed angle of a value on a plane, degrees from straight behind; `None` when it belongs elsewhere.
fn on_plane(v: &Value, theta_l: f64, phi_l: f64, plane: f64) -> Option<f64> {
    let p = &v.pose;
    // Poses are rounded to pulses: a hundredth of a degree is well above that.
    if (p.theta_l - theta_l).abs() > 0.01 || (p.phi_l - phi_l).abs() > 0.01 || p.theta_v < 90.0 {
        return None;
    }
    let turn = (p.phi_v - plane).rem_euclid(360.0);
    let t = 180.0 - p.theta_v;
    if t < 0.01 || !(0.01..=359.99).contains(&turn) {
        Some(t)
    } else if (turn - 180.0).abs() < 0.01 {
        Some(-t)
    } else {
        None
    }
}

/// Where the straight-through direction lies on a plane, if it does.
fn straight_at(theta_l: f64, phi_l: f64, plane: f64) -> Option<f64> {
    let turn = (phi_l + 180.0 - plane).rem_euclid(360.0);
    if theta_l.abs() < 0.01 || !(0.01..=359.99).contains(&turn) {
        Some(theta_l)
    } else {
        ((turn - 180.0).abs() < 0.01).then_some(-theta_l)
    }
}

/// Middles of the intervals where a straight line is not good enough, each with how much it is needed (over 1): the line's middle is compared with
/// that of a cubic through the four nearest points.
fn halve(line: &[(f64, f64)], a: &Adaptive, straight: Option<f64>, blind: f64) -> Vec<(f64, f64)> {
    let mut out = Vec::new();
    if line.len() < 4 {
        return out;
    }
    let peak = line.iter().map(|p| p.1).fold(0.0, f64::max);
    let floor = line
        .iter()
        .map(|p| p.1)
        .fold(f64::INFINITY, f64::min)
        .max(0.0);
    let fwhm = width_at_half(line, 0.5 * (peak + floor));
    for i in 0..line.len() - 1 {
        let ((t0, f0), (t1, f1)) = (line[i], line[i + 1]);
        let h = t1 - t0;
        let middle = 0.5 * (t0 + t1);
        if h < 2.0 * a.least_step {
            continue;
        }
        if let Some(s) = straight.filter(|s| (middle - s).abs() < blind) {
            // The straight beam hides the middle: as near to it as can be seen, on both sides.
            let beside = [s - 1.3 * blind, s + 1.3 * blind].map(|t| (t * 1000.0).round() / 1000.0);
            let inside = beside
                .into_iter()
                .filter(|t| *t > t0 + 0.01 && *t < t1 - 0.01);
            out.extend(inside.map(|t| (t, f64::MAX)));
            continue;
        }
        let first = i.saturating_sub(1).min(line.len() - 4);
        let cubic = lagrange(&line[first..first + 4], middle);
        let linear = 0.5 * (f0 + f1);
        let bent = (cubic - linear).abs() / (a.tolerance * (linear + 0.02 * peak));
        let coarse = if f0.max(f1) > 0.5 * (peak + floor) {
            h * f64::from(a.per_fwhm) / fwhm
        } else {
            0.0
        };
        let need = bent.max(coarse);
        if need > 1.0 {
            // On the pulse grid of any stage: thousandths of a degree.
            out.push(((middle * 1000.0).round() / 1000.0, need));
        }
    }
    out
}

fn width_at_half(line: &[(f64, f64)], half: f64) -> f64 {
    let cross = |a: (f64, f64), b: (f64, f64)| a.0 + (half - a.1) / (b.1 - a.1) * (b.0 - a.0);
    let over: Vec<usize> = (0..line.len()).filter(|&i| line[i].1 > half).collect();
    let (Some(&first), Some(&last)) = (over.first(), over.last()) else {
        return 180.0;
    };
    let low = if first > 0 {
        cross(line[first - 1], line[first])
    } else {
        line[first].0
    };
    let high = if last + 1 < line.len() {
        cross(line[last + 1], line[last])
    } else {
        line[last].0
    };
    (high - low).max(1e-3)
}

fn lagrange(points: &[(f64, f64)], t: f64) -> f64 {
    let term = |i: usize| {
        let others = points.iter().enumerate().filter(|(j, _)| *j != i);
        others
            .map(|(_, p)| (t - p.0) / (points[i].0 - p.0))
            .product::<f64>()
            * points[i].1
    };
    (0..points.len()).map(term).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_line_is_left_alone_and_a_peak_is_followed() {
        let a = Adaptive::default();
        let flat: Vec<(f64, f64)> = (-10..=10)
            .map(|k| (f64::from(k) * 8.0, 1.0 + 0.001 * f64::from(k)))
            .collect();
        assert!(
            halve(
                &flat,
                &Adaptive {
                    per_fwhm: 0,
                    ..a.clone()
                },
                None,
                0.0
            )
            .is_empty()
        );
        let f = |t: f64| (-(t * t) / 2.0).exp() + 0.05; // FWHM 2.35°
        let mut line: Vec<(f64, f64)> = (-10..=10)
            .map(|k| (f64::from(k) * 8.0, f(f64::from(k) * 8.0)))
            .collect();
        for _ in 0..12 {
            let more = halve(&line, &a, None, 0.0);
            line.extend(more.into_iter().map(|(t, _)| (t, f(t))));
            line.sort_by(|p, q| p.0.total_cmp(&q.0));
        }
        let inside = line.iter().filter(|p| p.0.abs() < 1.177).count();
        assert!(inside >= 5 && line.len() < 80, "{inside} of {}", line.len());
        let flux: f64 = line
            .windows(2)
            .map(|w| 0.5 * (w[0].1 + w[1].1) * (w[1].0 - w[0].0))
            .sum();
        let exact = std::f64::consts::TAU.sqrt() + 0.05 * 160.0;
        assert!((flux / exact - 1.0).abs() < 0.01, "{flux} {exact}");
    }
}
