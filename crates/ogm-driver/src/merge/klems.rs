//! A measurement as a Klems matrix: the XML that WINDOW, Radiance and the project's own reader take.
//!
//! Row = outgoing patch, column = incident patch; a patch is named by the way the light travels, so the incident patch (θ, φ) has its light at
//! (θ, φ + 180°). The straight-through beam is spread over its patch: T divided by the patch's projected solid angle.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::Measurement;
use super::export::{beside, write_whole};
use crate::error::{Error, Result};
use crate::klems::{Patch, centre, patches};
use woven_bsdf::measured::klems_write::RINGS;

/// A direction as whole numbers.
type Key = (i64, i64);

/// Directions as whole hundredths of a degree, so that rounding to pulses does not matter; azimuth 0 at the pole.
fn key(theta: f64, phi: f64) -> Key {
    let theta_key = (theta * 100.0).round() as i64;
    let pole = theta_key == 0 || theta_key == 18_000;
    let phi_key = if pole {
        0
    } else {
        ((phi * 10.0).round() as i64).rem_euclid(3600)
    };
    (theta_key, phi_key)
}

impl Measurement {
    /// The transmission matrix, 145 × 145 values in 1/sr with their standard errors, row by row.
    ///
    /// # Errors
    /// [`Error::Merge`] telling how many of the pairs were measured when it is not all of them.
    pub fn klems_matrix(&self) -> Result<Vec<(f64, f64)>> {
        let mut known: BTreeMap<(Key, Key), (f64, f64)> = BTreeMap::new();
        for s in &self.samples {
            let p = &s.pose;
            let directions = (key(p.theta_l, p.phi_l), key(p.theta_v, p.phi_v));
            known.insert(directions, (s.f, s.sigma));
        }
        let mut straight = BTreeMap::new();
        for d in &self.direct {
            straight.insert(key(d.pose.theta_l, d.pose.phi_l), d);
        }
        let all: Vec<Patch> = patches().collect();
        let (mut values, mut missing) = (Vec::with_capacity(all.len() * all.len()), 0);
        for (o, outgoing) in all.iter().enumerate() {
            for (i, incident) in all.iter().enumerate() {
                let light = key(incident.theta, incident.phi + 180.0);
                let view = key(180.0 - outgoing.theta, outgoing.phi);
                let value = if i == o {
                    straight.get(&light).map(|d| {
                        let spread = |x: f64| x / incident.projected;
                        (spread(d.transmittance) + d.scattered, spread(d.sigma))
                    })
                } else {
                    known.get(&(light, view)).copied()
                };
                missing += usize::from(value.is_none());
                values.push(value.unwrap_or_default());
            }
        }
        if missing > 0 {
            let pairs = all.len() * all.len();
            return Err(Error::Merge(format!(
                "A Klems matrix needs all {pairs} pairs of patches, this scan has {}; measure with grid kind = \"klems\" and all_incidences = true, or write .csv.",
                pairs - missing
            )));
        }
        Ok(values)
    }

    /// Writes the Klems XML (front transmission, one band), and beside it `NAME_sigma.xml` with the standard errors in the same places.
    /// Returns both files.
    ///
    /// # Errors
    /// [`Error::Merge`] when pairs are missing, [`Error::Io`].
    pub fn write_klems(&self, path: &Path) -> Result<[PathBuf; 2]> {
        let values = self.klems_matrix()?;
        let beside = beside(path, "_sigma");
        write_whole(
            path,
            self.klems_xml(path, values.iter().map(|v| v.0)).as_bytes(),
        )?;
        write_whole(
            &beside,
            self.klems_xml(&beside, values.iter().map(|v| v.1))
                .as_bytes(),
        )?;
        Ok([path.into(), beside])
    }

    fn klems_xml(&self, path: &Path, values: impl Iterator<Item = f64>) -> String {
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        let escape = |s: &str| {
            s.replace('&', "&amp;")
                .replace('<', "&lt;")
                .replace('>', "&gt;")
                .replace("--", "- -")
        };
        let mut x = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
        for c in &self.comments {
            // A string takes everything that is written to it.
            let _ = writeln!(x, "<!-- {} -->", escape(c));
        }
        let _ = write!(
            x,
            "<WindowElement xmlns=\"http://windows.lbl.gov\">\n<WindowElementType>System</WindowElementType>\n<Optical><Layer>\n\
             <Material><Name>{}</Name><Manufacturer></Manufacturer><DeviceType>Other</DeviceType></Material>\n\
             <DataDefinition><IncidentDataStructure>Columns</IncidentDataStructure><AngleBasis>\n\
             <AngleBasisName>LBNL/Klems Full</AngleBasisName>\n",
            escape(&name)
        );
        for (low, high, count) in RINGS {
            let theta = centre(low, high);
            let _ = writeln!(
                x,
                "<AngleBasisBlock><Theta>{theta}</Theta><nPhis>{count}</nPhis><ThetaBounds><LowerTheta>{low}</LowerTheta><UpperTheta>{high}</UpperTheta></ThetaBounds></AngleBasisBlock>"
            );
        }
        x.push_str(
            "</AngleBasis></DataDefinition>\n<WavelengthData><LayerNumber>System</LayerNumber><Wavelength unit=\"Integral\">Visible</Wavelength>\n\
             <WavelengthDataBlock><WavelengthDataDirection>Transmission Front</WavelengthDataDirection>\
             <ColumnAngleBasis>LBNL/Klems Full</ColumnAngleBasis><RowAngleBasis>LBNL/Klems Full</RowAngleBasis>\
             <ScatteringDataType>BTDF</ScatteringDataType><ScatteringData>\n",
        );
        let n = patches().count();
        for (at, value) in values.enumerate() {
            let end = if (at + 1) % n == 0 { ",\n" } else { ", " };
            let _ = write!(x, "{value:.6e}{end}");
        }
        x.push_str("</ScatteringData></WavelengthDataBlock></WavelengthData>\n</Layer></Optical></WindowElement>\n");
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::merge::{Straight, Value};
    use crate::plan::Plan;
    use crate::pose::Pose;
    use woven_bsdf::measured::klems::{Kind, Klems};

    fn f(l: [f64; 3], v: [f64; 3]) -> f64 {
        // Not symmetric in anything, so that a swapped row or a turned azimuth shows.
        1.0 + 0.3 * l[0] + 0.2 * l[1] - 0.5 * v[0] + 0.7 * v[1] + 0.1 * v[2]
    }

    /// What a scan of the whole grid would give.
    fn whole() -> Measurement {
        let plan =
            Plan::from_toml("name = 'k'\n[grid]\nkind = 'klems'\nall_incidences = true").unwrap();
        let mut m = Measurement::default();
        for pose in plan.grid.poses().unwrap() {
            if pose.from_straight() < 0.7 {
                m.direct.push(Straight {
                    pose,
                    transmittance: 0.1,
                    sigma: 0.001,
                    own: 0.001,
                    scattered: 2.0,
                });
            } else {
                m.samples.push(Value {
                    pose,
                    f: f(pose.light(), pose.view()),
                    sigma: 0.01,
                    own: 0.01,
                });
            }
        }
        m
    }

    #[test]
    fn the_matrix_is_read_back_in_the_right_places() {
        let m = whole();
        assert_eq!((m.samples.len(), m.direct.len()), (145 * 144, 145));
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("k.xml");
        let [_, beside] = m.write_klems(&path).unwrap();
        let read = Klems::read(&path).unwrap();
        let errors = Klems::read(&beside).unwrap();
        let error = |o, i| {
            errors.value(
                errors.block("Visible", Kind::TransmissionFront).unwrap(),
                o,
                i,
            )
        };
        let normal = read.patches[0].projected_solid_angle();
        assert!(
            (error(1, 0) - 0.01).abs() < 1e-9 && (error(0, 0) * normal / 0.001 - 1.0).abs() < 1e-5
        );
        let block = read.block("Visible", Kind::TransmissionFront).unwrap();
        for (o, po) in read.patches.iter().enumerate() {
            for (i, pi) in read.patches.iter().enumerate() {
                let value = read.value(block, o, i);
                if o == i {
                    let expected = 0.1 / pi.projected_solid_angle() + 2.0;
                    assert!((value / expected - 1.0).abs() < 1e-5);
                } else {
                    let (l, v) = (
                        Kind::TransmissionFront.l((pi.theta(), pi.phi)),
                        Kind::TransmissionFront.v((po.theta(), po.phi)),
                    );
                    let expected = f([l.x, l.y, l.z], [v.x, v.y, v.z]);
                    // Six decimals in the file.
                    assert!(
                        (value - expected).abs() < 1e-5,
                        "{o} {i}: {value} {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_part_of_the_matrix_is_refused_with_its_count() {
        let mut m = whole();
        m.samples.pop();
        m.samples.push(Value {
            pose: Pose::new(1.0, 2.0, 170.0, 3.0),
            f: 1.0,
            sigma: 1.0,
            own: 1.0,
        });
        let e = m.klems_matrix().unwrap_err().to_string();
        assert!(
            e.contains("all 21025 pairs") && e.contains("has 21024"),
            "{e}"
        );
    }
}
