//! Nanoseconds of every model's eval on the GPU (lavapipe is one), beside a mirrored GGX written by hand:
//! `cargo run --release -p woven-render --example optics_bench`.
//!
//! Each number is the least of fifteen rounds, in each of which every kernel runs once over 65,536 random inputs with 32
//! viewers each, so that other programs trouble all of them alike. `LP_NUM_THREADS=1` keeps lavapipe on one core.

use anyhow::{Result, ensure};
use woven_bsdf::model::{MODELS, ModelInfo, find};
use woven_bsdf::shader::parity::{self, CALLS, GROUP};
use woven_render::gpu::Kernel;

const INPUTS: usize = 65_536;

/// A kernel with its inputs and the least nanoseconds per call so far.
struct Subject {
    name: &'static str,
    kernel: Kernel,
    inputs: Vec<f32>,
    least: f64,
}

/// The timer of `model`, or of the lobe written by hand. Widths from 0.02: D of narrower lobes may overflow in a sum.
fn subject(name: &'static str, model: Option<&ModelInfo>) -> Result<Subject> {
    let of = model.unwrap_or_else(|| find("ggx-mirrored").expect("it is in the list"));
    Ok(Subject {
        name,
        kernel: Kernel::new(&parity::timer(model))?,
        inputs: parity::inputs(of, 0.02, 0, INPUTS),
        least: f64::INFINITY,
    })
}

fn main() -> Result<()> {
    let mut subjects = vec![subject("by hand", None)?];
    for model in MODELS {
        subjects.push(subject(model.name, Some(model))?);
    }
    println!("{}, ns a call", subjects[0].kernel.adapter());
    for _ in 0..15 {
        for s in &mut subjects {
            let groups = INPUTS.div_ceil(GROUP) as u32;
            let (sums, took) = s.kernel.run(&s.inputs, INPUTS, groups)?;
            ensure!(
                sums.iter().all(|x| x.is_finite()) && sums.iter().any(|x| *x > 0.0),
                "{}: the kernel gave no values",
                s.name
            );
            s.least = s
                .least
                .min(took.as_secs_f64() * 1e9 / (INPUTS * CALLS) as f64);
        }
    }
    let hand = subjects[0].least;
    for s in &subjects {
        println!(
            "{:<18} {:>7.1}  {:>5.2} of by hand",
            s.name,
            s.least,
            s.least / hand
        );
    }
    Ok(())
}
