//! The JSON lines between the scan and a detector command.
//!
//! | line to its standard input | line from its standard output |
//! |---|---|
//! | `{"ask":"identify"}` | `{"name":"camera and serial number"}` |
//! | `{"ask":"lamp"}` | `{"seconds":7200}`, or `{"seconds":null}` when it cannot know |
//! | `{"ask":"expose","tag":7,"ms":16.0,"f_number":4.0}` | `{"tag":7,"counts":1234.5,"reference":0.0,"saturated":false}` |
//!
//! Counts are linear, raw, dark level included. `reference` is the count of a diode that watches the lamp and may be left out.
//! `{"error":"..."}` ends the scan with that text.

use serde::{Deserialize, Serialize};

/// What the scan asks.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "ask", rename_all = "kebab-case")]
pub enum Question {
    /// Who are you.
    Identify,
    /// How long has the lamp been on.
    Lamp,
    /// Take an exposure.
    Expose {
        /// Comes back.
        tag: u64,
        /// Exposure, milliseconds.
        ms: f64,
        /// The f-number.
        f_number: f64,
    },
}

/// What a detector answers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Answer {
    /// Something is wrong; ends the scan.
    Trouble {
        /// What, in the words of the detector.
        error: String,
    },
    /// An exposure.
    Exposed {
        /// Of the question.
        tag: u64,
        /// Raw counts.
        counts: f64,
        /// Counts of the diode that watches the lamp; 0 without one.
        #[serde(default)]
        reference: f64,
        /// At the end of its range.
        saturated: bool,
    },
    /// Name and serial number.
    Identity {
        /// For the log.
        name: String,
    },
    /// The lamp.
    Lamp {
        /// Seconds it has been on, 0 when off, null when unknown; the field must stand there.
        #[serde(deserialize_with = "Option::deserialize")]
        seconds: Option<f64>,
    },
}

/// A value as one line, without its line end.
pub fn encode(value: &impl Serialize) -> String {
    // Numbers, words and flags always have a JSON form; a number that is not finite becomes null, which no reader takes.
    serde_json::to_string(value).unwrap_or_default()
}

/// A line as an answer; `None` when it is none, or has a number that is not finite.
pub fn parse_answer(line: &str) -> Option<Answer> {
    let answer = serde_json::from_str(line).ok()?;
    let sound = match &answer {
        Answer::Exposed {
            counts, reference, ..
        } => counts.is_finite() && reference.is_finite(),
        Answer::Lamp { seconds } => seconds.is_none_or(f64::is_finite),
        Answer::Trouble { .. } | Answer::Identity { .. } => true,
    };
    sound.then_some(answer)
}

/// A line as a question; `None` when it is none.
pub fn parse_question(line: &str) -> Option<Question> {
    serde_json::from_str(line).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_above_is_what_is_said() {
        let expose = Question::Expose {
            tag: 7,
            ms: 16.0,
            f_number: 4.0,
        };
        for (question, line) in [
            (Question::Identify, r#"{"ask":"identify"}"#),
            (Question::Lamp, r#"{"ask":"lamp"}"#),
            (
                expose,
                r#"{"ask":"expose","tag":7,"ms":16.0,"f_number":4.0}"#,
            ),
        ] {
            assert_eq!(encode(&question), line);
            assert_eq!(parse_question(line), Some(question));
        }
        let exposed = r#"{"tag":7,"counts":1234.5,"reference":0.0,"saturated":false}"#;
        assert_eq!(encode(&parse_answer(exposed).unwrap()), exposed);
        assert_eq!(
            parse_answer(r#"{"seconds":null}"#),
            Some(Answer::Lamp { seconds: None })
        );
        for bad in [
            "{}",
            "noise",
            r#"{"tag":7,"counts":null,"saturated":false}"#,
            r#"{"seconds":"many"}"#,
        ] {
            assert_eq!(parse_answer(bad), None, "{bad}");
        }
    }
}
