//! Which second points of a block are looked at, by one coin for all of them.

use super::{BLOCK, GROUP, KEPT};

/// Width of a tooth, where the teeth are one apart. Of no width it would fall on one or the other of two points by the
/// rounding of their brightness, and the shader's picture would differ; a hundredth looks at 0.6 points more.
const TOOTH: f32 = 0.01;
/// From row to row of a block a comb is shifted by so much.
const GOLDEN: f32 = 0.618_034;

/// Weights of the second points, 0 for those that are dropped, 1 on the mean. The points of a row are laid side by side,
/// each as long as it is bright, and a comb with `KEPT` teeth for all rows is laid on them, shifted by `coin`; a point
/// counts by what lies on it. Each row has a comb of its own, so that a path which goes another way in the shader by
/// rounding moves the teeth of seven others only.
pub(super) fn comb(bright: &[f32; GROUP], total: f32, coin: f32) -> [f32; GROUP] {
    let under_teeth = |x: f32| x.floor() * TOOTH + (x - x.floor()).min(TOOTH);
    let mut weights = [0.0; GROUP];
    let rows = bright.chunks_exact(BLOCK as usize);
    for (row, (bright, weights)) in rows
        .zip(weights.chunks_exact_mut(BLOCK as usize))
        .enumerate()
    {
        let turned = coin + GOLDEN * row as f32;
        let start = turned - turned.floor();
        let (mut sum, mut before) = (0.0, under_teeth(start));
        for (bright, weight) in bright.iter().zip(weights) {
            sum += bright;
            let now = under_teeth(KEPT * sum / total + start);
            let teeth = (now - before) / TOOTH;
            before = now;
            // Where one tooth at least is sure to lie nothing is left to chance.
            let length = KEPT * bright / total;
            if teeth > 0.0 {
                *weight = if length < 1.0 { teeth / length } else { 1.0 };
            }
        }
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::{hash, unit};

    #[test]
    fn a_comb_keeps_each_point_as_often_as_it_is_bright_and_as_many_each_time() {
        // Dark, dim, bright and one that is brighter than a sixteenth of all.
        let bright: [f32; GROUP] = std::array::from_fn(|i| match i {
            5 => 0.0,
            9 => 14.0,
            _ => unit(hash(i as u32)),
        });
        let total = bright.iter().sum();
        const COINS: usize = 20_000;
        let mut means = [0.0; GROUP];
        let (mut fewest, mut most) = (GROUP, 0);
        for k in 0..COINS {
            let weights = comb(&bright, total, k as f32 / COINS as f32);
            let kept = weights.iter().filter(|w| **w > 0.0).count();
            (fewest, most) = (fewest.min(kept), most.max(kept));
            for (mean, w) in means.iter_mut().zip(weights) {
                *mean += w / COINS as f32;
            }
        }
        for (i, mean) in means.into_iter().enumerate() {
            let right = if bright[i] > 0.0 { 1.0 } else { 0.0 };
            // The coins are a grid: each point's weight is off by at most a step or two of it, over its probability.
            let slack = 2.0 / (COINS as f32 * (KEPT * bright[i] / total).max(1e-2));
            assert!((mean - right).abs() <= slack.max(1e-3), "point {i}: {mean}");
        }
        // Independent coins leave from about 5 to 25.
        assert!(fewest >= 8 && most <= 18, "{fewest} to {most} kept");
    }
}
