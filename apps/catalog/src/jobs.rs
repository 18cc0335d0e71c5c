//! The work list: fit, simulate, render, encode, page. Every product is kept with a key of what it was made from, so a run that was
//! stopped, even by force, goes on where it was, and its pictures are those of an undisturbed run.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use anyhow::{Context as _, Result};
use image::RgbImage;
use woven_bsdf::fabric::Fabric;
use woven_cloth::{CurtainClip, CurtainSpec};

use crate::anchor::Anchor;
use crate::catalog::{Catalog, FabricSpec, Source};
use crate::optics::Summary;
use crate::picture::{Choice, Photographer, Set, Shoot};
use crate::progress::Progress;
use crate::stage::{Preset, Stage};
use crate::store::{Key, Store, sha256};
use crate::{assets, cloth, desk, optics, story, video};

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

/// A fabric on its way through the run.
pub struct Subject {
    /// What the catalog says of it.
    pub spec: FabricSpec,
    /// Its measurement or fabric file.
    pub source: Source,
    /// Its fabric file's contents.
    pub fabric: Fabric,
    /// What the fit found.
    pub summary: Summary,
    /// SHA-256 of the fabric file, with its map of openness.
    pub fabric_hash: String,
    /// SHA-256 of the clip of its curtain.
    pub clip_hash: String,
    /// The curtain's mesh, at rest and in motion.
    pub clip: CurtainClip,
}

/// A picture to be taken.
#[derive(Clone, Debug)]
struct Shot {
    subject: usize,
    kind: Kind,
    /// Its product's name.
    name: String,
    /// Cost in the unit of the progress bar.
    work: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// The curtain at rest, one picture a light.
    Desk,
    /// A frame of the motion in a light.
    Frame(Preset, u32),
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

/// Work of the fit of one fabric, in the progress bar's unit: about a second of two ordinary cores.
const FIT_WORK: f64 = 12.0;
/// Work of a simulated frame per vertex of the mesh.
const CLOTH_WORK: f64 = 3.0e-5;
/// Work of a path.
const PATH_WORK: f64 = 2.4e-6;
/// Work of filtering a pixel.
const FILTER_WORK: f64 = 2.0e-6;
/// Work of encoding a pixel of a video.
const VIDEO_WORK: f64 = 1.5e-7;

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

    /// Measurement, fit and motion of one fabric, each taken from the folder if it is there.
    fn subject(&mut self, index: usize) -> Result<Subject> {
        let spec = self.catalog.fabrics[index].clone();
        let source = self.sources[index].clone();
        let id = &spec.id;
        let path = self.put_source(&spec, &source)?;
        self.check_stop()?;

        let how = serde_json::to_string(&self.catalog.fit)?;
        let tint = format!("{:?}", spec.tint);
        let bytes = [Some(&source.bytes), source.map.as_ref().map(|(_, map)| map)];
        let hash = bytes
            .into_iter()
            .flatten()
            .map(|b| sha256(b))
            .collect::<Vec<_>>()
            .join(" ");
        let key = Key::new(
            "fit",
            &[
                ("measurement", &hash),
                ("fit", &how),
                ("name", &spec.name),
                ("maker", &spec.maker),
                ("tint", &tint),
            ],
        );
        let (fabric_name, summary_name) = (format!("{id}/fabric.toml"), format!("{id}/fit.json"));
        let (fabric_text, summary) = match (
            self.store.get(&fabric_name, &key),
            self.store.get(&summary_name, &key),
        ) {
            (Some(fabric), Some(summary)) => {
                self.progress.skip(FIT_WORK);
                (
                    String::from_utf8(fabric)?,
                    serde_json::from_slice(&summary)?,
                )
            }
            _ => {
                let fitted = if spec.fabric_file.is_empty() {
                    self.progress.say(&format!("{}: fitting", spec.name));
                    let progress = &self.progress;
                    let fitted = optics::fit(&path, &spec, &self.catalog.fit, &|share| {
                        progress.show(share * FIT_WORK);
                        !progress.stopped()
                    });
                    self.or_stopped(fitted)?
                } else {
                    optics::ready(&path, &spec)?
                };
                let text = fitted.fabric.to_toml();
                if let Some(report) = &fitted.report {
                    self.store
                        .put(&format!("{id}/fit.html"), &key, report.as_bytes())?;
                }
                self.store.put(&fabric_name, &key, text.as_bytes())?;
                self.store.put(
                    &summary_name,
                    &key,
                    &serde_json::to_vec_pretty(&fitted.summary)?,
                )?;
                self.progress.add(FIT_WORK);
                (text, fitted.summary)
            }
        };
        let fabric = Fabric::from_toml(&fabric_text)?;
        let curtain = cloth::spec(&spec, summary.openness, &self.catalog.motion)?;
        let (clip, clip_hash) = self.clip(&spec, &curtain)?;
        Ok(Subject {
            spec,
            fabric_hash: match &source.map {
                None => sha256(fabric_text.as_bytes()),
                Some((_, map)) => sha256(&[fabric_text.as_bytes(), map].concat()),
            },
            source,
            fabric,
            summary,
            clip_hash,
            clip,
        })
    }

    /// A carried measurement is put beside the page, with its notices, and so is a map of openness; another file is read where it is.
    fn put_source(&self, spec: &FabricSpec, source: &Source) -> Result<PathBuf> {
        let mut files: Vec<(&str, &[u8])> = Vec::new();
        let mut path = source.path.clone();
        if source.builtin {
            files = assets::notices();
            files.push((&source.file, &source.bytes));
            path = self.store.path(&format!("{}/{}", spec.id, source.file));
        }
        files.extend(
            source
                .map
                .iter()
                .map(|(name, map)| (name.as_str(), map.as_slice())),
        );
        for (file, bytes) in files {
            let name = format!("{}/{file}", spec.id);
            let key = Key::new("source", &[("sha256", &sha256(bytes))]);
            if self.store.get(&name, &key).is_none() {
                self.store.put(&name, &key, bytes)?;
            }
        }
        Ok(path)
    }

    fn clip(&mut self, spec: &FabricSpec, curtain: &CurtainSpec) -> Result<(CurtainClip, String)> {
        let name = format!("{}/curtain.glb", spec.id);
        let motion = self.catalog.motion;
        let key = Key::new(
            "clip",
            &[
                ("curtain", &serde_json::to_string(curtain)?),
                ("motion", &serde_json::to_string(&motion)?),
            ],
        );
        let work = clip_work(self.catalog);
        if self.store.get(&name, &key).is_none() {
            self.check_stop()?;
            self.progress
                .say(&format!("{}: hanging it in the wind", spec.name));
            let progress = &self.progress;
            let made = cloth::run(curtain, &motion, &mut |share| {
                progress.show(share * work);
                !progress.stopped()
            });
            let clip = self.or_stopped(made)?;
            self.store.put(&name, &key, &cloth::bytes(&clip)?)?;
            self.progress.add(work);
        } else {
            self.progress.skip(work);
        }
        // Always from the file: a run that goes on sees the same numbers as one that never stopped.
        let bytes = self.store.get(&name, &key).with_context(|| {
            format!("{name} vanished from the output folder while it was in use")
        })?;
        Ok((cloth::read(&self.store.path(&name))?, sha256(&bytes)))
    }

    /// What a picture is made from.
    fn shot_key(&self, subject: &Subject, kind: Kind) -> Key {
        let frame = match kind {
            Kind::Desk => "rest".to_owned(),
            Kind::Frame(_, frame) => frame.to_string(),
        };
        self.picture_key(
            subject,
            if kind == Kind::Desk { "desk" } else { "frame" },
            kind.light(),
            &frame,
        )
    }

    /// The key of a picture of this `kind`.
    fn picture_key(&self, subject: &Subject, kind: &str, light: Preset, frame: &str) -> Key {
        let picture = serde_json::to_string(&self.catalog.picture).unwrap_or_default();
        Key::new(
            kind,
            &[
                ("fabric", &subject.fabric_hash),
                ("clip", &subject.clip_hash),
                ("frame", frame),
                ("light", light.name()),
                ("picture", &picture),
                ("backend", self.photographer.identity()),
            ],
        )
    }

    /// The still of a fabric in a light, and the anchor of its frames.
    fn still(&mut self, subject: &Subject, light: Preset) -> Result<Anchor> {
        let id = &subject.spec.id;
        let (name, anchor_name) = (
            format!("{id}/{}-rest.png", light.name()),
            format!("work/{id}/{}/anchor.bin", light.name()),
        );
        let key = self.picture_key(subject, "still", light, "rest");
        let work = still_work(self.catalog);
        if let (Some(_), Some(anchor)) = (
            self.store.get(&name, &key),
            self.store.get(&anchor_name, &key),
        ) {
            self.progress.skip(work);
            return Anchor::from_bytes(&anchor);
        }
        self.check_stop()?;
        self.progress
            .say(&format!("{}: {}, at rest", subject.spec.name, light.name()));
        let mut set = self.set_up(subject, light)?;
        let picture = &self.catalog.picture;
        let progress = &self.progress;
        let taken = set.still(
            &cloth::mesh(&subject.clip, None),
            picture.samples,
            picture.still_samples,
            &mut |share| {
                progress.show(share * work);
                !progress.stopped()
            },
        );
        let (film, anchor) = self.or_stopped(taken)?;
        self.store.put(&anchor_name, &key, &anchor.to_bytes())?;
        self.store.put(&name, &key, &film.png()?)?;
        self.progress.add(work);
        Ok(anchor)
    }

    /// The stage in a light, with the curtain at rest.
    fn set_up(&self, subject: &Subject, light: Preset) -> Result<Set> {
        let picture = &self.catalog.picture;
        let mut stage = Stage::new(light).with_curtain(cloth::mesh(&subject.clip, None));
        stage.dress(&subject.fabric, &self.store.path(&subject.spec.id))?;
        let shoot = Shoot {
            size: picture.size,
            depth: picture.depth,
            seed: picture.seed,
            denoise: picture.denoise,
            layers: light == Preset::All,
        };
        self.photographer.set_up(&stage, &shoot)
    }

    /// Takes a picture: the bytes of its product.
    fn take(
        &self,
        subject: &Subject,
        set: &mut Set,
        shot: &Shot,
        anchor: Option<&Anchor>,
    ) -> Result<Vec<u8>> {
        let picture = &self.catalog.picture;
        let name = &subject.spec.name;
        let (frame, samples) = match shot.kind {
            Kind::Desk => {
                self.progress.say(&format!("{name}: one picture a light"));
                (None, picture.desk_samples())
            }
            Kind::Frame(light, frame) => {
                self.progress.say(&format!(
                    "{name}: {}, frame {} of {}",
                    light.name(),
                    frame + 1,
                    self.catalog.motion.frames
                ));
                (Some(frame as usize), picture.samples)
            }
        };
        let progress = &self.progress;
        let film = set.take(
            &cloth::mesh(&subject.clip, frame),
            samples,
            anchor,
            &mut |share| {
                progress.show(share * shot.work);
                !progress.stopped()
            },
        );
        let film = self.or_stopped(film)?;
        if shot.kind == Kind::Desk {
            return Ok(
                desk::script(&subject.spec.id, picture.size.into(), &film.lights()?)?.into_bytes(),
            );
        }
        film.png()
    }

    /// Encodes the frames of one light, and puts the first one beside as the poster.
    fn video(&mut self, subject: &Subject, light: Preset) -> Result<()> {
        let id = &subject.spec.id;
        let motion = &self.catalog.motion;
        let frames: Vec<(String, Key)> = (0..motion.frames)
            .map(|n| {
                (
                    frame_name(id, light, n),
                    self.shot_key(subject, Kind::Frame(light, n)),
                )
            })
            .collect();
        let all: Vec<&str> = frames.iter().map(|(_, key)| key.text()).collect();
        let key = Key::new(
            "video",
            &[("frames", &all.join(" ")), ("fps", &motion.fps.to_string())],
        );
        let (name, poster) = (
            format!("{id}/{}.mp4", light.name()),
            format!("{id}/{}-poster.jpg", light.name()),
        );
        let work = video_work(self.catalog);
        if self.store.get(&name, &key).is_some() && self.store.get(&poster, &key).is_some() {
            self.progress.skip(work);
            return Ok(());
        }
        self.check_stop()?;
        self.progress
            .say(&format!("{}: {}, video", subject.spec.name, light.name()));
        let read = |(name, key): &(String, Key)| -> Result<RgbImage> {
            let bytes = self.store.get(name, key).with_context(|| {
                format!("{name} vanished from the output folder while it was in use")
            })?;
            Ok(image::load_from_memory(&bytes)
                .with_context(|| format!("{name} is not a picture"))?
                .to_rgb8())
        };
        let bytes = video::encode(frames.iter().map(read), motion.fps)?;
        self.store.put(&name, &key, &bytes)?;
        let mut jpeg = Vec::new();
        read(&frames[0])?.write_with_encoder(
            image::codecs::jpeg::JpegEncoder::new_with_quality(&mut jpeg, 88),
        )?;
        self.store.put(&poster, &key, &jpeg)?;
        self.progress.add(work);
        Ok(())
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

impl Kind {
    fn light(self) -> Preset {
        match self {
            Self::Frame(light, _) => light,
            Self::Desk => Preset::All,
        }
    }
}

fn frame_name(id: &str, light: Preset, frame: u32) -> String {
    format!("work/{id}/{}/{:04}.png", light.name(), frame + 1)
}

/// All pictures of a catalog in the order of work, numbered for the shards.
fn shots(catalog: &Catalog) -> Vec<(usize, Shot)> {
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
fn mine(order: &Order, index: usize) -> bool {
    order
        .shard
        .is_none_or(|(i, n)| index % n as usize == i as usize - 1)
}

/// Work of a picture with this many paths a pixel.
fn work(catalog: &Catalog, samples: u32) -> f64 {
    let size = catalog.picture.size;
    f64::from(size[0] * size[1]) * (f64::from(samples) * PATH_WORK + FILTER_WORK)
}

fn still_work(catalog: &Catalog) -> f64 {
    work(catalog, catalog.picture.still_samples)
}

fn clip_work(catalog: &Catalog) -> f64 {
    let m = &catalog.motion;
    // Rest, warming up and the search for a loop take about as long again as a hundred frames.
    f64::from(m.frames + m.blend + 100) * f64::from(m.mesh[0] * m.mesh[1]) * CLOTH_WORK
}

fn video_work(catalog: &Catalog) -> f64 {
    f64::from(catalog.motion.frames)
        * f64::from(catalog.picture.size[0] * catalog.picture.size[1])
        * VIDEO_WORK
}
