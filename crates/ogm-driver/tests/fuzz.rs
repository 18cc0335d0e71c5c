//! Mutated bytes into every parser: none panics, and what is read is written back the same. `OGM_FUZZ` sets the executions of the line parsers
//! (the suite: 100 000); the others get a share. The long campaign is `examples/fuzz.rs`.

#[path = "common/corpus.rs"]
mod corpus;

#[test]
fn no_parser_panics_and_each_understands_some() {
    let n: u64 = std::env::var("OGM_FUZZ")
        .ok()
        .and_then(|s| s.parse().ok())
        .unwrap_or(100_000);
    let mut bytes = Vec::new();
    for target in corpus::targets() {
        let n = match target.name {
            "plan" | "rig" | "record" => n / 10,
            _ => n,
        };
        let understood: u64 = (0..n)
            .map(|k| u64::from(target.execute(k, &mut bytes)))
            .sum();
        println!("{}: {n} executions, {understood} understood", target.name);
        assert!(
            understood > n / 100,
            "{} understands too little",
            target.name
        );
        assert!(understood < n, "{} takes everything", target.name);
    }
}
