//! The terms that models are built from: distributions, masking, Fresnel, phase functions, samplers.

pub mod albedo;
pub mod beckmann;
pub mod fresnel;
pub mod fuzz;
pub mod ggx;
pub mod hg;
pub mod power;
pub mod warp;
