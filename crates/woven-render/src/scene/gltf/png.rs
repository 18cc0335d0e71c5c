//! A look at the chunks of a PNG before its decoder sees them: what the format forbids and the decoder trusts.

use anyhow::{Context, Result, ensure};
use std::borrow::Cow;

/// Checks the order and lengths of the chunks that decoding follows (PNG, third edition, 11.2 and 11.3.1).
///
/// # Errors
/// A sentence that names the chunk. A file that breaks off is left to the decoder.
pub(super) fn check(bytes: &[u8]) -> Result<()> {
    let mut at = 8;
    let mut form = None;
    while let Some(head) = bytes.get(at..at + 8) {
        let length = u32::from_be_bytes([head[0], head[1], head[2], head[3]]) as usize;
        let kind = [head[4], head[5], head[6], head[7]];
        let name = String::from_utf8_lossy(&kind);
        ensure!(
            length <= bytes.len(),
            "its chunk {name} says {length} bytes, more than the file has"
        );
        if form.is_none() {
            ensure!(
                &kind == b"IHDR" && length == 13,
                "its first chunk is {name} with {length} bytes instead of IHDR with 13"
            );
            form = Some(*bytes.get(at + 17).context("its header is cut off")?);
        } else if &kind == b"PLTE" {
            ensure!(
                (3..=768).contains(&length) && length.is_multiple_of(3),
                "its palette has {length} bytes, not three for each of 1 to 256 colours"
            );
        } else if &kind == b"tRNS" {
            let good = match form {
                Some(0) => length == 2,
                Some(2) => length == 6,
                Some(3) => (1..=256).contains(&length),
                _ => false,
            };
            ensure!(
                good,
                "its transparency (tRNS) of {length} bytes does not fit its kind of colour"
            );
        } else if &kind == b"IEND" {
            break;
        }
        at += 12 + length;
    }
    Ok(())
}

/// The file without what a picture does not need but a decoder unpacks: colour profiles and compressed texts, 256 MiB of
/// which fit into 300 KB. The file has passed [`check`].
pub(super) fn plain(bytes: &[u8]) -> Cow<'_, [u8]> {
    let mut out = Vec::new();
    let (mut at, mut copied) = (8, 0);
    while let Some(head) = bytes.get(at..at + 8) {
        let length = u32::from_be_bytes([head[0], head[1], head[2], head[3]]) as usize;
        let end = (at + 12 + length).min(bytes.len());
        if matches!(&head[4..], b"iCCP" | b"zTXt" | b"iTXt" | b"tEXt" | b"eXIf") {
            out.extend(&bytes[copied..at]);
            copied = end;
        }
        if &head[4..] == b"IEND" {
            break;
        }
        at = end;
    }
    if copied == 0 {
        return Cow::Borrowed(bytes);
    }
    out.extend(&bytes[copied..]);
    Cow::Owned(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chunks(list: &[(&[u8; 4], usize)]) -> Vec<u8> {
        let mut out = vec![0; 8];
        for (kind, length) in list {
            out.extend((*length as u32).to_be_bytes());
            out.extend(*kind);
            // Colour type 3, where it is the header's.
            out.extend((0..*length).map(|i| if i == 9 { 3 } else { 0 }));
            out.extend([0; 4]);
        }
        out
    }

    #[test]
    fn profiles_and_texts_are_left_out() {
        let kept = chunks(&[(b"IHDR", 13), (b"PLTE", 6), (b"IDAT", 5), (b"IEND", 0)]);
        assert!(matches!(plain(&kept), Cow::Borrowed(_)));
        let more = [
            (b"IHDR", 13),
            (b"iCCP", 9),
            (b"PLTE", 6),
            (b"zTXt", 1),
            (b"iTXt", 0),
            (b"IDAT", 5),
            (b"IEND", 0),
        ];
        assert_eq!(plain(&chunks(&more)).as_ref(), kept);
    }

    #[test]
    fn palettes_of_odd_length_are_refused() {
        assert!(check(&chunks(&[(b"IHDR", 13), (b"PLTE", 6), (b"IEND", 0)])).is_ok());
        for (bad, word) in [
            (chunks(&[(b"IHDR", 13), (b"PLTE", 1)]), "1 bytes"),
            (chunks(&[(b"IHDR", 13), (b"PLTE", 771)]), "771 bytes"),
            (chunks(&[(b"IHDR", 13), (b"tRNS", 257)]), "257 bytes"),
            (chunks(&[(b"PLTE", 3)]), "first chunk"),
            (chunks(&[(b"IHDR", 12)]), "12 bytes"),
        ] {
            let told = check(&bad).unwrap_err().to_string();
            assert!(told.contains(word), "{told}");
        }
    }
}
