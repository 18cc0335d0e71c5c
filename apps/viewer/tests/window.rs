//! The window without a screen: every widget is found by its name, and what it does is seen in the state.

use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use egui::accesskit::Role;
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use woven_bsdf::model::{MODELS, find};
use woven_render::film::Film;
use woven_viewer::app::{LookPainter, Options, Viewer};
use woven_viewer::cloth::Cloth;
use woven_viewer::painter::Look;
use woven_viewer::worker::Painter;

/// Paints the diffuse transmission of the curtain it is given: enough to see that a change arrives.
struct Flat(f32);

impl Painter for Flat {
    type Scene = Look;
    fn prepare(&mut self, look: &Look) -> Result<(), String> {
        assert!(
            !look.curtain.indices.is_empty(),
            "there is a curtain before there is a picture"
        );
        self.0 = look.cloth.linear[0][1] as f32;
        Ok(())
    }
    fn pass(
        &mut self,
        size: [usize; 2],
        _pass: u32,
        _stop: &AtomicBool,
    ) -> Result<Option<Film>, String> {
        Ok(Some(Film::of_beauty(
            size[0],
            size[1],
            vec![[self.0; 3]; size[0] * size[1]],
        )))
    }
    fn backend(&self) -> String {
        "flat".to_owned()
    }
}

/// A small curtain that is simulated in no time.
fn curtain() -> woven_cloth::CurtainSpec {
    "width = 1.0\nheight = 1.0\npleats = 3\ncolumns = 19\nrows = 11\nframes = 3\nsettle = 0.1\n"
        .parse()
        .expect("the description is sound")
}

fn window(options: Options) -> Harness<'static, Viewer> {
    let mut ready: Option<Viewer> = None;
    let ctx = egui::Context::default();
    let painter = || -> LookPainter { Box::new(Flat(0.0)) };
    ready.get_or_insert_with(|| Viewer::new(&ctx, options, painter, Ok(curtain())));
    let viewer = ready.take().expect("just made");
    Harness::builder()
        .with_size([1400.0, 1000.0])
        .build_ui_state(|ui, viewer: &mut Viewer| viewer.show(ui), viewer)
}

fn quick() -> Options {
    Options {
        passes: 2,
        ..Options::default()
    }
}

/// Steps the window until `until` holds.
fn wait(window: &mut Harness<'static, Viewer>, until: impl Fn(&Viewer) -> bool) {
    let begin = Instant::now();
    while !until(window.state()) {
        // Ten times what is needed on a busy machine.
        assert!(
            begin.elapsed() < Duration::from_secs(30),
            "it did not come about"
        );
        window.step();
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Waits until the curtain hangs still and all samples are there.
fn settle(window: &mut Harness<'static, Viewer>) {
    for _ in 0..3 {
        wait(window, Viewer::finished);
        for _ in 0..10 {
            window.step();
            std::thread::sleep(Duration::from_millis(5));
        }
    }
    wait(window, Viewer::finished);
}

#[test]
fn every_parameter_of_every_model_has_a_slider_that_restarts_the_picture() {
    let mut window = window(quick());
    settle(&mut window);
    for model in MODELS {
        window.state_mut().choose_model(model);
        window.step();
        settle(&mut window);
        for (index, param) in model.params.iter().enumerate() {
            let before = window.state().wishes();
            let value = 0.4 * param.min + 0.6 * param.max;
            window
                .get_by_role_and_label(Role::Slider, param.name)
                .set_value_accesskit(value);
            wait(&mut window, |v| v.wishes() > before);
            let now = window.state().cloth().values[index];
            // Sliders round to four digits behind the point.
            assert!(
                (now - value).abs() < 1e-3 * value.max(1.0),
                "{} {}: {now} instead of {value}",
                model.name,
                param.name
            );
            wait(&mut window, Viewer::finished);
        }
    }
}

#[test]
fn the_picture_follows_the_slider() {
    let mut window = window(quick());
    settle(&mut window);
    // The painter shows the green channel, and the linen is a little yellow.
    let green = window.state().cloth().colors[0][1];
    for value in [0.1, 0.3] {
        window
            .get_by_role_and_label(Role::Slider, "t_d")
            .set_value_accesskit(value);
        let shown = |v: &Viewer| v.picture().map_or(0.0, |p| f64::from(p.pixel(0)[0]));
        wait(&mut window, |v| {
            v.finished() && (shown(v) - value * green).abs() < 1e-6
        });
    }
}

#[test]
fn reset_puts_the_sliders_back() {
    let mut window = window(quick());
    settle(&mut window);
    let start = window.state().cloth().values.clone();
    window
        .get_by_role_and_label(Role::Slider, "r_d")
        .set_value_accesskit(0.05);
    wait(&mut window, |v| v.cloth().values != start);
    window.get_by_label("Reset all").click();
    wait(&mut window, |v| v.cloth().values == start);
}

#[test]
fn looking_at_a_fabric_does_not_change_it() {
    let folder = std::env::temp_dir().join(format!("woven-viewer-look-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("there is room");
    let path = folder.join("odd.toml");
    let text = "name = \"odd\"\n[optics]\nmodel = \"sheet\"\nparameters = { t_d = 0.123456789, gamma_warp = 0.7654321 }\n";
    std::fs::write(&path, text).expect("there is room");
    let mut window = window(Options {
        fabrics: vec![path],
        ..quick()
    });
    settle(&mut window);
    assert_eq!(window.state().cloth().values[0], 0.123456789);
    assert!(!window.state().cloth().changed());
    std::fs::remove_dir_all(&folder).ok();
}

#[test]
fn light_and_wind_restart_the_picture() {
    let mut window = window(quick());
    settle(&mut window);
    for button in ["Evening", "Day", "Wind"] {
        let before = window.state().wishes();
        window.get_by_label(button).click();
        wait(&mut window, |v| v.wishes() > before);
    }
    // The curtain goes on moving of itself.
    let before = window.state().wishes();
    wait(&mut window, |v| v.wishes() > before + 3);
}

#[test]
fn a_bad_file_is_a_sentence_in_the_window() {
    let folder = std::env::temp_dir().join(format!("woven-viewer-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("there is room");
    let cut = folder.join("cut.xml");
    std::fs::write(&cut, "<?xml version=\"1.0\"?><WindowElement><Optical>").expect("there is room");
    let unknown = folder.join("unknown.toml");
    std::fs::write(&unknown, "name = \"x\"\n[optics]\nmodel = \"velvet\"\n")
        .expect("there is room");
    let options = Options {
        fabrics: vec![unknown.clone()],
        measurement: Some(cut.clone()),
        ..quick()
    };
    let mut window = window(options);
    window.step();
    let told: Vec<_> = window
        .state()
        .messages()
        .iter()
        .map(|m| m.text.clone())
        .collect();
    assert!(told.iter().any(|t| t.contains("velvet")), "{told:?}");
    assert!(
        told.iter()
            .any(|t| t.contains("cut.xml") && t.contains("XML")),
        "{told:?}"
    );
    assert!(window.query_by_label_contains("velvet").is_some());
    assert_eq!(window.state().cloth().model.name, "sheet");
    std::fs::remove_dir_all(&folder).ok();
}

#[test]
fn a_measurement_lies_over_the_plot() {
    let file = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../assets/measurements/satine_5500_white_pearl.xml"
    );
    let mut window = window(Options {
        measurement: Some(file.into()),
        ..quick()
    });
    window.step();
    assert!(window.state().measurement().is_some());
    // Of the model and of the measurement.
    assert_eq!(window.query_all_by_label_contains("transmits").count(), 2);
}

#[test]
fn what_is_saved_is_opened_again() {
    let folder = std::env::temp_dir().join(format!("woven-viewer-save-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("there is room");
    let mut window = window(quick());
    settle(&mut window);
    window
        .get_by_role_and_label(Role::Slider, "gamma_warp")
        .set_value_accesskit(0.5);
    let sheet = find("sheet").expect("it is in the list");
    let place = sheet.params.iter().position(|p| p.name == "gamma_warp");
    let place = place.expect("the sheet has a weave");
    wait(&mut window, |v| v.cloth().values[place] == 0.5);
    let path = folder.join("mine.toml");
    window.state_mut().save_fabric(&path);
    let back = Cloth::open(&path).expect("its own files are read");
    assert_eq!(back.values, window.state().cloth().values);
    assert_eq!((back.name(), back.model.name), ("mine", sheet.name));

    wait(&mut window, Viewer::finished);
    let picture = folder.join("mine.png");
    window.state_mut().save_picture(&picture);
    wait(&mut window, |v| {
        v.messages().iter().any(|m| m.text.contains("mine.png"))
    });
    assert!(std::fs::read(&picture).is_ok_and(|b| b.starts_with(b"\x89PNG")));

    window
        .state_mut()
        .save_fabric(&folder.join("no/such/folder/x.toml"));
    assert!(
        window
            .state()
            .messages()
            .last()
            .is_some_and(|m| m.wrong && m.text.contains("no/such/folder"))
    );
    std::fs::remove_dir_all(&folder).ok();
}

#[test]
fn keys_do_what_the_buttons_do() {
    let mut window = window(quick());
    settle(&mut window);
    window.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::M);
    window.step();
    window.step();
    assert!(window.query_by_label("Open a measurement").is_some());
    window.key_press(egui::Key::Escape);
    window.step();
    window.step();
    assert!(window.query_by_label("Open a measurement").is_none());
    let before = window.state().eye();
    window.key_press(egui::Key::ArrowLeft);
    wait(&mut window, |v| v.eye() != before);
    let wishes = window.state().wishes();
    window.key_press(egui::Key::E);
    wait(&mut window, |v| v.wishes() > wishes);
}

#[test]
fn dragging_turns_and_home_brings_back() {
    let mut window = window(quick());
    settle(&mut window);
    let before = window.state().eye();
    let middle = egui::pos2(500.0, 500.0);
    window.drag_at(middle);
    window.step();
    window.hover_at(middle + egui::vec2(120.0, 10.0));
    window.step();
    window.drop_at(middle + egui::vec2(120.0, 10.0));
    wait(&mut window, |v| v.eye().distance(before) > 0.1);
    window.get_by_label("Home").click();
    wait(&mut window, |v| v.eye() == before);
}
