//! The sun's colour after its way through the air: Preetham et al. 1999, appendix A.1, summed over wavelengths.

/// Illuminance of the sun outside the air \[lux\] (CIE 1989: 133.8 klx).
const EXTRATERRESTRIAL: f64 = 133_800.0;
/// Ozone in the air column \[cm\].
const OZONE: f64 = 0.35;
/// Absorption of ozone \[1/cm\] every 10 nm from 450 nm (Chappuis band; Preetham's table 2), 0 below.
const OZONE_FROM_450: [f64; 34] = [
    0.003, 0.006, 0.009, 0.014, 0.021, 0.030, 0.040, 0.048, 0.063, 0.075, 0.085, 0.103, 0.120,
    0.120, 0.115, 0.125, 0.120, 0.105, 0.090, 0.079, 0.067, 0.057, 0.048, 0.036, 0.028, 0.023,
    0.018, 0.014, 0.011, 0.010, 0.009, 0.007, 0.004, 0.0,
];

/// X, Y, Z of the sun's illuminance at normal incidence \[lux\] for its elevation in radians and a turbidity. Oxygen
/// and water absorb at the red end of the visible and are left out (under 1 % of the luminance).
pub(super) fn sun_xyz(elevation: f64, turbidity: f64) -> [f64; 3] {
    // (Kasten 1965): relative optical mass of the air.
    let zenith = 90.0 - elevation.to_degrees();
    let mass = 1.0 / (elevation.sin() + 0.15 * (93.885 - zenith).max(1e-3).powf(-1.253));
    let beta = 0.046_08 * turbidity - 0.045_86;
    let (mut sum, mut white) = ([0.0; 3], 0.0);
    for step in 0..=40 {
        let nm = 380.0 + 10.0 * f64::from(step);
        let um = nm * 1e-3;
        let rayleigh = (-0.008_735 * um.powf(-4.08) * mass).exp();
        let aerosol = (-beta.max(0.0) * um.powf(-1.3) * mass).exp();
        let band = ((nm - 450.0) / 10.0).round();
        let k = if band < 0.0 {
            0.0
        } else {
            OZONE_FROM_450.get(band as usize).copied().unwrap_or(0.0)
        };
        let ozone = (-k * OZONE * mass).exp();
        // The sun as a black body of 5778 K; only its shape matters.
        let emitted = um.powi(-5) / ((14_387.8 / (um * 1000.0) * 1000.0 / 5778.0).exp() - 1.0);
        let [x, y, z] = observer(nm);
        let arrived = emitted * rayleigh * aerosol * ozone;
        sum[0] += arrived * x;
        sum[1] += arrived * y;
        sum[2] += arrived * z;
        white += emitted * y;
    }
    sum.map(|v| v / white * EXTRATERRESTRIAL)
}

/// The CIE 1931 observer as sums of Gaussians: Wyman, Sloan, Shirley 2013, (4).
fn observer(nm: f64) -> [f64; 3] {
    let g = |mean: f64, left: f64, right: f64| {
        let t = (nm - mean) * if nm < mean { left } else { right };
        (-0.5 * t * t).exp()
    };
    [
        0.362 * g(442.0, 0.0624, 0.0374) + 1.056 * g(599.8, 0.0264, 0.0323)
            - 0.065 * g(501.1, 0.0490, 0.0382),
        0.821 * g(568.8, 0.0213, 0.0247) + 0.286 * g(530.9, 0.0613, 0.0322),
        1.217 * g(437.0, 0.0845, 0.0278) + 0.681 * g(459.0, 0.0385, 0.0725),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_observer_peaks_where_it_should() {
        assert!((observer(555.0)[1] - 1.0).abs() < 0.02);
        assert!((observer(445.0)[2] - 1.78).abs() < 0.05);
    }

    #[test]
    fn sunlight_reddens_and_fades_with_the_air_it_crosses() {
        let mut last = f64::INFINITY;
        for e in [80, 60, 40, 20, 10, 5, 2] {
            let [x, y, z] = sun_xyz(f64::from(e).to_radians(), 3.0);
            assert!(y < last && y > 0.0 && x.is_finite() && z > 0.0);
            last = y;
        }
        let ratio = |e: f64| {
            let [x, _, z] = sun_xyz(e, 3.0);
            x / z
        };
        assert!(ratio(0.05) > 4.0 * ratio(1.2));
    }
}
