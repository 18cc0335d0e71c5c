//! The whole state of a simulation as bytes, and back: a run that goes on has the bits of one that never stopped.

use super::Simulation;
use crate::error::{Error, Result};
use crate::force::Friction;
use crate::random::fnv1a;
use crate::spec::CurtainSpec;

const MAGIC: &[u8; 8] = b"WOVENCL4";
/// Magic, fingerprint, tick, frame, settled, history.
const HEAD: usize = 6 * 8;

impl Simulation {
    /// A fingerprint of everything that decides the motion; the number of frames does not.
    #[must_use]
    pub fn fingerprint(spec: &CurtainSpec) -> u64 {
        let spec = CurtainSpec {
            frames: 1,
            ..spec.clone()
        };
        fnv1a(toml::to_string(&spec).unwrap_or_default().as_bytes())
    }

    /// The whole state as bytes; `load` continues with the same bits.
    #[must_use]
    pub fn save(&self) -> Vec<u8> {
        let mut out = Vec::new();
        out.extend_from_slice(MAGIC);
        for number in [
            Self::fingerprint(&self.spec),
            self.tick,
            self.frame,
            u64::from(self.settled),
            u64::from(self.layers[0].stepper.history),
        ] {
            out.extend_from_slice(&number.to_le_bytes());
        }
        for layer in &self.layers {
            let (s, t, a) = (&layer.sheet, &layer.stepper, &layer.air);
            let tensions = t.tensions(s.nx, s.ny);
            let fields = [&s.x, &s.v, &t.x_old, &t.v_old, &a.now, &a.next];
            for value in fields.into_iter().flatten().flatten().chain(&tensions) {
                out.extend_from_slice(&value.to_le_bytes());
            }
            for value in t.friction.iter().flat_map(Friction::state) {
                out.extend_from_slice(&value.to_le_bytes());
            }
        }
        let sum = fnv1a(&out);
        out.extend_from_slice(&sum.to_le_bytes());
        out
    }

    /// A simulation that goes on where `save` was called.
    ///
    /// # Errors
    /// When the bytes are damaged or belong to another curtain.
    pub fn load(spec: &CurtainSpec, bytes: &[u8]) -> Result<Self> {
        let damaged =
            || Error::Checkpoint("it is damaged or cut short; delete it to start anew".into());
        let number =
            |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes"));
        if bytes.len() < HEAD + 8
            || &bytes[..8] != MAGIC
            || fnv1a(&bytes[..bytes.len() - 8]) != number(bytes.len() - 8)
        {
            return Err(damaged());
        }
        if number(8) != Self::fingerprint(spec) {
            return Err(Error::Checkpoint(
                "it was made for another curtain, wind or seed; delete it to start anew".into(),
            ));
        }
        let mut sim = Self::new(spec)?;
        let values: usize = sim
            .layers
            .iter()
            .map(|l| {
                let sliders = l.stepper.friction.iter().flat_map(Friction::state).count();
                13 * l.sheet.len() + 6 * l.air.now[0].len() + sliders
            })
            .sum();
        if bytes.len() != HEAD + values * 8 + 8 {
            return Err(damaged());
        }
        (sim.tick, sim.frame, sim.settled) = (number(16), number(24), number(32) != 0);
        let mut at = HEAD;
        let mut next = || {
            at += 8;
            f64::from_bits(number(at - 8))
        };
        for layer in &mut sim.layers {
            let (s, t, a) = (&mut layer.sheet, &mut layer.stepper, &mut layer.air);
            t.history = number(40) != 0;
            for field in [
                &mut s.x,
                &mut s.v,
                &mut t.x_old,
                &mut t.v_old,
                &mut a.now,
                &mut a.next,
            ] {
                for value in field.iter_mut().flatten() {
                    *value = next();
                }
            }
            let tensions: Vec<f64> = (0..s.len()).map(|_| next()).collect();
            t.set_tensions(s, &tensions);
            for value in t.friction.iter_mut().flat_map(Friction::state_mut) {
                *value = next();
            }
        }
        Ok(sim)
    }
}
