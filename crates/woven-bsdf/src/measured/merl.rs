//! MERL `.binary`: measured isotropic reflectance in three colours (Matusik et al. 2003).
//!
//! Three little-endian `i32` (bins of θ_h, θ_d, φ_d: 90, 90, 180 in the database), then as many `f64` for red, green and
//! blue, φ_d fastest. θ_h is binned by its square root, φ_d covers half a turn (the rest by reciprocity). A stored
//! number times 1/1500, 1.15/1500, 1.66/1500 is the BRDF in 1/sr; a negative one was not measured and counts as 0.

use super::{Refused, read_bytes};
use crate::vec3::Vec3;
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

/// What a stored number is multiplied with, per colour.
const SCALE: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];

/// One material.
#[derive(Clone, Debug, PartialEq)]
pub struct Merl {
    /// Bins of θ_h, θ_d, φ_d.
    dims: [usize; 3],
    /// Colour by colour, φ_d fastest; as stored, rounded to single precision.
    values: Vec<f32>,
}

impl Merl {
    /// Reads a file.
    ///
    /// # Errors
    /// A sentence that names the file and what is wrong with it.
    pub fn read(path: &Path) -> Result<Self, Refused> {
        Self::parse(&read_bytes(path)?)
            .map_err(|e| Refused::new(format!("{}: {e}", path.display())))
    }

    /// Reads the bytes of a file. The size is checked before anything is allocated.
    ///
    /// # Errors
    /// A sentence when the header and the number of bytes disagree or a number is not finite.
    pub fn parse(bytes: &[u8]) -> Result<Self, Refused> {
        let Some((header, data)) = bytes.split_at_checked(12) else {
            return Err(Refused::new(format!(
                "{} bytes are no MERL file: its header alone has 12",
                bytes.len()
            )));
        };
        let dims: [i32; 3] =
            std::array::from_fn(|i| i32::from_le_bytes(std::array::from_fn(|k| header[4 * i + k])));
        let wrong = || {
            Refused::new(format!(
                "the header asks for 3 × {} × {} × {} numbers of 8 bytes, but {} bytes follow; the file is cut off or no MERL file",
                dims[0],
                dims[1],
                dims[2],
                data.len()
            ))
        };
        let mut count = 3usize;
        for d in dims {
            let d = usize::try_from(d)
                .ok()
                .filter(|d| *d > 0)
                .ok_or_else(wrong)?;
            count = count.checked_mul(d).ok_or_else(wrong)?;
        }
        if count.checked_mul(8) != Some(data.len()) {
            return Err(wrong());
        }
        let mut values = Vec::with_capacity(count);
        for (i, number) in data.chunks_exact(8).enumerate() {
            let x = f64::from_le_bytes(std::array::from_fn(|k| number[k]));
            if x.is_nan() || x.abs() >= 1e30 {
                return Err(Refused::new(format!(
                    "number {} of the table is {x}; a reflectance is finite",
                    i + 1
                )));
            }
            values.push(x as f32);
        }
        Ok(Merl {
            dims: dims.map(|d| d as usize),
            values,
        })
    }

    /// Bins of θ_h, θ_d, φ_d.
    pub fn dims(&self) -> [usize; 3] {
        self.dims
    }

    /// The BRDF in 1/sr for red, green, blue; zeros for light or viewer behind the surface. Constant over each bin.
    pub fn eval(&self, l: Vec3<f64>, v: Vec3<f64>) -> [f64; 3] {
        if l.z <= 0.0 || v.z <= 0.0 {
            return [0.0; 3];
        }
        let (theta_h, theta_d, phi_d) = half_difference(l, v);
        let bin = |share: f64, n: usize| ((share * n as f64) as usize).min(n - 1);
        let [n_h, n_d, n_p] = self.dims;
        let place = [
            bin((theta_h / FRAC_PI_2).max(0.0).sqrt(), n_h),
            bin(theta_d / FRAC_PI_2, n_d),
            bin(phi_d.rem_euclid(PI) / PI, n_p),
        ];
        let at = (place[0] * n_d + place[1]) * n_p + place[2];
        std::array::from_fn(|c| {
            f64::from(self.values[c * n_h * n_d * n_p + at]).max(0.0) * SCALE[c]
        })
    }
}

/// Rusinkiewicz 1998: polar angle of the half vector, then polar angle and azimuth of the light as seen from it.
pub fn half_difference(l: Vec3<f64>, v: Vec3<f64>) -> (f64, f64, f64) {
    let h = (l + v).normalize();
    let sin_h = h.x.hypot(h.y);
    let (c, s) = if sin_h > 1e-12 {
        (h.x / sin_h, h.y / sin_h)
    } else {
        (1.0, 0.0)
    };
    // Turned by -φ_h about z, then by -θ_h about y.
    let (x, y) = (l.x * c + l.y * s, l.y * c - l.x * s);
    let d = Vec3::new(x * h.z - l.z * sin_h, y, x * sin_h + l.z * h.z);
    (sin_h.atan2(h.z), d.x.hypot(d.y).atan2(d.z), d.y.atan2(d.x))
}
