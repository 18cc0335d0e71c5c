//! The path tracer on a GPU by wgpu compute: the same picture as [`crate::render::Backend::Cpu`], from the same
//! random numbers. wgpu is named in this folder only.

mod buffers;
mod device;
mod forks;
mod kernel;
mod pipeline;
mod rows;

pub use device::{Adapter, adapters};
pub use forks::Fork;
pub use kernel::Kernel;
pub use pipeline::{Traits, source};

use anyhow::{Result, bail, ensure};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crate::accumulate::{Accumulation, PixelSum};
use crate::cpu::path::View;
use crate::cpu::share::{BLOCK, shift};
use crate::table::Table;
use buffers::{Buffers, range};
pub use buffers::{Frame, SECOND, SLOT};
use device::Device;
use pipeline::Pipeline;

/// A submit should take about this long: short beside a desktop's watchdog and its screen, long beside the cost of a
/// submit.
const AIM: Duration = Duration::from_millis(50);
/// The same on a software adapter, which other programs keep waiting.
const AIM_SOFTWARE: Duration = Duration::from_millis(20);
/// No submit should take longer.
const LIMIT: Duration = Duration::from_millis(200);
/// A device that does not answer for this long is lost. Long, for lavapipe compiles a shader at its first use, which takes
/// half a minute where other programs run.
const PATIENCE: Duration = Duration::from_secs(180);

/// A device and the compiled shaders: made once in a process and shared, for compiling takes seconds.
struct Context {
    device: Device,
    /// By what they are made for.
    pipelines: Mutex<Vec<(Traits, Arc<Pipeline>)>>,
}

/// The contexts so far: without and with software adapters.
static SHARED: Mutex<[Option<Arc<Context>>; 2]> = Mutex::new([None, None]);

impl Context {
    fn shared(software: bool) -> Result<Arc<Self>> {
        let mut shared = SHARED
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        let slot = &mut shared[usize::from(software)];
        if let Some(context) = slot.take().filter(|c| c.device.check().is_ok()) {
            *slot = Some(Arc::clone(&context));
            return Ok(context);
        }
        let device = Device::open(software)?;
        let pipelines = Mutex::default();
        let context = Arc::new(Self { device, pipelines });
        *slot = Some(Arc::clone(&context));
        Ok(context)
    }

    /// The shader for a scene.
    fn pipeline(&self, table: &Table) -> Result<Arc<Pipeline>> {
        let traits = Traits::of(table, self.device.software);
        let mut pipelines = self
            .pipelines
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some((_, found)) = pipelines.iter().find(|(t, _)| *t == traits) {
            return Ok(Arc::clone(found));
        }
        let made = self.device.guarded("compiling the shader", || {
            Arc::new(Pipeline::new(&self.device.device, traits))
        })?;
        pipelines.push((traits, Arc::clone(&made)));
        Ok(made)
    }
}

/// A device with a scene on it.
pub(crate) struct Gpu {
    context: Arc<Context>,
    pipeline: Arc<Pipeline>,
    buffers: Buffers,
    globals: crate::table::Globals,
    samples: u32,
    width: u32,
    height: u32,
    /// Pixel samples that one submit is given now, in blocks of 64.
    load: u32,
    /// Seconds that a block of them takes at most, of late.
    cost: f64,
    /// The longest submit so far.
    longest: Duration,
    /// Submits so far.
    submits: u64,
}

impl Gpu {
    /// Sets up a device, compiles the shader and uploads the scene. Without `software`, a software adapter is no GPU.
    pub(crate) fn new(table: &Table, view: &View, software: bool) -> Result<Self> {
        let context = Context::shared(software)?;
        let pipeline = context.pipeline(table)?;
        let buffers = Buffers::new(&context.device, &pipeline, table, view)?;
        let new = Self {
            context,
            pipeline,
            buffers,
            globals: table.globals,
            samples: 0,
            width: view.width,
            height: view.height,
            load: 4,
            cost: 0.0,
            longest: Duration::ZERO,
            submits: 0,
        };
        // lavapipe compiles a shader when it is first run, even over nothing.
        let frame = Frame::new(view, &new.globals, 0, 0);
        let sent = new.submit(&frame, 0);
        new.wait(Some(sent))?;
        Ok(new)
    }

    pub(crate) fn name(&self) -> &str {
        &self.context.device.name
    }

    pub(crate) fn samples(&self) -> u32 {
        self.samples
    }

    /// The longest time that a single submit has taken, and how many there were.
    pub(crate) fn longest(&self) -> (Duration, u64) {
        (self.longest, self.submits)
    }

    /// Takes the device away. For tests.
    pub(crate) fn lose(&self) {
        self.context.device.lose();
    }

    /// Adds `count` samples to every pixel, in submits that are waited for after about [`AIM`].
    pub(crate) fn step(&mut self, view: &View, count: u32, stop: &AtomicBool) -> Result<bool> {
        let goal = self.samples + count;
        while self.samples < goal {
            // Only between passes: the samples of a broken one could not be taken back on the device.
            if stop.load(Ordering::Relaxed) {
                return Ok(false);
            }
            // A pass gives every pixel one sample. Small ones are sent together, large ones cut into ranges of blocks.
            let blocks = self.blocks(self.samples);
            let most = range(self.width, self.height).min(self.context.device.max_groups);
            if self.load >= 2 * blocks && blocks <= most {
                let together = (self.load / blocks).min(goal - self.samples);
                let began = Instant::now();
                let mut sent = None;
                for index in self.samples..self.samples + together {
                    let frame = Frame::new(view, &self.globals, index, 0);
                    sent = Some(self.submit(&frame, self.blocks(index)));
                }
                self.wait(sent)?;
                self.adapt(began.elapsed(), together * blocks);
                self.samples += together;
                continue;
            }
            let mut block = 0;
            while block < blocks {
                let range = self.load.clamp(1, blocks - block).min(most);
                let began = Instant::now();
                let frame = Frame::new(view, &self.globals, self.samples, block);
                let sent = self.submit(&frame, range);
                self.wait(Some(sent))?;
                self.adapt(began.elapsed(), range);
                block += range;
            }
            self.samples += 1;
        }
        Ok(true)
    }

    /// Blocks of pixels that cover the picture for a sample.
    fn blocks(&self, index: u32) -> u32 {
        let (left, above) = shift(index);
        (self.width + left).div_ceil(BLOCK) * (self.height + above).div_ceil(BLOCK)
    }

    fn wait(&self, sent: Option<wgpu::SubmissionIndex>) -> Result<()> {
        sent.map_or(Ok(()), |index| self.context.device.wait(index, PATIENCE))
    }

    fn submit(&self, frame: &Frame, groups: u32) -> wgpu::SubmissionIndex {
        let (device, queue) = (&self.context.device.device, &self.context.device.queue);
        queue.write_buffer(&self.buffers.frame, 0, bytemuck::bytes_of(frame));
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
            label: Some("samples"),
        });
        let (first, others) = self.pipeline.passes.split_at(1);
        self.pass(&mut encoder, first, groups);
        self.buffers.copy(&mut encoder, groups);
        self.pass(&mut encoder, others, groups);
        queue.submit([encoder.finish()])
    }

    fn pass(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        pipelines: &[(wgpu::ComputePipeline, u32)],
        groups: u32,
    ) {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_bind_group(0, &self.buffers.group, &[]);
        for (pipeline, blocks) in pipelines {
            pass.set_pipeline(pipeline);
            pass.dispatch_workgroups(groups.div_ceil(*blocks), 1, 1);
        }
    }

    /// Sizes the next submit by the time of the last.
    fn adapt(&mut self, took: Duration, load: u32) {
        self.longest = self.longest.max(took);
        self.submits += 1;
        let aim = if self.context.device.software {
            AIM_SOFTWARE
        } else {
            AIM
        };
        // Neighbouring parts of a picture differ in cost: the dear ones are forgotten slowly, and the load at most doubled.
        let seconds = took.as_secs_f64().max(1e-5);
        self.cost = (0.9 * self.cost).max(seconds / f64::from(load));
        let most = if took > LIMIT { load / 2 } else { load * 2 };
        self.load = ((aim.as_secs_f64() / self.cost) as u32).clamp(1, most.clamp(1, 1 << 24));
    }

    /// Puts sums on the device, to go on from them.
    pub(crate) fn restore(&mut self, sums: &Accumulation) -> Result<()> {
        ensure!(
            (sums.width, sums.height) == (self.width, self.height),
            "the sums have another size than the picture; start the render anew"
        );
        self.context.device.queue.write_buffer(
            &self.buffers.sums,
            0,
            bytemuck::cast_slice(&sums.pixels),
        );
        self.samples = sums.samples;
        self.context.device.check()
    }

    /// Reads the sums back.
    pub(crate) fn read(&self, sums: &mut Accumulation) -> Result<()> {
        let bytes = self.context.device.read(&self.buffers.sums)?;
        let size = sums.pixels.len() * size_of::<PixelSum>();
        if bytes.len() < size {
            bail!("the GPU gave {} bytes back instead of {size}", bytes.len());
        }
        sums.pixels = bytes[..size]
            .chunks_exact(size_of::<PixelSum>())
            .map(bytemuck::pod_read_unaligned)
            .collect();
        sums.samples = self.samples;
        Ok(())
    }

    /// A mesh has moved: uploads what moves of the table.
    pub(crate) fn moved(&mut self, table: &Table) -> Result<()> {
        self.globals = table.globals;
        self.pipeline = self.context.pipeline(table)?;
        self.buffers
            .update(&self.context.device, &self.pipeline, table)
    }
}
