//! SIGMA KOKI (OptoSigma) SHOT and GSC controllers, byte exact: commands to bytes, bytes to commands, status replies both ways.
//!
//! Sources: the vendor's own adapter in micro-manager/mmCoreAndDevices (SigmaKoki), ken1row/PyOptoSigma (SHOT-304GS, SHOT-702),
//! elerac/optosigma (GSC-01, GSC-02). Lines end in CR LF both ways, 8N1, RTS/CTS.

use serde::{Deserialize, Serialize};

/// The controllers this module speaks to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Model {
    /// SHOT-302GS, two axes.
    Shot302,
    /// SHOT-304GS, four axes: the count of a goniometer.
    Shot304,
    /// SHOT-702, two axes, 38400 baud only.
    Shot702,
    /// GSC-01, one axis.
    Gsc01,
    /// GSC-02, two axes: answers nothing but questions, has no absolute move.
    Gsc02,
}

impl Model {
    /// Every model.
    pub const ALL: [Model; 5] = [
        Model::Shot302,
        Model::Shot304,
        Model::Shot702,
        Model::Gsc01,
        Model::Gsc02,
    ];

    /// Number of axes.
    pub const fn axes(self) -> usize {
        match self {
            Model::Gsc01 => 1,
            Model::Shot302 | Model::Shot702 | Model::Gsc02 => 2,
            Model::Shot304 => 4,
        }
    }
    /// Answer to `?:N`.
    pub const fn name(self) -> &'static str {
        match self {
            Model::Shot302 => "SHOT-302GS",
            Model::Shot304 => "SHOT-304GS",
            Model::Shot702 => "SHOT-702",
            Model::Gsc01 => "GSC-01",
            Model::Gsc02 => "GSC-02",
        }
    }
    /// Whether `A:` exists.
    pub const fn has_absolute(self) -> bool {
        !matches!(self, Model::Gsc02)
    }
    /// Whether commands are answered OK or NG (with COMM/ACK = MAIN).
    pub const fn acknowledges(self) -> bool {
        !matches!(self, Model::Gsc02)
    }
    /// Whether homing names a direction for each axis.
    pub const fn home_has_direction(self) -> bool {
        matches!(self, Model::Gsc01 | Model::Gsc02)
    }
    /// Largest relative move, pulses.
    pub const fn longest_move(self) -> i64 {
        match self {
            Model::Gsc01 | Model::Gsc02 => 16_777_214,
            _ => 999_999_999,
        }
    }
    /// Line speeds that can be set.
    pub const fn bauds(self) -> &'static [u32] {
        match self {
            Model::Shot702 => &[38_400],
            Model::Gsc02 => &[2_400, 4_800, 9_600, 19_200],
            _ => &[4_800, 9_600, 19_200, 38_400],
        }
    }
}

/// Coordinates stay within this many pulses; beyond is an overflow alert.
pub const COORDINATE_LIMIT: i64 = 999_999_999;
/// Microstep divisions that `S:` takes.
pub const DIVISIONS: [u16; 15] = [1, 2, 4, 5, 8, 10, 20, 25, 40, 50, 80, 100, 125, 200, 250];

/// One axis (from 1) or all.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Which {
    /// Axis number from 1.
    One(u8),
    /// `W`.
    All,
}

/// A sense of turning.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sense {
    /// `+`
    Plus,
    /// `-`
    Minus,
}

/// `S`, `F`, `R` of one axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Speed {
    /// Least speed, pulses a second.
    pub start: u32,
    /// Top speed, pulses a second.
    pub top: u32,
    /// Ramp time, milliseconds.
    pub ramp_ms: u32,
}

impl Speed {
    fn valid(self) -> bool {
        (1..=500_000).contains(&self.start)
            && (1..=500_000).contains(&self.top)
            && self.ramp_ms <= 1000
            && self.start <= self.top
            && (self.top < 8000 || self.start >= 64)
    }
}

/// What `?:` can ask.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Query {
    /// `V`: version of the ROM.
    Version,
    /// `N`: product name.
    Name,
    /// `PW`: pulse rate of every axis.
    PulseRate,
    /// `SW`: divisions of every axis.
    Divisions,
    /// `DW`: speeds of every axis.
    Speeds,
}

/// A command of the protocol.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Command {
    /// `H:` mechanical origin; the senses only for GSC.
    Home(Which, Vec<Sense>),
    /// `M:` relative move in pulses.
    MoveBy(Which, Vec<i64>),
    /// `A:` absolute move in pulses.
    MoveTo(Which, Vec<i64>),
    /// `G:` start.
    Go,
    /// `J:` jog.
    Jog(Which, Vec<Sense>),
    /// `L:n`, `L:W` stop with a ramp.
    Stop(Which),
    /// `L:E` stop all at once.
    StopNow,
    /// `R:` this is zero.
    Zero(Which),
    /// `D:` speeds.
    Speeds(Which, Vec<Speed>),
    /// `S:` divisions of an axis.
    Divide(u8, u16),
    /// `C:` hold (true) or free (false) a motor.
    Hold(Which, bool),
    /// `Q:`
    Status,
    /// `!:`
    Busy,
    /// `?:`
    Ask(Query),
    /// `O:` output port, 4 bits.
    Output(u8),
    /// `I:` input port.
    Input,
}

/// Why a command cannot be written for a model.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{model} has no way to say {command}: {why}.")]
pub struct Unsayable {
    /// Name of the controller.
    pub model: &'static str,
    /// The command.
    pub command: String,
    /// The rule it breaks.
    pub why: &'static str,
}

/// The reason a command is not in the grammar of `model`, if any. The same rules make the simulated controller answer `NG`.
fn broken_rule(command: &Command, model: Model) -> Option<&'static str> {
    let n = model.axes();
    let axis = |w: &Which| match w {
        Which::One(a) => (1..=n).contains(&usize::from(*a)),
        Which::All => true,
    };
    let count = |w: &Which| if *w == Which::All { n } else { 1 };
    let no_axis = "there is no such axis";
    let wrong_count = "one value for each axis is needed";
    match command {
        Command::Home(w, senses) => {
            if !axis(w) {
                return Some(no_axis);
            }
            let wanted = if model.home_has_direction() {
                count(w)
            } else {
                0
            };
            (senses.len() != wanted)
                .then_some("a direction for each axis is needed on GSC and unknown on SHOT")
        }
        Command::MoveBy(w, by) => {
            if !axis(w) {
                return Some(no_axis);
            }
            if by.len() != count(w) {
                return Some(wrong_count);
            }
            by.iter()
                .any(|x| x.abs() > model.longest_move())
                .then_some("the move is too long")
        }
        Command::MoveTo(w, to) => {
            if !model.has_absolute() {
                return Some("there is no absolute move");
            }
            if !axis(w) {
                return Some(no_axis);
            }
            if to.len() != count(w) {
                return Some(wrong_count);
            }
            to.iter()
                .any(|x| x.abs() > COORDINATE_LIMIT)
                .then_some("the target leaves the coordinates")
        }
        Command::Jog(w, senses) => {
            if !axis(w) {
                return Some(no_axis);
            }
            (senses.len() != count(w)).then_some(wrong_count)
        }
        Command::Stop(w) | Command::Zero(w) | Command::Hold(w, _) => (!axis(w)).then_some(no_axis),
        Command::Speeds(w, speeds) => {
            if !axis(w) {
                return Some(no_axis);
            }
            if speeds.len() != count(w) {
                return Some(wrong_count);
            }
            speeds.iter().any(|s| !s.valid()).then_some(
                "speeds are 1..500000 with S <= F, R 0..1000, and S >= 64 when F >= 8000",
            )
        }
        Command::Divide(a, d) => {
            if !axis(&Which::One(*a)) {
                return Some(no_axis);
            }
            (!DIVISIONS.contains(d)).then_some("there is no such division")
        }
        Command::Output(bits) => (*bits > 15).then_some("the port has four bits"),
        Command::Go
        | Command::StopNow
        | Command::Status
        | Command::Busy
        | Command::Ask(_)
        | Command::Input => None,
    }
}

fn which(w: Which) -> String {
    match w {
        Which::One(a) => a.to_string(),
        Which::All => "W".into(),
    }
}

fn senses(s: &[Sense]) -> String {
    s.iter()
        .map(|s| if *s == Sense::Plus { '+' } else { '-' })
        .collect()
}

fn pulses(p: &[i64]) -> String {
    p.iter()
        .map(|x| format!("{}P{}", if *x < 0 { '-' } else { '+' }, x.unsigned_abs()))
        .collect()
}

/// The command without its line end.
fn text(command: &Command, model: Model) -> String {
    match command {
        Command::Home(w, s) => format!("H:{}{}", which(*w), senses(s)),
        Command::MoveBy(w, p) => format!("M:{}{}", which(*w), pulses(p)),
        Command::MoveTo(w, p) => format!("A:{}{}", which(*w), pulses(p)),
        Command::Go if model == Model::Gsc02 => "G".into(),
        Command::Go => "G:".into(),
        Command::Jog(w, s) => format!("J:{}{}", which(*w), senses(s)),
        Command::Stop(w) => format!("L:{}", which(*w)),
        Command::StopNow => "L:E".into(),
        Command::Zero(w) => format!("R:{}", which(*w)),
        Command::Speeds(w, s) => {
            let each: String = s
                .iter()
                .map(|s| format!("S{}F{}R{}", s.start, s.top, s.ramp_ms))
                .collect();
            format!("D:{}{each}", which(*w))
        }
        Command::Divide(a, d) => format!("S:{a}{d}"),
        Command::Hold(w, on) => format!("C:{}{}", which(*w), u8::from(*on)),
        Command::Status => "Q:".into(),
        Command::Busy => "!:".into(),
        Command::Ask(Query::Version) => "?:V".into(),
        Command::Ask(Query::Name) => "?:N".into(),
        Command::Ask(Query::PulseRate) => "?:PW".into(),
        Command::Ask(Query::Divisions) => "?:SW".into(),
        Command::Ask(Query::Speeds) => "?:DW".into(),
        Command::Output(bits) => format!("O:{bits}"),
        Command::Input => "I:".into(),
    }
}

/// A command as bytes with CR LF.
///
/// # Errors
/// [`Unsayable`] when the model's grammar has no such command.
pub fn encode(command: &Command, model: Model) -> Result<Vec<u8>, Unsayable> {
    match broken_rule(command, model) {
        Some(why) => Err(Unsayable {
            model: model.name(),
            command: text(command, model),
            why,
        }),
        None => Ok(format!("{}\r\n", text(command, model)).into_bytes()),
    }
}

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

/// A number of plain digits, at most nine of them.
fn number(s: &str) -> Option<i64> {
    (!s.is_empty() && s.len() <= 9 && s.bytes().all(|b| b.is_ascii_digit()))
        .then(|| s.parse().ok())?
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

    #[test]
    fn what_cannot_be_said_is_refused_with_the_rule() {
        let e = encode(&Command::MoveTo(Which::All, vec![1, 2]), Model::Gsc02).unwrap_err();
        assert_eq!(
            e.to_string(),
            "GSC-02 has no way to say A:W+P1+P2: there is no absolute move."
        );
        assert!(
            encode(
                &Command::MoveBy(Which::One(1), vec![16_777_215]),
                Model::Gsc01
            )
            .is_err()
        );
        assert!(encode(&Command::Divide(1, 3), Model::Shot304).is_err());
        let slow = Speed {
            start: 63,
            top: 8000,
            ramp_ms: 100,
        };
        assert!(encode(&Command::Speeds(Which::One(1), vec![slow]), Model::Shot304).is_err());
    }
}
