//! The photodiode head: an ADC with shutter timing that shares the controller's line. Its lines begin with `@`, which no controller here uses.
//!
//! | sent | answered |
//! |---|---|
//! | `@R tag exposure_us aperture` | `@V tag counts reference flags` and a CRC, once the exposure is over |
//! | `@L` | `@L seconds_on` and a CRC: how long the lamp has been on (0 = off) |
//! | `@I` | `@I name serial` and a CRC |
//!
//! `tag` is chosen by the host and comes back unchanged, so a late answer is never taken for the right one. `aperture` is the f-number times ten.
//! Every line ends in ` *XXXX`, the CRC-16/CCITT-FALSE of what stands before the blank. A line with a wrong CRC is not answered.

/// What the host asks of the head.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Request {
    /// One exposure.
    Read {
        /// Chosen by the host, comes back.
        tag: u64,
        /// Exposure in microseconds.
        exposure_us: u64,
        /// f-number times ten.
        aperture: u32,
    },
    /// How long the lamp has been on.
    Lamp,
    /// Who are you.
    Identify,
}

/// What the head answers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Reply {
    /// One exposure.
    Value {
        /// The host's tag.
        tag: u64,
        /// ADC counts of the detector.
        counts: i64,
        /// ADC counts of the reference diode beside the lamp.
        reference: i64,
        /// Whether the ADC was at its end.
        saturated: bool,
    },
    /// Seconds since the lamp was switched on; 0 when off.
    Lamp(u64),
    /// Name and serial number.
    Identity(String),
}

/// CRC-16/CCITT-FALSE (polynomial 0x1021, start 0xFFFF): "123456789" gives 0x29B1.
pub fn crc16(bytes: &[u8]) -> u16 {
    bytes.iter().fold(0xFFFF, |crc, &b| {
        (0..8).fold(crc ^ (u16::from(b) << 8), |c, _| {
            if c & 0x8000 == 0 {
                c << 1
            } else {
                (c << 1) ^ 0x1021
            }
        })
    })
}

fn seal(body: &str) -> String {
    format!("{body} *{:04X}\r\n", crc16(body.as_bytes()))
}

fn unseal(line: &str) -> Option<&str> {
    let (body, crc) = line.rsplit_once(" *")?;
    (crc.len() == 4 && u16::from_str_radix(crc, 16).ok()? == crc16(body.as_bytes())).then_some(body)
}

/// A request as bytes.
pub fn encode_request(request: Request) -> String {
    seal(&match request {
        Request::Read {
            tag,
            exposure_us,
            aperture,
        } => format!("@R {tag} {exposure_us} {aperture}"),
        Request::Lamp => "@L".into(),
        Request::Identify => "@I".into(),
    })
}

/// A request from a line without its line end; `None` when it is damaged.
pub fn parse_request(line: &str) -> Option<Request> {
    let mut words = unseal(line)?.split(' ');
    let request = match words.next()? {
        "@R" => Request::Read {
            tag: words.next()?.parse().ok()?,
            exposure_us: words.next()?.parse().ok()?,
            aperture: words.next()?.parse().ok()?,
        },
        "@L" => Request::Lamp,
        "@I" => Request::Identify,
        _ => return None,
    };
    words.next().is_none().then_some(request)
}

/// A reply as bytes.
pub fn encode_reply(reply: &Reply) -> String {
    seal(&match reply {
        Reply::Value {
            tag,
            counts,
            reference,
            saturated,
        } => format!("@V {tag} {counts} {reference} {}", u8::from(*saturated)),
        Reply::Lamp(seconds) => format!("@L {seconds}"),
        Reply::Identity(text) => format!("@I {text}"),
    })
}

/// A reply from a line without its line end; `None` when it is damaged or not the head's.
pub fn parse_reply(line: &str) -> Option<Reply> {
    let body = unseal(line)?;
    if let Some(text) = body.strip_prefix("@I ") {
        return Some(Reply::Identity(text.into()));
    }
    let mut words = body.split(' ');
    let reply = match words.next()? {
        "@V" => Reply::Value {
            tag: words.next()?.parse().ok()?,
            counts: words.next()?.parse().ok()?,
            reference: words.next()?.parse().ok()?,
            saturated: match words.next()? {
                "0" => false,
                "1" => true,
                _ => return None,
            },
        },
        "@L" => Reply::Lamp(words.next()?.parse().ok()?),
        _ => return None,
    };
    words.next().is_none().then_some(reply)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_check_value_of_the_catalogue() {
        assert_eq!(crc16(b"123456789"), 0x29B1);
    }

    #[test]
    fn round_trips() {
        for r in [
            Request::Read {
                tag: 7,
                exposure_us: 32_000,
                aperture: 40,
            },
            Request::Lamp,
            Request::Identify,
        ] {
            assert_eq!(parse_request(encode_request(r).trim_end()), Some(r));
        }
        for r in [
            Reply::Value {
                tag: 7,
                counts: -3,
                reference: 99_000,
                saturated: true,
            },
            Reply::Lamp(1800),
            Reply::Identity("ogm-photodiode SIM-1".into()),
        ] {
            assert_eq!(parse_reply(encode_reply(&r).trim_end()).as_ref(), Some(&r));
        }
    }

    #[test]
    fn one_wrong_byte_is_always_seen() {
        let good = encode_reply(&Reply::Value {
            tag: 12,
            counts: 4711,
            reference: 5000,
            saturated: false,
        });
        let good = good.trim_end();
        for at in 0..good.len() {
            for flip in 1..=127_u8 {
                let mut bad = good.as_bytes().to_vec();
                bad[at] ^= flip;
                let bad = String::from_utf8_lossy(&bad).into_owned();
                // Upper and lower case of the CRC itself mean the same.
                if !bad.eq_ignore_ascii_case(good) {
                    assert_eq!(parse_reply(&bad), None, "{bad:?}");
                }
            }
        }
    }
}
