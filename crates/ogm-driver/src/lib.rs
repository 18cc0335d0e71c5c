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

//!
//! | to read first | what it holds |
//! |---|---|
//! | [`plan`], [`adaptive`], [`design`] | which poses: grids by name, refined where the light changes fast, or chosen by what they tell |
//! | [`rig`], [`axis`], [`pose`] | the rig file, its limits, and the zone where the arms would touch |
//! | [`protocol`] | bytes to values and back: SHOT/GSC, GRBL, the photodiode head, detector commands |
//! | [`transport`], [`serial`], [`recorded`] | carrying bytes: a port, a recording played back, a simulated rig ([`sim::MemoryTransport`]) |
//! | [`controller`], [`detector`] | what to say to the arms and to the light meter, and what to believe of their answers |
//! | [`scan`], [`log`], [`replay`] | the scan, its log that survives a cut of the power, and a look at it without the rig |
//! | [`exposure`], [`merge`], [`klems`] | from counts to a measurement with standard errors, and which of them all values share ([`merge::Shared`]) |
//! | [`sim`] | the rig's twin, with everything that goes wrong |
//!
//! Long campaigns, none of them part of the suite:
//!
//! | what | command |
//! |---|---|
//! | 100 million mutated inputs to a parser | `cargo run --release -p ogm-driver --example fuzz -- shot 100000000` (also `grbl`, `plan`, `log`, `record`: the JSON behind a good checksum) |
//! | a million random plans | `OGM_PLANS=1000000 cargo test --release -p ogm-driver --test safety` |
//! | 10 000 fault scripts | `OGM_FAULT_SCRIPTS=10000 cargo test --release -p ogm-driver --test faults` |
//! | 1000 `kill -9` in 4800 points | `OGM_KILLS=1000 OGM_KILL_POINTS=4800 cargo test --release -p ogm-driver --test kills -- --nocapture` |
//! | 1000 stops, on a quiet machine | `OGM_STOPS=1000 cargo test --release -p ogm-driver --test stops -- --nocapture` |
//! | what the driver adds to a point | `cargo run --release -p ogm-driver --example overhead` |
//! | more rigs of known truth | `OGM_RIGS=300 cargo test --release -p ogm-driver --test calibration -- --nocapture` |
//! | more rigs from cloth to fitted intervals | `OGM_FITS=40 cargo test -p woven-tests --test rig_to_fit -- --nocapture` |
//!
//! What came out stands in `docs/rig.md`.

pub mod adaptive;
pub mod axis;
pub mod controller;
pub mod design;
pub mod detector;
pub mod error;
pub mod exposure;
pub mod klems;
pub mod log;
pub mod merge;
pub mod plan;
pub mod pose;
pub mod protocol;
pub mod recorded;
pub mod replay;
pub mod rig;
pub mod scan;
pub mod serial;
pub mod sim;
pub mod transport;

pub use error::{Error, Result};
