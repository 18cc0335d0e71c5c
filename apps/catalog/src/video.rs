//! Pictures to an H.264 video in an MP4 file that plays in browsers: Rec.709 4:2:0 by OpenH264, muxed by [`crate::mp4`].

use anyhow::{Context as _, Result, bail, ensure};
use image::RgbImage;
use openh264::OpenH264API;
use openh264::encoder::{
    Complexity, Encoder, EncoderConfig, FrameRate, IntraFramePeriod, Level, Profile, QpRange,
    RateControlMode, UsageType, VuiConfig,
};
use openh264::formats::YUVSlices;

use crate::mp4::{self, Sample, Track};

/// The most pixels OpenH264 takes on the longer and the shorter side.
const LARGEST: (u32, u32) = (3840, 2160);

/// Says why a picture of this size cannot become a video, if so: sides even (4:2:0 colour), at least 32, at most 3840×2160.
///
/// # Errors
/// A sentence for the user.
pub fn check_size(width: u32, height: u32) -> Result<()> {
    ensure!(
        width.is_multiple_of(2) && height.is_multiple_of(2),
        "{width}x{height} has an odd side; a video needs even ones, for example 640x480."
    );
    ensure!(
        width.min(height) >= 32,
        "{width}x{height} is too small for a video; the least is 32x32."
    );
    let (long, short) = (width.max(height), width.min(height));
    ensure!(
        long <= LARGEST.0 && short <= LARGEST.1,
        "{width}x{height} is too large for a video; the most is 3840x2160."
    );
    Ok(())
}

/// Encodes `frames`, all of one size, into the bytes of an MP4 file that plays `fps` frames a second and can be seeked every half second.
///
/// The same frames give the same bytes: one thread, no clock.
///
/// # Errors
/// When there is no frame, sizes differ or are unsuitable, a frame cannot be had, or the encoder refuses.
pub fn encode(frames: impl IntoIterator<Item = Result<RgbImage>>, fps: u32) -> Result<Vec<u8>> {
    let config = EncoderConfig::new()
        .usage_type(UsageType::CameraVideoRealTime)
        .profile(Profile::High)
        .level(Level::Level_5_2)
        .complexity(Complexity::High)
        .rate_control_mode(RateControlMode::Bufferbased)
        // Folds and soft walls band easily, and the file is read from a disk: a fine quantiser, no limit on the rate.
        .qp(QpRange::new(18, 22))
        .max_frame_rate(FrameRate::from_hz(fps as f32))
        .intra_frame_period(IntraFramePeriod::from_num_frames((fps / 2).max(1)))
        .skip_frames(false)
        .scene_change_detect(false)
        .background_detection(false)
        .num_threads(1)
        .vui(VuiConfig::bt709());
    let mut encoder = Encoder::with_api_config(OpenH264API::from_source(), config)
        .context("The H.264 encoder did not start")?;

    let mut size = None;
    let (mut sps, mut pps) = (Vec::new(), Vec::new());
    let mut samples = Vec::new();
    for (number, frame) in frames.into_iter().enumerate() {
        let frame = frame?;
        let dims = frame.dimensions();
        check_size(dims.0, dims.1)?;
        let first = *size.get_or_insert(dims);
        ensure!(
            first == dims,
            "Frame {number} is {}x{} but the first one is {}x{}.",
            dims.0,
            dims.1,
            first.0,
            first.1
        );
        let planes = Planes::rec709(&frame);
        let (w, h) = (dims.0 as usize, dims.1 as usize);
        let coded = encoder
            .encode(&YUVSlices::new(
                (&planes.y, &planes.cb, &planes.cr),
                (w, h),
                (w, w / 2, w / 2),
            ))
            .with_context(|| format!("The H.264 encoder refused frame {number}"))?;
        let mut sample = Sample {
            data: Vec::new(),
            sync: false,
        };
        for layer in (0..coded.num_layers()).filter_map(|i| coded.layer(i)) {
            for nal in (0..layer.nal_count()).filter_map(|i| layer.nal_unit(i)) {
                let nal = strip_start_code(nal);
                match nal.first().map(|byte| byte & 0x1f) {
                    None => {}
                    Some(7) => sps = nal.to_vec(),
                    Some(8) => pps = nal.to_vec(),
                    Some(kind) => {
                        sample.sync |= kind == 5;
                        sample
                            .data
                            .extend_from_slice(&u32::try_from(nal.len())?.to_be_bytes());
                        sample.data.extend_from_slice(nal);
                    }
                }
            }
        }
        if sample.data.is_empty() {
            bail!("The H.264 encoder gave nothing for frame {number}.");
        }
        samples.push(sample);
    }
    let (width, height) = size.context("A video needs at least one frame; this one has none.")?;
    mp4::write(&Track {
        width: u16::try_from(width)?,
        height: u16::try_from(height)?,
        fps,
        sps,
        pps,
        samples,
    })
}

/// A NAL unit without its Annex B start code (`00 00 01` or `00 00 00 01`).
fn strip_start_code(nal: &[u8]) -> &[u8] {
    nal.strip_prefix(&[0, 0, 0, 1])
        .or_else(|| nal.strip_prefix(&[0, 0, 1]))
        .unwrap_or(nal)
}

/// Luma and the two halved colour differences of a picture.
struct Planes {
    y: Vec<u8>,
    cb: Vec<u8>,
    cr: Vec<u8>,
}

impl Planes {
    /// Rec. ITU-R BT.709-6, 3.2 to 3.4: Y' = 0.2126 R' + 0.7152 G' + 0.0722 B', limited range (16..235, 16..240).
    fn rec709(frame: &RgbImage) -> Self {
        let (width, height) = (frame.width() as usize, frame.height() as usize);
        let rgb = frame.as_raw();
        let luma = |p: [f32; 3]| 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2];
        let y = rgb
            .chunks_exact(3)
            .map(|p| {
                (16.0 + luma([p[0].into(), p[1].into(), p[2].into()]) * (219.0 / 255.0)).round()
                    as u8
            })
            .collect();
        let (mut cb, mut cr) = (
            Vec::with_capacity(width * height / 4),
            Vec::with_capacity(width * height / 4),
        );
        for row in (0..height).step_by(2) {
            for column in (0..width).step_by(2) {
                let mut mean = [0.0_f32; 3];
                for at in [
                    row * width + column,
                    row * width + column + 1,
                    (row + 1) * width + column,
                    (row + 1) * width + column + 1,
                ] {
                    for (m, &v) in mean.iter_mut().zip(&rgb[at * 3..at * 3 + 3]) {
                        *m += f32::from(v) * 0.25;
                    }
                }
                let l = luma(mean);
                cb.push((128.0 + (mean[2] - l) / 1.8556 * (224.0 / 255.0)).round() as u8);
                cr.push((128.0 + (mean[0] - l) / 1.5748 * (224.0 / 255.0)).round() as u8);
            }
        }
        Self { y, cb, cr }
    }
}
