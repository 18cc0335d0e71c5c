//! Random numbers: Owen-scrambled Sobol points after Burley 2020 ("Practical hash-based Owen scrambling"), padded by
//! sets of four dimensions, and a counter hash. The pair of `shader/rng.wgsl`; both give the same bits.

/// Directions of the first four Sobol dimensions for the 16 low bits of the index (Joe and Kuo 2008).
pub const SOBOL: [[u32; 4]; 16] = directions();
/// Samples of a pixel after which the points start anew with another scrambling.
pub const PERIOD: u32 = 1 << 16;

const fn directions() -> [[u32; 4]; 16] {
    // Degree, coefficients and first numbers of the primitive polynomials of dimensions 2 to 4.
    const DEGREE: [usize; 3] = [1, 2, 3];
    const A: [u32; 3] = [0, 1, 1];
    const M: [[u32; 3]; 3] = [[1, 0, 0], [1, 3, 0], [1, 3, 1]];
    let mut v = [[0; 4]; 16];
    let mut i = 0;
    while i < 16 {
        v[i][0] = 1 << (31 - i);
        let mut d = 0;
        while d < 3 {
            let s = DEGREE[d];
            v[i][d + 1] = if i < s {
                M[d][i] << (31 - i)
            } else {
                let mut x = v[i - s][d + 1] ^ (v[i - s][d + 1] >> s);
                let mut k = 1;
                while k < s {
                    if (A[d] >> (s - 1 - k)) & 1 == 1 {
                        x ^= v[i - k][d + 1];
                    }
                    k += 1;
                }
                x
            };
            d += 1;
        }
        i += 1;
    }
    v
}

/// The same points by bytes of the index: what the CPU looks up.
static BYTES: [[[u32; 4]; 256]; 2] = bytes();

const fn bytes() -> [[[u32; 4]; 256]; 2] {
    let mut t = [[[0; 4]; 256]; 2];
    let mut i = 0;
    while i < 2 * 256 * 8 {
        let (half, byte, bit) = (i / 2048, (i / 8) % 256, i % 8);
        if (byte >> bit) & 1 == 1 {
            let mut d = 0;
            while d < 4 {
                t[half][byte][d] ^= SOBOL[half * 8 + bit][d];
                d += 1;
            }
        }
        i += 1;
    }
    t
}

/// A well mixed 32-bit hash (Wellons' lowbias32).
#[inline(always)]
#[must_use]
pub fn hash(x: u32) -> u32 {
    let x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    let x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// A hash of two numbers.
#[inline(always)]
#[must_use]
pub fn hash2(a: u32, b: u32) -> u32 {
    hash(
        a ^ hash(b)
            .wrapping_add(0x9e37_79b9)
            .wrapping_add(a << 6)
            .wrapping_add(a >> 2),
    )
}

/// Owen's scrambling of a bit-reversed number, Laine and Karras' hash with Vegdahl's constants.
#[inline(always)]
fn laine_karras(x: u32, seed: u32) -> u32 {
    let x = x ^ x.wrapping_mul(0x3d20_adea);
    let x = x.wrapping_add(seed);
    let x = x.wrapping_mul((seed >> 16) | 1);
    let x = x ^ x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// Nested uniform scrambling in base 2.
#[inline(always)]
fn scramble(x: u32, seed: u32) -> u32 {
    laine_karras(x.reverse_bits(), seed).reverse_bits()
}

/// 24 bits as a number in 0..1.
#[inline(always)]
#[must_use]
pub fn unit(x: u32) -> f32 {
    (x >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// Number of the place (x, y) on a Z-curve: their 16 low bits in turn (Morton 1966).
#[inline(always)]
#[must_use]
pub fn morton(x: u32, y: u32) -> u32 {
    let spread = |x: u32| {
        let x = x & 0xffff;
        let x = (x | (x << 8)) & 0x00ff_00ff;
        let x = (x | (x << 4)) & 0x0f0f_0f0f;
        let x = (x | (x << 2)) & 0x3333_3333;
        (x | (x << 1)) & 0x5555_5555
    };
    spread(x) | (spread(y) << 1)
}

/// The random numbers of one sample of one pixel.
#[derive(Clone, Copy, Debug)]
pub struct Rng {
    seed: u32,
    index: u32,
    /// State of the counter for coins.
    state: u32,
}

impl Rng {
    /// Sample `index` of pixel (x, y).
    #[inline(always)]
    #[must_use]
    pub fn new(x: u32, y: u32, index: u32, seed: u32) -> Self {
        let seed = hash2(hash2(x | (y << 16), seed), index / PERIOD);
        Self {
            seed,
            index: index % PERIOD,
            state: hash2(seed, index ^ 0x5bd1_e995),
        }
    }

    /// Four numbers in 0..1; each `set` is a four-dimensional low-discrepancy set over the samples of the pixel,
    /// independent of the other sets.
    #[inline(always)]
    #[must_use]
    pub fn set(&self, set: u32) -> [f32; 4] {
        let seed = hash2(self.seed, set);
        let i = scramble(self.index, seed) & (PERIOD - 1);
        let (a, b) = (&BYTES[0][(i & 255) as usize], &BYTES[1][(i >> 8) as usize]);
        let s1 = hash(seed ^ 0xa511_e9b3);
        let s2 = hash(s1);
        [
            unit(scramble(a[0] ^ b[0], s1)),
            unit(scramble(a[1] ^ b[1], s2)),
            unit(scramble(a[2] ^ b[2], s1 ^ 0x68e3_1da4)),
            unit(scramble(a[3] ^ b[3], s2 ^ 0x1b56_c4e9)),
        ]
    }

    /// For decisions whose number depends on rounding (a ray that grazes a sheet): they change nothing of what follows.
    #[inline(always)]
    #[must_use]
    pub fn aside(&mut self) -> Self {
        self.coin();
        Self {
            state: hash(self.state),
            ..*self
        }
    }

    /// The next independent number in 0..1, for decisions of which a sample takes an unknown number.
    #[inline(always)]
    pub fn coin(&mut self) -> f32 {
        self.state = self
            .state
            .wrapping_mul(747_796_405)
            .wrapping_add(2_891_336_453);
        let word =
            ((self.state >> ((self.state >> 28) + 4)) ^ self.state).wrapping_mul(277_803_737);
        unit((word >> 22) ^ word)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_stratified_in_every_pair_of_dimensions() {
        // A (0, m, 2)-net in the first two dimensions: 64 points, one in each of 8 x 8 cells, at any pixel and set.
        for set in 0..20 {
            let mut cells = [0; 64];
            for index in 0..64 {
                let u = Rng::new(31, 7 + set, index, 5).set(set);
                cells[(u[0] * 8.0) as usize * 8 + (u[1] * 8.0) as usize] += 1;
            }
            assert!(cells.iter().all(|&n| n == 1), "set {set}: {cells:?}");
        }
    }

    #[test]
    fn every_dimension_is_a_permutation_of_strata() {
        for d in 0..4 {
            let mut cells = vec![0; 256];
            for index in 0..256 {
                cells[(Rng::new(3, 4, index, 9).set(17)[d] * 256.0) as usize] += 1;
            }
            assert!(cells.iter().all(|&n| n == 1), "dimension {d}");
        }
    }

    #[test]
    fn the_mean_of_a_product_of_four_is_right() {
        let n = 4096;
        let mean: f64 = (0..n)
            .map(|i| {
                Rng::new(1, 2, i, 3)
                    .set(8)
                    .iter()
                    .map(|&u| f64::from(u))
                    .product::<f64>()
            })
            .sum::<f64>()
            / f64::from(n);
        // 1/16; random points would scatter by 0.0013, these by far less.
        assert!((mean - 0.0625).abs() < 4e-4, "{mean}");
    }

    #[test]
    fn samples_beyond_the_period_differ() {
        assert_ne!(
            Rng::new(1, 2, 3, 4).set(0),
            Rng::new(1, 2, 3 + PERIOD, 4).set(0)
        );
    }
}
