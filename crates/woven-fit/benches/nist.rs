//! The 54 NIST runs with the solver's one default setting: digits and time, one thread.
//!
//! `cargo bench -p woven-fit --bench nist` prints the table; with `-- --csv` one line a run, for `peers.py`.

#[path = "../tests/nist/mod.rs"]
mod nist;

use std::hint::black_box;
use std::time::Instant;
use woven_fit::solve::{Settings, solve};

fn main() {
    let csv = std::env::args().any(|a| a == "--csv");
    if csv {
        println!("problem,start,digits,error_digits,rss_digits,evaluations,microseconds");
    } else {
        println!(
            "{:9} {:>5} {:>10} {:>7} {:>6} {:>11} {:>9}",
            "problem", "start", "parameters", "errors", "RSS", "evaluations", "µs"
        );
    }
    let (mut tally, mut total) = (nist::Tally::default(), 0.0);
    for data in &nist::all() {
        for (i, start) in data.starts.iter().enumerate() {
            let score = nist::run(data, i);
            tally.add(data, &score);
            // The least of seven: what the work costs, not what else the machine does.
            let time = (0..7).fold(f64::INFINITY, |least, _| {
                let clock = Instant::now();
                black_box(nist::with_problem(data, |p| {
                    solve(p, start, &Settings::default())
                }));
                least.min(clock.elapsed().as_secs_f64())
            });
            total += time;
            let (name, s, n, micros) = (data.name, i + 1, score.solution.evaluations, time * 1e6);
            let (digits, errors, rss) = (score.digits, score.error_digits, score.rss_digits);
            if csv {
                println!("{name},{s},{digits:.2},{errors:.2},{rss:.2},{n},{micros:.1}");
            } else {
                println!(
                    "{name:9} {s:>5} {digits:>10.1} {errors:>7.1} {rss:>6.1} {n:>11} {micros:>9.0}"
                );
            }
        }
    }
    if !csv {
        println!("\n{}, {:.1} ms together", tally.text(), total * 1e3);
    }
}
