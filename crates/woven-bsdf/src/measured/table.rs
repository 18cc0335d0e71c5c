//! Measured cloth rendered as it was measured: a Klems table as a BSDF, with the straight-through peak kept apart.
//!
//! The value is constant over each pair of patches. What the straight-through patch holds above its neighbours is the
//! gap, a delta like [`crate::sheet::Sheet::gap`]; the rest is the floor and the skirt. [`Tabulated::packed`] is the same for a
//! renderer in single precision, on CPU and GPU.

use super::Refused;
use super::klems::{Kind, Klems, Patch};
use crate::vec3::Vec3;
use std::f64::consts::{FRAC_PI_2, TAU};

/// The tables of one band, both sides.
#[derive(Clone, Debug)]
pub struct Tabulated {
    patches: Vec<Patch>,
    /// First patch of each ring, then the number of patches.
    rings: Vec<usize>,
    /// For light from the front, from the back: transmission and reflection, row = outgoing, column = incident.
    tables: [[Vec<f64>; 2]; 2],
    /// Straight-through share of each incident patch, for light from the front, from the back.
    gaps: [Vec<f64>; 2],
    /// For a viewer in front, behind: running sums of f·Ω over incident patches, those of transmitted light first.
    sums: [Vec<f64>; 2],
}

/// 0 in front (z ≥ 0), 1 behind.
fn side(w: Vec3<f64>) -> usize {
    usize::from(w.z < 0.0)
}

impl Tabulated {
    /// From the blocks of a band. A side that the file lacks behaves as the other; without reflection it is black.
    ///
    /// # Errors
    /// A sentence when the band has no transmission.
    pub fn new(file: &Klems, band: &str) -> Result<Self, Refused> {
        let n = file.patches.len();
        let get = |a: Kind, b: Kind| {
            file.block(band, a)
                .or_else(|| file.block(band, b))
                .map(|b| b.values.clone())
        };
        let table = |transmit: [Kind; 2], reflect: [Kind; 2]| {
            let t = get(transmit[0], transmit[1]).ok_or_else(|| {
                Refused::new(format!("the file has no transmission in the band {band:?}"))
            })?;
            let r = get(reflect[0], reflect[1]).unwrap_or_else(|| vec![0.0; n * n]);
            // Noise below zero is no light.
            Ok([t, r].map(|m| m.into_iter().map(|x| x.max(0.0)).collect::<Vec<f64>>()))
        };
        use Kind::{ReflectionBack, ReflectionFront, TransmissionBack, TransmissionFront};
        let mut tables = [
            table(
                [TransmissionFront, TransmissionBack],
                [ReflectionFront, ReflectionBack],
            )?,
            table(
                [TransmissionBack, TransmissionFront],
                [ReflectionBack, ReflectionFront],
            )?,
        ];
        let gaps = [0, 1].map(|light| take_peaks(&file.patches, &mut tables[light][0]));
        let mut rings: Vec<usize> = (0..n)
            .filter(|&i| i == 0 || file.patches[i].theta_lo != file.patches[i - 1].theta_lo)
            .collect();
        rings.push(n);
        let mut out = Tabulated {
            patches: file.patches.clone(),
            rings,
            tables,
            gaps,
            sums: [vec![], vec![]],
        };
        out.sums = [0, 1].map(|viewer| out.running_sums(viewer));
        Ok(out)
    }

    /// The table for a renderer: 32-bit words, of which all but the counts are bits of `f32`. With n patches in r rings:
    ///
    /// | words | what |
    /// |---|---|
    /// | 0, 1 | n, r |
    /// | 2 + 3 i … | ring i: sin² of its greatest θ, its first patch, how many it has (their centres from φ = 0 on) |
    /// | then 4 n² | f in 1/sr by side of the light, transmission or reflection, outgoing and incident patch |
    /// | then 2 n | gap by side of the light and incident patch |
    /// | then 4 n² | running sums of f·Ω by side of the viewer, outgoing patch and incident patch (n of the other side first) |
    ///
    /// Light comes in a patch by the way it travels; see [`super::klems`].
    pub fn packed(&self) -> Vec<u32> {
        let n = self.patches.len();
        let bits = |x: f64| (x as f32).to_bits();
        let mut out = vec![n as u32, self.rings.len() as u32 - 1];
        for ring in self.rings.windows(2) {
            let edge = self.patches[ring[0]].theta_hi.sin().powi(2);
            out.extend([bits(edge), ring[0] as u32, (ring[1] - ring[0]) as u32]);
        }
        let numbers = self
            .tables
            .iter()
            .flatten()
            .chain(&self.gaps)
            .chain(&self.sums);
        out.extend(numbers.flatten().map(|x| bits(*x)));
        out
    }

    /// Mean share of an even light that is scattered through, and back: the two sides' mean.
    pub fn means(&self) -> [f64; 2] {
        let n = self.patches.len();
        let mut out = [0.0; 2];
        for sums in &self.sums {
            for (o, p) in self.patches.iter().enumerate() {
                let row = &sums[o * 2 * n..][..2 * n];
                let share = p.projected_solid_angle() / std::f64::consts::TAU;
                out[0] += share * row[n - 1];
                out[1] += share * (row[2 * n - 1] - row[n - 1]);
            }
        }
        out
    }

    fn running_sums(&self, viewer: usize) -> Vec<f64> {
        let n = self.patches.len();
        let mut sums = Vec::with_capacity(2 * n * n);
        for o in 0..n {
            let mut sum = 0.0;
            for k in 0..2 * n {
                let (light, kind) = if k < n { (1 - viewer, 0) } else { (viewer, 1) };
                sum += self.tables[light][kind][o * n + k % n]
                    * self.patches[k % n].projected_solid_angle();
                sums.push(sum);
            }
        }
        sums
    }

    /// The patch of a point (θ from the normal, φ).
    fn patch(&self, theta: f64, phi: f64) -> usize {
        let theta = theta.min(FRAC_PI_2);
        let ring = (0..self.rings.len() - 1)
            .find(|&r| theta <= self.patches[self.rings[r]].theta_hi)
            .unwrap_or(self.rings.len() - 2);
        let (first, n) = (self.rings[ring], self.rings[ring + 1] - self.rings[ring]);
        first + (phi.rem_euclid(TAU) / TAU * n as f64).round() as usize % n
    }
    /// The patch of the direction to the light: light travels along -l.
    fn incident(&self, l: Vec3<f64>) -> usize {
        self.patch(l.x.hypot(l.y).atan2(l.z.abs()), (-l.y).atan2(-l.x))
    }
    fn outgoing(&self, v: Vec3<f64>) -> usize {
        self.patch(v.x.hypot(v.y).atan2(v.z.abs()), v.y.atan2(v.x))
    }

    /// The share of a beam along `w` (towards the light) that passes straight on.
    pub fn gap(&self, w: Vec3<f64>) -> f64 {
        self.gaps[side(w)][self.incident(w)]
    }
    /// f(l, v) in 1/sr without the gap.
    pub fn eval(&self, l: Vec3<f64>, v: Vec3<f64>) -> f64 {
        let kind = usize::from(side(l) == side(v));
        self.tables[side(l)][kind][self.outgoing(v) * self.patches.len() + self.incident(l)]
    }
    /// ∫ f(l, v) |cosθ_l| dω_l for the viewer `v`: what an even light of radiance 1 all around looks like, gap apart.
    pub fn albedo(&self, v: Vec3<f64>) -> f64 {
        let n = 2 * self.patches.len();
        self.sums[side(v)][self.outgoing(v) * n + n - 1]
    }
    /// Density of [`Tabulated::sample`] per solid angle: f |cosθ|/albedo, exactly.
    pub fn pdf(&self, wo: Vec3<f64>, wi: Vec3<f64>) -> f64 {
        let albedo = self.albedo(wo);
        if albedo > 0.0 {
            self.eval(wi, wo) * wi.z.abs() / albedo
        } else {
            0.0
        }
    }
    /// A direction to the light for the viewer `wo`, drawn in proportion to f |cosθ|; none where the table is black.
    pub fn sample(&self, wo: Vec3<f64>, u: [f64; 3]) -> Option<Vec3<f64>> {
        let n = self.patches.len();
        let row = &self.sums[side(wo)][self.outgoing(wo) * 2 * n..][..2 * n];
        let total = row[2 * n - 1];
        if total <= 0.0 {
            return None;
        }
        let k = row.partition_point(|&s| s <= u[2] * total).min(2 * n - 1);
        let (theta, phi) = self.patches[k % n].at(u[0], u[1]);
        let w = Vec3::from_angles(theta, phi);
        // Transmitted light comes from the other side.
        let z = if (k < n) == (wo.z < 0.0) { w.z } else { -w.z };
        Some(Vec3::new(-w.x, -w.y, z))
    }
}

/// Takes from each diagonal value what it holds above the mean of its neighbours (centres within 1.6 times the spacing
/// of the rings) and gives it as a share of the beam.
fn take_peaks(patches: &[Patch], table: &mut [f64]) -> Vec<f64> {
    let n = patches.len();
    let center = |p: &Patch| Vec3::from_angles(p.theta(), p.phi);
    let mut out = Vec::with_capacity(n);
    for (i, p) in patches.iter().enumerate() {
        let reach = (1.6
            * (p.theta_hi - p.theta_lo).max(p.theta_hi - p.theta())
            * if i == 0 { 2.0 } else { 1.0 })
        .min(0.6);
        let near: Vec<f64> = (0..n)
            .filter(|&o| o != i && center(p).dot(center(&patches[o])) > reach.cos())
            .map(|o| table[o * n + i])
            .collect();
        let around = near.iter().sum::<f64>() / near.len().max(1) as f64;
        let peak = if near.is_empty() {
            0.0
        } else {
            (table[i * n + i] - around).max(0.0)
        };
        table[i * n + i] -= peak;
        out.push((peak * p.projected_solid_angle()).min(1.0));
    }
    out
}
