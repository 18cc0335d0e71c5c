//! The cloth on the sliders: a model, its values and colours, and the way from and to a fabric file.

mod pattern;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use woven_bsdf::fabric::{Fabric, OpticsTable, WeaveTable};
use woven_bsdf::measured::Refused;
use woven_bsdf::model::{Linear, MAX_LINEAR, ModelInfo, Param, Role, Shape};
use woven_bsdf::sheet;
use woven_bsdf::vec3::Vec3;

use crate::nearest::{Woven, nearest};
pub use pattern::Pattern;

/// Luminance of linear Rec. 709.
#[must_use]
pub fn luminance(c: [f64; 3]) -> f64 {
    0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]
}

/// The cloth with which the window opens when there is no fabric file: a light linen, not measured.
const LINEN: &str = r#"
name = "light linen (not measured)"
[optics]
model = "sheet"
[optics.parameters]
t_d = 0.15
k_t = 0.06
r_d = 0.52
k_r = 0.02
gamma_warp = 0.92
gamma_weft = 0.88
section = 0.5
alpha_x = 0.25
alpha_y = 0.32
[optics.colors]
t_d = [1.0, 0.95, 0.86]
k_t = [1.0, 0.96, 0.89]
r_d = [1.0, 0.965, 0.905]
"#;

/// What the sliders stand at.
#[derive(Clone, Debug, PartialEq)]
struct Setting {
    model: &'static str,
    values: Vec<f64>,
    colors: Vec<[f64; 3]>,
}

/// A cloth being looked at and changed.
#[derive(Clone, Debug)]
pub struct Cloth {
    /// The fabric from which it came; optics excepted, it is saved as it was read.
    fabric: Fabric,
    /// The model whose sliders are shown.
    pub model: &'static ModelInfo,
    /// Values in the order of the model's parameters.
    pub values: Vec<f64>,
    /// Colours in the same order; those of shape parameters are not used.
    pub colors: Vec<[f64; 3]>,
    /// Diffuse reflection given to models that know transmission only.
    pub reflect: f64,
    /// The file's map of openness.
    pub pattern: Option<Arc<Pattern>>,
    opened: Option<Setting>,
}

impl Default for Cloth {
    fn default() -> Self {
        let linen = Fabric::from_toml(LINEN).and_then(Self::of);
        linen.unwrap_or_else(|_| {
            // Never reached: a test opens the linen.
            let model = &woven_bsdf::model::MODELS[0];
            Self {
                fabric: Fabric::default(),
                model,
                values: model.start(),
                colors: white(model),
                reflect: 0.4,
                pattern: None,
                opened: None,
            }
        })
    }
}

/// Under which name a fabric file has a parameter's colour on the other side.
fn back_of(p: &Param) -> String {
    format!("{}_back", p.name)
}

fn white(model: &ModelInfo) -> Vec<[f64; 3]> {
    vec![[1.0; 3]; model.params.len()]
}

impl Cloth {
    /// Reads a fabric file, and the map of openness beside it.
    ///
    /// # Errors
    /// A sentence with the file and the field.
    pub fn open(path: &Path) -> Result<Self, Refused> {
        let fabric = Fabric::read(path)?;
        let folder = path.parent().unwrap_or_else(|| Path::new(""));
        let pattern = Pattern::of(&fabric, folder).map_err(|e| Refused::new(format!("{e:#}")))?;
        let mut cloth = Self::of(fabric)?;
        cloth.pattern = pattern.map(Arc::new);
        Ok(cloth)
    }

    /// The cloth of a fabric.
    ///
    /// # Errors
    /// A sentence when its optics are not sound.
    pub fn of(fabric: Fabric) -> Result<Self, Refused> {
        let optics = fabric.optics()?;
        let model = optics.model;
        let mut shapes = optics.shape.iter();
        let table = &fabric.optics;
        let values: Vec<f64> = model
            .params
            .iter()
            .map(|p| match p.role {
                Role::Linear => table.parameters.get(p.name).copied().unwrap_or(0.0),
                Role::Shape => shapes.next().copied().unwrap_or(p.start),
            })
            .collect();
        let colors = model
            .params
            .iter()
            .map(|p| table.colors.get(p.name).copied().unwrap_or([1.0; 3]))
            .collect();
        let mut cloth = Self {
            fabric,
            model,
            values,
            colors,
            reflect: 0.4,
            pattern: None,
            opened: None,
        };
        cloth.opened = Some(cloth.setting());
        Ok(cloth)
    }

    fn setting(&self) -> Setting {
        Setting {
            model: self.model.name,
            values: self.values.clone(),
            colors: self.colors.clone(),
        }
    }

    /// What people call the cloth.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.fabric.name
    }

    /// The named numbers of its mechanics.
    #[must_use]
    pub fn mechanics(&self) -> &BTreeMap<String, f64> {
        &self.fabric.mechanics
    }

    /// Whether a slider stands elsewhere than in the file.
    #[must_use]
    pub fn changed(&self) -> bool {
        self.opened.as_ref().is_some_and(|o| *o != self.setting())
    }

    /// Takes another model, at the file's values where the file has it, else at the model's start.
    pub fn choose(&mut self, model: &'static ModelInfo) {
        self.model = model;
        self.reset();
    }

    /// Puts all sliders back to the file's values, or to the model's start.
    pub fn reset(&mut self) {
        match &self.opened {
            Some(o) if o.model == self.model.name => {
                (self.values, self.colors) = (o.values.clone(), o.colors.clone());
            }
            _ => (self.values, self.colors) = (self.model.start(), white(self.model)),
        }
    }

    /// The value to which a slider goes back.
    #[must_use]
    pub fn start_of(&self, index: usize) -> f64 {
        let opened = self.opened.as_ref().filter(|o| o.model == self.model.name);
        opened.map_or(self.model.params[index].start, |o| o.values[index])
    }

    /// The parameters with their places.
    pub fn params(&self, role: Role) -> impl Iterator<Item = (usize, &'static Param)> + use<> {
        self.model
            .params
            .iter()
            .enumerate()
            .filter(move |(_, p)| p.role == role)
    }

    /// The greatest sum of the sheet's factors over the channels: more than 1 would give more light than the yarn gets.
    #[must_use]
    pub fn given(&self) -> f64 {
        if self.model.name != "sheet" {
            return 0.0;
        }
        let sum = |c: usize, back: bool| {
            self.params(Role::Linear)
                .map(|(i, _)| self.values[i] * self.color(i, back)[c])
                .sum::<f64>()
        };
        let sums = (0..3).flat_map(|c| [sum(c, false), sum(c, true)]);
        sums.fold(0.0, f64::max)
    }

    /// The colour of a parameter on the front, or on the side away from +z, where the file may have one of its own.
    fn color(&self, index: usize, back: bool) -> [f64; 3] {
        let own = self.backs().find(|(i, _)| back && *i == index);
        own.map_or(self.colors[index], |(_, color)| color)
    }

    /// The parameters of which the file has a colour for the other side, with that colour; sliders do not change it.
    fn backs(&self) -> impl Iterator<Item = (usize, [f64; 3])> + '_ {
        let same = self.fabric.optics.model == self.model.name;
        self.params(Role::Linear)
            .filter(move |_| same)
            .filter_map(|(i, p)| {
                let colors = &self.fabric.optics.colors;
                colors.get(&back_of(p)).map(|color| (i, *color))
            })
    }

    /// By what the factors are multiplied so that the yarn gives no more than it gets.
    fn share(&self) -> f64 {
        1.0 / self.given().max(1.0)
    }

    /// The coloured linear factors of a side, as they are used.
    fn linear(&self, back: bool) -> [[f64; 3]; MAX_LINEAR] {
        let share = self.share();
        let mut linear = [[0.0; 3]; MAX_LINEAR];
        for (k, (i, _)) in linear.iter_mut().zip(self.params(Role::Linear)) {
            *k = self.color(i, back).map(|c| c * self.values[i] * share);
        }
        linear
    }

    /// The coloured linear factors as they are used, and the prepared shape.
    #[must_use]
    pub fn optics(&self) -> ([[f64; 3]; MAX_LINEAR], Shape<f64>) {
        let linear = self.linear(false);
        let shape: Vec<f64> = self
            .params(Role::Shape)
            .map(|(i, _)| self.values[i])
            .collect();
        (linear, self.model.prepare(&shape))
    }

    /// The same with luminances for colours, as the plot shows it.
    #[must_use]
    pub fn gray(&self) -> (Linear<f64>, Shape<f64>) {
        let (linear, shape) = self.optics();
        (linear.map(luminance), shape)
    }

    /// The sheet that the renderer draws.
    #[must_use]
    pub fn woven(&self) -> Woven {
        let (linear, shape) = self.optics();
        let two_sided = self.model.name == "sheet" && self.backs().next().is_some();
        Woven {
            back: two_sided.then(|| self.linear(true)),
            ..nearest(self.model, &linear, &shape, self.reflect)
        }
    }

    /// The straight-through share for a beam along `w`; 0 for models that have no weave.
    #[must_use]
    pub fn gap(&self, w: Vec3<f64>) -> f64 {
        if self.model.name == "sheet" {
            sheet::Sheet::gap(&self.optics().1, w)
        } else {
            0.0
        }
    }

    /// The fabric as it would be saved under `name`.
    #[must_use]
    pub fn fabric(&self, name: &str) -> Fabric {
        let share = self.share();
        let mut optics = OpticsTable {
            model: self.model.name.to_owned(),
            ..OpticsTable::default()
        };
        for (i, p) in self.model.params.iter().enumerate() {
            let linear = p.role == Role::Linear;
            optics.parameters.insert(
                p.name.to_owned(),
                if linear {
                    self.values[i] * share
                } else {
                    self.values[i]
                },
            );
            if linear && self.colors[i] != [1.0; 3] {
                optics.colors.insert(p.name.to_owned(), self.colors[i]);
            }
        }
        for (i, color) in self.backs() {
            optics.colors.insert(back_of(&self.model.params[i]), color);
        }
        let mut fabric = Fabric {
            name: name.to_owned(),
            optics,
            ..self.fabric.clone()
        };
        if self.changed() {
            fabric.provenance.insert(
                "edited".to_owned(),
                format!("in woven-viewer, from {:?}", self.fabric.name),
            );
        }
        if self.weave_contradicts() {
            // A map of openness cannot be without the table: then the yarns follow the sliders.
            fabric.weave = fabric.weave.filter(|w| !w.openness_map.is_empty());
            if let Some(weave) = &mut fabric.weave {
                let gamma = |name| fabric.optics.parameters.get(name);
                if let (Some(warp), Some(weft)) = (gamma("gamma_warp"), gamma("gamma_weft")) {
                    weave.warp_diameter_mm = warp * weave.warp_pitch_mm;
                    weave.weft_diameter_mm = weft * weave.weft_pitch_mm;
                }
            }
        }
        fabric
    }

    /// Whether the sliders of the weave have left what the file says of its yarns.
    fn weave_contradicts(&self) -> bool {
        let Some(WeaveTable {
            warp_diameter_mm,
            warp_pitch_mm,
            weft_diameter_mm,
            weft_pitch_mm,
            ..
        }) = &self.fabric.weave
        else {
            return false;
        };
        let off = |name: &str, d: f64, pitch: f64| {
            let at = self.model.params.iter().position(|p| p.name == name);
            at.is_some_and(|i| (self.values[i] - (d / pitch).clamp(0.0, 1.0)).abs() > 0.01)
        };
        off("gamma_warp", *warp_diameter_mm, *warp_pitch_mm)
            || off("gamma_weft", *weft_diameter_mm, *weft_pitch_mm)
    }
}

#[cfg(test)]
mod tests;
