//! What the simulated detector sees: the sample's BSDF over the aperture, the straight-through beam, the white standard.

use crate::pose::Pose;
use crate::rig::Holder;

/// Something that can be put into the simulated beam.
pub trait Sample: Send + Sync {
    /// BSDF without the straight-through part, 1/sr; `l` to the light, `v` to the detector, unit vectors away from the sample.
    fn bsdf(&self, l: [f64; 3], v: [f64; 3]) -> f64;
    /// Share of the light that goes straight through the gaps, dimensionless.
    fn direct(&self, l: [f64; 3]) -> f64;
    /// A name for the log.
    fn name(&self) -> String;
}

/// A sample made of two functions.
pub struct FnSample<F, G> {
    /// BSDF, 1/sr.
    pub bsdf: F,
    /// Straight-through transmittance.
    pub direct: G,
}

impl<F, G> Sample for FnSample<F, G>
where
    F: Fn([f64; 3], [f64; 3]) -> f64 + Send + Sync,
    G: Fn([f64; 3]) -> f64 + Send + Sync,
{
    fn bsdf(&self, l: [f64; 3], v: [f64; 3]) -> f64 {
        (self.bsdf)(l, v)
    }
    fn direct(&self, l: [f64; 3]) -> f64 {
        (self.direct)(l)
    }
    fn name(&self) -> String {
        "two functions".into()
    }
}

/// A shade cloth in three plain terms, for trials without a fabric file: 5 % gap, a Gaussian skirt of 12° standard deviation holding 10 %,
/// 20 % diffuse transmission and 40 % diffuse reflection.
pub struct PlainCloth;

impl Sample for PlainCloth {
    fn bsdf(&self, l: [f64; 3], v: [f64; 3]) -> f64 {
        if l[2] * v[2] >= 0.0 {
            return 0.4 / std::f64::consts::PI;
        }
        let s = 12_f64.to_radians();
        let angle = crate::pose::angle_between([-l[0], -l[1], -l[2]], v).to_radians();
        0.1 / (std::f64::consts::TAU * s * s) * (-angle * angle / (2.0 * s * s)).exp()
            + 0.2 / std::f64::consts::PI
    }
    fn direct(&self, l: [f64; 3]) -> f64 {
        0.05 * l[2].abs().min(1.0)
    }
    fn name(&self) -> String {
        "plain cloth".into()
    }
}

/// Reflectance of the simulated white standard.
pub const WHITE_REFLECTANCE: f64 = 0.98;

/// Flux into the aperture as a share of the whole beam. `pose` holds the true angles; the aperture has the full angle `aperture_deg`,
/// the beam the half angle `beam_half_deg`.
pub fn flux(
    sample: &dyn Sample,
    holder: Holder,
    pose: Pose,
    aperture_deg: f64,
    beam_half_deg: f64,
) -> f64 {
    let l = pose.light();
    let beam = beam_share(pose.from_straight(), aperture_deg / 2.0, beam_half_deg);
    match holder {
        Holder::Empty => beam,
        Holder::White => over_aperture(pose.view(), aperture_deg, |v| {
            if l[2] * v[2] > 0.0 {
                WHITE_REFLECTANCE / std::f64::consts::PI * v[2].abs()
            } else {
                0.0
            }
        }),
        Holder::Sample => {
            let scattered = over_aperture(pose.view(), aperture_deg, |v| {
                sample.bsdf(l, v) * v[2].abs()
            });
            beam * sample.direct(l) + scattered
        }
    }
}

/// Share of a beam of half angle `beam` (a cone of even brightness) that falls into a round aperture of half angle `aperture` whose centre lies
/// `off` away; all in degrees, flat geometry. The overlap of two circles.
pub fn beam_share(off: f64, aperture: f64, beam: f64) -> f64 {
    if beam <= 0.0 {
        return if off <= aperture { 1.0 } else { 0.0 };
    }
    if off >= aperture + beam {
        return 0.0;
    }
    if off <= (aperture - beam).abs() {
        return (aperture.min(beam) / beam).powi(2);
    }
    let (r, s, d) = (aperture, beam, off);
    let a = ((d * d + r * r - s * s) / (2.0 * d * r))
        .clamp(-1.0, 1.0)
        .acos();
    let b = ((d * d + s * s - r * r) / (2.0 * d * s))
        .clamp(-1.0, 1.0)
        .acos();
    let kite = 0.5
        * ((-d + r + s) * (d + r - s) * (d - r + s) * (d + r + s))
            .max(0.0)
            .sqrt();
    (r * r * a + s * s * b - kite) / (std::f64::consts::PI * s * s)
}

/// Integral of `g` over the round aperture around `v`, sr: 3 rings of Gauss points in the radius squared, 8 points on each
/// (exact for a polynomial of degree five over the flat disc).
fn over_aperture(v: [f64; 3], aperture_deg: f64, g: impl Fn([f64; 3]) -> f64) -> f64 {
    let half = (aperture_deg / 2.0).to_radians();
    let omega = 4.0 * std::f64::consts::PI * (half / 2.0).sin().powi(2);
    let (x, y) = crossways(v);
    // Gauss-Legendre of three points on 0..1 in u = (r/R)².
    const RINGS: [(f64, f64); 3] = [
        (0.112_701_665_379_258_3, 5.0 / 18.0),
        (0.5, 4.0 / 9.0),
        (0.887_298_334_620_741_7, 5.0 / 18.0),
    ];
    let mut sum = 0.0;
    for (k, (u, weight)) in RINGS.into_iter().enumerate() {
        // Equal solid angle: 1 - cos grows evenly with u.
        let c = 1.0 - u * (1.0 - half.cos());
        let s = (1.0 - c * c).max(0.0).sqrt();
        for j in 0..8 {
            let turn = (f64::from(j) + 0.25 * k as f64) * std::f64::consts::TAU / 8.0;
            let (st, ct) = turn.sin_cos();
            let w = [0, 1, 2].map(|i| c * v[i] + s * (ct * x[i] + st * y[i]));
            sum += weight / 8.0 * g(w);
        }
    }
    omega * sum
}

/// Two unit vectors across `v` and across each other.
fn crossways(v: [f64; 3]) -> ([f64; 3], [f64; 3]) {
    let a = if v[0].abs() < 0.5 {
        [1.0, 0.0, 0.0]
    } else {
        [0.0, 1.0, 0.0]
    };
    let dot = a[0] * v[0] + a[1] * v[1] + a[2] * v[2];
    let x = [0, 1, 2].map(|i| a[i] - dot * v[i]);
    let n = (x[0] * x[0] + x[1] * x[1] + x[2] * x[2]).sqrt();
    let x = x.map(|c| c / n);
    (
        x,
        [
            v[1] * x[2] - v[2] * x[1],
            v[2] * x[0] - v[0] * x[2],
            v[0] * x[1] - v[1] * x[0],
        ],
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lambertian_gives_its_value_times_the_projected_solid_angle() {
        let sample = FnSample {
            bsdf: |_, _| 0.3,
            direct: |_: [f64; 3]| 0.0,
        };
        for theta in [95.0, 120.0, 150.0, 180.0_f64] {
            let f = flux(
                &sample,
                Holder::Sample,
                Pose::new(0.0, 0.0, theta, 0.0),
                1.0,
                0.2,
            );
            // Projected solid angle of a cone of half angle h around θ: π sin²h |cos θ|.
            let exact = 0.3
                * std::f64::consts::PI
                * 0.5_f64.to_radians().sin().powi(2)
                * theta.to_radians().cos().abs();
            assert!((f / exact - 1.0).abs() < 1e-9, "{theta}: {f} {exact}");
        }
    }

    #[test]
    fn overlap_of_circles_by_counting_points() {
        for (off, r, s) in [
            (0.5, 0.5, 0.2),
            (0.3, 0.5, 0.4),
            (0.1, 0.2, 0.5),
            (0.9, 0.5, 0.5),
        ] {
            let (n, mut inside, mut all) = (400, 0.0, 0.0);
            for i in 0..n {
                for j in 0..n {
                    let (x, y) = (
                        (f64::from(i) + 0.5) / f64::from(n) * 2.0 - 1.0,
                        (f64::from(j) + 0.5) / f64::from(n) * 2.0 - 1.0,
                    );
                    if x * x + y * y <= 1.0 {
                        all += 1.0;
                        if (s * x + off).hypot(s * y) <= r {
                            inside += 1.0;
                        }
                    }
                }
            }
            let share = beam_share(off, r, s);
            // 125 000 points in the disc, edge cells: within 0.003.
            assert!(
                (share - inside / all).abs() < 0.003,
                "{off} {r} {s}: {share} {}",
                inside / all
            );
        }
        assert_eq!(beam_share(0.0, 0.5, 0.2), 1.0);
        assert_eq!(beam_share(0.8, 0.5, 0.2), 0.0);
    }
}
