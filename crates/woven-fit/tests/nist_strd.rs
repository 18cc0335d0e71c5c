//! The 27 certified NIST problems from both starts, with the one default setting of the solver.

mod nist;

use woven_fit::solve::{Outcome, Settings, solve};
use woven_fit::uncertainty::uncertainty;

#[test]
fn all_54_runs_give_the_certified_parameters_and_errors() {
    let settings = Settings::default();
    let (mut sum, mut errors, mut runs) = (0.0, 0, 0);
    for data in nist::all() {
        for (number, start) in data.starts.iter().enumerate() {
            let s = nist::with_problem(&data, |p| solve(p, start, &settings));
            let digits = nist::digits(&s.x, &data.certified);
            let names: Vec<String> = (1..=s.x.len()).map(|i| format!("b{i}")).collect();
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
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
            println!(
                "{:9} start {} parameters {digits:5.1} errors {error_digits:5.1} sse {:5.1} evaluations {:4}",
                data.name,
                number + 1,
                nist::digits(&[s.sse], &[data.rss]),
                s.evaluations
            );
            assert_eq!(
                s.outcome,
                Outcome::Converged,
                "{} start {}",
                data.name,
                number + 1
            );
            assert!(
                digits >= 6.0,
                "{} start {}: {digits} digits, {:?}",
                data.name,
                number + 1,
                s.x
            );
            // Lanczos1 has no noise: its standard errors are rounding.
            errors += usize::from(data.name != "Lanczos1" && error_digits >= 6.0);
            sum += digits;
            runs += 1;
        }
    }
    println!("mean {:.2} of {runs}", sum / f64::from(runs));
    assert_eq!(runs, 54);
    assert_eq!(
        errors, 52,
        "runs with six digits of the standard errors, Lanczos1 left out"
    );
    // Certified values have 11 digits; the best peer has a mean of 9.27. Seen here: 10.7.
    assert!(sum / f64::from(runs) >= 10.0);
}

#[test]
fn the_certified_values_are_minima_of_these_models() {
    // Guards the models' formulas: the certified parameters must give the certified sum of squares.
    for data in nist::all() {
        let (m, n) = (data.y.len(), data.certified.len());
        let sse = nist::with_problem(&data, |p| {
            let mut r = vec![0.0; m];
            assert_eq!(p.params(), n);
            assert!(p.evaluate(&data.certified, &mut r, None));
            r.iter().map(|r| r * r).sum::<f64>()
        });
        // Parameters are given to 11 digits; Lanczos1 is exact, so only its absolute size counts.
        assert!(
            (sse / data.rss - 1.0).abs() < 1e-6 || sse < 1e-20,
            "{}: {sse} {}",
            data.name,
            data.rss
        );
    }
}
