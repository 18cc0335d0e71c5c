//! WIF drafts (Weaving Information File 1.1 and 1.2), read tolerantly: real files have holes in their tables.
//!
//! INI text: `[THREADING]` end -> shafts; `[TIEUP]` treadle -> shafts with `[TREADLING]` pick -> treadles, or
//! `[LIFTPLAN]` pick -> shafts; `[WEAVING] Rising Shed`; `[WARP]`, `[WEFT]` with threads, colour, spacing, thickness.

use super::draft::{Draft, Yarn};
use crate::measured::{Refused, read_bytes};
use std::collections::BTreeMap;
use std::path::Path;

/// Most yarns of one kind in a repeat, and most crossings: more is a damaged file.
const MAX_THREADS: usize = 20_000;
const MAX_CROSSINGS: usize = 50_000_000;
/// The greatest number of a shaft or treadle.
const MAX_SHAFT: usize = 4096;

/// One section: keys in lower case.
type Section = BTreeMap<String, String>;

/// Reads a file.
///
/// # Errors
/// A sentence that names the file and the section.
pub fn read(path: &Path) -> Result<Draft, Refused> {
    parse(&read_bytes(path)?).map_err(|e| Refused::new(format!("{}: {e}", path.display())))
}

/// Reads the bytes of a file; bytes that are no UTF-8 (old files are Latin-1) are replaced, only names suffer.
///
/// # Errors
/// A sentence that names the section.
pub fn parse(bytes: &[u8]) -> Result<Draft, Refused> {
    let text = String::from_utf8_lossy(bytes);
    let sections = sections(text.trim_start_matches('\u{feff}'));
    let empty = Section::new();
    let section = |name: &str| sections.get(name).unwrap_or(&empty);
    if !sections.contains_key("wif") && !sections.contains_key("threading") {
        return Err(Refused::new(
            "there is neither [WIF] nor [THREADING]: this is not a WIF draft",
        ));
    }
    let threading = table(section("threading"));
    if threading.is_empty() {
        return Err(Refused::new(
            "[THREADING] is missing or empty: no end is on a shaft",
        ));
    }
    let lifts = lifts(section("liftplan"), section("tieup"), section("treadling"));
    if lifts.is_empty() {
        return Err(Refused::new(
            "there is no [LIFTPLAN], and no [TREADLING] with a [TIEUP]: no pick lifts a shaft",
        ));
    }
    let ends = count("WARP", section("warp"), &threading)?;
    let picks = count("WEFT", section("weft"), &lifts)?;
    if ends * picks > MAX_CROSSINGS {
        return Err(Refused::new(format!(
            "{ends} ends × {picks} picks are more crossings than {MAX_CROSSINGS}"
        )));
    }
    let rising = section("weaving")
        .get("rising shed")
        .is_none_or(|v| truth(v));
    let none = Vec::new();
    let raised: Vec<Vec<bool>> = (1..=picks)
        .map(|pick| {
            let mut row = vec![false; MAX_SHAFT + 1];
            lifts
                .get(&pick)
                .unwrap_or(&none)
                .iter()
                .for_each(|&s| row[s] = true);
            row
        })
        .collect();
    let title = section("text").get("title").cloned().unwrap_or_default();
    let mut draft = Draft::new(&title, ends, picks, |end, pick| {
        let lifted = threading
            .get(&(end + 1))
            .is_some_and(|shafts| shafts.iter().any(|&s| s > 0 && raised[pick][s]));
        lifted == rising
    });
    let palette = palette(section("color palette"), section("color table"));
    draft.warp_colors = colors(ends, section("warp"), section("warp colors"), &palette);
    draft.weft_colors = colors(picks, section("weft"), section("weft colors"), &palette);
    draft.warp = yarn(section("warp"));
    draft.weft = yarn(section("weft"));
    Ok(draft)
}

fn sections(text: &str) -> BTreeMap<String, Section> {
    let mut out: BTreeMap<String, Section> = BTreeMap::new();
    let mut name = String::new();
    for line in text.lines() {
        let line = line.trim();
        if line.is_empty() || line.starts_with(';') {
            continue;
        }
        if let Some(rest) = line.strip_prefix('[') {
            name = rest.split(']').next().unwrap_or("").trim().to_lowercase();
            out.entry(name.clone()).or_default();
        } else if let Some((key, value)) = line.split_once('=') {
            let value = value.split(';').next().unwrap_or("").trim();
            out.entry(name.clone())
                .or_default()
                .insert(key.trim().to_lowercase(), value.to_owned());
        }
    }
    out
}

fn truth(value: &str) -> bool {
    ["true", "yes", "on", "1"].contains(&value.trim().to_lowercase().as_str())
}

/// `number -> numbers`; 0 means none, what is no number or too great is left out.
fn table(section: &Section) -> BTreeMap<usize, Vec<usize>> {
    let number = |s: &str| s.trim().parse::<usize>().ok();
    section
        .iter()
        .filter_map(|(key, value)| {
            let key = number(key).filter(|k| (1..=MAX_THREADS).contains(k))?;
            let list = value
                .split(',')
                .filter_map(number)
                .filter(|n| (1..=MAX_SHAFT).contains(n))
                .collect();
            Some((key, list))
        })
        .collect()
}

/// Pick -> lifted shafts, from the lift plan if it has any, else from treadles (several lift the union of theirs).
fn lifts(liftplan: &Section, tieup: &Section, treadling: &Section) -> BTreeMap<usize, Vec<usize>> {
    let plan = table(liftplan);
    if !plan.is_empty() {
        return plan;
    }
    let tieup = table(tieup);
    if tieup.is_empty() {
        return BTreeMap::new();
    }
    table(treadling)
        .into_iter()
        .map(|(pick, treadles)| {
            let shafts = treadles.iter().filter_map(|t| tieup.get(t)).flatten();
            (pick, shafts.copied().collect())
        })
        .collect()
}

/// The stated number of threads, or else the last one that a table names.
fn count(
    name: &str,
    section: &Section,
    table: &BTreeMap<usize, Vec<usize>>,
) -> Result<usize, Refused> {
    let stated = section.get("threads").and_then(|t| t.parse::<usize>().ok());
    let n = stated.unwrap_or_else(|| table.keys().last().copied().unwrap_or(0));
    if !(1..=MAX_THREADS).contains(&n) {
        return Err(Refused::new(format!(
            "[{name}] has Threads = {n}; there must be 1 to {MAX_THREADS}"
        )));
    }
    Ok(n)
}

/// Linear colours of the table, scaled from the palette's range; drafts hold display (sRGB) values.
fn palette(palette: &Section, table: &Section) -> BTreeMap<usize, [f64; 3]> {
    let numbers = |s: &str| -> Vec<f64> {
        s.split(',')
            .filter_map(|x| x.trim().parse().ok())
            .filter(|x: &f64| x.is_finite())
            .collect()
    };
    let range = palette.get("range").map(|r| numbers(r)).unwrap_or_default();
    let (lo, hi) = match range[..] {
        [lo, hi] if hi > lo => (lo, hi),
        _ => (0.0, 255.0),
    };
    let linear = |x: f64| {
        let x = ((x - lo) / (hi - lo)).clamp(0.0, 1.0);
        // IEC 61966-2-1.
        if x <= 0.04045 {
            x / 12.92
        } else {
            ((x + 0.055) / 1.055).powf(2.4)
        }
    };
    table
        .iter()
        .filter_map(|(key, value)| {
            let &[r, g, b] = &numbers(value)[..] else {
                return None;
            };
            Some((key.parse().ok()?, [r, g, b].map(linear)))
        })
        .collect()
}

/// The colour of each thread; empty when no colour at all is known. Holes take the section's own colour, then grey.
fn colors(
    n: usize,
    section: &Section,
    own: &Section,
    palette: &BTreeMap<usize, [f64; 3]>,
) -> Vec<[f64; 3]> {
    if palette.is_empty() {
        return Vec::new();
    }
    let look = |value: &String| {
        let index = value.split(',').next()?.trim().parse().ok()?;
        palette.get(&index).copied()
    };
    let default = section.get("color").and_then(look).unwrap_or([0.5; 3]);
    (1..=n)
        .map(|i| own.get(&i.to_string()).and_then(look).unwrap_or(default))
        .collect()
}

/// Spacing and thickness of a section in metres.
fn yarn(section: &Section) -> Yarn {
    let unit = match section.get("units").map(|u| u.to_lowercase()).as_deref() {
        Some("inches") => 0.0254,
        Some("decipoints") => 0.0254 / 720.0,
        _ => 0.01,
    };
    let length = |key: &str| {
        let x: f64 = section.get(key)?.parse().ok()?;
        (x.is_finite() && (0.0..1e4).contains(&x)).then_some(x * unit)
    };
    Yarn {
        spacing: length("spacing").filter(|s| *s > 0.0),
        thickness: length("thickness"),
    }
}
