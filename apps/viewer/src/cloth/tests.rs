//! Cloths from files, on sliders, and back into files.

use super::*;
use woven_bsdf::model::MODELS;

const LACE: &str = "name = \"lace\"\n[optics]\nmodel = \"sheet\"\n\
    parameters = { t_d = 0.3, k_t = 0.1, r_d = 0.5, gamma_warp = 0.5, gamma_weft = 0.4 }\n\
    [optics.colors]\nr_d = [1.0, 0.9, 0.8]\n[mechanics]\nareal_density_kg_m2 = 0.1\n";

#[test]
fn the_window_opens_with_linen() {
    let cloth = Cloth::default();
    assert!(cloth.model.name == "sheet" && cloth.name().contains("linen") && cloth.given() < 1.0);
}

#[test]
fn what_is_saved_is_what_was_seen() {
    for model in MODELS {
        let mut cloth = Cloth::default();
        cloth.choose(model);
        for (i, p) in model.params.iter().enumerate() {
            cloth.values[i] = p.min + (p.max - p.min) * 0.3;
            cloth.colors[i] = [1.0, 0.5, 0.25];
        }
        let text = cloth.fabric("again").to_toml();
        let back = Cloth::of(Fabric::from_toml(&text).expect("its own files are read"))
            .expect("and are sound");
        let ((a, s), (b, t)) = (cloth.optics(), back.optics());
        for (x, y) in a
            .iter()
            .flatten()
            .chain(&s)
            .zip(b.iter().flatten().chain(&t))
        {
            assert!(
                (x - y).abs() < 1e-12 * x.abs().max(1.0),
                "{}: {x} {y}",
                model.name
            );
        }
    }
}

#[test]
fn reset_goes_back_to_the_file() {
    let mut cloth = Cloth::of(Fabric::from_toml(LACE).expect("it is sound")).expect("it is sound");
    let (before, r_d) = (cloth.values.clone(), 2);
    assert!(!cloth.changed() && cloth.values[r_d] == 0.5);
    cloth.values[r_d] = 0.1;
    assert!(cloth.changed() && cloth.start_of(r_d) == 0.5);
    cloth.reset();
    assert_eq!(cloth.values, before);
    assert_eq!(cloth.mechanics()["areal_density_kg_m2"], 0.1);
}

#[test]
fn a_yarn_never_gives_more_than_it_gets() {
    let mut cloth = Cloth::default();
    for (i, _) in cloth.params(Role::Linear) {
        cloth.values[i] = 1.0;
        cloth.colors[i] = [1.0; 3];
    }
    assert_eq!(cloth.given(), 5.0);
    let sum: f64 = cloth.optics().0.iter().map(|k| k[1]).sum();
    assert!((sum - 1.0).abs() < 1e-12);
    assert!(Fabric::from_toml(&cloth.fabric("full").to_toml()).is_ok());
}
