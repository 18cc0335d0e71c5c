//! The fabric file: what one cloth is, in a text that a person can open.
//!
//! ```
//! use woven_bsdf::fabric::Fabric;
//! let lace = Fabric::from_toml(r#"
//!     name = "lace"
//!     [optics]
//!     model = "sheet"
//!     parameters = { t_d = 0.3, k_t = 0.1, r_d = 0.5, gamma_warp = 0.5, gamma_weft = 0.5, alpha_x = 0.2, alpha_y = 0.1 }
//!     [optics.colors]
//!     r_d = [1.0, 0.95, 0.9]
//! "#).unwrap();
//! let optics = lace.optics().unwrap();
//! assert_eq!(optics.model.name, "sheet");
//! assert_eq!(optics.linear[0], [0.3; 3]);
//! ```

use crate::measured::Refused;
use crate::model::{self, MAX_LINEAR, ModelInfo, Role, Shape};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// The factors of the sheet that send light back.
const REFLECTED: [&str; 3] = ["r_d", "k_r", "sheen"];
/// The name under which a file gives the yarn's optical depth.
const TAU: &str = "tau";
/// What the name of a colour ends in that belongs to the side away from +z.
const BACK: &str = "_back";

/// A fabric file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fabric {
    /// What people call it.
    pub name: String,
    /// Who makes it.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub maker: String,
    /// Yarns and their spacing, where known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weave: Option<WeaveTable>,
    /// How it scatters and passes light.
    pub optics: OpticsTable,
    /// Named numbers of its mechanics, in SI units, read by the cloth simulation (`areal_density_kg_m2`, ...).
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub mechanics: BTreeMap<String, f64>,
    /// Where the numbers come from: files, hashes, commands.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub provenance: BTreeMap<String, String>,
}

/// `[weave]`: lengths in millimetres.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WeaveTable {
    /// Warp yarn diameter, mm.
    pub warp_diameter_mm: f64,
    /// Distance of warp yarns, mm.
    pub warp_pitch_mm: f64,
    /// Weft yarn diameter, mm.
    pub weft_diameter_mm: f64,
    /// Distance of weft yarns, mm.
    pub weft_pitch_mm: f64,
    /// "plain", "twill 2/2", … or the name of a draft.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub pattern: String,
    /// A picture (PNG) beside the fabric file, of one repeat of a lace or a jacquard: white where it is open.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub openness_map: String,
    /// How often the map repeats over a unit of the mesh's texture coordinates, along the weft and along the warp; 0: once.
    #[serde(default, skip_serializing_if = "is_default")]
    pub map_repeats: [f64; 2],
    /// What the map says: holes in the sheet, whose own weave goes on between them (a lace); or, if true, the share of
    /// the ground that is woven openly, the rest being closed (a jacquard): gap = map × openness of the weave.
    #[serde(default, skip_serializing_if = "is_default")]
    pub map_multiplies: bool,
}

fn is_default<T: Default + PartialEq>(x: &T) -> bool {
    *x == T::default()
}

/// `[optics]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OpticsTable {
    /// The model's name; see `woven-fit models`.
    pub model: String,
    /// Its parameters; those left out have the model's start values (linear factors: 0).
    #[serde(default)]
    pub parameters: BTreeMap<String, f64>,
    /// Linear Rec. 709 colours that multiply linear factors. A reflection factor of the sheet may have a second one for
    /// the side away from +z, under its name and `_back`: `r_d_back = [...]`. Transmission has none: light takes the same
    /// way from both sides. In a file, `tau = [...]` is the yarn's optical depth for each channel; see
    /// [`Fabric::from_toml`].
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub colors: BTreeMap<String, [f64; 3]>,
}

/// The optics ready for use.
#[derive(Clone, Debug)]
pub struct Optics {
    /// The model.
    pub model: &'static ModelInfo,
    /// Coloured linear factors, in the model's order.
    pub linear: [[f64; 3]; MAX_LINEAR],
    /// The prepared shape.
    pub shape: Shape<f64>,
}

impl Fabric {
    /// Reads a file.
    ///
    /// # Errors
    /// A sentence that names the file and the place.
    pub fn read(path: &Path) -> Result<Self, Refused> {
        let text = crate::measured::read_text(path)?;
        Self::from_toml(&text).map_err(|e| Refused::new(format!("{}: {e}", path.display())))
    }

    /// Reads the text of a file and checks that its optics are sound.
    ///
    /// The optical depth of the yarn for each channel, `tau` of `[optics.colors]`, is the paper's e^-τ: what it leaves of
    /// the light becomes part of the colours of all transmitted factors here, and the provenance keeps τ. The gap has no
    /// colour, and what is reflected has its own.
    ///
    /// # Errors
    /// A sentence that names the field.
    pub fn from_toml(text: &str) -> Result<Self, Refused> {
        let mut fabric: Fabric =
            toml::from_str(text).map_err(|e| Refused::new(format!("not a fabric file: {e}")))?;
        if let Some(tau) = fabric.optics.colors.remove(TAU) {
            fabric.absorb(tau)?;
        }
        fabric.optics()?;
        Ok(fabric)
    }

    /// Multiplies the colours of all transmitted factors by e^-τ.
    fn absorb(&mut self, tau: [f64; 3]) -> Result<(), Refused> {
        if tau.iter().any(|t| !(0.0..=1e3).contains(t)) {
            return Err(Refused::new(format!(
                "the optical depth {TAU} is {tau:?}; each channel must be 0 or more"
            )));
        }
        let model = model::find(&self.optics.model);
        let linear = model.into_iter().flat_map(|m| m.linear());
        for p in linear.filter(|p| !REFLECTED.contains(&p.name)) {
            let color = self.optics.colors.entry(p.name.to_owned());
            let color = color.or_insert([1.0; 3]);
            color
                .iter_mut()
                .zip(tau)
                .for_each(|(c, t)| *c *= (-t).exp());
        }
        self.provenance
            .insert(TAU.to_owned(), format!("{tau:?}, part of the colours"));
        Ok(())
    }

    /// The text of the file.
    pub fn to_toml(&self) -> String {
        toml::to_string_pretty(self).expect("names and numbers always print")
    }

    /// The optics with parameters checked, coloured and prepared, for light and viewer on the face.
    ///
    /// # Errors
    /// A sentence when the model or a parameter is unknown or out of its range.
    pub fn optics(&self) -> Result<Optics, Refused> {
        // Both sides must be sound when a file is read.
        self.side(BACK)?;
        self.side("")
    }

    /// [`Fabric::optics`] of the other side: reflection has the colours with `_back` where there are any.
    ///
    /// # Errors
    /// As [`Fabric::optics`].
    pub fn optics_back(&self) -> Result<Optics, Refused> {
        self.side(BACK)
    }

    fn side(&self, suffix: &str) -> Result<Optics, Refused> {
        let table = &self.optics;
        let model = model::find(&table.model).ok_or_else(|| {
            let names: Vec<_> = model::MODELS.iter().map(|m| m.name).collect();
            Refused::new(format!(
                "[optics] model = {:?} is unknown; there are {}",
                table.model,
                names.join(", ")
            ))
        })?;
        let color_of = |key: &String| match key.strip_suffix(BACK) {
            Some(name) if REFLECTED.contains(&name) => name.to_owned(),
            _ => key.clone(),
        };
        let colored = table.colors.keys().map(color_of);
        for name in &table
            .parameters
            .keys()
            .cloned()
            .chain(colored)
            .collect::<Vec<_>>()
        {
            if !model.params.iter().any(|p| p.name == *name) {
                let names: Vec<_> = model.params.iter().map(|p| p.name).collect();
                return Err(Refused::new(format!(
                    "{} has no parameter {name:?}; it has {}",
                    model.name,
                    names.join(", ")
                )));
            }
        }
        let mut linear = [[0.0; 3]; MAX_LINEAR];
        let mut shape = Vec::new();
        let mut k = 0;
        for p in model.params {
            let default = if p.role == Role::Linear {
                0.0
            } else {
                self.weave_gamma(p.name).unwrap_or(p.start)
            };
            let x = table.parameters.get(p.name).copied().unwrap_or(default);
            if !(p.min..=p.max).contains(&x) {
                return Err(Refused::new(format!(
                    "{} = {x} lies outside {}…{}",
                    p.name, p.min, p.max
                )));
            }
            if p.role == Role::Shape {
                shape.push(x);
                continue;
            }
            let own = table.colors.get(&format!("{}{suffix}", p.name));
            let color = own
                .or(table.colors.get(p.name))
                .copied()
                .unwrap_or([1.0; 3]);
            if color.iter().any(|c| !(0.0..=1e3).contains(c)) {
                return Err(Refused::new(format!(
                    "the colour of {} is {color:?}; each channel must be 0 or more",
                    p.name
                )));
            }
            linear[k] = color.map(|c| c * x);
            k += 1;
        }
        if model.name == "sheet" {
            for c in 0..3 {
                let sum: f64 = linear.iter().map(|k| k[c]).sum();
                // The yarn cannot give more than it gets; the slack is for decimals in files.
                if sum > 1.0 + 1e-6 {
                    return Err(Refused::new(format!(
                        "t_d + k_t + r_d + k_r + sheen = {sum:.4} in channel {c}: more than the light it gets"
                    )));
                }
            }
        }
        Ok(Optics {
            model,
            linear,
            shape: model.prepare(&shape),
        })
    }

    fn weave_gamma(&self, parameter: &str) -> Option<f64> {
        let w = self.weave.as_ref()?;
        match parameter {
            "gamma_warp" => Some((w.warp_diameter_mm / w.warp_pitch_mm).clamp(0.0, 1.0)),
            "gamma_weft" => Some((w.weft_diameter_mm / w.weft_pitch_mm).clamp(0.0, 1.0)),
            _ => None,
        }
    }
}
