//! The way in: settings, backends, and a renderer that gathers samples until it is told to stop.

use anyhow::{Context, Result, ensure};
use glam::Vec3;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::accumulate::{Accumulation, PixelSum};
use crate::cpu;
use crate::cpu::path::View;
use crate::film::Film;
use crate::scene::{Camera, Scene};
use crate::shutter::{Pose, Shutter};
use crate::table::Table;

/// What is counted as light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrator {
    /// Everything up to [`Settings::depth`] scattering events.
    #[default]
    Path,
    /// What lights give off and one scattering event.
    Direct,
}

/// Where the work is done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Backend {
    /// On a GPU if there is one in hardware, else on the CPU.
    #[default]
    Auto,
    /// The reference.
    Cpu,
    /// On a GPU, a software one (lavapipe) if there is no other; an error without any.
    Gpu,
}

/// How a picture is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Samples a pixel.
    pub spp: u32,
    /// Most scattering events of a path; passing a gap is none.
    pub depth: u32,
    /// Another seed gives another noise.
    pub seed: u32,
    /// What is counted as light.
    pub integrator: Integrator,
    /// Keep the light of each layer apart.
    pub light_layers: bool,
    /// Keep apart instead what the first sheet that the camera's ray meets has scattered back, scattered through, let pass
    /// by its gaps, or given off ([`crate::scene::EVENT_NAMES`]).
    pub event_layers: bool,
    /// Add albedo, normal, depth, gap and variance.
    pub aov: bool,
    /// Stop after this time with the samples gathered by then (at least one a pixel).
    pub time_limit: Option<Duration>,
    /// Stop when the estimated noise, relMSE = mean((x - r)²/(r² + 0.01)), is at most this; `spp` is then the most.
    pub noise: Option<f32>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            width: 640,
            height: 480,
            spp: 64,
            depth: 8,
            seed: 0,
            integrator: Integrator::Path,
            light_layers: false,
            event_layers: false,
            aov: false,
            time_limit: None,
            noise: None,
        }
    }
}

/// Hears how far a render is and may stop it.
pub trait Progress {
    /// `done` of `total` pixel samples are gathered.
    fn advance(&mut self, done: u64, total: u64);
    /// A flag that ends the render early when set; the film then holds what was gathered.
    fn stop(&self) -> Option<Arc<AtomicBool>> {
        None
    }
}

/// Nobody listens.
impl Progress for () {
    fn advance(&mut self, _done: u64, _total: u64) {}
}

/// Renders `scene` to the end.
///
/// # Errors
/// A sentence when the scene or the settings cannot be rendered, when no GPU is there and one is asked for, or when
/// it was stopped before the first sample.
pub fn render(
    scene: &Scene,
    settings: &Settings,
    backend: Backend,
    progress: &mut dyn Progress,
) -> Result<Film> {
    let mut renderer = Renderer::new(scene, settings, backend)?;
    renderer.finish(progress)?;
    renderer.film()
}

/// A render that goes on step by step.
pub struct Renderer {
    table: Table,
    settings: Settings,
    /// Complete for the CPU; for the GPU the state of the last read-back.
    sums: Accumulation,
    engine: Engine,
    /// Room for one sample of every pixel.
    fresh: Vec<cpu::path::Sample>,
    /// The mesh that moves while samples are gathered.
    shutter: Option<Shutter>,
    note: Option<String>,
    /// Samples and means at the last power of two.
    half: Option<(u32, Vec<[f32; 3]>)>,
    /// The last estimate of the noise times the samples that it was made of.
    noise: Option<f64>,
}

enum Engine {
    Cpu,
    Gpu(Box<crate::gpu::Gpu>),
}

impl Renderer {
    /// Prepares the scene.
    ///
    /// # Errors
    /// As [`render`].
    pub fn new(scene: &Scene, settings: &Settings, backend: Backend) -> Result<Self> {
        let (w, h) = (settings.width, settings.height);
        ensure!(
            w > 0 && h > 0,
            "a picture of {w} x {h} pixels has no pixel; give a size like 640x480"
        );
        ensure!(
            w <= 32_768 && h <= 32_768,
            "{w} x {h} pixels are more than 32768 on a side"
        );
        ensure!(
            settings.spp > 0,
            "0 samples a pixel give no picture; ask for at least 1"
        );
        ensure!(
            !(settings.light_layers && settings.event_layers),
            "light is kept apart by lamp or by event, not by both at once; render twice with the same seed"
        );
        let mut table = Table::new(scene, settings.light_layers)?;
        table.globals.events = u32::from(settings.event_layers);
        let sums = Accumulation::new(w, h);
        let mut note = None;
        let engine = match backend {
            Backend::Cpu => Engine::Cpu,
            Backend::Gpu => Engine::Gpu(Box::new(
                crate::gpu::Gpu::new(&table, &view(&table, settings), true)
                    .context("the GPU cannot be used")?,
            )),
            Backend::Auto => match crate::gpu::Gpu::new(&table, &view(&table, settings), false) {
                Ok(gpu) => Engine::Gpu(Box::new(gpu)),
                Err(why) => {
                    note = Some(format!("rendering on the CPU: {why:#}"));
                    Engine::Cpu
                }
            },
        };
        Ok(Self {
            table,
            settings: *settings,
            sums,
            engine,
            fresh: Vec::new(),
            shutter: None,
            note,
            half: None,
            noise: None,
        })
    }

    /// Where the work is done, in words.
    #[must_use]
    pub fn device(&self) -> String {
        match &self.engine {
            Engine::Cpu => format!("CPU ({} threads)", rayon::current_num_threads()),
            Engine::Gpu(gpu) => gpu.name().to_owned(),
        }
    }

    /// Something the user should be told once, such as why the CPU is used.
    #[must_use]
    pub fn note(&self) -> Option<&str> {
        self.note.as_deref()
    }

    /// The longest time that one submit to the GPU has taken, and how many submits there were; nothing on the CPU.
    #[must_use]
    pub fn longest_submit(&self) -> Option<(Duration, u64)> {
        match &self.engine {
            Engine::Cpu => None,
            Engine::Gpu(gpu) => Some(gpu.longest()),
        }
    }

    /// Takes the GPU away, as the reset of a driver does; the next step has to find its way. For tests.
    #[doc(hidden)]
    pub fn lose_device(&self) {
        if let Engine::Gpu(gpu) = &self.engine {
            gpu.lose();
        }
    }

    /// How far what each pixel sees has moved over the picture since `mesh` had the vertices `before`: to the right
    /// and down, in pixels; 0 where nothing is seen or nothing has moved.
    ///
    /// # Errors
    /// When the mesh is not there or has another number of vertices.
    pub fn motion(&self, mesh: usize, before: &[Vec3]) -> Result<Vec<[f32; 3]>> {
        cpu::motion::motion(
            &self.table,
            &view(&self.table, &self.settings),
            mesh,
            before,
        )
    }

    /// The settings.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Samples a pixel gathered so far.
    #[must_use]
    pub fn samples(&self) -> u32 {
        match &self.engine {
            Engine::Cpu => self.sums.samples,
            Engine::Gpu(gpu) => gpu.samples(),
        }
    }

    /// Gathers `count` more samples of every pixel. Returns false when `stop` was set meanwhile; samples that
    /// not every pixel has got are then not counted.
    ///
    /// # Errors
    /// When the GPU fails and the CPU cannot go on in its place.
    pub fn step(&mut self, count: u32, stop: &AtomicBool) -> Result<bool> {
        let goal = self.samples() + count;
        let Err(why) = self.gather(goal, stop) else {
            return Ok(self.samples() >= goal);
        };
        self.recover(&why, goal, stop)?;
        Ok(self.samples() >= goal)
    }

    /// Gathers samples until there are `goal`, each with the mesh where it is at its moment.
    fn gather(&mut self, goal: u32, stop: &AtomicBool) -> Result<()> {
        let view = view(&self.table, &self.settings);
        while self.samples() < goal {
            let mut count = goal - self.samples();
            let index = self.samples();
            if let Some(shutter) = &mut self.shutter {
                count = count.min(shutter.left(index));
                if let Some(pose) = shutter.turn(index) {
                    let mesh = shutter.mesh;
                    self.place_mesh(mesh, &pose.positions, &pose.normals)?;
                }
            }
            let whole = match &mut self.engine {
                Engine::Gpu(gpu) => gpu.step(&view, count, stop)?,
                Engine::Cpu => {
                    let (sums, fresh) = (&mut self.sums, &mut self.fresh);
                    cpu::step(&self.table, &view, sums, fresh, count, stop)
                }
            };
            if !whole {
                break;
            }
        }
        Ok(())
    }

    /// What was gathered since the last read-back is gathered again, on a fresh device or the CPU.
    fn recover(&mut self, why: &anyhow::Error, goal: u32, stop: &AtomicBool) -> Result<()> {
        let view = view(&self.table, &self.settings);
        let fresh = crate::gpu::Gpu::new(&self.table, &view, true).and_then(|mut gpu| {
            gpu.restore(&self.sums)?;
            Ok(gpu)
        });
        let again = fresh.and_then(|gpu| {
            self.engine = Engine::Gpu(Box::new(gpu));
            self.gather(goal, stop)
        });
        self.note = Some(match again {
            Ok(()) => format!("the GPU was lost and has been set up again: {why:#}"),
            Err(_) => {
                self.engine = Engine::Cpu;
                self.gather(goal, stop)?;
                format!("the GPU failed, going on with the CPU: {why:#}")
            }
        });
        Ok(())
    }

    /// Goes on until all samples are gathered, the time is over, the noise is low enough, or the listener stops it.
    ///
    /// # Errors
    /// As [`Self::step`], and when there is not a single sample.
    pub fn finish(&mut self, progress: &mut dyn Progress) -> Result<()> {
        self.finish_keeping(progress, Duration::MAX, &mut |_| Ok(()))
    }

    /// [`Self::finish`], which hands the sums to `keep` now and then, so that a power cut costs no more than the time
    /// `every`.
    ///
    /// # Errors
    /// As [`Self::finish`], and what `keep` gives.
    pub fn finish_keeping(
        &mut self,
        progress: &mut dyn Progress,
        every: Duration,
        keep: &mut dyn FnMut(&Accumulation) -> Result<()>,
    ) -> Result<()> {
        let stop = progress.stop().unwrap_or_default();
        let start = Instant::now();
        let mut kept = start;
        let pixels = u64::from(self.settings.width) * u64::from(self.settings.height);
        let mut goal = self.settings.spp;
        let mut count = 1;
        while self.samples() < goal {
            let mut most = goal - self.samples();
            if self.settings.noise.is_some() {
                // The estimate looks at the powers of two.
                most = most.min((self.samples() + 1).next_power_of_two() - self.samples());
            }
            let began = Instant::now();
            let whole = self.step(count.min(most), &stop)?;
            if !whole {
                break;
            }
            if let Some(limit) = self.settings.noise {
                goal = self.goal(goal, limit)?;
            }
            progress.advance(pixels * u64::from(self.samples()), pixels * u64::from(goal));
            let took = began.elapsed().as_secs_f64();
            // Steps of about a third of a second: often enough to stop and to report, seldom enough to cost nothing.
            count =
                ((f64::from(count) * 0.33 / took.max(1e-4)) as u32).clamp(1, (count * 2).max(1));
            if let Some(limit) = self.settings.time_limit {
                let rest = limit.saturating_sub(start.elapsed()).as_secs_f64();
                if rest <= 0.0 {
                    break;
                }
                let rate = f64::from(self.samples()) / start.elapsed().as_secs_f64().max(1e-6);
                count = count.min((rest * rate) as u32).max(1);
            }
            if stop.load(Ordering::Relaxed) {
                break;
            }
            if kept.elapsed() >= every && self.samples() < goal {
                keep(self.sums()?)?;
                kept = Instant::now();
            }
        }
        ensure!(
            self.samples() > 0,
            "stopped before the first sample of each pixel; nothing was rendered"
        );
        Ok(())
    }

    /// The samples that bring the noise to `limit`, at most `spp`. At each power of two the two halves of the
    /// samples are compared; the noise of their mean is a quarter of their squared difference, and it falls at least as 1/n.
    fn goal(&mut self, goal: u32, limit: f32) -> Result<u32> {
        let n = self.samples();
        if !n.is_power_of_two() || n < 4 {
            return Ok(goal);
        }
        self.read_back()?;
        let now = self.sums.means();
        let half = self.half.replace((n, now));
        let Some((_, before)) = half.filter(|h| h.0 * 2 == n) else {
            return Ok(goal);
        };
        let now = self.half.as_ref().map_or(&[][..], |h| &h.1);
        let mut sum = 0.0;
        for (m, a) in now.iter().flatten().zip(before.iter().flatten()) {
            // The mean of the second half is 2 m - a, its distance from the first half's 2 (m - a).
            sum += f64::from((m - a) * (m - a)) / f64::from(m * m + 0.01);
        }
        let noise = sum / (now.len() * 3).max(1) as f64;
        self.noise = Some(noise * f64::from(n));
        // Fewer than 16 samples say little about their own noise.
        let wanted = (f64::from(n) * noise / f64::from(limit.max(1e-12)))
            .ceil()
            .min(1e9) as u32;
        Ok(wanted.max(n).max(16).min(self.settings.spp))
    }

    /// The estimated relMSE of the picture so far; only with [`Settings::noise`], from the eighth sample on.
    #[must_use]
    pub fn noise(&self) -> Option<f64> {
        Some(self.noise? / f64::from(self.samples().max(1)))
    }

    /// The picture so far.
    ///
    /// # Errors
    /// When it cannot be read back from the GPU.
    pub fn film(&mut self) -> Result<Film> {
        self.read_back()?;
        let mut film = self.sums.film(&self.settings);
        film.metadata.insert("device".into(), self.device());
        if let Some(noise) = self.noise() {
            film.metadata.insert("noise".into(), format!("{noise:.6}"));
        }
        Ok(film)
    }

    /// The sums so far, to be stored and resumed from.
    ///
    /// # Errors
    /// As [`Self::film`].
    pub fn sums(&mut self) -> Result<&Accumulation> {
        self.read_back()?;
        Ok(&self.sums)
    }

    fn read_back(&mut self) -> Result<()> {
        let Engine::Gpu(gpu) = &mut self.engine else {
            // Without a sample there may be sums of before, see `clear`.
            if self.sums.samples == 0 {
                self.sums.pixels.fill(PixelSum::default());
            }
            return Ok(());
        };
        let Err(why) = gpu.read(&mut self.sums) else {
            return Ok(());
        };
        let goal = gpu.samples();
        self.recover(&why, goal, &AtomicBool::new(false))?;
        if let Engine::Gpu(gpu) = &mut self.engine {
            gpu.read(&mut self.sums)?;
        }
        Ok(())
    }

    /// Goes on from sums of an earlier run with the same scene and settings.
    ///
    /// # Errors
    /// When the sizes differ.
    pub fn resume(&mut self, sums: Accumulation) -> Result<()> {
        ensure!(
            (sums.width, sums.height) == (self.settings.width, self.settings.height),
            "the checkpoint has {} x {} pixels, the picture {} x {}",
            sums.width,
            sums.height,
            self.settings.width,
            self.settings.height
        );
        self.sums = sums;
        (self.half, self.noise) = (None, None);
        if let Engine::Gpu(gpu) = &mut self.engine {
            gpu.restore(&self.sums)?;
        }
        Ok(())
    }

    /// Forgets all samples.
    ///
    /// # Errors
    /// When the GPU does not answer.
    pub fn clear(&mut self) -> Result<()> {
        if let Engine::Cpu = self.engine {
            // The first sample takes the place of these sums.
            self.sums.samples = 0;
            (self.half, self.noise) = (None, None);
            return Ok(());
        }
        self.resume(Accumulation::new(self.settings.width, self.settings.height))
    }

    /// Another seed for the samples to come, as for the next frame of an animation; forgets the samples.
    ///
    /// # Errors
    /// As [`Self::clear`].
    pub fn set_seed(&mut self, seed: u32) -> Result<()> {
        self.settings.seed = seed;
        self.clear()
    }

    /// Looks from elsewhere; forgets the samples.
    ///
    /// # Errors
    /// As [`Self::clear`].
    pub fn set_camera(&mut self, camera: Camera) -> Result<()> {
        self.table.camera = camera;
        self.clear()
    }

    /// Moves the vertices of a mesh (refits the ray structure), which then stands there; forgets the samples. `normals` may
    /// be empty.
    ///
    /// # Errors
    /// When the mesh is not there or has another number of vertices.
    pub fn move_mesh(&mut self, mesh: usize, positions: &[Vec3], normals: &[Vec3]) -> Result<()> {
        self.shutter = None;
        self.place_mesh(mesh, positions, normals)?;
        self.clear()
    }

    /// Lets a mesh move through `poses`, evenly spaced in time, while the samples are gathered: it blurs. Forgets the
    /// samples. The same sums at any number of threads and after any pause, for a moment depends on the number of the sample
    /// alone (and on [`Settings::spp`], where neither time nor noise ends the render).
    ///
    /// # Errors
    /// When the mesh is not there, or the poses do not fit it.
    pub fn open_shutter(&mut self, mesh: usize, poses: Vec<Pose>) -> Result<()> {
        // Every pose must fit before the first sample.
        for pose in &poses {
            self.table.fits(mesh, &pose.positions, &pose.normals)?;
        }
        self.shutter = Some(Shutter::new(mesh, poses, &self.settings)?);
        self.clear()
    }

    fn place_mesh(&mut self, mesh: usize, positions: &[Vec3], normals: &[Vec3]) -> Result<()> {
        self.table.move_mesh(mesh, positions, normals)?;
        if let Engine::Gpu(gpu) = &mut self.engine {
            gpu.moved(&self.table)?;
        }
        Ok(())
    }
}

/// The camera and the settings as the transport needs them.
pub(crate) fn view(table: &Table, settings: &Settings) -> View {
    let camera = &table.camera;
    let m = camera.transform;
    let unit = |v: glam::Vec4, or: Vec3| v.truncate().try_normalize().unwrap_or(or);
    let (x, y, z) = (
        unit(m.x_axis, Vec3::X),
        unit(m.y_axis, Vec3::Y),
        unit(m.z_axis, Vec3::Z),
    );
    let tan = (0.5 * camera.vfov).tan();
    View {
        eye: m.w_axis.truncate(),
        right: x * (tan * settings.width as f32 / settings.height as f32),
        up: y * tan,
        forward: -z,
        lens_x: x,
        lens_y: y,
        aperture: camera.aperture_radius,
        focus: camera.focus_distance,
        width: settings.width,
        height: settings.height,
        depth: match settings.integrator {
            Integrator::Path => settings.depth,
            Integrator::Direct => settings.depth.min(1),
        },
        seed: settings.seed,
    }
}
