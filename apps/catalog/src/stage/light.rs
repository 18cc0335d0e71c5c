//! The light on the stage: noon with sun and sky outside, evening with lamps inside and dusk outside, or all of it for mixing.

use glam::Vec3;
use serde::{Deserialize, Serialize};
use woven_render::scene::{Environment, LAYER_SKY, LAYER_SUN, Light};

/// A light setting of the stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Preset {
    /// Sun and sky outside the window, lamps off.
    Day,
    /// Lamps inside, the last light of dusk outside.
    Evening,
    /// Sun, sky and lamps together, each to be kept in a layer of its own and mixed afterwards.
    All,
}

impl Preset {
    /// The two settings of a catalog page.
    pub const CATALOG: [Self; 2] = [Self::Day, Self::Evening];

    /// The name used in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Day => "day",
            Self::Evening => "evening",
            Self::All => "all",
        }
    }

    /// The name used on the page.
    #[must_use]
    pub const fn title(self) -> &'static str {
        match self {
            Self::Day => "Day",
            Self::Evening => "Evening",
            Self::All => "All lights",
        }
    }

    /// Stops by which the picture is brighter than radiance 1 = white.
    #[must_use]
    pub const fn exposure(self) -> f32 {
        match self {
            Self::Day | Self::All => 2.0,
            Self::Evening => 2.4,
        }
    }

    pub(super) const fn lamps(self) -> [f32; 3] {
        match self {
            Self::Day => [0.0; 3],
            Self::Evening => LAMPS,
            Self::All => [
                LAMPS[0] * LAMP_BOOST,
                LAMPS[1] * LAMP_BOOST,
                LAMPS[2] * LAMP_BOOST,
            ],
        }
    }

    /// Radiance of the window behind the eye, a share of the sky's.
    pub(super) fn far_window(self) -> [f32; 3] {
        let scale = self.sky_scale();
        [0, 1, 2].map(|c| FAR_WINDOW[c] * scale[c])
    }

    fn sky_scale(self) -> [f32; 3] {
        if self == Self::Evening {
            DUSK
        } else {
            [1.0; 3]
        }
    }

    pub(super) fn sun(self) -> Option<Light> {
        let light = Light::Sun {
            direction: sun_direction(),
            irradiance: SUN,
            angular_radius: 0.0047,
            layer: LAYER_SUN,
        };
        (self != Self::Evening).then_some(light)
    }

    pub(super) fn sky(self) -> Environment {
        Environment {
            scale: self.sky_scale(),
            ..bake(128, 64, day_sky)
        }
    }
}

/// Radiance of the window behind the eye by day: sky and a bright wall across the street.
const FAR_WINDOW: [f32; 3] = [1.35, 1.45, 1.6];
/// Radiance of the lamp shades: warm white, about 3500 K, as an eye half adapted to it sees 2800 K.
const LAMPS: [f32; 3] = [2.7, 1.92, 1.18];
/// With all lights on, the lamps are this much brighter than in the evening, so that they get their share of the paths beside the sun;
/// whoever mixes the layers takes it off again.
pub const LAMP_BOOST: f32 = 8.0;
/// Irradiance of the sun on a surface that faces it; the sky's radiance is about 1, so the ratio is that of a day with thin haze.
const SUN: [f32; 3] = [5.2, 4.8, 4.2];
/// The dusk sky as a share of the day's, a deep blue: evening is lamps + this share of the sky's layer.
pub const DUSK: [f32; 3] = [0.016, 0.028, 0.060];

/// Unit vector to the sun: high on the right, outside the window.
#[must_use]
pub fn sun_direction() -> Vec3 {
    Vec3::new(0.50, 0.66, -0.72).normalize()
}

/// A clear sky without the sun's disc: deeper blue above, milky at the horizon and around the sun.
fn day_sky(d: Vec3) -> Vec3 {
    let up = d.y.max(0.0);
    let zenith = Vec3::new(0.30, 0.52, 0.98);
    let horizon = Vec3::new(1.02, 1.12, 1.22);
    let sky = horizon.lerp(zenith, 1.0 - (-3.2 * up).exp());
    let aureole = Vec3::new(1.3, 1.22, 1.08) * ((d.dot(sun_direction()) - 1.0) * 9.0).exp();
    if d.y < 0.0 {
        Vec3::new(0.20, 0.22, 0.17)
    } else {
        sky + aureole
    }
}

/// A latitude-longitude picture of `radiance` in the convention of [`Environment`].
fn bake(width: u32, height: u32, radiance: impl Fn(Vec3) -> Vec3) -> Environment {
    let mut pixels = Vec::with_capacity((width * height) as usize);
    for y in 0..height {
        let (sin, cos) = ((y as f32 + 0.5) / height as f32 * std::f32::consts::PI).sin_cos();
        for x in 0..width {
            let phi = ((x as f32 + 0.5) / width as f32 - 0.5) * std::f32::consts::TAU;
            pixels.push(radiance(Vec3::new(sin * phi.sin(), cos, -sin * phi.cos())).to_array());
        }
    }
    Environment {
        width,
        height,
        pixels,
        rotation: 0.0,
        scale: [1.0; 3],
        layer: LAYER_SKY,
    }
}
