//! A density over the unit square as the warp that makes it even, as the RGL format stores it.

/// Values on a grid over the unit square, one slice per point of a grid of parameters; linear between all of them.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) values: Vec<f32>,
}

/// The slices that surround a place in the parameters, with their shares.
pub(super) type Slices = [(usize, f64); 4];

impl Grid {
    fn blend(&self, slices: &[(usize, f64)], column: usize, row: usize) -> f64 {
        let size = self.width * self.height;
        slices
            .iter()
            .map(|&(s, w)| w * f64::from(self.values[s * size + row * self.width + column]))
            .sum()
    }
    /// The cell of a coordinate, and where in it.
    fn cell(x: f64, n: usize) -> (usize, f64) {
        let x = x.clamp(0.0, 1.0) * (n - 1) as f64;
        let i = (x as usize).min(n.saturating_sub(2));
        (i, x - i as f64)
    }
    fn corners(
        &self,
        slices: &[(usize, f64)],
        x: f64,
        y: f64,
    ) -> ([f64; 4], (usize, f64), (usize, f64)) {
        let (cx, cy) = (Self::cell(x, self.width), Self::cell(y, self.height));
        let at = |dx: usize, dy: usize| {
            let (i, j) = (
                (cx.0 + dx).min(self.width - 1),
                (cy.0 + dy).min(self.height - 1),
            );
            self.blend(slices, i, j)
        };
        ([at(0, 0), at(1, 0), at(0, 1), at(1, 1)], cx, cy)
    }
    pub(super) fn eval(&self, slices: &[(usize, f64)], x: f64, y: f64) -> f64 {
        let ([a, b, c, d], (_, s), (_, t)) = self.corners(slices, x, y);
        (a * (1.0 - s) + b * s) * (1.0 - t) + (c * (1.0 - s) + d * s) * t
    }
}

/// A [`Grid`] as a density with its sums along rows and over rows.
#[derive(Clone, Debug)]
pub(super) struct Warp {
    density: Grid,
    /// For each vertex the integral of its row from the left.
    along: Grid,
    /// For each row the integral of the rows below it; one column.
    over: Grid,
}

impl Warp {
    /// Each slice is scaled so that it integrates to 1; one without any light stays black.
    pub(super) fn new(mut density: Grid) -> Self {
        let (w, h) = (density.width, density.height);
        let (dx, dy) = (1.0 / (w.max(2) - 1) as f64, 1.0 / (h.max(2) - 1) as f64);
        let mut along = vec![0.0f32; density.values.len()];
        let mut over = Vec::with_capacity(density.values.len() / w.max(1));
        for (slice, sums) in density
            .values
            .chunks_exact_mut(w * h)
            .zip(along.chunks_exact_mut(w * h))
        {
            // Noise below zero is no density.
            slice.iter_mut().for_each(|x| *x = x.max(0.0));
            let mut rows = vec![0.0f64; h];
            for (j, row) in rows.iter_mut().enumerate() {
                let mut sum = 0.0;
                for i in 1..w {
                    sum += 0.5 * dx * f64::from(slice[j * w + i - 1] + slice[j * w + i]);
                    sums[j * w + i] = sum as f32;
                }
                *row = sum;
            }
            let total: f64 = rows.windows(2).map(|r| 0.5 * dy * (r[0] + r[1])).sum();
            let scale = if total > 0.0 { 1.0 / total } else { 0.0 };
            slice
                .iter_mut()
                .chain(sums.iter_mut())
                .for_each(|x| *x = (f64::from(*x) * scale) as f32);
            let mut sum = 0.0;
            over.push(0.0);
            for pair in rows.windows(2) {
                sum += 0.5 * dy * (pair[0] + pair[1]) * scale;
                over.push(sum as f32);
            }
        }
        Warp {
            along: Grid {
                width: w,
                height: h,
                values: along,
            },
            over: Grid {
                width: 1,
                height: h,
                values: over,
            },
            density,
        }
    }

    /// Where the point (x, y) comes from in the unit square.
    pub(super) fn invert(&self, slices: &[(usize, f64)], x: f64, y: f64) -> (f64, f64) {
        let (w, h) = (self.density.width, self.density.height);
        let ([a, b, c, d], (i, s), (j, t)) = self.density.corners(slices, x, y);
        let mix = |p: f64, q: f64| p * (1.0 - t) + q * t;
        let row = |i: usize| {
            mix(
                self.along.blend(slices, i, j),
                self.along.blend(slices, i, (j + 1).min(h - 1)),
            )
        };
        let (left, right) = (mix(a, c), mix(b, d));
        let part = (left + 0.5 * (right - left) * s) * s / (w - 1) as f64;
        let whole = row(w - 1);
        let (low, high) = (
            self.along.blend(slices, w - 1, j),
            self.along.blend(slices, w - 1, (j + 1).min(h - 1)),
        );
        let below =
            self.over.blend(slices, 0, j) + (low + 0.5 * (high - low) * t) * t / (h - 1) as f64;
        let u = if whole > 0.0 {
            (row(i) + part) / whole
        } else {
            x
        };
        (u.clamp(0.0, 1.0), below.clamp(0.0, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_shrink_as_the_density_says() {
        // Three columns, four rows, nothing alike, so that a corner taken for another shows; two slices, mixed.
        let values = [
            1.0, 3.0, 0.5, 2.0, 0.2, 4.0, 0.7, 6.0, 1.5, 5.0, 0.9, 2.5, //
            0.3, 1.0, 2.0, 5.0, 1.0, 0.1, 2.0, 0.4, 3.0, 1.2, 2.2, 0.6,
        ];
        let warp = Warp::new(Grid {
            width: 3,
            height: 4,
            values: values.to_vec(),
        });
        for slices in [[(0, 1.0), (1, 0.0)], [(0, 0.3), (1, 0.7)]] {
            for i in 0..8 {
                for j in 0..9 {
                    // Inside the cells, away from their edges, where the density has kinks.
                    let (x, y) = ((i as f64 + 0.5) / 8.0, (j as f64 + 0.5) / 9.0);
                    const H: f64 = 1e-4;
                    let at = |dx: f64, dy: f64| warp.invert(&slices, x + dx * H, y + dy * H);
                    let (dx, dy) = ((at(1.0, 0.0), at(-1.0, 0.0)), (at(0.0, 1.0), at(0.0, -1.0)));
                    let det = (dx.0.0 - dx.1.0) * (dy.0.1 - dy.1.1)
                        - (dx.0.1 - dx.1.1) * (dy.0.0 - dy.1.0);
                    let (got, known) = (det / (4.0 * H * H), warp.density.eval(&slices, x, y));
                    // The sums are kept in single precision: 1e-7 over a step of 2e-4.
                    assert!(
                        (got - known).abs() < 5e-3 * known.max(0.1),
                        "{x} {y}: {got} {known}"
                    );
                }
            }
            assert!(warp.invert(&slices, 0.0, 0.0).1.abs() < 1e-6);
            let end = warp.invert(&slices, 1.0, 1.0);
            assert!((end.0 - 1.0).abs() < 1e-6 && (end.1 - 1.0).abs() < 1e-6);
        }
    }
}
