//! The shader's text, put together from the pair files and the generated optics, and its pipeline.

use super::rows;
use crate::rng::SOBOL;
use crate::table::{EVEN, MATT, MEASURED, MaterialRow, NONE, SKY, Table};

/// What the shader is made for: names of constants in `shader/table.wgsl` that are false where a scene has nothing of
/// the kind, and where the rows lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Traits {
    /// The rows of the scene are read from textures (see `rows.rs`).
    pub textures: bool,
    /// Some material has a texture, or some mesh colours.
    pub textured: bool,
    /// Some material is measured.
    pub measures: bool,
    /// Some material has lobes, or a gap that depends on the direction.
    pub lobes: bool,
    /// The lights stand in a tree.
    pub clusters: bool,
    /// There is an environment.
    pub skies: bool,
}

impl Traits {
    /// Of everything that there is.
    #[must_use]
    pub fn all(textures: bool) -> Self {
        Self {
            textures,
            textured: true,
            measures: true,
            lobes: true,
            clusters: true,
            skies: true,
        }
    }

    /// Of a scene.
    pub(super) fn of(table: &Table, textures: bool) -> Self {
        let material = |f: &dyn Fn(&MaterialRow) -> bool| table.materials.iter().any(f);
        Self {
            textures,
            textured: table.shade.iter().any(|s| s.colors[3] != 0)
                || material(&|m| {
                    [
                        m.color_texture,
                        m.coverage_texture,
                        m.emission_texture,
                        m.normal_texture,
                        m.gloss_texture,
                    ]
                    .iter()
                    .any(|t| *t != NONE)
                }),
            measures: material(&|m| m.flags & MEASURED != 0),
            lobes: material(&|m| m.flags & (MATT | EVEN) != MATT | EVEN),
            clusters: table.globals.tree != NONE,
            skies: table.globals.sky_width > 0 || table.lights.iter().any(|l| l.kind == SKY),
        }
    }
}

/// The whole shader.
#[must_use]
pub fn source(traits: Traits) -> String {
    let mut text = text();
    for (name, there) in [
        ("TEXTURED", traits.textured),
        ("MEASURES", traits.measures),
        ("LOBES", traits.lobes),
        ("CLUSTERS", traits.clusters),
        ("SKIES", traits.skies),
    ] {
        if !there {
            let declared = format!("const {name}: bool = ");
            text = text.replace(&format!("{declared}true;"), &format!("{declared}false;"));
        }
    }
    if traits.textures {
        return rows::in_textures(&text);
    }
    text
}

fn text() -> String {
    let mut sobol = String::from("fn sobol(i: u32) -> vec4<u32> {\n    var p = vec4<u32>(0u);\n");
    for (bit, [a, b, c, d]) in SOBOL.iter().enumerate() {
        sobol.push_str(&format!(
            "    p ^= vec4<u32>({a}u, {b}u, {c}u, {d}u) * ((i >> {bit}u) & 1u);\n"
        ));
    }
    sobol.push_str("    return p;\n}\n");
    [
        include_str!("../shader/table.wgsl"),
        include_str!("../shader/math.wgsl"),
        &sobol,
        include_str!("../shader/rng.wgsl"),
        woven_bsdf::shader::OPTICS,
        include_str!("../shader/measured.wgsl"),
        include_str!("../shader/surface.wgsl"),
        include_str!("../shader/bvh.wgsl"),
        include_str!("../shader/rect.wgsl"),
        include_str!("../shader/tree.wgsl"),
        include_str!("../shader/light.wgsl"),
        include_str!("../shader/path.wgsl"),
        include_str!("../shader/share.wgsl"),
    ]
    .join("\n")
}

/// The passes of a sample, in their order: names of functions in `shader/share.wgsl`, and how many blocks of pixels a
/// workgroup looks after.
const PASSES: [(&str, u32); 5] = [
    ("start", 1),
    ("keep", 8),
    ("see", 1),
    ("weigh", 1),
    ("finish", 1),
];
/// Bindings of the scene's rows and the second points, after the frame; three that the passes write follow.
const SCENE: std::ops::Range<u32> = 1..9;
/// Storage buffers that a shader binds.
pub(super) const BINDINGS: u32 = SCENE.end + 3;

/// The compiled shader.
pub(super) struct Pipeline {
    /// With the blocks of pixels that a workgroup looks after.
    pub(super) passes: Vec<(wgpu::ComputePipeline, u32)>,
    pub(super) layout: wgpu::BindGroupLayout,
    /// The rows of the scene are in textures.
    pub(super) textures: bool,
}

impl Pipeline {
    pub(super) fn new(device: &wgpu::Device, traits: Traits) -> Self {
        let textures = traits.textures;
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("woven-render"),
            source: wgpu::ShaderSource::Wgsl(source(traits).into()),
        });
        let entry = |binding: u32| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: if textures && SCENE.contains(&binding) {
                wgpu::BindingType::Texture {
                    sample_type: wgpu::TextureSampleType::Uint,
                    view_dimension: wgpu::TextureViewDimension::D2,
                    multisampled: false,
                }
            } else {
                wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Storage {
                        read_only: binding < SCENE.end,
                    },
                    has_dynamic_offset: false,
                    min_binding_size: None,
                }
            },
            count: None,
        };
        let entries: Vec<_> = (0..BINDINGS).map(entry).collect();
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("scene"),
            entries: &entries,
        });
        let of_all = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("scene"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let passes = PASSES
            .iter()
            .map(|(name, blocks)| {
                let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                    label: Some(name),
                    layout: Some(&of_all),
                    module: &module,
                    entry_point: Some(name),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    cache: None,
                });
                (pipeline, *blocks)
            })
            .collect();
        Self {
            passes,
            layout,
            textures,
        }
    }
}
