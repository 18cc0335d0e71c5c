//! A textile laboratory for virtual cloth: the cantilever of Peirce (ASTM D1388) and the drape meter of Cusick.
//!
//! A strip clamped level bends under its weight; Gamma = w L³ / B decides its shape. At Gamma = 8.0042 the chord to the tip hangs at
//! 41.5°, and the bending length is c = (B/w)^(1/3) = 0.49991 L (from the exact heavy elastica, which differs from Peirce's own
//! formula by 5.8 % in B).

mod drape;

pub use drape::{Drape, TABLE, cusick};

use crate::fabrics::{GRAVITY, Mechanics};
use crate::sheet::Sheet;
use crate::step::{Stepper, stable_step};

/// A direction of the cloth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Thread {
    /// Along the warp.
    Warp,
    /// Along the weft.
    Weft,
}

/// The tip of a strip of `length` m and `segments` segments clamped level at its root, at rest under its own weight: how far it
/// hangs down and how far it reaches, m.
#[must_use]
pub fn cantilever(mechanics: &Mechanics, thread: Thread, length: f64, segments: usize) -> [f64; 2] {
    let m = Mechanics {
        stretch_damping: 0.0,
        ..mechanics.clone()
    };
    let [warp, weft] = m.bending();
    let bending = if thread == Thread::Warp { warp } else { weft };
    // The clamp holds the first segment; the free length begins in its middle, where the slope is level.
    let h = length / (segments as f64 + 0.5);
    let (along, across) = (segments + 2, 3);
    let total = h * (segments + 1) as f64;
    let (nx, ny) = if thread == Thread::Warp {
        (across, along)
    } else {
        (along, across)
    };
    let (width, height) = if thread == Thread::Warp {
        (2.0 * h, total)
    } else {
        (total, 2.0 * h)
    };
    let mut sheet = Sheet::flat(nx, ny, width, height, m);
    for k in 0..sheet.len() {
        let (i, j) = (k % nx, k / nx);
        let (s, t) = if thread == Thread::Warp {
            (j, i)
        } else {
            (i, j)
        };
        sheet.set_position(k, [s as f64 * h, 0.0, t as f64 * h]);
        if s < 2 {
            sheet.pin(k);
        }
    }
    // Near critical damping of the first mode, whether bending or weight drives it.
    let omega = (3.516 * (bending / (mechanics.areal_density * length.powi(4))).sqrt())
        .max((GRAVITY / length).sqrt());
    let dt = stable_step(&sheet, GRAVITY).min(0.05 / omega);
    let mut stepper = Stepper::new(&sheet, dt, GRAVITY);
    stepper.settling = 1.6 * omega;
    let tip = if thread == Thread::Warp {
        (ny - 1) * nx + 1
    } else {
        nx + nx - 1
    };
    let mut last = [0.0; 3];
    for n in 0..40 {
        for _ in 0..(1.0 / (omega * dt)).ceil() as usize {
            stepper.step(&mut sheet);
        }
        let p = sheet.position(tip);
        let moved = (p[0] - last[0]).hypot(p[1] - last[1]);
        last = p;
        if n > 4 && moved < 2e-5 * length {
            break;
        }
    }
    [-last[1], last[0] - 0.5 * h]
}

/// The bending length in m that the cantilever test reports: overhang until the chord to the tip hangs at 41.5°.
#[must_use]
pub fn peirce(mechanics: &Mechanics, thread: Thread, segments: usize) -> f64 {
    let [warp, weft] = mechanics.bending();
    let bending = if thread == Thread::Warp { warp } else { weft };
    let guess = 2.0 * (bending / (mechanics.areal_density * GRAVITY)).cbrt();
    let angle = |length: f64| {
        let [down, out] = cantilever(mechanics, thread, length, segments);
        down.atan2(out).to_degrees()
    };
    // Secant in the logarithm of the length; the angle grows smoothly with it.
    let (mut a, mut b) = (0.93 * guess, 1.07 * guess);
    let (mut fa, mut fb) = (angle(a) - 41.5, angle(b) - 41.5);
    for _ in 0..4 {
        if (fb - fa).abs() < 1e-9 {
            break;
        }
        let c = (b - fb * (b - a) / (fb - fa)).clamp(0.2 * guess, 5.0 * guess);
        (a, fa) = (b, fb);
        b = c;
        fb = angle(b) - 41.5;
        if fb.abs() < 0.01 {
            break;
        }
    }
    0.49991 * b
}
