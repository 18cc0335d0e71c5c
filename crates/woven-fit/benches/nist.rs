//! The 54 NIST runs with the solver's one default setting: digits and time, one thread.
//!
//! `cargo bench -p woven-fit --bench nist` prints the table; with `-- --csv` one line a run, for `peers.py`.

#[path = "../tests/nist/mod.rs"]
mod nist;

use std::time::Instant;
use woven_fit::solve::{Settings, solve};
use woven_fit::uncertainty::uncertainty;

fn main() {
    let csv = std::env::args().any(|a| a == "--csv");
    let settings = Settings::default();
    let all = nist::all();
    if csv {
        println!("problem,start,digits,error_digits,rss_digits,evaluations,microseconds");
    } else {
        println!(
            "{:9} {:>5} {:>10} {:>7} {:>6} {:>11} {:>9}",
            "problem", "start", "parameters", "errors", "RSS", "evaluations", "µs"
        );
    }
    let (mut sum, mut solved, mut six, mut errors, mut total) = (0.0, 0, 0, 0, 0.0);
    for data in &all {
        for (i, start) in data.starts.iter().enumerate() {
            // The least of seven: what the work costs, not what else the machine does.
            let mut time = f64::INFINITY;
            let mut solution = None;
            for _ in 0..7 {
                let clock = Instant::now();
                let s = nist::with_problem(data, |p| solve(p, start, &settings));
                time = time.min(clock.elapsed().as_secs_f64());
                solution = Some(s);
            }
            let s = solution.expect("seven rounds");
            let digits = nist::digits(&s.x, &data.certified);
            let names = vec!["b"; s.x.len()];
            let u = uncertainty(
                &s.jacobian,
                data.y.len(),
                &names,
                &s.x,
                &s.at_bound,
                s.sse,
                true,
            );
            let found: Vec<f64> = u
                .standard_error
                .iter()
                .map(|e| e.unwrap_or(f64::NAN))
                .collect();
            let error_digits = nist::digits(&found, &data.deviations);
            let rss = nist::digits(&[s.sse], &[data.rss]);
            let micros = time * 1e6;
            if csv {
                println!(
                    "{},{},{digits:.2},{error_digits:.2},{rss:.2},{},{micros:.1}",
                    data.name,
                    i + 1,
                    s.evaluations
                );
            } else {
                println!(
                    "{:9} {:>5} {digits:>10.1} {error_digits:>7.1} {rss:>6.1} {:>11} {micros:>9.0}",
                    data.name,
                    i + 1,
                    s.evaluations
                );
            }
            sum += digits;
            solved += i32::from(digits >= 4.0);
            six += i32::from(digits >= 6.0);
            errors += i32::from(error_digits >= 6.0 && data.name != "Lanczos1");
            total += time;
        }
    }
    if !csv {
        println!(
            "\n54 runs: {solved} solved, {six} with 6 digits or more, mean {:.2} digits, standard errors with 6 digits or more {errors} of 52 (without Lanczos1), {:.1} ms together",
            sum / 54.0,
            total * 1e3
        );
    }
}
