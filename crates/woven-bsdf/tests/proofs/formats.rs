//! Readers of other instruments' and databases' files: made here number by number, read back, damaged.

use crate::made::{PAB, PAB_XYZ, merl as merl_file};
use crate::support::Rng;
use std::f64::consts::{FRAC_PI_2, PI};
use woven_bsdf::measured::csv::{Direct, Sample, Scan};
use woven_bsdf::measured::merl::{Merl, half_difference};
use woven_bsdf::measured::pab::{Pab, Quantity};
use woven_bsdf::measured::scattered::{Scattered, Symmetry};
use woven_bsdf::measured::table::Tabulated;
use woven_bsdf::model::find;
use woven_bsdf::vec3::Vec3;

#[test]
fn pab_text() {
    let pab = Pab::parse(PAB).unwrap();
    assert_eq!((pab.name.as_str(), pab.incident), ("lace 3", [30.0, 0.0]));
    assert_eq!((pab.channels, pab.up_phi), (1, 90.0));
    assert_eq!(pab.points[1], [150.0, 90.5, 1e-3, 0.0, 0.0]);
    assert_eq!(Pab::parse(&pab.to_text()).unwrap(), pab);
    let scan = pab.scan();
    // Straight on: the detector stands opposite to the lamp.
    let [first, _] = scan.samples[..] else {
        panic!("two samples")
    };
    assert!((first.l + first.v).length_sqr() < 1e-24 && first.f == 0.52);
    // Scan and back.
    let again = Pab::from_scan("lace 3", &scan);
    assert_eq!(again.len(), 1);
    for (a, b) in again[0].scan().samples.iter().zip(&scan.samples) {
        assert!((a.v - b.v).length_sqr() < 1e-24 && a.f == b.f);
    }
    // Colours, another up, and values times the cosine.
    let pab = Pab::parse(PAB_XYZ).unwrap();
    assert_eq!((pab.channels, pab.quantity), (3, Quantity::Dsf));
    assert_eq!(Pab::parse(&pab.to_text()).unwrap(), pab);
    let scan = pab.scan();
    assert_eq!(scan.samples.len(), 1, "grazing is left out");
    let s = scan.samples[0];
    // Up is the azimuth 0 here, so the detector's 10° lie at 100° from the weft; luminance is Y, over cos 120°.
    let v = Vec3::from_angles(2.0 * PI / 3.0, 100f64.to_radians());
    assert!((s.v - v).length_sqr() < 1e-24 && (s.f - 4.0).abs() < 1e-12);
}

#[test]
fn pab_errors_name_the_line() {
    for (text, needle) in [
        ("", "incidence"),
        ("#incident_angle 0 0\n", "format"),
        ("#incident_angle 0\n", "line 1: 1 numbers"),
        ("#colorimetry: RGB\n", "\"RGB\""),
        // Found by the fuzzer: colours that begin behind the first point.
        (
            "#incident_angle 0 0\n#format: theta phi BSDF\n1 2 3\n#colorimetry: CIE-XYZ\n",
            "line 4: \"colorimetry\"",
        ),
        ("#intheta x\n", "\"x\""),
        ("#incident_angle 200 0\n#format: theta phi BSDF\n", "200"),
        ("#format: phi theta BSDF\n", "line 1: the format"),
        (
            "#incident_angle 0 0\n#format: theta phi BSDF\n1 2\n",
            "line 3: 2 numbers",
        ),
        (
            "#incident_angle 0 0\n#format: theta phi BSDF\n1 2 3 4\n",
            "\"4\"",
        ),
        (
            "#incident_angle 0 0\n#format: theta phi BSDF\n181 2 3\n",
            "181",
        ),
        (
            "#incident_angle 0 0\n#format: theta phi BSDF\n1 2 nan\n",
            "nan",
        ),
    ] {
        let e = Pab::parse(text).unwrap_err().to_string();
        assert!(e.contains(needle), "{e:?} lacks {needle:?}");
    }
}

#[test]
fn merl_binary() {
    const N: [usize; 3] = [9, 10, 18];
    let value = |[h, d, p]: [usize; 3], c: usize| {
        1500.0 * (0.1 + h as f64 + 0.1 * d as f64 + 0.01 * p as f64) * (1.0 + c as f64)
    };
    let merl = Merl::parse(&merl_file(N, value)).unwrap();
    let mut rng = Rng::new(101);
    let up = |w: Vec3<f64>| Vec3::new(w.x, w.y, w.z.abs());
    for _ in 0..10_000 {
        let (l, v) = (up(rng.direction(0.01)), up(rng.direction(0.01)));
        // The angles another way: h and a frame about it by cross products.
        let h = (l + v).normalize();
        let theta_h = h.z.acos();
        let theta_d = l.dot(h).acos();
        let along = Vec3::new(h.x * h.z, h.y * h.z, h.z * h.z - 1.0).normalize();
        let across = Vec3::new(
            h.y * along.z - h.z * along.y,
            h.z * along.x - h.x * along.z,
            h.x * along.y - h.y * along.x,
        );
        let phi_d = l.dot(across).atan2(l.dot(along));
        let (a, b, c) = half_difference(l, v);
        assert!((a - theta_h).abs() < 1e-6 && (b - theta_d).abs() < 1e-6);
        assert!((c - phi_d).sin().abs() < 1e-6 && (c - phi_d).cos() > 0.0);
        let bin = [
            ((theta_h / FRAC_PI_2).sqrt() * 9.0) as usize,
            (theta_d / FRAC_PI_2 * 10.0) as usize,
            (phi_d.rem_euclid(PI) / PI * 18.0) as usize,
        ];
        let got = merl.eval(l, v);
        for (channel, scale) in [1.0, 1.15, 1.66].into_iter().enumerate() {
            let wanted = value(bin, channel) / 1500.0 * scale;
            // Stored in single precision; the last bin's border may fall either way.
            let border = [
                theta_h / FRAC_PI_2 * 81.0,
                theta_d * 20.0 / PI,
                phi_d * 18.0 / PI,
            ];
            let near = border.iter().any(|x| (x - x.round()).abs() < 1e-4)
                || ((theta_h / FRAC_PI_2).sqrt() * 9.0).fract() > 0.9999;
            assert!(
                near || (got[channel] / wanted - 1.0).abs() < 1e-6,
                "{bin:?}"
            );
        }
        assert_eq!(merl.eval(v, l), got, "half a turn of φ_d is the same pair");
        assert_eq!(merl.eval(-l, v), [0.0; 3]);
    }
    let negative = Merl::parse(&merl_file([1, 1, 1], |_, _| -1.0)).unwrap();
    assert_eq!(
        negative.eval(Vec3::new(0.0, 0.0, 1.0), Vec3::new(0.0, 0.0, 1.0)),
        [0.0; 3]
    );
}

#[test]
fn merl_errors() {
    let file = merl_file([2, 2, 2], |_, _| 1.0);
    let with = |at: usize, x: i32| {
        let mut f = file.clone();
        f[at..at + 4].copy_from_slice(&x.to_le_bytes());
        f
    };
    for (bytes, needle) in [
        (file[..5].to_vec(), "no MERL"),
        (file[..file.len() - 1].to_vec(), "cut off"),
        (with(0, -2), "-2"),
        (with(4, 0), "× 0"),
        (with(8, i32::MAX), "2147483647"),
        (merl_file([1, 1, 1], |_, _| f64::NAN), "NaN"),
    ] {
        let e = Merl::parse(&bytes).unwrap_err().to_string();
        assert!(e.contains(needle), "{e:?} lacks {needle:?}");
    }
}

/// A scan of `ggx-mirrored` every ten degrees of incidence in one azimuth, the plane and beside it.
fn scan_of_ggx(values: &[f64]) -> Scan {
    let ggx = find("ggx-mirrored").unwrap();
    let mut scan = Scan::default();
    for i in 0..=7 {
        let l = Vec3::from_angles(f64::from(i) * PI / 18.0, 0.0);
        for a in -21..=21 {
            for b in -21..=21 {
                let (x, y) = (f64::from(a) / 21.5, f64::from(b) / 21.5);
                if x * x + y * y < 0.99 {
                    let v = Vec3::new(x, y, -(1.0 - x * x - y * y).sqrt());
                    scan.samples.push(Sample {
                        l,
                        v,
                        f: ggx.eval(values, l, v),
                        sigma: None,
                    });
                }
            }
        }
        scan.direct.push(Direct {
            l,
            transmittance: 0.1 * l.z,
            sigma: None,
        });
    }
    scan
}

#[test]
fn scattered_points_carry_their_peak_along() {
    let values = [0.1, 0.5, 0.15, 0.15];
    let ggx = find("ggx-mirrored").unwrap();
    let scan = scan_of_ggx(&values);
    let points = Scattered::new(&scan, Symmetry::Isotropic).unwrap();
    // At a measured place the measured value.
    for s in scan.samples.iter().step_by(31) {
        assert!((points.eval(s.l, s.v) - s.f).abs() < 1e-3 * s.f, "{s:?}");
    }
    // Between the incidences and at another azimuth: the peak stands where the light goes, at its height.
    for deg in [5.0, 15.0, 25.0, 35.0, 45.0] {
        let l = Vec3::from_angles(f64::to_radians(deg), 2.0);
        let (got, wanted) = (points.eval(l, -l), ggx.eval(&values, l, -l));
        println!("peak at {deg}°: {got:.4} of {wanted:.4}");
        // The peak's height changes by 1/cos²; halfway between 40° and 50° linear mixing is 3 % off.
        assert!((got / wanted - 1.0).abs() < 0.05, "{deg}°: {got} {wanted}");
        assert!((points.gap(l) - 0.1 * l.z).abs() < 2e-3);
    }
    // As a table: the transmittance per incidence is that of the model, gap included.
    let file = points.to_klems("ggx");
    let block = &file.blocks[0];
    for i in [0, 3, 12, 30, 50] {
        let l = block.kind.l((file.patches[i].theta(), file.patches[i].phi));
        let lobe = crate::support::flux(
            &|v| ggx.eval(&values, l, v),
            l,
            true,
            Some((0.15, 0.15)),
            (200, 100),
        );
        let got = file.directional(block, i);
        println!("patch {i}: {got:.4} of {:.4}", lobe + 0.1 * l.z);
        assert!((got / (lobe + 0.1 * l.z) - 1.0).abs() < 0.04, "{i}: {got}");
    }
    let table = Tabulated::new(&file, "Visible").unwrap();
    assert!(table.eval(Vec3::new(0.0, 0.0, 1.0), Vec3::new(0.6, 0.0, -0.8)) > 0.0);
    assert!(Scattered::new(&Scan::default(), Symmetry::None).is_err());
}
