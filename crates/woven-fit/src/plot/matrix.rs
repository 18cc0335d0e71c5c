//! A matrix of correlations as coloured squares.

use super::Drawing;
use super::drawing::{AXIS, Anchor, BLACK, Shape};

/// A matrix of correlations as coloured squares with their numbers.
pub fn correlations(names: &[&str], values: &[Option<f64>]) -> Drawing {
    let (cell, left, top) = (42.0, 92.0, 34.0);
    let n = names.len();
    let (w, h) = (left + cell * n as f64 + 70.0, top + cell * n as f64 + 60.0);
    let mut drawing = Drawing::new(w, h, "correlations");
    for (i, name) in names.iter().enumerate() {
        let y = top + cell * (i as f64 + 0.5) + 4.0;
        let x = left + cell * (i as f64 + 0.5);
        drawing.text((left - 6.0, y), Anchor::End, AXIS, name);
        let foot = top + cell * n as f64 + 10.0;
        drawing.turned((x, foot), 30.0, Anchor::Start, BLACK, name);
        for j in 0..n {
            let (x, y) = (left + cell * j as f64, top + cell * i as f64);
            let (color, text) = match values.get(i * n + j).copied().flatten() {
                Some(c) => {
                    let fade = (255.0 * (1.0 - c.abs())) as u8;
                    let color = if c > 0.0 {
                        [255, fade, fade]
                    } else {
                        [fade, fade, 255]
                    };
                    (color, format!("{c:.2}"))
                }
                None => ([0xee; 3], "·".to_owned()),
            };
            drawing.shapes.push(Shape::Rect {
                at: (x, y),
                size: (cell - 1.0, cell - 1.0),
                color,
            });
            let middle = (x + cell / 2.0, y + cell / 2.0 + 4.0);
            drawing.text(middle, Anchor::Middle, AXIS, &text);
        }
    }
    drawing
}
