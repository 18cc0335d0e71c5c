//! Single pixels that noise has made brighter or darker than all around them, before and after the filters.

use rayon::prelude::*;

use super::luminance;

/// Brings single specks down to what their neighbours believe; returns the factor for each pixel.
pub(super) fn tame(plain: &mut [[f32; 3]], width: usize, height: usize) -> Vec<f32> {
    let lum: Vec<f32> = plain.iter().map(|c| luminance(*c)).collect();
    let factors: Vec<f32> = (0..plain.len())
        .into_par_iter()
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let mut near = [0.0_f32; 24];
            let mut n = 0;
            for yy in y.saturating_sub(2)..(y + 3).min(height) {
                for xx in x.saturating_sub(2)..(x + 3).min(width) {
                    if (xx, yy) != (x, y) {
                        near[n] = lum[yy * width + xx];
                        n += 1;
                    }
                }
            }
            if n < 8 {
                return 1.0;
            }
            near[..n].sort_by(|a, b| b.total_cmp(a));
            // The third brightest neighbour: an edge has more bright pixels than that, a speck with its shadow fewer. A speck
            // becomes as bright as that one: left brighter it would still be unlike all around it, and stay.
            let near = near[2] + 1e-6;
            if lum[i] > 1.5 * near {
                near / lum[i]
            } else {
                1.0
            }
        })
        .collect();
    plain
        .iter_mut()
        .zip(&factors)
        .for_each(|(p, f)| *p = p.map(|c| c * f));
    factors
}

/// Noise of this many standard deviations is not believed where a pixel stands alone.
const ALONE: f32 = 4.0;

/// Gives filtered pixels that are darker or brighter than all their neighbours but one the colour of the next in that order,
/// where noise explains the difference: a pixel in which an edge mixes two surfaces is like none around it, so the
/// filter leaves it alone. A line has two neighbours of its kind beside each of its pixels and stays; so does what carries
/// no noise.
pub(super) fn mend(
    sources: &[&[[f32; 3]]],
    changes: &mut [Vec<[f32; 3]>],
    noise: &[f32],
    width: usize,
    height: usize,
) {
    let filtered = |s: &[[f32; 3]], c: &[[f32; 3]], i: usize| [0, 1, 2].map(|k| s[i][k] + c[i][k]);
    let lum: Vec<f32> = (0..noise.len())
        .map(|i| luminance(filtered(sources[0], &changes[0], i)))
        .collect();
    let like: Vec<usize> = (0..lum.len())
        .into_par_iter()
        .map(|i| {
            let (x, y) = (i % width, i / width);
            if x == 0 || y == 0 || x + 1 == width || y + 1 == height {
                return i;
            }
            let (above, below) = (i - width, i + width);
            let mut near = [
                above - 1,
                above,
                above + 1,
                i - 1,
                i + 1,
                below - 1,
                below,
                below + 1,
            ];
            near.sort_by(|&a, &b| lum[a].total_cmp(&lum[b]));
            let to = if lum[i] < lum[near[1]] {
                near[1]
            } else if lum[i] > lum[near[6]] {
                near[6]
            } else {
                return i;
            };
            let far = lum[to] - lum[i];
            if far * far <= ALONE * ALONE * noise[i] {
                to
            } else {
                i
            }
        })
        .collect();
    for (source, change) in sources.iter().zip(changes) {
        let before = std::mem::take(change);
        *change = (0..like.len())
            .map(|i| {
                if like[i] == i {
                    return before[i];
                }
                let to = filtered(source, &before, like[i]);
                [0, 1, 2].map(|k| to[k] - source[i][k])
            })
            .collect();
    }
}
