//! What the program was started with, and what it tells.

use std::path::PathBuf;

use woven_catalog::stage::Preset;
use woven_render::render::Backend;

/// What the program was started with.
#[derive(Clone, Debug)]
pub struct Options {
    /// Fabrics to choose from; the first is shown.
    pub fabrics: Vec<PathBuf>,
    /// A measurement for the plot.
    pub measurement: Option<PathBuf>,
    /// Where the work is done.
    pub backend: Backend,
    /// The light at the start.
    pub preset: Preset,
    /// Passes after which a picture is finished.
    pub passes: u32,
    /// Whether the wind blows at the start.
    pub wind: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            fabrics: Vec::new(),
            measurement: None,
            backend: Backend::Auto,
            preset: Preset::Day,
            passes: 512,
            wind: false,
        }
    }
}

/// A sentence for the user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// The sentence.
    pub text: String,
    /// Whether something went wrong.
    pub wrong: bool,
}
