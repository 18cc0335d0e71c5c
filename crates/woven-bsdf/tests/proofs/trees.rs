//! Tensor trees: branches against grids, the square of the disc, cut files, and as Klems matrices.

use crate::made::tree as file;
use crate::support::Rng;
use std::f64::consts::PI;
use std::fmt::Write;
use woven_bsdf::measured::klems::Klems;
use woven_bsdf::measured::tensor_tree::{TensorTree, square};
use woven_bsdf::vec3::Vec3;

/// A full grid of side 2^log2, the first coordinate slowest, of `f` at the centres of the cells.
fn grid(rank: usize, log2: u32, f: &dyn Fn(&[f64]) -> f64) -> String {
    let side = 1usize << log2;
    let mut out = "{".to_owned();
    for i in 0..side.pow(rank as u32) {
        let p: Vec<f64> = (0..rank)
            .map(|d| (i / side.pow((rank - 1 - d) as u32) % side) as f64 + 0.5)
            .map(|x| x / side as f64)
            .collect();
        write!(out, " {}", f(&p)).unwrap();
    }
    out + "}"
}

/// The same cells as branches down to single values.
fn branches(rank: usize, log2: u32, at: &[f64], size: f64, f: &dyn Fn(&[f64]) -> f64) -> String {
    if log2 == 0 {
        let centre: Vec<f64> = at.iter().map(|x| x + 0.5 * size).collect();
        return format!("{{ {} }}", f(&centre));
    }
    let children = (0..1usize << rank).map(|n| {
        let corner: Vec<f64> = (0..rank)
            .map(|d| at[d] + if n >> d & 1 == 1 { 0.5 * size } else { 0.0 })
            .collect();
        branches(rank, log2 - 1, &corner, 0.5 * size, f)
    });
    format!("{{ {} }}", children.collect::<Vec<_>>().join(", "))
}

#[test]
fn the_square_keeps_areas_and_axes() {
    for (x, y, a, b) in [
        (0.0, 0.0, 0.5, 0.5),
        (1.0, 0.0, 1.0, 0.5),
        (0.0, 1.0, 0.5, 1.0),
        (-1.0, 0.0, 0.0, 0.5),
        (0.0, -1.0, 0.5, 0.0),
        (0.5f64.sqrt(), 0.5f64.sqrt(), 1.0, 1.0),
        (-(0.5f64.sqrt()), 0.5f64.sqrt(), 0.0, 1.0),
        (0.5f64.sqrt(), -(0.5f64.sqrt()), 1.0, 0.0),
    ] {
        let (p, q) = square(x, y);
        assert!(
            (p - a).abs() < 1e-12 && (q - b).abs() < 1e-12,
            "({x}, {y}) → ({p}, {q})"
        );
    }
    let mut rng = Rng::new(121);
    for _ in 0..1000 {
        let (r, phi) = ((0.05 + 0.9 * rng.unit()).sqrt(), 7.0 * rng.unit());
        let (x, y) = (r * phi.cos(), r * phi.sin());
        // On the diagonals the map has a kink.
        if ((phi / (PI / 4.0)).rem_euclid(2.0) - 1.0).abs() < 1e-3 {
            continue;
        }
        let h = 1e-6;
        let ((ax, bx), (cx, dx)) = (square(x + h, y), square(x - h, y));
        let ((ay, by), (cy, dy)) = (square(x, y + h), square(x, y - h));
        let area = ((ax - cx) * (by - dy) - (ay - cy) * (bx - dx)) / (4.0 * h * h);
        assert!((area * PI - 1.0).abs() < 1e-4, "{area} at {r} {phi}");
    }
}

#[test]
fn branches_and_grids_are_the_same_tree() {
    let f = |p: &[f64]| {
        p.iter()
            .zip([1.0, 10.0, 100.0, 1000.0])
            .map(|(x, k)| x * k)
            .sum()
    };
    let mut rng = Rng::new(122);
    for rank in [3, 4] {
        let [a, b] = [
            grid(rank, 2, &f),
            branches(rank, 2, &[0.0; 4][..rank], 1.0, &f),
        ]
        .map(|t| TensorTree::parse(&file(rank, "Transmission Front", &t)).unwrap());
        for _ in 0..2000 {
            let (l, v) = (rng.direction(0.0), rng.direction(0.0));
            let (x, y) = (a.eval("Visible", l, v), b.eval("Visible", l, v));
            assert_eq!(x, y);
            if l.z > 0.0 && v.z < 0.0 {
                // By hand: the cell's centre.
                let (i, j) = if rank == 4 {
                    (square(-l.x, -l.y), square(v.x, v.y))
                } else {
                    let r = l.x.hypot(l.y);
                    let turn = (-l.y).atan2(-l.x);
                    let (s, c) = turn.sin_cos();
                    (
                        (0.5 - 0.5 * r, 0.0),
                        square(v.x * c + v.y * s, v.y * c - v.x * s),
                    )
                };
                let p = if rank == 4 {
                    vec![i.0, i.1, j.0, j.1]
                } else {
                    vec![i.0, j.0, j.1]
                };
                let centre: Vec<f64> = p.iter().map(|x| ((x * 4.0).floor() + 0.5) / 4.0).collect();
                assert!((x - f(&centre)).abs() < 1e-3, "{x} at {p:?}");
            } else {
                assert_eq!(x, 0.0, "the file has one side only");
            }
        }
    }
}

#[test]
fn trees_become_matrices() {
    // An isotropic cloth whose transmittance is its cosine, evenly spread: the light's place is ½ - ½ sinθ.
    let even = |p: &[f64]| (1.0 - (1.0 - 2.0 * p[0]).powi(2)).max(0.0).sqrt() / PI;
    let text = file(3, "Transmission Back", &grid(3, 5, &even));
    let klems = Klems::parse(&text).unwrap();
    let block = &klems.blocks[0];
    assert_eq!(
        (klems.patches.len(), block.kind.name()),
        (145, "Transmission Back")
    );
    for i in 0..129 {
        let (got, wanted) = (klems.directional(block, i), klems.patches[i].theta().cos());
        // 32 cells over the diameter: a cell is 3.6° at the centre, more outside.
        assert!((got - wanted).abs() < 0.03, "{i}: {got} {wanted}");
    }
    // A peak far narrower than a patch keeps its light: one cell in 64 x 64 at the normal.
    let peak = |p: &[f64]| {
        if p.iter().all(|x| (x - 0.5).abs() < 0.0157) {
            100.0
        } else {
            0.0
        }
    };
    let tree = TensorTree::parse(&file(4, "Transmission Front", &branches_to(6, &peak))).unwrap();
    assert_eq!(
        tree.eval(
            "Visible",
            Vec3::new(0.0, 0.0, 1.0),
            Vec3::new(0.0, 0.0, -1.0)
        ),
        100.0
    );
    let klems = tree.to_klems();
    let inside = 2.0f64.powi(2) / 64.0f64.powi(2);
    let omega = klems.patches[0].projected_solid_angle() / PI;
    let (got, wanted) = (klems.blocks[0].values[0], 100.0 * (inside / omega).powi(2));
    // 64 × 256 points see the eighth of the patch that the cell is, on either side, to some per cent.
    assert!(
        (got / wanted - 1.0).abs() < 0.15,
        "{got} instead of {wanted}"
    );
}

/// A rank-4 tree that is fine only where `f` is not 0.
fn branches_to(log2: u32, f: &dyn Fn(&[f64]) -> f64) -> String {
    fn cell(at: [f64; 4], size: f64, log2: u32, f: &dyn Fn(&[f64]) -> f64) -> String {
        let near = at
            .iter()
            .all(|x| (x - 0.5).abs() < 1e-9 || (x + size - 0.5).abs() < 1e-9 || size > 0.6);
        if log2 == 0 || !near {
            return format!("{{{}}}", f(&at.map(|x| x + 0.5 * size)));
        }
        let children = (0..16).map(|n| {
            let half = 0.5 * size;
            cell(
                std::array::from_fn(|d| at[d] + if n >> d & 1 == 1 { half } else { 0.0 }),
                half,
                log2 - 1,
                f,
            )
        });
        format!("{{{}}}", children.collect::<Vec<_>>().concat())
    }
    cell([0.0; 4], 1.0, log2, f)
}

#[test]
fn damaged_trees_get_a_sentence() {
    let tower = "{".repeat(100_000);
    for (rank, tree, needle) in [
        (4, "", "'{'"),
        (4, "{", "'}'"),
        (4, "{1 2 3}", "3 values"),
        (4, "{1", "cut off"),
        (3, "{1 x}", "\"x\""),
        (3, "{nan}", "nan"),
        (3, "{1} 2", "left behind"),
        (3, "{{1}{1}}", "expected '{'"),
        (4, "{{1}2{1}}", "expected '{'"),
        (4, tower.as_str(), "levels deep"),
    ] {
        let e = TensorTree::parse(&file(rank, "Transmission Front", tree))
            .unwrap_err()
            .to_string();
        assert!(e.contains(needle), "{e:?} lacks {needle:?}");
    }
    let sound = file(3, "Transmission Front", "{1}");
    for (from, to, needle) in [
        ("Tree3", "Tree5", "TensorTree5"),
        ("Shirley-Chiu", "Klems Full", "Klems Full"),
        ("Transmission Front", "Sideways", "Sideways"),
        ("WavelengthDataBlock", "Block", "no scattering data"),
    ] {
        let e = TensorTree::parse(&sound.replace(from, to))
            .unwrap_err()
            .to_string();
        assert!(e.contains(needle), "{e:?} lacks {needle:?}");
    }
}
