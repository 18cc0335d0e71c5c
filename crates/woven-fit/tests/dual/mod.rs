//! A number with slopes for the test problems: the same formula gives values and exact derivatives.

#![allow(
    dead_code,
    unreachable_pub,
    reason = "used in parts by several tests and by a bench"
)]

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number with N slopes.
#[derive(Clone, Copy)]
pub struct Dual<const N: usize> {
    pub v: f64,
    pub d: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// A constant.
    pub fn of(v: f64) -> Self {
        Self { v, d: [0.0; N] }
    }
    /// The parameter `i` of N.
    pub fn variable(v: f64, i: usize) -> Self {
        let mut d = [0.0; N];
        d[i] = 1.0;
        Self { v, d }
    }
    pub fn sqr(self) -> Self {
        self * self
    }
    fn chain(self, v: f64, slope: f64) -> Self {
        let mut d = self.d;
        for s in &mut d {
            *s *= slope;
        }
        Self { v, d }
    }
}

/// What the models need of a number.
pub trait Num:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
{
    fn exp(self) -> Self;
    fn ln(self) -> Self;
    fn cos(self) -> Self;
    fn sin(self) -> Self;
    fn atan(self) -> Self;
    fn recip(self) -> Self;
    fn sqrt(self) -> Self;
}

impl Num for f64 {
    fn exp(self) -> Self {
        f64::exp(self)
    }
    fn ln(self) -> Self {
        f64::ln(self)
    }
    fn cos(self) -> Self {
        f64::cos(self)
    }
    fn sin(self) -> Self {
        f64::sin(self)
    }
    fn atan(self) -> Self {
        f64::atan(self)
    }
    fn recip(self) -> Self {
        f64::recip(self)
    }
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
}

impl<const N: usize> Num for Dual<N> {
    fn exp(self) -> Self {
        let e = self.v.exp();
        self.chain(e, e)
    }
    fn ln(self) -> Self {
        self.chain(self.v.ln(), 1.0 / self.v)
    }
    fn cos(self) -> Self {
        self.chain(self.v.cos(), -self.v.sin())
    }
    fn sin(self) -> Self {
        self.chain(self.v.sin(), self.v.cos())
    }
    fn atan(self) -> Self {
        self.chain(self.v.atan(), 1.0 / (1.0 + self.v * self.v))
    }
    fn recip(self) -> Self {
        let r = 1.0 / self.v;
        self.chain(r, -r * r)
    }
    fn sqrt(self) -> Self {
        let r = self.v.sqrt();
        self.chain(r, 0.5 / r)
    }
}

macro_rules! by_slopes {
    ($op:ident, $f:ident, |$a:ident, $b:ident| $v:expr, $slope:expr) => {
        impl<const N: usize> $op for Dual<N> {
            type Output = Self;
            #[allow(clippy::needless_range_loop, clippy::suspicious_arithmetic_impl)]
            fn $f(self, $b: Self) -> Self {
                let $a = self;
                let mut d = [0.0; N];
                for k in 0..N {
                    d[k] = $slope($a.d[k], $b.d[k]);
                }
                Self { v: $v, d }
            }
        }
    };
}
by_slopes!(Add, add, |a, b| a.v + b.v, |x, y| x + y);
by_slopes!(Sub, sub, |a, b| a.v - b.v, |x, y| x - y);
by_slopes!(Mul, mul, |a, b| a.v * b.v, |x, y| x * b.v + a.v * y);

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    fn div(self, b: Self) -> Self {
        let (v, r) = (self.v / b.v, 1.0 / b.v);
        let mut d = self.d;
        for (x, y) in d.iter_mut().zip(b.d) {
            *x = (*x - v * y) * r;
        }
        Self { v, d }
    }
}
impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    fn neg(self) -> Self {
        self.chain(-self.v, -1.0)
    }
}
impl<const N: usize> Add<f64> for Dual<N> {
    type Output = Self;
    fn add(self, b: f64) -> Self {
        Self {
            v: self.v + b,
            ..self
        }
    }
}
impl<const N: usize> Sub<f64> for Dual<N> {
    type Output = Self;
    fn sub(self, b: f64) -> Self {
        Self {
            v: self.v - b,
            ..self
        }
    }
}
impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    fn mul(self, b: f64) -> Self {
        self.chain(self.v * b, b)
    }
}
