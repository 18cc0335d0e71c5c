//! USD as text (`.usda`): one Mesh with time samples of points, for Blender, Houdini and usdview.

use crate::clip::CurtainClip;
use std::fmt::Write;

/// The clip as `.usda`. Numbers have nine digits, enough to give back every f32.
pub(crate) fn encode(clip: &CurtainClip) -> String {
    let (mesh, last) = (&clip.mesh, clip.frames.len().saturating_sub(1));
    let mut out = format!(
        "#usda 1.0\n(\n    defaultPrim = \"curtain\"\n    metersPerUnit = 1\n    upAxis = \"Y\"\n    startTimeCode = 0\n    endTimeCode = {last}\n    timeCodesPerSecond = {}\n    framesPerSecond = {}\n)\n\n",
        clip.fps, clip.fps
    );
    let faces = mesh.indices.len() / 3;
    let list = |out: &mut String, items: &mut dyn Iterator<Item = String>| {
        out.push('[');
        for (k, item) in items.enumerate() {
            if k > 0 {
                out.push_str(", ");
            }
            out.push_str(&item);
        }
        out.push(']');
    };
    let vectors = |out: &mut String, values: &[[f32; 3]]| {
        out.push('[');
        for (k, [x, y, z]) in values.iter().enumerate() {
            // Writing to a string cannot fail.
            let _ = write!(out, "{}({x}, {y}, {z})", if k > 0 { ", " } else { "" });
        }
        out.push(']');
    };
    out.push_str("def Mesh \"curtain\"\n{\n    uniform bool doubleSided = 1\n    uniform token subdivisionScheme = \"none\"\n    int[] faceVertexCounts = ");
    list(&mut out, &mut (0..faces).map(|_| "3".to_owned()));
    out.push_str("\n    int[] faceVertexIndices = ");
    list(&mut out, &mut mesh.indices.iter().map(ToString::to_string));
    out.push_str("\n    texCoord2f[] primvars:st = ");
    list(
        &mut out,
        &mut mesh.uvs.iter().map(|[u, v]| format!("({u}, {v})")),
    );
    out.push_str(" (\n        interpolation = \"vertex\"\n    )\n    point3f[] points = ");
    vectors(&mut out, &mesh.positions);
    for (name, pick) in [("point3f[] points", 0), ("vector3f[] velocities", 1)] {
        if clip.frames.is_empty() {
            continue;
        }
        let _ = write!(out, "\n    {name}.timeSamples = {{");
        for (k, frame) in clip.frames.iter().enumerate() {
            let _ = write!(out, "\n        {k}: ");
            vectors(
                &mut out,
                if pick == 0 {
                    &frame.positions
                } else {
                    &frame.velocities
                },
            );
            out.push(',');
        }
        out.push_str("\n    }");
    }
    out.push_str("\n}\n");
    out
}
