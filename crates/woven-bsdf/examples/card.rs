//! The numbers by which a cloth is sold, and the way back:
//!
//! - `cargo run -p woven-bsdf --example card -- FILE`: the card of a measured cloth (Klems .xml) or of a fabric (.toml)
//! - `cargo run -p woven-bsdf --example card -- NAME OPENNESS TAU RHO`: a fabric from a maker's card (0…1), as text

use std::path::Path;
use std::process::ExitCode;
use woven_bsdf::fabric::Fabric;
use woven_bsdf::measured::Refused;
use woven_bsdf::measured::klems::Klems;
use woven_bsdf::measured::shop::{Shop, fabric_from_card};

/// One line of a card.
fn print(what: &str, shop: &Shop) {
    println!(
        "{what:<10} {:>8.4} {:>8.4} {:>8.4} {:>8.4} {:>8.4} {:>8.3}",
        shop.tau_nn,
        shop.tau_nd,
        shop.tau_dd,
        shop.rho_n,
        shop.rho_dd,
        shop.clarity()
    );
}

fn card(path: &Path) -> Result<(), Refused> {
    let head = [
        "τ n-n",
        "τ n-dif",
        "τ dif-dif",
        "ρ n-h",
        "ρ dif-dif",
        "clarity",
    ];
    let fabric = path.extension().is_some_and(|e| e == "toml");
    print!("{:<10}", if fabric { "channel" } else { "band" });
    if fabric {
        let optics = Fabric::read(path)?.optics()?;
        println!(" {}", head.join(" "));
        for (name, shop) in ["red", "green", "blue"]
            .iter()
            .zip(Shop::of_sheet(&optics)?)
        {
            print(name, &shop);
        }
        return Ok(());
    }
    let file = Klems::read(path)?;
    println!(" {}", head.join(" "));
    let mut bands: Vec<&str> = file.blocks.iter().map(|b| b.band.as_str()).collect();
    bands.dedup();
    for band in bands {
        print(band, &Shop::of_klems(&file, band)?);
    }
    Ok(())
}

fn number(text: &str) -> Result<f64, Refused> {
    text.parse()
        .map_err(|_| Refused::new(format!("{text:?} is not a number; 0.05 means 5 %")))
}

fn run(arguments: &[String]) -> Result<bool, Refused> {
    match arguments {
        [file] => card(Path::new(file))?,
        [name, openness, tau, rho] => {
            let fabric = fabric_from_card(name, number(openness)?, number(tau)?, number(rho)?)?;
            print!("{}", fabric.to_toml());
        }
        _ => return Ok(false),
    }
    Ok(true)
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match run(&arguments) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => {
            eprintln!(
                "either a file (.xml, .toml), or a name and three numbers: openness, tau, rho"
            );
            ExitCode::from(2)
        }
        Err(e) => {
            eprintln!("{e}");
            ExitCode::FAILURE
        }
    }
}
