//! FLIP against the numbers that its authors' own program gives for the same two pictures; `files_flip.py` made them.

use woven_render::compare::flip;

const W: usize = 64;
const H: usize = 48;

/// The same formula as in `files_flip.py`, in f64 and rounded to f32 at the end as there.
fn pattern(k: u64, spoiled: bool, power: bool) -> Vec<[f32; 3]> {
    let mut out = Vec::new();
    for y in 0..H {
        for x in 0..W {
            let pixel = [0_u64, 1, 2].map(|c| {
                let (xi, yi) = (x as u64, y as u64);
                let stripes = ((xi * (3 + c) + yi * 5) / 9 % 7) as f64 / 7.0;
                let block = if (xi / 11 + yi / 13) % 3 == 0 {
                    1.0
                } else {
                    0.4
                };
                let grain = ((xi * 7919 + yi * 104_729 + c * 1_299_709 + k * 15_485_863) % 101)
                    as f64
                    / 101.0;
                let mut v = stripes * block * 0.8 + grain * 0.2 * (k + 1) as f64 / 2.0;
                if spoiled && c == 0 && (20..28).contains(&y) && (30..44).contains(&x) {
                    v *= 0.5;
                }
                (if power { 12.0 * v * v * v } else { v }) as f32
            });
            out.push(pixel);
        }
    }
    out
}

fn check(map: &[f32], mean: f64, at: [(usize, usize, f64); 4]) {
    // Their program works in f32, ours in f64: worst difference seen 4.1e-6; five times that is allowed.
    let tolerance = 2e-5;
    let ours = map.iter().map(|&v| f64::from(v)).sum::<f64>() / map.len() as f64;
    for (x, y, want) in at {
        let got = f64::from(map[y * W + x]);
        assert!(
            (got - want).abs() < tolerance,
            "({x}, {y}): {got}, the authors' program gives {want}"
        );
    }
    assert!(
        (ours - mean).abs() < tolerance,
        "mean {ours}, the authors' program gives {mean}"
    );
}

#[test]
fn ldr_flip_is_that_of_the_authors() {
    let (test, reference) = (pattern(1, true, false), pattern(0, false, false));
    let map = flip::ldr(&test, &reference, W, H, flip::DEFAULT_PPD);
    check(
        &map,
        0.210_897_311_568_260_2,
        [
            (0, 0, 0.500_037),
            (36, 24, 0.351_701),
            (63, 47, 0.365_874),
            (20, 10, 0.191_168),
        ],
    );
}

#[test]
fn hdr_flip_is_that_of_the_authors() {
    let (test, reference) = (pattern(1, true, true), pattern(0, false, true));
    let (start, stop) = flip::exposures(&reference);
    // They weigh luminance with rounded factors: worst seen 3e-5 of a stop.
    assert!(
        (start - -1.355_927_586_555_481).abs() < 1e-4
            && (stop - 3.583_396_673_202_514_6).abs() < 1e-4,
        "{start} {stop}"
    );
    let map = flip::hdr(&test, &reference, W, H, flip::DEFAULT_PPD);
    check(
        &map,
        0.475_478_976_964_950_56,
        [
            (0, 0, 0.946_860),
            (36, 24, 0.791_401),
            (63, 47, 0.787_689),
            (20, 10, 0.417_080),
        ],
    );
}
