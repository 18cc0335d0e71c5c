//! Formulas, data and starts of Moré, Garbow and Hillstrom's test functions (ACM TOMS 7, 17–41, 1981).

use crate::dual::{Dual, Num};

/// A value and its slope along one parameter.
pub(crate) type D = Dual<1>;

fn c(v: f64) -> D {
    D::of(v)
}

fn weighted(x: &[D]) -> D {
    let terms = x.iter().enumerate();
    terms.fold(c(0.0), |s, (j, &x)| s + x * (j + 1) as f64)
}

pub(crate) fn linear_full_rank(x: &[D], m: usize) -> Vec<D> {
    let sum = x.iter().fold(c(0.0), |s, &x| s + x);
    let own = |i: usize| x.get(i).copied().unwrap_or(c(0.0));
    (0..m)
        .map(|i| own(i) - sum * (2.0 / m as f64) - 1.0)
        .collect()
}

pub(crate) fn linear_rank_one(x: &[D], m: usize) -> Vec<D> {
    (1..=m).map(|i| weighted(x) * i as f64 - 1.0).collect()
}

pub(crate) fn linear_rank_one_with_zeros(x: &[D], m: usize) -> Vec<D> {
    let n = x.len();
    let sum = weighted(&x[..n - 1]) - x[0];
    let row = |i: usize| {
        if i == 0 || i == m - 1 {
            c(-1.0)
        } else {
            sum * i as f64 - 1.0
        }
    };
    (0..m).map(row).collect()
}

pub(crate) fn rosenbrock(x: &[D], _m: usize) -> Vec<D> {
    vec![(x[1] - x[0].sqr()) * 10.0, -x[0] + 1.0]
}

pub(crate) fn helical(x: &[D], _m: usize) -> Vec<D> {
    let turn = std::f64::consts::TAU.recip();
    let angle = if x[0].v == 0.0 {
        c(0.25)
    } else {
        (x[1] / x[0]).atan() * turn + if x[0].v < 0.0 { 0.5 } else { 0.0 }
    };
    vec![
        (x[2] - angle * 10.0) * 10.0,
        ((x[0].sqr() + x[1].sqr()).sqrt() - 1.0) * 10.0,
        x[2],
    ]
}

pub(crate) fn powell_singular(x: &[D], _m: usize) -> Vec<D> {
    vec![
        x[0] + x[1] * 10.0,
        (x[2] - x[3]) * 5f64.sqrt(),
        (x[1] - x[2] * 2.0).sqr(),
        (x[0] - x[3]).sqr() * 10f64.sqrt(),
    ]
}

pub(crate) fn freudenstein(x: &[D], _m: usize) -> Vec<D> {
    let (a, b) = (x[0], x[1]);
    vec![
        a - 13.0 + ((-b + 5.0) * b - 2.0) * b,
        a - 29.0 + ((b + 1.0) * b - 14.0) * b,
    ]
}

const BARD: [f64; 15] = [
    0.14, 0.18, 0.22, 0.25, 0.29, 0.32, 0.35, 0.39, 0.37, 0.58, 0.73, 0.96, 1.34, 2.10, 4.39,
];

pub(crate) fn bard(x: &[D], _m: usize) -> Vec<D> {
    let row = |(i, y): (usize, &f64)| {
        let u = (i + 1) as f64;
        let v = 16.0 - u;
        -(x[0] + c(u) / (x[1] * v + x[2] * u.min(v))) + *y
    };
    BARD.iter().enumerate().map(row).collect()
}

const KOWALIK: [(f64, f64); 11] = [
    (0.1957, 4.0),
    (0.1947, 2.0),
    (0.1735, 1.0),
    (0.1600, 0.5),
    (0.0844, 0.25),
    (0.0627, 0.167),
    (0.0456, 0.125),
    (0.0342, 0.1),
    (0.0323, 0.0833),
    (0.0235, 0.0714),
    (0.0246, 0.0625),
];

pub(crate) fn kowalik(x: &[D], _m: usize) -> Vec<D> {
    let row = |(y, u): (f64, f64)| -(x[0] * (x[1] * u + u * u) / (x[2] * u + u * u + x[3])) + y;
    KOWALIK.into_iter().map(row).collect()
}

const MEYER: [f64; 16] = [
    34780.0, 28610.0, 23650.0, 19630.0, 16370.0, 13720.0, 11540.0, 9744.0, 8261.0, 7030.0, 6005.0,
    5147.0, 4427.0, 3820.0, 3307.0, 2872.0,
];

pub(crate) fn meyer(x: &[D], _m: usize) -> Vec<D> {
    let row = |(i, y): (usize, &f64)| x[0] * (x[1] / (x[2] + 50.0 + 5.0 * i as f64)).exp() - *y;
    MEYER.iter().enumerate().map(row).collect()
}

pub(crate) fn watson(x: &[D], _m: usize) -> Vec<D> {
    let mut r: Vec<D> = (1..=29)
        .map(|i| {
            let t = f64::from(i) / 29.0;
            let (mut slope, mut value, mut power) = (c(0.0), c(0.0), 1.0);
            for (j, &x) in x.iter().enumerate() {
                value = value + x * power;
                slope = slope + x * (j as f64 * power / t);
                power *= t;
            }
            slope - value.sqr() - 1.0
        })
        .collect();
    r.push(x[0]);
    r.push(x[1] - x[0].sqr() - 1.0);
    r
}

pub(crate) fn box_three(x: &[D], m: usize) -> Vec<D> {
    let row = |i: usize| {
        let t = 0.1 * i as f64;
        (x[0] * -t).exp() - (x[1] * -t).exp() - x[2] * ((-t).exp() - (-10.0 * t).exp())
    };
    (1..=m).map(row).collect()
}

pub(crate) fn jennrich(x: &[D], m: usize) -> Vec<D> {
    let row = |i: usize| {
        let i = i as f64;
        -((x[0] * i).exp() + (x[1] * i).exp()) + (2.0 + 2.0 * i)
    };
    (1..=m).map(row).collect()
}

pub(crate) fn brown_dennis(x: &[D], m: usize) -> Vec<D> {
    let row = |i: usize| {
        let t = i as f64 / 5.0;
        (x[0] + x[1] * t - t.exp()).sqr() + (x[2] + x[3] * t.sin() - t.cos()).sqr()
    };
    (1..=m).map(row).collect()
}

/// Mean of Chebyshev's polynomials over the points, less their integrals over [0, 1].
pub(crate) fn chebyquad(x: &[D], m: usize) -> Vec<D> {
    let mut sums = vec![c(0.0); m];
    for &x in x {
        let u = x * 2.0 - 1.0;
        let (mut before, mut now) = (c(1.0), u);
        for sum in &mut sums {
            *sum = *sum + now;
            (before, now) = (now, u * now * 2.0 - before);
        }
    }
    let row = |(i, s): (usize, D)| {
        let i = (i + 1) as f64;
        let integral = if i % 2.0 == 0.0 {
            1.0 / (i * i - 1.0)
        } else {
            0.0
        };
        s * (1.0 / x.len() as f64) + integral
    };
    sums.into_iter().enumerate().map(row).collect()
}

pub(crate) fn brown_almost_linear(x: &[D], _m: usize) -> Vec<D> {
    let n = x.len();
    let sum = x.iter().fold(c(0.0), |s, &x| s + x);
    let mut r: Vec<D> = x[..n - 1]
        .iter()
        .map(|&x| x + sum - (n as f64 + 1.0))
        .collect();
    r.push(x.iter().fold(c(1.0), |p, &x| p * x) - 1.0);
    r
}

const OSBORNE1: [f64; 33] = [
    0.844, 0.908, 0.932, 0.936, 0.925, 0.908, 0.881, 0.850, 0.818, 0.784, 0.751, 0.718, 0.685,
    0.658, 0.628, 0.603, 0.580, 0.558, 0.538, 0.522, 0.506, 0.490, 0.478, 0.467, 0.457, 0.448,
    0.438, 0.431, 0.424, 0.420, 0.414, 0.411, 0.406,
];

pub(crate) fn osborne1(x: &[D], _m: usize) -> Vec<D> {
    let row = |(i, y): (usize, &f64)| {
        let t = 10.0 * i as f64;
        -(x[0] + x[1] * (x[3] * -t).exp() + x[2] * (x[4] * -t).exp()) + *y
    };
    OSBORNE1.iter().enumerate().map(row).collect()
}

const OSBORNE2: [f64; 65] = [
    1.366, 1.191, 1.112, 1.013, 0.991, 0.885, 0.831, 0.847, 0.786, 0.725, 0.746, 0.679, 0.608,
    0.655, 0.616, 0.606, 0.602, 0.626, 0.651, 0.724, 0.649, 0.649, 0.694, 0.644, 0.624, 0.661,
    0.612, 0.558, 0.533, 0.495, 0.500, 0.423, 0.395, 0.375, 0.372, 0.391, 0.396, 0.405, 0.428,
    0.429, 0.523, 0.562, 0.607, 0.653, 0.672, 0.708, 0.633, 0.668, 0.645, 0.632, 0.591, 0.559,
    0.597, 0.625, 0.739, 0.710, 0.729, 0.720, 0.636, 0.581, 0.428, 0.292, 0.162, 0.098, 0.054,
];

pub(crate) fn osborne2(x: &[D], _m: usize) -> Vec<D> {
    let row = |(i, y): (usize, &f64)| {
        let t = i as f64 / 10.0;
        let bell = |j: usize| x[j + 1] * (-((-x[j + 8] + t).sqr() * x[j + 5])).exp();
        -(x[0] * (x[4] * -t).exp() + bell(0) + bell(1) + bell(2)) + *y
    };
    OSBORNE2.iter().enumerate().map(row).collect()
}

pub(crate) fn powell_badly_scaled(x: &[D], _m: usize) -> Vec<D> {
    vec![
        x[0] * x[1] * 1e4 - 1.0,
        (-x[0]).exp() + (-x[1]).exp() - 1.0001,
    ]
}

pub(crate) fn brown_badly_scaled(x: &[D], _m: usize) -> Vec<D> {
    vec![x[0] - 1e6, x[1] - 2e-6, x[0] * x[1] - 2.0]
}

pub(crate) fn beale(x: &[D], _m: usize) -> Vec<D> {
    let row = |(y, power): (f64, D)| -(x[0] * (-power + 1.0)) + y;
    let square = x[1].sqr();
    [(1.5, x[1]), (2.25, square), (2.625, square * x[1])]
        .map(row)
        .to_vec()
}

const GAUSSIAN: [f64; 15] = [
    0.0009, 0.0044, 0.0175, 0.0540, 0.1295, 0.2420, 0.3521, 0.3989, 0.3521, 0.2420, 0.1295, 0.0540,
    0.0175, 0.0044, 0.0009,
];

pub(crate) fn gaussian(x: &[D], _m: usize) -> Vec<D> {
    let row = |(i, y): (usize, &f64)| {
        let t = (7.0 - i as f64) / 2.0;
        x[0] * (x[1] * (-x[2] + t).sqr() * -0.5).exp() - *y
    };
    GAUSSIAN.iter().enumerate().map(row).collect()
}

pub(crate) fn gulf(x: &[D], m: usize) -> Vec<D> {
    let row = |i: usize| {
        let t = i as f64 / 100.0;
        let y = 25.0 + (-50.0 * t.ln()).powf(2.0 / 3.0);
        // Printed as y m i x2, where "mi" is a minus sign.
        let base = -x[1] + y;
        let power = if base.v > 0.0 {
            (x[2] * base.ln()).exp()
        } else {
            c(0.0)
        };
        (-(power / x[0])).exp() - t
    };
    (1..=m).map(row).collect()
}

pub(crate) fn wood(x: &[D], _m: usize) -> Vec<D> {
    vec![
        (x[1] - x[0].sqr()) * 10.0,
        -x[0] + 1.0,
        (x[3] - x[2].sqr()) * 90f64.sqrt(),
        -x[2] + 1.0,
        (x[1] + x[3] - 2.0) * 10f64.sqrt(),
        (x[1] - x[3]) * 0.1f64.sqrt(),
    ]
}

pub(crate) fn biggs(x: &[D], m: usize) -> Vec<D> {
    let row = |i: usize| {
        let t = 0.1 * i as f64;
        let y = (-t).exp() - 5.0 * (-10.0 * t).exp() + 3.0 * (-4.0 * t).exp();
        x[2] * (x[0] * -t).exp() - x[3] * (x[1] * -t).exp() + x[5] * (x[4] * -t).exp() - y
    };
    (1..=m).map(row).collect()
}
