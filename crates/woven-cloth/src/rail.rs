//! The heading on its rail: pleats whose chords add up to the fabric's width exactly, and the shape a curtain starts from.

use crate::random::uniform;
use serde::{Deserialize, Serialize};

/// How the fabric is hung.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Heading {
    /// Wave tape: the whole heading follows a smooth wave.
    #[default]
    Wave,
    /// Pinch pleats: narrow tall folds with flat cloth between them.
    Pinch,
    /// Rings at the crest of every pleat; the heading hangs freely between them.
    Rings,
    /// Eyelets: the rod holds the heading in every pleat's two crossings.
    Eyelets,
    /// A pocket on a rod: the cloth is pushed together into small uneven folds.
    RodPocket,
}

/// A wave over the rail from -width/2 to +width/2: z(x) with a phase that may be irregular and pleats that may be sharp.
#[derive(Clone, Debug)]
struct Wave {
    width: f64,
    pleats: f64,
    /// 0 is a sine; larger is a narrower pleat.
    sharpness: f64,
    irregular: f64,
    seed: u64,
}

impl Wave {
    /// z per amplitude at s = x / width in 0..1.
    fn at(&self, s: f64) -> f64 {
        let tau = std::f64::consts::TAU;
        let (mut phase, mut size) = (tau * self.pleats * s, 1.0);
        if self.irregular > 0.0 {
            for m in 1..=5u64 {
                let p = tau * uniform(self.seed, 31, m);
                let q = tau * uniform(self.seed, 32, m);
                // Slow drifts of the phase (vanishing at both ends) and of the depth along the rail.
                let slow = (tau * m as f64 * 0.5 * s + p).sin();
                phase += self.irregular * 1.6 / m as f64 * slow * (std::f64::consts::PI * s).sin();
                size +=
                    self.irregular * 0.5 / (m as f64).sqrt() * (tau * m as f64 * s * 0.7 + q).sin();
            }
        }
        let size = size.clamp(0.3, 2.0);
        if self.sharpness <= 0.0 {
            return size * phase.sin();
        }
        let k = self.sharpness;
        let low = (-2.0 * k).exp();
        size * (2.0 * (((k * (phase.sin() - 1.0)).exp() - low) / (1.0 - low)) - 1.0)
    }

    /// `n` chords of length `h` along this wave, from (0, 0) to (width, 0) exactly.
    ///
    /// The amplitude is the one whose arc is `n h` long; the chords take its directions at equal arcs; then all directions are
    /// scaled by one factor near 1, found by bisection, so that the ends are `width` apart, and the whole is turned onto the rail.
    fn fit(&self, h: f64, n: usize) -> Vec<[f64; 2]> {
        let fine = 24 * n;
        let dx = self.width / fine as f64;
        let z: Vec<f64> = (0..=fine)
            .map(|k| self.at(k as f64 / fine as f64))
            .collect();
        let length = |a: f64| {
            z.windows(2)
                .map(|p| dx.hypot(a * (p[1] - p[0])))
                .sum::<f64>()
        };
        let (mut lo, mut hi) = (0.0, n as f64 * h);
        for _ in 0..50 {
            let mid = 0.5 * (lo + hi);
            if length(mid) < n as f64 * h {
                lo = mid
            } else {
                hi = mid
            }
        }
        let amplitude = 0.5 * (lo + hi);
        // Points at equal arcs, then the direction of each chord.
        let mut points = vec![[0.0, amplitude * z[0]]];
        let (mut arc, mut want) = (0.0, h);
        for (k, p) in z.windows(2).enumerate() {
            let step = dx.hypot(amplitude * (p[1] - p[0]));
            while points.len() < n && arc + step >= want {
                let t = (want - arc) / step;
                points.push([(k as f64 + t) * dx, amplitude * (p[0] + t * (p[1] - p[0]))]);
                want += h;
            }
            arc += step;
        }
        points.push([self.width, amplitude * z[fine]]);
        let angles: Vec<f64> = points
            .windows(2)
            .map(|p| (p[1][1] - p[0][1]).atan2(p[1][0] - p[0][0]))
            .collect();
        let span = |s: f64| {
            angles.iter().fold([0.0, 0.0], |e, t| {
                [e[0] + h * (s * t).cos(), e[1] + h * (s * t).sin()]
            })
        };
        let (mut lo, mut hi) = (0.5, 1.5);
        for _ in 0..60 {
            let mid = 0.5 * (lo + hi);
            let e = span(mid);
            // Steep pleats turned too far run backwards, which is too short, however far they get.
            if e[0] > 0.0 && e[0].hypot(e[1]) > self.width {
                lo = mid
            } else {
                hi = mid
            }
        }
        let scale = 0.5 * (lo + hi);
        let e = span(scale);
        let turn = -e[1].atan2(e[0]);
        let mut p = [0.0, 0.0];
        std::iter::once(p)
            .chain(angles.iter().map(|t| {
                let t = scale * t + turn;
                p = [p[0] + h * t.cos(), p[1] + h * t.sin()];
                p
            }))
            .collect()
    }
}

/// What is needed to lay out a pleated sheet.
#[derive(Clone, Debug)]
pub struct Pleats {
    /// Width of the rail that the fabric covers, m.
    pub width: f64,
    /// Width of the flat fabric, m.
    pub fabric_width: f64,
    /// Number of pleats.
    pub pleats: f64,
    /// Kind of heading.
    pub heading: Heading,
    /// How uneven the folds become towards the hem, 0 to 1.
    pub irregularity: f64,
    /// Seed of the unevenness.
    pub seed: u64,
}

impl Pleats {
    /// The row at `depth` (0 heading, 1 hem) as `columns` points (x, z), m, x centred on the rail. Every chord has the length
    /// fabric_width/(columns-1), so no thread of the weft is stretched.
    #[must_use]
    pub fn row(&self, columns: usize, depth: f64) -> Vec<[f64; 2]> {
        let n = columns - 1;
        let h = self.fabric_width / n as f64;
        if self.fabric_width <= self.width * (1.0 + 1e-9) {
            return (0..columns)
                .map(|i| [i as f64 * h - 0.5 * self.fabric_width, 0.0])
                .collect();
        }
        let smooth = |t: f64| {
            let t = t.clamp(0.0, 1.0);
            t * t * (3.0 - 2.0 * t)
        };
        let sharpness = match self.heading {
            Heading::Pinch => 2.5 * (1.0 - smooth(depth / 0.5)) + 0.3,
            _ => 0.0,
        };
        let wave = Wave {
            width: self.width,
            pleats: self.pleats,
            sharpness,
            // On a rod the folds are uneven from the top on.
            irregular: match self.heading {
                Heading::RodPocket => self.irregularity * (0.5 + 0.5 * smooth(depth)),
                _ => self.irregularity * smooth(depth),
            },
            seed: self.seed,
        };
        let mut points = wave.fit(h, n);
        let shift = 0.5 * points[n][0];
        for p in &mut points {
            p[0] -= shift;
        }
        points
    }

    /// Which columns of the heading are held by the rail.
    #[must_use]
    pub fn held(&self, columns: usize) -> Vec<usize> {
        let per_pleat = (columns - 1) as f64 / self.pleats.max(1.0);
        let at = |pleat: f64| ((pleat * per_pleat).round() as usize).min(columns - 1);
        let count = self.pleats.round().max(1.0) as usize;
        let mut held: Vec<usize> = match self.heading {
            Heading::Wave | Heading::Pinch | Heading::RodPocket => (0..columns).collect(),
            Heading::Rings => (0..count)
                .map(|p| at(p as f64 + 0.25))
                .chain([0, columns - 1])
                .collect(),
            Heading::Eyelets => (0..=2 * count).map(|p| at(0.5 * p as f64)).collect(),
        };
        held.sort_unstable();
        held.dedup();
        held
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pleats_are_isometric_for_every_fullness_and_heading() {
        for heading in [Heading::Wave, Heading::Pinch, Heading::RodPocket] {
            for fullness in [1.0, 1.5, 2.0, 2.5, 3.0] {
                let pleats = Pleats {
                    width: 1.4,
                    fabric_width: 1.4 * fullness,
                    pleats: 10.0,
                    heading,
                    irregularity: 0.5,
                    seed: 3,
                };
                for depth in [0.0, 1.0] {
                    let n = 241;
                    let row = pleats.row(n, depth);
                    let h = pleats.fabric_width / (n - 1) as f64;
                    let worst = row
                        .windows(2)
                        .map(|p| ((p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1]) / h - 1.0).abs())
                        .fold(0.0, f64::max);
                    // V19: chords add up to the width, strain below 1e-12.
                    assert!(worst < 1e-12, "{heading:?} fullness {fullness}: {worst:e}");
                    assert!(
                        (row[n - 1][0] - row[0][0] - 1.4).abs() < 1e-9
                            && (row[n - 1][1] - row[0][1]).abs() < 1e-9,
                        "{heading:?} {fullness}: ends at {}",
                        row[n - 1][0] - row[0][0]
                    );
                }
            }
        }
    }
}
