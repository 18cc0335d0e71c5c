//! The instrument's kernels: over which directions each measured value is an average, for matrices and for scans.

use super::own::own;
use super::shared::shared;
use super::{Detail, Node, Point, Points};
use std::f64::consts::PI;
use woven_bsdf::angles::{degrees, radians};
use woven_bsdf::measured::csv::Scan;
use woven_bsdf::measured::klems::{Block, Klems};
use woven_bsdf::vec3::Vec3;

/// Point `i` of a low-discrepancy sequence in four dimensions: multiples of the powers of the root of x⁵ = x + 1
/// (the golden ratio's family), which needs no table and no fixed count.
fn lattice(i: usize) -> [f64; 4] {
    const A: [f64; 4] = [
        0.856_674_883_854_503,
        0.733_891_856_627_126,
        0.628_706_721_037_809,
        0.538_597_254_759_449,
    ];
    A.map(|a| (0.5 + a * (i as f64 + 0.5)).fract())
}

/// Angle from straight through (or mirror) beyond which a lobe is smooth over a patch: fewer nodes do.
const NEAR: f64 = 18.0;
const MIDDLE: f64 = 35.0;

pub(super) fn klems_points(k: &Klems, block: &Block, detail: Detail, normal_only: bool) -> Points {
    let n = k.patches.len();
    let mut out = Points::default();
    let used: Vec<usize> = (0..n)
        .filter(|&i| {
            let p = k.patches[i];
            if normal_only {
                return i == 0;
            }
            // The search looks at the normal, and at every other ring at four azimuths and two between.
            detail == Detail::Full || {
                let theta = degrees(p.theta());
                let phi = degrees(p.phi);
                i == 0
                    || (theta < 55.0
                        && (theta / 10.0).round() as i64 % 2 == 0
                        && phi % 45.0 < 1e-6
                        && phi <= 180.0)
            }
        })
        .collect();
    for (index, &i) in used.iter().enumerate() {
        let incident = k.patches[i];
        out.incidences
            .push(block.kind.l((incident.theta(), incident.phi)));
        for o in 0..n {
            let outgoing = k.patches[o];
            let l = block.kind.l((incident.theta(), incident.phi));
            let v = block.kind.v((outgoing.theta(), outgoing.phi));
            let mirrored = if block.kind.transmits() {
                -l
            } else {
                Vec3::new(-l.x, -l.y, l.z)
            };
            let off = degrees(mirrored.dot(v).clamp(-1.0, 1.0).acos());
            // Transmitted lobes are a few degrees narrow, reflected ones broad.
            let finer = if block.kind.transmits() { 4 } else { 1 };
            let count = match (detail, off) {
                // A model without gap may put a lobe far narrower than the patch here.
                (Detail::Full, _) if i == o => 40 * finer,
                (Detail::Full, a) if a < NEAR => 6 * finer,
                (Detail::Full, a) if a < MIDDLE => 4,
                (Detail::Full, _) => 1,
                (Detail::Coarse, a) if a < NEAR => 2 * finer,
                (Detail::Coarse, _) => 1,
            };
            let first = out.nodes.len();
            for s in 0..count {
                // A single node stands in the centres.
                let [a, b, c, d] = if count == 1 { [0.5; 4] } else { lattice(s) };
                out.nodes.push(Node {
                    l: block.kind.l(incident.at(a, b)),
                    v: block.kind.v(outgoing.at(c, d)),
                    weight: 1.0 / count as f64,
                });
            }
            let area = outgoing.projected_solid_angle();
            out.points.push(Point {
                l,
                v,
                f: k.value(block, o, i),
                sigma: None,
                own: 1.0,
                area,
                share: area * incident.projected_solid_angle(),
                incidence: index,
                transmits: block.kind.transmits(),
                gap_density: if block.kind.transmits() && i == o {
                    1.0 / area
                } else {
                    0.0
                },
                direct_only: false,
                nodes: (first, out.nodes.len()),
            });
        }
    }
    let mean = out.points.iter().map(|p| p.share).sum::<f64>() / out.points.len().max(1) as f64;
    out.points.iter_mut().for_each(|p| p.share /= mean);
    out
}

/// `# aperture_deg,1.5` in a scan: half-angle of the detector's disc as seen from the sample.
fn aperture(scan: &Scan) -> f64 {
    let number = |c: &String| c.strip_prefix("aperture_deg,")?.trim().parse::<f64>().ok();
    let a = scan.comments.iter().find_map(number).unwrap_or(0.0);
    if a > 0.0 && a < 45.0 { radians(a) } else { 0.0 }
}

/// Centre and six directions at the radius that makes the average over a disc exact to third order.
fn disc(v: Vec3<f64>, half_angle: f64) -> Vec<(Vec3<f64>, f64)> {
    let side = if v.x.abs() < 0.9 {
        Vec3::new(1.0, 0.0, 0.0)
    } else {
        Vec3::new(0.0, 1.0, 0.0)
    };
    let t = (side + v * -side.dot(v)).normalize();
    let b = Vec3::new(
        v.y * t.z - v.z * t.y,
        v.z * t.x - v.x * t.z,
        v.x * t.y - v.y * t.x,
    );
    // Seven-point rule: 1/4 in the centre, 1/8 at six places on the radius √(2/3) (Abramowitz and Stegun 25.4.61).
    let radius = half_angle * (2.0_f64 / 3.0).sqrt();
    let mut out = vec![(v, 0.25)];
    for i in 0..6 {
        let phi = PI / 3.0 * f64::from(i);
        let w = v * radius.cos() + (t * phi.cos() + b * phi.sin()) * radius.sin();
        out.push((w, 0.125));
    }
    out
}

/// Beyond this a BSDF is not defined; the reader keeps such rows, the fit leaves them out.
pub(super) const STEEP_DEG: f64 = 89.9;

pub(super) fn scan_points(scan: &Scan, transmission: bool, normal_only: bool) -> Points {
    let mut out = Points::default();
    // Lines that cannot be read are told by whoever reads the file or fits it.
    (out.shared, _) = shared(scan).unwrap_or_default();
    let (own_samples, own_direct) = own(scan).unwrap_or_default();
    let aperture = aperture(scan);
    let incidence = |out: &mut Points, l: Vec3<f64>| {
        // Directions that differ by less than a hundredth of a degree are one incidence.
        let same = out
            .incidences
            .iter()
            .position(|w| (*w + -l).length_sqr().sqrt() < 1.7e-4);
        same.unwrap_or_else(|| {
            out.incidences.push(l);
            out.incidences.len() - 1
        })
    };
    let steep = radians(STEEP_DEG).cos();
    let is_normal = |l: Vec3<f64>| l.z.abs() > radians(0.5).cos();
    for (row, s) in scan.samples.iter().enumerate() {
        let transmits = s.l.z * s.v.z < 0.0;
        if transmits != transmission || (normal_only && !is_normal(s.l)) {
            continue;
        }
        if s.l.z.abs() < steep || s.v.z.abs() < steep {
            continue;
        }
        let index = incidence(&mut out, s.l);
        let first = out.nodes.len();
        if aperture > 0.0 {
            out.nodes
                .extend(disc(s.v, aperture).into_iter().map(|(v, weight)| Node {
                    l: s.l,
                    v,
                    weight,
                }));
        } else {
            out.nodes.push(Node {
                l: s.l,
                v: s.v,
                weight: 1.0,
            });
        }
        let area = PI * aperture.sin().powi(2) * s.v.z.abs();
        let straight = aperture > 0.0 && transmits && (-s.l).dot(s.v) > aperture.cos();
        out.points.push(Point {
            l: s.l,
            v: s.v,
            f: s.f,
            sigma: s.sigma,
            own: own_samples.get(row).copied().unwrap_or(1.0),
            area,
            share: 1.0,
            incidence: index,
            transmits,
            gap_density: if straight { 1.0 / area } else { 0.0 },
            direct_only: false,
            nodes: (first, out.nodes.len()),
        });
    }
    if transmission {
        for (row, d) in scan.direct.iter().enumerate() {
            if (normal_only && !is_normal(d.l)) || d.l.z.abs() < steep {
                continue;
            }
            let index = incidence(&mut out, d.l);
            let first = out.nodes.len();
            out.nodes.push(Node {
                l: d.l,
                v: -d.l,
                weight: 1.0,
            });
            out.points.push(Point {
                l: d.l,
                v: -d.l,
                f: d.transmittance,
                sigma: d.sigma,
                own: own_direct.get(row).copied().unwrap_or(1.0),
                area: 1.0,
                share: 1.0,
                incidence: index,
                transmits: true,
                gap_density: 1.0,
                direct_only: true,
                nodes: (first, out.nodes.len()),
            });
        }
    }
    out
}
