//! Faults on demand: which mishap, at which line of the conversation or with which chance.

use super::noise::Noise;
use crate::error::{Error, Result};

/// A mishap of the simulated rig.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fault {
    /// The answer is lost.
    Drop,
    /// The answer comes twice.
    Duplicate,
    /// One byte of the answer is changed.
    Corrupt,
    /// The answer comes this many seconds late.
    Delay(f64),
    /// The answer comes in two pieces, 40 ms apart.
    Split,
    /// The command is lost on its way.
    Lose,
    /// One byte of the command is changed on its way.
    Garble,
    /// A line nobody asked for comes first.
    Banner,
    /// The controller refuses the command.
    Ng,
    /// The controller locks itself (GRBL) or answers with an overflow alert (SHOT: NG until homed).
    Alarm,
    /// An arm runs into its limit sensor.
    Limit,
    /// An arm stops part of the way.
    Stall,
    /// An arm runs 40 pulses too far.
    Overshoot,
    /// The port disappears.
    Vanish,
    /// The lamp goes out.
    LampOff,
    /// The simulation's clock jumps ahead by this many seconds.
    ClockJump(f64),
    /// The controller loses power for an instant: counters 0, not homed.
    PowerCycle,
}

/// Every fault with its name on the command line and a usual argument.
pub const NAMES: [(&str, Fault); 17] = [
    ("drop", Fault::Drop),
    ("duplicate", Fault::Duplicate),
    ("corrupt", Fault::Corrupt),
    ("delay", Fault::Delay(3.0)),
    ("split", Fault::Split),
    ("lose", Fault::Lose),
    ("garble", Fault::Garble),
    ("banner", Fault::Banner),
    ("ng", Fault::Ng),
    ("alarm", Fault::Alarm),
    ("limit", Fault::Limit),
    ("stall", Fault::Stall),
    ("overshoot", Fault::Overshoot),
    ("vanish", Fault::Vanish),
    ("lamp-off", Fault::LampOff),
    ("clock-jump", Fault::ClockJump(3600.0)),
    ("power-cycle", Fault::PowerCycle),
];

#[derive(Debug, Clone, Copy, PartialEq)]
enum When {
    Line(u64),
    Chance(f64),
}

/// A list of faults with their moments.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FaultPlan {
    entries: Vec<(Fault, When)>,
    seed: u64,
}

impl FaultPlan {
    /// No faults.
    pub fn none() -> Self {
        Self::default()
    }

    /// Reads `name@line`, `name~chance`, `name:seconds@line` for each entry; lines are counted from 1 over everything the rig receives.
    ///
    /// # Errors
    /// [`Error::Rig`] naming the entry and the known names.
    pub fn parse(entries: &[String], seed: u64) -> Result<Self> {
        let mut plan = FaultPlan {
            entries: Vec::new(),
            seed,
        };
        for entry in entries {
            plan.entries.push(parse_entry(entry).ok_or_else(|| {
                let names: Vec<&str> = NAMES.iter().map(|n| n.0).collect();
                Error::Rig(format!(
                    "The fault {entry:?} cannot be read; write name@line, name~chance or name:seconds@line with a name out of {}.",
                    names.join(", ")
                ))
            })?);
        }
        Ok(plan)
    }

    /// A random script of one to three faults within the first `lines` lines.
    pub fn random(seed: u64, lines: u64) -> Self {
        let mut noise = Noise::at(&[seed, 0x66_6175]);
        let count = 1 + noise.below(3);
        let entries = (0..count)
            .map(|_| {
                let mut fault = NAMES[noise.below(NAMES.len() as u64) as usize].1;
                if let Fault::Delay(s) = &mut fault {
                    *s = noise.uniform() * 4.0;
                }
                (fault, When::Line(1 + noise.below(lines)))
            })
            .collect();
        FaultPlan { entries, seed }
    }

    /// The faults that strike at line `line`.
    pub fn at(&self, line: u64) -> Vec<Fault> {
        let strikes = |i: usize, when: &When| match when {
            When::Line(n) => *n == line,
            When::Chance(p) => Noise::at(&[self.seed, line, i as u64]).uniform() < *p,
        };
        self.entries
            .iter()
            .enumerate()
            .filter(|(i, e)| strikes(*i, &e.1))
            .map(|(_, e)| e.0)
            .collect()
    }
}

fn parse_entry(entry: &str) -> Option<(Fault, When)> {
    let (what, when) = if let Some((what, line)) = entry.split_once('@') {
        (what, When::Line(line.parse().ok().filter(|n| *n > 0)?))
    } else {
        let (what, chance) = entry.split_once('~')?;
        (
            what,
            When::Chance(chance.parse().ok().filter(|p| (0.0..=1.0).contains(p))?),
        )
    };
    let (name, argument) = match what.split_once(':') {
        Some((n, a)) => (
            n,
            Some(a.parse::<f64>().ok().filter(|x| (0.0..=1e6).contains(x))?),
        ),
        None => (what, None),
    };
    let fault = NAMES.iter().find(|n| n.0 == name)?.1;
    let fault = match (fault, argument) {
        (Fault::Delay(_), Some(s)) => Fault::Delay(s),
        (Fault::ClockJump(_), Some(s)) => Fault::ClockJump(s),
        (_, Some(_)) => return None,
        (f, None) => f,
    };
    Some((fault, when))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_read_or_refused() {
        let p = FaultPlan::parse(
            &["drop@3".into(), "delay:0.5@7".into(), "corrupt~1".into()],
            1,
        )
        .unwrap();
        assert_eq!(p.at(3), vec![Fault::Drop, Fault::Corrupt]);
        assert_eq!(p.at(7), vec![Fault::Delay(0.5), Fault::Corrupt]);
        for bad in [
            "drop",
            "drop@0",
            "drop@x",
            "drap@3",
            "drop:1@3",
            "ng~2",
            "delay:-1@3",
            "delay:nan@1",
        ] {
            let e = FaultPlan::parse(&[bad.into()], 1).unwrap_err().to_string();
            assert!(e.contains(bad) && e.contains("clock-jump"), "{e}");
        }
    }
}
