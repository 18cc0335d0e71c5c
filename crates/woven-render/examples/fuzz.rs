//! The long fuzz campaign of everything that reads files: `cargo run --release -p woven-render --example fuzz -- gltf 100000000`.
//!
//! Targets are `gltf` (the whole loader, container to triangles), `motion`, `exr`, `hdr`, `png`, `jpeg`, or `all`; the number is that of
//! executions of each. Every execution is a function of its number alone, so a panic is repeated by `-- TARGET 1 NUMBER`, with the number
//! that was printed. Panics that the loader's second net catches count as panics, and the peak of memory is printed.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

#[path = "process/mod.rs"]
mod process;
#[path = "../tests/small/mod.rs"]
mod small;

use small::corpus;

/// Set by the panic hook, so that a caught panic is seen too.
static PANICKED: AtomicBool = AtomicBool::new(false);

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
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        PANICKED.store(true, Ordering::Relaxed);
        usual(info);
    }));
    for target in chosen {
        run(target, first, count);
    }
}

fn run(target: &corpus::Target, first: u64, count: u64) {
    let (begun, mut told) = (Instant::now(), Instant::now());
    let (mut understood, mut done, mut bytes, mut slowest) = (0_u64, 0_u64, Vec::new(), (0.0, 0));
    while done < count {
        let k = first + done;
        let one = Instant::now();
        let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            target.execute(k, &mut bytes)
        }));
        let took = one.elapsed().as_secs_f64();
        if took > slowest.0 {
            slowest = (took, k);
        }
        if outcome.is_err() || PANICKED.load(Ordering::Relaxed) {
            eprintln!("{}: execution {k} panicked.", target.name);
            std::process::exit(1);
        }
        understood += u64::from(outcome.unwrap_or(false));
        done += 1;
        if done.is_multiple_of(1024) && told.elapsed().as_secs() >= 30 || done == count {
            told = Instant::now();
            let seconds = begun.elapsed().as_secs_f64();
            let rate = done as f64 / seconds;
            println!(
                "{}: {done} executions, {understood} understood, no panic, {seconds:.0} s, {rate:.0} a second, {:.0} s left, peak {} MiB, slowest {:.0} ms (number {})",
                target.name,
                (count - done) as f64 / rate,
                process::peak_memory(),
                slowest.0 * 1e3,
                slowest.1
            );
        }
    }
}
