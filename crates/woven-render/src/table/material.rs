//! Materials as rows, with the textures and measured tables that they use.

use glam::Vec3;
use woven_bsdf::measured::table::Tabulated;

use super::{
    DOUBLE_SIDED, EMITS, EVEN, MATT, MEASURED, MULTIPLIES, MaterialRow, NONE, PLAIN_GLOSS,
    TRANSMITS, TextureRow, mips,
};
use crate::optics;
use crate::scene::{LAYERS, MAX_LINEAR, Material, Scene, TextureUse, Wrap};

/// The row of a material; textures and tables that it uses go to `textures`.
pub(super) fn row(
    m: &Material,
    textures: &mut Textures,
    scene: &Scene,
    light_layers: bool,
) -> MaterialRow {
    let back = m.back.unwrap_or(m.linear);
    // The brighter side decides what is worth a sample.
    let most: [[f32; 3]; MAX_LINEAR] = std::array::from_fn(|j| {
        let side = if j == 2 || j == 3 || j == 4 {
            &back
        } else {
            &m.linear
        };
        std::array::from_fn(|c| m.linear[j][c].max(side[j][c]))
    });
    let sum = |c: usize| most.iter().map(|k| k[c]).sum::<f32>();
    let albedo = crate::cpu::math::luminance(Vec3::new(sum(0), sum(1), sum(2)));
    let black = |j: usize| most[j].iter().all(|&k| k <= 0.0);
    let measured = m.measured.is_some();
    let multiplies = m.multiplies && m.coverage_texture.is_some();
    let flat = m.shape[2] == 0.0 || (m.shape[0] == 0.0 && m.shape[1] == 0.0);
    let even = flat && !measured && !multiplies;
    let mut linear = m.linear.map(|k| [k[0], k[1], k[2], 0.0]);
    for (behind, j) in [(5, 2), (6, 3), (7, 4)] {
        linear[behind] = [back[j][0], back[j][1], back[j][2], 0.0];
    }
    let mut flags = 0;
    let mut set = |on: bool, flag: u32| flags |= if on { flag } else { 0 };
    let lobes = !black(1) || !black(3) || !black(4) || m.gloss_texture.is_some();
    set(!lobes && !measured, MATT);
    set(measured, MEASURED);
    set(multiplies, MULTIPLIES);
    set(m.double_sided, DOUBLE_SIDED);
    set(!black(0) || !black(1), TRANSMITS);
    set(m.emission.iter().any(|&e| e > 0.0), EMITS);
    set(even, EVEN);
    set(m.plain_gloss, PLAIN_GLOSS);
    MaterialRow {
        linear,
        shape: m.shape,
        weights: optics::weights(&most, &m.shape),
        metal: m.metal,
        emission: [m.emission[0], m.emission[1], m.emission[2], albedo],
        flags,
        layer: if light_layers {
            m.layer.min(LAYERS as u32 - 1)
        } else {
            0
        },
        color_texture: textures.row(m.color_texture, scene),
        coverage_texture: textures.row(m.coverage_texture, scene),
        emission_texture: textures.row(m.emission_texture, scene),
        alpha_cutoff: m.alpha_cutoff.unwrap_or(-1.0),
        gap: if even && m.coverage_texture.is_none() {
            optics::openness(&m.shape, Vec3::Z).clamp(0.0, 1.0)
        } else {
            -1.0
        },
        cover: 1.0 - optics::openness(&m.shape, Vec3::Z).clamp(0.0, 1.0),
        measured: m.measured.as_ref().map_or(NONE, |t| textures.measured(t)),
        normal_texture: textures.row(m.normal_texture, scene),
        normal_scale: m.normal_scale,
        gloss_texture: textures.row(m.gloss_texture, scene),
    }
}

/// Textures are copied once each, however often they are used.
#[derive(Default)]
pub(super) struct Textures {
    pub(super) rows: Vec<TextureRow>,
    pub(super) texels: Vec<u32>,
    /// (number in the scene, first texel, smaller copies)
    there: Vec<(usize, u32, u32)>,
}

impl Textures {
    /// Puts a measured table among the texels.
    fn measured(&mut self, table: &Tabulated) -> u32 {
        let first = self.texels.len() as u32;
        self.texels.extend(table.packed());
        first
    }

    fn row(&mut self, used: Option<TextureUse>, scene: &Scene) -> u32 {
        let Some(used) = used else { return NONE };
        let texture = &scene.textures[used.texture];
        let (first, copies) = match self.there.iter().find(|t| t.0 == used.texture) {
            Some(&(_, first, copies)) => (first, copies),
            None => {
                let first = self.texels.len() as u32;
                let copies = mips::append(texture, &mut self.texels);
                self.there.push((used.texture, first, copies));
                (first, copies)
            }
        };
        let wrap = |w: Wrap| match w {
            Wrap::Repeat => 0,
            Wrap::Mirror => 1,
            Wrap::Clamp => 2,
        };
        let [[a, b, c], [d, e, f]] = used.transform;
        let density = (a * e - b * d).abs() * texture.width as f32 * texture.height as f32;
        self.rows.push(TextureRow {
            map_u: [a, b, c, density],
            map_v: [d, e, f, copies as f32],
            first,
            width: texture.width,
            height: texture.height,
            flags: wrap(texture.wrap_u) | wrap(texture.wrap_v) << 2 | u32::from(texture.srgb) << 4,
        });
        self.rows.len() as u32 - 1
    }
}
