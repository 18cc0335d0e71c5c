//! Random and mutated bytes into every parser: none panics, and what is read is written back the same. `OGM_FUZZ` sets the executions of each line
//! parser (the suite: 200 000); the log parser gets a hundredth, the plan and rig parsers a thousandth.

use ogm_driver::log::{self, Record};
use ogm_driver::plan::Plan;
use ogm_driver::protocol::shot::Model;
use ogm_driver::protocol::{grbl, head, shot};
use ogm_driver::rig::Rig;
use ogm_driver::sim::noise::Noise;

fn count() -> u64 {
    std::env::var("OGM_FUZZ")
        .ok()
        .and_then(|s| s.parse().ok())
        .unwrap_or(200_000)
}

/// A seed with up to four bytes changed, inserted, removed or doubled; sometimes two seeds joined. Valid UTF-8 is not promised.
fn mutate(seeds: &[&[u8]], noise: &mut Noise, out: &mut Vec<u8>) {
    out.clear();
    out.extend_from_slice(seeds[noise.below(seeds.len() as u64) as usize]);
    if noise.below(16) == 0 {
        out.extend_from_slice(seeds[noise.below(seeds.len() as u64) as usize]);
    }
    const ODD: &[u8] = b"0123456789+-.,:PWSFRE ABKLMXQ<>|=$@#*\x00\xff\x80\n";
    for _ in 0..noise.below(5) {
        let at = noise.below(out.len() as u64 + 1) as usize;
        let odd = ODD[noise.below(ODD.len() as u64) as usize];
        match noise.below(5) {
            0 if at < out.len() => out[at] = odd,
            1 => out.insert(at, odd),
            2 if at < out.len() => drop(out.remove(at)),
            3 => out.truncate(at),
            _ => {
                let copy: Vec<u8> = out[at..].iter().take(8).copied().collect();
                out.extend(copy);
            }
        }
    }
}

#[test]
fn line_parsers() {
    let shot_seeds: Vec<&[u8]> = include_str!("golden/shot.txt")
        .lines()
        .filter_map(|l| l.get(2..))
        .map(str::as_bytes)
        .collect();
    let grbl_seeds: Vec<&[u8]> = include_str!("golden/grbl.txt")
        .lines()
        .filter_map(|l| l.get(2..))
        .map(str::as_bytes)
        .collect();
    let head_seeds: [&[u8]; 4] = [
        b"@R 7 1000 40 *082A",
        b"@V 1099511627776 122 800018 0 *0AF5",
        b"@L *998B",
        b"@I *C92E",
    ];
    let (mut noise, mut bytes, mut understood) = (Noise::at(&[1]), Vec::new(), [0_u64; 6]);
    let n = count();
    for k in 0..n {
        mutate(&shot_seeds, &mut noise, &mut bytes);
        let text = String::from_utf8_lossy(&bytes);
        let model = Model::ALL[(k % 5) as usize];
        if let Some(command) = shot::parse_command(&text, model) {
            understood[0] += 1;
            let again = shot::encode(&command, model).unwrap();
            assert_eq!(
                shot::parse_command(std::str::from_utf8(&again).unwrap().trim_end(), model),
                Some(command)
            );
        }
        if let Some(status) = shot::parse_status(&text) {
            understood[1] += 1;
            assert_eq!(
                shot::parse_status(&shot::format_status(&status)),
                Some(status)
            );
        }
        mutate(&grbl_seeds, &mut noise, &mut bytes);
        let text = String::from_utf8_lossy(&bytes);
        if let Ok(line) = grbl::parse_line(&text) {
            understood[2] += 1;
            if let Some(again) = grbl::encode(&line) {
                assert_eq!(
                    grbl::parse_line(std::str::from_utf8(&again).unwrap().trim_end()),
                    Ok(line)
                );
            }
        }
        let mut offset = vec![1000; (k % 7) as usize];
        understood[3] += u64::from(grbl::parse_reply(&text, &mut offset).is_some());
        mutate(&head_seeds, &mut noise, &mut bytes);
        let text = String::from_utf8_lossy(&bytes);
        understood[4] += u64::from(head::parse_request(&text).is_some());
        understood[5] += u64::from(head::parse_reply(&text).is_some());
    }
    println!("{n} lines for each of six parsers, understood {understood:?}");
    assert!(understood.iter().all(|u| *u > n / 1000), "{understood:?}");
}

#[test]
fn log_parser() {
    let lines: Vec<Vec<u8>> = (0..4)
        .map(|n| log::encode(n, &Record::End { points: n as usize }).unwrap())
        .collect();
    let whole = lines.concat();
    let seeds: [&[u8]; 3] = [&whole, &lines[0], b"#00000000 00000000 {}\n"];
    let (mut noise, mut bytes, mut damaged, mut torn) = (Noise::at(&[2]), Vec::new(), 0_u64, 0_u64);
    for _ in 0..count() / 100 {
        mutate(&seeds, &mut noise, &mut bytes);
        let c = log::parse(&bytes);
        assert_eq!(c.good_bytes + c.torn_bytes, bytes.len() as u64);
        damaged += u64::from(!c.damage.is_empty());
        torn += u64::from(c.torn_bytes > 0);
    }
    println!("{} logs, {damaged} damaged, {torn} torn", count() / 100);
    assert!(damaged > 0 && torn > 0);
}

#[test]
fn plan_and_rig_parsers() {
    let rig = toml::to_string(&Rig::default()).unwrap();
    let seeds: [&[u8]; 4] = [
        include_bytes!("../plans/paper.toml"),
        include_bytes!("../plans/quick.toml"),
        b"name = 'a'\n[grid]\nkind = 'adaptive'\ntheta_l = [0, 1e308]\nreach = 1e-300",
        b"name = 'a'\n[grid]\nkind = 'random'\ncount = 4\nseed = 1",
    ];
    let (mut noise, mut bytes, mut good) = (Noise::at(&[3]), Vec::new(), 0_u64);
    for _ in 0..count() / 1000 {
        mutate(&seeds, &mut noise, &mut bytes);
        let text = String::from_utf8_lossy(&bytes);
        if let Ok(plan) = Plan::from_toml(&text) {
            good += 1;
            // Small plans are routed, too: no panic, no endless loop.
            if plan.grid.poses().is_ok_and(|p| p.len() < 300) {
                let _ = plan.route(&Rig::default());
            }
        }
        mutate(&[rig.as_bytes()], &mut noise, &mut bytes);
        let _ = Rig::from_toml(&String::from_utf8_lossy(&bytes));
    }
    println!("{} plans, {good} good", count() / 1000);
    assert!(good > 0);
}
