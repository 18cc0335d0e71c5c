//! Cloth that is pulled lets more light through its weave and scatters as much less; at rest nothing changes.
//!
//! Seen to fail: without the factor in the shader's `gap_at`, in its `surface`, or after [`Renderer::move_mesh`].

use std::sync::atomic::AtomicBool;

use crate::common::{backends, furnace, mean, picture, quad, sheet};
use glam::Vec3;
use woven_bsdf::model::Model;
use woven_render::render::{Backend, Renderer, Settings};
use woven_render::scene::{Camera, Light, Material, Mesh, Scene};

const GAMMAS: [f64; 2] = [0.9, 0.8];

/// A woven sheet whose yarns transmit `t` and reflect `r`, of flat yarns or round ones.
fn cloth(t: f32, r: f32, section: f64) -> Material {
    let mut s = [0.0; 16];
    s[..8].copy_from_slice(&[GAMMAS[0], GAMMAS[1], section, 0.3, 0.3, 0.3, 0.3, 0.04]);
    woven_bsdf::sheet::Sheet::derive(&mut s);
    let mut m = Material::diffuse_sheet("cloth", [t; 3], [r; 3], 0.0);
    m.shape = s.map(|x: f64| x as f32);
    m
}

/// Four by four metres of cloth, pulled by `warp` and `weft`.
fn pulled(warp: f32, weft: f32) -> Mesh {
    let size = Vec3::new(4.0 * (1.0 + weft), 4.0 * (1.0 + warp), 0.0);
    Mesh {
        at_rest: Some([4.0; 2]),
        moving: true,
        ..quad("cloth", size * -0.5, Vec3::X * size.x, Vec3::Y * size.y, 0)
    }
}

fn scene(material: Material, mesh: Mesh) -> Scene {
    Scene {
        materials: vec![material],
        meshes: vec![mesh],
        environment: Some(furnace()),
        camera: Camera::look_at(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO, Vec3::Y, 0.05),
        ..Scene::default()
    }
}

fn settings(spp: u32) -> Settings {
    Settings {
        width: 16,
        height: 12,
        spp,
        ..Settings::default()
    }
}

#[test]
fn a_pulled_weave_opens() {
    let open =
        |warp: f64, weft: f64| (1.0 - GAMMAS[0] / (1.0 + weft)) * (1.0 - GAMMAS[1] / (1.0 + warp));
    for (warp, weft) in [(0.0, 0.0), (0.01, 0.03), (-0.01, 0.0)] {
        let want = open(warp, weft);
        for section in [0.0, 0.6] {
            let scene = scene(cloth(0.0, 0.0, section), pulled(warp as f32, weft as f32));
            for backend in backends() {
                let got = mean(&picture(&scene, &settings(1), backend))[1];
                // Half a step of the ten bits is 0.2 %, and the edges of the picture look 1.4 degrees aslant.
                assert!(
                    (got / want - 1.0).abs() < 3e-3,
                    "{backend:?} {warp} {weft}: {got} of {want}"
                );
            }
        }
    }
}

#[test]
fn shadows_and_moved_meshes_know_the_pull() {
    // Light that has come through the cloth falls onto a floor; the cloth is pulled after it was set up.
    let floor = |mesh: Mesh| {
        let mut scene = scene(cloth(0.0, 0.0, 0.6), mesh);
        scene.environment = None;
        scene.materials.push(Material::matt("floor", [0.8; 3]));
        scene.meshes.push(Mesh {
            material: 1,
            ..sheet(1)
        });
        scene.meshes[1]
            .positions
            .iter_mut()
            .for_each(|p| p.z -= 2.0);
        scene.lights.push(Light::Sun {
            direction: Vec3::Z,
            irradiance: [1.0; 3],
            angular_radius: 0.0,
            layer: 1,
        });
        // From beside the cloth.
        scene.camera = Camera::look_at(
            Vec3::new(0.0, -4.0, -1.0),
            Vec3::new(0.0, 0.0, -2.0),
            Vec3::Y,
            0.05,
        );
        scene
    };
    let pull = pulled(0.02, 0.05);
    let open =
        |warp: f64, weft: f64| (1.0 - GAMMAS[0] / (1.0 + weft)) * (1.0 - GAMMAS[1] / (1.0 + warp));
    let want = 0.8 / std::f64::consts::PI * open(0.02, 0.05);
    for backend in backends() {
        let new = mean(&picture(&floor(pull.clone()), &settings(1), backend))[1];
        assert!(
            (new / want - 1.0).abs() < 3e-3,
            "{backend:?}: {new} of {want}"
        );
        let mut renderer = Renderer::new(&floor(pulled(0.0, 0.0)), &settings(1), backend).unwrap();
        renderer.move_mesh(0, &pull.positions, &[]).unwrap();
        while renderer.samples() < 1 {
            renderer.step(1, &AtomicBool::new(false)).unwrap();
        }
        let moved = mean(&renderer.film().unwrap())[1];
        assert!(
            (moved / new - 1.0).abs() < 1e-5,
            "{backend:?}: {moved} moved, {new} new"
        );
    }
}

#[test]
fn what_opens_scatters_less_and_nothing_is_gained() {
    // Yarns that absorb nothing in an even light.
    for (warp, weft) in [(0.0, 0.0), (0.01, 0.03), (-0.02, -0.02)] {
        let scene = scene(cloth(0.6, 0.4, 0.6), pulled(warp, weft));
        for backend in backends() {
            let got = mean(&picture(&scene, &settings(64), backend))[1];
            assert!((got - 1.0).abs() < 0.01, "{backend:?} {warp} {weft}: {got}");
        }
    }
}

#[test]
fn at_rest_nothing_changes() {
    let known = scene(cloth(0.5, 0.3, 0.6), pulled(0.0, 0.0));
    let mut unknown = known.clone();
    unknown.meshes[0].at_rest = None;
    let [a, b] = [&known, &unknown].map(|s| picture(s, &settings(2), Backend::Cpu));
    assert_eq!(a.beauty(), b.beauty());
}
