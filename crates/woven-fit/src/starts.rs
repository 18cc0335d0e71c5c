//! Starting points that fill the box of parameters evenly: a Sobol sequence with a seeded digital shift.
//!
//! Direction numbers: Joe and Kuo 2008 (new-joe-kuo-6), first eight dimensions. One start proves nothing; two to
//! thirty-two evenly spread ones find the global minimum of every model here.

/// Joe–Kuo: degree, coefficients, initial numbers of dimensions 2 to 8.
const JOE_KUO: [(u32, u32, [u32; 5]); 7] = [
    (1, 0, [1, 0, 0, 0, 0]),
    (2, 1, [1, 3, 0, 0, 0]),
    (3, 1, [1, 3, 1, 0, 0]),
    (3, 2, [1, 1, 1, 0, 0]),
    (4, 1, [1, 1, 3, 3, 0]),
    (4, 4, [1, 3, 5, 13, 0]),
    (5, 2, [1, 1, 5, 5, 17]),
];

fn directions(dimension: usize) -> [u32; 32] {
    let mut v = [0u32; 32];
    if dimension == 0 {
        for (i, v) in v.iter_mut().enumerate() {
            *v = 1 << (31 - i);
        }
        return v;
    }
    let (degree, a, m) = JOE_KUO[dimension - 1];
    let s = degree as usize;
    for i in 0..s {
        v[i] = m[i] << (31 - i);
    }
    for i in s..32 {
        v[i] = v[i - s] ^ (v[i - s] >> s);
        for k in 1..s {
            if (a >> (s - 1 - k)) & 1 == 1 {
                v[i] ^= v[i - k];
            }
        }
    }
    v
}

/// A counter-based random number: the same for the same arguments, on every machine (splitmix64).
pub fn hash(seed: u64, counter: u64) -> u64 {
    let mut z = seed
        .wrapping_mul(0x9e37_79b9_7f4a_7c15)
        .wrapping_add(counter.wrapping_mul(0xd1b5_4a32_d192_ed03))
        .wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Uniform in (0, 1).
pub fn uniform(seed: u64, counter: u64) -> f64 {
    ((hash(seed, counter) >> 11) as f64 + 0.5) / (1u64 << 53) as f64
}

/// Standard normal by Box and Muller.
pub fn normal(seed: u64, counter: u64) -> f64 {
    let (a, b) = (uniform(seed, 2 * counter), uniform(seed, 2 * counter + 1));
    (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
}

/// `count` points in the unit cube of `dimensions` ≤ 8.
pub fn sobol(count: usize, dimensions: usize, seed: u64) -> Vec<Vec<f64>> {
    let tables: Vec<[u32; 32]> = (0..dimensions.min(8)).map(directions).collect();
    (0..count)
        .map(|i| {
            let gray = (i ^ (i >> 1)) as u32;
            tables
                .iter()
                .enumerate()
                .map(|(d, v)| {
                    let bits = (0..32)
                        .filter(|b| (gray >> b) & 1 == 1)
                        .fold(0, |x, b| x ^ v[b]);
                    let shifted = bits ^ (hash(seed, d as u64) >> 32) as u32;
                    (f64::from(shifted) + 0.5) / 4_294_967_296.0
                })
                .collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_dimension_is_stratified() {
        // A Sobol sequence puts exactly one of its first 2^k points into each of the 2^k intervals, shift or not.
        for seed in [0, 7] {
            let points = sobol(64, 8, seed);
            for d in 0..8 {
                let mut seen = [false; 64];
                for p in &points {
                    seen[(p[d] * 64.0) as usize] = true;
                }
                assert!(seen.iter().all(|&s| s), "dimension {d}");
            }
        }
    }

    #[test]
    fn normal_numbers_have_unit_variance() {
        let n = 20_000;
        let (mut sum, mut squares) = (0.0, 0.0);
        for i in 0..n {
            let x = normal(3, i);
            sum += x;
            squares += x * x;
        }
        // Standard errors are 0.007 and 0.01; four of them are allowed.
        assert!((sum / n as f64).abs() < 0.028 && (squares / n as f64 - 1.0).abs() < 0.04);
    }
}
