//! What the cloth cannot enter: floor, wall, sill, and itself.

mod cells;
mod creases;
mod distance;
mod folds;
mod glance;
mod guard;
mod motions;
mod net;
mod obstacles;
mod patches;
mod tiles;

pub(crate) use cells::sort_into_cells;
pub use folds::SelfContact;
pub use obstacles::Obstacles;
