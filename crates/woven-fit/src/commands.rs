//! The commands of `woven-fit`: fit, eval, models, info, convert.

use anyhow::{Context, Result, anyhow, bail};
use clap::{Parser, Subcommand};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use woven_bsdf::model::{self, MODELS, Role};
use woven_bsdf::vec3::Vec3;
use woven_fit::convert::{convert, write_atomically};
use woven_fit::fit::{FitResult, Options, fit_measurement, models_named};
use woven_fit::info::info;
use woven_fit::measurement::Measurement;
use woven_fit::problem::Metric;
use woven_fit::robust::Loss;
use woven_fit::{report, text};

/// Fits models of woven cloth to goniometer measurements.
#[derive(Debug, Parser)]
#[command(
    name = "woven-fit",
    version,
    after_help = "Example: woven-fit fit assets/measurements/klems_aniso_high.xml --out fit/"
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Fit models to measurements; print the ranking, write fit.json, a fabric and a report.
    #[command(
        after_help = "Example: woven-fit fit lace.xml --model sheet,ggx-mirrored,hgf --out fit/"
    )]
    Fit(FitArgs),
    /// Evaluate a model at directions: columns lx,ly,lz,vx,vy,vz in; the same plus f,pdf out.
    #[command(
        after_help = "Example: woven-fit eval --model ggx-mirrored --param k_d=0.1,k_t=0.3,alpha_x=0.1,alpha_y=0.2 dirs.csv"
    )]
    Eval {
        /// The model's name; see `woven-fit models`.
        #[arg(long)]
        model: String,
        /// Parameters that differ from their start values.
        #[arg(long, value_delimiter = ',', value_name = "KEY=VALUE")]
        param: Vec<String>,
        /// Directions with a header line; each a unit vector away from the sheet (normalised if not).
        dirs: PathBuf,
    },
    /// List every model with its parameters, bounds, units and equation.
    #[command(after_help = "Example: woven-fit models --json")]
    Models {
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// What a measurement says by itself: transmittance per incidence, openness, peak, skirt and floor.
    #[command(after_help = "Example: woven-fit info assets/measurements/klems_aniso_high.xml")]
    Info {
        /// The measurement.
        data: PathBuf,
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// Convert a measurement between formats, by the files' endings.
    #[command(after_help = "Example: woven-fit convert shade.xml shade.csv")]
    Convert {
        /// What to read.
        input: PathBuf,
        /// What to write.
        output: PathBuf,
    },
}

#[derive(Debug, clap::Args)]
struct FitArgs {
    /// Measurements: Klems XML (.xml) or scattered points (.csv).
    #[arg(required = true)]
    data: Vec<PathBuf>,
    /// Models to fit, or all.
    #[arg(long, value_delimiter = ',', default_value = "all")]
    model: Vec<String>,
    /// In which measure misfits are squared.
    #[arg(long, value_enum, default_value = "linear")]
    metric: Metric,
    /// Which incidences: all, or the normal one only as in the paper.
    #[arg(long, value_enum, default_value = "all")]
    plane: Plane,
    /// How outliers count.
    #[arg(long, value_enum, default_value = "squares")]
    loss: Loss,
    /// Weight each value with the cosine of its outgoing angle.
    #[arg(long)]
    cos_weight: bool,
    /// Cross-validate over incidences also for matrices of thousands of values (takes five times as long).
    #[arg(long)]
    cv: bool,
    /// Starts per model.
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u16).range(1..=4096))]
    starts: u16,
    /// Folder for fit.json, the fabric and the report; without it nothing is written.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Seed of the starts and of the bootstrap.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Plane {
    All,
    Normal,
}

/// Runs a command.
pub(crate) fn run(cli: Cli) -> Result<()> {
    match cli.command {
        Command::Fit(args) => fit(&args),
        Command::Eval { model, param, dirs } => eval(&model, &param, &dirs),
        Command::Models { json } => models(json),
        Command::Info { data, json } => {
            let info = info(&Measurement::read(&data)?);
            let text = if json {
                serde_json::to_string_pretty(&info)? + "\n"
            } else {
                info.to_text()
            };
            Ok(std::io::stdout().lock().write_all(text.as_bytes())?)
        }
        Command::Convert { input, output } => convert(&input, &output),
    }
}

static STOP: AtomicBool = AtomicBool::new(false);

/// The command as typed, without folders of this machine, for the heads of result files.
fn command_line() -> String {
    let mut words = vec!["woven-fit".to_owned()];
    words.extend(std::env::args().skip(1).map(|a| {
        let path = Path::new(&a);
        match path.file_name() {
            Some(name) if path.is_absolute() => name.to_string_lossy().into_owned(),
            _ => a,
        }
    }));
    words.join(" ")
}

fn fit(args: &FitArgs) -> Result<()> {
    let options = Options {
        models: (args.model != ["all"]).then(|| args.model.clone()),
        metric: args.metric,
        normal_only: args.plane == Plane::Normal,
        seed: args.seed,
        starts: usize::from(args.starts),
        loss: args.loss,
        cosine_weights: args.cos_weight,
        cross_validate: args.cv,
    };
    models_named(options.models.as_deref())?;
    if let Some(out) = &args.out {
        prepare_folder(out)?;
    }
    // A second Ctrl-C ends the program at once.
    let _ = ctrlc::set_handler(|| {
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
    let bar = if std::io::stderr().is_terminal() {
        ProgressBar::new(1)
    } else {
        ProgressBar::hidden()
    };
    bar.set_style(
        ProgressStyle::with_template("{msg:28} {bar:24} {pos}/{len} models, {per_sec}, {eta} left")
            .expect("a fixed template"),
    );
    for path in &args.data {
        bar.reset();
        let progress = |done: usize, total: usize, what: &str| {
            bar.set_length(total as u64);
            bar.set_position(done as u64);
            bar.set_message(what.to_owned());
            !STOP.load(Ordering::Relaxed)
        };
        let result = fit_measurement(path, &options, &progress)?;
        bar.finish_and_clear();
        std::io::stdout()
            .lock()
            .write_all(text::whole(&result).as_bytes())?;
        if let Some(out) = &args.out {
            write_results(out, path, &result, args.data.len() > 1)?;
        }
    }
    Ok(())
}

/// Makes the folder and proves that it can be written, before minutes of work.
fn prepare_folder(out: &Path) -> Result<()> {
    std::fs::create_dir_all(out)
        .with_context(|| format!("cannot make the folder {}", out.display()))?;
    tempfile::NamedTempFile::new_in(out)
        .map(drop)
        .with_context(|| {
            format!(
                "cannot write into the folder {}; choose another with --out",
                out.display()
            )
        })
}

fn write_results(out: &Path, data: &Path, result: &FitResult, many: bool) -> Result<()> {
    let stem = data
        .file_stem()
        .map_or("measurement".into(), |s| s.to_string_lossy());
    let name = |end: &str| {
        if many {
            format!("{stem}.{end}")
        } else {
            end.to_owned()
        }
    };
    let command = command_line();
    let mut json = serde_json::to_value(result)?;
    if let Some(map) = json.as_object_mut() {
        map.insert("command".into(), command.clone().into());
    }
    let mut written = vec![name("fit.json")];
    if !many {
        written[0] = "fit.json".to_owned();
    }
    write_atomically(
        &out.join(&written[0]),
        (serde_json::to_string_pretty(&json)? + "\n").as_bytes(),
    )?;
    if let Some(fabric) = result.fabric(&command) {
        let file = format!("{stem}.toml");
        let head = format!("# {command}\n");
        write_atomically(&out.join(&file), (head + &fabric.to_toml()).as_bytes())?;
        written.push(file);
    }
    let report_name = name("report.html");
    write_atomically(
        &out.join(&report_name),
        report::html(result, &command).as_bytes(),
    )?;
    written.push(report_name);
    println!("written to {}: {}", out.display(), written.join(", "));
    Ok(())
}

/// A direction away from the sheet as typed; scaled to length 1.
fn unit(x: f64, y: f64, z: f64) -> Option<Vec3<f64>> {
    let length = (x * x + y * y + z * z).sqrt();
    (length.is_finite() && length > 1e-9).then(|| Vec3::new(x / length, y / length, z / length))
}

fn eval(name: &str, params: &[String], dirs: &Path) -> Result<()> {
    let model = models_named(Some(&[name.to_owned()]))?[0];
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
                    "{name} has no parameter {key:?}; it has {}",
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
    let (linear, shape) = model.split(&values);
    let weights = model::normalized(&linear);
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_path(dirs)
        .with_context(|| format!("cannot read {}", dirs.display()))?;
    let header = reader
        .headers()
        .with_context(|| format!("cannot read {}", dirs.display()))?
        .clone();
    let columns: Vec<usize> = ["lx", "ly", "lz", "vx", "vy", "vz"]
        .iter()
        .map(|c| {
            header.iter().position(|h| h == *c).ok_or_else(|| {
                anyhow!(
                    "{}: there is no column {c}; the header must name lx,ly,lz,vx,vy,vz",
                    dirs.display()
                )
            })
        })
        .collect::<Result<_>>()?;
    let mut out = std::io::BufWriter::new(std::io::stdout().lock());
    writeln!(out, "{},f,pdf", header.iter().collect::<Vec<_>>().join(","))?;
    for record in reader.records() {
        let record = record.with_context(|| format!("cannot read {}", dirs.display()))?;
        let line = record.position().map_or(0, csv::Position::line);
        let mut c = [0.0; 6];
        for (c, &column) in c.iter_mut().zip(&columns) {
            let word = &record[column];
            *c = word
                .parse()
                .map_err(|_| anyhow!("{} line {line}: {word:?} is not a number", dirs.display()))?;
        }
        let (Some(l), Some(v)) = (unit(c[0], c[1], c[2]), unit(c[3], c[4], c[5])) else {
            bail!("{} line {line}: a direction has no length", dirs.display());
        };
        let f = model::dot(&linear, &(model.f64.basis)(&shape, l, v));
        // The density with which the model's sampler, standing at v, chooses l.
        let pdf = (model.f64.pdf)(&shape, &weights, v, l);
        writeln!(
            out,
            "{},{f},{pdf}",
            record.iter().collect::<Vec<_>>().join(",")
        )?;
    }
    Ok(out.flush()?)
}

fn models(json: bool) -> Result<()> {
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
