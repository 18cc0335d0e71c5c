//! How the hot loops run: in bands over threads, with the widest vectors of the machine, and the same bits with or without either.
//!
//! The loops are plain Rust; compiled once for the base instruction set and once for AVX2, they do the same additions and
//! multiplications in the same order (nothing is contracted into fused operations), only more of them at a time.

use crate::sheet::{Field, Sheet};
use rayon::prelude::*;

/// Fewer vertices than this are not worth waking other threads for.
const WORTH_THREADS: usize = 3000;

/// Runs `work` compiled for the best instruction set at hand. What `work` calls must be `#[inline(always)]` to profit.
pub(crate) fn widest<R>(work: impl FnOnce() -> R) -> R {
    pulp::Arch::new().dispatch(work)
}

/// Whether the sheet is large enough to share its work out, and there is someone to share with.
pub(crate) fn worth_threads(sheet: &Sheet) -> bool {
    sheet.len() >= WORTH_THREADS && rayon::current_num_threads() > 1
}

/// Calls `work` for every band of `length` numbers of the three coordinates, on all threads or one after another.
pub(crate) fn over_bands(
    q: &mut Field,
    length: usize,
    parallel: bool,
    work: impl Fn(usize, [&mut [f64]; 3]) + Sync,
) {
    let [x, y, z] = q;
    if parallel {
        x.par_chunks_mut(length)
            .zip(y.par_chunks_mut(length))
            .zip(z.par_chunks_mut(length))
            .enumerate()
            .for_each(|(k, ((x, y), z))| work(k, [x, y, z]));
    } else {
        x.chunks_mut(length)
            .zip(y.chunks_mut(length))
            .zip(z.chunks_mut(length))
            .enumerate()
            .for_each(|(k, ((x, y), z))| work(k, [x, y, z]));
    }
}
