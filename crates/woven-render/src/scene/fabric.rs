//! A fabric as a material of the scene: the fitted sheet of a fabric file with its map of openness and its two sides, or a
//! measured table rendered as it is.

use super::{Material, Texture, TextureUse};
use anyhow::{Context, Result, ensure};
use std::path::Path;
use woven_bsdf::fabric::Fabric;
use woven_bsdf::measured::klems::Klems;
use woven_bsdf::measured::table::Tabulated;
use woven_bsdf::weave::map::OpennessMap;

/// Replaces the optics of `material` by those of a file; its emission stays, its textures go. An XML file is a measurement
/// (Klems matrix or tensor tree), of which the visible band is rendered; any other one is a fabric file, see [`wear`].
///
/// # Errors
/// A sentence when the file cannot be read or its model is no sheet.
pub fn dress(material: &mut Material, file: &Path, textures: &mut Vec<Texture>) -> Result<()> {
    let name = material.name.clone();
    let of = || format!("the fabric of material '{name}'");
    if file
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("xml"))
    {
        let measured = Klems::read(file)
            .and_then(|k| Tabulated::new(&k, "Visible"))
            .map_err(|e| anyhow::anyhow!("{e}"))
            .with_context(of)?;
        *material = Material {
            emission: material.emission,
            double_sided: material.double_sided,
            layer: material.layer,
            ..Material::measured(&material.name, measured)
        };
        return Ok(());
    }
    let fabric = Fabric::read(file)
        .map_err(|e| anyhow::anyhow!("{e}"))
        .with_context(of)?;
    let folder = file.parent().unwrap_or_else(|| Path::new(""));
    wear(material, &fabric, folder, textures).with_context(of)
}

/// The same with a fabric that has been read: its sheet, the colours of its other side, and its map of openness, a picture in
/// `folder` that becomes one of `textures`.
///
/// # Errors
/// A sentence when its model is no sheet, a parameter is out of range or the map cannot be used.
pub fn wear(
    material: &mut Material,
    fabric: &Fabric,
    folder: &Path,
    textures: &mut Vec<Texture>,
) -> Result<()> {
    let optics = fabric.optics()?;
    let back = fabric.optics_back()?;
    ensure!(
        optics.model.name == "sheet",
        "the fabric \"{}\" uses the model '{}'; only 'sheet' can be rendered: fit it with --model sheet",
        fabric.name,
        optics.model.name
    );
    let map = fabric
        .weave
        .as_ref()
        .filter(|w| !w.openness_map.is_empty())
        .map(|w| openness_map(folder, &w.openness_map).map(|map| (w, map)))
        .transpose()?;
    let single = |linear: [[f64; 3]; _]| linear.map(|k| k.map(|v| v as f32));
    material.measured = None;
    material.linear = single(optics.linear);
    material.back = (back.linear != optics.linear).then(|| single(back.linear));
    material.shape = optics.shape.map(|v| v as f32);
    material.color_texture = None;
    material.coverage_texture = None;
    material.normal_texture = None;
    material.alpha_cutoff = None;
    material.multiplies = false;
    if let Some((weave, map)) = map {
        let texture = Texture::of_openness(&weave.openness_map, &map, weave.map_multiplies);
        textures.push(texture);
        let [u, v] = weave
            .map_repeats
            .map(|r| if r == 0.0 { 1.0 } else { r as f32 });
        material.coverage_texture = Some(TextureUse {
            texture: textures.len() - 1,
            transform: [[u, 0.0, 0.0], [0.0, v, 0.0]],
        });
        material.multiplies = weave.map_multiplies;
    }
    Ok(())
}

/// Reads a map of openness from the picture `name` in `folder`: its luminance, white open.
///
/// # Errors
/// A sentence when the name leaves the folder, or it is no picture of at most 64 megapixels.
pub fn openness_map(folder: &Path, name: &str) -> Result<OpennessMap> {
    ensure!(
        Path::new(name).file_name().is_some_and(|f| f == name),
        "the openness map {name:?} must lie beside the fabric file: give a file name without folders"
    );
    let path = folder.join(name);
    let mut reader = image::ImageReader::open(&path)
        .and_then(image::ImageReader::with_guessed_format)
        .with_context(|| format!("cannot read the openness map {}", path.display()))?;
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(256 << 20);
    (limits.max_image_width, limits.max_image_height) = (Some(8192), Some(8192));
    reader.limits(limits);
    let picture = reader
        .decode()
        .with_context(|| format!("the openness map {} is no picture", path.display()))?
        .into_luma8();
    let (w, h) = picture.dimensions();
    let values = picture.iter().map(|p| f32::from(*p) / 255.0).collect();
    OpennessMap::new(w as usize, h as usize, values).map_err(|e| anyhow::anyhow!("{e}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A lace with colours of its own behind and a map of 2 × 1 thirds.
    const LACE: &str = "
name = \"lace\"
[weave]
warp_diameter_mm = 0.2
warp_pitch_mm = 0.5
weft_diameter_mm = 0.2
weft_pitch_mm = 0.5
openness_map = \"holes.png\"
map_repeats = [3, 0]
[optics]
model = \"sheet\"
[optics.parameters]
t_d = 0.3
r_d = 0.4
[optics.colors]
r_d = [1.0, 0.5, 0.25]
r_d_back = [0.25, 0.5, 1.0]
";

    fn dressed(folder: &Path, text: &str) -> Result<(Material, Vec<Texture>)> {
        let file = folder.join("lace.toml");
        std::fs::write(&file, text)?;
        let mut material = Material::matt("panel", [0.7; 3]);
        (material.emission, material.color_texture) = ([2.0; 3], Some(TextureUse::plain(0)));
        let mut textures = vec![Texture::default()];
        dress(&mut material, &file, &mut textures).map(|()| (material, textures))
    }

    #[test]
    fn a_fabric_file_brings_its_map_and_both_sides() {
        let folder = tempfile::tempdir().unwrap();
        let map = image::GrayImage::from_raw(2, 1, vec![0, 255]).unwrap();
        map.save(folder.path().join("holes.png")).unwrap();
        let (material, textures) = dressed(folder.path(), LACE).unwrap();
        assert_eq!(material.linear[0], [0.3; 3]);
        assert_eq!(material.linear[2], [0.4, 0.2, 0.1]);
        assert_eq!(material.back.unwrap()[2], [0.1, 0.2, 0.4]);
        assert_eq!(material.emission, [2.0; 3]);
        assert!(material.color_texture.is_none());
        let cover = material.coverage_texture.unwrap();
        assert_eq!(cover.transform, [[3.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        // White is open: its alpha, the share that is covered, is nothing.
        let alpha: Vec<u8> = textures[cover.texture]
            .pixels
            .iter()
            .map(|p| p[3])
            .collect();
        assert_eq!(alpha[..2], [255, 0]);
    }

    #[test]
    fn what_cannot_be_worn_is_refused_with_a_sentence() {
        let folder = tempfile::tempdir().unwrap();
        let told = |text: &str| match dressed(folder.path(), text) {
            Ok(_) => panic!("taken: {text}"),
            Err(e) => format!("{e:#}"),
        };
        let missing = told(LACE);
        assert!(
            missing.contains("cannot read the openness map") && missing.contains("panel"),
            "{missing}"
        );
        std::fs::write(folder.path().join("holes.png"), "no picture").unwrap();
        assert!(told(LACE).contains("is no picture"));
        let outside = told(&LACE.replace("holes.png", "../holes.png"));
        assert!(
            outside.contains("must lie beside the fabric file"),
            "{outside}"
        );
        let lambert = "name = \"matt\"\n[optics]\nmodel = \"lambert\"\n";
        assert!(told(lambert).contains("fit it with --model sheet"));
    }

    #[test]
    fn an_xml_file_is_worn_as_it_was_measured() {
        let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/measurements");
        let file = std::fs::read_dir(assets)
            .unwrap()
            .map(|f| f.unwrap().path())
            .find(|f| f.extension().is_some_and(|e| e == "xml"))
            .unwrap();
        let mut material = Material::lamp("panel", [2.0; 3], true);
        dress(&mut material, &file, &mut Vec::new()).unwrap();
        assert_eq!((material.emission, material.double_sided), ([2.0; 3], true));
        assert!(material.measured.is_some());
    }
}
