//! The viewer's parts: everything but the window itself, so that tests can use them without one.
//!
//! [`app::Viewer`] is the state; [`layout`] says where things are; [`worker`] renders in a thread of its own what
//! [`painter`] paints, [`darkroom`] develops it ([`smooth`]), [`hang`] moves the curtain. [`cloth`] is what the sliders of [`sliders`]
//! change, [`plot`] draws [`polar`] curves of it and of a [`measurement`], to which [`fitting`] fits it.
//!
//! What is absent: no optics, transport or cloth of its own; these are woven-bsdf, woven-render and woven-cloth.

pub mod app;
pub mod camera;
pub mod cloth;
pub mod darkroom;
pub mod files;
pub mod fitting;
pub mod hang;
pub mod layout;
pub mod measurement;
pub mod nearest;
pub mod painter;
pub mod plot;
pub mod polar;
pub mod rail;
pub mod sliders;
pub mod smooth;
pub mod style;
pub mod view;
pub mod worker;
