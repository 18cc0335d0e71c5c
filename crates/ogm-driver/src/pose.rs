//! A pose of the two arms, the directions it means, and the zone in which the arms would touch.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// Number of axes of the rig: light theta, light phi, view theta, view phi.
pub const AXES: usize = 4;

/// Angles of both arms in degrees: theta is the polar angle from the sample's normal +n, phi the azimuth from weft (x) to warp (y).
/// Transmission has theta_l < 90 and theta_v > 90.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Polar angle of the light arm, degrees.
    pub theta_l: f64,
    /// Azimuth of the light arm, degrees.
    pub phi_l: f64,
    /// Polar angle of the detector arm, degrees.
    pub theta_v: f64,
    /// Azimuth of the detector arm, degrees.
    pub phi_v: f64,
}

impl Pose {
    /// A pose from its four angles in degrees.
    pub const fn new(theta_l: f64, phi_l: f64, theta_v: f64, phi_v: f64) -> Self {
        Pose {
            theta_l,
            phi_l,
            theta_v,
            phi_v,
        }
    }

    /// The angles in the order of the axes.
    pub fn angles(&self) -> [f64; AXES] {
        [self.theta_l, self.phi_l, self.theta_v, self.phi_v]
    }

    /// A pose from angles in the order of the axes.
    pub fn from_angles(a: [f64; AXES]) -> Self {
        Pose::new(a[0], a[1], a[2], a[3])
    }

    /// Unit vector to the light, away from the sample.
    pub fn light(&self) -> [f64; 3] {
        direction(self.theta_l, self.phi_l)
    }

    /// Unit vector to the detector, away from the sample.
    pub fn view(&self) -> [f64; 3] {
        direction(self.theta_v, self.phi_v)
    }

    /// Angle between the two arms, degrees.
    pub fn separation(&self) -> f64 {
        angle_between(self.light(), self.view())
    }

    /// The pose with the detector straight behind the sample as seen from the light.
    pub fn straight_through(theta_l: f64, phi_l: f64) -> Self {
        let phi_v = if phi_l > 0.0 {
            phi_l - 180.0
        } else {
            phi_l + 180.0
        };
        Pose::new(theta_l, phi_l, 180.0 - theta_l, phi_v)
    }

    /// Angle between the view direction and straight through (-l), degrees.
    pub fn from_straight(&self) -> f64 {
        let l = self.light();
        angle_between([-l[0], -l[1], -l[2]], self.view())
    }
}

impl std::fmt::Display for Pose {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "light ({:.3}, {:.3}) view ({:.3}, {:.3}) deg",
            self.theta_l, self.phi_l, self.theta_v, self.phi_v
        )
    }
}

/// Unit vector of polar angle and azimuth in degrees.
pub fn direction(theta_deg: f64, phi_deg: f64) -> [f64; 3] {
    let (st, ct) = theta_deg.to_radians().sin_cos();
    let (sp, cp) = phi_deg.to_radians().sin_cos();
    [st * cp, st * sp, ct]
}

/// Angle between two unit vectors in degrees, exact near 0 and 180.
pub fn angle_between(a: [f64; 3], b: [f64; 3]) -> f64 {
    let d = |s: f64| {
        ((a[0] - s * b[0]).powi(2) + (a[1] - s * b[1]).powi(2) + (a[2] - s * b[2]).powi(2)).sqrt()
    };
    2.0 * d(1.0).atan2(d(-1.0)).to_degrees()
}

/// Whether every pose of the box between `from` and `to` keeps the arms at least `zone` degrees apart. The box is the hull of all ways on which
/// each axis runs monotonically, whatever their speeds. Interval halving with the bound that turning one axis by δ changes the separation by at most δ.
pub fn box_is_clear(from: [f64; AXES], to: [f64; AXES], zone: f64) -> bool {
    let (mut lo, mut hi) = ([0.0; AXES], [0.0; AXES]);
    for i in 0..AXES {
        lo[i] = from[i].min(to[i]);
        hi[i] = from[i].max(to[i]);
    }
    let inside = |a: f64| (0.0..=180.0).contains(&a);
    if inside(lo[0])
        && inside(hi[0])
        && inside(lo[2])
        && inside(hi[2])
        && (lo[2] - hi[0] >= zone || lo[0] - hi[2] >= zone)
    {
        return true; // two directions are never nearer than their polar angles
    }
    let mut todo = vec![(lo, hi)];
    let mut budget = 4096;
    while let Some((lo, hi)) = todo.pop() {
        budget -= 1;
        if budget == 0 {
            return false; // cannot be shown clear: taken as not clear
        }
        let (mut mid, mut reach, mut widest) = ([0.0; AXES], 0.0, 0);
        for i in 0..AXES {
            mid[i] = (lo[i] + hi[i]) / 2.0;
            reach += (hi[i] - lo[i]) / 2.0;
            if hi[i] - lo[i] > hi[widest] - lo[widest] {
                widest = i;
            }
        }
        let here = Pose::from_angles(mid).separation();
        if here < zone {
            return false;
        }
        if here - reach >= zone {
            continue;
        }
        if hi[widest] - lo[widest] < 0.01 {
            return false;
        }
        let (mut left, mut right) = (hi, lo);
        left[widest] = mid[widest];
        right[widest] = mid[widest];
        todo.push((lo, left));
        todo.push((right, hi));
    }
    true
}

/// A way from one pose to another that keeps out of the zone: the corners to visit, the last being `to`. All axes at once when that is safe,
/// else one axis after the other in the first safe order, else by way of one of the `detours`, each a (theta, phi) of the detector arm where NaN
/// means "stay".
///
/// # Errors
/// [`Error::Zone`] when the target itself or every known way lies in the zone.
pub fn safe_way(
    from: [f64; AXES],
    to: [f64; AXES],
    zone: f64,
    detours: &[(f64, f64)],
) -> Result<Vec<[f64; AXES]>> {
    let target = Pose::from_angles(to);
    if target.separation() < zone {
        return Err(Error::Zone {
            what: format!("The pose {target}"),
            least: target.separation(),
            zone,
        });
    }
    if box_is_clear(from, to, zone) {
        return Ok(vec![to]);
    }
    if let Some(way) = one_by_one(from, to, zone) {
        return Ok(way);
    }
    for &(theta, phi) in detours {
        let via = |mut p: [f64; AXES]| {
            p[2] = if theta.is_nan() { p[2] } else { theta };
            p[3] = if phi.is_nan() { p[3] } else { phi };
            p
        };
        let (a, b) = (via(from), via(to));
        let legs = [(from, a), (a, b), (b, to)].map(|(p, q)| one_by_one(p, q, zone));
        if let [Some(first), Some(second), Some(third)] = legs {
            return Ok([first, second, third].concat());
        }
    }
    Err(Error::Zone {
        what: format!(
            "Every way known from {} to {target}",
            Pose::from_angles(from)
        ),
        least: 0.0,
        zone,
    })
}

fn one_by_one(from: [f64; AXES], to: [f64; AXES], zone: f64) -> Option<Vec<[f64; AXES]>> {
    const ORDERS: [[usize; AXES]; 8] = [
        [2, 3, 0, 1],
        [3, 2, 0, 1],
        [0, 1, 2, 3],
        [1, 0, 3, 2],
        [2, 0, 3, 1],
        [0, 2, 1, 3],
        [3, 1, 2, 0],
        [1, 3, 0, 2],
    ];
    ORDERS.iter().find_map(|order| {
        let (mut here, mut way) = (from, Vec::new());
        for &axis in order {
            if here[axis] == to[axis] {
                continue;
            }
            let mut next = here;
            next[axis] = to[axis];
            if !box_is_clear(here, next, zone) {
                return None;
            }
            way.push(next);
            here = next;
        }
        Some(way)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_and_separations() {
        let p = Pose::new(30.0, 0.0, 150.0, 180.0);
        assert!((p.separation() - 180.0).abs() < 1e-9 && p.from_straight() < 1e-9);
        assert_eq!(Pose::straight_through(30.0, 0.0), p);
        assert!((Pose::new(10.0, 0.0, 10.0, 180.0).separation() - 20.0).abs() < 1e-9);
        assert!(Pose::straight_through(40.0, 90.0).from_straight() < 1e-9);
    }

    #[test]
    fn a_swing_through_the_light_is_seen() {
        let (a, b) = ([40.0, 0.0, 20.0, 0.0], [40.0, 0.0, 60.0, 0.0]);
        assert!(!box_is_clear(a, b, 8.0));
        assert!(box_is_clear(
            [40.0, 0.0, 50.0, 0.0],
            [40.0, 0.0, 60.0, 0.0],
            8.0
        ));
    }

    #[test]
    fn the_way_around_is_found_and_each_leg_is_clear() {
        let (a, b) = ([40.0, 0.0, 20.0, 0.0], [40.0, 0.0, 60.0, 0.0]);
        let way = safe_way(a, b, 8.0, &[]).unwrap_err();
        assert!(way.to_string().contains("nothing was moved"));
        let way = safe_way(a, b, 8.0, &[(f64::NAN, 90.0)]).unwrap();
        let mut here = a;
        for leg in &way {
            for k in 0..=1000 {
                let t = f64::from(k) / 1000.0;
                let p: Vec<f64> = (0..AXES)
                    .map(|i| here[i] + t * (leg[i] - here[i]))
                    .collect();
                assert!(Pose::new(p[0], p[1], p[2], p[3]).separation() >= 8.0);
            }
            here = *leg;
        }
        assert_eq!(here, b);
    }

    #[test]
    fn a_target_inside_the_zone_is_refused() {
        let e = safe_way([0.0, 0.0, 180.0, 0.0], [40.0, 10.0, 42.0, 10.0], 8.0, &[]).unwrap_err();
        assert!(matches!(e, Error::Zone { .. }), "{e}");
    }
}
