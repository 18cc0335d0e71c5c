//! A matrix of correlations as coloured squares.

use super::{OK, escape, open};
use std::fmt::Write;

/// A matrix of correlations as coloured squares with their numbers.
pub fn correlations(names: &[&str], values: &[Option<f64>]) -> String {
    let (cell, left, top) = (42.0, 92.0, 34.0);
    let n = names.len();
    let (w, h) = (left + cell * n as f64 + 70.0, top + cell * n as f64 + 60.0);
    let mut svg = open(w, h, "correlations");
    for (i, name) in names.iter().enumerate() {
        let y = top + cell * (i as f64 + 0.5) + 4.0;
        let x = left + cell * (i as f64 + 0.5);
        write!(
            svg,
            "<text x='{:.1}' y='{y:.1}' class='e'>{}</text>",
            left - 6.0,
            escape(name)
        )
        .expect(OK);
        let foot = top + cell * n as f64 + 10.0;
        write!(
            svg,
            "<text transform='translate({x:.1} {foot:.1}) rotate(30)'>{}</text>",
            escape(name)
        )
        .expect(OK);
        for j in 0..n {
            let (x, y) = (left + cell * j as f64, top + cell * i as f64);
            let (fill, text) = match values.get(i * n + j).copied().flatten() {
                Some(c) => {
                    let fade = (255.0 * (1.0 - c.abs())) as u8;
                    let fill = if c > 0.0 {
                        format!("rgb(255,{fade},{fade})")
                    } else {
                        format!("rgb({fade},{fade},255)")
                    };
                    (fill, format!("{c:.2}"))
                }
                None => ("#eee".to_owned(), "·".to_owned()),
            };
            write!(
                svg,
                "<rect x='{x:.1}' y='{y:.1}' width='{:.1}' height='{:.1}' fill='{fill}'/><text x='{:.1}' y='{:.1}' class='m'>{text}</text>",
                cell - 1.0,
                cell - 1.0,
                x + cell / 2.0,
                y + cell / 2.0 + 4.0
            )
            .expect(OK);
        }
    }
    svg += "</svg>";
    svg
}
