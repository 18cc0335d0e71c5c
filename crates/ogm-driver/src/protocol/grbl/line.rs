//! Lines to the controller, written and read as it reads them.

use super::{LETTERS, LONGEST_LINE, decimal, parse_decimal};

/// A line to the controller.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Line {
    /// `$J=G90G21X..F..`: jog to absolute machine positions in thousandths, feed in whole units a minute.
    /// Outside the soft limits it is answered `error:15` and nothing moves; it can be cancelled.
    Jog(Vec<i64>, u32),
    /// `G90G53G0X..`: rapid move to absolute machine positions in thousandths.
    Rapid(Vec<i64>),
    /// `G4P0.01`: its `ok` comes when the planner is empty.
    Dwell,
    /// `$H`: home.
    Home,
    /// `$X`: unlock.
    Unlock,
    /// `$C`: check mode, parses and does not move.
    Check,
    /// `$SLP`: sleep.
    Sleep,
    /// `$I`: build information.
    Build,
    /// `$$`: settings.
    Settings,
    /// `$n=value` in thousandths: written to the EEPROM.
    Set(u16, i64),
    /// `M62P..`/`M63P..`: switch an output on or off (grblHAL).
    Output(u8, bool),
}

fn words(positions: &[i64]) -> String {
    positions
        .iter()
        .zip(LETTERS)
        .map(|(p, letter)| format!("{letter}{}", decimal(*p)))
        .collect()
}

/// A line as bytes with its line end. `None` when there are more than six axes or the line grows too long.
pub fn encode(line: &Line) -> Option<Vec<u8>> {
    let text = match line {
        Line::Jog(p, _) | Line::Rapid(p) if p.is_empty() || p.len() > LETTERS.len() => return None,
        Line::Jog(p, feed) => format!("$J=G90G21{}F{feed}", words(p)),
        Line::Rapid(p) => format!("G90G53G0{}", words(p)),
        Line::Dwell => "G4P0.01".into(),
        Line::Home => "$H".into(),
        Line::Unlock => "$X".into(),
        Line::Check => "$C".into(),
        Line::Sleep => "$SLP".into(),
        Line::Build => "$I".into(),
        Line::Settings => "$$".into(),
        Line::Set(n, value) => format!("${n}={}", decimal(*value)),
        Line::Output(port, on) => format!("M{}P{port}", if *on { 62 } else { 63 }),
    };
    (text.len() <= LONGEST_LINE).then(|| format!("{text}\n").into_bytes())
}

/// Reads a line (without its line end) as the controller does.
///
/// # Errors
/// The number of the `error:N` answer: 11 too long, 3 unknown `$` command, 2 bad number, 20 unknown G-code.
pub fn parse_line(text: &str) -> Result<Line, u32> {
    if text.len() > LONGEST_LINE {
        return Err(11);
    }
    match text {
        "$H" => return Ok(Line::Home),
        "$X" => return Ok(Line::Unlock),
        "$C" => return Ok(Line::Check),
        "$SLP" => return Ok(Line::Sleep),
        "$I" => return Ok(Line::Build),
        "$$" => return Ok(Line::Settings),
        "G4P0.01" => return Ok(Line::Dwell),
        _ => {}
    }
    if let Some(rest) = text.strip_prefix("$J=G90G21") {
        let (positions, rest) = parse_words(rest)?;
        let feed = rest.strip_prefix('F').ok_or(22_u32)?;
        let feed = feed.parse().map_err(|_| 2_u32)?;
        return if feed == 0 {
            Err(22)
        } else {
            Ok(Line::Jog(positions, feed))
        };
    }
    if let Some(rest) = text.strip_prefix("G90G53G0") {
        let (positions, rest) = parse_words(rest)?;
        return if rest.is_empty() {
            Ok(Line::Rapid(positions))
        } else {
            Err(20)
        };
    }
    for (word, on) in [("M62P", true), ("M63P", false)] {
        if let Some(port) = text.strip_prefix(word) {
            return port.parse().map(|p| Line::Output(p, on)).map_err(|_| 2);
        }
    }
    if let Some((n, value)) = text.strip_prefix('$').and_then(|s| s.split_once('=')) {
        let n = n.parse().map_err(|_| 3_u32)?;
        return parse_decimal(value).map(|v| Line::Set(n, v)).ok_or(2);
    }
    Err(if text.starts_with('$') { 3 } else { 20 })
}

fn parse_words(mut text: &str) -> Result<(Vec<i64>, &str), u32> {
    let mut positions = Vec::new();
    for letter in LETTERS {
        let Some(rest) = text.strip_prefix(letter) else {
            break;
        };
        let end = rest
            .find(|c: char| c.is_ascii_alphabetic())
            .unwrap_or(rest.len());
        positions.push(parse_decimal(&rest[..end]).ok_or(2_u32)?);
        text = &rest[end..];
    }
    if positions.is_empty() {
        Err(26)
    } else {
        Ok((positions, text))
    }
}
