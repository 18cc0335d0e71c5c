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
        include_str!("../shader/surface.wgsl"),
        include_str!("../shader/bvh.wgsl"),
        include_str!("../shader/rect.wgsl"),
        include_str!("../shader/light.wgsl"),
        include_str!("../shader/path.wgsl"),
        include_str!("../shader/share.wgsl"),
    ]
    .join("\n")
}

/// The compiled shader.
pub(super) struct Pipeline {
    pub(super) pipeline: wgpu::ComputePipeline,
    pub(super) layout: wgpu::BindGroupLayout,
}

impl Pipeline {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("woven-render"),
            source: wgpu::ShaderSource::Wgsl(source().into()),
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("path"),
            layout: None,
            module: &module,
            entry_point: Some("main"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        let layout = pipeline.get_bind_group_layout(0);
        Self { pipeline, layout }
    }
}
