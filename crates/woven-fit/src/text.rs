//! Numbers as people read them, and the ranking as a table for a terminal.

use crate::fit::{FitResult, ModelFit, Parameter};
use crate::measurement::shared::Kind;
use crate::rank::place_or_tie;
use std::fmt::Write;

/// A number with four significant digits, without a needless exponent.
pub fn number(x: f64) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    let magnitude = x.abs().log10().floor();
    if !x.is_finite() {
        return "—".to_owned();
    }
    if (-5.0..5.0).contains(&magnitude) {
        let decimals = (3.0 - magnitude).max(0.0) as usize;
        format!("{x:.decimals$}")
    } else {
        format!("{x:.3e}")
    }
}

/// "0.1234 ± 0.0012", with the error to two digits and the value to the same decimal; without error bar, the reason.
pub fn with_error(p: &Parameter) -> String {
    let Some(se) = p.standard_error.filter(|s| s.is_finite() && *s > 0.0) else {
        return format!(
            "{} ({})",
            number(p.value),
            if p.remark.is_empty() {
                "no error bar"
            } else {
                &p.remark
            }
        );
    };
    let decimals = (1.0 - se.log10().floor()).clamp(0.0, 12.0) as usize;
    format!("{:.decimals$} ± {:.decimals$}", p.value, se)
}

/// The table of all models, best first.
pub fn ranking(result: &FitResult) -> String {
    let mut s = String::new();
    let ok = "a string grows";
    writeln!(
        s,
        "{:>5}  {:<34} {:>2} {:>9} {:>10} {:>8} {:>8} {:>11} {:>11} {:>8} {:>6}",
        "place",
        "model",
        "n",
        "misfit",
        "SSE·1e4",
        "RMS·1e4",
        "off peak",
        "AICc",
        "BIC",
        "CV·1e4",
        "keeps"
    )
    .expect(ok);
    let mut last = 0;
    for fit in &result.ranking {
        writeln!(
            s,
            "{:>5}  {:<34} {:>2} {:>9.0} {:>10.1} {:>8.1} {:>8.1} {:>11.1} {:>11.1} {:>8} {:>5.0}%{}",
            place_or_tie(fit.place, &mut last),
            fit.label,
            fit.uncertainty.rank,
            fit.misfit,
            fit.sse_e4,
            fit.rms_e4,
            fit.rms_off_peak_e4,
            fit.aicc,
            fit.bic,
            fit.cross_validation_e4.map_or("—".to_owned(), |v| format!("{v:.1}")),
            100.0 * fit.stability,
            if fit.outcome == "converged" { String::new() } else { format!("  {}", fit.outcome) }
        )
        .expect(ok);
    }
    writeln!(
        s,
        "\nSorted by misfit: squares ({} metric) in units of the best model's scatter, apart for straight-through rows and the rest.\nSSE and RMS of values divided by the peak; \"=\" ties with the line above; \"keeps\": share of bootstrap samples at this place or better.",
        result.metric.name()
    )
    .expect(ok);
    s
}

/// One model's parameters with error bars, and what the data cannot see.
pub fn parameters(fit: &ModelFit) -> String {
    let mut s = format!(
        "{} ({}, {} of {} starts agree)\n",
        fit.label, fit.outcome, fit.starts_agreeing, fit.starts
    );
    let ok = "a string grows";
    for p in &fit.parameters {
        // A limit tells the interval already.
        let limit = p.remark.contains("95 %");
        let profile = p.interval95.filter(|_| p.profiled && !limit);
        let interval = profile.map_or(String::new(), |(lo, hi)| {
            format!(" (95 %: {} … {}, by profile)", number(lo), number(hi))
        });
        writeln!(s, "    {:<11} {}{interval}", p.name, with_error(p)).expect(ok);
    }
    if let Some(line) = offsets(fit) {
        writeln!(s, "    {line}").expect(ok);
    }
    if fit.uncertainty.rank < fit.uncertainty.free {
        writeln!(
            s,
            "    rank {} of {} free parameters",
            fit.uncertainty.rank, fit.uncertainty.free
        )
        .expect(ok);
    }
    for line in fit
        .uncertainty
        .invisible
        .iter()
        .chain(&fit.uncertainty.entangled)
    {
        writeln!(s, "    {line}").expect(ok);
    }
    s
}

/// What the fit says of errors that all rows share, in one line; none where there are none.
pub fn offsets(fit: &ModelFit) -> Option<String> {
    let one = |(kind, value, sigma): &(Kind, f64, f64)| {
        let sign = if *value < 0.0 { "" } else { "+" };
        let (name, value, sigma) = (kind.name(), number(*value), number(*sigma));
        format!("{name} {sign}{value} (± {sigma} before)")
    };
    let list: Vec<String> = fit.offsets.iter().map(one).collect();
    (!list.is_empty()).then(|| format!("shared errors as the fit finds them: {}", list.join(", ")))
}

/// Straight-through share in words.
pub fn straight(result: &FitResult) -> String {
    let Some(st) = &result.straight else {
        return String::new();
    };
    let at = if st.theta_deg < 0.5 {
        "normal incidence".to_owned()
    } else {
        format!("{:.0}° incidence", st.theta_deg)
    };
    let mut s = match (st.transmittance, st.measured_share) {
        (Some(t), Some(share)) => {
            format!(
                "straight-through share at {at}: {:.1} % of the transmittance ({:.4} of {t:.4} measured)",
                100.0 * share,
                st.measured
            )
        }
        _ => format!(
            "straight-through light at {at}: {:.4} measured",
            st.measured
        ),
    };
    if let Some(openness) = st.openness {
        s += &format!("; fitted sheet: openness {openness:.4}");
        if let Some(share) = st.model_share {
            s += &format!(", {:.1} % of its transmittance", 100.0 * share);
        }
    }
    if let (Some(m), Some(f)) = (st.measured_parts, st.model_parts) {
        s += &format!(
            "\npeak, skirt and floor at {at}: {} + {} + {} measured, {} + {} + {} fitted",
            number(m.peak),
            number(m.skirt),
            number(m.floor),
            number(f.peak),
            number(f.skirt),
            number(f.floor)
        );
    }
    if let (Some(m), Some(f)) = (st.measured_share_all, st.model_share_all)
        && !result.normal_only
    {
        s += &format!(
            "\nstraight-through share under even light from all sides: {:.1} % measured, {:.1} % fitted",
            100.0 * m,
            100.0 * f
        );
    }
    s
}

/// The whole answer for a terminal: ranking, straight-through share, parameters of the sheet and of the best model, notes.
pub fn whole(result: &FitResult) -> String {
    let mut s = format!(
        "{}: {} transmission values, {} incidences\n\n",
        result.name,
        result.transmission_points.points.len(),
        result.transmission_points.incidences.len()
    );
    s += &ranking(result);
    s += &format!("\n{}\n\n", straight(result));
    for (i, fit) in result.ranking.iter().enumerate() {
        if i == 0 || fit.label == "sheet" {
            s += &parameters(fit);
        }
    }
    if let Some(fit) = &result.reflection {
        s += &parameters(fit);
    }
    for note in &result.notes {
        s += &format!("note: {note}\n");
    }
    s
}
