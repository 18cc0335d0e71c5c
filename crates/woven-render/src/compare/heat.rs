//! A picture of where two pictures differ: FLIP values as colours from black (same) over red to pale yellow (worst).

/// Colours at 0, 1/8, ... 1: dark to light in even steps, so that it also reads in grey. Our own, after the manner of
/// "magma" (van der Walt and Smith 2015): black, violet, magenta, orange, pale yellow.
const STOPS: [[f32; 3]; 9] = [
    [0.0, 0.0, 0.02],
    [0.11, 0.06, 0.27],
    [0.31, 0.07, 0.48],
    [0.51, 0.14, 0.51],
    [0.71, 0.21, 0.48],
    [0.90, 0.31, 0.39],
    [0.98, 0.53, 0.38],
    [1.00, 0.76, 0.53],
    [0.99, 0.99, 0.75],
];

/// sRGB bytes of a map of values in 0..=1, three a pixel.
pub fn colours(map: &[f32]) -> Vec<u8> {
    map.iter()
        .flat_map(|&v| {
            let x = if v.is_finite() {
                v.clamp(0.0, 1.0)
            } else {
                1.0
            } * (STOPS.len() - 1) as f32;
            let i = (x as usize).min(STOPS.len() - 2);
            let t = x - i as f32;
            std::array::from_fn::<u8, 3, _>(|k| {
                ((STOPS[i][k] + (STOPS[i + 1][k] - STOPS[i][k]) * t) * 255.0 + 0.5) as u8
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brighter_means_worse() {
        let ramp: Vec<f32> = (0..=100).map(|i| i as f32 / 100.0).collect();
        let lightness: Vec<f64> = colours(&ramp)
            .chunks(3)
            .map(|c| {
                super::super::color::cielab(
                    [0, 1, 2].map(|k| crate::film::srgb_decode(f32::from(c[k]) / 255.0).into()),
                )[0]
            })
            .collect();
        assert!(
            lightness.windows(2).all(|w| w[1] >= w[0] - 0.3),
            "{lightness:?}"
        );
        assert!(lightness[100] > 90.0 && lightness[0] < 2.0);
    }
}
