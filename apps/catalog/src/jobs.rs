//! The work list: fit, simulate, render, encode, page. Every product is kept with a key of what it was made from, so a run that was
//! stopped, even by force, goes on where it was, and its pictures are those of an undisturbed run.

mod pictures;
mod shots;
mod subject;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use anyhow::Result;

use crate::catalog::{Catalog, Source};
use crate::picture::{Choice, Photographer, Set};
use crate::progress::Progress;
use crate::stage::Preset;
use crate::store::{Key, Store};
use crate::{cloth, story};
use shots::{FIT_WORK, Kind, clip_work, mine, shots, still_work, video_work};
pub use subject::Subject;

/// What the user ordered beside the catalog.
#[derive(Clone, Debug)]
pub struct Order {
    /// Folder for the page and everything it shows.
    pub out: PathBuf,
    /// Where to render.
    pub backend: Choice,
    /// Part i of n of the pictures, counted from 1.
    pub shard: Option<(u32, u32)>,
    /// The command as typed, for the page.
    pub command: String,
}

/// How a run ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The page is there.
    Complete {
        /// Where.
        page: PathBuf,
    },
    /// This part is done, pictures of other parts are missing.
    Partial {
        /// How many.
        missing: usize,
    },
    /// The user stopped it.
    Stopped,
}

/// Marks a run that the user stopped, on its way up.
#[derive(Debug, thiserror::Error)]
#[error("stopped on request")]
struct Stopped;

/// Makes the catalog, as far as the order asks. `folder` is where the catalog's file lies; `stop` is raised to stop.
///
/// # Errors
/// A sentence: what could not be done, and which file it was.
pub fn run(
    catalog: &Catalog,
    folder: &Path,
    order: &Order,
    stop: Arc<AtomicBool>,
) -> Result<Outcome> {
    match Run::start(catalog, folder, order, stop).and_then(|mut run| run.all()) {
        Err(e) if e.is::<Stopped>() => Ok(Outcome::Stopped),
        other => other,
    }
}

struct Run<'a> {
    catalog: &'a Catalog,
    order: &'a Order,
    store: Store,
    sources: Vec<Source>,
    photographer: Photographer,
    progress: Progress,
}

impl<'a> Run<'a> {
    /// Reads and checks everything that can be wrong before the first long piece of work.
    fn start(
        catalog: &'a Catalog,
        folder: &Path,
        order: &'a Order,
        stop: Arc<AtomicBool>,
    ) -> Result<Self> {
        let mut sources = Vec::new();
        for spec in &catalog.fabrics {
            sources.push(spec.source(folder)?);
            cloth::spec(spec, 0.0, &catalog.motion)?;
        }
        let store = Store::open(&order.out)?;
        let photographer = Photographer::choose(order.backend)?;
        eprintln!("{}", photographer.why());
        let clips = catalog.fabrics.len() as f64 * (FIT_WORK + clip_work(catalog));
        let shots: f64 = shots(catalog)
            .iter()
            .filter(|(i, _)| mine(order, *i))
            .map(|(_, s)| s.work)
            .sum();
        let total = clips
            + shots
            + (still_work(catalog) + video_work(catalog))
                * (catalog.fabrics.len() * catalog.lights.len()) as f64;
        Ok(Self {
            catalog,
            order,
            store,
            sources,
            photographer,
            progress: Progress::new(total, stop),
        })
    }

    fn all(&mut self) -> Result<Outcome> {
        let mut subjects = Vec::new();
        for index in 0..self.catalog.fabrics.len() {
            subjects.push(self.subject(index)?);
        }
        // Stills first: after a few minutes there is something to look at. Every shard needs them for its frames.
        let mut anchors = Vec::new();
        for subject in &subjects {
            for &light in &self.catalog.lights {
                anchors.push(self.still(subject, light)?);
            }
        }
        let mut ready: Option<((usize, Preset), Set)> = None;
        let mut missing = 0;
        for (index, shot) in shots(self.catalog) {
            let key = self.shot_key(&subjects[shot.subject], shot.kind);
            if self.store.get(&shot.name, &key).is_some() {
                if mine(self.order, index) {
                    self.progress.skip(shot.work);
                }
                continue;
            }
            if !mine(self.order, index) {
                missing += 1;
                continue;
            }
            self.check_stop()?;
            let subject = &subjects[shot.subject];
            let wanted = (shot.subject, shot.kind.light());
            let mut set = match ready.take() {
                Some((is, set)) if is == wanted => set,
                _ => self.set_up(subject, wanted.1)?,
            };
            let anchor = match shot.kind {
                Kind::Frame(light, _) => self
                    .catalog
                    .lights
                    .iter()
                    .position(|l| *l == light)
                    .map(|l| &anchors[shot.subject * self.catalog.lights.len() + l]),
                Kind::Desk => None,
            };
            let bytes = self.take(subject, &mut set, &shot, anchor)?;
            ready = Some((wanted, set));
            self.store.put(&shot.name, &key, &bytes)?;
            self.progress.add(shot.work);
        }
        if missing > 0 {
            self.progress.finish();
            return Ok(Outcome::Partial { missing });
        }
        for subject in &subjects {
            for &light in &self.catalog.lights {
                self.video(subject, light)?;
            }
        }
        let page = self.page(&subjects)?;
        self.progress.finish();
        Ok(Outcome::Complete { page })
    }

    fn check_stop(&self) -> Result<()> {
        if self.progress.stopped() {
            self.progress.finish();
            return Err(Stopped.into());
        }
        Ok(())
    }

    /// A failure that came from the user's wish to stop is no failure.
    fn or_stopped<T>(&self, result: Result<T>) -> Result<T> {
        if result.is_err() {
            self.check_stop()?;
        }
        result
    }

    fn page(&self, subjects: &[Subject]) -> Result<PathBuf> {
        let html = story::page(
            self.catalog,
            subjects,
            &self.order.command,
            self.photographer.why(),
        )
        .html();
        let key = Key::new("page", &[("html", &html)]);
        if self.store.get("index.html", &key).is_none() {
            self.store.put("index.html", &key, html.as_bytes())?;
        }
        Ok(self.store.path("index.html"))
    }
}
