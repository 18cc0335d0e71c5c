//! Mutated inputs for every reader of this crate: none may panic, hang or give a number that is not finite.
//!
//! `cargo run --release -p woven-fit --example fuzz -- 10000000` gives each reader ten million inputs, one thread, a line of
//! progress each second on a terminal. Input n depends on n alone: `-- 1 csv 12345` runs one again.

use indicatif::{ProgressBar, ProgressStyle};
use std::path::Path;
use woven_bsdf::measured::tensor_tree::TensorTree;
use woven_fit::directions::Directions;
use woven_fit::measurement::{Detail, Measurement, Source};
use woven_fit::photos::{Photo, Setup};
use woven_fit::starts::hash;

/// Pieces that readers trip over.
const PIECES: [&str; 25] = [
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "1e-320",
    "-0",
    "0",
    "90",
    "180",
    "360",
    ",",
    ",,",
    "\n",
    "\r\n",
    "\"",
    "#",
    "# direct,0,0,0.5,\n",
    "# aperture_deg,44\n",
    "# shared,light_theta_deg,40\n",
    "# shared,scale,0.1\n",
    "<nPhis>9</nPhis>",
    "\u{fe0f}",
    "lx",
    "99999999999999999999999999999999",
];

/// The seed text with a few changes, all drawn from the number `n`.
fn mutate(seed: &[u8], n: u64) -> Vec<u8> {
    let mut out = seed.to_vec();
    let changes = 1 + hash(n, 0) % 6;
    for c in 0..changes {
        let draw = |k: u64| hash(n, 10 * c + k + 1);
        let at = (draw(0) % (out.len() as u64 + 1)) as usize;
        match draw(1) % 6 {
            0 if at < out.len() => out[at] = draw(2) as u8,
            1 if at < out.len() => {
                out.remove(at);
            }
            2 => out.insert(at, draw(2) as u8),
            3 => {
                let piece = PIECES[(draw(2) % PIECES.len() as u64) as usize];
                out.splice(at..at, piece.bytes());
            }
            4 => out.truncate(at),
            _ if at < out.len() => {
                let end = (at + (draw(2) % 24) as usize).min(out.len());
                let copy = out[at..end].to_vec();
                let to = (draw(3) % (out.len() as u64 + 1)) as usize;
                out.splice(to..to, copy);
            }
            _ => {}
        }
    }
    out
}

const CSV: &str = "# a cloth\n# aperture_deg,1.5\n# shared,scale,4e-4\n# shared,view_phi_deg,0.06\n# direct,0,0,0.3,0.01\ntheta_l_deg,phi_l_deg,theta_v_deg,phi_v_deg,f,sigma\n0,0,170,0,0.31,0.01\n0,0,150,90,0.12,\n30,180,120,45,0.05,\n30,180,40,0,0.01,\n";

const DIRECTIONS: &str = "lx,ly,lz,vx,vy,vz,note\n0,0,1,0,0,-1,on\n0,0,2,0.6,0,-0.8,\"a, b\"\n";

const PAB: &str = "#sample_name \"lace 3\"\n#intheta 30\n#inphi 0\n#format: theta phi BTDF\n150 180 0.52\n 150  90.5 1e-3 \n";

/// A matrix over three patches.
const KLEMS: &str = "<WindowElement><Optical><Layer><Material><Name>x</Name><Manufacturer>y</Manufacturer></Material><DataDefinition>\
    <IncidentDataStructure>Columns</IncidentDataStructure><AngleBasis><AngleBasisBlock><ThetaBounds><LowerTheta>0</LowerTheta>\
    <UpperTheta>40</UpperTheta></ThetaBounds><nPhis>1</nPhis></AngleBasisBlock><AngleBasisBlock><ThetaBounds><LowerTheta>40</LowerTheta>\
    <UpperTheta>90</UpperTheta></ThetaBounds><nPhis>2</nPhis></AngleBasisBlock></AngleBasis></DataDefinition><WavelengthData>\
    <Wavelength>Visible</Wavelength><WavelengthDataBlock><WavelengthDataDirection>Transmission Front</WavelengthDataDirection>\
    <ScatteringData>0.5, 0.1 0.1\n0.1 0.5 0.1\n0.1 0.1 0.5</ScatteringData></WavelengthDataBlock></WavelengthData></Layer></Optical></WindowElement>";

const TREE: &str = "<WindowElement><Optical><Layer><Material><Name>x</Name><Manufacturer>y</Manufacturer></Material><DataDefinition>\
    <IncidentDataStructure>TensorTree3</IncidentDataStructure></DataDefinition><WavelengthData><Wavelength>Visible</Wavelength>\
    <WavelengthDataBlock><WavelengthDataDirection>Transmission Front</WavelengthDataDirection><AngleBasis>LBNL/Shirley-Chiu</AngleBasis>\
    <ScatteringDataType>BTDF</ScatteringDataType><ScatteringData>{{1}{1}{1}{1}{1}{1}{1}{1 2 3 4 5 6 7 8}}</ScatteringData>\
    </WavelengthDataBlock></WavelengthData></Layer></Optical></WindowElement>";

/// A picture of 6 × 6 pixels as PNG.
fn picture() -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::RgbImage::from_fn(6, 6, |x, y| {
        image::Rgb([(x * 40) as u8, (y * 40) as u8, 90])
    })
    .write_to(&mut bytes, image::ImageFormat::Png)
    .expect("written to memory");
    bytes.into_inner()
}

/// Panics on numbers that a fit must not see.
fn sound(data: &Measurement, detail: Detail) {
    data.remarks();
    for transmission in [true, false] {
        let points = data.points(transmission, detail, false);
        for p in &points.points {
            assert!(p.f.is_finite() && p.area.is_finite() && p.gap_density.is_finite());
            assert!(p.incidence < points.incidences.len() && p.nodes.1 <= points.nodes.len());
        }
        let finite = |w: woven_bsdf::vec3::Vec3<f64>| w.length_sqr().is_finite();
        assert!(points.nodes.iter().all(|n| finite(n.l) && finite(n.v)));
        assert!(
            points
                .shared
                .iter()
                .all(|s| s.sigma > 0.0 && s.sigma.is_finite())
        );
    }
}

/// Whether input `n` was read; panics on what a fit must not see.
fn read(reader: &str, n: u64, input: &[u8]) -> bool {
    match reader {
        "csv" | "pab" | "klems" => {
            let end = if reader == "klems" { "xml" } else { reader };
            let Ok(data) = Measurement::parse(Path::new(&format!("made.{end}")), input) else {
                return false;
            };
            sound(&data, Detail::Full);
            true
        }
        "tensor" => {
            let Ok(tree) = TensorTree::parse(&String::from_utf8_lossy(input)) else {
                return false;
            };
            // Averaging over the patches of a full basis takes a tenth of a second.
            if n.is_multiple_of(256) {
                let scan = woven_bsdf::measured::csv::Scan::default();
                let mut data = Measurement::from_scan("made", scan);
                data.source = Source::Klems(tree.to_klems());
                sound(&data, Detail::Coarse);
            }
            true
        }
        "directions" => {
            let Ok(list) = Directions::parse(&String::from_utf8_lossy(input)) else {
                return false;
            };
            for (_, l, v) in &list.rows {
                assert!((l.length_sqr() - 1.0).abs() < 1e-9 && (v.length_sqr() - 1.0).abs() < 1e-9);
            }
            true
        }
        _ => {
            let Ok(photo) = Photo::parse(input) else {
                return false;
            };
            let setup = Setup {
                cell_px: 2,
                ..Setup::default()
            };
            let points = photo.points(&setup, true);
            assert!(points.points.iter().all(|p| p.f.is_finite()));
            true
        }
    }
}

fn main() {
    let mut args = std::env::args().skip(1);
    let count: u64 = args.next().and_then(|a| a.parse().ok()).unwrap_or(100_000);
    let only = args.next();
    let first: u64 = args.next().and_then(|a| a.parse().ok()).unwrap_or(0);
    let seeds = [
        ("csv", CSV.as_bytes().to_vec()),
        ("pab", PAB.as_bytes().to_vec()),
        ("klems", KLEMS.as_bytes().to_vec()),
        ("tensor", TREE.as_bytes().to_vec()),
        ("directions", DIRECTIONS.as_bytes().to_vec()),
        ("photo", picture()),
    ];
    for (reader, seed) in &seeds {
        if only.as_ref().is_some_and(|o| o != reader) {
            continue;
        }
        assert!(
            read(reader, 0, seed),
            "{reader}: the seed itself must be read"
        );
        let bar = ProgressBar::new(count);
        bar.set_style(
            ProgressStyle::with_template("{msg:12} {bar:24} {pos}/{len}, {per_sec}, {eta} left")
                .expect("a fixed template"),
        );
        bar.set_message(*reader);
        let mut good = 0u64;
        for n in first..first + count {
            good += u64::from(read(reader, n, &mutate(seed, n)));
            if n % 4096 == 0 {
                bar.set_position(n - first);
            }
        }
        bar.finish_and_clear();
        println!(
            "{reader}: {count} inputs from number {first}, {good} read, the others refused, no panic"
        );
    }
}
