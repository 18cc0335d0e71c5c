//! Colour spaces for comparing: CIE XYZ, L*a*b*, the opponent space of FLIP, and the colour difference ΔE2000.

/// Linear Rec.709 to CIE XYZ (D65), the exact rational matrix of the standard's primaries and white.
pub fn xyz(rgb: [f64; 3]) -> [f64; 3] {
    let [r, g, b] = rgb;
    [
        r * (10_135_552.0 / 24_577_794.0)
            + g * (8_788_810.0 / 24_577_794.0)
            + b * (4_435_075.0 / 24_577_794.0),
        r * (2_613_072.0 / 12_288_897.0)
            + g * (8_788_810.0 / 12_288_897.0)
            + b * (887_015.0 / 12_288_897.0),
        r * (1_425_312.0 / 73_733_382.0)
            + g * (8_788_810.0 / 73_733_382.0)
            + b * (70_074_185.0 / 73_733_382.0),
    ]
}

/// CIE XYZ (D65) to linear Rec.709: the inverse of [`xyz`].
pub fn rgb_of_xyz(v: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = v;
    [
        x * 3.241_003_232_976_358_7 - y * 1.537_398_969_488_785_5 - z * 0.498_615_881_996_362_9,
        -x * 0.969_224_252_202_516_6 + y * 1.875_929_983_695_176 + z * 0.041_554_226_340_084_724,
        x * 0.055_639_419_851_975_444 - y * 0.204_011_206_123_909_97 + z * 1.057_148_977_187_533_5,
    ]
}

/// White of Rec.709: D65 at Y = 1.
pub fn white() -> [f64; 3] {
    xyz([1.0; 3])
}

/// CIE L*a*b* (1976) of a linear Rec.709 colour, D65 white.
pub fn cielab(rgb: [f64; 3]) -> [f64; 3] {
    const DELTA: f64 = 6.0 / 29.0;
    let f = |t: f64| {
        if t > DELTA * DELTA * DELTA {
            t.cbrt()
        } else {
            t / (3.0 * DELTA * DELTA) + 4.0 / 29.0
        }
    };
    let (v, w) = (xyz(rgb), white());
    let [x, y, z] = [f(v[0] / w[0]), f(v[1] / w[1]), f(v[2] / w[2])];
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// YCxCz, the linear opponent space of FLIP (Andersson et al. 2020, section 3.1): L*a*b* without the cube root.
pub fn ycxcz(rgb: [f64; 3]) -> [f64; 3] {
    let (v, w) = (xyz(rgb), white());
    let [x, y, z] = [v[0] / w[0], v[1] / w[1], v[2] / w[2]];
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// The inverse of [`ycxcz`], to linear Rec.709.
pub fn rgb_of_ycxcz(c: [f64; 3]) -> [f64; 3] {
    let w = white();
    let y = (c[0] + 16.0) / 116.0;
    rgb_of_xyz([
        (c[1] / 500.0 + y) * w[0],
        y * w[1],
        (y - c[2] / 200.0) * w[2],
    ])
}

/// The colour difference CIEDE2000 (Sharma, Wu, Dalal 2005) of two L*a*b* colours, all weights 1.
pub fn delta_e2000(first: [f64; 3], second: [f64; 3]) -> f64 {
    use std::f64::consts::{PI, TAU};
    let [l1, a1, b1] = first;
    let [l2, a2, b2] = second;
    let pow7 = |x: f64| x.powi(7);
    // (2)-(6): chroma adjusted by G.
    let c_bar = (a1.hypot(b1) + a2.hypot(b2)) / 2.0;
    let g = 0.5 * (1.0 - (pow7(c_bar) / (pow7(c_bar) + pow7(25.0))).sqrt());
    let (a1, a2) = (a1 * (1.0 + g), a2 * (1.0 + g));
    let (c1, c2) = (a1.hypot(b1), a2.hypot(b2));
    // (7): hue angle, 0 for grey.
    let hue = |a: f64, b: f64| {
        if a == 0.0 && b == 0.0 {
            0.0
        } else {
            b.atan2(a).rem_euclid(TAU)
        }
    };
    let (h1, h2) = (hue(a1, b1), hue(a2, b2));
    // (8)-(11).
    let dl = l2 - l1;
    let dc = c2 - c1;
    let grey = c1 * c2 == 0.0;
    let mut dh = h2 - h1;
    if grey {
        dh = 0.0;
    } else if dh > PI {
        dh -= TAU;
    } else if dh < -PI {
        dh += TAU;
    }
    let dh_term = 2.0 * (c1 * c2).sqrt() * (dh / 2.0).sin();
    // (12)-(14): means.
    let l_bar = (l1 + l2) / 2.0;
    let c_bar = (c1 + c2) / 2.0;
    let h_bar = if grey {
        h1 + h2
    } else if (h1 - h2).abs() <= PI {
        (h1 + h2) / 2.0
    } else if h1 + h2 < TAU {
        (h1 + h2 + TAU) / 2.0
    } else {
        (h1 + h2 - TAU) / 2.0
    };
    // (15)-(21).
    let deg = |d: f64| d.to_radians();
    let t = 1.0 - 0.17 * (h_bar - deg(30.0)).cos()
        + 0.24 * (2.0 * h_bar).cos()
        + 0.32 * (3.0 * h_bar + deg(6.0)).cos()
        - 0.20 * (4.0 * h_bar - deg(63.0)).cos();
    let d_theta = deg(30.0) * (-((h_bar.to_degrees() - 275.0) / 25.0).powi(2)).exp();
    let r_c = 2.0 * (pow7(c_bar) / (pow7(c_bar) + pow7(25.0))).sqrt();
    let s_l = 1.0 + 0.015 * (l_bar - 50.0).powi(2) / (20.0 + (l_bar - 50.0).powi(2)).sqrt();
    let s_c = 1.0 + 0.045 * c_bar;
    let s_h = 1.0 + 0.015 * c_bar * t;
    let r_t = -(2.0 * d_theta).sin() * r_c;
    // (22).
    let (l, c, h) = (dl / s_l, dc / s_c, dh_term / s_h);
    (l * l + c * c + h * h + r_t * c * h).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_two_matrices_are_inverse() {
        for i in 0..3 {
            let mut e = [0.0; 3];
            e[i] = 1.0;
            let back = rgb_of_xyz(xyz(e));
            for k in 0..3 {
                assert!((back[k] - e[k]).abs() < 1e-9, "{i}: {back:?}");
            }
        }
        let c = [0.3, 0.7, 0.05];
        let back = rgb_of_ycxcz(ycxcz(c));
        assert!(
            c.iter().zip(back).all(|(x, y)| (x - y).abs() < 1e-9),
            "{back:?}"
        );
    }

    #[test]
    fn delta_e2000_agrees_with_the_published_pairs() {
        // Sharma, Wu, Dalal 2005, table 1: pairs 1, 4, 7, 9, 17, 19, 25, 34, printed with four decimals.
        let table = [
            ([50.0, 2.6772, -79.7751], [50.0, 0.0, -82.7485], 2.0425),
            ([50.0, -1.3802, -84.2814], [50.0, 0.0, -82.7485], 1.0000),
            ([50.0, 0.0, 0.0], [50.0, -1.0, 2.0], 2.3669),
            ([50.0, 2.49, -0.001], [50.0, -2.49, 0.0009], 7.1792),
            ([50.0, 2.5, 0.0], [73.0, 25.0, -18.0], 27.1492),
            ([50.0, 2.5, 0.0], [56.0, -27.0, -3.0], 31.9030),
            (
                [60.2574, -34.0099, 36.2677],
                [60.4626, -34.1751, 39.4387],
                1.2644,
            ),
            (
                [2.0776, 0.0795, -1.1350],
                [0.9033, -0.0636, -0.5514],
                0.9082,
            ),
        ];
        for (a, b, want) in table {
            for (x, y) in [(a, b), (b, a)] {
                let got = delta_e2000(x, y);
                assert!(
                    (got - want).abs() < 5.1e-5,
                    "{x:?} {y:?}: {got}, published {want}"
                );
            }
        }
    }
}
