//! OpenEXR files: a film as one file with layers and metadata, and back; a file too large for memory is refused by its header.

use crate::atomic::write_atomically;
use crate::film::{BEAUTY, Film};
use anyhow::{Context, Result, anyhow, bail, ensure};
use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer};
use exr::meta::attribute::{SampleType, Text};
use exr::meta::header::{Header, LayerAttributes};
use exr::prelude::{ReadChannels, ReadLayers, WritableImage};
use std::collections::BTreeMap;
use std::io::{BufReader, Cursor, Read};
use std::path::Path;

/// Decoded samples of one file may take this many bytes unless told otherwise: 2 GiB.
pub const DEFAULT_LIMIT: u64 = 2 << 30;

/// A file may unfold to this many bytes however small it is ...
const FREE: u64 = 256 << 20;
/// ... and to this many more for each of its own bytes. Rendered light unfolds 2 to 10 times; a black picture a thousand times.
const UNFOLDS: u64 = 64;
/// Pictures of fewer pixels than this are decoded without starting threads for it.
const SMALL: u64 = 1 << 18;

/// A file holds at most this many channels.
const MAX_CHANNELS: usize = 1024;

/// The letters under which the three numbers of a layer are stored.
fn letters(layer: &str) -> &'static [&'static str] {
    match layer {
        "depth" | "variance" => &["Z"],
        "normal" | "position" | "motion" => &["X", "Y", "Z"],
        _ => &["R", "G", "B"],
    }
}

/// Writes a film, atomically. "beauty" becomes R, G, B; every other layer `name.R`, ...; normals X, Y, Z; depth and
/// variance a single Z. All samples are 32-bit floats, ZIP compressed. The metadata is JSON in the `comments` attribute,
/// so that the same film gives the same bytes.
///
/// # Errors
/// When the film is empty or the file cannot be written.
pub fn write(film: &Film, path: &Path) -> Result<()> {
    ensure!(
        film.width > 0 && film.height > 0,
        "a film of {} x {} pixels cannot be written",
        film.width,
        film.height
    );
    ensure!(
        !film.layers.is_empty(),
        "the film has no layer, so {} is not written",
        path.display()
    );
    let mut list = Vec::new();
    for layer in &film.layers {
        for (k, letter) in letters(&layer.name).iter().enumerate() {
            let name = if layer.name == BEAUTY {
                (*letter).to_string()
            } else {
                format!("{}.{letter}", layer.name)
            };
            let text = Text::new_or_none(&name)
                .ok_or_else(|| anyhow!("'{name}' cannot be the name of an EXR channel"))?;
            let samples = layer.pixels.iter().map(|p| p[k]).collect();
            list.push(AnyChannel::new(text, FlatSamples::F32(samples)));
        }
    }
    let mut attributes = LayerAttributes {
        software_name: Text::new_or_none(concat!("woven-render ", env!("CARGO_PKG_VERSION"))),
        ..LayerAttributes::default()
    };
    if !film.metadata.is_empty() {
        // EXR text is Latin-1; the JSON keeps to ASCII by escaping the rest.
        attributes.comments = Text::new_or_none(ascii(&serde_json::to_string(&film.metadata)?));
    }
    let channels = AnyChannels::sort(list.into());
    let layer = Layer::new(
        (film.width, film.height),
        attributes,
        Encoding::SMALL_LOSSLESS,
        channels,
    );
    let image = Image::from_layer(layer);
    let mut bytes = Cursor::new(Vec::new());
    image
        .write()
        .to_buffered(&mut bytes)
        .map_err(|e| anyhow!("encoding {} failed: {e}", path.display()))?;
    write_atomically(path, |out| {
        Ok(std::io::Write::write_all(out, bytes.get_ref())?)
    })
}

fn ascii(json: &str) -> String {
    let mut out = String::with_capacity(json.len());
    let mut units = [0_u16; 2];
    for c in json.chars() {
        if c.is_ascii() {
            out.push(c);
        } else {
            c.encode_utf16(&mut units)
                .iter()
                .for_each(|u| out.push_str(&format!("\\u{u:04x}")));
        }
    }
    out
}

/// Reads a film with the default limit of 2 GiB of samples.
///
/// # Errors
/// See [`read_limited`].
pub fn read(path: &Path) -> Result<Film> {
    read_limited(path, DEFAULT_LIMIT)
}

/// Reads every flat layer of an EXR file; channels are gathered by the name before their last dot, and R, G, B without
/// a name are "beauty". Half and integer samples become f32; a single channel fills all three numbers.
///
/// # Errors
/// A sentence when the file cannot be read, is not OpenEXR, is broken, has deep data, or its samples would take more
/// than `limit` bytes (told from the header, before anything is decoded).
pub fn read_limited(path: &Path, limit: u64) -> Result<Film> {
    let file =
        std::fs::File::open(path).with_context(|| format!("cannot open {}", path.display()))?;
    let length = file.metadata().map_or(0, |m| m.len());
    // The compressed file cannot sensibly be larger than what it holds.
    ensure!(
        length <= limit,
        "{} is {length} bytes long, more than the limit of {limit}",
        path.display()
    );
    let mut bytes = Vec::new();
    BufReader::new(file)
        .take(limit)
        .read_to_end(&mut bytes)
        .with_context(|| format!("cannot read {}", path.display()))?;
    decode(&bytes, limit).with_context(|| format!("cannot read {}", path.display()))
}

/// [`read_limited`] from bytes in memory.
///
/// # Errors
/// See [`read_limited`].
pub fn decode(bytes: &[u8], limit: u64) -> Result<Film> {
    let meta = exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false)
        .map_err(|e| anyhow!("not a whole OpenEXR file: {e}"))?;
    check_headers(
        &meta.headers,
        limit.min(FREE + UNFOLDS * bytes.len() as u64),
    )?;
    let small = |h: &Header| (h.layer_size.0 as u64) * (h.layer_size.1 as u64) < SMALL;
    let mut reader = exr::image::read::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes();
    if meta.headers.iter().all(small) {
        reader = reader.non_parallel();
    }
    let image = reader
        .from_buffered(Cursor::new(bytes))
        .map_err(|e| anyhow!("the OpenEXR data is broken: {e}"))?;
    let first = image
        .layer_data
        .first()
        .ok_or_else(|| anyhow!("the file has no layer"))?;
    let (width, height) = (first.size.0, first.size.1);
    ensure!(width > 0 && height > 0, "the picture has no pixels");
    let mut groups: BTreeMap<String, BTreeMap<String, Vec<f32>>> = BTreeMap::new();
    let mut metadata = BTreeMap::new();
    for layer in &image.layer_data {
        ensure!(
            layer.size == first.size,
            "the file's parts have different sizes, which is not supported"
        );
        if let Some(found) = layer
            .attributes
            .comments
            .as_ref()
            .and_then(|t| serde_json::from_str(&t.to_string()).ok())
        {
            metadata = found;
        }
        let part = layer
            .attributes
            .layer_name
            .as_ref()
            .map(ToString::to_string)
            .filter(|_| image.layer_data.len() > 1);
        for channel in &layer.channel_data.list {
            ensure!(
                channel.sampling.0 == 1 && channel.sampling.1 == 1,
                "subsampled channels ({}) are not supported",
                channel.name
            );
            let full = channel.name.to_string();
            let (group, letter) = full.rsplit_once('.').unwrap_or(("", &full));
            let group = match (&part, group) {
                (Some(part), "") => part.clone(),
                (_, "") => BEAUTY.to_string(),
                (_, named) => named.to_string(),
            };
            let samples: Vec<f32> = channel.sample_data.values_as_f32().collect();
            ensure!(
                samples.len() == width * height,
                "channel {full} does not have the picture's size"
            );
            groups
                .entry(group)
                .or_default()
                .insert(letter.to_string(), samples);
        }
    }
    let mut film = Film::new(width, height);
    film.metadata = metadata;
    // The picture first, then by name.
    let mut names: Vec<String> = groups.keys().cloned().collect();
    names.sort_by_key(|n| (n != BEAUTY, n.clone()));
    for name in names {
        let channels = &groups[&name];
        let pick = |trio: [&str; 3]| -> Option<[&Vec<f32>; 3]> {
            Some([
                channels.get(trio[0])?,
                channels.get(trio[1])?,
                channels.get(trio[2])?,
            ])
        };
        let three = pick(["R", "G", "B"])
            .or_else(|| pick(["X", "Y", "Z"]))
            .or_else(|| pick(["r", "g", "b"]));
        let pixels = match (three, channels.values().next()) {
            (Some([r, g, b]), _) => (0..width * height).map(|i| [r[i], g[i], b[i]]).collect(),
            (None, Some(one)) => one.iter().map(|&v| [v; 3]).collect(),
            (None, None) => continue,
        };
        film.push(&name, pixels);
    }
    if film.layers.is_empty() {
        bail!("the file has no channel that could be a picture");
    }
    Ok(film)
}

fn check_headers(headers: &[Header], limit: u64) -> Result<()> {
    let mut total = 0_u64;
    let mut channels = 0;
    for header in headers {
        ensure!(
            !header.deep,
            "deep EXR data is not supported; flatten the file first"
        );
        let (w, h) = (header.layer_size.0 as u64, header.layer_size.1 as u64);
        ensure!(
            w <= 1 << 20 && h <= 1 << 20,
            "the header claims {w} x {h} pixels, more than any picture has"
        );
        channels += header.channels.list.len();
        for channel in &header.channels.list {
            // As stored, widened to f32, and once more in the film: a lone channel fills three numbers.
            let size = match channel.sample_type {
                SampleType::F16 => 2 + 4 + 4,
                SampleType::F32 | SampleType::U32 => 4 + 4 + 4,
            };
            total = total.saturating_add(w.saturating_mul(h).saturating_mul(size));
        }
    }
    ensure!(
        channels <= MAX_CHANNELS,
        "the file has {channels} channels; at most {MAX_CHANNELS} are read"
    );
    ensure!(
        total <= limit,
        "decoding would take {} MiB, more than the limit of {} MiB",
        total >> 20,
        limit >> 20
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Film {
        let mut film = Film::of_beauty(
            7,
            5,
            (0..35).map(|i| [i as f32 * 0.1, -1.5, 1e20]).collect(),
        );
        film.push(
            "light.sun",
            (0..35).map(|i| [0.0, 1.0 / (i + 1) as f32, 3.0]).collect(),
        );
        film.push("normal", vec![[0.0, 1.0, -0.25]; 35]);
        film.push("depth", (0..35).map(|i| [i as f32; 3]).collect());
        film.metadata.insert("seed".into(), "7".into());
        film.metadata
            .insert("fabric".into(), "Spitze \u{e9}\u{1f9f5}".into());
        film
    }

    #[test]
    fn layers_and_metadata_come_back_bit_for_bit() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.exr");
        let film = sample();
        write(&film, &path).unwrap();
        let back = read(&path).unwrap();
        assert_eq!(back.metadata, film.metadata);
        assert_eq!(back.layers.len(), film.layers.len());
        for layer in &film.layers {
            assert_eq!(
                back.layer(&layer.name),
                Some(layer.pixels.as_slice()),
                "{}",
                layer.name
            );
        }
    }

    #[test]
    fn the_same_film_gives_the_same_bytes() {
        let dir = tempfile::tempdir().unwrap();
        let (a, b) = (dir.path().join("a.exr"), dir.path().join("b.exr"));
        write(&sample(), &a).unwrap();
        write(&sample(), &b).unwrap();
        assert_eq!(std::fs::read(a).unwrap(), std::fs::read(b).unwrap());
    }

    #[test]
    fn a_large_picture_is_refused_by_its_header() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.exr");
        write(&sample(), &path).unwrap();
        let err = read_limited(&path, 900).unwrap_err();
        assert!(format!("{err:#}").contains("limit"), "{err:#}");
    }

    #[test]
    fn what_is_no_exr_is_a_sentence() {
        for bytes in [&b""[..], b"PNG", &[0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0]] {
            let err = decode(bytes, DEFAULT_LIMIT).unwrap_err();
            assert!(format!("{err:#}").contains("OpenEXR"), "{err:#}");
        }
    }
}
