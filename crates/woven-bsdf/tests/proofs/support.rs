//! What the proofs share: seeded numbers, random legal parameters, quadrature on the sphere, the χ² distribution.

use std::f64::consts::{PI, TAU};
use woven_bsdf::model::{ModelInfo, Role};
use woven_bsdf::term::{ggx, warp};
use woven_bsdf::vec3::Vec3;

/// SplitMix64: seeded, the same on every machine.
pub(crate) struct Rng(u64);

impl Rng {
    pub(crate) fn new(seed: u64) -> Self {
        Rng(seed)
    }
    pub(crate) fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
    /// Even in [0, 1).
    pub(crate) fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }
    pub(crate) fn three(&mut self) -> [f64; 3] {
        [self.unit(), self.unit(), self.unit()]
    }
    /// Even on the sphere, |z| at least `z_min`.
    pub(crate) fn direction(&mut self, z_min: f64) -> Vec3<f64> {
        let side = if self.unit() < 0.5 { -1.0 } else { 1.0 };
        let z = side * (z_min + (1.0 - z_min) * self.unit());
        let (r, phi) = ((1.0 - z * z).max(0.0).sqrt(), TAU * self.unit());
        Vec3::new(r * phi.cos(), r * phi.sin(), z)
    }
    /// Random legal values in the model's order; linear factors share a sum of at most 1, widths of lobes
    /// (parameters on a logarithmic scale) are at least `width_min`.
    pub(crate) fn parameters(&mut self, model: &ModelInfo, width_min: f64) -> Vec<f64> {
        let sum: f64 = 1.0 / model.linear().count() as f64;
        model
            .params
            .iter()
            .map(|p| match p.role {
                Role::Linear => self.unit() * p.max.min(1.0) * sum,
                Role::Shape if p.log => {
                    let lo = p.min.max(width_min.min(p.max));
                    (lo.ln() + self.unit() * (p.max.ln() - lo.ln())).exp()
                }
                Role::Shape => p.min + self.unit() * (p.max - p.min),
            })
            .collect()
    }
}

/// Nodes and weights of four-point Gauss–Legendre quadrature on [0, 1].
const GAUSS4: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// ∫ f dω over the box z ∈ [z0, z1], φ ∈ [p0, p1], split until two orders agree.
pub(crate) fn integrate(
    f: &dyn Fn(Vec3<f64>) -> f64,
    z: [f64; 2],
    phi: [f64; 2],
    depth: u32,
) -> f64 {
    let whole = gauss(f, z, phi);
    let (zm, pm) = (0.5 * (z[0] + z[1]), 0.5 * (phi[0] + phi[1]));
    let parts = [
        ([z[0], zm], [phi[0], pm]),
        ([z[0], zm], [pm, phi[1]]),
        ([zm, z[1]], [phi[0], pm]),
        ([zm, z[1]], [pm, phi[1]]),
    ];
    let finer: f64 = parts.iter().map(|(z, p)| gauss(f, *z, *p)).sum();
    if depth == 0 || (finer - whole).abs() < 1e-7 + 1e-4 * finer.abs() {
        return finer;
    }
    parts
        .iter()
        .map(|(z, p)| integrate(f, *z, *p, depth - 1))
        .sum()
}

fn gauss(f: &dyn Fn(Vec3<f64>) -> f64, z: [f64; 2], phi: [f64; 2]) -> f64 {
    let mut sum = 0.0;
    for (a, wa) in GAUSS4 {
        let c = z[0] + a * (z[1] - z[0]);
        let r = (1.0 - c * c).max(0.0).sqrt();
        for (b, wb) in GAUSS4 {
            let p = phi[0] + b * (phi[1] - phi[0]);
            sum += wa * wb * f(Vec3::new(r * p.cos(), r * p.sin(), c));
        }
    }
    sum * (z[1] - z[0]) * (phi[1] - phi[0])
}

/// ∫ f(v) |cosθ_v| dω over the side opposite to `l` (`through`) or the same side, on n.0 × n.1 midpoints (height, azimuth): even in cosθ
/// for a smooth f, or shared with the GGX sampler of the given widths about the straight direction for a lobe.
pub(crate) fn flux(
    f: &dyn Fn(Vec3<f64>) -> f64,
    l: Vec3<f64>,
    through: bool,
    lobe: Option<(f64, f64)>,
    n: (usize, usize),
) -> f64 {
    let up = Vec3::new(l.x, l.y, l.z.abs());
    let side = if (l.z < 0.0) == through { 1.0 } else { -1.0 };
    let share = if lobe.is_some() { 0.5 } else { 1.0 };
    let mut sum = 0.0;
    let mut add = |w: Vec3<f64>, weight: f64| {
        if w.z > 1e-9 {
            let peak = lobe.map_or(0.0, |(ax, ay)| 0.5 * ggx::pdf(w, up, ax, ay));
            sum += share * weight * f(Vec3::new(w.x, w.y, w.z * side)) * w.z
                / (share * w.z / PI + peak);
        }
    };
    for i in 0..n.0 * n.1 {
        let (u, t) = (
            ((i / n.1) as f64 + 0.5) / n.0 as f64,
            ((i % n.1) as f64 + 0.5) / n.1 as f64,
        );
        // The sampler wants sin²θ; with cosθ even instead, the density is 2 cosθ.
        add(warp::cosine(1.0 - u * u, t), 2.0 * u);
        if let Some((ax, ay)) = lobe {
            add(ggx::sample(up, ax, ay, t, u), 1.0);
        }
    }
    sum / (n.0 * n.1) as f64
}

/// The chance that χ² with `k` degrees of freedom exceeds `x`: Γ(k/2, x/2)/Γ(k/2), by series or continued fraction.
pub(crate) fn chi2_exceeds(x: f64, k: usize) -> f64 {
    let (a, x) = (k as f64 / 2.0, x / 2.0);
    if x <= 0.0 {
        return 1.0;
    }
    // ln Γ(a) for a multiple of one half, by the recurrence.
    let mut ln_gamma = if k.is_multiple_of(2) {
        0.0
    } else {
        PI.sqrt().ln()
    };
    let mut i = if k.is_multiple_of(2) { 1.0 } else { 0.5 };
    while i < a - 0.25 {
        ln_gamma += f64::ln(i);
        i += 1.0;
    }
    let front = (a * x.ln() - x - ln_gamma).exp();
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        for _ in 0..10_000 {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        return 1.0 - front * sum;
    }
    // Lentz's method for the continued fraction.
    let mut b = x + 1.0 - a;
    let (mut c, mut d) = (1e300, 1.0 / b);
    let mut h = d;
    for i in 1..10_000 {
        let an = -(i as f64) * (i as f64 - a);
        b += 2.0;
        d = 1.0 / (an * d + b);
        c = b + an / c;
        h *= d * c;
    }
    front * h
}

#[test]
fn chi2_has_the_known_quantiles() {
    // Tables: 95 % of χ²(1) lie below 3.841459, of χ²(10) below 18.307038, of χ²(100) below 124.342113.
    for (x, k) in [(3.841_459, 1), (18.307_038, 10), (124.342_113, 100)] {
        assert!(
            (chi2_exceeds(x, k) - 0.05).abs() < 1e-6,
            "{k}: {}",
            chi2_exceeds(x, k)
        );
    }
}
