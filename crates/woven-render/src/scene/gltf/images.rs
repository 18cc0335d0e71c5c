//! Pictures of a scene: found by the rules for URIs, measured before they are decoded, decoded once.

use super::container::{Limits, read_file};
use super::uri::{self, Source};
use crate::scene::{Texture, Wrap};
use anyhow::{Context, Result, anyhow, ensure};
use gltf::image::Source as ImageSource;
use gltf::texture::WrappingMode;
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;
use std::rc::Rc;

/// Greatest width or height of a picture.
const MAX_SIDE: u32 = 16_384;
/// All pictures of a scene may unfold to this many bytes ...
const FREE: u64 = 192 << 20;
/// ... and to this many more for each byte that they have in their files. Photographs unfold 3 to 20 times, drawings 100 times; what
/// unfolds a thousand times is one even colour or a bomb.
const UNFOLDS: u64 = 64;

/// One decoded picture: width, height, RGBA rows from the top.
type Decoded = Rc<Pixels>;

/// The pictures met so far.
pub(super) struct Pictures<'a> {
    document: &'a gltf::Document,
    base: &'a Path,
    buffers: &'a [Vec<u8>],
    limits: &'a Limits,
    spent: u64,
    /// Bytes of the pictures' files so far.
    read: u64,
    decoded: BTreeMap<usize, Decoded>,
    known: BTreeMap<(usize, bool), usize>,
    /// Textures of the scene, in the order they were first used.
    pub(super) textures: Vec<Texture>,
}

impl<'a> Pictures<'a> {
    pub(super) fn new(
        document: &'a gltf::Document,
        base: &'a Path,
        buffers: &'a [Vec<u8>],
        limits: &'a Limits,
    ) -> Self {
        Pictures {
            document,
            base,
            buffers,
            limits,
            spent: 0,
            read: 0,
            decoded: BTreeMap::new(),
            known: BTreeMap::new(),
            textures: Vec::new(),
        }
    }

    /// Number of the scene's texture for a glTF texture, loaded at first use.
    pub(super) fn texture(&mut self, texture: &gltf::Texture<'_>, srgb: bool) -> Result<usize> {
        if let Some(&n) = self.known.get(&(texture.index(), srgb)) {
            return Ok(n);
        }
        let picture = self.picture(&texture.source())?;
        let wrap = |m| match m {
            WrappingMode::Repeat => Wrap::Repeat,
            WrappingMode::MirroredRepeat => Wrap::Mirror,
            WrappingMode::ClampToEdge => Wrap::Clamp,
        };
        let sampler = texture.sampler();
        self.count(picture.2.len() as u64 * 4)?;
        self.textures.push(Texture {
            name: texture
                .name()
                .map_or_else(|| format!("texture {}", texture.index()), str::to_owned),
            width: picture.0,
            height: picture.1,
            pixels: picture.2.clone(),
            srgb,
            wrap_u: wrap(sampler.wrap_s()),
            wrap_v: wrap(sampler.wrap_t()),
        });
        self.known
            .insert((texture.index(), srgb), self.textures.len() - 1);
        Ok(self.textures.len() - 1)
    }

    /// A copy of a colour texture with `veil` over it: (under c + veil) / (under + veil), so that with the factor under + veil
    /// only what lies under the veil takes the picture's colour.
    pub(super) fn veiled(
        &mut self,
        texture: usize,
        under: [f32; 3],
        veil: [f32; 3],
    ) -> Result<usize> {
        self.count(self.textures[texture].pixels.len() as u64 * 4)?;
        let mut copy = self.textures[texture].clone();
        for c in 0..3 {
            let all = (under[c] + veil[c]).max(1e-6);
            let table: Vec<u8> = (0..=255_u8)
                .map(|b| {
                    let below = crate::film::srgb_decode(f32::from(b) / 255.0) * under[c];
                    let seen = crate::film::srgb_encode(((below + veil[c]) / all).clamp(0.0, 1.0));
                    (seen * 255.0 + 0.5) as u8
                })
                .collect();
            copy.pixels
                .iter_mut()
                .for_each(|p| p[c] = table[p[c] as usize]);
        }
        self.textures.push(copy);
        Ok(self.textures.len() - 1)
    }

    /// Mean of the four channels as stored, 0..=1.
    pub(super) fn mean(&mut self, texture: &gltf::Texture<'_>) -> Result<[f32; 4]> {
        let picture = self.picture(&texture.source())?;
        let mut sum = [0_u64; 4];
        for p in &picture.2 {
            sum.iter_mut().zip(p).for_each(|(s, v)| *s += u64::from(*v));
        }
        Ok(sum.map(|s| (s as f64 / 255.0 / picture.2.len() as f64) as f32))
    }

    /// [`Pictures::mean`] of the texture with this number.
    pub(super) fn mean_of(&mut self, index: usize) -> Result<[f32; 4]> {
        let texture = self
            .document
            .textures()
            .nth(index)
            .with_context(|| format!("there is no texture {index}"))?;
        self.mean(&texture)
    }

    fn count(&mut self, bytes: u64) -> Result<()> {
        self.spent += bytes;
        let limit = self.limits.pictures.min(FREE + UNFOLDS * self.read);
        ensure!(
            self.spent <= limit,
            "the pictures take more than {} MiB when decoded, too much for {} KiB of files; save them smaller",
            limit >> 20,
            self.read >> 10
        );
        Ok(())
    }

    fn picture(&mut self, image: &gltf::Image<'_>) -> Result<Decoded> {
        if let Some(d) = self.decoded.get(&image.index()) {
            return Ok(d.clone());
        }
        let told = || {
            format!(
                "images[{}]{}",
                image.index(),
                image.name().map(|n| format!(" '{n}'")).unwrap_or_default()
            )
        };
        let owned;
        let bytes = match image.source() {
            ImageSource::View { view, .. } => {
                let buffer = self
                    .buffers
                    .get(view.buffer().index())
                    .map_or(&[][..], Vec::as_slice);
                buffer
                    .get(view.offset()..view.offset().saturating_add(view.length()))
                    .with_context(|| format!("{}: its bytes lie beyond the buffer", told()))?
            }
            ImageSource::Uri { uri, .. } => {
                owned = match uri::resolve(self.base, uri).with_context(told)? {
                    Source::Data(bytes) => bytes,
                    Source::File(path) => read_file(&path, self.limits.file)?,
                };
                &owned
            }
        };
        self.read += bytes.len() as u64;
        let bytes = &plain(bytes).with_context(told)?;
        let (format, w, h) = measure(bytes).with_context(told)?;
        self.count((u64::from(w) * u64::from(h)).saturating_mul(4))
            .with_context(told)?;
        let picture = Rc::new(decode(bytes, format, w, h).with_context(told)?);
        self.decoded.insert(image.index(), picture.clone());
        Ok(picture)
    }
}

/// Width, height, RGBA rows from the top.
type Pixels = (u32, u32, Vec<[u8; 4]>);

/// Decodes one PNG or JPEG after its header has been measured.
///
/// # Errors
/// A sentence when it is neither, is broken, or unfolds to more than [`FREE`] and [`UNFOLDS`] times its bytes.
pub fn decode_picture(bytes: &[u8]) -> Result<Pixels> {
    let bytes = &plain(bytes)?;
    let (format, w, h) = measure(bytes)?;
    ensure!(
        (u64::from(w) * u64::from(h)).saturating_mul(4) <= FREE + UNFOLDS * bytes.len() as u64,
        "it claims {w} x {h} pixels in {} bytes; save it smaller",
        bytes.len()
    );
    decode(bytes, format, w, h)
}

/// A checked PNG without what is not needed; any other file as it is.
fn plain(bytes: &[u8]) -> Result<std::borrow::Cow<'_, [u8]>> {
    if !bytes.starts_with(b"\x89PNG") {
        return Ok(bytes.into());
    }
    super::png::check(bytes)?;
    Ok(super::png::plain(bytes))
}

/// Format and sides by the header.
fn measure(bytes: &[u8]) -> Result<(image::ImageFormat, u32, u32)> {
    let format = image::guess_format(bytes)
        .ok()
        .filter(|f| matches!(f, image::ImageFormat::Png | image::ImageFormat::Jpeg));
    let format = format.context("it is neither PNG nor JPEG")?;
    let (w, h) = image::ImageReader::with_format(Cursor::new(bytes), format)
        .into_dimensions()
        .map_err(|e| anyhow!("it cannot be read: {e}"))?;
    ensure!(w > 0 && h > 0, "it has no pixels");
    ensure!(
        w <= MAX_SIDE && h <= MAX_SIDE,
        "it is {w} x {h} pixels; at most {MAX_SIDE} a side are read"
    );
    Ok((format, w, h))
}

fn decode(bytes: &[u8], format: image::ImageFormat, w: u32, h: u32) -> Result<Pixels> {
    let mut reader = image::ImageReader::with_format(Cursor::new(bytes), format);
    // Room for 16-bit RGBA while decoding is the decoder's; what stays is 4 bytes a pixel.
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(
        (u64::from(w) * u64::from(h))
            .saturating_mul(16)
            .saturating_add(1 << 20),
    );
    reader.limits(limits);
    let picture = reader
        .decode()
        .map_err(|e| anyhow!("it cannot be decoded: {e}"))?
        .into_rgba8();
    let pixels = picture
        .as_raw()
        .chunks_exact(4)
        .map(|p| [p[0], p[1], p[2], p[3]])
        .collect();
    Ok((w, h, pixels))
}
