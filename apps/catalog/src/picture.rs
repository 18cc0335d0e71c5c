//! Taking pictures of the stage: which backend renders them and why, and how a film becomes a file.

use std::sync::atomic::AtomicBool;

use anyhow::{Context as _, Result, ensure};
use clap::ValueEnum;
use image::{ExtendedColorType, ImageEncoder as _};
use woven_render::denoise::{Settings as Filter, denoise};
use woven_render::film::{Curve, Film};
use woven_render::render::{Backend, Renderer, Settings};

use crate::anchor::Anchor;
use crate::desk::Layer;
use crate::stage::{CurtainMesh, Preset, Stage};

/// Where to render, as the user says it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Choice {
    /// A graphics card if there is one, else the processor.
    #[default]
    Auto,
    /// The processor.
    Cpu,
    /// A graphics card; an error without one.
    Gpu,
}

/// How pictures are taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shoot {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Bounces of a path.
    pub depth: u32,
    /// Seed of the paths.
    pub seed: u64,
    /// Filters the noise that is left.
    pub denoise: bool,
    /// Keeps one layer a light.
    pub layers: bool,
}

/// A backend that has been chosen.
pub struct Photographer {
    backend: Backend,
    why: String,
    identity: String,
}

/// A stage before a camera: the room is prepared once, the curtain is moved from picture to picture.
pub struct Set {
    renderer: Renderer,
    curtain: usize,
    exposure: f32,
    denoise: bool,
}

/// A picture taken.
pub struct Picture {
    film: Film,
    exposure: f32,
}

/// Pixels and samples of the picture that tries out the backend.
const TRIAL: u32 = 32;

impl Photographer {
    /// Chooses the backend, by trying it.
    ///
    /// # Errors
    /// When a graphics card was asked for and there is none.
    pub fn choose(choice: Choice) -> Result<Self> {
        let settings = Settings {
            width: TRIAL,
            height: TRIAL,
            spp: 1,
            ..Settings::default()
        };
        let wanted = match choice {
            Choice::Auto => Backend::Auto,
            Choice::Cpu => Backend::Cpu,
            Choice::Gpu => Backend::Gpu,
        };
        let trial = Renderer::new(Stage::new(Preset::Day).scene(), &settings, wanted)?;
        let device = trial.device();
        if let Some(note) = trial.note() {
            // Nothing but the fall back to the processor leaves a note before the first sample.
            let note = note.strip_prefix("rendering on the CPU: ").unwrap_or(note);
            return Ok(Self {
                backend: Backend::Cpu,
                why: format!("Rendered on the CPU: {note}."),
                identity: "cpu".to_owned(),
            });
        }
        Ok(match (choice, device.starts_with("CPU")) {
            (Choice::Cpu, _) => Self {
                backend: Backend::Cpu,
                why: "Rendered on the CPU, as asked.".to_owned(),
                identity: "cpu".to_owned(),
            },
            (_, true) => Self {
                backend: Backend::Cpu,
                why: "Rendered on the CPU.".to_owned(),
                identity: "cpu".to_owned(),
            },
            (_, false) => Self {
                backend: Backend::Gpu,
                why: format!("Rendered on the GPU: {device}."),
                identity: format!("gpu {device}"),
            },
        })
    }

    /// A sentence: which backend, and why.
    #[must_use]
    pub fn why(&self) -> &str {
        &self.why
    }

    /// What pictures of this backend are the same for.
    #[must_use]
    pub fn identity(&self) -> &str {
        &self.identity
    }

    /// Prepares a stage whose curtain hangs at rest; pictures of it in motion need the same triangles.
    ///
    /// # Errors
    /// When the scene cannot be rendered.
    pub fn set_up(&self, stage: &Stage, shoot: &Shoot) -> Result<Set> {
        let settings = Settings {
            width: shoot.size[0],
            height: shoot.size[1],
            spp: 1,
            depth: shoot.depth,
            seed: (shoot.seed ^ (shoot.seed >> 32)) as u32,
            light_layers: shoot.layers,
            aov: true,
            ..Settings::default()
        };
        let renderer = Renderer::new(stage.scene(), &settings, self.backend)?;
        Ok(Set {
            renderer,
            curtain: stage.curtain(),
            exposure: stage.scene().camera.exposure,
            denoise: shoot.denoise,
        })
    }
}

impl Set {
    /// Takes a picture with the curtain as `mesh` has it, `samples` paths a pixel, steadied by an anchor of [`Self::still`] with as
    /// many `few` samples. `progress(share)` answers false to stop.
    ///
    /// The picture does not depend on the ones taken before: the ray structure is fitted to the new places from the same start.
    ///
    /// # Errors
    /// When the backend fails, or on request.
    pub fn take(
        &mut self,
        mesh: &CurtainMesh,
        samples: u32,
        anchor: Option<&Anchor>,
        progress: &mut dyn FnMut(f64) -> bool,
    ) -> Result<Picture> {
        self.renderer
            .move_mesh(self.curtain, &mesh.positions, &mesh.normals)?;
        self.gather(samples, samples, progress)?;
        let mut film = self.renderer.film()?;
        if let Some(anchor) = anchor {
            anchor.steady(&mut film);
        }
        Ok(self.develop(film))
    }

    /// Takes a picture with `many` paths a pixel, and the anchor for frames with `few`.
    ///
    /// # Errors
    /// As [`Self::take`].
    pub fn still(
        &mut self,
        mesh: &CurtainMesh,
        few: u32,
        many: u32,
        progress: &mut dyn FnMut(f64) -> bool,
    ) -> Result<(Picture, Anchor)> {
        self.renderer
            .move_mesh(self.curtain, &mesh.positions, &mesh.normals)?;
        self.gather(few, many, progress)?;
        let begun = self.renderer.film()?;
        self.gather(many.max(few), many, progress)?;
        let film = self.renderer.film()?;
        let anchor = Anchor::new(&begun, &film, few as f32 / many.max(few) as f32);
        Ok((self.develop(film), anchor))
    }

    /// Goes on until there are `samples` paths a pixel, of `all` that will be.
    fn gather(
        &mut self,
        samples: u32,
        all: u32,
        progress: &mut dyn FnMut(f64) -> bool,
    ) -> Result<()> {
        let go_on = AtomicBool::new(false);
        while self.renderer.samples() < samples {
            let left = samples - self.renderer.samples();
            ensure!(
                self.renderer.step(left.min(STEP), &go_on)?,
                "The renderer stopped before the picture was done."
            );
            ensure!(
                progress(f64::from(self.renderer.samples()) / f64::from(all.max(1))),
                "Stopped on request."
            );
        }
        Ok(())
    }

    fn develop(&self, mut film: Film) -> Picture {
        if self.denoise {
            denoise(&mut film, &FILTER);
        }
        Picture {
            film,
            exposure: self.exposure,
        }
    }
}

/// Stronger than the filter's own: pixels share paths, so that their noise is alike over a few pixels, and a film shows what flickers.
const FILTER: Filter = Filter {
    radius: 8,
    strength: 1.2,
    albedo: 0.06,
    normal: 0.25,
    depth: 0.02,
    gap: 0.06,
};

/// Paths a pixel between two looks at the wish to stop: well under a second.
const STEP: u32 = 4;

impl Picture {
    /// The picture as a PNG, exposed and bent for the screen.
    ///
    /// # Errors
    /// When the encoder fails.
    pub fn png(&self) -> Result<Vec<u8>> {
        let (width, height) = (self.film.width as u32, self.film.height as u32);
        let mut png = Vec::new();
        image::codecs::png::PngEncoder::new(&mut png)
            .write_image(
                &self.film.to_rgb8(Curve::Filmic, self.exposure),
                width,
                height,
                ExtendedColorType::Rgb8,
            )
            .context("The picture could not be stored as PNG")?;
        Ok(png)
    }

    /// One picture a light.
    ///
    /// # Errors
    /// When the film was rendered without layers.
    pub fn lights(&self) -> Result<Vec<Layer<'_>>> {
        ["sun", "sky", "lamps"]
            .into_iter()
            .map(|name| {
                let pixels = self.film.layer(&format!("light.{name}")).with_context(|| {
                    format!("The renderer left no layer for the light \"{name}\"")
                })?;
                Ok(Layer { name, pixels })
            })
            .collect()
    }
}
