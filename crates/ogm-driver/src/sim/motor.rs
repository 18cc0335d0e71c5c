//! One simulated arm: a trapezoid of speed, limit sensors, and a counter that knows nothing until it has been home.

/// A move under way. Pulses and seconds.
#[derive(Debug, Clone, Copy)]
struct Motion {
    from: f64,
    to: f64,
    begun: f64,
    start: f64,
    top: f64,
    ramp: f64,
}

impl Motion {
    /// Time of one ramp and the speed at its end; a short move turns round before it reaches the top speed.
    fn ramps(&self) -> (f64, f64) {
        let distance = (self.to - self.from).abs();
        if self.ramp <= 0.0 || self.top <= self.start {
            return (0.0, self.top);
        }
        let a = (self.top - self.start) / self.ramp;
        if distance >= (self.start + self.top) * self.ramp {
            (self.ramp, self.top)
        } else {
            let peak = (self.start * self.start + a * distance).sqrt();
            ((peak - self.start) / a, peak)
        }
    }

    fn duration(&self) -> f64 {
        let distance = (self.to - self.from).abs();
        let (ramp, peak) = self.ramps();
        2.0 * ramp + (distance - (self.start + peak) * ramp).max(0.0) / peak
    }

    fn at(&self, now: f64) -> f64 {
        let (t, total) = (now - self.begun, self.duration());
        if t >= total {
            return self.to;
        }
        let t = t.max(0.0);
        let (ramp, peak) = self.ramps();
        let part = |t: f64| {
            if ramp > 0.0 {
                self.start * t + (peak - self.start) * t * t / (2.0 * ramp)
            } else {
                0.0
            }
        };
        let distance = (self.to - self.from).abs();
        let gone = if t < ramp {
            part(t)
        } else if t > total - ramp {
            distance - part(total - t)
        } else {
            part(ramp) + peak * (t - ramp)
        };
        self.from + gone.clamp(0.0, distance) * (self.to - self.from).signum()
    }
}

/// An arm. `position` is where it really is, counted in pulses from the mechanical origin; `count` is what its controller believes.
#[derive(Debug, Clone)]
pub struct Motor {
    place: f64,
    zero: f64,
    motion: Option<Motion>,
    low: f64,
    high: f64,
    /// At a limit sensor since the last move.
    pub at_limit: bool,
}

impl Motor {
    /// An arm resting at `place`, with sensors at `low` and `high`. Its counter starts at 0, wherever it rests.
    pub fn new(place: f64, low: f64, high: f64) -> Self {
        Motor {
            place,
            zero: place,
            motion: None,
            low,
            high,
            at_limit: false,
        }
    }

    /// Starts towards `to` (counter pulses) at `now`. Speeds in pulses a second, ramp in seconds.
    pub fn go(&mut self, to: f64, now: f64, start: f64, top: f64, ramp: f64) {
        self.update(now);
        self.at_limit = false;
        let to = to + self.zero;
        if (to - self.place).abs() > 0.0 {
            self.motion = Some(Motion {
                from: self.place,
                to,
                begun: now,
                start,
                top,
                ramp,
            });
        }
    }

    /// Starts towards the mechanical origin and forgets the counter.
    pub fn go_home(&mut self, now: f64, start: f64, top: f64, ramp: f64) {
        self.update(now);
        self.zero = 0.0;
        self.go(0.0, now, start, top, ramp);
    }

    /// Stops where it is.
    pub fn freeze(&mut self, now: f64) {
        self.update(now);
        self.motion = None;
        self.place = self.place.round();
    }

    /// Calls the present place zero.
    pub fn zero_here(&mut self, now: f64) {
        self.update(now);
        self.zero = self.place;
    }

    /// Brings the arm to where it is at `now`; true while it moves.
    pub fn update(&mut self, now: f64) -> bool {
        let Some(motion) = self.motion else {
            return false;
        };
        self.place = motion.at(now);
        if self.place > self.high || self.place < self.low {
            self.place = self.place.clamp(self.low, self.high);
            self.at_limit = true;
            self.motion = None;
        } else if now - motion.begun >= motion.duration() {
            self.place = motion.to;
            self.motion = None;
        }
        self.motion.is_some()
    }

    /// Pulses from the mechanical origin.
    pub fn place(&self) -> f64 {
        self.place
    }

    /// The controller's counter.
    pub fn count(&self) -> i64 {
        (self.place - self.zero).round() as i64
    }

    /// When the present move will end.
    pub fn end(&self) -> Option<f64> {
        self.motion.map(|m| m.begun + m.duration())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trapezoid_is_where_the_formula_says() {
        let mut m = Motor::new(0.0, -1e9, 1e9);
        m.go(9680.0, 0.0, 400.0, 8000.0, 0.2); // 840 up, 8000 at speed in 1 s, 840 down
        for (t, x) in [
            (0.0, 0.0),
            (0.2, 840.0),
            (0.7, 4840.0),
            (1.2, 8840.0),
            (1.4, 9680.0),
            (2.0, 9680.0),
        ] {
            m.update(t);
            assert!((m.place() - x).abs() < 1e-6, "{t}: {} {x}", m.place());
        }
    }

    #[test]
    fn a_short_move_ends_where_it_should_and_never_turns_back() {
        let mut m = Motor::new(0.0, -1e9, 1e9);
        m.go(-100.0, 1.0, 400.0, 8000.0, 0.2);
        let mut before = 0.0;
        for k in 0..200 {
            m.update(1.0 + f64::from(k) * 1e-3);
            assert!(m.place() <= before);
            before = m.place();
        }
        assert_eq!(m.count(), -100);
    }

    #[test]
    fn the_limit_sensor_stops_at_once() {
        let mut m = Motor::new(0.0, -50.0, 50.0);
        m.go(100.0, 0.0, 100.0, 100.0, 0.0);
        assert!(m.update(0.4));
        assert!(!m.update(0.9) && m.at_limit);
        assert_eq!(m.count(), 50);
    }

    #[test]
    fn a_power_cycle_forgets_and_home_remembers() {
        let mut m = Motor::new(1234.0, -1e6, 1e6);
        assert_eq!(m.count(), 0);
        m.go_home(0.0, 1e5, 1e5, 0.0);
        m.update(10.0);
        assert_eq!((m.count(), m.place()), (0, 0.0));
    }
}
