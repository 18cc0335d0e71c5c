//! The stage: a room with a window, a garden outside, light, a camera, and one curtain whose mesh and fabric are put in.
//!
//! The catalog renders it frame by frame, the viewer shows it live.
//!
//! ```
//! use woven_catalog::stage::{Preset, Stage};
//! let stage = Stage::new(Preset::Day);
//! assert_eq!(stage.scene().portals.len(), 1);
//! ```

mod furniture;
mod light;
mod outside;
mod room;
mod shape;
mod texture;

use std::path::Path;

use anyhow::Result;
use glam::{Vec2, Vec3};
use woven_bsdf::fabric::Fabric;
use woven_render::scene::fabric::wear;
use woven_render::scene::{
    Camera, LAYER_LAMPS, LAYER_SKY, Material, Mesh, Scene, Texture, TextureUse,
};

pub use light::{DUSK, LAMP_BOOST, Preset, sun_direction};
pub use room::{OPENING, RAIL_DISTANCE, RAIL_HEIGHT, ROOM, WALL, portal};

/// Left and right end of the closed curtain on the rail [m].
pub const CURTAIN_SPAN: (f32, f32) = (-1.16, 0.36);
/// Height of the hem above the floor [m].
pub const HEM_HEIGHT: f32 = 0.035;

/// The triangles of a curtain at one moment, in the stage's world (see [`ROOM`]).
#[derive(Clone, Debug, Default)]
pub struct CurtainMesh {
    /// Vertices [m].
    pub positions: Vec<Vec3>,
    /// Unit normals, one a vertex.
    pub normals: Vec<Vec3>,
    /// u along the weft, v along the warp, in metres of cloth at rest, one a vertex.
    pub uvs: Vec<Vec2>,
    /// Three vertex numbers a triangle.
    pub indices: Vec<[u32; 3]>,
}

/// A lit room with a curtain in it.
#[derive(Clone, Debug)]
pub struct Stage {
    scene: Scene,
    curtain: usize,
    cloth: usize,
    /// Number of the room's own textures; the curtain's follow them.
    textures: usize,
}

impl Stage {
    /// The room in the light of `preset`, with an empty rail and an ordinary white cloth.
    #[must_use]
    pub fn new(preset: Preset) -> Self {
        let mut builder = Builder::default();
        room::build(&mut builder);
        furniture::build(&mut builder, preset.lamps(), preset.far_window());
        outside::build(&mut builder);
        let mut scene = builder.scene;
        let cloth = scene.materials.len();
        scene.materials.push(Material::diffuse_sheet(
            "curtain", [0.45; 3], [0.35; 3], 0.02,
        ));
        let curtain = scene.meshes.len();
        scene.meshes.push(Mesh {
            name: "curtain".to_owned(),
            material: cloth,
            moving: true,
            // Its coordinates are metres of cloth.
            at_rest: Some([1.0; 2]),
            ..Mesh::default()
        });
        scene.lights.extend(preset.sun());
        scene.environment = Some(preset.sky());
        scene.portals.push(room::portal());
        scene.camera = Camera {
            exposure: preset.exposure(),
            ..camera()
        };
        Self {
            textures: scene.textures.len(),
            scene,
            curtain,
            cloth,
        }
    }

    /// Hangs a curtain on the rail, in the place of the one that hung there.
    #[must_use]
    pub fn with_curtain(mut self, mesh: CurtainMesh) -> Self {
        self.set_curtain(mesh);
        self
    }

    /// Hangs a curtain on the rail, in the place of the one that hung there.
    pub fn set_curtain(&mut self, mesh: CurtainMesh) {
        let place = &mut self.scene.meshes[self.curtain];
        let CurtainMesh {
            positions,
            normals,
            uvs,
            indices,
        } = mesh;
        (place.positions, place.normals, place.uvs, place.indices) =
            (positions, normals, uvs, indices);
    }

    /// Weaves the curtain of another material, which may be covered by one of `textures`, its own; its name stays "curtain".
    pub fn set_material(&mut self, material: Material, textures: &[Texture]) {
        self.scene.textures.truncate(self.textures);
        self.scene.textures.extend_from_slice(textures);
        let coverage_texture = material.coverage_texture.map(|cover| TextureUse {
            texture: self.textures + cover.texture,
            ..cover
        });
        self.scene.materials[self.cloth] = Material {
            name: "curtain".to_owned(),
            coverage_texture,
            ..material
        };
    }

    /// Weaves the curtain of a fabric, whose map of openness lies in `folder`.
    ///
    /// # Errors
    /// A sentence when the fabric cannot be rendered.
    pub fn dress(&mut self, fabric: &Fabric, folder: &Path) -> Result<()> {
        let (mut material, mut textures) = (Material::matt("curtain", [0.0; 3]), Vec::new());
        wear(&mut material, fabric, folder, &mut textures)?;
        self.set_material(material, &textures);
        Ok(())
    }

    /// The scene to render.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The scene, to be changed further: camera, exposure, lights.
    pub fn scene_mut(&mut self) -> &mut Scene {
        &mut self.scene
    }

    /// Number of the curtain's mesh in the scene.
    #[must_use]
    pub const fn curtain(&self) -> usize {
        self.curtain
    }

    /// Number of the curtain's material in the scene.
    #[must_use]
    pub const fn cloth(&self) -> usize {
        self.cloth
    }
}

/// The eye: standing in the room, a little to the right, looking at the curtain.
fn camera() -> Camera {
    Camera::look_at(
        Vec3::new(0.42, 1.34, 4.35),
        Vec3::new(-0.02, 1.20, 0.0),
        Vec3::Y,
        36_f32.to_radians(),
    )
}

/// A scene being put together.
#[derive(Default)]
struct Builder {
    scene: Scene,
}

impl Builder {
    fn add(&mut self, mesh: Mesh) {
        self.scene.meshes.push(mesh);
    }

    fn material(&mut self, material: Material) -> usize {
        self.scene.materials.push(material);
        self.scene.materials.len() - 1
    }

    fn matt(&mut self, name: &str, albedo: [f32; 3]) -> usize {
        self.material(Material::matt(name, albedo))
    }

    /// Leaves: a matt sheet that also lets light through.
    fn leafy(&mut self, name: &str, reflect: [f32; 3], transmit: [f32; 3]) -> usize {
        self.material(Material::diffuse_sheet(name, reflect, transmit, 0.0))
    }

    fn textured(&mut self, name: &str, tint: [f32; 3], texture: TextureUse) -> usize {
        self.material(Material {
            color_texture: Some(texture),
            ..Material::matt(name, tint)
        })
    }

    /// A pane that is as bright as the sky it shows, and belongs to its layer.
    fn window(&mut self, name: &str, radiance: [f32; 3]) -> usize {
        let pane = Material {
            layer: LAYER_SKY,
            ..Material::lamp(name, radiance, false)
        };
        self.material(pane)
    }

    fn lamp(&mut self, name: &str, radiance: [f32; 3], albedo: [f32; 3]) -> usize {
        let shade = Material {
            emission: radiance,
            layer: LAYER_LAMPS,
            ..Material::matt(name, albedo)
        };
        self.material(shade)
    }

    fn texture(&mut self, texture: Texture) -> usize {
        self.scene.textures.push(texture);
        self.scene.textures.len() - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mesh_is_whole() {
        for preset in [Preset::Day, Preset::Evening, Preset::All] {
            let stage = Stage::new(preset);
            let scene = stage.scene();
            for mesh in &scene.meshes {
                assert!(mesh.material < scene.materials.len(), "{}", mesh.name);
                assert_eq!(mesh.normals.len(), mesh.positions.len(), "{}", mesh.name);
                assert_eq!(mesh.uvs.len(), mesh.positions.len(), "{}", mesh.name);
                assert!(
                    mesh.indices
                        .iter()
                        .flatten()
                        .all(|&i| (i as usize) < mesh.positions.len()),
                    "{}",
                    mesh.name
                );
                assert!(
                    mesh.positions
                        .iter()
                        .chain(&mesh.normals)
                        .all(|p| p.is_finite()),
                    "{}",
                    mesh.name
                );
            }
        }
    }

    #[test]
    fn the_eye_is_inside_and_the_sun_outside() {
        let eye = camera().transform.w_axis.truncate();
        assert!(eye.cmpgt(ROOM.0).all() && eye.cmplt(ROOM.1).all());
        assert!(sun_direction().z < 0.0 && sun_direction().y > 0.0);
        let portal = portal();
        assert!(
            portal.edge_u.cross(portal.edge_v).z > 0.0,
            "the portal's normal points into the room"
        );
    }

    #[test]
    fn lamps_are_off_by_day_and_the_sun_is_down_in_the_evening() {
        let lit = |preset| {
            Stage::new(preset)
                .scene
                .materials
                .iter()
                .any(|m| m.layer == LAYER_LAMPS && m.emission != [0.0; 3])
        };
        assert!(!lit(Preset::Day) && lit(Preset::Evening) && lit(Preset::All));
        assert!(Stage::new(Preset::Evening).scene.lights.is_empty());
    }
}
