//! Exact derivatives by dual numbers against central differences, for every model and every shape parameter.

use crate::support::Rng;
use woven_bsdf::model::{MODELS, ModelInfo};
use woven_bsdf::vec3::Vec3;

/// Σ of the basis functions, weighed so that none can hide behind another.
fn mixture(model: &ModelInfo, shape: &[f64], l: Vec3<f64>, v: Vec3<f64>) -> f64 {
    let b = (model.f64.basis)(&model.prepare(shape), l, v);
    b.iter().zip(1..).map(|(b, j)| b * f64::from(j)).sum()
}

/// Central difference with step `h`, one order better by Richardson's extrapolation: error O(h⁴).
fn difference(f: &dyn Fn(f64) -> f64, x: f64, h: f64) -> f64 {
    let central = |h: f64| (f(x + h) - f(x - h)) / (2.0 * h);
    (4.0 * central(h / 2.0) - central(h)) / 3.0
}

#[test]
fn duals_agree_with_differences() {
    for model in MODELS {
        let mut rng = Rng::new(21);
        for (i, param) in model.shape().enumerate() {
            let (mut judged, mut worst) = (0, 0.0f64);
            const TRIALS: usize = 400;
            for _ in 0..TRIALS {
                let values = rng.parameters(model, 0.0);
                let mut shape: Vec<f64> = model
                    .params
                    .iter()
                    .zip(&values)
                    .filter(|(p, _)| p.role == woven_bsdf::model::Role::Shape)
                    .map(|(_, x)| *x)
                    .collect();
                // Away from the ends, so that both sides of the difference are legal.
                let room = 0.02 * (param.max - param.min).min(shape[i].abs().max(1e-3));
                shape[i] = shape[i].clamp(param.min + room, param.max - room);
                let (l, v) = (rng.direction(0.05), rng.direction(0.05));
                let dual = (model.dual)(&model.prepare_dual(&shape), l.cast(), v.cast());
                let exact: f64 = dual
                    .iter()
                    .zip(1..)
                    .map(|(b, j)| b.d[i] * f64::from(j))
                    .sum();
                let f = |x: f64| {
                    let mut s = shape.clone();
                    s[i] = x;
                    mixture(model, &s, l, v)
                };
                let scale = exact.abs() + f(shape[i]).abs() / (param.max - param.min) + 1e-9;
                // Where two steps disagree there is a kink (a yarn just closes) or the step is too long; a shorter
                // step is tried, and what stays undecided is not judged.
                for h in [room / 3e3, room / 3e4] {
                    let (a, b) = (
                        difference(&f, shape[i], h),
                        difference(&f, shape[i], h / 2.0),
                    );
                    if (a - b).abs() < 2e-7 * scale {
                        judged += 1;
                        worst = worst.max((b - exact).abs() / scale);
                        break;
                    }
                }
            }
            println!(
                "{} d/d{}: worst {worst:.1e} of {judged} judged",
                model.name, param.name
            );
            assert!(
                judged * 10 > TRIALS * 7,
                "{} {}: only {judged} could be judged",
                model.name,
                param.name
            );
            assert!(
                worst < 1e-6,
                "{} d/d{}: off by {worst:e}",
                model.name,
                param.name
            );
        }
    }
}
