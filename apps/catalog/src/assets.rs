//! The measurements that this program carries: the files of `assets/measurements`, with their notices.

/// (file name, contents), in the order of the names.
const FILES: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/measurements.rs"));

/// The contents of a carried measurement.
#[must_use]
pub fn measurement(name: &str) -> Option<&'static [u8]> {
    FILES
        .iter()
        .find(|(n, _)| *n == name && is_measurement(n))
        .map(|(_, bytes)| *bytes)
}

/// The names of the carried measurements.
#[must_use]
pub fn names() -> Vec<&'static str> {
    FILES
        .iter()
        .map(|(name, _)| *name)
        .filter(|n| is_measurement(n))
        .collect()
}

/// The notices that go wherever the measurements go: (file name, contents).
#[must_use]
pub fn notices() -> Vec<(&'static str, &'static [u8])> {
    FILES
        .iter()
        .filter(|(name, _)| !is_measurement(name))
        .copied()
        .collect()
}

fn is_measurement(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    name.ends_with(".xml") || name.ends_with(".csv")
}
