//! Scattered goniometer points as a BSDF: interpolation that carries the peak along with the light.
//!
//! A point is placed by the direction in which its light travels, t (x and y of -l), and by how far the detector stands
//! from straight through (or from the mirror image): v - t in x and y. In these four coordinates a peak that follows
//! the light stays at one place, so that between two measured incidences it neither doubles nor fades; interpolated in
//! v alone, it would. What the scan's `direct` rows give is kept apart, as the light of the straight patch.

use super::csv::Scan;
use super::klems::{Kind, Klems};
use super::{Refused, resample};
use crate::vec3::Vec3;

/// What may be taken for granted of a cloth that was measured at few azimuths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Symmetry {
    /// Nothing: each azimuth stands for itself.
    None,
    /// Mirror images about warp and weft are alike, as in most weaves: one quadrant of incidences is enough.
    Quadrant,
    /// Turning the cloth changes nothing: one azimuth of incidence is enough.
    Isotropic,
}

/// A measured place: t, then v - t.
type Place = [f64; 4];

/// The points of one kind of light, sorted by the light's direction.
#[derive(Clone, Debug)]
struct Cloud {
    /// Distinct directions of travel with their range of points.
    incidences: Vec<([f64; 2], std::ops::Range<usize>)>,
    points: Vec<([f64; 2], f64)>,
}

/// Points ready for interpolation.
#[derive(Clone, Debug)]
pub struct Scattered {
    symmetry: Symmetry,
    /// By [`Kind`]: transmission front and back, reflection front and back.
    clouds: [Option<Cloud>; 4],
    /// Direct rows: side, direction of travel, share.
    direct: Vec<(bool, [f64; 2], f64)>,
}

const KINDS: [Kind; 4] = [
    Kind::TransmissionFront,
    Kind::TransmissionBack,
    Kind::ReflectionFront,
    Kind::ReflectionBack,
];

/// How many incidences and points of each are mixed.
const NEIGHBOURS: usize = 4;

impl Scattered {
    /// Most points: nearest ones are found by looking at all of an incidence.
    pub const MAX_POINTS: usize = 200_000;

    /// From a scan.
    ///
    /// # Errors
    /// A sentence when there are no samples, or more than [`Scattered::MAX_POINTS`].
    pub fn new(scan: &Scan, symmetry: Symmetry) -> Result<Self, Refused> {
        if scan.samples.is_empty() {
            return Err(Refused::new("the scan holds no samples to interpolate"));
        }
        if scan.samples.len() > Self::MAX_POINTS {
            return Err(Refused::new(format!(
                "{} samples are more than {}; thin the scan out",
                scan.samples.len(),
                Self::MAX_POINTS
            )));
        }
        let mut sorted: [Vec<(Place, f64)>; 4] = Default::default();
        for s in &scan.samples {
            if s.l.z != 0.0 && s.v.z != 0.0 {
                sorted[kind(s.l, s.v)].push((place(symmetry, s.l, s.v), s.f.max(0.0)));
            }
        }
        let direct = scan.direct.iter().map(|d| {
            let p = place(symmetry, d.l, -d.l);
            (d.l.z > 0.0, [p[0], p[1]], d.transmittance.max(0.0))
        });
        Ok(Scattered {
            symmetry,
            clouds: sorted.map(cloud),
            direct: direct.collect(),
        })
    }

    /// f(l, v) in 1/sr without the direct rows; 0 where nothing was measured for these sides.
    pub fn eval(&self, l: Vec3<f64>, v: Vec3<f64>) -> f64 {
        if l.z == 0.0 || v.z == 0.0 {
            return 0.0;
        }
        let Some(cloud) = &self.clouds[kind(l, v)] else {
            return 0.0;
        };
        let [tx, ty, dx, dy] = place(self.symmetry, l, v);
        let nearest = nearest(&cloud.incidences, |(t, _)| square([t[0] - tx, t[1] - ty]));
        blend(nearest.iter().map(|&(i, d)| {
            let points = &cloud.points[cloud.incidences[i].1.clone()];
            let near = self::nearest(points, |(p, _)| square([p[0] - dx, p[1] - dy]));
            (blend(near.iter().map(|&(k, d)| (points[k].1, d))), d)
        }))
    }

    /// The share of a beam along `w` (towards the light) that goes straight on, from the scan's direct rows.
    pub fn gap(&self, w: Vec3<f64>) -> f64 {
        let [tx, ty, ..] = place(self.symmetry, w, -w);
        let rows: Vec<&(bool, [f64; 2], f64)> = self
            .direct
            .iter()
            .filter(|(front, ..)| *front == (w.z > 0.0))
            .collect();
        let near = nearest(&rows, |(_, t, _)| square([t[0] - tx, t[1] - ty]));
        blend(near.iter().map(|&(i, d)| (rows[i].2, d)))
    }

    /// As Klems matrices of the kinds that were measured, the direct rows in the straight-through patches: a file for
    /// [`super::table::Tabulated`], for the fit and for other programs.
    pub fn to_klems(&self, name: &str) -> Klems {
        let mut blocks = Vec::new();
        for (cloud, kind) in self.clouds.iter().zip(KINDS) {
            if cloud.is_none() {
                continue;
            }
            let detail = resample::Detail {
                peak: (8, 16),
                floor: 8,
            };
            let mut block = resample::block("Visible", kind, detail, |l, v| self.eval(l, v));
            if kind.transmits() {
                let patches = super::klems_write::klems_full();
                for (i, p) in patches.iter().enumerate() {
                    let direct = self.gap(kind.l((p.theta(), p.phi)));
                    block.values[i * patches.len() + i] += direct / p.projected_solid_angle();
                }
            }
            blocks.push(block);
        }
        resample::file(name, "", blocks)
    }
}

fn square(d: [f64; 2]) -> f64 {
    d[0] * d[0] + d[1] * d[1]
}

/// The place of a pair of directions in [`KINDS`].
fn kind(l: Vec3<f64>, v: Vec3<f64>) -> usize {
    let back = usize::from(l.z < 0.0);
    if l.z * v.z < 0.0 { back } else { 2 + back }
}

fn place(symmetry: Symmetry, l: Vec3<f64>, v: Vec3<f64>) -> Place {
    let (mut t, mut d) = ([-l.x, -l.y], [v.x + l.x, v.y + l.y]);
    match symmetry {
        Symmetry::None => {}
        Symmetry::Quadrant => {
            for (t, d) in t.iter_mut().zip(&mut d) {
                if *t < 0.0 {
                    (*t, *d) = (-*t, -*d);
                }
            }
        }
        Symmetry::Isotropic => {
            let r = square(t).sqrt();
            if r > 1e-12 {
                let (c, s) = (t[0] / r, t[1] / r);
                d = [d[0] * c + d[1] * s, d[1] * c - d[0] * s];
            }
            t = [r, 0.0];
        }
    }
    [t[0], t[1], d[0], d[1]]
}

fn cloud(mut points: Vec<(Place, f64)>) -> Option<Cloud> {
    // Angles in files are rounded; what agrees to 1e-6 is one incidence.
    let key = |p: &Place| [0, 1].map(|i| (p[i] * 1e6).round() as i64);
    points.sort_by_key(|(p, _)| key(p));
    let mut incidences: Vec<([f64; 2], std::ops::Range<usize>)> = Vec::new();
    for group in points.chunk_by(|a, b| key(&a.0) == key(&b.0)) {
        let start = incidences.last().map_or(0, |(_, r)| r.end);
        incidences.push(([group[0].0[0], group[0].0[1]], start..start + group.len()));
    }
    (!points.is_empty()).then(|| Cloud {
        incidences,
        points: points.iter().map(|(p, f)| ([p[2], p[3]], *f)).collect(),
    })
}

/// The nearest few of a list with their squared distances, nearest first.
fn nearest<T>(list: &[T], distance: impl Fn(&T) -> f64) -> Vec<(usize, f64)> {
    let mut best: Vec<(usize, f64)> = Vec::with_capacity(NEIGHBOURS + 1);
    for (i, x) in list.iter().enumerate() {
        let d = distance(x);
        if best.len() < NEIGHBOURS || d < best[best.len() - 1].1 {
            let at = best.partition_point(|b| b.1 <= d);
            best.insert(at, (i, d));
            best.truncate(NEIGHBOURS);
        }
    }
    best
}

/// Mean with weights that fall to zero at the farthest of the neighbours: a new neighbour enters without a jump.
fn blend(near: impl Iterator<Item = (f64, f64)>) -> f64 {
    let near: Vec<(f64, f64)> = near.collect();
    let reach = near.iter().map(|n| n.1).fold(0.0, f64::max).sqrt();
    let (mut sum, mut weights) = (0.0, 0.0);
    for (f, d) in &near {
        let d = d.sqrt();
        let share = if near.len() > 1 && reach > 0.0 {
            1.0 - d / (reach * 1.001)
        } else {
            1.0
        };
        // Shepard 1968 in the form of Franke and Nielson; a point that is hit counts alone.
        let w = (share / d.max(1e-7)).powi(2);
        (sum, weights) = (sum + w * f, weights + w);
    }
    if weights > 0.0 { sum / weights } else { 0.0 }
}
