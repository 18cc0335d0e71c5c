//! GRBL 1.1 / grblHAL with up to six axes: lines and real-time bytes to the controller, answers and reports from it.
//!
//! Source: gnea/grbl, doc/markdown/interface.md and commands.md; grblHAL/core. There is no degree in G-code: one "mm" is one degree here, and
//! positions are whole thousandths, as the controller reports them.

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

/// The controller's state word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// Nothing moves.
    Idle,
    /// A program line runs.
    Run,
    /// Held; 0 complete, 1 still slowing down.
    Hold(u8),
    /// A jog runs.
    Jog,
    /// Locked.
    Alarm,
    /// Door; 0..3 tells how far.
    Door(u8),
    /// Check mode.
    Check,
    /// Homing.
    Home,
    /// Asleep.
    Sleep,
}

/// A `<...>` report.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Report {
    /// State word.
    pub state: State,
    /// Machine positions in thousandths.
    pub machine: Vec<i64>,
    /// Letters of the active input pins, for example "XZ".
    pub pins: String,
}

/// Anything the controller can send on a line of its own.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Reply {
    /// The line was accepted (into the planner: not done yet).
    Ok,
    /// The line was refused.
    Error(u32),
    /// The controller locked itself.
    Alarm(u32),
    /// A status report.
    Report(Report),
    /// The welcome line: the controller has just started.
    Welcome(String),
    /// `[MSG:..]`, `[VER:..]`, `$n=v`, `>..`: for people.
    Message(String),
}

/// Reads a line from the controller. `work_offset` holds the last WCO seen (thousandths) and is renewed by reports that carry one:
/// with `$10` set to work positions, machine = work + offset. `None` for a line that is none of these.
pub fn parse_reply(text: &str, work_offset: &mut Vec<i64>) -> Option<Reply> {
    match text {
        "ok" => return Some(Reply::Ok),
        "" => return None,
        _ => {}
    }
    if let Some(n) = text.strip_prefix("error:") {
        return small(n).map(Reply::Error);
    }
    if let Some(n) = text.strip_prefix("ALARM:") {
        return small(n).map(Reply::Alarm);
    }
    if text.starts_with("Grbl ") || text.starts_with("GrblHAL ") {
        return text.ends_with(']').then(|| Reply::Welcome(text.into()));
    }
    if let Some(inner) = text.strip_prefix('<').and_then(|t| t.strip_suffix('>')) {
        return parse_report(inner, work_offset).map(Reply::Report);
    }
    let message = (text.starts_with('[') && text.ends_with(']'))
        || text.starts_with('>')
        || (text.starts_with('$') && text.contains('='));
    message.then(|| Reply::Message(text.into()))
}

fn small(text: &str) -> Option<u32> {
    (text.len() <= 3 && text.bytes().all(|b| b.is_ascii_digit())).then(|| text.parse().ok())?
}

fn positions(text: &str) -> Option<Vec<i64>> {
    let list: Option<Vec<i64>> = text.split(',').map(parse_decimal).collect();
    list.filter(|l| (3..=6).contains(&l.len()))
}

fn parse_state(text: &str) -> Option<State> {
    let (word, sub) = match text.split_once(':') {
        Some((w, s)) => (w, Some(s)),
        None => (text, None),
    };
    let sub = match sub {
        None => 0,
        Some(s) if s.len() == 1 && s.as_bytes()[0].is_ascii_digit() => s.as_bytes()[0] - b'0',
        Some(_) => return None,
    };
    match word {
        "Hold" if sub <= 1 => Some(State::Hold(sub)),
        "Door" if sub <= 3 => Some(State::Door(sub)),
        _ if text.contains(':') => None,
        "Idle" => Some(State::Idle),
        "Run" => Some(State::Run),
        "Jog" => Some(State::Jog),
        "Alarm" => Some(State::Alarm),
        "Check" => Some(State::Check),
        "Home" => Some(State::Home),
        "Sleep" => Some(State::Sleep),
        _ => None,
    }
}

fn parse_report(inner: &str, work_offset: &mut Vec<i64>) -> Option<Report> {
    let mut fields = inner.split('|');
    let state = parse_state(fields.next()?)?;
    let (mut machine, mut work, mut pins) = (None, None, String::new());
    for field in fields {
        let Some((name, value)) = field.split_once(':') else {
            continue;
        };
        match name {
            "MPos" => machine = Some(positions(value)?),
            "WPos" => work = Some(positions(value)?),
            "WCO" => *work_offset = positions(value)?,
            "Pn" => pins = value.into(),
            _ => {}
        }
    }
    let machine = match (machine, work) {
        (Some(m), None) => m,
        (None, Some(w)) if work_offset.len() == w.len() => w
            .iter()
            .zip(work_offset.iter())
            .map(|(w, o)| w + o)
            .collect(),
        _ => return None,
    };
    Some(Report {
        state,
        machine,
        pins,
    })
}

/// A report with machine positions, as the simulated controller sends it.
pub fn format_report(report: &Report) -> String {
    let state = match report.state {
        State::Idle => "Idle".into(),
        State::Run => "Run".into(),
        State::Hold(n) => format!("Hold:{n}"),
        State::Jog => "Jog".into(),
        State::Alarm => "Alarm".into(),
        State::Door(n) => format!("Door:{n}"),
        State::Check => "Check".into(),
        State::Home => "Home".into(),
        State::Sleep => "Sleep".to_string(),
    };
    let positions: Vec<String> = report.machine.iter().map(|p| decimal(*p)).collect();
    let pins = if report.pins.is_empty() {
        String::new()
    } else {
        format!("|Pn:{}", report.pins)
    };
    format!("<{state}|MPos:{}|FS:0,0{pins}>", positions.join(","))
}

/// What an alarm number means.
pub const fn alarm_meaning(code: u32) -> &'static str {
    match code {
        1 => "hard limit switch hit, position lost",
        2 => "target outside the soft limits, position kept",
        3 => "reset while moving, position lost",
        4 | 5 => "probe failed",
        6 => "homing failed: reset during homing",
        7 => "homing failed: door opened",
        8 => "homing failed: the switch did not clear after the pull-off",
        9 => "homing failed: the switch was not found",
        10 => "homing failed: second switch of a dual axis not found",
        _ => "unknown to GRBL 1.1",
    }
}

/// What an error number means.
pub const fn error_meaning(code: u32) -> &'static str {
    match code {
        1 => "a command letter was expected",
        2 => "bad number",
        3 => "unknown $ command",
        5 => "homing is switched off, set $22=1",
        8 => "only possible while idle",
        9 => "locked by an alarm, home first",
        10 => "soft limits need homing",
        11 => "line too long",
        13 => "the safety door is open",
        15 => "the target lies beyond the machine's travel",
        20 => "unknown G-code",
        22 => "no feed rate",
        26 => "no axis words",
        _ => "see the list of GRBL errors",
    }
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
