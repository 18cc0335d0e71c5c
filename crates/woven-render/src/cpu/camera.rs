//! The camera rays of a block of pixels, side by side. Half of the pair of `shader/path.wgsl`.
//!
//! A camera ray goes straight on through every sheet it meets. At each crossing the light that the sheet scatters
//! towards the eye is estimated with weight (product of the gaps before it). Indirect light is gathered at the first
//! crossing and at one of those behind; the path that finds it begins at one of the two, chosen in proportion to what
//! the crossings contribute. So the view through the cloth is as clean as without it, and there is no coin in the
//! picture of the cloth itself.
//!
//! The rays of a block go on together from crossing to crossing, so that the ray structure is walked once for all.

use glam::Vec3;

use super::beam::Beam;
use super::bvh::{FAINT, FAR, Hit, Ray, transmittance};
use super::light;
use super::math::luminance;
use super::path::{
    Begun, FIRSTS, First, Sample, Vertex, View, add, follow, incident, layer, place, towards_eye,
};
use super::share::{GROUP, TILES};
use super::surface::{self, Surface};
use crate::rng::Rng;
use crate::table::{EMITTED, MaterialRow, PASSED, Table};

/// Sheets at which a camera ray is lit (random numbers: set 0 is the camera's, then one set a crossing); beyond it goes
/// on dark (the product of as many gaps is below any noise).
const CROSSINGS: u32 = 64;

/// The camera ray of pixel (x, y); `u` chooses the place in the pixel and on the lens.
pub(super) fn camera_ray(view: &View, x: u32, y: u32, u: [f32; 4]) -> Ray {
    let sx = (x as f32 + u[0]) / view.width as f32 * 2.0 - 1.0;
    let sy = 1.0 - (y as f32 + u[1]) / view.height as f32 * 2.0;
    let d = view.forward + view.right * sx + view.up * sy;
    if view.aperture <= 0.0 {
        return Ray::new(view.eye, d.normalize());
    }
    let (sin, cos) = super::math::sincos_turn(u[2]);
    let r = view.aperture * u[3].sqrt();
    let lens = view.lens_x * (r * cos) + view.lens_y * (r * sin);
    Ray::new(view.eye + lens, (d * view.focus - lens).normalize())
}

/// A camera ray on its way.
pub(super) struct Walk {
    rng: Rng,
    ray: Ray,
    tmin: f32,
    /// Product of the gaps so far; 0 at the end.
    passed: f32,
    sample: Sample,
    found: [Option<Vertex>; FIRSTS],
    /// Weight of the first, and of the rest with that of the one that stands for them.
    front: f32,
    rest: f32,
    kept: f32,
    pick: f32,
}

impl Walk {
    #[inline(always)]
    fn new(view: &View, x: u32, y: u32, index: u32) -> Self {
        let mut rng = Rng::new(x, y, index, view.seed);
        Self {
            ray: camera_ray(view, x, y, rng.set(0)),
            tmin: 0.0,
            passed: 1.0,
            sample: Sample::default(),
            found: [None; FIRSTS],
            front: 0.0,
            rest: 0.0,
            kept: 0.0,
            pick: rng.coin(),
            rng,
        }
    }

    /// Goes through the sheet that it has met, or ends.
    #[inline(always)]
    fn cross(&mut self, table: &Table, view: &View, hit: Option<Hit>, crossing: u32) {
        let out = &mut self.sample;
        let (ray, passed) = (&self.ray, self.passed);
        let Some(hit) = hit else {
            let straight = |light| layer(table, PASSED, light);
            add(
                &mut out.direct,
                straight(table.globals.sky_layer),
                light::sky(table, ray.d) * passed,
            );
            light::discs(table, ray.d, |light, l| {
                add(&mut out.direct, straight(light), l * passed);
            });
            self.passed = 0.0;
            return;
        };
        let s = surface::surface(table, &hit, hit.t * view.up.length() / view.height as f32);
        let m = &table.materials[s.material as usize];
        let wo = s.local(-ray.d);
        let gap = surface::gap(table, m, &s, ray.d);
        let given = if crossing == 0 { EMITTED } else { PASSED };
        add(
            &mut out.direct,
            layer(table, given, m.layer),
            surface::emission(table, m, &s, -ray.d) * (passed * (1.0 - gap)),
        );
        let albedo = m.emission[3] * luminance(s.tint);
        if crossing == 0 {
            out.normal = towards_eye(&s, ray.d);
            out.depth = hit.t;
        }
        out.albedo += reflectance(m, &s, wo) * (passed * (1.0 - gap));
        let weight = passed * (1.0 - gap) * albedo;
        if weight > 0.0 && view.depth > 0 {
            let at = place(table, m, &s, ray.d);
            let u = self.rng.set(1 + crossing);
            let vertex = Vertex {
                s,
                at,
                wo,
                throughput: Vec3::splat(passed),
                front: crossing == 0,
            };
            if let Some(l) = incident(table, m, &s, &at, wo, u) {
                let through = transmittance(table, &l.ray, l.end, &mut self.rng);
                let (l, value) = l.pass(through);
                let event = vertex.event(s.local(l.wi));
                add(
                    &mut out.direct,
                    layer(table, event, l.layer),
                    value * passed,
                );
            }
            self.keep(vertex, weight);
        }
        self.go_on(gap, hit.t * (1.0 + 2e-6) + table.globals.offset);
    }

    /// Keeps the first sheet, and one of those behind in proportion to its weight: a reservoir of one.
    fn keep(&mut self, vertex: Vertex, weight: f32) {
        if self.found[0].is_none() {
            self.found[0] = Some(vertex);
            self.front = weight;
            return;
        }
        self.rest += weight;
        let keep = weight / self.rest;
        if self.pick < keep {
            self.pick /= keep;
            self.found[1] = Some(vertex);
            self.kept = weight;
        } else {
            self.pick = (self.pick - keep) / (1.0 - keep);
        }
    }

    /// Through the gap, if there is one; faint rays by a coin.
    fn go_on(&mut self, gap: f32, tmin: f32) {
        self.passed *= gap;
        self.tmin = tmin;
        if self.passed <= 0.0 {
            return;
        }
        self.sample.gap = self.passed;
        if self.passed < FAINT {
            if self.rng.coin() < 0.5 {
                self.sample.gap = 0.0;
                self.passed = 0.0;
            }
            self.passed *= 2.0;
        }
    }

    /// Follows the pixel's path from one of the sheets.
    #[inline(always)]
    pub(super) fn follow(&mut self, table: &Table, view: &View, paths: &mut Rng) -> Begun {
        if let Some(v) = &mut self.found[1] {
            v.throughput *= self.rest / self.kept;
        }
        let share = self.front / (self.front + self.rest).max(1e-30);
        let shares = [share, 1.0 - share];
        let chosen = usize::from(self.pick >= share && self.found[1].is_some());
        let mut second = None;
        if let Some(mut v) = self.found[chosen] {
            v.throughput /= shares[chosen];
            second = follow(table, view, &v, paths, &mut self.sample);
        }
        let [a, b] = self.found;
        let first = |vertex: Vertex, share| First { vertex, share };
        Begun {
            sample: self.sample,
            firsts: [
                a.map(|v| first(v, shares[0])),
                b.map(|v| first(v, shares[1])),
            ],
            chosen,
            second,
        }
    }
}

/// Sample `index` of the pixels of a block, as far as their camera rays go, into `walks`; `beam` is room to work in.
#[inline(always)]
pub(super) fn walk(
    table: &Table,
    view: &View,
    pixels: &[Option<(u32, u32)>; GROUP],
    index: u32,
    beam: &mut Beam,
    walks: &mut Vec<Option<Walk>>,
) {
    walks.clear();
    for pixel in pixels {
        walks.push(match *pixel {
            None => None,
            Some((x, y)) => Some(Walk::new(view, x, y, index)),
        });
    }
    for crossing in 0..CROSSINGS {
        beam.clear();
        for &k in &TILES {
            if let Some(w) = walks[k].as_ref().filter(|w| w.passed > 0.0) {
                beam.add(&w.ray, w.tmin, FAR);
            }
        }
        if beam.count() == 0 {
            break;
        }
        beam.nearest(table);
        let mut n = 0;
        for &k in &TILES {
            if let Some(w) = walks[k].as_mut().filter(|w| w.passed > 0.0) {
                w.cross(table, view, beam.hit(n), crossing);
                n += 1;
            }
        }
    }
}

/// Sum of the factors on the side of `wo`.
#[inline(always)]
fn reflectance(m: &MaterialRow, s: &Surface, wo: Vec3) -> Vec3 {
    let back = surface::side(wo);
    let k = |j: usize| Vec3::new(m.linear[j][0], m.linear[j][1], m.linear[j][2]);
    (k(0) + k(1) + k(2 + back) + k(3 + back) + k(4 + back)) * s.tint
}
