//! Many measurements, one table: which model does best over a whole shelf of fabrics.
//!
//! Places are comparable between files, sums of squares are not. A model's row holds its place in every file, the mean of
//! them, how often it came first, and the geometric mean of its RMS over the best RMS of the same file. Two models tie when
//! resampling the files (bootstrap, 95 %) does not settle which has the lower mean place; with one file the file's own
//! ties are all there is.

use crate::fit::FitResult;
use crate::rank::place_or_tie;
use crate::starts::hash;
use serde::Serialize;
use std::fmt::Write;

/// Samples of the bootstrap over files.
const BOOTSTRAP: u64 = 1000;

/// One model over all files.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// How the tables call it.
    pub label: String,
    /// Place in each file; ties share the better place. None where it was not fitted.
    pub places: Vec<Option<usize>>,
    /// Root mean square of peak-normalised misfits × 10⁴ in each file.
    pub rms_e4: Vec<Option<f64>>,
    /// Mean of the places.
    pub mean_place: f64,
    /// How often it came first, ties included.
    pub first: usize,
    /// Geometric mean of RMS over the file's least RMS.
    pub ratio: f64,
    /// Place in this table, from 1; models that the files cannot tell apart share one.
    pub place: usize,
}

/// The table.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// Names of the files.
    pub files: Vec<String>,
    /// Rows, best first.
    pub rows: Vec<Row>,
}

impl Comparison {
    /// The table of fits of the same models to several files.
    pub fn of(results: &[FitResult], seed: u64) -> Self {
        let mut labels: Vec<&str> = Vec::new();
        for fit in results.iter().flat_map(|r| &r.ranking) {
            if !labels.contains(&fit.label.as_str()) {
                labels.push(&fit.label);
            }
        }
        let least: Vec<f64> = results
            .iter()
            .map(|r| {
                r.ranking
                    .iter()
                    .map(|f| f.rms_e4)
                    .fold(f64::INFINITY, f64::min)
            })
            .collect();
        let mut rows: Vec<Row> = labels
            .into_iter()
            .map(|label| {
                let of = |r: &FitResult| r.ranking.iter().position(|f| f.label == label);
                let places: Vec<Option<usize>> = results
                    .iter()
                    .map(|r| of(r).map(|i| r.ranking[i].place))
                    .collect();
                let rms_e4: Vec<Option<f64>> = results
                    .iter()
                    .map(|r| of(r).map(|i| r.ranking[i].rms_e4))
                    .collect();
                let logs: Vec<f64> = rms_e4
                    .iter()
                    .zip(&least)
                    .filter_map(|(rms, least)| {
                        rms.map(|r| (r.max(f64::MIN_POSITIVE) / least.max(f64::MIN_POSITIVE)).ln())
                    })
                    .collect();
                Row {
                    label: label.to_owned(),
                    mean_place: mean(places.iter().flatten().map(|&p| p as f64)),
                    first: places.iter().flatten().filter(|&&p| p == 1).count(),
                    ratio: mean(logs.into_iter()).exp(),
                    places,
                    rms_e4,
                    place: 0,
                }
            })
            .collect();
        rows.sort_by(|a, b| {
            let means = a.mean_place.total_cmp(&b.mean_place);
            means.then(a.ratio.total_cmp(&b.ratio))
        });
        let mut first = 0;
        for i in 0..rows.len() {
            if !tie(&rows[first], &rows[i], seed) {
                first = i;
            }
            rows[i].place = first + 1;
        }
        Self {
            files: results.iter().map(|r| r.file.clone()).collect(),
            rows,
        }
    }

    /// The table for a terminal.
    pub fn to_text(&self) -> String {
        let ok = "a string grows";
        let mut s = String::new();
        for (i, file) in self.files.iter().enumerate() {
            writeln!(s, "file {}: {file}", i + 1).expect(ok);
        }
        write!(
            s,
            "\n{:>5}  {:<34} {:>10} {:>6} {:>9}   place (RMS·1e4) in file",
            "place", "model", "mean place", "first", "RMS/least"
        )
        .expect(ok);
        s.push('\n');
        let mut last = 0;
        for row in &self.rows {
            let place = place_or_tie(row.place, &mut last);
            write!(
                s,
                "{place:>5}  {:<34} {:>10.2} {:>6} {:>9.3}  ",
                row.label, row.mean_place, row.first, row.ratio
            )
            .expect(ok);
            for (place, rms) in row.places.iter().zip(&row.rms_e4) {
                match (place, rms) {
                    (Some(p), Some(r)) => write!(s, " {p:>3} ({r:>6.1})").expect(ok),
                    _ => s.push_str("   — (     —)"),
                }
            }
            s.push('\n');
        }
        s += "\nSorted by mean place; \"=\" ties with the line above: resampling the files does not settle the order.\n";
        s
    }

    /// The table as CSV, one line a model and file.
    pub fn to_csv(&self) -> String {
        let ok = "a string grows";
        let mut s = String::from("model,file,place_in_file,rms_e4,mean_place,place\n");
        let quoted = |t: &str| format!("\"{}\"", t.replace('"', "\"\""));
        for row in &self.rows {
            for ((file, place), rms) in self.files.iter().zip(&row.places).zip(&row.rms_e4) {
                writeln!(
                    s,
                    "{},{},{},{},{},{}",
                    quoted(&row.label),
                    quoted(file),
                    place.map_or(String::new(), |p| p.to_string()),
                    rms.map_or(String::new(), |r| r.to_string()),
                    row.mean_place,
                    row.place
                )
                .expect(ok);
            }
        }
        s
    }
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (n, sum) = values.fold((0, 0.0), |(n, s), v| (n + 1, s + v));
    sum / f64::from(n.max(1))
}

/// Whether the order of two rows is not settled by the files; `a` stands before `b`.
fn tie(a: &Row, b: &Row, seed: u64) -> bool {
    let differences: Vec<f64> = a
        .places
        .iter()
        .zip(&b.places)
        .filter_map(|(a, b)| Some(b.as_ref().copied()? as f64 - a.as_ref().copied()? as f64))
        .collect();
    let n = differences.len() as u64;
    if n == 0 {
        return false;
    }
    let worse = (0..BOOTSTRAP).filter(|sample| {
        let draw = |i: u64| differences[(hash(seed ^ 0xf11e, sample * n + i) % n) as usize];
        (0..n).map(draw).sum::<f64>() <= 0.0
    });
    worse.count() as f64 > 0.025 * BOOTSTRAP as f64
}
