//! Stills, frames, the light desk's layers and videos of one fabric.

use anyhow::{Context as _, Result};
use image::RgbImage;

use super::shots::{Kind, Shot, frame_name, still_work, video_work};
use super::{Run, Subject};
use crate::anchor::Anchor;
use crate::picture::{Set, Shoot};
use crate::stage::{Preset, Stage};
use crate::store::Key;
use crate::{cloth, desk, video};

impl Run<'_> {
    /// What a picture is made from.
    pub(super) fn shot_key(&self, subject: &Subject, kind: Kind) -> Key {
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
    pub(super) fn still(&mut self, subject: &Subject, light: Preset) -> Result<Anchor> {
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
    pub(super) fn set_up(&self, subject: &Subject, light: Preset) -> Result<Set> {
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
    pub(super) fn take(
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
    pub(super) fn video(&mut self, subject: &Subject, light: Preset) -> Result<()> {
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
}
