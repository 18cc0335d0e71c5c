//! Klems files written and read back; the numbers by which cloth is sold, there and back.

use crate::support::flux;
use std::f64::consts::FRAC_PI_8;
use std::path::Path;
use woven_bsdf::fabric::Fabric;
use woven_bsdf::measured::klems::{Kind, Klems};
use woven_bsdf::measured::klems_write::klems_full;
use woven_bsdf::measured::shop::{Shop, fabric_from_card};
use woven_bsdf::model::dot;
use woven_bsdf::sheet::Sheet;
use woven_bsdf::vec3::Vec3;

const FILES: [&str; 3] = [
    "satine_5500_white_pearl.xml",
    "urban_loft_river_stone.xml",
    "mecho_6216_goniometer.xml",
];

fn shipped(name: &str) -> Klems {
    Klems::read(
        &Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../../assets/measurements")
            .join(name),
    )
    .unwrap()
}

#[test]
fn klems_files_survive_a_round_trip_to_the_bit() {
    for name in FILES {
        let file = shipped(name);
        let back = Klems::parse(&file.to_text()).unwrap();
        assert_eq!(file, back, "{name}");
        for (a, b) in file.blocks.iter().zip(&back.blocks) {
            assert!(
                a.values
                    .iter()
                    .zip(&b.values)
                    .all(|(a, b)| a.to_bits() == b.to_bits())
            );
        }
        assert_eq!(file.patches, klems_full(), "{name} has the full basis");
    }
    // Letters that XML reserves, and both bands.
    let mut odd = shipped(FILES[0]);
    odd.name = "a < b & \"c\" > d".into();
    assert_eq!(Klems::parse(&odd.to_text()).unwrap(), odd);
    assert!(
        odd.block("Solar", Kind::TransmissionFront).is_some(),
        "the shade files have a solar block"
    );
}

#[test]
fn numbers_of_the_shipped_cloths() {
    let satine = Shop::of_klems(&shipped(FILES[0]), "Visible").unwrap();
    println!("satine {satine:?}, clarity {:.3}", satine.clarity());
    // The maker states 5 % openness (4.99 in the file); the file's own sum at normal incidence is 0.0959.
    assert!(
        (satine.tau_nn - 0.0499).abs() < 1.5e-3
            && (satine.tau_nn + satine.tau_nd - 0.0959).abs() < 1e-4
    );
    assert!((satine.tau_dd - 0.08533).abs() < 1e-4);
    let gonio = Shop::of_klems(&shipped(FILES[2]), "Visible").unwrap();
    println!("goniometer {gonio:?}, clarity {:.3}", gonio.clarity());
    assert!(
        (0.65..0.75).contains(&gonio.clarity()),
        "about 70 % of it goes straight on"
    );
    assert!(Shop::of_klems(&shipped(FILES[2]), "Solar").is_err());
}

#[test]
fn a_sheets_card_counts_every_factor() {
    // Against all of the sheet's value at once, integrated by other means than the card's.
    let fabric = Fabric::from_toml(
        "name = \"velvet\"\n[optics]\nmodel = \"sheet\"\nparameters = { t_d = 0.2, k_t = 0.1, r_d = 0.3, k_r = 0.1, sheen = 0.3, \
         gamma_warp = 0.7, gamma_weft = 0.8, alpha_x = 0.3, alpha_y = 0.2 }\n",
    )
    .unwrap();
    let optics = fabric.optics().unwrap();
    let k: [f64; 8] = optics.linear.map(|c| c[1]);
    let total = |l: Vec3<f64>, through: bool| {
        let f = |v: Vec3<f64>| dot(&k, &(optics.model.f64.basis)(&optics.shape, l, v));
        flux(&f, l, through, Some((0.3, 0.3)), (300, 96))
    };
    let [_, card, _] = Shop::of_sheet(&optics).unwrap();
    let normal = Vec3::new(0.0, 0.0, 1.0);
    // Both are midpoints in two dimensions: 64 × 32 for the card.
    for (got, known) in [
        (card.tau_nd, total(normal, true)),
        (card.rho_n, total(normal, false)),
    ] {
        assert!((got - known).abs() < 1e-3, "{got} instead of {known}");
    }
    // Even light: 24 incidences even in projected solid angle, four azimuths each.
    let (mut t, mut r) = (0.0, 0.0);
    for i in 0..96 {
        let theta = ((f64::from(i / 4) + 0.5) / 24.0).sqrt().asin();
        let l = Vec3::from_angles(theta, (f64::from(i % 4) + 0.5) * FRAC_PI_8);
        let one = |through| {
            flux(
                &|v| dot(&k, &(optics.model.f64.basis)(&optics.shape, l, v)),
                l,
                through,
                Some((0.3, 0.3)),
                (100, 32),
            )
        };
        t += (one(true) + Sheet::gap(&optics.shape, l)) / 96.0;
        r += one(false) / 96.0;
    }
    println!(
        "even light: {t:.4} {r:.4}, card {:.4} {:.4}",
        card.tau_dd, card.rho_dd
    );
    assert!(
        (card.tau_dd - t).abs() < 3e-3 && (card.rho_dd - r).abs() < 3e-3,
        "{card:?}, {t} {r}"
    );
}

#[test]
fn a_makers_card_becomes_a_fabric_and_a_card_again() {
    for (openness, tau, rho) in [
        (0.05, 0.12, 0.6),
        (0.0, 0.3, 0.5),
        (0.5, 0.5, 0.2),
        (0.01, 0.03, 0.04),
    ] {
        let fabric = fabric_from_card("card", openness, tau, rho).unwrap();
        let [card, ..] = Shop::of_sheet(&fabric.optics().unwrap()).unwrap();
        assert!((card.tau_nn - openness).abs() < 1e-12, "{card:?}");
        // Midpoints in cosθ of a constant are exact; the mean cover of flat yarns is too.
        assert!(
            (card.tau_nn + card.tau_nd - tau).abs() < 1e-6 && (card.rho_n - rho).abs() < 1e-6,
            "{card:?}"
        );
        assert!(card.tau_dd + card.rho_dd <= 1.0 + 2e-3, "{card:?}");
    }
    for (o, t, r, needle) in [
        (0.2, 0.1, 0.1, "openness"),
        (0.1, 0.6, 0.6, "tau + rho"),
        (-0.1, 0.6, 0.1, "openness"),
        (0.1, f64::NAN, 0.1, "tau"),
    ] {
        let e = fabric_from_card("x", o, t, r).unwrap_err().to_string();
        assert!(e.contains(needle), "{e}");
    }
}
