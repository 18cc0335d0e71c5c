//! The Klems full basis: 145 patches of a hemisphere (Klems 1994; the LBNL WINDOW program).

use std::f64::consts::PI;
use woven_bsdf::measured::klems_write::RINGS;

/// One patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch {
    /// Polar angle of the centre, degrees.
    pub theta: f64,
    /// Azimuth of the centre, degrees in 0..360.
    pub phi: f64,
    /// Projected solid angle, sr.
    pub projected: f64,
}

/// The patches in the order of the basis.
pub fn patches() -> impl Iterator<Item = Patch> {
    RINGS.into_iter().flat_map(|(low, high, count)| {
        let n = f64::from(count);
        let square_sine = |deg: f64| deg.to_radians().sin().powi(2);
        let ring = PI * (square_sine(high) - square_sine(low));
        (0..count).map(move |k| Patch {
            theta: centre(low, high),
            phi: f64::from(k) * 360.0 / n,
            projected: ring / n,
        })
    })
}

/// Polar angle of the centre of a ring, degrees; the first ring is a cap.
pub fn centre(low: f64, high: f64) -> f64 {
    if low == 0.0 { 0.0 } else { (low + high) / 2.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_patches_fill_the_hemisphere() {
        assert_eq!(patches().count(), 145);
        let whole: f64 = patches().map(|p| p.projected).sum();
        assert!((whole - PI).abs() < 1e-12, "{whole}");
    }
}
