//! A curtain through time: from the pleated start to rest, then into the wind, frame by frame.
//!
//! Time advances in ticks of 1/600 s, a whole number of which makes a frame at 24, 25, 30, 50, 60 or 100 a second, so the path
//! does not depend on the frames asked for. Each tick is cut into as many steps as the fabric and the grid need.

mod checkpoint;
mod layer;
mod report;

pub use report::Report;

use crate::contact::SelfContact;
use crate::crossing::crossings;
use crate::error::{Error, Result};
use crate::fabrics::GRAVITY;
use crate::mesh::{Mesh, normals, positions};
use crate::sheet::Sheet;
use crate::spec::CurtainSpec;
use crate::wind::{WIND_TICK, Wind};
use layer::Layer;

/// Ticks a second.
pub const TICKS: f64 = 600.0;
const TICKS_PER_WIND: u64 = 10;

/// One moment of the clip.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame {
    /// Positions, m.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals.
    pub normals: Vec<[f32; 3]>,
    /// Velocities, m/s, for motion blur.
    pub velocities: Vec<[f32; 3]>,
}

/// A curtain being simulated.
#[derive(Clone, Debug)]
pub struct Simulation {
    spec: CurtainSpec,
    /// The curtain, and a second one if there is one.
    layers: Vec<Layer>,
    /// Contact of two curtains, each with itself and with the other.
    between: Option<SelfContact>,
    wind: Wind,
    substeps: u32,
    tick: u64,
    frame: u64,
    settled: bool,
}

impl Simulation {
    /// A curtain in its pleats, not yet at rest.
    ///
    /// # Errors
    /// When a value of the description makes no sense.
    pub fn new(spec: &CurtainSpec) -> Result<Self> {
        spec.validate()?;
        let wind = Wind::new(&spec.wind, spec.seed);
        let second = spec.second();
        let mut layers = vec![Layer::new(spec, &wind)?];
        if let Some(second) = &second {
            layers.push(Layer::new(second, &wind)?);
        }
        let needed = layers.iter().map(Layer::needed).fold(2.0, f64::max);
        let substeps = match spec.substeps {
            Some(n) => n,
            None if needed <= 64.0 => needed as u32,
            None => {
                return Err(Error::spec(
                    "substeps",
                    format!(
                        "this fabric on so fine a grid needs {needed} steps per 1/600 s; use fewer rows and columns or set `substeps`"
                    ),
                ));
            }
        };
        let alone = spec.self_contact && second.is_none();
        for layer in &mut layers {
            layer.prepare(substeps, alone.then_some(spec.friction));
        }
        let sheets: Vec<&Sheet> = layers.iter().map(|l| &l.sheet).collect();
        let between = (spec.self_contact && second.is_some())
            .then(|| SelfContact::among(&sheets, spec.friction));
        let sim = Self {
            spec: spec.clone(),
            layers,
            between,
            wind,
            substeps,
            tick: 0,
            frame: 0,
            settled: false,
        };
        if second.is_some() && crossings(&sim.frame().positions, &sim.mesh()) > 0 {
            return Err(Error::spec(
                "second.rail_depth",
                "the pleats of the two curtains reach into each other; put their rails farther apart or hang fewer folds",
            ));
        }
        Ok(sim)
    }

    /// The cloth itself (the first curtain's).
    #[must_use]
    pub fn sheet(&self) -> &Sheet {
        &self.layers[0].sheet
    }

    /// The cloth itself, to disturb it; the solver forgets its past.
    pub fn sheet_mut(&mut self) -> &mut Sheet {
        self.restart();
        &mut self.layers[0].sheet
    }

    /// Number of vertices of all curtains.
    #[must_use]
    pub fn count(&self) -> usize {
        self.layers.iter().map(|l| l.sheet.len()).sum()
    }

    fn restart(&mut self) {
        for layer in &mut self.layers {
            layer.stepper.restart();
        }
        if let Some(between) = &mut self.between {
            between.restart();
        }
    }

    /// Number of frames taken so far.
    #[must_use]
    pub fn frame_index(&self) -> usize {
        self.frame as usize
    }

    /// Still air until the curtain hangs at rest, at most `seconds`; a drag on every motion helps it there.
    ///
    /// # Errors
    /// When the cloth blows up.
    pub fn settle(&mut self, seconds: f64) -> Result<Report> {
        for layer in &mut self.layers {
            layer.calm();
        }
        let ticks = (seconds * TICKS).round() as u64;
        for t in 0..ticks {
            // Strong at first, weaker later so that slow unfolding is not held up.
            let settling = if t * 2 < ticks { 8.0 } else { 4.0 };
            for layer in &mut self.layers {
                layer.stepper.settling = settling;
            }
            self.advance_tick(0.5)?;
            let kinetic = |l: &Layer| l.sheet.energy(GRAVITY).kinetic;
            if t % 60 == 59 && t > 600 && self.layers.iter().map(kinetic).sum::<f64>() < 1e-9 {
                break;
            }
        }
        for layer in &mut self.layers {
            layer.stepper.settling = 0.0;
            for v in &mut layer.sheet.v {
                v.fill(0.0);
            }
        }
        self.restart();
        self.settled = true;
        Ok(self.report())
    }

    /// One tick of 1/600 s; `s` is the place between two samples of the wind.
    fn advance_tick(&mut self, s: f64) -> Result<()> {
        for layer in &mut self.layers {
            layer.push(s);
        }
        for n in 0..self.substeps {
            if self.settled {
                let end = (f64::from(n) + 1.0) / f64::from(self.substeps);
                for layer in &mut self.layers {
                    layer.place(self.tick, end);
                }
            }
            layer::step(&mut self.layers, self.between.as_mut());
        }
        // A curtain in the strongest wind allowed stays under 60 m/s; NaN fails the comparison too.
        if self.layers.iter().all(|l| l.sheet.is_within(200.0)) {
            return Ok(());
        }
        let fastest = self.max_speed();
        let what = if fastest.is_finite() && self.layers.iter().all(|l| l.sheet.is_finite()) {
            format!("a speed of {fastest:.0} m/s or a place as far away")
        } else {
            "a position that is not a number".to_owned()
        };
        Err(Error::Diverged {
            time: self.time(),
            what,
        })
    }

    /// Time since the wind began, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.tick as f64 / TICKS
    }

    /// Runs in the wind until tick number `target`.
    fn advance_to(&mut self, target: u64) -> Result<()> {
        while self.tick < target {
            let part = self.tick % TICKS_PER_WIND;
            if part == 0 {
                let t = self.time();
                let first = (self.tick == 0).then_some(t);
                for layer in &mut self.layers {
                    layer.sample(&self.wind, first, t + WIND_TICK);
                }
            }
            self.advance_tick((part as f64 + 0.5) / TICKS_PER_WIND as f64)?;
            self.tick += 1;
        }
        Ok(())
    }

    /// Runs `seconds` of wind without taking frames.
    ///
    /// # Errors
    /// When the cloth blows up.
    pub fn run(&mut self, seconds: f64) -> Result<()> {
        let target = self.tick + (seconds * TICKS).round() as u64;
        self.advance_to(target)
    }

    /// Runs to the next frame of the clip. Frame 0 lies `warm_up` seconds after the wind began.
    ///
    /// # Errors
    /// When the cloth blows up.
    pub fn step_frame(&mut self) -> Result<()> {
        if !self.settled {
            let seconds = self.spec.settle;
            self.settle(seconds)?;
        }
        let (tick, _) = self.frame_tick(self.frame);
        self.advance_to(tick)?;
        self.frame += 1;
        Ok(())
    }

    /// The last tick before frame `n`, and how much of a tick the frame is later.
    fn frame_tick(&self, n: u64) -> (u64, f64) {
        let exact = (self.spec.warm_up + n as f64 / self.spec.fps) * TICKS;
        // A hair of rounding must not cost a tick.
        let tick = (exact + 1e-6).floor();
        (tick as u64, (exact - tick).max(0.0))
    }

    /// The cloth at the frame last reached.
    #[must_use]
    pub fn frame(&self) -> Frame {
        let sheets = || self.layers.iter().map(|l| &l.sheet);
        let mut positions: Vec<[f32; 3]> = sheets().flat_map(positions).collect();
        let velocities: Vec<[f32; 3]> = sheets()
            .flat_map(|s| (0..s.len()).map(|k| s.velocity(k).map(|c| c as f32)))
            .collect();
        let late = if self.frame > 0 {
            (self.frame_tick(self.frame - 1).1 / TICKS) as f32
        } else {
            0.0
        };
        if late > 0.0 {
            for (p, v) in positions.iter_mut().zip(&velocities) {
                for c in 0..3 {
                    p[c] += late * v[c];
                }
            }
        }
        Frame {
            positions,
            normals: sheets().flat_map(normals).collect(),
            velocities,
        }
    }

    /// The mesh as it hangs now, a second curtain's after the first's.
    #[must_use]
    pub fn mesh(&self) -> Mesh {
        let mesh = Mesh::from_sheet(&self.layers[0].sheet);
        match self.layers.get(1) {
            Some(second) => mesh.with(&Mesh::from_sheet(&second.sheet)),
            None => mesh,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn small() -> CurtainSpec {
        "width = 0.6\nheight = 0.8\npleats = 4\ncolumns = 33\nrows = 21\nsettle = 0.5\nwarm_up = 0.2\n[wind]\nspeed = 1.5".parse().unwrap()
    }

    #[test]
    fn a_run_resumed_from_a_saved_state_has_the_same_bits() {
        let mut spec = small();
        spec.mechanics.bending_hysteresis = 2e-5;
        spec.mechanics.shear_hysteresis = 0.3;
        let mut a = Simulation::new(&spec).unwrap();
        for _ in 0..5 {
            a.step_frame().unwrap();
        }
        let mut b = Simulation::load(&spec, &a.save()).unwrap();
        for _ in 0..5 {
            a.step_frame().unwrap();
            b.step_frame().unwrap();
        }
        assert_eq!(a.save(), b.save());
        assert_eq!(a.frame(), b.frame());
    }

    #[test]
    fn frames_a_second_do_not_change_the_path_and_seeds_do() {
        let at_one_second = |fps: f64, seed: u64| {
            let mut sim = Simulation::new(&CurtainSpec {
                fps,
                seed,
                ..small()
            })
            .unwrap();
            for _ in 0..=fps as usize {
                sim.step_frame().unwrap();
            }
            sim.frame()
        };
        let film = at_one_second(24.0, 1);
        for fps in [25.0, 30.0, 60.0] {
            assert_eq!(film, at_one_second(fps, 1), "{fps} frames a second");
        }
        assert_ne!(film, at_one_second(24.0, 2));
    }

    #[test]
    fn a_damaged_or_foreign_state_is_refused_in_words() {
        let sim = Simulation::new(&small()).unwrap();
        let mut bytes = sim.save();
        let other = CurtainSpec { seed: 9, ..small() };
        assert!(
            Simulation::load(&other, &bytes)
                .unwrap_err()
                .to_string()
                .contains("another curtain")
        );
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        assert!(
            Simulation::load(&small(), &bytes)
                .unwrap_err()
                .to_string()
                .contains("damaged")
        );
        assert!(Simulation::load(&small(), &bytes[..100]).is_err());
    }
}
