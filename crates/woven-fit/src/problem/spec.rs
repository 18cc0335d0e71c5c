//! What is fitted: a model, which of its parameters are free and in which scale, and whether a gap is added.

use woven_bsdf::model::{MAX_LINEAR, ModelInfo, Role};

/// A parameter that the solver moves: where it lives, its range, whether its logarithm is moved.
#[derive(Clone, Debug)]
pub struct Coordinate {
    /// The parameter's name.
    pub name: &'static str,
    /// Where it lives.
    pub place: Place,
    /// Least value.
    pub min: f64,
    /// Greatest value.
    pub max: f64,
    /// Where the first start stands.
    pub start: f64,
    /// Whether the solver moves the logarithm.
    pub log: bool,
}

/// Where a [`Coordinate`] lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Number in the model's list of shape parameters.
    Shape(usize),
    /// Number among (gamma_warp, gamma_weft, section) of a gap added to a model that has none.
    Gap(usize),
    /// Two shape parameters tied together: an isotropic lobe.
    Tied(usize, usize),
}

/// What is fitted: a model, which of its parameters are free, and whether a gap is added.
#[derive(Clone, Debug)]
pub struct Spec {
    /// The model.
    pub model: &'static ModelInfo,
    /// How reports call it, for example "hgf without c".
    pub label: String,
    /// Numbers (in the model's list of linear parameters) of the free factors.
    pub linear: Vec<usize>,
    /// Fixed factors, in the model's order; used for those not free.
    pub fixed_linear: [f64; MAX_LINEAR],
    /// Free shape parameters.
    pub coordinates: Vec<Coordinate>,
    /// Values of the shape parameters that are not free.
    pub shape: Vec<f64>,
    /// Whether light passes through gaps: by the model itself (`sheet`) or added to it.
    pub gap: bool,
    /// (gamma_warp, gamma_weft, section) of an added gap where they are not free.
    pub held_gap: [f64; 3],
}

/// Names of the terms that do not depend on the direction.
const DIFFUSE: [&str; 4] = ["k_d", "c", "t_d", "r_d"];
/// Parameters of `sheet` that only reflection sees.
const REFLECTION: [&str; 5] = ["r_d", "k_r", "ralpha_x", "ralpha_y", "f0"];
/// Reflection too, but a goniometer of a few angles cannot tell it from the lobe: it keeps the value 0.
const SHEEN: &str = "sheen";
/// Parameters that make the gap.
pub const GAP: [&str; 3] = ["gamma_warp", "gamma_weft", "section"];

impl Spec {
    /// The model's parameters that transmission sees; the constant term only with `diffuse`, a gap only with `gap`.
    pub fn transmission(model: &'static ModelInfo, diffuse: bool, gap: bool) -> Self {
        let own_gap = model.params.iter().any(|p| p.name == GAP[0]);
        let skip = |name: &str| {
            (own_gap && (REFLECTION.contains(&name) || name == SHEEN))
                || (!diffuse && DIFFUSE.contains(&name))
                || (own_gap && !gap && GAP.contains(&name))
        };
        let mut spec = Self::with(model, skip, gap);
        if own_gap && !gap {
            // Closed: whatever passes is scattered by the yarn.
            for (value, p) in spec.shape.iter_mut().zip(model.shape()) {
                if GAP[..2].contains(&p.name) {
                    *value = p.max;
                }
            }
        }
        if gap && !own_gap {
            let range = [(0.0, 1.0), (0.0, 1.0), (0.0, 2.0)];
            for (i, &name) in GAP.iter().enumerate() {
                spec.coordinates.push(Coordinate {
                    name,
                    place: Place::Gap(i),
                    min: range[i].0,
                    max: range[i].1,
                    start: 0.5,
                    log: false,
                });
            }
        }
        if !diffuse {
            let term = model.linear().find(|p| DIFFUSE.contains(&p.name));
            if let Some(p) = term {
                spec.label += &format!(" without {}", p.name);
            }
        }
        if gap && !own_gap {
            spec.label += " + gap";
        }
        spec
    }

    /// The parameters of `sheet` that reflection sees, on top of known `values` for all others.
    pub fn reflection(model: &'static ModelInfo, values: &[f64]) -> Self {
        // f0 multiplies k_r at all angles but grazing ones, so it keeps the value of a common fibre.
        let mut spec = Self::with(
            model,
            |name| !REFLECTION.contains(&name) || name == "f0",
            true,
        );
        let (linear, _) = model.split(values);
        spec.fixed_linear = linear;
        spec.shape = model
            .params
            .iter()
            .zip(values)
            .filter(|(p, _)| p.role == Role::Shape)
            .map(|(_, &v)| v)
            .collect();
        spec.label += ", reflection";
        spec
    }

    /// All parameters of a model but those that `skip` names.
    pub fn with(model: &'static ModelInfo, skip: impl Fn(&str) -> bool, gap: bool) -> Self {
        let linear = model
            .linear()
            .enumerate()
            .filter(|(_, p)| !skip(p.name))
            .map(|(i, _)| i)
            .collect();
        let coordinates = model
            .shape()
            .enumerate()
            .filter(|(_, p)| !skip(p.name))
            .map(|(i, p)| Coordinate {
                name: p.name,
                place: Place::Shape(i),
                min: p.min,
                max: p.max,
                start: p.start,
                log: p.log,
            })
            .collect();
        Self {
            model,
            label: model.name.to_owned(),
            linear,
            fixed_linear: [0.0; MAX_LINEAR],
            coordinates,
            shape: model.shape().map(|p| p.start).collect(),
            gap,
            held_gap: [0.0; 3],
        }
    }

    /// Only the named parameters; shapes not named stand at their start values, factors not named at zero.
    pub fn only(model: &'static ModelInfo, names: &[&str]) -> Self {
        Self::with(model, |name| !names.contains(&name), false)
    }

    /// Ties alpha_x to alpha_y: the isotropic version of an anisotropic lobe; `None` if there is no such pair.
    pub fn isotropic(&self) -> Option<Self> {
        let find = |suffix: &str| {
            self.coordinates
                .iter()
                .position(|c| c.name.ends_with(suffix) && matches!(c.place, Place::Shape(_)))
        };
        let (x, y) = find("_x")
            .zip(find("_y"))
            .or_else(|| find("_u").zip(find("_v")))?;
        let (Place::Shape(i), Place::Shape(j)) =
            (self.coordinates[x].place, self.coordinates[y].place)
        else {
            return None;
        };
        let mut spec = self.clone();
        spec.coordinates[x].place = Place::Tied(i, j);
        spec.coordinates.remove(y);
        spec.label += " isotropic";
        Some(spec)
    }

    /// Names of the free parameters: factors first, then shape.
    pub fn names(&self) -> Vec<&'static str> {
        let linear: Vec<&'static str> = self.model.linear().map(|p| p.name).collect();
        let factors = self.linear.iter().map(|&i| linear[i]);
        factors
            .chain(self.coordinates.iter().map(|c| c.name))
            .collect()
    }

    /// Shape values and gap values for solver coordinates `x`.
    pub fn shape_at(&self, x: &[f64]) -> (Vec<f64>, [f64; 3]) {
        let mut shape = self.shape.clone();
        let mut gap = self.held_gap;
        for (c, &x) in self.coordinates.iter().zip(x) {
            let value = if c.log { x.exp() } else { x };
            match c.place {
                Place::Shape(i) => shape[i] = value,
                Place::Gap(i) => gap[i] = value,
                Place::Tied(i, j) => {
                    shape[i] = value;
                    shape[j] = value;
                }
            }
        }
        (shape, gap)
    }

    /// All of the model's parameters in its own order, from factors and solver coordinates.
    pub fn values(&self, k: &[f64], x: &[f64]) -> Vec<f64> {
        let (shape, _) = self.shape_at(x);
        let mut linear = self.fixed_linear;
        for (&i, &k) in self.linear.iter().zip(k) {
            linear[i] = k;
        }
        let (mut i, mut j) = (0, 0);
        self.model
            .params
            .iter()
            .map(|p| {
                if p.role == Role::Linear {
                    i += 1;
                    linear[i - 1]
                } else {
                    j += 1;
                    shape[j - 1]
                }
            })
            .collect()
    }

    /// Whether coordinate `c` makes the gap.
    pub fn is_gap(&self, c: usize) -> bool {
        GAP.contains(&self.coordinates[c].name)
    }

    /// The same with the gap held at (gamma_warp, gamma_weft, section).
    pub fn holding_gap(&self, gap: [f64; 3]) -> Self {
        let mut spec = self.clone();
        for (c, coordinate) in self.coordinates.iter().enumerate() {
            let Some(i) = GAP.iter().position(|g| *g == coordinate.name) else {
                continue;
            };
            if let Place::Shape(place) = self.coordinates[c].place {
                spec.shape[place] = gap[i];
            }
        }
        spec.held_gap = gap;
        spec.coordinates.retain(|c| !GAP.contains(&c.name));
        spec
    }

    /// Factors that are not free and not zero: (number, value).
    pub(super) fn held(&self) -> Vec<(usize, f64)> {
        let held = self.fixed_linear.iter().copied().enumerate();
        held.filter(|(i, k)| *k != 0.0 && !self.linear.contains(i))
            .collect()
    }

    /// Holds the factor `name` at `value`.
    pub fn hold(&mut self, name: &str, value: f64) {
        if let Some(i) = self.model.linear().position(|p| p.name == name) {
            self.linear.retain(|&j| j != i);
            self.fixed_linear[i] = value;
        }
    }

    /// The solver's range of coordinate `c`.
    pub fn range(&self, c: usize) -> (f64, f64) {
        let c = &self.coordinates[c];
        if c.log {
            (c.min.ln(), c.max.ln())
        } else {
            (c.min, c.max)
        }
    }
}
