//! A draft: which yarn lies on top where warp and weft cross, and what an eye therefore sees on each side.

/// A yarn as a draft file describes it; lengths in metres.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Yarn {
    /// Distance of neighbours, if stated.
    pub spacing: Option<f64>,
    /// Diameter, if stated.
    pub thickness: Option<f64>,
}

impl Yarn {
    /// Diameter over pitch, limited to 1 (draft libraries write yarns thicker than their spacing: closed cloth).
    pub fn gamma(&self) -> Option<f64> {
        match (self.thickness, self.spacing) {
            (Some(d), Some(s)) if s > 0.0 && d >= 0.0 => Some((d / s).min(1.0)),
            _ => None,
        }
    }
}

/// Which side of the cloth an eye looks at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The side with +z.
    Face,
    /// The other.
    Back,
}

/// Shares of the sheet's area seen along the normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Visible {
    /// Warp yarn.
    pub warp: f64,
    /// Weft yarn.
    pub weft: f64,
    /// Gap between the yarns.
    pub gap: f64,
}

/// One repeat of a weave: `ends` warp yarns by `picks` weft yarns.
#[derive(Clone, Debug, PartialEq)]
pub struct Draft {
    /// What people call it.
    pub name: String,
    ends: usize,
    picks: usize,
    /// Row = pick, column = end; true where the warp lies on the face.
    warp_up: Vec<bool>,
    /// Linear Rec. 709 colour of each end; empty if unknown.
    pub warp_colors: Vec<[f64; 3]>,
    /// Linear Rec. 709 colour of each pick; empty if unknown.
    pub weft_colors: Vec<[f64; 3]>,
    /// The warp yarn.
    pub warp: Yarn,
    /// The weft yarn.
    pub weft: Yarn,
}

impl Draft {
    /// A draft from a rule: whether end `e` lies over pick `p`.
    ///
    /// # Panics
    /// When there is no end or no pick.
    pub fn new(
        name: &str,
        ends: usize,
        picks: usize,
        warp_up: impl Fn(usize, usize) -> bool,
    ) -> Self {
        assert!(ends > 0 && picks > 0, "a weave needs ends and picks");
        Draft {
            name: name.to_owned(),
            ends,
            picks,
            warp_up: (0..ends * picks)
                .map(|i| warp_up(i % ends, i / ends))
                .collect(),
            warp_colors: Vec::new(),
            weft_colors: Vec::new(),
            warp: Yarn::default(),
            weft: Yarn::default(),
        }
    }
    /// Over one, under one: the tightest interlacement.
    pub fn plain() -> Self {
        Self::new("plain", 2, 2, |e, p| (e + p) % 2 == 0)
    }
    /// Over `up`, under `down`, one end further at each pick: `twill(2, 2)` is denim's cousin, `twill(3, 1)` denim.
    pub fn twill(up: usize, down: usize) -> Self {
        let n = (up + down).max(1);
        Self::new(&format!("twill {up}/{down}"), n, n, |e, p| {
            (e + n - p) % n < up
        })
    }
    /// Each end under one pick in `n`, the next end `step` picks further: a face almost wholly of warp. `n` and `step`
    /// must have no common divisor, and step ± 1 must not be a multiple of n; `satin(5, 2)` and `satin(8, 3)` are usual.
    pub fn satin(n: usize, step: usize) -> Option<Self> {
        let gcd = |mut a: usize, mut b: usize| {
            while b > 0 {
                (a, b) = (b, a % b);
            }
            a
        };
        (n >= 5 && step > 1 && step + 1 < n && gcd(n, step) == 1).then(|| {
            Self::new(&format!("satin {n}/{step}"), n, n, |e, p| {
                (e * step) % n != p
            })
        })
    }
    /// Gauze: ends in pairs; one always lies over the weft, its partner, which it crosses between picks, always under.
    pub fn leno() -> Self {
        Self::new("leno", 2, 2, |e, _| e % 2 == 0)
    }
    /// Mock leno, the simplest woven lace: blocks of three ends and picks draw together and leave holes between them.
    pub fn lace() -> Self {
        Self::new("lace", 6, 6, |e, p| {
            let block = (e % 3 != 1) || (p % 3 == 1);
            block == (e / 3 == p / 3)
        })
    }

    /// Warp yarns in the repeat.
    pub fn ends(&self) -> usize {
        self.ends
    }
    /// Weft yarns in the repeat.
    pub fn picks(&self) -> usize {
        self.picks
    }
    /// Whether the warp lies on the face where `end` crosses `pick`; both wrap around.
    pub fn warp_up(&self, end: usize, pick: usize) -> bool {
        self.warp_up[(pick % self.picks) * self.ends + end % self.ends]
    }
    /// Share of the crossings with the warp on the face.
    pub fn warp_share(&self) -> f64 {
        self.warp_up.iter().filter(|&&up| up).count() as f64 / self.warp_up.len() as f64
    }
    /// What is seen along the normal, for yarns of diameter over pitch γ: the warp's bare stretches, plus its share of
    /// the crossings. The three shares sum to 1.
    pub fn visible(&self, side: Side, gamma_warp: f64, gamma_weft: f64) -> Visible {
        let (a, b) = (gamma_warp.clamp(0.0, 1.0), gamma_weft.clamp(0.0, 1.0));
        let top = match side {
            Side::Face => self.warp_share(),
            Side::Back => 1.0 - self.warp_share(),
        };
        Visible {
            warp: a * (1.0 - b) + a * b * top,
            weft: b * (1.0 - a) + a * b * (1.0 - top),
            gap: (1.0 - a) * (1.0 - b),
        }
    }
    /// The longest floats: how many picks an end passes over without going under, and how many ends a pick, on the
    /// face. An end that never goes under has a float of the whole repeat.
    pub fn longest_floats(&self) -> (usize, usize) {
        let run = |n: usize, up: &dyn Fn(usize) -> bool| {
            if (0..n).all(up) {
                return n;
            }
            let (mut best, mut now) = (0, 0);
            // Twice around, so that a float across the edge of the repeat counts in full.
            for i in 0..2 * n {
                now = if up(i % n) { now + 1 } else { 0 };
                best = best.max(now);
            }
            best
        };
        let warp = (0..self.ends)
            .map(|e| run(self.picks, &|p| self.warp_up(e, p)))
            .max();
        let weft = (0..self.picks)
            .map(|p| run(self.ends, &|e| !self.warp_up(e, p)))
            .max();
        (warp.unwrap_or(0), weft.unwrap_or(0))
    }
    /// Mean colour of the yarn seen on one side; none when the draft has no colours.
    pub fn color(&self, side: Side) -> Option<[f64; 3]> {
        if self.warp_colors.len() != self.ends || self.weft_colors.len() != self.picks {
            return None;
        }
        let mut sum = [0.0; 3];
        for p in 0..self.picks {
            for e in 0..self.ends {
                let warp = self.warp_up(e, p) == (side == Side::Face);
                let c = if warp {
                    self.warp_colors[e]
                } else {
                    self.weft_colors[p]
                };
                sum.iter_mut().zip(c).for_each(|(s, c)| *s += c);
            }
        }
        Some(sum.map(|s| s / (self.ends * self.picks) as f64))
    }
}
