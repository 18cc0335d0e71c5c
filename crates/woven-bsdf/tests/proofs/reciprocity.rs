//! f(l, v) = f(v, l), to rounding, for every model that says so; and not for those that say they are not.

use crate::support::Rng;
use woven_bsdf::model::MODELS;

#[test]
fn reciprocity() {
    for model in MODELS {
        let mut rng = Rng::new(11);
        let mut worst: f64 = 0.0;
        for _ in 0..20_000 {
            let p = rng.parameters(model, 0.0);
            let (l, v) = (rng.direction(0.0), rng.direction(0.0));
            let (a, b) = (model.eval(&p, l, v), model.eval(&p, v, l));
            assert!(
                a.is_finite() && a >= 0.0,
                "{}: f = {a} at {p:?} {l:?} {v:?}",
                model.name
            );
            worst = worst.max((a - b).abs() / (a.abs() + b.abs()).max(1e-300));
        }
        println!(
            "{}: worst |f(l,v) - f(v,l)| / sum = {worst:.1e}",
            model.name
        );
        if model.reciprocal {
            assert!(worst < 1e-6, "{} is off by {worst:e}", model.name);
        } else {
            assert!(
                worst > 1e-3,
                "{} is reciprocal, but does not say so",
                model.name
            );
        }
    }
}

#[test]
fn single_precision_agrees_with_double() {
    for model in MODELS {
        let mut rng = Rng::new(12);
        let mut worst: f64 = 0.0;
        for _ in 0..20_000 {
            // Widths from 0.05: D of a narrower lobe amplifies the rounding of h by 1/α² and means nothing in f32.
            let (k, s) = model.split(&rng.parameters(model, 0.05));
            let (l, v) = (rng.direction(0.02), rng.direction(0.02));
            let exact = (model.f64.basis)(&s, l, v);
            let single = (model.f32.basis)(&s.map(|x| x as f32), l.cast(), v.cast());
            let pdf = (model.f64.pdf)(&s, &woven_bsdf::model::normalized(&k), l, v);
            let pdf32 = (model.f32.pdf)(
                &s.map(|x| x as f32),
                &woven_bsdf::model::normalized(&k).map(|x| x as f32),
                l.cast(),
                v.cast(),
            );
            for (a, b) in exact.iter().zip(single).chain([(&pdf, pdf32)]) {
                // Below 1e-6/sr nobody sees the value.
                worst = worst.max((a - f64::from(b)).abs() / (a.abs() + 1e-6));
            }
        }
        println!(
            "{}: f32 against f64, worst relative difference {worst:.1e}",
            model.name
        );
        assert!(worst < 2e-3, "{}: {worst:e}", model.name);
    }
}
