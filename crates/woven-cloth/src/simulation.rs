//! A curtain through time: from the pleated start to rest, then into the wind, frame by frame.
//!
//! Time advances in ticks of 1/600 s, a whole number of which makes a frame at 24, 25, 30, 50, 60 or 100 a second, so the path
//! does not depend on the frames asked for. Each tick is cut into as many steps as the fabric and the grid need.

mod checkpoint;
mod report;

pub use report::Report;

use crate::contact::SelfContact;
use crate::draw::Draw;
use crate::error::{Error, Result};
use crate::fabrics::GRAVITY;
use crate::mesh::{Mesh, normals, positions};
use crate::sheet::Sheet;
use crate::spec::CurtainSpec;
use crate::step::{Stepper, stable_step};
use crate::wind::{AirState, Drag, WIND_TICK, Wind, air_forces, sample};

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
    sheet: Sheet,
    stepper: Stepper,
    wind: Wind,
    air: AirState,
    drag: Drag,
    draw: Draw,
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
        let mechanics = spec.mechanics()?;
        let (nx, ny) = (spec.columns, spec.rows);
        let mut sheet = Sheet::flat(nx, ny, spec.fabric_width(), spec.height, mechanics);
        sheet.add_hem(spec.hem);
        let draw = Draw::new(spec);
        let layout = draw.layout(0.0);
        for j in 0..ny {
            let row = layout.row(nx, j as f64 / (ny - 1) as f64);
            for (i, p) in row.iter().enumerate() {
                sheet.set_position(
                    j * nx + i,
                    [
                        p[0] + draw.middle(0.0),
                        spec.rail_height() - j as f64 * sheet.hy,
                        p[1],
                    ],
                );
            }
        }
        for i in layout.held(nx) {
            sheet.pin(i);
        }
        let longest = stable_step(&sheet, GRAVITY);
        let needed = (1.0 / (TICKS * longest)).ceil().max(2.0);
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
        let mut stepper = Stepper::new(&sheet, 1.0 / (TICKS * f64::from(substeps)), GRAVITY);
        stepper.obstacles = spec.obstacles.clone();
        stepper.window = spec.window;
        if spec.self_contact {
            stepper.self_contact = Some(SelfContact::new(&sheet, spec.friction));
        }
        let wind = Wind::new(&spec.wind, spec.seed);
        let drag = Drag::new(&sheet.mechanics, spec.wind.tangential, wind.speed());
        let empty = || std::array::from_fn(|_| vec![0.0; (nx - 1) * (ny - 1)]);
        let air = AirState {
            now: empty(),
            next: empty(),
        };
        Ok(Self {
            wind,
            spec: spec.clone(),
            sheet,
            stepper,
            air,
            drag,
            draw,
            substeps,
            tick: 0,
            frame: 0,
            settled: false,
        })
    }

    /// The cloth itself.
    #[must_use]
    pub fn sheet(&self) -> &Sheet {
        &self.sheet
    }

    /// The cloth itself, to disturb it; the solver forgets its past.
    pub fn sheet_mut(&mut self) -> &mut Sheet {
        self.stepper.restart();
        &mut self.sheet
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
        for air in self.air.now.iter_mut().chain(self.air.next.iter_mut()) {
            air.fill(0.0);
        }
        let ticks = (seconds * TICKS).round() as u64;
        for t in 0..ticks {
            // Strong at first, weaker later so that slow unfolding is not held up.
            self.stepper.settling = if t * 2 < ticks { 8.0 } else { 4.0 };
            self.advance_tick(0.5)?;
            if t % 60 == 59 && t > 600 && self.sheet.energy(GRAVITY).kinetic < 1e-9 {
                break;
            }
        }
        self.stepper.settling = 0.0;
        for v in &mut self.sheet.v {
            v.fill(0.0);
        }
        self.stepper.restart();
        self.settled = true;
        Ok(self.report())
    }

    /// One tick of 1/600 s; `s` is the place between two samples of the wind.
    fn advance_tick(&mut self, s: f64) -> Result<()> {
        air_forces(&self.sheet, &self.air, s, self.drag, &mut self.stepper.air);
        for n in 0..self.substeps {
            if self.settled {
                let end = (f64::from(n) + 1.0) / f64::from(self.substeps);
                self.draw.place(
                    self.tick,
                    end,
                    &self.stepper.pins,
                    &mut self.stepper.pin_places,
                );
            }
            self.stepper.step(&mut self.sheet);
        }
        // A curtain in the strongest wind allowed stays under 60 m/s; NaN fails the comparison too.
        if self.sheet.is_within(200.0) {
            return Ok(());
        }
        let fastest = self.max_speed();
        let what = if fastest.is_finite() && self.sheet.is_finite() {
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
                if self.tick == 0 {
                    sample(&self.sheet, &self.wind, t, &mut self.air.next);
                }
                std::mem::swap(&mut self.air.now, &mut self.air.next);
                sample(&self.sheet, &self.wind, t + WIND_TICK, &mut self.air.next);
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
        let mut positions = positions(&self.sheet);
        let velocities: Vec<[f32; 3]> = (0..self.sheet.len())
            .map(|k| self.sheet.velocity(k).map(|c| c as f32))
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
            normals: normals(&self.sheet),
            velocities,
        }
    }

    /// The mesh as it hangs now.
    #[must_use]
    pub fn mesh(&self) -> Mesh {
        Mesh::from_sheet(&self.sheet)
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
        let mut a = Simulation::new(&small()).unwrap();
        for _ in 0..5 {
            a.step_frame().unwrap();
        }
        let mut b = Simulation::load(&small(), &a.save()).unwrap();
        for _ in 0..5 {
            a.step_frame().unwrap();
            b.step_frame().unwrap();
        }
        assert_eq!(a.save(), b.save());
        assert_eq!(a.frame(), b.frame());
    }

    #[test]
    fn frames_a_second_do_not_change_the_path_and_seeds_do() {
        let at_half_second = |fps: f64, seed: u64| {
            let mut sim = Simulation::new(&CurtainSpec {
                fps,
                seed,
                ..small()
            })
            .unwrap();
            for _ in 0..=(fps / 2.0) as usize {
                sim.step_frame().unwrap();
            }
            sim.frame()
        };
        let film = at_half_second(24.0, 1);
        assert_eq!(film, at_half_second(60.0, 1));
        assert_eq!(film, at_half_second(30.0, 1));
        assert_ne!(film, at_half_second(24.0, 2));
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
