//! Readers under damaged input: cut, changed, repeated and swapped bytes. No panic, and a sentence or a sound result.
//!
//! `WOVEN_FUZZ=100` runs a hundred times as many inputs (10 million of the smaller formats take some minutes in release).

use crate::support::Rng;
use woven_bsdf::fabric::Fabric;
use woven_bsdf::measured::csv::Scan;
use woven_bsdf::measured::klems::Klems;
use woven_bsdf::weave::wif;

fn rounds(n: usize) -> usize {
    let times = std::env::var("WOVEN_FUZZ")
        .ok()
        .and_then(|t| t.parse().ok())
        .unwrap_or(1);
    n * times
}

/// One to four changes of `seed`: bits, digits, pieces cut out, doubled or moved, ends cut off, numbers made absurd.
fn mutate(seed: &[u8], rng: &mut Rng) -> Vec<u8> {
    const ODD: [&[u8]; 14] = [
        b"-1",
        b"0",
        b"99999999999999999999",
        b"1e999",
        b"nan",
        b"-0.0",
        b"\xff\xfe",
        b"=",
        b",",
        b"[",
        b"<",
        b"\0",
        b"&x;",
        b"1e-320",
    ];
    let mut out = seed.to_vec();
    for _ in 0..1 + rng.bits() % 4 {
        if out.is_empty() {
            break;
        }
        let at = rng.bits() as usize % out.len();
        let end = (at + 1 + rng.bits() as usize % 40).min(out.len());
        match rng.bits() % 7 {
            0 => out[at] ^= 1 << (rng.bits() % 8),
            1 => out[at] = b'0' + (rng.bits() % 10) as u8,
            2 => {
                out.drain(at..end);
            }
            3 => {
                let piece = out[at..end].to_vec();
                let to = rng.bits() as usize % out.len();
                out.splice(to..to, piece);
            }
            4 => out.truncate(at),
            _ => {
                let odd = ODD[rng.bits() as usize % ODD.len()];
                out.splice(at..end.min(at + 3), odd.iter().copied());
            }
        }
    }
    out
}

fn run(name: &str, seeds: &[Vec<u8>], n: usize, check: impl Fn(&[u8]) -> bool) {
    let mut rng = Rng::new(81);
    let n = rounds(n);
    let taken = (0..n)
        .filter(|i| check(&mutate(&seeds[i % seeds.len()], &mut rng)))
        .count();
    println!("{name}: {n} damaged inputs, {taken} of them still read");
    // If nothing or everything were read, the changes would test nothing.
    assert!(taken > 0 && taken < n, "{name}: {taken} of {n}");
}

#[test]
fn wif_drafts() {
    let seed = b"[WIF]\nVersion=1.1\n[WEAVING]\nRising Shed=true\n[THREADING]\n1=1\n2=2\n3=3,1\n[TIEUP]\n1=1,2\n2=2,3\n[TREADLING]\n1=1\n2=2,1\n\
        [WARP]\nThreads=3\nColor=1\nSpacing=0.2\nThickness=0.1\nUnits=centimeters\n[WEFT]\nThreads=2\nColor=2\n[COLOR PALETTE]\nRange=0,255\n\
        [COLOR TABLE]\n1=255,0,0\n2=0,255,0\n[WARP COLORS]\n2=2\n";
    run("wif", &[seed.to_vec()], 20_000, |bytes| {
        wif::parse(bytes).is_ok_and(|draft| {
            assert!((0.0..=1.0).contains(&draft.warp_share()));
            draft.longest_floats();
            true
        })
    });
}

#[test]
fn measurement_csv() {
    let seed = b"# ogm merge a.ogm\n# direct,0,0,0.113,0.002\ntheta_l_deg,phi_l_deg,theta_v_deg,phi_v_deg,f,sigma\n0,0,170,0,0.0143,0.0002\n30,45,150,-90,1.5e-3,\n";
    run("csv", &[seed.to_vec()], 20_000, |bytes| {
        let Ok(text) = std::str::from_utf8(bytes) else {
            return false;
        };
        Scan::parse(text).is_ok_and(|scan| {
            assert!(
                scan.samples
                    .iter()
                    .all(|s| s.f.is_finite() && s.l.x.is_finite() && s.v.z.is_finite())
            );
            true
        })
    });
}

#[test]
fn fabric_files() {
    let seed = b"name = \"lace\"\n[weave]\nwarp_diameter_mm = 0.3\nwarp_pitch_mm = 0.5\nweft_diameter_mm = 0.3\nweft_pitch_mm = 0.5\n[optics]\nmodel = \"sheet\"\n\
        parameters = { t_d = 0.3, k_t = 0.1, alpha_x = 0.2 }\n[optics.colors]\nt_d = [1.0, 0.9, 0.8]\n[mechanics]\nareal_density_kg_m2 = 0.1\n";
    run("fabric", &[seed.to_vec()], 4_000, |bytes| {
        let Ok(text) = std::str::from_utf8(bytes) else {
            return false;
        };
        Fabric::from_toml(text).is_ok_and(|fabric| {
            let optics = fabric.optics().expect("checked when read");
            assert!(optics.shape.iter().all(|x| x.is_finite()), "{text}");
            true
        })
    });
}

/// A whole Klems file over a basis of three patches, small enough for many rounds.
fn small_klems() -> Vec<u8> {
    let ring = |lo: f64, hi: f64, n: usize| {
        format!(
            "<AngleBasisBlock><ThetaBounds><LowerTheta>{lo}</LowerTheta><UpperTheta>{hi}</UpperTheta></ThetaBounds><nPhis>{n}</nPhis></AngleBasisBlock>"
        )
    };
    format!(
        "<WindowElement><Optical><Layer><Material><Name>x</Name><Manufacturer>y</Manufacturer></Material><DataDefinition>\
         <IncidentDataStructure>Columns</IncidentDataStructure><AngleBasis>{}{}</AngleBasis></DataDefinition><WavelengthData>\
         <Wavelength>Visible</Wavelength><WavelengthDataBlock><WavelengthDataDirection>Transmission Front</WavelengthDataDirection>\
         <ScatteringData>0.5, 0.1 0.1\n0.1 0.5 0.1\n0.1 0.1 0.5</ScatteringData></WavelengthDataBlock></WavelengthData></Layer></Optical></WindowElement>",
        ring(0.0, 40.0, 1),
        ring(40.0, 90.0, 2)
    )
    .into_bytes()
}

#[test]
fn klems_files() {
    run("klems", &[small_klems()], 10_000, |bytes| {
        let Ok(text) = std::str::from_utf8(bytes) else {
            return false;
        };
        Klems::parse(text).is_ok_and(|file| {
            for block in &file.blocks {
                assert!((0..file.patches.len()).all(|i| file.directional(block, i).is_finite()));
            }
            true
        })
    });
}
