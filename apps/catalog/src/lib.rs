//! From measurements to a moving catalog page: the stage, the work list, the videos and the page.
//!
//! [`catalog::Catalog`] says what is wanted, [`jobs::run`] does it: [`optics`] fits each fabric, [`cloth`] hangs it and lets it blow,
//! [`stage::Stage`] is the lit room, [`picture`] renders it, [`video`] and [`mp4`] make the films, [`story`] and [`page`] the page.

pub mod anchor;
pub mod assets;
pub mod catalog;
pub mod cloth;
pub mod desk;
pub mod jobs;
pub mod looping;
pub mod mp4;
pub mod optics;
pub mod page;
pub mod picture;
pub mod progress;
pub mod stage;
pub mod store;
pub mod story;
pub mod video;
