//! How much of the light the mirrored GGX lobe keeps, in closed form.

use crate::real::Real;

/// Coefficients of 1 - E in powers of x = μ/(μ + 1.5 α) (rows) and α (columns), a least-squares fit to 8,192-point
/// quadratures over 32 × 23 places with 0.005 ≤ μ ≤ 1, 0.02 ≤ α ≤ 1; worst residual 7e-4.
const LOSS: [[f64; 5]; 7] = [
    [0.060930, 0.015319, 0.686083, -0.503019, 0.126509],
    [0.212560, 0.048797, 0.030101, 1.030206, -0.374508],
    [-0.693694, -2.582927, 14.104216, -10.735562, -0.978490],
    [5.178192, 12.033237, -69.089446, 33.436849, 20.753539],
    [-15.358249, -21.667885, 140.748206, -11.945922, -93.810546],
    [16.636341, 17.876793, -146.267721, -8.149532, 111.597070],
    [-6.036059, -5.954266, 64.214315, -16.781917, -21.144462],
];

/// The part of the light from cosine `mu` that the lobe [`crate::term::ggx::lobe`] loses to masking: 1 - E(μ, α).
#[inline(always)]
pub fn ggx_loss<R: Real>(mu: R, alpha: R) -> R {
    let mu = mu.clamp(0.0, 1.0);
    let x = mu / (mu + alpha * R::of(1.5)).max(R::of(1e-6));
    let mut sum = R::zero();
    for row in LOSS.iter().rev() {
        let mut c = R::zero();
        for k in row.iter().rev() {
            c = c * alpha + R::of(*k);
        }
        sum = sum * x + c;
    }
    sum.clamp(0.0, 1.0)
}

/// Nodes and weights of eight-point Gauss–Legendre quadrature on [0, 1].
pub const GAUSS8: [(f64, f64); 8] = [
    (0.019_855_071_751_231_856, 0.050_614_268_145_188_13),
    (0.101_666_761_293_186_64, 0.111_190_517_226_687_23),
    (0.237_233_795_041_835_5, 0.156_853_322_938_943_64),
    (0.408_282_678_752_175_1, 0.181_341_891_689_180_99),
    (0.591_717_321_247_824_9, 0.181_341_891_689_180_99),
    (0.762_766_204_958_164_5, 0.156_853_322_938_943_64),
    (0.898_333_238_706_813_4, 0.111_190_517_226_687_23),
    (0.980_144_928_248_768_1, 0.050_614_268_145_188_13),
];

/// The loss averaged over the cosine-weighted hemisphere: 2 ∫ (1 - E) μ dμ.
pub fn ggx_mean_loss<R: Real>(alpha: R) -> R {
    GAUSS8.iter().fold(R::zero(), |sum, &(mu, w)| {
        sum + ggx_loss(R::of(mu), alpha) * R::of(2.0 * w * mu)
    })
}
