//! The RGL reader against a material made here: GGX's own visible normals as the warp.

use crate::made::{RGL_ALPHA as ALPHA, rgl as material, rgl_sigma as sigma, rgl_theta as theta_i};
use crate::support::{Rng, chi2_exceeds};
use std::f64::consts::TAU;
use woven_bsdf::measured::rgl::Rgl;
use woven_bsdf::term::ggx;
use woven_bsdf::vec3::Vec3;

#[test]
fn values_are_those_of_the_microfacets() {
    let rgl = Rgl::parse(&material(1, 96, 256)).unwrap();
    assert_eq!((rgl.channels(), rgl.description.as_str()), (3, "test"));
    let mut rng = Rng::new(111);
    let mut worst = 0.0f64;
    for _ in 0..2000 {
        let turn = TAU * rng.unit();
        let l = Vec3::from_angles(1.3 * rng.unit(), turn);
        let v = Vec3::from_angles(1.3 * rng.unit(), TAU * rng.unit());
        let d = ggx::d((l + v).normalize(), ALPHA, ALPHA);
        let wanted = d / (4.0 * sigma(l) * v.z);
        worst = worst.max((rgl.eval(l, v, 2) / wanted - 1.0).abs());
    }
    println!("RGL against D/(4 σ cosθ): worst {worst:.1e}");
    // Linear between 256 places of D and σ: the second derivative times (1/255)²/8.
    assert!(worst < 5e-3, "{worst}");
    let down = Vec3::new(0.0, 0.0, -1.0);
    assert_eq!(rgl.eval(down, -down, 0), 0.0);
    assert_eq!(rgl.eval(-down, -down, 3), 0.0);
}

#[test]
fn the_warp_makes_visible_normals_even() {
    let rgl = Rgl::parse(&material(0, 96, 256)).unwrap();
    for (setting, k) in [0, 4].into_iter().enumerate() {
        let mut rng = Rng::new(112 + setting as u64);
        let l = Vec3::from_angles(theta_i(k).max(1e-4), 1.0);
        const N: usize = 20_000;
        let (mut counts, mut lost) = ([0.0f64; 64], 0);
        for _ in 0..N {
            let m = ggx::visible_normal(l, ALPHA, ALPHA, rng.unit(), rng.unit());
            let v = m * (2.0 * l.dot(m)) - l;
            if v.z < 0.02 {
                // A value below the horizon cannot be asked for; such normals lie in the last eighth of x.
                lost += 1;
                continue;
            }
            let (x, y) = (rgl.eval(l, v, 0) * v.z, rgl.eval(l, v, 1) * v.z);
            assert!((-1e-6..=1.0 + 1e-6).contains(&x) && (-1e-6..=1.0 + 1e-6).contains(&y));
            counts[((x * 8.0) as usize).min(7) * 8 + ((y * 8.0) as usize).min(7)] += 1.0;
        }
        let e = N as f64 / 64.0;
        let x2: f64 = counts[..56].iter().map(|c| (c - e).powi(2) / e).sum();
        let p = chi2_exceeds(x2, 56);
        println!(
            "θ {:.2}: χ² {x2:.0} of 56 bins, p = {p:.3}, {lost} below the horizon",
            theta_i(k)
        );
        assert!(p > 5e-3, "{p}: {counts:?}");
    }
}

#[test]
fn damaged_files_get_a_sentence() {
    let file = material(1, 8, 8);
    let with = |from: &[u8], to: &[u8]| {
        let at = file.windows(from.len()).position(|w| w == from).unwrap();
        let mut f = file.clone();
        f[at..at + to.len()].copy_from_slice(to);
        f
    };
    for (bytes, needle) in [
        (b"tensor".to_vec(), "too short"),
        (with(b"tensor", b"sensor"), "no RGL"),
        (file[..40].to_vec(), "cut off"),
        (file[..file.len() - 1].to_vec(), "outside the file"),
        (with(b"vndf", b"xndf"), "no field \"vndf\""),
        (with(b"rgb", b"rgx"), "no field \"rgb\""),
        (with(&1.4f32.to_le_bytes(), &f32::NAN.to_le_bytes()), "NaN"),
        (
            with(&1.4f32.to_le_bytes(), &0.1f32.to_le_bytes()),
            "do not rise",
        ),
    ] {
        let e = Rgl::parse(&bytes).unwrap_err().to_string();
        assert!(e.contains(needle), "{e:?} lacks {needle:?}");
    }
}
