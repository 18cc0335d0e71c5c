//! The table's rows and the frame's numbers as buffers; the pair of `shader/table.wgsl`.

use anyhow::{Result, ensure};
use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};

use super::device::Device;
use super::pipeline::Pipeline;
use crate::accumulate::PixelSum;
use crate::bvh::{EMPTY, Node, Packet};
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
pub const SLOT: u64 = 2640;
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
    pub(super) group: wgpu::BindGroup,
    scene: Vec<wgpu::Buffer>,
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
        let size = u64::from(range(view.width, view.height) * BLOCK * BLOCK) * SLOT;
        let slots = buffer(device, "paths", size, Use::STORAGE)?;
        let scene = upload(device, table)?;
        let group = bind(device, pipeline, &frame, &scene, [&sums, &slots]);
        Ok(Self {
            frame,
            sums,
            slots,
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
        let moving = moving(table);
        let fits = |(at, _, bytes): &Moving| bytes.len() as u64 == self.scene[*at].size();
        if moving.iter().all(fits) {
            for (at, _, bytes) in &moving {
                device.queue.write_buffer(&self.scene[*at], 0, bytes);
            }
            return device.check();
        }
        self.scene = upload(device, table)?;
        let written = [&self.sums, &self.slots];
        self.group = bind(device, pipeline, &self.frame, &self.scene, written);
        Ok(())
    }
}

/// Rows as bytes, with their place among the scene's buffers and a name.
type Moving = (usize, &'static str, Vec<u8>);

/// What changes when meshes move.
fn moving(table: &Table) -> [Moving; 4] {
    let nowhere = Node {
        lo: [Vec4::splat(1e30); 3],
        hi: [Vec4::splat(-1e30); 3],
        child: [EMPTY; 4],
    };
    [
        (0, "nodes", bytes(&table.bvh.nodes, nowhere)),
        (1, "triangles", bytes(&table.bvh.packets, Packet::default())),
        (2, "normals", bytes(&table.shade, Shade::default())),
        (5, "lights", bytes(&table.lights, LightRow::default())),
    ]
}

/// The table's rows as bytes, in the order of the shader's bindings. No buffer is empty.
fn rows(table: &Table) -> Vec<(&'static str, Vec<u8>)> {
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
    rows.extend(moving(table));
    rows.sort_by_key(|(at, ..)| *at);
    rows.into_iter()
        .map(|(_, name, bytes)| (name, bytes))
        .collect()
}

fn bytes<T: Pod>(rows: &[T], none: T) -> Vec<u8> {
    if rows.is_empty() {
        bytemuck::bytes_of(&none).to_vec()
    } else {
        bytemuck::cast_slice(rows).to_vec()
    }
}

fn upload(device: &Device, table: &Table) -> Result<Vec<wgpu::Buffer>> {
    use wgpu::BufferUsages as Use;
    let mut scene = Vec::new();
    for (name, bytes) in rows(table) {
        let b = buffer(
            device,
            name,
            bytes.len() as u64,
            Use::STORAGE | Use::COPY_DST,
        )?;
        device.queue.write_buffer(&b, 0, &bytes);
        scene.push(b);
    }
    device.check()?;
    Ok(scene)
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

fn bind(
    device: &Device,
    pipeline: &Pipeline,
    frame: &wgpu::Buffer,
    scene: &[wgpu::Buffer],
    written: [&wgpu::Buffer; 2],
) -> wgpu::BindGroup {
    let all = std::iter::once(frame).chain(scene).chain(written);
    let entries: Vec<_> = all
        .enumerate()
        .map(|(i, b)| wgpu::BindGroupEntry {
            binding: i as u32,
            resource: b.as_entire_binding(),
        })
        .collect();
    device.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("scene"),
        layout: &pipeline.layout,
        entries: &entries,
    })
}
