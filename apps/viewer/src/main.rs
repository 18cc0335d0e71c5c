//! `woven-viewer`: a window with the curtain path traced live.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use clap::{Parser, ValueEnum};
use woven_catalog::stage::Preset;
use woven_render::render::Backend;
use woven_viewer::app::{Options, Viewer};
use woven_viewer::painter::StagePainter;
use woven_viewer::{cloth, rail, style};

/// A window with a woven curtain, path traced live, with sliders for its optics and a polar plot of its BTDF.
#[derive(Parser)]
#[command(
    version,
    after_help = "Example: woven-viewer assets/fabrics/*.toml --measurement assets/measurements/satine_5500_white_pearl.xml"
)]
struct Arguments {
    /// Fabric files; the first is shown, the others can be chosen [default: those in assets/fabrics]
    #[arg(value_name = "FABRIC.toml")]
    fabrics: Vec<PathBuf>,
    /// Measured data to lay over the plot: Klems .xml or the rig's .csv
    #[arg(long, value_name = "FILE")]
    measurement: Option<PathBuf>,
    /// Where the picture is computed
    #[arg(long, value_enum, default_value_t = Where::Auto)]
    backend: Where,
    /// The light at the start
    #[arg(long, value_enum, default_value_t = When::Day)]
    light: When,
    /// Start with the wind on
    #[arg(long)]
    wind: bool,
    /// Samples a pixel after which the picture is finished
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = clap::value_parser!(u32).range(1..1_000_000))]
    spp: u32,
    /// Write a picture of the window to this file, then close it
    #[arg(long, value_name = "OUT.png")]
    screenshot: Option<PathBuf>,
    /// Seconds after which the screenshot is taken
    #[arg(
        long,
        value_name = "SECONDS",
        default_value_t = 10.0,
        requires = "screenshot"
    )]
    after: f64,
    /// Size of the window
    #[arg(long, value_name = "WxH", default_value = "1400x900", value_parser = size)]
    size: (f32, f32),
}

#[derive(Clone, Copy, ValueEnum)]
enum Where {
    /// On a GPU if there is one in hardware, else on the CPU
    Auto,
    /// On the CPU
    Cpu,
    /// On a GPU, a software one if there is no other
    Gpu,
}

#[derive(Clone, Copy, ValueEnum)]
enum When {
    Day,
    Evening,
}

fn size(text: &str) -> Result<(f32, f32), String> {
    let parsed = text
        .split_once('x')
        .and_then(|(w, h)| Some((w.parse::<u16>().ok()?, h.parse::<u16>().ok()?)));
    match parsed {
        Some((w, h)) if w >= 640 && h >= 480 => Ok((f32::from(w), f32::from(h))),
        _ => Err(format!(
            "{text:?} is not a size like 1400x900 (at least 640x480)"
        )),
    }
}

/// The fabrics of the project, beside the working folder or the program.
fn shipped_fabrics() -> Vec<PathBuf> {
    let beside = std::env::current_exe().ok().into_iter().flat_map(|exe| {
        exe.ancestors()
            .skip(1)
            .map(Path::to_owned)
            .collect::<Vec<_>>()
    });
    for root in std::iter::once(PathBuf::from(".")).chain(beside) {
        let Ok(folder) = std::fs::read_dir(root.join("assets/fabrics")) else {
            continue;
        };
        let mut found: Vec<_> = folder
            .filter_map(|e| Some(e.ok()?.path()))
            .filter(|p| p.extension().is_some_and(|e| e == "toml"))
            .collect();
        found.sort();
        if !found.is_empty() {
            return found;
        }
    }
    Vec::new()
}

/// A picture of the window, to be taken once.
struct Shot {
    path: PathBuf,
    at: Instant,
    asked: bool,
    done: Arc<AtomicBool>,
    error: Arc<Mutex<Option<String>>>,
}

/// The program in eframe's terms.
struct Window {
    viewer: Viewer,
    shot: Option<Shot>,
}

impl eframe::App for Window {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        self.viewer.show(ui);
        if let Some(shot) = &mut self.shot {
            shot.advance(ui.ctx());
        }
    }
}

impl Shot {
    fn advance(&mut self, ctx: &egui::Context) {
        if self.done.load(Ordering::Acquire) {
            ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        } else if self.at > Instant::now() {
            ctx.request_repaint_after(self.at - Instant::now());
        } else if !self.asked {
            self.asked = true;
            let (path, done, error, again) = (
                self.path.clone(),
                Arc::clone(&self.done),
                Arc::clone(&self.error),
                ctx.clone(),
            );
            ctx.request_screenshot(move |image| {
                let rgb: Vec<u8> = image
                    .pixels
                    .iter()
                    .flat_map(|p| [p.r(), p.g(), p.b()])
                    .collect();
                if let Err(e) =
                    woven_render::film::write_png8(&path, image.size[0], image.size[1], &rgb)
                {
                    *error.lock().unwrap_or_else(PoisonError::into_inner) = Some(format!("{e:#}"));
                }
                done.store(true, Ordering::Release);
                again.request_repaint();
            });
            ctx.request_repaint();
        } else {
            ctx.request_repaint_after(Duration::from_millis(50));
        }
    }
}

fn run(arguments: Arguments) -> Result<(), String> {
    let fabrics = if arguments.fabrics.is_empty() {
        shipped_fabrics()
    } else {
        arguments.fabrics
    };
    let options = Options {
        fabrics,
        measurement: arguments.measurement,
        backend: match arguments.backend {
            Where::Auto => Backend::Auto,
            Where::Cpu => Backend::Cpu,
            Where::Gpu => Backend::Gpu,
        },
        preset: match arguments.light {
            When::Day => Preset::Day,
            When::Evening => Preset::Evening,
        },
        passes: arguments.spp,
        wind: arguments.wind,
    };
    let error = Arc::new(Mutex::new(None));
    let after = Duration::try_from_secs_f64(arguments.after)
        .map_err(|_| "--after wants a number of seconds, 0 or more".to_owned())?;
    let shot = arguments.screenshot.map(|path| Shot {
        path,
        at: Instant::now() + after,
        asked: false,
        done: Arc::default(),
        error: Arc::clone(&error),
    });
    let native = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title("woven viewer")
            .with_app_id("woven-viewer")
            .with_inner_size([arguments.size.0, arguments.size.1])
            .with_min_inner_size([900.0, 600.0]),
        ..eframe::NativeOptions::default()
    };
    let create = move |cc: &eframe::CreationContext<'_>| -> Result<
        Box<dyn eframe::App>,
        Box<dyn std::error::Error + Send + Sync>,
    > {
        style::dress(&cc.egui_ctx);
        let curtain = rail::curtain(&cloth::Cloth::default());
        let viewer = Viewer::new(
            &cc.egui_ctx,
            options,
            || Box::new(StagePainter::default()),
            curtain,
        );
        Ok(Box::new(Window { viewer, shot }))
    };
    eframe::run_native("woven-viewer", native, Box::new(create))
        .map_err(|e| no_window(&e.to_string()))?;
    match error.lock().unwrap_or_else(PoisonError::into_inner).take() {
        Some(told) => Err(told),
        None => Ok(()),
    }
}

/// Why there is no window, and what to do.
fn no_window(cause: &str) -> String {
    // Some causes begin with a place in a library's source, which says nothing to a user.
    let cause = cause.rsplit_once(".rs:").map_or(cause, |(_, c)| {
        c.trim_start_matches(|c: char| c.is_ascii_digit() || c == ':' || c == ' ')
    });
    let cause = cause.trim_end_matches('.');
    format!(
        "No window can be opened ({cause}). The viewer needs a desktop (X11 or Wayland) and a driver for Vulkan or OpenGL; \
         on Debian and Ubuntu `apt install mesa-vulkan-drivers` gives one that works without a GPU. \
         Without a window, `woven-render frame` and `woven-catalog` make the same pictures."
    )
}

fn main() -> ExitCode {
    match run(Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(told) => {
            eprintln!("woven-viewer: {told}");
            ExitCode::FAILURE
        }
    }
}
