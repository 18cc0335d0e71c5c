//! A measurement as the fit sees it: points with the instrument's kernel, grouped by incidence.
//!
//! A goniometer never sees one pair of directions: it averages over its aperture, a Klems patch over some ten
//! degrees on both sides. Each [`Point`] therefore carries the nodes over which a model must be averaged before it
//! is compared, and the density with which a gap's delta appears in it.

mod kernel;
mod own;
mod remarks;
pub mod shared;

use anyhow::{Context, Result, bail};
use sha2::{Digest, Sha256};
use shared::Shared;
use std::path::{Path, PathBuf};
use woven_bsdf::measured::csv::Scan;
use woven_bsdf::measured::klems::{Block, Kind, Klems};
use woven_bsdf::measured::pab::Pab;
use woven_bsdf::vec3::Vec3;

/// One pair of directions inside a kernel, with its share of the average.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// Direction to the light.
    pub l: Vec3<f64>,
    /// Direction to the viewer.
    pub v: Vec3<f64>,
    /// Share; the nodes of a point sum to 1.
    pub weight: f64,
}

/// One measured value.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Direction to the light (centre of the kernel).
    pub l: Vec3<f64>,
    /// Direction to the viewer (centre of the kernel).
    pub v: Vec3<f64>,
    /// Measured BSDF in 1/sr; for a direct row the transmitted share of the beam.
    pub f: f64,
    /// Its standard error, if known.
    pub sigma: Option<f64>,
    /// Share of the standard error that is the value's own; the rest it has in common with the others.
    pub own: f64,
    /// Projected solid angle of the kernel in sr, 0 if unknown.
    pub area: f64,
    /// Its part of the measured light, relative to the mean of all points: patches of a matrix count by their projected
    /// solid angles on both sides, so that crowded or grazing patches do not count double; 1 for scattered points.
    pub share: f64,
    /// Which incidence it belongs to.
    pub incidence: usize,
    /// Whether light and viewer are on opposite sides.
    pub transmits: bool,
    /// What a gap of openness 1 adds to the value: 1/area in the straight-through patch, else 0.
    pub gap_density: f64,
    /// A row that holds the straight-through light alone, without any scattered light.
    pub direct_only: bool,
    /// Range of its nodes.
    pub nodes: (usize, usize),
}

impl Point {
    /// Whether straight-through light of a gap is part of the value.
    pub fn is_peak(&self) -> bool {
        self.gap_density > 0.0
    }
}

impl Points {
    /// The points that `keep` wants, with all nodes and incidences.
    pub fn filter(&self, keep: impl Fn(&Point) -> bool) -> Self {
        Self {
            points: self.points.iter().filter(|p| keep(p)).copied().collect(),
            nodes: self.nodes.clone(),
            incidences: self.incidences.clone(),
            shared: self.shared.clone(),
        }
    }
}

/// Points and their kernels.
#[derive(Clone, Debug, Default)]
pub struct Points {
    /// The values.
    pub points: Vec<Point>,
    /// The kernels' nodes.
    pub nodes: Vec<Node>,
    /// Centre directions to the light.
    pub incidences: Vec<Vec3<f64>>,
    /// Errors that all values share.
    pub shared: Vec<Shared>,
}

/// What the file is.
#[derive(Clone, Debug)]
pub enum Source {
    /// A Klems matrix file.
    Klems(Klems),
    /// Scattered points.
    Scan(Scan),
}

/// A file read and understood.
#[derive(Clone, Debug)]
pub struct Measurement {
    /// Where it was read.
    pub path: PathBuf,
    /// The fabric's name; the file's stem if the file gives none.
    pub name: String,
    /// Who made the fabric, if known.
    pub maker: String,
    /// SHA-256 of the file, hexadecimal.
    pub sha256: String,
    /// The content.
    pub source: Source,
}

impl Measurement {
    /// Reads a Klems matrix or a tensor tree (`.xml`), a scan (`.csv`) or PAB text (`.pab`, `.txt`, `.dat`).
    ///
    /// # Errors
    /// A sentence that names the file and what to do.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes =
            std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
        Self::parse(path, &bytes)
    }

    /// Reads the bytes of a file; `path` gives the format by its ending and the name by its stem.
    ///
    /// # Errors
    /// As [`Measurement::read`].
    pub fn parse(path: &Path, bytes: &[u8]) -> Result<Self> {
        let extension = path
            .extension()
            .map(|e| e.to_string_lossy().to_lowercase())
            .unwrap_or_default();
        if !["xml", "csv", "pab", "txt", "dat"].contains(&extension.as_str()) {
            bail!(
                "{}: the ending {extension:?} is unknown; measurements are .xml (Klems or tensor tree), .csv (theta_l_deg,…) or .pab (PAB text)",
                path.display()
            );
        }
        let text = std::str::from_utf8(bytes).map_err(|e| {
            anyhow::anyhow!(
                "{} is not UTF-8 text (byte {})",
                path.display(),
                e.valid_up_to()
            )
        })?;
        let place = || path.display().to_string();
        let stem = path
            .file_stem()
            .map(|s| s.to_string_lossy().into_owned())
            .unwrap_or_default();
        let (source, name, maker) = match extension.as_str() {
            "xml" => {
                // Tensor trees share the ending; they come averaged over Klems' patches.
                let klems = Klems::parse(text).with_context(place)?;
                let name = if klems.name.is_empty() {
                    stem
                } else {
                    klems.name.clone()
                };
                let maker = klems.manufacturer.clone();
                (Source::Klems(klems), name, maker)
            }
            "csv" => {
                let scan = Scan::parse(text).with_context(place)?;
                check(&scan).with_context(place)?;
                (Source::Scan(scan), stem, String::new())
            }
            _ => {
                let scan = Pab::parse(text).with_context(place)?.scan();
                (Source::Scan(scan), stem, String::new())
            }
        };
        let sha256 = Sha256::digest(bytes)
            .iter()
            .map(|b| format!("{b:02x}"))
            .collect();
        Ok(Self {
            path: path.to_owned(),
            name,
            maker,
            sha256,
            source,
        })
    }

    /// Scattered points under a name, for data made in memory.
    pub fn from_scan(name: &str, scan: Scan) -> Self {
        Self {
            path: PathBuf::from(format!("{name}.csv")),
            name: name.to_owned(),
            maker: String::new(),
            sha256: Sha256::digest(scan.to_text())
                .iter()
                .map(|b| format!("{b:02x}"))
                .collect(),
            source: Source::Scan(scan),
        }
    }

    /// The band of a Klems file that is fitted: Visible where there is one, else the first.
    pub fn band(&self) -> Option<&str> {
        let Source::Klems(k) = &self.source else {
            return None;
        };
        let visible = k.blocks.iter().find(|b| b.band == "Visible");
        visible.or(k.blocks.first()).map(|b| b.band.as_str())
    }

    /// What is odd about its rows, in sentences that name them; matrices have none.
    pub fn remarks(&self) -> Vec<String> {
        match &self.source {
            Source::Klems(_) => Vec::new(),
            Source::Scan(scan) => remarks::remarks(scan),
        }
    }

    /// The Klems block of a kind in the fitted band.
    pub fn block(&self, kind: Kind) -> Option<(&Klems, &Block)> {
        let Source::Klems(k) = &self.source else {
            return None;
        };
        k.block(self.band()?, kind).map(|b| (k, b))
    }

    /// All points of the transmission (or of the reflection) of light from the front, or from the back where the
    /// file has no front.
    pub fn points(&self, transmission: bool, detail: Detail, normal_only: bool) -> Points {
        match &self.source {
            Source::Klems(k) => {
                let kinds = if transmission {
                    [Kind::TransmissionFront, Kind::TransmissionBack]
                } else {
                    [Kind::ReflectionFront, Kind::ReflectionBack]
                };
                let block = kinds.iter().find_map(|&kind| self.block(kind));
                block.map_or_else(Points::default, |(_, b)| {
                    kernel::klems_points(k, b, detail, normal_only)
                })
            }
            Source::Scan(scan) => kernel::scan_points(scan, transmission, normal_only),
        }
    }
}

/// Whether the comments of a scan that a fit reads can be read.
///
/// # Errors
/// A sentence with the line.
pub fn check(scan: &Scan) -> Result<()> {
    shared::shared(scan)?;
    own::own(scan).map(|_| ())
}

/// How finely kernels are sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Detail {
    /// Few incidences and nodes: for the search from many starts.
    Coarse,
    /// Everything: for the fit itself.
    Full,
}
