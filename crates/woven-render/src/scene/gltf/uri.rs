//! What a URI in a scene may point at: data inside the scene, or a plain file in the scene's folder or below. Nothing else.

use anyhow::{Context, Result, bail, ensure};
use std::path::{Component, Path, PathBuf};

/// Where the bytes of a URI are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// Written out in the URI itself.
    Data(Vec<u8>),
    /// A regular file inside the scene's folder; the path is canonical.
    File(PathBuf),
}

/// Finds what `uri` names, seen from the folder `base`.
///
/// Refused: any scheme but `data:`, absolute paths, `..`, backslashes, control characters, `?` and `#`, anything that
/// becomes one of these when percent-decoded once more, links that lead out of the folder, and what is no regular file.
///
/// # Errors
/// A sentence that quotes the URI (shortened) and says which rule it breaks.
pub fn resolve(base: &Path, uri: &str) -> Result<Source> {
    resolve_inner(base, uri).with_context(|| format!("the URI '{}' is refused", shorten(uri)))
}

fn resolve_inner(base: &Path, uri: &str) -> Result<Source> {
    if let Some(rest) = uri.strip_prefix("data:") {
        return Ok(Source::Data(decode_data(rest)?));
    }
    ensure!(
        uri.len() <= 4096,
        "it is {} bytes long, more than any path",
        uri.len()
    );
    check_text(uri)?;
    let decoded = percent_decode(uri)?;
    check_text(&decoded)?;
    // A name that still holds an escape could mean something else to the next reader.
    ensure!(!has_escape(&decoded), "it is percent-encoded twice");
    let path = Path::new(&decoded);
    for part in path.components() {
        match part {
            Component::Normal(name) => check_name(&name.to_string_lossy())?,
            Component::CurDir => {}
            Component::ParentDir => {
                bail!("'..' would leave the scene's folder; put the file beside the scene")
            }
            Component::RootDir | Component::Prefix(_) => {
                bail!("it is an absolute path; put the file beside the scene")
            }
        }
    }
    let home = base
        .canonicalize()
        .with_context(|| format!("the scene's folder {} cannot be found", base.display()))?;
    let target = home.join(path);
    let target = target
        .canonicalize()
        .with_context(|| format!("there is no file {decoded} in the scene's folder"))?;
    ensure!(
        target.starts_with(&home),
        "it leads out of the scene's folder through a link"
    );
    let kind = std::fs::metadata(&target).with_context(|| format!("{decoded} cannot be read"))?;
    ensure!(kind.is_file(), "{decoded} is no regular file");
    Ok(Source::File(target))
}

/// Rules for the text as a whole, before and after decoding.
fn check_text(text: &str) -> Result<()> {
    ensure!(!text.is_empty(), "it is empty");
    ensure!(
        !text.chars().any(char::is_control),
        "it holds a control character"
    );
    ensure!(
        !text.contains('\\'),
        "it holds a backslash; paths in glTF use '/'"
    );
    ensure!(
        !text.contains(':'),
        "only data: and relative paths are allowed, no other scheme and no drive"
    );
    ensure!(
        !text.starts_with('/'),
        "it is an absolute path; put the file beside the scene"
    );
    ensure!(
        !text.contains(['?', '#']),
        "it holds '?' or '#'; only plain relative paths are allowed"
    );
    ensure!(
        text.split('/').all(|p| p != ".."),
        "'..' would leave the scene's folder; put the file beside the scene"
    );
    Ok(())
}

/// Names that mean a device or lose their end on some systems are refused on all, so that a scene works everywhere.
fn check_name(name: &str) -> Result<()> {
    ensure!(
        !name.ends_with(['.', ' ']),
        "the name '{name}' ends with a dot or a space"
    );
    let stem = name
        .split('.')
        .next()
        .unwrap_or(name)
        .trim_end()
        .to_ascii_uppercase();
    let numbered = |p: &str| {
        stem.strip_prefix(p)
            .is_some_and(|n| n.len() == 1 && n.as_bytes()[0].is_ascii_digit())
    };
    let device = matches!(
        stem.as_str(),
        "CON" | "PRN" | "AUX" | "NUL" | "CONIN$" | "CONOUT$"
    ) || numbered("COM")
        || numbered("LPT");
    ensure!(!device, "'{name}' is the name of a device on some systems");
    Ok(())
}

fn hex(byte: u8) -> Option<u8> {
    char::from(byte).to_digit(16).map(|d| d as u8)
}

fn has_escape(text: &str) -> bool {
    text.as_bytes()
        .windows(3)
        .any(|w| w[0] == b'%' && hex(w[1]).is_some() && hex(w[2]).is_some())
}

fn percent_decode(text: &str) -> Result<String> {
    let bytes = text.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut i = 0;
    while i < bytes.len() {
        if bytes[i] == b'%' {
            let pair = bytes
                .get(i + 1..i + 3)
                .and_then(|p| Some((hex(p[0])? << 4) | hex(p[1])?));
            let Some(byte) = pair else {
                bail!("'%' is not followed by two hexadecimal digits")
            };
            out.push(byte);
            i += 3;
        } else {
            out.push(bytes[i]);
            i += 1;
        }
    }
    String::from_utf8(out).context("it does not decode to text (UTF-8)")
}

fn shorten(uri: &str) -> String {
    let clean: String = uri
        .chars()
        .map(|c| if c.is_control() { '\u{fffd}' } else { c })
        .take(60)
        .collect();
    if uri.chars().count() > 60 {
        format!("{clean}…")
    } else {
        clean
    }
}

/// `[<media type>];base64,<data>`; the plain form (percent-encoded text) does not occur in glTF and is refused.
fn decode_data(rest: &str) -> Result<Vec<u8>> {
    let (head, body) = rest
        .split_once(',')
        .context("a data: URI needs a comma before its data")?;
    ensure!(head.ends_with(";base64"), "only base64 data: URIs are read");
    decode_base64(body)
}

/// Base64 (RFC 4648, section 4), padding optional, nothing else between the letters.
fn decode_base64(text: &str) -> Result<Vec<u8>> {
    let body = text.trim_end_matches('=');
    ensure!(
        text.len() - body.len() <= 2,
        "the base64 data has too much padding"
    );
    ensure!(body.len() % 4 != 1, "the base64 data is cut off");
    let mut out = Vec::with_capacity(body.len() * 3 / 4);
    for chunk in body.as_bytes().chunks(4) {
        let mut bits = 0_u32;
        for &c in chunk {
            let value = match c {
                b'A'..=b'Z' => c - b'A',
                b'a'..=b'z' => c - b'a' + 26,
                b'0'..=b'9' => c - b'0' + 52,
                b'+' => 62,
                b'/' => 63,
                _ => bail!("the base64 data holds a character that is none of its letters"),
            };
            bits = (bits << 6) | u32::from(value);
        }
        bits <<= 6 * (4 - chunk.len());
        out.extend_from_slice(&bits.to_be_bytes()[1..chunk.len()]);
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_vectors_of_the_rfc() {
        for (text, want) in [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYmFy", "foobar"),
            ("Zm9vYg", "foob"),
        ] {
            assert_eq!(decode_base64(text).unwrap(), want.as_bytes());
        }
        for bad in ["A", "Zm9v=Zg", "Zm9v===", "Zm 9v"] {
            assert!(decode_base64(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn plain_and_encoded_names_inside_the_folder_are_found() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir(dir.path().join("maps")).unwrap();
        std::fs::write(dir.path().join("maps/a b.bin"), b"x").unwrap();
        for uri in ["maps/a b.bin", "maps/a%20b.bin", "./maps/a%20b.bin"] {
            assert!(
                matches!(resolve(dir.path(), uri), Ok(Source::File(_))),
                "{uri}"
            );
        }
        assert_eq!(
            resolve(dir.path(), "data:;base64,Zm9v").unwrap(),
            Source::Data(b"foo".to_vec())
        );
    }
}
