//! GRBL 1.1 / grblHAL with up to six axes: lines and real-time bytes to the controller, answers and reports from it.
//!
//! Source: gnea/grbl, doc/markdown/interface.md and commands.md; grblHAL/core. There is no degree in G-code: one "mm" is one degree here, and
//! positions are whole thousandths, as the controller reports them.

mod line;
mod reply;

pub use line::{Line, encode, parse_line};
pub use reply::{Reply, Report, State, alarm_meaning, error_meaning, format_report, parse_reply};

/// Letters of the axes in their order.
pub const LETTERS: [char; 6] = ['X', 'Y', 'Z', 'A', 'B', 'C'];
/// A line must stay shorter than this, line end not counted.
pub const LONGEST_LINE: usize = 79;

/// Bytes that act at once, without a line end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RealTime {
    /// `?`: report the status.
    Status,
    /// `!`: feed hold, decelerates.
    Hold,
    /// `~`: go on.
    Resume,
    /// Ctrl-X: soft reset; in motion the position is lost.
    Reset,
    /// 0x84: safety door.
    Door,
    /// 0x85: cancel a jog.
    JogCancel,
}

impl RealTime {
    /// Every real-time byte this module knows.
    pub const ALL: [RealTime; 6] = [
        RealTime::Status,
        RealTime::Hold,
        RealTime::Resume,
        RealTime::Reset,
        RealTime::Door,
        RealTime::JogCancel,
    ];

    /// The byte.
    pub const fn byte(self) -> u8 {
        match self {
            RealTime::Status => b'?',
            RealTime::Hold => b'!',
            RealTime::Resume => b'~',
            RealTime::Reset => 0x18,
            RealTime::Door => 0x84,
            RealTime::JogCancel => 0x85,
        }
    }

    /// The meaning of a byte.
    pub fn from_byte(byte: u8) -> Option<RealTime> {
        Self::ALL.into_iter().find(|r| r.byte() == byte)
    }
}

/// Thousandths as a decimal number: -12345 is "-12.345".
pub fn decimal(thousandths: i64) -> String {
    let sign = if thousandths < 0 { "-" } else { "" };
    let a = thousandths.unsigned_abs();
    format!("{sign}{}.{:03}", a / 1000, a % 1000)
}

/// A decimal number with at most three places as thousandths. Strict: no exponent, no blanks.
pub fn parse_decimal(text: &str) -> Option<i64> {
    let (sign, digits) = match text.strip_prefix('-') {
        Some(rest) => (-1, rest),
        None => (1, text.strip_prefix('+').unwrap_or(text)),
    };
    let (whole, places) = digits.split_once('.').unwrap_or((digits, ""));
    if whole.is_empty()
        || whole.len() > 9
        || places.len() > 3
        || !whole
            .bytes()
            .chain(places.bytes())
            .all(|b| b.is_ascii_digit())
    {
        return None;
    }
    let mut value: i64 = whole.parse().ok()?;
    for at in 0..3 {
        value = value * 10 + i64::from(places.as_bytes().get(at).map_or(0, |b| b - b'0'));
    }
    Some(sign * value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals_are_exact_both_ways() {
        for n in [0, 1, -1, 999, -999, 1000, 123_456, -180_000, 999_999_999] {
            assert_eq!(parse_decimal(&decimal(n)), Some(n));
        }
        assert_eq!(decimal(-5), "-0.005");
        for bad in ["", "-", "1.2345", "1e3", " 1", "1.-2", "0x1"] {
            assert_eq!(parse_decimal(bad), None, "{bad}");
        }
    }

    #[test]
    fn a_report_of_the_documentation() {
        let mut wco = Vec::new();
        let r = parse_reply(
            "<Idle|MPos:3.000,2.000,0.000|FS:0,0|WCO:1.000,1.000,0.000|Pn:XZ>",
            &mut wco,
        );
        assert_eq!(
            r,
            Some(Reply::Report(Report {
                state: State::Idle,
                machine: vec![3000, 2000, 0],
                pins: "XZ".into()
            }))
        );
        let r = parse_reply("<Hold:0|WPos:2.000,1.000,0.000|Bf:15,128>", &mut wco);
        assert_eq!(
            r,
            Some(Reply::Report(Report {
                state: State::Hold(0),
                machine: vec![3000, 2000, 0],
                pins: String::new()
            }))
        );
    }

    #[test]
    fn a_truncated_report_is_no_report() {
        let whole = format_report(&Report {
            state: State::Jog,
            machine: vec![1, 2, 3, 4],
            pins: "X".into(),
        });
        for cut in 0..whole.len() {
            assert_eq!(parse_reply(&whole[..cut], &mut Vec::new()), None);
        }
    }

    #[test]
    fn four_axes_fit_into_a_line() {
        let line = encode(&Line::Jog(
            vec![-182_000, -185_000, -182_000, -185_000],
            12_000,
        ))
        .unwrap();
        assert!(line.len() <= LONGEST_LINE + 1);
        assert_eq!(
            parse_line(std::str::from_utf8(&line).unwrap().trim_end()),
            Ok(Line::Jog(
                vec![-182_000, -185_000, -182_000, -185_000],
                12_000
            ))
        );
    }
}
