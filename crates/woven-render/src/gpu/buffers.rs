//! The table's rows and the frame's numbers as buffers; the pair of `shader/table.wgsl`.

use anyhow::{Result, ensure};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::device::Device;
use super::forks::{Fork, forks};
use super::pipeline::Pipeline;
use super::rows::COLUMNS;
use crate::accumulate::PixelSum;
use crate::bvh::Packet;
use crate::cpu::path::View;
use crate::cpu::share::{BLOCK, shift};
use crate::table::{Globals, LightRow, MaterialRow, NONE, Shade, Table};

/// What one submit is told.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C, align(16))]
#[allow(
    missing_docs,
    reason = "the fields of the shader's Frame, see cpu/path.rs's View"
)]
pub struct Frame {
    pub eye: [f32; 3],
    pub aperture: f32,
    pub right: [f32; 3],
    pub focus: f32,
    pub up: [f32; 3],
    pub width: u32,
    pub forward: [f32; 3],
    pub height: u32,
    pub lens_x: [f32; 3],
    pub depth: u32,
    pub lens_y: [f32; 3],
    pub seed: u32,
    pub index: u32,
    pub left: u32,
    pub above: u32,
    pub block: u32,
    pub globals: Globals,
}

impl Frame {
    /// Sample `index`, the blocks from `block` on.
    pub(crate) fn new(v: &View, globals: &Globals, index: u32, block: u32) -> Self {
        let (left, above) = shift(index);
        let a = |v: Vec3| v.to_array();
        Self {
            eye: a(v.eye),
            aperture: v.aperture,
            right: a(v.right),
            focus: v.focus,
            up: a(v.up),
            width: v.width,
            forward: a(v.forward),
            height: v.height,
            lens_x: a(v.lens_x),
            depth: v.depth,
            lens_y: a(v.lens_y),
            seed: v.seed,
            index,
            left,
            above,
            block,
            globals: *globals,
        }
    }
}

/// Bytes of the shader's `Slot`; a test compares them.
pub const SLOT: u64 = 2464;
/// Bytes of the shader's `SecondRow`; the same.
pub const SECOND: u64 = 192;
/// Most blocks of one submit: their slots take about 90 MB.
const RANGE: u32 = 512;

/// Blocks of pixels for whose paths there is room.
pub(super) fn range(width: u32, height: u32) -> u32 {
    ((width / BLOCK + 2) * (height / BLOCK + 2)).min(RANGE)
}

/// Everything the shader binds.
pub(super) struct Buffers {
    pub(super) frame: wgpu::Buffer,
    pub(super) sums: wgpu::Buffer,
    slots: wgpu::Buffer,
    seconds: wgpu::Buffer,
    looks: Rows,
    pub(super) group: wgpu::BindGroup,
    scene: Vec<Rows>,
}

/// Rows of the scene on the device.
enum Rows {
    Buffer(wgpu::Buffer),
    /// With its view and the bytes that it was made for.
    Texture(wgpu::Texture, wgpu::TextureView, u64),
}

impl Rows {
    fn new(device: &Device, pipeline: &Pipeline, name: &str, size: u64) -> Result<Self> {
        use wgpu::BufferUsages as Use;
        if pipeline.textures {
            let texture = texture(device, name, size)?;
            let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
            return Ok(Self::Texture(texture, view, size));
        }
        let buffer = buffer(device, name, size, Use::STORAGE | Use::COPY_DST)?;
        Ok(Self::Buffer(buffer))
    }

    fn size(&self) -> u64 {
        match self {
            Self::Buffer(b) => b.size(),
            Self::Texture(_, _, size) => *size,
        }
    }

    fn write(&self, device: &Device, bytes: &[u8]) {
        match self {
            Self::Buffer(b) => device.queue.write_buffer(b, 0, bytes),
            Self::Texture(t, ..) => write_texture(device, t, bytes),
        }
    }
}

impl Buffers {
    pub(super) fn new(
        device: &Device,
        pipeline: &Pipeline,
        table: &Table,
        view: &View,
    ) -> Result<Self> {
        use wgpu::BufferUsages as Use;
        let pixels = u64::from(view.width) * u64::from(view.height);
        let frame = buffer(
            device,
            "frame",
            size_of::<Frame>() as u64,
            Use::STORAGE | Use::COPY_DST,
        )?;
        let size = pixels * size_of::<PixelSum>() as u64;
        let sums = buffer(
            device,
            "picture",
            size,
            Use::STORAGE | Use::COPY_DST | Use::COPY_SRC,
        )?;
        let paths = u64::from(range(view.width, view.height) * BLOCK * BLOCK);
        let slots = buffer(device, "paths", paths * SLOT, Use::STORAGE)?;
        // Whole lines, for the copy.
        let size = (paths * SECOND).next_multiple_of(u64::from(COLUMNS) * 16);
        let seconds = buffer(device, "second points", size, Use::STORAGE | Use::COPY_SRC)?;
        let looks = Rows::new(device, pipeline, "second points", size)?;
        let scene = upload(device, pipeline, table)?;
        let written = [&sums, &slots, &seconds];
        let group = bind(device, pipeline, &frame, (&scene, &looks), written);
        Ok(Self {
            frame,
            sums,
            slots,
            seconds,
            looks,
            group,
            scene,
        })
    }

    /// Writes what moves of a table whose meshes have moved: pictures, materials and environment stay as they are there.
    pub(super) fn update(
        &mut self,
        device: &Device,
        pipeline: &Pipeline,
        table: &Table,
    ) -> Result<()> {
        let moving = moving(table)?;
        let fits = |(at, _, bytes): &Moving| bytes.len() as u64 == self.scene[*at].size();
        if moving.iter().all(fits) {
            for (at, _, bytes) in &moving {
                self.scene[*at].write(device, bytes);
            }
            return device.check();
        }
        self.scene = upload(device, pipeline, table)?;
        let written = [&self.sums, &self.slots, &self.seconds];
        let read = (&self.scene[..], &self.looks);
        self.group = bind(device, pipeline, &self.frame, read, written);
        Ok(())
    }

    /// Copies the second points of `groups` blocks to where the later passes read them.
    pub(super) fn copy(&self, encoder: &mut wgpu::CommandEncoder, groups: u32) {
        let size = u64::from(groups * BLOCK * BLOCK) * SECOND;
        match &self.looks {
            Rows::Buffer(looks) => encoder.copy_buffer_to_buffer(&self.seconds, 0, looks, 0, size),
            Rows::Texture(looks, ..) => encoder.copy_buffer_to_texture(
                wgpu::TexelCopyBufferInfo {
                    buffer: &self.seconds,
                    layout: layout(COLUMNS * 16),
                },
                looks.as_image_copy(),
                wgpu::Extent3d {
                    width: COLUMNS,
                    height: size.div_ceil(u64::from(COLUMNS) * 16) as u32,
                    depth_or_array_layers: 1,
                },
            ),
        }
    }
}

/// Rows as bytes, with their place among the scene's buffers and a name.
type Moving = (usize, &'static str, Vec<u8>);

/// What changes when meshes move.
fn moving(table: &Table) -> Result<[Moving; 4]> {
    let forks = forks(&table.bvh.nodes)?;
    Ok([
        (0, "nodes", bytes(&forks, Fork::default())),
        (1, "triangles", bytes(&table.bvh.packets, Packet::default())),
        (2, "normals", bytes(&table.shade, Shade::default())),
        (5, "lights", bytes(&table.lights, LightRow::default())),
    ])
}

/// The table's rows as bytes, in the order of the shader's bindings. No buffer is empty.
fn rows(table: &Table) -> Result<Vec<(&'static str, Vec<u8>)>> {
    let mut texels: Vec<u32> = crate::cpu::surface::SRGB
        .iter()
        .map(|x| x.to_bits())
        .collect();
    let head = 256 + table.textures.len() as u32 * 12;
    for t in &table.textures {
        let moved = crate::table::TextureRow {
            first: t.first + head,
            ..*t
        };
        texels.extend(bytemuck::cast::<_, [u32; 12]>(moved));
    }
    texels.extend(&table.texels);
    let materials: Vec<MaterialRow> = table
        .materials
        .iter()
        .map(|m| MaterialRow {
            measured: if m.measured == NONE {
                NONE
            } else {
                m.measured + head
            },
            ..*m
        })
        .collect();
    let mut rows = vec![
        (3, "materials", bytes(&materials, MaterialRow::zeroed())),
        (4, "textures", bytes(&texels, 0)),
        (6, "environment", bytes(&table.sky, [0.0_f32; 4])),
    ];
    rows.extend(moving(table)?);
    rows.sort_by_key(|(at, ..)| *at);
    Ok(rows
        .into_iter()
        .map(|(_, name, bytes)| (name, bytes))
        .collect())
}

fn bytes<T: Pod>(rows: &[T], none: T) -> Vec<u8> {
    if rows.is_empty() {
        bytemuck::bytes_of(&none).to_vec()
    } else {
        bytemuck::cast_slice(rows).to_vec()
    }
}

fn upload(device: &Device, pipeline: &Pipeline, table: &Table) -> Result<Vec<Rows>> {
    let mut scene = Vec::new();
    for (name, bytes) in rows(table)? {
        let made = Rows::new(device, pipeline, name, bytes.len() as u64)?;
        made.write(device, &bytes);
        scene.push(made);
    }
    device.check()?;
    Ok(scene)
}

/// Lines of a texture in a buffer.
fn layout(line: u32) -> wgpu::TexelCopyBufferLayout {
    wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(line),
        rows_per_image: None,
    }
}

/// A texture for `size` bytes: of numbers for the texels of pictures, else of four numbers each.
fn texture(device: &Device, name: &str, size: u64) -> Result<wgpu::Texture> {
    let format = if name == "textures" {
        wgpu::TextureFormat::R32Uint
    } else {
        wgpu::TextureFormat::Rgba32Uint
    };
    let texel = u64::from(format.block_copy_size(None).unwrap_or(16));
    let lines = size.div_ceil(texel * u64::from(COLUMNS));
    // lavapipe compiles a shader anew for textures whose height is a power of two.
    let lines = lines + u64::from(lines.is_power_of_two()) + u64::from(lines == 1);
    let most = device
        .max_binding
        .min(u64::from(device.max_side) * u64::from(COLUMNS) * texel);
    ensure!(
        lines * u64::from(COLUMNS) * texel <= most,
        "the {name} need {} MiB, {} takes at most {} MiB in one texture; use --backend cpu",
        size >> 20,
        device.name,
        most >> 20
    );
    device.guarded(&format!("making room for the {name}"), || {
        device.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(name),
            size: wgpu::Extent3d {
                width: COLUMNS,
                height: lines as u32,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        })
    })
}

/// Writes whole lines, then the rest of the last one.
fn write_texture(device: &Device, texture: &wgpu::Texture, bytes: &[u8]) {
    let texel = texture.format().block_copy_size(None).unwrap_or(16);
    let line = COLUMNS * texel;
    let (whole, rest) = bytes.split_at(bytes.len() - bytes.len() % line as usize);
    let whole_lines = (whole.len() / line as usize) as u32;
    for (bytes, at, width, height) in [
        (whole, 0, COLUMNS, whole_lines),
        (rest, whole_lines, rest.len() as u32 / texel, 1),
    ] {
        if bytes.is_empty() {
            continue;
        }
        device.queue.write_texture(
            wgpu::TexelCopyTextureInfo {
                texture,
                mip_level: 0,
                origin: wgpu::Origin3d { x: 0, y: at, z: 0 },
                aspect: wgpu::TextureAspect::All,
            },
            bytes,
            layout(line),
            wgpu::Extent3d {
                width,
                height,
                depth_or_array_layers: 1,
            },
        );
    }
}

fn buffer(
    device: &Device,
    name: &str,
    size: u64,
    usage: wgpu::BufferUsages,
) -> Result<wgpu::Buffer> {
    ensure!(
        size <= device.max_binding,
        "the {name} need {} MiB, {} takes at most {} MiB in one buffer; use --backend cpu",
        size >> 20,
        device.name,
        device.max_binding >> 20
    );
    device.guarded(&format!("making room for the {name}"), || {
        device.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(name),
            size,
            usage,
            mapped_at_creation: false,
        })
    })
}

fn bind<'a>(
    device: &Device,
    pipeline: &Pipeline,
    frame: &'a wgpu::Buffer,
    (scene, looks): (&'a [Rows], &'a Rows),
    written: [&'a wgpu::Buffer; 3],
) -> wgpu::BindGroup {
    let resource = |rows: &'a Rows| match rows {
        Rows::Buffer(b) => b.as_entire_binding(),
        Rows::Texture(_, view, _) => wgpu::BindingResource::TextureView(view),
    };
    let all = std::iter::once(frame.as_entire_binding())
        .chain(scene.iter().chain([looks]).map(resource))
        .chain(written.map(wgpu::Buffer::as_entire_binding));
    let entries: Vec<_> = all
        .enumerate()
        .map(|(i, resource)| wgpu::BindGroupEntry {
            binding: i as u32,
            resource,
        })
        .collect();
    device.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("scene"),
        layout: &pipeline.layout,
        entries: &entries,
    })
}
