//! The animated `.glb`: one morph target a frame (see `cache` for the layout), written and read back without loss of f32 bits
//! in the differences.

use crate::clip::CurtainClip;
use crate::error::{Error, Result};
use crate::mesh::Mesh;
use crate::simulation::Frame;
use crate::weave::weave_strain;
use serde_json::{Value, json};

const F32: u32 = 5126;
const U32: u32 = 5125;
const I16: u32 = 5122;
/// The attribute with the strain of the weave.
const STRAIN: &str = "_WOVEN_STRETCH";

/// Binary chunk and the lists of views and accessors that describe it.
#[derive(Default)]
struct Chunk {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Chunk {
    fn view(&mut self, bytes: impl Iterator<Item = [u8; 4]>, target: Option<u32>) -> usize {
        let from = self.bytes.len();
        self.bytes.extend(bytes.flatten());
        let mut view =
            json!({ "buffer": 0, "byteOffset": from, "byteLength": self.bytes.len() - from });
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.views.push(view);
        self.views.len() - 1
    }

    /// An accessor of vectors with `min` and `max`.
    fn vectors<const N: usize>(
        &mut self,
        values: &[[f32; N]],
        kind: &str,
        target: Option<u32>,
    ) -> usize {
        let view = self.view(values.iter().flatten().map(|v| v.to_le_bytes()), target);
        let (mut min, mut max) = ([f32::INFINITY; N], [f32::NEG_INFINITY; N]);
        for v in values {
            for c in 0..N {
                min[c] = min[c].min(v[c]);
                max[c] = max[c].max(v[c]);
            }
        }
        self.accessors.push(json!({ "bufferView": view, "componentType": F32, "count": values.len(), "type": kind, "min": min.to_vec(), "max": max.to_vec() }));
        self.accessors.len() - 1
    }

    fn scalars(&mut self, values: &[f32]) -> usize {
        let values: Vec<[f32; 1]> = values.iter().map(|&v| [v]).collect();
        self.vectors(&values, "SCALAR", None)
    }

    /// Numbers of -1 to 1 as normalised 16-bit integers, each vertex padded to eight bytes as the format asks.
    fn shorts(&mut self, values: &[[f32; 3]], base: &[[f32; 3]]) -> usize {
        let word = |v: f32| (v.clamp(-1.0, 1.0) * 32767.0).round() as i16;
        let words: Vec<[i16; 4]> = values
            .iter()
            .enumerate()
            .map(|(k, v)| {
                let from = base.get(k).copied().unwrap_or_default();
                let [a, b, c] = std::array::from_fn(|c| word(v[c]).saturating_sub(word(from[c])));
                [a, b, c, 0]
            })
            .collect();
        let bytes = words
            .iter()
            .flat_map(|[a, b, c, d]| [[*a, *b], [*c, *d]])
            .map(|[a, b]| {
                let (a, b) = (a.to_le_bytes(), b.to_le_bytes());
                [a[0], a[1], b[0], b[1]]
            });
        let view = self.view(bytes, Some(34962));
        self.views[view]["byteStride"] = 8.into();
        let (mut min, mut max) = ([i16::MAX; 3], [i16::MIN; 3]);
        for w in &words {
            for c in 0..3 {
                min[c] = min[c].min(w[c]);
                max[c] = max[c].max(w[c]);
            }
        }
        self.accessors.push(json!({ "bufferView": view, "componentType": I16, "normalized": true, "count": values.len(), "type": "VEC3", "min": min, "max": max }));
        self.accessors.len() - 1
    }

    fn indices(&mut self, values: &[u32]) -> usize {
        let view = self.view(values.iter().map(|v| v.to_le_bytes()), Some(34963));
        let max = values.iter().max().copied().unwrap_or(0);
        self.accessors.push(json!({ "bufferView": view, "componentType": U32, "count": values.len(), "type": "SCALAR", "min": [0], "max": [max] }));
        self.accessors.len() - 1
    }
}

fn differences(a: &[[f32; 3]], base: &[[f32; 3]]) -> Vec<[f32; 3]> {
    a.iter()
        .zip(base)
        .map(|(a, b)| std::array::from_fn(|c| a[c] - b[c]))
        .collect()
}

/// The clip as bytes of a `.glb`. A clip without frames is a plain mesh.
pub(crate) fn encode(clip: &CurtainClip) -> Result<Vec<u8>> {
    let (mesh, n) = (&clip.mesh, clip.frames.len());
    let finite = |v: &[[f32; 3]]| v.iter().flatten().all(|c| c.is_finite());
    if mesh.indices.is_empty() {
        return Err(Error::Cache(
            "this clip has no faces, so it cannot become a .glb; write a .pc2".into(),
        ));
    }
    if !finite(&mesh.positions)
        || !clip
            .frames
            .iter()
            .all(|f| finite(&f.positions) && f.positions.len() == mesh.positions.len())
    {
        return Err(Error::Cache("the clip holds positions that are not numbers or frames of another size; nothing is written".into()));
    }
    let mut chunk = Chunk::default();
    let vertex = Some(34962);
    let position = chunk.vectors(&mesh.positions, "VEC3", vertex);
    let normal = chunk.vectors(&mesh.normals, "VEC3", vertex);
    let uv = chunk.vectors(&mesh.uvs, "VEC2", vertex);
    let index = chunk.indices(&mesh.indices);
    let mut primitive = json!({ "attributes": { "POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv }, "indices": index, "mode": 4, "material": 0 });
    let strain = weave_strain(mesh, &mesh.positions);
    if !strain.is_empty() {
        primitive["attributes"][STRAIN] = chunk.shorts(&strain, &[]).into();
    }
    let extras = json!({
        "woven": { "fabric_size": mesh.fabric_size, "grid": mesh.grid, "fps": clip.fps, "frames": n },
        "targetNames": (0..n).map(|k| format!("frame_{k:04}")).collect::<Vec<_>>(),
    });
    let mut root = json!({
        "asset": { "version": "2.0", "generator": concat!("woven-cloth ", env!("CARGO_PKG_VERSION")) },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "name": "curtain", "mesh": 0 }],
        "materials": [{ "name": "cloth", "doubleSided": true, "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.9 } }],
    });
    let mut curtain = json!({ "name": "curtain", "extras": extras });
    if n > 0 {
        let targets: Vec<Value> = clip
            .frames
            .iter()
            .map(|f| {
                let p = chunk.vectors(&differences(&f.positions, &mesh.positions), "VEC3", vertex);
                let n = chunk.vectors(&differences(&f.normals, &mesh.normals), "VEC3", vertex);
                let mut target = json!({ "POSITION": p, "NORMAL": n });
                if !strain.is_empty() {
                    let now = weave_strain(mesh, &f.positions);
                    target[STRAIN] = chunk.shorts(&now, &strain).into();
                }
                target
            })
            .collect();
        primitive["targets"] = targets.into();
        let times: Vec<f32> = (0..n).map(|k| (k as f64 / clip.fps) as f32).collect();
        let mut weights = vec![0.0; n * n];
        for k in 0..n {
            weights[k * n + k] = 1.0;
        }
        let (input, output) = (chunk.scalars(&times), chunk.scalars(&weights));
        let mut start = vec![0.0; n];
        start[0] = 1.0;
        curtain["weights"] = start.into();
        root["animations"] = json!([{
            "name": "wind",
            "samplers": [{ "input": input, "output": output, "interpolation": "LINEAR" }],
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": "weights" } }],
        }]);
    }
    curtain["primitives"] = json!([primitive]);
    root["meshes"] = json!([curtain]);
    root["accessors"] = chunk.accessors.into();
    root["bufferViews"] = chunk.views.into();
    root["buffers"] = json!([{ "byteLength": chunk.bytes.len() }]);
    let mut text = root.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let total = 12 + 8 + text.len() + 8 + chunk.bytes.len();
    let total = u32::try_from(total).map_err(|_| {
        Error::Cache("the clip is larger than the 4 GiB that a .glb can hold; write a .pc2".into())
    })?;
    let mut out = Vec::with_capacity(total as usize);
    for word in [0x4654_6c67, 2, total, text.len() as u32, 0x4e4f_534a] {
        out.extend_from_slice(&word.to_le_bytes());
    }
    out.extend_from_slice(&text);
    for word in [chunk.bytes.len() as u32, 0x004e_4942] {
        out.extend_from_slice(&word.to_le_bytes());
    }
    out.extend_from_slice(&chunk.bytes);
    Ok(out)
}

/// A reader over the parsed JSON and the binary chunk of a file of ours.
struct Reader<'a> {
    root: Value,
    bytes: &'a [u8],
}

fn bad(what: &str) -> Error {
    Error::Cache(format!("this is no .glb of ours: {what}"))
}

impl Reader<'_> {
    fn words(&self, accessor: &Value, kind: u32, width: usize) -> Result<Vec<[u8; 4]>> {
        let a = accessor
            .as_u64()
            .and_then(|k| self.root["accessors"].get(k as usize))
            .ok_or_else(|| bad("an accessor is missing"))?;
        if a["componentType"].as_u64() != Some(u64::from(kind)) {
            return Err(bad("an accessor has another type of number"));
        }
        let view = a["bufferView"]
            .as_u64()
            .and_then(|k| self.root["bufferViews"].get(k as usize))
            .ok_or_else(|| bad("a view is missing"))?;
        let from = view["byteOffset"].as_u64().unwrap_or(0) as usize;
        let count = a["count"].as_u64().unwrap_or(0) as usize;
        let size = count
            .checked_mul(width * 4)
            .ok_or_else(|| bad("a count is too large"))?;
        let part = self
            .bytes
            .get(from..)
            .and_then(|b| b.get(..size))
            .ok_or_else(|| bad("it is cut short"))?;
        Ok(part
            .chunks_exact(4)
            .map(|b| [b[0], b[1], b[2], b[3]])
            .collect())
    }

    fn vectors<const N: usize>(&self, accessor: &Value) -> Result<Vec<[f32; N]>> {
        let words = self.words(accessor, F32, N)?;
        Ok(words
            .chunks_exact(N)
            .map(|w| std::array::from_fn(|c| f32::from_le_bytes(w[c])))
            .collect())
    }
}

/// Reads a `.glb` written by `encode`. Velocities are differences of neighbouring frames.
pub(crate) fn decode(bytes: &[u8]) -> Result<CurtainClip> {
    let word = |at: usize| {
        bytes
            .get(at..at + 4)
            .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
    };
    if word(0) != Some(0x4654_6c67) || word(4) != Some(2) {
        return Err(bad("the header is missing"));
    }
    let text = word(12).ok_or_else(|| bad("it is cut short"))? as usize;
    let json = bytes
        .get(20..20 + text)
        .ok_or_else(|| bad("it is cut short"))?;
    let root: Value = serde_json::from_slice(json).map_err(|e| bad(&e.to_string()))?;
    let reader = Reader {
        root,
        bytes: bytes
            .get(28 + text..)
            .ok_or_else(|| bad("it is cut short"))?,
    };
    let mesh = &reader.root["meshes"][0];
    let (primitive, about) = (&mesh["primitives"][0], &mesh["extras"]["woven"]);
    let number = |v: &Value| v.as_f64().ok_or_else(|| bad("`extras.woven` is missing"));
    let rest = Mesh {
        positions: reader.vectors(&primitive["attributes"]["POSITION"])?,
        normals: reader.vectors(&primitive["attributes"]["NORMAL"])?,
        uvs: reader.vectors(&primitive["attributes"]["TEXCOORD_0"])?,
        indices: reader
            .words(&primitive["indices"], U32, 1)?
            .into_iter()
            .map(u32::from_le_bytes)
            .collect(),
        fabric_size: [
            number(&about["fabric_size"][0])? as f32,
            number(&about["fabric_size"][1])? as f32,
        ],
        grid: [
            number(&about["grid"][0])? as usize,
            number(&about["grid"][1])? as usize,
        ],
        second: None,
    };
    let fps = number(&about["fps"])?;
    let mut frames = Vec::new();
    let none = Vec::new();
    for target in primitive["targets"].as_array().unwrap_or(&none) {
        let add = |d: Vec<[f32; 3]>, base: &[[f32; 3]]| -> Vec<[f32; 3]> {
            d.iter()
                .zip(base)
                .map(|(d, b)| std::array::from_fn(|c| d[c] + b[c]))
                .collect()
        };
        let positions = add(reader.vectors(&target["POSITION"])?, &rest.positions);
        let normals = add(reader.vectors(&target["NORMAL"])?, &rest.normals);
        frames.push(Frame {
            positions,
            normals,
            velocities: Vec::new(),
        });
    }
    for k in 0..frames.len() {
        let (a, b) = (k.saturating_sub(1), (k + 1).min(frames.len() - 1));
        let rate = fps as f32 / (b - a).max(1) as f32;
        frames[k].velocities = differences(&frames[b].positions, &frames[a].positions)
            .into_iter()
            .map(|d| d.map(|c| c * rate))
            .collect();
    }
    Ok(CurtainClip {
        mesh: rest,
        frames,
        fps,
    })
}
