//! What a curtain's description may say: every value has its limits, and a refusal names the field.

use super::CurtainSpec;
use crate::error::{Error, Result};

impl CurtainSpec {
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
        range("rail_depth", self.rail_depth, -20.0, 20.0, "m")?;
        range("pleats", f64::from(self.pleats), 1.0, 200.0, "")?;
        range("irregularity", self.irregularity, 0.0, 1.0, "")?;
        range("heat_set", self.heat_set, 0.0, 1.0, "")?;
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
        match self.second() {
            Some(second) => second.validate().map_err(|e| match e {
                Error::Spec { field, message } => Error::spec(format!("second.{field}"), message),
                other => other,
            }),
            None => Ok(()),
        }
    }
}
