//! A coarse curtain in gusts for a long time: no number that is none, no drift, energy bounded.
//!
//! `cargo run --release -p woven-cloth --example endure -- 24` runs so many hours of simulated time and prints a line an hour.

use std::time::Instant;
use woven_cloth::{CurtainSpec, Simulation};

fn main() {
    let hours: f64 = std::env::args()
        .nth(1)
        .and_then(|a| a.parse().ok())
        .unwrap_or(1.0);
    let text = "width = 0.6\nheight = 1.2\npleats = 2\ncolumns = 13\nrows = 11\nfabric = \"voile\"\nsettle = 3.0\n[wind]\nspeed = 1.5\ngust = 0.4\n[obstacles]\nwall = -0.15\nfriction = 0.3";
    let spec: CurtainSpec = text.parse().expect("the description is valid");
    let mut sim = Simulation::new(&spec).expect("the description is valid");
    let rest = sim.settle(3.0).expect("stays whole");
    let start = Instant::now();
    let (mut most, mut strain, mut next) = (0.0f64, 0.0f64, 1.0);
    let (mut kinetic, mut samples) = (0.0, 0.0);
    while sim.time() < hours * 3600.0 {
        sim.run(1.0).expect("stays whole");
        let r = sim.report();
        let energy = r.energy.total() - rest.energy.total();
        assert!(energy.is_finite());
        most = most.max(energy);
        strain = strain.max(r.max_strain);
        kinetic += r.energy.kinetic;
        samples += 1.0;
        if sim.time() >= next * 3600.0 {
            println!(
                "hour {next}: energy above rest at most {most:.4} J, mean kinetic {:.5} J, largest strain {:.2} %, {:.0} times real time",
                kinetic / samples,
                strain * 100.0,
                sim.time() / start.elapsed().as_secs_f64()
            );
            (most, strain, kinetic, samples) = (0.0, 0.0, 0.0, 0.0);
            next += 1.0;
        }
    }
}
