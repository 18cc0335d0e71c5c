//! Drawings as PNG pictures, for papers and slides that take no SVG. The font comes along, so text looks alike on all machines.

use crate::plot::{Anchor, Color, DOT_OPACITY, Drawing, FONT_SIZE, Shape, Text};
use anyhow::{Context, Result};
use tiny_skia::{FillRule, Paint, Path, PathBuilder, Pixmap, Rect, Stroke, Transform};
use ttf_parser::{Face, OutlineBuilder};

/// Dots per inch of the pictures; one unit of a drawing is 1/96 inch, so a chart of 460 units is 122 mm wide.
pub const DOTS_PER_INCH: f64 = 300.0;
/// The font is a light one: its outlines are drawn too, this wide in units of the drawing, for normal and for bold text.
const WEIGHT: [f32; 2] = [0.25, 0.7];

/// A PNG of [`DOTS_PER_INCH`]; its head tells that and the `command` that made it.
///
/// # Errors
/// A sentence when the picture does not fit into memory.
pub fn png(drawing: &Drawing, command: &str) -> Result<Vec<u8>> {
    let scale = DOTS_PER_INCH / 96.0;
    let size = [drawing.width, drawing.height].map(|v| (v * scale).round() as u32);
    let mut pen = Pen {
        picture: Pixmap::new(size[0], size[1]).context("a figure is too large for a picture")?,
        face: Face::parse(epaint_default_fonts::UBUNTU_LIGHT, 0)?,
        scale: Transform::from_scale(scale as f32, scale as f32),
    };
    pen.picture.fill(tiny_skia::Color::WHITE);
    drawing.shapes.iter().for_each(|s| pen.draw(s));
    // Opaque everywhere: no transparency is left to write.
    let pixels = pen.picture.pixels().iter();
    let rgb: Vec<u8> = pixels
        .flat_map(|p| [p.red(), p.green(), p.blue()])
        .collect();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size[0], size[1]);
    encoder.set_color(png::ColorType::Rgb);
    let per_metre = (DOTS_PER_INCH / 0.0254).round() as u32;
    encoder.set_pixel_dims(Some(png::PixelDimensions {
        xppu: per_metre,
        yppu: per_metre,
        unit: png::Unit::Meter,
    }));
    encoder.add_itxt_chunk("Comment".to_owned(), command.to_owned())?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&rgb)?;
    writer.finish()?;
    Ok(bytes)
}

struct Pen<'a> {
    picture: Pixmap,
    face: Face<'a>,
    /// From units of the drawing to pixels.
    scale: Transform,
}

impl Pen<'_> {
    fn draw(&mut self, shape: &Shape) {
        match shape {
            Shape::Line {
                points,
                color,
                width,
            } => {
                let mut path = PathBuilder::new();
                for (i, &(x, y)) in points.iter().enumerate() {
                    if i == 0 {
                        path.move_to(x as f32, y as f32);
                    } else {
                        path.line_to(x as f32, y as f32);
                    }
                }
                self.stroke(path.finish(), *color, *width as f32, self.scale);
            }
            Shape::Ring { at, radius, color } => {
                let path = PathBuilder::from_circle(at.0 as f32, at.1 as f32, *radius as f32);
                self.stroke(path, *color, 1.0, self.scale);
            }
            Shape::Dot { at, radius, color } => {
                let path = PathBuilder::from_circle(at.0 as f32, at.1 as f32, *radius as f32);
                self.fill(path, *color, DOT_OPACITY, self.scale);
            }
            Shape::Rect { at, size, color } => {
                let [x, y, w, h] = [at.0, at.1, size.0, size.1].map(|v| v as f32);
                let path = Rect::from_xywh(x, y, w, h).map(PathBuilder::from_rect);
                self.fill(path, *color, 1.0, self.scale);
            }
            Shape::Text(text) => self.text(text),
        }
    }

    fn text(&mut self, t: &Text) {
        let mut glyphs = Glyphs {
            path: PathBuilder::new(),
            x: 0.0,
        };
        for c in t.text.chars() {
            // A sign that the font lacks shows as its empty box, glyph 0.
            let glyph = self.face.glyph_index(c).unwrap_or_default();
            self.face.outline_glyph(glyph, &mut glyphs);
            glyphs.x += f32::from(self.face.glyph_hor_advance(glyph).unwrap_or(0));
        }
        let back = match t.anchor {
            Anchor::Start => 0.0,
            Anchor::Middle => 0.5,
            Anchor::End => 1.0,
        };
        let em = FONT_SIZE as f32 / f32::from(self.face.units_per_em());
        // Fonts have their y upwards.
        let place = Transform::from_translate(-back * glyphs.x, 0.0)
            .post_scale(em, -em)
            .post_concat(Transform::from_rotate(t.turn_deg as f32))
            .post_translate(t.at.0 as f32, t.at.1 as f32)
            .post_concat(self.scale);
        let path = glyphs.path.finish();
        self.stroke(
            path.clone(),
            t.color,
            WEIGHT[usize::from(t.bold)] / em,
            place,
        );
        self.fill(path, t.color, 1.0, place);
    }

    fn fill(&mut self, path: Option<Path>, color: Color, opacity: f64, place: Transform) {
        if let Some(path) = path {
            let paint = paint(color, opacity);
            self.picture
                .fill_path(&path, &paint, FillRule::Winding, place, None);
        }
    }

    fn stroke(&mut self, path: Option<Path>, color: Color, width: f32, place: Transform) {
        if let Some(path) = path {
            let stroke = Stroke {
                width,
                ..Stroke::default()
            };
            let paint = paint(color, 1.0);
            self.picture
                .stroke_path(&path, &paint, &stroke, place, None);
        }
    }
}

fn paint([r, g, b]: Color, opacity: f64) -> Paint<'static> {
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, (255.0 * opacity).round() as u8);
    paint.anti_alias = true;
    paint
}

/// The outlines of a text, one letter after the other, in units of the font.
struct Glyphs {
    path: PathBuilder,
    x: f32,
}

impl OutlineBuilder for Glyphs {
    fn move_to(&mut self, x: f32, y: f32) {
        self.path.move_to(self.x + x, y);
    }
    fn line_to(&mut self, x: f32, y: f32) {
        self.path.line_to(self.x + x, y);
    }
    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.path.quad_to(self.x + x1, y1, self.x + x, y);
    }
    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.path
            .cubic_to(self.x + x1, y1, self.x + x2, y2, self.x + x, y);
    }
    fn close(&mut self) {
        self.path.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::{COLORS, Mark, Scale, Series, chart, correlations};

    /// Pixels, row by row, and the width.
    fn drawn(drawing: &Drawing) -> (Vec<u8>, usize) {
        let bytes = png(drawing, "woven-fit fit µ.xml").unwrap();
        let decoder = png::Decoder::new(std::io::Cursor::new(bytes));
        let mut reader = decoder.read_info().unwrap();
        let info = reader.info();
        assert_eq!(info.pixel_dims.unwrap().xppu, 11811);
        assert_eq!(info.utf8_text[0].get_text().unwrap(), "woven-fit fit µ.xml");
        let width = info.width as usize;
        let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut rgb).unwrap();
        (rgb, width)
    }

    /// Number of pixels in a rectangle of the figure's units that are darker than mid grey.
    fn dark((rgb, width): &(Vec<u8>, usize), x: [f64; 2], y: [f64; 2]) -> usize {
        let px = |v: f64| (v * 3.125) as usize;
        (px(y[0])..px(y[1]))
            .flat_map(|row| (px(x[0])..px(x[1])).map(move |column| row * width + column))
            .filter(|i| rgb[3 * i..3 * i + 3].iter().all(|&c| c < 128))
            .count()
    }

    #[test]
    fn a_chart_has_its_size_its_curve_and_its_text() {
        let line = |points: Vec<(f64, f64)>| Series {
            name: String::new(),
            color: COLORS[0],
            mark: Mark::Line,
            points,
        };
        let series = [line(vec![(0.0, 1.0), (1.0, 1.0)])];
        let with = drawn(&chart("θ φ °", "angle", "f", &series, Scale::Linear));
        let without = drawn(&chart("", "angle", "f", &series, Scale::Linear));
        assert_eq!((with.1, with.0.len()), (1438, 1438 * 938 * 3));
        // The title stands in the upper left corner; the tick labels of both below the plot.
        let title = |d| dark(d, [8.0, 60.0], [4.0, 22.0]);
        assert!(
            title(&with) > 100 && title(&without) == 0,
            "{}",
            title(&with)
        );
        assert!(dark(&with, [50.0, 70.0], [258.0, 275.0]) > 20);
        // Blue where the curve is: 1 of 1.05 of the height.
        let y = 258.0 - 230.0 / 1.05;
        let at = ((y * 3.125) as usize * 1438 + 800) * 3;
        assert_eq!(with.0[at..at + 3], [0x00, 0x72, 0xb2]);
    }

    #[test]
    fn a_matrix_is_red_on_its_diagonal_and_no_size_is_a_sentence() {
        let one = Some(1.0);
        let mut matrix = correlations(&["a", "b"], &[one, None, None, one]);
        let (rgb, width) = drawn(&matrix);
        let at = |x: f64, y: f64| {
            let i = 3 * ((y * 3.125) as usize * width + (x * 3.125) as usize);
            [rgb[i], rgb[i + 1], rgb[i + 2]]
        };
        assert_eq!((at(97.0, 38.0), at(139.0, 38.0)), ([255, 0, 0], [0xee; 3]));
        matrix.width = 0.0;
        let error = png(&matrix, "").unwrap_err().to_string();
        assert!(error.contains("picture"), "{error}");
    }
}
