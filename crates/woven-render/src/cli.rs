//! The command line: what can be asked for. Each command is one file below.

mod adapters;
mod animate;
mod compare;
mod frame;
mod oidn;
mod progress;
mod setup;

use anyhow::Result;
use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;
use std::str::FromStr;

/// Renders scenes with woven cloth by path tracing, on the CPU or a GPU.
#[derive(Parser, Debug)]
#[command(
    name = "woven-render",
    version,
    arg_required_else_help = true,
    after_help = "Examples:
  woven-render frame room.glb -o room.exr --size 640x480 --spp 64
  woven-render frame room.glb -o room.png --fabric lace=lace.toml --env noon.hdr --denoise
  woven-render animate room.glb --cloth wind.glb --frames 0..48 -o frames
  woven-render compare ours.exr reference.exr --json
  woven-render adapters"
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Render one picture of a glTF scene.
    Frame(Box<frame::FrameArgs>),
    /// Render a scene in which one mesh moves, frame by frame; resumes where it was stopped.
    Animate(Box<animate::AnimateArgs>),
    /// Measure how much two pictures differ: FLIP, relMSE, RMSE, PSNR, ΔE2000.
    Compare(compare::CompareArgs),
    /// List the GPUs there are and which would be used.
    Adapters(adapters::AdaptersArgs),
}

/// Does what was asked for.
pub(crate) fn run(cli: Cli) -> Result<()> {
    match cli.command {
        Command::Frame(args) => frame::run(&args),
        Command::Animate(args) => animate::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Adapters(args) => adapters::run(&args),
    }
}

/// What `frame` and `animate` share.
#[derive(Args, Debug, Clone)]
pub(crate) struct RenderArgs {
    /// Where the work is done; auto takes a hardware GPU if there is one.
    #[arg(long, value_enum, default_value = "auto")]
    pub(crate) backend: BackendArg,
    /// path counts all light up to --depth scattering events, direct only the first.
    #[arg(long, value_enum, default_value = "path")]
    pub(crate) integrator: IntegratorArg,
    /// Size of the picture in pixels.
    #[arg(long, value_name = "WxH", default_value = "640x480")]
    pub(crate) size: Size,
    /// Samples a pixel.
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub(crate) spp: u32,
    /// Stop as soon as the estimated noise (relMSE) is at most this; --spp is then the most. 0.001 looks clean.
    #[arg(long, value_name = "RELMSE")]
    pub(crate) noise: Option<f32>,
    /// Stop after this many seconds (of each frame) with the samples gathered by then.
    #[arg(long, value_name = "SECONDS")]
    pub(crate) time: Option<f64>,
    /// Most scattering events of a path; passing through a gap is none.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(0..=1024))]
    pub(crate) depth: u32,
    /// Another seed gives another noise.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) seed: u32,
    /// Give a material of the scene the optics of a fabric file; may be repeated.
    #[arg(long, value_name = "MATERIAL=FABRIC.toml")]
    pub(crate) fabric: Vec<Pairing>,
    /// Light from a latitude-longitude picture (.hdr or .exr) around the scene.
    #[arg(long, value_name = "MAP.hdr", conflicts_with = "sky")]
    pub(crate) env: Option<PathBuf>,
    /// Turn the environment about the vertical, in degrees, counter-clockwise seen from above.
    #[arg(
        long,
        value_name = "DEGREES",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    pub(crate) env_turn: f32,
    /// Multiply the environment (and sky and sun).
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    pub(crate) env_scale: f32,
    /// Clear sky and sun of a date and time, as 2026-06-21T12:00+02:00.
    #[arg(long, value_name = "DATETIME")]
    pub(crate) sky: Option<woven_render::scene::sky::DateTime>,
    /// Place of --sky in degrees, north and east positive.
    #[arg(
        long,
        value_name = "LAT,LON",
        default_value = "48.14,11.58",
        allow_hyphen_values = true
    )]
    pub(crate) place: Place,
    /// Haze of --sky: 2 very clear, 3 clear, 6 hazy.
    #[arg(long, value_name = "T", default_value_t = 3.0)]
    pub(crate) turbidity: f64,
    /// Multiply the scene's own lamps and suns. Blender's exporter writes lumens: 0.00146 (1/683) makes watts of them.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0)]
    pub(crate) lamp_scale: f32,
    /// Use the camera of this name instead of the first.
    #[arg(long, value_name = "NAME")]
    pub(crate) camera: Option<String>,
    /// Filter the noise of the picture, led by albedo, normal, depth and variance.
    #[arg(long)]
    pub(crate) denoise: bool,
    /// Which denoiser --denoise means: our own, or the program oidnDenoise of Open Image Denoise; auto takes that where
    /// it is installed.
    #[arg(long, value_enum, default_value = "own")]
    pub(crate) denoiser: DenoiserArg,
    /// Keep albedo, normal, depth, gap, variance and (of an animation) motion as layers of the EXR.
    #[arg(long)]
    pub(crate) aov: bool,
    /// Keep one layer per light (sun, sky, lamps, other) in the EXR.
    #[arg(long)]
    pub(crate) light_layers: bool,
    /// Keep one layer for what the first sheet in view has scattered back (reflected), scattered through (transmitted), let
    /// pass by its gaps (gap), and given off (emitted) instead; their sum is the picture.
    #[arg(long, conflicts_with = "light_layers")]
    pub(crate) event_layers: bool,
    /// Brightness of a PNG in stops, added to the camera's.
    #[arg(
        long,
        value_name = "EV",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    pub(crate) exposure: f32,
    /// How a PNG shows light: filmic rolls off the brightest, clip cuts at 1.
    #[arg(long, value_enum, default_value = "filmic")]
    pub(crate) curve: CurveArg,
}

/// `--backend`.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BackendArg {
    /// A hardware GPU, else the CPU.
    Auto,
    /// The reference.
    Cpu,
    /// A GPU or an error; takes a software one (lavapipe) too.
    Gpu,
}

/// `--denoiser`.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DenoiserArg {
    /// Led by gap, normal, depth, albedo and variance.
    Own,
    /// Open Image Denoise, or an error.
    Oidn,
    /// Open Image Denoise where there is one.
    Auto,
}

/// `--integrator`.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum IntegratorArg {
    /// All light.
    Path,
    /// One scattering event.
    Direct,
}

/// `--curve`.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CurveArg {
    /// Rolls off.
    Filmic,
    /// Cuts off.
    Clip,
}

/// `640x480`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Size {
    pub(crate) width: u32,
    pub(crate) height: u32,
}

impl FromStr for Size {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text
            .split_once(['x', 'X', '×'])
            .and_then(|(w, h)| Some((w.trim().parse().ok()?, h.trim().parse().ok()?)));
        match parts {
            Some((width, height))
                if (1..=32_768).contains(&width) && (1..=32_768).contains(&height) =>
            {
                Ok(Size { width, height })
            }
            _ => Err(format!(
                "'{text}' is no size; write it as 640x480, each side 1 to 32768"
            )),
        }
    }
}

/// `MATERIAL=FABRIC.toml`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Pairing {
    pub(crate) material: String,
    pub(crate) file: PathBuf,
}

impl FromStr for Pairing {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once('=') {
            Some((material, file)) if !material.is_empty() && !file.is_empty() => Ok(Pairing {
                material: material.into(),
                file: file.into(),
            }),
            _ => Err(format!(
                "'{text}' is no pair; write it as lace=fabrics/lace.toml"
            )),
        }
    }
}

/// `48.14,11.58`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    pub(crate) latitude: f64,
    pub(crate) longitude: f64,
}

impl FromStr for Place {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once(',').and_then(|(a, b)| {
            Some((a.trim().parse::<f64>().ok()?, b.trim().parse::<f64>().ok()?))
        });
        match parts {
            Some((latitude, longitude)) if latitude.abs() <= 90.0 && longitude.abs() <= 360.0 => {
                Ok(Place {
                    latitude,
                    longitude,
                })
            }
            _ => Err(format!(
                "'{text}' is no place; write latitude,longitude in degrees, as 48.14,11.58"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_sound() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }

    #[test]
    fn values_that_make_no_sense_are_refused_with_an_example() {
        assert_eq!(
            "320x240".parse(),
            Ok(Size {
                width: 320,
                height: 240
            })
        );
        for bad in ["", "x", "640", "0x5", "-1x5", "99999x5", "6e2x4"] {
            assert!(
                bad.parse::<Size>().unwrap_err().contains("640x480"),
                "{bad}"
            );
        }
        assert!("lace".parse::<Pairing>().is_err());
        assert_eq!(
            "a=b=c".parse::<Pairing>().unwrap().file,
            PathBuf::from("b=c")
        );
        assert!("91,0".parse::<Place>().is_err());
        assert_eq!(
            "-33.9, 18.4".parse(),
            Ok(Place {
                latitude: -33.9,
                longitude: 18.4
            })
        );
    }
}
