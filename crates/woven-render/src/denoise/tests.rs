//! What the denoiser keeps and what it takes away.

use super::*;

/// A small generator for test noise (PCG-like hash), uniform in 0..1.
fn random(i: usize) -> f32 {
    let mut h = (i as u32)
        .wrapping_mul(747_796_405)
        .wrapping_add(2_891_336_453);
    h = ((h >> ((h >> 28) + 4)) ^ h).wrapping_mul(277_803_737);
    ((h >> 22) ^ h) as f32 / u32::MAX as f32
}

/// Two walls under a soft gradient, and beside them a bright noiseless view through gaps with fine stripes.
fn scene(noisy: bool) -> Film {
    let (w, h) = (64, 48);
    let mut film = Film::new(w, h);
    let (mut beauty, mut albedo, mut gap, mut variance) = (vec![], vec![], vec![], vec![]);
    for i in 0..w * h {
        let (x, y) = (i % w, i / w);
        let a = if x < 24 { 0.7 } else { 0.2 };
        let light = 0.5 + y as f32 / 96.0;
        let view = x >= 44;
        let n = if noisy && !view {
            (random(i) + random(i + 90_001) + random(i + 700_001) - 1.5) * 0.4
        } else {
            0.0
        };
        let v = if view {
            if x % 2 == 0 { 2.0 } else { 0.5 }
        } else {
            a * light * (1.0 + n)
        };
        beauty.push([v; 3]);
        albedo.push([if view { 0.0 } else { a }; 3]);
        gap.push([if view { 0.9 } else { 0.0 }; 3]);
        let sigma = if view { 0.0 } else { a * light * 0.2 };
        variance.push([sigma * sigma; 3]);
    }
    film.push(BEAUTY, beauty);
    film.push("albedo", albedo);
    film.push("gap", gap);
    film.push("variance", variance);
    film
}

#[test]
fn noise_falls_and_the_view_through_the_gaps_stays() {
    let truth = scene(false);
    let mut film = scene(true);
    let before = crate::compare::rel_mse(film.beauty().unwrap(), truth.beauty().unwrap());
    denoise(&mut film, &Settings::default());
    let after = crate::compare::rel_mse(film.beauty().unwrap(), truth.beauty().unwrap());
    // Seen: 30 times less; a tenth is asked for.
    assert!(
        after < before * 0.1,
        "relMSE {before} before, {after} after"
    );
    for (i, (p, t)) in film
        .beauty()
        .unwrap()
        .iter()
        .zip(truth.beauty().unwrap())
        .enumerate()
    {
        assert!(i % 64 < 44 || p == t, "pixel {i}: {p:?}, not {t:?}");
    }
}

#[test]
fn a_constant_picture_comes_back_bit_for_bit() {
    let mut film = Film::of_beauty(33, 21, vec![[0.1, 0.7, 3.3]; 33 * 21]);
    film.push("albedo", vec![[0.3, 0.5, 0.7]; 33 * 21]);
    film.push("variance", vec![[0.2; 3]; 33 * 21]);
    let before = film.clone();
    denoise(&mut film, &Settings::default());
    assert_eq!(film, before);
}

#[test]
fn light_layers_still_add_up_to_the_picture() {
    let mut film = scene(true);
    let sun: Vec<[f32; 3]> = film
        .beauty()
        .unwrap()
        .iter()
        .map(|p| p.map(|c| c * 0.25))
        .collect();
    let sky: Vec<[f32; 3]> = film
        .beauty()
        .unwrap()
        .iter()
        .map(|p| p.map(|c| c * 0.75))
        .collect();
    film.push("light.sun", sun);
    film.push("light.sky", sky);
    denoise(&mut film, &Settings::default());
    for i in 0..64 * 48 {
        let (a, b, c) = (
            film.layer("light.sun").unwrap()[i],
            film.layer("light.sky").unwrap()[i],
            film.beauty().unwrap()[i],
        );
        assert!(
            (a[0] + b[0] - c[0]).abs() < 1e-4 * c[0].max(0.1),
            "pixel {i}"
        );
    }
}

#[test]
fn a_firefly_goes_and_nothing_unfinite_comes() {
    let mut film = scene(false);
    let mut pixels = film.beauty().unwrap().to_vec();
    pixels[20 * 64 + 10] = [5000.0; 3];
    film.push(BEAUTY, pixels);
    denoise(&mut film, &Settings::default());
    assert!(film.beauty().unwrap()[20 * 64 + 10][0] < 2.0);
    assert!(
        film.beauty()
            .unwrap()
            .iter()
            .flatten()
            .all(|v| v.is_finite())
    );
}

/// Two surfaces one behind the other under different, even, indirect light with the noise of whole blocks, and direct
/// light with stripes.
fn lit_indirectly(noisy: bool) -> Film {
    let (w, h) = (160, 120);
    let mut film = Film::new(w, h);
    let near = |i: usize| i % w < 80;
    let stripes = |i: usize| if i % w % 4 < 2 { 0.8 } else { 0.2 };
    let light = |i: usize| if near(i) { 0.3 } else { 0.6 };
    let noise = |i: usize| {
        let block = (i % w / 8) + 1000 * (i / w / 8);
        if noisy {
            (random(block) + random(block + 90_001) + random(block + 700_001) - 1.5) * 0.3
        } else {
            0.0
        }
    };
    let all = |f: &dyn Fn(usize) -> f32| (0..w * h).map(|i| [f(i); 3]).collect::<Vec<_>>();
    film.push(BEAUTY, all(&|i| stripes(i) + light(i) * (1.0 + noise(i))));
    film.push("indirect", all(&|i| light(i) * (1.0 + noise(i))));
    film.push("albedo", all(&|_| 0.5));
    film.push("depth", all(&|i| if near(i) { 1.0 } else { 2.0 }));
    film.push("normal", vec![[0.0, 0.0, 1.0]; w * h]);
    film.push("direct.variance", all(&|_| 0.0));
    film.push(
        "indirect.variance",
        all(&|i| (light(i) * 0.15) * (light(i) * 0.15)),
    );
    film
}

#[test]
fn noise_that_blocks_share_falls_and_edges_stay() {
    let truth = lit_indirectly(false);
    let noisy = lit_indirectly(true);
    let mut film = noisy.clone();
    denoise(&mut film, &Settings::default());
    let error = |film: &Film, name: &str| {
        crate::compare::rel_mse(film.layer(name).unwrap(), truth.layer(name).unwrap())
    };
    let (before, after) = (error(&noisy, "indirect"), error(&film, "indirect"));
    // Seen: 20 times less. Some thirty blocks lie within reach of a pixel here, less at the borders.
    assert!(
        after < 0.1 * before,
        "relMSE {before} before, {after} after"
    );
    // The stripes of direct light carry no noise and stay; what is left is the noise of the indirect light.
    let (direct, all) = (error(&film, "indirect"), error(&film, BEAUTY));
    assert!(
        all <= direct,
        "{all} in the picture, {direct} in its indirect part"
    );
    // Nothing leaks over the edge of depth: the light beside it differs by a factor of two.
    for y in 0..120 {
        let row = |x: usize| film.layer("indirect").unwrap()[y * 160 + x][0];
        assert!(
            row(79) < 0.4 && row(80) > 0.48,
            "row {y}: {} {}",
            row(79),
            row(80)
        );
    }
}

#[test]
fn light_layers_add_up_with_indirect_light_too() {
    let mut film = lit_indirectly(true);
    for (name, share) in [("sun", 0.25), ("sky", 0.75)] {
        let scaled = |name: &str| -> Vec<[f32; 3]> {
            let layer = film.layer(name).unwrap();
            layer.iter().map(|p| p.map(|c| c * share)).collect()
        };
        let (light, indirect) = (scaled(BEAUTY), scaled("indirect"));
        film.push(&format!("light.{name}"), light);
        film.push(&format!("indirect.{name}"), indirect);
    }
    denoise(&mut film, &Settings::default());
    for i in 0..160 * 120 {
        let at = |name: &str| film.layer(name).unwrap()[i][0];
        let sum = at("light.sun") + at("light.sky");
        assert!(
            (sum - at(BEAUTY)).abs() < 1e-4,
            "pixel {i}: {sum} {}",
            at(BEAUTY)
        );
    }
}

#[test]
fn what_no_neighbour_is_like_goes_where_it_is_noise_and_stays_where_it_is_not() {
    // A pixel in which an edge mixes two surfaces, dark by chance; a line one pixel wide; a dark point without noise.
    let (w, h) = (48, 32);
    let (mixed, point) = (10 * w + 12, 20 * w + 38);
    let line = |i: usize| i / w == 20 && i % w < 24;
    let mut film = Film::new(w, h);
    let (mut beauty, mut albedo, mut variance) = (vec![], vec![], vec![]);
    for i in 0..w * h {
        beauty.push(if i == mixed {
            [0.1; 3]
        } else if line(i) {
            [0.2; 3]
        } else if i == point {
            [0.3; 3]
        } else {
            [0.5; 3]
        });
        albedo.push([if i == mixed || line(i) { 0.9 } else { 0.5 }; 3]);
        variance.push([if i % w < 24 { 0.04 } else { 0.0 }; 3]);
    }
    let was = beauty.clone();
    film.push(BEAUTY, beauty);
    film.push("albedo", albedo);
    film.push("variance", variance);
    denoise(&mut film, &Settings::default());
    let is = film.beauty().unwrap();
    // The light of the neighbours, one unit, times its own albedo.
    assert!((is[mixed][1] - 0.9).abs() < 0.1, "{:?}", is[mixed]);
    // Its two ends have one neighbour of their kind and may go.
    for i in (0..w * h).filter(|&i| line(i) && (1..23).contains(&(i % w))) {
        assert!(
            (is[i][1] - was[i][1]).abs() < 0.05,
            "{:?} at {}",
            is[i],
            i % w
        );
    }
    assert_eq!(is[point], was[point]);
}
