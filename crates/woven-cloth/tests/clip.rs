//! A clip from description to cache file and back: a valid glTF, point caches, resume after a stop.

use std::ops::ControlFlow;
use woven_cloth::{CurtainClip, CurtainSpec, Simulation, simulate, simulate_to};

fn spec() -> CurtainSpec {
    "width = 0.5\nheight = 0.7\npleats = 4\ncolumns = 33\nrows = 17\nframes = 10\nsettle = 0.5\nwarm_up = 0.1\n[wind]\nspeed = 1.5".parse().unwrap()
}

fn go(_: usize, _: usize) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

#[test]
fn the_glb_is_valid_gltf_and_reads_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("curtain.glb");
    let clip = simulate(&spec(), &mut go).unwrap();
    clip.write(&path).unwrap();
    // The crate gltf validates indices, accessors, min and max.
    let document = gltf::Gltf::open(&path).unwrap();
    let blob = document.blob.as_deref().unwrap();
    let mesh = document.meshes().next().unwrap();
    let primitive = mesh.primitives().next().unwrap();
    let reader = primitive.reader(|_| Some(blob));
    assert_eq!(reader.read_positions().unwrap().count(), 33 * 17);
    assert_eq!(primitive.morph_targets().count(), 10);
    let mut worst = 0.0f32;
    for (k, (moved, _, _)) in reader.read_morph_targets().enumerate() {
        for ((d, base), want) in moved
            .unwrap()
            .zip(&clip.mesh.positions)
            .zip(&clip.frames[k].positions)
        {
            for c in 0..3 {
                worst = worst.max((d[c] + base[c] - want[c]).abs());
            }
        }
    }
    // Base and difference are rounded to f32 once each: a few 1e-7 m on metres.
    assert!(worst < 1e-6, "{worst}");
    let animation = document.animations().next().unwrap();
    let channel = animation.channels().next().unwrap();
    let channel = channel.reader(|_| Some(blob));
    let times: Vec<f32> = channel.read_inputs().unwrap().collect();
    assert!((times[9] - 9.0 / 24.0).abs() < 1e-6);

    let back = CurtainClip::read(&path).unwrap();
    assert_eq!(back.mesh, clip.mesh);
    assert_eq!(back.frames.len(), 10);
}

#[test]
fn pc2_reads_back_exactly_and_mdd_has_its_length() {
    let folder = tempfile::tempdir().unwrap();
    let clip = simulate(
        &CurtainSpec {
            frames: 3,
            ..spec()
        },
        &mut go,
    )
    .unwrap();
    let pc2 = folder.path().join("c.pc2");
    clip.write(&pc2).unwrap();
    let back = CurtainClip::read(&pc2).unwrap();
    for (a, b) in back.frames.iter().zip(&clip.frames) {
        assert_eq!(a.positions, b.positions);
    }
    let usd = folder.path().join("c.usda");
    clip.write(&usd).unwrap();
    let text = std::fs::read_to_string(&usd).unwrap();
    // The third sample's points, read back from the text, have the same bits.
    let samples = &text[text.find("points.timeSamples").unwrap()..];
    let sample = &samples[samples.find("\n        2: ").unwrap() + 12..];
    let numbers: Vec<f32> = sample[..sample.find(']').unwrap()]
        .split(|c: char| "[](), ".contains(c))
        .filter_map(|n| n.parse().ok())
        .collect();
    assert_eq!(numbers, clip.frames[2].positions.as_flattened());
    let mdd = folder.path().join("c.mdd");
    clip.write(&mdd).unwrap();
    assert_eq!(
        std::fs::metadata(&mdd).unwrap().len(),
        8 + 3 * 4 + 3 * 33 * 17 * 12
    );
}

#[test]
fn a_stopped_clip_goes_on_and_ends_with_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let (whole, parts) = (
        folder.path().join("whole.glb"),
        folder.path().join("parts.glb"),
    );
    simulate_to(&spec(), &whole, 0, &mut go).unwrap();
    let mut stops = 0;
    loop {
        match simulate_to(&spec(), &parts, 2, &mut |done, _| {
            if done % 4 == 3 {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        }) {
            Ok(_) => break,
            Err(e) => {
                assert!(e.to_string().contains("stopped on request"), "{e}");
                assert!(
                    !parts.exists(),
                    "nothing half done is left under the final name"
                );
                stops += 1;
            }
        }
    }
    assert_eq!(stops, 2);
    assert_eq!(
        std::fs::read(&whole).unwrap(),
        std::fs::read(&parts).unwrap()
    );
    assert_eq!(
        std::fs::read_dir(folder.path()).unwrap().count(),
        2,
        "helpers are removed"
    );
}

#[test]
fn too_many_frames_for_a_glb_are_refused_before_the_work() {
    let many = CurtainSpec {
        frames: 241,
        ..spec()
    };
    let e = simulate_to(&many, std::path::Path::new("never.glb"), 0, &mut |_, _| {
        panic!("must not start")
    })
    .unwrap_err()
    .to_string();
    assert!(e.contains("240") && e.contains(".pc2"), "{e}");
    let e = simulate_to(&spec(), std::path::Path::new("never.abc"), 0, &mut go)
        .unwrap_err()
        .to_string();
    assert!(e.contains("abc"), "{e}");
}

#[test]
fn a_folder_that_is_not_there_is_a_sentence() {
    let clip = simulate(
        &CurtainSpec {
            frames: 1,
            ..spec()
        },
        &mut go,
    )
    .unwrap();
    let e = clip
        .write(std::path::Path::new("no/such/folder/c.glb"))
        .unwrap_err()
        .to_string();
    assert!(e.contains("c.glb"), "{e}");
}

#[test]
fn damaged_caches_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("c.glb");
    simulate(
        &CurtainSpec {
            frames: 2,
            ..spec()
        },
        &mut go,
    )
    .unwrap()
    .write(&path)
    .unwrap();
    let bytes = std::fs::read(&path).unwrap();
    for keep in [0, 10, 30, 2000, bytes.len() - 40_000] {
        std::fs::write(&path, &bytes[..keep]).unwrap();
        assert!(CurtainClip::read(&path).is_err(), "{keep} bytes");
    }
}

/// The chain's own demand: 600 frames of wind without NaN, strain below 5 %, support = weight within 1 % at rest.
#[test]
fn six_hundred_frames_of_gusts_stay_whole() {
    let text = "width = 0.7\nheight = 1.6\npleats = 5\ncolumns = 41\nrows = 29\nfps = 60.0\nwarm_up = 0.0\nsettle = 3.0\nfabric = \"voile\"\n[wind]\nspeed = 1.6\ngust = 0.5";
    let mut sim = Simulation::new(&text.parse().unwrap()).unwrap();
    let rest = sim.settle(3.0).unwrap();
    let ratio = rest.support_force[1] / rest.weight;
    assert!(
        (ratio - 1.0).abs() < 0.01,
        "the rail carries {ratio} of the weight"
    );
    let (mut strain, mut reach) = (0.0f64, 0.0f32);
    for _ in 0..600 {
        sim.step_frame().unwrap();
        strain = strain.max(sim.report().max_strain);
        let frame = sim.frame();
        assert!(frame.positions.iter().flatten().all(|c| c.is_finite()));
        reach = frame.positions.iter().fold(reach, |m, p| m.max(p[2]));
    }
    println!(
        "rest: rail/weight {ratio:.5}; 600 frames: largest strain {:.2} %, reach {reach:.2} m",
        strain * 100.0
    );
    assert!(strain < 0.05, "largest strain {strain}");
    assert!(reach > 0.2, "the wind must move it: {reach} m");
}

/// A curtain large enough to be shared out over threads, folds in contact, rings on their way.
fn busy() -> CurtainSpec {
    "width = 0.7\nheight = 0.9\npleats = 7\ncolumns = 71\nrows = 45\nsettle = 0.3\nwarm_up = 0.0\nfps = 24.0\n[wind]\nspeed = 2.0\n[[draw]]\ntime = 0.0\nshare = 0.5\n[[draw]]\ntime = 2.0\nshare = 0.3"
        .parse()
        .unwrap()
}

#[test]
fn one_two_and_four_threads_give_the_same_bits_and_so_does_going_on_from_any_frame() {
    let frames = 5;
    let run = |threads: usize| -> Vec<Vec<u8>> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| {
            let mut sim = Simulation::new(&busy()).unwrap();
            sim.settle(0.3).unwrap();
            (0..frames)
                .map(|_| {
                    sim.step_frame().unwrap();
                    sim.save()
                })
                .collect()
        })
    };
    let one = run(1);
    assert!(one == run(2) && one == run(4), "bits differ over threads");
    for (k, state) in one.iter().enumerate() {
        let mut sim = Simulation::load(&busy(), state).unwrap();
        for after in &one[k + 1..] {
            sim.step_frame().unwrap();
            assert!(
                sim.save() == *after,
                "bits differ after going on from frame {k}"
            );
        }
    }
}

#[test]
fn a_curtain_drawn_to_a_fifth_of_its_rail_stays_whole() {
    let text = "width = 1.0\nheight = 1.2\nfullness = 2.0\npleats = 8\ncolumns = 65\nrows = 33\nsettle = 1.0\nwarm_up = 0.0\nfps = 24.0\nfabric = \"voile\"\ndraw_to = \"left\"\n[[draw]]\ntime = 0.0\nshare = 1.0\n[[draw]]\ntime = 2.0\nshare = 0.2";
    let mut sim = Simulation::new(&text.parse().unwrap()).unwrap();
    let (mut through, mut strain) = (0, 0.0f64);
    for _ in 0..72 {
        sim.step_frame().unwrap();
        through += woven_cloth::crossings(&sim.frame().positions, &sim.mesh());
        strain = strain.max(sim.report().max_strain);
    }
    let s = sim.sheet();
    let heading = s.x[0][64] - s.x[0][0];
    println!(
        "drawn to {heading:.3} m: {through} crossings in 72 frames, largest strain {:.2} %",
        strain * 100.0
    );
    assert!((heading - 0.2).abs() < 1e-9 && (s.x[0][0] + 0.5).abs() < 1e-9);
    // Half again the strain of the converged reference (3.1 %), as for gusts; 0.36 % found, 8.5 % where creases were held open
    // further than the pleats are.
    assert!(strain < 0.0465, "{strain}");
    assert_eq!(through, 0);
}

#[test]
fn a_lace_behind_a_drape_makes_two_files_and_neither_passes_through_the_other() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("two.glb");
    let text = "width = 0.6\nheight = 0.8\npleats = 4\ncolumns = 33\nrows = 21\nsettle = 0.3\nwarm_up = 0.0\nframes = 24\nfabric = \"drape\"\nrail_depth = 0.1\n[wind]\nspeed = 3.0\nramp = 0.2\n[second]\nfabric = \"lace\"\nrail_depth = -0.1\npleats = 5";
    let near = text.replace("rail_depth = 0.1", "rail_depth = -0.06");
    let e = Simulation::new(&near.parse().unwrap()).unwrap_err();
    assert!(e.to_string().contains("second.rail_depth"), "{e}");
    let spec: CurtainSpec = text.parse().unwrap();
    let mut stops = 0;
    let clip = loop {
        match simulate_to(&spec, &path, 2, &mut |done, _| match done {
            12 => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        }) {
            Ok(clip) => break clip,
            Err(_) => stops += 1,
        }
    };
    assert_eq!(stops, 1);
    assert!(
        clip == simulate(&spec, &mut go).unwrap(),
        "a stop changes no bit of two curtains"
    );
    let (first, second) = (
        CurtainClip::read(&path).unwrap(),
        CurtainClip::read(&woven_cloth::second_path(&path)).unwrap(),
    );
    assert_eq!((first.mesh.grid, second.mesh.grid), ([33, 21], [33, 21]));
    // The wind drives the lace into the drape: they come near, and nothing pierces anything.
    let mut least = f32::INFINITY;
    for (frame, other) in first.frames.iter().zip(&second.frames) {
        for p in &frame.positions[33 * 10..] {
            for q in &other.positions[33 * 10..] {
                let d2: f32 = (0..3).map(|c| (p[c] - q[c]).powi(2)).sum();
                least = least.min(d2);
            }
        }
    }
    let through: usize = clip
        .frames
        .iter()
        .map(|f| woven_cloth::crossings(&f.positions, &clip.mesh))
        .sum();
    println!(
        "two curtains: nearest vertices {:.4} m, {through} crossings",
        least.sqrt()
    );
    assert_eq!(through, 0);
    assert!(least.sqrt() < 0.03, "they never met: {} m", least.sqrt());
}

#[test]
fn the_strain_of_the_weave_is_in_the_glb() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("c.glb");
    let clip = simulate(
        &CurtainSpec {
            frames: 2,
            ..spec()
        },
        &mut go,
    )
    .unwrap();
    clip.write(&path).unwrap();
    let document = gltf::Gltf::open(&path).unwrap();
    let primitive = document
        .meshes()
        .next()
        .unwrap()
        .primitives()
        .next()
        .unwrap();
    let accessor = primitive
        .get(&gltf::Semantic::Extras("WOVEN_STRETCH".into()))
        .expect("the attribute is there");
    let view = accessor.view().unwrap();
    let (from, step) = (view.offset(), view.stride().unwrap());
    let blob = document.blob.as_deref().unwrap();
    for (k, want) in woven_cloth::weave_strain(&clip.mesh, &clip.mesh.positions)
        .iter()
        .enumerate()
    {
        for c in 0..3 {
            let at = from + k * step + 2 * c;
            let got = f32::from(i16::from_le_bytes([blob[at], blob[at + 1]])) / 32767.0;
            // Half a step of 16 bits.
            assert!(
                (got - want[c]).abs() < 1.6e-5,
                "vertex {k}: {got} for {}",
                want[c]
            );
        }
    }
}
