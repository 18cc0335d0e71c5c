//! Small files of other instruments and databases, made number by number; the tests and the fuzzer share them.

use std::f64::consts::{FRAC_PI_2, PI};
use woven_bsdf::term::ggx;
use woven_bsdf::vec3::Vec3;

/// A draft on three shafts.
pub(crate) const WIF: &str = "[WIF]\nVersion=1.1\n[WEAVING]\nRising Shed=true\n[THREADING]\n1=1\n2=2\n3=3,1\n[TIEUP]\n1=1,2\n2=2,3\n\
    [TREADLING]\n1=1\n2=2,1\n[WARP]\nThreads=3\nColor=1\nSpacing=0.2\nThickness=0.1\nUnits=centimeters\n[WEFT]\nThreads=2\nColor=2\n\
    [COLOR PALETTE]\nRange=0,255\n[COLOR TABLE]\n1=255,0,0\n2=0,255,0\n[WARP COLORS]\n2=2\n";

/// A small pgII file.
pub(crate) const PAB: &str = "#sample_name \"lace 3\"\n#intheta 30\n#inphi 0\n#format: theta phi BTDF\n150 180 0.52\n 150  90.5 1e-3 \n";
/// The same with colours, another up and the other quantity.
pub(crate) const PAB_XYZ: &str = "#incident_angle 0 0\n#upphi 0\n#colorimetry: CIE-XYZ\n#format: theta phi DSF\n120 10 1 2 3\n90 0 1 1 1\n";

/// A whole Klems file over a basis of three patches.
pub(crate) fn klems() -> String {
    let ring = |lo: f64, hi: f64, n: usize| {
        format!(
            "<AngleBasisBlock><ThetaBounds><LowerTheta>{lo}</LowerTheta><UpperTheta>{hi}</UpperTheta></ThetaBounds><nPhis>{n}</nPhis></AngleBasisBlock>"
        )
    };
    format!(
        "<WindowElement><Optical><Layer><Material><Name>x</Name><Manufacturer>y</Manufacturer></Material><DataDefinition>\
         <IncidentDataStructure>Columns</IncidentDataStructure><AngleBasis>{}{}</AngleBasis></DataDefinition><WavelengthData>\
         <Wavelength>Visible</Wavelength><WavelengthDataBlock><WavelengthDataDirection>Transmission Front</WavelengthDataDirection>\
         <ScatteringData>0.5, 0.1 0.1\n0.1 0.5 0.1\n0.1 0.1 0.5</ScatteringData></WavelengthDataBlock></WavelengthData></Layer></Optical></WindowElement>",
        ring(0.0, 40.0, 1),
        ring(40.0, 90.0, 2)
    )
}

/// A file with one tensor tree.
pub(crate) fn tree(rank: usize, direction: &str, tree: &str) -> String {
    format!(
        "<WindowElement><Optical><Layer><Material><Name>x</Name><Manufacturer>y</Manufacturer></Material><DataDefinition>\
         <IncidentDataStructure>TensorTree{rank}</IncidentDataStructure></DataDefinition><WavelengthData>\
         <Wavelength>Visible</Wavelength><WavelengthDataBlock><WavelengthDataDirection>{direction}</WavelengthDataDirection>\
         <AngleBasis>LBNL/Shirley-Chiu</AngleBasis><ScatteringDataType>BTDF</ScatteringDataType><ScatteringData>{tree}\
         </ScatteringData></WavelengthDataBlock></WavelengthData></Layer></Optical></WindowElement>"
    )
}

/// A MERL file of these sizes with the value `f(bin, colour)`.
pub(crate) fn merl(dims: [usize; 3], f: impl Fn([usize; 3], usize) -> f64) -> Vec<u8> {
    let mut out: Vec<u8> = dims
        .iter()
        .flat_map(|d| (*d as i32).to_le_bytes())
        .collect();
    for c in 0..3 {
        for h in 0..dims[0] {
            for d in 0..dims[1] {
                for p in 0..dims[2] {
                    out.extend(f([h, d, p], c).to_le_bytes());
                }
            }
        }
    }
    out
}

/// A field of a tensor file: name, type, sizes, bytes.
type Field = (&'static str, u8, Vec<u64>, Vec<u8>);

/// The bytes of a tensor file.
fn tensor_file(fields: &[Field]) -> Vec<u8> {
    let entry = |(name, _, shape, _): &Field| 13 + name.len() + 8 * shape.len();
    let mut offset = 18 + fields.iter().map(entry).sum::<usize>() as u64;
    let mut out = b"tensor_file\0\x01\0".to_vec();
    out.extend((fields.len() as u32).to_le_bytes());
    for (name, kind, shape, data) in fields {
        out.extend((name.len() as u16).to_le_bytes());
        out.extend(name.as_bytes());
        out.extend((shape.len() as u16).to_le_bytes());
        out.push(*kind);
        out.extend(offset.to_le_bytes());
        shape.iter().for_each(|s| out.extend(s.to_le_bytes()));
        offset += data.len() as u64;
    }
    fields.iter().for_each(|f| out.extend(&f.3));
    out
}

fn floats(name: &'static str, shape: &[usize], f: impl Fn(usize) -> f64) -> Field {
    let n = shape.iter().product();
    let data = (0..n).flat_map(|i| (f(i) as f32).to_le_bytes()).collect();
    (name, 10, shape.iter().map(|s| *s as u64).collect(), data)
}

/// Width of the RGL material, and its number of incidences.
pub(crate) const RGL_ALPHA: f64 = 0.12;
pub(crate) const RGL_THETAS: usize = 12;

/// Incidence number `k` of [`RGL_THETAS`], in radians.
pub(crate) fn rgl_theta(k: usize) -> f64 {
    1.4 * k as f64 / (RGL_THETAS - 1) as f64
}

/// σ(i) = ∫ D ⟨i, m⟩ dm = cosθ/G1.
pub(crate) fn rgl_sigma(i: Vec3<f64>) -> f64 {
    i.z / ggx::g1(i, RGL_ALPHA, RGL_ALPHA)
}

/// An isotropic GGX in the RGL format, `warp` points a side and `fine` of D and σ: channels 0 and 1 give the warp's own
/// square, channel 2 is 1 everywhere.
pub(crate) fn rgl(jacobian: u8, warp: usize, fine: usize) -> Vec<u8> {
    let theta = |x: f64| x * x * FRAC_PI_2;
    let share = |i: usize, n: usize| (i % n) as f64 / (n - 1) as f64;
    let normal = |x: f64, y: f64| Vec3::from_angles(theta(x), (2.0 * y - 1.0) * PI);
    let d = |m| ggx::d(m, RGL_ALPHA, RGL_ALPHA);
    tensor_file(&[
        ("description", 1, vec![4], b"test".to_vec()),
        ("jacobian", 1, vec![1], vec![jacobian]),
        floats("phi_i", &[1], |_| 0.0),
        floats("theta_i", &[RGL_THETAS], rgl_theta),
        floats("ndf", &[2, fine], |i| d(normal(share(i, fine), 0.0))),
        floats("sigma", &[2, fine], |i| {
            rgl_sigma(Vec3::from_angles(theta(share(i, fine)).min(1.55), 0.0))
        }),
        floats("vndf", &[1, RGL_THETAS, warp, warp], |i| {
            let (x, y) = (share(i, warp), share(i / warp, warp));
            let l = Vec3::from_angles(rgl_theta(i / (warp * warp)), 0.0);
            let m = normal(x, y);
            // dm = sinθ dθ dφ, θ = π x²/2, φ = (2y - 1)π.
            d(m) * l.dot(m).max(0.0) * theta(x).sin() * x
        }),
        floats("rgb", &[1, RGL_THETAS, 3, 2, 2], |i| match i / 4 % 3 {
            0 => (i % 2) as f64,
            1 => (i / 2 % 2) as f64,
            _ => 1.0,
        }),
    ])
}
