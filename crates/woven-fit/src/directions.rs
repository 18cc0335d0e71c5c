//! Lists of direction pairs, as `woven-fit eval` reads them: CSV with columns lx,ly,lz,vx,vy,vz among others.

use anyhow::{Result, anyhow, bail};
use woven_bsdf::vec3::Vec3;

/// A list of pairs with the text of its rows.
#[derive(Clone, Debug, Default)]
pub struct Directions {
    /// The header line.
    pub header: String,
    /// Each row's text, direction to the light and direction to the viewer, both of length 1.
    pub rows: Vec<(String, Vec3<f64>, Vec3<f64>)>,
}

impl Directions {
    /// Reads the text of a file; lines that begin with `#` are left out.
    ///
    /// # Errors
    /// A sentence with the line.
    pub fn parse(text: &str) -> Result<Self> {
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .comment(Some(b'#'))
            .from_reader(text.as_bytes());
        let header = reader.headers()?.clone();
        let mut columns = [0; 6];
        for (place, name) in columns.iter_mut().zip(["lx", "ly", "lz", "vx", "vy", "vz"]) {
            *place = header.iter().position(|h| h == name).ok_or_else(|| {
                anyhow!("there is no column {name}; the header must name lx,ly,lz,vx,vy,vz")
            })?;
        }
        let join = |r: &csv::StringRecord| r.iter().collect::<Vec<_>>().join(",");
        let mut rows = Vec::new();
        for record in reader.records() {
            let record = record?;
            let line = record.position().map_or(0, csv::Position::line);
            let mut c = [0.0; 6];
            for (c, &column) in c.iter_mut().zip(&columns) {
                let word = &record[column];
                *c = word
                    .parse()
                    .map_err(|_| anyhow!("line {line}: {word:?} is not a number"))?;
            }
            let (Some(l), Some(v)) = (unit(c[0], c[1], c[2]), unit(c[3], c[4], c[5])) else {
                bail!("line {line}: a direction has no length");
            };
            rows.push((join(&record), l, v));
        }
        Ok(Self {
            header: join(&header),
            rows,
        })
    }
}

/// A direction away from the sheet as typed, scaled to length 1.
fn unit(x: f64, y: f64, z: f64) -> Option<Vec3<f64>> {
    let length = (x * x + y * y + z * z).sqrt();
    (length.is_finite() && length > 1e-9).then(|| Vec3::new(x / length, y / length, z / length))
}
