//! The optics as WGSL, printed from the Rust by recording it.
//!
//! For each model `name` (dashes become underscores): `name_basis(s, l, v)`, `name_pdf(s, w, wo, wi)`,
//! `name_sample(s, w, wo, u)` with `s: array<f32, 16>` the prepared shape and `w: array<f32, 8>` the weights; and
//! `openness(gamma_warp, gamma_weft, section, w)`. The text is checked in; a test prints it again and compares.

pub mod parity;

use crate::model::{MAX_LINEAR, MAX_SHAPE, MODELS, ModelInfo};
use crate::trace::{Rec, record, wgsl};
use crate::vec3::Vec3;
use crate::weave;

/// The generated shader text.
pub const OPTICS: &str = include_str!("shader/optics.wgsl");

/// Prints the shader text anew.
pub fn generate() -> String {
    let mut out = String::from(
        "// Generated from crates/woven-bsdf/src by `cargo run -p woven-bsdf --example print_shader`; do not edit.\n\n",
    );
    out.push_str(&openness());
    for model in MODELS {
        out.push('\n');
        out.push_str(&functions(model));
    }
    out
}

/// The three functions of one model, with its equation above.
pub fn functions(model: &ModelInfo) -> String {
    let mut out = format!("// {}: {}\n", model.name, model.equation);
    for function in [basis(model), pdf(model), sample(model)] {
        out.push_str(&function);
    }
    out
}

/// Hands out inputs in order and keeps the WGSL expression of each.
#[derive(Default)]
struct Inputs(Vec<String>);

impl Inputs {
    fn scalar(&mut self, name: impl Into<String>) -> Rec {
        self.0.push(name.into());
        Rec::input(self.0.len() as u32 - 1)
    }
    fn vec3(&mut self, name: &str) -> Vec3<Rec> {
        Vec3::new(
            self.scalar(format!("{name}.x")),
            self.scalar(format!("{name}.y")),
            self.scalar(format!("{name}.z")),
        )
    }
    fn array<const N: usize>(&mut self, name: &str) -> [Rec; N] {
        std::array::from_fn(|i| self.scalar(format!("{name}[{i}]")))
    }
}

pub(crate) fn identifier(model: &ModelInfo) -> String {
    model.name.replace('-', "_")
}

fn openness() -> String {
    let mut inputs = Inputs::default();
    let (tape, root) = record(|| {
        let [a, b, c] = ["gamma_warp", "gamma_weft", "section"].map(|n| inputs.scalar(n));
        weave::openness(a, b, c, inputs.vec3("w"))
    });
    let signature =
        "fn openness(gamma_warp: f32, gamma_weft: f32, section: f32, w: vec3<f32>) -> f32";
    wgsl::function(signature, "", &inputs.0, &tape, &[root], |r| r[0].clone())
}

fn basis(model: &ModelInfo) -> String {
    let mut inputs = Inputs::default();
    let (tape, roots) = record(|| {
        let s = inputs.array::<MAX_SHAPE>("s");
        (model.rec.basis)(&s, inputs.vec3("l"), inputs.vec3("v"))
    });
    let signature = format!(
        "fn {}_basis(s: array<f32, 16>, l: vec3<f32>, v: vec3<f32>) -> array<f32, 8>",
        identifier(model)
    );
    wgsl::function(&signature, "", &inputs.0, &tape, &roots, |r| {
        format!("array<f32, 8>({})", r.join(", "))
    })
}

fn pdf(model: &ModelInfo) -> String {
    let mut inputs = Inputs::default();
    let (tape, root) = record(|| {
        let (s, w) = (
            inputs.array::<MAX_SHAPE>("s"),
            inputs.array::<MAX_LINEAR>("w"),
        );
        (model.rec.pdf)(&s, &w, inputs.vec3("wo"), inputs.vec3("wi"))
    });
    let signature = format!(
        "fn {}_pdf(s: array<f32, 16>, w: array<f32, 8>, wo: vec3<f32>, wi: vec3<f32>) -> f32",
        identifier(model)
    );
    wgsl::function(&signature, "", &inputs.0, &tape, &[root], |r| r[0].clone())
}

fn sample(model: &ModelInfo) -> String {
    let mut inputs = Inputs::default();
    let (tape, wi) = record(|| {
        let (s, w) = (
            inputs.array::<MAX_SHAPE>("s"),
            inputs.array::<MAX_LINEAR>("w"),
        );
        let wo = inputs.vec3("wo");
        let u = inputs.vec3("u");
        (model.rec.sample)(&s, &w, wo, [u.x, u.y, u.z])
    });
    let signature = format!(
        "fn {}_sample(s: array<f32, 16>, w: array<f32, 8>, wo: vec3<f32>, u: vec3<f32>) -> vec3<f32>",
        identifier(model)
    );
    wgsl::function(&signature, "", &inputs.0, &tape, &[wi.x, wi.y, wi.z], |r| {
        format!("vec3<f32>({})", r.join(", "))
    })
}
