//! Adapters, the device, waiting for it, and its errors as sentences.

use super::pipeline::BINDINGS;
use anyhow::{Result, anyhow, bail};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// An adapter as `woven-render adapters` lists it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Adapter {
    /// Its name.
    pub name: String,
    /// Driver and version.
    pub driver: String,
    /// "Vulkan", "Metal", "Dx12".
    pub backend: String,
    /// "discrete GPU", "integrated GPU", "virtual GPU", "software" or "other".
    pub kind: String,
    /// It runs on the CPU and is used only when a GPU is asked for by name.
    pub software: bool,
    /// The one that would be used.
    pub chosen: bool,
}

fn instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12;
    wgpu::Instance::new(descriptor)
}

fn is_software(info: &wgpu::AdapterInfo) -> bool {
    info.device_type == wgpu::DeviceType::Cpu
}

/// Adapters, the best first: discrete, integrated, virtual, other, software.
fn sorted(instance: &wgpu::Instance) -> Vec<wgpu::Adapter> {
    let mut found = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    let rank = |a: &wgpu::Adapter| match a.get_info().device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    };
    found.retain(fits);
    found.sort_by_key(rank);
    found
}

/// The adapter can hold what the shader binds.
fn fits(adapter: &wgpu::Adapter) -> bool {
    let compute = adapter
        .get_downlevel_capabilities()
        .flags
        .contains(wgpu::DownlevelFlags::COMPUTE_SHADERS);
    compute && adapter.limits().max_storage_buffers_per_shader_stage >= BINDINGS
}

/// What adapters there are.
#[must_use]
pub fn adapters() -> Vec<Adapter> {
    let found = sorted(&instance());
    let row = |(i, a): (usize, &wgpu::Adapter)| {
        let info = a.get_info();
        Adapter {
            name: info.name.clone(),
            driver: format!("{} {}", info.driver, info.driver_info)
                .trim()
                .to_owned(),
            backend: format!("{:?}", info.backend),
            kind: match info.device_type {
                wgpu::DeviceType::DiscreteGpu => "discrete GPU",
                wgpu::DeviceType::IntegratedGpu => "integrated GPU",
                wgpu::DeviceType::VirtualGpu => "virtual GPU",
                wgpu::DeviceType::Cpu => "software",
                wgpu::DeviceType::Other => "other",
            }
            .to_owned(),
            software: is_software(&info),
            chosen: i == 0,
        }
    };
    found.iter().enumerate().map(row).collect()
}

/// A device, its queue, and the first error that nobody caught.
pub(super) struct Device {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    pub(super) name: String,
    /// It runs on the CPU.
    pub(super) software: bool,
    pub(super) max_side: u32,
    pub(super) max_binding: u64,
    pub(super) max_groups: u32,
    trouble: Arc<Mutex<Option<String>>>,
    /// The device is gone for good.
    lost: Arc<AtomicBool>,
}

impl Device {
    /// Opens the best adapter; a software one only with `software`.
    pub(super) fn open(software: bool) -> Result<Self> {
        let instance = instance();
        let found = sorted(&instance);
        let hardware = |a: &&wgpu::Adapter| software || !is_software(&a.get_info());
        let Some(adapter) = found.iter().find(hardware) else {
            match found.first() {
                Some(a) => bail!(
                    "the only adapter, {}, is software; ask for it with --backend gpu if you want it",
                    a.get_info().name
                ),
                None => bail!(
                    "no Vulkan, Metal or Direct3D 12 adapter was found; install a driver or use --backend cpu"
                ),
            }
        };
        let info = adapter.get_info();
        let limits = adapter.limits();
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("woven-render"),
            required_features: wgpu::Features::empty(),
            required_limits: limits.clone(),
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| anyhow!("{} could not be opened: {e}; use --backend cpu", info.name))?;
        let trouble = Arc::new(Mutex::new(None));
        let keep = |slot: &Arc<Mutex<Option<String>>>, what: String| {
            if let Ok(mut slot) = slot.lock() {
                slot.get_or_insert(what);
            }
        };
        let slot = Arc::clone(&trouble);
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| keep(&slot, e.to_string())));
        let slot = Arc::clone(&trouble);
        let lost = Arc::new(AtomicBool::new(false));
        let gone = Arc::clone(&lost);
        device.set_device_lost_callback(move |_, what| {
            gone.store(true, Ordering::SeqCst);
            keep(&slot, format!("the device was lost: {what}"));
        });
        Ok(Self {
            device,
            queue,
            name: format!("{} ({:?})", info.name, info.backend),
            software: is_software(&info),
            max_side: limits.max_texture_dimension_2d,
            // Drivers misbehave near i32::MAX bytes.
            max_binding: limits
                .max_storage_buffer_binding_size
                .min(limits.max_buffer_size)
                .min(1 << 30),
            max_groups: limits.max_compute_workgroups_per_dimension,
            trouble,
            lost,
        })
    }

    /// Takes the device away, as a driver that was reset does. For tests.
    pub(super) fn lose(&self) {
        self.lost.store(true, Ordering::SeqCst);
        self.device.destroy();
    }

    /// The first error since the last look.
    pub(super) fn check(&self) -> Result<()> {
        match self.trouble.lock().map(|mut t| t.take()) {
            Ok(Some(what)) => bail!(
                "{}: {}",
                self.name,
                what.lines().next().unwrap_or("an error without a text")
            ),
            _ if self.lost.load(Ordering::SeqCst) => bail!("{}: the device was lost", self.name),
            _ => Ok(()),
        }
    }

    /// Runs `f`; an error of memory or validation in it becomes a sentence.
    pub(super) fn guarded<T>(&self, what: &str, f: impl FnOnce() -> T) -> Result<T> {
        let memory = self.device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let validation = self.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let value = f();
        let errors = [
            pollster::block_on(validation.pop()),
            pollster::block_on(memory.pop()),
        ];
        match errors.into_iter().flatten().next() {
            Some(wgpu::Error::OutOfMemory { .. }) => {
                bail!("{} is out of memory while {what}", self.name)
            }
            Some(e) => bail!("{} failed while {what}: {e}", self.name),
            None => Ok(value),
        }
    }

    /// Waits for a submit.
    pub(super) fn wait(&self, index: wgpu::SubmissionIndex, patience: Duration) -> Result<()> {
        let poll = wgpu::PollType::Wait {
            submission_index: Some(index),
            timeout: Some(patience),
        };
        if let Err(e) = self.device.poll(poll) {
            bail!("{} does not answer: {e}", self.name);
        }
        self.check()
    }

    /// Copies a buffer to the CPU.
    pub(super) fn read(&self, buffer: &wgpu::Buffer) -> Result<Vec<u8>> {
        let size = buffer.size();
        let staging = self.guarded("reading the picture back", || {
            self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("read back"),
                size,
                usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        })?;
        let mut encoder = self
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: None });
        encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, size);
        let index = self.queue.submit([encoder.finish()]);
        let (send, receive) = std::sync::mpsc::channel();
        staging.map_async(wgpu::MapMode::Read, .., move |result| {
            // The receiver is gone only when waiting failed before.
            let _gone = send.send(result);
        });
        self.wait(index, Duration::from_secs(30))?;
        match receive.recv_timeout(Duration::from_secs(1)) {
            Ok(Ok(())) => {}
            _ => bail!("{} did not give the picture back", self.name),
        }
        let view = staging
            .get_mapped_range(..)
            .map_err(|e| anyhow!("{}: {e}", self.name))?;
        Ok(view.to_vec())
    }
}
