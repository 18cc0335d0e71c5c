//! The air's push on moving cloth: the wind at every cell, then dynamic pressure of the relative normal velocity.

use super::{AIR_DENSITY, Wind};
use crate::fabrics::Mechanics;
use crate::sheet::{Field, Sheet};
use crate::work::{over_bands, widest, worth_threads};

/// Rows of cells that go together.
const BAND: usize = 16;

/// The air seen by every cell of a sheet: wind at two ticks, linear between them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct AirState {
    pub(crate) now: Field,
    pub(crate) next: Field,
}

/// The wind at every cell's middle at time `t`.
pub(crate) fn sample(sheet: &Sheet, wind: &Wind, t: f64, out: &mut Field) {
    let (nx, ny) = (sheet.nx, sheet.ny);
    for u in out.iter_mut() {
        u.clear();
        u.resize((nx - 1) * (ny - 1), 0.0);
    }
    if wind.is_calm() {
        return;
    }
    let (mean, spec) = (wind.mean_speed(t), wind.spec());
    let calm = (mean.abs() / spec.speed.max(1e-9)).min(1.0);
    // Eddies at a coarser grid of cells, bilinear between: six points to the shortest wave of half an eddy's length.
    let stride =
        |h: f64, cells: usize| ((spec.eddy_length / (12.0 * h)) as usize).clamp(1, cells.max(1));
    let (sx, sy) = (stride(sheet.hx, nx - 1), stride(sheet.hy, ny - 1));
    let (mx, my) = ((nx - 1).div_ceil(sx) + 1, (ny - 1).div_ceil(sy) + 1);
    let mut coarse: Field = std::array::from_fn(|_| vec![0.0; mx * my]);
    let n = wind.direction();
    let parallel = worth_threads(sheet);
    over_bands(&mut coarse, mx, parallel, |row, mut u| {
        let j = (row * sy).min(ny - 1);
        let p: Field = std::array::from_fn(|c| {
            (0..mx)
                .map(|i| sheet.x[c][j * nx + (i * sx).min(nx - 1)])
                .collect()
        });
        widest(
            #[inline(always)]
            || {
                let [ux, uy, uz] = &mut u;
                wind.eddies_along([&p[0], &p[1], &p[2]], t, [ux, uy, uz]);
            },
        );
        for i in 0..mx {
            let jet = wind.jet([p[0][i], p[1][i], p[2][i]]);
            for c in 0..3 {
                u[c][i] = jet * (mean * n[c] + calm * u[c][i]);
            }
        }
    });
    for c in 0..3 {
        let coarse = &coarse[c];
        for j in 0..ny - 1 {
            let (cj, fj) = (j / sy, ((j % sy) as f64 + 0.5) / sy as f64);
            let (top, low) = (&coarse[cj * mx..][..mx], &coarse[(cj + 1) * mx..][..mx]);
            for (i, out) in out[c][j * (nx - 1)..][..nx - 1].iter_mut().enumerate() {
                let (ci, fi) = (i / sx, ((i % sx) as f64 + 0.5) / sx as f64);
                let a = top[ci] + (top[ci + 1] - top[ci]) * fi;
                let b = low[ci] + (low[ci + 1] - low[ci]) * fi;
                *out = a + (b - a) * fj;
            }
        }
    }
}

/// Coefficients of the air's push.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Drag {
    /// 1/2 rho C_N.
    pub(crate) normal: f64,
    /// 1/2 rho C_T.
    pub(crate) tangential: f64,
}

impl Drag {
    /// Drag of a fabric in a wind of about `speed` m/s.
    pub(crate) fn new(mechanics: &Mechanics, tangential: f64, speed: f64) -> Self {
        Self {
            normal: 0.5 * AIR_DENSITY * mechanics.drag_coefficient(speed),
            tangential: 0.5 * AIR_DENSITY * tangential,
        }
    }
}

/// Forces of the air on the vertices: per cell p = 1/2 rho C |w_n| w_n with w the air's velocity relative to the cloth, plus a small
/// tangential part, a quarter to each corner. `s` in 0..1 is the time between the two ticks of the air.
pub(crate) fn air_forces(sheet: &Sheet, air: &AirState, s: f64, drag: Drag, f: &mut Field) {
    let (nx, ny) = (sheet.nx, sheet.ny);
    over_bands(f, BAND * nx, worth_threads(sheet), |band, mut f| {
        let (j0, j1) = (band * BAND, (band * BAND + BAND).min(ny));
        for f in &mut f {
            f.fill(0.0);
        }
        // A cell's push, with a zero before the first and after the last of a row.
        let mut push: Field = std::array::from_fn(|_| vec![0.0; nx + 1]);
        widest(
            #[inline(always)]
            || {
                for j in j0.max(1) - 1..j1.min(ny - 1) {
                    cell_row(sheet, air, s, drag, j, &mut push);
                    for c in 0..3 {
                        let g = &push[c][..nx + 1];
                        for row in [j, j + 1] {
                            if (j0..j1).contains(&row) {
                                let f = &mut f[c][(row - j0) * nx..][..nx];
                                for i in 0..nx {
                                    f[i] += g[i] + g[i + 1];
                                }
                            }
                        }
                    }
                }
            },
        );
    });
}

/// A quarter of the force on every cell of row `j`, at `push[c][1 + i]`.
#[inline(always)]
fn cell_row(sheet: &Sheet, air: &AirState, s: f64, drag: Drag, j: usize, push: &mut Field) {
    let (nx, m) = (sheet.nx, sheet.nx - 1);
    fn corners(a: &[f64], j: usize, nx: usize) -> [&[f64]; 4] {
        let (top, low) = a[j * nx..(j + 2) * nx].split_at(nx);
        [&top[..nx - 1], &top[1..], &low[..nx - 1], &low[1..]]
    }
    // Names end in the corner: a upper left, b upper right, c lower left, d lower right.
    let [xa, xb, xc, xd] = corners(&sheet.x[0], j, nx);
    let [ya, yb, yc, yd] = corners(&sheet.x[1], j, nx);
    let [za, zb, zc, zd] = corners(&sheet.x[2], j, nx);
    let [ua, ub, uc, ud] = corners(&sheet.v[0], j, nx);
    let [va, vb, vc, vd] = corners(&sheet.v[1], j, nx);
    let [wa, wb, wc, wd] = corners(&sheet.v[2], j, nx);
    let between = |c: usize| (&air.now[c][j * m..][..m], &air.next[c][j * m..][..m]);
    let ((u0, u1), (v0, v1), (w0, w1)) = (between(0), between(1), between(2));
    let [px, py, pz] = push;
    let (px, py, pz) = (&mut px[1..nx], &mut py[1..nx], &mut pz[1..nx]);
    for i in 0..m {
        // Area vector of the quad: half the cross product of its diagonals.
        let (ax, ay, az) = (xd[i] - xa[i], yd[i] - ya[i], zd[i] - za[i]);
        let (bx, by, bz) = (xb[i] - xc[i], yb[i] - yc[i], zb[i] - zc[i]);
        let (nx_, ny_, nz_) = (
            0.5 * (ay * bz - az * by),
            0.5 * (az * bx - ax * bz),
            0.5 * (ax * by - ay * bx),
        );
        let wx = u0[i] + (u1[i] - u0[i]) * s - 0.25 * (ua[i] + ub[i] + uc[i] + ud[i]);
        let wy = v0[i] + (v1[i] - v0[i]) * s - 0.25 * (va[i] + vb[i] + vc[i] + vd[i]);
        let wz = w0[i] + (w1[i] - w0[i]) * s - 0.25 * (wa[i] + wb[i] + wc[i] + wd[i]);
        let n2 = (nx_ * nx_ + ny_ * ny_ + nz_ * nz_).max(1e-30);
        let wn = wx * nx_ + wy * ny_ + wz * nz_;
        let (along, area) = (wn / n2, n2.sqrt());
        // Normal part |w_n| w_n A n, tangential |w_t| w_t A with w_t = w - w_n n.
        let (tx, ty, tz) = (wx - along * nx_, wy - along * ny_, wz - along * nz_);
        let t = drag.tangential * area * (tx * tx + ty * ty + tz * tz).sqrt();
        let p = drag.normal * wn.abs() * along;
        px[i] = 0.25 * (p * nx_ + t * tx);
        py[i] = 0.25 * (p * ny_ + t * ty);
        pz[i] = 0.25 * (p * nz_ + t * tz);
    }
}

/// Forces of a uniform wind (m/s) on a sheet, N, with the normal drag coefficient `c_n` and no tangential part.
#[must_use]
pub fn uniform_wind_forces(sheet: &Sheet, wind: [f64; 3], c_n: f64) -> [Vec<f64>; 3] {
    let cells = (sheet.nx - 1) * (sheet.ny - 1);
    let air: Field = wind.map(|w| vec![w; cells]);
    let air = AirState {
        now: air.clone(),
        next: air,
    };
    let mut f = std::array::from_fn(|_| vec![0.0; sheet.len()]);
    let drag = Drag {
        normal: 0.5 * AIR_DENSITY * c_n,
        tangential: 0.0,
    };
    air_forces(sheet, &air, 0.0, drag, &mut f);
    f
}
