//! Things that give the room its scale: an armchair on a rug, a side table with a vase, a plant, a lamp, a print on the wall.

use glam::{Quat, Vec3};
use woven_render::scene::TextureUse;

use super::room::ROOM;
use super::shape::{Shape, noise};
use super::{Builder, texture};

/// Foot of the floor lamp [m].
const LAMP: Vec3 = Vec3::new(1.50, 0.0, 0.62);

/// Adds the furniture; `lamp` is the radiance of the lamp shades, dark when the lamps are off, `far_window` that of a window
/// behind the eye.
pub(super) fn build(b: &mut Builder, lamp: [f32; 3], far_window: [f32; 3]) {
    armchair(b);
    side_table(b);
    plant(b);
    lamps(b, lamp);

    // The room's other window, behind the eye: soft light from where the viewer stands.
    let far = b.window("far window", far_window);
    let pane = Shape::default().quad(
        Vec3::new(1.75, 0.9, ROOM.1.z - 0.03),
        Vec3::X * -1.3,
        Vec3::Y * 1.3,
    );
    b.add(pane.mesh("far window", far));

    let weave = b.texture(texture::rug());
    // The rug's own coordinates are metres along z and x; one repeat is the whole rug.
    let (corner, long, wide) = (Vec3::new(-0.75, 0.012, 1.15), 1.9, 2.5);
    let rug = b.textured(
        "rug",
        [0.95; 3],
        TextureUse {
            texture: weave,
            transform: [[0.0, 1.0 / wide, 0.0], [1.0 / long, 0.0, 0.0]],
        },
    );
    b.add(
        Shape::default()
            .quad(corner, Vec3::Z * long, Vec3::X * wide)
            .mesh("rug", rug),
    );

    // A framed print on the right wall, facing -x; its quad runs towards the window and up.
    let picture = b.texture(texture::print());
    let (w, h) = (0.56, 0.70);
    let corner = Vec3::new(ROOM.1.x - 0.024, 1.22, 1.15);
    let paper = b.textured(
        "print",
        [1.0; 3],
        TextureUse {
            texture: picture,
            transform: [[1.0 / w, 0.0, 0.0], [0.0, -1.0 / h, 1.0]],
        },
    );
    b.add(
        Shape::default()
            .quad(corner, Vec3::Z * w, Vec3::Y * h)
            .mesh("print", paper),
    );
    let wood = b.matt("picture frame", [0.42, 0.29, 0.18]);
    let edge = Vec3::new(0.0, 0.022, 0.022);
    let frame = Shape::default().board(
        corner - edge + Vec3::X * 0.002,
        corner + Vec3::new(0.024, h, w) + edge,
    );
    b.add(frame.mesh("picture frame", wood));
}

fn armchair(b: &mut Builder) {
    let cloth = b.matt("armchair", [0.40, 0.45, 0.44]);
    let wood = b.matt("chair legs", [0.33, 0.21, 0.12]);
    let center = Vec3::new(1.02, 0.0, 1.62);
    let turn = (-0.62, center);
    let part = |shape: Shape, low: [f32; 3], high: [f32; 3], radius: f32| {
        shape.cushion(
            center + Vec3::from(low),
            center + Vec3::from(high),
            radius,
            turn,
        )
    };
    let mut shape = part(
        Shape::default(),
        [-0.36, 0.17, -0.36],
        [0.36, 0.33, 0.36],
        0.05,
    );
    shape = part(shape, [-0.27, 0.30, -0.28], [0.27, 0.46, 0.38], 0.06);
    shape = part(shape, [-0.36, 0.17, -0.40], [0.36, 0.86, -0.24], 0.07);
    shape = part(shape, [-0.27, 0.44, -0.27], [0.27, 0.82, -0.12], 0.07);
    shape = part(shape, [-0.40, 0.17, -0.38], [-0.26, 0.60, 0.36], 0.06);
    shape = part(shape, [0.26, 0.17, -0.38], [0.40, 0.60, 0.36], 0.06);
    b.add(shape.mesh("armchair", cloth));
    let mut legs = Shape::default();
    for (x, z) in [(-0.31, -0.31), (0.31, -0.31), (-0.31, 0.31), (0.31, 0.31)] {
        let foot = center + Quat::from_rotation_y(turn.0) * Vec3::new(x, 0.0, z);
        legs = legs.turned(foot, &[(0.013, 0.0), (0.024, 0.19)], 12);
    }
    b.add(legs.mesh("chair legs", wood));
    // A cushion that leans into the corner.
    let wool = b.matt("cushion", [0.66, 0.50, 0.33]);
    let pillow = part(
        Shape::default(),
        [-0.23, 0.45, -0.13],
        [0.13, 0.78, -0.02],
        0.052,
    );
    b.add(pillow.mesh("cushion", wool));
}

fn side_table(b: &mut Builder) {
    let wood = b.matt("table", [0.47, 0.33, 0.20]);
    let foot = Vec3::new(0.34, 0.0, 1.0);
    let top = 0.50;
    let mut shape = Shape::default().turned(
        foot + Vec3::Y * top,
        &[
            (0.0, 0.0),
            (0.225, 0.0),
            (0.235, 0.012),
            (0.225, 0.024),
            (0.0, 0.024),
        ],
        48,
    );
    for k in 0..3 {
        let out = Quat::from_rotation_y(k as f32 * 2.1 + 0.5) * Vec3::X;
        shape = shape.turned(foot + out * 0.14, &[(0.011, 0.0), (0.016, top)], 10);
    }
    b.add(shape.mesh("side table", wood));
    let clay = b.matt("vase", [0.72, 0.66, 0.58]);
    let profile = [
        (0.0, 0.0),
        (0.045, 0.0),
        (0.072, 0.045),
        (0.078, 0.085),
        (0.058, 0.135),
        (0.026, 0.17),
        (0.024, 0.20),
        (0.032, 0.212),
    ];
    b.add(
        Shape::default()
            .turned(foot + Vec3::new(0.02, top + 0.024, -0.02), &profile, 40)
            .mesh("vase", clay),
    );
}

fn plant(b: &mut Builder) {
    let pot = b.matt("pot", [0.52, 0.50, 0.47]);
    let green = b.leafy("leaves", [0.055, 0.13, 0.045], [0.05, 0.12, 0.02]);
    let foot = Vec3::new(-1.62, 0.0, 0.62);
    let profile = [
        (0.0, 0.0),
        (0.12, 0.0),
        (0.165, 0.30),
        (0.170, 0.335),
        (0.150, 0.335),
        (0.145, 0.29),
        (0.0, 0.29),
    ];
    b.add(Shape::default().turned(foot, &profile, 40).mesh("pot", pot));
    let mut leaves = Shape::default();
    for k in 0..26 {
        let angle = k as f32 * 2.399_963; // the golden angle spreads them evenly
        let reach = 0.16 + 0.34 * noise(31, k);
        let way = Quat::from_rotation_y(angle) * Vec3::X;
        let way = Vec3::new(way.x, 0.0, way.z.max(-0.9)) * reach;
        leaves = leaves.leaf(
            foot + Vec3::Y * 0.30 + way * 0.08,
            way,
            0.30 + 0.62 * noise(32, k),
            0.026 + 0.022 * noise(33, k),
        );
    }
    b.add(leaves.mesh("plant", green));
}

/// The floor lamp beside the window and a wide one on the wall behind the eye that fills the room. All shades are flat rectangles:
/// those are sampled by solid angle, which leaves hardly any noise.
fn lamps(b: &mut Builder, radiance: [f32; 3]) {
    let brass = b.matt("brass", [0.30, 0.21, 0.10]);
    let shade = b.lamp("lamp shade", radiance, [0.78, 0.74, 0.66]);
    let stand = [
        (0.0, 0.0),
        (0.15, 0.0),
        (0.15, 0.02),
        (0.011, 0.028),
        (0.011, 1.44),
        (0.0, 1.44),
    ];
    b.add(
        Shape::default()
            .turned(LAMP, &stand, 24)
            .mesh("lamp stand", brass),
    );
    let (half, low, high) = (0.145, 1.27, 1.55);
    let mut paper = Shape::default();
    for turn in 0..4 {
        let rotation = Quat::from_rotation_y(0.42 + turn as f32 * std::f32::consts::FRAC_PI_2);
        let corner = LAMP + Vec3::Y * low + rotation * Vec3::new(-half, 0.0, half);
        paper = paper.quad(
            corner,
            rotation * Vec3::X * (2.0 * half),
            Vec3::Y * (high - low),
        );
    }
    b.add(paper.mesh("floor lamp", shade));
    let wide = b.lamp("wall lamp", radiance.map(|c| c * 2.6), [0.78, 0.74, 0.66]);
    let panel = Shape::default().quad(
        Vec3::new(-0.35, 1.45, ROOM.1.z - 0.05),
        Vec3::X * -1.1,
        Vec3::Y * 0.6,
    );
    b.add(panel.mesh("wall lamp", wide));
}
