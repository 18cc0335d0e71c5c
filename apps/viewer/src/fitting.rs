//! Fits the chosen model to the opened measurement, in a thread of its own.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use woven_bsdf::model::ModelInfo;
use woven_fit::fit::{Options, fit_measurement};

/// What came out.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The model's name.
    pub model: &'static str,
    /// Values in the order of the model's parameters, within their ranges.
    pub values: Vec<f64>,
    /// A sentence about it.
    pub told: String,
}

#[derive(Default)]
struct State {
    share: f32,
    done: Option<Result<Fitted, String>>,
}

/// A fit under way; dropping it stops it.
pub struct Fitting {
    state: Arc<Mutex<State>>,
    stop: Arc<AtomicBool>,
}

fn lock(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Fitting {
    /// Starts to fit `model` to the measurement at `path`; `wake` is called as it goes on.
    pub fn new(
        path: PathBuf,
        model: &'static ModelInfo,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> Self {
        let (state, stop) = (Arc::<Mutex<State>>::default(), Arc::<AtomicBool>::default());
        let (theirs, told_to) = (Arc::clone(&state), Arc::clone(&stop));
        let run = move || {
            let progress = |done: usize, total: usize, _: &str| {
                lock(&theirs).share = done as f32 / total.max(1) as f32;
                wake();
                !told_to.load(Ordering::Relaxed)
            };
            let result = fit(&path, model, &progress);
            lock(&theirs).done = Some(result);
            wake();
        };
        if let Err(e) = std::thread::Builder::new()
            .name("fit".to_owned())
            .spawn(run)
        {
            lock(&state).done = Some(Err(format!("The fit cannot be started: {e}")));
        }
        Self { state, stop }
    }

    /// The share that is done, 0…1.
    #[must_use]
    pub fn share(&self) -> f32 {
        lock(&self.state).share
    }

    /// The outcome, once.
    pub fn outcome(&self) -> Option<Result<Fitted, String>> {
        lock(&self.state).done.take()
    }
}

impl Drop for Fitting {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

fn fit(
    path: &std::path::Path,
    model: &'static ModelInfo,
    progress: &(dyn Fn(usize, usize, &str) -> bool + Sync),
) -> Result<Fitted, String> {
    let options = Options {
        models: Some(vec![model.name.to_owned()]),
        ..Options::default()
    };
    let result =
        fit_measurement(path, &options, progress).map_err(|e| format!("The fit failed: {e:#}"))?;
    // The table may hold variants, such as one with a gap beside the lobe; here the model's own sliders are wanted.
    let own = |f: &&woven_fit::fit::ModelFit| f.model == model.name;
    let Some(best) = result
        .ranking
        .iter()
        .filter(own)
        .find(|f| f.label == model.name)
        .or_else(|| result.ranking.iter().find(own))
    else {
        return Err(format!("The fit of {} gave nothing.", model.name));
    };
    // The reflection is fitted on top of the transmission, so its list holds all values.
    let whole = result
        .reflection
        .as_ref()
        .filter(|r| r.model == model.name)
        .unwrap_or(best);
    let values = model
        .params
        .iter()
        .zip(&whole.values)
        .map(|(p, v)| v.clamp(p.min, p.max))
        .collect();
    let told = format!(
        "{} fitted to {}: root mean square {:.2e} of the peak, {}.",
        model.name,
        result.name,
        best.rms_e4 * 1e-4,
        best.outcome
    );
    Ok(Fitted {
        model: model.name,
        values,
        told,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use woven_bsdf::model::find;

    #[test]
    fn lambert_is_fitted_to_the_goniometer_file() {
        let path = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../assets/measurements/mecho_6216_goniometer.xml"
        );
        let model = find("lambert").expect("it is in the list");
        let fitted = fit(path.as_ref(), model, &|_, _, _| true).expect("the shipped file is sound");
        // The file transmits 0.0179 in all at normal incidence, most of it straight through.
        assert!(
            fitted.values.len() == 1 && (1e-4..0.0179).contains(&fitted.values[0]),
            "{fitted:?}"
        );
        let nowhere = Fitting::new(PathBuf::from("no/such/file.xml"), model, || ());
        let begin = std::time::Instant::now();
        let told = loop {
            if let Some(outcome) = nowhere.outcome() {
                break outcome.expect_err("there is no such file");
            }
            assert!(begin.elapsed().as_secs() < 30);
            std::thread::yield_now();
        };
        assert!(told.contains("no/such/file.xml"), "{told}");
    }
}
