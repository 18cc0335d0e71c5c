//! Date, time and the place of the sun: Meeus, "Astronomical Algorithms" (1998), chapters 7, 12, 13, 25; good to 0.01°.

use std::f64::consts::TAU;
use std::fmt;
use std::str::FromStr;

/// A moment: civil date and time with its offset from universal time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DateTime {
    year: i32,
    month: u32,
    day: u32,
    hour: u32,
    minute: u32,
    second: u32,
    /// Minutes east of Greenwich.
    offset: i32,
}

impl FromStr for DateTime {
    type Err = String;
    /// `2026-06-21T12:00`, seconds optional, then `Z`, `+02:00` or nothing (universal time).
    fn from_str(text: &str) -> Result<Self, String> {
        parse(text).ok_or_else(|| {
            format!("'{text}' is no date and time; write it as 2026-06-21T12:00+02:00")
        })
    }
}

fn parse(text: &str) -> Option<DateTime> {
    let number = |t: &str, len: usize| -> Option<u32> {
        (t.len() == len && t.bytes().all(|b| b.is_ascii_digit())).then(|| t.parse().ok())?
    };
    let (date, rest) = text.split_once(['T', ' '])?;
    let mut parts = date.split('-');
    let (year, month, day) = (
        number(parts.next()?, 4)?,
        number(parts.next()?, 2)?,
        number(parts.next()?, 2)?,
    );
    if parts.next().is_some() {
        return None;
    }
    let (clock, offset) = match rest.find(['Z', '+', '-']) {
        None => (rest, 0),
        Some(i) if &rest[i..] == "Z" => (&rest[..i], 0),
        Some(i) => {
            let (h, m) = rest[i + 1..].split_once(':')?;
            let (h, m) = (number(h, 2)?, number(m, 2)?);
            let sign = if rest[i..].starts_with('-') { -1 } else { 1 };
            (
                (h <= 14 && m < 60).then_some(&rest[..i])?,
                sign * (h * 60 + m) as i32,
            )
        }
    };
    let mut parts = clock.split(':');
    let (hour, minute) = (number(parts.next()?, 2)?, number(parts.next()?, 2)?);
    let second = parts.next().map_or(Some(0), |s| number(s, 2))?;
    let leap = year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400));
    let days = [
        31,
        if leap { 29 } else { 28 },
        31,
        30,
        31,
        30,
        31,
        31,
        30,
        31,
        30,
        31,
    ];
    let good = parts.next().is_none()
        && (1..=12).contains(&month)
        && day >= 1
        && day <= days[month as usize - 1]
        && hour < 24
        && minute < 60
        && second < 60
        && year >= 1583;
    good.then_some(DateTime {
        year: year as i32,
        month,
        day,
        hour,
        minute,
        second,
        offset,
    })
}

impl fmt::Display for DateTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let DateTime {
            year,
            month,
            day,
            hour,
            minute,
            second,
            offset,
        } = self;
        let (sign, o) = if *offset < 0 {
            ('-', -offset)
        } else {
            ('+', *offset)
        };
        write!(
            f,
            "{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}{sign}{:02}:{:02}",
            o / 60,
            o % 60
        )
    }
}

impl DateTime {
    /// Julian day, chapter 7.
    fn julian_day(&self) -> f64 {
        let (mut y, mut m) = (f64::from(self.year), f64::from(self.month));
        if m <= 2.0 {
            (y, m) = (y - 1.0, m + 12.0);
        }
        let a = (y / 100.0).floor();
        let b = 2.0 - a + (a / 4.0).floor();
        let clock = f64::from(self.hour) / 24.0
            + f64::from(self.minute) / 1440.0
            + f64::from(self.second) / 86_400.0;
        let day = f64::from(self.day) + clock - f64::from(self.offset) / 1440.0;
        (365.25 * (y + 4716.0)).floor() + (30.6001 * (m + 1.0)).floor() + day + b - 1524.5
    }
}

/// Where the sun stands, in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunPosition {
    /// From north over east.
    pub azimuth: f64,
    /// Over the horizon, as seen (refraction included where the sun is up).
    pub elevation: f64,
}

/// Right ascension and declination of the sun in radians, chapter 25 (low accuracy, 0.01°), for a Julian day.
fn equatorial(jd: f64) -> (f64, f64) {
    let t = (jd - 2_451_545.0) / 36_525.0;
    let mean_longitude = 280.466_46 + t * (36_000.769_83 + 0.000_303_2 * t);
    let anomaly = (357.529_11 + t * (35_999.050_29 - 0.000_153_7 * t)).to_radians();
    let center = anomaly.sin() * (1.914_602 - t * (0.004_817 + 0.000_014 * t))
        + (2.0 * anomaly).sin() * (0.019_993 - 0.000_101 * t)
        + (3.0 * anomaly).sin() * 0.000_289;
    let omega = (125.04 - 1934.136 * t).to_radians();
    let lambda = (mean_longitude + center - 0.005_69 - 0.004_78 * omega.sin()).to_radians();
    let tilt =
        23.439_291_1 - t * (0.013_004_2 + t * (1.64e-7 - t * 5.04e-7)) + 0.002_56 * omega.cos();
    let tilt = tilt.to_radians();
    (
        (tilt.cos() * lambda.sin()).atan2(lambda.cos()),
        (tilt.sin() * lambda.sin()).asin(),
    )
}

/// Where the sun stands over a place in degrees (north and east positive).
pub fn sun_position(when: &DateTime, latitude: f64, longitude: f64) -> SunPosition {
    let jd = when.julian_day();
    // Dynamical time runs ahead of universal time by about 70 s in these decades.
    let (ascension, declination) = equatorial(jd + 70.0 / 86_400.0);
    let d = jd - 2_451_545.0;
    let t = d / 36_525.0;
    // (12.4): mean sidereal time at Greenwich.
    let sidereal =
        280.460_618_37 + 360.985_647_366_29 * d + t * t * (0.000_387_933 - t / 38_710_000.0);
    let hour_angle = (sidereal + longitude).to_radians() - ascension;
    let phi = latitude.to_radians();
    // (13.5), (13.6); Meeus counts the azimuth from the south.
    let azimuth = hour_angle
        .sin()
        .atan2(hour_angle.cos() * phi.sin() - declination.tan() * phi.cos());
    let true_elevation = (phi.sin() * declination.sin()
        + phi.cos() * declination.cos() * hour_angle.cos())
    .clamp(-1.0, 1.0)
    .asin();
    let h = true_elevation.to_degrees();
    // (16.4), Saemundsson, for a true elevation; it bends light by 0.57° at the horizon.
    let refraction = if h > -1.0 {
        1.02 / (h + 10.3 / (h + 5.11)).to_radians().tan() / 60.0
    } else {
        0.0
    };
    SunPosition {
        azimuth: (azimuth + std::f64::consts::PI).rem_euclid(TAU),
        elevation: true_elevation + refraction.max(0.0).to_radians(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sun_of_meeus_example_25a() {
        // 1992 October 13.0 TD: right ascension 198.38083°, declination -7.78507°.
        let (a, d) = equatorial(2_448_908.5);
        assert!(
            (a.to_degrees().rem_euclid(360.0) - 198.380_83).abs() < 2e-4,
            "{}",
            a.to_degrees()
        );
        assert!(
            (d.to_degrees() - -7.785_07).abs() < 2e-4,
            "{}",
            d.to_degrees()
        );
    }

    #[test]
    fn the_sun_of_the_nrel_example() {
        // Reda and Andreas (NREL 2004), table A5.1: 2003-10-17 12:30:30 -7 h, 39.742476 N, 105.1786 W at 1830 m:
        // zenith 50.11162°, azimuth 194.34024°. Our formulas are good to 0.01°, and the air there is thinner.
        let when = "2003-10-17T12:30:30-07:00".parse().unwrap();
        let p = sun_position(&when, 39.742_476, -105.178_6);
        assert!(
            (90.0 - p.elevation.to_degrees() - 50.111_62).abs() < 0.01,
            "{}",
            90.0 - p.elevation.to_degrees()
        );
        assert!(
            (p.azimuth.to_degrees() - 194.340_24).abs() < 0.02,
            "{}",
            p.azimuth.to_degrees()
        );
    }

    #[test]
    fn dates_are_read_and_nonsense_is_refused() {
        let when: DateTime = "2026-06-21T12:00+02:00".parse().unwrap();
        assert_eq!(when.to_string(), "2026-06-21T12:00:00+02:00");
        assert_eq!(
            "2024-02-29 00:00:01Z"
                .parse::<DateTime>()
                .unwrap()
                .to_string(),
            "2024-02-29T00:00:01+00:00"
        );
        for bad in [
            "",
            "2026-06-21",
            "2026-13-01T00:00",
            "2025-02-29T00:00",
            "2026-06-21T24:00",
            "2026-06-21T12:00+99:00",
            "26-6-1T1:1",
            "2026-06-21T12:00Zx",
        ] {
            assert!(bad.parse::<DateTime>().is_err(), "{bad}");
        }
    }
}
