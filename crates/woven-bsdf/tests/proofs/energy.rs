//! The sheet never gives more light than it gets, and gives back all of it when told to.

use crate::support::{Rng, flux};
use woven_bsdf::model::{Shape, find};
use woven_bsdf::sheet::{Sheet, linear, shape};
use woven_bsdf::vec3::Vec3;

/// Midpoints in height and azimuth of the coarsest grid. The height needs many: masking ends it like a square root.
const GRID: (usize, usize) = (150, 24);

/// How many settings; `WOVEN_SETTINGS` asks for more.
fn settings(usual: usize) -> usize {
    let asked = std::env::var("WOVEN_SETTINGS").ok();
    asked.and_then(|n| n.parse().ok()).unwrap_or(usual)
}

/// [`flux`] on grids that are doubled both ways until two of them agree to 3e-4, which is what a grid may then still be
/// wrong by. A sparse weave of flat yarns with a narrow lobe, lit at 88.8°, wants 1200 × 192.
fn converged(
    f: &dyn Fn(Vec3<f64>) -> f64,
    l: Vec3<f64>,
    through: bool,
    widths: Option<(f64, f64)>,
) -> f64 {
    let mut last = flux(f, l, through, widths, GRID);
    for k in 1..=4 {
        let next = flux(f, l, through, widths, (GRID.0 << k, GRID.1 << k));
        if (next - last).abs() < 3e-4 {
            return next;
        }
        last = next;
    }
    last
}

/// The share of a beam along `l` that each factor of the sheet sends on, for factors of 1.
fn shares(s: &Shape<f64>, l: Vec3<f64>) -> [f64; 5] {
    let sheet = find("sheet").unwrap();
    let forward = Some((s[shape::ALPHA_X], s[shape::ALPHA_Y]));
    let back = Some((s[shape::RALPHA_X], s[shape::RALPHA_Y]));
    let of = |j: usize, through, widths| {
        converged(&|v| (sheet.f64.basis)(s, l, v)[j], l, through, widths)
    };
    let mut out = [0.0; 5];
    out[linear::T_D] = of(linear::T_D, true, None);
    out[linear::K_T] = of(linear::K_T, true, forward);
    out[linear::R_D] = of(linear::R_D, false, None);
    out[linear::K_R] = of(linear::K_R, false, back);
    out[linear::SHEEN] = of(linear::SHEEN, false, None);
    out
}

#[test]
fn the_sheet_never_gives_more_than_it_gets() {
    let sheet = find("sheet").unwrap();
    let mut rng = Rng::new(41);
    let mut worst = (0.0f64, String::new());
    for i in 0..settings(60) {
        let mut values = rng.parameters(sheet, 0.0);
        if i % 3 == 0 {
            // Tapes, which close only at grazing incidence: there the cover that a tilt adds is far from its mean.
            values[7] *= 1e-3f64.powf(rng.unit());
        }
        let (_, s) = sheet.split(&values);
        let l = rng.direction(0.01);
        let gap = Sheet::gap(&s, l);
        // Legal factors sum to at most 1, so the worst of the five alone is the worst of all mixtures.
        let share = shares(&s, l);
        for (j, share) in share.into_iter().enumerate() {
            if gap + share > worst.0 {
                worst = (gap + share, format!("factor {j} {values:?} {l:?}"));
            }
        }
    }
    println!("greatest gap + R + T = {:.5} at {}", worst.0, worst.1);
    assert!(worst.0 < 1.001, "{worst:?}");
}

#[test]
fn the_slab_never_gives_more_than_it_gets() {
    let slab = find("slab").unwrap();
    let mut rng = Rng::new(43);
    let mut worst = (0.0f64, String::new());
    for _ in 0..settings(60) {
        let mut values = rng.parameters(slab, 0.0);
        // All of the light in the lobe; the floor alone gives k_d.
        (values[0], values[1]) = (0.0, 1.0);
        let (_, s) = slab.split(&values);
        let l = rng.direction(0.01);
        let lobe = |v| (slab.f64.basis)(&s, l, v)[1];
        let t = converged(&lobe, l, true, Some((s[2], s[2])));
        if t > worst.0 {
            worst = (t, format!("{values:?} {l:?}"));
        }
    }
    println!("greatest T of the slab = {:.5} at {}", worst.0, worst.1);
    assert!(worst.0 < 1.001, "{worst:?}");
}

#[test]
fn factors_that_sum_to_one_lose_nothing() {
    let sheet = find("sheet").unwrap();
    let mut rng = Rng::new(42);
    // Least total of (diffuse factors, lobe alone) within 81°, and of the lobe alone at all incidences.
    let mut least = [1.0f64; 3];
    for _ in 0..settings(60) {
        let mut values = rng.parameters(sheet, 0.0);
        // Widths of one cloth differ by less than 4.6 in all measurements seen; beyond that the loss is less exact.
        let ratio = (2.0 * rng.unit() - 1.0) * 4.6f64.ln();
        values[8] = (values[7] * ratio.exp()).clamp(0.02, 1.0);
        let (_, s) = sheet.split(&values);
        let l = rng.direction(0.01);
        let gap = Sheet::gap(&s, l);
        let share = shares(&s, l);
        let diffuse = gap + share[linear::T_D].min(share[linear::R_D]);
        let lobe = gap + share[linear::K_T];
        if l.z.abs() > 0.156 {
            least = [least[0].min(diffuse), least[1].min(lobe), least[2]];
        }
        least[2] = least[2].min(lobe);
    }
    println!(
        "least total: diffuse {:.4}, forward lobe {:.4} (θ < 81°), {:.4} (all)",
        least[0], least[1], least[2]
    );
    // The mean cover is a quadrature over closing yarns, good to 6e-4, and the grid to 3e-4.
    assert!(least[0] > 0.995, "{least:?}");
    // The closed form of the loss is one-sided: see term::albedo. Seen over 600 settings: 0.947 within 81°, 0.936 at all
    // incidences. Mixed with diffuse factors, as cloth is, the sheet is closer: a share of 0.4 in the lobe costs 0.4 × 0.053.
    assert!(least[1] > 0.94 && least[2] > 0.93, "{least:?}");
}
