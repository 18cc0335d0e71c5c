//! Readers: the numbers of the shipped files, damaged files, round trips.

use std::path::PathBuf;
use woven_bsdf::fabric::Fabric;
use woven_bsdf::measured::csv::{Direct, Sample, Scan};
use woven_bsdf::measured::klems::{Kind, Klems};
use woven_bsdf::vec3::Vec3;

fn shipped(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../../assets/measurements")
        .join(name)
}

fn patch_at(file: &Klems, theta_deg: f64) -> usize {
    let wanted = theta_deg.to_radians();
    file.patches
        .iter()
        .position(|p| (p.theta() - wanted).abs() < 1e-6)
        .expect("a ring at that angle")
}

#[test]
#[expect(
    clippy::approx_constant,
    reason = "a transmittance of 0.3180 only looks like 1/π"
)]
fn transmittances_of_the_shipped_files() {
    // The numbers of pywincalc 3.3.1 and of the data's own notes: τ at 0, 40, 60°, straight share at 0, hemi-hemi.
    let known = [
        (
            "satine_5500_white_pearl.xml",
            [0.0959, 0.0881, 0.0847],
            0.0493,
            Some(0.08533),
            2.063833,
        ),
        (
            "urban_loft_river_stone.xml",
            [0.3180, 0.2730, 0.2138],
            0.0037,
            Some(0.24631),
            0.1550,
        ),
    ];
    for (name, tau, straight, hemi, centre) in known {
        let file = Klems::read(&shipped(name)).unwrap();
        let block = file.block("Visible", Kind::TransmissionFront).unwrap();
        for (theta, t) in [0.0, 40.0, 60.0].into_iter().zip(tau) {
            let got = file.directional(block, patch_at(&file, theta));
            assert!(
                (got - t).abs() < 1e-4,
                "{name} {theta}°: {got} instead of {t}"
            );
        }
        assert!((file.straight(block, 0) - straight).abs() < 1e-4, "{name}");
        assert!((file.value(block, 0, 0) - centre).abs() < 1e-4, "{name}");
        if let Some(h) = hemi {
            assert!((file.hemispherical(block) - h).abs() < 1e-4, "{name}");
        }
    }
    let gonio = Klems::read(&shipped("mecho_6216_goniometer.xml")).unwrap();
    let block = gonio.block("Visible", Kind::TransmissionFront).unwrap();
    assert!(
        (gonio.directional(block, 0) - 0.0179).abs() < 1e-4,
        "{}",
        gonio.directional(block, 0)
    );
    assert!((gonio.straight(block, 0) - 0.0128).abs() < 1e-4);
    let back = gonio.block("Visible", Kind::TransmissionBack).unwrap();
    assert!((gonio.directional(back, 0) - 0.0107).abs() < 1e-4);
}

#[test]
fn every_incidence_equals_its_sum() {
    for name in [
        "satine_5500_white_pearl.xml",
        "urban_loft_river_stone.xml",
        "mecho_6216_goniometer.xml",
    ] {
        let file = Klems::read(&shipped(name)).unwrap();
        // The projected solid angles anew, straight from the ring table of the format's page.
        let rings: [(f64, f64, usize); 9] = [
            (0., 5., 1),
            (5., 15., 8),
            (15., 25., 16),
            (25., 35., 20),
            (35., 45., 24),
            (45., 55., 24),
            (55., 65., 24),
            (65., 75., 16),
            (75., 90., 12),
        ];
        let omega: Vec<f64> = rings
            .iter()
            .flat_map(|&(lo, hi, n)| {
                let a = std::f64::consts::PI
                    * (hi.to_radians().sin().powi(2) - lo.to_radians().sin().powi(2))
                    / n as f64;
                std::iter::repeat_n(a, n)
            })
            .collect();
        assert_eq!(omega.len(), 145);
        for block in &file.blocks {
            for i in 0..145 {
                let sum: f64 = (0..145).map(|o| block.values[o * 145 + i] * omega[o]).sum();
                assert!(
                    (file.directional(block, i) - sum).abs() < 1e-6,
                    "{name} {}",
                    block.kind.name()
                );
            }
        }
    }
}

#[test]
fn damaged_files_are_refused_with_a_sentence() {
    let text = std::fs::read_to_string(shipped("mecho_6216_goniometer.xml")).unwrap();
    // Cut off in the middle of the XML.
    let e = Klems::parse(&text[..text.len() / 2])
        .unwrap_err()
        .to_string();
    assert!(e.contains("cut off"), "{e}");
    // A matrix with its last row gone.
    let end = text.find("</ScatteringData>").unwrap();
    let row = text[..end].trim_end().rfind('\n').unwrap();
    let short = format!("{}{}", &text[..row], &text[end..]);
    let e = Klems::parse(&short).unwrap_err().to_string();
    assert!(e.contains("145 × 145") && e.contains("cut off"), "{e}");
    // A matrix said to be the other way round.
    let e = Klems::parse(&text.replace(">Columns<", ">Rows<"))
        .unwrap_err()
        .to_string();
    assert!(e.contains("Rows") && e.contains("Columns"), "{e}");
    // A word among the numbers, no numbers, another XML, no XML.
    let e = Klems::parse(&text.replacen("<ScatteringData>", "<ScatteringData> nan ", 1))
        .unwrap_err()
        .to_string();
    assert!(e.contains("row 1, column 1"), "{e}");
    let e = Klems::parse("<a/>").unwrap_err().to_string();
    assert!(e.contains("not a Klems"), "{e}");
    assert!(Klems::parse("").is_err());
    let e = Klems::read(&shipped("none.xml")).unwrap_err().to_string();
    assert!(e.contains("none.xml"), "{e}");
}

#[test]
fn csv_round_trip() {
    let scan = Scan {
        comments: vec!["ogm merge a.ogm -o b.csv".into()],
        direct: vec![Direct {
            l: Vec3::from_angles(0.3, 0.2),
            transmittance: 0.113,
            sigma: Some(0.002),
        }],
        samples: vec![
            Sample {
                l: Vec3::from_angles(0.3, 0.2),
                v: Vec3::from_angles(3.0, -2.0),
                f: 0.0143,
                sigma: Some(2e-4),
            },
            Sample {
                l: Vec3::from_angles(0.0, 0.0),
                v: Vec3::from_angles(0.5, 1.0),
                f: 1e-7,
                sigma: None,
            },
        ],
    };
    let back = Scan::parse(&scan.to_text()).unwrap();
    assert_eq!(back.comments, scan.comments);
    assert_eq!(back.samples.len(), 2);
    for (a, b) in back.samples.iter().zip(&scan.samples) {
        assert!((a.l - b.l).length_sqr() < 1e-24 && (a.v - b.v).length_sqr() < 1e-24);
        assert_eq!((a.f, a.sigma), (b.f, b.sigma));
    }
    assert_eq!(back.direct[0].transmittance, 0.113);
    assert!((back.direct[0].l - scan.direct[0].l).length_sqr() < 1e-24);
}

#[test]
fn csv_errors_name_the_line() {
    let head = "theta_l_deg,phi_l_deg,theta_v_deg,phi_v_deg,f,sigma\n";
    for (text, needle) in [
        ("".to_owned(), "header"),
        ("a,b\n".to_owned(), "line 1"),
        (format!("{head}1,2,3,4,5\n"), "line 2: 5 columns"),
        (format!("{head}1,2,3,4,x,\n"), "\"x\""),
        (format!("{head}1,2,3,4,nan,\n"), "\"nan\""),
        (format!("{head}1,2,200,4,1,\n"), "200"),
        (format!("{head}1,2,3,4,1,0\n"), "sigma"),
        (format!("# direct,1,2\n{head}"), "line 1"),
    ] {
        let e = Scan::parse(&text).unwrap_err().to_string();
        assert!(e.contains(needle), "{e:?} lacks {needle:?}");
    }
}

#[test]
fn fabric_errors_name_the_field() {
    let with = |optics: &str| format!("name = \"x\"\n[optics]\n{optics}\n");
    for (text, needle) in [
        ("".to_owned(), "not a fabric file"),
        (with("model = \"sheeet\""), "sheeet"),
        (with("model = \"sheet\"\nparameters = { t_x = 1 }"), "t_x"),
        (
            with("model = \"sheet\"\nparameters = { t_d = -0.5 }"),
            "t_d",
        ),
        (with("model = \"sheet\"\nparameters = { t_d = nan }"), "t_d"),
        (
            with("model = \"sheet\"\nparameters = { t_d = 0.8, r_d = 0.8 }"),
            "more than the light",
        ),
        (
            with("model = \"sheet\"\nparameters = { t_d = 0.8 }\ncolors = { t_d = [1, 2, -3] }"),
            "colour of t_d",
        ),
        (with("model = \"sheet\"\nparmeters = {}"), "parmeters"),
    ] {
        let e = Fabric::from_toml(&text).unwrap_err().to_string();
        assert!(e.contains(needle), "{e:?} lacks {needle:?}");
    }
    let text = with("model = \"sheet\"\nparameters = { t_d = 0.3 }");
    let fabric = Fabric::from_toml(&text).unwrap();
    assert_eq!(Fabric::from_toml(&fabric.to_toml()).unwrap(), fabric);
}

#[test]
fn a_back_of_its_own_colour() {
    let text = |colors: &str| {
        format!(
            "name = \"x\"\n[optics]\nmodel = \"sheet\"\nparameters = {{ t_d = 0.3, r_d = 0.5 }}\n[optics.colors]\n{colors}\n"
        )
    };
    let fabric =
        Fabric::from_toml(&text("r_d = [1, 0.9, 0.8]\nr_d_back = [0.1, 0.2, 0.3]")).unwrap();
    let (face, back) = (fabric.optics().unwrap(), fabric.optics_back().unwrap());
    assert_eq!(
        (face.linear[2], back.linear[2]),
        ([0.5, 0.45, 0.4], [0.05, 0.1, 0.15])
    );
    // Transmission is one and the same, as reciprocity wants it.
    assert_eq!((face.linear[0], face.shape), (back.linear[0], back.shape));
    assert_eq!(Fabric::from_toml(&fabric.to_toml()).unwrap(), fabric);
    // Without a second colour both sides are alike.
    let plain = Fabric::from_toml(&text("r_d = [1, 0.9, 0.8]")).unwrap();
    assert_eq!(
        plain.optics_back().unwrap().linear,
        plain.optics().unwrap().linear
    );
    for (colors, needle) in [
        ("t_d_back = [1, 1, 1]", "t_d_back"),
        ("r_d_back = [2, 1, 1]", "more than the light"),
        ("r_d_back = [-1, 1, 1]", "colour of r_d"),
    ] {
        let e = Fabric::from_toml(&text(colors)).unwrap_err().to_string();
        assert!(e.contains(needle), "{e:?} lacks {needle:?}");
    }
}

#[test]
fn absorption_of_the_yarn() {
    let text = |colors: &str| {
        format!(
            "name = \"x\"\n[optics]\nmodel = \"sheet\"\nparameters = {{ t_d = 0.3, k_t = 0.2, r_d = 0.4 }}\n[optics.colors]\n{colors}\n"
        )
    };
    let plain = Fabric::from_toml(&text("t_d = [1, 0.5, 1]")).unwrap();
    let dyed = Fabric::from_toml(&text("t_d = [1, 0.5, 1]\ntau = [0, 0.7, 2]")).unwrap();
    let (a, b) = (plain.optics().unwrap(), dyed.optics().unwrap());
    for (c, tau) in [0.0f64, 0.7, 2.0].into_iter().enumerate() {
        // The paper's e^-τ on both transmitted factors, nothing on what is reflected; the gap has no colour at all.
        for (j, left) in [(0, (-tau).exp()), (1, (-tau).exp()), (2, 1.0)] {
            assert!((b.linear[j][c] - a.linear[j][c] * left).abs() < 1e-15);
        }
    }
    assert_eq!(a.shape, b.shape);
    assert!(dyed.provenance["tau"].contains("0.7"));
    // Written and read again it is the same cloth, not one that absorbs twice.
    assert_eq!(Fabric::from_toml(&dyed.to_toml()).unwrap(), dyed);
    let e = Fabric::from_toml(&text("tau = [0, -1, 0]")).unwrap_err();
    assert!(e.to_string().contains("optical depth"), "{e}");
}
