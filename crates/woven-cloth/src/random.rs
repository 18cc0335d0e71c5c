//! Counter-based random numbers: the value depends on the seed and the counter alone, never on the order of calls.

/// One step of SplitMix64 (Steele, Lea, Flood 2014): a bijective scrambling of 64 bits.
fn splitmix64(mut z: u64) -> u64 {
    z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A number in [0, 1) for the given seed, stream and counter.
pub(crate) fn uniform(seed: u64, stream: u64, counter: u64) -> f64 {
    let bits = splitmix64(splitmix64(splitmix64(seed) ^ stream) ^ counter);
    (bits >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
}

/// A unit vector, uniform over the sphere (Archimedes: the height is uniform).
pub(crate) fn direction(seed: u64, stream: u64, counter: u64) -> [f64; 3] {
    let z = 2.0 * uniform(seed, stream, 2 * counter) - 1.0;
    let phi = std::f64::consts::TAU * uniform(seed, stream, 2 * counter + 1);
    let r = (1.0 - z * z).max(0.0).sqrt();
    [r * phi.cos(), r * phi.sin(), z]
}

/// FNV-1a over bytes: a fingerprint for checkpoints, not a cryptographic hash.
pub(crate) fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |h, &b| {
        (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uniform_has_the_mean_and_variance_of_the_unit_interval() {
        let n = 20_000;
        let (mut sum, mut sq) = (0.0, 0.0);
        for i in 0..n {
            let u = uniform(7, 1, i);
            assert!((0.0..1.0).contains(&u));
            sum += u;
            sq += u * u;
        }
        let mean = sum / n as f64;
        // Standard error of the mean is 0.289 / sqrt(20000) = 0.002; five of them.
        assert!((mean - 0.5).abs() < 0.01);
        assert!((sq / n as f64 - mean * mean - 1.0 / 12.0).abs() < 0.005);
    }

    #[test]
    fn directions_are_unit_vectors_without_a_favourite_side() {
        let mut sum = [0.0; 3];
        for i in 0..5000 {
            let d = direction(3, 2, i);
            assert!((d.iter().map(|c| c * c).sum::<f64>() - 1.0).abs() < 1e-12);
            for (s, c) in sum.iter_mut().zip(d) {
                *s += c;
            }
        }
        assert!(sum.iter().all(|s| s.abs() / 5000.0 < 0.05));
    }
}
