//! What the controller sends: acknowledgements, reports, alarms.

use super::{decimal, parse_decimal};

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
