//! The simulated rig, a device of equal rank: arms with speed and limits, a lamp, a noisy detector, two controller languages, faults on demand.

pub mod bench;
pub mod camera;
pub mod device;
pub mod fabric;
pub mod fault;
mod firmware_grbl;
mod firmware_shot;
pub mod memory;
pub mod motor;
pub mod noise;
pub mod optics;
pub mod pty;

pub use bench::{Bench, Imperfections};
pub use device::Device;
pub use fault::{Fault, FaultPlan};
pub use memory::MemoryTransport;
pub use optics::Sample;
pub use pty::PtyRig;
