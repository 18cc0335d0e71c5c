//! The GPU is taken away in the middle of a render, and the picture is the same.
//!
//! Two losses in the suite; the campaign of the issue is `WOVEN_LOSSES=20 cargo test -p woven-render --test device_loss -- --nocapture`.

mod common;

use common::{backends, curtain_room, even_lace};
use std::sync::atomic::AtomicBool;
use woven_render::render::{Backend, Renderer, Settings};

#[test]
fn a_lost_device_costs_nothing_but_time() {
    if !backends().contains(&Backend::Gpu) {
        return;
    }
    let losses: u32 = std::env::var("WOVEN_LOSSES")
        .ok()
        .and_then(|n| n.parse().ok())
        .unwrap_or(2);
    let scene = curtain_room(even_lace(), 40);
    let settings = Settings {
        width: 24,
        height: 16,
        spp: 6,
        aov: true,
        ..Settings::default()
    };
    let go = AtomicBool::new(false);
    let mut whole = Renderer::new(&scene, &settings, Backend::Gpu).unwrap();
    whole.step(settings.spp, &go).unwrap();
    let want = whole.film().unwrap();
    for loss in 0..losses {
        let mut renderer = Renderer::new(&scene, &settings, Backend::Gpu).unwrap();
        let before = loss % settings.spp;
        if before > 0 {
            renderer.step(before, &go).unwrap();
        }
        // Half of the time something has been read back before, so that there is something to go on from.
        if loss % 2 == 1 {
            renderer.film().unwrap();
        }
        renderer.lose_device();
        renderer.step(settings.spp - before, &go).unwrap();
        let note = renderer.note().unwrap_or("nothing").to_owned();
        assert!(note.contains("set up again"), "loss {loss}: {note}");
        assert!(
            renderer.device().contains("GPU") || !renderer.device().starts_with("CPU"),
            "{}",
            renderer.device()
        );
        let got = renderer.film().unwrap();
        assert_eq!(
            got.layers, want.layers,
            "loss {loss} after {before} samples"
        );
    }
    // Lost between the last sample and the reading: what was not read is gathered again.
    let mut renderer = Renderer::new(&scene, &settings, Backend::Gpu).unwrap();
    renderer.step(settings.spp, &go).unwrap();
    renderer.lose_device();
    assert_eq!(renderer.film().unwrap().layers, want.layers);
    eprintln!("{} losses, the same picture each time", losses + 1);
}
