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

/// A lace with a map, and another colour behind.
const MAPPED: &str = "name = \"lace\"\n[weave]\nwarp_diameter_mm = 0.2\nwarp_pitch_mm = 0.4\nweft_diameter_mm = 0.2\n\
    weft_pitch_mm = 0.4\nopenness_map = \"holes.png\"\n[optics]\nmodel = \"sheet\"\nparameters = { t_d = 0.3, r_d = 0.5 }\n\
    [optics.colors]\nr_d_back = [0.2, 0.4, 1.2]\n";

fn opened(folder: &Path) -> Cloth {
    std::fs::write(folder.join("lace.toml"), MAPPED).expect("the folder is ours");
    woven_render::film::write_png8(&folder.join("holes.png"), 2, 1, &[0, 0, 0, 255, 255, 255])
        .expect("it is written");
    Cloth::open(&folder.join("lace.toml")).expect("it is sound")
}

#[test]
fn a_map_and_a_back_are_shown_and_saved() {
    let folder = tempfile::tempdir().expect("there is room");
    let mut cloth = opened(folder.path());
    let woven = cloth.woven();
    let back = woven.back.expect("the file has another colour behind");
    assert_eq!((woven.linear[2], back[2]), ([0.5; 3], [0.1, 0.2, 0.6]));
    assert_eq!(back[0], woven.linear[0]);

    let pattern = cloth.pattern.clone().expect("the file names a map");
    let covered = pattern.cover(woven_render::scene::Material::matt("", [0.0; 3]));
    assert_eq!(covered.0.coverage_texture.expect("covered").texture, 0);
    assert_eq!(
        covered.1.pixels.iter().map(|p| p[3]).collect::<Vec<_>>(),
        [255, 0]
    );

    // The back follows the slider, and counts where the yarn would give more than it gets.
    let at = |name: &str| cloth.model.params.iter().position(|p| p.name == name);
    let (r_d, gamma) = (at("r_d").unwrap(), at("gamma_warp").unwrap());
    cloth.values[r_d] = 0.7;
    assert!((cloth.given() - (0.3 + 0.7 * 1.2)).abs() < 1e-12);
    cloth.values[r_d] = 0.4;
    cloth.values[gamma] = 0.8;
    let saved = cloth.fabric("another");
    assert_eq!(saved.optics.colors["r_d_back"], [0.2, 0.4, 1.2]);
    let weave = saved.weave.as_ref().expect("it names the map");
    assert!((weave.warp_diameter_mm - 0.32).abs() < 1e-12 && weave.openness_map == "holes.png");

    let other = tempfile::tempdir().expect("there is room");
    pattern.copy_to(other.path()).expect("the folder is empty");
    std::fs::write(other.path().join("a.toml"), saved.to_toml()).expect("the folder is ours");
    let again = Cloth::open(&other.path().join("a.toml")).expect("it is complete");
    assert_eq!(again.woven(), cloth.woven());
    std::fs::write(other.path().join("holes.png"), "mine").expect("the folder is ours");
    let told = pattern.copy_to(other.path()).expect_err("it lies there");
    assert!(told.to_string().contains("another picture"), "{told}");
}
