//! Points sorted into cubic cells, to find neighbours in space.

use crate::sheet::Field;

/// Points sorted into cubic cells.
pub(crate) struct Cells {
    inv_size: f64,
    /// The points sorted by cell, then by number.
    order: Vec<u32>,
    /// The cells that hold something, ascending, each with the place in `order` where it starts.
    start: Vec<(u64, usize)>,
}

impl Cells {
    /// 21 bits an axis, offset so that negative places stay positive.
    fn key_of(inv_size: f64, p: [f64; 3]) -> u64 {
        let [x, y, z] = p.map(|v| {
            ((v * inv_size).floor() + f64::from(1 << 20)).clamp(1.0, f64::from((1 << 21) - 2))
                as u64
        });
        x | y << 21 | z << 42
    }

    /// Calls `f` for every point in the cell of `p` and the 26 around it.
    pub(crate) fn near(&self, p: [f64; 3], mut f: impl FnMut(usize)) {
        let cell = Self::key_of(self.inv_size, p);
        for dz in [-1i64, 0, 1] {
            for dy in [-1i64, 0, 1] {
                // Three cells in a row along x are neighbours in the order too.
                let row = cell
                    .wrapping_add_signed(dy << 21)
                    .wrapping_add_signed(dz << 42);
                let mut at = self.start.partition_point(|&(c, _)| c < row - 1);
                while let Some(&(c, from)) = self.start.get(at) {
                    if c > row + 1 {
                        break;
                    }
                    let to = self.start.get(at + 1).map_or(self.order.len(), |&(_, s)| s);
                    for &k in &self.order[from..to] {
                        f(k as usize);
                    }
                    at += 1;
                }
            }
        }
    }
}

/// Sorts points into cells of edge `size`.
pub(crate) fn sort_into_cells(x: &Field, size: f64) -> Cells {
    let n = x[0].len();
    let inv_size = 1.0 / size;
    let key: Vec<u64> = (0..n)
        .map(|k| Cells::key_of(inv_size, [x[0][k], x[1][k], x[2][k]]))
        .collect();
    let mut order: Vec<u32> = (0..n as u32).collect();
    order.sort_unstable_by_key(|&k| (key[k as usize], k));
    let mut start: Vec<(u64, usize)> = Vec::new();
    for (at, &k) in order.iter().enumerate() {
        let cell = key[k as usize];
        if start.last().is_none_or(|&(c, _)| c != cell) {
            start.push((cell, at));
        }
    }
    Cells {
        inv_size,
        order,
        start,
    }
}
