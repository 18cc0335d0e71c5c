//! The window: its state, what changes when, and the layout. Nothing here waits for anything.

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
use crate::fitting::Fitting;
use crate::files::{Choice, Chooser, Purpose};
use crate::hang::Hang;
use crate::measurement::Measurement;
use crate::nearest::Woven;
use crate::painter::Look;
use crate::plot::PolarPlot;
use crate::view::View;
use crate::worker::{Painter, Picture, Wish, Worker};

/// A painter of looks.
pub type LookPainter = Box<dyn Painter<Scene = Look>>;
/// The longest time for which a wish waits for the first picture of the one before.
const PATIENCE: Duration = Duration::from_millis(600);

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
        Self { fabrics: Vec::new(), measurement: None, backend: Backend::Auto, preset: Preset::Day, passes: 512, wind: false }
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
        let folder = options.fabrics.first().and_then(|f| f.parent()).filter(|p| !p.as_os_str().is_empty());
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
        let message = Message { text: text.into(), wrong };
        if self.messages.last() != Some(&message) {
            self.messages.push(message);
        }
        if self.messages.len() > 3 {
            self.messages.remove(0);
        }
    }

    /// Shows another fabric, or tells why not.
    pub fn open_fabric(&mut self, path: &Path) {
        match Cloth::open(path) {
            Ok(cloth) => {
                self.cloth = cloth;
                if !self.fabrics.iter().any(|f| f == path) {
                    self.fabrics.push(path.to_owned());
                }
                self.cloth_changed();
            }
            Err(told) => self.tell(told.to_string(), true),
        }
    }

    /// Lays a measurement over the plot, or tells why not.
    pub fn open_measurement(&mut self, path: &Path) {
        match Measurement::open(path) {
            Ok(measurement) => {
                self.measurement = Some(measurement);
                path.clone_into(&mut self.measured_from);
                self.fitting = None;
            }
            Err(told) => self.tell(told.to_string(), true),
        }
    }

    /// Fits the chosen model to the measurement that lies over the plot.
    pub fn fit(&mut self, ctx: &egui::Context) {
        let ctx = ctx.clone();
        self.fitting = Some(Fitting::new(self.measured_from.clone(), self.cloth.model, move || ctx.request_repaint()));
    }

    /// Puts the sliders to what was fitted, if the fit is done.
    fn take_fit(&mut self) {
        let Some(outcome) = self.fitting.as_ref().and_then(Fitting::outcome) else { return };
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

    /// Opens whatever the file is, by its name's end.
    pub fn open(&mut self, path: &Path) {
        match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
            Some("toml") => self.open_fabric(path),
            Some("xml" | "csv") => self.open_measurement(path),
            _ => self.tell(format!("{} is neither a fabric (.toml) nor a measurement (.xml, .csv).", path.display()), true),
        }
    }

    /// Whether all samples of the last wish are on the screen.
    #[must_use]
    pub fn finished(&self) -> bool {
        !self.dirty && self.picture.as_ref().is_some_and(|p| p.finished && p.wish == self.worker.wishes())
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

    pub(crate) fn choose_file(&mut self, purpose: Purpose) {
        let name = match purpose {
            Purpose::SaveFabric => format!("{}.toml", file_name(self.cloth.name())),
            Purpose::SavePicture => format!("{}.png", file_name(self.cloth.name())),
            Purpose::OpenFabric | Purpose::OpenMeasurement => String::new(),
        };
        self.chooser = Some(Chooser::new(purpose, &self.folder, &name));
    }

    pub(crate) fn show_chooser(&mut self, ctx: &egui::Context) {
        let Some(chooser) = &mut self.chooser else { return };
        let choice = chooser.show(ctx);
        let (purpose, folder) = (chooser.purpose, chooser.folder().to_owned());
        match choice {
            Choice::Open => return,
            Choice::Cancelled => {}
            Choice::File(path) => match purpose {
                Purpose::OpenFabric => self.open_fabric(&path),
                Purpose::OpenMeasurement => self.open_measurement(&path),
                Purpose::SaveFabric => self.save_fabric(&path),
                Purpose::SavePicture => self.save_picture(&path),
            },
        }
        self.folder = folder;
        self.chooser = None;
    }

    /// Whether the file window is open, so that keys belong to it.
    pub(crate) fn choosing(&self) -> bool {
        self.chooser.is_some()
    }

    /// Writes the fabric as the sliders stand.
    pub fn save_fabric(&mut self, path: &Path) {
        let name = path.file_stem().map_or_else(|| self.cloth.name().to_owned(), |n| n.to_string_lossy().into_owned());
        let name = if name == file_name(self.cloth.name()) { self.cloth.name().to_owned() } else { name };
        let text = self.cloth.fabric(&name).to_toml();
        let written = woven_render::atomic::write_atomically(path, |out| {
            use std::io::Write;
            Ok(out.write_all(text.as_bytes())?)
        });
        match written {
            Ok(()) => self.tell(format!("The fabric is saved as {}.", path.display()), false),
            Err(told) => self.tell(format!("{told:#}"), true),
        }
    }

    /// Writes the picture as it is on the screen, in a thread of its own.
    pub fn save_picture(&mut self, path: &Path) {
        let Some(print) = self.view.print.clone() else {
            self.tell("There is no picture to save yet; wait a second.", true);
            return;
        };
        let (path, letters) = (path.to_owned(), self.letters.0.clone());
        let write = move || {
            let written = woven_render::film::write_png8(&path, print.size[0], print.size[1], &print.rgb);
            let message = match written {
                Ok(()) => Message { text: format!("The picture is saved as {}.", path.display()), wrong: false },
                Err(told) => Message { text: format!("{told:#}"), wrong: true },
            };
            letters.send(message).ok();
        };
        if let Err(e) = std::thread::Builder::new().name("save".to_owned()).spawn(write) {
            self.tell(format!("The picture cannot be saved: {e}"), true);
        }
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
        if let Some(picture) = self.worker.newer(self.picture.as_ref().map_or(0, |p| p.number)) {
            self.picture = Some(picture);
        }
        if let Some(picture) = &self.picture {
            let recipe = Recipe { exposure: self.exposure + self.preset.exposure(), smooth: self.smooth, samples: picture.passes };
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
        let answered = self.picture.as_ref().is_some_and(|p| p.wish == self.worker.wishes());
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
            curtain: Arc::clone(&self.curtain),
            camera: self.orbit.camera(0.0),
            backend: self.backend,
        };
        self.worker.wish(Wish { scene, size: self.size, passes: self.passes });
        self.wished = Instant::now();
        self.dirty = false;
    }
}

/// A name that every file system takes.
fn file_name(name: &str) -> String {
    let plain: String = name.chars().map(|c| if c.is_alphanumeric() || c == '-' { c.to_ascii_lowercase() } else { '-' }).collect();
    let parts: Vec<_> = plain.split('-').filter(|p| !p.is_empty()).collect();
    if parts.is_empty() { "fabric".to_owned() } else { parts.join("-") }
}

#[cfg(test)]
mod tests {
    use super::file_name;

    #[test]
    fn file_names_are_plain() {
        assert_eq!(file_name("Satine 5500 5 %, White Pearl"), "satine-5500-5-white-pearl");
        assert_eq!(file_name("../../etc"), "etc");
        assert_eq!(file_name("%"), "fabric");
    }
}
