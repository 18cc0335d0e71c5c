//! The 27 NIST problems: reader of their files, their models on dual numbers, their score.

#![allow(
    dead_code,
    unreachable_pub,
    reason = "used in parts by a test and by a bench"
)]

#[path = "../dual/mod.rs"]
mod dual;

use dual::{Dual, Num};
use woven_fit::solve::{Outcome, Residuals, Settings, Solution, solve};
use woven_fit::uncertainty::uncertainty;

/// One problem as read from its file.
pub struct Nist {
    pub name: &'static str,
    pub starts: [Vec<f64>; 2],
    pub certified: Vec<f64>,
    pub deviations: Vec<f64>,
    pub rss: f64,
    pub y: Vec<f64>,
    pub x: Vec<[f64; 2]>,
}

impl Nist {
    fn read(name: &'static str, text: &str) -> Self {
        let number = |s: &str| s.parse::<f64>().unwrap_or_else(|_| panic!("{name}: {s}"));
        let mut nist = Nist {
            name,
            starts: [vec![], vec![]],
            certified: vec![],
            deviations: vec![],
            rss: 0.0,
            y: vec![],
            x: vec![],
        };
        for (i, line) in text.lines().enumerate() {
            let words: Vec<&str> = line.split_whitespace().collect();
            if i < 60 {
                if words.len() == 6 && words[0].starts_with('b') && words[1] == "=" {
                    nist.starts[0].push(number(words[2]));
                    nist.starts[1].push(number(words[3]));
                    nist.certified.push(number(words[4]));
                    nist.deviations.push(number(words[5]));
                } else if line.starts_with("Residual Sum of Squares") {
                    nist.rss = number(words[words.len() - 1]);
                }
            } else if !words.is_empty() {
                let y = number(words[0]);
                nist.y.push(if name == "Nelson" { y.ln() } else { y });
                nist.x
                    .push([number(words[1]), words.get(2).map_or(0.0, |w| number(w))]);
            }
        }
        assert!(!nist.certified.is_empty() && nist.y.len() > 5, "{name}");
        nist
    }
}

/// A problem with its model, ready for the solver.
pub struct Problem<'a, const N: usize, F, G> {
    data: &'a Nist,
    value: F,
    slopes: G,
}

impl<const N: usize, F, G> Residuals for Problem<'_, N, F, G>
where
    F: Fn(&[f64; N], [f64; 2]) -> f64,
    G: Fn(&[Dual<N>; N], [f64; 2]) -> Dual<N>,
{
    fn rows(&self) -> usize {
        self.data.y.len()
    }
    fn params(&self) -> usize {
        N
    }
    fn evaluate(&mut self, b: &[f64], r: &mut [f64], jac: Option<&mut [f64]>) -> bool {
        let m = r.len();
        if let Some(jac) = jac {
            let b: [Dual<N>; N] = std::array::from_fn(|j| Dual::variable(b[j], j));
            for i in 0..m {
                let f = (self.slopes)(&b, self.data.x[i]);
                r[i] = f.v - self.data.y[i];
                for j in 0..N {
                    jac[j * m + i] = f.d[j];
                }
            }
        } else {
            let b: [f64; N] = std::array::from_fn(|j| b[j]);
            for i in 0..m {
                r[i] = (self.value)(&b, self.data.x[i]) - self.data.y[i];
            }
        }
        true
    }
}

macro_rules! problems {
    ($( $($name:literal)+ => $n:literal, |$b:ident, $x:ident| $body:expr; )+) => {
        /// All 27 problems.
        pub fn all() -> Vec<Nist> {
            vec![$($( Nist::read($name, include_str!(concat!($name, ".dat"))), )+)+]
        }

        /// Calls `run` with the problem's model.
        pub fn with_problem<T>(data: &Nist, run: impl FnOnce(&mut dyn Residuals) -> T) -> T {
            match data.name {
                $($( $name )|+ => {
                    fn model<T: Num>($b: &[T; $n], $x: [f64; 2]) -> T { $body }
                    run(&mut Problem::<$n, _, _> { data, value: model::<f64>, slopes: model::<Dual<$n>> })
                })+
                other => panic!("no model for {other}"),
            }
        }
    };
}

fn gauss<T: Num>(b: &[T; 8], x: f64) -> T {
    let bell = |centre: T, width: T| {
        let t = (-centre + x) / width;
        (-(t * t)).exp()
    };
    b[0] * (b[1] * -x).exp() + b[2] * bell(b[3], b[4]) + b[5] * bell(b[6], b[7])
}

const TAU: f64 = std::f64::consts::TAU;

problems! {
    "Bennett5" => 3, |b, x| b[0] * (-((b[1] + x[0]).ln() / b[2])).exp();
    "BoxBOD" "Misra1a" => 2, |b, x| b[0] * (-((b[1] * -x[0]).exp()) + 1.0);
    "Chwirut1" "Chwirut2" => 3, |b, x| (b[0] * -x[0]).exp() / (b[1] + b[2] * x[0]);
    "DanWood" => 2, |b, x| b[0] * (b[1] * x[0].ln()).exp();
    "ENSO" => 9, |b, x| {
        let t = TAU * x[0];
        let (u, v) = (b[3].recip() * t, b[6].recip() * t);
        b[0] + b[1] * (t / 12.0).cos() + b[2] * (t / 12.0).sin()
            + b[4] * u.cos() + b[5] * u.sin() + b[7] * v.cos() + b[8] * v.sin()
    };
    "Eckerle4" => 3, |b, x| {
        let t = (-b[2] + x[0]) / b[1];
        b[0] / b[1] * (t * t * -0.5).exp()
    };
    "Gauss1" "Gauss2" "Gauss3" => 8, |b, x| gauss(b, x[0]);
    "Hahn1" "Thurber" => 7, |b, x| {
        let x = x[0];
        (b[0] + b[1] * x + b[2] * (x * x) + b[3] * (x * x * x))
            / (b[4] * x + b[5] * (x * x) + b[6] * (x * x * x) + 1.0)
    };
    "Kirby2" => 5, |b, x| {
        let x = x[0];
        (b[0] + b[1] * x + b[2] * (x * x)) / (b[3] * x + b[4] * (x * x) + 1.0)
    };
    "Lanczos1" "Lanczos2" "Lanczos3" => 6, |b, x| {
        b[0] * (b[1] * -x[0]).exp() + b[2] * (b[3] * -x[0]).exp() + b[4] * (b[5] * -x[0]).exp()
    };
    "MGH09" => 4, |b, x| {
        let x = x[0];
        b[0] * (b[1] * x + x * x) / (b[2] * x + b[3] + x * x)
    };
    "MGH10" => 3, |b, x| b[0] * (b[1] / (b[2] + x[0])).exp();
    "MGH17" => 5, |b, x| b[0] + b[1] * (b[3] * -x[0]).exp() + b[2] * (b[4] * -x[0]).exp();
    "Misra1b" => 2, |b, x| {
        let t = (b[1] * (x[0] / 2.0) + 1.0).recip();
        b[0] * (-(t * t) + 1.0)
    };
    "Misra1c" => 2, |b, x| b[0] * (-(b[1] * (2.0 * x[0]) + 1.0).sqrt().recip() + 1.0);
    "Misra1d" => 2, |b, x| b[0] * b[1] * x[0] / (b[1] * x[0] + 1.0);
    "Nelson" => 3, |b, x| b[0] - b[1] * x[0] * (b[2] * -x[1]).exp();
    "Rat42" => 3, |b, x| b[0] / ((b[1] - b[2] * x[0]).exp() + 1.0);
    "Rat43" => 4, |b, x| b[0] * (-(((b[1] - b[2] * x[0]).exp() + 1.0).ln() / b[3])).exp();
    "Roszman1" => 4, |b, x| {
        b[0] - b[1] * x[0] - (b[2] / (-b[3] + x[0])).atan() * std::f64::consts::FRAC_1_PI
    };
}

/// Matching digits of the worst of several numbers, at most 11, at least 0.
pub fn digits(found: &[f64], certified: &[f64]) -> f64 {
    found
        .iter()
        .zip(certified)
        .map(|(f, c)| {
            let error = ((f - c) / c).abs();
            if error.is_nan() {
                0.0
            } else {
                (-error.log10()).clamp(0.0, 11.0)
            }
        })
        .fold(11.0, f64::min)
}

/// What one run came to.
pub struct Score {
    pub solution: Solution,
    /// Digits of the worst parameter.
    pub digits: f64,
    /// Digits of the worst standard error; Lanczos1 has no noise, so its errors are rounding.
    pub error_digits: f64,
    /// Digits of the residual sum of squares.
    pub rss_digits: f64,
}

/// One run from start 0 or 1 with the solver's default setting.
pub fn run(data: &Nist, start: usize) -> Score {
    let solution = with_problem(data, |p| {
        solve(p, &data.starts[start], &Settings::default())
    });
    let names = vec!["b"; solution.x.len()];
    let u = uncertainty(
        &solution.jacobian,
        data.y.len(),
        &names,
        &solution.x,
        &solution.at_bound,
        solution.sse,
        true,
    );
    let errors: Vec<f64> = u
        .standard_error
        .iter()
        .map(|e| e.unwrap_or(f64::NAN))
        .collect();
    Score {
        digits: digits(&solution.x, &data.certified),
        error_digits: digits(&errors, &data.deviations),
        rss_digits: digits(&[solution.sse], &[data.rss]),
        solution,
    }
}

/// Sums over the 54 runs.
#[derive(Default)]
pub struct Tally {
    pub runs: usize,
    pub converged: usize,
    pub four: usize,
    pub six: usize,
    pub errors_six: usize,
    pub sum: f64,
}

impl Tally {
    pub fn add(&mut self, data: &Nist, score: &Score) {
        self.runs += 1;
        self.converged += usize::from(score.solution.outcome == Outcome::Converged);
        self.four += usize::from(score.digits >= 4.0);
        self.six += usize::from(score.digits >= 6.0);
        self.errors_six += usize::from(score.error_digits >= 6.0 && data.name != "Lanczos1");
        self.sum += score.digits;
    }
    pub fn mean(&self) -> f64 {
        self.sum / self.runs as f64
    }
    pub fn text(&self) -> String {
        format!(
            "{} runs: {} solved, {} with 6 digits or more, mean {:.2} digits, standard errors with 6 digits or more {} of 52 (without Lanczos1)",
            self.runs,
            self.four,
            self.six,
            self.mean(),
            self.errors_six
        )
    }
}
