//! A curtain as a mass-spring sheet in SI units: it hangs in pleats from a rail, comes to rest and moves in the wind of a window.
//!
//! The way: [`CurtainSpec`] (what a person writes in TOML) → [`Simulation`] (rest, wind, frames, checkpoints) → [`CurtainClip`]
//! (mesh and frames) → a cache file ([`cache`]: animated `.glb`, `.pc2`, `.mdd`). The cloth knows nothing of how it looks.
//!
//! ```
//! let spec: woven_cloth::CurtainSpec =
//!     "width = 0.4\nheight = 0.5\npleats = 3\ncolumns = 19\nrows = 11\nframes = 3\nsettle = 0.2\nwarm_up = 0.0\n[wind]\nspeed = 1.0".parse()?;
//! let clip = woven_cloth::simulate(&spec, &mut |_done, _total| std::ops::ControlFlow::Continue(()))?;
//! assert_eq!((clip.frames.len(), clip.mesh.positions.len()), (3, 19 * 11));
//! # Ok::<(), woven_cloth::Error>(())
//! ```

pub mod cache;
mod clip;
mod contact;
mod crossing;
mod draw;
mod error;
mod fabrics;
mod force;
pub mod lab;
mod line;
mod mesh;
pub mod preview;
mod rail;
mod random;
mod reference;
mod sheet;
mod simulation;
mod spec;
mod step;
mod weave;
mod wind;
mod work;

pub use clip::{CurtainClip, second_path, simulate, simulate_to};
pub use contact::{Obstacles, SelfContact};
pub use crossing::crossings;
pub use draw::{DrawKey, Side};
pub use error::{Error, Result};
pub use fabrics::{FABRICS, Fabric, GRAVITY, Mechanics, bending_length, bending_stiffness, fabric};
pub use mesh::Mesh;
pub use rail::{Heading, Pleats};
pub use reference::{Reference, explicit_step};
pub use sheet::{Energy, Sheet};
pub use simulation::{Frame, Report, Simulation, TICKS};
pub use spec::{CurtainSpec, SecondLayer};
pub use step::{Stepper, gust_step, stable_step};
pub use weave::weave_strain;
pub use wind::{AIR_DENSITY, Opening, Wind, WindSpec, uniform_wind_forces, von_karman};
