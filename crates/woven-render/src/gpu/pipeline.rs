//! The shader's text, put together from the pair files and the generated optics, and its pipeline.

use crate::rng::SOBOL;

/// The whole shader.
#[must_use]
pub fn source() -> String {
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

/// The passes of a sample, in their order; names of functions in `shader/share.wgsl`.
const PASSES: [&str; 3] = ["start", "see", "finish"];
/// Bindings that the passes only read; two that they write follow.
const READ_ONLY: u32 = 8;
/// Storage buffers that a shader binds.
pub(super) const BINDINGS: u32 = READ_ONLY + 2;

/// The compiled shader.
pub(super) struct Pipeline {
    pub(super) passes: Vec<wgpu::ComputePipeline>,
    pub(super) layout: wgpu::BindGroupLayout,
}

impl Pipeline {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("woven-render"),
            source: wgpu::ShaderSource::Wgsl(source().into()),
        });
        let entry = |binding: u32| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Storage {
                    read_only: binding < READ_ONLY,
                },
                has_dynamic_offset: false,
                min_binding_size: None,
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
            .map(|name| {
                device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                    label: Some(name),
                    layout: Some(&of_all),
                    module: &module,
                    entry_point: Some(name),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    cache: None,
                })
            })
            .collect();
        Self { passes, layout }
    }
}
