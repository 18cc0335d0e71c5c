//! One curtain of a simulation: its cloth, its solver, the air about it and its rail.

use super::{TICKS, TICKS_PER_WIND};
use crate::contact::SelfContact;
use crate::draw::Draw;
use crate::error::Result;
use crate::fabrics::GRAVITY;
use crate::force::HeatSet;
use crate::sheet::{Field, Sheet};
use crate::spec::CurtainSpec;
use crate::step::{Stepper, gust_step};
use crate::wind::{AirState, Drag, Wind, air_forces, sample};
use crate::work::worth_threads;

/// One curtain.
#[derive(Clone, Debug)]
pub(super) struct Layer {
    pub(super) sheet: Sheet,
    pub(super) stepper: Stepper,
    pub(super) air: AirState,
    drag: Drag,
    draw: Draw,
}

impl Layer {
    /// A curtain in its pleats.
    pub(super) fn new(spec: &CurtainSpec, wind: &Wind) -> Result<Self> {
        let (nx, ny) = (spec.columns, spec.rows);
        let mut sheet = Sheet::flat(nx, ny, spec.fabric_width(), spec.height, spec.mechanics()?);
        sheet.add_hem(spec.hem);
        let draw = Draw::new(spec);
        let layout = draw.layout(0.0);
        for j in 0..ny {
            let row = layout.row(nx, j as f64 / (ny - 1) as f64);
            for (i, p) in row.iter().enumerate() {
                let place = [
                    p[0] + draw.middle(0.0),
                    spec.rail_height() - j as f64 * sheet.hy,
                    p[1] + spec.rail_depth,
                ];
                sheet.set_position(j * nx + i, place);
            }
        }
        for i in layout.held(nx) {
            sheet.pin(i);
        }
        let mut stepper = Stepper::new(&sheet, 1.0 / TICKS, GRAVITY);
        stepper.obstacles = spec.obstacles.clone();
        stepper.window = spec.window;
        stepper.heat_set = HeatSet::of_pleats(&sheet, &spec.layout(), spec.heat_set);
        let empty = || std::array::from_fn(|_| vec![0.0; (nx - 1) * (ny - 1)]);
        Ok(Self {
            drag: Drag::new(&sheet.mechanics, spec.wind.tangential, wind.speed()),
            sheet,
            stepper,
            air: AirState {
                now: empty(),
                next: empty(),
            },
            draw,
        })
    }

    /// Steps a tick that the fabric and the grid need.
    pub(super) fn needed(&self) -> f64 {
        (1.0 / (TICKS * gust_step(&self.sheet, GRAVITY)) - 1e-9)
            .ceil()
            .max(2.0)
    }

    /// Sets the steps of a tick, and contact with itself with this friction.
    pub(super) fn prepare(&mut self, substeps: u32, friction: Option<f64>) {
        let dt = 1.0 / (TICKS * f64::from(substeps));
        let mut stepper = Stepper::new(&self.sheet, dt, GRAVITY);
        stepper.obstacles = self.stepper.obstacles.clone();
        stepper.window = self.stepper.window;
        stepper.heat_set.clone_from(&self.stepper.heat_set);
        stepper.self_contact = friction.map(|f| SelfContact::new(&self.sheet, f));
        self.stepper = stepper;
    }

    /// Still air.
    pub(super) fn calm(&mut self) {
        for air in self.air.now.iter_mut().chain(self.air.next.iter_mut()) {
            air.fill(0.0);
        }
    }

    /// The air's push at the part `s` of the way between two samples.
    pub(super) fn push(&mut self, s: f64) {
        air_forces(&self.sheet, &self.air, s, self.drag, &mut self.stepper.air);
    }

    /// Samples the wind for time `next`, and for `first` before it when the wind has only begun.
    pub(super) fn sample(&mut self, wind: &Wind, first: Option<f64>, next: f64) {
        if let Some(t) = first {
            sample(&self.sheet, wind, t, &mut self.air.next);
        }
        std::mem::swap(&mut self.air.now, &mut self.air.next);
        sample(&self.sheet, wind, next, &mut self.air.next);
    }

    /// The rings' places at the part `end` of the tick after number `tick`.
    pub(super) fn place(&mut self, tick: u64, end: f64) {
        let t = &mut self.stepper;
        self.draw.place(tick, end, &t.pins, &mut t.pin_places);
    }
}

/// Ticks between two samples of the wind are whole.
const _: () = assert!(TICKS_PER_WIND == 10);

/// One step of all curtains; `between` looks after the contact of two.
pub(super) fn step(layers: &mut [Layer], between: Option<&mut SelfContact>) {
    let Some(contact) = between else {
        for layer in layers {
            layer.stepper.step(&mut layer.sheet);
        }
        return;
    };
    let mut masses = Vec::new();
    let mut before: Field = Field::default();
    for Layer { sheet, stepper, .. } in layers.iter_mut() {
        stepper.predict(sheet, false);
        masses.extend_from_slice(&sheet.inv_mass);
        for (all, x) in before.iter_mut().zip(&sheet.x) {
            all.extend_from_slice(x);
        }
    }
    let hp = layers[0].stepper.effective_step();
    let parallel = layers.iter().any(|l| worth_threads(&l.sheet));
    let mut x = together(layers);
    contact.cushion(&masses, &before, &mut x, hp);
    apart(layers, &x);
    for Layer { sheet, stepper, .. } in layers.iter_mut() {
        stepper.weft(sheet);
        stepper.hold(sheet);
    }
    let mut x = together(layers);
    contact.keep_apart(&masses, &before, &mut x, hp, parallel);
    apart(layers, &x);
    for Layer { sheet, stepper, .. } in layers {
        stepper.finish(sheet);
    }
}

/// The places that the steps have found so far, one curtain after the other.
fn together(layers: &mut [Layer]) -> Field {
    let mut all = Field::default();
    for layer in layers {
        for (all, x) in all.iter_mut().zip(layer.stepper.place()) {
            all.extend_from_slice(x);
        }
    }
    all
}

/// The way back.
fn apart(layers: &mut [Layer], all: &Field) {
    let mut from = 0;
    for layer in layers {
        let to = from + layer.sheet.len();
        for (x, all) in layer.stepper.place().iter_mut().zip(all) {
            x.copy_from_slice(&all[from..to]);
        }
        from = to;
    }
}
