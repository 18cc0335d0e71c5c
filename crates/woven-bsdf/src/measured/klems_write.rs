//! Writes Klems matrices as the XML that WINDOW and Radiance read; reading it back gives the same numbers to the bit.

use super::klems::{Block, Klems, Patch};
use crate::angles::{degrees, radians};
use std::fmt::Write;

impl Klems {
    /// The text of the file: one block after the other, values as the shortest decimals that read back the same.
    pub fn to_text(&self) -> String {
        let ok = "a string grows";
        let mut out = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
        out.push_str("<WindowElement xmlns=\"http://windows.lbl.gov\">\n<WindowElementType>System</WindowElementType>\n");
        out.push_str("<Optical>\n<Layer>\n<Material>\n");
        writeln!(out, "<Name>{}</Name>", escape(&self.name)).expect(ok);
        writeln!(
            out,
            "<Manufacturer>{}</Manufacturer>",
            escape(&self.manufacturer)
        )
        .expect(ok);
        out.push_str("</Material>\n<DataDefinition>\n");
        out.push_str("<IncidentDataStructure>Columns</IncidentDataStructure>\n<AngleBasis>\n");
        let name = basis_name(self.patches.len());
        writeln!(out, "<AngleBasisName>{name}</AngleBasisName>").expect(ok);
        for ring in self.patches.chunk_by(|a, b| a.theta_lo == b.theta_lo) {
            let (lo, hi) = (written(ring[0].theta_lo), written(ring[0].theta_hi));
            let (theta, n) = (if lo == 0.0 { 0.0 } else { 0.5 * (lo + hi) }, ring.len());
            writeln!(
                out,
                "<AngleBasisBlock><Theta>{theta}</Theta><nPhis>{n}</nPhis><ThetaBounds><LowerTheta>{lo}</LowerTheta>\
                 <UpperTheta>{hi}</UpperTheta></ThetaBounds></AngleBasisBlock>"
            )
            .expect(ok);
        }
        out.push_str("</AngleBasis>\n</DataDefinition>\n");
        for block in &self.blocks {
            self.write_block(&mut out, block, name);
        }
        out.push_str("</Layer>\n</Optical>\n</WindowElement>\n");
        out
    }

    fn write_block(&self, out: &mut String, block: &Block, basis: &str) {
        let ok = "a string grows";
        writeln!(
            out,
            "<WavelengthData>\n<LayerNumber>System</LayerNumber>\n<Wavelength unit=\"Integral\">{}</Wavelength>\n\
             <WavelengthDataBlock>\n<WavelengthDataDirection>{}</WavelengthDataDirection>\n\
             <ColumnAngleBasis>{basis}</ColumnAngleBasis>\n<RowAngleBasis>{basis}</RowAngleBasis>\n\
             <ScatteringDataType>{}</ScatteringDataType>\n<ScatteringData>",
            escape(&block.band),
            block.kind.name(),
            if block.kind.transmits() { "BTDF" } else { "BRDF" }
        )
        .expect(ok);
        for row in block.values.chunks(self.patches.len()) {
            let numbers: Vec<String> = row.iter().map(f64::to_string).collect();
            writeln!(out, "{},", numbers.join(", ")).expect(ok);
        }
        out.push_str("</ScatteringData>\n</WavelengthDataBlock>\n</WavelengthData>\n");
    }
}

/// The format's names of its own bases.
fn basis_name(patches: usize) -> &'static str {
    match patches {
        145 => "LBNL/Klems Full",
        73 => "LBNL/Klems Half",
        41 => "LBNL/Klems Quarter",
        _ => "Custom",
    }
}

/// Degrees that become exactly the angle `theta` again: rounded to 1e-9 where that does, as typed numbers do.
fn written(theta: f64) -> f64 {
    let plain = degrees(theta);
    let round = (plain * 1e9).round() / 1e9;
    // One of the neighbours does if neither does: a product by π/180 moves the last bit only.
    [round, plain, plain.next_up(), plain.next_down()]
        .into_iter()
        .find(|&d| radians(d) == theta)
        .unwrap_or(plain)
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

/// The nine rings of LBNL's full basis: bounds in polar angle, degrees, and the number of patches in each (Klems 1994).
pub const RINGS: [(f64, f64, u32); 9] = [
    (0.0, 5.0, 1),
    (5.0, 15.0, 8),
    (15.0, 25.0, 16),
    (25.0, 35.0, 20),
    (35.0, 45.0, 24),
    (45.0, 55.0, 24),
    (55.0, 65.0, 24),
    (65.0, 75.0, 16),
    (75.0, 90.0, 12),
];

/// The patches of LBNL's full basis: 145 in nine rings.
pub fn klems_full() -> Vec<Patch> {
    let turn = std::f64::consts::TAU;
    RINGS
        .iter()
        .flat_map(|&(lo, hi, n)| {
            (0..n).map(move |k| Patch {
                theta_lo: radians(lo),
                theta_hi: radians(hi),
                phi: turn * f64::from(k) / f64::from(n),
                phi_width: turn / f64::from(n),
            })
        })
        .collect()
}
