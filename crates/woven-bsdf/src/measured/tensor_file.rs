//! Tensor files: the container of the RGL material database, named arrays of numbers behind a table of contents.
//!
//! `tensor_file\0`, version 1.0 (two bytes), number of fields (`u32`); then for each its name (`u16` length, bytes),
//! number of dimensions (`u16`), type (`u8`), offset from the start of the file and sizes (`u64`); all little-endian.

use super::Refused;

/// Most fields and dimensions of a sound file.
const MAX_FIELDS: u32 = 64;
const MAX_DIMENSIONS: u16 = 8;

/// Type numbers of the format.
const UINT8: u8 = 1;
const FLOAT32: u8 = 10;
/// Bytes of a number of each type, by its number; 0 is no type.
const WIDTHS: [usize; 12] = [0, 1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8];

/// One array of a file.
#[derive(Clone, Debug)]
pub(super) struct Field<'a> {
    pub(super) name: String,
    pub(super) shape: Vec<usize>,
    kind: u8,
    data: &'a [u8],
}

impl Field<'_> {
    /// The numbers of a field of single precision; all finite.
    pub(super) fn floats(&self) -> Result<Vec<f32>, Refused> {
        if self.kind != FLOAT32 {
            return Err(Refused::new(format!(
                "the field {:?} has the type {}; single precision is {FLOAT32}",
                self.name, self.kind
            )));
        }
        let number = |b: &[u8]| f32::from_le_bytes(std::array::from_fn(|k| b[k]));
        let out: Vec<f32> = self.data.chunks_exact(4).map(number).collect();
        match out.iter().position(|x| !x.is_finite()) {
            None => Ok(out),
            Some(i) => Err(Refused::new(format!(
                "number {} of the field {:?} is {}",
                i + 1,
                self.name,
                out[i]
            ))),
        }
    }
    /// The bytes of a field of text.
    pub(super) fn bytes(&self) -> Result<&[u8], Refused> {
        if self.kind == UINT8 {
            return Ok(self.data);
        }
        Err(Refused::new(format!(
            "the field {:?} has the type {}; bytes are {UINT8}",
            self.name, self.kind
        )))
    }
}

/// Takes numbers from the front of the table of contents.
struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    fn take(&mut self, n: usize) -> Result<&'a [u8], Refused> {
        let piece = self.bytes.get(self.at..).and_then(|b| b.get(..n));
        self.at += n;
        piece.ok_or_else(|| Refused::new("the table of contents is cut off; fetch the file again"))
    }
    fn number<const N: usize>(&mut self) -> Result<[u8; N], Refused> {
        let piece = self.take(N)?;
        Ok(std::array::from_fn(|i| piece[i]))
    }
}

/// The arrays of a file; they borrow its bytes, nothing is copied.
pub(super) fn fields(bytes: &[u8]) -> Result<Vec<Field<'_>>, Refused> {
    let mut reader = Reader { bytes, at: 0 };
    let magic = reader
        .take(14)
        .map_err(|_| Refused::new("the file is too short for a tensor file"))?;
    if &magic[..12] != b"tensor_file\0" || magic[12] != 1 {
        return Err(Refused::new(
            "the file does not begin with \"tensor_file\" and version 1: this is no RGL .bsdf file",
        ));
    }
    let count = u32::from_le_bytes(reader.number()?);
    if count > MAX_FIELDS {
        return Err(Refused::new(format!(
            "the table of contents has {count} fields; {MAX_FIELDS} is the most"
        )));
    }
    let mut out = Vec::new();
    for _ in 0..count {
        let length = u16::from_le_bytes(reader.number()?);
        let name = String::from_utf8_lossy(reader.take(usize::from(length))?).into_owned();
        let dimensions = u16::from_le_bytes(reader.number()?);
        let [kind] = reader.number()?;
        let offset = u64::from_le_bytes(reader.number()?);
        if dimensions > MAX_DIMENSIONS {
            return Err(Refused::new(format!(
                "the field {name:?} has {dimensions} dimensions; {MAX_DIMENSIONS} is the most"
            )));
        }
        let mut shape = Vec::new();
        let width = WIDTHS.get(usize::from(kind)).copied().unwrap_or(0);
        let mut size = (width > 0).then_some(width);
        for _ in 0..dimensions {
            let n = usize::try_from(u64::from_le_bytes(reader.number()?)).unwrap_or(usize::MAX);
            shape.push(n);
            size = size.and_then(|s| s.checked_mul(n));
        }
        let start = usize::try_from(offset).ok();
        let data = start
            .zip(size)
            .and_then(|(start, size)| bytes.get(start..start.checked_add(size)?));
        let data = data.ok_or_else(|| {
            Refused::new(format!(
                "the field {name:?} of type {kind} and shape {shape:?} at byte {offset} lies outside the file of {} bytes",
                bytes.len()
            ))
        })?;
        out.push(Field {
            name,
            shape,
            kind,
            data,
        });
    }
    Ok(out)
}
