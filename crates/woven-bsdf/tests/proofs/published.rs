//! Numbers known from elsewhere: Walter's lobe from another implementation, norms, the paper's formulas as printed.

use crate::support::{Rng, flux};
use std::f64::consts::PI;
use woven_bsdf::angles::radians;
use woven_bsdf::model::{MODELS, find};
use woven_bsdf::term::{beckmann, fresnel, ggx};
use woven_bsdf::vec3::Vec3;

/// Made by `tests/walter_mitsuba.py`.
const MITSUBA: &[[f64; 7]] = &[
    // mitsuba 3.9.1: alpha, n, theta_l, phi_l, theta_v, phi_v in degrees, f in 1/sr
    [
        0.1,
        1.3,
        24.287457362487178,
        -125.6942973871793,
        155.5175099137955,
        37.203154079522406,
        0.4245609345215182,
    ],
    [
        0.1,
        1.3,
        40.19115032300169,
        -48.35198991146922,
        167.91693209989552,
        131.9454394161076,
        0.016750532863135027,
    ],
    [
        0.1,
        1.3,
        2.812174383148866,
        -23.887553881541095,
        164.95707321352995,
        139.7409666522135,
        0.06543107362731679,
    ],
    [
        0.1,
        1.3,
        31.83893918568855,
        117.66676488193372,
        171.10697686283493,
        286.5963234662143,
        0.033295428295918944,
    ],
    [
        0.1,
        1.5,
        47.0574916804192,
        161.17521928452203,
        147.70502188605582,
        337.04243827055325,
        22.157218323992126,
    ],
    [
        0.1,
        1.5,
        73.219132919469,
        -163.23023497760775,
        125.99777936402353,
        8.354136475659299,
        0.9851429929607227,
    ],
    [
        0.1,
        1.5,
        10.819131251807814,
        -137.5947942917874,
        179.52808642321287,
        55.05026007301386,
        1.5252391082455765,
    ],
    [
        0.1,
        1.5,
        13.55447849429531,
        29.376058918487843,
        165.45436238188228,
        204.2719606275171,
        3.3717578656288003,
    ],
    [
        0.1,
        1.8,
        41.08083492821684,
        -157.39596900960368,
        176.2041600656857,
        10.842379503169386,
        0.05155870886518479,
    ],
    [
        0.1,
        1.8,
        51.029997988633944,
        -26.066769959014977,
        161.84396046287887,
        157.35570458129058,
        1.9857900130111565,
    ],
    [
        0.1,
        1.8,
        33.98882822780815,
        -72.08388112907436,
        150.13106046108342,
        115.8758962201085,
        0.5040600466188868,
    ],
    [
        0.1,
        1.8,
        18.307238304161466,
        26.79253569312155,
        168.94217658654924,
        221.7980355160587,
        28.435904272999295,
    ],
    [
        0.3,
        1.3,
        54.70839670794132,
        -76.34240463953286,
        121.90035140602171,
        88.38022649066562,
        0.5602512001016289,
    ],
    [
        0.3,
        1.3,
        31.35921163389204,
        92.5707346434898,
        170.32311372249913,
        272.12925866252203,
        0.34518939673369536,
    ],
    [
        0.3,
        1.3,
        2.9405442785578244,
        60.557708352382264,
        167.15561386565824,
        243.47874596347762,
        1.082101095723443,
    ],
    [
        0.3,
        1.3,
        65.66083588731662,
        -67.05089537468517,
        127.69190932165716,
        116.72389970951556,
        14.64430079771123,
    ],
    [
        0.3,
        1.5,
        43.492140321186916,
        -15.766080731491314,
        139.08922084011976,
        182.0211630728262,
        0.9583400088826092,
    ],
    [
        0.3,
        1.5,
        35.55737530647333,
        59.09479397088282,
        174.76309046491275,
        247.1544748230598,
        0.21418526351923575,
    ],
    [
        0.3,
        1.5,
        48.53466408957516,
        177.51453820798827,
        137.1513881925282,
        348.89835949175426,
        2.5869716464750474,
    ],
    [
        0.3,
        1.5,
        28.93435818350331,
        60.71497771830775,
        179.71901044240158,
        239.18278917029838,
        0.18211810250416471,
    ],
    [
        0.3,
        1.8,
        12.603628417990842,
        -137.84551398657652,
        169.32098424641725,
        52.88380555232431,
        10.807520622765487,
    ],
    [
        0.3,
        1.8,
        9.700516651401317,
        -90.85865986911085,
        178.9906811583181,
        103.99821909594112,
        8.82056908530568,
    ],
    [
        0.3,
        1.8,
        6.043597590010396,
        -18.292535658240865,
        174.66915815038274,
        177.04281739941962,
        14.15119213658952,
    ],
    [
        0.3,
        1.8,
        61.4459878376806,
        131.03440909146548,
        159.6551522307623,
        307.6462697799334,
        1.3582555047947,
    ],
    [
        0.6,
        1.3,
        26.90783739987186,
        138.3094177913581,
        141.31835032275887,
        304.3462540230025,
        0.8788960329150102,
    ],
    [
        0.6,
        1.3,
        13.216329636777774,
        -96.49552794496712,
        179.46261480016042,
        82.90298126868714,
        2.3129431474834594,
    ],
    [
        0.6,
        1.3,
        44.18426277991917,
        -85.41121705252634,
        167.41572171624412,
        91.34664299248678,
        0.09639697039785353,
    ],
    [
        0.6,
        1.3,
        27.694017967104404,
        23.882840534301096,
        140.9293601130094,
        211.5025868197402,
        1.1660840378193906,
    ],
    [
        0.6,
        1.5,
        38.66185748030838,
        42.33338978728597,
        148.33931792391712,
        204.49310551623756,
        3.149350177759639,
    ],
    [
        0.6,
        1.5,
        67.46497575434641,
        100.78901665418618,
        127.01204538337974,
        292.70394150204885,
        3.266771840898286,
    ],
    [
        0.6,
        1.5,
        29.42841801684515,
        -36.367620364701736,
        176.73794169153547,
        149.00396226272662,
        0.5745793743221091,
    ],
    [
        0.6,
        1.5,
        4.668586621401569,
        -155.75485829651106,
        171.46100323583158,
        10.737269214372837,
        5.5317626610304735,
    ],
    [
        0.6,
        1.8,
        25.504023917425755,
        -161.0727825995039,
        173.84913466557788,
        4.977814691673208,
        1.8540880128084565,
    ],
    [
        0.6,
        1.8,
        7.609827601694738,
        -49.100428067554446,
        165.23911074061579,
        145.87286702739834,
        2.2887452997061493,
    ],
    [
        0.6,
        1.8,
        46.055174084135906,
        -126.52182528087909,
        166.33121947179487,
        47.373756561268976,
        0.8848154765017349,
    ],
    [
        0.6,
        1.8,
        27.312257964621185,
        -135.77679692560983,
        151.27421611922335,
        63.94731194257873,
        1.791832065446,
    ],
];

#[test]
fn walter_agrees_with_mitsuba() {
    let model = find("ggx-walter").unwrap();
    let mut worst = 0.0f64;
    for &[alpha, n, tl, pl, tv, pv, f] in MITSUBA {
        let l = Vec3::from_angles(radians(tl), radians(pl));
        let v = Vec3::from_angles(radians(tv), radians(pv));
        let got = model.eval(&[0.0, 1.0, alpha, n], l, v);
        worst = worst.max((got / f - 1.0).abs());
    }
    println!(
        "ggx-walter against mitsuba: worst relative difference {worst:.1e} of {}",
        MITSUBA.len()
    );
    // Mitsuba's scalar variant computes in single precision.
    assert!(MITSUBA.len() > 30 && worst < 1e-5, "{worst:e}");
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
