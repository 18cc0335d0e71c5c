//! Every reader under damaged input. `cargo run --release -p woven-bsdf --example fuzz` does ten million of each.

use crate::damage::{Bits, mutate, targets};

#[test]
fn damaged_files() {
    for target in targets() {
        let mut rng = Bits(81);
        let n = target.rounds;
        let taken = (0..n)
            .filter(|i| (target.check)(&mutate(&target.seeds[i % target.seeds.len()], &mut rng)))
            .count();
        println!(
            "{}: {n} damaged inputs, {taken} of them still read",
            target.name
        );
        // If nothing or everything were read, the changes would test nothing.
        assert!(taken > 0 && taken < n, "{}: {taken} of {n}", target.name);
    }
}
