//! Which patches of the cloth are near each other: found anew when they have moved, with a lower bound of every pair's distance.

use super::distance::{Point, dot, sub};
use super::motions::{self, Motion};
use super::net::Grid;
use super::sort_into_cells;
use super::tiles::{Bounds, Tile};
use crate::sheet::Field;

/// Pairs are gathered anew when a patch may have moved by so many times the distance up to which they are told apart: seldom, since that is
/// dear, and yet with few pairs that are far.
const DRIFT: f64 = 1.1;

/// Two patches and what is known of them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pair {
    pub(crate) a: u32,
    pub(crate) b: u32,
    /// A lower bound of their distance at the start of the step, m.
    pub(crate) slack: f64,
    /// The most they move against each other in the step, m.
    pub(crate) motion: f64,
    /// How far they may still move against each other before their vertices are listed anew, m.
    pub(crate) budget: f64,
}

/// Two vertices that may come near, and the squared distance, m², below which they push each other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touch {
    pub(crate) a: u32,
    pub(crate) b: u32,
    pub(crate) near: f64,
}

/// The patches of all grids and the pairs that are near.
#[derive(Clone, Debug)]
pub(crate) struct Patches {
    pub(crate) grids: Vec<Grid>,
    pub(crate) tiles: Vec<Tile>,
    pub(crate) pairs: Vec<Pair>,
    /// For every pair the vertices, one of each patch, that are or may come near.
    pub(crate) touch: Vec<Vec<Touch>>,
    /// Distances are told apart up to here, m.
    pub(crate) cap: f64,
    motions: Vec<Motion>,
    /// How far a patch has moved at most since the pairs were gathered, beside what all have moved, m; none before the first time.
    drift: Option<f64>,
}

impl Patches {
    pub(crate) fn new(grids: &[Grid], cap: f64) -> Self {
        let tiles = Tile::all(grids);
        Self {
            grids: grids.to_vec(),
            motions: vec![Motion::default(); tiles.len()],
            tiles,
            pairs: Vec::new(),
            touch: Vec::new(),
            cap,
            drift: None,
        }
    }

    /// Forgets all distances, as after a jump.
    pub(crate) fn restart(&mut self) {
        self.drift = None;
        self.pairs.clear();
        self.touch.clear();
    }

    /// Takes the motions of a step from `before` to `x`.
    pub(crate) fn take_motions(&mut self, before: &Field, x: &Field, parallel: bool) {
        motions::take(&self.grids, before, x, &mut self.motions, parallel);
        let motions = &self.motions;
        for pair in &mut self.pairs {
            pair.motion = motions[pair.a as usize].against(&motions[pair.b as usize]);
        }
    }

    /// Whether there are pairs at all.
    pub(crate) fn is_new(&self) -> bool {
        self.drift.is_none()
    }

    /// The step is done: what was left of all distances grows less by its motions.
    pub(crate) fn advance(&mut self) {
        for pair in &mut self.pairs {
            pair.slack -= pair.motion;
            pair.budget -= pair.motion;
        }
        let most = self.most();
        self.drift = self.drift.map(|drift| drift + most);
    }

    /// The most that a patch moves in this step, m, beside what all of them move.
    fn most(&self) -> f64 {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for m in &self.motions {
            for c in 0..3 {
                low[c] = m.middle[c].min(low[c]);
                high[c] = m.middle[c].max(high[c]);
            }
        }
        let all = [0, 1, 2].map(|c| 0.5 * (low[c] + high[c]));
        let of = |m: &Motion| {
            let d = sub(m.middle, all);
            dot(d, d).sqrt() + m.radius
        };
        self.motions.iter().map(of).fold(0.0, f64::max)
    }

    /// Gathers the pairs that are near at the start of a step, when patches have moved so far that others may have come near, or may
    /// within this step.
    pub(crate) fn gather_if_moved(&mut self, before: &Field) {
        let most = self.most();
        // What is not a pair is farther apart than one cap and twice the drift allowed, so more than one cap before the next gathering;
        // a tenth of a cap for either is left for what parting adds to a motion.
        if self
            .drift
            .is_some_and(|drift| drift + most < DRIFT * self.cap)
        {
            return;
        }
        let reach = ((1.2 + 2.0 * DRIFT) * self.cap).max(1.1 * self.cap + 2.5 * most);
        self.drift = Some(0.0);
        let bounds: Vec<Bounds> = self
            .tiles
            .iter()
            .map(|t| t.bounds(&self.grids, before))
            .collect();
        let middle: Vec<Point> = bounds.iter().map(Bounds::middle).collect();
        let widest = bounds.iter().map(Bounds::radius).fold(0.0, f64::max);
        let field: Field = std::array::from_fn(|c| middle.iter().map(|m| m[c]).collect());
        let cells = sort_into_cells(&field, 2.0 * widest + reach);
        let old = std::mem::take(&mut self.pairs);
        let mut old_touch = std::mem::take(&mut self.touch);
        let mut at = 0;
        for a in 0..self.tiles.len() {
            let first = self.pairs.len();
            cells.near(middle[a], |b| {
                if b < a {
                    return;
                }
                let d2 = bounds[a].squared_distance(&bounds[b]);
                if d2 < reach * reach {
                    self.pairs.push(Pair {
                        a: a as u32,
                        b: b as u32,
                        slack: d2.sqrt(),
                        motion: self.motions[a].against(&self.motions[b]),
                        budget: -1.0,
                    });
                }
            });
            self.pairs[first..].sort_unstable_by_key(|p| p.b);
            for pair in &mut self.pairs[first..] {
                while at < old.len() && (old[at].a, old[at].b) < (pair.a, pair.b) {
                    at += 1;
                }
                let mut touch = Vec::new();
                if at < old.len() && (old[at].a, old[at].b) == (pair.a, pair.b) {
                    pair.slack = pair.slack.max(old[at].slack);
                    pair.budget = old[at].budget;
                    touch = std::mem::take(&mut old_touch[at]);
                }
                self.touch.push(touch);
            }
        }
    }
}
