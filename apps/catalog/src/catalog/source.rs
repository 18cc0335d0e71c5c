//! What a fabric of a catalog is made from: a measurement that will be fitted, or a fabric file.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, bail};
use woven_bsdf::fabric::Fabric;

use super::FabricSpec;
use crate::assets;

/// What a fabric is made from, as bytes with a name for people: a measurement or a fabric file.
#[derive(Clone, Debug)]
pub struct Source {
    /// The file's name without folders.
    pub file: String,
    /// Where it was read; the bare name for one that this program carries.
    pub path: PathBuf,
    /// Its contents.
    pub bytes: Vec<u8>,
    /// True for one that this program carries and may put beside the page.
    pub builtin: bool,
    /// The map of openness that a fabric file names, with its contents.
    pub map: Option<(String, Vec<u8>)>,
}

impl FabricSpec {
    /// The measurement or the fabric file; `folder` is where the catalog lies.
    ///
    /// # Errors
    /// A sentence that names the file.
    pub fn source(&self, folder: &Path) -> Result<Source> {
        if let Some(name) = self.measurement.strip_prefix("builtin:") {
            let Some(bytes) = assets::measurement(name) else {
                bail!(
                    "Fabric \"{}\" wants the built-in measurement \"{name}\", but there are only: {}.",
                    self.id,
                    assets::names().join(", ")
                );
            };
            return Ok(Source {
                file: name.to_owned(),
                path: PathBuf::from(name),
                bytes: bytes.to_vec(),
                builtin: true,
                map: None,
            });
        }
        let read = |path: &Path, what: &str| {
            std::fs::read(path).with_context(|| {
                format!(
                    "The {what} {} of fabric \"{}\" cannot be read",
                    path.display(),
                    self.id
                )
            })
        };
        let (what, name) = if self.fabric_file.is_empty() {
            ("measurement", &self.measurement)
        } else {
            ("fabric file", &self.fabric_file)
        };
        let path = folder.join(name);
        let bytes = read(&path, what)?;
        let map = if self.fabric_file.is_empty() {
            None
        } else {
            openness_map(&Fabric::read(&path)?)
                .map(|map| {
                    anyhow::Ok((
                        map.to_owned(),
                        read(&path.with_file_name(map), "openness map")?,
                    ))
                })
                .transpose()?
        };
        let file = path
            .file_name()
            .map_or_else(|| what.to_owned(), |n| n.to_string_lossy().into_owned());
        Ok(Source {
            file,
            path,
            bytes,
            builtin: false,
            map,
        })
    }
}

/// The name of the fabric's map of openness, if it has one.
fn openness_map(fabric: &Fabric) -> Option<&str> {
    let weave = fabric.weave.as_ref()?;
    Some(weave.openness_map.as_str()).filter(|name| !name.is_empty())
}
