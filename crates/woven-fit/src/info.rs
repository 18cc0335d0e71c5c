//! What a measurement says by itself, before any model: transmittances, openness, peak, skirt and floor.

use crate::measurement::{Measurement, Source};
use serde::Serialize;
use std::f64::consts::PI;
use woven_bsdf::angles::degrees;
use woven_bsdf::measured::klems::{Block, Kind, Klems};

/// One incidence of one block.
#[derive(Clone, Debug, Serialize)]
pub struct Incidence {
    /// Polar angle of incidence in degrees.
    pub theta_deg: f64,
    /// Azimuth of the incident patch in degrees.
    pub phi_deg: f64,
    /// Direct-hemispherical transmittance or reflectance.
    pub total: f64,
    /// Part in the straight-through (or mirror) patch.
    pub straight: f64,
}

/// The three parts of the transmission at one incidence; they sum to the transmittance.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Parts {
    /// Straight-through patch.
    pub peak: f64,
    /// What stands above the floor elsewhere.
    pub skirt: f64,
    /// The rest: even light, about π times the median value.
    pub floor: f64,
}

/// One block of a Klems file.
#[derive(Clone, Debug, Serialize)]
pub struct BlockInfo {
    /// "Transmission Front" and so on.
    pub kind: &'static str,
    /// All incident patches.
    pub incidences: Vec<Incidence>,
    /// Under even light.
    pub hemispherical: f64,
    /// Parts at normal incidence; none for reflection.
    pub normal: Option<Parts>,
}

/// What a measurement says by itself.
#[derive(Clone, Debug, Serialize)]
pub struct Info {
    /// The fabric's name.
    pub name: String,
    /// Who made it.
    pub maker: String,
    /// SHA-256 of the file.
    pub sha256: String,
    /// Number of scattered values (points of a scan, entries of the fitted band of a matrix file).
    pub values: usize,
    /// The band of a matrix file.
    pub band: Option<String>,
    /// Blocks of a matrix file.
    pub blocks: Vec<BlockInfo>,
    /// Straight-through rows of a scan: (theta_deg, phi_deg, transmittance).
    pub direct: Vec<(f64, f64, f64)>,
    /// What is odd about the rows of a scan.
    pub notes: Vec<String>,
}

impl Parts {
    /// Their sum: the transmittance.
    pub fn total(&self) -> f64 {
        self.peak + self.skirt + self.floor
    }
}

/// Peak, skirt and floor of one incidence from the values (1/sr) of all patches and their projected solid angles (sr);
/// `straight` is the straight-through one. The floor's level is the median over the patches.
pub fn parts_of(values: &[f64], areas: &[f64], straight: usize) -> Parts {
    let n = values.len();
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let level = if n % 2 == 1 {
        sorted[n / 2]
    } else {
        0.5 * (sorted[n / 2 - 1] + sorted[n / 2])
    };
    let sum = |value: &dyn Fn(f64) -> f64| {
        let rows = values.iter().zip(areas).enumerate();
        rows.filter(|(i, _)| *i != straight)
            .map(|(_, (v, a))| value(*v) * a)
            .sum::<f64>()
    };
    let skirt = sum(&|v| (v - level).max(0.0));
    Parts {
        peak: values[straight] * areas[straight],
        skirt,
        floor: sum(&|v| v) - skirt,
    }
}

/// [`parts_of`] the incident patch `i` of a block.
pub fn parts(k: &Klems, block: &Block, i: usize) -> Parts {
    let n = k.patches.len();
    let values: Vec<f64> = (0..n).map(|o| k.value(block, o, i)).collect();
    let areas: Vec<f64> = k
        .patches
        .iter()
        .map(woven_bsdf::measured::klems::Patch::projected_solid_angle)
        .collect();
    parts_of(&values, &areas, i)
}

/// Looks at a measurement.
pub fn info(data: &Measurement) -> Info {
    let mut out = Info {
        name: data.name.clone(),
        maker: data.maker.clone(),
        sha256: data.sha256.clone(),
        values: 0,
        band: data.band().map(str::to_owned),
        blocks: Vec::new(),
        direct: Vec::new(),
        notes: data.remarks(),
    };
    match &data.source {
        Source::Klems(k) => {
            let kinds = [
                Kind::TransmissionFront,
                Kind::TransmissionBack,
                Kind::ReflectionFront,
                Kind::ReflectionBack,
            ];
            for kind in kinds {
                let Some((_, block)) = data.block(kind) else {
                    continue;
                };
                out.values += block.values.len();
                out.blocks.push(BlockInfo {
                    kind: kind.name(),
                    incidences: (0..k.patches.len())
                        .map(|i| Incidence {
                            theta_deg: degrees(k.patches[i].theta()),
                            phi_deg: degrees(k.patches[i].phi),
                            total: k.directional(block, i),
                            straight: k.straight(block, i),
                        })
                        .collect(),
                    hemispherical: k.hemispherical(block),
                    normal: kind.transmits().then(|| parts(k, block, 0)),
                });
            }
        }
        Source::Scan(scan) => {
            out.values = scan.samples.len();
            out.direct = scan
                .direct
                .iter()
                .map(|d| {
                    let (theta, phi) = d.l.to_angles();
                    (degrees(theta), degrees(phi), d.transmittance)
                })
                .collect();
        }
    }
    out
}

impl Info {
    /// The text for a terminal.
    pub fn to_text(&self) -> String {
        use std::fmt::Write;
        let mut s = format!(
            "{}{}\n",
            self.name,
            if self.maker.is_empty() {
                String::new()
            } else {
                format!(" ({})", self.maker)
            }
        );
        let ok = "a string grows";
        writeln!(s, "sha256 {}\n{} values", self.sha256, self.values).expect(ok);
        if let Some(band) = &self.band {
            writeln!(s, "band {band}").expect(ok);
        }
        for b in &self.blocks {
            writeln!(s, "\n{}: {:.5} under even light", b.kind, b.hemispherical).expect(ok);
            if let Some(p) = b.normal {
                let total = p.total();
                let share = |x: f64| 100.0 * x / total.max(f64::MIN_POSITIVE);
                writeln!(
                    s,
                    "  normal incidence: transmittance {total:.5} = straight-through {:.5} ({:.1} %) + skirt {:.5} ({:.1} %) + floor {:.5} ({:.1} %, level {:.5}/sr)",
                    p.peak, share(p.peak), p.skirt, share(p.skirt), p.floor, share(p.floor), p.floor / PI
                )
                .expect(ok);
            }
            writeln!(
                s,
                "  theta   total: mean    least  greatest   straight: mean"
            )
            .expect(ok);
            let mut rings: Vec<f64> = b.incidences.iter().map(|i| i.theta_deg).collect();
            rings.dedup();
            for theta in rings {
                let ring: Vec<&Incidence> = b
                    .incidences
                    .iter()
                    .filter(|i| i.theta_deg == theta)
                    .collect();
                let n = ring.len() as f64;
                let mean = |f: fn(&Incidence) -> f64| ring.iter().map(|i| f(i)).sum::<f64>() / n;
                let least = ring.iter().map(|i| i.total).fold(f64::INFINITY, f64::min);
                let greatest = ring.iter().map(|i| i.total).fold(0.0, f64::max);
                writeln!(
                    s,
                    "  {theta:5.1} {:13.5} {least:9.5} {greatest:9.5} {:13.5}",
                    mean(|i| i.total),
                    mean(|i| i.straight)
                )
                .expect(ok);
            }
        }
        for (theta, phi, t) in &self.direct {
            writeln!(s, "direct: theta {theta:.1}, phi {phi:.1}: {t:.5}").expect(ok);
        }
        for note in &self.notes {
            writeln!(s, "note: {note}").expect(ok);
        }
        s
    }
}
