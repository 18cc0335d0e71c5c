//! Checks of Klems matrices that are square and full of numbers, but wrong: laid out the other way round.
//!
//! A transposed matrix has as many numbers as a sound one. Three things give it away. The file may say so: the names of
//! its row and column bases. Light may be made: a column (one incidence) sums to more than 1 where no row does. And
//! where the scattered part is one constant per *incident* patch, as the shade files of WINDOW have it, a matrix with
//! one constant per *outgoing* patch is no cloth's: light would leave unevenly, but the same way whatever way it came.
//!
//! Reciprocity cannot tell. For f(l, v) = f(v, l) the transposed file is that of the same cloth turned over and about,
//! so a goniometer's file transposed as a whole looks sound; and the shade files, which are not reciprocal, agree
//! *better* with it when one block is transposed (0.001 instead of 0.13 for the shipped Urban Loft).

use super::Refused;
use super::klems::{Kind, Klems};
use super::xml::text;
use roxmltree::Node;

/// Patches from which on a pattern in rows or columns is no accident.
const ENOUGH: usize = 16;

/// Whether the bases named by a block are the one that the file defines.
pub(super) fn bases(block: Node<'_, '_>, basis: &str, whose: &str) -> Result<(), Refused> {
    let (column, row) = (
        text(block, "ColumnAngleBasis"),
        text(block, "RowAngleBasis"),
    );
    if column != row && !column.is_empty() && !row.is_empty() {
        return Err(Refused::new(format!(
            "{whose}: the columns are over {column:?} and the rows over {row:?}; only one basis for both is known"
        )));
    }
    for named in [column, row] {
        if !named.is_empty() && !basis.is_empty() && named != basis {
            return Err(Refused::new(format!(
                "{whose}: the matrix is over {named:?}, but the file defines {basis:?}"
            )));
        }
    }
    Ok(())
}

/// Refuses a file with a matrix that must have been written with rows and columns exchanged.
pub(super) fn orientation(file: &Klems) -> Result<(), Refused> {
    let exchanged = |band: &str, kind: Kind, why: String| {
        Err(Refused::new(format!(
            "{band}, {}: {why}; the matrix is transposed: write row = outgoing, column = incident patch",
            kind.name()
        )))
    };
    for block in &file.blocks {
        let (columns, rows) = spread(file.patches.len(), &block.values);
        // The shade files' columns are constant to their six decimals; their rows vary by 2 % at the least.
        if file.patches.len() >= ENOUGH && rows < 1e-3 && columns > 1e-2 {
            return exchanged(
                &block.band,
                block.kind,
                format!(
                    "every row is constant to {rows:.0e}, but the columns vary by {columns:.0e}"
                ),
            );
        }
    }
    for (t, r) in [
        (Kind::TransmissionFront, Kind::ReflectionFront),
        (Kind::TransmissionBack, Kind::ReflectionBack),
    ] {
        for block in file.blocks.iter().filter(|b| b.kind == t) {
            let other = file.block(&block.band, r);
            let of = |column: bool, i: usize| {
                let one = |b: &super::klems::Block| match column {
                    true => file.directional(b, i),
                    false => (0..file.patches.len())
                        .map(|k| file.value(b, i, k) * file.patches[k].projected_solid_angle())
                        .sum(),
                };
                one(block) + other.map_or(0.0, one)
            };
            let most = |column| {
                (0..file.patches.len())
                    .map(|i| of(column, i))
                    .fold(0.0, f64::max)
            };
            let (columns, rows) = (most(true), most(false));
            // Goniometers are wrong by some per cent; more than that is not noise.
            if columns > 1.05 && rows <= 1.0 {
                return exchanged(
                    &block.band,
                    t,
                    format!(
                        "one incidence gives back {columns:.3} of its light, but no row sums to more than {rows:.3}"
                    ),
                );
            }
        }
    }
    Ok(())
}

/// Mean spread within a column and within a row, off the diagonal, over the mean value; zeros for a black matrix.
fn spread(n: usize, values: &[f64]) -> (f64, f64) {
    let mean = (0..n * n)
        .filter(|i| i / n != i % n)
        .map(|i| values[i])
        .sum::<f64>()
        / (n * n - n).max(1) as f64;
    if n < 2 || mean <= 0.0 {
        return (0.0, 0.0);
    }
    let of = |at: &dyn Fn(usize, usize) -> f64| {
        (0..n)
            .map(|i| {
                let line = || (0..n).filter(|k| *k != i).map(|k| at(i, k));
                let mean = line().sum::<f64>() / (n - 1) as f64;
                (line().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1) as f64).sqrt()
            })
            .sum::<f64>()
            / (n as f64 * mean)
    };
    (
        of(&|column, k| values[k * n + column]),
        of(&|row, k| values[row * n + k]),
    )
}
