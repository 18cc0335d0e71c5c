//! Klems matrices: the XML files of WINDOW and of Radiance's `bsdf2klems`.
//!
//! A block is a square matrix over the patches of a hemisphere: row = outgoing patch, column = incident patch, values
//! in 1/sr. The incident direction of a patch is the way the light travels, so the outgoing patch with the same index
//! is the straight-through one: in the cloth's frame (seen from the front) l = (-sinθ cosφ, -sinθ sinφ, cosθ) and the
//! transmitted v = (sinθ cosφ, sinθ sinφ, -cosθ), the mirror-reflected v = (sinθ cosφ, sinθ sinφ, cosθ).

use super::xml::{document, find, is, number, text};
use super::{Refused, klems_check, read_text, tensor_tree};
use crate::angles::radians;
use crate::vec3::Vec3;
use roxmltree::Node;
use std::f64::consts::{PI, TAU};
use std::path::Path;

/// One patch of the angular basis; angles in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Least polar angle from the normal.
    pub theta_lo: f64,
    /// Greatest polar angle.
    pub theta_hi: f64,
    /// Azimuth of the centre, from the weft.
    pub phi: f64,
    /// Width in azimuth.
    pub phi_width: f64,
}

impl Patch {
    /// Polar angle of the centre: 0 for the cap around the normal, else the middle of the ring.
    pub fn theta(&self) -> f64 {
        if self.theta_lo == 0.0 {
            0.0
        } else {
            0.5 * (self.theta_lo + self.theta_hi)
        }
    }
    /// ∫ cosθ dω over the patch, in sr; all patches of a basis sum to π.
    pub fn projected_solid_angle(&self) -> f64 {
        0.5 * self.phi_width * (self.theta_hi.sin().powi(2) - self.theta_lo.sin().powi(2))
    }
    /// The point of the patch at the fractions `a` of its projected area in θ and `b` of its width in φ, as (θ, φ).
    pub fn at(&self, a: f64, b: f64) -> (f64, f64) {
        let (lo, hi) = (self.theta_lo.sin().powi(2), self.theta_hi.sin().powi(2));
        (
            (lo + a * (hi - lo)).sqrt().min(1.0).asin(),
            self.phi + (b - 0.5) * self.phi_width,
        )
    }
}

/// What a block measures, seen from the side of the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Light from the front, passing to the back.
    TransmissionFront,
    /// Light from the back, passing to the front.
    TransmissionBack,
    /// Light from the front, reflected.
    ReflectionFront,
    /// Light from the back, reflected.
    ReflectionBack,
}

impl Kind {
    fn parse(text: &str) -> Option<Self> {
        Some(
            match text
                .split_whitespace()
                .collect::<Vec<_>>()
                .join(" ")
                .as_str()
            {
                "Transmission Front" => Kind::TransmissionFront,
                "Transmission Back" => Kind::TransmissionBack,
                "Reflection Front" => Kind::ReflectionFront,
                "Reflection Back" => Kind::ReflectionBack,
                _ => return None,
            },
        )
    }
    /// The words of the file format.
    pub fn name(self) -> &'static str {
        match self {
            Kind::TransmissionFront => "Transmission Front",
            Kind::TransmissionBack => "Transmission Back",
            Kind::ReflectionFront => "Reflection Front",
            Kind::ReflectionBack => "Reflection Back",
        }
    }
    /// Whether the light passes the sheet.
    pub fn transmits(self) -> bool {
        matches!(self, Kind::TransmissionFront | Kind::TransmissionBack)
    }
    /// +1 when the light comes from the front (z > 0), else -1.
    pub fn light_side(self) -> f64 {
        if matches!(self, Kind::TransmissionFront | Kind::ReflectionFront) {
            1.0
        } else {
            -1.0
        }
    }
    /// The direction to the light for an incident patch point (θ, φ).
    pub fn l(self, (theta, phi): (f64, f64)) -> Vec3<f64> {
        let w = Vec3::from_angles(theta, phi);
        Vec3::new(-w.x, -w.y, w.z * self.light_side())
    }
    /// The direction to the viewer for an outgoing patch point (θ, φ).
    pub fn v(self, (theta, phi): (f64, f64)) -> Vec3<f64> {
        let w = Vec3::from_angles(theta, phi);
        let side = if self.transmits() {
            -self.light_side()
        } else {
            self.light_side()
        };
        Vec3::new(w.x, w.y, w.z * side)
    }
}

/// One matrix.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// "Visible", "Solar" or whatever the file says.
    pub band: String,
    /// What it measures.
    pub kind: Kind,
    /// n × n values in 1/sr, row = outgoing patch, column = incident patch.
    pub values: Vec<f64>,
}

/// A whole file.
#[derive(Clone, Debug, PartialEq)]
pub struct Klems {
    /// The fabric's name.
    pub name: String,
    /// Who made it.
    pub manufacturer: String,
    /// The patches of the hemisphere.
    pub patches: Vec<Patch>,
    /// The matrices.
    pub blocks: Vec<Block>,
}

impl Klems {
    /// Reads a file.
    ///
    /// # Errors
    /// A sentence that names the file and the place when it is not readable, not such a file, or damaged.
    pub fn read(path: &Path) -> Result<Self, Refused> {
        Self::parse(&read_text(path)?).map_err(|e| Refused::new(format!("{}: {e}", path.display())))
    }

    /// Reads the text of a file.
    ///
    /// # Errors
    /// As [`Klems::read`].
    pub fn parse(xml: &str) -> Result<Self, Refused> {
        let doc = document(xml)?;
        let root = doc.root_element();
        match text(root, "IncidentDataStructure") {
            "Columns" => {}
            "TensorTree3" | "TensorTree4" => {
                return Ok(tensor_tree::TensorTree::of_root(root)?.to_klems());
            }
            "" => {
                return Err(Refused::new(
                    "there is no IncidentDataStructure: this is not a Klems BSDF file",
                ));
            }
            other => {
                return Err(Refused::new(format!(
                    "IncidentDataStructure is {other:?}; only Columns and TensorTree3 or 4 are known"
                )));
            }
        }
        let patches = patches(root)?;
        let mut blocks = Vec::new();
        let basis = text(root, "AngleBasisName");
        for (band, kind, block) in data_blocks(root)? {
            let whose = format!("{band}, {}", kind.name());
            klems_check::bases(block, basis, &whose)?;
            let values = matrix(text(block, "ScatteringData"), patches.len(), &whose)?;
            blocks.push(Block { band, kind, values });
        }
        if blocks.is_empty() {
            return Err(Refused::new("the file holds no scattering data"));
        }
        let file = Klems {
            name: text(root, "Name").to_owned(),
            manufacturer: text(root, "Manufacturer").to_owned(),
            patches,
            blocks,
        };
        klems_check::orientation(&file)?;
        Ok(file)
    }

    /// The block of a band ("Visible", "Solar") and kind.
    pub fn block(&self, band: &str, kind: Kind) -> Option<&Block> {
        self.blocks
            .iter()
            .find(|b| b.band == band && b.kind == kind)
    }
    /// The BSDF from incident to outgoing patch, in 1/sr.
    pub fn value(&self, block: &Block, outgoing: usize, incident: usize) -> f64 {
        block.values[outgoing * self.patches.len() + incident]
    }
    /// Direct-hemispherical transmittance or reflectance of one incident patch: Σ_o f · projected solid angle.
    pub fn directional(&self, block: &Block, incident: usize) -> f64 {
        (0..self.patches.len())
            .map(|o| self.value(block, o, incident) * self.patches[o].projected_solid_angle())
            .sum()
    }
    /// Hemispherical-hemispherical transmittance or reflectance under even light.
    pub fn hemispherical(&self, block: &Block) -> f64 {
        let sum: f64 = (0..self.patches.len())
            .map(|i| self.directional(block, i) * self.patches[i].projected_solid_angle())
            .sum();
        sum / PI
    }
    /// The part of [`Klems::directional`] in the straight-through (or mirror) patch.
    pub fn straight(&self, block: &Block, incident: usize) -> f64 {
        self.value(block, incident, incident) * self.patches[incident].projected_solid_angle()
    }
}

/// Band, kind and element of every block of data.
pub(super) fn data_blocks<'a, 'i>(
    root: Node<'a, 'i>,
) -> Result<Vec<(String, Kind, Node<'a, 'i>)>, Refused> {
    let mut out = Vec::new();
    for data in root.descendants().filter(|n| is(*n, "WavelengthData")) {
        let band = match text(data, "Wavelength") {
            "" => "Visible",
            band => band,
        };
        let blocks = data.descendants();
        for block in blocks.filter(|n| is(*n, "WavelengthDataBlock")) {
            let direction = text(block, "WavelengthDataDirection");
            let kind = Kind::parse(direction).ok_or_else(|| {
                Refused::new(format!("unknown WavelengthDataDirection {direction:?}"))
            })?;
            out.push((band.to_owned(), kind, block));
        }
    }
    Ok(out)
}

fn patches(root: Node<'_, '_>) -> Result<Vec<Patch>, Refused> {
    let basis =
        find(root, "AngleBasis").ok_or_else(|| Refused::new("the file has no AngleBasis"))?;
    let mut patches = Vec::new();
    for ring in basis.descendants().filter(|n| is(*n, "AngleBasisBlock")) {
        let (lo, hi, n) = (
            number(ring, "LowerTheta")?,
            number(ring, "UpperTheta")?,
            number(ring, "nPhis")?,
        );
        if !(0.0..=90.0).contains(&lo)
            || !(lo..=90.0).contains(&hi)
            || !(1.0..=3600.0).contains(&n)
            || n.fract() != 0.0
        {
            return Err(Refused::new(format!(
                "the angle basis has a ring of {n} patches from {lo} to {hi} degrees"
            )));
        }
        let n = n as usize;
        patches.extend((0..n).map(|k| Patch {
            theta_lo: radians(lo),
            theta_hi: radians(hi),
            phi: TAU * k as f64 / n as f64,
            phi_width: TAU / n as f64,
        }));
        if patches.len() > 1500 {
            return Err(Refused::new("the angle basis has more than 1,500 patches"));
        }
    }
    let total: f64 = patches.iter().map(Patch::projected_solid_angle).sum();
    // The rings of a sound basis tile the hemisphere; degrees written with two decimals move the sum by less than this.
    if (total - PI).abs() > 1e-3 * PI {
        return Err(Refused::new(format!(
            "the patches of the angle basis cover {:.3} of the hemisphere",
            total / PI
        )));
    }
    Ok(patches)
}

fn matrix(text: &str, n: usize, whose: &str) -> Result<Vec<f64>, Refused> {
    // No more room than the text can fill: a damaged basis must not ask for gigabytes.
    let mut values = Vec::with_capacity((n * n).min(text.len() / 2 + 1));
    for word in text
        .split(|c: char| c == ',' || c == ';' || c.is_whitespace())
        .filter(|w| !w.is_empty())
    {
        let (row, column) = (values.len() / n, values.len() % n);
        match word.parse::<f64>() {
            Ok(x) if x.is_finite() => values.push(x),
            _ => {
                return Err(Refused::new(format!(
                    "{whose}: {word:?} at row {}, column {} is not a number",
                    row + 1,
                    column + 1
                )));
            }
        }
        if values.len() > n * n {
            return Err(Refused::new(format!("{whose}: more than {n} × {n} values")));
        }
    }
    if values.len() != n * n {
        return Err(Refused::new(format!(
            "{whose}: {} values where {n} × {n} = {} are needed; the file is cut off",
            values.len(),
            n * n
        )));
    }
    Ok(values)
}
