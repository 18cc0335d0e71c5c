//! The curtain on its rail: a thread that lets it come to rest, and blows it when the wind is on.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use glam::{Vec2, Vec3};
use woven_catalog::stage::{CURTAIN_SPAN, CurtainMesh, RAIL_DISTANCE};
use woven_cloth::{CurtainSpec, Simulation};

/// The wind's clock [frames a second]; the picture takes as many of them as it can.
pub const FPS: f64 = 24.0;
/// Seconds of simulated time for coming to rest.
const SETTLE: f64 = 2.5;

/// A curtain at one moment.
#[derive(Clone, Debug)]
pub struct Moment {
    /// Counts up with every moment.
    pub number: u64,
    /// The triangles, in the stage's world.
    pub mesh: Arc<CurtainMesh>,
    /// Whether it hangs at rest.
    pub at_rest: bool,
}

#[derive(Default)]
struct Board {
    latest: Option<Moment>,
    taken: u64,
    wind: bool,
    error: Option<String>,
    closing: bool,
}

#[derive(Default)]
struct Shared {
    board: Mutex<Board>,
    news: Condvar,
}

impl Shared {
    fn board(&self) -> MutexGuard<'_, Board> {
        self.board.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts up a moment; false when the thread is to end.
    fn publish(&self, mesh: CurtainMesh, at_rest: bool) -> bool {
        let mut board = self.board();
        let number = board.latest.as_ref().map_or(0, |m| m.number) + 1;
        board.latest = Some(Moment {
            number,
            mesh: Arc::new(mesh),
            at_rest,
        });
        !board.closing
    }

    /// Waits until the newest moment was taken and `until` holds; `None` when the thread is to end.
    fn wait(&self, until: impl Fn(&Board) -> bool) -> Option<bool> {
        let mut board = self.board();
        loop {
            if board.closing {
                return None;
            }
            if until(&board) {
                return Some(board.wind);
            }
            board = self
                .news
                .wait(board)
                .unwrap_or_else(PoisonError::into_inner);
        }
    }
}

/// The handle of the thread; dropping it ends the thread.
pub struct Hang {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Hang {
    /// Hangs the curtain that `spec` describes; `wake` is called at each new moment.
    pub fn new(spec: CurtainSpec, wake: impl Fn() + Send + 'static) -> Self {
        let shared = Arc::new(Shared::default());
        let theirs = Arc::clone(&shared);
        let run = move || {
            if let Err(told) = live(&theirs, &spec, &wake) {
                theirs.board().error = Some(format!("The curtain cannot be simulated: {told}"));
                wake();
            }
        };
        let thread = std::thread::Builder::new()
            .name("cloth".to_owned())
            .spawn(run)
            .ok();
        Self { shared, thread }
    }

    /// Opens or shuts the window.
    pub fn set_wind(&self, on: bool) {
        self.shared.board().wind = on;
        self.shared.news.notify_all();
    }

    /// The newest moment, if it is newer than number `seen`. Asking for it lets the simulation go on to the next.
    #[must_use]
    pub fn newer(&self, seen: u64) -> Option<Moment> {
        let mut board = self.shared.board();
        let moment = board.latest.clone().filter(|m| m.number > seen)?;
        board.taken = moment.number;
        self.shared.news.notify_all();
        Some(moment)
    }

    /// What went wrong since the last call.
    #[must_use]
    pub fn error(&self) -> Option<String> {
        self.shared.board().error.take()
    }
}

impl Drop for Hang {
    fn drop(&mut self) {
        self.shared.board().closing = true;
        self.shared.news.notify_all();
        // The thread looks up between frames; waiting for it would hold up the window by at most the settling.
        drop(self.thread.take());
    }
}

/// Pleats, rest, then wind whenever it is on.
fn live(shared: &Shared, spec: &CurtainSpec, wake: &impl Fn()) -> Result<(), woven_cloth::Error> {
    let mut simulation = Simulation::new(spec)?;
    let go_on = |simulation: &Simulation, at_rest| {
        let there = shared.publish(placed(simulation), at_rest);
        wake();
        there
    };
    if !go_on(&simulation, false) {
        return Ok(());
    }
    simulation.settle(SETTLE)?;
    if !go_on(&simulation, true) {
        return Ok(());
    }
    loop {
        let Some(_) =
            shared.wait(|b| b.wind && b.latest.as_ref().is_none_or(|m| m.number <= b.taken))
        else {
            return Ok(());
        };
        let begin = Instant::now();
        simulation.run(1.0 / FPS)?;
        std::thread::sleep(Duration::from_secs_f64(1.0 / FPS).saturating_sub(begin.elapsed()));
        if !go_on(&simulation, false) {
            return Ok(());
        }
    }
}

/// The cloth as it hangs now, put onto the stage's rail.
fn placed(simulation: &Simulation) -> CurtainMesh {
    let mesh = simulation.mesh();
    let place = Vec3::new((CURTAIN_SPAN.0 + CURTAIN_SPAN.1) * 0.5, 0.0, RAIL_DISTANCE);
    let size = Vec2::from(mesh.fabric_size);
    CurtainMesh {
        positions: mesh
            .positions
            .iter()
            .map(|p| Vec3::from(*p) + place)
            .collect(),
        normals: mesh.normals.iter().copied().map(Vec3::from).collect(),
        uvs: mesh.uvs.iter().map(|uv| Vec2::from(*uv) * size).collect(),
        indices: mesh
            .indices
            .chunks_exact(3)
            .map(|t| [t[0], t[1], t[2]])
            .collect(),
    }
}
