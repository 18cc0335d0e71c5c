//! `woven-fit eval` and `woven-fit models`.

use anyhow::{Context, Result, anyhow, bail};
use std::io::Write;
use std::path::PathBuf;
use woven_bsdf::model::{self, MODELS, ModelInfo, Role};
use woven_fit::directions::Directions;
use woven_fit::fit::models_named;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The model's name; see `woven-fit models`.
    #[arg(long)]
    model: String,
    /// Parameters that differ from their start values.
    #[arg(long, value_delimiter = ',', value_name = "KEY=VALUE")]
    param: Vec<String>,
    /// Directions with a header line; each a unit vector away from the sheet (normalised if not).
    dirs: PathBuf,
}

/// A model's values: the start values but for those given as `key=value`.
pub(super) fn values_of(model: &ModelInfo, params: &[String]) -> Result<Vec<f64>> {
    let mut values = model.start();
    for pair in params {
        let (key, value) = pair
            .split_once('=')
            .ok_or_else(|| anyhow!("{pair:?} is not of the form key=value"))?;
        let index = model
            .params
            .iter()
            .position(|p| p.name == key.trim())
            .ok_or_else(|| {
                let known: Vec<&str> = model.params.iter().map(|p| p.name).collect();
                anyhow!(
                    "{} has no parameter {key:?}; it has {}",
                    model.name,
                    known.join(", ")
                )
            })?;
        let p = &model.params[index];
        let value: f64 = value
            .trim()
            .parse()
            .map_err(|_| anyhow!("{key} = {value:?} is not a number"))?;
        // Linear factors may exceed their usual range (relative scans); shapes may not.
        let max = if p.role == Role::Linear {
            f64::MAX
        } else {
            p.max
        };
        if !(p.min..=max).contains(&value) {
            bail!("{key} = {value} lies outside {}…{}", p.min, p.max);
        }
        values[index] = value;
    }
    Ok(values)
}

pub(super) fn run(args: &Args) -> Result<()> {
    let model = models_named(Some(std::slice::from_ref(&args.model)))?[0];
    let (linear, shape) = model.split(&values_of(model, &args.param)?);
    let weights = model::normalized(&linear);
    let text = std::fs::read_to_string(&args.dirs)
        .with_context(|| format!("cannot read {}", args.dirs.display()))?;
    let list =
        Directions::parse(&text).with_context(|| format!("cannot use {}", args.dirs.display()))?;
    let mut out = std::io::BufWriter::new(std::io::stdout().lock());
    writeln!(out, "{},f,pdf", list.header)?;
    for (row, l, v) in list.rows {
        let f = model::dot(&linear, &(model.f64.basis)(&shape, l, v));
        // The density with which the model's sampler, standing at v, chooses l.
        let pdf = (model.f64.pdf)(&shape, &weights, v, l);
        writeln!(out, "{row},{f},{pdf}")?;
    }
    Ok(out.flush()?)
}

pub(super) fn models(json: bool) -> Result<()> {
    let mut out = std::io::stdout().lock();
    if json {
        let list: Vec<serde_json::Value> = MODELS
            .iter()
            .map(|m| {
                let params: Vec<serde_json::Value> = m
                    .params
                    .iter()
                    .map(|p| {
                        serde_json::json!({
                            "name": p.name, "meaning": p.meaning, "unit": p.unit, "min": p.min, "max": p.max,
                            "start": p.start, "linear": p.role == Role::Linear, "log": p.log
                        })
                    })
                    .collect();
                serde_json::json!({ "name": m.name, "equation": m.equation, "doc": m.doc, "reciprocal": m.reciprocal, "params": params })
            })
            .collect();
        writeln!(out, "{}", serde_json::to_string_pretty(&list)?)?;
        return Ok(());
    }
    for m in MODELS {
        writeln!(out, "{}\n  f = {}\n  {}", m.name, m.equation, m.doc)?;
        for p in m.params {
            let role = if p.role == Role::Linear {
                "factor"
            } else {
                "shape"
            };
            let unit = if p.unit.is_empty() {
                String::new()
            } else {
                format!(" {}", p.unit)
            };
            writeln!(
                out,
                "    {:<11} {role:<6} {}…{}{unit}, start {}: {}",
                p.name, p.min, p.max, p.start, p.meaning
            )?;
        }
        writeln!(out)?;
    }
    Ok(())
}
