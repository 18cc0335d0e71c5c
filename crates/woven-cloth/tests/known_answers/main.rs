//! Known answers that nobody on this project wrote: each case of the validation suite with its figure in one table.
//!
//! `cargo test -p woven-cloth --test known_answers -- --nocapture`. The tolerances are those the suite asks for.

mod air;
mod bend;
mod cloth;
mod folds;
mod hang;
mod swing;

use cloth::cloth;
use woven_cloth::*;

/// One line of the table.
struct Row {
    id: &'static str,
    what: String,
    want: f64,
    got: f64,
    /// Allowed relative difference; absolute where `want` is 0.
    tolerance: f64,
}

impl Row {
    fn new(id: &'static str, what: impl Into<String>, want: f64, got: f64, tolerance: f64) -> Self {
        Self {
            id,
            what: what.into(),
            want,
            got,
            tolerance,
        }
    }

    fn error(&self) -> f64 {
        if self.want == 0.0 {
            self.got.abs()
        } else {
            (self.got / self.want - 1.0).abs()
        }
    }

    fn holds(&self) -> bool {
        self.error() <= self.tolerance
    }
}

fn step_of(sheet: &Sheet) -> f64 {
    stable_step(sheet, GRAVITY).min(1.0 / 1200.0)
}

fn run(stepper: &mut Stepper, sheet: &mut Sheet, seconds: f64) {
    for _ in 0..(seconds / stepper.dt()).round() as usize {
        stepper.step(sheet);
    }
}

#[test]
fn known_answers() {
    // The longest first.
    let cases: [fn() -> Vec<Row>; 14] = [
        folds::contact,
        bend::drape,
        hang::hang,
        bend::cantilevers,
        air::planes,
        hang::free_fall,
        hang::impulse,
        hang::catenary,
        swing::swings,
        swing::pendulum,
        swing::axial,
        air::wind_statistics,
        folds::pleats,
        bend::buckling,
    ];
    // Two workers take cases in turn.
    let next = std::sync::atomic::AtomicUsize::new(0);
    let done = std::sync::Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                loop {
                    let k = next.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
                    let Some(case) = cases.get(k) else { break };
                    let start = std::time::Instant::now();
                    let rows = case();
                    done.lock()
                        .unwrap()
                        .push((k, rows, start.elapsed().as_secs_f64()));
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap();
    done.sort_by_key(|d| d.0);
    assert_eq!(done.len(), cases.len());
    println!(
        "{:<4} {:<78} {:>12} {:>12} {:>10} {:>10}",
        "id", "case", "expected", "found", "error", "allowed"
    );
    let mut failed = Vec::new();
    for (_, rows, seconds) in &done {
        for r in rows {
            let mark = if r.holds() { "" } else { "  <-- outside" };
            println!(
                "{:<4} {:<78} {:>12.6} {:>12.6} {:>10.2e} {:>10.1e}{mark}",
                r.id,
                r.what,
                r.want,
                r.got,
                r.error(),
                r.tolerance
            );
            if !r.holds() {
                failed.push(format!("{} {}", r.id, r.what));
            }
        }
        println!("     ({seconds:.1} s)");
    }
    assert!(failed.is_empty(), "outside their tolerance: {failed:?}");
}
