//! The render thread with painters that take a known time.

use super::*;

/// Paints the scene's number plus the pass's; takes a given time a pixel.
struct Slow(f64, Duration);

impl Painter for Slow {
    type Scene = f64;
    fn prepare(&mut self, scene: &f64) -> Result<(), String> {
        self.0 = *scene;
        if *scene < 0.0 {
            Err("The scene is less than nothing.".to_owned())
        } else {
            Ok(())
        }
    }
    fn pass(
        &mut self,
        size: [usize; 2],
        pass: u32,
        stop: &AtomicBool,
    ) -> Result<Option<Film>, String> {
        let pixels = size[0] * size[1];
        let end = Instant::now() + self.1 * pixels as u32;
        while Instant::now() < end {
            if stop.load(Ordering::Acquire) {
                return Ok(None);
            }
            std::thread::sleep(Duration::from_micros(200));
        }
        let value = self.0 as f32 + pass as f32;
        Ok(Some(Film::of_beauty(
            size[0],
            size[1],
            vec![[value; 3]; pixels],
        )))
    }
    fn backend(&self) -> String {
        "slow".to_owned()
    }
}

fn wait(worker: &Worker<Slow>, until: impl Fn(&Picture) -> bool) -> Picture {
    let begin = Instant::now();
    loop {
        if let Some(p) = worker.newer(0).filter(&until) {
            return p;
        }
        // Ten times what is needed on a busy machine.
        assert!(
            begin.elapsed() < Duration::from_secs(20),
            "no such picture came"
        );
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn passes_are_counted_and_end() {
    let mut worker = Worker::new(|| Slow(0.0, Duration::ZERO), || ());
    worker.wish(Wish {
        scene: 2.0,
        size: [5, 4],
        passes: 3,
    });
    let done = wait(&worker, |p| p.finished);
    assert_eq!((done.size, done.passes, done.full), ([5, 4], 3, true));
    assert_eq!(done.pixel(7), [4.0; 3]);
}

#[test]
fn the_first_picture_is_coarse_and_soon() {
    // 40 000 pixels at 20 µs: 0.8 s for a full pass.
    let mut worker = Worker::new(|| Slow(0.0, Duration::from_micros(20)), || ());
    worker.wish(Wish {
        scene: 1.0,
        size: [200, 200],
        passes: 1,
    });
    let first = wait(&worker, |_| true);
    assert!(!first.full && first.size[0] < 200);
    assert!(
        first.since < Duration::from_millis(300),
        "{:?}",
        first.since
    );
    wait(&worker, |p| p.full);
    // Now that the rate is known the next one is in time, too.
    let number = worker.wish(Wish {
        scene: 1.0,
        size: [200, 200],
        passes: 1,
    });
    let again = wait(&worker, |p| p.wish == number);
    assert!(
        again.since < Duration::from_millis(300),
        "{:?}",
        again.since
    );
}

#[test]
fn a_newer_wish_stops_the_pass() {
    // An hour a pass, if it were let.
    let mut worker = Worker::new(|| Slow(0.0, Duration::from_millis(40)), || ());
    worker.wish(Wish {
        scene: 1.0,
        size: [300, 300],
        passes: 1,
    });
    std::thread::sleep(Duration::from_millis(30));
    let number = worker.wish(Wish {
        scene: 7.0,
        size: [1, 1],
        passes: 1,
    });
    let picture = wait(&worker, |p| p.wish == number);
    assert_eq!(picture.pixel(0), [7.0; 3]);
}

#[test]
fn a_failure_is_told_and_the_next_wish_is_fulfilled() {
    let mut worker = Worker::new(|| Slow(0.0, Duration::ZERO), || ());
    worker.wish(Wish {
        scene: -1.0,
        size: [2, 2],
        passes: 1,
    });
    let begin = Instant::now();
    let told = loop {
        if let Some(told) = worker.error() {
            break told;
        }
        assert!(begin.elapsed() < Duration::from_secs(20));
        std::thread::sleep(Duration::from_millis(1));
    };
    assert_eq!(told, "The scene is less than nothing.");
    worker.wish(Wish {
        scene: 3.0,
        size: [2, 2],
        passes: 1,
    });
    assert_eq!(wait(&worker, |p| p.finished).pixel(3), [3.0; 3]);
}
