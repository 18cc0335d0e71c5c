//! Fits models of woven cloth to goniometer measurements: Levenberg–Marquardt, ranking, error bars one can believe.
//!
//! Any model of [`woven_bsdf::model::MODELS`] in ten lines, here on values made from a known one:
//!
//! ```
//! use woven_bsdf::{measured::csv::Scan, model};
//! use woven_fit::fit::{Options, fit, quiet};
//! use woven_fit::measurement::Measurement;
//!
//! let truth = model::find("ggx-mirrored").unwrap();
//! let mut text = String::from("theta_l_deg,phi_l_deg,theta_v_deg,phi_v_deg,f,sigma\n");
//! for (theta, phi) in (100..180).step_by(2).flat_map(|t| [(t, 0), (t, 90)]) {
//!     let v = woven_bsdf::vec3::Vec3::from_angles(f64::from(theta).to_radians(), f64::from(phi).to_radians());
//!     let f = truth.eval(&[0.05, 0.4, 0.12, 0.2], woven_bsdf::vec3::Vec3::new(0.0, 0.0, 1.0), v);
//!     text += &format!("0,0,{theta},{phi},{f},\n");
//! }
//! let data = Measurement::from_scan("made", Scan::parse(&text).unwrap());
//! let result = fit(&data, &Options::default(), &quiet).unwrap();
//! assert_eq!(result.ranking[0].model, "ggx-mirrored");
//! let alpha_x = &result.ranking[0].parameters[2];
//! assert!((alpha_x.value - 0.12).abs() < 1e-6, "{alpha_x:?}");
//! ```
//!
//! From a file it is [`fit::fit_measurement`]; [`fit::FitResult::fabric`] gives the fabric file, [`report::html`] the
//! report, [`figures`] its plots as SVG text, [`pixels`] those as PNG, [`compare`] one table of many files. Any other least-squares problem goes to
//! [`solve::solve`], its error bars to [`uncertainty`] and, where those mislead, to [`profile`]. Without a goniometer
//! [`photos`] gives first values.
//!
//! What is absent: no formula of optics (they are woven-bsdf's), no derivative by hand, no drawing library but what turns its SVG into PNG.

pub mod compare;
pub mod convert;
pub mod directions;
pub mod figures;
mod finish;
pub mod fit;
mod gap;
pub mod identify;
pub mod info;
pub mod linalg;
pub mod measurement;
pub mod photos;
pub mod pixels;
pub mod plot;
pub mod problem;
pub mod profile;
pub mod quantile;
pub mod rank;
mod reflection;
pub mod report;
pub mod robust;
pub mod search;
pub mod solve;
pub mod starts;
pub mod straight;
mod summary;
pub mod synth;
pub mod text;
pub mod uncertainty;
mod whiten;
