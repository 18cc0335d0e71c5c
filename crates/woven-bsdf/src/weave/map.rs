//! Maps of local openness: where a lace or a jacquard has its holes.
//!
//! A texel holds the share of its area that is open along the normal. A renderer takes the sheet's openness for the
//! ground and multiplies it, or covers it, texel by texel; the gap stays uncoloured, whatever colour the yarn has.

use super::yarns::Yarns;
use crate::measured::Refused;
use crate::vec3::Vec3;

/// Most texels of a map.
const MAX_TEXELS: usize = 1 << 26;

/// Local openness over one repeat, which continues on all sides.
#[derive(Clone, Debug, PartialEq)]
pub struct OpennessMap {
    width: usize,
    height: usize,
    /// Row after row along the weft, 0…1.
    values: Vec<f32>,
}

impl OpennessMap {
    /// From a picture of `width` × `height` numbers, 0 closed, 1 open: a jacquard's card.
    ///
    /// # Errors
    /// A sentence when the sizes do not fit or a number lies outside 0…1.
    pub fn new(width: usize, height: usize, values: Vec<f32>) -> Result<Self, Refused> {
        if width.checked_mul(height) != Some(values.len())
            || values.is_empty()
            || values.len() > MAX_TEXELS
        {
            return Err(Refused::new(format!(
                "a map of {width} × {height} texels has {} numbers; between 1 and {MAX_TEXELS} are possible",
                values.len()
            )));
        }
        if let Some(x) = values.iter().find(|x| !(0.0..=1.0).contains(*x)) {
            return Err(Refused::new(format!("the openness {x} lies outside 0…1")));
        }
        Ok(OpennessMap {
            width,
            height,
            values,
        })
    }

    /// Of a yarn geometry: `texels` along each pitch, each the mean of 8 × 8 cells of the shadow along the normal.
    pub fn of_yarns(yarns: &Yarns, texels: usize) -> Self {
        const FINE: usize = 8;
        let ([w, h], dark) = yarns.shadow(Vec3::new(0.0, 0.0, 1.0), texels.max(1) * FINE);
        let (width, height) = (w / FINE, h / FINE);
        let open = |i: usize| {
            let (x, y) = (i % width * FINE, i / width * FINE);
            let cells = (0..FINE * FINE).map(|k| dark[(y + k / FINE) * w + x + k % FINE]);
            cells.filter(|d| !d).count() as f32 / (FINE * FINE) as f32
        };
        OpennessMap {
            width,
            height,
            values: (0..width * height).map(open).collect(),
        }
    }

    /// Texels along the weft and along the warp.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }
    /// The texels, row after row along the weft.
    pub fn values(&self) -> &[f32] {
        &self.values
    }
    /// Mean openness: what an eye far away sees, and what a maker's openness factor measures.
    pub fn mean(&self) -> f64 {
        self.values.iter().map(|x| f64::from(*x)).sum::<f64>() / self.values.len() as f64
    }
    /// Openness at (u, v), one repeat being 1 × 1; linear between the centres of texels.
    pub fn at(&self, u: f64, v: f64) -> f64 {
        let cell = |x: f64, n: usize| {
            let x = x.rem_euclid(1.0) * n as f64 - 0.5;
            let i = x.floor();
            let wrap = |i: f64| i.rem_euclid(n as f64) as usize % n;
            (wrap(i), wrap(i + 1.0), x - i)
        };
        let ((x0, x1, s), (y0, y1, t)) = (cell(u, self.width), cell(v, self.height));
        let at = |x: usize, y: usize| f64::from(self.values[y * self.width + x]);
        (at(x0, y0) * (1.0 - s) + at(x1, y0) * s) * (1.0 - t)
            + (at(x0, y1) * (1.0 - s) + at(x1, y1) * s) * t
    }
}
