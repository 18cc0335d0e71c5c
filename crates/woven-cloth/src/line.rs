//! The direct solve of one thread: all stretch constraints of a warp (or weft) line at once, a tridiagonal system.
//!
//! XPBD (Macklin et al. 2016) with compliance alpha = 1/k asks for (J M⁻¹ Jᵀ + alpha/h²) dlambda = -C. Along a thread
//! J M⁻¹ Jᵀ is tridiagonal, so one forward and one backward sweep solve it exactly, where Gauss-Seidel would leave a stretch that
//! grows with the count of rows. Eight threads are solved side by side, which the compiler turns into vector code.

/// Threads solved side by side.
pub(crate) const LANES: usize = 8;
pub(crate) type Lane = [f64; LANES];

/// Eight threads of `n` vertices.
#[derive(Clone, Debug, Default)]
pub(crate) struct Block {
    /// Positions, changed in place by `solve`.
    pub(crate) x: Vec<Lane>,
    pub(crate) y: Vec<Lane>,
    pub(crate) z: Vec<Lane>,
    /// Inverse masses.
    pub(crate) w: Vec<Lane>,
    /// Force of each edge over the step before and, after `solve`, of this one (times h'²; negative is tension), kg m.
    pub(crate) lambda: Vec<Lane>,
    /// Length of each edge at the start of the step, used when there is damping, m.
    pub(crate) before: Vec<Lane>,
}

/// Work space of a solve.
#[derive(Clone, Debug, Default)]
pub(crate) struct Work {
    nx: Vec<Lane>,
    ny: Vec<Lane>,
    nz: Vec<Lane>,
    c: Vec<Lane>,
    r: Vec<Lane>,
}

impl Work {
    /// Room for threads of `n` vertices.
    pub(crate) fn fit(&mut self, n: usize) {
        for v in [
            &mut self.nx,
            &mut self.ny,
            &mut self.nz,
            &mut self.c,
            &mut self.r,
        ] {
            if v.len() < n {
                v.resize(n, [0.0; LANES]);
            }
        }
    }
}

/// What the springs of the eight threads have in common.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Springs {
    /// Rest length, m.
    pub(crate) rest: f64,
    /// alpha / h'² = 1/(k h'²) per lane, 1/kg.
    pub(crate) alpha: Lane,
    /// Damping time / h'; 0 for none.
    pub(crate) damping: f64,
    /// Growth of the tangent stiffness per strain, in tension.
    pub(crate) stiffening: f64,
}

impl Block {
    pub(crate) fn new(n: usize) -> Self {
        let lane = || vec![[0.0; LANES]; n];
        Self {
            x: lane(),
            y: lane(),
            z: lane(),
            w: lane(),
            lambda: lane(),
            before: lane(),
        }
    }

    /// One exact solve of the linearised constraints of threads of `n` vertices.
    ///
    /// `WARM`: the positions already carry the forces `lambda` of the step before, and the solve corrects both. Otherwise the
    /// positions carry none and the whole force is found.
    #[inline(always)]
    pub(crate) fn solve<const WARM: bool>(&mut self, n: usize, springs: &Springs, work: &mut Work) {
        let Springs {
            rest,
            alpha,
            damping,
            stiffening,
        } = *springs;
        let g = 1.0 + damping;
        let inv_rest = 1.0 / rest;
        let (x, y, z, w) = (
            &mut self.x[..n],
            &mut self.y[..n],
            &mut self.z[..n],
            &self.w[..n],
        );
        let (nx, ny, nz) = (&mut work.nx[..n], &mut work.ny[..n], &mut work.nz[..n]);
        let (c, r) = (&mut work.c[..n], &mut work.r[..n]);
        let (force, before) = (&mut self.lambda[..n], &self.before[..n]);
        // Directions, compliance and right-hand sides of all edges.
        for j in 0..n - 1 {
            for l in 0..LANES {
                let (ax, ay, az) = (
                    x[j + 1][l] - x[j][l],
                    y[j + 1][l] - y[j][l],
                    z[j + 1][l] - z[j][l],
                );
                let length = (ax * ax + ay * ay + az * az).max(1e-24).sqrt();
                let inv = 1.0 / length;
                let stretch = length - rest;
                (nx[j][l], ny[j][l], nz[j][l]) = (ax * inv, ay * inv, az * inv);
                // A stiffening thread: the secant compliance at the present stretch.
                let soft = if stiffening > 0.0 {
                    alpha[l] / (1.0 + 0.5 * stiffening * (stretch * inv_rest).max(0.0))
                } else {
                    alpha[l]
                };
                c[j][l] = soft;
                r[j][l] = if WARM {
                    -stretch - soft * force[j][l]
                } else {
                    -stretch
                };
                if damping > 0.0 {
                    r[j][l] -= damping * (length - before[j][l]);
                }
            }
        }
        // Forward elimination: `off` couples an edge to the one before through the vertex between them, -w n·n'.
        let (mut cp, mut rp) = ([0.0; LANES], [0.0; LANES]);
        let mut off = [0.0; LANES];
        for j in 0..n - 1 {
            let last = j + 2 >= n;
            for l in 0..LANES {
                let a = (w[j][l] + w[j + 1][l]) * g + c[j][l];
                let m = 1.0 / (a - off[l] * cp[l]).max(1e-300);
                rp[l] = (r[j][l] - off[l] * rp[l]) * m;
                let next = if last {
                    0.0
                } else {
                    -w[j + 1][l]
                        * (nx[j][l] * nx[j + 1][l]
                            + ny[j][l] * ny[j + 1][l]
                            + nz[j][l] * nz[j + 1][l])
                        * g
                };
                cp[l] = next * m;
                off[l] = next;
            }
            (c[j], r[j]) = (cp, rp);
        }
        // Back substitution, moving the vertices on the way: vertex j+1 by w (lambda_j n_j - lambda_{j+1} n_{j+1}).
        let (mut fx, mut fy, mut fz, mut lambda) =
            ([0.0; LANES], [0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for j in (0..n - 1).rev() {
            for l in 0..LANES {
                lambda[l] = if j + 2 < n {
                    r[j][l] - c[j][l] * lambda[l]
                } else {
                    r[j][l]
                };
                if WARM {
                    force[j][l] += lambda[l];
                }
                let (gx, gy, gz) = (
                    lambda[l] * nx[j][l],
                    lambda[l] * ny[j][l],
                    lambda[l] * nz[j][l],
                );
                x[j + 1][l] += w[j + 1][l] * (gx - fx[l]);
                y[j + 1][l] += w[j + 1][l] * (gy - fy[l]);
                z[j + 1][l] += w[j + 1][l] * (gz - fz[l]);
                (fx[l], fy[l], fz[l]) = (gx, gy, gz);
            }
        }
        for l in 0..LANES {
            x[0][l] -= w[0][l] * fx[l];
            y[0][l] -= w[0][l] * fy[l];
            z[0][l] -= w[0][l] * fz[l];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hanging_chain_takes_its_exact_stretch_in_one_solve() {
        // Vertices moved down by h² g (the free fall of one step) are pulled back to where every spring carries the weight below.
        let (n, rest, mass, k, h, g) = (40, 0.05, 1e-3, 400.0, 1e-3, 9.81);
        let mut block = Block::new(n);
        let mut want = vec![0.0; n];
        for j in 1..n {
            let below = (n - j) as f64 * mass;
            want[j] = want[j - 1] - rest - below * g / k;
        }
        for j in 0..n {
            block.w[j] = [if j == 0 { 0.0 } else { 1.0 / mass }; LANES];
            block.y[j] = [if j == 0 { 0.0 } else { want[j] - h * h * g }; LANES];
        }
        let mut work = Work::default();
        work.fit(n);
        block.solve::<false>(
            n,
            &Springs {
                rest,
                alpha: [1.0 / (k * h * h); LANES],
                damping: 0.0,
                stiffening: 0.0,
            },
            &mut work,
        );
        for j in 0..n {
            for l in 0..LANES {
                assert!(
                    (block.y[j][l] - want[j]).abs() < 1e-12,
                    "row {j}: {} for {}",
                    block.y[j][l],
                    want[j]
                );
                assert!(block.x[j][l].abs() < 1e-15);
            }
        }
    }
}
