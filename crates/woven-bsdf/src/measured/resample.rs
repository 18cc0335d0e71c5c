//! Any BSDF as a Klems matrix: the mean over every pair of patches.

use super::klems::{Block, Kind, Klems};
use super::klems_write::klems_full;
use crate::vec3::Vec3;

/// The powers of the root of x⁵ = x + 1: a low-discrepancy sequence in four dimensions without a table.
const STEP: [f64; 4] = [
    0.856_674_883_854_503,
    0.733_891_856_627_126,
    0.628_706_721_037_809,
    0.538_597_254_759_449,
];

/// How finely the pairs of patches are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Detail {
    /// Points of the incident and of the outgoing patch where these are straight through (or mirrored): a peak may be
    /// far narrower than a patch. Each pair of them is asked for.
    pub peak: (usize, usize),
    /// Pairs of points elsewhere.
    pub floor: usize,
}

/// A block over LBNL's full basis: the mean of `f(l, v)` in 1/sr over each pair of patches, even in projected solid
/// angle.
pub fn block(
    band: &str,
    kind: Kind,
    detail: Detail,
    f: impl Fn(Vec3<f64>, Vec3<f64>) -> f64,
) -> Block {
    let patches = klems_full();
    let n = patches.len();
    let mut values = vec![0.0; n * n];
    for (i, incident) in patches.iter().enumerate() {
        for (o, out) in patches.iter().enumerate() {
            // Point k of one patch with point m of the other.
            let at = |k: usize, m: usize| {
                let place = |a: usize, i: usize| (0.5 + STEP[a] * (i as f64 + 0.5)).fract();
                let l = kind.l(incident.at(place(0, k), place(1, k)));
                f(l, kind.v(out.at(place(2, m), place(3, m))))
            };
            let (many, each) = detail.peak;
            values[o * n + i] = if i == o {
                let pairs = (0..many * each).map(|k| at(k / each, k % each));
                pairs.sum::<f64>() / (many * each).max(1) as f64
            } else {
                (0..detail.floor).map(|k| at(k, k)).sum::<f64>() / detail.floor.max(1) as f64
            };
        }
    }
    Block {
        band: band.to_owned(),
        kind,
        values,
    }
}

/// A file of such blocks.
pub fn file(name: &str, manufacturer: &str, blocks: Vec<Block>) -> Klems {
    Klems {
        name: name.to_owned(),
        manufacturer: manufacturer.to_owned(),
        patches: klems_full(),
        blocks,
    }
}
