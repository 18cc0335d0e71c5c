//! Drives a four-axis goniometer over a serial line, simulates one behind a pseudo-terminal, logs every reading so that none is ever lost,
//! and merges the log into a measurement with standard errors.
//!
//! A scan of a simulated cloth, in memory and on virtual time:
//!
//! ```
//! use ogm_driver::{plan::Plan, rig::Rig, scan, sim, transport::StopToken};
//! use std::sync::Arc;
//!
//! let rig = Rig::default();
//! let bench = sim::Bench::new(rig.clone(), Arc::new(sim::optics::PlainCloth), sim::Imperfections::default());
//! let device = Arc::new(std::sync::Mutex::new(sim::Device::new(bench, sim::FaultPlan::none())));
//! let plan = Plan::from_toml("name = 'two points'\n[grid]\nkind = 'list'\nposes = [[0, 0, 150, 0], [0, 0, 170, 0]]")?;
//! let folder = tempfile::tempdir()?;
//! let log = folder.path().join("scan.ogm");
//! let transport = Box::new(sim::MemoryTransport::new(device));
//! let outcome = scan::run(transport, &rig, &plan, &log, &StopToken::new(), &mut scan::Quiet)?;
//! assert_eq!(outcome.stored, outcome.points);
//! let measurement = ogm_driver::merge::merge_log(&log)?;
//! assert!(measurement.samples.iter().all(|s| s.f > 0.0 && s.sigma > 0.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod adaptive;
pub mod axis;
pub mod controller;
pub mod design;
pub mod detector;
pub mod error;
pub mod exposure;
pub mod external;
pub mod log;
pub mod merge;
pub mod plan;
pub mod pose;
pub mod protocol;
pub mod replay;
pub mod rig;
pub mod scan;
pub mod serial;
pub mod sim;
pub mod transport;

pub use error::{Error, Result};
