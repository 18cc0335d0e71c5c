//! Damaged descriptions by the million: every text is read or answered with a sentence, none panics.
//!
//! `cargo run --release -p woven-cloth --example fuzz_toml -- 10000000` prints the count of texts read, refused, and the rate.

use std::time::Instant;
use woven_cloth::CurtainSpec;

/// SplitMix64 (Steele, Lea, Flood 2014).
fn next(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

const SEEDS: &[&str] = &[
    "width = 1.4\nheight = 2.2\npleats = 12\nfullness = 2.0\n",
    "columns = 121\nrows = 81\nfabric = \"voile\"\nheading = \"rings\"\n",
    "[mechanics]\nareal_density = 0.06\nbending_length_warp_mm = 17.4\n",
    "[wind]\nspeed = 1.5\ndirection = [0.0, 0.0, 1.0]\nsamples = [[0.0, 1.0], [1.0, 2.0]]\n",
    "[wind.opening]\nx = [-0.5, 0.5]\ny = [0.9, 2.0]\nz = -0.1\n",
    "[obstacles]\nfloor = 0.0\nwall = -0.1\nsill = [0.9, 0.05]\n",
    "window = [-0.5, 0.5, 0.9, 2.0]\ndraw_to = \"left\"\n[[draw]]\ntime = 0.0\nshare = 1.0\n[[draw]]\ntime = 2.0\nshare = 0.2\n",
];
const WORDS: &[&str] = &[
    "nan",
    "inf",
    "-inf",
    "0",
    "-1",
    "1e308",
    "1e-308",
    "9223372036854775807",
    "true",
    "\"\"",
    "[]",
    "{}",
    "[[draw]]\n",
    "=",
];

fn main() {
    let count: u64 = std::env::args()
        .nth(1)
        .and_then(|a| a.parse().ok())
        .unwrap_or(100_000);
    let (start, mut state) = (Instant::now(), 7u64);
    let (mut read, mut refused) = (0u64, 0u64);
    for n in 0..count {
        let mut text = SEEDS[next(&mut state) as usize % SEEDS.len()]
            .as_bytes()
            .to_vec();
        for _ in 0..=next(&mut state) % 4 {
            let at = next(&mut state) as usize % text.len().max(1);
            let to = (at + next(&mut state) as usize % 12).min(text.len());
            match next(&mut state) % 5 {
                0 => text[at] ^= 1 << (next(&mut state) % 8),
                1 => drop(text.drain(at..to)),
                2 => {
                    let word = WORDS[next(&mut state) as usize % WORDS.len()];
                    drop(text.splice(at..to, word.bytes()));
                }
                3 => {
                    let part = text[at..to].to_vec();
                    drop(text.splice(at..at, part));
                }
                _ => text.insert(at, next(&mut state) as u8),
            }
            if text.is_empty() {
                text.push(b'#');
            }
        }
        match String::from_utf8_lossy(&text).parse::<CurtainSpec>() {
            Ok(_) => read += 1,
            Err(e) => {
                assert!(e.to_string().len() > 10, "no sentence: {e}");
                refused += 1;
            }
        }
        if n % 1_000_000 == 999_999 {
            eprintln!(
                "{} executions, {:.0} s",
                n + 1,
                start.elapsed().as_secs_f64()
            );
        }
    }
    println!(
        "{count} executions: {read} read, {refused} refused with a sentence, no panic; {:.0} a second",
        count as f64 / start.elapsed().as_secs_f64()
    );
}
