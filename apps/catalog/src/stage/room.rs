//! The house around the curtain: walls with the window opening, floor, ceiling, frame, sill, skirting, rail.

use glam::Vec3;
use woven_render::scene::{Portal, TextureUse};

use super::shape::Shape;
use super::{Builder, texture};

/// Inner sides of the room [m]: x to the right, y up, z from the window wall into the room.
pub const ROOM: (Vec3, Vec3) = (Vec3::new(-2.1, 0.0, 0.0), Vec3::new(2.1, 2.62, 4.6));
/// The opening in the window wall [m]: lower left and upper right corner, on the inner side of the wall.
pub const OPENING: (Vec3, Vec3) = (Vec3::new(-0.98, 0.42, 0.0), Vec3::new(0.98, 2.22, 0.0));
/// Thickness of the window wall [m].
pub const WALL: f32 = 0.30;
/// Height of the curtain rail [m].
pub const RAIL_HEIGHT: f32 = 2.40;
/// Distance of the rail, and of the curtain's middle plane, from the wall [m].
pub const RAIL_DISTANCE: f32 = 0.13;
/// Thickness of walls that nobody sees from the edge [m].
const SHELL: f32 = 0.1;

/// The light's way in: the whole opening, on the outer side of the wall, facing inwards.
#[must_use]
pub fn portal() -> Portal {
    let (low, high) = OPENING;
    Portal {
        corner: Vec3::new(low.x, low.y, -WALL),
        edge_u: Vec3::X * (high.x - low.x),
        edge_v: Vec3::Y * (high.y - low.y),
    }
}

/// Adds the room to the scene.
pub(super) fn build(b: &mut Builder) {
    let (min, max) = ROOM;
    let wall = b.matt("wall", [0.80, 0.775, 0.735]);
    let white = b.matt("white paint", [0.86, 0.855, 0.84]);
    let metal = b.matt("rail", [0.10, 0.095, 0.09]);
    let oak = b.texture(texture::oak());
    let floor = b.textured(
        "floor",
        [0.92; 3],
        TextureUse {
            texture: oak,
            transform: [[0.0, 1.0 / 1.2, 0.0], [1.0 / 2.4, 0.0, 0.0]],
        },
    );

    // Boards thicker than needed and overlapping at the corners: no ray finds a seam.
    let (low, high) = OPENING;
    let out = Vec3::splat(SHELL);
    let window_wall = Shape::default()
        .board(
            Vec3::new(min.x - SHELL, min.y - SHELL, -WALL),
            Vec3::new(low.x, max.y + SHELL, 0.0),
        )
        .board(
            Vec3::new(high.x, min.y - SHELL, -WALL),
            Vec3::new(max.x + SHELL, max.y + SHELL, 0.0),
        )
        .board(
            Vec3::new(low.x, min.y - SHELL, -WALL),
            Vec3::new(high.x, low.y, 0.0),
        )
        .board(
            Vec3::new(low.x, high.y, -WALL),
            Vec3::new(high.x, max.y + SHELL, 0.0),
        );
    let walls = window_wall
        .board(
            Vec3::new(min.x - SHELL, min.y - SHELL, 0.0),
            Vec3::new(min.x, max.y + SHELL, max.z + SHELL),
        )
        .board(Vec3::new(max.x, min.y - SHELL, 0.0), max + out)
        .board(Vec3::new(min.x, min.y - SHELL, max.z), max + out);
    b.add(walls.mesh("walls", wall));
    b.add(
        Shape::default()
            .board(Vec3::new(min.x, max.y, 0.0), max + Vec3::Y * SHELL)
            .mesh("ceiling", white),
    );
    let floor_quad =
        Shape::default().quad(min, Vec3::Z * (max.z - min.z), Vec3::X * (max.x - min.x));
    b.add(floor_quad.mesh("floor", floor));

    // Skirting along the three walls in sight.
    let (tall, deep) = (0.10, 0.016);
    let skirting = Shape::default()
        .board(Vec3::new(min.x, 0.0, 0.0), Vec3::new(max.x, tall, deep))
        .board(
            Vec3::new(min.x, 0.0, 0.0),
            Vec3::new(min.x + deep, tall, max.z),
        )
        .board(
            Vec3::new(max.x - deep, 0.0, 0.0),
            Vec3::new(max.x, tall, max.z),
        );
    b.add(skirting.mesh("skirting", white));

    b.add(window_frame().mesh("window", white));
    b.add(rail(min, max).mesh("rail", metal));
}

/// Casing on the wall, sill, and two sashes deep in the opening.
fn window_frame() -> Shape {
    let (low, high) = OPENING;
    let casing = 0.07;
    let mut shape = Shape::default()
        .board(
            Vec3::new(low.x - casing, low.y, 0.0),
            Vec3::new(low.x, high.y + casing, 0.022),
        )
        .board(
            Vec3::new(high.x, low.y, 0.0),
            Vec3::new(high.x + casing, high.y + casing, 0.022),
        )
        .board(
            Vec3::new(low.x, high.y, 0.0),
            Vec3::new(high.x, high.y + casing, 0.022),
        )
        .board(
            Vec3::new(low.x - 0.10, low.y - 0.035, -WALL),
            Vec3::new(high.x + 0.10, low.y, 0.055),
        );
    // Sashes: a frame each of 55 mm, a glazing bar across at two thirds of the height.
    let (back, front, bar) = (-0.21, -0.165, 0.055);
    let middle = (low.x + high.x) * 0.5;
    for (x0, x1) in [(low.x, middle), (middle, high.x)] {
        let cross = low.y + (high.y - low.y) * 0.68;
        shape = shape
            .board(
                Vec3::new(x0, low.y, back),
                Vec3::new(x0 + bar, high.y, front),
            )
            .board(
                Vec3::new(x1 - bar, low.y, back),
                Vec3::new(x1, high.y, front),
            )
            .board(
                Vec3::new(x0, low.y, back),
                Vec3::new(x1, low.y + bar * 1.3, front),
            )
            .board(
                Vec3::new(x0, high.y - bar, back),
                Vec3::new(x1, high.y, front),
            )
            .board(
                Vec3::new(x0, cross - 0.014, back + 0.01),
                Vec3::new(x1, cross + 0.014, front - 0.01),
            );
    }
    shape
}

/// A round rail with end knobs and two brackets.
fn rail(min: Vec3, max: Vec3) -> Shape {
    let (left, right) = (min.x.max(-1.42), max.x.min(1.42));
    let at = Vec3::new(0.0, RAIL_HEIGHT + 0.028, RAIL_DISTANCE);
    let mut shape = Shape::default();
    // The rod is an eight-sided prism: at this size nobody counts.
    let radius = 0.011;
    for k in 0..8 {
        let [a, b] = [k, k + 1].map(|i| (i as f32 / 8.0 * std::f32::consts::TAU).sin_cos());
        let [p, q] = [a, b].map(|(s, c)| at + Vec3::new(left, s * radius, c * radius));
        shape = shape.quad(p, Vec3::X * (right - left), q - p);
    }
    for x in [left, right] {
        shape = shape.ball(at + Vec3::X * x, Vec3::splat(0.024), 0.0, 0);
    }
    for x in [left + 0.12, right - 0.12] {
        shape = shape.board(
            at + Vec3::new(x - 0.008, -0.008, -RAIL_DISTANCE),
            at + Vec3::new(x + 0.008, 0.008, 0.0),
        );
    }
    shape
}
