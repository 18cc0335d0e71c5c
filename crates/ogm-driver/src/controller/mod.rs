//! Motion controllers: home, move and verify, switch outputs, stop. One trait, two languages.

mod grbl;
mod shot;

use crate::error::{Error, Result};
use crate::pose::AXES;
use crate::rig::{Language, Rig};
use crate::transport::Link;

pub use grbl::GrblController;
pub use shot::ShotController;

/// Questions change nothing and may be repeated this often; moves are never repeated.
pub const QUESTION_TRIES: u32 = 3;

/// Drives the axes over a link it is lent for each call.
pub trait Controller: Send {
    /// Product and firmware, asked from the device.
    ///
    /// # Errors
    /// No or no sensible reply.
    fn identify(&mut self, link: &mut Link, rig: &Rig) -> Result<String>;
    /// Homes every axis and returns their positions (pulses) afterwards.
    ///
    /// # Errors
    /// No reply, refusal, limit, alarm, or the deadline of homing.
    fn home(&mut self, link: &mut Link, rig: &Rig) -> Result<[i64; AXES]>;
    /// Moves to `target` (pulses), waits, and returns the positions the controller reports at rest. The move is sent once, never again.
    ///
    /// # Errors
    /// No reply, refusal, limit, alarm, a move that ends elsewhere or never.
    fn move_to(
        &mut self,
        link: &mut Link,
        rig: &Rig,
        target: &[i64; AXES],
        seconds: f64,
    ) -> Result<[i64; AXES]>;
    /// Positions at rest, asked from the device.
    ///
    /// # Errors
    /// No or no sensible reply.
    fn positions(&mut self, link: &mut Link, rig: &Rig) -> Result<[i64; AXES]>;
    /// Sets the four output bits.
    ///
    /// # Errors
    /// No reply or refusal.
    fn set_outputs(&mut self, link: &mut Link, rig: &Rig, bits: u8) -> Result<()>;
    /// What stops all arms at once.
    fn stop_bytes(&self) -> &'static [u8];
}

/// The controller a rig file names.
pub fn controller_for(rig: &Rig) -> Box<dyn Controller> {
    match rig.language {
        Language::Shot => Box::new(ShotController::new(rig.model)),
        Language::Grbl => Box::new(GrblController::new()),
    }
}

/// Asks what changes nothing, so it may be repeated; the answer is the first line that `read` takes.
fn question<T>(
    link: &mut Link,
    rig: &Rig,
    bytes: &[u8],
    read: impl FnMut(&str) -> Result<Option<T>>,
) -> Result<T> {
    link.ask(bytes, rig.reply(), QUESTION_TRIES, read)
}

/// The name of a command for messages: its bytes without the line end.
fn named(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).trim_end().to_string()
}

/// The positions of the rig's axes out of a status that has at least as many.
fn four(positions: &[i64]) -> [i64; AXES] {
    let mut out = [0; AXES];
    out.copy_from_slice(&positions[..AXES]);
    out
}

/// Compares reached and wanted pulses and names the first axis that is off.
pub(crate) fn verify(
    rig: &Rig,
    command: &str,
    wanted: &[i64; AXES],
    got: &[i64; AXES],
) -> Result<()> {
    for i in 0..AXES {
        if wanted[i] != got[i] {
            let axis = &rig.axes[i];
            return Err(Error::NotThere {
                axis: axis.name.clone(),
                wanted: axis.degrees(wanted[i]),
                got: axis.degrees(got[i]),
                command: command.into(),
            });
        }
    }
    Ok(())
}
