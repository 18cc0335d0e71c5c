//! Mechanics of a fabric in SI units, and a table of twelve curtain fabrics from voile to blackout.
//!
//! Sources. Bending: medians per weight class of 618 fabrics measured with the method of Feng et al. 2022 (DrapeTester,
//! SIGGRAPH Asia), rounded; the median bending length c = (B / (w g))^(1/3) lies between 16 and 21 mm whatever the weight.
//! Areal density, tensile and shear: the ranges usual for woven curtain cloth in Kawabata (KES-F) units, 1 gf/(cm deg) =
//! 56.2 N/m per radian. A row whose `measured` is false is an estimate within these ranges, not a measurement of one cloth.

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// Acceleration of gravity, m/s².
pub const GRAVITY: f64 = 9.81;

/// Mechanical properties of a fabric per unit width, in SI units.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Mechanics {
    /// Mass per area, kg/m².
    pub areal_density: f64,
    /// Tensile stiffness along the warp, N/m (force per width per strain) at small loads.
    pub tensile_warp: f64,
    /// Tensile stiffness along the weft, N/m.
    pub tensile_weft: f64,
    /// Stiffening of the tensile law: the tangent stiffness grows by this factor per unit of strain (1). Woven cloth is
    /// softer at small loads because crimp straightens first; 0 is a straight line.
    pub tensile_stiffening: f64,
    /// Shear stiffness, N/m per radian. KES G of 1 gf/(cm deg) is 56.2.
    pub shear: f64,
    /// Bending stiffness along the warp, N·m (per width: N·m²/m). KES B of 1 gf·cm²/cm is 98.07e-6.
    pub bending_warp: f64,
    /// Bending stiffness along the weft, N·m.
    pub bending_weft: f64,
    /// Bending length along the warp, mm (Peirce, ASTM D1388); when given it replaces `bending_warp`.
    pub bending_length_warp_mm: Option<f64>,
    /// Bending length along the weft, mm; when given it replaces `bending_weft`.
    pub bending_length_weft_mm: Option<f64>,
    /// Friction of bending, N (moment per width): half of Kawabata's 2HB; 2HB of 1 gf·cm/cm is 9.807e-3. 0 leaves it out.
    pub bending_hysteresis: f64,
    /// Friction of shear, N/m: half of Kawabata's 2HG; 2HG of 1 gf/cm is 0.9807. 0 leaves it out.
    pub shear_hysteresis: f64,
    /// Retardation time of the threads' stretch, s: stress = Y (strain + time × strain rate).
    pub stretch_damping: f64,
    /// Retardation time of shear and of bending, s. Acts on the rate of deformation, so it does not slow a fall.
    pub bending_damping: f64,
    /// Thickness, m; the distance that self-contact keeps at least.
    pub thickness: f64,
    /// Share of the area that is open (0 to below 1); lowers the air drag above about 0.6.
    pub openness: f64,
    /// Yarn diameter, m; sets the Reynolds number of the drag of the open weave.
    pub yarn_diameter: f64,
}

impl Default for Mechanics {
    fn default() -> Self {
        FABRICS[3].mechanics()
    }
}

/// One row of the table of fabrics.
#[derive(Clone, Copy, Debug)]
pub struct Fabric {
    /// Name used by `fabric = "..."` in a curtain's description.
    pub name: &'static str,
    /// What a shop would call it.
    pub about: &'static str,
    /// Mass per area, g/m².
    pub grams: f64,
    /// Tensile stiffness warp and weft, N/m.
    pub tensile: [f64; 2],
    /// Shear stiffness, N/m per radian.
    pub shear: f64,
    /// Bending length warp and weft, mm.
    pub bending_length: [f64; 2],
    /// Thickness, mm.
    pub thickness_mm: f64,
    /// Open share of the area.
    pub openness: f64,
    /// Yarn diameter, mm.
    pub yarn_mm: f64,
    /// Where the numbers come from.
    pub source: &'static str,
}

const CLASS: &str = "bending: class median of DrapeTester 2022; the rest estimated within KES-F ranges of woven curtain cloth";

#[rustfmt::skip]
/// The built-in fabrics, light to heavy.
pub const FABRICS: &[Fabric] = &[
    Fabric { name: "tulle",     about: "bobbinet tulle, polyester",        grams:  25.0, tensile: [ 800.0,  500.0], shear:  8.0, bending_length: [16.5, 13.0], thickness_mm: 0.20, openness: 0.80, yarn_mm: 0.10, source: CLASS },
    Fabric { name: "chiffon",   about: "sheer chiffon",                    grams:  40.0, tensile: [1200.0,  900.0], shear: 17.0, bending_length: [16.5, 14.5], thickness_mm: 0.15, openness: 0.45, yarn_mm: 0.10, source: CLASS },
    Fabric { name: "organza",   about: "stiff sheer organza",              grams:  45.0, tensile: [2500.0, 2200.0], shear: 40.0, bending_length: [31.0, 29.0], thickness_mm: 0.15, openness: 0.50, yarn_mm: 0.08, source: CLASS },
    Fabric { name: "voile",     about: "polyester voile",                  grams:  60.0, tensile: [2000.0, 1600.0], shear: 22.0, bending_length: [17.4, 17.4], thickness_mm: 0.20, openness: 0.35, yarn_mm: 0.12, source: CLASS },
    Fabric { name: "lace",      about: "raschel lace",                     grams:  80.0, tensile: [1500.0,  700.0], shear: 17.0, bending_length: [17.5, 15.0], thickness_mm: 0.40, openness: 0.60, yarn_mm: 0.20, source: CLASS },
    Fabric { name: "batiste",   about: "cotton batiste",                   grams:  90.0, tensile: [3000.0, 2200.0], shear: 35.0, bending_length: [17.7, 16.0], thickness_mm: 0.25, openness: 0.12, yarn_mm: 0.14, source: CLASS },
    Fabric { name: "linen",     about: "open linen sheer",                 grams: 120.0, tensile: [4000.0, 3500.0], shear: 45.0, bending_length: [21.2, 19.0], thickness_mm: 0.40, openness: 0.25, yarn_mm: 0.30, source: CLASS },
    Fabric { name: "satin",     about: "light satin",                      grams: 150.0, tensile: [3500.0, 2500.0], shear: 30.0, bending_length: [18.9, 15.8], thickness_mm: 0.30, openness: 0.02, yarn_mm: 0.12, source: CLASS },
    Fabric { name: "dimout",    about: "dim-out satin, three layers",      grams: 220.0, tensile: [4500.0, 3500.0], shear: 45.0, bending_length: [20.9, 19.1], thickness_mm: 0.45, openness: 0.00, yarn_mm: 0.15, source: CLASS },
    Fabric { name: "drape",     about: "medium drapery, plain weave",      grams: 260.0, tensile: [5000.0, 4000.0], shear: 50.0, bending_length: [20.0, 18.5], thickness_mm: 0.60, openness: 0.03, yarn_mm: 0.30, source: CLASS },
    Fabric { name: "velvet",    about: "cotton velvet",                    grams: 350.0, tensile: [5000.0, 4500.0], shear: 60.0, bending_length: [21.0, 18.0], thickness_mm: 1.50, openness: 0.00, yarn_mm: 0.30, source: CLASS },
    Fabric { name: "blackout",  about: "coated blackout",                  grams: 320.0, tensile: [9000.0, 8000.0], shear: 85.0, bending_length: [26.5, 24.0], thickness_mm: 0.50, openness: 0.00, yarn_mm: 0.20, source: CLASS },
];

impl Fabric {
    /// The row as mechanics in SI units.
    #[must_use]
    pub fn mechanics(&self) -> Mechanics {
        let areal_density = self.grams * 1e-3;
        let bending = |mm: f64| bending_stiffness(mm * 1e-3, areal_density);
        Mechanics {
            areal_density,
            tensile_warp: self.tensile[0],
            tensile_weft: self.tensile[1],
            tensile_stiffening: 0.0,
            shear: self.shear,
            bending_warp: bending(self.bending_length[0]),
            bending_weft: bending(self.bending_length[1]),
            bending_length_warp_mm: None,
            bending_length_weft_mm: None,
            bending_hysteresis: 0.0,
            shear_hysteresis: 0.0,
            stretch_damping: 2e-3,
            bending_damping: 1e-2,
            thickness: self.thickness_mm * 1e-3,
            openness: self.openness,
            yarn_diameter: self.yarn_mm * 1e-3,
        }
    }
}

/// The built-in fabric of this name.
///
/// # Errors
/// Names what there is when `name` is not in the table.
pub fn fabric(name: &str) -> Result<&'static Fabric> {
    FABRICS.iter().find(|f| f.name == name).ok_or_else(|| {
        let names: Vec<_> = FABRICS.iter().map(|f| f.name).collect();
        Error::spec(
            "fabric",
            format!(
                "there is no built-in fabric `{name}`; choose one of {}",
                names.join(", ")
            ),
        )
    })
}

/// B = w c³ with w the weight per area (Peirce 1930): bending stiffness, N·m, from the bending length in m.
#[must_use]
pub fn bending_stiffness(bending_length: f64, areal_density: f64) -> f64 {
    areal_density * GRAVITY * bending_length.powi(3)
}

/// c = (B / w)^(1/3): bending length, m, from the bending stiffness in N·m.
#[must_use]
pub fn bending_length(bending: f64, areal_density: f64) -> f64 {
    (bending / (areal_density * GRAVITY)).cbrt()
}

impl Mechanics {
    /// Bending stiffness along warp and weft, N·m, whichever way it was given.
    #[must_use]
    pub fn bending(&self) -> [f64; 2] {
        let of = |mm: Option<f64>, direct: f64| {
            mm.map_or(direct, |mm| {
                bending_stiffness(mm * 1e-3, self.areal_density)
            })
        };
        [
            of(self.bending_length_warp_mm, self.bending_warp),
            of(self.bending_length_weft_mm, self.bending_weft),
        ]
    }

    /// Drag coefficient of the open weave for a normal speed in m/s: 1 for a closed cloth, less above about 60 % open area.
    ///
    /// K = 6.5 (1-b)/b² (U d/(b nu))^(-1/3) (Wieghardt 1953), C = K/(1+K/4)² (Taylor 1944), never more than 1 here: the law is
    /// of first order and a fairly solid screen is taken as a plate.
    #[must_use]
    pub fn drag_coefficient(&self, speed: f64) -> f64 {
        const AIR_VISCOSITY: f64 = 1.5e-5;
        let b = self.openness;
        if b <= 0.0 {
            return 1.0;
        }
        let reynolds = (speed.abs().max(0.05) * self.yarn_diameter / (b * AIR_VISCOSITY)).max(1e-3);
        let k = 6.5 * (1.0 - b) / (b * b) * reynolds.powf(-1.0 / 3.0);
        // The law has its maximum of 1 at K = 4 and falls again for denser cloth, where a plate is meant.
        if k >= 4.0 {
            1.0
        } else {
            k / (1.0 + 0.25 * k).powi(2)
        }
    }

    pub(crate) fn validate(&self) -> Result<()> {
        let check = |field: &str, value: f64, least: f64, most: f64, unit: &str| {
            if value.is_finite() && value >= least && value <= most {
                Ok(())
            } else {
                Err(Error::spec(
                    format!("mechanics.{field}"),
                    format!("{value} {unit} is outside {least} to {most} {unit}"),
                ))
            }
        };
        check("areal_density", self.areal_density, 0.005, 5.0, "kg/m²")?;
        check("tensile_warp", self.tensile_warp, 50.0, 1e5, "N/m")?;
        check("tensile_weft", self.tensile_weft, 50.0, 1e5, "N/m")?;
        check(
            "tensile_stiffening",
            self.tensile_stiffening,
            0.0,
            200.0,
            "",
        )?;
        check("shear", self.shear, 0.0, 2000.0, "N/m")?;
        check("bending_warp", self.bending_warp, 0.0, 0.1, "N·m")?;
        check("bending_weft", self.bending_weft, 0.0, 0.1, "N·m")?;
        for (field, mm) in [
            ("bending_length_warp_mm", self.bending_length_warp_mm),
            ("bending_length_weft_mm", self.bending_length_weft_mm),
        ] {
            if let Some(mm) = mm {
                check(field, mm, 0.0, 200.0, "mm")?;
            }
        }
        check(
            "bending_hysteresis",
            self.bending_hysteresis,
            0.0,
            0.01,
            "N",
        )?;
        check("shear_hysteresis", self.shear_hysteresis, 0.0, 50.0, "N/m")?;
        check("stretch_damping", self.stretch_damping, 0.0, 0.1, "s")?;
        check("bending_damping", self.bending_damping, 0.0, 0.1, "s")?;
        check("thickness", self.thickness, 1e-5, 0.02, "m")?;
        check("openness", self.openness, 0.0, 0.99, "")?;
        check("yarn_diameter", self.yarn_diameter, 1e-6, 0.01, "m")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_is_valid_and_bends_at_the_length_it_says() {
        assert!(FABRICS.len() >= 12);
        for row in FABRICS {
            let m = row.mechanics();
            m.validate().unwrap();
            assert!(
                (bending_length(m.bending_warp, m.areal_density) * 1e3 - row.bending_length[0])
                    .abs()
                    < 1e-9,
                "{}",
                row.name
            );
        }
    }

    #[test]
    fn lace_lowers_the_drag_only_above_about_sixty_percent_open_area() {
        // CLOTH notes, Wieghardt and Taylor at 3 m/s, d = 0.2 mm: 0.5 -> 0.98, 0.6 -> 0.85, 0.7 -> 0.65, 0.8 -> 0.43, 0.9 -> 0.20.
        for (b, want) in [
            (0.5, 0.98),
            (0.6, 0.85),
            (0.7, 0.65),
            (0.8, 0.43),
            (0.9, 0.20),
        ] {
            let m = Mechanics {
                openness: b,
                yarn_diameter: 2e-4,
                ..Mechanics::default()
            };
            let got = m.drag_coefficient(3.0);
            assert!(
                (got - want).abs() < 0.02,
                "openness {b}: {got}, expected {want}"
            );
        }
        assert_eq!(
            Mechanics {
                openness: 0.0,
                ..Mechanics::default()
            }
            .drag_coefficient(3.0),
            1.0
        );
    }

    #[test]
    fn an_unknown_fabric_is_answered_with_the_list() {
        let message = fabric("chainmail").unwrap_err().to_string();
        assert!(
            message.contains("chainmail") && message.contains("voile"),
            "{message}"
        );
    }
}
