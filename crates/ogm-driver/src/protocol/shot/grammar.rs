//! Commands read as the controller reads them.

use super::command::broken_rule;
use super::{Command, Model, Query, Sense, Speed, Which, number};

/// Reads a command line (without its line end) as the controller does; `None` is what it answers `NG` to.
pub fn parse_command(line: &str, model: Model) -> Option<Command> {
    if line == "G" {
        return (model == Model::Gsc02).then_some(Command::Go);
    }
    let (head, rest) = line.split_at_checked(2)?;
    let command = match head {
        "H:" => parse_which(rest).and_then(|(w, s)| Some(Command::Home(w, parse_senses(s)?)))?,
        "M:" => parse_which(rest).and_then(|(w, s)| Some(Command::MoveBy(w, parse_pulses(s)?)))?,
        "A:" => parse_which(rest).and_then(|(w, s)| Some(Command::MoveTo(w, parse_pulses(s)?)))?,
        "G:" if rest.is_empty() && model != Model::Gsc02 => Command::Go,
        "J:" => parse_which(rest).and_then(|(w, s)| Some(Command::Jog(w, parse_senses(s)?)))?,
        "L:" if rest == "E" => Command::StopNow,
        "L:" => bare(rest).map(Command::Stop)?,
        "R:" => bare(rest).map(Command::Zero)?,
        "D:" => parse_which(rest).and_then(|(w, s)| Some(Command::Speeds(w, parse_speeds(s)?)))?,
        "S:" => match parse_which(rest)? {
            (Which::One(a), d) => Command::Divide(a, number(d)?.try_into().ok()?),
            _ => return None,
        },
        "C:" => match parse_which(rest)? {
            (w, "0") => Command::Hold(w, false),
            (w, "1") => Command::Hold(w, true),
            _ => return None,
        },
        "Q:" if rest.is_empty() => Command::Status,
        "!:" if rest.is_empty() => Command::Busy,
        "?:" => Command::Ask(match rest {
            "V" => Query::Version,
            "N" => Query::Name,
            "PW" => Query::PulseRate,
            "SW" => Query::Divisions,
            "DW" => Query::Speeds,
            _ => return None,
        }),
        "O:" => Command::Output(number(rest)?.try_into().ok()?),
        "I:" if rest.is_empty() => Command::Input,
        _ => return None,
    };
    broken_rule(&command, model).is_none().then_some(command)
}

fn parse_which(s: &str) -> Option<(Which, &str)> {
    let (first, rest) = s.split_at_checked(1)?;
    match first.as_bytes()[0] {
        b'W' => Some((Which::All, rest)),
        d @ b'1'..=b'9' => Some((Which::One(d - b'0'), rest)),
        _ => None,
    }
}

fn bare(s: &str) -> Option<Which> {
    parse_which(s).and_then(|(w, rest)| rest.is_empty().then_some(w))
}

fn parse_senses(s: &str) -> Option<Vec<Sense>> {
    s.bytes()
        .map(|b| match b {
            b'+' => Some(Sense::Plus),
            b'-' => Some(Sense::Minus),
            _ => None,
        })
        .collect()
}

fn digits(s: &str) -> (&str, &str) {
    s.split_at(s.bytes().take_while(u8::is_ascii_digit).count())
}

fn parse_pulses(mut s: &str) -> Option<Vec<i64>> {
    let mut out = Vec::new();
    while !s.is_empty() {
        let sign = match s.as_bytes()[0] {
            b'+' => 1,
            b'-' => -1,
            _ => return None,
        };
        let (d, rest) = digits(s[1..].strip_prefix('P')?);
        out.push(sign * number(d)?);
        s = rest;
    }
    (!out.is_empty()).then_some(out)
}

fn parse_speeds(mut s: &str) -> Option<Vec<Speed>> {
    let mut out = Vec::new();
    while !s.is_empty() {
        let mut values = [0_u32; 3];
        for (value, letter) in values.iter_mut().zip(['S', 'F', 'R']) {
            let (d, rest) = digits(s.strip_prefix(letter)?);
            *value = number(d)?.try_into().ok()?;
            s = rest;
        }
        out.push(Speed {
            start: values[0],
            top: values[1],
            ramp_ms: values[2],
        });
    }
    (!out.is_empty()).then_some(out)
}
