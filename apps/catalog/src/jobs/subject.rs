//! What comes before the first picture of a fabric: its measurement, its fit and the motion of its curtain.

use std::path::PathBuf;

use anyhow::{Context as _, Result};
use woven_bsdf::fabric::Fabric;
use woven_cloth::{CurtainClip, CurtainSpec};

use super::Run;
use super::shots::{FIT_WORK, clip_work};
use crate::catalog::{FabricSpec, Source};
use crate::optics::Summary;
use crate::store::{Key, sha256};
use crate::{assets, cloth, optics};

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

impl Run<'_> {
    /// Measurement, fit and motion of one fabric, each taken from the folder if it is there.
    pub(super) fn subject(&mut self, index: usize) -> Result<Subject> {
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

    pub(super) fn clip(
        &mut self,
        spec: &FabricSpec,
        curtain: &CurtainSpec,
    ) -> Result<(CurtainClip, String)> {
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
}
