//! What is odd about a scan's rows, said by row: twice the same directions, grazing angles, values below zero.

use super::kernel::STEEP_DEG;
use super::shared::shared;
use crate::text::number;
use std::collections::BTreeMap;
use woven_bsdf::angles::radians;
use woven_bsdf::measured::csv::Scan;

/// "rows 3, 7 and 12" with at most six of them named.
fn rows(list: &[usize]) -> String {
    let named: Vec<String> = list.iter().take(6).map(usize::to_string).collect();
    match list.len() {
        1 => format!("row {}", named[0]),
        n if n > 6 => format!("rows {} and {} more", named.join(", "), n - 6),
        _ => format!("rows {}", named.join(", ")),
    }
}

/// Sentences about a scan; rows count from 1 after the header.
pub(super) fn remarks(scan: &Scan) -> Vec<String> {
    let mut out = Vec::new();
    let (known, unknown) = shared(scan).unwrap_or_default();
    if !known.is_empty() {
        let list: Vec<String> = known
            .iter()
            .map(|s| format!("{} {}", s.kind.name(), number(s.sigma)))
            .collect();
        out.push(format!(
            "All rows share errors of the instrument ({}); the fit knows of them and the intervals hold them.",
            list.join(", ")
        ));
    }
    for name in unknown {
        out.push(format!(
            "The measurement names a shared error that this version does not know: {name}."
        ));
    }
    let mut seen: BTreeMap<[i64; 6], usize> = BTreeMap::new();
    let (mut twice, mut grazing, mut negative) = (Vec::new(), Vec::new(), Vec::new());
    let steep = radians(STEEP_DEG).cos();
    for (i, s) in scan.samples.iter().enumerate() {
        let row = i + 1;
        let key = [s.l.x, s.l.y, s.l.z, s.v.x, s.v.y, s.v.z].map(|c| (c * 1e7).round() as i64);
        if let Some(&first) = seen.get(&key) {
            twice.push((first, row));
        } else {
            seen.insert(key, row);
        }
        if s.l.z.abs() < steep || s.v.z.abs() < steep {
            grazing.push(row);
        }
        if s.f < 0.0 {
            negative.push(row);
        }
    }
    if !twice.is_empty() {
        let named = twice.iter().take(6);
        let pairs: Vec<String> = named
            .map(|(a, b)| format!("row {b} repeats row {a}"))
            .collect();
        let more = match twice.len() {
            n if n > 6 => format!(" and {} more", n - 6),
            _ => String::new(),
        };
        out.push(format!(
            "The same pair of directions stands twice: {}{more}; each counts.",
            pairs.join(", ")
        ));
    }
    if !grazing.is_empty() {
        out.push(format!(
            "Beyond {STEEP_DEG}° a BSDF is not defined: {} left out.",
            rows(&grazing)
        ));
    }
    if !negative.is_empty() {
        out.push(format!(
            "Below zero, which only noise can be: {}; kept.",
            rows(&negative)
        ));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odd_rows_are_named() {
        let text = "theta_l_deg,phi_l_deg,theta_v_deg,phi_v_deg,f,sigma\n\
            0,0,170,0,1,\n0,0,160,0,-0.1,\n0,0,170,0,1.1,\n0,0,90,0,1,\n";
        let list = remarks(&Scan::parse(text).unwrap());
        assert_eq!(list.len(), 3, "{list:?}");
        assert!(list[0].contains("row 3 repeats row 1"), "{list:?}");
        assert!(
            list[1].contains("row 4") && list[2].contains("row 2"),
            "{list:?}"
        );
    }
}
