//! The pictures of a catalog in the order of work, and what each piece of work costs on the progress bar.

use super::Order;
use crate::catalog::Catalog;
use crate::stage::Preset;

/// A picture to be taken.
#[derive(Clone, Debug)]
pub(super) struct Shot {
    pub(super) subject: usize,
    pub(super) kind: Kind,
    /// Its product's name.
    pub(super) name: String,
    /// Cost in the unit of the progress bar.
    pub(super) work: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// The curtain at rest, one picture a light.
    Desk,
    /// A frame of the motion in a light.
    Frame(Preset, u32),
}

/// Work of the fit of one fabric, in the progress bar's unit: about a second of two ordinary cores.
pub(super) const FIT_WORK: f64 = 12.0;
/// Work of a simulated frame per vertex of the mesh.
const CLOTH_WORK: f64 = 3.0e-5;
/// Work of a path.
const PATH_WORK: f64 = 2.4e-6;
/// Work of filtering a pixel.
const FILTER_WORK: f64 = 2.0e-6;
/// Work of encoding a pixel of a video.
const VIDEO_WORK: f64 = 1.5e-7;

impl Kind {
    pub(super) fn light(self) -> Preset {
        match self {
            Self::Frame(light, _) => light,
            Self::Desk => Preset::All,
        }
    }
}

pub(super) fn frame_name(id: &str, light: Preset, frame: u32) -> String {
    format!("work/{id}/{}/{:04}.png", light.name(), frame + 1)
}

/// All pictures of a catalog in the order of work, numbered for the shards.
pub(super) fn shots(catalog: &Catalog) -> Vec<(usize, Shot)> {
    let picture = &catalog.picture;
    let mut shots = Vec::new();
    for (subject, fabric) in catalog.fabrics.iter().enumerate() {
        shots.push(Shot {
            subject,
            kind: Kind::Desk,
            name: format!("{}/lights.js", fabric.id),
            work: work(catalog, picture.desk_samples()),
        });
    }
    for (subject, fabric) in catalog.fabrics.iter().enumerate() {
        for &light in &catalog.lights {
            for n in 0..catalog.motion.frames {
                shots.push(Shot {
                    subject,
                    kind: Kind::Frame(light, n),
                    name: frame_name(&fabric.id, light, n),
                    work: work(catalog, picture.samples),
                });
            }
        }
    }
    shots.into_iter().enumerate().collect()
}

/// Whether the picture of this number belongs to this run.
pub(super) fn mine(order: &Order, index: usize) -> bool {
    order
        .shard
        .is_none_or(|(i, n)| index % n as usize == i as usize - 1)
}

/// Work of a picture with this many paths a pixel.
pub(super) fn work(catalog: &Catalog, samples: u32) -> f64 {
    let size = catalog.picture.size;
    f64::from(size[0] * size[1]) * (f64::from(samples) * PATH_WORK + FILTER_WORK)
}

pub(super) fn still_work(catalog: &Catalog) -> f64 {
    work(catalog, catalog.picture.still_samples)
}

pub(super) fn clip_work(catalog: &Catalog) -> f64 {
    let m = &catalog.motion;
    // Rest, warming up and the search for a loop take about as long again as a hundred frames.
    f64::from(m.frames + m.blend + 100) * f64::from(m.mesh[0] * m.mesh[1]) * CLOTH_WORK
}

pub(super) fn video_work(catalog: &Catalog) -> f64 {
    f64::from(catalog.motion.frames)
        * f64::from(catalog.picture.size[0] * catalog.picture.size[1])
        * VIDEO_WORK
}
