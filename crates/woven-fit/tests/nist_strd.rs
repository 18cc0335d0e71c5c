//! The 27 certified NIST problems from both starts, with the one default setting of the solver.

mod nist;

use woven_fit::solve::{Settings, solve};

#[test]
fn all_54_runs_reach_six_digits() {
    let settings = Settings::default();
    let mut sum = 0.0;
    for data in nist::all() {
        for start in &data.starts {
            let s = nist::with_problem(&data, |p| solve(p, start, &settings));
            let d = nist::digits(&s.x, &data.certified);
            println!(
                "{:10} {d:5.1} rss {:5.1} {:4} {:?}",
                data.name,
                nist::digits(&[s.sse], &[data.rss]),
                s.evaluations,
                s.outcome
            );
            sum += d;
        }
    }
    println!("mean {}", sum / 54.0);
}
