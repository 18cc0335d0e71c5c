//! A simulated camera: a small region of pixels on the detector arm, each with its own gain, noise and ADC, behind the JSON lines of a detector command.
//!
//! Its numbers are those of the rig's detector, spread over the pixels, so that the mean over the region has the noise the rig file states.

use std::io::{self, BufRead, BufReader, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::bench::{Bench, Shot};
use super::device::Device;
use super::noise::Noise;
use super::pty::Clock;
use crate::protocol::camera::{self, Answer, Question};

/// Pixels of the region.
pub const PIXELS: u64 = 64;
/// Relative standard deviation of the pixels' gains (fixed pattern); the mean gain is 1.
const PATTERN: f64 = 0.01;
/// Above this share of pixels at the end of the ADC the mean is no measure of the light.
const CLIPPED: f64 = 0.01;

/// The mean over the region of one exposure beginning at `now`.
pub fn expose(bench: &mut Bench, now: f64, ms: f64, f_number: f64, tag: u64) -> Shot {
    let light = bench.light(now, ms, f_number, tag);
    let dark = bench.wrong.dark_rate * ms;
    let (d, wrong) = (&bench.rig.detector, &bench.wrong);
    let n = PIXELS as f64;
    let pattern = |k: u64| PATTERN * Noise::at(&[wrong.seed, 0x0070_6978, k]).normal();
    let mean_pattern = (0..PIXELS).map(pattern).sum::<f64>() / n;
    let mut noise = Noise::at(&[wrong.seed, tag, (ms * 1000.0) as u64, 0xca]);
    let (mut sum, mut clipped) = (0.0, 0.0);
    for k in 0..PIXELS {
        let gain = 1.0 + pattern(k) - mean_pattern;
        let mut counts =
            light * gain * (1.0 - wrong.nonlinearity * (light / d.full_scale).min(1.0));
        if wrong.noise {
            // One pixel has the n-th part of the region's electrons and √n times its read noise.
            let variance = (counts + dark) * n / d.electrons_per_count + n * d.read_noise.powi(2);
            counts += noise.normal() * variance.sqrt();
        }
        counts += wrong.dark_offset + dark;
        clipped += f64::from(u8::from(counts >= d.full_scale));
        sum += counts.min(d.full_scale).round();
    }
    Shot {
        counts: (sum / n).round() as i64,
        reference: bench.reference(now + ms / 2000.0, tag),
        saturated: clipped > CLIPPED * n,
    }
}

/// A camera listening on a Unix socket; the socket is removed when this is dropped.
pub struct CameraServer {
    path: PathBuf,
}

impl CameraServer {
    /// Listens at `path`, looking at `device` on its clock.
    ///
    /// # Errors
    /// The system's, when there can be no such socket.
    pub fn start(path: &Path, device: Arc<Mutex<Device>>, clock: Clock) -> io::Result<Self> {
        let listener = UnixListener::bind(path)?;
        std::thread::Builder::new()
            .name("camera".into())
            .spawn(move || {
                for stream in listener.incoming().flatten() {
                    // A host that goes away in the middle of a line is no trouble of the camera's.
                    let _ = serve(stream, &device, &clock);
                }
            })?;
        Ok(CameraServer { path: path.into() })
    }
}

impl Drop for CameraServer {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

fn serve(mut stream: UnixStream, device: &Mutex<Device>, clock: &Clock) -> io::Result<()> {
    for line in BufReader::new(stream.try_clone()?).lines() {
        let answer = match camera::parse_question(&line?) {
            None => Answer::Trouble {
                error: "the question is none of identify, lamp, expose".into(),
            },
            Some(question) => {
                if let Question::Expose { ms, .. } = question {
                    let seconds = (ms / 1000.0 / clock.speed).clamp(0.0, 3600.0);
                    let (answer, end) = (reply(question, device, clock), seconds);
                    std::thread::sleep(Duration::from_secs_f64(end));
                    answer
                } else {
                    reply(question, device, clock)
                }
            }
        };
        writeln!(stream, "{}", camera::encode(&answer))?;
    }
    Ok(())
}

fn reply(question: Question, device: &Mutex<Device>, clock: &Clock) -> Answer {
    let mut device = device.lock().unwrap_or_else(PoisonError::into_inner);
    let now = device.time(clock.now());
    let bench = &mut device.bench;
    match question {
        Question::Identify => Answer::Identity {
            name: format!("simulated camera, {PIXELS} pixels, SIM-2"),
        },
        Question::Lamp => Answer::Lamp {
            seconds: Some(bench.lamp_seconds(now)),
        },
        Question::Expose { tag, ms, f_number } => {
            let sound = (0.001..=600_000.0).contains(&ms) && (0.5..=64.0).contains(&f_number);
            if !sound {
                return Answer::Trouble {
                    error: format!("it cannot expose {ms} ms at f/{f_number}"),
                };
            }
            let shot = expose(bench, now, ms, f_number, tag);
            Answer::Exposed {
                tag,
                counts: shot.counts as f64,
                reference: shot.reference as f64,
                saturated: shot.saturated,
            }
        }
    }
}

/// Carries lines between standard input and output and a camera's socket: the detector command `ogm camera`.
///
/// # Errors
/// The system's, when the socket is not there or goes away.
pub fn relay(path: &Path) -> io::Result<()> {
    let mut stream = UnixStream::connect(path)?;
    let mut answers = BufReader::new(stream.try_clone()?).lines();
    let mut out = io::stdout().lock();
    for line in io::stdin().lock().lines() {
        writeln!(stream, "{}", line?)?;
        let Some(answer) = answers.next() else {
            return Err(io::Error::new(
                io::ErrorKind::BrokenPipe,
                "the camera has gone",
            ));
        };
        writeln!(out, "{}", answer?)?;
        out.flush()?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::Rig;
    use crate::sim::Imperfections;
    use crate::sim::optics::PlainCloth;

    fn bench() -> Bench {
        let mut bench = Bench::new(
            Rig::default(),
            Arc::new(PlainCloth),
            Imperfections::default(),
        );
        bench.outputs = 3; // shutter open, nothing in the beam
        for (m, target) in bench.motors.iter_mut().zip([0.0; 4]) {
            m.go_home(0.0, 1e6, 1e6, 0.0);
            m.go(target, 50.0, 1e6, 1e6, 0.0);
        }
        bench
    }

    #[test]
    fn the_mean_has_the_noise_of_the_rig_file() {
        let mut bench = bench();
        let shots: Vec<f64> = (0..400)
            .map(|tag| expose(&mut bench, 100.0, 1.0, 4.0, tag).counts as f64)
            .collect();
        let mean = shots.iter().sum::<f64>() / 400.0;
        let spread = (shots.iter().map(|c| (c - mean).powi(2)).sum::<f64>() / 399.0).sqrt();
        let stated = (600_000.0_f64 / 20.0 + 9.0).sqrt();
        // Standard error of a standard deviation of 400 readings: 3.5 %; four of them.
        assert!((spread / stated - 1.0).abs() < 0.14, "{spread} {stated}");
        // The dark offset of 120 counts, a lamp a hundred-thousandth short of warm, four standard errors of the mean.
        assert!(
            (mean - 600_120.0).abs() < 10.0 + 4.0 * stated / 20.0,
            "{mean}"
        );
    }

    #[test]
    fn bright_pixels_end_first_and_say_so() {
        let mut bench = bench();
        assert!(!expose(&mut bench, 100.0, 1.6, 4.0, 1).saturated);
        // 1.73 ms bring the mean to 99 % of full scale: the pixels of high gain are at their end, the mean is not.
        let shot = expose(&mut bench, 100.0, 1.73, 4.0, 1);
        assert!(shot.saturated && (shot.counts as f64) < 0.999 * bench.rig.detector.full_scale);
        assert!(expose(&mut bench, 100.0, 8.0, 4.0, 1).saturated);
        assert!(!expose(&mut bench, 100.0, 8.0, 16.0, 1).saturated);
    }
}
