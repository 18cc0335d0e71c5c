//! What the page tells: names, captions, tables and provenance, gathered from the catalog and the results.

use crate::catalog::{Catalog, Motion};
use crate::desk;
use crate::jobs::Subject;
use crate::page::{FabricPart, Page, Row, Shot};
use crate::stage::Preset;
use crate::store::{sha256, version};

/// The page of a finished run.
#[must_use]
pub fn page(catalog: &Catalog, subjects: &[Subject], command: &str, backend: &str) -> Page {
    let (p, m) = (&catalog.picture, &catalog.motion);
    let made = [
        ("Command", command.to_owned()),
        ("Program", format!("woven-catalog {}", version())),
        ("Rendering", format!("{backend} {}x{} pixels, {} paths a pixel in motion and {} at rest, up to {} bounces{}; seed {}.", p.size[0], p.size[1], p.samples, p.still_samples, p.depth, if p.denoise { ", remaining noise filtered" } else { "" }, p.seed)),
        ("Motion", format!("Mass-spring sheets of {} by {} cells in wind of {} m/s with gusts (standard deviation {} of the mean); {} frames at {} a second{}; seed {}.", m.mesh[0], m.mesh[1], m.wind, m.gusts, m.frames, m.fps, looping(m), m.seed)),
        ("Lights", "Day: sun and clear sky outside the window. Evening: warm lamps inside, dusk outside. Exposure is set for each light, the same for all fabrics.".to_owned()),
    ];
    Page {
        title: catalog.title.clone(),
        lead: catalog.lead.clone(),
        fabrics: subjects.iter().map(|s| fabric(catalog, s)).collect(),
        made: pairs(made),
    }
}

fn looping(m: &Motion) -> String {
    if m.blend == 0 {
        String::new()
    } else {
        format!(
            ", the end led back to the beginning over {} frames",
            m.blend
        )
    }
}

fn pairs<const N: usize>(rows: [(&str, String); N]) -> Vec<(String, String)> {
    rows.into_iter()
        .filter(|(_, text)| !text.is_empty())
        .map(|(label, text)| (label.to_owned(), text))
        .collect()
}

fn fabric(catalog: &Catalog, s: &Subject) -> FabricPart {
    let (spec, size) = (&s.spec, (catalog.picture.size[0], catalog.picture.size[1]));
    let mut facts: Vec<String> = Vec::new();
    if !spec.maker.is_empty() {
        facts.push(spec.maker.clone());
    }
    if let Some((transmittance, angle)) = s.summary.transmittance {
        let at = if angle < 1.0 {
            "straight on".to_owned()
        } else {
            format!("at {angle:.0}°")
        };
        facts.push(format!(
            "transmits {} of the light {at}",
            percent(transmittance)
        ));
    }
    facts.push(format!("{} open", percent(s.summary.openness)));
    let mut notes = s.summary.notes.clone();
    if spec.tint.is_some() {
        notes.push("The measurement has one band (luminous), no colour: the hue in the pictures is chosen by the name of the article, the level of light is the measured one.".to_owned());
    }
    notes.push(format!("Weight and stiffness were not measured: the curtain is simulated as the class \"{}\" of woven-cloth's table.", spec.mechanics));
    FabricPart {
        id: spec.id.clone(),
        name: spec.name.clone(),
        facts: facts.join(" · "),
        lead: spec.lead.clone(),
        shots: shots(catalog, s),
        desk: Some(desk::desk(&spec.id, &spec.name, size)),
        plots: s.summary.plots.clone(),
        report: spec
            .fabric_file
            .is_empty()
            .then(|| format!("{}/fit.html", spec.id)),
        parameters: s.summary.parameters.iter().map(row).collect(),
        notes,
        ranking: ranking(s),
        provenance: provenance(s),
    }
}

fn percent(share: f64) -> String {
    let value = share * 100.0;
    if value >= 9.95 {
        format!("{value:.0} %")
    } else if value >= 0.995 {
        format!("{value:.1} %")
    } else {
        format!("{value:.2} %")
    }
}

fn row(p: &crate::optics::Parameter) -> Row {
    Row {
        name: p.name.clone(),
        meaning: p.meaning.clone(),
        value: p.value,
        error: p.error,
        unit: String::new(),
    }
}

/// Videos of all lights, then stills.
fn shots(catalog: &Catalog, s: &Subject) -> Vec<Shot> {
    let (id, name, m) = (&s.spec.id, &s.spec.name, &catalog.motion);
    let size = (catalog.picture.size[0], catalog.picture.size[1]);
    let scene = |light: Preset| match light {
        Preset::Evening => "in the evening, lit by lamps in the room, dusk outside",
        _ => "by day, sun and sky outside the window",
    };
    let videos = catalog.lights.iter().map(|&light| Shot {
        file: format!("{id}/{}.mp4", light.name()),
        poster: Some(format!("{id}/{}-poster.jpg", light.name())),
        title: format!("{}, in the wind", light.title()),
        detail: format!(
            "{:.1} s, {} frames a second",
            f64::from(m.frames) / f64::from(m.fps),
            m.fps
        ),
        alt: format!(
            "Video: a pleated curtain of {name} moves in the wind of an open window, {}",
            scene(light)
        ),
        size,
    });
    let stills = catalog.lights.iter().map(|&light| Shot {
        file: format!("{id}/{}-rest.png", light.name()),
        poster: None,
        title: format!("{}, at rest", light.title()),
        detail: format!("{} paths a pixel", catalog.picture.still_samples),
        alt: format!(
            "A pleated curtain of {name} hangs still before a window, {}",
            scene(light)
        ),
        size,
    });
    videos.chain(stills).collect()
}

fn ranking(s: &Subject) -> Option<(Vec<String>, Vec<Vec<String>>)> {
    if s.summary.ranking.is_empty() {
        return None;
    }
    let head = ["Model", "Place", "RMS × 10⁴", "unseen × 10⁴", "AICc"]
        .map(str::to_owned)
        .to_vec();
    let rows = s.summary.ranking.iter().map(|r| {
        let cross = r
            .cross_e4
            .map_or_else(|| "–".to_owned(), |c| format!("{c:.1}"));
        vec![
            r.label.clone(),
            r.place.to_string(),
            format!("{:.1}", r.rms_e4),
            cross,
            format!("{:.0}", r.aicc),
        ]
    });
    Some((head, rows.collect()))
}

fn provenance(s: &Subject) -> Vec<(String, String)> {
    let source = &s.source;
    let file = if source.builtin {
        format!("{} (beside this page in {}/)", source.file, s.spec.id)
    } else {
        source.file.clone()
    };
    let map = source.map.as_ref();
    let what = if s.spec.fabric_file.is_empty() {
        "Measurement"
    } else {
        "Made from the fabric file"
    };
    let mut rows = pairs([
        (what, file),
        ("Name in the file", s.summary.name.clone()),
        ("Source", s.spec.source.clone()),
        ("Licence", s.spec.licence.clone()),
        ("SHA-256", sha256(&source.bytes)),
        (
            "Map of openness",
            map.map_or_else(String::new, |(name, bytes)| {
                format!("{}/{name}, SHA-256 {}", s.spec.id, sha256(bytes))
            }),
        ),
        (
            "Fabric file",
            format!("{}/fabric.toml, SHA-256 {}", s.spec.id, s.fabric_hash),
        ),
        (
            "Curtain",
            format!("{}/curtain.glb, SHA-256 {}", s.spec.id, s.clip_hash),
        ),
    ]);
    if !s.spec.fabric_file.is_empty() {
        let own = s.fabric.provenance.iter();
        rows.extend(own.map(|(label, text)| (label.clone(), text.clone())));
    }
    rows
}
