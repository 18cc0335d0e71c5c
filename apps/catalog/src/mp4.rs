//! A small MP4 writer for one silent H.264 track: the index (`moov`) in front, so that a browser can start and seek at once.
//!
//! ISO/IEC 14496-12 (boxes) and 14496-15 (`avc1`, `avcC`). Written here because the published muxers put the index last or
//! cannot say which colours the video has (`colr`), and because its bytes depend on the samples alone: no clock, no random ids.

use anyhow::{Context as _, Result, ensure};

/// One coded picture, as length-prefixed NAL units (four bytes, big endian) without parameter sets.
pub struct Sample {
    /// The bytes as they go into `mdat`.
    pub data: Vec<u8>,
    /// True for a picture that can be decoded alone (IDR): a place to seek to.
    pub sync: bool,
}

/// A video track of constant frame rate.
pub struct Track {
    /// Width in pixels.
    pub width: u16,
    /// Height in pixels.
    pub height: u16,
    /// Frames per second.
    pub fps: u32,
    /// The sequence parameter set, without start code.
    pub sps: Vec<u8>,
    /// The picture parameter set, without start code.
    pub pps: Vec<u8>,
    /// The pictures in the order of display, which is also the order of decoding (no B pictures).
    pub samples: Vec<Sample>,
}

/// Ticks a frame takes; the time scale is `fps` times this, so that every frame lies on a whole tick.
const TICKS: u32 = 512;

/// The bytes of the MP4 file.
///
/// # Errors
/// When the track is empty, has no usable parameter sets, or exceeds the 4 GiB that 32-bit offsets can name.
pub fn write(track: &Track) -> Result<Vec<u8>> {
    ensure!(
        !track.samples.is_empty(),
        "A video needs at least one frame; this one has none."
    );
    ensure!(track.fps > 0, "A video needs a frame rate above zero.");
    ensure!(
        track.sps.len() >= 4 && !track.pps.is_empty(),
        "The H.264 encoder gave no parameter sets, so the video cannot be described."
    );

    let ftyp = ftyp();
    // `moov` names the place of the first sample, which depends on its own length but not on its own contents: measure, then write.
    let measured = moov(track, 0)?.len();
    let first = ftyp.len() + measured + 8;
    let payload: usize = track.samples.iter().map(|s| s.data.len()).sum();
    let end = u32::try_from(first + payload)
        .context("The video exceeds 4 GiB; use fewer or smaller frames.")?;

    let mut out = Vec::with_capacity(end as usize);
    out.extend_from_slice(&ftyp);
    out.extend_from_slice(&moov(track, u32::try_from(first)?)?);
    out.extend_from_slice(&u32::try_from(payload + 8)?.to_be_bytes());
    out.extend_from_slice(b"mdat");
    for sample in &track.samples {
        out.extend_from_slice(&sample.data);
    }
    Ok(out)
}

/// A box under construction; `end` fills in its length.
struct Boxed(Vec<u8>);

impl Boxed {
    fn new(kind: &[u8; 4]) -> Self {
        let mut bytes = vec![0; 4];
        bytes.extend_from_slice(kind);
        Self(bytes)
    }

    /// A box with the version and flags word.
    fn full(kind: &[u8; 4], version: u8, flags: u32) -> Self {
        Self::new(kind).u32(u32::from(version) << 24 | flags)
    }

    fn u8(mut self, value: u8) -> Self {
        self.0.push(value);
        self
    }

    fn u16(mut self, value: u16) -> Self {
        self.0.extend_from_slice(&value.to_be_bytes());
        self
    }

    fn u32(mut self, value: u32) -> Self {
        self.0.extend_from_slice(&value.to_be_bytes());
        self
    }

    fn bytes(mut self, value: &[u8]) -> Self {
        self.0.extend_from_slice(value);
        self
    }

    fn end(mut self) -> Vec<u8> {
        // Boxes here hold tables of a few bytes a frame; `write` has bounded the frames.
        let length = self.0.len() as u32;
        self.0[..4].copy_from_slice(&length.to_be_bytes());
        self.0
    }
}

/// The identity matrix of `mvhd` and `tkhd` (16.16 and 2.30 fixed point).
const IDENTITY: [u32; 9] = [0x1_0000, 0, 0, 0, 0x1_0000, 0, 0, 0, 0x4000_0000];

fn identity(mut b: Boxed) -> Boxed {
    for value in IDENTITY {
        b = b.u32(value);
    }
    b
}

fn ftyp() -> Vec<u8> {
    Boxed::new(b"ftyp")
        .bytes(b"isom")
        .u32(512)
        .bytes(b"isomiso2avc1mp41")
        .end()
}

fn moov(track: &Track, first: u32) -> Result<Vec<u8>> {
    let count = u32::try_from(track.samples.len())?;
    let timescale = track
        .fps
        .checked_mul(TICKS)
        .context("The frame rate is too high for a video.")?;
    let duration = count
        .checked_mul(TICKS)
        .context("The video has too many frames.")?;

    // Times of creation are left at zero: the same frames give the same bytes.
    let mvhd = Boxed::full(b"mvhd", 0, 0)
        .u32(0)
        .u32(0)
        .u32(timescale)
        .u32(duration);
    let mvhd = mvhd.u32(0x1_0000).u16(0x100).bytes(&[0; 10]); // rate 1, volume 1
    let mvhd = identity(mvhd).bytes(&[0; 24]).u32(2).end(); // next track id 2

    let tkhd = Boxed::full(b"tkhd", 0, 3)
        .u32(0)
        .u32(0)
        .u32(1)
        .u32(0)
        .u32(duration);
    let tkhd = identity(tkhd.bytes(&[0; 16])); // layer, group, volume: none
    let tkhd = tkhd
        .u32(u32::from(track.width) << 16)
        .u32(u32::from(track.height) << 16)
        .end();

    let mdhd = Boxed::full(b"mdhd", 0, 0)
        .u32(0)
        .u32(0)
        .u32(timescale)
        .u32(duration)
        .u16(0x55c4)
        .u16(0)
        .end(); // "und"
    let hdlr = Boxed::full(b"hdlr", 0, 0)
        .u32(0)
        .bytes(b"vide")
        .bytes(&[0; 12])
        .bytes(b"VideoHandler\0")
        .end();
    let vmhd = Boxed::full(b"vmhd", 0, 1).bytes(&[0; 8]).end();
    let url = Boxed::full(b"url ", 0, 1).end(); // the samples are in this file
    let dref = Boxed::full(b"dref", 0, 0).u32(1).bytes(&url).end();
    let dinf = Boxed::new(b"dinf").bytes(&dref).end();

    let stbl = Boxed::new(b"stbl")
        .bytes(&stsd(track)?)
        .bytes(&timing(count))
        .bytes(&sync_table(track))
        .bytes(&places(track, first)?)
        .end();
    let minf = Boxed::new(b"minf")
        .bytes(&vmhd)
        .bytes(&dinf)
        .bytes(&stbl)
        .end();
    let mdia = Boxed::new(b"mdia")
        .bytes(&mdhd)
        .bytes(&hdlr)
        .bytes(&minf)
        .end();
    let trak = Boxed::new(b"trak").bytes(&tkhd).bytes(&mdia).end();
    Ok(Boxed::new(b"moov").bytes(&mvhd).bytes(&trak).end())
}

/// What the samples are: `avc1` with `avcC` (parameter sets), `colr` (Rec.709, limited range) and square pixels.
fn stsd(track: &Track) -> Result<Vec<u8>> {
    let sps_len =
        u16::try_from(track.sps.len()).context("The H.264 sequence parameter set is too long.")?;
    let pps_len =
        u16::try_from(track.pps.len()).context("The H.264 picture parameter set is too long.")?;
    let avcc = Boxed::new(b"avcC").u8(1).bytes(&track.sps[1..4]).u8(0xff); // profile, constraints, level; 4-byte lengths
    let avcc = avcc
        .u8(0xe1)
        .u16(sps_len)
        .bytes(&track.sps)
        .u8(1)
        .u16(pps_len)
        .bytes(&track.pps);
    // High profiles tell the chroma format and the bit depths too (14496-15, 5.3.3.1.2).
    let avcc = if track.sps[1] >= 100 {
        avcc.bytes(&[0xfd, 0xf8, 0xf8, 0])
    } else {
        avcc
    }
    .end();
    let colr = Boxed::new(b"colr")
        .bytes(b"nclx")
        .u16(1)
        .u16(1)
        .u16(1)
        .u8(0)
        .end();
    let pasp = Boxed::new(b"pasp").u32(1).u32(1).end();
    let avc1 = Boxed::new(b"avc1")
        .bytes(&[0; 6])
        .u16(1)
        .bytes(&[0; 16])
        .u16(track.width)
        .u16(track.height);
    let avc1 = avc1
        .u32(0x48_0000)
        .u32(0x48_0000)
        .u32(0)
        .u16(1)
        .bytes(&[0; 32])
        .u16(24)
        .u16(0xffff); // 72 dpi, 24 bits
    let avc1 = avc1.bytes(&avcc).bytes(&colr).bytes(&pasp).end();
    Ok(Boxed::full(b"stsd", 0, 0).u32(1).bytes(&avc1).end())
}

fn timing(count: u32) -> Vec<u8> {
    Boxed::full(b"stts", 0, 0)
        .u32(1)
        .u32(count)
        .u32(TICKS)
        .end()
}

fn sync_table(track: &Track) -> Vec<u8> {
    let numbers: Vec<u32> = (1..)
        .zip(&track.samples)
        .filter(|(_, s)| s.sync)
        .map(|(n, _)| n)
        .collect();
    let mut stss = Boxed::full(b"stss", 0, 0).u32(numbers.len() as u32);
    for n in numbers {
        stss = stss.u32(n);
    }
    stss.end()
}

/// Sizes and places: all samples lie in one chunk that begins at byte `first`.
fn places(track: &Track, first: u32) -> Result<Vec<u8>> {
    let count = u32::try_from(track.samples.len())?;
    let mut stsz = Boxed::full(b"stsz", 0, 0).u32(0).u32(count);
    for sample in &track.samples {
        stsz = stsz.u32(u32::try_from(sample.data.len())?);
    }
    let mut out = Boxed::full(b"stsc", 0, 0)
        .u32(1)
        .u32(1)
        .u32(count)
        .u32(1)
        .end();
    out.extend_from_slice(&stsz.end());
    out.extend_from_slice(&Boxed::full(b"stco", 0, 0).u32(1).u32(first).end());
    Ok(out)
}
