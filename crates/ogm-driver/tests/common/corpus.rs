//! The parsers under mutated bytes, for `tests/fuzz.rs` and `examples/fuzz.rs`: seeds, mutations by counter, and what must hold of whatever is read.

use ogm_driver::log::{self, Record};
use ogm_driver::plan::Plan;
use ogm_driver::protocol::shot::Model;
use ogm_driver::protocol::{grbl, head, shot};
use ogm_driver::rig::Rig;
use ogm_driver::sim::noise::Noise;

/// One parser with its seeds.
pub(crate) struct Target {
    /// Its name on the command line.
    pub(crate) name: &'static str,
    seeds: Vec<Vec<u8>>,
    /// Reads the bytes of execution `k`; tells whether they were understood, panics when something does not hold.
    read: fn(&[u8], u64) -> bool,
}

impl Target {
    /// Execution `k`: the same bytes in every run. `bytes` is only a place to work in.
    pub(crate) fn execute(&self, k: u64, bytes: &mut Vec<u8>) -> bool {
        let mut noise = Noise::at(&[
            k,
            self.name.len() as u64,
            u64::from(self.name.as_bytes()[0]),
        ]);
        mutate(&self.seeds, &mut noise, bytes);
        (self.read)(bytes, k)
    }
}

/// Every target.
pub(crate) fn targets() -> Vec<Target> {
    let golden = |text: &str| -> Vec<Vec<u8>> {
        let lines = text.lines().filter_map(|l| l.get(2..));
        lines.map(|l| l.as_bytes().to_vec()).collect()
    };
    let plain = |texts: &[&str]| texts.iter().map(|t| t.as_bytes().to_vec()).collect();
    let logs: Vec<Vec<u8>> = {
        let lines: Vec<Vec<u8>> = records()
            .iter()
            .enumerate()
            .map(|(n, r)| log::encode(n as u64, r).unwrap())
            .collect();
        let ends: Vec<Vec<u8>> = (0..4)
            .map(|n| log::encode(n, &Record::End { points: n as usize }).unwrap())
            .collect();
        vec![
            ends.concat(),
            ends[0].clone(),
            lines.concat(),
            b"#00000000 00000000 {}\n".to_vec(),
        ]
    };
    let bodies = records()
        .iter()
        .map(|r| serde_json::to_vec(r).unwrap())
        .collect();
    vec![
        Target {
            name: "shot",
            seeds: golden(include_str!("../golden/shot.txt")),
            read: read_shot,
        },
        Target {
            name: "grbl",
            seeds: golden(include_str!("../golden/grbl.txt")),
            read: read_grbl,
        },
        Target {
            name: "head",
            seeds: plain(&[
                "@R 7 1000 40 *082A",
                "@V 1099511627776 122 800018 0 *0AF5",
                "@L *998B",
                "@I *C92E",
            ]),
            read: read_head,
        },
        Target {
            name: "log",
            seeds: logs,
            read: read_log,
        },
        Target {
            name: "record",
            seeds: bodies,
            read: read_record,
        },
        Target {
            name: "plan",
            seeds: plain(&[
                "name='a'\n[grid]\nkind='klems'\ntheta_l=[0,5]",
                "name='a'\n[grid]\nkind='paper'\nlight_elevations=[180]\ncamera='forty-samples'",
                "name='a'\norder='as-given'\n[grid]\nkind='random'\ncount=4\nseed=1",
                "name='a'\n[grid]\nkind='adaptive'\ntheta_l=[0,1e308]\nreach=1e-300",
                "name='a'\n[grid]\nkind='list'\nposes=[[0,0,150,0]]\n[exposure]\nladder_ms=[1,4]",
                "name='a'\nforbidden='leave-out'\n[grid]\nkind='uniform'\ntheta_l={from=0,to=9,step=3}\nphi_l=[0]\ntheta_v=[150]\nphi_v=[0]",
                "name='a'\n[grid]\nkind='klems'\n[calibration]\nwarm_up_min=0\ndark=1\ndrift='reference'",
            ]),
            read: read_plan,
        },
        Target {
            name: "rig",
            seeds: plain(&[
                "zone_deg=8\nbaud=9600\n[detector]\naperture_deg=0.5",
                &toml::to_string(&Rig::default()).unwrap(),
            ]),
            read: |bytes, _| Rig::from_toml(&String::from_utf8_lossy(bytes)).is_ok(),
        },
    ]
}

/// One record of each kind.
fn records() -> Vec<Record> {
    let shot = r#"{"ms":1.0,"counts":5e3,"ref":8e5,"sat":false}"#;
    [
        r#"{"kind":"header","format":1,"software":"ogm","plan":"name='a'","rig":"","fingerprint":"00","points":2}"#,
        r#"{"kind":"session","number":0,"wall_s":1.7e9,"scan_s":0.0,"controller":"c","detector":"d","lamp_s":7200.0,"torn_bytes":0}"#,
        &format!(
            r#"{{"kind":"reading","what":"sample","index":0,"asked":{{"theta_l":0.0,"phi_l":0.0,"theta_v":150.0,"phi_v":0.0}},"reached":{{"theta_l":0.0,"phi_l":0.0,"theta_v":150.0,"phi_v":0.0}},"f_number":4.0,"shots":[{shot}],"wall_s":1.7e9,"scan_s":3.5}}"#
        ),
        r#"{"kind":"end","points":1}"#,
    ]
    .iter()
    .map(|t| serde_json::from_str(t).unwrap())
    .collect()
}

/// A seed with up to four bytes changed, inserted, removed or doubled; sometimes two seeds joined. Valid UTF-8 is not promised.
fn mutate(seeds: &[Vec<u8>], noise: &mut Noise, out: &mut Vec<u8>) {
    const ODD: &[u8] = b"0123456789+-.,:PWSFRE ABKLMXQ<>|=$@#*'[]{}\"e\x00\xff\x80\n";
    out.clear();
    out.extend_from_slice(&seeds[noise.below(seeds.len() as u64) as usize]);
    if noise.below(16) == 0 {
        out.extend_from_slice(&seeds[noise.below(seeds.len() as u64) as usize]);
    }
    for _ in 0..noise.below(5) {
        let at = noise.below(out.len() as u64 + 1) as usize;
        let odd = ODD[noise.below(ODD.len() as u64) as usize];
        match noise.below(6) {
            0 if at < out.len() => out[at] = odd,
            1 if at < out.len() => out[at] ^= 1 << noise.below(8),
            2 => out.insert(at, odd),
            3 if at < out.len() => drop(out.remove(at)),
            4 => out.truncate(at),
            _ => {
                let copy: Vec<u8> = out[at..].iter().take(8).copied().collect();
                out.extend(copy);
            }
        }
    }
}

fn read_shot(bytes: &[u8], k: u64) -> bool {
    let text = String::from_utf8_lossy(bytes);
    let model = Model::ALL[(k % 5) as usize];
    let command = shot::parse_command(&text, model);
    if let Some(command) = &command {
        let again = shot::encode(command, model).unwrap();
        let again = std::str::from_utf8(&again).unwrap().trim_end();
        assert_eq!(shot::parse_command(again, model).as_ref(), Some(command));
    }
    let status = shot::parse_status(&text);
    if let Some(status) = &status {
        let again = shot::parse_status(&shot::format_status(status));
        assert_eq!(again.as_ref(), Some(status));
    }
    let short = shot::parse_ack(&text).is_some() || shot::parse_busy(&text).is_some();
    command.is_some() || status.is_some() || short
}

fn read_grbl(bytes: &[u8], k: u64) -> bool {
    let text = String::from_utf8_lossy(bytes);
    let line = grbl::parse_line(&text);
    if let Ok(line) = &line
        && let Some(again) = grbl::encode(line)
    {
        let again = std::str::from_utf8(&again).unwrap().trim_end();
        assert_eq!(grbl::parse_line(again).as_ref(), Ok(line));
    }
    let mut offset = vec![1000; (k % 7) as usize];
    let reply = grbl::parse_reply(&text, &mut offset);
    if let Some(grbl::Reply::Report(r)) = &reply {
        let again = grbl::parse_reply(&grbl::format_report(r), &mut Vec::new());
        assert_eq!(again.as_ref(), reply.as_ref());
    }
    line.is_ok() || reply.is_some()
}

fn read_head(bytes: &[u8], _: u64) -> bool {
    let text = String::from_utf8_lossy(bytes);
    head::parse_request(&text).is_some() || head::parse_reply(&text).is_some()
}

fn read_log(bytes: &[u8], _: u64) -> bool {
    let c = log::parse(bytes);
    assert_eq!(c.good_bytes + c.torn_bytes, bytes.len() as u64);
    !c.records.is_empty()
}

/// The JSON behind a good checksum: what a checksum hides from the target above.
fn read_record(bytes: &[u8], _: u64) -> bool {
    let json = String::from_utf8_lossy(bytes);
    let body = format!("00000000 {json}");
    let line = format!("#00000000 {:08x} {json}", crc32fast::hash(body.as_bytes()));
    let Some((number, record)) = log::decode(line.as_bytes()) else {
        return false;
    };
    assert_eq!(number, 0);
    let again = log::encode(0, &record).unwrap();
    // A number that is not finite becomes null; every other record comes back.
    let again = log::decode(&again[..again.len() - 1]);
    assert!(again.is_none_or(|(_, r)| r == record));
    true
}

fn read_plan(bytes: &[u8], k: u64) -> bool {
    let Ok(plan) = Plan::from_toml(&String::from_utf8_lossy(bytes)) else {
        return false;
    };
    // Now and then a small plan is routed, too: no panic, no endless loop.
    if k.is_multiple_of(64) && plan.grid.poses().is_ok_and(|p| p.len() < 40) {
        let _ = plan.route(&Rig::default());
    }
    true
}
