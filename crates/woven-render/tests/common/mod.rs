//! Scenes whose answer is known on paper, and a small curtain, for the tests of the transport.
#![allow(dead_code, reason = "each test file uses a part")]

use glam::{Vec2, Vec3};
use woven_render::film::Film;
use woven_render::render::{Backend, Settings, render};
use woven_render::scene::{Camera, Environment, LAYER_SUN, Light, Material, Mesh, Portal, Scene};

/// A rectangle `corner`, `corner + u`, ...; its front is where `u × v` points.
pub(crate) fn quad(name: &str, corner: Vec3, u: Vec3, v: Vec3, material: usize) -> Mesh {
    Mesh {
        name: name.into(),
        positions: vec![corner, corner + u, corner + u + v, corner + v],
        normals: Vec::new(),
        uvs: vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
        indices: vec![[0, 1, 2], [0, 2, 3]],
        material,
        moving: false,
        at_rest: None,
    }
}

/// A box seen from inside, its front faces inwards.
pub(crate) fn room(lo: Vec3, hi: Vec3, material: usize) -> Vec<Mesh> {
    let d = hi - lo;
    let (x, y, z) = (Vec3::X * d.x, Vec3::Y * d.y, Vec3::Z * d.z);
    vec![
        quad("floor", lo, z, x, material),
        quad("ceiling", lo + y, x, z, material),
        quad("back", lo, x, y, material),
        quad("front", lo + z, y, x, material),
        quad("left", lo, y, z, material),
        quad("right", lo + x, z, y, material),
    ]
}

/// Sheets across z = 0, -0.1, ... over a white floor far behind, lit along -z... the eye looks at the floor from the
/// side so that no sheet is between eye and floor.
pub(crate) fn sheets_over_floor(count: usize, gap: f32, sun: Option<Light>) -> Scene {
    let mut scene = Scene {
        materials: vec![
            Material::matt("white", [0.8; 3]),
            Material::diffuse_sheet("sheet", [0.0; 3], [0.0; 3], gap),
        ],
        meshes: vec![quad(
            "floor",
            Vec3::new(-9.0, 0.0, -9.0),
            Vec3::Z * 18.0,
            Vec3::X * 18.0,
            0,
        )],
        lights: vec![sun.unwrap_or(Light::Sun {
            direction: Vec3::Y,
            irradiance: [2.0, 1.0, 0.5],
            angular_radius: 0.0,
            layer: LAYER_SUN,
        })],
        camera: Camera::look_at(
            Vec3::new(0.0, 0.5, 6.0),
            Vec3::new(0.0, 0.0, 4.0),
            Vec3::Y,
            0.2,
        ),
        ..Scene::default()
    };
    for i in 0..count {
        let y = 2.0 + 0.1 * i as f32;
        scene.meshes.push(quad(
            "sheet",
            Vec3::new(-9.0, y, -9.0),
            Vec3::Z * 18.0,
            Vec3::X * 18.0,
            1,
        ));
    }
    scene
}

/// Matt lace with the same gap in every direction.
pub(crate) fn even_lace() -> Material {
    Material::diffuse_sheet("lace", [0.38; 3], [0.46; 3], 0.35)
}

/// A sheet of 4 m x 4 m around the origin, the weft along x, the warp along y.
pub(crate) fn sheet(material: usize) -> Mesh {
    let corner = Vec3::new(-2.0, -2.0, 0.0);
    quad("sheet", corner, Vec3::X * 4.0, Vec3::Y * 4.0, material)
}

/// An even environment of radiance 1.
pub(crate) fn furnace() -> Environment {
    Environment {
        width: 4,
        height: 2,
        pixels: vec![[1.0; 3]; 8],
        rotation: 0.0,
        scale: [1.0; 3],
        layer: 1,
    }
}

/// A room with a window, a panel outside, a lamp inside, a pleated curtain of `material` before the window.
pub(crate) fn curtain_room(curtain: Material, columns: usize) -> Scene {
    let (lo, hi) = (Vec3::new(-2.0, 0.0, 0.0), Vec3::new(2.0, 2.6, 3.0));
    let mut meshes = room(lo, hi, 0);
    meshes[0].material = 1;
    // The back wall has a window from (-0.8, 0.8) to (0.8, 2.2).
    meshes.remove(2);
    let wall = |x0: f32, y0: f32, x1: f32, y1: f32| {
        quad(
            "wall",
            Vec3::new(x0, y0, 0.0),
            Vec3::X * (x1 - x0),
            Vec3::Y * (y1 - y0),
            0,
        )
    };
    meshes.extend([
        wall(-2.0, 0.0, -0.8, 2.6),
        wall(0.8, 0.0, 2.0, 2.6),
        wall(-0.8, 0.0, 0.8, 0.8),
        wall(-0.8, 2.2, 0.8, 2.6),
    ]);
    meshes.push(quad(
        "panel",
        Vec3::new(-1.5, 1.1, -1.0),
        Vec3::X * 1.8,
        Vec3::Y * 1.8,
        2,
    ));
    meshes.push(pleats(columns, 3));
    Scene {
        meshes,
        materials: vec![
            Material::matt("wall", [0.7, 0.68, 0.62]),
            Material::matt("floor", [0.4, 0.3, 0.22]),
            Material::lamp("panel", [6.0, 5.6, 5.0], false),
            curtain,
        ],
        portals: vec![Portal {
            corner: Vec3::new(-0.8, 0.8, 0.0),
            edge_u: Vec3::X * 1.6,
            edge_v: Vec3::Y * 1.4,
        }],
        camera: Camera::look_at(
            Vec3::new(0.7, 1.45, 2.75),
            Vec3::new(0.0, 1.45, 0.05),
            Vec3::Y,
            0.67,
        ),
        ..Scene::default()
    }
}

/// Cuts the panel of [`curtain_room`] into `count` squares of a grid, `fill` of a cell's side each, with as much light together
/// as the whole grid of them would have.
pub(crate) fn cut_panel(scene: &mut Scene, count: usize, fill: f32) {
    let across = (count as f32).sqrt().ceil() as usize;
    let side = 1.8 / across as f32;
    let more = (across * across) as f32 / count as f32;
    scene.meshes.retain(|m| m.name != "panel");
    scene.materials[2].emission = scene.materials[2].emission.map(|e| e * more);
    for k in 0..count {
        let corner = Vec3::new(
            -1.5 + (k % across) as f32 * side,
            1.1 + (k / across) as f32 * side,
            -1.0,
        );
        let edge = fill * side;
        let panel = quad("panel", corner, Vec3::X * edge, Vec3::Y * edge, 2);
        scene.meshes.insert(0, panel);
    }
}

/// A pleated sheet 2 m wide before the window, `columns` cells across.
pub(crate) fn pleats(columns: usize, material: usize) -> Mesh {
    let rows = columns / 2;
    let mut mesh = Mesh {
        name: "curtain".into(),
        material,
        moving: true,
        ..Mesh::default()
    };
    let point = |u: f32, v: f32| {
        let amplitude = 0.02 + 0.02 * v;
        Vec3::new(
            2.0 * u - 1.0,
            2.4 - 1.85 * v,
            0.08 + amplitude * (std::f32::consts::TAU * 9.0 * u + v).sin(),
        )
    };
    for j in 0..=rows {
        for i in 0..=columns {
            let (u, v) = (i as f32 / columns as f32, j as f32 / rows as f32);
            mesh.positions.push(point(u, v));
            mesh.uvs.push(Vec2::new(u, 1.0 - v));
            let du = point(u + 1e-3, v) - point(u - 1e-3, v);
            let dv = point(u, v + 1e-3) - point(u, v - 1e-3);
            mesh.normals.push(dv.cross(du).normalize());
        }
    }
    let across = columns as u32 + 1;
    for j in 0..rows as u32 {
        for i in 0..columns as u32 {
            let a = j * across + i;
            mesh.indices.push([a, a + across, a + across + 1]);
            mesh.indices.push([a, a + across + 1, a + 1]);
        }
    }
    mesh
}

/// Renders and panics with the error's sentence.
pub(crate) fn picture(scene: &Scene, settings: &Settings, backend: Backend) -> Film {
    render(scene, settings, backend, &mut ()).unwrap_or_else(|e| panic!("{e:#}"))
}

/// Mean of the picture.
pub(crate) fn mean(film: &Film) -> [f64; 3] {
    let pixels = film.beauty().expect("a film has a picture");
    let mut sum = [0.0; 3];
    for p in pixels {
        for c in 0..3 {
            sum[c] += f64::from(p[c]) / pixels.len() as f64;
        }
    }
    sum
}

/// The backends that can be tested here: the CPU, and the GPU if there is an adapter.
pub(crate) fn backends() -> Vec<Backend> {
    if std::env::var_os("WOVEN_NO_GPU").is_some() {
        eprintln!("skipped on the GPU: WOVEN_NO_GPU is set");
        return vec![Backend::Cpu];
    }
    // No adapter is a reason to skip; an adapter that fails is a failure of the test.
    if woven_render::gpu::adapters().is_empty() {
        assert!(
            std::env::var_os("WOVEN_REQUIRE_GPU").is_none(),
            "WOVEN_REQUIRE_GPU is set, but there is no adapter"
        );
        eprintln!("skipped on the GPU: there is no adapter");
        return vec![Backend::Cpu];
    }
    vec![Backend::Cpu, Backend::Gpu]
}
