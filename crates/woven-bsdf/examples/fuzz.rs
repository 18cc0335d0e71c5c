//! Ten million damaged files for every reader: `cargo run --release -p woven-bsdf --example fuzz -- [ROUNDS [READER]]`.
//!
//! One thread, seeded: the same inputs on every machine. Ends with the executions, how many were still read, the time
//! and the greatest memory of the process; a panic ends it at once with the input written beside it.

#[path = "../tests/proofs/damage.rs"]
#[allow(dead_code, reason = "the tests use the rest")]
mod damage;
#[path = "../tests/proofs/made.rs"]
#[allow(dead_code, reason = "the tests use the rest")]
mod made;

use damage::{Bits, mutate, targets};
use std::time::Instant;

/// The greatest resident memory so far in MiB, where the system tells it.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? / 1024)
}

fn main() {
    let mut arguments = std::env::args().skip(1);
    let rounds = arguments.next().map_or(Ok(10_000_000), |n| n.parse());
    let Ok(rounds) = rounds else {
        eprintln!("the first argument is the number of executions, a whole number");
        std::process::exit(2);
    };
    let only = arguments.next();
    for target in targets() {
        if only.as_ref().is_some_and(|o| o != target.name) {
            continue;
        }
        let (start, mut rng, mut taken) = (Instant::now(), Bits(1), 0usize);
        for i in 0..rounds {
            let input = mutate(&target.seeds[i % target.seeds.len()], &mut rng);
            let read = std::panic::catch_unwind(|| (target.check)(&input));
            match read {
                Ok(read) => taken += usize::from(read),
                Err(_) => {
                    let path = format!("fuzz-{}-{i}.tmp", target.name.replace(' ', "-"));
                    match std::fs::write(&path, &input) {
                        Ok(()) => eprintln!(
                            "{}: execution {i} panicked; its input is {path}",
                            target.name
                        ),
                        Err(e) => {
                            eprintln!("{}: execution {i} panicked, and {path}: {e}", target.name)
                        }
                    }
                    std::process::exit(1);
                }
            }
        }
        let seconds = start.elapsed().as_secs_f64();
        let memory = peak_memory().map_or("unknown".into(), |m| format!("{m} MiB"));
        println!(
            "{:<12} {rounds} executions, {taken} still read, no panic, {seconds:.0} s, greatest memory {memory}",
            target.name
        );
    }
}
