//! Pixels of a block share the second points of their paths. The pair of `shader/share.wgsl`.
//!
//! A path is dear up to its second point and behind it; to look at that point from another pixel costs one shadow ray.
//! So every pixel of a block takes the light that the second points of all of them scatter (Bekaert, Sbert and Halton
//! 2002, "Accelerating path tracing by re-using paths"), each weighed by the balance heuristic over all pixels that
//! could have found it. That is as free of bias as each path alone: the densities that are compared hold the product
//! of the gaps on the way. Dim points are dropped by a coin, in proportion to what they scatter: one coin for the block
//! (systematic resampling), so that their number does not scatter too.
//!
//! The paths of all blocks draw from one set of points along a Z-curve over the picture (Ahmed and Wonka 2020,
//! "Screen-space blue-noise diffusion of Monte Carlo sampling error via hierarchical ordering of pixels"): blocks side
//! by side complete each other, and what a filter takes together has less noise than as many strangers.
//!
//! A point is shared on the side of the sheet on which it was found. What scattering found behind a glossy point
//! belongs to its own path, for another viewer would have looked elsewhere; light that was sampled there is shared.

mod comb;

use glam::Vec3;

use super::beam::{Beam, MOST};
use super::bvh::Ray;
use super::camera;
use super::math::luminance;
use super::path::{Begun, FIRSTS, First, Sample, Second, View, layer};
use super::surface;
use crate::rng::{Rng, hash, hash2, morton, unit};
use crate::table::{MaterialRow, Table};
use comb::comb;

/// Side of a block of pixels.
pub(crate) const BLOCK: u32 = 8;
/// Pixels in a block.
pub(super) const GROUP: usize = (BLOCK * BLOCK) as usize;
const _: () = assert!(FIRSTS * GROUP <= MOST, "a beam holds the rays of a block");
/// About as many second points are looked at. Measured on the bench scene (relMSE x CPU-s at 320 x 240, 16 spp;
/// `examples/measure.rs`): 8 gives 0.033, 16 0.026, all 64 some 0.03; without sharing 0.32.
const KEPT: f32 = 16.0;
/// Sets the points of the paths apart from those of the pixels.
const PATHS: u32 = 0x7061_7468;

/// How far the blocks are shifted left and up for sample `index`, so that their edges do not show.
pub(crate) fn shift(index: u32) -> (u32, u32) {
    let h = hash(index ^ 0x736b_6966);
    (h % BLOCK, h / BLOCK % BLOCK)
}

/// The pixels of a block in tiles of four by two, so that rays side by side have much in common.
pub(super) const TILES: [usize; GROUP] = tiles();

const fn tiles() -> [usize; GROUP] {
    let mut order = [0; GROUP];
    let mut i = 0;
    while i < GROUP {
        let (tile, within) = (i / 8, i % 8);
        let (x, y) = (tile % 2 * 4 + within % 4, tile / 2 * 2 + within / 4);
        order[i] = y * BLOCK as usize + x;
        i += 1;
    }
    order
}

/// Room to work in, kept from block to block.
pub(crate) struct Room {
    beam: Beam,
    walks: Vec<Option<camera::Walk>>,
    begun: Vec<Option<Begun>>,
}

impl Room {
    pub(crate) fn new() -> Self {
        Self {
            beam: Beam::new(),
            walks: Vec::with_capacity(GROUP),
            begun: Vec::with_capacity(GROUP),
        }
    }
}

/// Place in its block (blocks row by row, `columns` a row; then row by row in it) of pixel (x, y) for sample `index`.
pub(crate) fn find(x: u32, y: u32, index: u32, columns: u32) -> usize {
    let (left, above) = shift(index);
    let (x, y) = (x + left, y + above);
    let block = y / BLOCK * columns + x / BLOCK;
    (block as usize) * GROUP + (y % BLOCK * BLOCK + x % BLOCK) as usize
}

/// Sample `index` of those pixels of the block at (x0, y0) that lie in the picture, one a pixel of the block. Their
/// paths draw from one set of points, a slice each, another one each time.
pub(super) fn block(
    table: &Table,
    view: &View,
    x0: i32,
    y0: i32,
    index: u32,
    room: &mut Room,
    out: &mut [Sample],
) {
    pulp::Arch::new().dispatch(Widest {
        table,
        view,
        corner: (x0, y0),
        index,
        room,
        out,
    });
}

/// A block to be compiled for the widest vectors: everything in it that takes time is compiled in.
struct Widest<'a> {
    table: &'a Table,
    view: &'a View,
    corner: (i32, i32),
    index: u32,
    room: &'a mut Room,
    out: &'a mut [Sample],
}

impl pulp::NullaryFnOnce for Widest<'_> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        let Self {
            table,
            view,
            corner: (x0, y0),
            index,
            room,
            out,
        } = self;
        let seed = hash2(index, view.seed ^ PATHS);
        // Where the curve begins is another place each time, so that its seams do not show.
        let place = |corner: i32, bits: u32| (corner + BLOCK as i32) as u32 / BLOCK + (bits & 31);
        let order = morton(place(x0, seed), place(y0, seed >> 5));
        let turn = hash2(order, seed);
        let pixel = |member: usize| {
            let x = u32::try_from(x0 + (member as u32 % BLOCK) as i32).ok()?;
            let y = u32::try_from(y0 + (member as u32 / BLOCK) as i32).ok()?;
            (x < view.width && y < view.height).then_some((x, y))
        };
        let pixels = std::array::from_fn(pixel);
        camera::walk(table, view, &pixels, index, &mut room.beam, &mut room.walks);
        room.begun.clear();
        for member in 0..GROUP {
            let Some(walk) = &mut room.walks[member] else {
                room.begun.push(None);
                continue;
            };
            let slice = order * GROUP as u32 + (member as u32 ^ (turn % GROUP as u32));
            let mut paths = Rng::new(0, 0, slice, seed);
            room.begun.push(Some(walk.follow(table, view, &mut paths)));
        }
        gather(table, &mut room.begun, unit(turn), &mut room.beam);
        for (out, begun) in out.iter_mut().zip(&room.begun) {
            if let Some(begun) = begun {
                *out = begun.sample;
            }
        }
    }
}

/// How a pixel sees the second point of another.
#[derive(Clone, Copy, Default)]
struct Sight {
    /// Density with which its path would have come there, per area.
    density: f32,
    /// What the pixel takes of the light that the point scatters towards it, times area.
    carry: Vec3,
    /// Towards the point.
    d: Vec3,
}

/// Distributes the light of all second points over all first points.
#[inline(always)]
fn gather(table: &Table, group: &mut [Option<Begun>], coin: f32, beam: &mut Beam) {
    let mut bright = [0.0; GROUP];
    for (bright, begun) in bright.iter_mut().zip(group.iter()) {
        if let Some(y) = begun.as_ref().and_then(|b| b.second.as_ref()) {
            *bright = brightness(table, y);
        }
    }
    let total: f32 = bright.iter().sum();
    if total <= 0.0 {
        return;
    }
    for (i, weight) in comb(&bright, total, coin).into_iter().enumerate() {
        if weight <= 0.0 {
            continue;
        }
        let Some(begun) = group[i].as_ref() else {
            continue;
        };
        let (Some(own), Some(y)) = (begun.firsts[begun.chosen].as_ref(), begun.second) else {
            continue;
        };
        let chosen = begun.chosen;
        let side = y.s.ng.dot(y.s.p - own.vertex.s.p) < 0.0;
        let mut sights = [[Sight::default(); FIRSTS]; GROUP];
        // The rays of the beam by number: where they belong, and the share of the solid angle.
        let mut rays = [(0, 0, 0.0); MOST];
        beam.clear();
        for which in 0..FIRSTS {
            for &k in &TILES {
                let Some(first) = group[k].as_ref().and_then(|b| b.firsts[which].as_ref()) else {
                    continue;
                };
                let Some(look) = look(table, first, &y, side) else {
                    continue;
                };
                sights[k][which] = look.sight;
                if (k, which) == (i, chosen) {
                    sights[k][which].pass(look.angle, y.passed);
                } else {
                    let n = beam.add(&look.ray, 0.0, look.end);
                    rays[n] = (k, which, look.angle);
                }
            }
        }
        beam.pass(table);
        for (n, &(k, which, angle)) in rays[..beam.count()].iter().enumerate() {
            sights[k][which].pass(angle, beam.passed(n));
        }
        let all: f32 = sights.iter().flatten().map(|s| s.density).sum();
        let m = &table.materials[y.s.material as usize];
        let shine = Shine {
            y: &y,
            m,
            sides: surface::even(m)
                .then(|| [Vec3::Z, -Vec3::Z].map(|wo| scattered(table, m, &y, wo))),
        };
        for (sights, begun) in sights.iter().zip(group.iter_mut()) {
            let Some(begun) = begun else { continue };
            for which in 0..FIRSTS {
                let sight = &sights[which];
                if sight.density > 0.0 {
                    shine.add(table, begun, which, sight, sight.carry * (weight / all));
                }
            }
        }
    }
}

/// The light that a second point scatters.
struct Shine<'a> {
    y: &'a Second,
    m: &'a MaterialRow,
    /// See [`scattered`]; for a viewer in front and behind, where it is the same in all directions of a side.
    sides: Option<[(Vec3, Vec3); 2]>,
}

/// What is scattered of the sampled light, and the value for where the path went on to, towards `wo`.
#[inline(always)]
fn scattered(table: &Table, m: &MaterialRow, y: &Second, wo: Vec3) -> (Vec3, Vec3) {
    (
        y.lit.scattered(table, m, &y.s, wo),
        surface::evaluate(table, m, &y.s, y.s.local(y.wi), wo),
    )
}

impl Shine<'_> {
    /// Adds the share `carry` of it to what the pixel sees by way of `sight`.
    #[inline(always)]
    fn add(&self, table: &Table, begun: &mut Begun, which: usize, sight: &Sight, carry: Vec3) {
        let y = self.y;
        let (lit, f) = match &self.sides {
            Some(sides) => sides[usize::from(sight.d.dot(y.s.frame[2]) > 0.0)],
            None => scattered(table, self.m, y, y.s.local(-sight.d)),
        };
        // By event all that comes this way is of one layer.
        let event = match &begun.firsts[which] {
            Some(x) if table.globals.events != 0 => x.vertex.event(x.vertex.s.local(sight.d)),
            _ => 0,
        };
        let into = |light: usize| layer(table, event, light as u32) as usize;
        let light = &mut begun.sample.indirect;
        light[into(y.lit.layer as usize)] += lit * carry;
        let f = f * carry;
        for (k, &beyond) in y.beyond.iter().enumerate() {
            if beyond != Vec3::ZERO {
                light[into(k)] += f * beyond;
            }
        }
    }
}

/// About what the point scatters.
#[inline(always)]
fn brightness(table: &Table, y: &Second) -> f32 {
    let all = y.beyond.iter().fold(y.lit.light, |sum, &b| sum + b);
    let l = luminance(all) * table.materials[y.s.material as usize].emission[3];
    if l.is_finite() { l } else { 0.0 }
}

/// A look from a first point at a second one before its ray is followed.
struct Look {
    /// As if nothing stood between, per solid angle.
    sight: Sight,
    /// Solid angle over area.
    angle: f32,
    ray: Ray,
    end: f32,
}

impl Sight {
    /// The share `passed` of it gets through; from solid angle to area.
    #[inline(always)]
    fn pass(&mut self, angle: f32, passed: f32) {
        let seen = angle * passed;
        self.density *= seen;
        self.carry *= seen;
    }
}

#[inline(always)]
fn look(table: &Table, first: &First, y: &Second, side: bool) -> Option<Look> {
    let x = &first.vertex;
    let from = x.s.leave(table, y.s.p - x.s.p);
    let to = y.s.p - from;
    let distance2 = to.length_squared().max(1e-12);
    let distance = distance2.sqrt();
    let d = to * (1.0 / distance);
    let cos = y.s.ng.dot(d);
    if (cos < 0.0) != side {
        return None;
    }
    let m = &table.materials[x.s.material as usize];
    let wi = x.s.local(d);
    let yarn = 1.0 - surface::gap(table, &table.materials[y.s.material as usize], &y.s, d);
    let density = first.share * surface::density(table, m, &x.s, x.wo, wi) * yarn;
    if density <= 0.0 {
        return None;
    }
    let carry = x.throughput * surface::evaluate(table, m, &x.s, wi, x.wo) * wi.z.abs();
    Some(Look {
        sight: Sight { density, carry, d },
        angle: cos.abs() / distance2,
        ray: Ray::new(from, d),
        end: distance - (1e-4 + 1e-4 * distance),
    })
}
