//! The thread that renders: it takes the newest wish, shows a coarse picture of it at once, and refines it pass by pass.
//!
//! Wishes do not queue up: a new one takes the place of the one before and stops the pass in progress. The first passes are
//! coarse enough to be done in [`FIRST`]; some at half the size follow, then passes of the full size until [`Wish::passes`].

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use woven_render::film::Film;

/// The time that a first, coarse picture may take.
pub const FIRST: Duration = Duration::from_millis(120);
/// Samples a pixel at half the size before the full size is begun.
const HALVES: u32 = 6;
/// A coarse picture is not coarser than this many pixels of the full one along a side.
const COARSEST: usize = 8;

/// What is to be seen. `P` is what the painter needs to know of the scene.
#[derive(Clone, Debug)]
pub struct Wish<P> {
    /// The scene.
    pub scene: P,
    /// Pixels across and down, at least 1 each.
    pub size: [usize; 2],
    /// Passes of one sample a pixel after which the picture is finished.
    pub passes: u32,
}

/// Who renders.
pub trait Painter: Send + 'static {
    /// What it needs to know of the scene.
    type Scene: Clone + Send + 'static;
    /// Prepares the scene of a wish.
    ///
    /// # Errors
    /// A sentence when it cannot be rendered.
    fn prepare(&mut self, scene: &Self::Scene) -> Result<(), String>;
    /// Adds the `pass`-th sample (from 0) to every pixel of a picture of this size and gives the film of all since sample 0;
    /// `None` when `stop` ended it.
    ///
    /// # Errors
    /// A sentence when it cannot.
    fn pass(
        &mut self,
        size: [usize; 2],
        pass: u32,
        stop: &AtomicBool,
    ) -> Result<Option<Film>, String>;
    /// What renders, for the status line.
    fn backend(&self) -> String;
}

impl<T: Painter + ?Sized> Painter for Box<T> {
    type Scene = T::Scene;
    fn prepare(&mut self, scene: &T::Scene) -> Result<(), String> {
        (**self).prepare(scene)
    }
    fn pass(
        &mut self,
        size: [usize; 2],
        pass: u32,
        stop: &AtomicBool,
    ) -> Result<Option<Film>, String> {
        (**self).pass(size, pass, stop)
    }
    fn backend(&self) -> String {
        (**self).backend()
    }
}

/// A picture on its way.
#[derive(Clone, Debug, Default)]
pub struct Picture {
    /// Counts up with every picture.
    pub number: u64,
    /// Counts up with every wish; all pictures of a wish carry its number.
    pub wish: u64,
    /// Pixels across and down of this picture; fewer than wished while it is coarse.
    pub size: [usize; 2],
    /// Linear radiance, and what a filter wants to know besides.
    pub film: Arc<Film>,
    /// Samples a pixel in it.
    pub passes: u32,
    /// Whether it has the full size.
    pub full: bool,
    /// Whether all passes are in it.
    pub finished: bool,
    /// Samples a second, of late.
    pub rate: f64,
    /// Time from the wish to this picture.
    pub since: Duration,
    /// What rendered it.
    pub backend: String,
}

impl Picture {
    /// The mean linear radiance of a pixel, by rows from the top; black where there is none.
    #[must_use]
    pub fn pixel(&self, index: usize) -> [f32; 3] {
        self.film
            .beauty()
            .and_then(|b| b.get(index))
            .copied()
            .unwrap_or_default()
    }
}

/// What the threads share.
struct Board<S> {
    wish: Option<(u64, Instant, Wish<S>)>,
    latest: Option<Picture>,
    error: Option<String>,
    closing: bool,
}

struct Shared<S> {
    board: Mutex<Board<S>>,
    news: Condvar,
    stop: AtomicBool,
}

impl<S> Shared<S> {
    /// The board; a thread that died while holding it has left it whole, for it is only assigned to.
    fn board(&self) -> MutexGuard<'_, Board<S>> {
        self.board.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The handle of the thread; dropping it ends the thread.
pub struct Worker<P: Painter> {
    shared: Arc<Shared<P::Scene>>,
    wishes: u64,
    thread: Option<JoinHandle<()>>,
}

impl<P: Painter> Worker<P> {
    /// Starts the thread. The painter is made in it by `painter`; `wake` is called after each picture.
    pub fn new(
        painter: impl FnOnce() -> P + Send + 'static,
        wake: impl Fn() + Send + 'static,
    ) -> Self {
        let board = Board {
            wish: None,
            latest: None,
            error: None,
            closing: false,
        };
        let shared = Arc::new(Shared {
            board: Mutex::new(board),
            news: Condvar::new(),
            stop: AtomicBool::new(false),
        });
        let theirs = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("render".to_owned())
            .spawn(move || {
                Loop {
                    painter: painter(),
                    shared: theirs,
                    wake: Box::new(wake),
                    rate: 0.0,
                    number: 0,
                }
                .run();
            });
        if let Err(e) = &thread {
            shared.board().error = Some(format!("No thread could be started to render in: {e}"));
        }
        Self {
            shared,
            wishes: 0,
            thread: thread.ok(),
        }
    }

    /// Wishes for another picture; what is being rendered is dropped. Returns the wish's number.
    pub fn wish(&mut self, wish: Wish<P::Scene>) -> u64 {
        self.wishes += 1;
        let mut board = self.shared.board();
        board.wish = Some((self.wishes, Instant::now(), wish));
        self.shared.stop.store(true, Ordering::Release);
        self.shared.news.notify_all();
        self.wishes
    }

    /// How many wishes there were.
    #[must_use]
    pub fn wishes(&self) -> u64 {
        self.wishes
    }

    /// The newest picture, if there is one newer than number `seen`.
    #[must_use]
    pub fn newer(&self, seen: u64) -> Option<Picture> {
        self.shared
            .board()
            .latest
            .as_ref()
            .filter(|p| p.number > seen)
            .cloned()
    }

    /// What went wrong since the last call.
    pub fn error(&mut self) -> Option<String> {
        self.shared.board().error.take()
    }
}

impl<P: Painter> Drop for Worker<P> {
    fn drop(&mut self) {
        self.shared.board().closing = true;
        self.shared.stop.store(true, Ordering::Release);
        self.shared.news.notify_all();
        if let Some(thread) = self.thread.take() {
            thread.join().ok();
        }
    }
}

/// The thread's own things.
struct Loop<P: Painter> {
    painter: P,
    shared: Arc<Shared<P::Scene>>,
    wake: Box<dyn Fn() + Send>,
    /// Samples a second, of late; 0 when not known.
    rate: f64,
    number: u64,
}

impl<P: Painter> Loop<P> {
    fn run(mut self) {
        let shared = Arc::clone(&self.shared);
        loop {
            let mut board = shared.board();
            while board.wish.is_none() && !board.closing {
                board = shared
                    .news
                    .wait(board)
                    .unwrap_or_else(PoisonError::into_inner);
            }
            if board.closing {
                return;
            }
            let Some((number, since, wish)) = board.wish.take() else {
                continue;
            };
            // From here on, `stop` means that there is a newer wish.
            shared.stop.store(false, Ordering::Release);
            drop(board);
            if let Err(told) = self.fulfil(number, since, &wish) {
                shared.board().error = Some(told);
                (self.wake)();
            }
        }
    }

    /// Works on a wish until it is finished or there is a newer one.
    fn fulfil(&mut self, number: u64, since: Instant, wish: &Wish<P::Scene>) -> Result<(), String> {
        let full = wish.size.map(|s| s.max(1));
        self.painter.prepare(&wish.scene)?;
        let first = self.coarseness(full, since.elapsed());
        if first > 2 && !self.stage(number, since, wish, first, [1, 1])? {
            return Ok(());
        }
        if first > 1 && !self.stage(number, since, wish, 2, [HALVES, 1])? {
            return Ok(());
        }
        // A full picture is shown as soon as it has as many samples on the same area as the one before.
        let least = if first > 1 { HALVES.div_ceil(4) } else { 1 };
        self.stage(number, since, wish, 1, [wish.passes.max(1), least])
            .map(|_| ())
    }

    /// Renders `passes` samples a pixel at a fraction of the size and shows the picture from the `least`-th on; false when
    /// there is a newer wish.
    fn stage(
        &mut self,
        number: u64,
        since: Instant,
        wish: &Wish<P::Scene>,
        coarse: usize,
        [passes, least]: [u32; 2],
    ) -> Result<bool, String> {
        let size = wish.size.map(|s| s.max(1).div_ceil(coarse));
        for pass in 0..passes {
            let Some(film) = self.pass(size, pass)? else {
                return Ok(false);
            };
            if pass + 1 >= least || pass + 1 == passes {
                self.publish(
                    number,
                    since,
                    size,
                    film,
                    [pass + 1, wish.passes],
                    coarse == 1,
                );
            }
        }
        Ok(true)
    }

    /// By what the first picture is coarser than the full one so that it is there in time, as a power of two.
    fn coarseness(&self, full: [usize; 2], spent: Duration) -> usize {
        let time = FIRST.saturating_sub(spent).max(FIRST / 3).as_secs_f64();
        // Before the first measurement: a third of a million samples a second.
        let rate = if self.rate > 0.0 { self.rate } else { 3e5 };
        let mut coarse = 1;
        while coarse < COARSEST
            && full[0].div_ceil(coarse) as f64 * full[1].div_ceil(coarse) as f64 > rate * time
        {
            coarse *= 2;
        }
        coarse
    }

    fn pass(&mut self, size: [usize; 2], pass: u32) -> Result<Option<Film>, String> {
        let begin = Instant::now();
        let Some(film) = self.painter.pass(size, pass, &self.shared.stop)? else {
            return Ok(None);
        };
        let samples = size[0] * size[1];
        if [film.width, film.height] != size || film.beauty().is_none() {
            return Err(format!(
                "The renderer gave a picture of {} x {} instead of {} x {}.",
                film.width, film.height, size[0], size[1]
            ));
        }
        let rate = samples as f64 / begin.elapsed().as_secs_f64().max(1e-6);
        self.rate = if self.rate > 0.0 {
            0.7 * self.rate + 0.3 * rate
        } else {
            rate
        };
        Ok(Some(film))
    }

    fn publish(
        &mut self,
        wish: u64,
        since: Instant,
        size: [usize; 2],
        film: Film,
        [passes, wanted]: [u32; 2],
        full: bool,
    ) {
        self.number += 1;
        let picture = Picture {
            number: self.number,
            wish,
            size,
            film: Arc::new(film),
            passes,
            full,
            finished: full && passes >= wanted,
            rate: self.rate,
            since: since.elapsed(),
            backend: self.painter.backend(),
        };
        self.shared.board().latest = Some(picture);
        (self.wake)();
    }
}

#[cfg(test)]
mod tests;
