//! Golden conversations: the encoders, the parsers and the simulated controllers against a second account of both protocols, written in Python
//! (`golden/make_shot.py`, `golden/make_grbl.py`, which tell the format).

use std::sync::Arc;

use ogm_driver::protocol::grbl::{self, Reply};
use ogm_driver::protocol::shot::{self, Model};
use ogm_driver::rig::Rig;
use ogm_driver::sim::motor::Motor;
use ogm_driver::sim::optics::PlainCloth;
use ogm_driver::sim::{Bench, Device, FaultPlan, Imperfections};

/// A device whose arms rest at the mechanical origin.
fn device(rig: Rig) -> Device {
    let mut bench = Bench::new(rig, Arc::new(PlainCloth), Imperfections::none());
    for i in 0..4 {
        let axis = &bench.rig.axes[i];
        let pulses = |deg: f64| ((deg - axis.home_deg) / axis.degrees_per_pulse).round();
        bench.motors[i] = Motor::new(0.0, pulses(axis.min_deg - 1.0), pulses(axis.max_deg + 1.0));
    }
    Device::new(bench, FaultPlan::none())
}

/// Runs a conversation; returns the numbers of lines to and from the device. `check` sees each line with its direction.
fn converse(
    text: &str,
    fresh: impl Fn(&str) -> Device,
    mut check: impl FnMut(&str, bool, &str),
) -> (usize, usize) {
    let (mut now, mut sent, mut got) = (0.0, 0, 0);
    let mut device: Option<Device> = None;
    let mut heard: Vec<u8> = Vec::new();
    let mut key = "";
    for (number, line) in text.lines().enumerate() {
        let place = format!("line {} ({line:?})", number + 1);
        if let Some(k) = line.strip_prefix("= ") {
            assert!(heard.is_empty(), "{place}: unread answers");
            (key, device) = (k, Some(fresh(k)));
            heard = device.as_mut().unwrap().emit(now);
            continue;
        }
        let d = device.as_mut().unwrap();
        if let Some(command) = line.strip_prefix("> ") {
            assert!(
                heard.is_empty(),
                "{place}: before it came {:?}",
                String::from_utf8_lossy(&heard)
            );
            check(key, true, command);
            d.receive(format!("{command}\r\n").as_bytes(), now);
            heard = d.emit(now);
            sent += 1;
        } else if let Some(byte) = line.strip_prefix("! ") {
            assert!(
                heard.is_empty(),
                "{place}: before it came {:?}",
                String::from_utf8_lossy(&heard)
            );
            d.receive(&[u8::from_str_radix(byte, 16).unwrap()], now);
            heard = d.emit(now);
            sent += 1;
        } else if line == "~" {
            now += 10_000.0;
            heard.extend(d.emit(now));
        } else {
            let expected = line.strip_prefix("< ").unwrap();
            // A reset begins with an empty line.
            while heard.starts_with(b"\r\n") {
                heard.drain(..2);
            }
            let end = heard
                .iter()
                .position(|b| *b == b'\n')
                .unwrap_or_else(|| panic!("{place}: no answer"));
            let answer: Vec<u8> = heard.drain(..=end).collect();
            assert_eq!(
                String::from_utf8_lossy(&answer),
                format!("{expected}\r\n"),
                "{place}"
            );
            check(key, false, expected);
            got += 1;
        }
    }
    assert!(heard.is_empty());
    (sent, got)
}

#[test]
fn shot_and_gsc() {
    let model = |key: &str| match key {
        "shot302" => Model::Shot302,
        "shot304" => Model::Shot304,
        "shot702" => Model::Shot702,
        "gsc01" => Model::Gsc01,
        _ => Model::Gsc02,
    };
    let mut lengths = std::collections::BTreeSet::new();
    let fresh = |key: &str| {
        device(Rig {
            model: model(key),
            ..Rig::default()
        })
    };
    let (sent, got) = converse(
        include_str!("golden/shot.txt"),
        fresh,
        |key, to_rig, line| {
            if to_rig {
                // What the grammar knows comes back from the encoder byte for byte.
                if let Some(command) = shot::parse_command(line, model(key)) {
                    assert_eq!(
                        shot::encode(&command, model(key)).unwrap(),
                        format!("{line}\r\n").as_bytes()
                    );
                }
            } else if let Some(status) = shot::parse_status(line) {
                assert_eq!(shot::format_status(&status), line);
                lengths.insert((status.positions.len(), line.len()));
            }
        },
    );
    assert_eq!(
        lengths.into_iter().collect::<Vec<_>>(),
        [(1, 16), (2, 27), (4, 49)]
    );
    assert!(sent + got >= 200, "{sent} + {got}");
    println!("{sent} lines to the controllers, {got} from them");
}

#[test]
fn grbl_with_four_axes() {
    let (sent, got) = converse(
        include_str!("golden/grbl.txt"),
        |_| device(Rig::grbl()),
        |_, to_rig, line| {
            if to_rig {
                if let Ok(parsed) = grbl::parse_line(line) {
                    let again = grbl::encode(&parsed).unwrap();
                    assert_eq!(
                        grbl::parse_line(std::str::from_utf8(&again).unwrap().trim_end()),
                        Ok(parsed)
                    );
                }
            } else {
                let reply = grbl::parse_reply(line, &mut Vec::new())
                    .unwrap_or_else(|| panic!("{line:?} is not understood"));
                if let Reply::Report(report) = reply {
                    assert_eq!(grbl::format_report(&report), line);
                }
            }
        },
    );
    assert!(sent + got >= 200, "{sent} + {got}");
    println!("{sent} lines and bytes to the controller, {got} lines from it");
}
