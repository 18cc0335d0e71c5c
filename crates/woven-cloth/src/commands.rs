//! What the program's commands do beyond simulating: pictures, checks, the textile laboratory.

use anyhow::{Context, ensure};
use std::path::Path;
use woven_cloth::lab::{Thread, cusick, peirce};
use woven_cloth::{CurtainClip, CurtainSpec, bending_length};

/// The clip of a cache, and of a second curtain's with it.
pub(crate) fn read(cache: &Path, with: Option<&Path>) -> anyhow::Result<CurtainClip> {
    let faces = |path: &Path| {
        let clip = CurtainClip::read(path)?;
        ensure!(
            !clip.mesh.indices.is_empty(),
            "{} has no faces; give a .glb",
            path.display()
        );
        Ok(clip)
    };
    let clip = faces(cache)?;
    match with {
        Some(other) => Ok(clip.with(&faces(other)?)?),
        None => Ok(clip),
    }
}

/// Writes a strip of pictures.
pub(crate) fn preview(
    clip: &CurtainClip,
    output: &Path,
    count: usize,
    height: usize,
) -> anyhow::Result<()> {
    ensure!(
        (32..=4096).contains(&height),
        "--height {height} is outside 32 to 4096 pixels"
    );
    let p = woven_cloth::preview::strip(clip, count, height);
    let picture = image::RgbImage::from_raw(p.width as u32, p.height as u32, p.rgb)
        .context("the strip has no size")?;
    let folder = output
        .parent()
        .filter(|f| !f.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let mut file = tempfile::NamedTempFile::new_in(folder)
        .with_context(|| format!("cannot write into {}", folder.display()))?;
    picture.write_to(
        &mut std::io::BufWriter::new(file.as_file_mut()),
        image::ImageFormat::Png,
    )?;
    file.persist(output)
        .with_context(|| format!("cannot write {}", output.display()))?;
    Ok(())
}

/// The cantilever and the drape meter.
pub(crate) fn test_fabric(fabric: &str, segments: usize, cells: usize) -> anyhow::Result<()> {
    ensure!(
        (8..=256).contains(&segments),
        "--segments {segments} is outside 8 to 256"
    );
    ensure!(
        (16..=128).contains(&cells),
        "--cells {cells} is outside 16 to 128"
    );
    let path = Path::new(fabric);
    let mechanics = if path.extension().is_some() {
        CurtainSpec::read(path)?.mechanics()?
    } else {
        woven_cloth::fabric(fabric)?.mechanics()
    };
    println!("{fabric}: {:.0} g/m2", mechanics.areal_density * 1e3);
    for (thread, name, b) in [
        (Thread::Warp, "warp", mechanics.bending()[0]),
        (Thread::Weft, "weft", mechanics.bending()[1]),
    ] {
        ensure!(
            b > 0.0,
            "the bending stiffness along the {name} is 0, so the strip hangs straight down; nothing to measure"
        );
        let (own, found) = (
            bending_length(b, mechanics.areal_density) * 1e3,
            peirce(&mechanics, thread, segments) * 1e3,
        );
        println!(
            "  {name}: B {:.2} uN m, bending length {own:.2} mm; cantilever of {segments} segments finds {found:.2} mm ({:+.2} %)",
            b * 1e6,
            (found / own - 1.0) * 100.0
        );
    }
    // The standard takes a smaller piece for limp cloth and a larger for stiff.
    let mut diameter = 0.30;
    let mut drape = cusick(&mechanics, diameter, cells, 0.0);
    let other = match drape.coefficient {
        d if d < 0.30 => Some(0.24),
        d if d > 0.85 => Some(0.36),
        _ => None,
    };
    if let Some(other) = other {
        diameter = other;
        drape = cusick(&mechanics, diameter, cells, 0.0);
    }
    println!(
        "  drape of a piece of {:.0} cm: coefficient {:.1} %, {} folds",
        diameter * 100.0,
        drape.coefficient * 100.0,
        drape.folds
    );
    Ok(())
}

/// Crossings and strain of a clip.
pub(crate) fn check(clip: &CurtainClip, cache: &Path) -> anyhow::Result<()> {
    let (mut sum, mut frames, mut worst) = (0, 0, (0, 0));
    for (k, frame) in clip.frames.iter().enumerate() {
        let found = woven_cloth::crossings(&frame.positions, &clip.mesh);
        sum += found;
        frames += usize::from(found > 0);
        worst = worst.max((found, k));
    }
    let (first, second) = clip.layers();
    let mut strain = 0.0f32;
    for layer in std::iter::once(&first).chain(&second) {
        for frame in &layer.frames {
            for [warp, weft, _] in woven_cloth::weave_strain(&layer.mesh, &frame.positions) {
                strain = strain.max(warp.abs()).max(weft.abs());
            }
        }
    }
    println!(
        "{}: at rest {} crossings; in {} of {} frames {sum} (an edge through a triangle), most in frame {}: {}; largest strain at a vertex {:.2} %",
        cache.display(),
        woven_cloth::crossings(&clip.mesh.positions, &clip.mesh),
        frames,
        clip.frames.len(),
        worst.1,
        worst.0,
        strain * 100.0
    );
    Ok(())
}
