//! Progress over the whole run: share done, rate and time left on a terminal; nothing when the output goes elsewhere.

use std::io::IsTerminal as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Steps of the bar; the work is counted as a share of the whole.
const STEPS: u64 = 10_000;

/// A bar over all the work, which is given in seconds of an ordinary machine; only the proportions matter.
pub struct Progress {
    bar: ProgressBar,
    total: f64,
    done: f64,
    /// Work done in this run, without what was there already, and since when: the rate is taken from these.
    fresh: f64,
    since: Instant,
    stop: Arc<AtomicBool>,
}

impl Progress {
    /// A bar over `total` work. `stop` is raised when the user wants to stop.
    #[must_use]
    pub fn new(total: f64, stop: Arc<AtomicBool>) -> Self {
        let target = if std::io::stderr().is_terminal() {
            ProgressDrawTarget::stderr()
        } else {
            ProgressDrawTarget::hidden()
        };
        let bar = ProgressBar::with_draw_target(Some(STEPS), target);
        // The template is a constant that indicatif accepts; the fallback is its own.
        let style = ProgressStyle::with_template(
            "{bar:28} {percent:>3} %  {elapsed} gone, {prefix} left  {wide_msg}",
        );
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.set_prefix("?");
        Self {
            bar,
            total: total.max(f64::MIN_POSITIVE),
            done: 0.0,
            fresh: 0.0,
            since: Instant::now(),
            stop,
        }
    }

    /// Says what is being done now.
    pub fn say(&self, what: &str) {
        self.bar.set_message(what.to_owned());
    }

    /// Counts work that an earlier run has done.
    pub fn skip(&mut self, work: f64) {
        self.done += work;
        self.show(0.0);
    }

    /// Counts work done now.
    pub fn add(&mut self, work: f64) {
        self.done += work;
        self.fresh += work;
        self.show(0.0);
    }

    /// Shows that `work` of the present piece is done, without counting it yet.
    pub fn show(&self, work: f64) {
        self.bar.set_position(
            ((self.done + work) / self.total * STEPS as f64).clamp(0.0, STEPS as f64) as u64,
        );
        if let Some(left) = self.left(work) {
            self.bar.set_prefix(human(left));
        }
    }

    /// Time left at the rate of this run.
    fn left(&self, work: f64) -> Option<Duration> {
        let (fresh, gone) = (self.fresh + work, self.since.elapsed().as_secs_f64());
        (fresh > 0.0 && gone > 2.0).then(|| {
            Duration::from_secs_f64(
                ((self.total - self.done - work).max(0.0) * gone / fresh).min(1e7),
            )
        })
    }

    /// Writes a line above the bar; on stderr when there is no bar.
    pub fn line(&self, text: &str) {
        if self.bar.is_hidden() {
            eprintln!("{text}");
        } else {
            self.bar.println(text);
        }
    }

    /// True when the user wants to stop.
    #[must_use]
    pub fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// The flag that is raised when the user wants to stop.
    #[must_use]
    pub fn stop_flag(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.stop)
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// A duration for people: "4 min 10 s".
#[must_use]
pub fn human(time: Duration) -> String {
    let seconds = time.as_secs();
    match (seconds / 3600, seconds / 60 % 60, seconds % 60) {
        (0, 0, s) => format!("{s} s"),
        (0, m, s) => format!("{m} min {s} s"),
        (h, m, _) => format!("{h} h {m} min"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_read_well() {
        assert_eq!(human(Duration::from_secs(9)), "9 s");
        assert_eq!(human(Duration::from_secs(250)), "4 min 10 s");
        assert_eq!(human(Duration::from_secs(7260)), "2 h 1 min");
    }

    #[test]
    fn the_rate_forgets_what_was_there_already() {
        let mut p = Progress::new(100.0, Arc::default());
        p.skip(50.0);
        assert!(p.left(0.0).is_none(), "nothing done in this run: no rate");
        p.since = Instant::now() - Duration::from_secs(10);
        p.add(10.0);
        let left = p.left(0.0).unwrap().as_secs_f64();
        assert!((left - 40.0).abs() < 1.0, "{left}");
    }
}
