//! Commands as values, the rules of each model, and the bytes they become.

use super::{COORDINATE_LIMIT, DIVISIONS, Model};

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
pub(super) fn broken_rule(command: &Command, model: Model) -> Option<&'static str> {
    use Command as C;
    let n = model.axes();
    let each = |w: &Which| if *w == Which::All { n } else { 1 };
    // Which axes it names, how many values it has, how many it needs.
    let (axes, given, needed) = match command {
        C::Home(w, senses) if model.home_has_direction() => (*w, senses.len(), each(w)),
        C::Home(w, senses) => (*w, senses.len(), 0),
        C::MoveBy(w, p) | C::MoveTo(w, p) => (*w, p.len(), each(w)),
        C::Jog(w, senses) => (*w, senses.len(), each(w)),
        C::Speeds(w, speeds) => (*w, speeds.len(), each(w)),
        C::Stop(w) | C::Zero(w) | C::Hold(w, _) => (*w, 0, 0),
        C::Divide(a, _) => (Which::One(*a), 0, 0),
        C::Go | C::StopNow | C::Status | C::Busy | C::Ask(_) | C::Output(_) | C::Input => {
            (Which::All, 0, 0)
        }
    };
    let too_far = |p: &[i64], most: i64| p.iter().any(|x| x.abs() > most);
    match command {
        C::MoveTo(..) if !model.has_absolute() => Some("there is no absolute move"),
        _ if matches!(axes, Which::One(a) if !(1..=n).contains(&usize::from(a))) => {
            Some("there is no such axis")
        }
        C::Home(..) if given != needed => {
            Some("a direction for each axis is needed on GSC and unknown on SHOT")
        }
        _ if given != needed => Some("one value for each axis is needed"),
        C::MoveBy(_, by) if too_far(by, model.longest_move()) => Some("the move is too long"),
        C::MoveTo(_, to) if too_far(to, COORDINATE_LIMIT) => {
            Some("the target leaves the coordinates")
        }
        C::Speeds(_, speeds) if speeds.iter().any(|s| !s.valid()) => {
            Some("speeds are 1..500000 with S <= F, R 0..1000, and S >= 64 when F >= 8000")
        }
        C::Divide(_, d) if !DIVISIONS.contains(d) => Some("there is no such division"),
        C::Output(bits) if *bits > 15 => Some("the port has four bits"),
        _ => None,
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

#[cfg(test)]
mod tests {
    use super::*;

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
