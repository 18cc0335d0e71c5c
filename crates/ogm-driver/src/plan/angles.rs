//! Lists of angles as a plan writes them.

use serde::{Deserialize, Serialize};

use super::{MOST_POSES, refused};
use crate::error::Result;

/// A list of angles in degrees: given one by one, or from-to-step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Angles {
    /// One by one.
    List(Vec<f64>),
    /// Evenly, both ends included.
    Range {
        /// First angle.
        from: f64,
        /// Last angle.
        to: f64,
        /// Step, positive.
        step: f64,
    },
}

/// The list of 0 alone.
pub(crate) fn zero() -> Angles {
    Angles::List(vec![0.0])
}

impl Angles {
    /// The angles, in degrees; `name` is the place in the file for messages.
    pub(crate) fn values(&self, name: &str) -> Result<Vec<f64>> {
        match self {
            Angles::List(list) if list.is_empty() || list.len() > MOST_POSES => {
                Err(refused(format!("{name} has no angle or far too many")))
            }
            Angles::List(list) if list.iter().any(|a| !a.is_finite()) => {
                Err(refused(format!("{name} has an angle that is not a number")))
            }
            Angles::List(list) => Ok(list.clone()),
            Angles::Range { from, to, step } => {
                if !(from.is_finite() && to.is_finite() && *step > 0.0 && to >= from) {
                    return Err(refused(format!(
                        "{name} needs from <= to and a positive step"
                    )));
                }
                let n = ((to - from) / step + 1e-6).floor();
                if n > 100_000.0 {
                    return Err(refused(format!("{name} has {n} steps")));
                }
                Ok((0..=n as u32).map(|k| from + f64::from(k) * step).collect())
            }
        }
    }
}
