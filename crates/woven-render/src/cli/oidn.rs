//! Open Image Denoise as a program beside ours, where it is installed: pictures go there and back as PFM files.

use anyhow::{Context, Result, ensure};
use std::path::{Path, PathBuf};
use std::process::Command;
use woven_render::film::{BEAUTY, Film};

/// The program's place in the PATH.
pub(crate) fn found() -> Option<PathBuf> {
    let name = format!("oidnDenoise{}", std::env::consts::EXE_SUFFIX);
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path)
        .map(|folder| folder.join(&name))
        .find(|p| p.is_file())
}

/// Replaces the picture of `film` by the denoised one, led by albedo and normal where the film has them.
///
/// # Errors
/// When the program fails or what it gives back is no picture of the same size.
pub(crate) fn denoise(program: &Path, film: &mut Film) -> Result<()> {
    let dir = tempfile::tempdir().context("there is no room for temporary files")?;
    let at = |name: &str| dir.path().join(format!("{name}.pfm"));
    let mut command = Command::new(program);
    for (layer, option) in [(BEAUTY, "--hdr"), ("albedo", "--alb"), ("normal", "--nrm")] {
        let Some(pixels) = film.layer(layer) else {
            continue;
        };
        std::fs::write(at(layer), to_pfm(film.width, film.height, pixels))
            .context("a temporary file cannot be written")?;
        command.arg(option).arg(at(layer));
    }
    let output = command
        .arg("-o")
        .arg(at("out"))
        .output()
        .with_context(|| format!("{} cannot be started", program.display()))?;
    ensure!(
        output.status.success(),
        "{} failed: {}",
        program.display(),
        String::from_utf8_lossy(&output.stderr)
            .lines()
            .last()
            .unwrap_or("no reason given")
    );
    let bytes = std::fs::read(at("out"))
        .with_context(|| format!("{} wrote no picture", program.display()))?;
    let pixels = from_pfm(&bytes, film.width, film.height)
        .with_context(|| format!("{} wrote something else than asked for", program.display()))?;
    film.push(BEAUTY, pixels);
    Ok(())
}

/// PFM: rows from the bottom, three little-endian floats a pixel.
fn to_pfm(width: usize, height: usize, pixels: &[[f32; 3]]) -> Vec<u8> {
    let mut out = format!("PF\n{width} {height}\n-1.0\n").into_bytes();
    for row in pixels.chunks_exact(width.max(1)).rev() {
        out.extend(row.iter().flatten().flat_map(|v| v.to_le_bytes()));
    }
    out
}

fn from_pfm(bytes: &[u8], width: usize, height: usize) -> Result<Vec<[f32; 3]>> {
    let mut rest = bytes;
    let mut word = || -> Option<String> {
        let end = rest.iter().position(u8::is_ascii_whitespace)?;
        let word = String::from_utf8_lossy(&rest[..end]).into_owned();
        rest = &rest[end + 1..];
        Some(word)
    };
    let head: Vec<String> = (0..4).map_while(|_| word()).collect();
    let size = [width.to_string(), height.to_string()];
    ensure!(
        head.len() == 4 && head[0] == "PF" && head[1..3] == size,
        "its header is {head:?}"
    );
    ensure!(
        rest.len() == width * height * 12,
        "it has {} bytes of pixels instead of {}",
        rest.len(),
        width * height * 12
    );
    let little = head[3].starts_with('-');
    let number = |b: &[u8]| {
        let b = [b[0], b[1], b[2], b[3]];
        let v = if little {
            f32::from_le_bytes(b)
        } else {
            f32::from_be_bytes(b)
        };
        if v.is_finite() { v } else { 0.0 }
    };
    Ok(rest
        .chunks_exact(width * 12)
        .rev()
        .flat_map(|row| {
            row.chunks_exact(12)
                .map(|p| [number(&p[..4]), number(&p[4..8]), number(&p[8..])])
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_go_there_and_back() {
        let pixels: Vec<[f32; 3]> = (0..6).map(|i| [i as f32, -1.0, 0.5]).collect();
        let bytes = to_pfm(3, 2, &pixels);
        assert_eq!(from_pfm(&bytes, 3, 2).unwrap(), pixels);
        assert!(from_pfm(&bytes, 2, 3).is_err());
        assert!(from_pfm(&bytes[..bytes.len() - 1], 3, 2).is_err());
    }

    /// A program of the same manners stands in for the real one: it hands back the albedo.
    #[cfg(unix)]
    #[test]
    fn the_program_is_called_as_its_manual_says() {
        use std::os::unix::fs::PermissionsExt;
        let dir = tempfile::tempdir().unwrap();
        let program = dir.path().join("oidnDenoise");
        let script = "#!/bin/sh\nwhile [ $# -gt 0 ]; do case $1 in --alb) a=$2;; --hdr) h=$2;; -o) o=$2;; esac; shift 2; done\n[ -f \"$h\" ] && cp \"$a\" \"$o\"\n";
        std::fs::write(&program, script).unwrap();
        std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
        let mut film = Film::of_beauty(2, 1, vec![[9.0; 3], [8.0; 3]]);
        film.push("albedo", vec![[0.25; 3], [0.5; 3]]);
        denoise(&program, &mut film).unwrap();
        assert_eq!(film.beauty().unwrap(), [[0.25; 3], [0.5; 3]]);
        std::fs::write(&program, "#!/bin/sh\necho no licence >&2\nexit 3\n").unwrap();
        let told = format!("{:#}", denoise(&program, &mut film).unwrap_err());
        assert!(told.contains("no licence"), "{told}");
    }
}
