//! Detectors: a trait, and the photodiode head that shares the controller's line.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::controller::QUESTION_TRIES;
use crate::error::{Error, Result};
use crate::protocol::head::{self, Reply, Request};
use crate::rig::Rig;
use crate::transport::Link;

/// One exposure as it came from the detector, and as it stands in the log.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Shot {
    /// Exposure, milliseconds.
    #[serde(rename = "ms")]
    pub exposure_ms: f64,
    /// Raw counts.
    pub counts: f64,
    /// Raw counts of the reference diode; 0 when there is none.
    #[serde(rename = "ref")]
    pub reference: f64,
    /// At the end of its range.
    #[serde(rename = "sat")]
    pub saturated: bool,
}

/// Takes exposures. A detector on the rig's own line uses the link it is lent; others ignore it except for the stop.
pub trait Detector: Send {
    /// Name and serial number.
    ///
    /// # Errors
    /// No or no sensible reply.
    fn identify(&mut self, link: &mut Link, rig: &Rig) -> Result<String>;
    /// Seconds the lamp has been on, if the detector knows; 0 when it is off.
    ///
    /// # Errors
    /// No or no sensible reply.
    fn lamp_seconds(&mut self, link: &mut Link, rig: &Rig) -> Result<Option<f64>>;
    /// One exposure. `tag` names the reading and comes back with it. An exposure moves nothing and may be repeated.
    ///
    /// # Errors
    /// No or no sensible reply.
    fn expose(
        &mut self,
        link: &mut Link,
        rig: &Rig,
        tag: u64,
        exposure_ms: f64,
        f_number: f64,
    ) -> Result<Shot>;
}

/// The photodiode head of [`crate::protocol::head`].
#[derive(Debug, Default)]
pub struct SerialPhotodiode;

impl SerialPhotodiode {
    fn ask<T>(
        link: &mut Link,
        request: Request,
        deadline: Duration,
        pick: impl Fn(Reply) -> Option<T>,
    ) -> Result<T> {
        link.ask(
            head::encode_request(request).as_bytes(),
            deadline,
            QUESTION_TRIES,
            |line| Ok(head::parse_reply(line).and_then(&pick)),
        )
    }
}

impl Detector for SerialPhotodiode {
    fn identify(&mut self, link: &mut Link, rig: &Rig) -> Result<String> {
        Self::ask(link, Request::Identify, rig.reply(), |r| match r {
            Reply::Identity(text) => Some(text),
            _ => None,
        })
    }

    fn lamp_seconds(&mut self, link: &mut Link, rig: &Rig) -> Result<Option<f64>> {
        Self::ask(link, Request::Lamp, rig.reply(), |r| match r {
            Reply::Lamp(s) => Some(Some(s as f64)),
            _ => None,
        })
    }

    fn expose(
        &mut self,
        link: &mut Link,
        rig: &Rig,
        tag: u64,
        exposure_ms: f64,
        f_number: f64,
    ) -> Result<Shot> {
        let us = (exposure_ms * 1000.0).round();
        let aperture = (f_number * 10.0).round();
        if !((1.0..=6e8).contains(&us) && (5.0..=640.0).contains(&aperture)) {
            return Err(Error::Detector(format!(
                "The photodiode cannot expose {exposure_ms} ms at f/{f_number}; give 0.001..600000 ms and f/0.5..f/64."
            )));
        }
        let request = Request::Read {
            tag,
            exposure_us: us as u64,
            aperture: aperture as u32,
        };
        let deadline = rig.reply() + Duration::from_secs_f64(exposure_ms / 1000.0 * 1.1);
        Self::ask(link, request, deadline, |r| match r {
            Reply::Value {
                tag: t,
                counts,
                reference,
                saturated,
            } if t == tag => Some(Shot {
                exposure_ms,
                counts: counts as f64,
                reference: reference as f64,
                saturated,
            }),
            _ => None,
        })
    }
}
