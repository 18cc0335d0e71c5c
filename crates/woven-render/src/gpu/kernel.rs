//! Runs a compute shader of numbers in, numbers out: for tests that hold a part of the shader against the CPU.

use super::device::Device;
use anyhow::{Result, ensure};
use std::time::{Duration, Instant};

/// No submit of a test may take longer.
const PATIENCE: Duration = Duration::from_secs(60);

/// A shader ready to run.
pub struct Kernel {
    device: Device,
    pipeline: wgpu::ComputePipeline,
}

impl Kernel {
    /// Compiles `source`: entry point `main`, group 0, binding 0 the numbers in (read), binding 1 those out.
    /// Software adapters count as well.
    ///
    /// # Errors
    /// A sentence when there is no adapter or the shader does not compile.
    pub fn new(source: &str) -> Result<Self> {
        let device = Device::open(true)?;
        let pipeline = device.guarded("compiling the shader", || {
            let module = device
                .device
                .create_shader_module(wgpu::ShaderModuleDescriptor {
                    label: Some("kernel"),
                    source: wgpu::ShaderSource::Wgsl(source.into()),
                });
            device
                .device
                .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                    label: Some("kernel"),
                    layout: None,
                    module: &module,
                    entry_point: Some("main"),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    cache: None,
                })
        })?;
        Ok(Self { device, pipeline })
    }

    /// The adapter's name.
    #[must_use]
    pub fn adapter(&self) -> &str {
        &self.device.name
    }

    /// Runs `groups` workgroups over `inputs` and reads `outputs` numbers back, with the time of the submit.
    ///
    /// # Errors
    /// A sentence when memory is short or the device does not answer.
    pub fn run(&self, inputs: &[f32], outputs: usize, groups: u32) -> Result<(Vec<f32>, Duration)> {
        let gpu = &self.device.device;
        let buffer = |size: usize| {
            self.device.guarded("making buffers", || {
                gpu.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("kernel"),
                    size: (size * size_of::<f32>()) as u64,
                    usage: wgpu::BufferUsages::STORAGE
                        | wgpu::BufferUsages::COPY_DST
                        | wgpu::BufferUsages::COPY_SRC,
                    mapped_at_creation: false,
                })
            })
        };
        ensure!(
            groups <= self.device.max_groups,
            "{groups} workgroups are too many"
        );
        let (input, output) = (buffer(inputs.len())?, buffer(outputs)?);
        self.device
            .queue
            .write_buffer(&input, 0, bytemuck::cast_slice(inputs));
        let group = gpu.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &[(0, &input), (1, &output)].map(|(binding, b)| wgpu::BindGroupEntry {
                binding,
                resource: b.as_entire_binding(),
            }),
        });
        self.device.wait(self.device.queue.submit([]), PATIENCE)?;
        let mut encoder =
            gpu.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: None });
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.dispatch_workgroups(groups, 1, 1);
        }
        let began = Instant::now();
        let index = self.device.queue.submit([encoder.finish()]);
        self.device.wait(index, PATIENCE)?;
        let took = began.elapsed();
        let bytes = self.device.read(&output)?;
        let numbers = bytes.chunks_exact(4).map(bytemuck::pod_read_unaligned);
        Ok((numbers.take(outputs).collect(), took))
    }
}
