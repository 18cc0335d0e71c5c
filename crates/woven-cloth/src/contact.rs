//! What the cloth cannot enter: floor, wall, sill, and itself.

mod cells;
mod folds;
mod obstacles;

pub(crate) use cells::sort_into_cells;
pub use folds::SelfContact;
pub(crate) use folds::{Pair, Stage};
pub use obstacles::Obstacles;
