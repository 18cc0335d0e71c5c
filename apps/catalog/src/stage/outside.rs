//! What is seen through the window and through open cloth: a lawn, a hedge, trees, hills far away.

use glam::Vec3;

use super::Builder;
use super::shape::{Shape, noise};

/// Height of the lawn below the floor [m].
const LAWN: f32 = -0.45;

/// Adds the garden; the window looks along -z.
pub(super) fn build(b: &mut Builder) {
    let grass = b.matt("grass", [0.13, 0.20, 0.06]);
    let terrace = b.matt("terrace", [0.48, 0.45, 0.40]);
    let hedge = b.leafy("hedge", [0.045, 0.095, 0.03], [0.02, 0.05, 0.01]);
    let crown = b.leafy("crown", [0.07, 0.14, 0.035], [0.05, 0.11, 0.02]);
    let bark = b.matt("bark", [0.13, 0.10, 0.075]);
    let hill = b.matt("hills", [0.20, 0.26, 0.20]);

    let ground = Shape::default().quad(
        Vec3::new(-150.0, LAWN, -220.0),
        Vec3::Z * 219.5,
        Vec3::X * 300.0,
    );
    b.add(ground.mesh("lawn", grass));
    b.add(
        Shape::default()
            .board(
                Vec3::new(-3.5, LAWN, -2.6),
                Vec3::new(3.5, LAWN + 0.05, -0.32),
            )
            .mesh("terrace", terrace),
    );

    let mut bushes = Shape::default();
    for k in 0..15 {
        let x = -13.0 + 1.85 * k as f32 + 0.4 * noise(61, k);
        let radii = Vec3::new(1.35, 0.95 + 0.35 * noise(62, k), 0.9);
        bushes = bushes.ball(
            Vec3::new(x, LAWN + 0.5, -11.5 - 0.8 * noise(63, k)),
            radii,
            0.10,
            100 + 7 * k,
        );
    }
    b.add(bushes.mesh("hedge", hedge));

    let (mut crowns, mut trunks) = (Shape::default(), Shape::default());
    for (k, (x, z, tall)) in (0..).zip([
        (-3.4, -14.5, 5.2),
        (2.3, -17.5, 6.4),
        (6.5, -15.0, 4.6),
        (-8.5, -19.0, 7.0),
        (-0.6, -26.0, 6.6),
    ]) {
        let foot = Vec3::new(x, LAWN, z);
        trunks = trunks.turned(foot, &[(0.20, 0.0), (0.12, tall * 0.7)], 10);
        for j in 0..4 {
            let i = k * 10 + j;
            let way = Vec3::new(
                noise(41, i) - 0.5,
                0.7 * (noise(42, i) - 0.4),
                noise(43, i) - 0.5,
            ) * tall
                * 0.42;
            crowns = crowns.ball(
                foot + Vec3::Y * tall * 0.72 + way,
                Vec3::splat(tall * (0.17 + 0.09 * noise(44, i))),
                0.16,
                300 + i,
            );
        }
    }
    b.add(crowns.mesh("crowns", crown));
    b.add(trunks.mesh("trunks", bark));

    let mut hills = Shape::default();
    for (k, (x, z, wide, tall)) in (0..).zip([
        (-70.0, -190.0, 90.0, 13.0),
        (30.0, -205.0, 110.0, 17.0),
        (110.0, -180.0, 70.0, 11.0),
    ]) {
        hills = hills.ball(
            Vec3::new(x, LAWN - 2.0, z),
            Vec3::new(wide, tall, 30.0),
            0.05,
            500 + k,
        );
    }
    b.add(hills.mesh("hills", hill));
}
