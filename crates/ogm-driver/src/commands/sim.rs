//! `ogm sim`: the simulated rig behind a pseudo-terminal.

use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use clap::Args;

use super::{rig_named, stop_on_signal};
use ogm_driver::error::{Error, Result};
use ogm_driver::pose::AXES;
use ogm_driver::sim::camera::{CameraServer, relay};
use ogm_driver::sim::fabric::FabricSample;
use ogm_driver::sim::optics::{PlainCloth, Sample};
use ogm_driver::sim::{Bench, Device, FaultPlan, Imperfections, PtyRig};

/// What the simulated rig is like.
#[derive(Args)]
pub(crate) struct SimArgs {
    /// The fabric in the beam; without it a plain cloth.
    #[arg(long)]
    fabric: Option<PathBuf>,
    /// The rig: shot, grbl, instant (arms that arrive at once), or a TOML file.
    #[arg(long, default_value = "shot")]
    rig: String,
    /// A mishap and its moment; may be given more than once.
    #[arg(long)]
    fault: Vec<String>,
    /// Seed of the noise and of random faults.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// How many times faster than the wall clock the simulation runs.
    #[arg(long, default_value_t = 1.0)]
    speed: f64,
    /// Readings without noise, drift or dark counts.
    #[arg(long)]
    perfect: bool,
    /// Lamp drift, share per hour.
    #[arg(long, default_value_t = 0.0)]
    drift: f64,
    /// True angle minus commanded angle of light theta, light phi, view theta, view phi, degrees.
    #[arg(
        long,
        value_delimiter = ',',
        allow_hyphen_values = true,
        value_name = "FOUR"
    )]
    misaligned: Vec<f64>,
    /// The detector reads c (1 - x c / full scale): this x.
    #[arg(long, default_value_t = 0.0, value_name = "X")]
    curved: f64,
    /// True full angle of the aperture minus the one of the rig file, degrees.
    #[arg(
        long,
        default_value_t = 0.0,
        allow_hyphen_values = true,
        value_name = "DEG"
    )]
    aperture_error: f64,
    /// Minutes the lamp has been on at the start.
    #[arg(long, default_value_t = 120.0)]
    lamp_on_min: f64,
    /// Answers take the time of their bytes on the line.
    #[arg(long)]
    wire_time: bool,
    /// A simulated camera listens on this socket; give the scan `--detector "ogm camera SOCKET"`.
    #[arg(long)]
    camera: Option<PathBuf>,
    /// Also makes a symbolic link of this name to the port.
    #[arg(long)]
    link: Option<PathBuf>,
}

/// Serves until Ctrl-C.
pub(crate) fn sim(args: SimArgs) -> Result<()> {
    let rig = rig_named(&args.rig)?;
    if !(args.speed > 0.0
        && args.speed <= 1e6
        && args.drift.abs() < 1.0
        && (0.0..=1e6).contains(&args.lamp_on_min)
        && args.curved.abs() < 0.5
        && args.aperture_error.abs() < 0.9 * rig.detector.aperture_deg
        && matches!(args.misaligned.len(), 0 | AXES)
        && args.misaligned.iter().all(|a| a.abs() <= 10.0))
    {
        return Err(Error::Rig(
            "Give --speed in 0..1000000, --drift in -1..1, --lamp-on-min in 0..1000000, --curved in -0.5..0.5, --misaligned as four angles within 10 degrees and --aperture-error within the aperture.".into(),
        ));
    }
    let misalignment_deg = <[f64; AXES]>::try_from(args.misaligned.clone()).unwrap_or_default();
    let sample: Arc<dyn Sample> = match &args.fabric {
        Some(path) => Arc::new(FabricSample::read(path)?),
        None => Arc::new(PlainCloth),
    };
    let base = if args.perfect {
        Imperfections::none()
    } else {
        Imperfections::default()
    };
    let wrong = Imperfections {
        seed: args.seed,
        drift_per_hour: args.drift,
        lamp_on_s: args.lamp_on_min * 60.0,
        misalignment_deg,
        nonlinearity: args.curved,
        aperture_error_deg: args.aperture_error,
        ..base
    };
    eprintln!("Simulating {}, in the beam: {}.", rig.name, sample.name());
    let baud = rig.baud;
    let faults = FaultPlan::parse(&args.fault, args.seed)?;
    let mut device = Device::new(Bench::new(rig, sample, wrong), faults);
    device.wire_baud = args.wire_time.then_some(baud);
    serve(device, &args)
}

/// Where the camera listens.
#[derive(Args)]
pub(crate) struct CameraArgs {
    /// The socket of `ogm sim --camera`.
    socket: PathBuf,
}

/// Carries lines between a scan and the simulated camera until the scan has no more questions.
pub(crate) fn camera(args: &CameraArgs) -> Result<()> {
    relay(&args.socket).map_err(|e| Error::io("talk to the camera at", &args.socket, e))
}

fn serve(device: Device, args: &SimArgs) -> Result<()> {
    let stop = stop_on_signal();
    let rig =
        PtyRig::start(device, args.speed).map_err(|e| Error::io("open", "a pseudo-terminal", e))?;
    if let Some(link) = &args.link {
        if link.is_symlink() {
            std::fs::remove_file(link).map_err(|e| Error::io("replace", link, e))?;
        }
        std::os::unix::fs::symlink(rig.port(), link)
            .map_err(|e| Error::io("make the link", link, e))?;
    }
    let camera = match &args.camera {
        Some(path) => Some(
            CameraServer::start(path, rig.device.clone(), rig.clock)
                .map_err(|e| Error::io("listen on the socket", path, e))?,
        ),
        None => None,
    };
    println!("{}", rig.port());
    std::io::stdout()
        .flush()
        .map_err(|e| Error::io("write", "the standard output", e))?;
    while !stop.is_set() && !rig.is_over() {
        std::thread::sleep(Duration::from_millis(50));
    }
    drop(camera);
    if let Some(link) = &args.link {
        let _ = std::fs::remove_file(link);
    }
    Ok(())
}
