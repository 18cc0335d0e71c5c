//! The catalog page: one `index.html` without network, fonts or frameworks, beside the videos and pictures that it shows.

use std::fmt::Write as _;

/// Everything the page tells.
#[derive(Clone, Debug, Default)]
pub struct Page {
    /// The page's heading.
    pub title: String,
    /// A sentence or two under it.
    pub lead: String,
    /// The fabrics in order.
    pub fabrics: Vec<FabricPart>,
    /// How the page was made: (label, text).
    pub made: Vec<(String, String)>,
}

/// One fabric's part of the page.
#[derive(Clone, Debug, Default)]
pub struct FabricPart {
    /// Name in files and anchors: letters, digits, hyphens.
    pub id: String,
    /// The fabric's name.
    pub name: String,
    /// One line beside the name: maker, openness, weight.
    pub facts: String,
    /// A sentence about it.
    pub lead: String,
    /// The shots, motion first.
    pub shots: Vec<Shot>,
    /// The light desk, where there are light layers.
    pub desk: Option<Desk>,
    /// The plots: (caption, SVG text).
    pub plots: Vec<(String, String)>,
    /// The whole report of the fit, relative to the page.
    pub report: Option<String>,
    /// Parameters of the fitted model.
    pub parameters: Vec<Row>,
    /// What the numbers cannot tell and what was noticed, as sentences.
    pub notes: Vec<String>,
    /// The ranking of models: header, then rows.
    pub ranking: Option<(Vec<String>, Vec<Vec<String>>)>,
    /// Where the data came from and how it went on: (label, text).
    pub provenance: Vec<(String, String)>,
}

/// A video or a picture.
#[derive(Clone, Debug)]
pub struct Shot {
    /// File, relative to the page.
    pub file: String,
    /// The picture shown before the video plays; `None` for a still.
    pub poster: Option<String>,
    /// Bold part of the caption.
    pub title: String,
    /// Right part of the caption.
    pub detail: String,
    /// For those who do not see it.
    pub alt: String,
    /// Width and height in pixels.
    pub size: (u32, u32),
}

/// The sliders that mix one picture a light.
#[derive(Clone, Debug)]
pub struct Desk {
    /// Script that holds the layers, relative to the page.
    pub script: String,
    /// (layer name, label, share in percent at the start).
    pub lights: Vec<(String, String, u32)>,
    /// Button label, and share of each slider in percent (exposure in stops).
    pub presets: Vec<(String, Vec<(String, f32)>)>,
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// The picture shown before the script has run.
    pub alt: String,
}

/// One line of the table of parameters.
#[derive(Clone, Debug)]
pub struct Row {
    /// Name in files.
    pub name: String,
    /// What it means.
    pub meaning: String,
    /// The value.
    pub value: f64,
    /// Its standard error, if the data can see the parameter.
    pub error: Option<f64>,
    /// Unit; empty for a pure number.
    pub unit: String,
}

impl Page {
    /// The page as HTML.
    #[must_use]
    pub fn html(&self) -> String {
        let mut out = String::with_capacity(64 << 10);
        let title = escape(&self.title);
        // Writing to a String cannot fail.
        let _ = write!(
            out,
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; script-src 'self' 'unsafe-inline' file:; img-src 'self' data: file:; media-src 'self' file:\">\n\
             <title>{title}</title>\n<link rel=\"icon\" href=\"data:,\">\n<style>\n{}</style>\n</head>\n<body>\n<header class=\"top\">\n<h1>{title}</h1>\n<p>{}</p>\n<nav aria-label=\"Fabrics\">",
            include_str!("page/style.css"),
            escape(&self.lead)
        );
        for f in &self.fabrics {
            let _ = write!(
                out,
                "<a href=\"#{}\">{}</a>",
                escape(&f.id),
                escape(&f.name)
            );
        }
        out.push_str("</nav>\n</header>\n<main>\n");
        for f in &self.fabrics {
            f.html(&mut out);
        }
        out.push_str(
            "</main>\n<footer>\n<details open><summary>How this page was made</summary>\n",
        );
        list(&mut out, &self.made);
        out.push_str("</details>\n</footer>\n");
        for desk in self.fabrics.iter().filter_map(|f| f.desk.as_ref()) {
            let _ = writeln!(out, "<script src=\"{}\"></script>", escape(&desk.script));
        }
        let _ = write!(
            out,
            "<script>\n{}</script>\n</body>\n</html>\n",
            include_str!("page/page.js")
        );
        out
    }
}

impl FabricPart {
    fn html(&self, out: &mut String) {
        let (id, name) = (escape(&self.id), escape(&self.name));
        let _ = writeln!(
            out,
            "<section class=\"fabric\" id=\"{id}\" aria-labelledby=\"{id}-name\">"
        );
        let _ = writeln!(
            out,
            "<div class=\"name\"><h2 id=\"{id}-name\">{name}</h2><p>{}</p></div>",
            escape(&self.facts)
        );
        let _ = writeln!(out, "<p class=\"lead\">{}</p>", escape(&self.lead));
        for pair in self.shots.chunks(2) {
            out.push_str("<div class=\"pair\">\n");
            for shot in pair {
                shot.html(out);
            }
            out.push_str("</div>\n");
        }
        if let Some(desk) = &self.desk {
            desk.html(&self.id, out);
        }
        out.push_str("<div class=\"measured\">\n<div>\n");
        if !self.plots.is_empty() || self.report.is_some() {
            out.push_str("<h3>Measured and fitted</h3>\n");
        }
        for (caption, svg) in &self.plots {
            // An SVG of ours goes in as it is; a declaration before it would not be HTML.
            let svg = svg.find("<svg").map_or("", |at| &svg[at..]);
            let _ = writeln!(
                out,
                "<figure class=\"plot\">{svg}<figcaption>{}</figcaption></figure>",
                escape(caption)
            );
        }
        if let Some(report) = &self.report {
            let _ = writeln!(
                out,
                "<p><a href=\"{}\">The whole report of the fit</a></p>",
                escape(report)
            );
        }
        out.push_str("</div>\n<div>\n<h3>The sheet</h3>\n<div class=\"scroll\"><table>\n<thead><tr><th>Parameter</th><th class=\"n\">Value</th><th class=\"n\">± standard error</th></tr></thead>\n<tbody>\n");
        for row in &self.parameters {
            let (value, error) = plus_minus(row.value, row.error);
            let unit = if row.unit.is_empty() {
                String::new()
            } else {
                format!(" {}", escape(&row.unit))
            };
            let _ = writeln!(
                out,
                "<tr><td><code>{}</code><small>{}</small></td><td class=\"n\">{value}{unit}</td><td class=\"n\">{error}</td></tr>",
                escape(&row.name),
                escape(&row.meaning)
            );
        }
        out.push_str("</tbody></table></div>\n");
        for note in &self.notes {
            let _ = writeln!(out, "<p><small>{}</small></p>", escape(note));
        }
        if let Some((head, rows)) = &self.ranking {
            out.push_str("<details><summary>Ranking of the models</summary>\n<div class=\"scroll\"><table>\n<thead><tr>");
            for (i, h) in head.iter().enumerate() {
                let _ = write!(
                    out,
                    "<th{}>{}</th>",
                    if i == 0 { "" } else { " class=\"n\"" },
                    escape(h)
                );
            }
            out.push_str("</tr></thead>\n<tbody>\n");
            for row in rows {
                out.push_str("<tr>");
                for (i, cell) in row.iter().enumerate() {
                    let _ = write!(
                        out,
                        "<td{}>{}</td>",
                        if i == 0 { "" } else { " class=\"n\"" },
                        escape(cell)
                    );
                }
                out.push_str("</tr>\n");
            }
            out.push_str("</tbody></table></div></details>\n");
        }
        out.push_str("<details open><summary>Provenance</summary>\n");
        list(out, &self.provenance);
        out.push_str("</details>\n</div>\n</div>\n</section>\n");
    }
}

impl Shot {
    fn html(&self, out: &mut String) {
        let (file, alt, (w, h)) = (escape(&self.file), escape(&self.alt), self.size);
        out.push_str("<figure>");
        let _ = match &self.poster {
            Some(poster) => write!(
                out,
                "<video src=\"{file}\" poster=\"{}\" width=\"{w}\" height=\"{h}\" aria-label=\"{alt}\" autoplay muted loop playsinline controls preload=\"metadata\"></video>",
                escape(poster)
            ),
            None => write!(
                out,
                "<img class=\"still\" src=\"{file}\" alt=\"{alt}\" width=\"{w}\" height=\"{h}\" loading=\"lazy\">"
            ),
        };
        let _ = writeln!(
            out,
            "<figcaption><b>{}</b><span>{}</span></figcaption></figure>",
            escape(&self.title),
            escape(&self.detail)
        );
    }
}

impl Desk {
    fn html(&self, id: &str, out: &mut String) {
        let id = escape(id);
        let _ = write!(
            out,
            "<div class=\"desk\" data-lights=\"{id}\">\n<canvas width=\"{}\" height=\"{}\" role=\"img\" aria-label=\"{}\"></canvas>\n<div>\n<h3>Mix the light</h3>\n\
             <p>Light adds up. Every light was traced into a picture of its own; here they are weighed and summed.</p>\n",
            self.size.0,
            self.size.1,
            escape(&self.alt)
        );
        for (name, label, share) in &self.lights {
            let _ = writeln!(
                out,
                "<label>{}<input type=\"range\" name=\"{}\" min=\"0\" max=\"200\" step=\"1\" value=\"{share}\"><output>{share} %</output></label>",
                escape(label),
                escape(name)
            );
        }
        out.push_str("<label>Exposure<input type=\"range\" name=\"exposure\" min=\"-3\" max=\"3\" step=\"0.1\" value=\"0\" data-unit=\"EV\"><output>0 EV</output></label>\n<div class=\"presets\">");
        for (label, shares) in &self.presets {
            let json: Vec<String> = shares
                .iter()
                .map(|(name, share)| format!("\"{name}\":{share}"))
                .collect();
            let _ = write!(
                out,
                "<button type=\"button\" data-preset=\"{}\">{}</button>",
                escape(&format!("{{{}}}", json.join(","))),
                escape(label)
            );
        }
        out.push_str("</div>\n</div>\n</div>\n");
    }
}

fn list(out: &mut String, rows: &[(String, String)]) {
    out.push_str("<dl>\n");
    for (label, text) in rows {
        let _ = writeln!(out, "<dt>{}</dt><dd>{}</dd>", escape(label), escape(text));
    }
    out.push_str("</dl>\n");
}

/// Text for HTML, in elements and in quoted attributes.
#[must_use]
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            _ => out.push(c),
        }
    }
    out
}

/// A value and its error with as many digits as the error warrants: two digits of the error, the value to the same place.
#[must_use]
pub fn plus_minus(value: f64, error: Option<f64>) -> (String, String) {
    match error.filter(|e| e.is_finite() && *e > 0.0) {
        Some(error) => {
            let places = (1.0 - error.log10().floor()).clamp(0.0, 9.0) as usize;
            (format!("{value:.places$}"), format!("{error:.places$}"))
        }
        None => {
            let places = if value == 0.0 {
                1.0
            } else {
                (3.0 - value.abs().log10().floor()).clamp(0.0, 9.0)
            };
            (format!("{value:.0$}", places as usize), "–".to_owned())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_follow_the_error() {
        assert_eq!(
            plus_minus(0.123_456, Some(0.0021)),
            ("0.1235".into(), "0.0021".into())
        );
        assert_eq!(
            plus_minus(12.345, Some(1.26)),
            ("12.3".into(), "1.3".into())
        );
        assert_eq!(plus_minus(0.049_35, None), ("0.04935".into(), "–".into()));
        assert_eq!(plus_minus(1.0, Some(f64::NAN)).1, "–");
    }

    #[test]
    fn names_from_files_cannot_break_out() {
        let part = FabricPart {
            id: "a".into(),
            name: "<script>alert(1)</script> & \"co\"".into(),
            ..FabricPart::default()
        };
        let html = Page {
            title: "T".into(),
            fabrics: vec![part],
            ..Page::default()
        }
        .html();
        assert!(
            !html.contains("<script>alert")
                && html.contains("&lt;script&gt;alert(1)&lt;/script&gt; &amp; &quot;co&quot;")
        );
    }

    #[test]
    fn nothing_is_fetched_from_the_network() {
        let html = Page::default().html();
        assert!(
            !html.contains("http://") && !html.contains("https://") && !html.contains("@import")
        );
    }
}
