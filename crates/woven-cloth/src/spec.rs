//! The description of a curtain: what a person writes in `CURTAIN.toml`, its defaults and its limits.

mod limits;

use crate::contact::Obstacles;
use crate::draw::{DrawKey, Side};
use crate::error::{Error, Result};
use crate::fabrics::{Mechanics, fabric};
use crate::rail::{Heading, Pleats};
use crate::wind::{WindSpec, read_record};
use serde::{Deserialize, Serialize};

/// A curtain on a rail before a window. Lengths in m, times in s; y is up, the floor y = 0, the middle of the rail x = 0, the
/// curtain's plane z = 0 and the room at z > 0.
///
/// ```
/// let spec: woven_cloth::CurtainSpec = "width = 0.6\nheight = 0.8\npleats = 4\ncolumns = 33\nrows = 17".parse()?;
/// assert_eq!(spec.fabric_width(), 1.2);
/// # Ok::<(), woven_cloth::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CurtainSpec {
    /// Width of the rail that the curtain covers, m.
    pub width: f64,
    /// Height of the fabric from heading to hem, m.
    pub height: f64,
    /// Height of the rail above the floor, m; by default 2 cm more than the fabric.
    pub rail_height: Option<f64>,
    /// Place of the rail along z, m.
    pub rail_depth: f64,
    /// Width of the flat fabric over the width of the rail.
    pub fullness: f64,
    /// Number of pleats.
    pub pleats: u32,
    /// How it hangs: `wave`, `pinch`, `rings`, `eyelets` or `rod-pocket`.
    pub heading: Heading,
    /// How uneven the folds become towards the hem, 0 to 1.
    pub irregularity: f64,
    /// Share of the pleats' curvature that is set by heat, 0 to 1: how far the cloth is at ease in its folds.
    pub heat_set: f64,
    /// Vertices along the weft.
    pub columns: usize,
    /// Vertices along the warp.
    pub rows: usize,
    /// Name of a built-in fabric; replaces `[mechanics]`.
    pub fabric: Option<String>,
    /// The fabric's mechanics, when none is named.
    pub mechanics: Mechanics,
    /// Weight of the hem or lead band, kg per metre of fabric width.
    pub hem: f64,
    /// The wind.
    pub wind: WindSpec,
    /// Floor, wall and sill.
    pub obstacles: Obstacles,
    /// A hole in the obstacles' wall, `[left, right, bottom, top]` in m: the open window, through which the curtain may blow.
    pub window: Option<[f64; 4]>,
    /// Opening and closing: how far the curtain is drawn at which time. None leaves it closed.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub draw: Vec<DrawKey>,
    /// The side it is drawn to: `left`, `middle` or `right`.
    pub draw_to: Side,
    /// Contact of the folds with each other.
    pub self_contact: bool,
    /// Coulomb friction of cloth on cloth.
    pub friction: f64,
    /// Frames a second of the clip; does not change the motion.
    pub fps: f64,
    /// Number of frames.
    pub frames: usize,
    /// Seconds of wind before the first frame.
    pub warm_up: f64,
    /// Most seconds of still air in which the curtain comes to rest before that.
    pub settle: f64,
    /// Steps per 1/600 s; by default as many as the fabric and the grid need.
    pub substeps: Option<u32>,
    /// Seed of the wind and of the unevenness.
    pub seed: u64,
    /// A second curtain on a rail of its own, such as a lace behind a drape; the two touch each other as folds do.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub second: Option<SecondLayer>,
}

impl Default for CurtainSpec {
    fn default() -> Self {
        Self {
            width: 1.4,
            height: 2.2,
            rail_height: None,
            rail_depth: 0.0,
            fullness: 2.0,
            pleats: 12,
            heading: Heading::Wave,
            irregularity: 0.3,
            heat_set: 0.0,
            columns: 121,
            rows: 81,
            fabric: None,
            mechanics: Mechanics::default(),
            hem: 0.02,
            wind: WindSpec::default(),
            obstacles: Obstacles::default(),
            window: None,
            draw: Vec::new(),
            draw_to: Side::Middle,
            self_contact: true,
            friction: 0.3,
            fps: 24.0,
            frames: 96,
            warm_up: 2.0,
            settle: 4.0,
            substeps: None,
            seed: 1,
            second: None,
        }
    }
}

/// What a second curtain has of its own; all else is as with the first, its fabric included when none is named.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SecondLayer {
    /// Name of a built-in fabric.
    pub fabric: Option<String>,
    /// Place of its rail along z, m.
    pub rail_depth: f64,
    /// Height of the fabric, m; none means the first curtain's.
    pub height: Option<f64>,
    /// Width of the flat fabric over the width of the rail.
    pub fullness: f64,
    /// Number of pleats.
    pub pleats: u32,
    /// How it hangs.
    pub heading: Heading,
    /// Weight of the hem, kg per metre of fabric width.
    pub hem: f64,
    /// Opening and closing of this curtain alone.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub draw: Vec<DrawKey>,
}

impl Default for SecondLayer {
    fn default() -> Self {
        Self {
            fabric: None,
            rail_depth: -0.12,
            height: None,
            fullness: 2.0,
            pleats: 12,
            heading: Heading::Wave,
            hem: 0.02,
            draw: Vec::new(),
        }
    }
}

impl std::str::FromStr for CurtainSpec {
    type Err = Error;

    /// Reads TOML and checks every value.
    fn from_str(text: &str) -> Result<Self> {
        let spec = Self::parse(text)?;
        if spec.wind.recorded.is_some() && spec.wind.samples.is_empty() {
            return Err(Error::spec(
                "wind.recorded",
                "a text without a file has no folder to look for the record in; give `wind.samples`, or read the description from its file",
            ));
        }
        spec.validate()?;
        Ok(spec)
    }
}

impl CurtainSpec {
    /// Reads a curtain's `.toml`.
    ///
    /// # Errors
    /// When the file cannot be read, is not TOML, or a value is outside its limits.
    pub fn read(path: &std::path::Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, e))?;
        let mut spec = Self::parse(&text)?;
        if let Some(name) = &spec.wind.recorded {
            let folder = path.parent().unwrap_or(std::path::Path::new("."));
            spec.wind.samples = read_record(&folder.join(name))?;
        }
        spec.validate()?;
        Ok(spec)
    }

    fn parse(text: &str) -> Result<Self> {
        toml::from_str(text).map_err(|e| Error::Toml(e.to_string().trim_end().to_owned()))
    }

    /// The second curtain's description, if there is one.
    #[must_use]
    pub fn second(&self) -> Option<Self> {
        let own = self.second.clone()?;
        Some(Self {
            height: own.height.unwrap_or(self.height),
            rail_height: Some(self.rail_height()),
            rail_depth: own.rail_depth,
            fullness: own.fullness,
            pleats: own.pleats,
            heading: own.heading,
            hem: own.hem,
            fabric: own.fabric.or_else(|| self.fabric.clone()),
            draw: own.draw,
            seed: self.seed.wrapping_add(1),
            second: None,
            ..self.clone()
        })
    }

    /// The mechanics in force: the named fabric's or those given.
    ///
    /// # Errors
    /// When the named fabric is not built in.
    pub fn mechanics(&self) -> Result<Mechanics> {
        match &self.fabric {
            Some(name) => Ok(fabric(name)?.mechanics()),
            None => Ok(self.mechanics.clone()),
        }
    }

    /// Width of the flat fabric, m.
    #[must_use]
    pub fn fabric_width(&self) -> f64 {
        self.width * self.fullness
    }

    /// Height of the rail above the floor, m.
    #[must_use]
    pub fn rail_height(&self) -> f64 {
        self.rail_height.unwrap_or(self.height + 0.02)
    }

    /// The layout of the heading.
    #[must_use]
    pub fn layout(&self) -> Pleats {
        Pleats {
            width: self.width,
            fabric_width: self.fabric_width(),
            pleats: f64::from(self.pleats),
            heading: self.heading,
            irregularity: self.irregularity,
            seed: self.seed,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_valid_and_survives_a_round_trip() {
        let spec = CurtainSpec::default();
        spec.validate().unwrap();
        let text = toml::to_string(&spec).unwrap();
        assert_eq!(text.parse::<CurtainSpec>().unwrap(), spec);
    }

    #[test]
    fn nonsense_is_answered_with_the_name_of_the_field() {
        for (text, field) in [
            ("width = nan", "width"),
            ("width = 0.0", "width"),
            ("fullness = 50.0", "fullness"),
            (
                "[mechanics]\nareal_density = 0.0",
                "mechanics.areal_density",
            ),
            ("[mechanics]\ntensile_warp = 1e6", "mechanics.tensile_warp"),
            ("[wind]\nspeed = inf", "wind.speed"),
            ("[wind]\ndirection = [0.0, 0.0, 0.0]", "wind.direction"),
            ("fabric = \"tinfoil\"", "fabric"),
            ("pleats = 60", "columns"),
            ("fps = -3.0", "fps"),
            ("colour = \"red\"", "colour"),
            ("[second]\nfullness = 50.0", "second.fullness"),
        ] {
            let message = text.parse::<CurtainSpec>().unwrap_err().to_string();
            assert!(
                message.contains(field) && message.len() > 20,
                "{text}: {message}"
            );
        }
    }
}
