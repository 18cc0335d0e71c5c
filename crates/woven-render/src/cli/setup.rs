//! From the arguments to a scene, settings and the hash that tells whether two runs make the same picture.

use super::{BackendArg, CurveArg, DenoiserArg, IntegratorArg, RenderArgs, oidn};
use anyhow::{Context, Result, ensure};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::Path;
use woven_render::film::{Curve, Film};
use woven_render::render::{Backend, Integrator, Renderer, Settings};
use woven_render::scene::{Light, Scene, environment, gltf, sky};
use woven_render::{denoise, exr_io};

/// A scene ready to be rendered.
pub(crate) struct Job {
    pub(crate) scene: Scene,
    pub(crate) settings: Settings,
    pub(crate) backend: Backend,
    /// What the EXR's metadata say beside the renderer's own.
    pub(crate) metadata: BTreeMap<String, String>,
    /// Everything that decides the picture, as one SHA-256 in hexadecimal.
    pub(crate) hash: String,
}

/// Reads the scene and what belongs to it; notes go to stderr.
pub(crate) fn prepare(scene_path: &Path, args: &RenderArgs) -> Result<Job> {
    let options = gltf::Options {
        fabrics: args
            .fabric
            .iter()
            .map(|p| (p.material.clone(), p.file.clone()))
            .collect(),
        camera: args.camera.clone(),
        ..gltf::Options::default()
    };
    let loaded = gltf::load(scene_path, &options)?;
    for note in &loaded.notes {
        eprintln!("note: {note}");
    }
    let mut scene = loaded.scene;
    let mut metadata = BTreeMap::new();
    metadata.insert("scene.sha256".to_owned(), loaded.hash);
    for (name, file) in &options.fabrics {
        metadata.insert(format!("fabric.{name}.sha256"), file_hash(file)?);
    }
    ensure!(
        args.env_scale.is_finite() && args.env_scale >= 0.0,
        "--env-scale {} is no factor; give a number from 0 up",
        args.env_scale
    );
    ensure!(
        args.lamp_scale.is_finite() && args.lamp_scale >= 0.0,
        "--lamp-scale {} is no factor; give a number from 0 up",
        args.lamp_scale
    );
    for light in &mut scene.lights {
        let (Light::Sun {
            irradiance: power, ..
        }
        | Light::Point {
            intensity: power, ..
        }
        | Light::Spot {
            intensity: power, ..
        }) = light;
        *power = power.map(|p| p * args.lamp_scale);
    }
    ensure!(
        args.env_turn.is_finite() && args.exposure.is_finite(),
        "--env-turn and --exposure must be finite numbers"
    );
    if let Some(map) = &args.env {
        let mut environment = environment::load(map)?;
        environment.rotation = args.env_turn.to_radians();
        environment.scale = [args.env_scale; 3];
        scene.environment = Some(environment);
        metadata.insert("env.sha256".to_owned(), file_hash(map)?);
    }
    if let Some(when) = &args.sky {
        let day = sky::Day::new(
            when,
            args.place.latitude,
            args.place.longitude,
            args.turbidity,
        )?;
        let (mut environment, sun) = day.bake(512);
        environment.rotation = args.env_turn.to_radians();
        environment.scale = [args.env_scale; 3];
        scene.environment = Some(environment);
        scene
            .lights
            .extend(sun.map(|s| sky::turned(s, args.env_turn.to_radians(), args.env_scale)));
        metadata.insert(
            "sky".to_owned(),
            format!(
                "{when} at {},{} turbidity {}",
                args.place.latitude, args.place.longitude, args.turbidity
            ),
        );
    }
    let settings = Settings {
        width: args.size.width,
        height: args.size.height,
        spp: args.spp,
        depth: args.depth,
        seed: args.seed,
        integrator: match args.integrator {
            IntegratorArg::Path => Integrator::Path,
            IntegratorArg::Direct => Integrator::Direct,
        },
        light_layers: args.light_layers,
        event_layers: args.event_layers,
        // The denoiser is led by them.
        aov: args.aov || args.denoise,
        time_limit: args
            .time
            .map(|seconds| {
                std::time::Duration::try_from_secs_f64(seconds)
                    .map_err(|_| anyhow::anyhow!("--time {seconds} is no time in seconds"))
            })
            .transpose()?,
        noise: args.noise,
    };
    ensure!(
        args.noise.is_none_or(|n| n > 0.0),
        "--noise {} cannot be reached; give a relMSE above 0, such as 0.001",
        args.noise.unwrap_or(0.0)
    );
    let backend = match args.backend {
        BackendArg::Auto => Backend::Auto,
        BackendArg::Cpu => Backend::Cpu,
        BackendArg::Gpu => Backend::Gpu,
    };
    let mut hasher = Sha256::new();
    // The thread count and the place of the output do not decide the picture; everything below does.
    let view = (
        args.env_turn,
        args.env_scale,
        args.exposure,
        args.curve,
        &args.camera,
        args.denoise,
        args.aov,
        args.denoiser,
        args.lamp_scale,
    );
    hasher.update(format!(
        "{} {settings:?} {backend:?} {metadata:?} {view:?}",
        env!("CARGO_PKG_VERSION")
    ));
    let hash = hex(&hasher.finalize());
    Ok(Job {
        scene,
        settings,
        backend,
        metadata,
        hash,
    })
}

/// SHA-256 of bytes as text.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

fn file_hash(path: &Path) -> Result<String> {
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    Ok(hex(&Sha256::digest(bytes)))
}

/// What a finished film goes through before it is written: denoising, leaving out helper layers, metadata.
///
/// # Errors
/// When Open Image Denoise is asked for and does not do its work.
pub(crate) fn finish(
    film: &mut Film,
    args: &RenderArgs,
    metadata: &BTreeMap<String, String>,
    hash: &str,
) -> Result<()> {
    if args.denoise {
        let program = match args.denoiser {
            DenoiserArg::Own => None,
            DenoiserArg::Auto => oidn::found(),
            DenoiserArg::Oidn => Some(oidn::found().context(
                "the program oidnDenoise is not in the PATH; install Open Image Denoise or leave --denoiser out",
            )?),
        };
        let how = match program {
            Some(program) => {
                oidn::denoise(&program, film)?;
                "Open Image Denoise"
            }
            None => {
                denoise::denoise(film, &denoise::Settings::default());
                "yes"
            }
        };
        film.metadata.insert("denoised".to_owned(), how.to_owned());
    }
    if !args.aov {
        film.layers
            .retain(|l| l.name == woven_render::film::BEAUTY || l.name.starts_with("light."));
    }
    film.metadata.extend(metadata.clone());
    film.metadata
        .insert("settings.sha256".to_owned(), hash.to_owned());
    Ok(())
}

/// What the renderer has to tell at the end: the submits to the GPU and the noise that is left.
pub(crate) fn log(renderer: &Renderer) -> String {
    let mut out = String::new();
    if let Some((longest, submits)) = renderer.longest_submit() {
        out += &format!(
            "; {submits} submits, the longest {:.0} ms",
            longest.as_secs_f64() * 1e3
        );
    }
    if let Some(noise) = renderer.noise() {
        out += &format!("; relMSE about {noise:.5}");
    }
    out
}

/// Kinds of output by the file's ending.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Linear radiance, layers, metadata.
    Exr,
    /// 8-bit sRGB through the film curve.
    Png,
}

/// The kind of `path`, or a sentence.
pub(crate) fn kind(path: &Path) -> Result<Kind> {
    match path
        .extension()
        .and_then(|e| e.to_str())
        .map(str::to_ascii_lowercase)
        .as_deref()
    {
        Some("exr") => Ok(Kind::Exr),
        Some("png") => Ok(Kind::Png),
        _ => anyhow::bail!(
            "{} ends in neither .exr nor .png; the ending chooses the format",
            path.display()
        ),
    }
}

/// Fails before hours of work rather than after: is the folder there and does it take a file?
pub(crate) fn check_writable(path: &Path) -> Result<()> {
    let folder = path
        .parent()
        .filter(|p| !p.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    tempfile::Builder::new()
        .prefix(".woven-")
        .tempfile_in(folder)
        .with_context(|| {
            format!(
                "cannot write into the folder {}; does it exist and is it writable?",
                folder.display()
            )
        })?;
    Ok(())
}

/// Writes the film as the ending of `path` says.
pub(crate) fn write(
    film: &Film,
    path: &Path,
    args: &RenderArgs,
    camera_exposure: f32,
) -> Result<()> {
    match kind(path)? {
        Kind::Exr => exr_io::write(film, path),
        Kind::Png => {
            let curve = match args.curve {
                CurveArg::Filmic => Curve::Filmic,
                CurveArg::Clip => Curve::Clip,
            };
            film.write_png(path, curve, args.exposure + camera_exposure)
        }
    }
}
