//! A measurement beside the model: its values in a plane of incidence, and what it transmits.

use std::path::Path;

use woven_bsdf::measured::Refused;
use woven_bsdf::measured::csv::Scan;
use woven_bsdf::measured::klems::{Kind, Klems, Patch};
use woven_bsdf::vec3::Vec3;

use crate::polar::Plane;

/// How far out of the plane of incidence a reading may lie [rad]: 1.5°.
const OUT_OF_PLANE: f64 = 0.026;
/// How far from the wanted incidence a reading may lie [rad]: 3°.
const OFF_INCIDENCE: f64 = 0.053;

/// A measurement file.
#[derive(Clone, Debug)]
pub enum Measurement {
    /// A Klems matrix.
    Klems(Klems),
    /// A scan of directions.
    Scan(Scan, String),
}

/// One measured value in the plane of incidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Angle within the plane, see [`Plane::direction`] [rad].
    pub psi: f64,
    /// BSDF [1/sr].
    pub f: f64,
    /// The patch that contains the straight-through light: its value is an average over lobe and gap.
    pub straight: bool,
}

/// What the measurement says near one plane of incidence.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Slice {
    /// The incidence really measured that is nearest to the wanted one; readings are for this one.
    pub plane: Option<Plane>,
    /// The values, by rising angle.
    pub readings: Vec<Reading>,
    /// Share of the light that passes, gap included, where the file has the whole hemisphere.
    pub transmittance: Option<f64>,
    /// Share of the light that passes straight through, where the file has it apart.
    pub direct: Option<f64>,
}

impl Measurement {
    /// Reads a Klems XML or a CSV.
    ///
    /// # Errors
    /// A sentence with the file and the place.
    pub fn open(path: &Path) -> Result<Self, Refused> {
        let name = path
            .file_stem()
            .map(|n| n.to_string_lossy().into_owned())
            .unwrap_or_default();
        match path
            .extension()
            .and_then(|e| e.to_str())
            .map(str::to_ascii_lowercase)
            .as_deref()
        {
            Some("xml") => Ok(Self::Klems(Klems::read(path)?)),
            Some("csv") => Ok(Self::Scan(Scan::read(path)?, name)),
            _ => Err(Refused::new(format!(
                "{}: a measurement is a Klems .xml or a .csv of the rig",
                path.display()
            ))),
        }
    }

    /// The name of what was measured.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Klems(k) => &k.name,
            Self::Scan(_, name) => name,
        }
    }

    /// The readings near a plane of incidence with the light in front.
    #[must_use]
    pub fn slice(&self, plane: Plane) -> Slice {
        let mut slice = match self {
            Self::Klems(k) => klems_slice(k, plane),
            Self::Scan(s, _) => scan_slice(s, plane),
        };
        slice.readings.retain(|r| r.f.is_finite());
        slice.readings.sort_by(|a, b| a.psi.total_cmp(&b.psi));
        slice
    }
}

/// The angle between two unit vectors [rad].
fn apart(a: Vec3<f64>, b: Vec3<f64>) -> f64 {
    a.dot(b).clamp(-1.0, 1.0).acos()
}

/// The plane of a light in front of the sheet; at normal incidence the azimuth is that of `wanted`.
fn plane_of(l: Vec3<f64>, wanted: Plane) -> Plane {
    let (theta, phi) = l.to_angles();
    if theta < 1e-9 {
        Plane {
            theta: 0.0,
            ..wanted
        }
    } else {
        Plane { theta, phi }
    }
}

fn klems_slice(klems: &Klems, wanted: Plane) -> Slice {
    let Some((incident, _)) = klems
        .patches
        .iter()
        .map(|p| {
            apart(
                Kind::TransmissionFront.l((p.theta(), p.phi)),
                wanted.light(),
            )
        })
        .enumerate()
        .min_by(|a, b| a.1.total_cmp(&b.1))
    else {
        return Slice::default();
    };
    let centre = |p: &Patch| (p.theta(), p.phi);
    let plane = plane_of(
        Kind::TransmissionFront.l(centre(&klems.patches[incident])),
        wanted,
    );
    let mut slice = Slice {
        plane: Some(plane),
        ..Slice::default()
    };
    let n = klems.patches.len();
    for kind in [Kind::TransmissionFront, Kind::ReflectionFront] {
        // The first block of a kind is the visible one in these files; a later band is another wavelength.
        let visible =
            |b: &&woven_bsdf::measured::klems::Block| b.kind == kind && b.band == "Visible";
        let Some(block) = klems
            .blocks
            .iter()
            .find(visible)
            .or_else(|| klems.blocks.iter().find(|b| b.kind == kind))
        else {
            continue;
        };
        let mut passed = 0.0;
        for (row, patch) in klems.patches.iter().enumerate() {
            let f = block.values[row * n + incident];
            passed += f * patch.projected_solid_angle();
            let (psi, _) = plane.angles(kind.v(centre(patch)));
            // In the plane if the plane's azimuth, on either side, lies within the patch.
            let off = (patch.phi - plane.phi).rem_euclid(std::f64::consts::PI);
            let inside = off.min(std::f64::consts::PI - off) <= patch.phi_width * 0.5 + 1e-9;
            if inside || patch.theta_lo == 0.0 {
                slice.readings.push(Reading {
                    psi,
                    f,
                    straight: kind.transmits() && row == incident,
                });
            }
        }
        if kind.transmits() {
            slice.transmittance = Some(passed);
        }
    }
    slice
}

fn scan_slice(scan: &Scan, wanted: Plane) -> Slice {
    let lights = scan
        .samples
        .iter()
        .map(|s| s.l)
        .chain(scan.direct.iter().map(|d| d.l))
        .filter(|l| l.z > 0.0);
    let Some(l) =
        lights.min_by(|a, b| apart(*a, wanted.light()).total_cmp(&apart(*b, wanted.light())))
    else {
        return Slice::default();
    };
    let plane = plane_of(l, wanted);
    let near = |other: Vec3<f64>| apart(other, l) < OFF_INCIDENCE;
    let readings = scan
        .samples
        .iter()
        .filter(|s| near(s.l))
        .map(|s| (plane.angles(s.v), s.f))
        .filter(|((_, out), _)| out.abs() < OUT_OF_PLANE)
        .map(|((psi, _), f)| Reading {
            psi,
            f,
            straight: false,
        })
        .collect();
    let direct = scan
        .direct
        .iter()
        .find(|d| near(d.l))
        .map(|d| d.transmittance);
    Slice {
        plane: Some(plane),
        readings,
        transmittance: None,
        direct,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use woven_bsdf::measured::csv::{Direct, Sample};

    fn goniometer() -> Measurement {
        let path = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../assets/measurements/mecho_6216_goniometer.xml"
        );
        Measurement::open(Path::new(path)).expect("the shipped file is sound")
    }

    #[test]
    fn the_goniometer_file_has_its_peak_straight_through() {
        let data = goniometer();
        for degrees in [0.0_f64, 20.0, 40.0] {
            for phi in [0.0, std::f64::consts::FRAC_PI_2] {
                let slice = data.slice(Plane {
                    theta: degrees.to_radians(),
                    phi,
                });
                let plane = slice.plane.expect("it has patches");
                assert!(
                    (plane.theta - degrees.to_radians()).abs() < 0.01,
                    "{degrees}: {}",
                    plane.theta.to_degrees()
                );
                let peak = slice
                    .readings
                    .iter()
                    .filter(|r| r.psi.abs() > 1.58)
                    .max_by(|a, b| a.f.total_cmp(&b.f));
                let peak = peak.expect("there are readings");
                assert!(peak.straight, "{degrees}: {peak:?}");
                assert!(
                    (peak.psi.sin() - plane.straight().sin()).abs() < 1e-6,
                    "{peak:?}"
                );
                assert!(slice.readings.len() > 10, "{}", slice.readings.len());
            }
        }
        // 0.0179 is the file's transmittance at normal incidence as told in the project's notes.
        let normal = data.slice(Plane {
            theta: 0.0,
            phi: 0.0,
        });
        let transmittance = normal.transmittance.expect("it has the hemisphere");
        assert!((transmittance - 0.0179).abs() < 1e-4, "{transmittance}");
    }

    #[test]
    fn a_scan_gives_back_what_lies_in_the_plane() {
        let plane = Plane {
            theta: 0.5,
            phi: 0.0,
        };
        let value = |psi: f64, f: f64| Sample {
            l: plane.light(),
            v: plane.direction(psi),
            f,
            sigma: None,
        };
        let out_of_plane = Sample {
            v: Vec3::from_angles(2.5, 1.0),
            ..value(0.0, 9.0)
        };
        let scan = Scan {
            samples: vec![value(-2.0, 0.25), value(-2.6, 0.5), out_of_plane],
            direct: vec![Direct {
                l: plane.light(),
                transmittance: 0.125,
                sigma: None,
            }],
            comments: Vec::new(),
        };
        let slice = Measurement::Scan(scan, String::new()).slice(Plane {
            theta: 0.48,
            phi: 0.01,
        });
        let values: Vec<_> = slice.readings.iter().map(|r| r.f).collect();
        assert_eq!(values, [0.5, 0.25]);
        assert!((slice.readings[0].psi + 2.6).abs() < 1e-9);
        assert_eq!(slice.direct, Some(0.125));
    }

    #[test]
    fn a_bad_file_is_a_sentence() {
        for name in ["nothing.xml", "nothing.csv", "nothing.doc"] {
            let told = Measurement::open(Path::new(name))
                .expect_err("it is not there")
                .to_string();
            assert!(told.contains(name), "{told}");
        }
    }
}
