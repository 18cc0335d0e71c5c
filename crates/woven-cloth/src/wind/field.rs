//! The air itself: gusts through time, eddies in space, the jet of the window.

use super::WindSpec;
use super::cosine::cosine;
use crate::random::{direction, uniform};

const GUST_MODES: usize = 160;
const EDDY_MODES: usize = 48;

#[derive(Clone, Copy, Debug)]
struct Gust {
    omega: f64,
    phase: f64,
    amplitude: f64,
}

#[derive(Clone, Copy, Debug)]
struct Eddy {
    k: [f64; 3],
    a: [f64; 3],
    omega: f64,
    phase: f64,
}

/// A seeded wind; the same seed gives the same air on every machine and in any order of questions.
#[derive(Clone, Debug)]
pub struct Wind {
    spec: WindSpec,
    n: [f64; 3],
    gusts: Vec<Gust>,
    eddies: Vec<Eddy>,
}

/// von Kármán's one-sided spectrum of the longitudinal component, m²/s: `sigma` m/s, `length` m, `speed` m/s, `f` Hz.
#[must_use]
pub fn von_karman(f: f64, sigma: f64, length: f64, speed: f64) -> f64 {
    let t = length / speed;
    4.0 * sigma * sigma * t / (1.0 + 70.8 * (f * t).powi(2)).powf(5.0 / 6.0)
}

impl Wind {
    /// The wind of a description (already validated) and a seed.
    #[must_use]
    pub fn new(spec: &WindSpec, seed: u64) -> Self {
        let len = spec
            .direction
            .iter()
            .map(|c| c * c)
            .sum::<f64>()
            .sqrt()
            .max(1e-12);
        let n = spec.direction.map(|c| c / len);
        let mut spec = spec.clone();
        if !spec.samples.is_empty() {
            // The record has its own mean and gusts; the small eddies go with its mean.
            let sum: f64 = spec.samples.iter().map(|s| s[1].abs()).sum();
            spec.speed = sum / spec.samples.len() as f64;
            spec.gust = 0.0;
        }
        let (mut gusts, mut eddies) = (Vec::new(), Vec::new());
        if spec.speed > 0.0 && spec.gust > 0.0 {
            let sigma = spec.gust * spec.speed;
            let scale = spec.speed / spec.gust_length;
            // Logarithmic bins from a hundredth of the gust frequency up to 20 Hz or 40 times it.
            let (lo, hi) = (0.01 * scale, (40.0 * scale).max(20.0));
            let ratio = (hi / lo).powf(1.0 / GUST_MODES as f64);
            let mut variance = 0.0;
            for m in 0..GUST_MODES {
                let f0 = if m == 0 {
                    0.0
                } else {
                    lo * ratio.powi(m as i32)
                };
                let f1 = lo * ratio.powi(m as i32 + 1);
                let f = f0 + (f1 - f0) * uniform(seed, 11, m as u64);
                let power: f64 = (0..8)
                    .map(|q| {
                        von_karman(
                            f0 + (f1 - f0) * (f64::from(q) + 0.5) / 8.0,
                            sigma,
                            spec.gust_length,
                            spec.speed,
                        )
                    })
                    .sum::<f64>()
                    / 8.0;
                let v = power * (f1 - f0);
                variance += v;
                let phase = std::f64::consts::TAU * uniform(seed, 12, m as u64);
                gusts.push(Gust {
                    omega: std::f64::consts::TAU * f,
                    phase,
                    amplitude: (2.0 * v).sqrt(),
                });
            }
            let fix = sigma / variance.sqrt();
            for g in &mut gusts {
                g.amplitude *= fix;
            }
        }
        if spec.speed > 0.0 && spec.turbulence > 0.0 {
            let sigma = spec.turbulence * spec.speed;
            let mut variance = 0.0;
            for m in 0..EDDY_MODES {
                // Wave lengths from two eddies down to half of one; energy falls as k^(-5/3) per wave number.
                let s = (m as f64 + uniform(seed, 21, m as u64)) / EDDY_MODES as f64;
                let k = std::f64::consts::PI / spec.eddy_length * 4f64.powf(s);
                let d = direction(seed, 22, m as u64);
                let e = direction(seed, 23, m as u64);
                let a = [
                    d[1] * e[2] - d[2] * e[1],
                    d[2] * e[0] - d[0] * e[2],
                    d[0] * e[1] - d[1] * e[0],
                ];
                let norm = a.iter().map(|c| c * c).sum::<f64>().sqrt().max(1e-9);
                let size = k.powf(-1.0 / 3.0);
                variance += 0.5 * size * size / 3.0;
                let phase = std::f64::consts::TAU * uniform(seed, 24, m as u64);
                // Eddies turn over as well as drift: rate sigma k.
                let omega = sigma * k * (2.0 * uniform(seed, 25, m as u64) - 1.0);
                eddies.push(Eddy {
                    k: d.map(|c| c * k),
                    a: a.map(|c| c / norm * size),
                    omega,
                    phase,
                });
            }
            let fix = sigma / variance.sqrt();
            for e in &mut eddies {
                e.a = e.a.map(|c| c * fix);
            }
        }
        Self {
            spec,
            n,
            gusts,
            eddies,
        }
    }

    /// The description, with the mean of a record as its speed.
    pub(super) fn spec(&self) -> &WindSpec {
        &self.spec
    }

    /// Mean speed, m/s.
    pub(crate) fn speed(&self) -> f64 {
        self.spec.speed
    }

    /// Direction of the mean wind, a unit vector.
    pub(super) fn direction(&self) -> [f64; 3] {
        self.n
    }

    /// True when there is no wind at all; still air still slows the cloth.
    #[must_use]
    pub fn is_calm(&self) -> bool {
        self.spec.speed <= 0.0
    }

    /// Speed of the gusting mean at time `t` (s), m/s, with the rise at the start.
    #[must_use]
    pub fn mean_speed(&self, t: f64) -> f64 {
        let s = if self.spec.ramp > 0.0 {
            (t / self.spec.ramp).clamp(0.0, 1.0)
        } else {
            1.0
        };
        let speed = if self.spec.samples.is_empty() {
            self.spec.speed + self.gust(t)
        } else {
            super::record::at(&self.spec.samples, t)
        };
        s * s * (3.0 - 2.0 * s) * speed
    }

    /// The gust alone, m/s: zero mean, standard deviation `gust × speed`.
    #[must_use]
    pub fn gust(&self, t: f64) -> f64 {
        self.gusts
            .iter()
            .map(|g| g.amplitude * cosine(g.omega * t + g.phase))
            .sum()
    }

    /// The small eddies alone at a point, m/s.
    #[must_use]
    pub fn eddy(&self, p: [f64; 3], t: f64) -> [f64; 3] {
        let (mut u, p) = ([[0.0]; 3], p.map(|c| [c]));
        let [x, y, z] = &mut u;
        self.eddies_along([&p[0], &p[1], &p[2]], t, [x, y, z]);
        u.map(|c| c[0])
    }

    /// Adds the small eddies at many points, m/s. One wave after the other, so that the points go side by side.
    #[inline(always)]
    pub(super) fn eddies_along(&self, p: [&[f64]; 3], t: f64, u: [&mut [f64]; 3]) {
        let drift = self.spec.speed * t;
        let n = p[0].len();
        let [x, y, z] = p.map(|c| &c[..n]);
        let [ux, uy, uz] = u.map(|c| &mut c[..n]);
        for e in &self.eddies {
            let along = e.k[0] * self.n[0] + e.k[1] * self.n[1] + e.k[2] * self.n[2];
            let phase = e.omega * t + e.phase - along * drift;
            for i in 0..n {
                let s = cosine(e.k[0] * x[i] + e.k[1] * y[i] + e.k[2] * z[i] + phase);
                ux[i] += e.a[0] * s;
                uy[i] += e.a[1] * s;
                uz[i] += e.a[2] * s;
            }
        }
    }

    /// Share of the wind that reaches a point: 1 inside the jet of the opening, soft at its edges, which widen as it goes.
    #[must_use]
    pub fn jet(&self, p: [f64; 3]) -> f64 {
        let Some(o) = self.spec.opening else {
            return self.spec.blocking;
        };
        let along = (p[2] - o.z).abs();
        // The mixing layer of a plane jet widens by about a tenth of the way on either side (Pope 2000, 5.4).
        let soft = 0.05 + 0.1 * along;
        let inside = |v: f64, [lo, hi]: [f64; 2]| {
            let s = |d: f64| {
                let s = (0.5 + 0.5 * d / soft).clamp(0.0, 1.0);
                s * s * (3.0 - 2.0 * s)
            };
            s(v - lo) * s(hi - v)
        };
        self.spec.blocking * inside(p[0], o.x) * inside(p[1], o.y)
    }

    /// Velocity of the air at a point and time, m/s.
    #[must_use]
    pub fn velocity(&self, p: [f64; 3], t: f64) -> [f64; 3] {
        if self.is_calm() {
            return [0.0; 3];
        }
        let (u, e, jet) = (self.mean_speed(t), self.eddy(p, t), self.jet(p));
        let s = self.mean_speed(t).abs() / self.spec.speed.max(1e-9);
        let calm = s.min(1.0);
        std::array::from_fn(|c| jet * (u * self.n[c] + calm * e[c]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wind::Opening;

    fn breeze() -> WindSpec {
        WindSpec {
            speed: 2.0,
            gust: 0.3,
            gust_length: 2.0,
            turbulence: 0.2,
            ramp: 0.0,
            ..WindSpec::default()
        }
    }

    #[test]
    fn a_record_replaces_mean_and_gusts() {
        let spec = WindSpec {
            samples: vec![[0.0, 1.0], [2.0, 3.0], [3.0, -1.0]],
            turbulence: 0.0,
            ramp: 0.0,
            ..breeze()
        };
        let wind = Wind::new(&spec, 3);
        for (t, want) in [(-1.0, 1.0), (1.0, 2.0), (2.5, 1.0), (9.0, -1.0)] {
            assert!((wind.mean_speed(t) - want).abs() < 1e-12, "{t}");
        }
        assert!((wind.velocity([0.0; 3], 1.0)[2] - 2.0).abs() < 1e-12);
    }

    #[test]
    fn gusts_have_the_deviation_asked_for() {
        let wind = Wind::new(&breeze(), 5);
        let n = 400_000;
        let (mut sum, mut sq) = (0.0, 0.0);
        for k in 0..n {
            let g = wind.gust(f64::from(k) * 0.05);
            sum += g;
            sq += g * g;
        }
        let sigma = (sq / f64::from(n)).sqrt();
        // 20 000 s: 10 000 gust lengths, sampling error about 1 %; 2 % is the goal.
        assert!((sigma / 0.6 - 1.0).abs() < 0.02, "{sigma}");
        assert!((sum / f64::from(n)).abs() < 0.02);
    }

    #[test]
    fn eddies_are_divergence_free_and_have_their_deviation() {
        let wind = Wind::new(&breeze(), 9);
        let h = 1e-4;
        let (mut sq, n) = (0.0, 4000u64);
        for q in 0..n {
            let p: [f64; 3] = std::array::from_fn(|c| 30.0 * uniform(1, c as u64, q));
            let mut div = 0.0;
            for c in 0..3 {
                let (mut a, mut b) = (p, p);
                a[c] -= h;
                b[c] += h;
                div += (wind.eddy(b, 0.3)[c] - wind.eddy(a, 0.3)[c]) / (2.0 * h);
            }
            // Central differences of waves no shorter than 0.17 m: (k h)²/6 = 2e-6 relative, on gradients of sigma/L.
            assert!(div.abs() < 1e-5 * 0.4 / 0.35 * 10.0, "{div}");
            sq += wind.eddy(p, 0.3).iter().map(|c| c * c).sum::<f64>() / 3.0;
        }
        assert!(((sq / n as f64).sqrt() / 0.4 - 1.0).abs() < 0.05);
    }

    #[test]
    fn the_jet_stays_within_its_window() {
        let spec = WindSpec {
            opening: Some(Opening {
                x: [-0.5, 0.5],
                y: [1.0, 2.0],
                z: -0.1,
            }),
            ..breeze()
        };
        let wind = Wind::new(&spec, 1);
        assert!(wind.jet([0.0, 1.5, 0.0]) > 0.999);
        assert!(wind.jet([0.9, 1.5, 0.0]) == 0.0 && wind.jet([0.0, 0.5, 0.0]) == 0.0);
    }

    #[test]
    fn other_seeds_blow_otherwise() {
        let (a, b) = (Wind::new(&breeze(), 1), Wind::new(&breeze(), 2));
        assert!((a.gust(1.0) - b.gust(1.0)).abs() > 1e-6);
        assert_eq!(a.gust(1.0), Wind::new(&breeze(), 1).gust(1.0));
    }
}
