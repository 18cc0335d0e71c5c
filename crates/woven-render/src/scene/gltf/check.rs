//! Checks every index, range, stride, count and cycle of a scene's JSON before anything follows them.
//!
//! The rules are those of the glTF 2.0 specification (section numbers at the checks) as far as memory safety, finite work
//! and finite numbers depend on them; matters of taste are left to validators.

use super::container::Limits;
use anyhow::{Context, Result, anyhow, bail, ensure};
use serde_json::{Map, Value};

/// Extensions a scene may require: understood, or harmless to a renderer of still geometry.
const KNOWN_EXTENSIONS: &[&str] = &[
    "KHR_lights_punctual",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_texture_transform",
];

/// Properties of an accessor that has passed the checks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct AccessorShape {
    pub(super) count: usize,
    pub(super) component: u64,
    pub(super) components: usize,
}

impl AccessorShape {
    fn component_size(self) -> usize {
        match self.component {
            5120 | 5121 => 1,
            5122 | 5123 => 2,
            _ => 4,
        }
    }

    pub(super) fn size(self) -> usize {
        self.component_size() * self.components
    }
}

/// The entries of an array at the top of the document; an absent one is empty.
pub(super) fn list<'a>(root: &'a Value, name: &str) -> &'a [Value] {
    root.get(name)
        .and_then(Value::as_array)
        .map_or(&[], Vec::as_slice)
}

/// Checks everything that can be checked without the buffers' bytes.
///
/// # Errors
/// A sentence that names the object ("accessors\[3\]") and what is wrong with it.
pub(super) fn document(root: &Value, limits: &Limits) -> Result<()> {
    let top = root.as_object().context("the scene's JSON is no object")?;
    let version = root
        .pointer("/asset/version")
        .and_then(Value::as_str)
        .context("asset.version is missing: not a glTF 2.0 scene")?;
    ensure!(
        version.starts_with("2."),
        "the scene is glTF {version}; only glTF 2 is read"
    );
    for (name, value) in top {
        if let Value::Array(entries) = value {
            ensure!(
                entries.len() <= limits.entries,
                "'{name}' has {} entries; at most {} are read",
                entries.len(),
                limits.entries
            );
        }
    }
    numbers(root).context("a number in the scene's JSON is out of range")?;
    for name in list(root, "extensionsRequired") {
        let name = name.as_str().unwrap_or("?");
        ensure!(
            KNOWN_EXTENSIONS.contains(&name),
            "the scene requires the extension {name}, which is not supported; export it without (compression of meshes or pictures, for instance)"
        );
    }
    each(root, "buffers", |b| buffer(b, limits))?;
    each(root, "bufferViews", |v| view(root, v))?;
    each(root, "accessors", |a| accessor(root, a).map(drop))?;
    each(root, "images", |i| image(root, i))?;
    each(root, "textures", |t| {
        optional_index(t, "source", list(root, "images").len())?;
        optional_index(t, "sampler", list(root, "samplers").len())
    })?;
    each(root, "materials", |m| {
        texture_uses(m, list(root, "textures").len())
    })?;
    each(root, "meshes", |m| mesh(root, m))?;
    each(root, "cameras", camera)?;
    each(root, "nodes", |n| node(root, n))?;
    each(root, "scenes", |s| {
        indices(s, "nodes", list(root, "nodes").len()).map(drop)
    })?;
    optional_index(root, "scene", list(root, "scenes").len())?;
    tree(root)?;
    written_out(root, limits)
}

/// Triangles and vertices that a scene may have however few bytes it has; beyond it may have one for each byte of its buffers. A file of
/// a few hundred bytes can ask for a million copies of its one mesh, or for a million zeros.
const FREE: u64 = 1 << 20;

/// What the scene takes when its instances are written out, told before anything is.
fn written_out(root: &Value, limits: &Limits) -> Result<()> {
    let (accessors, meshes) = (list(root, "accessors"), list(root, "meshes"));
    let count = |n: Option<&Value>| {
        n.and_then(Value::as_u64)
            .and_then(|n| accessors.get(n as usize))
            .and_then(|a| a["count"].as_u64())
    };
    let mut sizes = Vec::with_capacity(meshes.len());
    for mesh in meshes {
        let (mut triangles, mut vertices) = (0_u64, 0_u64);
        for p in mesh["primitives"].as_array().into_iter().flatten() {
            let points = count(p["attributes"].get("POSITION")).unwrap_or(0);
            let order = count(p.get("indices")).unwrap_or(points);
            vertices += points;
            triangles += match p.get("mode").and_then(Value::as_u64).unwrap_or(4) {
                4 => order / 3,
                5 | 6 => order.saturating_sub(2),
                _ => 0,
            };
        }
        sizes.push((triangles, vertices));
    }
    let (mut triangles, mut vertices) = (0_u64, 0_u64);
    for n in list(root, "nodes") {
        if let Some((t, v)) = n
            .get("mesh")
            .and_then(Value::as_u64)
            .and_then(|m| sizes.get(m as usize))
        {
            triangles = triangles.saturating_add(*t);
            vertices = vertices.saturating_add(*v);
        }
    }
    ensure!(
        triangles <= limits.triangles as u64,
        "the scene has more than {} triangles when its instances are written out ({triangles})",
        limits.triangles
    );
    let bytes = list(root, "buffers")
        .iter()
        .filter_map(|b| b["byteLength"].as_u64())
        .fold(0, u64::saturating_add);
    ensure!(
        triangles.max(vertices) <= FREE.saturating_add(bytes),
        "the scene has {triangles} triangles and {vertices} vertices when its instances are written out, too many for buffers of {bytes} bytes"
    );
    Ok(())
}

fn each(root: &Value, name: &str, mut check: impl FnMut(&Value) -> Result<()>) -> Result<()> {
    if let Some(value) = root.get(name) {
        ensure!(value.is_array(), "'{name}' is no array");
    }
    for (i, entry) in list(root, name).iter().enumerate() {
        ensure!(entry.is_object(), "{name}[{i}] is no object");
        check(entry).with_context(|| format!("{name}[{i}]"))?;
    }
    Ok(())
}

/// Every number must be finite as f32, wherever it stands: nothing downstream has to ask again.
fn numbers(value: &Value) -> Result<()> {
    match value {
        Value::Number(n) => {
            let x = n.as_f64().unwrap_or(f64::INFINITY);
            ensure!(x.abs() <= f64::from(f32::MAX), "{n} is too large");
            Ok(())
        }
        Value::Array(a) => a.iter().try_for_each(numbers),
        Value::Object(o) => o.values().try_for_each(numbers),
        _ => Ok(()),
    }
}

/// A whole number that is there, in 0..=2^53.
fn whole(value: &Value, key: &str) -> Result<Option<u64>> {
    match value.get(key) {
        None => Ok(None),
        Some(v) => {
            let n = v.as_u64().filter(|n| *n <= 1 << 53);
            Ok(Some(n.ok_or_else(|| {
                anyhow!("{key} = {v} is no whole number of sensible size")
            })?))
        }
    }
}

fn required(value: &Value, key: &str) -> Result<u64> {
    whole(value, key)?.with_context(|| format!("{key} is missing"))
}

fn check_index(n: u64, len: usize, key: &str) -> Result<usize> {
    let i = usize::try_from(n).unwrap_or(usize::MAX);
    ensure!(i < len, "{key} = {n}, but there are only {len}");
    Ok(i)
}

fn optional_index(value: &Value, key: &str, len: usize) -> Result<()> {
    whole(value, key)?.map_or(Ok(()), |n| check_index(n, len, key).map(drop))
}

fn indices(value: &Value, key: &str, len: usize) -> Result<Vec<usize>> {
    let Some(entries) = value.get(key) else {
        return Ok(Vec::new());
    };
    let entries = entries
        .as_array()
        .with_context(|| format!("{key} is no array"))?;
    entries
        .iter()
        .map(|v| {
            check_index(
                v.as_u64()
                    .with_context(|| format!("{key} holds {v}, no index"))?,
                len,
                key,
            )
        })
        .collect()
}

fn object<'a>(value: &'a Value, key: &str) -> Result<Option<&'a Map<String, Value>>> {
    value
        .get(key)
        .map(|v| v.as_object().with_context(|| format!("{key} is no object")))
        .transpose()
}

/// 3.6.1: buffers.
fn buffer(b: &Value, limits: &Limits) -> Result<()> {
    let length = required(b, "byteLength")?;
    ensure!(
        length <= limits.file,
        "byteLength = {length}; at most {} are read",
        limits.file
    );
    if let Some(uri) = b.get("uri") {
        ensure!(uri.is_string(), "uri is no text");
    }
    Ok(())
}

/// 3.6.1: views into buffers.
fn view(root: &Value, v: &Value) -> Result<()> {
    let buffers = list(root, "buffers");
    let buffer = &buffers[check_index(required(v, "buffer")?, buffers.len(), "buffer")?];
    let (offset, length) = (
        whole(v, "byteOffset")?.unwrap_or(0),
        required(v, "byteLength")?,
    );
    let have = required(buffer, "byteLength")?;
    ensure!(length > 0, "byteLength is 0");
    ensure!(
        offset + length <= have,
        "its bytes {offset}..{} lie beyond the buffer's {have}",
        offset + length
    );
    if let Some(stride) = whole(v, "byteStride")? {
        ensure!(
            (4..=252).contains(&stride) && stride % 4 == 0,
            "byteStride = {stride} is not 4, 8, ... 252"
        );
    }
    Ok(())
}

/// 3.6.2: accessors, dense or sparse; every element must lie in its view.
pub(super) fn accessor(root: &Value, a: &Value) -> Result<AccessorShape> {
    let count = required(a, "count")?;
    ensure!(
        (1..=1 << 28).contains(&count),
        "count = {count} is not in 1..=2^28"
    );
    let component = required(a, "componentType")?;
    ensure!(
        [5120, 5121, 5122, 5123, 5125, 5126].contains(&component),
        "componentType = {component} is unknown"
    );
    let kind = a
        .get("type")
        .and_then(Value::as_str)
        .context("type is missing")?;
    let components = match kind {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" | "MAT2" => 4,
        "MAT3" => 9,
        "MAT4" => 16,
        _ => bail!("type '{kind}' is unknown"),
    };
    let shape = AccessorShape {
        count: count as usize,
        component,
        components,
    };
    let offset = whole(a, "byteOffset")?.unwrap_or(0);
    let views = list(root, "bufferViews");
    match whole(a, "bufferView")? {
        Some(n) => {
            let v = &views[check_index(n, views.len(), "bufferView")?];
            fits(
                v,
                offset,
                shape.size() as u64,
                shape.component_size() as u64,
                count,
            )?;
        }
        // 3.6.2.3: without a view the elements are zero; they cost memory all the same.
        None => ensure!(count <= FREE, "{count} elements without a bufferView"),
    }
    if object(a, "sparse")?.is_some() {
        let sparse = &a["sparse"];
        let n = required(sparse, "count")?;
        ensure!(
            (1..=count).contains(&n),
            "sparse.count = {n} is not in 1..={count}"
        );
        for (part, size) in [("indices", 0), ("values", shape.size() as u64)] {
            let p = sparse
                .get(part)
                .filter(|p| p.is_object())
                .with_context(|| format!("sparse.{part} is missing"))?;
            let v = &views[check_index(required(p, "bufferView")?, views.len(), "bufferView")?];
            let size = if part == "indices" {
                match required(p, "componentType")? {
                    5121 => 1,
                    5123 => 2,
                    5125 => 4,
                    other => bail!("sparse.indices.componentType = {other} is no unsigned type"),
                }
            } else {
                size
            };
            // Sparse data are packed, whatever the view says.
            ensure!(
                whole(v, "byteStride")?.is_none(),
                "sparse.{part} uses a bufferView with a stride"
            );
            fits(v, whole(p, "byteOffset")?.unwrap_or(0), size, 1, n)
                .with_context(|| format!("sparse.{part}"))?;
        }
    }
    Ok(shape)
}

fn fits(view: &Value, offset: u64, size: u64, align: u64, count: u64) -> Result<()> {
    let length = required(view, "byteLength")?;
    let stride = whole(view, "byteStride")?.unwrap_or(size);
    ensure!(
        stride >= size,
        "an element has {size} bytes, but the bufferView's stride is {stride}"
    );
    ensure!(
        stride.is_multiple_of(align) && offset.is_multiple_of(align),
        "its elements are not aligned to their {align} bytes"
    );
    let end = offset + stride * (count - 1) + size;
    ensure!(
        end <= length,
        "its {count} elements need {end} bytes, the bufferView has {length}"
    );
    Ok(())
}

fn image(root: &Value, i: &Value) -> Result<()> {
    optional_index(i, "bufferView", list(root, "bufferViews").len())?;
    match (i.get("uri"), i.get("bufferView")) {
        (Some(uri), None) => ensure!(uri.is_string(), "uri is no text"),
        (None, Some(_)) => ensure!(
            i.get("mimeType").is_some_and(Value::is_string),
            "mimeType is missing beside bufferView"
        ),
        _ => bail!("needs either uri or bufferView"),
    }
    Ok(())
}

/// Every "...Texture" below a material names one that exists, extensions included.
fn texture_uses(value: &Value, textures: usize) -> Result<()> {
    match value {
        Value::Object(o) => {
            for (key, v) in o {
                // Extras are the author's own and are not followed.
                if key == "extras" {
                    continue;
                }
                if key.ends_with("Texture") && v.is_object() {
                    check_index(
                        required(v, "index").with_context(|| key.clone())?,
                        textures,
                        &format!("{key}.index"),
                    )?;
                }
                texture_uses(v, textures)?;
            }
            Ok(())
        }
        Value::Array(a) => a.iter().try_for_each(|v| texture_uses(v, textures)),
        _ => Ok(()),
    }
}

/// 3.7.2: attributes of one primitive have one count and the types of table 3.7.2.1.
fn mesh(root: &Value, m: &Value) -> Result<()> {
    let primitives = m
        .get("primitives")
        .and_then(Value::as_array)
        .context("primitives are missing")?;
    for (i, p) in primitives.iter().enumerate() {
        primitive(root, p).with_context(|| format!("primitives[{i}]"))?;
    }
    Ok(())
}

fn primitive(root: &Value, p: &Value) -> Result<()> {
    let accessors = list(root, "accessors");
    let shape = |n: &Value, key: &str| -> Result<AccessorShape> {
        let n = n
            .as_u64()
            .with_context(|| format!("{key} = {n} is no index"))?;
        accessor(root, &accessors[check_index(n, accessors.len(), key)?])
    };
    let attributes = object(p, "attributes")?.context("attributes are missing")?;
    let mut count = None;
    for (name, n) in attributes {
        let s = shape(n, name)?;
        let good = match name.as_str() {
            "POSITION" | "NORMAL" => s.component == 5126 && s.components == 3,
            "TANGENT" => s.component == 5126 && s.components == 4,
            _ if name.starts_with("TEXCOORD_") => {
                matches!(s.component, 5121 | 5123 | 5126) && s.components == 2
            }
            _ if name.starts_with("COLOR_") => {
                matches!(s.component, 5121 | 5123 | 5126) && matches!(s.components, 3 | 4)
            }
            _ => true,
        };
        ensure!(good, "{name} has a type that glTF does not allow for it");
        ensure!(
            *count.get_or_insert(s.count) == s.count,
            "{name} has {} elements, others have {}",
            s.count,
            count.unwrap_or(0)
        );
    }
    if let Some(n) = p.get("indices") {
        let s = shape(n, "indices")?;
        ensure!(
            matches!(s.component, 5121 | 5123 | 5125) && s.components == 1,
            "indices are not unsigned whole numbers"
        );
    }
    if let Some(mode) = whole(p, "mode")? {
        ensure!(mode <= 6, "mode = {mode} is unknown");
    }
    optional_index(p, "material", list(root, "materials").len())?;
    if let Some(targets) = p.get("targets") {
        for (t, target) in targets
            .as_array()
            .context("targets are no array")?
            .iter()
            .enumerate()
        {
            for (name, n) in target
                .as_object()
                .with_context(|| format!("targets[{t}] is no object"))?
            {
                let s = shape(n, name)?;
                ensure!(
                    count.is_none_or(|c| c == s.count),
                    "targets[{t}].{name} has another count than the mesh"
                );
                let known = matches!(name.as_str(), "POSITION" | "NORMAL" | "TANGENT");
                ensure!(
                    !known || (s.component == 5126 && s.components == 3),
                    "targets[{t}].{name} has a type that glTF does not allow"
                );
            }
        }
    }
    Ok(())
}

fn camera(c: &Value) -> Result<()> {
    if c.get("type").and_then(Value::as_str) == Some("perspective") {
        let yfov = c
            .pointer("/perspective/yfov")
            .and_then(Value::as_f64)
            .context("perspective.yfov is missing")?;
        ensure!(
            yfov > 0.0 && yfov < std::f64::consts::PI,
            "yfov = {yfov} is not between 0 and pi"
        );
    }
    Ok(())
}

fn node(root: &Value, n: &Value) -> Result<()> {
    optional_index(n, "mesh", list(root, "meshes").len())?;
    optional_index(n, "camera", list(root, "cameras").len())?;
    for (key, len) in [
        ("matrix", 16),
        ("translation", 3),
        ("rotation", 4),
        ("scale", 3),
    ] {
        if let Some(v) = n.get(key) {
            let a = v.as_array().with_context(|| format!("{key} is no array"))?;
            ensure!(
                a.len() == len && a.iter().all(Value::is_number),
                "{key} must have {len} numbers"
            );
        }
    }
    if let Some(light) = n.pointer("/extensions/KHR_lights_punctual") {
        let lights = root
            .pointer("/extensions/KHR_lights_punctual/lights")
            .and_then(Value::as_array)
            .map_or(0, Vec::len);
        check_index(required(light, "light")?, lights, "light")?;
    }
    Ok(())
}

/// 3.5.2: nodes form trees: no node has two parents or is its own ancestor; roots have no parent.
fn tree(root: &Value) -> Result<()> {
    let nodes = list(root, "nodes");
    let mut parent = vec![None; nodes.len()];
    for (i, n) in nodes.iter().enumerate() {
        for child in indices(n, "children", nodes.len()).with_context(|| format!("nodes[{i}]"))? {
            ensure!(parent[child].is_none(), "nodes[{child}] has two parents");
            parent[child] = Some(i);
        }
    }
    // With one parent each, a walk upwards that does not end within the number of nodes goes round.
    let mut safe = vec![false; nodes.len()];
    for start in 0..nodes.len() {
        let (mut at, mut way) = (start, Vec::new());
        while !safe[at] {
            way.push(at);
            ensure!(
                way.len() <= nodes.len(),
                "nodes[{start}] is among its own ancestors"
            );
            match parent[at] {
                Some(up) => at = up,
                None => break,
            }
        }
        way.into_iter().for_each(|i| safe[i] = true);
    }
    for (s, scene) in list(root, "scenes").iter().enumerate() {
        let mut seen = vec![false; nodes.len()];
        for n in indices(scene, "nodes", nodes.len())? {
            ensure!(
                parent[n].is_none(),
                "scenes[{s}] lists nodes[{n}], which has a parent"
            );
            ensure!(
                !std::mem::replace(&mut seen[n], true),
                "scenes[{s}] lists nodes[{n}] twice"
            );
        }
    }
    Ok(())
}
