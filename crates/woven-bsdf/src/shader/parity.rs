//! One model on the GPU against the same lines on the CPU: a kernel, its inputs, and what it must give.
//!
//! Nothing here needs a GPU: a crate that has one runs [`kernel`] over [`inputs`] and hands the result to [`compare`].

use super::{functions, identifier};
use crate::model::{Linear, MAX_LINEAR, MAX_SHAPE, ModelInfo, Role, Shape, normalized};
use crate::vec3::Vec3;
use std::f64::consts::TAU;

/// Numbers of one input: shape, weights, l, v, u.
pub const INPUTS: usize = MAX_SHAPE + MAX_LINEAR + 9;
/// Numbers of one output: basis functions for (l, v), density of `l` for the viewer `v`, the sample for `v` and `u`.
pub const OUTPUTS: usize = MAX_LINEAR + 4;
/// Invocations of a workgroup.
pub const GROUP: usize = 64;

/// A compute shader with the entry point `main` and the functions `text`, which does `body` for each input: `s`, `w` and `l`
/// are read, `first` is where the input begins; `count` numbers go out from `outputs[out]` on.
fn program(text: &str, count: usize, body: &str) -> String {
    let at = MAX_SHAPE + MAX_LINEAR;
    format!(
        "{text}\n@group(0) @binding(0) var<storage, read> inputs: array<f32>;\n\
         @group(0) @binding(1) var<storage, read_write> outputs: array<f32>;\n\n\
         fn vector(at: u32) -> vec3<f32> {{\n    return vec3<f32>(inputs[at], inputs[at + 1u], inputs[at + 2u]);\n}}\n\n\
         @compute @workgroup_size({GROUP})\n\
         fn main(@builtin(global_invocation_id) id: vec3<u32>) {{\n\
         \x20   if id.x * {count}u >= arrayLength(&outputs) {{ return; }}\n\
         \x20   let first = id.x * {INPUTS}u;\n\
         \x20   var s: array<f32, {MAX_SHAPE}>;\n\
         \x20   for (var i = 0u; i < {MAX_SHAPE}u; i++) {{ s[i] = inputs[first + i]; }}\n\
         \x20   var w: array<f32, {MAX_LINEAR}>;\n\
         \x20   for (var i = 0u; i < {MAX_LINEAR}u; i++) {{ w[i] = inputs[first + {MAX_SHAPE}u + i]; }}\n\
         \x20   let at = first + {at}u;\n\
         \x20   let l = vector(at);\n\
         \x20   let out = id.x * {count}u;\n{body}}}\n"
    )
}

/// A compute shader with the entry point `main`: storage buffers of `f32`, group 0, binding 0 the inputs one after the
/// other, binding 1 the outputs.
pub fn kernel(model: &ModelInfo) -> String {
    let name = identifier(model);
    let body = format!(
        "    let v = vector(at + 3u);\n    let u = vector(at + 6u);\n\
         \x20   let basis = {name}_basis(s, l, v);\n\
         \x20   let sample = {name}_sample(s, w, v, u);\n\
         \x20   for (var i = 0u; i < {MAX_LINEAR}u; i++) {{ outputs[out + i] = basis[i]; }}\n\
         \x20   outputs[out + {MAX_LINEAR}u] = {name}_pdf(s, w, v, l);\n\
         \x20   outputs[out + {}u] = sample.x;\n    outputs[out + {}u] = sample.y;\n    outputs[out + {}u] = sample.z;\n",
        MAX_LINEAR + 1,
        MAX_LINEAR + 2,
        MAX_LINEAR + 3,
    );
    program(&functions(model), OUTPUTS, &body)
}

/// Calls of f by one invocation of [`timer`].
pub const CALLS: usize = 32;

/// The mirrored GGX lobe with a floor as one writes it for one purpose: [`timer`] compares with it.
const BY_HAND: &str = "
fn shade(w: vec3<f32>, a: vec2<f32>) -> f32 {
    let t = w.xy * a;
    return 2.0 / (1.0 + sqrt(1.0 + dot(t, t) / (w.z * w.z)));
}
fn value(s: array<f32, 16>, w: array<f32, 8>, l: vec3<f32>, v: vec3<f32>) -> f32 {
    if l.z * v.z >= 0.0 { return 0.0; }
    let a = vec2<f32>(s[0], s[1]);
    let lu = vec3<f32>(l.xy, abs(l.z));
    let vu = vec3<f32>(v.xy, abs(v.z));
    let h = normalize(lu + vu);
    let e = dot(h.xy / a, h.xy / a) + h.z * h.z;
    let d = 0.31830987 / (a.x * a.y * e * e);
    return w[0] * 0.31830987 + w[1] * d * shade(lu, a) * shade(vu, a) / (4.0 * lu.z * vu.z);
}
";

/// A compute shader as [`kernel`] that evaluates and does nothing else, for its time: each invocation calls
/// f = Σ w_j basis_j [`CALLS`] times, for its own light and the viewers of its own and the following inputs, and writes one
/// number, their sum. Without a model it is a mirrored GGX written by hand, for inputs of `ggx-mirrored`.
pub fn timer(model: Option<&ModelInfo>) -> String {
    let text = model.map_or(BY_HAND.to_owned(), |model| {
        let terms: Vec<String> = (0..model.linear().count())
            .map(|j| format!("w[{j}] * b[{j}]"))
            .collect();
        format!(
            "{}\nfn value(s: array<f32, {MAX_SHAPE}>, w: array<f32, {MAX_LINEAR}>, l: vec3<f32>, v: vec3<f32>) -> f32 {{\n\
             \x20   let b = {}_basis(s, l, v);\n    return {};\n}}\n",
            functions(model),
            identifier(model),
            terms.join(" + ")
        )
    });
    let body = format!(
        "    var sum = 0.0;\n\
         \x20   for (var k = 0u; k < {CALLS}u; k++) {{\n\
         \x20       let other = (id.x + k) % arrayLength(&outputs) * {INPUTS}u;\n\
         \x20       sum += value(s, w, l, vector(other + {}u));\n    }}\n    outputs[out] = sum;\n",
        MAX_SHAPE + MAX_LINEAR + 3
    );
    program(&text, 1, &body)
}

/// A number in [0, 1) of the pair (seed, place): SplitMix64's mixer.
fn unit(seed: u64, place: u64) -> f64 {
    let z = seed
        .wrapping_mul(0x9e37_79b9_7f4a_7c15)
        .wrapping_add(place.wrapping_mul(0xd134_2543_de82_ef95));
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// Inputs number `first` to `first + n`: random legal parameters, of which widths are at least `width`, random light
/// and viewer within 87° of the normal on either side (half of the pairs within some lobe widths of straight through).
pub fn inputs(model: &ModelInfo, width: f64, first: u64, n: usize) -> Vec<f32> {
    let mut out = Vec::with_capacity(n * INPUTS);
    for i in first..first + n as u64 {
        let mut place = 0;
        let mut next = || {
            place += 1;
            unit(i + 1, place)
        };
        let values: Vec<f64> = model
            .params
            .iter()
            .map(|p| match p.role {
                Role::Linear => next() * p.max.min(1.0),
                Role::Shape if p.log => {
                    let lo = p.min.max(width.min(p.max));
                    lo * (p.max / lo).powf(next())
                }
                Role::Shape => p.min + next() * (p.max - p.min),
            })
            .collect();
        let (k, s) = model.split(&values);
        let mut direction = |side: f64| {
            let z = 0.05 + 0.95 * next();
            let (r, phi) = ((1.0 - z * z).max(0.0).sqrt(), TAU * next());
            Vec3::new(r * phi.cos(), r * phi.sin(), z * side)
        };
        let (l, far) = (direction(1.0), direction(-1.0));
        let (spread, flip, near) = (next(), next(), next());
        let mut v = if near < 0.5 {
            (far * (0.3 * spread * spread) - l).normalize()
        } else {
            far
        };
        // A quarter on the same side, all of it turned over half of the time.
        if flip < 0.25 {
            v.z = -v.z;
        }
        let turn = if next() < 0.5 { 1.0 } else { -1.0 };
        let u = [next(), next(), next()];
        out.extend(s.map(|x| x as f32));
        out.extend(normalized(&k).map(|x| x as f32));
        let single = [l.x, l.y, l.z * turn, v.x, v.y, v.z * turn];
        out.extend(single.into_iter().chain(u).map(|x| x as f32));
    }
    out
}

/// One input taken apart.
fn parts(input: &[f32]) -> (Shape<f32>, Linear<f32>, [Vec3<f32>; 2], [f32; 3]) {
    let at = |i: usize| input[i];
    let base = MAX_SHAPE + MAX_LINEAR;
    let vector = |i: usize| Vec3::new(at(base + i), at(base + i + 1), at(base + i + 2));
    (
        std::array::from_fn(at),
        std::array::from_fn(|i| at(MAX_SHAPE + i)),
        [vector(0), vector(3)],
        std::array::from_fn(|i| at(base + 6 + i)),
    )
}

/// What the model gives on the CPU in single precision.
pub fn expected(model: &ModelInfo, inputs: &[f32]) -> Vec<f32> {
    let mut out = Vec::with_capacity(inputs.len() / INPUTS * OUTPUTS);
    for input in inputs.chunks_exact(INPUTS) {
        let (s, w, [l, v], u) = parts(input);
        out.extend((model.f32.basis)(&s, l, v));
        out.push((model.f32.pdf)(&s, &w, v, l));
        let wi = (model.f32.sample)(&s, &w, v, u);
        out.extend([wi.x, wi.y, wi.z]);
    }
    out
}

/// How far a GPU is from the CPU.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Difference {
    /// Greatest relative difference of a basis function above 1e-6 of its peak.
    pub eval: f64,
    /// Greatest relative difference of a density above 1e-6 of its peak.
    pub pdf: f64,
    /// Greatest difference of a component of a sample (of a refracted one: of what makes it, see [`compare`]), coins that
    /// fell otherwise apart.
    pub sample: f64,
    /// Samples whose coin fell otherwise, by one rounding of a chance.
    pub coins: usize,
    /// Values above 1e-6 of their peak.
    pub judged: usize,
}

/// Whether samples come from refraction at a facet.
fn refracts(model: &ModelInfo) -> bool {
    ["ggx-walter", "paper"].contains(&model.name)
}

/// Greatest difference of a component; a NaN is no small one.
fn apart<const N: usize>(p: [f64; N], q: [f64; N]) -> f64 {
    let larger = |m: f64, d: f64| if d.is_nan() { f64::INFINITY } else { m.max(d) };
    p.iter()
        .zip(q)
        .map(|(p, q)| (p - q).abs())
        .fold(0.0, larger)
}

/// How far two refracted directions are apart in what makes them: the facet, and the square of the refracted cosine.
///
/// cos²θ_t = 1 - n² (1 - c²) is what the sampler computes, to some 1e-7 of 1. Next to total reflection it is small, and
/// its root, the direction's part along the facet's normal, is wrong by 1e-7/(2 cosθ_t) in any single precision: that
/// root has lost its digits in the cosine c, not in how it is written. Facet and cos²θ_t determine the direction.
fn facets_apart(v: [f64; 3], n: f64, p: [f64; 3], q: [f64; 3]) -> f64 {
    let made = |w: [f64; 3]| {
        let l = Vec3::new(w[0], w[1], w[2]);
        let h = (l + Vec3::new(v[0], v[1], v[2]) * n).normalize();
        [h.x, h.y, h.z, l.dot(h).powi(2)]
    };
    apart(made(p), made(q))
}

/// Compares the outputs `gpu` of a kernel with [`expected`]. A peak is the greatest value of the model straight through,
/// mirrored and at the pair itself, for the same light. A sample refracted next to total reflection is compared by its
/// facet and the square of its cosine, from which it comes by an ill-conditioned root.
pub fn compare(model: &ModelInfo, inputs: &[f32], cpu: &[f32], gpu: &[f32]) -> Difference {
    let mut out = Difference::default();
    let all = inputs
        .chunks_exact(INPUTS)
        .zip(cpu.chunks_exact(OUTPUTS))
        .zip(gpu.chunks_exact(OUTPUTS));
    for ((input, a), b) in all {
        let (s, w, [l, v], _) = parts(input);
        let peaks = [-v, Vec3::new(-v.x, -v.y, v.z)].map(|to| {
            let mut p = [0.0; MAX_LINEAR + 1];
            p[..MAX_LINEAR].copy_from_slice(&(model.f32.basis)(&s, to, v));
            p[MAX_LINEAR] = (model.f32.pdf)(&s, &w, v, to);
            p
        });
        debug_assert!(l.z != 0.0);
        for j in 0..=MAX_LINEAR {
            let peak = peaks[0][j].max(peaks[1][j]).max(a[j]);
            if a[j] > 1e-6 * peak {
                out.judged += 1;
                let d = f64::from((a[j] - b[j]).abs() / a[j]);
                let worst = if j < MAX_LINEAR {
                    &mut out.eval
                } else {
                    &mut out.pdf
                };
                // A NaN is no small difference.
                *worst = if d.is_nan() {
                    f64::INFINITY
                } else {
                    worst.max(d)
                };
            } else if b[j].is_nan() {
                out.eval = f64::INFINITY;
            }
        }
        let at = |o: &[f32]| std::array::from_fn(|j| f64::from(o[MAX_LINEAR + 1 + j]));
        let (p, q): ([f64; 3], [f64; 3]) = (at(a), at(b));
        let mut d = apart(p, q);
        if refracts(model) && d > 1e-6 {
            d = d.min(facets_apart(
                [v.x, v.y, v.z].map(f64::from),
                f64::from(s[1]),
                p,
                q,
            ));
        }
        if d > 0.02 && d.is_finite() {
            out.coins += 1;
        } else {
            out.sample = out.sample.max(d);
        }
    }
    out
}
