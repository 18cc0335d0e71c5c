//! The path of one sample of one pixel, from where its camera ray is scattered. The pair of `shader/path.wgsl`, together
//! with `camera.rs`.

use glam::Vec3;

use super::bvh::{FAR, Ray, nearest, transmittance};
use super::light::{self, Place};
use super::surface::{self, Surface};
use crate::rng::Rng;
use crate::scene::LAYERS;
use crate::table::{MATT, MaterialRow, NONE, PASSED, REFLECTED, TRANSMITS, TRANSMITTED, Table};

/// A path survives with the probability of what it carries times this. Measured on the bench scene (relMSE x CPU-s at
/// 160 x 120, 32 spp; `examples/measure.rs`): 0.5 gives 0.042, 1 0.030, 3 0.022, 6 0.023, no roulette 0.023.
const ROULETTE: f32 = 3.0;

/// What is the same for all samples of a picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    pub eye: Vec3,
    /// To the right edge of the picture, at distance 1.
    pub right: Vec3,
    /// To its upper edge.
    pub up: Vec3,
    pub forward: Vec3,
    /// Unit vectors of the lens.
    pub lens_x: Vec3,
    pub lens_y: Vec3,
    pub aperture: f32,
    pub focus: f32,
    pub width: u32,
    pub height: u32,
    /// Most scattering events of a path; gaps do not count.
    pub depth: u32,
    pub seed: u32,
}

/// One sample.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sample {
    /// Radiance by light layer that was scattered at most once, at what the camera sees.
    pub direct: [Vec3; LAYERS],
    /// Radiance by light layer that was scattered before.
    pub indirect: [Vec3; LAYERS],
    /// Reflectance and transmittance of what is seen, weighted like the picture.
    pub albedo: Vec3,
    /// Shading normal of what is seen first, towards the eye.
    pub normal: Vec3,
    /// Distance of what is seen first [m], 0 for nothing.
    pub depth: f32,
    /// Share of the picture that is seen through gaps.
    pub gap: f32,
}

/// A point from which a path goes on.
#[derive(Clone, Copy)]
pub(super) struct Vertex {
    pub s: Surface,
    pub at: Place,
    pub wo: Vec3,
    /// What is scattered here reaches the eye times this.
    pub throughput: Vec3,
    /// The first sheet that the camera's ray meets.
    pub front: bool,
}

impl Vertex {
    /// Layer of what comes from direction `wi` (in the sheet's frame) and is scattered here, with `Globals::events`.
    pub(super) fn event(&self, wi: Vec3) -> u32 {
        match (self.front, wi.z * self.wo.z > 0.0) {
            (false, _) => PASSED,
            (true, true) => REFLECTED,
            (true, false) => TRANSMITTED,
        }
    }
}

/// The layer by event if these are asked for, else that of the light.
pub(super) fn layer(table: &Table, event: u32, light: u32) -> u32 {
    if table.globals.events == 0 {
        light
    } else {
        event
    }
}

/// Where a camera ray is scattered: its first sheet, and one of those behind for all of them.
pub(super) const FIRSTS: usize = 2;

/// A point at which a camera ray is scattered.
#[derive(Clone, Copy)]
pub(super) struct First {
    pub vertex: Vertex,
    /// Probability with which the pixel's path begins here.
    pub share: f32,
}

/// The second point of a path, and the light that it scatters on: what the pixels of a group share.
#[derive(Clone, Copy)]
pub(super) struct Second {
    pub s: Surface,
    /// Product of the gaps on the way to it.
    pub passed: f32,
    /// Light from a sampled light.
    pub lit: Incident,
    /// Where the path went on to, in the world.
    pub wi: Vec3,
    /// What it met there, times cosine over density, by layer.
    pub beyond: [Vec3; LAYERS],
}

/// A sample of a pixel, its indirect light still to be gathered.
pub(super) struct Begun {
    pub sample: Sample,
    /// Where the camera ray is scattered.
    pub firsts: [Option<First>; FIRSTS],
    /// At which of them the path begins.
    pub chosen: usize,
    pub second: Option<Second>,
}

#[inline(always)]
pub(super) fn towards_eye(s: &Surface, d: Vec3) -> Vec3 {
    if s.frame[2].dot(d) > 0.0 {
        -s.frame[2]
    } else {
        s.frame[2]
    }
}

#[inline(always)]
pub(super) fn place(table: &Table, m: &MaterialRow, s: &Surface, d: Vec3) -> Place {
    light::place(table, s.p, towards_eye(s, d), m.flags & TRANSMITS != 0)
}

/// Power heuristic.
#[inline(always)]
fn heuristic(a: f32, b: f32) -> f32 {
    let r = b / a.max(1e-30);
    1.0 / (1.0 + r * r)
}

/// Scattering at this material shares all lights with the sampling of lights.
fn shares(m: &MaterialRow) -> bool {
    m.flags & MATT == 0
}

/// Light that reaches a place from a sampled light.
#[derive(Clone, Copy, Default)]
pub(super) struct Incident {
    /// Where it comes from, in the world.
    pub wi: Vec3,
    /// Radiance times cosine over density: what the value of the scattering is to be multiplied with.
    pub light: Vec3,
    /// Density of the sampling if scattering shares the light with it, else 0.
    pub pdf: f32,
    pub layer: u32,
}

impl Incident {
    /// What is scattered towards `wo` (in the sheet's frame).
    #[inline(always)]
    pub(super) fn scattered(&self, table: &Table, m: &MaterialRow, s: &Surface, wo: Vec3) -> Vec3 {
        let wi = s.local(self.wi);
        let mut value = surface::evaluate(table, m, s, wi, wo) * self.light;
        if self.pdf > 0.0 {
            value *= heuristic(self.pdf, surface::density(table, m, s, wo, wi));
        }
        value
    }
}

/// A sampled light before its shadow ray is followed.
pub(super) struct Unseen {
    found: Incident,
    /// What is scattered towards the viewer if nothing is between.
    value: Vec3,
    pub ray: Ray,
    pub end: f32,
}

impl Unseen {
    /// The light that gets through, and what is scattered of it.
    #[inline(always)]
    pub(super) fn pass(mut self, passed: f32) -> (Incident, Vec3) {
        self.found.light *= passed;
        (self.found, self.value * passed)
    }
}

/// Samples a light for a place that is seen from `wo` (in the sheet's frame); nothing where what is scattered towards
/// `wo` is black.
#[inline(always)]
pub(super) fn incident(
    table: &Table,
    m: &MaterialRow,
    s: &Surface,
    at: &Place,
    wo: Vec3,
    u: [f32; 4],
) -> Option<Unseen> {
    let l = light::sample(table, at, [u[0], u[1], u[2]])?;
    let found = Incident {
        wi: l.wi,
        light: l.radiance * (s.local(l.wi).z.abs() / l.pdf),
        pdf: if l.meets && (l.shared || shares(m)) {
            l.pdf
        } else {
            0.0
        },
        layer: l.layer,
    };
    let value = found.scattered(table, m, s, wo);
    (value.max_element() > 0.0).then(|| Unseen {
        found,
        value,
        ray: Ray::new(s.leave(table, l.wi), l.wi),
        end: l.distance - (1e-4 + 1e-4 * l.distance),
    })
}

#[inline(always)]
pub(super) fn add(light: &mut [Vec3; LAYERS], layer: u32, value: Vec3) {
    light[(layer as usize).min(LAYERS - 1)] += value;
}

/// Follows the path that scatters at `first` until it ends. What it meets without a second scattering is added to
/// `own`, and so is what comes through the second point if only this very path may use it; the rest is returned.
#[inline(always)]
pub(super) fn follow(
    table: &Table,
    view: &View,
    first: &Vertex,
    rng: &mut Rng,
    own: &mut Sample,
) -> Option<Second> {
    let mut v = *first;
    let mut second: Option<Second> = None;
    // What the path carries from the second point on, and whether other paths may have it.
    let mut tail = Vec3::ONE;
    let mut lent = false;
    let mut event = PASSED;
    for bounce in 1..=view.depth {
        let m = &table.materials[v.s.material as usize];
        let mixed = shares(m);
        // The last ray could only meet lights that sampling has already counted.
        if bounce == view.depth && !mixed && table.globals.soft_lights == 0 {
            return second;
        }
        let u = rng.set(2 * bounce);
        let wi = surface::sample(table, m, &v.s, v.wo, Vec3::new(u[0], u[1], u[2]));
        let pdf = surface::density(table, m, &v.s, v.wo, wi);
        if pdf <= 1e-12 {
            return second;
        }
        let f = surface::evaluate(table, m, &v.s, wi, v.wo);
        v.throughput *= f * (wi.z.abs() / pdf);
        // Russian roulette by what the path still carries.
        let q = v.throughput.max_element() * ROULETTE;
        if q <= 0.0 {
            return second;
        }
        let mut kept = 1.0;
        if bounce > 1 && q < 1.0 {
            if u[3] >= q {
                return second;
            }
            kept = 1.0 / q;
            v.throughput *= kept;
        }
        let d = v.s.world(wi);
        if bounce == 1 {
            event = first.event(wi);
        }
        let away = wi.z.abs() / pdf * kept;
        if let (2, Some(y)) = (bounce, &mut second) {
            y.wi = d;
            tail = Vec3::splat(away);
        } else {
            tail *= f * away;
        }
        let ray = Ray::new(v.s.leave(table, d), d);
        let mut tmin = 0.0;
        let mut passed = 1.0;
        let mut give = |light: u32, value: Vec3, tail: Vec3, alone: Vec3| {
            let own_layer = layer(table, event, light);
            match &mut second {
                Some(y) if lent => add(&mut y.beyond, light, value * tail),
                Some(_) => add(&mut own.indirect, own_layer, value * alone),
                None => add(&mut own.direct, own_layer, value * alone),
            }
        };
        // Straight on through gaps, each by a coin.
        let (hit, s, gap) = loop {
            let Some(hit) = nearest(table, &ray, tmin, FAR) else {
                let sky = table.globals.sky_light;
                if sky != NONE {
                    let met = light::density(table, &v.at, sky, d, 1e9);
                    let share = if met <= 0.0 {
                        1.0
                    } else if mixed {
                        heuristic(pdf, met)
                    } else {
                        0.0
                    };
                    let value = light::sky(table, d) * share;
                    give(table.globals.sky_layer, value, tail, v.throughput);
                }
                return second;
            };
            let s = surface::surface(table, &hit, 0.0);
            let gap = surface::gap(table, &table.materials[s.material as usize], &s, d);
            if gap <= 0.0 || (gap < 1.0 && rng.coin() >= gap) {
                break (hit, s, gap);
            }
            passed *= gap;
            tmin = hit.t * (1.0 + 2e-6) + table.globals.offset;
        };
        let m = &table.materials[s.material as usize];
        let emitted = surface::emission(table, m, &s, -d);
        if emitted.max_element() > 0.0 {
            let mut share = 1.0;
            if s.light != NONE {
                let met = light::density(table, &v.at, s.light, d, hit.t);
                let both = mixed || light::soft(table, s.light);
                if met > 0.0 {
                    share = if both { heuristic(pdf, met) } else { 0.0 };
                }
            }
            give(m.layer, emitted * share, tail, v.throughput);
        }
        if bounce == view.depth || m.emission[3] <= 0.0 {
            return second;
        }
        let at = place(table, m, &s, d);
        let wo = s.local(-d);
        let u = rng.set(2 * bounce + 1);
        let lit = match incident(table, m, &s, &at, wo, u) {
            None => None,
            Some(l) => {
                let passed = transmittance(table, &l.ray, l.end, rng);
                Some(l.pass(passed))
            }
        };
        // What is scattered here is the yarn's share; the coin above has already chosen the yarn.
        let yarn = 1.0 / (1.0 - gap).max(1e-6);
        v.throughput *= yarn;
        if bounce > 1 {
            tail *= yarn;
            if let Some((l, value)) = lit {
                give(l.layer, value, tail, v.throughput);
            }
        } else {
            lent = !shares(m);
            second = Some(Second {
                s,
                passed,
                lit: lit.map(|l| l.0).unwrap_or_default(),
                wi: d,
                beyond: [Vec3::ZERO; LAYERS],
            });
        }
        v = Vertex {
            s,
            at,
            wo,
            throughput: v.throughput,
            front: false,
        };
    }
    second
}
