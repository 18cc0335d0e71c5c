//! Tensor trees: BSDFs of variable resolution in XML, as Radiance's `bsdf2ttree` and `rttree_reduce` write them.
//!
//! A tree halves the unit cube of its coordinates again and again; a leaf is one value or a cube of 2^k values a side,
//! in 1/sr, constant over its cell. Rank 4: the square images of the direction in which the light travels and of the
//! direction out. Rank 3 (isotropic): half of 1 - sinθ of the light, then the square image of the direction out, turned
//! so that the light travels along +x. The square is Shirley and Chiu's image of the disc (sinθ cosφ, sinθ sinφ), so
//! that equal areas are equal projected solid angles. Sides and azimuths are those of [`super::klems`].

use super::klems::{Kind, Klems, data_blocks};
use super::xml::{document, find, text};
use super::{Refused, read_text, resample};
use crate::vec3::Vec3;
use roxmltree::Node;
use std::f64::consts::{FRAC_PI_4, PI};
use std::path::Path;

/// Most values in a file, so that a tree of single values stays below 200 MiB.
const MAX_VALUES: usize = 1 << 23;
/// Most halvings: cells of 2^-16 are narrower than any instrument.
const MAX_DEPTH: usize = 16;

/// A branch or a leaf; numbers are places in the tree's lists.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Cell {
    /// First of its 2^rank children: bit d of a child's number is the half along dimension d.
    Branch(u32),
    /// First of its values and log2 of their number along a side; the first dimension varies slowest.
    Leaf(u32, u8),
}

/// One tree.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tree {
    rank: usize,
    cells: Vec<Cell>,
    children: Vec<u32>,
    values: Vec<f32>,
    root: u32,
}

/// One direction of light.
#[derive(Clone, Debug, PartialEq)]
pub struct TreeBlock {
    /// "Visible" in all files known.
    pub band: String,
    /// What it measures.
    pub kind: Kind,
    tree: Tree,
}

/// A whole file.
#[derive(Clone, Debug, PartialEq)]
pub struct TensorTree {
    /// The fabric's name.
    pub name: String,
    /// Who made it.
    pub manufacturer: String,
    /// The trees.
    pub blocks: Vec<TreeBlock>,
}

impl TensorTree {
    /// Reads a file.
    ///
    /// # Errors
    /// A sentence that names the file and the place when it is not readable, not such a file, or damaged.
    pub fn read(path: &Path) -> Result<Self, Refused> {
        Self::parse(&read_text(path)?).map_err(|e| Refused::new(format!("{}: {e}", path.display())))
    }

    /// Reads the text of a file.
    ///
    /// # Errors
    /// As [`TensorTree::read`].
    pub fn parse(xml: &str) -> Result<Self, Refused> {
        let doc = document(xml)?;
        Self::of_root(doc.root_element())
    }

    pub(super) fn of_root(root: Node<'_, '_>) -> Result<Self, Refused> {
        let rank = match text(root, "IncidentDataStructure") {
            "TensorTree3" => 3,
            "TensorTree4" => 4,
            other => {
                return Err(Refused::new(format!(
                    "IncidentDataStructure is {other:?}; a tensor tree has TensorTree3 or TensorTree4"
                )));
            }
        };
        let mut blocks: Vec<TreeBlock> = Vec::new();
        let mut left = MAX_VALUES;
        for (band, kind, block) in data_blocks(root)? {
            let whose = format!("{band}, {}", kind.name());
            let basis = find(block, "AngleBasis").and_then(|n| n.text());
            match basis.unwrap_or("").trim() {
                "LBNL/Shirley-Chiu" => {}
                other => {
                    return Err(Refused::new(format!(
                        "{whose}: the angle basis is {other:?}; trees are known over LBNL/Shirley-Chiu only"
                    )));
                }
            }
            let tree = Tree::parse(text(block, "ScatteringData"), rank, left)
                .map_err(|e| Refused::new(format!("{whose}: {e}")))?;
            left -= tree.values.len();
            blocks.push(TreeBlock { band, kind, tree });
        }
        if blocks.is_empty() {
            return Err(Refused::new("the file holds no scattering data"));
        }
        Ok(TensorTree {
            name: text(root, "Name").to_owned(),
            manufacturer: text(root, "Manufacturer").to_owned(),
            blocks,
        })
    }

    /// f(l, v) in 1/sr in a band, 0 where no tree covers these sides. Constant over each cell.
    pub fn eval(&self, band: &str, l: Vec3<f64>, v: Vec3<f64>) -> f64 {
        let block = self.blocks.iter().find(|b| {
            let viewer = if b.kind.transmits() { -1.0 } else { 1.0 };
            b.band == band
                && l.z * b.kind.light_side() > 0.0
                && v.z * b.kind.light_side() * viewer > 0.0
        });
        block.map_or(0.0, |b| b.tree.eval(l, v))
    }

    /// The same as matrices over LBNL's full basis; what is finer than its patches is averaged.
    pub fn to_klems(&self) -> Klems {
        let detail = resample::Detail {
            peak: (64, 256),
            floor: 24,
        };
        let blocks = self
            .blocks
            .iter()
            .map(|b| resample::block(&b.band, b.kind, detail, |l, v| b.tree.eval(l, v)));
        resample::file(&self.name, &self.manufacturer, blocks.collect())
    }
}

impl Tree {
    fn eval(&self, l: Vec3<f64>, v: Vec3<f64>) -> f64 {
        let mut p = [0.0; 4];
        if self.rank == 4 {
            (p[0], p[1]) = square(-l.x, -l.y);
            (p[2], p[3]) = square(v.x, v.y);
        } else {
            let r = l.x.hypot(l.y);
            let (c, s) = if r > 0.0 {
                (-l.x / r, -l.y / r)
            } else {
                (1.0, 0.0)
            };
            p[0] = 0.5 - 0.5 * r;
            (p[1], p[2]) = square(v.x * c + v.y * s, v.y * c - v.x * s);
        }
        self.at(p)
    }

    /// The value of the cell around the point `p` of the unit cube.
    fn at(&self, mut p: [f64; 4]) -> f64 {
        p.iter_mut().for_each(|x| *x = x.clamp(0.0, 1.0 - 1e-9));
        let mut cell = self.cells[self.root as usize];
        loop {
            match cell {
                Cell::Branch(first) => {
                    let mut child = 0;
                    for (d, x) in p[..self.rank].iter_mut().enumerate() {
                        let upper = *x >= 0.5;
                        *x = *x * 2.0 - f64::from(u8::from(upper));
                        child |= usize::from(upper) << d;
                    }
                    cell = self.cells[self.children[first as usize + child] as usize];
                }
                Cell::Leaf(first, log2) => {
                    let side = 1usize << log2;
                    let place = p[..self.rank].iter().fold(0, |n, x| {
                        n * side + ((x * side as f64) as usize).min(side - 1)
                    });
                    return f64::from(self.values[first as usize + place]);
                }
            }
        }
    }

    fn parse(text: &str, rank: usize, most: usize) -> Result<Self, Refused> {
        let mut tree = Tree {
            rank,
            ..Tree::default()
        };
        let mut rest = text;
        tree.root = tree.cell(&mut rest, 0, most)?;
        skip(&mut rest);
        if !rest.is_empty() {
            return Err(Refused::new(format!(
                "{} bytes are left behind the end of the tree",
                rest.len()
            )));
        }
        Ok(tree)
    }

    /// Reads one `{ … }` and gives its place.
    fn cell(&mut self, rest: &mut &str, depth: usize, most: usize) -> Result<u32, Refused> {
        expect(rest, '{')?;
        if depth > MAX_DEPTH {
            return Err(Refused::new(format!(
                "the tree is more than {MAX_DEPTH} levels deep"
            )));
        }
        skip(rest);
        let cell = if rest.starts_with('{') {
            let mut places = [0; 16];
            for place in &mut places[..1 << self.rank] {
                *place = self.cell(rest, depth + 1, most)?;
            }
            expect(rest, '}')?;
            self.children.extend(&places[..1 << self.rank]);
            Cell::Branch((self.children.len() - (1 << self.rank)) as u32)
        } else {
            let first = self.values.len();
            self.numbers(rest, most)?;
            expect(rest, '}')?;
            let n = self.values.len() - first;
            let log2 = (0..=31 / self.rank).find(|k| 1 << (k * self.rank) == n);
            let log2 = log2.ok_or_else(|| {
                Refused::new(format!(
                    "a leaf has {n} values, which do not fill a cube of rank {}",
                    self.rank
                ))
            })?;
            Cell::Leaf(first as u32, log2 as u8)
        };
        self.cells.push(cell);
        Ok((self.cells.len() - 1) as u32)
    }

    fn numbers(&mut self, rest: &mut &str, most: usize) -> Result<(), Refused> {
        loop {
            skip(rest);
            if rest.is_empty() || rest.starts_with(['{', '}']) {
                return Ok(());
            }
            let end = rest
                .find(|c: char| c.is_whitespace() || matches!(c, ',' | '{' | '}'))
                .unwrap_or(rest.len());
            let word = &rest[..end];
            match word.parse::<f32>() {
                // Noise below zero is no light.
                Ok(x) if x.is_finite() => self.values.push(x.max(0.0)),
                _ => {
                    return Err(Refused::new(format!(
                        "value {} of the tree is {word:?}, which is not a number",
                        self.values.len() + 1
                    )));
                }
            }
            if self.values.len() > most {
                return Err(Refused::new(format!(
                    "the file holds more than {MAX_VALUES} values"
                )));
            }
            *rest = &rest[end..];
        }
    }
}

fn skip(rest: &mut &str) {
    *rest = rest.trim_start_matches(|c: char| c.is_whitespace() || c == ',');
}

fn expect(rest: &mut &str, bracket: char) -> Result<(), Refused> {
    skip(rest);
    *rest = rest.strip_prefix(bracket).ok_or_else(|| {
        let found: String = rest.chars().take(12).collect();
        Refused::new(if found.is_empty() {
            format!("a {bracket:?} of the tree is missing; the file is cut off")
        } else {
            format!("expected {bracket:?} in the tree, found {found:?}")
        })
    })?;
    Ok(())
}

/// Shirley and Chiu 1997: the unit disc on the unit square, equal areas to equal areas.
pub fn square(x: f64, y: f64) -> (f64, f64) {
    let r = x.hypot(y).min(1.0);
    let mut phi = y.atan2(x);
    if phi < -FRAC_PI_4 {
        phi += 2.0 * PI;
    }
    let quarter = ((phi + FRAC_PI_4) / (2.0 * FRAC_PI_4)).floor().min(3.0);
    let across = r * (phi - quarter * 2.0 * FRAC_PI_4) / FRAC_PI_4;
    let (a, b) = match quarter as u32 {
        0 => (r, across),
        1 => (-across, r),
        2 => (-r, -across),
        _ => (across, -r),
    };
    (0.5 * (a + 1.0), 0.5 * (b + 1.0))
}
