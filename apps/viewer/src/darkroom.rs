//! Development of the linear picture into one for the screen, in a thread of its own so that the window never waits.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use woven_render::denoise::{self, denoise};
use woven_render::film::{Curve, Film};

use crate::smooth::smooth;

/// Half the window of the renderer's filter, in pixels: small, so that it keeps up with the renderer.
const RADIUS: usize = 4;
/// Samples a pixel from which on the renderer's filter knows the noise; before, light is spread within surfaces.
const ENOUGH: u32 = 12;

/// A picture for the screen.
#[derive(Clone, Debug)]
pub struct Print {
    /// Counts up with every print.
    pub number: u64,
    /// Pixels across and down.
    pub size: [usize; 2],
    /// sRGB, three bytes a pixel, by rows from the top.
    pub rgb: Arc<Vec<u8>>,
}

/// How a picture is developed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recipe {
    /// Stops by which it is brighter.
    pub exposure: f32,
    /// Filters the noise.
    pub smooth: bool,
    /// Samples a pixel in the film.
    pub samples: u32,
}

/// What is to be developed.
struct Negative {
    film: Arc<Film>,
    recipe: Recipe,
}

#[derive(Default)]
struct Tray {
    next: Option<Negative>,
    print: Option<Print>,
    closing: bool,
}

#[derive(Default)]
struct Shared {
    tray: Mutex<Tray>,
    news: Condvar,
}

impl Shared {
    fn tray(&self) -> MutexGuard<'_, Tray> {
        self.tray.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The handle of the thread; dropping it ends the thread.
pub struct Darkroom {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

/// The film as sRGB bytes, three a pixel.
#[must_use]
pub fn develop(film: &Film, recipe: Recipe) -> Vec<u8> {
    if !recipe.smooth {
        return film.to_rgb8(Curve::Filmic, recipe.exposure);
    }
    let mut film = film.clone();
    if recipe.samples < ENOUGH {
        // Half the width, a round less, for four times the samples.
        smooth(&mut film, 5 - recipe.samples.max(1).ilog2() / 2);
    } else {
        denoise(
            &mut film,
            &denoise::Settings {
                radius: RADIUS,
                ..denoise::Settings::default()
            },
        );
    }
    film.to_rgb8(Curve::Filmic, recipe.exposure)
}

impl Darkroom {
    /// Starts the thread; `wake` is called after each print.
    pub fn new(wake: impl Fn() + Send + 'static) -> Self {
        let shared = Arc::new(Shared::default());
        let theirs = Arc::clone(&shared);
        let run = move || {
            let mut number = 0;
            loop {
                let mut tray = theirs.tray();
                while tray.next.is_none() && !tray.closing {
                    tray = theirs
                        .news
                        .wait(tray)
                        .unwrap_or_else(PoisonError::into_inner);
                }
                if tray.closing {
                    return;
                }
                let Some(Negative { film, recipe }) = tray.next.take() else {
                    continue;
                };
                drop(tray);
                number += 1;
                let rgb = Arc::new(develop(&film, recipe));
                theirs.tray().print = Some(Print {
                    number,
                    size: [film.width, film.height],
                    rgb,
                });
                wake();
            }
        };
        let thread = std::thread::Builder::new()
            .name("develop".to_owned())
            .spawn(run)
            .ok();
        Self { shared, thread }
    }

    /// Puts in a film; one that is still waiting is dropped.
    pub fn put(&self, film: Arc<Film>, recipe: Recipe) {
        self.shared.tray().next = Some(Negative { film, recipe });
        self.shared.news.notify_all();
    }

    /// The newest print, if it is newer than number `seen`.
    #[must_use]
    pub fn newer(&self, seen: u64) -> Option<Print> {
        self.shared
            .tray()
            .print
            .as_ref()
            .filter(|p| p.number > seen)
            .cloned()
    }
}

impl Drop for Darkroom {
    fn drop(&mut self) {
        self.shared.tray().closing = true;
        self.shared.news.notify_all();
        if let Some(thread) = self.thread.take() {
            thread.join().ok();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_print_is_the_film_of_the_renderer() {
        let darkroom = Darkroom::new(|| ());
        let film = Arc::new(Film::of_beauty(
            2,
            1,
            vec![[0.18, 0.18, 0.18], [4.0, 0.0, 0.0]],
        ));
        darkroom.put(
            Arc::clone(&film),
            Recipe {
                exposure: 1.0,
                smooth: false,
                samples: 1,
            },
        );
        let begin = std::time::Instant::now();
        let print = loop {
            if let Some(print) = darkroom.newer(0) {
                break print;
            }
            assert!(begin.elapsed().as_secs() < 20);
            std::thread::yield_now();
        };
        assert_eq!(*print.rgb, film.to_rgb8(Curve::Filmic, 1.0));
        assert!(darkroom.newer(print.number).is_none());
    }
}
