//! What a scene may ask for beyond the transport itself: many lights, an open shutter, light kept apart. One program, so that
//! the shader is compiled once.

mod blur;
#[path = "../common/mod.rs"]
mod common;
mod events;
mod gloss;
mod lights;
mod stretch;
