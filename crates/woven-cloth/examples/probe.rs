//! Runs a curtain's description and prints where its threads are stretched most: `probe CURTAIN.toml [frames]`.

use woven_cloth::{CurtainSpec, Simulation, crossings};

fn main() -> Result<(), woven_cloth::Error> {
    let mut args = std::env::args().skip(1);
    let spec = CurtainSpec::read(std::path::Path::new(&args.next().unwrap_or_default()))?;
    let frames = args
        .next()
        .and_then(|a| a.parse().ok())
        .unwrap_or(spec.frames);
    let mut sim = Simulation::new(&spec)?;
    let rest = sim.settle(spec.settle)?;
    println!(
        "rest: largest strain {:.3} %, rail/weight {:.5}, kinetic {:.2e} J",
        rest.max_strain * 100.0,
        rest.support_force[1] / rest.weight,
        rest.energy.kinetic
    );
    let mut worst = 0.0;
    for f in 0..frames {
        sim.step_frame()?;
        let r = sim.report();
        let mut at = (false, 0.0f64, 0, 0);
        sim.sheet().for_each_strain(|w, s, i, j| {
            if s.abs() > at.1.abs() {
                at = (w, s, i, j);
            }
        });
        let through = if f % 12 == 0 {
            crossings(&sim.frame().positions, &sim.mesh())
        } else {
            0
        };
        if through > 0 || r.max_strain > worst || f % 24 == 0 {
            worst = r.max_strain.max(worst);
            let thread = if at.0 { "warp" } else { "weft" };
            println!(
                "frame {f}: {:+.2} % of {thread} at column {} row {}, fastest {:.2} m/s, kinetic {:.4} J, {through} crossings",
                at.1 * 100.0,
                at.2,
                at.3,
                r.max_speed,
                r.energy.kinetic
            );
        }
    }
    println!("largest strain {:.2} %", worst * 100.0);
    Ok(())
}
