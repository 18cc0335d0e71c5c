//! The checked-in shader is the one that the Rust models print, and it is valid WGSL.

use woven_bsdf::model::MODELS;
use woven_bsdf::shader::{self, parity};

#[test]
fn the_shader_is_current() {
    assert!(
        shader::generate() == shader::OPTICS,
        "src/shader/optics.wgsl is out of date: run `cargo run -p woven-bsdf --example print_shader`"
    );
}

fn validate(text: &str) {
    let module =
        naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)));
    let mut validator = naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        naga::valid::Capabilities::empty(),
    );
    validator.validate(&module).expect("the shader validates");
}

#[test]
fn the_shader_is_valid() {
    validate(shader::OPTICS);
}

#[test]
fn the_kernels_are_valid() {
    for model in MODELS {
        validate(&parity::kernel(model));
        validate(&parity::timer(Some(model)));
    }
    validate(&parity::timer(None));
}
