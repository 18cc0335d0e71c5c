//! Klems matrices laid out the wrong way round, and which of them can be told.

use std::path::Path;
use woven_bsdf::measured::klems::{Block, Kind, Klems};
use woven_bsdf::measured::klems_write::klems_full;

fn shipped(name: &str) -> Klems {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/measurements");
    Klems::read(&folder.join(name)).unwrap()
}

fn transpose(block: &mut Block) {
    let old = block.values.clone();
    for o in 0..145 {
        for i in 0..145 {
            block.values[o * 145 + i] = old[i * 145 + o];
        }
    }
}

#[test]
fn transposed_shade_files_are_refused() {
    for name in ["satine_5500_white_pearl.xml", "urban_loft_river_stone.xml"] {
        let file = shipped(name);
        for which in 0..file.blocks.len() {
            let mut wrong = file.clone();
            transpose(&mut wrong.blocks[which]);
            let e = Klems::parse(&wrong.to_text()).unwrap_err().to_string();
            let kind = file.blocks[which].kind.name();
            assert!(e.contains("transposed") && e.contains(kind), "{name}: {e}");
        }
        let mut wrong = file.clone();
        wrong.blocks.iter_mut().for_each(transpose);
        assert!(Klems::parse(&wrong.to_text()).is_err(), "{name} as a whole");
    }
}

#[test]
fn a_matrix_that_makes_light_only_across_is_refused() {
    // Four fifths of all light leave along the normal: no cloth, but a legal matrix. Transposed, the light of the
    // normal comes back a hundredfold.
    let patches = klems_full();
    let mut values = vec![1e-3; 145 * 145];
    for i in 0..145 {
        values[i] = (0.8 + 1e-3 * (i % 7) as f64) / patches[0].projected_solid_angle();
    }
    let mut file = Klems {
        name: "collimator".into(),
        manufacturer: String::new(),
        patches,
        blocks: vec![Block {
            band: "Visible".into(),
            kind: Kind::TransmissionFront,
            values,
        }],
    };
    Klems::parse(&file.to_text()).unwrap();
    transpose(&mut file.blocks[0]);
    // A little of every wave, so that no row is constant.
    for (i, x) in file.blocks[0].values.iter_mut().enumerate() {
        *x *= 1.0 + 0.1 * (i as f64).sin();
    }
    let e = Klems::parse(&file.to_text()).unwrap_err().to_string();
    assert!(e.contains("gives back") && e.contains("transposed"), "{e}");
}

#[test]
fn a_reciprocal_cloth_transposed_is_the_cloth_turned_over() {
    // What cannot be told is written down here: the goniometer's file transposed as a whole is that of a legal cloth.
    let mut file = shipped("mecho_6216_goniometer.xml");
    file.blocks.iter_mut().for_each(transpose);
    assert!(Klems::parse(&file.to_text()).is_ok());
}

#[test]
fn bases_must_fit() {
    let text = shipped("mecho_6216_goniometer.xml").to_text();
    let other = |from: &str, to: &str| {
        Klems::parse(&text.replacen(from, to, 1))
            .unwrap_err()
            .to_string()
    };
    let full = |tag: &str| format!("<{tag}>LBNL/Klems Full</{tag}>");
    let half = |tag: &str| format!("<{tag}>LBNL/Klems Half</{tag}>");
    let (column, row) = ("ColumnAngleBasis", "RowAngleBasis");
    let e = other(&full(row), &half(row));
    assert!(
        e.contains("Full") && e.contains("Half") && e.contains("rows"),
        "{e}"
    );
    let both = |f: &dyn Fn(&str) -> String| format!("{}\n{}", f(column), f(row));
    let e = other(&both(&full), &both(&half));
    assert!(e.contains("the file defines"), "{e}");
}
