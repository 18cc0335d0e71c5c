//! One picture of the stage, the smallest use of this library: `cargo run --release -p woven-catalog --example look -- day 320x240 16 look.png [FABRIC.toml [CURTAIN.glb [FRAME [STILL-SAMPLES]]]]`.

use std::path::Path;

use anyhow::{Context as _, Result};
use woven_bsdf::fabric::Fabric;
use woven_catalog::catalog::Catalog;
use woven_catalog::cloth;
use woven_catalog::picture::{Choice, Photographer, Shoot};
use woven_catalog::stage::{Preset, Stage};

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let word = |i: usize, or: &str| words.get(i).cloned().unwrap_or_else(|| or.to_owned());
    let light = match word(0, "day").as_str() {
        "evening" => Preset::Evening,
        "all" => Preset::All,
        _ => Preset::Day,
    };
    let (width, height) = word(1, "320x240")
        .split_once('x')
        .and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)))
        .context("the size is written like 320x240")?;
    let mut catalog = Catalog::builtin()?;
    catalog.quicken();
    let clip = match words.get(5) {
        Some(path) => cloth::read(Path::new(path))?,
        None => {
            catalog.motion.frames = 1;
            catalog.motion.blend = 0;
            let mut spec = cloth::spec(&catalog.fabrics[0], 0.05, &catalog.motion)?;
            (spec.settle, spec.warm_up) = (1.0, 0.1);
            cloth::run(&spec, &catalog.motion, &mut |_| true)?
        }
    };
    let frame = words
        .get(6)
        .map(|f| f.parse())
        .transpose()
        .context("the frame is a number")?;
    let mut stage = Stage::new(light).with_curtain(cloth::mesh(&clip, None));
    if let Some(path) = words.get(4) {
        let path = Path::new(path);
        stage.dress(&Fabric::read(path)?, path.parent().unwrap_or(path))?;
    }
    let photographer = Photographer::choose(Choice::Cpu)?;
    let began = std::time::Instant::now();
    let shoot = Shoot {
        size: [width, height],
        depth: catalog.picture.depth,
        seed: 1,
        denoise: catalog.picture.denoise,
        layers: false,
    };
    let mut set = photographer.set_up(&stage, &shoot)?;
    let samples = word(2, "16").parse()?;
    // With a number of samples for a still, the frame is steadied by it like those of the catalog.
    let anchor = match words.get(7) {
        Some(many) => Some(
            set.still(
                &cloth::mesh(&clip, None),
                samples,
                many.parse()?,
                &mut |_| true,
            )?
            .1,
        ),
        None => None,
    };
    let picture = set.take(
        &cloth::mesh(&clip, frame),
        samples,
        anchor.as_ref(),
        &mut |_| true,
    )?;
    std::fs::write(word(3, "look.png"), picture.png()?)?;
    println!("{:.1} s", began.elapsed().as_secs_f64());
    Ok(())
}
