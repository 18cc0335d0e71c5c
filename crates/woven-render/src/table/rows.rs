//! The rows of the table and the numbers in their flags.

use bytemuck::{Pod, Zeroable};

use crate::scene::{MAX_LINEAR, MAX_SHAPE};

/// No light, no texture.
pub const NONE: u32 = u32::MAX;

/// What shading needs of one triangle; row `i` belongs to place `i` of [`crate::bvh::Bvh::order`].
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct Shade {
    /// Shading normal of the first corner, then its u.
    pub n0: [f32; 4],
    /// Of the second corner.
    pub n1: [f32; 4],
    /// Of the third corner.
    pub n2: [f32; 4],
    /// Direction of the weft (dp/du), then -1 where the texture is mirrored, else 1.
    pub weft: [f32; 4],
    /// v of the three corners, then the area of the triangle in (u, v) over its area in metres.
    pub v: [f32; 4],
    /// Colours of the corners, sRGB of 8 bits, red lowest; then 1 where there are any, and from the third bit on, ten for each
    /// corner, 512 times the root of the factor of the openness (0: none).
    pub colors: [u32; 4],
    /// Row of the material.
    pub material: u32,
    /// Row of the light that this triangle is (part of), or [`NONE`].
    pub light: u32,
    /// Number of the mesh.
    pub mesh: u32,
    /// Number of the triangle in its mesh.
    pub triangle: u32,
}

/// A material ready for use.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct MaterialRow {
    /// Linear factors, RGB and nothing: the five of the sheet; then diffuse reflection, reflection lobe and sheen for
    /// a viewer behind.
    pub linear: [[f32; 4]; MAX_LINEAR],
    /// Shape numbers.
    pub shape: [f32; MAX_SHAPE],
    /// Sampling weights of the linear factors.
    pub weights: [f32; MAX_LINEAR],
    /// Radiance, then the luminance of the sum of the linear factors.
    pub emission: [f32; 4],
    /// Colour of metal and the metalness, where `gloss_texture` tells from place to place.
    pub metal: [f32; 4],
    /// See the constants of this file.
    pub flags: u32,
    /// Light layer of the emission.
    pub layer: u32,
    /// Row of the colour texture or [`NONE`].
    pub color_texture: u32,
    /// Row of the coverage texture or [`NONE`].
    pub coverage_texture: u32,
    /// Row of the emission's texture or [`NONE`].
    pub emission_texture: u32,
    /// Alpha below it is a hole; negative: alpha is coverage.
    pub alpha_cutoff: f32,
    /// Gap that is the same everywhere and in every direction, or negative.
    pub gap: f32,
    /// Cover by yarn in every direction, where [`EVEN`].
    pub cover: f32,
    /// Row of the texture that bends the normal or [`NONE`].
    pub normal_texture: u32,
    /// Multiplies its first two numbers.
    pub normal_scale: f32,
    /// First word of the measured table among [`super::Table::texels`], where [`MEASURED`].
    pub measured: u32,
    /// Row of the texture of roughness and metalness or [`NONE`].
    pub gloss_texture: u32,
}

/// [`MaterialRow::flags`]: no lobes, diffuse terms only.
pub const MATT: u32 = 1;
/// [`MaterialRow::flags`]: emits on both sides.
pub const DOUBLE_SIDED: u32 = 2;
/// [`MaterialRow::flags`]: some light passes through (transmission, not the gap).
pub const TRANSMITS: u32 = 4;
/// [`MaterialRow::flags`]: emits.
pub const EMITS: u32 = 8;
/// [`MaterialRow::flags`]: the same cover in every direction.
pub const EVEN: u32 = 16;
/// [`MaterialRow::flags`]: textures do not colour the reflection lobe.
pub const PLAIN_GLOSS: u32 = 32;
/// [`MaterialRow::flags`]: scatters as a table says.
pub const MEASURED: u32 = 64;
/// [`MaterialRow::flags`]: the coverage texture multiplies the openness.
pub const MULTIPLIES: u32 = 128;

/// A texture and how to reach it.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct TextureRow {
    /// First row of the affine map of (u, v, 1), then texels a square of side 1 in (u, v).
    pub map_u: [f32; 4],
    /// Second row, then the number of smaller copies after the picture, each of half the side, down to one texel.
    pub map_v: [f32; 4],
    /// First texel; the smaller copies follow.
    pub first: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Bits 0-1 wrap of u (0 repeat, 1 mirror, 2 clamp), bits 2-3 of v, bit 4 sRGB.
    pub flags: u32,
}

/// Layer of light that the first sheet of a camera ray scatters back, with [`Globals::events`].
pub const REFLECTED: u32 = 0;
/// See [`REFLECTED`]: scatters on.
pub const TRANSMITTED: u32 = 1;
/// See [`REFLECTED`]: lets through its gaps.
pub const PASSED: u32 = 2;
/// See [`REFLECTED`]: gives off.
pub const EMITTED: u32 = 3;

/// [`LightRow::kind`]: a rectangle.
pub const RECT: u32 = 0;
/// [`LightRow::kind`]: a triangle.
pub const TRIANGLE: u32 = 1;
/// [`LightRow::kind`]: a disc at infinity.
pub const SUN: u32 = 2;
/// [`LightRow::kind`]: a point.
pub const POINT: u32 = 3;
/// [`LightRow::kind`]: a cone from a point.
pub const SPOT: u32 = 4;
/// [`LightRow::kind`]: the environment.
pub const SKY: u32 = 5;
/// [`LightRow::kind`]: a window; these rows come after the lights.
pub const PORTAL: u32 = 6;

/// [`LightRow::kind`]: lights together; these rows come after the windows. The place is the middle of their box, the
/// first edge half its sides, the second cos and sin of the half angle of the cone of their normals and the cosine of how far
/// beyond it they shine, the normal its axis, the area the square of half the diagonal, the radiance's first number their
/// power; layer and place are the rows of the two halves.
pub const CLUSTER: u32 = 7;

/// A light (or a window, or a cluster of lights).
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct LightRow {
    /// Corner, or place of a point.
    pub p: [f32; 3],
    /// Which of the kinds above.
    pub kind: u32,
    /// First edge; sun: cos and sin of the angular radius.
    pub u: [f32; 3],
    /// Light layer.
    pub layer: u32,
    /// Second edge; spot: cos of the inner and outer angle.
    pub v: [f32; 3],
    /// A triangle of it, for its texture, or [`NONE`].
    pub place: u32,
    /// Unit normal of the front; sun: direction to it; spot: its axis.
    pub n: [f32; 3],
    /// Area \[m²\]; for a rectangle that is not one (a parallelogram) negative.
    pub area: f32,
    /// Radiance; sun: irradiance; point and spot: intensity.
    pub radiance: [f32; 3],
    /// Row of the cluster that it is a half of, or [`NONE`].
    pub parent: u32,
}

/// Numbers of the scene that are not rows.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct Globals {
    /// Multiplies the environment's pixels, then its mean luminance.
    pub sky_scale: [f32; 4],
    /// Rows of lights.
    pub lights: u32,
    /// Rows of portals, after the lights.
    pub portals: u32,
    /// Columns of the environment, 0 without one.
    pub sky_width: u32,
    /// Rows of the environment.
    pub sky_height: u32,
    /// cos and sin of the environment's rotation.
    pub sky_turn: [f32; 2],
    /// Share of environment samples through the portals, the rest by the picture.
    pub portal_share: f32,
    /// Row of the environment among the lights, or [`NONE`].
    pub sky_light: u32,
    /// Layer of the environment.
    pub sky_layer: u32,
    /// Some light is sampled so that scattering must meet it too (triangles, see `cpu/light.rs`).
    pub soft_lights: u32,
    /// Scale of the offset that keeps a ray off the surface it leaves [m].
    pub offset: f32,
    /// 4, the taps of a bilinear texture: a loop bound that shader compilers do not know.
    pub taps: u32,
    /// First light that has no place: sun and sky. These are weighed one by one.
    pub others: u32,
    /// Row of the cluster of all lights before these, or [`NONE`]: few lights are weighed one by one.
    pub tree: u32,
    /// 1: the layers are [`crate::scene::EVENT_NAMES`], every light is of layer 0.
    pub events: u32,
    /// Nothing.
    pub spare: u32,
}
