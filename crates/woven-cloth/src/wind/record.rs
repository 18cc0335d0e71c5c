//! Measured wind from a CSV: two columns, time in s and speed in m/s.

use crate::error::{Error, Result};
use std::path::Path;

/// Reads a record: lines of `time, speed` (comma, semicolon or tab), `#` begins a remark, one heading line is allowed.
///
/// # Errors
/// Names the line that is no pair of numbers, goes back in time or is no wind.
pub(crate) fn read_record(path: &Path) -> Result<Vec<[f64; 2]>> {
    let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
    parse(&text).map_err(|what| Error::spec("wind.recorded", format!("{}: {what}", path.display())))
}

fn parse(text: &str) -> std::result::Result<Vec<[f64; 2]>, String> {
    let mut samples: Vec<[f64; 2]> = Vec::new();
    let mut heading = true;
    for (n, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or("").trim();
        if line.is_empty() {
            continue;
        }
        let numbers: Vec<Option<f64>> = line
            .split([',', ';', '\t'])
            .map(|f| f.trim().parse().ok())
            .collect();
        let first = std::mem::take(&mut heading);
        let [Some(t), Some(u)] = numbers[..] else {
            if first && numbers.iter().all(Option::is_none) {
                continue;
            }
            return Err(format!(
                "line {} is `{line}`; two numbers are wanted, time in s and speed in m/s",
                n + 1
            ));
        };
        if !(t.is_finite() && u.abs() <= 20.0) {
            return Err(format!(
                "line {}: {u} m/s at {t} s is outside -20 to 20 m/s",
                n + 1
            ));
        }
        if samples.last().is_some_and(|s| s[0] >= t) {
            return Err(format!(
                "line {}: time {t} s does not come after the line before",
                n + 1
            ));
        }
        samples.push([t, u]);
    }
    if samples.len() < 2 {
        return Err("a record needs two lines at least".to_owned());
    }
    Ok(samples)
}

/// The speed at time `t`, m/s: linear between the lines, held before the first and after the last.
pub(super) fn at(samples: &[[f64; 2]], t: f64) -> f64 {
    let k = samples.partition_point(|s| s[0] <= t);
    if k == 0 || k == samples.len() {
        return samples[k.saturating_sub(1)][1];
    }
    let (a, b) = (samples[k - 1], samples[k]);
    a[1] + (b[1] - a[1]) * (t - a[0]) / (b[0] - a[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_is_read_and_nonsense_is_told_by_its_line() {
        let text = "time;speed\n# morning\n0; 1.5\n0.5; 2 # gust\n";
        assert_eq!(parse(text).unwrap(), [[0.0, 1.5], [0.5, 2.0]]);
        for (text, word) in [
            ("0,1\n1,fast\n", "line 2"),
            ("0,1\n0,2\n", "line 2"),
            ("0,1\n1,900\n", "900"),
            ("0,1\n1,nan\n", "line 2"),
            ("", "two lines"),
        ] {
            let e = parse(text).unwrap_err();
            assert!(e.contains(word), "{text:?}: {e}");
        }
    }
}
