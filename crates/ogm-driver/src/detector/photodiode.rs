//! The photodiode head that shares the controller's line.

use std::time::Duration;

use super::{Detector, Exposure, Shot};
use crate::controller::QUESTION_TRIES;
use crate::error::{Error, Result};
use crate::protocol::head::{self, Reply, Request};
use crate::rig::Rig;
use crate::transport::Link;

/// The photodiode head of [`crate::protocol::head`].
#[derive(Debug, Default)]
pub struct SerialPhotodiode;

fn ask<T>(
    link: &mut Link,
    request: Request,
    deadline: Duration,
    pick: impl Fn(Reply) -> Option<T>,
) -> Result<T> {
    let question = head::encode_request(request);
    link.ask(question.as_bytes(), deadline, QUESTION_TRIES, |line| {
        Ok(head::parse_reply(line).and_then(&pick))
    })
}

impl Detector for SerialPhotodiode {
    fn identify(&mut self, link: &mut Link, rig: &Rig) -> Result<String> {
        ask(link, Request::Identify, rig.reply(), |r| match r {
            Reply::Identity(text) => Some(text),
            _ => None,
        })
    }

    fn lamp_seconds(&mut self, link: &mut Link, rig: &Rig) -> Result<Option<f64>> {
        ask(link, Request::Lamp, rig.reply(), |r| match r {
            Reply::Lamp(s) => Some(Some(s as f64)),
            _ => None,
        })
    }

    fn expose(&mut self, link: &mut Link, rig: &Rig, exposure: &Exposure) -> Result<Shot> {
        let us = (exposure.ms * 1000.0).round();
        let aperture = (exposure.f_number * 10.0).round();
        if !((1.0..=6e8).contains(&us) && (5.0..=640.0).contains(&aperture)) {
            return Err(Error::Detector(format!(
                "The photodiode cannot expose {} ms at f/{}; give 0.001..600000 ms and f/0.5..f/64.",
                exposure.ms, exposure.f_number
            )));
        }
        let request = Request::Read {
            tag: exposure.tag,
            exposure_us: us as u64,
            aperture: aperture as u32,
        };
        ask(link, request, exposure.deadline(rig), |r| match r {
            Reply::Value {
                tag,
                counts,
                reference,
                saturated,
            } if tag == exposure.tag => {
                Some(exposure.shot(counts as f64, reference as f64, saturated))
            }
            _ => None,
        })
    }
}
