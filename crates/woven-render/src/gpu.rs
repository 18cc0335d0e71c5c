//! The path tracer on a GPU by wgpu compute: the same picture as [`crate::render::Backend::Cpu`], from the same
//! random numbers. wgpu is named in this folder only.

mod buffers;
mod device;
mod kernel;
mod pipeline;

pub use device::{Adapter, adapters};
pub use kernel::Kernel;
pub use pipeline::source;

use anyhow::{Result, bail, ensure};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crate::accumulate::{Accumulation, PixelSum};
use crate::cpu::path::View;
use crate::cpu::share::{BLOCK, shift};
use crate::table::Table;
use buffers::{Buffers, range};
pub use buffers::{Frame, SLOT};
use device::Device;
use pipeline::Pipeline;

/// A submit should take about this long: short beside a desktop's watchdog and its screen, long beside the cost of a
/// submit.
const AIM: Duration = Duration::from_millis(50);
/// No submit should take longer.
const LIMIT: Duration = Duration::from_millis(200);
/// A device that does not answer for this long is lost. Long, for lavapipe compiles a shader at its first use, which takes
/// half a minute where other programs run.
const PATIENCE: Duration = Duration::from_secs(180);

/// A device and the compiled shader: made once in a process and shared, for compiling takes seconds.
struct Context {
    device: Device,
    pipeline: Pipeline,
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
        let pipeline = device.guarded("compiling the shader", || Pipeline::new(&device.device))?;
        let context = Arc::new(Self { device, pipeline });
        *slot = Some(Arc::clone(&context));
        Ok(context)
    }
}

/// A device with a scene on it.
pub(crate) struct Gpu {
    context: Arc<Context>,
    buffers: Buffers,
    globals: crate::table::Globals,
    samples: u32,
    width: u32,
    height: u32,
    /// Pixel samples that one submit is given now, in blocks of 64.
    load: u32,
    /// The longest submit so far.
    longest: Duration,
    /// Submits so far.
    submits: u64,
}

impl Gpu {
    /// Sets up a device, compiles the shader and uploads the scene. Without `software`, a software adapter is no GPU.
    pub(crate) fn new(table: &Table, view: &View, software: bool) -> Result<Self> {
        let context = Context::shared(software)?;
        let buffers = Buffers::new(&context.device, &context.pipeline, table, view)?;
        Ok(Self {
            context,
            buffers,
            globals: table.globals,
            samples: 0,
            width: view.width,
            height: view.height,
            load: 16,
            longest: Duration::ZERO,
            submits: 0,
        })
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
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some("path"),
                timestamp_writes: None,
            });
            pass.set_bind_group(0, &self.buffers.group, &[]);
            for pipeline in &self.context.pipeline.passes {
                pass.set_pipeline(pipeline);
                pass.dispatch_workgroups(groups, 1, 1);
            }
        }
        queue.submit([encoder.finish()])
    }

    /// Sizes the next submit by the time of the last.
    fn adapt(&mut self, took: Duration, load: u32) {
        self.longest = self.longest.max(took);
        self.submits += 1;
        let ratio = AIM.as_secs_f64() / took.as_secs_f64().max(1e-5);
        self.load = if took > LIMIT {
            (load / 2).max(1)
        } else {
            // At most twice as much at once: neighbouring parts of a picture differ in cost.
            ((f64::from(load) * ratio.min(2.0)) as u32).clamp(1, 1 << 24)
        };
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
        self.buffers
            .update(&self.context.device, &self.context.pipeline, table)
    }
}
