//! A close-up of a weave for any renderer: `cargo run -p woven-bsdf --example close_up -- twill out.gltf`, then for
//! instance `woven-render frame out.gltf -o twill.png`. Weaves: plain, twill, satin, leno, lace.
//!
//! The yarns are the tubes of `weave::yarns`, 0.4 mm apart (the gauze's picks 0.8 mm) and enlarged a thousandfold (a
//! millimetre is a metre), with a camera, a lamp above and a bright panel behind; the numbers lie in a file of the same
//! name and the ending `.bin`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use woven_bsdf::weave::draft::Draft;
use woven_bsdf::weave::yarns::{Gauge, Mesh, Yarns};

/// The yarns of a built-in weave, and how often its repeat fits.
fn weave(name: &str) -> Option<(Yarns, [usize; 2])> {
    let gauge = Gauge {
        diameter: 0.27,
        pitch: 0.4,
    };
    let of = |draft: &Draft| Yarns::new(draft, gauge, gauge, 0.6);
    Some(match name {
        "plain" => (of(&Draft::plain()), [4, 4]),
        "twill" => (of(&Draft::twill(2, 2)), [2, 2]),
        "satin" => (of(&Draft::satin(5, 2)?), [2, 2]),
        // A gauze is wide: at the close pitch of the others its turning ends would bend more sharply than they are thick.
        "leno" => {
            let [warp, weft] = [0.4, 0.8].map(|pitch| Gauge {
                diameter: 0.2,
                pitch,
            });
            (Yarns::leno(warp, weft, 0.6), [4, 2])
        }
        "lace" => (of(&Draft::lace()).gathered(3, 0.4), [2, 2]),
        _ => return None,
    })
}

/// The file's numbers and the JSON that says where they are.
#[derive(Default)]
struct Gltf {
    bytes: Vec<u8>,
    views: Vec<String>,
    accessors: Vec<String>,
    primitives: Vec<String>,
}

impl Gltf {
    fn accessor(&mut self, bytes: &[u8], what: &str) -> usize {
        let offset = self.bytes.len();
        self.bytes.extend(bytes);
        self.views.push(format!(
            "{{\"buffer\":0,\"byteOffset\":{offset},\"byteLength\":{}}}",
            bytes.len()
        ));
        let view = self.views.len() - 1;
        self.accessors
            .push(format!("{{\"bufferView\":{view},\"byteOffset\":0,{what}}}"));
        view
    }
    fn add(&mut self, mesh: &Mesh, material: usize) {
        let flat = |v: &[[f32; 3]]| -> Vec<u8> {
            v.iter().flatten().flat_map(|x| x.to_le_bytes()).collect()
        };
        let bound = |pick: fn(f32, f32) -> f32, from: f32| {
            let of = |a: usize| mesh.positions.iter().map(|p| p[a]).fold(from, pick);
            format!("[{},{},{}]", of(0), of(1), of(2))
        };
        let n = mesh.positions.len();
        let vec3 = format!("\"componentType\":5126,\"type\":\"VEC3\",\"count\":{n}");
        let (lo, hi) = (bound(f32::min, f32::MAX), bound(f32::max, f32::MIN));
        let p = self.accessor(
            &flat(&mesh.positions),
            &format!("{vec3},\"min\":{lo},\"max\":{hi}"),
        );
        let m = self.accessor(&flat(&mesh.normals), &vec3);
        let bytes: Vec<u8> = mesh
            .triangles
            .iter()
            .flatten()
            .flat_map(|i| i.to_le_bytes())
            .collect();
        let count = 3 * mesh.triangles.len();
        let i = self.accessor(
            &bytes,
            &format!("\"componentType\":5125,\"type\":\"SCALAR\",\"count\":{count}"),
        );
        self.primitives.push(format!(
            "{{\"attributes\":{{\"POSITION\":{p},\"NORMAL\":{m}}},\"indices\":{i},\"material\":{material}}}"
        ));
    }
}

/// A square facing +z or -z.
fn panel(middle: [f32; 3], half: f32, up: f32) -> Mesh {
    let corner = |x: f32, y: f32| [middle[0] + half * x * up, middle[1] + half * y, middle[2]];
    Mesh {
        positions: vec![
            corner(-1.0, -1.0),
            corner(1.0, -1.0),
            corner(1.0, 1.0),
            corner(-1.0, 1.0),
        ],
        normals: vec![[0.0, 0.0, up]; 4],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    }
}

fn write(yarns: &Yarns, repeats: [usize; 2], path: &Path) -> std::io::Result<()> {
    let mut gltf = Gltf::default();
    for (material, warp) in [(0, true), (1, false)] {
        let mut part = yarns.clone();
        part.tubes.retain(|t| t.is_warp == warp);
        gltf.add(&part.mesh(repeats, 24), material);
    }
    let size = [0, 1].map(|a| (yarns.repeat[a] * repeats[a] as f64) as f32);
    let middle = [0.5 * size[0], 0.5 * size[1]];
    gltf.add(&panel([middle[0], middle[1] + 2.0, 4.0], 1.5, -1.0), 2);
    gltf.add(&panel([middle[0], middle[1], -3.0], 5.0, 1.0), 3);
    let bin = path.with_extension("bin");
    let mut json = String::from(
        "{\"asset\":{\"version\":\"2.0\"},\"extensionsUsed\":[\"KHR_materials_emissive_strength\"],\"scene\":0,\"scenes\":[{\"nodes\":[0,1]}],",
    );
    write!(
        json,
        "\"nodes\":[{{\"mesh\":0}},{{\"camera\":0,\"translation\":[{},{},4.2]}}],\
         \"cameras\":[{{\"type\":\"perspective\",\"perspective\":{{\"yfov\":0.6,\"znear\":0.01}}}}],\"meshes\":[{{\"primitives\":[{}]}}],",
        middle[0],
        middle[1],
        gltf.primitives.join(",")
    )
    .expect("a string grows");
    let matt = |c: &str| {
        format!(
            "{{\"doubleSided\":true,\"pbrMetallicRoughness\":{{\"baseColorFactor\":{c},\"metallicFactor\":0,\"roughnessFactor\":0.8}}}}"
        )
    };
    let bright = |c: &str, strength: u32| {
        format!(
            "{{\"emissiveFactor\":{c},\"pbrMetallicRoughness\":{{\"baseColorFactor\":[0,0,0,1]}},\
             \"extensions\":{{\"KHR_materials_emissive_strength\":{{\"emissiveStrength\":{strength}}}}}}}"
        )
    };
    let materials = [
        matt("[0.75,0.68,0.55,1]"),
        matt("[0.35,0.45,0.6,1]"),
        bright("[1,1,1]", 14),
        bright("[0.7,0.62,0.5]", 1),
    ];
    write!(
        json,
        "\"materials\":[{}],\"accessors\":[{}],\"bufferViews\":[{}],\"buffers\":[{{\"byteLength\":{},\"uri\":\"{}\"}}]}}",
        materials.join(","),
        gltf.accessors.join(","),
        gltf.views.join(","),
        gltf.bytes.len(),
        bin.file_name().unwrap_or_default().to_string_lossy()
    )
    .expect("a string grows");
    std::fs::write(&bin, &gltf.bytes)?;
    std::fs::write(path, json)
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [name, path] = &arguments[..] else {
        eprintln!(
            "two arguments are needed: the weave (plain, twill, satin, leno, lace) and the file to write (.gltf)"
        );
        std::process::exit(2);
    };
    let Some((yarns, repeats)) = weave(name) else {
        eprintln!("the weave {name:?} is unknown; there are plain, twill, satin, leno and lace");
        std::process::exit(2);
    };
    let path = PathBuf::from(path);
    if let Err(e) = write(&yarns, repeats, &path) {
        eprintln!("cannot write {}: {e}", path.display());
        std::process::exit(1);
    }
    println!(
        "{}: {} yarns, openness along the normal {:.3}",
        path.display(),
        yarns.tubes.len(),
        yarns.openness(woven_bsdf::vec3::Vec3::new(0.0, 0.0, 1.0), 64)
    );
}
