//! The sheet nearest to a model: what the curtain is made of when the chosen model is not the sheet itself.
//!
//! The renderer draws sheets. Another model's transmission is projected onto the sheet with a closed weave by least squares
//! over directions around the straight-through one, weighted by projected solid angle; the misfit is told to the user.

use std::f64::consts::PI;
use woven_bsdf::model::{Linear, MAX_LINEAR, Model, ModelInfo, Shape, dot};
use woven_bsdf::sheet::{Sheet, linear, shape};
use woven_bsdf::vec3::Vec3;

/// A sheet in the renderer's terms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Woven {
    /// Linear factors of the sheet, RGB.
    pub linear: [[f64; 3]; MAX_LINEAR],
    /// The same on the side away from +z, where it has colours of its own.
    pub back: Option<[[f64; 3]; MAX_LINEAR]>,
    /// Prepared shape of the sheet.
    pub shape: Shape<f64>,
    /// Root mean square misfit as a share of the model's root mean square; 0 when the model is the sheet.
    pub misfit: f64,
}

/// One pair of directions and the projected solid angle for which it stands.
struct Pair {
    l: Vec3<f64>,
    v: Vec3<f64>,
    weight: f64,
}

/// Directions behind the sheet around the straight-through one, for a few incidences.
fn pairs() -> Vec<Pair> {
    // Angles from the straight direction, 0.5° to 100°, each standing for a ring between its neighbours' middles.
    const RINGS: usize = 16;
    const SPOKES: usize = 8;
    let mut out = Vec::new();
    for (theta, phi) in [
        (0.0, 0.0),
        (0.4, 0.0),
        (0.4, 1.57),
        (0.8, 0.78),
        (1.1, 0.0),
        (1.1, 1.57),
    ] {
        let l = Vec3::from_angles(theta, phi);
        let t = Vec3::new(
            theta.cos() * phi.cos(),
            theta.cos() * phi.sin(),
            -theta.sin(),
        );
        let b = Vec3::new(-phi.sin(), phi.cos(), 0.0);
        for i in 0..RINGS {
            let edge = |x: f64| 1.75 * (x / RINGS as f64).powi(3);
            let delta = edge(i as f64 + 0.5);
            let solid_angle =
                2.0 * PI * (edge(i as f64).cos() - edge(i as f64 + 1.0).cos()) / SPOKES as f64;
            for j in 0..SPOKES {
                let a = (j as f64 + 0.5) / SPOKES as f64 * 2.0 * PI;
                let v = (t * a.cos() + b * a.sin()) * delta.sin() - l * delta.cos();
                if v.z < -1e-3 {
                    out.push(Pair {
                        l,
                        v,
                        weight: solid_angle * -v.z,
                    });
                }
            }
        }
    }
    out
}

/// Factors (t_d, k_t) ≥ 0 of the best fit to `f` and the weighted sum of squares that is left.
fn solve(basis: &[[f64; 2]], f: &[f64], pairs: &[Pair]) -> ([f64; 2], f64) {
    let sum = |g: &dyn Fn(usize) -> f64| {
        (0..pairs.len())
            .map(|i| pairs[i].weight * g(i))
            .sum::<f64>()
    };
    let aa = sum(&|i| basis[i][0] * basis[i][0]);
    let ab = sum(&|i| basis[i][0] * basis[i][1]);
    let bb = sum(&|i| basis[i][1] * basis[i][1]);
    let af = sum(&|i| basis[i][0] * f[i]);
    let bf = sum(&|i| basis[i][1] * f[i]);
    let left = |k: [f64; 2]| sum(&|i| (k[0] * basis[i][0] + k[1] * basis[i][1] - f[i]).powi(2));
    let det = aa * bb - ab * ab;
    // Two unknowns: the free solution, or the better one of those on the border.
    let mut tries = vec![
        [(af / aa.max(1e-30)).max(0.0), 0.0],
        [0.0, (bf / bb.max(1e-30)).max(0.0)],
    ];
    if det > 1e-12 * aa * bb {
        let k = [(af * bb - bf * ab) / det, (bf * aa - af * ab) / det];
        if k[0] >= 0.0 && k[1] >= 0.0 {
            tries = vec![k];
        }
    }
    tries
        .into_iter()
        .map(|k| (k, left(k)))
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or(([0.0; 2], 0.0))
}

/// The closed sheet with these widths of the forward lobe.
fn closed(alpha_x: f64, alpha_y: f64) -> Shape<f64> {
    let mut s = Sheet::constant_cover(1.0);
    (s[shape::ALPHA_X], s[shape::ALPHA_Y]) = (alpha_x, alpha_y);
    Sheet::derive(&mut s);
    s
}

/// The sheet nearest to `model` with RGB factors `k` and prepared shape `s`; `reflect` is its diffuse reflection, given
/// by hand because models of transmission have none.
#[must_use]
pub fn nearest(
    model: &ModelInfo,
    k: &[[f64; 3]; MAX_LINEAR],
    s: &Shape<f64>,
    reflect: f64,
) -> Woven {
    if model.name == Sheet::NAME {
        return Woven {
            linear: *k,
            back: None,
            shape: *s,
            misfit: 0.0,
        };
    }
    let pairs = pairs();
    let own: Vec<Linear<f64>> = pairs
        .iter()
        .map(|p| (model.f64.basis)(s, p.l, p.v))
        .collect();
    let target = |factor: &dyn Fn(&[f64; 3]) -> f64| -> Vec<f64> {
        let k: Linear<f64> = std::array::from_fn(|j| factor(&k[j]));
        own.iter().map(|b| dot(&k, b)).collect()
    };
    let luminance = target(&|c| 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]);
    let basis_of = |alpha: [f64; 2]| -> Vec<[f64; 2]> {
        let shape = closed(alpha[0], alpha[1]);
        let basis = |p: &Pair| Sheet::basis(&shape, p.l, p.v);
        pairs
            .iter()
            .map(basis)
            .map(|b| [b[linear::T_D], b[linear::K_T]])
            .collect()
    };
    let cost = |alpha: [f64; 2]| solve(&basis_of(alpha), &luminance, &pairs).1;

    // A coarse search of one width, then both widths in turn with shrinking steps.
    let mut alpha = [0.2; 2];
    let mut best = f64::INFINITY;
    for i in 0..14 {
        let a = 0.02 * 50_f64.powf(f64::from(i) / 13.0);
        let c = cost([a, a]);
        if c < best {
            (best, alpha) = (c, [a, a]);
        }
    }
    let mut step: f64 = 1.3;
    while step > 1.02 {
        let mut better = false;
        for axis in 0..2 {
            for factor in [step, step.recip()] {
                let mut trial = alpha;
                trial[axis] = (trial[axis] * factor).clamp(0.02, 1.0);
                let c = cost(trial);
                if c < best {
                    (best, alpha, better) = (c, trial, true);
                }
            }
        }
        if !better {
            step = step.sqrt();
        }
    }

    let basis = basis_of(alpha);
    let mut out = [[0.0; 3]; MAX_LINEAR];
    for c in 0..3 {
        let ([t_d, k_t], _) = solve(&basis, &target(&|k| k[c]), &pairs);
        (out[linear::T_D][c], out[linear::K_T][c]) = (t_d, k_t);
    }
    // The renderer's sheets never give more than they get.
    let transmitted = (0..3)
        .map(|c| out[linear::T_D][c] + out[linear::K_T][c])
        .fold(0.0, f64::max);
    if transmitted > 1.0 {
        out.iter_mut().flatten().for_each(|k| *k /= transmitted);
    }
    let spare = (1.0 - transmitted).max(0.0);
    out[linear::R_D] = [reflect.clamp(0.0, spare); 3];
    let energy: f64 = pairs
        .iter()
        .zip(&luminance)
        .map(|(p, f)| p.weight * f * f)
        .sum();
    let misfit = if energy > 0.0 {
        (best / energy).sqrt()
    } else {
        0.0
    };
    Woven {
        linear: out,
        back: None,
        shape: closed(alpha[0], alpha[1]),
        misfit,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use woven_bsdf::model::{MODELS, find};

    fn gray(values: &[f64], model: &ModelInfo) -> ([[f64; 3]; MAX_LINEAR], Shape<f64>) {
        let (k, s) = model.split(values);
        (k.map(|k| [k; 3]), s)
    }

    #[test]
    fn lambert_is_a_sheet() {
        let model = find("lambert").expect("it is in the list");
        let (k, s) = gray(&[0.3], model);
        let sheet = nearest(model, &k, &s, 0.4);
        assert!(
            (sheet.linear[linear::T_D][1] - 0.3).abs() < 1e-9,
            "{:?}",
            sheet.linear
        );
        assert!(sheet.misfit < 1e-6);
        assert_eq!(sheet.linear[linear::R_D], [0.4; 3]);
    }

    #[test]
    fn every_model_has_a_sheet_that_gives_no_more_than_it_gets() {
        for model in MODELS {
            for stretch in [0.0, 0.5, 1.0] {
                let values: Vec<_> = model
                    .params
                    .iter()
                    .map(|p| p.min + stretch * (p.max - p.min))
                    .collect();
                let (k, s) = gray(&values, model);
                let sheet = nearest(model, &k, &s, 0.9);
                assert!(
                    sheet
                        .linear
                        .iter()
                        .flatten()
                        .chain(&sheet.shape)
                        .all(|x| x.is_finite()),
                    "{}",
                    model.name
                );
                if model.name != Sheet::NAME {
                    let given: f64 = sheet.linear.iter().map(|k| k[0]).sum();
                    assert!(given <= 1.0 + 1e-9, "{}: {given}", model.name);
                }
            }
        }
    }

    #[test]
    fn the_mirrored_microfacet_lobe_keeps_its_widths() {
        let model = find("ggx-mirrored").expect("it is in the list");
        let (k, s) = gray(&[0.1, 0.3, 0.1, 0.25], model);
        let sheet = nearest(model, &k, &s, 0.0);
        // Its own lobe with the masked light given back is a little broader than the bare lobe.
        assert!(
            (0.07..0.14).contains(&sheet.shape[shape::ALPHA_X]),
            "{:?}",
            sheet.shape
        );
        assert!(
            (0.17..0.35).contains(&sheet.shape[shape::ALPHA_Y]),
            "{:?}",
            sheet.shape
        );
        assert!(sheet.misfit < 0.2, "{}", sheet.misfit);
    }
}
