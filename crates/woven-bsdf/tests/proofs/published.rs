//! Numbers known from elsewhere: Walter's lobe from another implementation, norms, the paper's formulas as printed.

use crate::support::{Rng, flux};
use std::f64::consts::PI;
use woven_bsdf::angles::radians;
use woven_bsdf::model::{MODELS, find};
use woven_bsdf::term::{beckmann, fresnel, ggx};
use woven_bsdf::vec3::Vec3;

/// Made by `tests/walter_mitsuba.py`.
const MITSUBA: &str = include_str!("walter_mitsuba.csv");

#[test]
fn walter_agrees_with_mitsuba() {
    let model = find("ggx-walter").unwrap();
    let mut worst = 0.0f64;
    let rows: Vec<Vec<f64>> = MITSUBA
        .lines()
        .skip(2)
        .map(|line| line.split(',').map(|x| x.parse().unwrap()).collect())
        .collect();
    for row in &rows {
        let &[alpha, n, tl, pl, tv, pv, f] = &row[..] else {
            panic!("{row:?} has not seven columns")
        };
        let l = Vec3::from_angles(radians(tl), radians(pl));
        let v = Vec3::from_angles(radians(tv), radians(pv));
        let got = model.eval(&[0.0, 1.0, alpha, n], l, v);
        worst = worst.max((got / f - 1.0).abs());
    }
    println!(
        "ggx-walter against mitsuba: worst relative difference {worst:.1e} of {}",
        rows.len()
    );
    // Mitsuba's scalar variant computes in single precision.
    assert!(rows.len() > 30 && worst < 1e-5, "{worst:e}");
}

#[test]
fn walter_is_not_reciprocal_by_n_squared() {
    let model = find("ggx-walter").unwrap();
    let mut rng = Rng::new(71);
    let mut seen = 0;
    while seen < 1000 {
        let n = 1.1 + rng.unit();
        let (alpha, tl) = (0.05 + 0.9 * rng.unit(), 1.2 * rng.unit());
        let l = Vec3::from_angles(tl, 0.3);
        let v = Vec3::from_angles(
            PI - (tl.sin() / n).asin() + 0.1 * (rng.unit() - 0.5),
            PI + 0.3,
        );
        // The light in the dense medium and the viewer in air: exchange the roles, the geometry stays.
        let f = model.eval(&[0.0, 1.0, alpha, n], l, v);
        let back = dense_to_air(v, l, alpha, n);
        if f < 1e-6 {
            continue;
        }
        seen += 1;
        // Veach 1997, (5.14): f(l→v)/n_v² = f(v→l)/n_l².
        assert!(
            (f / (n * n * back) - 1.0).abs() < 1e-9,
            "{f} against {back} at n = {n}"
        );
    }
}

/// Walter's (21) with the light in the medium of index n and the viewer in air, written out anew.
fn dense_to_air(l: Vec3<f64>, v: Vec3<f64>, alpha: f64, n: f64) -> f64 {
    // Towards the viewer's side, which is up.
    let h = -(l * n + v).normalize();
    let (lh, vh) = (l.dot(h), v.dot(h));
    // Fresnel is the same from both sides of one refracted pair; from the air side it needs no total reflection.
    let pass = 1.0 - fresnel::dielectric(vh.abs(), n);
    let d = ggx::d(Vec3::new(h.x, h.y, h.z.abs()), alpha, alpha);
    let g = ggx::g1(l, alpha, alpha) * ggx::g1(v, alpha, alpha);
    (lh * vh / (l.z * v.z)).abs() * pass * g * d / (n * lh + vh).powi(2)
}

#[test]
fn distributions_have_norm_one() {
    for i in 0..=12 {
        let alpha = 0.02 * 50f64.powf(f64::from(i) / 12.0);
        // ∫ D cosθ dω over t = tan²θ/(α² + tan²θ), in which GGX is even.
        let norm = |d: &dyn Fn(f64) -> f64| {
            const N: usize = 20_000;
            (0..N)
                .map(|k| {
                    let u = (k as f64 + 0.5) / N as f64;
                    let tan2 = alpha * alpha * u / (1.0 - u);
                    let cos2 = 1.0 / (1.0 + tan2);
                    // dω cosθ = π d(sin²θ) = π cos⁴θ d(tan²θ), d(tan²θ) = α²/(1-u)² du.
                    d(cos2.sqrt()) * PI * cos2 * cos2 * alpha * alpha / (1.0 - u).powi(2) / N as f64
                })
                .sum::<f64>()
        };
        let ggx = norm(&|c| ggx::d(Vec3::new((1.0 - c * c).sqrt(), 0.0, c), alpha, alpha));
        let beckmann = norm(&|c| beckmann::d(c, alpha));
        assert!((ggx - 1.0).abs() < 1e-4, "GGX {alpha}: {ggx}");
        assert!(
            (beckmann - 1.0).abs() < 1e-4,
            "Beckmann {alpha}: {beckmann}"
        );
        // Stretched: by quadrature over the two slopes, tan = radius.
        const N: usize = 600;
        let (ax, ay) = (alpha, 0.3);
        let mut sum = 0.0;
        for k in 0..N * 32 {
            let u = ((k / 32) as f64 + 0.5) / N as f64;
            let phi = ((k % 32) as f64 + 0.5) / 32.0 * 2.0 * PI;
            let r = (u / (1.0 - u)).sqrt();
            let h = Vec3::new(ax * r * phi.cos(), ay * r * phi.sin(), 1.0).normalize();
            // Slope area: r dr dφ = ½ d(r²) dφ; D cosθ dω = D cos⁴θ dA.
            sum += ggx::d(h, ax, ay) * h.z.powi(4) * ax * ay * PI / (1.0 - u).powi(2);
        }
        let norm = sum / (N * 32) as f64;
        assert!(
            (norm - 1.0).abs() < 1e-4,
            "anisotropic GGX {ax}, {ay}: {norm}"
        );
    }
}

#[test]
fn fresnel_lies_between_zero_and_one() {
    for i in 0..=1000 {
        let c = f64::from(i) / 1000.0;
        for eta in [0.4, 0.667, 1.0, 1.1, 1.5, 2.4] {
            let f = fresnel::dielectric(c, eta);
            assert!((0.0..=1.0 + 1e-12).contains(&f), "F({c}, {eta}) = {f}");
        }
        let s = fresnel::schlick(c, 0.04);
        assert!((0.04..=1.0).contains(&s));
    }
    // Born and Wolf: ((n-1)/(n+1))² along the normal, 1 at grazing and beyond the critical angle.
    assert!((fresnel::dielectric(1.0f64, 1.5) - 0.04).abs() < 1e-12);
    assert!((fresnel::dielectric(0.0f64, 1.5) - 1.0).abs() < 1e-12);
    assert!((fresnel::dielectric(radians(42.0).cos(), 1.0 / 1.5) - 1.0).abs() < 1e-12);
}

/// The transmittance of a beam at incidence `deg`, for a model without floor.
fn transmittance(name: &str, values: &[f64], deg: f64, widths: (f64, f64)) -> f64 {
    let model = find(name).unwrap();
    let l = Vec3::from_angles(radians(deg), 0.0);
    flux(
        &|v| model.eval(values, l, v),
        l,
        true,
        Some(widths),
        (500, 400),
    )
}

#[test]
fn transmittances_of_the_audit() {
    // The theory's page gives three digits, for n = 1.5 at 0° and 50°. Mitsuba 3.9.1 on 333 × 666 directions gives
    // 0.8556 for the last, so the 0.854 printed there is taken to be 0.002 too small.
    for (alpha, at_0, at_50) in [
        (0.1, 0.959, 0.938),
        (0.3, 0.953, 0.917),
        (0.6, 0.931, 0.854),
    ] {
        for (deg, known) in [(0.0, at_0), (50.0, at_50)] {
            let t = transmittance(
                "ggx-walter",
                &[0.0, 1.0, alpha, 1.5],
                deg,
                (0.3 * alpha, 0.3 * alpha),
            );
            println!("ggx-walter alpha {alpha} at {deg}°: {t:.4}");
            assert!(
                (t - known).abs() < 1e-3 || (known == 0.854 && (t - 0.8556).abs() < 1e-3),
                "alpha {alpha}, {deg}°: {t} instead of {known}"
            );
        }
    }
    let literal = transmittance("paper-literal", &[1.0, 0.1, 1.5], 0.0, (0.1, 0.1));
    println!("paper-literal alpha 0.1 at 0°: {literal:.4}");
    assert!((literal - 7.22).abs() < 5e-3, "{literal}");
    // M loses to masking: 0.59 at alpha 0.6.
    let mirrored = transmittance("ggx-mirrored", &[0.0, 1.0, 0.6, 0.6], 0.0, (0.6, 0.6));
    assert!((mirrored - 0.59).abs() < 5e-3, "{mirrored}");
}

#[test]
fn nothing_but_the_literal_form_gains_energy() {
    let mut rng = Rng::new(72);
    for model in MODELS {
        // Hgf is a phase function without a cosine, Ward grows at grazing angles; their pages say so.
        if ["hgf", "ward", "paper-literal", "sheet"].contains(&model.name) {
            continue;
        }
        let mut worst = 0.0f64;
        for _ in 0..20 {
            let mut values = rng.parameters(model, 0.1);
            // The lobe alone, at full strength.
            for (p, x) in model.params.iter().zip(&mut values) {
                if p.role == woven_bsdf::model::Role::Linear {
                    *x = if p.name == "k_d" { 0.0 } else { 1.0 };
                }
            }
            if model.name == "lambert" {
                values[0] = 1.0;
            }
            let l = rng.direction(0.05);
            let t = flux(
                &|v| model.eval(&values, l, v),
                l,
                true,
                Some((0.15, 0.15)),
                (200, 100),
            );
            worst = worst.max(t);
        }
        println!("{}: transmits at most {worst:.4}", model.name);
        assert!(worst < 1.003, "{}: {worst}", model.name);
    }
}

/// Two rough interfaces by Monte Carlo: the median deviation of a beam along the normal, in radians.
fn slab_median(alpha: f64, n: f64, rng: &mut Rng) -> f64 {
    let refract = |d: Vec3<f64>, m: Vec3<f64>, eta: f64| {
        // `d` travels down, `m` points up; eta = index before over index behind.
        let c = -d.dot(m);
        let k = 1.0 - eta * eta * (1.0 - c * c);
        (c > 0.0 && k > 0.0).then(|| d * eta + m * (eta * c - k.max(0.0).sqrt()))
    };
    let mut angles = Vec::new();
    while angles.len() < 60_000 {
        let down = Vec3::new(0.0, 0.0, -1.0);
        let first = ggx::visible_normal(-down, alpha, alpha, rng.unit(), rng.unit());
        let Some(inside) = refract(down, first, 1.0 / n) else {
            continue;
        };
        if inside.z >= 0.0 {
            continue;
        }
        let second = ggx::visible_normal(-inside, alpha, alpha, rng.unit(), rng.unit());
        let Some(out) = refract(inside, second, n) else {
            continue;
        };
        if out.z < 0.0 {
            angles.push(out.x.hypot(out.y).atan2(-out.z));
        }
    }
    angles.sort_by(f64::total_cmp);
    angles[angles.len() / 2]
}

#[test]
fn the_slab_is_as_wide_as_two_interfaces() {
    let slab = find("slab").unwrap();
    let mut rng = Rng::new(73);
    for (alpha, n) in [
        (0.05, 1.2),
        (0.1, 1.5),
        (0.2, 1.5),
        (0.2, 1.8),
        (0.15, 1.35),
    ] {
        let two = slab_median(alpha, n, &mut rng);
        let (k, s) = slab.split(&[0.0, 1.0, alpha, n]);
        let w = woven_bsdf::model::normalized(&k);
        let mut ours: Vec<f64> = (0..60_000)
            .map(|_| (slab.f64.sample)(&s, &w, Vec3::new(0.0, 0.0, 1.0), rng.three()))
            .filter(|v| v.z < 0.0)
            .map(|v| v.x.hypot(v.y).atan2(-v.z))
            .collect();
        ours.sort_by(f64::total_cmp);
        let one = ours[ours.len() / 2];
        println!("slab alpha {alpha}, n {n}: median {one:.4} rad, two interfaces {two:.4}");
        assert!(
            (one / two - 1.0).abs() < 0.05,
            "alpha {alpha}, n {n}: {one} against {two}"
        );
    }
}

#[test]
fn powers_near_one_keep_their_digits() {
    use woven_bsdf::term::power;
    for i in 0..400 {
        let x = 10f64.powf(-12.0 + 12.0 * f64::from(i) / 400.0);
        // The standard library's ln_1p and exp_m1 are independent of the series.
        assert!(
            (power::ln_one_minus(x) / (-x).ln_1p() - 1.0).abs() < 2e-15,
            "{x}"
        );
        assert!(
            (power::one_minus_exp(x) / -(-x).exp_m1() - 1.0).abs() < 2e-12,
            "{x}"
        );
        // In single precision the power of a narrow lobe is that of double precision, to the rounding of ln(1-x) times e: 14 where the value ends.
        let single = power::of_one_minus(x as f32, 1e4);
        let double = power::of_one_minus(f64::from(x as f32), 1e4);
        if double > 1e-6 {
            assert!(
                (f64::from(single) / double - 1.0).abs() < 3e-6,
                "{x}: {single} {double}"
            );
        }
    }
}
