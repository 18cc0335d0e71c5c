//! A model in the plane of incidence: the directions, the values, and where they lie on a polar plot.

use std::f64::consts::{FRAC_PI_2, PI};
use woven_bsdf::model::{self, ModelInfo, dot};
use woven_bsdf::vec3::Vec3;

/// The plane of incidence: the light's polar angle from the normal and its azimuth from the weft, both [rad].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Polar angle of the light, 0 ≤ θ < π/2.
    pub theta: f64,
    /// Azimuth of the light.
    pub phi: f64,
}

impl Plane {
    /// The direction at the angle `psi` from the normal within the plane: 0 is the normal on the light's side, θ the light
    /// itself, ±π the normal behind the sheet.
    #[must_use]
    pub fn direction(self, psi: f64) -> Vec3<f64> {
        Vec3::new(
            psi.sin() * self.phi.cos(),
            psi.sin() * self.phi.sin(),
            psi.cos(),
        )
    }
    /// The direction to the light.
    #[must_use]
    pub fn light(self) -> Vec3<f64> {
        self.direction(self.theta)
    }
    /// The angle of the light that goes straight on, in (-π, π].
    #[must_use]
    pub fn straight(self) -> f64 {
        self.theta - PI
    }
    /// The angle within the plane of a direction, and its angle out of the plane, both [rad].
    #[must_use]
    pub fn angles(self, v: Vec3<f64>) -> (f64, f64) {
        let along = v.x * self.phi.cos() + v.y * self.phi.sin();
        let across = v.y * self.phi.cos() - v.x * self.phi.sin();
        (along.atan2(v.z), across.clamp(-1.0, 1.0).asin())
    }
}

/// One value of a curve: the angle within the plane [rad] and the BSDF [1/sr].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Value {
    /// See [`Plane::direction`].
    pub psi: f64,
    /// BSDF, 1/sr.
    pub f: f64,
}

/// The BSDF all around the plane of incidence, from behind over the light's side to behind again.
///
/// `linear` holds the factors in the model's order, `shape` is prepared. The steps are finer around the straight-through
/// direction and its mirror image, where lobes can be a degree wide.
#[must_use]
pub fn curve(
    model: &ModelInfo,
    linear: &model::Linear<f64>,
    shape: &model::Shape<f64>,
    plane: Plane,
) -> Vec<Value> {
    let l = plane.light();
    let value = |psi: f64| Value {
        psi,
        f: dot(linear, &(model.f64.basis)(shape, l, plane.direction(psi))),
    };
    angles(plane)
        .into_iter()
        .map(value)
        .filter(|v| v.f.is_finite())
        .collect()
}

/// The angles of a curve, rising, none within 0.2° of grazing.
fn angles(plane: Plane) -> Vec<f64> {
    let mut out: Vec<f64> = (-180..=180).map(|d| f64::from(d).to_radians()).collect();
    for peak in [plane.straight(), -plane.theta] {
        out.extend((-60..=60).map(|i| peak + f64::from(i) * 0.1_f64.to_radians()));
    }
    out.retain(|psi| psi.abs() <= PI && (psi.abs() - FRAC_PI_2).abs() > 0.2_f64.to_radians());
    out.sort_by(f64::total_cmp);
    out.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    out
}

/// How a value becomes a distance from the middle of the plot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// The value on the outermost circle [1/sr].
    pub top: f64,
    /// Powers of ten from the middle to the outermost circle; `None`: linear.
    pub decades: Option<f64>,
}

impl Scale {
    /// A scale whose outermost circle carries a round number, at least `greatest`.
    #[must_use]
    pub fn fitting(greatest: f64, decades: Option<f64>) -> Self {
        let greatest = if greatest.is_finite() && greatest > 1e-9 {
            greatest
        } else {
            1.0
        };
        let ten = 10_f64.powf(greatest.log10().floor());
        let steps: &[f64] = if decades.is_some() {
            &[1.0, 10.0]
        } else {
            &[1.0, 1.5, 2.0, 3.0, 5.0, 7.5, 10.0]
        };
        let top = steps
            .iter()
            .map(|s| s * ten)
            .find(|t| *t >= greatest * (1.0 - 1e-9))
            .unwrap_or(10.0 * ten);
        Self { top, decades }
    }
    /// Distance from the middle, 0…1 for values up to the top.
    #[must_use]
    pub fn radius(self, f: f64) -> f64 {
        match self.decades {
            None => f.max(0.0) / self.top,
            Some(_) if f <= 0.0 => 0.0,
            Some(decades) => (1.0 + (f / self.top).log10() / decades).max(0.0),
        }
    }
    /// The value at a distance from the middle: the inverse of [`Scale::radius`].
    #[must_use]
    pub fn value(self, radius: f64) -> f64 {
        match self.decades {
            None => radius * self.top,
            Some(decades) => self.top * 10_f64.powf((radius - 1.0) * decades),
        }
    }
    /// A value's place on the plot: the light comes from the upper left, what passes the sheet goes down.
    #[must_use]
    pub fn place(self, value: Value) -> [f64; 2] {
        let r = self.radius(value.f);
        [-r * value.psi.sin(), r * value.psi.cos()]
    }
    /// The values of the circles to be drawn, outermost first.
    #[must_use]
    pub fn circles(self) -> Vec<f64> {
        match self.decades {
            None => (1..=4)
                .rev()
                .map(|i| self.top * f64::from(i) / 4.0)
                .collect(),
            Some(decades) => (0..decades as i32)
                .map(|i| self.top / 10_f64.powi(i))
                .collect(),
        }
    }
}

/// Shares of a beam from `l` that are transmitted and reflected into all directions, the gap not included: ∫ f cosθ dω.
///
/// A product rule around the straight-through (and mirror) direction, where the values are: 24 rings of sin², 32 spokes.
#[must_use]
pub fn albedo(
    model: &ModelInfo,
    linear: &model::Linear<f64>,
    shape: &model::Shape<f64>,
    l: Vec3<f64>,
) -> [f64; 2] {
    const RINGS: usize = 64;
    const SPOKES: usize = 48;
    let mut sums = [0.0; 2];
    for (side, sum) in [-1.0, 1.0].into_iter().zip(&mut sums) {
        let peak = Vec3::new(-l.x, -l.y, l.z.abs() * side * l.z.signum());
        // The frame around the peak.
        let (theta, phi) = peak.to_angles();
        let t = Vec3::new(
            theta.cos() * phi.cos(),
            theta.cos() * phi.sin(),
            -theta.sin(),
        );
        let b = Vec3::new(-phi.sin(), phi.cos(), 0.0);
        for i in 0..RINGS {
            // Angle from the peak δ = π x³: fine where a narrow lobe is, dδ = 3π x² dx.
            let x = (i as f64 + 0.5) / RINGS as f64;
            let delta = PI * x * x * x;
            let ring = delta.sin() * 3.0 * PI * x * x / RINGS as f64 * (2.0 * PI / SPOKES as f64);
            for j in 0..SPOKES {
                let a = (j as f64 + 0.5) / SPOKES as f64 * 2.0 * PI;
                let (s, c) = (delta.sin(), delta.cos());
                let v = t * (s * a.cos()) + b * (s * a.sin()) + peak * c;
                if v.z * peak.z > 0.0 {
                    *sum += dot(linear, &(model.f64.basis)(shape, l, v)) * v.z.abs() * ring;
                }
            }
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use woven_bsdf::model::MODELS;

    #[test]
    fn the_curve_on_the_plot_is_the_model() {
        let plane = Plane {
            theta: 0.6,
            phi: 0.3,
        };
        for model in MODELS {
            let values = model.start();
            let (linear, shape) = model.split(&values);
            let curve = curve(model, &linear, &shape, plane);
            assert!(curve.len() > 350, "{}", model.name);
            let greatest = curve.iter().map(|v| v.f).fold(0.0, f64::max);
            for scale in [
                Scale::fitting(greatest, None),
                Scale::fitting(greatest, Some(4.0)),
            ] {
                for value in &curve {
                    // Read the plot as an eye does: angle and distance of the drawn point, back to a value.
                    let [x, y] = scale.place(*value);
                    let radius = x.hypot(y);
                    if radius < 1e-3 {
                        continue;
                    }
                    let read = scale.value(radius);
                    let v = plane.direction((-x).atan2(y));
                    let f = model.eval(&values, plane.light(), v);
                    // Rounding of angles in f64, steep lobes included.
                    assert!(
                        (read - f).abs() < 1e-6 * f.max(1e-3),
                        "{} at {}: {read} {f}",
                        model.name,
                        value.psi
                    );
                }
            }
        }
    }

    #[test]
    fn straight_on_is_opposite_to_the_light() {
        let plane = Plane {
            theta: 0.5,
            phi: 1.1,
        };
        let (l, s) = (plane.light(), plane.direction(plane.straight()));
        assert!((l + s).length_sqr() < 1e-24);
        let (psi, out) = plane.angles(s);
        assert!((psi - plane.straight()).abs() < 1e-12 && out.abs() < 1e-12);
        // From the upper left to the lower right.
        let scale = Scale {
            top: 1.0,
            decades: None,
        };
        let [x, y] = scale.place(Value {
            psi: plane.theta,
            f: 1.0,
        });
        assert!(x < 0.0 && y > 0.0);
        let [x, y] = scale.place(Value {
            psi: plane.straight(),
            f: 1.0,
        });
        assert!(x > 0.0 && y < 0.0);
    }

    #[test]
    fn scales_have_round_tops_and_do_not_lose_small_values() {
        assert_eq!(Scale::fitting(0.34, None).top, 0.5);
        assert_eq!(Scale::fitting(0.34, Some(4.0)).top, 1.0);
        assert_eq!(Scale::fitting(0.0, None).top, 1.0);
        assert_eq!(Scale::fitting(f64::NAN, None).top, 1.0);
        let scale = Scale::fitting(1.0, Some(4.0));
        assert_eq!(scale.radius(0.0), 0.0);
        assert!((scale.radius(0.01) - 0.5).abs() < 1e-12);
        assert_eq!(scale.circles(), vec![1.0, 0.1, 0.01, 0.001]);
    }

    #[test]
    fn the_albedo_of_lambert_is_its_parameter() {
        let model = model::find("lambert").expect("it is in the list");
        for theta in [0.0, 0.7, 1.3] {
            let (linear, shape) = model.split(&[0.37]);
            let [t, r] = albedo(model, &linear, &shape, Vec3::from_angles(theta, 0.4));
            // Midpoints with a cut-off hemisphere: about 1 % worst.
            assert!(
                (t / 0.37 - 1.0).abs() < 0.015 && r == 0.0,
                "{theta}: {t} {r}"
            );
        }
    }
}
