//! The window: its state, what changes when, and the layout. Nothing here waits for anything.

mod files;
mod options;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use woven_bsdf::model::ModelInfo;
use woven_catalog::stage::{CurtainMesh, Preset, ROOM, Stage};
use woven_cloth::CurtainSpec;
use woven_render::render::Backend;

use crate::camera::Orbit;
use crate::cloth::Cloth;
use crate::darkroom::{Darkroom, Recipe};
use crate::files::Chooser;
use crate::fitting::Fitting;
use crate::hang::Hang;
use crate::measurement::Measurement;
use crate::nearest::Woven;
use crate::painter::Look;
use crate::plot::PolarPlot;
use crate::view::View;
use crate::worker::{Painter, Picture, Wish, Worker};

pub use options::{Message, Options};

/// A painter of looks.
pub type LookPainter = Box<dyn Painter<Scene = Look>>;
/// The longest time for which a wish waits for the first picture of the one before.
const PATIENCE: Duration = Duration::from_millis(600);

/// The program's state.
pub struct Viewer {
    pub(crate) cloth: Cloth,
    pub(crate) woven: Woven,
    pub(crate) fabrics: Vec<PathBuf>,
    pub(crate) measurement: Option<Measurement>,
    measured_from: PathBuf,
    pub(crate) fitting: Option<Fitting>,
    pub(crate) plot: PolarPlot,
    pub(crate) preset: Preset,
    /// Stops beside the preset's own exposure.
    pub(crate) exposure: f32,
    pub(crate) orbit: Orbit,
    home: Orbit,
    pub(crate) wind: bool,
    /// Pixels of the picture for a pixel of the screen, along a side.
    pub(crate) detail: f32,
    /// Filters the noise.
    pub(crate) smooth: bool,
    pub(crate) view: View,
    pub(crate) picture: Option<Picture>,
    pub(crate) messages: Vec<Message>,
    chooser: Option<Chooser>,
    folder: PathBuf,
    backend: Backend,
    passes: u32,
    curtain: Arc<CurtainMesh>,
    moment: u64,
    /// Whether the first moment has come, and the curtain has come to rest.
    pub(crate) hung: [bool; 2],
    worker: Worker<LookPainter>,
    darkroom: Darkroom,
    hang: Option<Hang>,
    /// Something has changed since the last wish.
    dirty: bool,
    wished: Instant,
    size: [usize; 2],
    developed: Option<(u64, Recipe)>,
    letters: (Sender<Message>, Receiver<Message>),
}

impl Viewer {
    /// Sets up the state and starts the threads. `painter` is called in the render thread.
    pub fn new(
        ctx: &egui::Context,
        options: Options,
        painter: impl FnOnce() -> LookPainter + Send + 'static,
        curtain: Result<CurtainSpec, String>,
    ) -> Self {
        let wake = |ctx: &egui::Context| {
            let ctx = ctx.clone();
            move || ctx.request_repaint()
        };
        let home = Orbit::of(&Stage::new(options.preset).scene().camera, ROOM);
        let cloth = Cloth::default();
        let folder = options
            .fabrics
            .first()
            .and_then(|f| f.parent())
            .filter(|p| !p.as_os_str().is_empty());
        let mut viewer = Self {
            woven: cloth.woven(),
            cloth,
            fabrics: options.fabrics.clone(),
            measurement: None,
            measured_from: PathBuf::new(),
            fitting: None,
            plot: PolarPlot::default(),
            preset: options.preset,
            exposure: 0.0,
            orbit: home,
            home,
            wind: options.wind,
            detail: 1.0,
            smooth: true,
            view: View::default(),
            picture: None,
            messages: Vec::new(),
            chooser: None,
            folder: folder.map_or_else(|| PathBuf::from("."), Path::to_owned),
            backend: options.backend,
            passes: options.passes,
            curtain: Arc::default(),
            moment: 0,
            hung: [false; 2],
            worker: Worker::new(painter, wake(ctx)),
            darkroom: Darkroom::new(wake(ctx)),
            hang: None,
            dirty: true,
            wished: Instant::now(),
            size: [0; 2],
            developed: None,
            letters: channel(),
        };
        match curtain {
            Ok(spec) => {
                let hang = Hang::new(spec, wake(ctx));
                hang.set_wind(options.wind);
                viewer.hang = Some(hang);
            }
            Err(told) => viewer.tell(told, true),
        }
        if let Some(path) = options.fabrics.first() {
            viewer.open_fabric(path);
        }
        if let Some(path) = &options.measurement {
            viewer.open_measurement(path);
        }
        viewer
    }

    /// The cloth on the sliders.
    #[must_use]
    pub fn cloth(&self) -> &Cloth {
        &self.cloth
    }

    /// Takes another model, as its line in the list of models does.
    pub fn choose_model(&mut self, model: &'static ModelInfo) {
        self.cloth.choose(model);
        self.cloth_changed();
    }

    /// Where the eye is [m].
    #[must_use]
    pub fn eye(&self) -> glam::Vec3 {
        self.orbit.eye()
    }

    /// How many pictures were begun.
    #[must_use]
    pub fn wishes(&self) -> u64 {
        self.worker.wishes()
    }

    /// The newest picture.
    #[must_use]
    pub fn picture(&self) -> Option<&Picture> {
        self.picture.as_ref()
    }

    /// The sentences on the window.
    #[must_use]
    pub fn messages(&self) -> &[Message] {
        &self.messages
    }

    /// The measurement over the plot.
    #[must_use]
    pub fn measurement(&self) -> Option<&Measurement> {
        self.measurement.as_ref()
    }

    /// Tells the user something; the last few sentences stay until they are closed.
    pub fn tell(&mut self, text: impl Into<String>, wrong: bool) {
        let message = Message {
            text: text.into(),
            wrong,
        };
        if self.messages.last() != Some(&message) {
            self.messages.push(message);
        }
        if self.messages.len() > 3 {
            self.messages.remove(0);
        }
    }

    /// Fits the chosen model to the measurement that lies over the plot.
    pub fn fit(&mut self, ctx: &egui::Context) {
        let ctx = ctx.clone();
        self.fitting = Some(Fitting::new(
            self.measured_from.clone(),
            self.cloth.model,
            move || ctx.request_repaint(),
        ));
    }

    /// Puts the sliders to what was fitted, if the fit is done.
    fn take_fit(&mut self) {
        let Some(outcome) = self.fitting.as_ref().and_then(Fitting::outcome) else {
            return;
        };
        self.fitting = None;
        match outcome {
            Ok(fitted) => {
                if fitted.model == self.cloth.model.name {
                    self.cloth.values = fitted.values;
                    self.cloth_changed();
                }
                self.tell(fitted.told, false);
            }
            Err(told) => self.tell(told, true),
        }
    }

    /// Whether all samples of the last wish are on the screen.
    #[must_use]
    pub fn finished(&self) -> bool {
        let whole = |p: &Picture| p.finished && p.wish == self.worker.wishes();
        !self.dirty && self.view.shown > 0 && self.picture.as_ref().is_some_and(whole)
    }

    pub(crate) fn cloth_changed(&mut self) {
        self.woven = self.cloth.woven();
        self.dirty = true;
    }

    pub(crate) fn set_preset(&mut self, preset: Preset) {
        self.dirty |= self.preset != preset;
        self.preset = preset;
    }

    pub(crate) fn set_wind(&mut self, on: bool) {
        self.wind = on;
        if let Some(hang) = &self.hang {
            hang.set_wind(on);
        }
    }

    pub(crate) fn go_home(&mut self) {
        self.orbit = self.home;
        self.dirty = true;
    }

    pub(crate) fn look_from(&mut self, orbit: Orbit, size: [usize; 2]) {
        self.dirty |= orbit != self.orbit || size != self.size;
        self.orbit = orbit;
        self.size = size;
    }

    /// Takes what the threads have brought and gives them what is new. Called once a frame.
    pub fn update(&mut self, ctx: &egui::Context) {
        for file in ctx.input(|i| i.raw.dropped_files.clone()) {
            self.open(file.path());
        }
        while let Ok(message) = self.letters.1.try_recv() {
            self.tell(message.text, message.wrong);
        }
        self.take_fit();
        if let Some(told) = self.worker.error() {
            self.tell(told, true);
        }
        if let Some(picture) = self
            .worker
            .newer(self.picture.as_ref().map_or(0, |p| p.number))
        {
            self.picture = Some(picture);
        }
        if let Some(picture) = &self.picture {
            let recipe = Recipe {
                exposure: self.exposure + self.preset.exposure(),
                smooth: self.smooth,
                samples: picture.passes,
            };
            let wanted = Some((picture.number, recipe));
            if self.developed != wanted {
                self.developed = wanted;
                self.darkroom.put(Arc::clone(&picture.film), recipe);
            }
        }
        if let Some(print) = self.darkroom.newer(self.view.shown) {
            self.view.set(ctx, print);
        }
        // The first picture of a wish is waited for before the next is made: a dragged slider shows its way.
        let answered = self
            .picture
            .as_ref()
            .is_some_and(|p| p.wish == self.worker.wishes());
        if !(answered || self.worker.wishes() == 0 || self.wished.elapsed() > PATIENCE) {
            if self.dirty {
                ctx.request_repaint_after(PATIENCE);
            }
            return;
        }
        self.swing();
        if self.dirty && self.hung[0] && self.size != [0; 2] {
            self.wish();
        }
    }

    /// Takes the curtain's newest moment.
    fn swing(&mut self) {
        let Some(hang) = &self.hang else { return };
        let (moment, error) = (hang.newer(self.moment), hang.error());
        if let Some(moment) = moment {
            self.moment = moment.number;
            self.hung = [true, self.hung[1] || moment.at_rest];
            self.curtain = moment.mesh;
            self.dirty = true;
        }
        if let Some(told) = error {
            self.tell(told, true);
        }
    }

    fn wish(&mut self) {
        let scene = Look {
            preset: self.preset,
            cloth: self.woven,
            pattern: self.cloth.pattern.clone(),
            curtain: Arc::clone(&self.curtain),
            camera: self.orbit.camera(0.0),
            backend: self.backend,
        };
        self.worker.wish(Wish {
            scene,
            size: self.size,
            passes: self.passes,
        });
        self.wished = Instant::now();
        self.dirty = false;
    }
}
