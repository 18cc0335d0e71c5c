//! `Real`: the scalar in which every formula of this crate is written once.
//!
//! The same lines run as `f32` and `f64` (CPU), as [`crate::dual::Dual`] (exact derivatives for the fit) and as
//! [`crate::trace::Rec`] (a recording that is printed as WGSL for the GPU). A branch becomes [`Real::select`], which
//! evaluates both sides: guard the operand (`x.max(eps).sqrt()`), never the result.

use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// The truth value that belongs to a [`Real`]: a `bool`, or a recorded comparison.
pub trait Mask: Copy + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {}
impl<T: Copy + BitAnd<Output = T> + BitOr<Output = T> + Not<Output = T>> Mask for T {}

/// A real number that formulas are generic over.
pub trait Real:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// What a comparison gives.
    type Mask: Mask;

    /// The constant `x`.
    fn of(x: f64) -> Self;
    /// `self < o`.
    fn lt(self, o: Self) -> Self::Mask;
    /// `self <= o`.
    fn le(self, o: Self) -> Self::Mask;
    /// `a` where the mask holds, else `b`. Both are evaluated.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
    /// Square root; its slope at 0 is infinite, so guard the operand.
    fn sqrt(self) -> Self;
    /// e to the power of self.
    fn exp(self) -> Self;
    /// Natural logarithm of a positive number.
    fn ln(self) -> Self;
    /// Sine of radians.
    fn sin(self) -> Self;
    /// Cosine of radians.
    fn cos(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// The smaller of two.
    fn min(self, o: Self) -> Self;
    /// The larger of two.
    fn max(self, o: Self) -> Self;

    /// `self` to the power `e`; `self` must be positive.
    fn powf(self, e: Self) -> Self {
        (self.ln() * e).exp()
    }
    /// `self > o`.
    fn gt(self, o: Self) -> Self::Mask {
        o.lt(self)
    }
    /// The square.
    fn sqr(self) -> Self {
        self * self
    }
    /// `1 - self`.
    fn one_minus(self) -> Self {
        Self::of(1.0) - self
    }
    /// `1 / self`.
    fn recip(self) -> Self {
        Self::of(1.0) / self
    }
    /// `self` limited to `[lo, hi]`.
    fn clamp(self, lo: f64, hi: f64) -> Self {
        self.max(Self::of(lo)).min(Self::of(hi))
    }
    /// `max(self, 0)`.
    fn pos(self) -> Self {
        self.max(Self::of(0.0))
    }
    /// Zero.
    fn zero() -> Self {
        Self::of(0.0)
    }
    /// One.
    fn one() -> Self {
        Self::of(1.0)
    }
    /// Square root of a number that rounding may have pushed below zero; `eps` keeps the slope finite.
    fn sqrt_pos(self) -> Self {
        self.max(Self::of(1e-14)).sqrt()
    }
}

macro_rules! real_for_float {
    ($t:ty) => {
        impl Real for $t {
            type Mask = bool;
            #[inline(always)]
            fn of(x: f64) -> Self {
                x as $t
            }
            #[inline(always)]
            fn lt(self, o: Self) -> bool {
                self < o
            }
            #[inline(always)]
            fn le(self, o: Self) -> bool {
                self <= o
            }
            #[inline(always)]
            fn select(mask: bool, a: Self, b: Self) -> Self {
                if mask { a } else { b }
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                <$t>::sqrt(self)
            }
            #[inline(always)]
            fn exp(self) -> Self {
                <$t>::exp(self)
            }
            #[inline(always)]
            fn ln(self) -> Self {
                <$t>::ln(self)
            }
            #[inline(always)]
            fn sin(self) -> Self {
                <$t>::sin(self)
            }
            #[inline(always)]
            fn cos(self) -> Self {
                <$t>::cos(self)
            }
            #[inline(always)]
            fn abs(self) -> Self {
                <$t>::abs(self)
            }
            #[inline(always)]
            fn min(self, o: Self) -> Self {
                if self < o { self } else { o }
            }
            #[inline(always)]
            fn max(self, o: Self) -> Self {
                if self > o { self } else { o }
            }
            #[inline(always)]
            fn powf(self, e: Self) -> Self {
                <$t>::powf(self, e)
            }
        }
    };
}
real_for_float!(f32);
real_for_float!(f64);
