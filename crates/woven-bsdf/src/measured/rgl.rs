//! RGL `.bsdf`: measured reflectance of the EPFL material database (Dupuy and Jakob 2018), isotropic or anisotropic.
//!
//! The file holds, over the direction to one side (φ_i, θ_i), a warp from the unit square to microfacet normals (`vndf`)
//! and the measured values over that square (`rgb` or `spectra`), so that the samples sit where the material scatters:
//! f cosθ_o = values(warp⁻¹(m)) D(m)/(4 σ(i)), m the half vector at (√(2θ_m/π), φ_m/2π + ½), D `ndf`, σ `sigma`.

mod warp;

use super::tensor_file::{Field, fields};
use super::{Refused, read_bytes_at_most};
use crate::vec3::Vec3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::path::Path;
use warp::{Grid, Slices, Warp};

/// Largest file: the numbers are kept once and summed twice, which stays below 512 MiB.
const LIMIT: u64 = 100 << 20;

/// One material.
#[derive(Clone, Debug)]
pub struct Rgl {
    /// What the file says of itself.
    pub description: String,
    /// Wavelengths in nm; empty when the channels are red, green and blue.
    pub wavelengths: Vec<f64>,
    channels: usize,
    phi: Vec<f64>,
    theta: Vec<f64>,
    /// How many times the measured sector repeats in a full turn; 0 for isotropic materials.
    reduction: u32,
    jacobian: bool,
    ndf: Grid,
    sigma: Grid,
    vndf: Warp,
    values: Grid,
}

impl Rgl {
    /// Reads a file.
    ///
    /// # Errors
    /// A sentence that names the file and what is wrong with it.
    pub fn read(path: &Path) -> Result<Self, Refused> {
        Self::parse(&read_bytes_at_most(path, LIMIT)?)
            .map_err(|e| Refused::new(format!("{}: {e}", path.display())))
    }

    /// Reads the bytes of a file.
    ///
    /// # Errors
    /// A sentence when a field is missing, lies outside the file, or its shape does not fit the others.
    pub fn parse(bytes: &[u8]) -> Result<Self, Refused> {
        let fields = fields(bytes)?;
        let field = |name: &str| {
            fields
                .iter()
                .find(|f| f.name == name)
                .ok_or_else(|| Refused::new(format!("the file has no field {name:?}")))
        };
        let axis = |name: &str| -> Result<Vec<f64>, Refused> {
            let out: Vec<f64> = field(name)?
                .floats()?
                .iter()
                .map(|x| f64::from(*x))
                .collect();
            if out.is_empty() || out.windows(2).any(|p| p[0] >= p[1]) {
                return Err(Refused::new(format!("the numbers of {name:?} do not rise")));
            }
            Ok(out)
        };
        let (phi, theta) = (axis("phi_i")?, axis("theta_i")?);
        let wavelengths = if field("wavelengths").is_ok() {
            axis("wavelengths")?
        } else {
            vec![]
        };
        let values = field(if wavelengths.is_empty() {
            "rgb"
        } else {
            "spectra"
        })?;
        let channels = if wavelengths.is_empty() {
            3
        } else {
            wavelengths.len()
        };
        let jacobian = field("jacobian")?.bytes()?.first().is_some_and(|b| *b != 0);
        let description = String::from_utf8_lossy(field("description")?.bytes()?).into_owned();
        let incidences = [phi.len(), theta.len()];
        let reduction = match phi[..] {
            [_] | [_, _] => 0,
            [first, .., last] => (TAU / (last - first)).round().clamp(1.0, 4.0) as u32,
            [] => unreachable!("axes are not empty"),
        };
        Ok(Rgl {
            ndf: grid(field("ndf")?, &[])?,
            sigma: grid(field("sigma")?, &[])?,
            vndf: Warp::new(grid(field("vndf")?, &incidences)?),
            values: grid(values, &[phi.len(), theta.len(), channels])?,
            description,
            wavelengths,
            channels,
            phi,
            theta,
            reduction,
            jacobian,
        })
    }

    /// Number of colours or wavelengths.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// The BRDF in 1/sr of a channel; 0 for light or viewer behind the surface.
    pub fn eval(&self, l: Vec3<f64>, v: Vec3<f64>, channel: usize) -> f64 {
        if l.z <= 0.0 || v.z <= 0.0 || channel >= self.channels {
            return 0.0;
        }
        let (mut i, mut o) = (l, v);
        if self.reduction >= 2 {
            // The measured sector has y ≤ 0 (and x ≤ 0 when it is a quarter).
            let flip = |a: f64| if a >= 0.0 { -1.0 } else { 1.0 };
            let sy = flip(l.y);
            let sx = if self.reduction == 4 { flip(l.x) } else { sy };
            (i.x, i.y, o.x, o.y) = (l.x * sx, l.y * sy, v.x * sx, v.y * sy);
        }
        let m = (i + o).normalize();
        let ((theta_i, phi_i), (theta_m, phi_m)) = (i.to_angles(), m.to_angles());
        let turned = if self.reduction == 0 {
            phi_m - phi_i
        } else {
            phi_m
        };
        let unit = |theta: f64, phi: f64| {
            (
                (theta / FRAC_PI_2).max(0.0).sqrt(),
                ((phi + PI) / TAU).rem_euclid(1.0),
            )
        };
        let (mx, my) = unit(theta_m, turned);
        let slices = self.slices(phi_i, theta_i);
        let (x, y) = self.vndf.invert(&slices, mx, my);
        let of_channel = slices.map(|(s, w)| (s * self.channels + channel, w));
        let mut f = self.values.eval(&of_channel, x, y);
        if self.jacobian {
            let (sx, sy) = unit(theta_i, phi_i);
            let sigma = self.sigma.eval(&[(0, 1.0)], sx, sy);
            f *= self.ndf.eval(&[(0, 1.0)], mx, my) / (4.0 * sigma).max(1e-9);
        }
        (f / v.z).max(0.0)
    }

    /// The four incidences around (φ, θ) with their shares.
    fn slices(&self, phi: f64, theta: f64) -> Slices {
        let of = |axis: &[f64], x: f64| {
            let i = axis
                .partition_point(|a| *a <= x)
                .clamp(1, axis.len().max(2) - 1)
                - 1;
            match axis.get(i + 1) {
                Some(next) => (i, ((x - axis[i]) / (next - axis[i])).clamp(0.0, 1.0)),
                None => (i, 0.0),
            }
        };
        let ((p, a), (t, b)) = (of(&self.phi, phi), of(&self.theta, theta));
        let mut out = [(0, 0.0); 4];
        for (k, slot) in out.iter_mut().enumerate() {
            let (dp, dt) = (k / 2, k % 2);
            let w = (if dp == 1 { a } else { 1.0 - a }) * (if dt == 1 { b } else { 1.0 - b });
            let (p, t) = (
                (p + dp).min(self.phi.len() - 1),
                (t + dt).min(self.theta.len() - 1),
            );
            *slot = (p * self.theta.len() + t, w);
        }
        out
    }
}

/// A field whose shape is `leading`, then the height and the width of each slice.
fn grid(field: &Field<'_>, leading: &[usize]) -> Result<Grid, Refused> {
    let n = leading.len();
    if field.shape.len() != n + 2
        || field.shape[..n] != *leading
        || field.shape[n..].iter().any(|s| *s < 2)
    {
        return Err(Refused::new(format!(
            "the field {:?} has the shape {:?} where {leading:?} and a grid of 2 × 2 or more are needed",
            field.name, field.shape
        )));
    }
    Ok(Grid {
        width: field.shape[n + 1],
        height: field.shape[n],
        values: field.floats()?,
    })
}
