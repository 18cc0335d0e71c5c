//! Profile likelihood: intervals where the covariance misleads.
//!
//! The profile of a parameter is the least sum of squares over all others, as a function of it. Where its square root is
//! straight (Bates and Watts' τ), the covariance says the same and costs nothing; where it is bent, or where a bound cuts
//! it, only the profile's own crossings hold the truth as often as they say. A bound that is active at the minimum is
//! such a case for every parameter: the covariance takes the held one for known.

use crate::quantile::student;
use crate::solve::{Outcome, Residuals, Settings, solve};
use crate::uncertainty::Uncertainty;

/// Coverages of the intervals: one, two and three standard deviations of a normal distribution, the middle one rounded.
pub const LEVELS: [f64; 3] = [0.6827, 0.95, 0.9973];

/// Where an interval ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// The sum of squares says so.
    Crossed(f64),
    /// At a bound of the parameter, which the data do not exclude.
    Bound(f64),
    /// Nowhere: however far one goes, the other parameters make up for it.
    Open,
}

/// Lower and upper ends of the intervals at [`LEVELS`], in the solver's coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// (lower, upper) for each level.
    pub ends: [(End, End); 3],
}

/// The straight profile may be off by this share of an interval before the covariance counts as misleading: it moves a
/// coverage of 95 % by less than a hundredth.
const STRAIGHT: f64 = 0.04;

/// One parameter held at a value, the others free.
struct Held<'a, P: ?Sized> {
    inner: &'a mut P,
    which: usize,
    value: f64,
}

impl<P: Residuals + ?Sized> Residuals for Held<'_, P> {
    fn rows(&self) -> usize {
        self.inner.rows()
    }
    fn params(&self) -> usize {
        self.inner.params()
    }
    fn bounds(&self, j: usize) -> (f64, f64) {
        if j == self.which {
            (self.value, self.value)
        } else {
            self.inner.bounds(j)
        }
    }
    fn evaluate(&mut self, x: &[f64], r: &mut [f64], jac: Option<&mut [f64]>) -> bool {
        self.inner.evaluate(x, r, jac)
    }
}

/// A place on a profile: the parameter, root of the excess in standard deviations, all parameters there.
#[derive(Clone)]
struct Place {
    at: f64,
    root: f64,
    x: Vec<f64>,
}

/// The ranges of all parameters for which the covariance misleads; none for the others and for those that a rank
/// deficiency hides.
///
/// `best` is the minimum, `u` its uncertainty in the solver's own coordinates, `sse` its sum of squares.
///
/// # Errors
/// A better minimum, if a profile meets one.
pub fn ranges<P: Residuals + ?Sized>(
    problem: &mut P,
    best: &[f64],
    at_bound: &[bool],
    u: &Uncertainty,
    sse: f64,
) -> Result<Vec<Option<Range>>, Vec<f64>> {
    let n = best.len();
    let none = vec![None; n];
    if u.dof == 0 || sse <= 0.0 || u.rank < u.free {
        return Ok(none);
    }
    let quantiles = LEVELS.map(|level| student(level, u.dof));
    let mut walk = Walk {
        problem,
        best,
        sse,
        variance: sse / u.dof as f64,
    };
    let bounded = at_bound.iter().any(|&b| b);
    let mut out = none;
    for j in 0..n {
        // How all parameters move with this one along the valley, to first order.
        let along: Vec<f64> = (0..n)
            .map(|i| match (u.standard_error[i], u.standard_error[j]) {
                _ if i == j => 1.0,
                (Some(a), Some(b)) if b > 0.0 => u.correlation[i * n + j].unwrap_or(0.0) * a / b,
                _ => 0.0,
            })
            .collect();
        let step = match u.standard_error[j] {
            Some(se) => se,
            None => walk.scale(j),
        };
        if step == 0.0 || !step.is_finite() {
            continue;
        }
        if !bounded && walk.is_straight(&along, quantiles[1] * step, quantiles[1]) {
            continue;
        }
        let lower = walk.side(j, &along, -step, &quantiles)?;
        let upper = walk.side(j, &along, step, &quantiles)?;
        out[j] = Some(Range {
            ends: std::array::from_fn(|i| (lower[i], upper[i])),
        });
    }
    Ok(out)
}

struct Walk<'a, P: ?Sized> {
    problem: &'a mut P,
    best: &'a [f64],
    sse: f64,
    variance: f64,
}

impl<P: Residuals + ?Sized> Walk<'_, P> {
    /// Step of parameter `j` alone that raises the sum of squares by one variance, from its column of the Jacobian.
    fn scale(&mut self, j: usize) -> f64 {
        let (m, n) = (self.problem.rows(), self.best.len());
        let (mut r, mut jac) = (vec![0.0; m], vec![0.0; m * n]);
        if !self.problem.evaluate(self.best, &mut r, Some(&mut jac)) {
            return 0.0;
        }
        self.variance.sqrt() / crate::linalg::norm(&jac[j * m..(j + 1) * m])
    }

    /// Whether straight steps of `reach` to both sides raise the sum of squares as the covariance foretells.
    fn is_straight(&mut self, along: &[f64], reach: f64, quantile: f64) -> bool {
        let mut r = vec![0.0; self.problem.rows()];
        [-reach, reach].into_iter().all(|t| {
            let at = self.best.iter().zip(along);
            let x: Vec<f64> = at.map(|(b, a)| b + t * a).collect();
            let inside = x.iter().enumerate().all(|(i, x)| {
                let (lo, hi) = self.problem.bounds(i);
                (lo..=hi).contains(x)
            });
            inside && self.problem.evaluate(&x, &mut r, None) && {
                let excess = crate::linalg::dot(&r, &r) - self.sse;
                let root = (excess.max(0.0) / self.variance).sqrt();
                (root / quantile - 1.0).abs() < STRAIGHT
            }
        })
    }

    /// The profile at `at`, the others starting from `guess`.
    fn place(&mut self, j: usize, at: f64, guess: &[f64]) -> Result<Place, Vec<f64>> {
        let settings = Settings {
            max_evaluations: 80,
            polish: 0,
            offset_tol: 1e-4,
            ..Settings::default()
        };
        let mut held = Held {
            inner: &mut *self.problem,
            which: j,
            value: at,
        };
        let s = solve(&mut held, guess, &settings);
        if s.outcome == Outcome::NotFinite {
            return Ok(Place {
                at,
                root: f64::INFINITY,
                x: guess.to_vec(),
            });
        }
        // Sums of squares agree to 1e-8 at these settings.
        if s.sse < self.sse * (1.0 - 1e-6) {
            return Err(s.x);
        }
        Ok(Place {
            at,
            root: ((s.sse - self.sse).max(0.0) / self.variance).sqrt(),
            x: s.x,
        })
    }

    /// Where the root of the profile crosses the quantiles, going from the minimum in steps of the sign of `step`.
    fn side(
        &mut self,
        j: usize,
        along: &[f64],
        step: f64,
        quantiles: &[f64; 3],
    ) -> Result<[End; 3], Vec<f64>> {
        let (lo, hi) = self.problem.bounds(j);
        let bound = if step < 0.0 { lo } else { hi };
        let start = self.best[j];
        let mut seen = vec![Place {
            at: start,
            root: 0.0,
            x: self.best.to_vec(),
        }];
        let mut ends = [End::Open; 3];
        for (end, &wanted) in ends.iter_mut().zip(quantiles) {
            for _ in 0..14 {
                // Neighbours of the crossing among the places seen; they are kept in the order of their distance.
                let above = seen.iter().position(|p| p.root >= wanted);
                let below = &seen[above.unwrap_or(seen.len()) - 1];
                let next = match above.map(|i| &seen[i]) {
                    Some(above) if above.root.is_finite() => {
                        let share = (wanted - below.root) / (above.root - below.root);
                        let guess = below.at + share * (above.at - below.at);
                        let near = |p: &Place| (p.root / wanted - 1.0).abs() < 0.02;
                        if near(below) || near(above) {
                            *end = End::Crossed(guess);
                            break;
                        }
                        // Secants from one side only would creep: never nearer than a tenth to either neighbour.
                        below.at + share.clamp(0.1, 0.9) * (above.at - below.at)
                    }
                    Some(above) => 0.5 * (below.at + above.at),
                    None if below.at == bound => {
                        *end = End::Bound(bound);
                        break;
                    }
                    None => {
                        let gone = below.at - start;
                        let straight = if below.root > 0.0 {
                            gone * (wanted / below.root).min(4.0) * 1.02
                        } else {
                            (4.0 * gone.abs()).max(wanted * step.abs()) * step.signum()
                        };
                        let further = start + straight;
                        if step < 0.0 {
                            further.max(bound)
                        } else {
                            further.min(bound)
                        }
                    }
                };
                let guess = if below.at == start {
                    let t = next - start;
                    self.best
                        .iter()
                        .zip(along)
                        .map(|(b, a)| b + t * a)
                        .collect()
                } else {
                    // Go on as far as from the minimum to the place before.
                    let t = (next - start) / (below.at - start);
                    let on = |(b, x): (&f64, &f64)| b + t * (x - b);
                    self.best.iter().zip(&below.x).map(on).collect::<Vec<f64>>()
                };
                let place = self.place(j, next, &guess)?;
                let after = seen
                    .iter()
                    .position(|p| (p.at - start).abs() > (next - start).abs());
                seen.insert(after.unwrap_or(seen.len()), place);
            }
        }
        Ok(ends)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::uncertainty::uncertainty;

    /// Four values of x² with the mean 4; the second parameter is a nuisance that only the last row sees.
    struct Square {
        least: f64,
    }

    impl Residuals for Square {
        fn rows(&self) -> usize {
            5
        }
        fn params(&self) -> usize {
            2
        }
        fn bounds(&self, j: usize) -> (f64, f64) {
            let least = if j == 0 { self.least } else { -100.0 };
            (least, 100.0)
        }
        fn evaluate(&mut self, x: &[f64], r: &mut [f64], jac: Option<&mut [f64]>) -> bool {
            for (r, y) in r.iter_mut().zip([2.5, 5.5, 3.0, 5.0]) {
                *r = x[0] * x[0] - y;
            }
            r[4] = x[1] - 3.0 * x[0];
            if let Some(jac) = jac {
                jac.copy_from_slice(&[2.0 * x[0]; 10]);
                jac[4..].copy_from_slice(&[-3.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
            }
            true
        }
    }

    fn range_of_x(least: f64) -> (Option<Range>, f64) {
        let mut problem = Square { least };
        let s = solve(&mut problem, &[3.0, 3.0], &Settings::default());
        assert!((s.x[0] - 2.0).abs() < 1e-9 && (s.x[1] - 6.0).abs() < 1e-9);
        let u = uncertainty(&s.jacobian, 5, &["x", "y"], &s.x, &s.at_bound, s.sse, true);
        let ranges = ranges(&mut problem, &s.x, &s.at_bound, &u, s.sse).unwrap();
        (ranges[0], (s.sse / 3.0).sqrt())
    }

    #[test]
    fn a_bent_profile_gives_its_own_crossings() {
        // 4 (x² - 4)² = t² s²: the covariance would be symmetric about 2.
        let (range, s) = range_of_x(0.01);
        for ((lo, hi), level) in range.unwrap().ends.into_iter().zip(LEVELS) {
            let half = 0.5 * student(level, 3) * s;
            let want = |square: f64| {
                if square > 1e-4 {
                    End::Crossed(square.sqrt())
                } else {
                    End::Bound(0.01)
                }
            };
            for (end, want) in [(lo, want(4.0 - half)), (hi, want(4.0 + half))] {
                match (end, want) {
                    // Crossings are found to 2 % of the root, which is steep here.
                    (End::Crossed(a), End::Crossed(b)) => {
                        assert!((a - b).abs() < 0.03, "{a} for {b} at {level}");
                    }
                    (a, b) => assert_eq!(a, b, "{level}"),
                }
            }
        }
    }

    #[test]
    fn a_bound_that_the_data_do_not_exclude_is_a_limit() {
        let (range, _) = range_of_x(1.9);
        let [_, (lo, hi), _] = range.unwrap().ends;
        assert_eq!(lo, End::Bound(1.9));
        assert!(matches!(hi, End::Crossed(_)));
    }
}
