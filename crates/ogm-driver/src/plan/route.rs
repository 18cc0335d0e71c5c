//! A plan on a rig: which poses may be taken, in which order, and what they cost in time.

use super::{Forbidden, Order, Plan, refused};
use crate::error::Result;
use crate::pose::{AXES, Pose};
use crate::rig::Rig;

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
    /// The poses that the rig may take, in the order of the scan, with the time they cost.
    ///
    /// # Errors
    /// [`Error::Limit`] or [`Error::Zone`] for the first forbidden pose (with `forbidden = "refuse"`), [`Error::Plan`].
    pub fn route(&self, rig: &Rig) -> Result<Route> {
        let mut poses = self.grid.poses()?;
        let mut left_out = 0;
        if self.forbidden == Forbidden::LeaveOut {
            let before = poses.len();
            poses.retain(|p| rig.pulses(*p).is_ok());
            left_out = before - poses.len();
        }
        if self.straight_through {
            let lights: Vec<(f64, f64)> = poses.iter().map(|p| (p.theta_l, p.phi_l)).collect();
            let mut seen: Vec<(f64, f64)> = Vec::new();
            for (theta_l, phi_l) in lights {
                if seen.contains(&(theta_l, phi_l)) || seen.len() >= 10_000 {
                    continue;
                }
                seen.push((theta_l, phi_l));
                let straight = Pose::straight_through(theta_l, phi_l);
                let same = |q: &Pose| q.light() == straight.light() && q.from_straight() < 1e-6;
                if poses.iter().any(same) {
                    continue;
                }
                if self.forbidden == Forbidden::Refuse || rig.pulses(straight).is_ok() {
                    poses.push(straight);
                } else {
                    left_out += 1;
                }
            }
        }
        if poses.is_empty() {
            return Err(refused(format!(
                "all of its {left_out} poses lie outside the limits or in the zone of the arms"
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
    use crate::error::Error;

    fn plan(grid: &str) -> Plan {
        Plan::from_toml(&format!("name = 't'\n{grid}")).unwrap()
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
}
