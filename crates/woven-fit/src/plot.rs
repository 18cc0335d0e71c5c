//! Plots: curves over an angle, polar plots, matrices; as SVG text or as pixels.

mod drawing;
mod matrix;

pub(crate) use drawing::{Anchor, BLACK, DOT_OPACITY, FONT_SIZE, Shape, Text};
pub use drawing::{Color, Drawing, escape};
pub use matrix::correlations;

use drawing::{AXIS, FAINT, GRID};

/// Colours that people with any colour vision tell apart (Okabe and Ito 2008), and a grey.
pub const COLORS: [Color; 7] = [
    [0x00, 0x72, 0xb2],
    [0xd5, 0x5e, 0x00],
    [0x00, 0x9e, 0x73],
    [0xcc, 0x79, 0xa7],
    [0xe6, 0x9f, 0x00],
    [0x56, 0xb4, 0xe9],
    [0x7f, 0x7f, 0x7f],
];
/// Of the arriving light.
const LIGHT: Color = [0xe6, 0xa0, 0x00];

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// A dot at each point.
    Dots,
    /// A line through the points.
    Line,
}

/// Points with a name and a colour.
#[derive(Clone, Debug)]
pub struct Series {
    /// Name in the legend; empty for none.
    pub name: String,
    /// Its colour.
    pub color: Color,
    /// Dots or line.
    pub mark: Mark,
    /// (x, y).
    pub points: Vec<(f64, f64)>,
}

/// Scale of the vertical axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// As it is; starts at 0 if nothing is negative.
    Linear,
    /// Decades; values ≤ 0 are left out.
    Log,
}

/// Ticks at 1, 2 or 5 times a power of ten, about `count` of them.
fn ticks(lo: f64, hi: f64, count: f64) -> Vec<f64> {
    let raw = ((hi - lo) / count).max(1e-300);
    let power = 10f64.powf(raw.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .map(|s| s * power)
        .into_iter()
        .find(|s| *s >= raw)
        .unwrap_or(power);
    let first = (lo / step).ceil() as i64;
    let last = (hi / step).floor() as i64;
    (first..=last.min(first + 50))
        .map(|i| i as f64 * step)
        .collect()
}

fn label(x: f64) -> String {
    if x == 0.0 || (1e-3..1e4).contains(&x.abs()) {
        let s = format!("{x:.4}");
        s.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        format!("{x:.0e}")
    }
}

/// A chart of several series, 460 × 300 units, with axes, grid and legend.
pub fn chart(title: &str, x_name: &str, y_name: &str, series: &[Series], scale: Scale) -> Drawing {
    let (w, h, left, right, top, bottom) = (460.0, 300.0, 58.0, 10.0, 28.0, 42.0);
    let visible = |y: f64| y.is_finite() && (scale == Scale::Linear || y > 0.0);
    let all: Vec<(f64, f64)> = series
        .iter()
        .flat_map(|s| s.points.iter().copied())
        .filter(|p| visible(p.1))
        .collect();
    let mut drawing = Drawing::new(w, h, title);
    if all.is_empty() {
        return drawing;
    }
    let fold = |f: fn(f64, f64) -> f64, start: f64, get: fn(&(f64, f64)) -> f64| {
        all.iter().map(get).fold(start, f)
    };
    let (x0, mut x1) = (
        fold(f64::min, f64::INFINITY, |p| p.0),
        fold(f64::max, f64::NEG_INFINITY, |p| p.0),
    );
    let (mut y0, mut y1) = (
        fold(f64::min, f64::INFINITY, |p| p.1),
        fold(f64::max, f64::NEG_INFINITY, |p| p.1),
    );
    if x1 <= x0 {
        x1 = x0 + 1.0;
    }
    if scale == Scale::Log {
        (y0, y1) = (
            y0.log10().floor().max(y1.log10().ceil() - 6.0),
            y1.log10().ceil(),
        );
        if y1 <= y0 {
            y1 = y0 + 1.0;
        }
    } else {
        y0 = y0.min(0.0);
        y1 += 0.05 * (y1 - y0).max(1e-12);
    }
    let x = |v: f64| left + (v - x0) / (x1 - x0) * (w - left - right);
    let up = |v: f64| if scale == Scale::Log { v.log10() } else { v };
    let y = |v: f64| h - bottom - ((up(v) - y0) / (y1 - y0)).clamp(0.0, 1.0) * (h - top - bottom);
    for t in ticks(x0, x1, 7.0) {
        let (px, foot) = (x(t), h - bottom);
        drawing.line(vec![(px, top), (px, foot)], GRID, 1.0);
        drawing.text((px, foot + 14.0), Anchor::Middle, AXIS, &label(t));
    }
    let y_ticks: Vec<f64> = if scale == Scale::Log {
        (y0 as i32..=y1 as i32).map(|e| 10f64.powi(e)).collect()
    } else {
        ticks(y0, y1, 6.0)
    };
    for t in y_ticks {
        let py = y(t);
        drawing.line(vec![(left, py), (w - right, py)], GRID, 1.0);
        drawing.text((left - 5.0, py + 3.5), Anchor::End, AXIS, &label(t));
    }
    let (across, up) = ((left + w - right) / 2.0, (top + h - bottom) / 2.0);
    drawing.text((across, h - 8.0), Anchor::Middle, AXIS, x_name);
    drawing.turned((12.0, up), -90.0, Anchor::Middle, AXIS, y_name);
    for s in series {
        let points = s.points.iter().filter(|p| visible(p.1));
        draw(&mut drawing, s, points.map(|p| (x(p.0), y(p.1))).collect());
    }
    // The legend stands on the side where the curves are lower.
    let third = (x1 - x0) / 3.0;
    let highest = |from: f64, to: f64| {
        let inside = all.iter().filter(|p| (from..=to).contains(&p.0));
        inside.map(|p| p.1).fold(f64::NEG_INFINITY, f64::max)
    };
    let end = if highest(x1 - third, x1) > highest(x0, x0 + third) {
        let longest = series.iter().map(|s| s.name.chars().count()).max();
        left + 24.0 + 6.0 * longest.unwrap_or(0) as f64
    } else {
        w - right - 6.0
    };
    legend(&mut drawing, series, end, top + 12.0);
    drawing
}

fn draw(drawing: &mut Drawing, s: &Series, points: Vec<(f64, f64)>) {
    match s.mark {
        Mark::Dots => points.iter().for_each(|&at| drawing.dot(at, 2.6, s.color)),
        Mark::Line => drawing.line(points, s.color, 1.6),
    }
}

/// Names with their marks, one below the other, ending at `right`.
fn legend(drawing: &mut Drawing, series: &[Series], right: f64, top: f64) {
    for (i, s) in series.iter().filter(|s| !s.name.is_empty()).enumerate() {
        let y = top + 14.0 * i as f64;
        drawing.text((right - 14.0, y), Anchor::End, s.color, &s.name);
        let (from, to) = ((right - 10.0, y - 3.5), (right, y - 3.5));
        match s.mark {
            Mark::Dots => drawing.dot((0.5 * (from.0 + to.0), from.1), 2.6, s.color),
            Mark::Line => drawing.line(vec![from, to], s.color, 1.6),
        }
    }
}

/// A polar plot of f over the directions of one plane, logarithmic in radius: transmitted light below the sheet, reflected
/// above, light arriving from the upper left.
///
/// Points are (angle, f): the angle in radians is measured from the downward normal (straight through) for transmission,
/// |angle| < π/2, and beyond that goes on up to the reflected half; f in 1/sr.
pub fn polar(title: &str, series: &[Series], light_angle: f64) -> Drawing {
    let (w, h, cx, cy, radius) = (420.0, 400.0, 210.0, 210.0, 168.0);
    let mut drawing = Drawing::new(w, h, title);
    let values = || {
        series
            .iter()
            .flat_map(|s| s.points.iter().map(|p| p.1))
            .filter(|v| *v > 0.0 && v.is_finite())
    };
    let top = values().fold(f64::MIN_POSITIVE, f64::max).log10().ceil();
    let low = values()
        .fold(f64::INFINITY, f64::min)
        .log10()
        .floor()
        .clamp(top - 5.0, top - 1.0);
    let r = |f: f64| ((f.max(1e-300).log10() - low) / (top - low)).clamp(0.0, 1.0) * radius;
    let place = |angle: f64, f: f64| (cx + r(f) * angle.sin(), cy + r(f) * angle.cos());
    let mut decade = low;
    while decade <= top {
        let radius = r(10f64.powf(decade));
        if radius > 0.0 {
            drawing.shapes.push(Shape::Ring {
                at: (cx, cy),
                radius,
                color: GRID,
            });
            let name = label(10f64.powf(decade));
            drawing.text((cx + 3.0, cy - radius + 11.0), Anchor::Start, FAINT, &name);
        }
        decade += 1.0;
    }
    for k in 0..12 {
        let a = f64::from(k) * std::f64::consts::PI / 6.0;
        let rim = (cx + radius * a.sin(), cy + radius * a.cos());
        drawing.line(vec![(cx, cy), rim], GRID, 1.0);
    }
    drawing.line(vec![(cx - radius, cy), (cx + radius, cy)], [0x33; 3], 2.0);
    let (ax, ay) = (
        cx - radius * light_angle.sin(),
        cy - radius * light_angle.cos(),
    );
    let tip = (cx + (ax - cx) * 0.06, cy + (ay - cy) * 0.06);
    drawing.line(vec![(ax, ay), tip], LIGHT, 2.5);
    drawing.dot((ax, ay), 5.0, LIGHT);
    for s in series {
        let inside = s.points.iter().filter(|p| p.1 > 0.0 && p.1.is_finite());
        draw(&mut drawing, s, inside.map(|p| place(p.0, p.1)).collect());
    }
    legend(&mut drawing, series, w - 8.0, 17.0);
    drawing.text(
        (8.0, h - 8.0),
        Anchor::Start,
        FAINT,
        "radius: log f, 1/sr; above: reflected, below: transmitted",
    );
    drawing
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plots_are_well_formed_and_hold_every_point() {
        let s = Series {
            name: "a < b".into(),
            color: COLORS[0],
            mark: Mark::Dots,
            points: vec![(0.0, 1.0), (0.5, 0.1), (1.0, f64::NAN)],
        };
        for scale in [Scale::Log, Scale::Linear] {
            let svg = chart("t", "x", "y", std::slice::from_ref(&s), scale).to_string();
            assert_eq!(
                svg.matches("<circle").count(),
                3,
                "the NaN is left out, the others and the legend's are there"
            );
            assert!(svg.contains("a &lt; b") && !svg.contains("NaN") && svg.ends_with("</svg>"));
        }
        assert!(!polar("p", &[s], 0.3).to_string().contains("NaN"));
        let matrix = correlations(&["a", "b"], &[Some(1.0), None, None, Some(1.0)]);
        assert!(matrix.to_string().contains("1.00"));
    }
}
