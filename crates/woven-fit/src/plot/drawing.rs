//! A figure as a list of shapes, which can be written as SVG text or drawn as pixels.

use std::fmt;

/// sRGB, 8 bits each.
pub type Color = [u8; 3];

/// Grey of axes' grids.
pub(super) const GRID: Color = [0xdd; 3];
/// Grey of axes' numbers and names.
pub(super) const AXIS: Color = [0x44; 3];
/// Grey of remarks.
pub(super) const FAINT: Color = [0x88; 3];
/// Of titles and measured points.
pub(crate) const BLACK: Color = [0x11; 3];

/// Height of the letters' em in units.
pub(crate) const FONT_SIZE: f64 = 11.0;
/// How much of what lies below a dot it hides.
pub(crate) const DOT_OPACITY: f64 = 0.85;

/// Which end of a text stands at its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

/// A text on the figure; its place is on the base line.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Text {
    pub(crate) at: (f64, f64),
    pub(crate) text: String,
    pub(crate) anchor: Anchor,
    pub(crate) color: Color,
    /// Clockwise, degrees.
    pub(crate) turn_deg: f64,
    pub(crate) bold: bool,
}

/// One thing to draw; lengths in units of the figure, y downwards.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Shape {
    Line {
        points: Vec<(f64, f64)>,
        color: Color,
        width: f64,
    },
    Ring {
        at: (f64, f64),
        radius: f64,
        color: Color,
    },
    Dot {
        at: (f64, f64),
        radius: f64,
        color: Color,
    },
    Rect {
        at: (f64, f64),
        size: (f64, f64),
        color: Color,
    },
    Text(Text),
}

/// A figure on white; [`fmt::Display`] gives its SVG text, without fonts, scripts or files beside it.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// Width in units of 1/96 inch.
    pub width: f64,
    /// Height in the same units.
    pub height: f64,
    pub(crate) shapes: Vec<Shape>,
}

impl Drawing {
    pub(super) fn new(width: f64, height: f64, title: &str) -> Self {
        let mut out = Self {
            width,
            height,
            shapes: Vec::new(),
        };
        out.shapes.push(Shape::Text(Text {
            at: (8.0, 17.0),
            text: title.to_owned(),
            anchor: Anchor::Start,
            color: BLACK,
            turn_deg: 0.0,
            bold: true,
        }));
        out
    }

    pub(super) fn line(&mut self, points: Vec<(f64, f64)>, color: Color, width: f64) {
        self.shapes.push(Shape::Line {
            points,
            color,
            width,
        });
    }

    pub(super) fn dot(&mut self, at: (f64, f64), radius: f64, color: Color) {
        self.shapes.push(Shape::Dot { at, radius, color });
    }

    pub(super) fn text(&mut self, at: (f64, f64), anchor: Anchor, color: Color, text: &str) {
        self.turned(at, 0.0, anchor, color, text);
    }

    pub(super) fn turned(
        &mut self,
        at: (f64, f64),
        turn_deg: f64,
        anchor: Anchor,
        color: Color,
        text: &str,
    ) {
        self.shapes.push(Shape::Text(Text {
            at,
            text: text.to_owned(),
            anchor,
            color,
            turn_deg,
            bold: false,
        }));
    }
}

/// Text made safe inside SVG and HTML.
pub fn escape(s: &str) -> String {
    s.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

fn css([r, g, b]: Color) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

impl fmt::Display for Drawing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (w, h) = (self.width, self.height);
        write!(
            f,
            "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {w} {h}' width='{w}' height='{h}' font-family='system-ui,sans-serif' font-size='{FONT_SIZE}'>\
             <rect width='{w}' height='{h}' fill='#fff'/>"
        )?;
        for shape in &self.shapes {
            write!(f, "{shape}")?;
        }
        write!(f, "</svg>")
    }
}

impl fmt::Display for Shape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line {
                points,
                color,
                width,
            } => {
                for (i, (x, y)) in points.iter().enumerate() {
                    let start = if i == 0 { "<path d='M" } else { "L" };
                    write!(f, "{start}{x:.1} {y:.1}")?;
                }
                if points.is_empty() {
                    return Ok(());
                }
                let color = css(*color);
                write!(f, "' fill='none' stroke='{color}' stroke-width='{width}'/>")
            }
            Self::Ring {
                at: (x, y),
                radius,
                color,
            } => {
                let color = css(*color);
                write!(
                    f,
                    "<circle cx='{x:.1}' cy='{y:.1}' r='{radius:.1}' fill='none' stroke='{color}'/>"
                )
            }
            Self::Dot {
                at: (x, y),
                radius,
                color,
            } => {
                let color = css(*color);
                write!(
                    f,
                    "<circle cx='{x:.1}' cy='{y:.1}' r='{radius:.1}' fill='{color}' fill-opacity='{DOT_OPACITY}'/>"
                )
            }
            Self::Rect {
                at: (x, y),
                size: (w, h),
                color,
            } => {
                let color = css(*color);
                write!(
                    f,
                    "<rect x='{x:.1}' y='{y:.1}' width='{w:.1}' height='{h:.1}' fill='{color}'/>"
                )
            }
            Self::Text(t) => {
                let (x, y) = t.at;
                write!(f, "<text ")?;
                if t.turn_deg == 0.0 {
                    write!(f, "x='{x:.1}' y='{y:.1}'")?;
                } else {
                    let turn = t.turn_deg;
                    write!(f, "transform='translate({x:.1} {y:.1}) rotate({turn})'")?;
                }
                let anchor = match t.anchor {
                    Anchor::Start => "",
                    Anchor::Middle => " text-anchor='middle'",
                    Anchor::End => " text-anchor='end'",
                };
                let bold = if t.bold { " font-weight='600'" } else { "" };
                let (color, text) = (css(t.color), escape(&t.text));
                write!(f, "{anchor}{bold} fill='{color}'>{text}</text>")
            }
        }
    }
}
