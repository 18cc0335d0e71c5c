//! What a fit leaves behind: the fabric file and the report as one HTML page that opens offline.

use crate::figures::{gap_chart, polar_plots, residual_chart, shown, slice_chart, slices};
use crate::fit::{FitResult, ModelFit};
use crate::plot::{Scale, correlations, escape};
use crate::rank::place_or_tie;
use crate::text;
use std::collections::BTreeMap;
use std::fmt::Write;
use woven_bsdf::fabric::{Fabric, OpticsTable};
use woven_bsdf::model;

impl FitResult {
    /// The fit of the sheet to the transmission; none if it was not asked for.
    pub fn sheet(&self) -> Option<&ModelFit> {
        self.ranking.iter().find(|f| f.label == "sheet")
    }

    /// The sheet as a fabric file, with hashes of what it was made from; none if no sheet was fitted.
    ///
    /// `command` goes into its provenance.
    pub fn fabric(&self, command: &str) -> Option<Fabric> {
        let fit = self.sheet()?;
        let info = model::find(fit.model)?;
        let reflection = self.reflection.as_ref();
        // The reflection was fitted on top of the transmission's values, so its list holds all of them.
        let values = &reflection.unwrap_or(fit).values;
        let named = |name: &str| {
            info.params
                .iter()
                .position(|p| p.name == name)
                .map_or(0.0, |i| values[i])
        };
        let (through, back) = (named("t_d") + named("k_t"), named("r_d") + named("k_r"));
        // The yarn cannot give more than it gets.
        let scale = if through + back > 1.0 {
            ((1.0 - through) / back).clamp(0.0, 1.0)
        } else {
            1.0
        };
        let mut parameters = BTreeMap::new();
        for (p, &value) in info.params.iter().zip(values) {
            let reflects = ["r_d", "k_r"].contains(&p.name);
            if reflects && reflection.is_none() {
                continue;
            }
            let value = if reflects {
                value * scale * (1.0 - 1e-9)
            } else {
                value
            };
            parameters.insert(p.name.to_owned(), value.clamp(p.min, p.max));
        }
        let mut provenance = BTreeMap::new();
        provenance.insert("measurement".to_owned(), self.file.clone());
        provenance.insert("measurement_sha256".to_owned(), self.sha256.clone());
        provenance.insert("command".to_owned(), command.to_owned());
        provenance.insert("side".to_owned(), "front".to_owned());
        provenance.insert(
            "fit".to_owned(),
            format!(
                "transmission: RMS {:.1}e-4 of the peak over {} values{}",
                fit.rms_e4,
                fit.points,
                reflection.map_or("; reflection not measured".to_owned(), |r| format!(
                    "; reflection: RMS {:.1}e-4 of its peak",
                    r.rms_e4
                ))
            ),
        );
        if scale < 1.0 {
            provenance.insert(
                "remark".to_owned(),
                format!("reflection scaled by {scale:.4} so that no light is made"),
            );
        }
        Some(Fabric {
            name: self.name.clone(),
            maker: self.maker.clone(),
            weave: None,
            optics: OpticsTable {
                model: fit.model.to_owned(),
                parameters,
                colors: BTreeMap::new(),
            },
            mechanics: BTreeMap::new(),
            provenance,
        })
    }
}

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:1000px;margin:2em auto;padding:0 1em;color:#222}\
h1{font-size:1.5em;margin-bottom:.2em}h2{font-size:1.15em;margin-top:2em;border-bottom:1px solid #ddd}\
table{border-collapse:collapse;font-size:13px}td,th{padding:.25em .7em;text-align:right;border-bottom:1px solid #eee}\
th{border-bottom:2px solid #888}td.l,th.l{text-align:left}tr.best{background:#eef6ff}code{font-size:12px;background:#f4f4f4;padding:.1em .3em;overflow-wrap:anywhere}\
.row{display:flex;flex-wrap:wrap;gap:12px}.big{font-size:1.2em}.bar{display:flex;height:28px;border-radius:4px;overflow:hidden;max-width:640px}\
.bar div{color:#fff;font-size:12px;line-height:28px;text-align:center;overflow:hidden}details{margin:.4em 0}.note{background:#fff7e0;padding:.4em .8em;border-left:4px solid #e6a000}";

/// The report of one measurement as one page.
pub fn html(result: &FitResult, command: &str) -> String {
    let mut s = String::from("<!doctype html>\n");
    let ok = "a string grows";
    writeln!(s, "<!-- {} -->", command.replace("--", "- -")).expect(ok);
    writeln!(
        s,
        "<html lang='en'><meta charset='utf-8'><meta name='viewport' content='width=device-width'><title>{0}</title><style>{STYLE}</style><h1>{0}</h1>",
        escape(&result.name)
    )
    .expect(ok);
    let maker = if result.maker.is_empty() {
        String::new()
    } else {
        format!("{} · ", escape(&result.maker))
    };
    writeln!(
        s,
        "<p>{maker}{} transmission values, {} reflection values, {} incidences · <code>{}</code> · sha256 <code>{}</code><br><code>{}</code></p>",
        result.transmission_points.points.len(),
        result.reflection_points.points.len(),
        result.transmission_points.incidences.len(),
        escape(&result.file),
        result.sha256,
        escape(command)
    )
    .expect(ok);
    for note in &result.notes {
        writeln!(s, "<p class='note'>{}</p>", escape(note)).expect(ok);
    }
    straight(&mut s, result);
    ranking(&mut s, result);

    writeln!(s, "<h2>Measurement and models</h2><p>Curves are the models averaged over the instrument's patches, as they were compared.</p>").expect(ok);
    let models = shown(result);
    let points = &result.transmission_points;
    s += "<div class='row'>";
    for (_, plot) in polar_plots(result) {
        s += &plot.to_string();
    }
    s += "</div>\n";
    let slices = slices(points);
    for slice in &slices {
        writeln!(
            s,
            "<div class='row'>{}{}</div>",
            slice_chart(points, slice, &models, Scale::Linear),
            slice_chart(points, slice, &models, Scale::Log)
        )
        .expect(ok);
    }
    writeln!(s, "<h2>Residuals</h2><div class='row'>").expect(ok);
    for slice in slices.iter().take(4) {
        s += &residual_chart(points, slice, &models).to_string();
    }
    if let Some(fit) = result.sheet().filter(|f| f.has_gap) {
        s += &gap_chart(points, fit);
    }
    s += "</div>";

    writeln!(s, "<h2>Parameters</h2>").expect(ok);
    for (i, fit) in result.ranking.iter().chain(&result.reflection).enumerate() {
        let open = i == 0 || fit.model == "sheet";
        parameters(&mut s, fit, open);
    }
    writeln!(
        s,
        "<h2>How to read this</h2><p>Fits minimise the sum of squares in the {} metric by Levenberg–Marquardt with exact derivatives, linear factors separated and not negative, \
         from evenly spread starts (seed {}). Where a gap is fitted, straight-through patches and the rest have their own scatter. Error bars are standard errors from the covariance at the minimum, or, where that misleads, from the profile of the sum of squares: then so wide that one, two and three of them hold its intervals of 68, 95 and 99.7 %. They hold the \
         model to be true and the points' errors to be independent, so between files of one cloth expect more. SSE and RMS are of values divided by the peak, times 10⁴. \
         A place is shared where AICc differs by less than 2 or a bootstrap over incidences does not settle the order.</p></html>",
        result.metric.name(),
        result.seed
    )
    .expect(ok);
    s
}

fn straight(s: &mut String, result: &FitResult) {
    let Some(st) = &result.straight else { return };
    let ok = "a string grows";
    writeln!(
        s,
        "<h2>Straight-through light</h2><p class='big'>{}</p>",
        escape(&text::straight(result)).replace('\n', "<br>")
    )
    .expect(ok);
    if let Some(share) = st.measured_share {
        let percent = 100.0 * share;
        writeln!(
            s,
            "<div class='bar'><div style='width:{percent:.1}%;background:#0072b2'>straight through {percent:.1} %</div><div style='width:{:.1}%;background:#d55e00'>scattered</div></div>",
            100.0 - percent
        )
        .expect(ok);
    }
}

fn ranking(s: &mut String, result: &FitResult) {
    let ok = "a string grows";
    writeln!(
        s,
        "<h2>Ranking</h2><table><tr><th>place<th class='l'>model<th>n<th>misfit<th>SSE·10⁴<th>RMS·10⁴<th>RMS·10⁴ off the peak<th>AICc<th>BIC<th>CV·10⁴<th>keeps place<th class='l'>end</tr>"
    )
    .expect(ok);
    let mut last = 0;
    for fit in &result.ranking {
        let place = place_or_tie(fit.place, &mut last);
        writeln!(
            s,
            "<tr{}><td>{place}<td class='l'>{}<td>{}<td>{:.0}<td>{:.1}<td>{:.1}<td>{:.1}<td>{:.1}<td>{:.1}<td>{}<td>{:.0} %<td class='l'>{}</tr>",
            if fit.place == 1 { " class='best'" } else { "" },
            escape(&fit.label),
            fit.uncertainty.rank,
            fit.misfit,
            fit.sse_e4,
            fit.rms_e4,
            fit.rms_off_peak_e4,
            fit.aicc,
            fit.bic,
            fit.cross_validation_e4.map_or("—".to_owned(), |v| format!("{v:.1}")),
            100.0 * fit.stability,
            fit.outcome
        )
        .expect(ok);
    }
    s.push_str("</table><p>Sorted by misfit: squares in units of the best model's scatter, apart for straight-through patches and the rest. n counts what the data can see; \"=\" ties with the line above.</p>");
}

fn parameters(s: &mut String, fit: &ModelFit, open: bool) {
    let ok = "a string grows";
    writeln!(
        s,
        "<details{}><summary><b>{}</b>: {}, rank {} of {}, {} of {} starts agree, {} evaluations</summary><div class='row'><div><table><tr><th class='l'>parameter<th>value ± standard error<th>68 %<th>95 %<th>99.7 %<th class='l'></tr>",
        if open { " open" } else { "" },
        escape(&fit.label),
        fit.outcome,
        fit.uncertainty.rank,
        fit.uncertainty.free,
        fit.starts_agreeing,
        fit.starts,
        fit.evaluations
    )
    .expect(ok);
    for p in &fit.parameters {
        let interval = |i: Option<(f64, f64)>| {
            i.map_or(String::new(), |(lo, hi)| {
                format!("{} … {}", text::number(lo), text::number(hi))
            })
        };
        let remarks = [
            p.remark.as_str(),
            if p.profiled { "by profile" } else { "" },
        ];
        let remarks: Vec<&str> = remarks.into_iter().filter(|r| !r.is_empty()).collect();
        writeln!(
            s,
            "<tr><td class='l'>{}<td>{}<td>{}<td>{}<td>{}<td class='l'>{}</tr>",
            p.name,
            escape(&text::with_error(p)),
            interval(p.interval68),
            interval(p.interval95),
            interval(p.interval997),
            escape(&remarks.join("; "))
        )
        .expect(ok);
    }
    s.push_str("</table><ul>");
    let u = &fit.uncertainty;
    for line in text::offsets(fit)
        .iter()
        .chain(&u.invisible)
        .chain(&u.entangled)
    {
        writeln!(s, "<li>{}", escape(line)).expect(ok);
    }
    writeln!(
        s,
        "</ul></div>{}</div></details>",
        correlations(&fit.names, &fit.uncertainty.correlation)
    )
    .expect(ok);
}
