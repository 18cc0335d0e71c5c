//! Errors that all rows of a scan share: its scale, its dark level, offsets of the axes.
//!
//! A scan says them in its comments, `# shared,scale,0.0004`: one standard normal number for the whole file moves every row
//! by so many standard deviations. Noise averages out over thousands of rows, these do not, so error bars that know noise
//! alone are too short. [`crate::whiten`] takes them into the fit.

use super::Points;
use serde::Serialize;
use woven_bsdf::angles::radians;
use woven_bsdf::measured::csv::Scan;
use woven_bsdf::vec3::Vec3;

/// What the rows share.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A factor on every value: direct beam, white standard.
    Scale,
    /// A factor on every scattered value, but not on straight-through rows: the aperture's solid angle.
    SolidAngle,
    /// A dark level: σ/|cosθ_v| on every scattered value, 1/sr.
    Floor,
    /// The light's polar angle, degrees.
    LightTheta,
    /// The light's azimuth, degrees.
    LightPhi,
    /// The detector's polar angle, degrees.
    ViewTheta,
    /// The detector's azimuth, degrees.
    ViewPhi,
}

impl Kind {
    /// All of them.
    pub const ALL: [Kind; 7] = [
        Kind::Scale,
        Kind::SolidAngle,
        Kind::Floor,
        Kind::LightTheta,
        Kind::LightPhi,
        Kind::ViewTheta,
        Kind::ViewPhi,
    ];

    /// Whether it turns an axis.
    pub fn is_axis(self) -> bool {
        !matches!(self, Kind::Scale | Kind::SolidAngle | Kind::Floor)
    }

    /// Its name in a file.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Scale => "scale",
            Kind::SolidAngle => "solid_angle",
            Kind::Floor => "floor",
            Kind::LightTheta => "light_theta_deg",
            Kind::LightPhi => "light_phi_deg",
            Kind::ViewTheta => "view_theta_deg",
            Kind::ViewPhi => "view_phi_deg",
        }
    }
}

/// An error that all rows share.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Shared {
    /// What is shared.
    pub kind: Kind,
    /// Its standard deviation in the kind's unit.
    pub sigma: f64,
}

/// The shared errors that a scan's comments name, and the names that are unknown here.
///
/// # Errors
/// A sentence with the line when a number is not positive or a kind stands twice.
pub fn shared(scan: &Scan) -> anyhow::Result<(Vec<Shared>, Vec<String>)> {
    let (mut known, mut unknown): (Vec<Shared>, _) = (Vec::new(), Vec::new());
    for line in &scan.comments {
        let Some(rest) = line.strip_prefix("shared,") else {
            continue;
        };
        let (name, number) = rest.split_once(',').unwrap_or((rest, ""));
        let name = name.trim();
        let Some(kind) = Kind::ALL.into_iter().find(|k| k.name() == name) else {
            unknown.push(name.to_owned());
            continue;
        };
        match number.trim().parse::<f64>() {
            Ok(sigma) if sigma > 0.0 && sigma.is_finite() => {
                if known.iter().any(|s| s.kind == kind) {
                    anyhow::bail!("\"# {line}\": {name} stands twice; leave one line");
                }
                known.push(Shared { kind, sigma });
            }
            _ => anyhow::bail!(
                "\"# {line}\": the standard deviation must be a number greater than 0"
            ),
        }
    }
    Ok((known, unknown))
}

/// The points as they are when an axis stands `delta_deg` further, and by what their values change through that alone: the
/// reading is a flux, so a view that is off comes with a foreshortening that is off.
///
/// Rows so near the horizon that they would cross it stay.
pub(crate) fn shifted(points: &Points, kind: Kind, delta_deg: f64) -> (Points, Vec<f64>) {
    let mut out = points.clone();
    let delta = radians(delta_deg);
    let mut factors = vec![1.0; points.points.len()];
    for (p, factor) in out.points.iter_mut().zip(&mut factors) {
        let of_light = matches!(kind, Kind::LightTheta | Kind::LightPhi);
        let centre = if of_light { p.l } else { p.v };
        if (!of_light && p.direct_only) || centre.z.abs() < 2.0 * delta.abs() {
            continue;
        }
        let axis = match kind {
            Kind::LightTheta | Kind::ViewTheta => {
                let (_, phi) = centre.to_angles();
                Vec3::new(-phi.sin(), phi.cos(), 0.0)
            }
            _ => Vec3::new(0.0, 0.0, 1.0),
        };
        let turned = turn(centre, axis, delta);
        for node in &mut out.nodes[p.nodes.0..p.nodes.1] {
            let w = if of_light { &mut node.l } else { &mut node.v };
            *w = turn(*w, axis, delta);
        }
        if of_light {
            p.l = turned;
        } else {
            *factor = turned.z.abs() / centre.z.abs();
            p.v = turned;
        }
    }
    (out, factors)
}

/// `w` turned by `angle` about the unit vector `axis` (Rodrigues).
fn turn(w: Vec3<f64>, axis: Vec3<f64>, angle: f64) -> Vec3<f64> {
    let (sin, cos) = angle.sin_cos();
    let cross = Vec3::new(
        axis.y * w.z - axis.z * w.y,
        axis.z * w.x - axis.x * w.z,
        axis.x * w.y - axis.y * w.x,
    );
    w * cos + cross * sin + axis * (axis.dot(w) * (1.0 - cos))
}

#[cfg(test)]
mod tests {
    use super::super::{Detail, Measurement};
    use super::*;

    fn scan(comments: &str) -> Scan {
        let text = format!(
            "{comments}theta_l_deg,phi_l_deg,theta_v_deg,phi_v_deg,f,sigma\n30,180,150,45,0.1,\n30,180,170,-90,0.2,\n"
        );
        Scan::parse(&text).unwrap()
    }

    #[test]
    fn lines_are_read_or_refused_in_words() {
        let (known, unknown) = shared(&scan(
            "# shared,scale,4e-4\n# shared,solid_angle,0.01\n# shared,view_phi_deg, 0.06\n# shared,dust,1\n",
        ))
        .unwrap();
        let want = [
            (Kind::Scale, 4e-4),
            (Kind::SolidAngle, 0.01),
            (Kind::ViewPhi, 0.06),
        ]
        .map(|(kind, sigma)| Shared { kind, sigma });
        assert_eq!((known, unknown), (want.to_vec(), vec!["dust".to_owned()]));
        for bad in [
            "# shared,scale,0\n",
            "# shared,scale,-1\n",
            "# shared,scale,nan\n",
            "# shared,scale\n",
            "# shared,scale,1e-3\n# shared,scale,2e-3\n",
        ] {
            let error = shared(&scan(bad)).unwrap_err().to_string();
            assert!(error.contains("shared,scale"), "{error}");
        }
    }

    #[test]
    fn a_shifted_axis_is_the_same_as_other_angles() {
        let data = Measurement::from_scan("made", scan("# aperture_deg,1\n"));
        let points = data.points(true, Detail::Full, false);
        for (kind, light, view) in [
            (
                Kind::LightTheta,
                [30.5, 180.0],
                [[150.0, 45.0], [170.0, -90.0]],
            ),
            (
                Kind::LightPhi,
                [30.0, 180.5],
                [[150.0, 45.0], [170.0, -90.0]],
            ),
            (
                Kind::ViewTheta,
                [30.0, 180.0],
                [[150.5, 45.0], [170.5, -90.0]],
            ),
            (
                Kind::ViewPhi,
                [30.0, 180.0],
                [[150.0, 45.5], [170.0, -89.5]],
            ),
        ] {
            let (moved, factors) = shifted(&points, kind, 0.5);
            for (i, p) in moved.points.iter().enumerate() {
                let at = |a: [f64; 2]| Vec3::from_angles(radians(a[0]), radians(a[1]));
                let off = |a: Vec3<f64>, b: Vec3<f64>| (a + -b).length_sqr().sqrt();
                assert!(off(p.l, at(light)) < 1e-12, "{kind:?} {i}");
                assert!(off(p.v, at(view[i])) < 1e-12, "{kind:?} {i}");
                // The kernel goes along as one: its first node is the centre.
                assert!(off(moved.nodes[p.nodes.0].v, p.v) < 1e-12, "{kind:?} {i}");
                let want = (p.v.z / points.points[i].v.z).abs();
                assert!((factors[i] - want).abs() < 1e-12, "{kind:?} {i}");
            }
        }
    }
}
