//! What a model is, and the list of all of them.
//!
//! Every model has the form f(l, v) = Σ_j k_j · basis_j(shape; l, v): linear factors k_j ≥ 0, which a fit separates and
//! a renderer colours, times basis functions of a few shape parameters. A new model is one file that implements
//! [`Model`] and one line in [`MODELS`]; from that line come its sliders, bounds, fit, rank, shader and tests.

pub mod ashikhmin_shirley;
pub mod cook_torrance;
pub mod ggx_mirrored;
pub mod ggx_walter;
pub mod hgf;
pub mod lambert;
pub mod paper;
pub mod paper_literal;
pub mod phong;
pub mod slab;
pub mod ward;

use crate::dual::Dual;
use crate::real::Real;
use crate::trace::Rec;
use crate::vec3::Vec3;

/// The most linear factors that a model may have.
pub const MAX_LINEAR: usize = 8;
/// The most shape numbers: parameters, then the constants derived from them.
pub const MAX_SHAPE: usize = 16;
/// The most shape parameters, which is also the width of the dual numbers.
pub const MAX_PARAMS: usize = 8;

/// Shape parameters in the order of the model's list, then derived constants, then zeros.
pub type Shape<R> = [R; MAX_SHAPE];
/// The basis functions, one per linear factor, or the factors themselves; zeros behind.
pub type Linear<R> = [R; MAX_LINEAR];
/// The dual number used for Jacobians: derivatives with respect to the shape parameters.
pub type D8 = Dual<MAX_PARAMS>;

/// Whether a parameter multiplies a basis function or shapes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// A factor k_j ≥ 0.
    Linear,
    /// A parameter inside the basis functions.
    Shape,
}

/// A parameter as data: what a window, a fit and a report need to know of it.
#[derive(Clone, Copy, Debug)]
pub struct Param {
    /// The field's own name, used on the command line and in files.
    pub name: &'static str,
    /// What it means, in a few words, with numbers where they help.
    pub meaning: &'static str,
    /// The unit; empty for a pure number.
    pub unit: &'static str,
    /// Least legal value.
    pub min: f64,
    /// Greatest legal value.
    pub max: f64,
    /// Where a slider or a single start begins.
    pub start: f64,
    /// Linear factor or shape.
    pub role: Role,
    /// Whether a slider or a start should be spread logarithmically.
    pub log: bool,
}

impl Param {
    /// A linear factor in [0, max].
    pub const fn linear(name: &'static str, meaning: &'static str, max: f64, start: f64) -> Self {
        Self {
            name,
            meaning,
            unit: "",
            min: 0.0,
            max,
            start,
            role: Role::Linear,
            log: false,
        }
    }
    /// A shape parameter in [min, max].
    pub const fn shape(
        name: &'static str,
        meaning: &'static str,
        min: f64,
        max: f64,
        start: f64,
    ) -> Self {
        Self {
            name,
            meaning,
            unit: "",
            min,
            max,
            start,
            role: Role::Shape,
            log: false,
        }
    }
    /// The same with a logarithmic scale; `min` must be positive.
    pub const fn log(self) -> Self {
        Self { log: true, ..self }
    }
}

/// A BSDF model. Directions are unit vectors in the cloth's frame, `l` to the light and `v` to the viewer, both away
/// from the sheet; values are in 1/sr. A gap is never part of it: see [`crate::weave::openness`].
pub trait Model {
    /// The name on the command line and in files.
    const NAME: &'static str;
    /// The lobe as an equation in plain text.
    const EQUATION: &'static str;
    /// Where it comes from, what it is good for and where it must not be used.
    const DOC: &'static str;
    /// Whether f(l, v) = f(v, l).
    const RECIPROCAL: bool;
    /// The parameters in the order in which users know them; linear and shape may be mixed.
    const PARAMS: &'static [Param];

    /// Fills the derived constants behind the shape parameters. Most models have none.
    fn derive<R: Real>(_shape: &mut Shape<R>) {}
    /// The basis functions, in the order of the linear parameters.
    fn basis<R: Real>(shape: &Shape<R>, l: Vec3<R>, v: Vec3<R>) -> Linear<R>;
    /// Density of [`Model::sample`] per solid angle; `weights` are the linear factors normalised to sum 1.
    fn pdf<R: Real>(shape: &Shape<R>, weights: &Linear<R>, wo: Vec3<R>, wi: Vec3<R>) -> R;
    /// A direction `wi` for the fixed `wo`, from three numbers in [0, 1); (0, 0, 0) when it finds none.
    fn sample<R: Real>(shape: &Shape<R>, weights: &Linear<R>, wo: Vec3<R>, u: [R; 3]) -> Vec3<R>;
}

/// `(shape, l, v) -> basis` in one scalar.
pub type BasisFn<R> = fn(&Shape<R>, Vec3<R>, Vec3<R>) -> Linear<R>;
/// `(shape, weights, wo, wi) -> pdf` in one scalar.
pub type PdfFn<R> = fn(&Shape<R>, &Linear<R>, Vec3<R>, Vec3<R>) -> R;
/// `(shape, weights, wo, u) -> wi` in one scalar.
pub type SampleFn<R> = fn(&Shape<R>, &Linear<R>, Vec3<R>, [R; 3]) -> Vec3<R>;

/// The three functions of a model in one scalar.
#[derive(Clone, Copy, Debug)]
pub struct Functions<R> {
    /// Basis functions.
    pub basis: BasisFn<R>,
    /// Density of the sampler.
    pub pdf: PdfFn<R>,
    /// Sampler.
    pub sample: SampleFn<R>,
}

impl<R: Real> Functions<R> {
    const fn of<M: Model>() -> Self {
        Self {
            basis: M::basis::<R>,
            pdf: M::pdf::<R>,
            sample: M::sample::<R>,
        }
    }
}

/// A model as data, for code that loops over all of them.
#[derive(Debug)]
pub struct ModelInfo {
    /// See [`Model::NAME`].
    pub name: &'static str,
    /// See [`Model::EQUATION`].
    pub equation: &'static str,
    /// See [`Model::DOC`].
    pub doc: &'static str,
    /// See [`Model::RECIPROCAL`].
    pub reciprocal: bool,
    /// See [`Model::PARAMS`].
    pub params: &'static [Param],
    /// In single precision, as the renderer uses it.
    pub f32: Functions<f32>,
    /// In double precision, as the fit and the tests use it.
    pub f64: Functions<f64>,
    /// Basis functions with their exact derivatives with respect to the shape parameters.
    pub dual: BasisFn<D8>,
    /// As a recording, from which the shader is printed.
    pub rec: Functions<Rec>,
    derive_f64: fn(&mut Shape<f64>),
    derive_dual: fn(&mut Shape<D8>),
}

impl ModelInfo {
    /// The description of the model `M`.
    pub const fn of<M: Model>() -> Self {
        Self {
            name: M::NAME,
            equation: M::EQUATION,
            doc: M::DOC,
            reciprocal: M::RECIPROCAL,
            params: M::PARAMS,
            f32: Functions::of::<M>(),
            f64: Functions::of::<M>(),
            dual: M::basis::<D8>,
            rec: Functions::of::<M>(),
            derive_f64: M::derive::<f64>,
            derive_dual: M::derive::<D8>,
        }
    }

    /// The linear parameters, in order.
    pub fn linear(&self) -> impl Iterator<Item = &'static Param> {
        self.params.iter().filter(|p| p.role == Role::Linear)
    }
    /// The shape parameters, in order.
    pub fn shape(&self) -> impl Iterator<Item = &'static Param> {
        self.params.iter().filter(|p| p.role == Role::Shape)
    }

    /// The shape with its derived constants, from the shape parameters in order (at most [`MAX_PARAMS`]).
    pub fn prepare(&self, shape: &[f64]) -> Shape<f64> {
        let mut out = [0.0; MAX_SHAPE];
        out[..shape.len()].copy_from_slice(shape);
        (self.derive_f64)(&mut out);
        out
    }
    /// [`ModelInfo::prepare`] with derivatives: number i of each dual belongs to shape parameter i.
    pub fn prepare_dual(&self, shape: &[f64]) -> Shape<D8> {
        let mut out = [D8::of(0.0); MAX_SHAPE];
        for (i, (o, s)) in out.iter_mut().zip(shape).enumerate() {
            *o = D8::variable(*s, i);
        }
        (self.derive_dual)(&mut out);
        out
    }
    /// Splits values in the order of [`ModelInfo::params`] into (linear, prepared shape).
    pub fn split(&self, values: &[f64]) -> (Linear<f64>, Shape<f64>) {
        assert_eq!(
            values.len(),
            self.params.len(),
            "{} has {} parameters",
            self.name,
            self.params.len()
        );
        let of = |role| {
            self.params
                .iter()
                .zip(values)
                .filter(move |(p, _)| p.role == role)
                .map(|(_, v)| *v)
        };
        let mut linear = [0.0; MAX_LINEAR];
        linear
            .iter_mut()
            .zip(of(Role::Linear))
            .for_each(|(k, v)| *k = v);
        (linear, self.prepare(&of(Role::Shape).collect::<Vec<_>>()))
    }
    /// f(l, v) in 1/sr for values in the order of [`ModelInfo::params`].
    pub fn eval(&self, values: &[f64], l: Vec3<f64>, v: Vec3<f64>) -> f64 {
        let (linear, shape) = self.split(values);
        dot(&linear, &(self.f64.basis)(&shape, l, v))
    }
    /// The start values, in the order of [`ModelInfo::params`].
    pub fn start(&self) -> Vec<f64> {
        self.params.iter().map(|p| p.start).collect()
    }
}

/// Σ k_j b_j.
pub fn dot(k: &Linear<f64>, b: &Linear<f64>) -> f64 {
    k.iter().zip(b).map(|(k, b)| k * b).sum()
}

/// The linear factors scaled to sum 1, as samplers want them; all zero stays all zero.
pub fn normalized(k: &Linear<f64>) -> Linear<f64> {
    let sum: f64 = k.iter().sum();
    k.map(|x| if sum > 0.0 { x / sum } else { 0.0 })
}

/// All models. Adding one is its file and a line here.
pub static MODELS: &[ModelInfo] = &[
    ModelInfo::of::<lambert::Lambert>(),
    ModelInfo::of::<phong::Phong>(),
    ModelInfo::of::<ward::Ward>(),
    ModelInfo::of::<ashikhmin_shirley::AshikhminShirley>(),
    ModelInfo::of::<cook_torrance::CookTorrance>(),
    ModelInfo::of::<hgf::Hgf>(),
    ModelInfo::of::<ggx_walter::GgxWalter>(),
    ModelInfo::of::<ggx_mirrored::GgxMirrored>(),
    ModelInfo::of::<slab::Slab>(),
    ModelInfo::of::<paper::Paper>(),
    ModelInfo::of::<paper_literal::PaperLiteral>(),
    ModelInfo::of::<crate::sheet::Sheet>(),
];

/// The model with that name.
pub fn find(name: &str) -> Option<&'static ModelInfo> {
    MODELS.iter().find(|m| m.name == name)
}

/// What transmission models share: mirror `v` back through the sheet, work in the upper half, mirror the result.
pub(crate) mod fold {
    use super::{Real, Vec3};

    /// `w` with its z made positive: the direction, or its image on the other side of the sheet.
    #[inline(always)]
    pub(crate) fn up<R: Real>(w: Vec3<R>) -> Vec3<R> {
        Vec3::new(w.x, w.y, w.z.abs())
    }
    /// Whether light and viewer are on opposite sides.
    #[inline(always)]
    pub(crate) fn transmits<R: Real>(l: Vec3<R>, v: Vec3<R>) -> R::Mask {
        (l.z * v.z).lt(R::zero())
    }
    /// `value` where the light is transmitted, else 0.
    #[inline(always)]
    pub(crate) fn transmitted<R: Real>(l: Vec3<R>, v: Vec3<R>, value: R) -> R {
        R::select(transmits(l, v), value, R::zero())
    }
    /// The upper-half direction `w` put on the side opposite to `wo`; (0, 0, 0) if it points below.
    #[inline(always)]
    pub(crate) fn opposite<R: Real>(wo: Vec3<R>, w: Vec3<R>) -> Vec3<R> {
        let z = R::select(wo.z.lt(R::zero()), w.z, -w.z);
        Vec3::select(w.z.gt(R::of(1e-6)), Vec3::new(w.x, w.y, z), Vec3::zero())
    }
}
