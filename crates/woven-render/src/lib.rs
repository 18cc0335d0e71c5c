//! Renders scenes with woven cloth: a CPU reference path tracer and a wgpu compute path tracer that give
//! the same picture.

pub mod accumulate;
pub mod bvh;
mod cpu;
pub mod gpu;
pub mod optics;
pub mod render;
pub mod rng;
pub mod scene;
pub mod shutter;
pub mod table;

// Files and tools.
pub mod atomic;
pub mod compare;
pub mod denoise;
pub mod exr_io;
pub mod film;
