//! Nanoseconds per call of every model, beside a GGX written by hand: `cargo run --release -p woven-bsdf --example bench`.
//!
//! Each number is the least of nine runs over the same 4,096 random pairs of directions.

use std::f64::consts::PI;
use std::hint::black_box;
use std::time::Instant;
use woven_bsdf::model::{D8, Linear, MODELS, Shape, normalized};
use woven_bsdf::real::Real;
use woven_bsdf::vec3::Vec3;

const PAIRS: usize = 4096;

/// Random unit vectors, light above and viewer below.
fn directions() -> Vec<(Vec3<f64>, Vec3<f64>)> {
    let mut state = 1u64;
    let mut unit = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..PAIRS)
        .map(|_| {
            let mut one = |lo: f64| Vec3::from_angles(lo + unit() * 1.5, unit() * 2.0 * PI);
            (one(0.0), one(1.6))
        })
        .collect()
}

/// Least nanoseconds per call of `f` over all pairs.
fn time<R: Copy, T>(pairs: &[(Vec3<R>, Vec3<R>)], f: impl Fn(Vec3<R>, Vec3<R>) -> T) -> f64 {
    (0..9)
        .map(|_| {
            let start = Instant::now();
            for &(l, v) in pairs {
                black_box(f(black_box(l), black_box(v)));
            }
            start.elapsed().as_secs_f64() * 1e9 / pairs.len() as f64
        })
        .fold(f64::INFINITY, f64::min)
}

/// The mirrored GGX lobe with a floor as one writes it in f64 for one purpose: k_d/π + k_t D G1 G1/(4 c c).
#[inline(never)]
fn by_hand(p: &[f64; 4], l: [f64; 3], v: [f64; 3]) -> f64 {
    if l[2] * v[2] >= 0.0 {
        return 0.0;
    }
    let (lz, vz) = (l[2].abs(), v[2].abs());
    let h = [l[0] + v[0], l[1] + v[1], lz + vz];
    let inv = 1.0 / (h[0] * h[0] + h[1] * h[1] + h[2] * h[2]).sqrt();
    let (hx, hy, hz) = (h[0] * inv / p[2], h[1] * inv / p[3], h[2] * inv);
    let e = hx * hx + hy * hy + hz * hz;
    let d = 1.0 / (PI * p[2] * p[3] * e * e);
    let g1 = |w: [f64; 3]| {
        let (x, y) = (w[0] * p[2], w[1] * p[3]);
        2.0 / (1.0 + (1.0 + (x * x + y * y) / (w[2] * w[2])).sqrt())
    };
    p[0] / PI + p[1] * d * g1(l) * g1(v) / (4.0 * lz * vz)
}

fn main() {
    let pairs = directions();
    let single: Vec<_> = pairs
        .iter()
        .map(|(l, v)| (l.cast::<f32>(), v.cast::<f32>()))
        .collect();
    let dual: Vec<_> = pairs
        .iter()
        .map(|(l, v)| (l.cast::<D8>(), v.cast::<D8>()))
        .collect();
    let p = black_box([0.1, 0.3, 0.2, 0.15]);
    let hand = time(&pairs, |l, v| by_hand(&p, [l.x, l.y, l.z], [v.x, v.y, v.z]));
    let ours = black_box(
        [0.2, 0.15]
            .iter()
            .chain(&[0.0; 14])
            .copied()
            .collect::<Vec<f64>>(),
    );
    let s: Shape<f64> = std::array::from_fn(|i| ours[i]);
    let k = [0.1, 0.3];
    // The generated form as one writes it for one purpose, without the array of basis functions.
    let same = time(&pairs, |l, v| {
        use woven_bsdf::model::{Model, ggx_mirrored::GgxMirrored};
        let b = GgxMirrored::basis(&s, l, v);
        k[0] * b[0] + k[1] * b[1]
    });
    println!(
        "by hand {hand:.1} ns, ggx-mirrored from the one source {same:.1} ns, ratio {:.2} (f64, inlined)",
        same / hand
    );
    println!(
        "{:<18} {:>8} {:>8} {:>8} {:>8} {:>8} {:>10}",
        "ns per call", "f32", "f64", "dual", "pdf f32", "smp f32", "prepare f64"
    );
    for model in MODELS {
        let (k, shape) = model.split(&model.start());
        let shape32 = shape.map(|x| x as f32);
        let w: Linear<f32> = normalized(&k).map(|x| x as f32);
        let start: Vec<f64> = model.shape().map(|p| p.start).collect();
        let shape_dual = model.prepare_dual(&start);
        let f = |m: f64| format!("{m:.1}");
        println!(
            "{:<18} {:>8} {:>8} {:>8} {:>8} {:>8} {:>10}",
            model.name,
            f(time(&single, |l, v| (model.f32.basis)(&shape32, l, v))),
            f(time(&pairs, |l, v| (model.f64.basis)(&shape, l, v))),
            f(time(&dual, |l, v| (model.dual)(&shape_dual, l, v))),
            f(time(&single, |l, v| (model.f32.pdf)(&shape32, &w, v, l))),
            f(time(&single, |l, v| (model.f32.sample)(
                &shape32,
                &w,
                v,
                [l.x.abs(), l.y.abs(), f32::of(0.5)]
            ))),
            f(time(&pairs[..64], |_, _| model.prepare(&start))),
        );
    }
}
