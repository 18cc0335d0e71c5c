//! Wind through a window: von Kármán gusts in time, divergence-free turbulence in space, and the pressure on moving cloth.
//!
//! u(x, t) = jet(x) [ (U + g(t)) n + c(x - n U t, t) ]. g is a sum of cosines whose variances are the integral of
//! S(f) = 4 s² (L/U) / (1 + 70.8 (f L/U)²)^(5/6) (von Kármán 1948) over their bins, rescaled so that the sum is exactly s²
//! whatever was cut off. c is a sum of plane waves each perpendicular to its wave vector (Kraichnan 1970), so it is
//! divergence free by construction; it is carried by the mean wind (Taylor's hypothesis). Speeds in m/s, lengths in m.

mod cosine;
mod field;
mod push;
mod record;

pub use field::{Wind, von_karman};
pub use push::uniform_wind_forces;
pub(crate) use push::{AirState, Drag, air_forces, sample};
pub(crate) use record::read_record;

use serde::{Deserialize, Serialize};

/// Density of air, kg/m³.
pub const AIR_DENSITY: f64 = 1.2;
/// Time between two evaluations of the wind at the cloth, s; between them it is linear.
pub(crate) const WIND_TICK: f64 = 1.0 / 60.0;

/// The wind's description in a curtain file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WindSpec {
    /// Mean speed through the window, m/s.
    pub speed: f64,
    /// Direction of the mean wind; the curtain's plane is z = 0 and the room is at z > 0. Any length but zero.
    pub direction: [f64; 3],
    /// Gust intensity: standard deviation of the gusts through time over the mean speed.
    pub gust: f64,
    /// Length of the gusts, m (integral scale of the von Kármán spectrum).
    pub gust_length: f64,
    /// Standard deviation of the small eddies over the mean speed, per component.
    pub turbulence: f64,
    /// Size of the small eddies, m.
    pub eddy_length: f64,
    /// Seconds in which the wind rises from nothing at the start of the clip (smooth).
    pub ramp: f64,
    /// Share of the wind that the curtain lets happen: a curtain before a window dams the air up.
    pub blocking: f64,
    /// Tangential drag coefficient.
    pub tangential: f64,
    /// The window's opening; without one the wind blows everywhere alike.
    pub opening: Option<Opening>,
    /// A CSV of measured wind (`time s, speed m/s` a line), relative to the description; it replaces mean and gusts.
    pub recorded: Option<String>,
    /// The lines of that CSV: time (s, from the start of the wind) and speed (m/s); linear between, held at the ends.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub samples: Vec<[f64; 2]>,
}

/// The rectangle through which the wind enters, in the plane z = `z` (m).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Opening {
    /// Left and right edge, m; the middle of the rail is x = 0.
    pub x: [f64; 2],
    /// Lower and upper edge, m above the floor.
    pub y: [f64; 2],
    /// Plane of the window, m; negative is behind the curtain.
    #[serde(default)]
    pub z: f64,
}

impl Default for WindSpec {
    fn default() -> Self {
        Self {
            speed: 0.0,
            direction: [0.0, 0.0, 1.0],
            gust: 0.35,
            gust_length: 1.5,
            turbulence: 0.2,
            eddy_length: 0.35,
            ramp: 1.0,
            blocking: 1.0,
            tangential: 0.02,
            opening: None,
            recorded: None,
            samples: Vec::new(),
        }
    }
}
