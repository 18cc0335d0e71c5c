//! The description of a catalog: which fabrics from which measurements, how they hang and move, how the pictures are taken.

mod source;

use std::path::Path;

use anyhow::{Context as _, Result, ensure};
use serde::{Deserialize, Serialize};

use crate::stage::Preset;
use crate::video;
pub use source::Source;

/// A catalog, as written in its `.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Catalog {
    /// Heading of the page.
    pub title: String,
    /// A sentence or two under it.
    #[serde(default)]
    pub lead: String,
    /// The lights in which each fabric is shown.
    #[serde(default = "day_and_evening")]
    pub lights: Vec<Preset>,
    /// The fabrics in the order of the page.
    #[serde(rename = "fabric")]
    pub fabrics: Vec<FabricSpec>,
    /// How the measurements are fitted.
    #[serde(default)]
    pub fit: Fit,
    /// How the curtains move.
    #[serde(default)]
    pub motion: Motion,
    /// How the pictures are taken.
    #[serde(default)]
    pub picture: Picture,
}

fn day_and_evening() -> Vec<Preset> {
    Preset::CATALOG.to_vec()
}

/// One fabric.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FabricSpec {
    /// Name in files and anchors: lower-case letters, digits, hyphens.
    pub id: String,
    /// Name on the page.
    pub name: String,
    /// Who weaves it.
    #[serde(default)]
    pub maker: String,
    /// A sentence about it.
    #[serde(default)]
    pub lead: String,
    /// The measurement, which will be fitted: a file beside the catalog, or `builtin:NAME` for one that this program carries.
    #[serde(default)]
    pub measurement: String,
    /// Instead of a measurement, a fabric file beside the catalog: from `woven-fit fit`, from a maker's numbers, or written by hand. Its
    /// map of openness and the colours of its other side are rendered with it.
    #[serde(default)]
    pub fabric_file: String,
    /// Where the measurement comes from.
    #[serde(default)]
    pub source: String,
    /// The licence of the measurement.
    #[serde(default)]
    pub licence: String,
    /// Mechanics: a name from the table of `woven-cloth` ("voile", "satin", "drape", ...).
    #[serde(default = "drape")]
    pub mechanics: String,
    /// Weight [g/m²], if it is not the table's.
    #[serde(default)]
    pub grams: Option<f64>,
    /// Hue and saturation as linear Rec.709 factors of luminance 1, where the measurement has one band only; the level is always the measured one.
    #[serde(default)]
    pub tint: Option<[f64; 3]>,
}

fn drape() -> String {
    "drape".to_owned()
}

/// How the measurements are fitted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Fit {
    /// The models that are ranked; the sheet, which is rendered, is always among them. See `woven-fit models`.
    pub models: Vec<String>,
    /// Starts of the solver for each model.
    pub starts: usize,
    /// Chooses the starts.
    pub seed: u64,
}

impl Default for Fit {
    fn default() -> Self {
        Self {
            models: ["sheet", "ggx-mirrored", "ward", "lambert"]
                .map(str::to_owned)
                .to_vec(),
            starts: 8,
            seed: 1,
        }
    }
}

/// How the curtains move.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Motion {
    /// Frames of a video.
    pub frames: u32,
    /// Frames per second.
    pub fps: u32,
    /// Frames over which the end of the motion is led back to its beginning, so that the video loops; 0 leaves a jump.
    pub blend: u32,
    /// Mean speed of the air that comes in through the window [m/s].
    pub wind: f64,
    /// Strength of the gusts: standard deviation over mean.
    pub gusts: f64,
    /// Chooses the gusts.
    pub seed: u64,
    /// Columns and rows of the cloth's mesh.
    pub mesh: [u32; 2],
}

impl Default for Motion {
    fn default() -> Self {
        Self {
            frames: 48,
            fps: 24,
            blend: 16,
            wind: 1.6,
            gusts: 0.5,
            seed: 7,
            mesh: [96, 60],
        }
    }
}

/// How the pictures are taken.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Picture {
    /// Width and height of a frame [pixels].
    pub size: [u32; 2],
    /// Paths a pixel in a frame of a video.
    pub samples: u32,
    /// Paths a pixel in a still.
    pub still_samples: u32,
    /// Bounces of a path.
    pub depth: u32,
    /// Seed of the paths.
    pub seed: u64,
    /// Filters the noise that is left.
    pub denoise: bool,
}

impl Default for Picture {
    fn default() -> Self {
        Self {
            size: [480, 360],
            samples: 6,
            still_samples: 48,
            depth: 4,
            seed: 1,
            denoise: true,
        }
    }
}

impl Picture {
    /// Paths a pixel of the light desk's pictures.
    #[must_use]
    pub fn desk_samples(&self) -> u32 {
        self.still_samples.div_ceil(2)
    }
}

/// The catalog that this program carries.
pub const BUILTIN: &str = include_str!("../../../assets/catalog.toml");

impl Catalog {
    /// The built-in catalog.
    ///
    /// # Errors
    /// Never for a program that passes its tests.
    pub fn builtin() -> Result<Self> {
        Self::parse(BUILTIN).context("The built-in catalog is broken")
    }

    /// Reads a catalog from a file.
    ///
    /// # Errors
    /// A sentence that names the file and the place in it.
    pub fn load(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path)
            .with_context(|| format!("The catalog {} cannot be read", path.display()))?;
        Self::parse(&text).with_context(|| format!("The catalog {} cannot be used", path.display()))
    }

    /// Reads a catalog from its text.
    ///
    /// # Errors
    /// A sentence that names the line, or the value and what it may be.
    pub fn parse(text: &str) -> Result<Self> {
        let catalog: Self = toml::from_str(text)?;
        catalog.check()?;
        Ok(catalog)
    }

    /// Makes everything small and coarse, for a look within two minutes.
    pub fn quicken(&mut self) {
        self.fit = Fit {
            models: vec!["sheet".to_owned(), "lambert".to_owned()],
            starts: self.fit.starts.min(3),
            seed: self.fit.seed,
        };
        self.motion = Motion {
            frames: self.motion.frames.min(24),
            blend: self.motion.blend.min(8),
            mesh: [72, 40],
            ..self.motion
        };
        self.picture = Picture {
            size: [240, 180],
            samples: 4,
            still_samples: 16,
            depth: self.picture.depth.min(4),
            ..self.picture
        };
    }

    /// Makes sure that every value can be worked with.
    ///
    /// # Errors
    /// A sentence that names the value and what it may be.
    pub fn check(&self) -> Result<()> {
        ensure!(
            !self.fabrics.is_empty(),
            "it has no [[fabric]]; there must be at least one"
        );
        ensure!(
            !self.lights.is_empty(),
            "`lights` is empty; it takes \"day\" and \"evening\""
        );
        for (i, light) in self.lights.iter().enumerate() {
            ensure!(
                *light != Preset::All && !self.lights[..i].contains(light),
                "`lights` takes \"day\" and \"evening\", each once"
            );
        }
        for (i, fabric) in self.fabrics.iter().enumerate() {
            let id = &fabric.id;
            let plain = !id.is_empty()
                && id.len() <= 60
                && id
                    .bytes()
                    .all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-');
            ensure!(
                plain && id != "work",
                "fabric id \"{id}\" is not usable in file names; use lower-case letters, digits and hyphens (and not \"work\")"
            );
            ensure!(
                !self.fabrics[..i].iter().any(|f| f.id == *id),
                "two fabrics have the id \"{id}\""
            );
            ensure!(
                fabric.grams.is_none_or(|g| (5.0..=2000.0).contains(&g)),
                "fabric \"{id}\": grams must lie between 5 and 2000"
            );
            ensure!(
                fabric.measurement.is_empty() != fabric.fabric_file.is_empty(),
                "fabric \"{id}\" must have either a `measurement`, which is fitted, or a `fabric_file`"
            );
            if let Some(tint) = fabric.tint {
                ensure!(
                    tint.iter()
                        .all(|t| t.is_finite() && (0.0..=4.0).contains(t)),
                    "fabric \"{id}\": tint must be three numbers from 0 to 4"
                );
            }
        }
        ensure!(
            (1..=1000).contains(&self.fit.starts),
            "fit.starts is {}; it must lie between 1 and 1000",
            self.fit.starts
        );
        woven_fit::fit::models_named(Some(&self.fit.models)).context("fit.models")?;
        let (m, p) = (&self.motion, &self.picture);
        ensure!(
            (1..=240).contains(&m.frames),
            "motion.frames is {}; it must lie between 1 and 240",
            m.frames
        );
        ensure!(
            (1..=120).contains(&m.fps),
            "motion.fps is {}; it must lie between 1 and 120",
            m.fps
        );
        ensure!(
            m.blend <= m.frames,
            "motion.blend is {}, more than the {} frames there are",
            m.blend,
            m.frames
        );
        ensure!(
            (0.0..=10.0).contains(&m.wind),
            "motion.wind is {} m/s; it must lie between 0 and 10",
            m.wind
        );
        ensure!(
            (0.0..=2.0).contains(&m.gusts),
            "motion.gusts is {}; it must lie between 0 and 2",
            m.gusts
        );
        ensure!(
            m.mesh.iter().all(|n| (8..=512).contains(n)),
            "motion.mesh must be two numbers from 8 to 512"
        );
        video::check_size(p.size[0], p.size[1])?;
        ensure!(
            (1..=65_536).contains(&p.samples) && (1..=65_536).contains(&p.still_samples),
            "picture.samples and still_samples must lie between 1 and 65536"
        );
        ensure!(
            (1..=64).contains(&p.depth),
            "picture.depth is {}; it must lie between 1 and 64",
            p.depth
        );
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SMALL: &str =
        "title = \"T\"\n[[fabric]]\nid = \"a\"\nname = \"A\"\nmeasurement = \"a.xml\"\n";

    fn complaint(text: &str) -> String {
        format!("{:#}", Catalog::parse(text).unwrap_err())
    }

    #[test]
    fn the_builtin_catalog_keeps_its_promise() {
        let catalog = Catalog::builtin().unwrap();
        assert_eq!(catalog.fabrics.len(), 2);
        assert_eq!(catalog.lights, Preset::CATALOG);
        assert!(catalog.motion.frames >= 48 && catalog.motion.frames >= 2 * catalog.motion.fps);
        assert!(catalog.picture.size[0] >= 480 && catalog.picture.size[1] >= 360);
        for fabric in &catalog.fabrics {
            assert!(fabric.source(Path::new("nowhere")).unwrap().bytes.len() > 10_000);
            assert!(!fabric.licence.is_empty() && !fabric.source.is_empty());
        }
    }

    #[test]
    fn mistakes_are_named() {
        assert!(Catalog::parse(SMALL).is_ok());
        assert!(complaint("title = ").contains("line 1"));
        assert!(complaint(&SMALL.replace("id = \"a\"", "id = \"../a\"")).contains("../a"));
        assert!(complaint(&format!("{SMALL}colour = 3\n")).contains("colour"));
        assert!(complaint(&format!("{SMALL}[picture]\nsize = [481, 360]\n")).contains("odd side"));
        assert!(complaint(&format!("{SMALL}[motion]\nframes = 0\n")).contains("motion.frames"));
        assert!(complaint(&format!("lights = [\"noon\"]\n{SMALL}")).contains("noon"));
        assert!(
            complaint(&format!(
                "{SMALL}[[fabric]]\nid = \"a\"\nname = \"B\"\nmeasurement = \"b.xml\"\n"
            ))
            .contains("two fabrics")
        );
        assert!(complaint("title = \"T\"\nfabric = []\n").contains("[[fabric]]"));
    }

    #[test]
    fn a_missing_measurement_is_named() {
        let mut fabric = Catalog::parse(SMALL).unwrap().fabrics.remove(0);
        assert!(
            format!("{:#}", fabric.source(Path::new("nowhere")).unwrap_err()).contains("a.xml")
        );
        fabric.measurement = "builtin:velvet.xml".to_owned();
        assert!(
            fabric
                .source(Path::new("nowhere"))
                .unwrap_err()
                .to_string()
                .contains("there are only")
        );
    }
}
