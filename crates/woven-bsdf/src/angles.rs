//! Where degrees become radians: at the edges, here, and nowhere else.

use std::f64::consts::PI;

/// Degrees to radians.
pub fn radians(deg: f64) -> f64 {
    deg * (PI / 180.0)
}

/// Radians to degrees.
pub fn degrees(rad: f64) -> f64 {
    rad * (180.0 / PI)
}
