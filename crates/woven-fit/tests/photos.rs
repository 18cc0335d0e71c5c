//! A pair of photos drawn from a known sheet: what photos can tell must come back.

use std::io::Cursor;
use woven_bsdf::model;
use woven_bsdf::vec3::Vec3;
use woven_fit::fit::Options;
use woven_fit::photos::{Photo, Setup, fit};
use woven_fit::starts::normal;

const SIDE: u32 = 192;

/// t_d, k_t, r_d, k_r, no sheen, closed weave, widths of both lobes, f0.
const SHEET: [f64; 13] = [
    0.15, 0.35, 0.35, 0.15, 0.0, 1.0, 1.0, 0.5, 0.30, 0.15, 0.35, 0.25, 0.04,
];

/// The photo as PNG bytes: light that the lamp gives times the sheet's value, 3 % of noise a pixel, eight bits.
fn draw(lamp: [f64; 3], seed: u64) -> Vec<u8> {
    let setup = Setup::default();
    let sheet = model::find("sheet").unwrap();
    let scale = setup.width / f64::from(SIDE);
    let place = |i: u32| (f64::from(i) + 0.5 - 0.5 * f64::from(SIDE)) * scale;
    let light = |i: u32, j: u32| {
        let (x, y) = (place(i), -place(j));
        let to_lamp = Vec3::new(lamp[0] - x, lamp[1] - y, lamp[2]);
        let (l, v) = (
            to_lamp.normalize(),
            Vec3::new(-x, -y, setup.camera).normalize(),
        );
        let noise = 1.0 + 0.03 * normal(seed, u64::from(j * SIDE + i));
        sheet.eval(&SHEET, l, v) * l.z.abs() / to_lamp.length_sqr() * noise
    };
    let all: Vec<f64> = (0..SIDE * SIDE)
        .map(|n| light(n % SIDE, n / SIDE))
        .collect();
    let top = all.iter().copied().fold(0.0, f64::max);
    let picture = image::GrayImage::from_fn(SIDE, SIDE, |i, j| {
        let encoded = (0.85 * all[(j * SIDE + i) as usize] / top).powf(1.0 / setup.gamma);
        image::Luma([(255.0 * encoded).round() as u8])
    });
    let mut bytes = Cursor::new(Vec::new());
    picture
        .write_to(&mut bytes, image::ImageFormat::Png)
        .unwrap();
    bytes.into_inner()
}

#[test]
fn widths_and_shares_come_back_from_a_pair_of_photos() {
    let setup = Setup {
        cell_px: 6,
        ..Setup::default()
    };
    let reflection = Photo::parse(&draw(setup.light_r, 1)).unwrap();
    let transmission = Photo::parse(&draw(setup.light_t, 2)).unwrap();
    let found = fit(&reflection, &transmission, &setup, &Options::default()).unwrap();
    for fit in [&found.transmission, &found.reflection] {
        println!("{}", woven_fit::text::parameters(fit));
    }
    // 1000 cells of 36 pixels with 3 % of noise: half a per cent a cell. Eight bits and the slope inside a cell add some per
    // cent where the lobe is steep.
    for (name, want) in [("alpha_x", 0.30), ("alpha_y", 0.15)] {
        let value = found.value(name);
        assert!(
            (value / want - 1.0).abs() < 0.05,
            "{name}: {value} for {want}"
        );
    }
    let share = found.value("k_t") / (found.value("k_t") + found.value("t_d"));
    assert!((share - 0.7).abs() < 0.05, "{share}");
    let told = found.cannot_tell().join(" ");
    assert!(told.contains("scale") && told.contains("gap") && told.contains("openness"));
    // The fabric holds what was assumed and no more light than there is.
    let fabric = found.fabric("drawn", 0.3, 0.5, "test");
    let p = &fabric.optics.parameters;
    assert!((p["t_d"] + p["k_t"] - 0.3).abs() < 1e-9);
    let lobe = p["k_r"] * (p["f0"] + (1.0 - p["f0"]) / 21.0);
    assert!((p["r_d"] + lobe - 0.5).abs() < 1e-9);
    assert!(p["t_d"] + p["k_t"] + p["r_d"] + p["k_r"] <= 1.0);
    assert!(fabric.optics().is_ok());
}

#[test]
fn bad_photos_are_sentences() {
    assert!(Photo::parse(b"no picture").is_err());
    let black = image::GrayImage::new(64, 64);
    let mut bytes = Cursor::new(Vec::new());
    black.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    let black = Photo::parse(&bytes.into_inner()).unwrap();
    let error = fit(&black, &black, &Setup::default(), &Options::default()).unwrap_err();
    assert!(error.to_string().contains("cells"), "{error}");
}
