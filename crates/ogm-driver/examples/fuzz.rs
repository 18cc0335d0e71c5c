//! The long fuzz campaign: `cargo run --release -p ogm-driver --example fuzz -- shot 100000000`.
//!
//! Targets are `shot`, `grbl`, `head`, `log`, `record`, `plan`, `rig`, or `all`; the number is that of executions of each. Every execution is a
//! function of its number alone, so a panic is repeated by `-- TARGET 1 NUMBER`, with the number that was printed.

use std::time::Instant;

#[path = "../tests/common/corpus.rs"]
mod corpus;

/// Executions between two looks at the clock.
const BATCH: u64 = 10_000;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let number = |at: usize, usual: u64| match words.get(at) {
        None => Some(usual),
        Some(word) => word.parse().ok(),
    };
    let targets = corpus::targets();
    let name = words.first().map_or("", String::as_str);
    let chosen: Vec<_> = targets
        .iter()
        .filter(|t| name == "all" || t.name == name)
        .collect();
    let (Some(count), Some(first), false) = (number(1, 1_000_000), number(2, 0), chosen.is_empty())
    else {
        eprintln!("Usage: fuzz TARGET [EXECUTIONS] [FIRST]; see the head of the file.");
        std::process::exit(2);
    };
    for target in chosen {
        run(target, first, count);
    }
}

fn run(target: &corpus::Target, first: u64, count: u64) {
    let (begun, mut told) = (Instant::now(), Instant::now());
    let (mut understood, mut done, mut bytes) = (0_u64, 0_u64, Vec::new());
    while done < count {
        let batch = BATCH.min(count - done);
        let from = first + done;
        let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            let mut sum = 0;
            for k in from..from + batch {
                sum += u64::from(target.execute(k, &mut bytes));
            }
            sum
        }));
        match outcome {
            Ok(sum) => understood += sum,
            Err(_) => {
                let panics = |k: &u64| {
                    std::panic::catch_unwind(|| target.execute(*k, &mut Vec::new())).is_err()
                };
                let k = (from..from + batch).find(panics);
                eprintln!("{}: execution {k:?} panicked.", target.name);
                std::process::exit(1);
            }
        }
        done += batch;
        if told.elapsed().as_secs() >= 30 || done == count {
            told = Instant::now();
            let seconds = begun.elapsed().as_secs_f64();
            let rate = done as f64 / seconds;
            println!(
                "{}: {done} executions, {understood} understood, no panic, {seconds:.0} s, {rate:.0} a second, {:.0} s left",
                target.name,
                (count - done) as f64 / rate
            );
        }
    }
}
