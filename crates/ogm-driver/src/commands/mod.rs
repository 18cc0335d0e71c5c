//! The commands of `ogm`, one file for each kind of work.

mod inspect;
mod plan;
mod scan;
mod sim;

pub(crate) use inspect::{MergeArgs, ReplayArgs, merge, replay};
pub(crate) use plan::{NextArgs, PlanArgs, next, plan};
pub(crate) use scan::{ScanArgs, scan};
pub(crate) use sim::{CameraArgs, SimArgs, camera, sim};

use std::path::Path;

use ogm_driver::error::Result;
use ogm_driver::rig::Rig;
use ogm_driver::transport::StopToken;

/// The rig of a word or a file.
fn rig_named(name: &str) -> Result<Rig> {
    match name {
        "shot" => Ok(Rig::default()),
        "grbl" => Ok(Rig::grbl()),
        "instant" => Ok(Rig::default().with_instant_motors()),
        file => Rig::load(Path::new(file)),
    }
}

/// A token that Ctrl-C pulls.
fn stop_on_signal() -> StopToken {
    let stop = StopToken::new();
    let token = stop.clone();
    if let Err(e) = ctrlc::set_handler(move || token.stop()) {
        eprintln!("Ctrl-C cannot be caught ({e}); stop the rig by its emergency switch.");
    }
    stop
}

fn tell_left_out(n: usize) {
    if n > 0 {
        eprintln!("{n} poses lie outside the limits or in the zone of the arms and are left out.");
    }
}
