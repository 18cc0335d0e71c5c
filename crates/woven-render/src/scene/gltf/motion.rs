//! Moving meshes: an animated `.glb` whose morph targets are the frames, or a PC2 point cache.

use super::{Limits, check, guarded, open_checked, read_file};
use crate::scene::Mesh;
use anyhow::{Context, Result, anyhow, bail, ensure};
use glam::{Mat3, Mat4, Quat, Vec2, Vec3};
use serde_json::Value;
use std::path::Path;

/// A mesh over time. One frame is worked out when asked for.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    /// Name of the mesh (or of its node) in the cache; empty for PC2, which has no names.
    pub name: String,
    /// Number of frames.
    pub frames: usize,
    /// Frames a second, where the cache tells.
    pub fps: Option<f64>,
    /// SHA-256 of the cache, in hexadecimal.
    pub hash: String,
    triangles: Vec<[u32; 3]>,
    uvs: Vec<Vec2>,
    rest: Vec<Vec3>,
    rest_normals: Vec<Vec3>,
    /// Differences from the rest pose per target (glTF), or positions per frame (PC2).
    shapes: Vec<Vec<Vec3>>,
    shape_normals: Vec<Vec<Vec3>>,
    /// Per frame: weight of each target that counts. Empty: frame k is shape k itself.
    weights: Vec<Vec<(usize, f32)>>,
    world: Mat4,
}

/// Opens a cache: PC2 by its first bytes, else glTF.
///
/// # Errors
/// A sentence when the file is broken, holds no moving mesh, or is too large.
pub fn open(path: &Path, limits: &Limits) -> Result<Motion> {
    let bytes = read_file(path, limits.file.max(1 << 30))?;
    let told = || format!("cannot read the moving mesh {}", path.display());
    let base = path
        .parent()
        .filter(|p| !p.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    from_bytes(&bytes, base, limits).with_context(told)
}

/// [`open`] from bytes in memory; `base` is the folder that relative URIs start from.
///
/// # Errors
/// See [`open`].
pub fn from_bytes(bytes: &[u8], base: &Path, limits: &Limits) -> Result<Motion> {
    if bytes.starts_with(b"POINTCACHE2") {
        return pc2(bytes);
    }
    guarded(|| morphs(bytes, base, limits))
}

impl Motion {
    /// Number of vertices.
    pub fn vertices(&self) -> usize {
        self.rest.len().max(self.shapes.first().map_or(0, Vec::len))
    }

    /// Puts frame `k` into `mesh`: positions and normals, and triangles and coordinates where the cache has its own.
    ///
    /// # Errors
    /// A sentence when there is no such frame, or a cache without triangles does not fit the mesh.
    pub fn apply(&self, k: usize, mesh: &mut Mesh) -> Result<()> {
        ensure!(
            k < self.frames,
            "the cache has the frames 0..{}, not frame {k}",
            self.frames.saturating_sub(1)
        );
        let (mut positions, mut normals) = (self.rest.clone(), self.rest_normals.clone());
        if self.weights.is_empty() {
            positions.clone_from(&self.shapes[k]);
        } else {
            for &(target, w) in &self.weights[k] {
                positions
                    .iter_mut()
                    .zip(&self.shapes[target])
                    .for_each(|(p, d)| *p += *d * w);
                match self.shape_normals.get(target) {
                    Some(d) => normals.iter_mut().zip(d).for_each(|(n, d)| *n += *d * w),
                    None => normals.clear(),
                }
            }
        }
        if self.triangles.is_empty() {
            ensure!(
                positions.len() == mesh.positions.len(),
                "the cache moves {} vertices, but the mesh '{}' has {}",
                positions.len(),
                mesh.name,
                mesh.positions.len()
            );
        } else {
            mesh.indices.clone_from(&self.triangles);
            mesh.uvs.clone_from(&self.uvs);
        }
        if self.world != Mat4::IDENTITY {
            positions
                .iter_mut()
                .for_each(|p| *p = self.world.transform_point3(*p));
            let turned = Mat3::from_mat4(self.world).inverse().transpose();
            normals.iter_mut().for_each(|n| *n = turned * *n);
        }
        ensure!(
            positions.iter().all(|p| p.is_finite()),
            "frame {k} of the cache holds a position that is not finite"
        );
        mesh.positions = positions;
        mesh.normals = if normals.is_empty() {
            smooth_normals(&mesh.positions, &mesh.indices)
        } else {
            normals
                .into_iter()
                .map(|n| n.try_normalize().unwrap_or(Vec3::Z))
                .collect()
        };
        mesh.moving = true;
        Ok(())
    }
}

/// Vertex normals weighted by area.
fn smooth_normals(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec3> {
    let mut sums = vec![Vec3::ZERO; positions.len()];
    for t in triangles {
        let [a, b, c] = t.map(|i| positions[i as usize]);
        let n = (b - a).cross(c - a);
        t.iter().for_each(|&i| sums[i as usize] += n);
    }
    sums.into_iter()
        .map(|n| n.try_normalize().unwrap_or(Vec3::Z))
        .collect()
}

fn digest(bytes: &[u8]) -> String {
    use sha2::Digest;
    sha2::Sha256::digest(bytes)
        .iter()
        .map(|b| format!("{b:02x}"))
        .collect()
}

/// PC2 (point cache 2): "POINTCACHE2\0", version 1, points, start, rate, samples, then f32 triples. World space here.
fn pc2(bytes: &[u8]) -> Result<Motion> {
    ensure!(
        bytes.starts_with(b"POINTCACHE2\0") && bytes.len() >= 32,
        "it is no PC2 point cache"
    );
    let word =
        |at: usize| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
    let (version, points, rate, samples) = (
        word(12),
        word(16) as usize,
        f32::from_bits(word(24)),
        word(28) as usize,
    );
    ensure!(
        version == 1,
        "the point cache has version {version}; only version 1 is read"
    );
    let need = points.checked_mul(samples).and_then(|n| n.checked_mul(12));
    ensure!(
        points > 0 && samples > 0 && need == Some(bytes.len() - 32),
        "{samples} samples of {points} points do not fill the file's {} bytes",
        bytes.len()
    );
    let shapes = bytes[32..]
        .chunks_exact(points * 12)
        .map(|frame| {
            frame
                .chunks_exact(12)
                .map(|p| {
                    Vec3::from(
                        [0, 4, 8].map(|k| f32::from_le_bytes([p[k], p[k + 1], p[k + 2], p[k + 3]])),
                    )
                })
                .collect()
        })
        .collect();
    let fps = (rate.is_finite() && rate > 0.0).then(|| f64::from(rate));
    Ok(Motion {
        frames: samples,
        fps,
        shapes,
        world: Mat4::IDENTITY,
        hash: digest(bytes),
        ..Motion::default()
    })
}

fn morphs(bytes: &[u8], base: &Path, limits: &Limits) -> Result<Motion> {
    let checked = open_checked(bytes, base, limits)?;
    let (json, buffers) = (&checked.json, &checked.buffers);
    let data = Data { json, buffers };
    let meshes = check::list(json, "meshes");
    // The mesh whose weights are animated; without an animation, the first with targets: frame k is target k.
    let animated = animated_mesh(json)?;
    let with_targets = |m: &Value| {
        m["primitives"]
            .as_array()
            .is_some_and(|p| p.iter().any(|p| p.get("targets").is_some()))
    };
    let mesh = animated
        .as_ref()
        .map(|a| a.mesh)
        .or_else(|| meshes.iter().position(with_targets))
        .context("no mesh in it moves: it has neither morph targets nor an animation of weights")?;
    let primitives = meshes[mesh]["primitives"]
        .as_array()
        .context("the mesh has no primitives")?;
    ensure!(
        primitives.len() == 1,
        "the moving mesh has {} primitives; only one is supported",
        primitives.len()
    );
    let p = &primitives[0];
    ensure!(
        p.get("mode").and_then(Value::as_u64).unwrap_or(4) == 4,
        "the moving mesh is not made of triangles"
    );
    let attribute = |name: &str| p["attributes"].get(name).and_then(Value::as_u64);
    let rest = data.vectors(attribute("POSITION").context("the moving mesh has no positions")?)?;
    let rest_normals = attribute("NORMAL")
        .map(|n| data.vectors(n))
        .transpose()?
        .unwrap_or_default();
    let uvs = attribute("TEXCOORD_0")
        .map(|n| data.numbers(n))
        .transpose()?
        .unwrap_or_default();
    let order = match p.get("indices").and_then(Value::as_u64) {
        Some(n) => data.indices(n)?,
        None => (0..rest.len() as u32).collect(),
    };
    ensure!(
        order.iter().all(|&i| (i as usize) < rest.len()),
        "an index is beyond the {} vertices",
        rest.len()
    );
    let (mut shapes, mut shape_normals) = (Vec::new(), Vec::new());
    for t in p
        .get("targets")
        .and_then(Value::as_array)
        .context("the moving mesh has no morph targets")?
    {
        shapes.push(match t.get("POSITION").and_then(Value::as_u64) {
            Some(n) => data.vectors(n)?,
            None => vec![Vec3::ZERO; rest.len()],
        });
        if let Some(n) = t.get("NORMAL").and_then(Value::as_u64) {
            shape_normals.push(data.vectors(n)?);
        }
    }
    if shape_normals.len() != shapes.len() {
        shape_normals.clear();
    }
    let (weights, fps) = match &animated {
        Some(a) => a.weights(&data, shapes.len())?,
        None => ((0..shapes.len()).map(|k| vec![(k, 1.0)]).collect(), None),
    };
    let nodes = check::list(json, "nodes");
    let node = animated
        .as_ref()
        .map(|a| a.node)
        .or_else(|| nodes.iter().position(|n| n["mesh"] == mesh));
    let name = meshes[mesh]
        .get("name")
        .or_else(|| nodes.get(node?)?.get("name"))
        .and_then(Value::as_str)
        .unwrap_or("");
    Ok(Motion {
        name: name.to_owned(),
        frames: weights.len(),
        fps,
        triangles: order.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
        uvs: uvs.chunks_exact(2).map(|c| Vec2::new(c[0], c[1])).collect(),
        rest,
        rest_normals,
        shapes,
        shape_normals,
        weights,
        world: node.map_or(Mat4::IDENTITY, |n| world(nodes, n)),
        hash: checked.hash,
    })
}

/// The first animation channel that moves weights.
struct Animated {
    node: usize,
    mesh: usize,
    input: u64,
    output: u64,
}

fn animated_mesh(json: &Value) -> Result<Option<Animated>> {
    for (i, a) in check::list(json, "animations").iter().enumerate() {
        for c in a["channels"].as_array().into_iter().flatten() {
            if c["target"]["path"] != "weights" {
                continue;
            }
            let found = || -> Option<Animated> {
                let node = c["target"]["node"].as_u64()? as usize;
                let mesh = check::list(json, "nodes").get(node)?["mesh"].as_u64()? as usize;
                let sampler = a["samplers"].get(c["sampler"].as_u64()? as usize)?;
                if sampler
                    .get("interpolation")
                    .is_some_and(|m| m != "LINEAR" && m != "STEP")
                {
                    return None;
                }
                Some(Animated {
                    node,
                    mesh,
                    input: sampler["input"].as_u64()?,
                    output: sampler["output"].as_u64()?,
                })
            };
            return found().map(Some).ok_or_else(|| {
                anyhow!("animations[{i}] does not name a node, a mesh and a LINEAR or STEP sampler")
            });
        }
    }
    Ok(None)
}

/// Per frame, the targets that count and their weights; and the frame rate, when the frames are evenly spaced.
type Weights = (Vec<Vec<(usize, f32)>>, Option<f64>);

impl Animated {
    fn weights(&self, data: &Data<'_>, targets: usize) -> Result<Weights> {
        let (times, values) = (data.numbers(self.input)?, data.numbers(self.output)?);
        ensure!(
            values.len() == times.len() * targets,
            "{} weights do not fit {} key frames of {targets} targets",
            values.len(),
            times.len()
        );
        let weights = values
            .chunks_exact(targets.max(1))
            .map(|w| {
                w.iter()
                    .copied()
                    .enumerate()
                    .filter(|(_, w)| *w != 0.0)
                    .collect()
            })
            .collect();
        let span = f64::from(times[times.len() - 1] - times[0]);
        let fps = (times.len() > 1 && span > 0.0).then(|| (times.len() - 1) as f64 / span);
        Ok((weights, fps))
    }
}

/// The node's transform to the world, along its parents (the tree has been checked).
fn world(nodes: &[Value], node: usize) -> Mat4 {
    let numbers = |n: &Value, key: &str| -> Option<Vec<f32>> {
        Some(
            n.get(key)?
                .as_array()?
                .iter()
                .map(|v| v.as_f64().unwrap_or(0.0) as f32)
                .collect(),
        )
    };
    let local = |n: &Value| match numbers(n, "matrix") {
        Some(m) => Mat4::from_cols_slice(&m),
        None => {
            let three = |key: &str, d: Vec3| numbers(n, key).map_or(d, |v| Vec3::from_slice(&v));
            let q =
                numbers(n, "rotation").map_or(Quat::IDENTITY, |v| Quat::from_slice(&v).normalize());
            Mat4::from_scale_rotation_translation(
                three("scale", Vec3::ONE),
                q,
                three("translation", Vec3::ZERO),
            )
        }
    };
    let parent = |i: usize| {
        nodes.iter().position(|n| {
            n["children"]
                .as_array()
                .is_some_and(|c| c.iter().any(|v| *v == i))
        })
    };
    let (mut m, mut at) = (local(&nodes[node]), node);
    while let Some(up) = parent(at) {
        m = local(&nodes[up]) * m;
        at = up;
    }
    m
}

/// Dense accessors, read straight from the checked buffers.
struct Data<'a> {
    json: &'a Value,
    buffers: &'a [Vec<u8>],
}

impl Data<'_> {
    /// Calls `each` with the bytes of every element.
    fn elements(&self, index: u64, mut each: impl FnMut(&[u8])) -> Result<check::AccessorShape> {
        let accessors = check::list(self.json, "accessors");
        let a = usize::try_from(index)
            .ok()
            .and_then(|i| accessors.get(i))
            .with_context(|| format!("there is no accessor {index}"))?;
        let shape = check::accessor(self.json, a)?;
        ensure!(
            a.get("sparse").is_none(),
            "accessors[{index}] is sparse, which is not supported in a moving mesh"
        );
        let Some(n) = a.get("bufferView").and_then(Value::as_u64) else {
            bail!("accessors[{index}] has no bufferView")
        };
        let view = &check::list(self.json, "bufferViews")[n as usize];
        let number = |v: &Value, key: &str| v.get(key).and_then(Value::as_u64).map(|n| n as usize);
        let buffer = &self.buffers[number(view, "buffer").unwrap_or(0)];
        let size = shape.size();
        let stride = number(view, "byteStride").unwrap_or(size);
        let start = number(view, "byteOffset").unwrap_or(0) + number(a, "byteOffset").unwrap_or(0);
        for i in 0..shape.count {
            let at = start + i * stride;
            each(
                buffer
                    .get(at..at + size)
                    .context("an accessor reaches beyond its buffer")?,
            );
        }
        Ok(shape)
    }

    fn numbers(&self, index: u64) -> Result<Vec<f32>> {
        let mut out = Vec::new();
        let shape = self.elements(index, |e| {
            out.extend(
                e.chunks_exact(4)
                    .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            );
        })?;
        ensure!(
            shape.component == 5126,
            "accessors[{index}] is not made of 32-bit floats, which a moving mesh needs"
        );
        ensure!(
            out.iter().all(|v| v.is_finite()),
            "accessors[{index}] holds a number that is not finite"
        );
        Ok(out)
    }

    fn vectors(&self, index: u64) -> Result<Vec<Vec3>> {
        Ok(self
            .numbers(index)?
            .chunks_exact(3)
            .map(Vec3::from_slice)
            .collect())
    }

    fn indices(&self, index: u64) -> Result<Vec<u32>> {
        let mut out = Vec::new();
        self.elements(index, |e| {
            out.push(e.iter().rev().fold(0_u32, |n, b| (n << 8) | u32::from(*b)));
        })?;
        Ok(out)
    }
}
