//! Short answers, and the reply to `Q:`.

use super::{COORDINATE_LIMIT, number};

/// `OK` or `NG`; `None` when the line is neither.
pub fn parse_ack(line: &str) -> Option<bool> {
    match line.trim_end() {
        "OK" => Some(true),
        "NG" => Some(false),
        _ => None,
    }
}

/// Answer to `!:`: true while busy.
pub fn parse_busy(line: &str) -> Option<bool> {
    match line.trim_end() {
        "B" => Some(true),
        "R" => Some(false),
        _ => None,
    }
}

/// Answer to `Q:`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Status {
    /// Logical positions, pulses.
    pub positions: Vec<i64>,
    /// ACK1: the last command was accepted.
    pub accepted: bool,
    /// ACK2: bit mask of axes at a limit sensor, bit 0 = axis 1.
    pub limits: u8,
    /// ACK3: moving.
    pub busy: bool,
}

/// The `Q:` reply without its line end: each position ten characters (sign, then right-justified), then the three acknowledges.
/// 16, 27 and 49 characters for one, two and four axes.
pub fn format_status(status: &Status) -> String {
    let n = status.positions.len();
    let mut out = String::new();
    for &p in &status.positions {
        out.push(if p < 0 { '-' } else { ' ' });
        out.push_str(&format!(
            "{:>9},",
            p.unsigned_abs().min(COORDINATE_LIMIT as u64)
        ));
    }
    let all = (1_u8 << n) - 1;
    let limits = status.limits & all;
    let ack2 = match (n, limits) {
        (_, 0) => 'K',
        (1, _) => 'L',
        (2, 1) => 'L',
        (2, 2) => 'M',
        (_, m) if m == all => 'W',
        (_, m) => char::from(b"0123456789ABCDEF"[usize::from(m)]),
    };
    out.push_str(&format!(
        "{},{ack2},{}",
        if status.accepted { 'K' } else { 'X' },
        if status.busy { 'B' } else { 'R' }
    ));
    out
}

/// Reads a `Q:` reply; the number of axes follows from its length. `None` for anything that is not exactly such a line.
pub fn parse_status(line: &str) -> Option<Status> {
    let line = line.as_bytes();
    if !line.is_ascii() || line.len() < 16 || !(line.len() - 5).is_multiple_of(11) {
        return None;
    }
    let n = (line.len() - 5) / 11;
    if n > 4 {
        return None;
    }
    let mut positions = Vec::with_capacity(n);
    for field in line[..11 * n].chunks(11) {
        let sign = match field[0] {
            b'-' => -1,
            b' ' | b'+' => 1,
            _ => return None,
        };
        let value = std::str::from_utf8(&field[1..10])
            .ok()?
            .trim_start_matches(' ');
        if field[10] != b',' {
            return None;
        }
        positions.push(sign * number(value)?);
    }
    let acks = &line[11 * n..];
    if acks[1] != b',' || acks[3] != b',' {
        return None;
    }
    let accepted = match acks[0] {
        b'K' => true,
        b'X' => false,
        _ => return None,
    };
    let all = (1_u8 << n) - 1;
    let limits = match (n, acks[2]) {
        (_, b'K') => 0,
        (1 | 2, b'L') => 1,
        (2, b'M') => 2,
        (2.., b'W') => all,
        (3.., c @ (b'1'..=b'9' | b'A'..=b'E')) => match char::from(c).to_digit(16)? as u8 {
            m if m < all => m,
            _ => return None,
        },
        _ => return None,
    };
    let busy = match acks[4] {
        b'B' => true,
        b'R' => false,
        _ => return None,
    };
    Some(Status {
        positions,
        accepted,
        limits,
        busy,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_manuals_example() {
        let s = parse_status("-    50000,-    50000,K,K,R").unwrap();
        assert_eq!(
            s,
            Status {
                positions: vec![-50_000, -50_000],
                accepted: true,
                limits: 0,
                busy: false
            }
        );
        assert_eq!(format_status(&s), "-    50000,-    50000,K,K,R");
    }

    #[test]
    fn lengths_and_places_of_the_acknowledges() {
        for (n, length, ack1) in [(1, 16, 11), (2, 27, 22), (4, 49, 44)] {
            let line = format_status(&Status {
                positions: vec![-123; n],
                accepted: false,
                limits: 1,
                busy: true,
            });
            assert_eq!(line.len(), length);
            assert_eq!(
                (line.as_bytes()[ack1], line.as_bytes()[ack1 + 4]),
                (b'X', b'B')
            );
        }
    }

    #[test]
    fn every_limit_mask_goes_there_and_back() {
        for n in [1, 2, 4] {
            for limits in 0..(1_u8 << n) {
                let s = Status {
                    positions: vec![7; n],
                    accepted: true,
                    limits,
                    busy: false,
                };
                assert_eq!(parse_status(&format_status(&s)), Some(s));
            }
        }
    }

    #[test]
    fn a_truncated_status_is_no_status() {
        let line = format_status(&Status {
            positions: vec![1, 2, 3, 4],
            accepted: true,
            limits: 0,
            busy: false,
        });
        for cut in 0..line.len() {
            // 16 and 27 characters would be shorter controllers' lines, but the acknowledges then are digits or blanks.
            assert_eq!(parse_status(&line[..cut]), None, "{cut}");
        }
    }
}
