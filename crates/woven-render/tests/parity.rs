//! CPU and GPU make the same picture from the same random numbers.
//!
//! Seen to fail: with `product *= gap * 0.97` in shader/bvh.wgsl the first test reports a mean FLIP of 0.018 and 35 %
//! of the pixels within 1e-3, where the whole shader gives 0.00001 and 100 %.

mod common;

use common::{backends, curtain_room, cut_panel, even_lace, furnace, mean, picture, quad, sheet};
use glam::Vec3;
use woven_bsdf::measured::klems::Klems;
use woven_bsdf::measured::table::Tabulated;
use woven_bsdf::model::Model;
use woven_bsdf::vec3::Vec3 as Direction;
use woven_bsdf::weave::draft::Draft;
use woven_bsdf::weave::map::OpennessMap;
use woven_bsdf::weave::yarns::{Gauge, Yarns};
use woven_render::compare::Picture;
use woven_render::film::Film;
use woven_render::render::{Backend, Integrator, Settings};
use woven_render::scene::{
    Camera, Environment, LAYER_SKY, LAYER_SUN, Light, Material, Scene, Texture, TextureUse, Wrap,
};

/// A sheet with all its parts: weave, forward lobe, reflection.
fn lace() -> Material {
    let mut s = [0.0; 16];
    s[..8].copy_from_slice(&[0.5, 0.42, 0.7, 0.22, 0.15, 0.4, 0.3, 0.04]);
    woven_bsdf::sheet::Sheet::derive(&mut s);
    let mut m = Material::diffuse_sheet("lace", [0.45, 0.42, 0.36], [0.3, 0.27, 0.2], 0.0);
    m.shape = s.map(|x: f64| x as f32);
    m.linear[1] = [0.2, 0.2, 0.18];
    m.linear[3] = [0.3; 3];
    m
}

fn settings(spp: u32) -> Settings {
    Settings {
        width: 32,
        height: 24,
        spp,
        seed: 3,
        ..Settings::default()
    }
}

/// Share of pixels within `limit` of each other, relative to the brighter plus a hundredth.
fn share_within(a: &Film, b: &Film, limit: f32) -> f64 {
    let (a, b) = (
        a.beauty().expect("a picture"),
        b.beauty().expect("a picture"),
    );
    let close = |(p, q): (&[f32; 3], &[f32; 3])| {
        (0..3).all(|c| (p[c] - q[c]).abs() <= limit * (p[c].max(q[c]) + 0.01))
    };
    a.iter().zip(b).filter(|&(p, q)| close((p, q))).count() as f64 / a.len() as f64
}

fn as_picture(film: &Film) -> Picture<'_> {
    Picture {
        width: film.width,
        height: film.height,
        pixels: film.beauty().expect("a picture"),
    }
}

fn compare(name: &str, scene: &Scene, settings: &Settings, pixels: f64, means: f64) {
    if !backends().contains(&Backend::Gpu) {
        return;
    }
    let cpu = picture(scene, settings, Backend::Cpu);
    let gpu = picture(scene, settings, Backend::Gpu);
    let (a, b) = (as_picture(&cpu), as_picture(&gpu));
    let flip = woven_render::compare::compare(a, b, true)
        .unwrap_or_else(|e| panic!("{e:#}"))
        .report
        .flip;
    let (mc, mg) = (mean(&cpu), mean(&gpu));
    let worst = (0..3)
        .map(|c| (mc[c] / mg[c] - 1.0).abs())
        .fold(0.0, f64::max);
    let share = share_within(&cpu, &gpu, 1e-3);
    eprintln!(
        "{name}: means differ by {worst:.1e}, {:.2} % of pixels within 1e-3, FLIP {flip:.5}",
        share * 100.0
    );
    assert!(mc[0] > 1e-3, "{name} is black: {mc:?}");
    assert!(flip < 0.01, "{name}: mean FLIP {flip}");
    assert!(worst < means, "{name}: means {mc:?} and {mg:?}");
    assert!(
        share > pixels,
        "{name}: only {share} of the pixels agree within 1e-3"
    );
}

/// Rounding differs (fused multiplications), so that now and then a ray just misses what the other one hits, or a
/// coin falls otherwise. Every pixel of the path's block looks at where it went: 64 of the 768 pixels of these pictures, so
/// that a single stray path may take 8 % of them. At 160 x 120 and 16 samples the bench scene has 99.4 % within 1e-3.
const PIXELS: f64 = 0.95;
/// The issue asks for 0.2 %; the strays of a 32 x 24 picture leave some 1e-4.
const MEANS: f64 = 1e-3;

#[test]
fn curtain_before_a_panel() {
    compare(
        "even curtain",
        &curtain_room(even_lace(), 60),
        &settings(16),
        0.99,
        MEANS,
    );
}

#[test]
fn curtain_with_weave_and_lobes() {
    compare(
        "woven curtain",
        &curtain_room(lace(), 60),
        &settings(8),
        PIXELS,
        MEANS,
    );
}

#[test]
fn direct_light() {
    let settings = Settings {
        integrator: Integrator::Direct,
        ..settings(8)
    };
    compare("direct", &curtain_room(lace(), 60), &settings, 0.99, MEANS);
}

#[test]
fn sun_and_sky_through_the_window() {
    let mut scene = curtain_room(lace(), 60);
    // The panel gives way to the day.
    scene.meshes.retain(|m| m.name != "panel");
    let direction = Vec3::new(-0.4, 0.8, -1.0).normalize();
    scene.lights.push(Light::Sun {
        direction,
        irradiance: [9.0, 8.0, 6.0],
        angular_radius: 0.0047,
        layer: LAYER_SUN,
    });
    let (width, height) = (32, 16);
    let pixels = (0..width * height)
        .map(|i| {
            let up = 1.0 - (i / width) as f32 / height as f32;
            [0.4 + 0.4 * up, 0.5 + 0.6 * up, 0.6 + 1.2 * up]
        })
        .collect();
    scene.environment = Some(Environment {
        width,
        height,
        pixels,
        rotation: 0.7,
        scale: [1.0; 3],
        layer: LAYER_SKY,
    });
    let settings = Settings {
        light_layers: true,
        aov: true,
        ..settings(8)
    };
    compare("day", &scene, &settings, PIXELS, MEANS);
    // The layers are there, sum to the picture, and the portal does not change the mean.
    for backend in backends() {
        let film = picture(&scene, &settings, backend);
        let beauty = film.beauty().expect("a picture");
        for (i, p) in beauty.iter().enumerate() {
            let sum: f32 = ["sun", "sky", "lamps", "other"]
                .iter()
                .map(|l| film.layer(&format!("light.{l}")).expect("a layer")[i][1])
                .sum();
            assert!(
                (sum - p[1]).abs() <= 1e-5 * (1.0 + p[1]),
                "{backend:?}, pixel {i}: {sum} {p:?}"
            );
        }
        for name in ["albedo", "normal", "depth", "gap", "variance"] {
            let layer = film
                .layer(name)
                .unwrap_or_else(|| panic!("no layer {name}"));
            assert!(
                layer.iter().flatten().all(|x| x.is_finite())
                    && layer.iter().flatten().any(|&x| x != 0.0),
                "{name}"
            );
        }
    }
}

#[test]
fn textures_and_lamps() {
    let mut scene = curtain_room(lace(), 60);
    let checker = |x: u32, y: u32| {
        if (x / 4 + y / 4).is_multiple_of(2) {
            [230, 180, 120, 255]
        } else {
            [90, 120, 200, 40]
        }
    };
    scene.textures.push(Texture {
        name: "checker".into(),
        width: 16,
        height: 16,
        pixels: (0..256).map(|i| checker(i % 16, i / 16)).collect(),
        srgb: true,
        wrap_u: Wrap::Repeat,
        wrap_v: Wrap::Mirror,
    });
    let used = TextureUse {
        texture: 0,
        transform: [[5.0, 0.3, 0.1], [-0.2, 4.0, 0.0]],
    };
    scene.materials[3].color_texture = Some(used);
    scene.materials[3].coverage_texture = Some(used);
    scene.lights.push(Light::Point {
        position: Vec3::new(0.9, 2.2, 1.5),
        intensity: [1.0, 0.8, 0.5],
        layer: 2,
    });
    scene.lights.push(Light::Spot {
        position: Vec3::new(-1.5, 2.4, 2.0),
        direction: Vec3::new(0.6, -0.8, -0.5).normalize(),
        intensity: [3.0; 3],
        inner_angle: 0.3,
        outer_angle: 0.6,
        layer: 2,
    });
    compare("textures and lamps", &scene, &settings(8), PIXELS, MEANS);
}

/// A tree over lights of every kind, inside and outside of the window; glossy surfaces share them with scattering.
#[test]
fn many_lights_of_every_kind() {
    let mut scene = curtain_room(lace(), 60);
    cut_panel(&mut scene, 30, 0.9);
    scene.materials[1] = lace();
    scene
        .materials
        .push(Material::lamp("glow", [2.0, 1.0, 0.5], true));
    for k in 0..6 {
        let at = 0.5 * k as f32;
        scene.meshes.push(quad(
            "glow",
            Vec3::new(-1.9, 0.2 + 0.3 * at, 0.3 + at),
            Vec3::new(0.1, 0.2, 0.05),
            Vec3::new(0.0, 0.1, 0.2 + 0.1 * at),
            4,
        ));
        scene.lights.push(Light::Point {
            position: Vec3::new(1.8, 0.4 + 0.3 * at, 0.4 + at),
            intensity: [0.1, 0.2, 0.05 * at],
            layer: 2,
        });
        scene.lights.push(Light::Spot {
            position: Vec3::new(at - 1.0, 2.5, 1.0 + 0.3 * at),
            direction: Vec3::new(0.3 - 0.2 * at, -0.9, -0.3).normalize(),
            intensity: [1.0, 0.9, 0.8],
            inner_angle: 0.2,
            outer_angle: 0.3 + 0.1 * at,
            layer: 2,
        });
    }
    scene.meshes.last_mut().expect("a lamp").indices.truncate(1);
    scene.lights.insert(
        0,
        Light::Sun {
            direction: Vec3::new(0.3, 0.5, -1.0).normalize(),
            irradiance: [3.0; 3],
            angular_radius: 0.01,
            layer: LAYER_SUN,
        },
    );
    scene.environment = Some(furnace());
    compare("many lights", &scene, &settings(8), PIXELS, MEANS);
}

/// Textures far away, so that their smaller copies are used; bent normals, coloured vertices, a glow with a texture.
#[test]
fn small_copies_bent_normals_and_coloured_vertices() {
    let mut scene = curtain_room(lace(), 60);
    let speckle = |i: u32, n: u32| {
        let k = i.wrapping_mul(2_654_435_761) >> 16;
        [
            (k & 255) as u8,
            (k >> 3 & 255) as u8,
            (n + k % 40) as u8,
            255,
        ]
    };
    for (name, srgb) in [("speckle", true), ("bumps", false)] {
        scene.textures.push(Texture {
            name: name.into(),
            width: 64,
            height: 48,
            pixels: (0..64 * 48)
                .map(|i| {
                    if srgb {
                        speckle(i, 90)
                    } else {
                        [(96 + i % 64) as u8, (150 - i / 64) as u8, 230, 255]
                    }
                })
                .collect(),
            srgb,
            ..Texture::default()
        });
    }
    let used = |texture: usize, n: f32| TextureUse {
        texture,
        transform: [[n, 0.2, 0.1], [-0.1, n, 0.0]],
    };
    scene.materials[0].color_texture = Some(used(0, 9.0));
    scene.materials[1].normal_texture = Some(used(1, 3.0));
    scene.materials[3].normal_texture = Some(used(1, 7.0));
    scene.materials[3].normal_scale = 0.7;
    scene.materials[3].color_texture = Some(used(0, 2.0));
    scene.materials[3].plain_gloss = true;
    let glow = scene.materials.len();
    scene.materials.push(Material {
        emission_texture: Some(used(0, 1.0)),
        ..Material::lamp("glow", [0.8; 3], true)
    });
    scene.meshes.push(quad(
        "glow",
        Vec3::new(-1.9, 0.3, 0.6),
        Vec3::Z * 0.8,
        Vec3::Y * 0.6,
        glow,
    ));
    for (i, mesh) in scene.meshes.iter().enumerate().take(2) {
        let colour = |k: usize| {
            [
                [0.9, 0.4, 0.2],
                [0.3, 0.8, 0.4],
                [0.1, 0.2, 0.9],
                [1.0, 1.0, 0.5],
            ][k % 4]
        };
        scene
            .colors
            .push((i, (0..mesh.positions.len()).map(colour).collect()));
    }
    compare(
        "small copies, bent normals",
        &scene,
        &settings(8),
        PIXELS,
        MEANS,
    );
}

#[test]
fn furnace_of_the_woven_sheet() {
    let mut scene = curtain_room(lace(), 40);
    scene.meshes.retain(|m| m.name == "curtain");
    scene.portals.clear();
    scene.environment = Some(furnace());
    compare("furnace", &scene, &settings(8), PIXELS, MEANS);
}

fn goniometer() -> Tabulated {
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../assets/measurements/mecho_6216_goniometer.xml");
    let file = Klems::read(&file).unwrap_or_else(|e| panic!("{e}"));
    Tabulated::new(&file, "Visible").unwrap_or_else(|e| panic!("{e}"))
}

/// A measured cloth is all edges of patches: where a rounding puts a direction on the other side, the sample differs.
#[test]
fn measured_cloth() {
    let scene = curtain_room(Material::measured("shade", goniometer()), 60);
    compare("measured curtain", &scene, &settings(8), 0.95, MEANS);
}

#[test]
fn a_measured_cloth_in_a_furnace_shows_its_albedo() {
    let table = goniometer();
    for (theta, phi) in [(0.0, 0.0), (0.6, 1.1), (1.1, 4.0), (2.6, 0.3)] {
        let to_eye = Direction::from_angles(theta, phi);
        let eye = Vec3::new(to_eye.x as f32, to_eye.y as f32, to_eye.z as f32) * 4.0;
        let scene = Scene {
            materials: vec![Material::measured("shade", table.clone())],
            meshes: vec![sheet(0)],
            environment: Some(furnace()),
            // So narrow that the whole picture lies in one patch.
            camera: Camera::look_at(eye, Vec3::ZERO, Vec3::new(0.1, 1.0, 0.2), 0.01),
            ..Scene::default()
        };
        let want = table.albedo(to_eye) + table.gap(-to_eye);
        for backend in backends() {
            let got = mean(&picture(&scene, &settings(16), backend))[1];
            eprintln!("{backend:?} {theta} {phi}: {got:.6} of {want:.6}");
            // The sampler's weight is the albedo itself: no noise is left.
            assert!((got / want - 1.0).abs() < 0.01, "{backend:?}: {got} {want}");
        }
    }
}

/// A lace of yarns as a map over a closed ground, and as the share that is woven openly.
#[test]
fn maps_of_openness() {
    let gauge = Gauge {
        diameter: 0.28,
        pitch: 0.4,
    };
    let yarns = Yarns::new(&Draft::lace(), gauge, gauge, 0.5).gathered(3, 0.5);
    let map = OpennessMap::of_yarns(&yarns, 4);
    for multiplies in [false, true] {
        let mut scene = curtain_room(lace(), 60);
        scene
            .textures
            .push(Texture::of_openness("lace", &map, multiplies));
        scene.materials[3].coverage_texture = Some(TextureUse {
            texture: 0,
            transform: [[3.0, 0.0, 0.0], [0.0, 4.0, 0.0]],
        });
        scene.materials[3].multiplies = multiplies;
        compare("map of openness", &scene, &settings(8), PIXELS, MEANS);
    }
}

/// Pleats with as much cloth across the bottom as hangs there, so too much for the flatter top.
#[test]
fn a_curtain_that_is_pulled_and_sheared() {
    let mut scene = curtain_room(lace(), 60);
    let curtain = scene.meshes.iter_mut().find(|m| m.name == "curtain");
    curtain.expect("a curtain").at_rest = Some([2.6, 1.85]);
    compare("pulled curtain", &scene, &settings(8), PIXELS, MEANS);
}

/// What a sheet with a map gives back of an even light, and what passes, is what its parts do.
#[test]
fn a_map_of_openness_keeps_the_light() {
    let picture_of = |material: Material, even: f32| {
        let mut scene = Scene {
            materials: vec![material],
            meshes: vec![sheet(0)],
            environment: Some(furnace()),
            camera: Camera::look_at(Vec3::new(1.0, 0.5, 2.0), Vec3::ZERO, Vec3::Y, 0.1),
            ..Scene::default()
        };
        let map = OpennessMap::new(1, 1, vec![even]).expect("a map");
        scene
            .textures
            .push(Texture::of_openness("even", &map, true));
        scene.materials[0].coverage_texture = Some(TextureUse::plain(0));
        scene.materials[0].multiplies = true;
        backends()
            .into_iter()
            .map(|b| mean(&picture(&scene, &settings(32), b))[1])
            .collect::<Vec<_>>()
    };
    // Nothing absorbs: 1 comes through or back, however much of the ground is closed.
    let mut s = [0.0; 16];
    s[..8].copy_from_slice(&[0.5, 0.42, 0.7, 0.22, 0.15, 0.4, 0.3, 0.04]);
    woven_bsdf::sheet::Sheet::derive(&mut s);
    let mut white = Material::diffuse_sheet("white", [0.6; 3], [0.4; 3], 0.0);
    white.shape = s.map(|x: f64| x as f32);
    for even in [0.0, 0.4, 1.0] {
        for got in picture_of(white.clone(), even) {
            assert!((got - 1.0).abs() < 0.01, "{even}: {got}");
        }
    }
}

#[test]
fn the_back_has_colours_of_its_own() {
    let mut cloth = lace();
    let mut back = cloth.linear;
    back[2] = [0.05, 0.3, 0.6];
    back[3] = [0.6, 0.1, 0.1];
    back[4] = [0.1, 0.05, 0.0];
    cloth.linear[4] = [0.0, 0.1, 0.05];
    cloth.back = Some(back);
    let seen_from = |z: f32, cloth: &Material| Scene {
        materials: vec![cloth.clone()],
        meshes: vec![sheet(0)],
        lights: [1.0, -1.0]
            .map(|z| Light::Point {
                position: Vec3::new(0.4, 0.3, 2.0 * z),
                intensity: [5.0; 3],
                layer: 2,
            })
            .to_vec(),
        camera: Camera::look_at(Vec3::new(0.3, 0.5, 3.0 * z), Vec3::ZERO, Vec3::Y, 0.4),
        ..Scene::default()
    };
    for z in [1.0, -1.0] {
        compare(
            "two sides",
            &seen_from(z, &cloth),
            &settings(4),
            PIXELS,
            MEANS,
        );
    }
    // The back of the cloth is the front of one that is dyed the other way round.
    let turned = Material {
        linear: back,
        back: None,
        ..cloth.clone()
    };
    for backend in backends() {
        let [a, b, front] = [
            seen_from(-1.0, &cloth),
            seen_from(-1.0, &turned),
            seen_from(1.0, &cloth),
        ]
        .map(|s| mean(&picture(&s, &settings(4), backend)));
        assert!(
            a.iter().zip(b).all(|(a, b)| (a / b - 1.0).abs() < 1e-6),
            "{a:?} {b:?}"
        );
        assert!(front[0] > 1.2 * a[0] && front[2] < a[2], "{front:?} {a:?}");
    }
}
