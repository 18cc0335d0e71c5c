//! Reads glTF 2.0 scenes (`.glb`, `.gltf`) that nobody vouches for: first our own checks, then the gltf crate, then a
//! second look at what it gives.
//!
//! Luminous units are taken as radiometric ones of the same scale: nits as radiance, candela as intensity, lux as irradiance.

mod check;
mod container;
mod images;
mod material;
pub mod motion;
mod png;
mod uri;

pub use container::{Limits, read_file};
pub use images::decode_picture;
pub use uri::{Source, resolve};

use super::fabric::dress;
use super::{Camera, LAYER_LAMPS, LAYER_SUN, Light, Material, Mesh, Portal, Scene};
use anyhow::{Context, Result, anyhow, bail, ensure};
use glam::{Mat3, Mat4, Vec2, Vec3};
use gltf::khr_lights_punctual::Kind;
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

/// What to do beside reading.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Fabrics by material name; they win over the scene's own.
    pub fabrics: Vec<(String, PathBuf)>,
    /// Name of the camera to use; the first one without.
    pub camera: Option<String>,
    /// Sizes that are refused.
    pub limits: Limits,
}

/// A scene and what was noticed while reading it.
#[derive(Clone, Debug, Default)]
pub struct Loaded {
    /// The scene in world space.
    pub scene: Scene,
    /// Things that were left out, one sentence each.
    pub notes: Vec<String>,
    /// SHA-256 of the scene file and the buffers it uses, in hexadecimal.
    pub hash: String,
}

/// A scene file whose JSON has passed every check and whose buffers are in memory.
pub(super) struct Checked {
    pub(super) json: Value,
    pub(super) buffers: Vec<Vec<u8>>,
    pub(super) hash: String,
}

/// Reads a scene.
///
/// # Errors
/// A sentence that names the file and the object in it that is wrong. Never panics, whatever the file holds.
pub fn load(path: &Path, options: &Options) -> Result<Loaded> {
    let bytes = read_file(path, options.limits.file)?;
    let base = match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    load_bytes(&bytes, base, options)
        .with_context(|| format!("cannot read the scene {}", path.display()))
}

/// [`load`] from bytes in memory; `base` is the folder that relative URIs start from.
///
/// # Errors
/// See [`load`].
pub fn load_bytes(bytes: &[u8], base: &Path, options: &Options) -> Result<Loaded> {
    guarded(|| {
        let checked = open_checked(bytes, base, &options.limits)?;
        assemble(checked, base, options)
    })
}

/// The second net: a panic in a library becomes a sentence.
pub(super) fn guarded<T>(work: impl FnOnce() -> Result<T>) -> Result<T> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        let told = panic
            .downcast_ref::<&str>()
            .map(|s| (*s).to_owned())
            .or_else(|| panic.downcast_ref::<String>().cloned());
        Err(anyhow!(
            "the glTF reader gave up on this file ({}); is it damaged?",
            told.unwrap_or_else(|| "no reason given".into())
        ))
    })
}

/// Takes the file apart, checks its JSON, loads and measures its buffers.
pub(super) fn open_checked(bytes: &[u8], base: &Path, limits: &Limits) -> Result<Checked> {
    let container::Container { json, bin } = container::open(bytes, limits)?;
    check::document(&json, limits)?;
    let mut hasher = Sha256::new();
    hasher.update(bytes);
    let mut buffers = Vec::new();
    let mut total = 0_u64;
    let mut bin = bin;
    for (i, b) in check::list(&json, "buffers").iter().enumerate() {
        let want = b["byteLength"].as_u64().unwrap_or(0);
        let data = match b.get("uri").and_then(Value::as_str) {
            Some(text) => {
                match uri::resolve(base, text).with_context(|| format!("buffers[{i}]"))? {
                    Source::Data(data) => data,
                    Source::File(path) => read_file(&path, limits.file)?,
                }
            }
            None if i == 0 => bin
                .take()
                .context("buffers[0] has no uri, and the file has no binary chunk")?,
            None => bail!("buffers[{i}] has no uri"),
        };
        ensure!(
            data.len() as u64 >= want,
            "buffers[{i}] says {want} bytes and has {}",
            data.len()
        );
        total += data.len() as u64;
        ensure!(
            total <= limits.buffers,
            "the buffers take more than {} MiB together",
            limits.buffers >> 20
        );
        if b.get("uri").is_some() {
            hasher.update(&data);
        }
        buffers.push(data);
    }
    let hash = hasher
        .finalize()
        .iter()
        .map(|b| format!("{b:02x}"))
        .collect();
    Ok(Checked {
        json,
        buffers,
        hash,
    })
}

/// Makes the JSON such that the crate's validation agrees with ours: known extensions are no longer "required",
/// bounds (which are not used) are always there, animations and skins are gone.
fn tame(json: &mut Value) {
    let Some(top) = json.as_object_mut() else {
        return;
    };
    for key in ["extensionsRequired", "animations", "skins"] {
        top.remove(key);
    }
    let mut positions = Vec::new();
    for m in top
        .get("meshes")
        .and_then(Value::as_array)
        .into_iter()
        .flatten()
    {
        for p in m["primitives"].as_array().into_iter().flatten() {
            positions.extend(p["attributes"].get("POSITION").and_then(Value::as_u64));
        }
    }
    if let Some(accessors) = top.get_mut("accessors").and_then(Value::as_array_mut) {
        for n in positions {
            if let Some(a) = accessors.get_mut(n as usize) {
                a["min"] = serde_json::json!([0.0, 0.0, 0.0]);
                a["max"] = serde_json::json!([0.0, 0.0, 0.0]);
            }
        }
    }
    for s in top
        .get_mut("scenes")
        .and_then(Value::as_array_mut)
        .into_iter()
        .flatten()
    {
        // The crate insists on what the specification leaves open.
        if let Some(s) = s.as_object_mut() {
            s.entry("nodes").or_insert_with(|| serde_json::json!([]));
        }
    }
    for n in top
        .get_mut("nodes")
        .and_then(Value::as_array_mut)
        .into_iter()
        .flatten()
    {
        if let Some(n) = n.as_object_mut() {
            n.remove("skin");
        }
    }
}

fn assemble(checked: Checked, base: &Path, options: &Options) -> Result<Loaded> {
    let Checked {
        mut json,
        buffers,
        hash,
    } = checked;
    let mut notes = Vec::new();
    for (key, what) in [
        ("skins", "skins (meshes stay as modelled)"),
        ("animations", "animations"),
    ] {
        match check::list(&json, key).len() {
            0 => {}
            n => notes.push(format!("{n} {what} left out")),
        }
    }
    tame(&mut json);
    let root: gltf::json::Root =
        serde_json::from_value(json).context("the scene's JSON does not follow glTF 2.0")?;
    let document = gltf::Document::from_json(root)
        .map_err(|e| anyhow!("the scene does not follow glTF 2.0: {e}"))?;

    let mut pictures = images::Pictures::new(&document, base, &buffers, &options.limits);
    let (mut materials, sets): (Vec<_>, Vec<_>) = document
        .materials()
        .map(|m| material::convert(&m, &mut pictures, &mut notes))
        .collect::<Result<Vec<_>>>()?
        .into_iter()
        .unzip();
    for (m, material) in document.materials().zip(&mut materials) {
        if let Some(file) = woven_extra(m.extras().as_deref())
            .as_ref()
            .and_then(|v| v.as_str())
        {
            let found = uri::resolve(base, file)
                .with_context(|| format!("the fabric of material '{}'", material.name))?;
            let Source::File(found) = found else {
                bail!("the fabric of material '{}' must be a file", material.name)
            };
            dress(material, &found, &mut pictures.textures)?;
        }
    }
    for (name, file) in &options.fabrics {
        let mut hit = false;
        for material in materials.iter_mut().filter(|m| m.name == *name) {
            dress(material, file, &mut pictures.textures)?;
            hit = true;
        }
        let names = || {
            materials
                .iter()
                .map(|m| m.name.as_str())
                .collect::<Vec<_>>()
                .join(", ")
        };
        ensure!(
            hit,
            "--fabric {name}=...: the scene has no material '{name}'; it has {}",
            names()
        );
    }
    let textures = std::mem::take(&mut pictures.textures);
    let mut scene = Scene {
        materials,
        textures,
        ..Scene::default()
    };
    let mut walk = Walk {
        buffers: &buffers,
        options,
        sets: &sets,
        scene: &mut scene,
        notes: &mut notes,
        triangles: 0,
        camera_found: false,
        plain: None,
    };
    walk.run(&document)?;
    let camera_found = walk.camera_found;
    if !camera_found {
        if let Some(name) = &options.camera {
            let all: Vec<_> = document
                .cameras()
                .filter_map(|c| c.name().map(str::to_owned))
                .collect();
            bail!(
                "the scene has no camera '{name}'; it has {}",
                if all.is_empty() {
                    "none with a name".into()
                } else {
                    all.join(", ")
                }
            );
        }
        scene.camera = frame_all(&scene);
        notes.push(
            "the scene has no camera; one that sees everything was put in front of it".into(),
        );
    }
    ensure!(!scene.meshes.is_empty(), "the scene shows no triangle");
    notes.dedup();
    Ok(Loaded { scene, notes, hash })
}

/// `fabric_size`, metres of cloth along u and v, of a mesh's `extras.woven`; nothing where it is no size.
fn fabric_size(extra: &Value) -> Option<[f32; 2]> {
    let side = |k: usize| {
        let metres = extra.get("fabric_size")?.get(k)?.as_f64()? as f32;
        (metres.is_finite() && metres > 0.0).then_some(metres)
    };
    Some([side(0)?, side(1)?])
}

/// `extras.woven`, whatever it is.
fn woven_extra(extras: Option<&serde_json::value::RawValue>) -> Option<Value> {
    let value: Value = serde_json::from_str(extras?.get()).ok()?;
    value.get("woven").cloned()
}

struct Walk<'a> {
    buffers: &'a [Vec<u8>],
    options: &'a Options,
    /// The set of texture coordinates of each material.
    sets: &'a [u32],
    scene: &'a mut Scene,
    notes: &'a mut Vec<String>,
    triangles: usize,
    camera_found: bool,
    /// Number of the material of primitives that name none.
    plain: Option<usize>,
}

impl Walk<'_> {
    fn run(&mut self, document: &gltf::Document) -> Result<()> {
        let scene = document
            .default_scene()
            .or_else(|| document.scenes().next())
            .context("the file holds no scene")?;
        let mut stack: Vec<_> = scene.nodes().map(|n| (n, Mat4::IDENTITY)).collect();
        stack.reverse();
        while let Some((node, parent)) = stack.pop() {
            let world = parent * Mat4::from_cols_array_2d(&node.transform().matrix());
            ensure!(
                world.is_finite(),
                "nodes[{}] has a transform that is not finite",
                node.index()
            );
            let children = stack.len();
            stack.extend(node.children().map(|c| (c, world)));
            stack[children..].reverse();
            self.node(&node, world).with_context(|| {
                format!(
                    "nodes[{}]{}",
                    node.index(),
                    node.name().map(|n| format!(" '{n}'")).unwrap_or_default()
                )
            })?;
        }
        Ok(())
    }

    fn node(&mut self, node: &gltf::Node<'_>, world: Mat4) -> Result<()> {
        if let Some(mesh) = node.mesh() {
            let portal = woven_extra(node.extras().as_deref()).is_some_and(|v| v == "portal");
            // A curtain tells how large its cloth is at rest.
            let cloth = woven_extra(mesh.extras().as_deref()).and_then(|v| fabric_size(&v));
            let scale = world.determinant().abs().cbrt();
            for primitive in mesh.primitives() {
                let name = node.name().or(mesh.name()).unwrap_or("mesh");
                let made = self
                    .primitive(name, &primitive, world)
                    .with_context(|| format!("primitives[{}]", primitive.index()))?;
                let Some(mut made) = made else { continue };
                made.at_rest = cloth.map(|c| c.map(|metres| metres * scale));
                if portal {
                    self.scene.portals.push(portal_of(&made)?);
                } else {
                    if let Some(colors) = self.colors(&primitive)? {
                        self.scene.colors.push((self.scene.meshes.len(), colors));
                    }
                    self.scene.meshes.push(made);
                }
            }
        }
        if let Some(camera) = node.camera() {
            self.camera(&camera, node, world);
        }
        if let Some(light) = node.light() {
            self.light(&light, world);
        }
        Ok(())
    }

    fn primitive(
        &mut self,
        name: &str,
        p: &gltf::Primitive<'_>,
        world: Mat4,
    ) -> Result<Option<Mesh>> {
        use gltf::mesh::Mode;
        let reader = p.reader(|b| self.buffers.get(b.index()).map(Vec::as_slice));
        let Some(positions) = reader.read_positions() else {
            self.notes
                .push("a primitive without positions left out".into());
            return Ok(None);
        };
        let local: Vec<Vec3> = positions.map(Vec3::from).collect();
        ensure!(
            local.iter().all(|p| p.is_finite()),
            "a position is not finite"
        );
        let order: Vec<u32> = match reader.read_indices() {
            Some(i) => i.into_u32().collect(),
            None => (0..local.len() as u32).collect(),
        };
        ensure!(
            order.iter().all(|&i| (i as usize) < local.len()),
            "an index is beyond the {} vertices",
            local.len()
        );
        let indices: Vec<[u32; 3]> = match p.mode() {
            Mode::Triangles => order.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
            Mode::TriangleStrip => order
                .windows(3)
                .enumerate()
                .map(|(i, t)| {
                    if i % 2 == 0 {
                        [t[0], t[1], t[2]]
                    } else {
                        [t[1], t[0], t[2]]
                    }
                })
                .collect(),
            Mode::TriangleFan => order
                .get(1..)
                .unwrap_or(&[])
                .windows(2)
                .map(|t| [order[0], t[0], t[1]])
                .collect(),
            _ => {
                self.notes.push("points and lines left out".into());
                return Ok(None);
            }
        };
        self.triangles = self.triangles.saturating_add(indices.len());
        let limit = self.options.limits.triangles;
        ensure!(
            self.triangles <= limit,
            "the scene has more than {limit} triangles when its instances are written out"
        );
        let positions: Vec<Vec3> = local.iter().map(|&p| world.transform_point3(p)).collect();
        ensure!(
            positions.iter().all(|p| p.is_finite()),
            "a transformed position is not finite"
        );
        let turned = normal_matrix(world);
        let normals: Vec<Vec3> = match reader.read_normals() {
            Some(n) => n
                .map(|n| (turned * Vec3::from(n)).try_normalize().unwrap_or(Vec3::Y))
                .collect(),
            None => Vec::new(),
        };
        let set = p.material().index().and_then(|i| self.sets.get(i)).copied();
        let uvs: Vec<Vec2> = match reader.read_tex_coords(set.unwrap_or(0)) {
            Some(uv) => uv.into_f32().map(Vec2::from).collect(),
            None => Vec::new(),
        };
        ensure!(
            uvs.iter().all(|uv| uv.is_finite()),
            "a texture coordinate is not finite"
        );
        // A mirroring transform turns every triangle's front to the back.
        let indices = if world.determinant() < 0.0 {
            indices.into_iter().map(|[a, b, c]| [a, c, b]).collect()
        } else {
            indices
        };
        let material = match p.material().index() {
            Some(i) => i,
            None => *self.plain.get_or_insert_with(|| {
                self.scene
                    .materials
                    .push(Material::matt("no material", [0.8; 3]));
                self.scene.materials.len() - 1
            }),
        };
        Ok(Some(Mesh {
            name: name.to_owned(),
            positions,
            normals,
            uvs,
            indices,
            material,
            moving: false,
            at_rest: None,
        }))
    }

    /// COLOR_0 of a primitive, linear; its alpha is left out.
    fn colors(&mut self, p: &gltf::Primitive<'_>) -> Result<Option<Vec<[f32; 3]>>> {
        let reader = p.reader(|b| self.buffers.get(b.index()).map(Vec::as_slice));
        let Some(colors) = reader.read_colors(0) else {
            return Ok(None);
        };
        let all: Vec<[f32; 4]> = colors.into_rgba_f32().collect();
        ensure!(
            all.iter().flatten().all(|c| c.is_finite()),
            "a colour of a vertex is not finite"
        );
        if all.iter().any(|c| c[3] < 1.0)
            && p.material().alpha_mode() != gltf::material::AlphaMode::Opaque
        {
            self.notes
                .push("the alpha of vertex colours left out".into());
        }
        Ok(Some(all.iter().map(|c| [c[0], c[1], c[2]]).collect()))
    }

    fn camera(&mut self, camera: &gltf::Camera<'_>, node: &gltf::Node<'_>, world: Mat4) {
        let named = [camera.name(), node.name()]
            .into_iter()
            .flatten()
            .any(|n| self.options.camera.as_deref() == Some(n));
        if self.camera_found || (self.options.camera.is_some() && !named) {
            return;
        }
        let gltf::camera::Projection::Perspective(lens) = camera.projection() else {
            self.notes.push("an orthographic camera left out".into());
            return;
        };
        let (_, rotation, position) = world.to_scale_rotation_translation();
        let extra = woven_extra(camera.extras().as_deref()).unwrap_or_default();
        let number = |key: &str, default: f32| {
            extra
                .get(key)
                .and_then(Value::as_f64)
                .map_or(default, |v| v as f32)
        };
        self.scene.camera = Camera {
            transform: Mat4::from_rotation_translation(rotation.normalize(), position),
            vfov: lens.yfov(),
            exposure: number("exposure", 0.0).clamp(-30.0, 30.0),
            aperture_radius: number("aperture_radius", 0.0).max(0.0),
            focus_distance: number("focus_distance", 1.0).max(1e-3),
        };
        self.camera_found = self.scene.camera.transform.is_finite();
    }

    fn light(&mut self, light: &gltf::khr_lights_punctual::Light<'_>, world: Mat4) {
        let intensity = light.color().map(|c| (c * light.intensity()).max(0.0));
        let position = world.w_axis.truncate();
        // Lights shine along their -Z.
        let direction = (-world.z_axis.truncate())
            .try_normalize()
            .unwrap_or(-Vec3::Z);
        self.scene.lights.push(match light.kind() {
            Kind::Directional => {
                let extra = woven_extra(light.extras().as_deref()).unwrap_or_default();
                let radius = extra
                    .get("angular_radius")
                    .and_then(Value::as_f64)
                    .unwrap_or(0.0) as f32;
                Light::Sun {
                    direction: -direction,
                    irradiance: intensity,
                    angular_radius: radius.clamp(0.0, 1.5),
                    layer: LAYER_SUN,
                }
            }
            Kind::Point => Light::Point {
                position,
                intensity,
                layer: LAYER_LAMPS,
            },
            Kind::Spot {
                inner_cone_angle,
                outer_cone_angle,
            } => {
                let outer = outer_cone_angle.clamp(1e-3, std::f32::consts::FRAC_PI_2);
                Light::Spot {
                    position,
                    direction,
                    intensity,
                    inner_angle: inner_cone_angle.clamp(0.0, outer - 1e-4),
                    outer_angle: outer,
                    layer: LAYER_LAMPS,
                }
            }
        });
    }
}

/// Inverse transpose, up to scale, also where the transform is flat.
fn normal_matrix(world: Mat4) -> Mat3 {
    let m = Mat3::from_mat4(world);
    let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
    let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    Mat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * sign
}

/// A window marked `extras.woven = "portal"`: a mesh that is one parallelogram, facing inside.
fn portal_of(mesh: &Mesh) -> Result<Portal> {
    ensure!(
        mesh.indices.len() == 2,
        "a portal must be one quadrilateral (two triangles)"
    );
    let [a, b, c] = mesh.indices[0].map(|i| mesh.positions[i as usize]);
    // The corner opposite the longest side has the right angle.
    let corners = [(a, b, c), (b, c, a), (c, a, b)];
    let (corner, p, q) = corners
        .into_iter()
        .max_by(|x, y| (x.1 - x.2).length().total_cmp(&(y.1 - y.2).length()))
        .unwrap_or((a, b, c));
    let portal = Portal {
        corner,
        edge_u: p - corner,
        edge_v: q - corner,
    };
    ensure!(
        portal.edge_u.cross(portal.edge_v).length() > 1e-12,
        "the portal has no area"
    );
    Ok(portal)
}

/// A camera in front (+Z) of everything, looking at the middle.
fn frame_all(scene: &Scene) -> Camera {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for p in scene.meshes.iter().flat_map(|m| &m.positions) {
        (low, high) = (low.min(*p), high.max(*p));
    }
    if !low.is_finite() || !high.is_finite() {
        return Camera::default();
    }
    let (middle, radius) = ((low + high) * 0.5, ((high - low).length() * 0.5).max(1e-3));
    let vfov = 0.7_f32;
    let away = Vec3::new(0.45, 0.3, 1.0).normalize() * (radius / (vfov * 0.5).sin() * 1.05);
    Camera::look_at(middle + away, middle, Vec3::Y, vfov)
}
