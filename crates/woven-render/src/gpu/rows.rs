//! The shader's rows in textures instead of storage buffers: the same text, rewritten.
//!
//! lavapipe reads a storage buffer lane by lane and number by number, with a test of bounds each, but a texel for eight
//! lanes at once (Mesa 22.3: a tenth of the time for 16 bytes at a place of each lane's own, docs/benchmarks.md). On
//! hardware both are loads, and the buffers stay.

use std::fmt::Write;

/// Texels in a line of a texture; a power of two.
pub(super) const COLUMNS: u32 = 4096;

/// A member of a row: its name, its type, its place in bytes.
struct Member<'a> {
    name: &'a str,
    kind: &'a str,
    at: u32,
}

/// A type's alignment and size in bytes (WGSL, "Alignment and Size"), of those that rows are made of.
fn measure(kind: &str) -> (u32, u32) {
    if let Some(inner) = kind
        .strip_prefix("array<")
        .and_then(|k| k.strip_suffix('>'))
    {
        let (element, count) = inner.rsplit_once(',').unwrap_or((inner, "1"));
        let (align, size) = measure(element);
        return (align, size * count.trim().parse().unwrap_or(1));
    }
    match kind.get(..4) {
        Some("vec2") => (8, 8),
        Some("vec3") => (16, 12),
        Some("vec4") => (16, 16),
        _ => (4, 4),
    }
}

/// The members of struct `name` and its size in texels.
fn members<'a>(text: &'a str, name: &str) -> Option<(Vec<Member<'a>>, u32)> {
    let (_, body) = text.split_once(&format!("struct {name} {{"))?;
    let (body, _) = body.split_once('}')?;
    let mut end = 0_u32;
    let mut found = Vec::new();
    for line in body.lines().map(str::trim) {
        let Some((name, kind)) = line
            .strip_suffix(',')
            .and_then(|l| l.split_once(':'))
            .filter(|_| !line.starts_with("//"))
        else {
            continue;
        };
        let kind = kind.trim();
        let (align, size) = measure(kind);
        let at = end.next_multiple_of(align);
        found.push(Member { name, kind, at });
        end = at + size;
    }
    Some((found, end.div_ceil(16)))
}

/// What reads a member: a function of the row's number, and of the place in the member if that is an array.
fn reader(out: &mut String, array: &str, member: &Member, texels: u32) {
    let Member { name, kind, at } = member;
    let texel = at / 16;
    let (element, parameter, more) = match kind.strip_prefix("array<") {
        Some(inner) => (
            inner.rsplit_once(',').map_or(inner, |(e, _)| e),
            ", k: u32",
            " + k",
        ),
        None => (*kind, "", ""),
    };
    let part = match measure(element).1 {
        16 => "",
        12 => ".xyz",
        _ => [".x", ".y", ".z", ".w"][(at % 16 / 4) as usize],
    };
    // Errors of writing to a string there are none.
    let _ok = write!(
        out,
        "fn {array}_{name}(i: u32{parameter}) -> {element} {{\n    \
         return bitcast<{element}>({array}_texel(i * {texels}u + {texel}u{more}){part});\n}}\n"
    );
}

/// A storage array that becomes a texture, and its members by name with whether they are arrays.
struct Array<'a> {
    name: &'a str,
    members: Vec<Member<'a>>,
}

/// The shader with its arrays that are only read in textures, and the frame's numbers copied once.
pub(super) fn in_textures(text: &str) -> String {
    let mut arrays = Vec::new();
    let mut out = String::new();
    let mut readers = String::new();
    for line in text.lines() {
        let declared = line
            .split_once("var<storage, read> ")
            .and_then(|(binding, rest)| Some((binding, rest.strip_suffix(';')?.split_once(": ")?)));
        match declared {
            // The numbers of the frame are asked for everywhere: to read them in a loop is to read them for each lane.
            Some((binding, (name, "Frame"))) => {
                out += &format!(
                    "{binding}var<storage, read> {name}_given: Frame;\nvar<private> {name}: Frame;\n"
                );
            }
            Some((binding, (name, kind))) => {
                let row = kind.trim_start_matches("array<").trim_end_matches('>');
                out += &format!("{binding}var {name}_texture: texture_2d<u32>;\n");
                readers += &format!(
                    "fn {name}_texel(i: u32) -> vec4<u32> {{\n    \
                     return textureLoad({name}_texture, vec2<u32>(i % {COLUMNS}u, i / {COLUMNS}u), 0);\n}}\n"
                );
                let mut members_of = Vec::new();
                if let Some((found, texels)) = members(text, row) {
                    for member in &found {
                        reader(&mut readers, name, member, texels);
                    }
                    members_of = found;
                } else if row == "u32" {
                    readers += &format!(
                        "fn {name}_at(i: u32) -> u32 {{\n    return {name}_texel(i).x;\n}}\n"
                    );
                } else {
                    readers += &format!(
                        "fn {name}_at(i: u32) -> vec4<f32> {{\n    return bitcast<vec4<f32>>({name}_texel(i));\n}}\n"
                    );
                }
                arrays.push(Array {
                    name,
                    members: members_of,
                });
            }
            None => {
                out += line;
                out.push('\n');
                if line.starts_with("fn ") && entry(&out) {
                    out += "    frame = frame_given;\n";
                }
            }
        }
    }
    readers.insert(0, '\n');
    rewritten(&out, &arrays) + &readers
}

/// The function whose first line ends `text` is an entry point.
fn entry(text: &str) -> bool {
    text.lines()
        .rev()
        .nth(1)
        .is_some_and(|l| l.starts_with("@compute"))
}

/// What is in the brackets that `text` begins with, and what follows them.
fn bracketed(text: &str) -> Option<(&str, &str)> {
    let mut depth = 0;
    for (i, c) in text.char_indices() {
        match c {
            '[' => depth += 1,
            ']' if depth == 1 => return Some((&text[1..i], &text[i + 1..])),
            ']' => depth -= 1,
            _ if depth == 0 => return None,
            _ => {}
        }
    }
    None
}

/// `text` with calls of the readers where it reads the arrays.
fn rewritten(text: &str, arrays: &[Array]) -> String {
    let part_of_name = |c: char| c.is_alphanumeric() || c == '_';
    let mut out = String::new();
    let mut rest = text;
    while !rest.is_empty() {
        let name = rest.split(|c| !part_of_name(c)).next().unwrap_or("");
        if name.is_empty() {
            let c = rest.chars().next().unwrap_or(' ');
            out.push(c);
            rest = &rest[c.len_utf8()..];
            continue;
        }
        let after = &rest[name.len()..];
        let found = arrays
            .iter()
            .find(|a| a.name == name && !out.ends_with('.'));
        if let Some((call, after)) = found.and_then(|a| call(a, after, arrays)) {
            out += &call;
            rest = after;
        } else {
            out += name;
            rest = after;
        }
    }
    out
}

/// The call that stands for `array[…]`, `array[…].member` or `array[…].member[…]`, and the text after it.
fn call<'a>(array: &Array, after: &'a str, arrays: &[Array]) -> Option<(String, &'a str)> {
    let (index, after) = bracketed(after)?;
    let index = rewritten(index, arrays);
    if array.members.is_empty() {
        return Some((format!("{}_at({index})", array.name), after));
    }
    let member = array.members.iter().find(|m| {
        after
            .strip_prefix('.')
            .and_then(|a| a.strip_prefix(m.name))
            .is_some_and(|a| !a.starts_with(|c: char| c.is_alphanumeric() || c == '_'))
    })?;
    let after = &after[1 + member.name.len()..];
    let name = format!("{}_{}", array.name, member.name);
    if !member.kind.starts_with("array<") {
        return Some((format!("{name}({index})"), after));
    }
    let (place, after) = bracketed(after)?;
    Some((
        format!("{name}({index}, u32({}))", rewritten(place, arrays)),
        after,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_become_textures() {
        let text = "struct Row {\n    p: vec3<f32>,\n    // A word.\n    kind: u32,\n    boxes: array<vec4<f32>, 3>,\n    \
                    flags: u32,\n}\n\
                    @group(0) @binding(0) var<storage, read> frame: Frame;\n\
                    @group(0) @binding(1) var<storage, read> rows: array<Row>;\n\
                    @group(0) @binding(2) var<storage, read> words: array<u32>;\n\
                    @group(0) @binding(3) var<storage, read_write> out: array<u32>;\n\
                    @compute @workgroup_size(64, 1, 1)\nfn main() {\n    \
                    out[0] = rows[words[2u]].kind + rows[i + 1u].flags + other.rows[3];\n    \
                    let a = rows[i].boxes[k + rows[j].kind].x;\n}\n";
        let made = in_textures(text);
        for wanted in [
            "@binding(0) var<storage, read> frame_given: Frame;\nvar<private> frame: Frame;\n",
            "@binding(1) var rows_texture: texture_2d<u32>;\n",
            "@binding(3) var<storage, read_write> out: array<u32>;\n",
            "fn main() {\n    frame = frame_given;\n",
            "out[0] = rows_kind(words_at(2u)) + rows_flags(i + 1u) + other.rows[3];",
            "let a = rows_boxes(i, u32(k + rows_kind(j))).x;",
            // Five texels a row: the place with the kind, three of the boxes, the flags.
            "fn rows_p(i: u32) -> vec3<f32> {\n    return bitcast<vec3<f32>>(rows_texel(i * 5u + 0u).xyz);\n}",
            "fn rows_kind(i: u32) -> u32 {\n    return bitcast<u32>(rows_texel(i * 5u + 0u).w);\n}",
            "fn rows_boxes(i: u32, k: u32) -> vec4<f32> {\n    return bitcast<vec4<f32>>(rows_texel(i * 5u + 1u + k));\n}",
            "fn rows_flags(i: u32) -> u32 {\n    return bitcast<u32>(rows_texel(i * 5u + 4u).x);\n}",
        ] {
            assert!(made.contains(wanted), "{wanted}\nis not in\n{made}");
        }
    }
}
