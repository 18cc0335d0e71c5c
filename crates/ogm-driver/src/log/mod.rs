//! The scan log: append-only, one line a record, each with its number and checksum, on the disk before the arms move on.
//!
//! A line is `#<number> <crc32> <json>`: the number counts from 0 in eight digits, the CRC-32 (IEEE) in eight hexadecimal digits covers
//! `<number> <json>`. A new line followed by `#` is the mark from which reading starts again after damage.
//! What follows the last whole record is a torn tail: it was never acknowledged and is cut off when the scan goes on.
//! A bad or missing record *before* a good one is damage, which is an error: somebody should know.

use serde::{Deserialize, Serialize};

use crate::detector::Shot;
use crate::error::{Error, Result};
use crate::pose::Pose;

mod contents;
mod worker;
mod writer;

pub use contents::{Contents, parse, read};
pub use worker::Worker;
pub use writer::{Sink, Writer};

/// The format's number; a reader refuses others.
pub const FORMAT: u32 = 1;

/// What a reading is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum What {
    /// Shutter closed.
    Dark,
    /// The direct beam, without the sample: the scale.
    Direct,
    /// The direct beam at exposures over the detector's range.
    Linearity,
    /// The white standard.
    White,
    /// The direct beam again, to follow the lamp.
    Reference,
    /// The direct beam after a resume, to see that the rig is as it was.
    Check,
    /// The sample.
    Sample,
}

/// One pose's reading.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// What was in the beam.
    pub what: What,
    /// Number within its kind; for the sample the place in the route.
    pub index: usize,
    /// The pose of the plan.
    pub asked: Pose,
    /// The pose that the controller reported at rest.
    pub reached: Pose,
    /// The f-number of all shots.
    pub f_number: f64,
    /// The exposures.
    pub shots: Vec<Shot>,
    /// Wall clock, seconds since 1970.
    pub wall_s: f64,
    /// Seconds since the first session began, by a clock that does not jump while a session lasts.
    pub scan_s: f64,
}

/// A record of the log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Record {
    /// The first record.
    Header {
        /// [`FORMAT`].
        format: u32,
        /// Program and version.
        software: String,
        /// The plan as TOML.
        plan: String,
        /// The rig as TOML.
        rig: String,
        /// SHA-256 of plan and rig text.
        fingerprint: String,
        /// Poses of the route.
        points: usize,
    },
    /// The scan was started or resumed.
    Session {
        /// From 0.
        number: u32,
        /// Wall clock, seconds since 1970.
        wall_s: f64,
        /// Seconds of [`Reading::scan_s`] at the session's start.
        scan_s: f64,
        /// Controller and firmware.
        controller: String,
        /// Detector and serial number.
        detector: String,
        /// Seconds the lamp had been on, if known.
        lamp_s: Option<f64>,
        /// Bytes of a torn tail that were cut off.
        torn_bytes: u64,
    },
    /// A reading.
    Reading(Reading),
    /// The scan is complete.
    End {
        /// Sample readings in the log.
        points: usize,
    },
}

/// A record as a line with its line end.
pub fn encode(number: u64, record: &Record) -> Result<Vec<u8>> {
    let json = serde_json::to_string(record)
        .map_err(|e| Error::Log(format!("A record cannot be written: {e}.")))?;
    let body = format!("{number:08} {json}");
    Ok(format!(
        "#{number:08} {:08x} {json}\n",
        crc32fast::hash(body.as_bytes())
    )
    .into_bytes())
}

/// A line (without its line end) as number and record; `None` when it is damaged.
pub fn decode(line: &[u8]) -> Option<(u64, Record)> {
    let text = std::str::from_utf8(line).ok()?.strip_prefix('#')?;
    let (number, rest) = text.split_once(' ')?;
    let (crc, json) = rest.split_once(' ')?;
    if number.len() < 8 || crc.len() != 8 {
        return None;
    }
    let sum = u32::from_str_radix(crc, 16).ok()?;
    if crc32fast::hash(format!("{number} {json}").as_bytes()) != sum {
        return None;
    }
    Some((number.parse().ok()?, serde_json::from_str(json).ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn end(points: usize) -> Record {
        Record::End { points }
    }

    fn three() -> Vec<u8> {
        (0..3)
            .flat_map(|n| encode(n, &end(n as usize)).unwrap())
            .collect()
    }

    #[test]
    fn numbers_come_back_to_the_last_bit() {
        // A resumed scan reads what an undisturbed one still has in memory, and both must choose the same poses.
        for k in 0..20_000 {
            let scan_s = 1e4 * crate::sim::noise::Noise::at(&[k, 0xf64]).uniform();
            let record = Record::Session {
                number: 0,
                wall_s: scan_s / 3.0,
                scan_s,
                controller: String::new(),
                detector: String::new(),
                lamp_s: Some(scan_s / 7.0),
                torn_bytes: 0,
            };
            let line = encode(0, &record).unwrap();
            assert_eq!(decode(&line[..line.len() - 1]), Some((0, record)));
        }
    }

    #[test]
    fn every_cut_is_a_torn_tail() {
        let whole = three();
        let one = encode(0, &end(0)).unwrap().len();
        for cut in 0..=whole.len() {
            let c = parse(&whole[..cut]);
            assert_eq!(c.records.len(), cut / one, "{cut}");
            assert!(c.damage.is_empty());
            assert_eq!(c.good_bytes + c.torn_bytes, cut as u64);
        }
    }

    #[test]
    fn every_changed_byte_is_told_and_the_rest_is_read() {
        let whole = three();
        let one = whole.len() / 3;
        for at in 0..whole.len() {
            let mut bad = whole.clone();
            bad[at] ^= 0x04;
            let c = parse(&bad);
            if at < 2 * one {
                assert!(!c.damage.is_empty(), "byte {at} changed and nobody noticed");
                assert!(c.records.contains(&end(2)), "{at}");
            } else {
                // In the last record, damage and a torn tail look alike: the point is measured again.
                assert_eq!((c.records.len(), c.damage.len()), (2, 0), "{at}");
            }
        }
    }

    #[test]
    fn a_lost_record_is_damage() {
        let whole = three();
        let one = whole.len() / 3;
        let c = parse(&[&whole[..one], &whole[2 * one..]].concat());
        assert_eq!(
            c.damage,
            vec![format!("Records 1 to 1 are missing before byte {one}.")]
        );
    }

    #[test]
    fn a_file_of_somebody_else_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("letter.txt");
        std::fs::write(&path, "Dear Sir").unwrap();
        let e = Writer::open(&path).err().unwrap().to_string();
        assert!(e.contains("not a scan log"), "{e}");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "Dear Sir");
    }

    #[test]
    fn a_torn_tail_is_cut_and_writing_goes_on() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.ogm");
        let whole = three();
        std::fs::write(&path, &whole[..whole.len() - 5]).unwrap();
        let (mut w, c) = Writer::open(&path).unwrap();
        assert_eq!(c.records.len(), 2);
        assert!(
            Writer::open(&path)
                .err()
                .unwrap()
                .to_string()
                .contains("Another scan")
        );
        w.append(&end(2)).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), whole);
    }
}
