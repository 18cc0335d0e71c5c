//! What there is to render: meshes, materials, lights, camera. Plain data in world space, filled by the
//! readers beside this file (glTF, environment maps, sky) or by hand.
//!
//! Lengths are metres, +Y is up, angles radians, colours linear Rec.709, light is radiance [W/(sr m²)]
//! per channel unless a field says otherwise.

pub mod environment;
pub mod fabric;
pub mod gltf;
pub mod sky;

use glam::{Mat4, Vec2, Vec3};
use std::sync::Arc;
use woven_bsdf::measured::table::Tabulated;
use woven_bsdf::weave::map::OpennessMap;

/// Number of shape numbers of a sheet: its parameters, then the constants derived from them.
pub const MAX_SHAPE: usize = 16;
/// Number of linear factors of a sheet, see [`Material::linear`].
pub const MAX_LINEAR: usize = 8;
/// Number of light layers, each of which can be kept in a picture of its own.
pub const LAYERS: usize = 4;
/// Names of the light layers in the order of their numbers.
pub const LAYER_NAMES: [&str; LAYERS] = ["sun", "sky", "lamps", "other"];
/// Names of the same layers where light is kept apart by what happened at the first sheet that the camera's ray meets:
/// scattered back, scattered through, passed by a gap or no sheet at all, or given off there.
pub const EVENT_NAMES: [&str; LAYERS] = ["reflected", "transmitted", "gap", "emitted"];
/// Light layer of the sun (and of any other [`Light::Sun`]).
pub const LAYER_SUN: u32 = 0;
/// Light layer of the environment.
pub const LAYER_SKY: u32 = 1;
/// Light layer of lamps: point and spot lights and emissive meshes.
pub const LAYER_LAMPS: u32 = 2;
/// Light layer of everything else.
pub const LAYER_OTHER: u32 = 3;

/// A whole scene at one moment.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Triangle meshes, already in world space (instances are flattened).
    pub meshes: Vec<Mesh>,
    /// Materials, named by [`Mesh::material`].
    pub materials: Vec<Material>,
    /// Pictures, named by [`TextureUse::texture`].
    pub textures: Vec<Texture>,
    /// Lights without a surface. Area lights are meshes whose material emits.
    pub lights: Vec<Light>,
    /// What is seen where a ray leaves the scene; black without one.
    pub environment: Option<Environment>,
    /// Openings through which environment and sun reach the inside. Light sampling uses them where a
    /// shading point sees the outside through them only; see [`Portal`].
    pub portals: Vec<Portal>,
    /// The eye.
    pub camera: Camera,
    /// Colours of vertices: the number of the mesh, and for each of its vertices a linear colour in 0..=1 that
    /// multiplies the factors as a texture does.
    pub colors: Vec<(usize, Vec<[f32; 3]>)>,
}

/// A triangle mesh in world space.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// For messages.
    pub name: String,
    /// Vertices [m].
    pub positions: Vec<Vec3>,
    /// Unit shading normals, one a vertex; empty: the triangle's own normal.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, one a vertex; u runs along the weft, v along the warp. Empty: the weft runs
    /// horizontally.
    pub uvs: Vec<Vec2>,
    /// Metres of cloth at rest in a unit of u and of v, where that is known: then stretch and shear open and close the weave of
    /// a woven material (not that of a measured table).
    pub at_rest: Option<[f32; 2]>,
    /// Three vertex numbers a triangle, counter-clockwise seen from the front.
    pub indices: Vec<[u32; 3]>,
    /// Number of the material.
    pub material: usize,
    /// Changes from frame to frame: its part of the ray structure is refitted, not built again.
    pub moving: bool,
}

/// A paper-thin two-sided sheet: every surface is one.
///
/// f(l, v) = Σ_j `linear[j]` basis_j(`shape`, l, v) \[1/sr\] beside the gap, which lets a share
/// openness(`shape`, w) of the light straight through, uncoloured.
#[derive(Clone, Debug)]
pub struct Material {
    /// For messages and for `--fabric NAME=FILE`.
    pub name: String,
    /// Linear factors, RGB each: diffuse transmission t_d, forward lobe k_t, diffuse reflection r_d,
    /// reflection lobe k_r, sheen, the rest 0. Shares of the light that hits the yarn.
    pub linear: [[f32; 3]; MAX_LINEAR],
    /// The same for a viewer on the side away from +z, where reflection has colours of its own there; transmission is
    /// always that of `linear`.
    pub back: Option<[[f32; 3]; MAX_LINEAR]>,
    /// Shape numbers of the sheet, derived constants included (see `woven_bsdf`'s sheet).
    pub shape: [f32; MAX_SHAPE],
    /// A measured table that scatters and passes light instead of the sheet; `linear` is then what denoiser and path
    /// choice take for its colour. See [`Material::measured`].
    pub measured: Option<Arc<Tabulated>>,
    /// Radiance given off \[W/(sr m²)\], from the front, or from both sides if `double_sided`.
    pub emission: [f32; 3],
    /// Multiplies the factors `linear`.
    pub color_texture: Option<TextureUse>,
    /// The reflection lobe keeps its colour where `color_texture` and coloured vertices multiply the other factors: the gloss of
    /// everything that is no metal.
    pub plain_gloss: bool,
    /// Its alpha channel multiplies the coverage by yarn: gap = 1 - a (1 - openness).
    pub coverage_texture: Option<TextureUse>,
    /// The alpha channel is the share that is woven as the sheet says instead, the rest being closed: gap = a openness.
    /// See [`Texture::of_openness`].
    pub multiplies: bool,
    /// With a cut-off, alpha below it is a hole and alpha above it is solid (glTF's MASK).
    pub alpha_cutoff: Option<f32>,
    /// Multiplies `emission`.
    pub emission_texture: Option<TextureUse>,
    /// Roughness and metalness from place to place (glTF's convention): the square of its green multiplies the widths of the
    /// reflection lobe, its blue the metalness of `metal`. `linear` and `shape` are those of no metal.
    pub gloss_texture: Option<TextureUse>,
    /// With `gloss_texture`: the colour that metal reflects, which `color_texture` multiplies, and the metalness.
    pub metal: [f32; 4],
    /// Bends the shading normal: its colours are 2 c - 1 in the frame of u, minus v and the normal (glTF's convention).
    pub normal_texture: Option<TextureUse>,
    /// Multiplies the bending's first two numbers.
    pub normal_scale: f32,
    /// Emits on both sides.
    pub double_sided: bool,
    /// Light layer of its emission, see [`LAYER_NAMES`].
    pub layer: u32,
}

/// A texture and how the mesh's coordinates reach it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureUse {
    /// Number of the texture.
    pub texture: usize,
    /// Affine map of (u, v, 1) to the texture's own coordinates, by rows.
    pub transform: [[f32; 3]; 2],
}

impl TextureUse {
    /// The texture with the mesh's own coordinates.
    #[must_use]
    pub const fn plain(texture: usize) -> Self {
        Self {
            texture,
            transform: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        }
    }
}

/// How a texture goes on outside 0..1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// Again from the start.
    #[default]
    Repeat,
    /// Mirrored every other time.
    Mirror,
    /// The edge goes on.
    Clamp,
}

/// A picture of 8 bits a channel; (0, 0) of the coordinates is the upper left corner, as in glTF.
#[derive(Clone, Debug, Default)]
pub struct Texture {
    /// For messages.
    pub name: String,
    /// Width in pixels, at least 1.
    pub width: u32,
    /// Height in pixels, at least 1.
    pub height: u32,
    /// RGBA rows from the top, `width * height` of them.
    pub pixels: Vec<[u8; 4]>,
    /// Colour channels are sRGB encoded (alpha never is).
    pub srgb: bool,
    /// Along u.
    pub wrap_u: Wrap,
    /// Along v.
    pub wrap_v: Wrap,
}

impl Texture {
    /// A map of openness as a texture for [`Material::coverage_texture`]: its holes cover nothing, or, for
    /// [`Material::multiplies`], its alpha is the openness. One repeat is a unit of its coordinates.
    #[must_use]
    pub fn of_openness(name: &str, map: &OpennessMap, multiplies: bool) -> Self {
        let [width, height] = map.size().map(|n| n as u32);
        let alpha = |o: &f32| (255.0 * if multiplies { *o } else { 1.0 - o } + 0.5) as u8;
        Self {
            name: name.to_owned(),
            width,
            height,
            pixels: map
                .values()
                .iter()
                .map(|o| [255, 255, 255, alpha(o)])
                .collect(),
            srgb: false,
            wrap_u: Wrap::Repeat,
            wrap_v: Wrap::Repeat,
        }
    }
}

/// A light without a surface of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// A disc at infinity.
    Sun {
        /// Unit vector towards the light.
        direction: Vec3,
        /// Irradiance on a surface that faces it \[W/m²\].
        irradiance: [f32; 3],
        /// Half the angle that its disc subtends (the sun's: 0.00465); 0 is a true direction.
        angular_radius: f32,
        /// Light layer.
        layer: u32,
    },
    /// A point, the same in every direction.
    Point {
        /// Place [m].
        position: Vec3,
        /// \[W/sr\].
        intensity: [f32; 3],
        /// Light layer.
        layer: u32,
    },
    /// A point that shines into a cone.
    Spot {
        /// Place [m].
        position: Vec3,
        /// Unit vector along the axis, away from the light.
        direction: Vec3,
        /// On the axis \[W/sr\].
        intensity: [f32; 3],
        /// Half angle of the full cone.
        inner_angle: f32,
        /// Half angle where it ends; more than `inner_angle`.
        outer_angle: f32,
        /// Light layer.
        layer: u32,
    },
}

/// Light from infinity as a latitude-longitude picture.
///
/// A unit direction d (after turning back by `rotation` about +Y) is found at
/// u = 1/2 + atan2(d.x, -d.z)/2π, v = acos(d.y)/π: the middle of the picture looks along -Z, its right
/// half towards +X, its first row is the zenith.
#[derive(Clone, Debug, Default)]
pub struct Environment {
    /// Columns, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// Radiance, rows from the top, `width * height` of them.
    pub pixels: Vec<[f32; 3]>,
    /// Turns the picture about +Y, counter-clockwise seen from above [rad].
    pub rotation: f32,
    /// Multiplies the pixels.
    pub scale: [f32; 3],
    /// Light layer.
    pub layer: u32,
}

/// A window: a parallelogram `corner + a edge_u + b edge_v` with a and b in 0..1, whose normal
/// `edge_u × edge_v` points inside.
///
/// From a point on the inside, what lies outside is sampled through the portals; the owner of the scene
/// vouches that no other way leads out. From a point on the outside they are ignored.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Portal {
    /// One corner [m].
    pub corner: Vec3,
    /// One side [m].
    pub edge_u: Vec3,
    /// The other side [m].
    pub edge_v: Vec3,
}

/// A perspective camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Camera to world without scale; the eye looks along its -Z, +Y is up in the picture.
    pub transform: Mat4,
    /// Full vertical angle of view [rad]; the horizontal one follows from the picture's sides.
    pub vfov: f32,
    /// Stops by which an 8-bit picture is brighter than radiance 1 = white; never applied to radiance.
    pub exposure: f32,
    /// Radius of the lens [m]; 0 is a pinhole.
    pub aperture_radius: f32,
    /// Distance of the plane that is sharp [m].
    pub focus_distance: f32,
}

impl Default for Camera {
    fn default() -> Self {
        Self::look_at(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, Vec3::Y, 0.8)
    }
}

impl Camera {
    /// A pinhole at `eye` that looks at `target`; `vfov` is the full vertical angle [rad].
    #[must_use]
    pub fn look_at(eye: Vec3, target: Vec3, up: Vec3, vfov: f32) -> Self {
        let z = (eye - target).try_normalize().unwrap_or(Vec3::Z);
        let x = up
            .cross(z)
            .try_normalize()
            .unwrap_or_else(|| z.any_orthonormal_vector());
        let transform = Mat4::from_cols(
            x.extend(0.0),
            z.cross(x).extend(0.0),
            z.extend(0.0),
            eye.extend(1.0),
        );
        Self {
            transform,
            vfov,
            exposure: 0.0,
            aperture_radius: 0.0,
            focus_distance: (eye - target).length().max(1e-3),
        }
    }
}

impl Default for Material {
    /// A matt grey wall.
    fn default() -> Self {
        Self::matt("default", [0.5; 3])
    }
}

impl Material {
    /// Opaque and matt on both sides: reflects `albedo`, passes nothing.
    #[must_use]
    pub fn matt(name: &str, albedo: [f32; 3]) -> Self {
        Self::diffuse_sheet(name, albedo, [0.0; 3], 0.0)
    }

    /// A matt sheet with the same `gap` in every direction; `reflect` and `transmit` are shares of the
    /// light that hits the yarn, so that R = (1 - gap) `reflect` and T = (1 - gap) `transmit`.
    #[must_use]
    pub fn diffuse_sheet(name: &str, reflect: [f32; 3], transmit: [f32; 3], gap: f32) -> Self {
        let mut linear = [[0.0; 3]; MAX_LINEAR];
        linear[0] = transmit;
        linear[2] = reflect;
        Self {
            name: name.to_owned(),
            linear,
            back: None,
            shape: crate::optics::constant_coverage(1.0 - gap),
            measured: None,
            emission: [0.0; 3],
            color_texture: None,
            plain_gloss: false,
            coverage_texture: None,
            multiplies: false,
            alpha_cutoff: None,
            emission_texture: None,
            gloss_texture: None,
            metal: [0.0; 4],
            normal_texture: None,
            normal_scale: 1.0,
            double_sided: false,
            layer: LAYER_LAMPS,
        }
    }

    /// Cloth as it was measured.
    #[must_use]
    pub fn measured(name: &str, table: Tabulated) -> Self {
        let [t, r] = table.means().map(|x| [x as f32; 3]);
        Self {
            measured: Some(Arc::new(table)),
            ..Self::diffuse_sheet(name, r, t, 0.0)
        }
    }

    /// A lamp: gives off `radiance` from the front (and the back if `double_sided`) and reflects nothing.
    #[must_use]
    pub fn lamp(name: &str, radiance: [f32; 3], double_sided: bool) -> Self {
        Self {
            emission: radiance,
            double_sided,
            ..Self::matt(name, [0.0; 3])
        }
    }
}
