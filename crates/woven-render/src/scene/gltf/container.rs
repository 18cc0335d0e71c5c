//! The outermost layer of a scene file: size, GLB chunks, JSON depth. Everything here works on bytes nobody has checked yet.

use anyhow::{Context, Result, bail, ensure};
use serde_json::Value;
use std::io::Read;
use std::path::Path;

/// How large things may be.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Bytes of one scene, buffer or picture file.
    pub file: u64,
    /// Bytes of all buffers together.
    pub buffers: u64,
    /// Depth of nested braces and brackets in JSON.
    pub json_depth: usize,
    /// Entries of one JSON array at the top (nodes, accessors, ...).
    pub entries: usize,
    /// Triangles after instances have been flattened.
    pub triangles: usize,
    /// Bytes of all decoded pictures together.
    pub pictures: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Limits {
            file: 256 << 20,
            buffers: 1 << 30,
            json_depth: 64,
            entries: 1 << 20,
            triangles: 32 << 20,
            pictures: 1 << 30,
        }
    }
}

/// A scene file taken apart.
#[derive(Clone, Debug)]
pub(super) struct Container {
    /// The JSON.
    pub(super) json: Value,
    /// The binary chunk of a GLB.
    pub(super) bin: Option<Vec<u8>>,
}

/// Reads a whole file of at most `limit` bytes.
///
/// # Errors
/// A sentence naming the file when it cannot be read or is too large.
pub fn read_file(path: &Path, limit: u64) -> Result<Vec<u8>> {
    let file =
        std::fs::File::open(path).with_context(|| format!("cannot open {}", path.display()))?;
    let meta = file
        .metadata()
        .with_context(|| format!("cannot open {}", path.display()))?;
    ensure!(meta.is_file(), "{} is no regular file", path.display());
    ensure!(
        meta.len() <= limit,
        "{} is {} MiB large; at most {} MiB are read",
        path.display(),
        meta.len() >> 20,
        limit >> 20
    );
    let mut bytes = Vec::with_capacity(meta.len() as usize);
    file.take(limit + 1)
        .read_to_end(&mut bytes)
        .with_context(|| format!("cannot read {}", path.display()))?;
    ensure!(
        bytes.len() as u64 <= limit,
        "{} grew beyond {} MiB while it was read",
        path.display(),
        limit >> 20
    );
    Ok(bytes)
}

/// Takes a `.glb` or `.gltf` apart.
///
/// # Errors
/// A sentence when the container is broken or the JSON too deep or malformed.
pub(super) fn open(bytes: &[u8], limits: &Limits) -> Result<Container> {
    let (text, bin) = if bytes.starts_with(b"glTF") {
        split_glb(bytes)?
    } else {
        (bytes, None)
    };
    check_text(text, limits.json_depth)?;
    // glTF writers in the wild pad with spaces or zeros and some begin with a byte-order mark.
    let text = text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text);
    let end = text.iter().rposition(|b| *b != 0).map_or(0, |i| i + 1);
    let json = serde_json::from_slice(&text[..end]).context("the scene's JSON cannot be read")?;
    Ok(Container {
        json,
        bin: bin.map(<[u8]>::to_vec),
    })
}

fn split_glb(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>)> {
    let word = |at: usize| -> Result<usize> {
        let b = bytes
            .get(at..at + 4)
            .context("the GLB file is cut off in a header")?;
        Ok(u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize)
    };
    let version = word(4)?;
    ensure!(
        version == 2,
        "the GLB container has version {version}; only version 2 is read"
    );
    let total = word(8)?;
    ensure!(
        total <= bytes.len(),
        "the GLB file is cut off: it says {total} bytes and has {}",
        bytes.len()
    );
    let mut at = 12;
    let (mut json, mut bin) = (None, None);
    while at + 8 <= total {
        let (length, kind) = (word(at)?, word(at + 4)? as u32);
        let end = (at + 8).checked_add(length).filter(|e| *e <= total);
        let Some(end) = end else {
            bail!("a GLB chunk of {length} bytes reaches beyond the end of the file")
        };
        let body = &bytes[at + 8..end];
        match kind {
            0x4E4F_534A if json.is_none() => json = Some(body),
            0x004E_4942 if bin.is_none() => bin = Some(body),
            _ => {}
        }
        at = end;
    }
    Ok((json.context("the GLB file has no JSON chunk")?, bin))
}

/// What the JSON may take in memory. A text of zeros unfolds thirtyfold and one of small objects a hundredfold.
const JSON_ROOM: usize = 384 << 20;
/// Bytes that an object takes at most while it is read (a node of the map, then the record made from it), and any other value or string.
const OBJECT: usize = 640;
/// See [`OBJECT`].
const VALUE: usize = 64;

/// Counts braces, commas and strings, so that neither a hostile depth nor a hostile number of values reaches the parser.
fn check_text(text: &[u8], limit: usize) -> Result<()> {
    let (mut depth, mut in_string, mut escaped) = (0_usize, false, false);
    let mut room = 0_usize;
    for &b in text {
        if in_string {
            match b {
                _ if escaped => escaped = false,
                b'\\' => escaped = true,
                b'"' => in_string = false,
                _ => {}
            }
        } else {
            match b {
                b'"' => {
                    in_string = true;
                    room += VALUE / 2;
                }
                b',' => room += VALUE,
                b'{' | b'[' => {
                    depth += 1;
                    room += if b == b'{' { OBJECT } else { VALUE };
                    ensure!(
                        depth <= limit,
                        "the scene's JSON is nested deeper than {limit} levels"
                    );
                    ensure!(
                        room <= JSON_ROOM,
                        "the scene's JSON would take more than {} MiB; its {} MiB are too many small values",
                        JSON_ROOM >> 20,
                        text.len() >> 20
                    );
                }
                b'}' | b']' => depth = depth.saturating_sub(1),
                _ => {}
            }
        }
    }
    ensure!(
        room <= JSON_ROOM,
        "the scene's JSON would take more than {} MiB; its {} MiB are too many small values",
        JSON_ROOM >> 20,
        text.len() >> 20
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(bytes: &[u8]) -> String {
        format!("{:#}", open(bytes, &Limits::default()).unwrap_err())
    }

    #[test]
    fn broken_containers_are_sentences() {
        let glb = |version: u32, total: u32, chunk: u32, body: &[u8]| {
            let mut b = b"glTF".to_vec();
            for w in [version, total, chunk, 0x4E4F_534A] {
                b.extend(w.to_le_bytes());
            }
            b.extend(body);
            b
        };
        assert!(refused(b"glTF\x02\0").contains("cut off"));
        assert!(refused(&glb(1, 22, 2, b"{}")).contains("version 1"));
        assert!(refused(&glb(2, 99, 2, b"{}")).contains("cut off"));
        assert!(refused(&glb(2, 22, u32::MAX, b"{}")).contains("beyond the end"));
        assert!(refused(&glb(2, 12, 2, b"{}")).contains("no JSON"));
        assert!(refused(b"{\"a\":1e999}").contains("JSON"));
        assert!(refused("[".repeat(100).as_bytes()).contains("64 levels"));
        assert!(open(&glb(2, 22, 2, b"{}"), &Limits::default()).is_ok());
        // Brackets in a string do not nest.
        assert!(
            open(
                format!("{{\"a\":\"{}\\\"[\"}}", "[".repeat(100)).as_bytes(),
                &Limits::default()
            )
            .is_ok()
        );
    }
}
