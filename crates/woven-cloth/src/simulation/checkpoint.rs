//! The whole state of a simulation as bytes, and back: a run that goes on has the bits of one that never stopped.

use super::Simulation;
use crate::contact::Pair;
use crate::error::{Error, Result};
use crate::random::fnv1a;
use crate::spec::CurtainSpec;

const MAGIC: &[u8; 8] = b"WOVENCL3";
/// Magic, fingerprint, tick, frame, settled, history, count of contacts.
const HEAD: usize = 7 * 8;

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

    fn contacts(&self) -> impl Iterator<Item = &Pair> {
        self.stepper.self_contact.iter().flat_map(|c| c.active())
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
            u64::from(self.stepper.history),
            self.contacts().count() as u64,
        ] {
            out.extend_from_slice(&number.to_le_bytes());
        }
        let (s, t, a) = (&self.sheet, &self.stepper, &self.air);
        let tensions = t.tensions(s.nx, s.ny);
        let fields = [&s.x, &s.v, &t.x_old, &t.v_old, &a.now, &a.next];
        for value in fields.into_iter().flatten().flatten().chain(&tensions) {
            out.extend_from_slice(&value.to_le_bytes());
        }
        for pair in self.contacts() {
            for word in [pair.a, pair.b] {
                out.extend_from_slice(&word.to_le_bytes());
            }
            out.extend(pair.side.map(|s| s as u8));
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
        let n = sim.sheet.len();
        let cells = sim.air.now[0].len();
        let values = 12 * n + 6 * cells + n;
        let pairs = usize::try_from(number(48)).unwrap_or(usize::MAX);
        let length = pairs
            .checked_mul(10)
            .and_then(|p| p.checked_add(HEAD + values * 8 + 8));
        if length != Some(bytes.len()) {
            return Err(damaged());
        }
        (sim.tick, sim.frame, sim.settled) = (number(16), number(24), number(32) != 0);
        let mut at = HEAD;
        let mut next = || {
            at += 8;
            f64::from_bits(number(at - 8))
        };
        let (s, t, a) = (&mut sim.sheet, &mut sim.stepper, &mut sim.air);
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
        let tensions: Vec<f64> = (0..n).map(|_| next()).collect();
        t.set_tensions(s, &tensions);
        if let Some(contact) = &mut t.self_contact {
            let word = |b: &[u8]| u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
            let end = bytes.len() - 8;
            contact.resume(
                bytes[at..end]
                    .chunks_exact(10)
                    .map(|b| Pair {
                        a: word(b),
                        b: word(&b[4..]),
                        side: [b[8] as i8, b[9] as i8],
                    })
                    .collect(),
            );
        }
        Ok(sim)
    }
}
