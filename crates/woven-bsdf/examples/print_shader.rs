//! Writes `src/shader/optics.wgsl` anew from the Rust models. Run after changing a model.

fn main() -> std::io::Result<()> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/src/shader/optics.wgsl");
    let text = woven_bsdf::shader::generate();
    std::fs::write(path, &text)?;
    println!("{} lines written to {path}", text.lines().count());
    Ok(())
}
