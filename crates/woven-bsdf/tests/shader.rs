//! The checked-in shader is the one that the Rust models print, and it is valid WGSL.

use woven_bsdf::shader;

#[test]
fn the_shader_is_current() {
    assert!(
        shader::generate() == shader::OPTICS,
        "src/shader/optics.wgsl is out of date: run `cargo run -p woven-bsdf --example print_shader`"
    );
}

#[test]
fn the_shader_is_valid() {
    let module = naga::front::wgsl::parse_str(shader::OPTICS)
        .unwrap_or_else(|e| panic!("{}", e.emit_to_string(shader::OPTICS)));
    let mut validator = naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        naga::valid::Capabilities::empty(),
    );
    validator.validate(&module).expect("the shader validates");
}
