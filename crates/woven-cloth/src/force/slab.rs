//! Shear and bending of some rows of a sheet, in loops that become vector code.

use super::Shape;
use crate::sheet::{Field, half_at_ends};

/// Some rows of a sheet of `ny` rows: `rows` of them, from number `first` on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slab {
    pub(crate) nx: usize,
    pub(crate) first: usize,
    pub(crate) rows: usize,
    pub(crate) ny: usize,
}

/// Work space for the terms of one row of cells, zero before the first and after the last.
#[derive(Clone, Debug, Default)]
pub(crate) struct Terms {
    rows: [Vec<f64>; 6],
    second: Vec<f64>,
}

impl Terms {
    pub(crate) fn new(nx: usize) -> Self {
        Self {
            rows: std::array::from_fn(|_| vec![0.0; nx + 1]),
            second: vec![0.0; nx + 2],
        }
    }
}

/// The three coordinates as slices.
pub(super) fn views(x: &Field) -> [&[f64]; 3] {
    [&x[0], &x[1], &x[2]]
}

/// The three coordinates as slices to be changed.
pub(super) fn views_mut(x: &mut Field) -> [&mut [f64]; 3] {
    let [a, b, c] = x;
    [a, b, c]
}

impl Shape {
    /// Shear of the cells between rows `cells` and the rows below them; `x` and `f` hold rows of a slab.
    ///
    /// Each cell's terms are written down first and gathered by the vertices afterwards: no loop reads what it just wrote, so
    /// the compiler makes vector code of both.
    #[inline(always)]
    pub(crate) fn shear_slab(
        &self,
        nx: usize,
        cells: std::ops::Range<usize>,
        x: [&[f64]; 3],
        f: [&mut [f64]; 3],
        terms: &mut Terms,
    ) {
        if self.shear <= 0.0 {
            return;
        }
        let m = nx - 1;
        let [fx, fy, fz] = f;
        for j in cells {
            let (r0, r1, r2) = (j * nx, (j + 1) * nx, (j + 2) * nx);
            {
                let corners = |c: usize| {
                    let (a, b) = (&x[c][r0..r1], &x[c][r1..r2]);
                    (&a[..m], &a[1..], &b[..m], &b[1..])
                };
                let (xa, xb, xc, xd) = corners(0);
                let (ya, yb, yc, yd) = corners(1);
                let (za, zb, zc, zd) = corners(2);
                let [px, py, pz, mx, my, mz] = &mut terms.rows;
                let (px, py, pz) = (&mut px[1..nx], &mut py[1..nx], &mut pz[1..nx]);
                let (mx, my, mz) = (&mut mx[1..nx], &mut my[1..nx], &mut mz[1..nx]);
                let (rx, ry) = (self.rx, self.ry);
                for i in 0..m {
                    let (s, t) = (xd[i] - xa[i], xb[i] - xc[i]);
                    let (ux, vx) = ((s + t) * rx, (s - t) * ry);
                    let (s, t) = (yd[i] - ya[i], yb[i] - yc[i]);
                    let (uy, vy) = ((s + t) * rx, (s - t) * ry);
                    let (s, t) = (zd[i] - za[i], zb[i] - zc[i]);
                    let (uz, vz) = ((s + t) * rx, (s - t) * ry);
                    let t = self.shear * (ux * vx + uy * vy + uz * vz);
                    // d gamma / d corner: -+ e2/(2hx) -+ e1/(2hy).
                    let (p, q) = (t * rx, t * ry);
                    (px[i], mx[i]) = (p * vx + q * ux, q * ux - p * vx);
                    (py[i], my[i]) = (p * vy + q * uy, q * uy - p * vy);
                    (pz[i], mz[i]) = (p * vz + q * uz, q * uz - p * vz);
                }
            }
            for (c, f) in [&mut *fx, &mut *fy, &mut *fz].into_iter().enumerate() {
                let (f0, f1) = f[r0..r2].split_at_mut(nx);
                let (p, q) = (&terms.rows[c][..nx + 1], &terms.rows[3 + c][..nx + 1]);
                for i in 0..nx {
                    f0[i] += p[i + 1] + q[i];
                    f1[i] -= q[i + 1] + p[i];
                }
            }
        }
    }

    /// Bending and twist at the rows of a slab; those along the weft only of the slab's rows `weft`.
    #[inline(always)]
    pub(crate) fn bending_slab(
        &self,
        slab: Slab,
        weft: std::ops::Range<usize>,
        x: [&[f64]; 3],
        f: [&mut [f64]; 3],
        terms: &mut Terms,
    ) {
        let nx = slab.nx;
        for (x, f) in x.into_iter().zip(f) {
            for j in 1..slab.rows - 1 {
                let (a, b, c) = (
                    &x[(j - 1) * nx..j * nx],
                    &x[j * nx..(j + 1) * nx],
                    &x[(j + 1) * nx..(j + 2) * nx],
                );
                let (fa, rest) = f[(j - 1) * nx..(j + 2) * nx].split_at_mut(nx);
                let (fb, fc) = rest.split_at_mut(nx);
                let mut add = |i: usize, k: f64| {
                    let t = k * (a[i] - 2.0 * b[i] + c[i]);
                    fa[i] -= t;
                    fb[i] += 2.0 * t;
                    fc[i] -= t;
                };
                add(0, 0.5 * self.bend_warp);
                for i in 1..nx - 1 {
                    add(i, self.bend_warp);
                }
                add(nx - 1, 0.5 * self.bend_warp);
            }
            // `second` stays zero at its ends, where no second difference lies.
            for j in weft.clone() {
                let k = self.bend_weft * half_at_ends(slab.first + j, slab.ny);
                let (x, f) = (&x[j * nx..(j + 1) * nx], &mut f[j * nx..(j + 1) * nx]);
                let t = &mut terms.second[..nx + 2];
                {
                    let (a, b, c) = (&x[..nx - 2], &x[1..nx - 1], &x[2..]);
                    let t = &mut t[2..nx];
                    for i in 0..nx - 2 {
                        t[i] = k * (a[i] - 2.0 * b[i] + c[i]);
                    }
                }
                for i in 0..nx {
                    f[i] += 2.0 * t[i + 1] - t[i] - t[i + 2];
                }
            }
            if self.twist > 0.0 {
                let m = nx - 1;
                for j in 0..slab.rows - 1 {
                    let (x0, x1) = (&x[j * nx..(j + 1) * nx], &x[(j + 1) * nx..(j + 2) * nx]);
                    let t = &mut terms.rows[0][..nx + 1];
                    {
                        let (a, b, c, d) = (&x0[..m], &x0[1..], &x1[..m], &x1[1..]);
                        let t = &mut t[1..nx];
                        for i in 0..m {
                            t[i] = self.twist * (a[i] - b[i] - c[i] + d[i]);
                        }
                    }
                    let (f0, f1) = f[j * nx..(j + 2) * nx].split_at_mut(nx);
                    for i in 0..nx {
                        let d = t[i] - t[i + 1];
                        f0[i] += d;
                        f1[i] -= d;
                    }
                }
            }
        }
    }
}
