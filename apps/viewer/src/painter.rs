//! The stage of the catalog, rendered by woven-render: what the render thread paints.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use woven_bsdf::model::MAX_LINEAR;
use woven_catalog::stage::{CurtainMesh, Preset, Stage};
use woven_render::film::Film;
use woven_render::render::{Backend, Renderer, Settings};
use woven_render::scene::{Camera, Material, Texture};

use crate::cloth::Pattern;
use crate::nearest::Woven;
use crate::worker::Painter;

/// Most scattering events of a path: enough for the light to leave the curtain, cross the room and come back.
const DEPTH: u32 = 5;
/// Renderers kept, one a size: the coarse steps and the full one.
const KEPT: usize = 4;

/// What there is to see.
#[derive(Clone, Debug)]
pub struct Look {
    /// The light.
    pub preset: Preset,
    /// The cloth's material.
    pub cloth: Woven,
    /// What covers it beside its weave.
    pub pattern: Option<Arc<Pattern>>,
    /// The curtain as it hangs.
    pub curtain: Arc<CurtainMesh>,
    /// The eye.
    pub camera: Camera,
    /// Where the work is done.
    pub backend: Backend,
}

impl Look {
    /// The cloth's material, and its own texture if it has one.
    fn material(&self) -> (Material, &[Texture]) {
        let single = |linear: [[f64; 3]; MAX_LINEAR]| linear.map(|k| k.map(|v| v as f32));
        let material = Material {
            linear: single(self.cloth.linear),
            back: self.cloth.back.map(single),
            shape: self.cloth.shape.map(|v| v as f32),
            ..Material::matt("curtain", [0.0; 3])
        };
        match &self.pattern {
            None => (material, &[]),
            Some(pattern) => {
                let (material, texture) = pattern.cover(material);
                (material, std::slice::from_ref(texture))
            }
        }
    }

    /// Whether another look has the same cloth.
    fn same_cloth(&self, other: &Self) -> bool {
        let same_pattern = match (&self.pattern, &other.pattern) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (None, None) => true,
            _ => false,
        };
        self.cloth == other.cloth && same_pattern
    }
}

/// Paints looks. What has not changed since the last one is kept: room, ray structure, buffers.
#[derive(Default)]
pub struct StagePainter {
    stages: Vec<(Preset, Stage)>,
    look: Option<Look>,
    renderers: Vec<([usize; 2], Renderer)>,
    backend: String,
    no_gpu: bool,
}

impl StagePainter {
    /// The stage in the light of `preset`; made once.
    fn stage(&mut self, preset: Preset) -> &mut Stage {
        let at = match self.stages.iter().position(|(p, _)| *p == preset) {
            Some(at) => at,
            None => {
                self.stages.push((preset, Stage::new(preset)));
                self.stages.len() - 1
            }
        };
        &mut self.stages[at].1
    }

    /// Moves camera and curtain of the renderers that are there; false when they have to be made anew.
    fn moved(&mut self, old: &Look, new: &Look) -> Result<bool, String> {
        let same = old.preset == new.preset && old.backend == new.backend && old.same_cloth(new);
        if !same
            || old.curtain.indices != new.curtain.indices
            || old.curtain.positions.len() != new.curtain.positions.len()
        {
            return Ok(false);
        }
        let mesh = self.stage(new.preset).curtain();
        for (_, renderer) in &mut self.renderers {
            if !Arc::ptr_eq(&old.curtain, &new.curtain) {
                renderer
                    .move_mesh(mesh, &new.curtain.positions, &new.curtain.normals)
                    .map_err(|e| format!("{e:#}"))?;
            }
            renderer
                .set_camera(new.camera)
                .map_err(|e| format!("{e:#}"))?;
        }
        Ok(true)
    }

    /// The renderer for a size, without samples.
    fn renderer(&mut self, size: [usize; 2]) -> Result<&mut Renderer, String> {
        let told = |e: anyhow::Error| format!("{e:#}");
        if let Some(at) = self.renderers.iter().position(|(s, _)| *s == size) {
            return Ok(&mut self.renderers[at].1);
        }
        let Some(look) = self.look.clone() else {
            return Err("There is nothing to render yet.".to_owned());
        };
        let settings = Settings {
            width: size[0] as u32,
            height: size[1] as u32,
            spp: 1 << 20,
            depth: DEPTH,
            seed: 1,
            aov: true,
            ..Settings::default()
        };
        let backend = if self.no_gpu {
            Backend::Cpu
        } else {
            look.backend
        };
        let renderer =
            Renderer::new(self.stage(look.preset).scene(), &settings, backend).map_err(told)?;
        if self.renderers.len() == KEPT {
            self.renderers.remove(0);
        }
        self.renderers.push((size, renderer));
        let last = self.renderers.len() - 1;
        Ok(&mut self.renderers[last].1)
    }
}

impl Painter for StagePainter {
    type Scene = Look;

    fn prepare(&mut self, look: &Look) -> Result<(), String> {
        let kept = match self.look.take() {
            Some(old) => self.moved(&old, look)?,
            None => false,
        };
        if !kept {
            self.renderers.clear();
        }
        let stage = self.stage(look.preset);
        let (material, textures) = look.material();
        stage.set_material(material, textures);
        stage.set_curtain((*look.curtain).clone());
        stage.scene_mut().camera = look.camera;
        self.look = Some(look.clone());
        Ok(())
    }

    fn pass(
        &mut self,
        size: [usize; 2],
        pass: u32,
        stop: &AtomicBool,
    ) -> Result<Option<Film>, String> {
        let told = |e: anyhow::Error| format!("{e:#}");
        let renderer = self.renderer(size)?;
        if pass == 0 && renderer.samples() > 0 {
            renderer.clear().map_err(told)?;
        }
        if !renderer.step(1, stop).map_err(told)? {
            return Ok(None);
        }
        let (device, fell_back) = (renderer.device(), renderer.note().is_some());
        let film = renderer.film().map_err(told)?;
        self.backend = device;
        if fell_back {
            // There is no GPU, or it was lost: looking for one again would cost time at every change.
            self.no_gpu = true;
        }
        Ok(Some(film))
    }

    fn backend(&self) -> String {
        self.backend.clone()
    }
}
