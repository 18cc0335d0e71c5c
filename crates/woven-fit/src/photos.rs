//! First values for the sheet where there is no goniometer: one photo of reflected and one of transmitted light.
//!
//! A flat cloth, a camera above its middle and a small lamp at a known place: every pixel then has its own pair of
//! directions, so one photo of transmitted light is a scan around the straight-through direction (Tang et al. 2024, whose
//! geometry is the default). The scale is unknown, so factors are relative, and misfits are squared in logarithms. What such
//! photos cannot tell is listed by [`PhotoFit::cannot_tell`].

use crate::fit::{ModelFit, Options};
use crate::measurement::{Node, Point, Points};
use crate::problem::{Metric, Spec};
use crate::search::fit_spec;
use anyhow::{Context, Result, bail};
use std::collections::BTreeMap;
use std::path::Path;
use woven_bsdf::angles::{degrees, radians};
use woven_bsdf::fabric::{Fabric, OpticsTable};
use woven_bsdf::model;
use woven_bsdf::vec3::Vec3;

/// Where camera and lamps stand, in any one unit of length; the cloth lies in z = 0 with its middle at the origin, x to the
/// right of the photo along the weft, y up along the warp.
#[derive(Clone, Copy, Debug)]
pub struct Setup {
    /// Height of the camera above the middle.
    pub camera: f64,
    /// Width of cloth that the photo shows.
    pub width: f64,
    /// The lamp of the reflection photo, in front (z > 0).
    pub light_r: [f64; 3],
    /// The lamp of the transmission photo, behind (z < 0).
    pub light_t: [f64; 3],
    /// Exponent from pixel values to light.
    pub gamma: f64,
    /// Standard deviation of the vignette in pixels, 0 for none.
    pub vignette_px: f64,
    /// Side of the square cells over which pixels are averaged.
    pub cell_px: u32,
    /// Angle around straight through that is left out, degrees: light of the pores, blurred by the lens, is no lobe.
    pub skip_deg: f64,
}

impl Default for Setup {
    fn default() -> Self {
        Self {
            camera: 8.0,
            width: 2.0 * 8.0 * radians(26.5).tan(),
            light_r: [0.0, 8.0, 8.0],
            light_t: [0.0, 0.0, -9.0],
            gamma: 2.2,
            vignette_px: 0.0,
            cell_px: 16,
            skip_deg: 6.0,
        }
    }
}

/// The pixels of a photo.
#[derive(Clone, Debug)]
pub struct Photo {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Red, green and blue as stored, 0 to 1, rows from the top.
    pub pixels: Vec<[f32; 3]>,
}

impl Photo {
    /// Reads a PNG or JPEG file.
    ///
    /// # Errors
    /// A sentence that names the file.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes =
            std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
        Self::parse(&bytes).with_context(|| format!("cannot use {}", path.display()))
    }

    /// Reads the bytes of a PNG or JPEG file.
    ///
    /// # Errors
    /// A sentence when they are no picture, or one of more than 8192 pixels a side.
    pub fn parse(bytes: &[u8]) -> Result<Self> {
        let mut reader =
            image::ImageReader::new(std::io::Cursor::new(bytes)).with_guessed_format()?;
        let mut limits = image::Limits::default();
        (limits.max_image_width, limits.max_image_height) = (Some(8192), Some(8192));
        reader.limits(limits);
        let picture = reader
            .decode()
            .context("this is no whole PNG or JPEG picture of at most 8192 pixels a side")?
            .into_rgb32f();
        Ok(Self {
            width: picture.width(),
            height: picture.height(),
            pixels: picture.pixels().map(|p| p.0).collect(),
        })
    }

    /// Relative BSDF values of the cells with their directions; burnt-out and black pixels are left out.
    pub fn points(&self, setup: &Setup, transmits: bool) -> Points {
        let mut out = Points::default();
        let lamp = if transmits {
            setup.light_t
        } else {
            setup.light_r
        };
        let (w, h, cell) = (self.width, self.height, setup.cell_px.max(1));
        let scale = setup.width / f64::from(w.max(1));
        let middle = |n: u32| f64::from(n) / 2.0;
        for (row, column) in (0..h / cell).flat_map(|r| (0..w / cell).map(move |c| (r, c))) {
            let x = (f64::from(column * cell) + middle(cell) - middle(w)) * scale;
            let y = (middle(h) - f64::from(row * cell) - middle(cell)) * scale;
            let to_lamp = Vec3::new(lamp[0] - x, lamp[1] - y, lamp[2]);
            let (l, v) = (
                to_lamp.normalize(),
                Vec3::new(-x, -y, setup.camera).normalize(),
            );
            let away = degrees((-l).dot(v).clamp(-1.0, 1.0).acos());
            if l.z.abs() < 0.02 || (transmits && away < setup.skip_deg) {
                continue;
            }
            let inside = (0..cell).flat_map(|j| (0..cell).map(move |i| (i, j)));
            let lights: Vec<f64> = inside
                .filter_map(|(i, j)| self.light(setup, column * cell + i, row * cell + j))
                .collect();
            if 2 * lights.len() < (cell * cell) as usize {
                continue;
            }
            // Light that a lamp of one unit gives at distance d under the angle θ: cosθ / d².
            let lit = l.z.abs() / to_lamp.length_sqr();
            let f = lights.iter().sum::<f64>() / lights.len() as f64 / lit;
            out.nodes.push(Node { l, v, weight: 1.0 });
            out.points.push(Point {
                l,
                v,
                f,
                sigma: None,
                own: 1.0,
                area: 0.0,
                share: 1.0,
                incidence: 0,
                transmits,
                gap_density: 0.0,
                direct_only: false,
                nodes: (out.nodes.len() - 1, out.nodes.len()),
            });
        }
        out.incidences
            .push(Vec3::new(lamp[0], lamp[1], lamp[2]).normalize());
        // A greatest value of 1 keeps relative factors within the usual ranges.
        let top = out.points.iter().map(|p| p.f).fold(0.0, f64::max);
        if top > 0.0 {
            out.points.iter_mut().for_each(|p| p.f /= top);
        }
        out
    }

    /// Luminance (Rec. 709) of a pixel in linear light; none if burnt out or black.
    fn light(&self, setup: &Setup, i: u32, j: u32) -> Option<f64> {
        let rgb = self.pixels[(j * self.width + i) as usize];
        let (x, y) = (
            f64::from(i) + 0.5 - 0.5 * f64::from(self.width),
            f64::from(j) + 0.5 - 0.5 * f64::from(self.height),
        );
        let shade = if setup.vignette_px > 0.0 {
            (-(x * x + y * y) / (2.0 * setup.vignette_px.powi(2))).exp()
        } else {
            1.0
        };
        let linear = rgb.map(|c| (f64::from(c) / shade).powf(setup.gamma));
        let sum = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
        (rgb.iter().all(|c| *c < 0.995) && sum > 0.0 && sum.is_finite()).then_some(sum)
    }
}

/// The reflectance of a common fibre's surface, which the fits hold.
const USUAL_F0: f64 = 0.04;

/// Cosine-weighted mean of Schlick's reflectance.
fn mean_schlick(f0: f64) -> f64 {
    f0 + (1.0 - f0) / 21.0
}

/// What two photos say of a sheet.
#[derive(Clone, Debug)]
pub struct PhotoFit {
    /// The fit of the transmission photo: t_d and k_t in one relative scale, widths of the forward lobe.
    pub transmission: ModelFit,
    /// The fit of the reflection photo: r_d and k_r in another relative scale, widths of the reflected lobe.
    pub reflection: ModelFit,
    /// Greatest angle from straight through that the transmission photo shows, degrees.
    pub reach_deg: f64,
}

/// Fits `sheet` to both photos.
///
/// # Errors
/// A sentence when a photo leaves too little to fit, or when a lamp is on the wrong side.
pub fn fit(
    reflection: &Photo,
    transmission: &Photo,
    setup: &Setup,
    options: &Options,
) -> Result<PhotoFit> {
    if setup.light_r[2] <= 0.0 || setup.light_t[2] >= 0.0 {
        bail!(
            "the lamp of the reflection photo must stand in front (z > 0), that of the transmission photo behind (z < 0)"
        );
    }
    let options = Options {
        metric: Metric::Log,
        ..options.clone()
    };
    let sheet = model::find("sheet").context("the sheet is in the list of models")?;
    let enough = |points: &Points, which: &str| {
        if points.points.len() < 50 {
            bail!(
                "the {which} photo leaves {} cells that are neither black nor burnt out; 50 are needed: choose smaller cells or another photo",
                points.points.len()
            );
        }
        Ok(())
    };
    let through = transmission.points(setup, true);
    enough(&through, "transmission")?;
    let back = reflection.points(setup, false);
    enough(&back, "reflection")?;
    let transmission = fit_spec(
        &Spec::transmission(sheet, true, false),
        &through,
        &through,
        &options,
    )?;
    let spec = Spec::reflection(sheet, &transmission.values);
    let reflection = fit_spec(&spec, &back, &back, &options)?;
    let away = |p: &Point| degrees((-p.l).dot(p.v).clamp(-1.0, 1.0).acos());
    Ok(PhotoFit {
        transmission,
        reflection,
        reach_deg: through.points.iter().map(away).fold(0.0, f64::max),
    })
}

impl PhotoFit {
    /// A fitted value by its parameter's name.
    pub fn value(&self, name: &str) -> f64 {
        let both = self.transmission.parameters.iter();
        let mut both = both.chain(&self.reflection.parameters);
        both.find(|p| p.name == name).map_or(0.0, |p| p.value)
    }

    /// Relative light that comes back evenly and from the lobe, whose reflectance counts with its mean.
    pub fn reflected_light(&self) -> (f64, f64) {
        let lobe = self.value("k_r") * mean_schlick(USUAL_F0);
        (self.value("r_d"), lobe)
    }

    /// What a pair of photos cannot tell, in sentences.
    pub fn cannot_tell(&self) -> Vec<String> {
        let mut list = vec![
            "The scale: how much light passes and how much comes back was not measured; only t_d against k_t and r_d against k_r are known.".to_owned(),
            "The gap: light through the pores falls into few pixels, blurred by the lens; openness and the yarns' section come from the weave, if known.".to_owned(),
            "Slanted light: there is one place of the lamp a photo, so how the cloth changes with the angle of incidence is the model's guess.".to_owned(),
            format!(
                "Beyond {:.0}° from straight through nothing was seen.",
                self.reach_deg
            ),
            "f0 apart from k_r: away from grazing angles only their product counts; the fit holds f0 at 0.04, a common fibre's.".to_owned(),
        ];
        for (fit, what) in [
            (&self.transmission, "transmission"),
            (&self.reflection, "reflection"),
        ] {
            for p in fit.parameters.iter().filter(|p| !p.remark.is_empty()) {
                list.push(format!("In {what}, {}: {}.", p.name, p.remark));
            }
        }
        list
    }

    /// A fabric file, with the shares of light that pass and come back as assumed by the caller.
    pub fn fabric(&self, name: &str, transmitted: f64, reflected: f64, command: &str) -> Fabric {
        let sheet = model::find("sheet").expect("in the list");
        let through = self.value("t_d") + self.value("k_t");
        let (r_d, lobe) = self.reflected_light();
        let share = reflected / (r_d + lobe).max(f64::MIN_POSITIVE);
        let (r_d, lobe) = (r_d * share, lobe * share);
        // The yarn's factors sum to 1 at most. A photo sees k_r and f0 as a product, so where the lobe needs more than what
        // is left, f0 rises instead.
        let left = (1.0 - transmitted - r_d).max(f64::MIN_POSITIVE);
        let f0 = ((lobe / left - 1.0 / 21.0) * 21.0 / 20.0).clamp(USUAL_F0, 1.0);
        let k_r = (lobe / mean_schlick(f0)).min(left * (1.0 - 1e-12));
        let mut parameters: BTreeMap<String, f64> = BTreeMap::new();
        for (p, &value) in sheet.params.iter().zip(&self.reflection.values) {
            let value = match p.name {
                "t_d" | "k_t" => value * transmitted / through.max(f64::MIN_POSITIVE),
                "r_d" => r_d,
                "k_r" => k_r,
                "f0" => f0,
                _ => value,
            };
            parameters.insert(p.name.to_owned(), value.clamp(p.min, p.max));
        }
        let remark = format!(
            "from photographs: the shares {transmitted} transmitted and {reflected} reflected were assumed, and the gap was taken as closed"
        );
        Fabric {
            name: name.to_owned(),
            maker: String::new(),
            weave: None,
            optics: OpticsTable {
                model: sheet.name.to_owned(),
                parameters,
                colors: BTreeMap::new(),
            },
            mechanics: BTreeMap::new(),
            provenance: BTreeMap::from([
                ("command".to_owned(), command.to_owned()),
                ("remark".to_owned(), remark),
            ]),
        }
    }
}
