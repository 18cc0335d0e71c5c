//! A fabric's map of openness: what the renderer covers the curtain with, and the picture that is saved beside the fabric.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use woven_bsdf::fabric::Fabric;
use woven_render::atomic::write_atomically;
use woven_render::scene::fabric::wear;
use woven_render::scene::{Material, Texture, TextureUse};

/// The map of openness of a fabric that was opened.
#[derive(Clone, Debug)]
pub struct Pattern {
    texture: Texture,
    cover: TextureUse,
    multiplies: bool,
    file: PathBuf,
}

impl Pattern {
    /// The map that `fabric` names, from `folder`; `None` when it names none.
    ///
    /// # Errors
    /// A sentence when it cannot be read, or the fabric is one that cannot be rendered.
    pub(super) fn of(fabric: &Fabric, folder: &Path) -> Result<Option<Self>> {
        let weave = fabric.weave.as_ref();
        let Some(weave) = weave.filter(|w| !w.openness_map.is_empty()) else {
            return Ok(None);
        };
        let (mut material, mut textures) = (Material::matt("", [0.0; 3]), Vec::new());
        wear(&mut material, fabric, folder, &mut textures)?;
        let pattern = material.coverage_texture.zip(textures.pop());
        Ok(pattern.map(|(cover, texture)| Self {
            texture,
            cover,
            multiplies: material.multiplies,
            file: folder.join(&weave.openness_map),
        }))
    }

    /// Covers `material` with the map, the only texture beside it.
    #[must_use]
    pub fn cover(&self, material: Material) -> (Material, &Texture) {
        let covered = Material {
            coverage_texture: Some(self.cover),
            multiplies: self.multiplies,
            ..material
        };
        (covered, &self.texture)
    }

    /// Puts the map into another folder, where a fabric file that names it was saved.
    ///
    /// # Errors
    /// A sentence when it cannot be read, or another file of its name lies there.
    pub fn copy_to(&self, folder: &Path) -> Result<()> {
        let (from, to) = (&self.file, folder.join(&self.texture.name));
        let bytes = std::fs::read(from)
            .with_context(|| format!("cannot read the openness map {}", from.display()))?;
        match std::fs::read(&to) {
            Ok(there) if there == bytes => Ok(()),
            Ok(_) => anyhow::bail!(
                "{} is another picture than the openness map {}; move it away, or save the fabric in a folder of its own",
                to.display(),
                from.display()
            ),
            Err(_) => write_atomically(&to, |out| {
                use std::io::Write;
                Ok(out.write_all(&bytes)?)
            }),
        }
    }
}
