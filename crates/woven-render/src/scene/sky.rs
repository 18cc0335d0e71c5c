//! Clear sky and sun by date, time and place: Preetham, Shirley, Smits, "A Practical Analytic Model for Daylight" (1999).
//!
//! In the scene -Z is north, +X east, +Y up. Light is radiometric: luminance \[cd/m²\] divided by 179 lm/W, the efficacy
//! of daylight that Ward's Radiance uses, so a clear noon has a sky of some 30 W/(sr m²) and a sun of some 500 W/m².
//! The sun is a light of its own and not in the picture of the sky.

mod spectrum;
mod time;

pub use time::{DateTime, SunPosition, sun_position};

use super::{Environment, LAYER_SKY, LAYER_SUN, Light};
use crate::compare::color::rgb_of_xyz;
use anyhow::{Result, ensure};
use glam::Vec3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Luminous efficacy of daylight \[lm/W\], as in Radiance.
pub const EFFICACY: f64 = 179.0;
/// Half the angle of the sun's disc.
pub const SUN_RADIUS: f32 = 0.004_65;
/// Share of light that the ground below the horizon returns.
const GROUND_ALBEDO: f64 = 0.2;
/// Height of the sun in radians from which the sky fades to nothing at -12 degrees: the model ends at the horizon.
const NIGHT: f64 = -12.0 * PI / 180.0;

/// The sky of one moment.
#[derive(Clone, Copy, Debug)]
pub struct Day {
    sun: Vec3,
    elevation: f64,
    turbidity: f64,
    /// Zenith values of Y \[kcd/m²\], x, y.
    zenith: [f64; 3],
    /// Perez coefficients A..E of Y, x, y.
    perez: [[f64; 5]; 3],
    /// 1 in daylight, falling to 0 through twilight.
    fade: f64,
}

/// Linear map of the turbidity for each Perez coefficient, appendix A.2.
const PEREZ: [[[f64; 2]; 5]; 3] = [
    [
        [0.1787, -1.4630],
        [-0.3554, 0.4275],
        [-0.0227, 5.3251],
        [0.1206, -2.5771],
        [-0.0670, 0.3703],
    ],
    [
        [-0.0193, -0.2592],
        [-0.0665, 0.0008],
        [-0.0004, 0.2125],
        [-0.0641, -0.8989],
        [-0.0033, 0.0452],
    ],
    [
        [-0.0167, -0.2608],
        [-0.0950, 0.0092],
        [-0.0079, 0.2102],
        [-0.0441, -1.6537],
        [-0.0109, 0.0529],
    ],
];

/// Zenith chromaticity, appendix A.2: rows T², T, 1; columns θ³, θ², θ, 1.
const ZENITH_X: [[f64; 4]; 3] = [
    [0.001_66, -0.003_75, 0.002_09, 0.0],
    [-0.029_03, 0.063_77, -0.032_02, 0.003_94],
    [0.116_93, -0.211_96, 0.060_52, 0.258_86],
];
/// See [`ZENITH_X`].
const ZENITH_Y: [[f64; 4]; 3] = [
    [0.002_75, -0.006_10, 0.003_17, 0.0],
    [-0.042_14, 0.089_70, -0.041_53, 0.005_16],
    [0.153_46, -0.267_56, 0.066_70, 0.266_88],
];

impl Day {
    /// The sky at a date and time, at a place in degrees (north and east positive).
    ///
    /// # Errors
    /// A sentence when the turbidity is outside 1.7..=10, for which the model was made.
    pub fn new(when: &DateTime, latitude: f64, longitude: f64, turbidity: f64) -> Result<Self> {
        let p = sun_position(when, latitude, longitude);
        Self::with_sun(p.azimuth, p.elevation, turbidity)
    }

    /// The sky for a sun at an azimuth (from north over east) and elevation, in radians.
    ///
    /// # Errors
    /// As [`Day::new`].
    pub fn with_sun(azimuth: f64, elevation: f64, turbidity: f64) -> Result<Self> {
        ensure!(
            (1.7..=10.0).contains(&turbidity),
            "a turbidity of {turbidity} is not in 1.7 (very clear) to 10 (very hazy)"
        );
        let sun = Vec3::new(
            (azimuth.sin() * elevation.cos()) as f32,
            elevation.sin() as f32,
            (-azimuth.cos() * elevation.cos()) as f32,
        );
        let t = turbidity;
        // Below the horizon the sky keeps the shape it has at sunset and fades.
        let theta = FRAC_PI_2 - elevation.max(0.0);
        let chi = (4.0 / 9.0 - t / 120.0) * (PI - 2.0 * theta);
        let luminance = ((4.0453 * t - 4.9710) * chi.tan() - 0.2155 * t + 2.4192).max(0.0);
        let chroma = |m: &[[f64; 4]; 3]| {
            let row = |r: &[f64; 4]| ((r[0] * theta + r[1]) * theta + r[2]) * theta + r[3];
            (row(&m[0]) * t + row(&m[1])) * t + row(&m[2])
        };
        let fade = if elevation >= 0.0 {
            1.0
        } else {
            ((NIGHT - elevation) / NIGHT).clamp(0.0, 1.0).powi(4)
        };
        Ok(Day {
            sun,
            elevation,
            turbidity,
            zenith: [luminance, chroma(&ZENITH_X), chroma(&ZENITH_Y)],
            perez: PEREZ.map(|c| c.map(|[a, b]| a * t + b)),
            fade,
        })
    }

    /// Unit vector to the sun.
    pub fn sun_direction(&self) -> Vec3 {
        self.sun
    }

    /// Luminance \[cd/m²\] and chromaticity x, y of the sky in a direction above the horizon.
    pub fn luminance(&self, direction: Vec3) -> [f64; 3] {
        let cos_theta = f64::from(direction.y).max(1e-3);
        // Twilight keeps the sunset's shape.
        let sun = Vec3::new(self.sun.x, self.sun.y.max(0.0), self.sun.z).normalize_or(Vec3::Y);
        let gamma = f64::from(direction.dot(sun)).clamp(-1.0, 1.0).acos();
        let theta_s = FRAC_PI_2 - self.elevation.clamp(0.0, FRAC_PI_2);
        let f = |[a, b, c, d, e]: [f64; 5], cos_theta: f64, gamma: f64| {
            (1.0 + a * (b / cos_theta).exp())
                * (1.0 + c * (d * gamma).exp() + e * gamma.cos().powi(2))
        };
        let value = |k: usize| {
            self.zenith[k] * f(self.perez[k], cos_theta, gamma) / f(self.perez[k], 1.0, theta_s)
        };
        [value(0).max(0.0) * 1000.0 * self.fade, value(1), value(2)]
    }

    /// Radiance of the sky in a direction above the horizon.
    pub fn radiance(&self, direction: Vec3) -> [f32; 3] {
        let [y_lum, x, y] = self.luminance(direction);
        let scale = y_lum / EFFICACY;
        let y = y.max(1e-3);
        rgb_of_xyz([x / y * scale, scale, (1.0 - x - y) / y * scale]).map(|v| v.max(0.0) as f32)
    }

    /// Irradiance of the sun on a surface that faces it; black when it is down.
    pub fn sun_irradiance(&self) -> [f32; 3] {
        if self.elevation <= -f64::from(SUN_RADIUS) {
            return [0.0; 3];
        }
        rgb_of_xyz(spectrum::sun_xyz(self.elevation.max(0.0), self.turbidity))
            .map(|v| (v / EFFICACY).max(0.0) as f32)
    }

    /// The sky as an environment of `width` x `width`/2 pixels, its lower half lit ground of albedo 0.2; and the sun,
    /// when it is up.
    pub fn bake(&self, width: u32) -> (Environment, Option<Light>) {
        let (width, height) = (width.max(4), (width / 2).max(2));
        let mut pixels = vec![[0.0_f32; 3]; (width * height) as usize];
        let mut horizontal = [0.0_f64; 3];
        for row in 0..height / 2 {
            let theta = PI * (f64::from(row) + 0.5) / f64::from(height);
            let solid = TAU / f64::from(width) * (PI / f64::from(height)) * theta.sin();
            for column in 0..width {
                let phi = TAU * ((f64::from(column) + 0.5) / f64::from(width) - 0.5);
                let d = Vec3::new(
                    (theta.sin() * phi.sin()) as f32,
                    theta.cos() as f32,
                    (-theta.sin() * phi.cos()) as f32,
                );
                let light = self.radiance(d);
                pixels[(row * width + column) as usize] = light;
                for c in 0..3 {
                    horizontal[c] += f64::from(light[c]) * theta.cos() * solid;
                }
            }
        }
        let sun = self.sun_irradiance();
        let up = f64::from(self.sun.y).max(0.0);
        let ground = [0, 1, 2]
            .map(|c| ((horizontal[c] + f64::from(sun[c]) * up) * GROUND_ALBEDO / PI) as f32);
        pixels[(height / 2 * width) as usize..].fill(ground);
        let environment = Environment {
            width,
            height,
            pixels,
            rotation: 0.0,
            scale: [1.0; 3],
            layer: LAYER_SKY,
        };
        let light = (sun[1] > 0.0).then_some(Light::Sun {
            direction: self.sun,
            irradiance: sun,
            angular_radius: SUN_RADIUS,
            layer: LAYER_SUN,
        });
        (environment, light)
    }
}

/// The sun turned about the vertical with its environment (counter-clockwise seen from above) and scaled.
pub fn turned(light: Light, angle: f32, scale: f32) -> Light {
    match light {
        Light::Sun {
            direction,
            irradiance,
            angular_radius,
            layer,
        } => Light::Sun {
            direction: glam::Quat::from_rotation_y(angle) * direction,
            irradiance: irradiance.map(|v| v * scale),
            angular_radius,
            layer,
        },
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zenith_luminance_is_the_formula_worked_out_by_hand() {
        // T = 3, sun at the zenith angle 40°: chi = (4/9 - 1/40) (pi - 2·0.698132) = 0.732069, tan = 0.898608;
        // Y_z = (12.1359 - 4.971) · 0.898608 - 0.6465 + 2.4192 = 8.2111 kcd/m².
        let day = Day::with_sun(0.0, 50.0_f64.to_radians(), 3.0).unwrap();
        let up = day.luminance(Vec3::Y);
        assert!((up[0] - 8211.4).abs() < 0.5, "{up:?}");
    }

    #[test]
    fn a_clear_noon_has_the_light_that_books_give() {
        // Sun at 60°: measured clear skies give 10-20 klx on the ground, and Preetham's is known to be some 40 % brighter;
        // the sun gives 80-110 klx at normal incidence.
        let day = Day::with_sun(PI, 60.0_f64.to_radians(), 2.5).unwrap();
        let (env, sun) = day.bake(128);
        let lum = |c: [f32; 3]| 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
        let mut e = 0.0_f64;
        for (i, p) in env.pixels.iter().enumerate().take(env.pixels.len() / 2) {
            let theta = PI * ((i / 128) as f64 + 0.5) / 64.0;
            e += f64::from(lum(*p))
                * theta.cos()
                * theta.sin()
                * (TAU / 128.0)
                * (PI / 64.0)
                * EFFICACY;
        }
        assert!((8e3..30e3).contains(&e), "sky {e} lx");
        let Some(Light::Sun {
            irradiance,
            direction,
            ..
        }) = sun
        else {
            panic!("the sun is up")
        };
        let s = f64::from(lum(irradiance)) * EFFICACY;
        assert!((75e3..115e3).contains(&s), "sun {s} lx");
        assert!(
            direction.z > 0.4 && direction.y > 0.8,
            "a southern sun is at +Z: {direction}"
        );
        // The sky is blue, the low sun red.
        assert!(env.pixels[0][2] > env.pixels[0][0]);
        let low = Day::with_sun(0.0, 0.05, 3.0).unwrap().sun_irradiance();
        assert!(
            low[0] > 3.0 * low[2] && low[0] < 0.6 * irradiance[0],
            "{low:?}"
        );
    }

    #[test]
    fn every_moment_is_finite_and_night_is_dark() {
        for t in [1.7, 3.0, 10.0] {
            for e in -18..=18 {
                let day = Day::with_sun(1.0, f64::from(e) * 5.0_f64.to_radians(), t).unwrap();
                let (env, _) = day.bake(32);
                assert!(
                    env.pixels
                        .iter()
                        .flatten()
                        .all(|v| v.is_finite() && *v >= 0.0),
                    "T {t}, {e}"
                );
                assert!(e > -3 || env.pixels.iter().flatten().all(|v| *v == 0.0));
            }
        }
        assert!(Day::with_sun(0.0, 0.5, 40.0).is_err());
    }
}
