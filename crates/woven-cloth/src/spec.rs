//! The description of a curtain: what a person writes in `CURTAIN.toml`, its defaults and its limits.

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
    /// Width of the flat fabric over the width of the rail.
    pub fullness: f64,
    /// Number of pleats.
    pub pleats: u32,
    /// How it hangs: `wave`, `pinch`, `rings` or `eyelets`.
    pub heading: Heading,
    /// How uneven the folds become towards the hem, 0 to 1.
    pub irregularity: f64,
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
}

impl Default for CurtainSpec {
    fn default() -> Self {
        Self {
            width: 1.4,
            height: 2.2,
            rail_height: None,
            fullness: 2.0,
            pleats: 12,
            heading: Heading::Wave,
            irregularity: 0.3,
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

    /// Checks every value.
    ///
    /// # Errors
    /// Names the field, the value and the limits.
    pub fn validate(&self) -> Result<()> {
        let range = |field: &str, value: f64, least: f64, most: f64, unit: &str| {
            if value.is_finite() && (least..=most).contains(&value) {
                return Ok(());
            }
            let unit = if unit.is_empty() {
                String::new()
            } else {
                format!(" {unit}")
            };
            Err(Error::spec(
                field,
                format!("{value}{unit} is outside {least} to {most}{unit}"),
            ))
        };
        range("width", self.width, 0.05, 20.0, "m")?;
        range("height", self.height, 0.05, 20.0, "m")?;
        range("fullness", self.fullness, 1.0, 4.0, "")?;
        range("rail_height", self.rail_height(), 0.05, 30.0, "m")?;
        range("pleats", f64::from(self.pleats), 1.0, 200.0, "")?;
        range("irregularity", self.irregularity, 0.0, 1.0, "")?;
        range("columns", self.columns as f64, 3.0, 2049.0, "")?;
        range("rows", self.rows as f64, 3.0, 2049.0, "")?;
        range("hem", self.hem, 0.0, 2.0, "kg/m")?;
        range("friction", self.friction, 0.0, 2.0, "")?;
        range("fps", self.fps, 1.0, 600.0, "1/s")?;
        range("frames", self.frames as f64, 1.0, 1e6, "")?;
        range("warm_up", self.warm_up, 0.0, 600.0, "s")?;
        range("settle", self.settle, 0.0, 600.0, "s")?;
        if let Some(n) = self.substeps {
            range("substeps", f64::from(n), 1.0, 100.0, "")?;
        }
        for (k, key) in self.draw.iter().enumerate() {
            range("draw.time", key.time, 0.0, 1e5, "s")?;
            range("draw.share", key.share, 0.1, 1.0, "")?;
            if k > 0 && key.time <= self.draw[k - 1].time {
                return Err(Error::spec(
                    "draw.time",
                    format!("{} s does not come after the key before", key.time),
                ));
            }
        }
        if self.fullness > 1.0 {
            let per_pleat = (self.columns - 1) as f64 / f64::from(self.pleats);
            if per_pleat < 6.0 {
                return Err(Error::spec(
                    "columns",
                    format!(
                        "{} columns give {per_pleat:.1} to a pleat; at least 6 are needed, so ask for {} or fewer pleats",
                        self.columns,
                        self.pleats * 6 + 1
                    ),
                ));
            }
        }
        self.mechanics()?.validate()?;
        let w = &self.wind;
        range("wind.speed", w.speed, 0.0, 20.0, "m/s")?;
        range("wind.gust", w.gust, 0.0, 1.0, "")?;
        range("wind.gust_length", w.gust_length, 0.05, 500.0, "m")?;
        range("wind.turbulence", w.turbulence, 0.0, 1.0, "")?;
        range("wind.eddy_length", w.eddy_length, 0.05, 10.0, "m")?;
        range("wind.ramp", w.ramp, 0.0, 60.0, "s")?;
        range("wind.blocking", w.blocking, 0.0, 1.0, "")?;
        range("wind.tangential", w.tangential, 0.0, 1.0, "")?;
        let length = w.direction.iter().map(|c| c * c).sum::<f64>().sqrt();
        if !(length.is_finite() && length > 1e-6) {
            return Err(Error::spec(
                "wind.direction",
                "the direction has no length; write for example [0.0, 0.0, 1.0]",
            ));
        }
        for (k, s) in w.samples.iter().enumerate() {
            range("wind.samples", s[1], -20.0, 20.0, "m/s")?;
            if !s[0].is_finite() || (k > 0 && s[0] <= w.samples[k - 1][0]) {
                return Err(Error::spec(
                    "wind.samples",
                    format!("the time {} s does not come after the one before", s[0]),
                ));
            }
        }
        if let Some(o) = w.opening {
            for (field, [lo, hi]) in [("wind.opening.x", o.x), ("wind.opening.y", o.y)] {
                if !(lo.is_finite() && hi.is_finite() && lo < hi) {
                    return Err(Error::spec(
                        field,
                        format!(
                            "[{lo}, {hi}] is no interval; the first number must be the smaller"
                        ),
                    ));
                }
            }
            range("wind.opening.z", o.z, -20.0, 20.0, "m")?;
        }
        let o = &self.obstacles;
        range("obstacles.friction", o.friction, 0.0, 2.0, "")?;
        for (field, value) in [("obstacles.floor", o.floor), ("obstacles.wall", o.wall)] {
            if let Some(v) = value {
                range(field, v, -20.0, 20.0, "m")?;
            }
        }
        if let Some([left, right, bottom, top]) = self.window {
            for v in [left, right, bottom, top] {
                range("window", v, -20.0, 20.0, "m")?;
            }
            if left >= right || bottom >= top {
                return Err(Error::spec(
                    "window",
                    "[left, right, bottom, top] is no rectangle",
                ));
            }
        }
        if let Some([height, z]) = o.sill {
            range("obstacles.sill", height, -20.0, 20.0, "m")?;
            range("obstacles.sill", z, -20.0, 20.0, "m")?;
        }
        Ok(())
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
        ] {
            let message = text.parse::<CurtainSpec>().unwrap_err().to_string();
            assert!(
                message.contains(field) && message.len() > 20,
                "{text}: {message}"
            );
        }
    }
}
