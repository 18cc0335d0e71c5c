//! Reading a log: every record that can be read, what was torn off at its end, and what is damaged before.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::{Record, decode};
use crate::error::{Error, Result};

/// No record is longer.
const LONGEST_RECORD: usize = 1 << 20;

/// What was found in a log.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Contents {
    /// Every good record.
    pub records: Vec<Record>,
    /// Bytes up to the end of the last good record.
    pub good_bytes: u64,
    /// Bytes after it: torn by the end of power, never acknowledged.
    pub torn_bytes: u64,
    /// Damage before the last good record, each a sentence.
    pub damage: Vec<String>,
}

/// Reads everything that can be read of a log's bytes.
pub fn parse(bytes: &[u8]) -> Contents {
    let mut out = Contents::default();
    let (mut at, mut next, mut bad_since) = (0_usize, 0_u64, None::<usize>);
    while at < bytes.len() {
        let Some(length) = bytes[at..].iter().position(|&b| b == b'\n') else {
            break;
        };
        let line = &bytes[at..at + length];
        let end = at + length + 1;
        // A damaged line end hides the record after it: reading starts again at every mark inside the line.
        let marks = line.iter().enumerate().filter(|(_, b)| **b == b'#');
        let found = marks
            .take(64)
            .find_map(|(start, _)| Some((start, decode(&line[start..])?)))
            .filter(|_| line.len() <= 2 * LONGEST_RECORD);
        match found {
            Some((start, (number, record))) => {
                if start > 0 {
                    bad_since = bad_since.or(Some(at));
                }
                if let Some(since) = bad_since.take() {
                    out.damage
                        .push(format!("Bytes {since} to {} cannot be read.", at + start));
                }
                match number.cmp(&next) {
                    std::cmp::Ordering::Equal => out.records.push(record),
                    std::cmp::Ordering::Greater => {
                        out.damage.push(format!(
                            "Records {next} to {} are missing before byte {at}.",
                            number - 1
                        ));
                        out.records.push(record);
                    }
                    std::cmp::Ordering::Less => out.damage.push(format!(
                        "Record {number} stands a second time at byte {at}; it was passed over."
                    )),
                }
                next = next.max(number + 1);
                out.good_bytes = end as u64;
            }
            None => bad_since = bad_since.or(Some(at)),
        }
        at = end;
    }
    out.torn_bytes = bytes.len() as u64 - out.good_bytes;
    out
}

/// Reads a log file.
///
/// # Errors
/// [`Error::Io`].
pub fn read(path: &Path) -> Result<Contents> {
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|mut f| f.read_to_end(&mut bytes))
        .map_err(|e| Error::io("read", path, e))?;
    Ok(parse(&bytes))
}
