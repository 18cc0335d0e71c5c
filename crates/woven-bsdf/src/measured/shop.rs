//! The numbers by which curtains are sold, in the manner of EN 14500 and EN 14501, and a fabric made from them.
//!
//! n-n: normal beam, what goes straight on; n-dif: normal beam, what is scattered; dif-dif: even light, all of it.

use super::Refused;
use super::klems::{Kind, Klems};
use crate::fabric::{Fabric, Optics, OpticsTable};
use crate::model::{MAX_LINEAR, find};
use crate::sheet::Sheet;
use crate::sheet::linear::{K_R, K_T, R_D, SHEEN, T_D};
use crate::term::albedo::GAUSS8;
use crate::term::{ggx, warp};
use crate::vec3::Vec3;
use crate::weave::mean_cover;
use std::f64::consts::{FRAC_PI_2, PI};

/// Visible transmittances and reflectances of one side, 0…1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shop {
    /// τ n-n: what of a normal beam passes straight on. For an opaque yarn it is the openness factor.
    pub tau_nn: f64,
    /// τ n-dif: what of a normal beam passes scattered.
    pub tau_nd: f64,
    /// τ dif-dif: what of even light passes.
    pub tau_dd: f64,
    /// ρ n-h: what of a normal beam is reflected.
    pub rho_n: f64,
    /// ρ dif-dif: what of even light is reflected.
    pub rho_dd: f64,
}

impl Shop {
    /// View-through clarity: the straight share of what passes, 0 (milk glass) to 1 (a net).
    pub fn clarity(&self) -> f64 {
        self.tau_nn / (self.tau_nn + self.tau_nd).max(1e-12)
    }

    /// From a Klems file's front blocks of a band ("Visible"). The straight part is what the straight-through patch
    /// holds over the mean of its neighbours, because that patch also holds its share of the scattered light.
    ///
    /// # Errors
    /// A sentence when the file lacks the band.
    pub fn of_klems(file: &Klems, band: &str) -> Result<Self, Refused> {
        let block = |kind: Kind| {
            file.block(band, kind).ok_or_else(|| {
                Refused::new(format!("the file has no block {band}, {}", kind.name()))
            })
        };
        let (t, r) = (
            block(Kind::TransmissionFront)?,
            block(Kind::ReflectionFront)?,
        );
        let Some(ring) = file.patches.get(1).map(|p| p.theta_lo) else {
            return Err(Refused::new(
                "one patch alone cannot tell straight from scattered light",
            ));
        };
        let near: Vec<f64> = (1..file.patches.len())
            .filter(|&o| file.patches[o].theta_lo == ring)
            .map(|o| file.value(t, o, 0))
            .collect();
        let around = near.iter().sum::<f64>() / near.len() as f64;
        let omega = file.patches[0].projected_solid_angle();
        let tau_nn = ((file.value(t, 0, 0) - around) * omega).max(0.0);
        Ok(Shop {
            tau_nn,
            tau_nd: file.directional(t, 0) - tau_nn,
            tau_dd: file.hemispherical(t),
            rho_n: file.directional(r, 0),
            rho_dd: file.hemispherical(r),
        })
    }

    /// Of a fabric with the model `sheet`, per colour channel.
    ///
    /// # Errors
    /// A sentence when the fabric has another model.
    pub fn of_sheet(optics: &Optics) -> Result<[Self; 3], Refused> {
        if optics.model.name != "sheet" {
            return Err(Refused::new(format!(
                "{} is no sheet: it has no gap to see through",
                optics.model.name
            )));
        }
        let s = &optics.shape;
        let normal = Vec3::new(0.0, 0.0, 1.0);
        let at_normal = scattered(optics, normal);
        let mut even = ([0.0; MAX_LINEAR], 0.0);
        // Even light: eight cosines by four azimuths of one quadrant.
        for (cos, weight) in GAUSS8 {
            for j in 0..4 {
                let w = Vec3::from_angles(cos.acos(), (f64::from(j) + 0.5) * FRAC_PI_2 / 4.0);
                let share = 2.0 * cos * weight / 4.0;
                let b = scattered(optics, w);
                even.0
                    .iter_mut()
                    .zip(b)
                    .for_each(|(sum, b)| *sum += share * b);
            }
        }
        even.1 = 1.0 - mean_cover(s[0], s[1], s[2]);
        Ok(std::array::from_fn(|c| {
            let sum = |b: &[f64; MAX_LINEAR], js: &[usize]| {
                js.iter().map(|&j| optics.linear[j][c] * b[j]).sum::<f64>()
            };
            let (through, back) = ([T_D, K_T], [R_D, K_R, SHEEN]);
            Shop {
                tau_nn: Sheet::gap(s, normal),
                tau_nd: sum(&at_normal, &through),
                tau_dd: even.1 + sum(&even.0, &through),
                rho_n: sum(&at_normal, &back),
                rho_dd: sum(&even.0, &back),
            }
        }))
    }
}

/// ∫ basis cosθ dω of each factor for a beam along `l`, on 64 × 32 midpoints even in cosθ for the diffuse factors, shared
/// with the lobe's own sampler for the others.
fn scattered(optics: &Optics, l: Vec3<f64>) -> [f64; MAX_LINEAR] {
    const N: (usize, usize) = (64, 32);
    let s = &optics.shape;
    let up = Vec3::new(l.x, l.y, l.z.abs());
    let mut out = [0.0; MAX_LINEAR];
    for (j, side, lobe) in [
        (T_D, -1.0, None),
        (K_T, -1.0, Some((s[3], s[4]))),
        (R_D, 1.0, None),
        (K_R, 1.0, Some((s[5], s[6]))),
        (SHEEN, 1.0, None),
    ] {
        let share = if lobe.is_some() { 0.5 } else { 1.0 };
        let mut add = |w: Vec3<f64>, weight: f64| {
            if w.z > 1e-6 {
                let peak = lobe.map_or(0.0, |(ax, ay)| 0.5 * ggx::pdf(w, up, ax, ay));
                let b = (optics.model.f64.basis)(s, up, Vec3::new(w.x, w.y, w.z * side))[j];
                out[j] += share * weight * b * w.z / (share * w.z / PI + peak) / (N.0 * N.1) as f64;
            }
        };
        for i in 0..N.0 * N.1 {
            let (u, t) = (
                ((i / N.1) as f64 + 0.5) / N.0 as f64,
                ((i % N.1) as f64 + 0.5) / N.1 as f64,
            );
            add(warp::cosine(1.0 - u * u, t), 2.0 * u);
            if let Some((ax, ay)) = lobe {
                add(ggx::sample(up, ax, ay, t, u), 1.0);
            }
        }
    }
    out
}

/// A fabric from a maker's card: openness factor, visible transmittance τ and reflectance ρ of a normal beam, all 0…1.
///
/// A square weave of flat yarns that passes and reflects evenly; what the card does not say (lobes, colour) is left out.
///
/// # Errors
/// A sentence when the numbers contradict each other.
pub fn fabric_from_card(name: &str, openness: f64, tau: f64, rho: f64) -> Result<Fabric, Refused> {
    for (what, x) in [("openness", openness), ("tau", tau), ("rho", rho)] {
        if !(0.0..=1.0).contains(&x) {
            return Err(Refused::new(format!("{what} = {x} lies outside 0…1")));
        }
    }
    if openness > tau || openness >= 1.0 {
        return Err(Refused::new(format!(
            "the openness {openness} is more than the transmittance {tau}: the gap alone passes it"
        )));
    }
    if tau + rho > 1.0 {
        return Err(Refused::new(format!(
            "tau + rho = {} is more than 1",
            tau + rho
        )));
    }
    // A square weave: (1 - γ)² = openness. For a normal beam on flat yarns the diffuse factors carry the cover exactly.
    let gamma = 1.0 - openness.sqrt();
    let cover = 1.0 - openness;
    let parameters = [
        ("gamma_warp", gamma),
        ("gamma_weft", gamma),
        ("section", 0.0),
        ("t_d", (tau - openness) / cover),
        ("r_d", rho / cover),
        ("k_t", 0.0),
        ("k_r", 0.0),
        ("sheen", 0.0),
    ];
    let known = find("sheet").expect("it is in the list");
    debug_assert!(
        parameters
            .iter()
            .all(|(n, _)| known.params.iter().any(|p| p.name == *n))
    );
    Ok(Fabric {
        name: name.to_owned(),
        optics: OpticsTable {
            model: "sheet".to_owned(),
            parameters: parameters
                .iter()
                .map(|(n, x)| ((*n).to_owned(), *x))
                .collect(),
            ..Default::default()
        },
        ..Default::default()
    })
}
