//! The optics of woven cloth: one source for CPU, GPU and derivatives.
//!
//! A model is written once over the scalar trait [`real::Real`]. The same lines run as `f32` and `f64`, as
//! [`dual::Dual`] for exact Jacobians, and as [`trace::Rec`], whose recording is printed as WGSL ([`shader`]).
//!
//! ```
//! use woven_bsdf::{model, vec3::Vec3};
//!
//! let ggx = model::find("ggx-mirrored").expect("it is in the list");
//! let l = Vec3::from_angles(0.3, 0.0);
//! let straight = -l;
//! // k_d, k_t, alpha_x, alpha_y in the model's own order; the value is in 1/sr.
//! let f = ggx.eval(&[0.1, 0.3, 0.1, 0.1], l, straight);
//! assert!(f > ggx.eval(&[0.1, 0.3, 0.1, 0.1], l, Vec3::new(0.0, 0.0, -1.0)));
//! ```
//!
//! Adding a model is one file and one line; `examples/adding_a_model.rs` is that file for a small one.
//!
//! What is absent: no GPU, window, thread or scene; no file format beyond measurements and fabrics.

pub mod angles;
pub mod dual;
pub mod fabric;
pub mod measured;
pub mod model;
pub mod real;
pub mod shader;
pub mod sheet;
pub mod term;
pub mod trace;
pub mod vec3;
pub mod weave;
