//! The rows that Rust writes lie where the shader reads them: naga's offsets against Rust's.

use std::mem::{offset_of, size_of};

use naga::{Module, TypeInner};
use woven_render::accumulate::PixelSum;
use woven_render::bvh::Packet;
use woven_render::gpu::{Fork, Frame, SECOND, SLOT, Traits, source};
use woven_render::table::{Globals, LightRow, MaterialRow, Shade, TextureRow};

/// Name, offset of each member, and the size of a struct of the shader.
fn layout(module: &Module, name: &str) -> (Vec<(String, u32)>, u32) {
    let found = module
        .types
        .iter()
        .find(|(_, t)| t.name.as_deref() == Some(name));
    match found.map(|(_, t)| &t.inner) {
        Some(TypeInner::Struct { members, span }) => (
            members
                .iter()
                .map(|m| (m.name.clone().unwrap_or_default(), m.offset))
                .collect(),
            *span,
        ),
        _ => panic!("the shader has no struct {name}"),
    }
}

macro_rules! same {
    ($module:expr, $t:ty, $($field:ident),+) => {{
        let ours = vec![$((stringify!($field).to_owned(), offset_of!($t, $field) as u32)),+];
        let name = stringify!($t);
        let (theirs, size) = layout($module, name);
        assert_eq!(theirs, ours, "{name}");
        assert_eq!(size as usize, size_of::<$t>(), "size of {name}");
    }};
}

fn valid(text: &str) -> Module {
    let module =
        naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)));
    let flags = naga::valid::ValidationFlags::all();
    naga::valid::Validator::new(flags, naga::valid::Capabilities::empty())
        .validate(&module)
        .unwrap_or_else(|e| panic!("{}", e.emit_to_string(text)));
    module
}

#[test]
fn every_shader_is_valid() {
    for textures in [false, true] {
        let all = Traits::all(textures);
        let none = Traits {
            textured: false,
            measures: false,
            lobes: false,
            clusters: false,
            skies: false,
            ..all
        };
        for traits in [all, none] {
            valid(&source(traits));
        }
        // Each is a constant of the shader's.
        assert_eq!(
            source(all).matches(": bool = true;").count(),
            source(none).matches(": bool = false;").count()
        );
        assert_eq!(source(none).matches(": bool = true;").count(), 0);
    }
}

#[test]
fn rows_lie_where_the_shader_reads_them() {
    let text = source(Traits::all(false));
    let module = valid(&text);
    let m = &module;
    assert_eq!(u64::from(layout(m, "Slot").1), SLOT, "size of Slot");
    assert_eq!(
        u64::from(layout(m, "SecondRow").1),
        SECOND,
        "size of SecondRow"
    );
    same!(m, Fork, corner, spread, lo, nodes, hi, packets);
    same!(m, Packet, v0, e1, e2, gap);
    same!(
        m, Shade, n0, n1, n2, weft, v, colors, material, light, mesh, triangle
    );
    same!(
        m,
        MaterialRow,
        linear,
        shape,
        weights,
        emission,
        metal,
        flags,
        layer,
        color_texture,
        coverage_texture,
        emission_texture,
        alpha_cutoff,
        gap,
        cover,
        normal_texture,
        normal_scale,
        measured,
        gloss_texture
    );
    same!(
        m, LightRow, p, kind, u, layer, v, place, n, area, radiance, parent
    );
    same!(
        m,
        Globals,
        sky_scale,
        lights,
        portals,
        sky_width,
        sky_height,
        sky_turn,
        portal_share,
        sky_light,
        sky_layer,
        soft_lights,
        offset,
        taps,
        others,
        tree,
        events,
        spare
    );
    same!(
        m, Frame, eye, aperture, right, focus, up, width, forward, height, lens_x, depth, lens_y,
        seed, index, left, above, block, globals
    );
    same!(m, PixelSum, direct, indirect, albedo, normal);
    // Texture rows are read by words: the shader's constant is Rust's size.
    assert!(text.contains(&format!(
        "const TEXTURE_ROW: u32 = {}u;",
        size_of::<TextureRow>() / 4
    )));
    assert!(text.contains("const SRGB: u32 = 256u;"));
    assert_eq!(
        (offset_of!(TextureRow, first), offset_of!(TextureRow, map_v)),
        (32, 16)
    );
}
