//! `woven-fit fit`: ranked models of each file, as text, JSON, fabric, report and plots.

use super::{command_line, prepare_folder, print, progress_bar, stop_at_ctrl_c, stopped};
use anyhow::Result;
use std::path::{Path, PathBuf};
use woven_fit::convert::write_atomically;
use woven_fit::fit::{FitResult, Options, Profiles, fit_measurement, models_named};
use woven_fit::problem::Metric;
use woven_fit::robust::Loss;
use woven_fit::{figures, pixels, report, text};

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Measurements: Klems matrix or tensor tree (.xml), scattered points (.csv) or PAB text (.pab, .txt, .dat).
    #[arg(required = true)]
    data: Vec<PathBuf>,
    #[command(flatten)]
    how: How,
    /// Where to look whether the covariance misleads: auto leaves out matrices of thousands of values, which take minutes.
    #[arg(long, value_enum, default_value = "auto")]
    profiles: Profiles,
    /// Folder for fit.json, the fabric and the report; without it nothing is written.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Also write every figure of the report as SVG and as PNG of 300 dots per inch, for a paper.
    #[arg(long, requires = "out")]
    plots: bool,
}

/// What `fit` and `rank` share.
#[derive(Debug, clap::Args)]
pub(super) struct How {
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
    /// Seed of the starts and of the bootstrap.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Plane {
    All,
    Normal,
}

impl How {
    /// The options, with known models and without error bars by profile.
    pub(super) fn options(&self) -> Result<Options> {
        let options = Options {
            models: (self.model != ["all"]).then(|| self.model.clone()),
            metric: self.metric,
            normal_only: self.plane == Plane::Normal,
            seed: self.seed,
            starts: usize::from(self.starts),
            loss: self.loss,
            cosine_weights: self.cos_weight,
            cross_validate: self.cv,
            profiles: Profiles::Never,
        };
        models_named(options.models.as_deref())?;
        Ok(options)
    }
}

/// Fits each file, with a bar; `done` gets the results one by one.
pub(super) fn fit_all(
    data: &[PathBuf],
    options: &Options,
    mut done: impl FnMut(&Path, FitResult) -> Result<()>,
) -> Result<()> {
    stop_at_ctrl_c();
    let bar = progress_bar();
    for path in data {
        bar.reset();
        let progress = |done: usize, total: usize, what: &str| {
            bar.set_length(total as u64);
            bar.set_position(done as u64);
            bar.set_message(what.to_owned());
            !stopped()
        };
        let result = fit_measurement(path, options, &progress)?;
        bar.finish_and_clear();
        done(path, result)?;
    }
    Ok(())
}

pub(super) fn run(args: &Args) -> Result<()> {
    let options = Options {
        profiles: args.profiles,
        ..args.how.options()?
    };
    if let Some(out) = &args.out {
        prepare_folder(out)?;
    }
    let many = args.data.len() > 1;
    fit_all(&args.data, &options, |path, result| {
        print(&text::whole(&result))?;
        match &args.out {
            Some(out) => write_results(out, path, &result, many, args.plots),
            None => Ok(()),
        }
    })
}

fn write_results(
    out: &Path,
    data: &Path,
    result: &FitResult,
    many: bool,
    plots: bool,
) -> Result<()> {
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
    let mut written = Vec::new();
    let mut write = |name: String, bytes: &[u8]| {
        write_atomically(&out.join(&name), bytes)?;
        written.push(name);
        anyhow::Ok(())
    };
    let mut json = serde_json::to_value(result)?;
    if let Some(map) = json.as_object_mut() {
        map.insert("command".into(), command.clone().into());
    }
    let json = serde_json::to_string_pretty(&json)? + "\n";
    write(name("fit.json"), json.as_bytes())?;
    if let Some(fabric) = result.fabric(&command) {
        let text = format!("# {command}\n{}", fabric.to_toml());
        write(format!("{stem}.toml"), text.as_bytes())?;
    }
    let page = report::html(result, &command);
    write(name("report.html"), page.as_bytes())?;
    if plots {
        for (title, drawing) in figures::all(result) {
            let head = format!("<!-- {} -->\n", command.replace("--", "- -"));
            let svg = format!("{head}{drawing}");
            let png = pixels::png(&drawing, &command)?;
            write(name(&format!("{title}.svg")), svg.as_bytes())?;
            write(name(&format!("{title}.png")), &png)?;
        }
    }
    print(&format!(
        "written to {}: {}\n",
        out.display(),
        written.join(", ")
    ))
}
