//! Three numbers in the cloth's frame: x along the weft, y along the warp, z the normal.

use crate::real::Real;
use std::ops::{Add, Mul, Neg, Sub};

/// A vector of [`Real`]s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vec3<R> {
    /// Along the weft.
    pub x: R,
    /// Along the warp.
    pub y: R,
    /// Along the normal.
    pub z: R,
}

impl<R> Vec3<R> {
    /// The vector (x, y, z).
    #[inline(always)]
    pub const fn new(x: R, y: R, z: R) -> Self {
        Self { x, y, z }
    }
}

impl Vec3<f64> {
    /// The unit vector at polar angle `theta` from +z and azimuth `phi` from +x, both in radians.
    pub fn from_angles(theta: f64, phi: f64) -> Self {
        Self::new(
            theta.sin() * phi.cos(),
            theta.sin() * phi.sin(),
            theta.cos(),
        )
    }
    /// Polar angle from +z in [0, pi] and azimuth from +x in (-pi, pi], in radians.
    pub fn to_angles(self) -> (f64, f64) {
        (self.x.hypot(self.y).atan2(self.z), self.y.atan2(self.x))
    }
    /// The same vector in another scalar.
    pub fn cast<R: Real>(self) -> Vec3<R> {
        Vec3::new(R::of(self.x), R::of(self.y), R::of(self.z))
    }
}

impl<R: Real> Vec3<R> {
    /// Dot product.
    #[inline(always)]
    pub fn dot(self, o: Self) -> R {
        self.x * o.x + self.y * o.y + self.z * o.z
    }
    /// Squared length.
    #[inline(always)]
    pub fn length_sqr(self) -> R {
        self.dot(self)
    }
    /// The unit vector; a vector shorter than 1e-7 is returned scaled, not as NaN.
    #[inline(always)]
    pub fn normalize(self) -> Self {
        self * self.length_sqr().sqrt_pos().recip()
    }
    /// (0, 0, 0): what a sampler returns that found nothing.
    #[inline(always)]
    pub fn zero() -> Self {
        Self::new(R::zero(), R::zero(), R::zero())
    }
    /// Component-wise choice.
    #[inline(always)]
    pub fn select(mask: R::Mask, a: Self, b: Self) -> Self {
        Self::new(
            R::select(mask, a.x, b.x),
            R::select(mask, a.y, b.y),
            R::select(mask, a.z, b.z),
        )
    }
}

impl<R: Real> Add for Vec3<R> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self::new(self.x + o.x, self.y + o.y, self.z + o.z)
    }
}
impl<R: Real> Sub for Vec3<R> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self::new(self.x - o.x, self.y - o.y, self.z - o.z)
    }
}
impl<R: Real> Mul<R> for Vec3<R> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, k: R) -> Self {
        Self::new(self.x * k, self.y * k, self.z * k)
    }
}
impl<R: Real> Neg for Vec3<R> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}
