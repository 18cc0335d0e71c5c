//! Dual numbers: a value and its derivatives with respect to `N` parameters, so that nobody differentiates by hand.
//!
//! The idea is that of Ceres' `Jet`: `a + Σ b_i ε_i` with `ε_i ε_j = 0`.

use crate::real::Real;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A value `v` with its derivatives `d[i]` with respect to parameter `i`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<const N: usize> {
    /// The value.
    pub v: f64,
    /// The derivatives.
    pub d: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// The parameter number `i` at value `v`: its derivative with respect to itself is 1.
    pub fn variable(v: f64, i: usize) -> Self {
        let mut d = [0.0; N];
        d[i] = 1.0;
        Self { v, d }
    }
    /// Applies a function of value `v` and slope `slope` by the chain rule.
    #[inline(always)]
    fn chain(self, v: f64, slope: f64) -> Self {
        Self {
            v,
            d: self.d.map(|d| d * slope),
        }
    }
    #[inline(always)]
    fn zip(self, o: Self, v: f64, f: impl Fn(f64, f64) -> f64) -> Self {
        let mut d = [0.0; N];
        for ((d, a), b) in d.iter_mut().zip(self.d).zip(o.d) {
            *d = f(a, b);
        }
        Self { v, d }
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        self.zip(o, self.v + o.v, |a, b| a + b)
    }
}
impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        self.zip(o, self.v - o.v, |a, b| a - b)
    }
}
impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[inline(always)]
    #[expect(clippy::suspicious_arithmetic_impl, reason = "the product rule adds")]
    fn mul(self, o: Self) -> Self {
        self.zip(o, self.v * o.v, |a, b| a * o.v + b * self.v)
    }
}
impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        let v = self.v / o.v;
        let r = 1.0 / o.v;
        self.zip(o, v, |a, b| (a - v * b) * r)
    }
}
impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.chain(-self.v, -1.0)
    }
}

impl<const N: usize> Real for Dual<N> {
    type Mask = bool;
    #[inline(always)]
    fn of(x: f64) -> Self {
        Self { v: x, d: [0.0; N] }
    }
    #[inline(always)]
    fn lt(self, o: Self) -> bool {
        self.v < o.v
    }
    #[inline(always)]
    fn le(self, o: Self) -> bool {
        self.v <= o.v
    }
    #[inline(always)]
    fn select(mask: bool, a: Self, b: Self) -> Self {
        if mask { a } else { b }
    }
    fn sqrt(self) -> Self {
        let v = self.v.sqrt();
        self.chain(v, 0.5 / v)
    }
    fn exp(self) -> Self {
        let v = self.v.exp();
        self.chain(v, v)
    }
    fn ln(self) -> Self {
        self.chain(self.v.ln(), 1.0 / self.v)
    }
    fn sin(self) -> Self {
        self.chain(self.v.sin(), self.v.cos())
    }
    fn cos(self) -> Self {
        self.chain(self.v.cos(), -self.v.sin())
    }
    fn abs(self) -> Self {
        if self.v < 0.0 { -self } else { self }
    }
    fn min(self, o: Self) -> Self {
        if self.v < o.v { self } else { o }
    }
    fn max(self, o: Self) -> Self {
        if self.v > o.v { self } else { o }
    }
}
