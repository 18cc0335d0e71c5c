//! Counter-based random numbers: the same counter always gives the same number, so a resumed scan reads what an undisturbed one reads.

/// Mixes 64 bits (the finaliser of splitmix64, Steele et al. 2014).
pub fn mix(mut x: u64) -> u64 {
    x = x.wrapping_add(0x9E37_79B9_7F4A_7C15);
    x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}

/// A generator at one place of the counter space.
#[derive(Debug, Clone)]
pub struct Noise {
    state: u64,
}

impl Noise {
    /// The stream that belongs to `keys`.
    pub fn at(keys: &[u64]) -> Self {
        Noise {
            state: keys
                .iter()
                .fold(0x6A09_E667_F3BC_C908, |s, k| mix(s ^ mix(*k))),
        }
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(1);
        mix(self.state)
    }

    /// Uniform in 0..1, never 1.
    pub fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform in 0..n; 0 when n is 0.
    pub fn below(&mut self, n: u64) -> u64 {
        if n == 0 {
            0
        } else {
            (self.uniform() * n as f64) as u64
        }
    }

    /// Normal with mean 0 and variance 1 (Box and Muller 1958).
    pub fn normal(&mut self) -> f64 {
        let (u, v) = (1.0 - self.uniform(), self.uniform());
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn normal_has_mean_0_and_variance_1() {
        let mut n = Noise::at(&[1, 2]);
        let x: Vec<f64> = (0..100_000).map(|_| n.normal()).collect();
        let mean = x.iter().sum::<f64>() / 1e5;
        let var = x.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 1e5;
        // Standard errors 0.0032 and 0.0045; four of them.
        assert!(
            mean.abs() < 0.0128 && (var - 1.0).abs() < 0.018,
            "{mean} {var}"
        );
    }

    #[test]
    fn same_counter_same_number() {
        assert_eq!(Noise::at(&[3, 4]).bits(), Noise::at(&[3, 4]).bits());
        assert_ne!(Noise::at(&[3, 4]).bits(), Noise::at(&[4, 3]).bits());
    }
}
