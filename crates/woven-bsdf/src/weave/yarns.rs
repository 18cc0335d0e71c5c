//! Yarns as curved tubes: the geometry that a draft means, as the oracle of the aggregated openness and for close-ups.
//!
//! Each yarn runs along a centre line that rises where it lies on the face and sinks where it lies under, so far that the
//! yarns touch at their crossings; its section is an ellipse. The aggregated form ([`super::openness`]) takes straight
//! yarns: between two neighbours of which one is up and one is down a tilted beam finds one gap wider and one narrower,
//! which the product of two straight gratings cannot know. [`Yarns::aggregate`] finds the diameters and the section with
//! which it comes closest, and says how close.

use super::draft::Draft;
use super::openness;
use crate::angles::radians;
use crate::vec3::Vec3;
use std::f64::consts::{FRAC_PI_4, PI, TAU};

/// Points of a centre line per pitch.
const STEPS: usize = 24;

/// Diameter and distance of yarns, both in one unit of length, which is then that of the geometry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gauge {
    /// Width of the yarn's section.
    pub diameter: f64,
    /// Distance of neighbours.
    pub pitch: f64,
}

/// One yarn over one repeat of the weave; its end is its beginning, one repeat further.
#[derive(Clone, Debug)]
pub struct Tube {
    /// Whether it is an end (warp, along y) or a pick (weft, along x).
    pub is_warp: bool,
    /// Number of the end or pick in the draft.
    pub index: usize,
    /// Half the width of its section.
    pub radius: f64,
    /// Points of the centre line.
    pub centre: Vec<Vec3<f64>>,
}

/// One repeat of a cloth.
#[derive(Clone, Debug)]
pub struct Yarns {
    /// Size of the repeat along the weft and along the warp.
    pub repeat: [f64; 2],
    /// Height of a yarn over its width.
    pub section: f64,
    /// The yarns.
    pub tubes: Vec<Tube>,
    gauges: [Gauge; 2],
}

/// What [`Yarns::aggregate`] finds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aggregate {
    /// Warp diameter over pitch for [`super::openness`] and the sheet.
    pub gamma_warp: f64,
    /// Weft diameter over pitch.
    pub gamma_weft: f64,
    /// Section.
    pub section: f64,
    /// Greatest |difference| of the two openings over 0…60° of incidence.
    pub error: f64,
}

/// Triangles of a cloth, for a renderer.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Corners.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals at the corners.
    pub normals: Vec<[f32; 3]>,
    /// Three corners each.
    pub triangles: Vec<[u32; 3]>,
}

/// From `a` to `b` along half a cosine.
fn ease(a: f64, b: f64, t: f64) -> f64 {
    a + (b - a) * 0.5 * (1.0 - (PI * t).cos())
}

/// Walks from `x` downhill in steps along a spiral of directions over the sphere, halving the step where none helps.
fn descend(mut x: [f64; 3], mut step: f64, error: &dyn Fn(&[f64; 3]) -> f64) -> [f64; 3] {
    const TURNS: i32 = 60;
    let mut e = error(&x);
    while step > 1e-4 {
        let better = (0..TURNS).find_map(|k| {
            let z = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(TURNS);
            let d = Vec3::from_angles(z.acos(), 2.399_963 * f64::from(k));
            let y = [
                (x[0] + step * d.x).clamp(0.0, 1.0),
                (x[1] + step * d.y).clamp(0.0, 1.0),
                (x[2] + step * d.z * 2.0).clamp(0.0, 2.0),
            ];
            let f = error(&y);
            (f < e - 1e-9).then_some((y, f))
        });
        match better {
            Some((y, f)) => (x, e) = (y, f),
            None => step *= 0.5,
        }
    }
    x
}

impl Yarns {
    /// The yarns of a draft; `section` is the height of a yarn over its width, above 0.
    pub fn new(draft: &Draft, warp: Gauge, weft: Gauge, section: f64) -> Self {
        // Half the distance of two yarns that touch, one over the other.
        let h = section * (warp.diameter + weft.diameter) / 4.0;
        let (ends, picks) = (draft.ends(), draft.picks());
        let mut tubes = Vec::new();
        let mut add = |is_warp: bool, index: usize, own: Gauge, other: Gauge, n: usize| {
            let level = |k: usize| {
                let up = if is_warp {
                    draft.warp_up(index, k)
                } else {
                    !draft.warp_up(k, index)
                };
                if up { h } else { -h }
            };
            let across = (index as f64 + 0.5) * own.pitch;
            let point = |i: usize| {
                let (k, t) = (i / STEPS, (i % STEPS) as f64 / STEPS as f64);
                let along = (k as f64 + 0.5 + t) * other.pitch;
                let z = ease(level(k), level((k + 1) % n), t);
                if is_warp {
                    Vec3::new(across, along, z)
                } else {
                    Vec3::new(along, across, z)
                }
            };
            tubes.push(Tube {
                is_warp,
                index,
                radius: own.diameter / 2.0,
                centre: (0..n * STEPS).map(point).collect(),
            });
        };
        (0..ends).for_each(|e| add(true, e, warp, weft, picks));
        (0..picks).for_each(|p| add(false, p, weft, warp, ends));
        Yarns {
            repeat: [ends as f64 * warp.pitch, picks as f64 * weft.pitch],
            section,
            tubes,
            gauges: [warp, weft],
        }
    }

    /// Gauze ([`Draft::leno`]): of each pair of ends one runs straight under all picks, the other lies over each pick,
    /// now on its left, now on its right, and passes below it in between. The picks are straight.
    pub fn leno(warp: Gauge, weft: Gauge, section: f64) -> Self {
        let h = section * (warp.diameter + weft.diameter) / 4.0;
        let (middle, below) = (warp.pitch, -h - section * warp.diameter);
        let along = |i: usize| i as f64 / STEPS as f64;
        let end = |index: usize, point: &dyn Fn(f64) -> (f64, f64)| Tube {
            is_warp: true,
            index,
            radius: warp.diameter / 2.0,
            centre: (0..2 * STEPS)
                .map(|i| {
                    let (x, z) = point(along(i));
                    Vec3::new(x, along(i) * weft.pitch, z)
                })
                .collect(),
        };
        let mut tubes = vec![
            end(0, &|t| {
                let turn = PI * (t - 0.5);
                let z = 0.5 * (h + below) + 0.5 * (h - below) * (2.0 * turn).cos();
                (middle + warp.diameter * turn.cos(), z)
            }),
            end(1, &|_| (middle, -h)),
        ];
        tubes.extend((0..2).map(|index| {
            Tube {
                is_warp: false,
                index,
                radius: weft.diameter / 2.0,
                centre: (0..2 * STEPS)
                    .map(|i| {
                        Vec3::new(
                            along(i) * warp.pitch,
                            (index as f64 + 0.5) * weft.pitch,
                            0.0,
                        )
                    })
                    .collect(),
            }
        }));
        Yarns {
            repeat: [2.0 * warp.pitch, 2.0 * weft.pitch],
            section,
            tubes,
            gauges: [warp, weft],
        }
    }

    /// Share of a beam along `w` that meets no yarn. Within 0.0015 for 48 cells.
    pub fn openness(&self, w: Vec3<f64>, cells: usize) -> f64 {
        let (_, dark) = self.shadow(w, cells);
        dark.iter().filter(|d| !**d).count() as f64 / dark.len() as f64
    }

    /// Where the yarns shade one repeat of the sheet from a beam along `w`: the shadows of all centre points, in cells of
    /// 1/`cells` of a pitch, row after row along the weft; what falls over an edge comes in at the other. A cell is as dark
    /// as one point of it, elsewhere in each row and column, or else the edge of a yarn would count in whole lines.
    pub fn shadow(&self, w: Vec3<f64>, cells: usize) -> ([usize; 2], Vec<bool>) {
        let n = [0, 1].map(|a| ((self.repeat[a] / self.gauges[a].pitch).round() as usize) * cells);
        let size = [0, 1].map(|a| self.repeat[a] / n[a] as f64);
        let z = w.z.abs().max(1e-6);
        let slope = w.z.signum() / z;
        let (slope_x, slope_y) = (w.x * slope, w.y * slope);
        // In a space where sections are round, the shadow of a ball is an ellipse 1/cos long and 1 wide.
        let sin = w.x.hypot(w.y);
        let (s, c) = w.y.atan2(w.x).sin_cos();
        let cos = (z / self.section) / (z / self.section).hypot(sin);
        let mut dark = vec![false; n[0] * n[1]];
        let golden = |i: usize| (i as f64 * 0.618_033_988_749_894_9).fract();
        let places = n.map(|n| (0..n).map(golden).collect::<Vec<f64>>());
        for tube in &self.tubes {
            let r = tube.radius;
            let reach = [0, 1].map(|a| (r / cos / size[a]).ceil() as i64 + 1);
            for p in &tube.centre {
                let (x, y) = (p.x - p.z * slope_x, p.y - p.z * slope_y);
                let (i, j) = ((x / size[0]).floor() as i64, (y / size[1]).floor() as i64);
                for row in j - reach[1]..=j + reach[1] {
                    let line = row.rem_euclid(n[1] as i64) as usize;
                    for column in i - reach[0]..=i + reach[0] {
                        let at = column.rem_euclid(n[0] as i64) as usize;
                        let dx = (column as f64 + places[1][line]) * size[0] - x;
                        let dy = (row as f64 + places[0][at]) * size[1] - y;
                        let (u, v) = ((dx * c + dy * s) * cos, dy * c - dx * s);
                        if u * u + v * v <= r * r {
                            dark[line * n[0] + at] = true;
                        }
                    }
                }
            }
        }
        (n, dark)
    }

    /// Draws the ends and picks of each block of `block` together towards its middle: 0 leaves them, 1 puts them all in
    /// one place. The holes between the blocks are what makes [`Draft::lace`] a lace.
    #[must_use]
    pub fn gathered(mut self, block: usize, share: f64) -> Self {
        let pitch = self.gauges.map(|g| g.pitch);
        let moved = |x: f64, pitch: f64| {
            let at = |k: f64| {
                let middle = ((k / block as f64).floor() + 0.5) * block as f64 * pitch;
                let own = (k + 0.5) * pitch;
                own + (middle - own) * share
            };
            // Between two yarns what was halfway stays halfway, so that crossings move with the yarns.
            let place = x / pitch - 0.5;
            let (k, t) = (place.floor(), place - place.floor());
            at(k) * (1.0 - t) + at(k + 1.0) * t
        };
        for p in self.tubes.iter_mut().flat_map(|tube| &mut tube.centre) {
            (p.x, p.y) = (moved(p.x, pitch[0]), moved(p.y, pitch[1]));
        }
        self
    }

    /// The straight yarns whose openness is closest to this geometry over 0…60°, by the greatest difference.
    pub fn aggregate(&self) -> Aggregate {
        let directions: Vec<Vec3<f64>> = std::iter::once(Vec3::new(0.0, 0.0, 1.0))
            .chain([20.0, 30.0, 40.0, 50.0, 60.0].into_iter().flat_map(|deg| {
                let azimuth = |j: i32| f64::from(j) * FRAC_PI_4 / 4.0;
                (0..9).map(move |j| Vec3::from_angles(radians(deg), azimuth(j)))
            }))
            .collect();
        let known: Vec<f64> = directions.iter().map(|w| self.openness(*w, 48)).collect();
        let off = |x: &[f64; 3]| -> Vec<f64> {
            let one = |(w, t): (&Vec3<f64>, &f64)| (openness(x[0], x[1], x[2], *w) - t).abs();
            directions.iter().zip(&known).map(one).collect()
        };
        let greatest = |x: &[f64; 3]| off(x).into_iter().fold(0.0, f64::max);
        // Nearly the same, but smooth, so that a search by steps does not stop at a ridge.
        let smooth = |x: &[f64; 3]| {
            let sum: f64 = off(x).iter().map(|d| (d * 10.0).powi(12)).sum();
            sum.powf(1.0 / 12.0)
        };
        let gamma = self.gauges.map(|g| (g.diameter / g.pitch).min(1.0));
        let mut best = ([gamma[0], gamma[1], self.section], f64::INFINITY);
        for k in 0..10 {
            let (more, s) = (0.05 * (k / 5) as f64, [0.6, 0.8, 1.0, 1.25, 1.6][k % 5]);
            let start = [gamma[0] + more, gamma[1] + more, self.section * s];
            let x = descend(descend(start, 0.08, &smooth), 0.02, &greatest);
            if greatest(&x) < best.1 {
                best = (x, greatest(&x));
            }
        }
        let (best, error) = best;
        Aggregate {
            gamma_warp: best[0],
            gamma_weft: best[1],
            section: best[2],
            error,
        }
    }

    /// The tubes as triangles, `repeats` times along weft and warp, each section a polygon of `sides` corners.
    pub fn mesh(&self, repeats: [usize; 2], sides: usize) -> Mesh {
        let mut out = Mesh::default();
        for tube in &self.tubes {
            let along = usize::from(tube.is_warp);
            for lane in 0..repeats[1 - along] {
                let n = tube.centre.len() * repeats[along];
                let at = |i: usize| {
                    let (turn, k) = (i / tube.centre.len(), i % tube.centre.len());
                    let mut p = tube.centre[k];
                    let shift = [turn as f64, lane as f64];
                    p.x += self.repeat[0] * shift[along];
                    p.y += self.repeat[1] * shift[1 - along];
                    p
                };
                let first = out.positions.len() as u32;
                for i in 0..=n {
                    let forward = (at(i + 1) - at(i.saturating_sub(1))).normalize();
                    // To the right of the way, and up: side × forward.
                    let side = Vec3::new(forward.y, -forward.x, 0.0).normalize();
                    let up = Vec3::new(
                        side.y * forward.z - side.z * forward.y,
                        side.z * forward.x - side.x * forward.z,
                        side.x * forward.y - side.y * forward.x,
                    );
                    for k in 0..sides {
                        let (s, c) = (TAU * k as f64 / sides as f64).sin_cos();
                        let p = at(i)
                            + side * (c * tube.radius)
                            + up * (s * tube.radius * self.section);
                        let normal = (side * (c * self.section) + up * s).normalize();
                        out.positions.push([p.x, p.y, p.z].map(|x| x as f32));
                        out.normals
                            .push([normal.x, normal.y, normal.z].map(|x| x as f32));
                    }
                }
                let m = sides as u32;
                for i in 0..n as u32 {
                    for k in 0..m {
                        let [a, b] = [k, (k + 1) % m].map(|k| first + i * m + k);
                        out.triangles.extend([[a, a + m, b], [b, a + m, b + m]]);
                    }
                }
            }
        }
        out
    }
}
