//! What part of a row's standard error is its own, where the rest is shared by all rows.
//!
//! ```text
//! # own,0,0.983,0.412,1      shares of `sigma` of the sample rows 0, 1 and 2; as many numbers a line as one likes
//! # own_direct,0,0.99        the same of the direct rows, in their order
//! ```
//! The column `sigma` stays the whole standard error, for readers that know of no shared errors.

use anyhow::{Result, bail};
use woven_bsdf::measured::csv::Scan;

/// Shares of the sample rows and of the direct rows; ones where the scan does not say.
///
/// # Errors
/// A sentence with the line when a share is not in (0, 1] or rows are left out or told twice.
pub(super) fn own(scan: &Scan) -> Result<(Vec<f64>, Vec<f64>)> {
    let samples = kind(scan, "own,", scan.samples.len())?;
    let direct = kind(scan, "own_direct,", scan.direct.len())?;
    match (samples, direct) {
        (Some(samples), Some(direct)) => Ok((samples, direct)),
        (None, None) => Ok((vec![1.0; scan.samples.len()], vec![1.0; scan.direct.len()])),
        (Some(samples), None) if scan.direct.is_empty() => Ok((samples, Vec::new())),
        (None, Some(direct)) if scan.samples.is_empty() => Ok((Vec::new(), direct)),
        (samples, _) => bail!(
            "there are \"# own{},...\" lines, but none for the {} rows",
            if samples.is_some() { "" } else { "_direct" },
            if samples.is_some() {
                "direct"
            } else {
                "sample"
            }
        ),
    }
}

/// The shares of one kind of rows; none if no line tells any.
fn kind(scan: &Scan, head: &str, rows: usize) -> Result<Option<Vec<f64>>> {
    let mut shares = Vec::new();
    let mut told = false;
    for line in &scan.comments {
        let Some(rest) = line.strip_prefix(head) else {
            continue;
        };
        told = true;
        let mut fields = rest.split(',').map(str::trim);
        if fields.next().and_then(|f| f.parse().ok()) != Some(shares.len()) {
            bail!(
                "\"# {line}\": the first number must be {}, the row that comes next",
                shares.len()
            );
        }
        for field in fields {
            match field.parse::<f64>() {
                Ok(share) if share > 0.0 && share <= 1.0 => shares.push(share),
                _ => bail!("\"# {line}\": {field:?} is no share between 0 and 1"),
            }
        }
    }
    if told && shares.len() != rows {
        bail!(
            "\"# {head}...\" tells of {} rows, the file has {rows}",
            shares.len()
        );
    }
    Ok(told.then_some(shares))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(comments: &str) -> Scan {
        let text = format!(
            "# direct,0,0,0.5,0.01\n{comments}theta_l_deg,phi_l_deg,theta_v_deg,phi_v_deg,f,sigma\n0,0,150,0,0.1,0.1\n0,0,140,0,0.1,0.1\n0,0,130,0,0.1,0.1\n"
        );
        Scan::parse(&text).unwrap()
    }

    #[test]
    fn shares_are_read_in_order_or_refused() {
        let told = scan("# own,0,0.5,1\n# own,2,0.25\n# own_direct,0,0.75\n");
        assert_eq!(own(&told).unwrap(), (vec![0.5, 1.0, 0.25], vec![0.75]));
        assert_eq!(own(&scan("")).unwrap(), (vec![1.0; 3], vec![1.0]));
        for (bad, word) in [
            ("# own,0,0.5,1,1\n", "direct"),
            ("# own,0,0.5,1\n# own_direct,0,1\n", "2 rows"),
            ("# own,0,0.5\n# own,2,1\n# own_direct,0,1\n", "must be 1"),
            ("# own,0,0.5,0,1\n# own_direct,0,1\n", "\"0\""),
            ("# own,0,0.5,1.5,1\n# own_direct,0,1\n", "1.5"),
            ("# own,0,0.5,nan,1\n# own_direct,0,1\n", "nan"),
        ] {
            let error = own(&scan(bad)).unwrap_err().to_string();
            assert!(error.contains(word), "{error}");
        }
    }
}
