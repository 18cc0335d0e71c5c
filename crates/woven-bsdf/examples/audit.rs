//! Writes the plots and prints the table of `docs/audit.md`: `cargo run --release -p woven-bsdf --example audit`.

use std::f64::consts::PI;
use std::fmt::Write;
use woven_bsdf::model::find;
use woven_bsdf::term::{ggx, warp};
use woven_bsdf::vec3::Vec3;
use woven_bsdf::weave::openness;

/// A curve: its name and its points.
type Curve = (String, Vec<(f64, f64)>);

const COLORS: [&str; 6] = [
    "#1f6fb4", "#d9541e", "#2e8b57", "#8e44ad", "#7f8c2a", "#555555",
];

/// A plot of curves as SVG; `log` makes the vertical axis logarithmic, with `y` in decades then.
fn plot(
    title: &str,
    xlabel: &str,
    ylabel: &str,
    x: [f64; 2],
    y: [f64; 2],
    log: bool,
    curves: &[Curve],
) -> String {
    let (w, h, left, top, right, bottom) = (680.0, 400.0, 70.0, 40.0, 190.0, 50.0);
    let px = |v: f64| left + (v - x[0]) / (x[1] - x[0]) * (w - left - right);
    let py = |v: f64| {
        let v = if log { v.max(1e-30).log10() } else { v };
        h - bottom - (v - y[0]) / (y[1] - y[0]) * (h - top - bottom)
    };
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"{w}\" height=\"{h}\" fill=\"white\"/>\n<text x=\"{left}\" y=\"22\" font-size=\"15\">{title}</text>\n"
    );
    for i in 0..=6 {
        let t = f64::from(i) / 6.0;
        let (vx, vy) = (x[0] + t * (x[1] - x[0]), y[0] + t * (y[1] - y[0]));
        let yy = h - bottom - t * (h - top - bottom);
        let label = if log {
            format!("{:.1e}", 10f64.powf(vy))
        } else {
            format!("{vy:.2}")
        };
        writeln!(
            out,
            "<path d=\"M{0:.1} {top}V{1:.1}M{left} {yy:.1}H{2:.1}\" stroke=\"#ddd\"/><text x=\"{0:.1}\" y=\"{3:.1}\" text-anchor=\"middle\">{vx:.0}</text>\
             <text x=\"{4:.1}\" y=\"{5:.1}\" text-anchor=\"end\">{label}</text>",
            px(vx), h - bottom, w - right, h - bottom + 16.0, left - 6.0, yy + 4.0
        )
        .expect("a string grows");
    }
    writeln!(
        out,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{xlabel}</text><text x=\"16\" y=\"{:.1}\" transform=\"rotate(-90 16 {:.1})\" \
         text-anchor=\"middle\">{ylabel}</text>",
        (left + w - right) / 2.0, h - 12.0, (top + h - bottom) / 2.0, (top + h - bottom) / 2.0
    )
    .expect("a string grows");
    for (i, (name, points)) in curves.iter().enumerate() {
        let color = COLORS[i % COLORS.len()];
        let mut path = String::new();
        let mut pen = false;
        for &(a, b) in points {
            let yy = py(b);
            let inside = yy <= h - bottom + 0.5 && b.is_finite();
            if inside {
                write!(
                    path,
                    "{}{:.1} {:.1}",
                    if pen { 'L' } else { 'M' },
                    px(a),
                    yy.max(top)
                )
                .expect("a string grows");
            }
            pen = inside;
        }
        let ly = top + 14.0 + 20.0 * i as f64;
        writeln!(
            out,
            "<path d=\"{path}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.8\"/><path d=\"M{0:.1} {ly:.1}h22\" stroke=\"{color}\" stroke-width=\"2.5\"/>\
             <text x=\"{1:.1}\" y=\"{2:.1}\">{name}</text>",
            w - right + 10.0, w - right + 38.0, ly + 4.0
        )
        .expect("a string grows");
    }
    out.push_str("</svg>\n");
    out
}

/// The transmittance of a beam at incidence `deg`, by midpoints even in cosθ shared with a lobe of width `alpha`.
fn transmittance(name: &str, values: &[f64], deg: f64, alpha: f64) -> f64 {
    let model = find(name).expect("in the list");
    let l = Vec3::from_angles(deg.to_radians(), 0.0);
    const N: (usize, usize) = (1200, 120);
    let mut sum = 0.0;
    let mut add = |w: Vec3<f64>, weight: f64| {
        if w.z > 1e-9 {
            let pdf = 0.5 * w.z / PI + 0.5 * ggx::pdf(w, l, alpha, alpha);
            sum += 0.5 * weight * model.eval(values, l, Vec3::new(w.x, w.y, -w.z)) * w.z / pdf;
        }
    };
    for i in 0..N.0 * N.1 {
        let (u, t) = (
            ((i / N.1) as f64 + 0.5) / N.0 as f64,
            ((i % N.1) as f64 + 0.5) / N.1 as f64,
        );
        add(warp::cosine(1.0 - u * u, t), 2.0 * u);
        add(ggx::sample(l, alpha, alpha, t, u), 1.0);
    }
    sum / (N.0 * N.1) as f64
}

/// f in the plane of incidence over the viewer's angle from straight down, degrees.
fn slice(name: &str, values: &[f64], deg: f64) -> Vec<(f64, f64)> {
    let model = find(name).expect("in the list");
    let l = Vec3::from_angles(deg.to_radians(), PI);
    (-178..=178)
        .map(|i| {
            let a = f64::from(i) / 2.0;
            let r = a.to_radians();
            (a, model.eval(values, l, Vec3::new(r.sin(), 0.0, -r.cos())))
        })
        .collect()
}

fn main() -> std::io::Result<()> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/plots");
    std::fs::create_dir_all(folder)?;
    let save = |name: &str, text: String| std::fs::write(format!("{folder}/{name}"), text);

    // (8): the distribution as printed and corrected, alpha = 0.1.
    let degrees: Vec<f64> = (0..=180).map(|i| f64::from(i) / 2.0).collect();
    let alpha = 0.1f64;
    let printed = |c: f64| {
        let t2 = (1.0 - c * c) / (c * c);
        alpha * alpha / (PI * (c * c * (alpha * alpha + t2 * t2)).powi(2))
    };
    let corrected = |c: f64| ggx::d(Vec3::new((1.0 - c * c).sqrt(), 0.0, c), alpha, alpha);
    let over = |f: &dyn Fn(f64) -> f64| {
        degrees
            .iter()
            .map(|&d| (d, f(d.to_radians().cos())))
            .collect::<Vec<_>>()
    };
    save(
        "distribution.svg",
        plot(
            "(8) the distribution D, alpha = 0.1",
            "angle between n and h (printed: between h and l), degrees",
            "D, 1/sr",
            [0.0, 60.0],
            [-3.0, 2.0],
            true,
            &[
                ("corrected".into(), over(&corrected)),
                ("as printed".into(), over(&printed)),
            ],
        ),
    )?;
    // (7): Fresnel.
    let fresnel = |c: f64| woven_bsdf::term::fresnel::dielectric(c, 1.5);
    let literal = |c: f64| {
        let g = (1.25 + c * c).sqrt();
        ((g - c) / (g + c)).powi(2) * (1.0 + ((c * (g + c) - 1.0) / (c * (g - c) + 1.0)).powi(2))
    };
    save(
        "fresnel.svg",
        plot(
            "(7) Fresnel reflectance, n = 1.5",
            "angle, degrees",
            "F",
            [0.0, 90.0],
            [0.0, 2.0],
            false,
            &[
                ("corrected".into(), over(&fresnel)),
                ("as printed".into(), over(&literal)),
            ],
        ),
    )?;
    // The four variants of a sheet over incidence.
    let incidences: Vec<f64> = (0..=14).map(|i| f64::from(i) * 5.0).collect();
    let curve = |label: &str, name: &str, values: &[f64], alpha: f64| -> Curve {
        (
            label.to_owned(),
            incidences
                .iter()
                .map(|&d| (d, transmittance(name, values, d, alpha)))
                .collect(),
        )
    };
    let variants = [
        curve("W ggx-walter", "ggx-walter", &[0.0, 1.0, 0.3, 1.5], 0.1),
        curve("M ggx-mirrored", "ggx-mirrored", &[0.0, 1.0, 0.3, 0.3], 0.3),
        curve("S slab", "slab", &[0.0, 1.0, 0.3, 1.5], 0.12),
        curve("P paper", "paper", &[0.0, 1.0, 0.3, 1.5], 0.2),
    ];
    println!("transmittance at alpha = 0.3, n = 1.5\n| θ | W | M | S | P |\n|---|---|---|---|---|");
    for (i, d) in incidences.iter().enumerate().step_by(2) {
        let row: Vec<String> = variants
            .iter()
            .map(|(_, p)| format!("{:.3}", p[i].1))
            .collect();
        println!("| {d}° | {} |", row.join(" | "));
    }
    save(
        "transmittance.svg",
        plot(
            "Transmittance of the four variants, alpha = 0.3, n = 1.5",
            "incidence, degrees",
            "T",
            [0.0, 72.0],
            [0.0, 1.2],
            false,
            &variants,
        ),
    )?;
    println!("\n| alpha | W 0° | W 50° | M 0° | printed 0° |\n|---|---|---|---|---|");
    for alpha in [0.1, 0.3, 0.6] {
        println!(
            "| {alpha} | {:.3} | {:.3} | {:.3} | {:.2} |",
            transmittance("ggx-walter", &[0.0, 1.0, alpha, 1.5], 0.0, alpha * 0.3),
            transmittance("ggx-walter", &[0.0, 1.0, alpha, 1.5], 50.0, alpha * 0.3),
            transmittance("ggx-mirrored", &[0.0, 1.0, alpha, alpha], 0.0, alpha),
            transmittance("paper-literal", &[1.0, alpha, 1.5], 0.0, alpha.sqrt() / 3.0),
        );
    }
    // Where the light goes at 30°.
    let lobes: Vec<Curve> = [
        ("W", "ggx-walter", vec![0.0, 1.0, 0.3, 1.5]),
        ("M", "ggx-mirrored", vec![0.0, 1.0, 0.3, 0.3]),
        ("S", "slab", vec![0.0, 1.0, 0.3, 1.5]),
        ("P", "paper", vec![0.0, 1.0, 0.3, 1.5]),
        ("printed", "paper-literal", vec![1.0, 0.3, 1.5]),
    ]
    .map(|(label, name, values)| (label.to_owned(), slice(name, &values, 30.0)))
    .into();
    for (label, points) in &lobes {
        let peak = points
            .iter()
            .fold((0.0, 0.0), |best, &p| if p.1 > best.1 { p } else { best });
        println!(
            "light at 30°: {label} peaks at {:.1}° with {:.2}/sr",
            peak.0, peak.1
        );
    }
    save(
        "variants.svg",
        plot(
            "BTDF in the plane of incidence, light at 30°, alpha = 0.3, n = 1.5",
            "viewer, degrees from straight down (30 is straight through)",
            "f, 1/sr",
            [-90.0, 90.0],
            [-2.0, 2.0],
            true,
            &lobes,
        ),
    )?;
    // The gap.
    let gaps: Vec<Curve> = [(0.0, 1.0), (45.0, 1.0), (0.0, 0.5), (0.0, 0.0)]
        .map(|(phi, section): (f64, f64)| {
            let points = degrees
                .iter()
                .map(|&d| {
                    (
                        d,
                        openness(
                            0.5,
                            0.5,
                            section,
                            Vec3::from_angles(d.to_radians(), phi.to_radians()),
                        ),
                    )
                })
                .collect();
            (format!("φ {phi}°, section {section}"), points)
        })
        .into();
    save(
        "openness.svg",
        plot(
            "Openness of a weave, γ = 0.5 both ways",
            "θ, degrees",
            "T",
            [0.0, 90.0],
            [0.0, 0.3],
            false,
            &gaps,
        ),
    )?;
    println!("plots written to docs/plots");
    Ok(())
}
