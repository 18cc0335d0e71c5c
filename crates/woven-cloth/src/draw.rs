//! Opening and closing: keyed positions of the rings along the rail.

use crate::rail::Pleats;
use crate::simulation::TICKS;
use crate::spec::CurtainSpec;
use serde::{Deserialize, Serialize};

/// Where the curtain is pulled to when it does not cover its whole rail.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// Its left edge stays.
    Left,
    /// Its middle stays.
    #[default]
    Middle,
    /// Its right edge stays.
    Right,
}

/// How far the curtain is drawn at one time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DrawKey {
    /// Seconds since the wind began; before the first key the first holds, after the last the last.
    pub time: f64,
    /// Share of the rail's width that the curtain covers, 1 when it is closed.
    pub share: f64,
}

/// Ticks between two evaluations of the heading's shape; between them the rings run straight.
const EVERY: u64 = 10;

/// The heading through time.
#[derive(Clone, Debug)]
pub(crate) struct Draw {
    keys: Vec<DrawKey>,
    side: Side,
    layout: Pleats,
    height: f64,
    depth: f64,
    columns: usize,
    /// The span of ticks that `from` and `to` belong to.
    span: Option<u64>,
    from: Vec<[f64; 3]>,
    to: Vec<[f64; 3]>,
}

impl Draw {
    pub(crate) fn new(spec: &CurtainSpec) -> Self {
        Self {
            keys: spec.draw.clone(),
            side: spec.draw_to,
            layout: spec.layout(),
            height: spec.rail_height(),
            depth: spec.rail_depth,
            columns: spec.columns,
            span: None,
            from: Vec::new(),
            to: Vec::new(),
        }
    }

    /// Share of the rail covered at `time`, s: between two keys it starts and ends at rest.
    fn share(&self, time: f64) -> f64 {
        let k = self.keys.partition_point(|k| k.time <= time);
        if k == 0 || k == self.keys.len() {
            return self.keys.get(k.saturating_sub(1)).map_or(1.0, |k| k.share);
        }
        let (a, b) = (self.keys[k - 1], self.keys[k]);
        let s = (time - a.time) / (b.time - a.time);
        a.share + (b.share - a.share) * s * s * (3.0 - 2.0 * s)
    }

    /// The pleats at `time`, s.
    pub(crate) fn layout(&self, time: f64) -> Pleats {
        Pleats {
            width: self.layout.width * self.share(time),
            ..self.layout.clone()
        }
    }

    /// Where the middle of the covered part lies at `time`, m from the rail's middle.
    pub(crate) fn middle(&self, time: f64) -> f64 {
        let free = 0.5 * self.layout.width * (1.0 - self.share(time));
        match self.side {
            Side::Left => -free,
            Side::Middle => 0.0,
            Side::Right => free,
        }
    }

    fn heading(&self, time: f64) -> Vec<[f64; 3]> {
        let middle = self.middle(time);
        self.layout(time)
            .row(self.columns, 0.0)
            .into_iter()
            .map(|[x, z]| [x + middle, self.height, z + self.depth])
            .collect()
    }

    /// Fills `places` with where the `pins` (columns of the heading) are at `part` (0 to 1) of the tick after number `tick`.
    /// Leaves it empty when nothing moves.
    pub(crate) fn place(
        &mut self,
        tick: u64,
        part: f64,
        pins: &[usize],
        places: &mut Vec<[f64; 3]>,
    ) {
        places.clear();
        if self.keys.len() < 2 {
            return;
        }
        let span = tick / EVERY;
        let time = |span: u64| (span * EVERY) as f64 / TICKS;
        if self.span != Some(span) {
            self.from = if self.span.is_some_and(|s| s + 1 == span) {
                std::mem::take(&mut self.to)
            } else {
                self.heading(time(span))
            };
            self.to = if self.share(time(span)) == self.share(time(span + 1)) {
                self.from.clone()
            } else {
                self.heading(time(span + 1))
            };
            self.span = Some(span);
        }
        let s = ((tick % EVERY) as f64 + part) / EVERY as f64;
        places.extend(pins.iter().map(|&k| {
            let (a, b) = (self.from[k], self.to[k]);
            std::array::from_fn(|c| a[c] + (b[c] - a[c]) * s)
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_heading_runs_between_its_keys_and_keeps_its_width_of_cloth() {
        let spec: CurtainSpec =
            "width = 1.0\ncolumns = 121\npleats = 10\ndraw_to = \"left\"\n[[draw]]\ntime = 1.0\nshare = 1.0\n[[draw]]\ntime = 3.0\nshare = 0.2"
                .parse()
                .unwrap();
        let mut draw = Draw::new(&spec);
        assert_eq!(
            (draw.share(0.0), draw.share(2.0), draw.share(9.0)),
            (1.0, 0.6, 0.2)
        );
        let pins: Vec<usize> = (0..121).collect();
        let mut places = Vec::new();
        for tick in [0, 600, 1207, 1805, 5000] {
            draw.place(tick, 0.5, &pins, &mut places);
            let h = spec.fabric_width() / 120.0;
            for p in places.windows(2) {
                let l = (p[1][0] - p[0][0]).hypot(p[1][2] - p[0][2]);
                // Between two evaluations the rings run straight, which shortens turning chords a little.
                assert!((l / h - 1.0).abs() < 1e-4, "tick {tick}: {l} for {h}");
            }
            assert!((places[0][0] + 0.5).abs() < 1e-9, "the left edge stays");
        }
        assert!((places[120][0] + 0.3).abs() < 1e-9);
    }
}
