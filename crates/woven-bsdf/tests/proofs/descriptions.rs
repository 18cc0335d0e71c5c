//! What the descriptions of the models say in numbers, and that they say what a description must.

use woven_bsdf::angles::radians;
use woven_bsdf::model::{MODELS, find};
use woven_bsdf::vec3::Vec3;

/// Where f falls to half its value straight ahead, for light along the normal: degrees, in the plane of x or y.
fn half_width(name: &str, values: &[f64], along_y: bool) -> f64 {
    let model = find(name).unwrap();
    let f = |deg: f64| {
        let (s, c) = radians(deg).sin_cos();
        let v = Vec3::new(
            if along_y { 0.0 } else { s },
            if along_y { s } else { 0.0 },
            -c,
        );
        model.eval(values, Vec3::new(0.0, 0.0, 1.0), v)
    };
    let (mut lo, mut hi) = (0.0, 80.0);
    for _ in 0..60 {
        let mid = 0.5 * (lo + hi);
        if f(mid) > 0.5 * f(1e-6) {
            lo = mid;
        } else {
            hi = mid;
        }
    }
    lo
}

#[test]
fn the_widths_that_the_descriptions_name() {
    // (model, values with the lobe alone, what the parameter's meaning says in degrees)
    let known: [(&str, &[f64], f64); 23] = [
        ("phong", &[0.0, 1.0, 1.0], 60.0),
        ("phong", &[0.0, 1.0, 100.0], 6.7),
        ("phong", &[0.0, 1.0, 10_000.0], 0.67),
        ("ward", &[0.0, 1.0, 0.1, 0.1], 9.6),
        ("ward", &[0.0, 1.0, 0.3, 0.3], 29.0),
        ("ashikhmin-shirley", &[0.0, 1.0, 10.0, 10.0, 1.0], 44.0),
        ("ashikhmin-shirley", &[0.0, 1.0, 100.0, 100.0, 1.0], 13.5),
        ("ashikhmin-shirley", &[0.0, 1.0, 1000.0, 1000.0, 1.0], 4.3),
        ("cook-torrance", &[0.0, 1.0, 0.1, 1.5], 9.7),
        ("cook-torrance", &[0.0, 1.0, 0.3, 1.5], 34.0),
        ("hgf", &[1.0, 0.3, 0.0, 0.9, 0.0], 59.0),
        ("hgf", &[0.0, 0.3, 1.0, 0.9, 0.0], 4.6),
        ("hgf", &[0.0, 0.3, 1.0, 0.99, 0.0], 0.44),
        ("ggx-walter", &[0.0, 1.0, 0.1, 1.5], 1.2),
        ("ggx-walter", &[0.0, 1.0, 0.3, 1.5], 3.7),
        ("slab", &[0.0, 1.0, 0.1, 1.5], 3.1),
        ("slab", &[0.0, 1.0, 0.3, 1.5], 8.5),
        ("ggx-mirrored", &[0.0, 1.0, 0.05, 0.05], 3.7),
        ("ggx-mirrored", &[0.0, 1.0, 0.1, 0.1], 7.5),
        ("ggx-mirrored", &[0.0, 1.0, 0.3, 0.3], 25.0),
        // Of a stretched lobe each plane shows its own width.
        ("ggx-mirrored", &[0.0, 1.0, 0.1, 0.3], 7.5),
        ("ward", &[0.0, 1.0, 0.1, 0.3], 9.6),
        (
            "sheet",
            &[
                0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.5, 0.1, 0.05, 0.4, 0.4, 0.04,
            ],
            7.5,
        ),
    ];
    for (name, values, degrees) in known {
        let got = half_width(name, values, false);
        // The descriptions give two digits.
        assert!(
            (got / degrees - 1.0).abs() < 0.04,
            "{name} {values:?}: {got:.2}° instead of {degrees}°"
        );
    }
    for (name, degrees) in [("ggx-mirrored", 7.5), ("ward", 9.6)] {
        let along_y = half_width(name, &[0.0, 1.0, 0.3, 0.1], true);
        assert!((along_y / degrees - 1.0).abs() < 0.04, "{name}: {along_y}");
    }
}

#[test]
fn every_model_is_described() {
    for model in MODELS {
        let says = |what: &str| model.doc.to_lowercase().contains(what);
        // Reciprocity, energy and a limit of use, in words; every shape parameter with a number or by another one.
        assert!(
            says("reciprocal") && model.reciprocal != says("not reciprocal"),
            "{}: {}",
            model.name,
            model.doc
        );
        assert!(
            ["transmit", "energy", "passes", "at most"]
                .iter()
                .any(|w| says(w)),
            "{}: nothing about energy",
            model.name
        );
        assert!(
            ["not for", "not render", "never use", "instead", "take `"]
                .iter()
                .any(|w| says(w))
                || says("a comparison model"),
            "{}: nothing about where not to use it",
            model.name
        );
        assert!(!model.equation.is_empty());
        for p in model.shape() {
            let number = p.meaning.chars().any(|c| c.is_ascii_digit());
            let other = model
                .shape()
                .any(|q| q.name != p.name && p.meaning.contains(q.name));
            assert!(number || other, "{} {}: {}", model.name, p.name, p.meaning);
        }
    }
}
