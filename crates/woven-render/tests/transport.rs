//! Scenes whose answer is known on paper, on every backend.

mod common;

use common::{
    backends, curtain_room, even_lace, furnace, mean, picture, quad, room, sheets_over_floor,
};
use glam::Vec3;
use woven_render::render::{Backend, Integrator, Settings};
use woven_render::scene::{Camera, LAYER_SUN, Light, Material, Scene};

/// 384 pixels. A software GPU is slow, so it gets an eighth of many samples.
fn small(spp: u32, backend: Backend) -> Settings {
    let spp = if backend == Backend::Gpu && spp > 32 {
        spp / 8
    } else {
        spp
    };
    Settings {
        width: 24,
        height: 16,
        spp,
        ..Settings::default()
    }
}

/// The tolerance for the noise of an eighth of the samples.
fn slack(tolerance: f64, backend: Backend) -> f64 {
    if backend == Backend::Gpu {
        tolerance * 8.0_f64.sqrt()
    } else {
        tolerance
    }
}

fn assert_mean(got: [f64; 3], want: [f64; 3], tolerance: f64, what: &str) {
    for c in 0..3 {
        assert!(
            (got[c] / want[c] - 1.0).abs() < tolerance,
            "{what}: {got:?} instead of {want:?}"
        );
    }
}

#[test]
fn half_open_sheet_passes_half_of_a_directional_light() {
    let open = sheets_over_floor(0, 0.5, None);
    let half = sheets_over_floor(1, 0.5, None);
    for backend in backends() {
        let want = mean(&picture(&open, &small(4, backend), backend)).map(|x| x * 0.5);
        let got = mean(&picture(&half, &small(4, backend), backend));
        // The sheet is black, so the answer has no noise; the issue asks for 1 %.
        assert_mean(got, want, 1e-3, &format!("{backend:?}"));
        // And the open floor itself: albedo/π times irradiance.
        assert_mean(
            want,
            [2.0, 1.0, 0.5].map(|e| 0.8 / std::f64::consts::PI * e * 0.5),
            1e-3,
            "floor",
        );
    }
}

#[test]
fn eight_half_open_sheets_pass_one_part_in_256() {
    let open = sheets_over_floor(0, 0.5, None);
    let eight = sheets_over_floor(8, 0.5, None);
    for backend in backends() {
        let want = mean(&picture(&open, &small(4, backend), backend)).map(|x| x / 256.0);
        // 1/256 is above the limit where the coin begins: no noise.
        assert_mean(
            mean(&picture(&eight, &small(4, backend), backend)),
            want,
            1e-3,
            &format!("{backend:?}"),
        );
    }
}

#[test]
fn sixteen_sheets_keep_their_mean_below_the_limit_of_the_coin() {
    let open = sheets_over_floor(0, 0.5, None);
    let many = sheets_over_floor(16, 0.5, None);
    for backend in backends() {
        let want = mean(&picture(&open, &small(4, backend), backend)).map(|x| x / 65_536.0);
        // About one sample in 64 survives: 24*16*256 samples give 1500 of them, a scatter of 2.6 %; three of that.
        assert_mean(
            mean(&picture(&many, &small(256, backend), backend)),
            want,
            slack(0.08, backend),
            &format!("{backend:?}"),
        );
    }
}

#[test]
fn white_furnace_with_the_sheet_stays_white() {
    // R + T + gap = 1: all that is not let through by the gap is reflected or transmitted.
    let sheet = Material::diffuse_sheet("sheet", [0.6; 3], [0.4; 3], 0.3);
    let mut scene = Scene {
        materials: vec![sheet],
        environment: Some(furnace()),
        camera: Camera::look_at(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO, Vec3::Y, 1.0),
        ..Scene::default()
    };
    // Two crossed sheets light each other.
    scene.meshes.push(quad(
        "a",
        Vec3::new(-0.8, -0.8, 0.0),
        Vec3::X * 1.6,
        Vec3::Y * 1.6,
        0,
    ));
    scene.meshes.push(quad(
        "b",
        Vec3::new(0.1, -0.7, -0.9),
        Vec3::Z * 1.7,
        Vec3::Y * 1.5,
        0,
    ));
    for backend in backends() {
        let film = picture(
            &scene,
            &Settings {
                depth: 64,
                ..small(64, backend)
            },
            backend,
        );
        // The issue asks for 0.01; noise of the mean of 384 pixels x 64 samples is about 0.002.
        assert_mean(
            mean(&film),
            [1.0; 3],
            slack(0.003, backend),
            &format!("{backend:?}"),
        );
        // Pixel by pixel the noise is some 20 times that, and no pixel may be far off.
        for p in film.beauty().expect("a picture") {
            assert!(
                f64::from((p[0] - 1.0).abs()) < slack(0.25, backend),
                "{backend:?}: {p:?}"
            );
        }
    }
}

#[test]
fn white_furnace_with_a_weave_and_its_lobes_gains_nothing() {
    // A measured-like sheet: round yarns, forward lobe. Its parts sum to at most 1, and most of it is given back.
    let mut sheet = Material::diffuse_sheet("weave", [0.45; 3], [0.25; 3], 0.0);
    let shape = woven_bsdf_shape(0.6, 0.55, 0.4);
    sheet.shape = shape;
    sheet.linear[1] = [0.3; 3];
    let scene = Scene {
        materials: vec![sheet],
        meshes: vec![quad(
            "a",
            Vec3::new(-0.8, -0.8, 0.0),
            Vec3::X * 1.6,
            Vec3::Y * 1.6,
            0,
        )],
        environment: Some(furnace()),
        camera: Camera::look_at(Vec3::new(0.5, 0.4, 3.0), Vec3::ZERO, Vec3::Y, 0.3),
        ..Scene::default()
    };
    for backend in backends() {
        let got = mean(&picture(&scene, &small(256, backend), backend));
        // The lobe's albedo is bounded by 1 and the diffuse terms are normalised by the mean cover: 0.97..1.
        assert!(
            got[0] > 0.96 && got[0] < 1.0 + slack(0.003, backend),
            "{backend:?}: {got:?}"
        );
    }
}

fn woven_bsdf_shape(warp: f64, weft: f64, section: f64) -> [f32; 16] {
    use woven_bsdf::model::Model;
    let mut s = [0.0; 16];
    s[..8].copy_from_slice(&[warp, weft, section, 0.2, 0.15, 0.4, 0.4, 0.04]);
    woven_bsdf::sheet::Sheet::derive(&mut s);
    s.map(|x: f64| x as f32)
}

#[test]
fn closed_white_box_is_lit_by_one_over_one_minus_rho() {
    // Every wall gives off 1 and reflects rho: each pixel 1/(1 - rho).
    for rho in [0.5_f32, 0.8] {
        let mut wall = Material::matt("wall", [rho; 3]);
        wall.emission = [1.0; 3];
        let scene = Scene {
            materials: vec![wall],
            meshes: room(Vec3::splat(-1.0), Vec3::new(1.0, 1.5, 2.0), 0),
            camera: Camera::look_at(Vec3::new(0.1, 0.2, 1.5), Vec3::ZERO, Vec3::Y, 1.0),
            ..Scene::default()
        };
        for backend in backends() {
            let film = picture(
                &scene,
                &Settings {
                    depth: 100,
                    ..small(256, backend)
                },
                backend,
            );
            let want = 1.0 / (1.0 - f64::from(rho));
            // Noise of the mean over 98 000 samples of paths of some 1/(1-rho) bounces: about 0.15 %.
            assert_mean(
                mean(&film),
                [want; 3],
                slack(0.003, backend),
                &format!("{backend:?} {rho}"),
            );
        }
    }
}

#[test]
fn direct_light_is_one_scattering_and_less_than_all() {
    let scene = common::curtain_room(even_lace(), 40);
    for backend in backends() {
        let settings = small(32, backend);
        let all = mean(&picture(&scene, &settings, backend));
        let direct = mean(&picture(
            &scene,
            &Settings {
                integrator: Integrator::Direct,
                ..settings
            },
            backend,
        ));
        let one = mean(&picture(
            &scene,
            &Settings {
                depth: 1,
                ..settings
            },
            backend,
        ));
        assert_eq!(direct, one, "{backend:?}");
        assert!(
            direct[0] > 0.0 && direct[0] < 0.98 * all[0],
            "{backend:?}: {direct:?} {all:?}"
        );
    }
}

#[test]
fn sun_disc_and_point_light_give_their_irradiance() {
    let sun = Light::Sun {
        direction: Vec3::Y,
        irradiance: [1.0; 3],
        angular_radius: 0.0047,
        layer: LAYER_SUN,
    };
    // A point at height h gives I cos/d² = I h / d³.
    let point = Light::Point {
        position: Vec3::Y * 3.0,
        intensity: [9.0; 3],
        layer: 2,
    };
    for (light, want) in [(sun, 1.0), (point, 1.0)] {
        let scene = sheets_over_floor(0, 0.5, Some(light));
        let mut scene = scene;
        scene.camera = Camera::look_at(Vec3::new(0.0, 2.0, 0.01), Vec3::ZERO, Vec3::Y, 0.02);
        for backend in backends() {
            let got = mean(&picture(&scene, &small(16, backend), backend));
            assert_mean(
                got,
                [want * 0.8 / std::f64::consts::PI; 3],
                2e-3,
                &format!("{backend:?} {light:?}"),
            );
        }
    }
}

#[test]
fn a_marked_window_changes_the_noise_and_not_the_mean() {
    let marked = curtain_room(even_lace(), 60);
    let mut unmarked = marked.clone();
    unmarked.portals.clear();
    for integrator in [Integrator::Direct, Integrator::Path] {
        let settings = |seed: u32, spp: u32| Settings {
            width: 48,
            height: 36,
            spp,
            seed,
            integrator,
            ..Settings::default()
        };
        let mut means = Vec::new();
        let mut noises = Vec::new();
        for scene in [&marked, &unmarked] {
            let long = picture(scene, &settings(1, 256), Backend::Cpu);
            means.push(mean(&long));
            let short = picture(scene, &settings(2, 8), Backend::Cpu);
            let pairs = long.beauty().unwrap().iter().zip(short.beauty().unwrap());
            noises.push(
                pairs
                    .map(|(a, b)| f64::from((a[1] - b[1]).powi(2) / (a[1] * a[1] + 0.01)))
                    .sum::<f64>(),
            );
        }
        // The issue asks for 0.2 %; the noise of the means is about a tenth of that.
        assert_mean(means[0], means[1], 2e-3, &format!("{integrator:?}"));
        eprintln!(
            "{integrator:?}: relMSE falls to {:.2} of what it was, means {means:?}",
            noises[0] / noises[1]
        );
        if integrator == Integrator::Direct {
            // The panel is mostly behind the wall from beside the window.
            assert!(noises[0] < 0.5 * noises[1], "{noises:?}");
        }
    }
}
