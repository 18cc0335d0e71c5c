//! Plots as SVG text: curves over an angle, polar plots, matrices. No fonts, scripts or files beside them.

mod matrix;

pub use matrix::correlations;

use std::fmt::Write;

/// Colours that people with any colour vision tell apart (Okabe and Ito 2008).
pub const COLORS: [&str; 7] = [
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f7f7f",
];

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
    /// CSS colour.
    pub color: &'static str,
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

const OK: &str = "a string grows";

/// Text made safe inside SVG and HTML.
pub fn escape(s: &str) -> String {
    s.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
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
pub fn chart(title: &str, x_name: &str, y_name: &str, series: &[Series], scale: Scale) -> String {
    let (w, h, left, right, top, bottom) = (460.0, 300.0, 58.0, 10.0, 28.0, 42.0);
    let visible = |y: f64| y.is_finite() && (scale == Scale::Linear || y > 0.0);
    let all: Vec<(f64, f64)> = series
        .iter()
        .flat_map(|s| s.points.iter().copied())
        .filter(|p| visible(p.1))
        .collect();
    let mut svg = open(w, h, title);
    if all.is_empty() {
        svg += "</svg>";
        return svg;
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
        let px = x(t);
        write!(svg, "<path d='M{px:.1} {top}V{:.1}' class='g'/><text x='{px:.1}' y='{:.1}' class='m'>{}</text>", h - bottom, h - bottom + 14.0, label(t)).expect(OK);
    }
    let y_ticks: Vec<f64> = if scale == Scale::Log {
        (y0 as i32..=y1 as i32).map(|e| 10f64.powi(e)).collect()
    } else {
        ticks(y0, y1, 6.0)
    };
    for t in y_ticks {
        let py = y(t);
        write!(svg, "<path d='M{left} {py:.1}H{:.1}' class='g'/><text x='{:.1}' y='{:.1}' class='e'>{}</text>", w - right, left - 5.0, py + 3.5, label(t)).expect(OK);
    }
    write!(
        svg,
        "<text x='{:.1}' y='{:.1}' class='m'>{}</text><text transform='translate(12 {:.1}) rotate(-90)' class='m'>{}</text>",
        (left + w - right) / 2.0,
        h - 8.0,
        escape(x_name),
        (top + h - bottom) / 2.0,
        escape(y_name)
    )
    .expect(OK);
    for s in series {
        let points: Vec<(f64, f64)> = s
            .points
            .iter()
            .filter(|p| visible(p.1))
            .map(|p| (x(p.0), y(p.1)))
            .collect();
        draw(&mut svg, s, &points);
    }
    legend(&mut svg, series, w - right - 6.0, top + 12.0);
    svg += "</svg>";
    svg
}

fn open(w: f64, h: f64, title: &str) -> String {
    format!(
        "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {w} {h}' width='{w}' height='{h}' font-family='system-ui,sans-serif' font-size='11'>\
         <style>.g{{stroke:#ddd;fill:none}}.m{{text-anchor:middle;fill:#444}}.e{{text-anchor:end;fill:#444}}.t{{font-weight:600;fill:#111}}</style>\
         <rect width='{w}' height='{h}' fill='#fff'/><text x='8' y='17' class='t'>{}</text>",
        escape(title)
    )
}

fn draw(svg: &mut String, s: &Series, points: &[(f64, f64)]) {
    match s.mark {
        Mark::Dots => {
            for (x, y) in points {
                write!(
                    svg,
                    "<circle cx='{x:.1}' cy='{y:.1}' r='2.6' fill='{}' fill-opacity='.85'/>",
                    s.color
                )
                .expect(OK);
            }
        }
        Mark::Line if !points.is_empty() => {
            svg.push_str("<path d='M");
            for (i, (x, y)) in points.iter().enumerate() {
                write!(svg, "{}{x:.1} {y:.1}", if i > 0 { "L" } else { "" }).expect(OK);
            }
            write!(
                svg,
                "' fill='none' stroke='{}' stroke-width='1.6'/>",
                s.color
            )
            .expect(OK);
        }
        Mark::Line => {}
    }
}

fn legend(svg: &mut String, series: &[Series], right: f64, top: f64) {
    for (i, s) in series.iter().filter(|s| !s.name.is_empty()).enumerate() {
        let y = top + 14.0 * i as f64;
        write!(
            svg,
            "<text x='{:.1}' y='{y:.1}' class='e' style='fill:{}'>{} {}</text>",
            right,
            s.color,
            escape(&s.name),
            if s.mark == Mark::Dots { "●" } else { "—" }
        )
        .expect(OK);
    }
}

/// A polar plot of f over the directions of one plane, logarithmic in radius: transmitted light below the sheet, reflected
/// above, light arriving from the upper left.
///
/// Points are (angle, f): the angle in radians is measured from the downward normal (straight through) for transmission,
/// |angle| < π/2, and beyond that goes on up to the reflected half; f in 1/sr.
pub fn polar(title: &str, series: &[Series], light_angle: f64) -> String {
    let (w, h, cx, cy, radius) = (420.0, 400.0, 210.0, 210.0, 168.0);
    let mut svg = open(w, h, title);
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
        let rr = r(10f64.powf(decade));
        if rr > 0.0 {
            write!(svg, "<circle cx='{cx}' cy='{cy}' r='{rr:.1}' class='g'/><text x='{:.1}' y='{:.1}' fill='#888'>{}</text>", cx + 3.0, cy - rr + 11.0, label(10f64.powf(decade))).expect(OK);
        }
        decade += 1.0;
    }
    for k in 0..12 {
        let a = f64::from(k) * std::f64::consts::PI / 6.0;
        write!(
            svg,
            "<path d='M{cx} {cy}L{:.1} {:.1}' class='g'/>",
            cx + radius * a.sin(),
            cy + radius * a.cos()
        )
        .expect(OK);
    }
    write!(
        svg,
        "<path d='M{} {cy}H{}' stroke='#333' stroke-width='2'/>",
        cx - radius,
        cx + radius
    )
    .expect(OK);
    let (ax, ay) = (
        cx - radius * light_angle.sin(),
        cy - radius * light_angle.cos(),
    );
    write!(
        svg,
        "<path d='M{ax:.1} {ay:.1}L{:.1} {:.1}' stroke='#e6a000' stroke-width='2.5'/><circle cx='{ax:.1}' cy='{ay:.1}' r='5' fill='#e6a000'/>",
        cx + (ax - cx) * 0.06,
        cy + (ay - cy) * 0.06
    )
    .expect(OK);
    for s in series {
        let inside = s.points.iter().filter(|p| p.1 > 0.0 && p.1.is_finite());
        let points: Vec<(f64, f64)> = inside.map(|p| place(p.0, p.1)).collect();
        draw(&mut svg, s, &points);
    }
    legend(&mut svg, series, w - 8.0, 17.0);
    write!(svg, "<text x='8' y='{:.1}' fill='#888'>radius: log f, 1/sr; above: reflected, below: transmitted</text></svg>", h - 8.0).expect(OK);
    svg
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
        for svg in [
            chart("t", "x", "y", std::slice::from_ref(&s), Scale::Log),
            chart("t", "x", "y", std::slice::from_ref(&s), Scale::Linear),
        ] {
            assert_eq!(
                svg.matches("<circle").count(),
                2,
                "the NaN is left out, the others are there"
            );
            assert!(svg.contains("a &lt; b") && !svg.contains("NaN") && svg.ends_with("</svg>"));
        }
        assert!(!polar("p", &[s], 0.3).contains("NaN"));
        assert!(correlations(&["a", "b"], &[Some(1.0), None, None, Some(1.0)]).contains("1.00"));
    }
}
