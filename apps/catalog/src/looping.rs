//! From a run of simulated frames to one that repeats without a jump.
//!
//! Wind does not repeat, so a loop is looked for: of all stretches of the wanted length, the one whose end is most like its
//! beginning is taken, and over a few frames its continuation is faded, vertex by vertex, into its beginning.

use glam::Vec3;

/// The first frame of the stretch of `count` frames whose `blend` frames after its end are nearest to its first `blend` frames
/// (mean squared distance of the vertices). Needs `count + blend` frames; with exactly as many the answer is 0.
#[must_use]
pub fn best_start(frames: &[Vec<Vec3>], count: usize, blend: usize) -> usize {
    let last = frames.len().saturating_sub(count + blend);
    let cost = |start: usize| -> f64 {
        let pairs = (start..start + blend.max(1)).filter(|i| i + count < frames.len());
        pairs.map(|i| apart(&frames[i], &frames[i + count])).sum()
    };
    let mut best = (f64::INFINITY, 0);
    for start in 0..=last {
        let cost = cost(start);
        if cost < best.0 {
            best = (cost, start);
        }
    }
    best.1
}

/// Mean squared distance of the vertices of two frames [m²].
fn apart(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(p, q)| f64::from(p.distance_squared(*q)))
        .sum::<f64>()
        / a.len().max(1) as f64
}

/// `count` frames from `start` on; the first `blend` of them are mixed with what follows the last, so that the last leads to the
/// first as smoothly as any frame to the next. Without enough frames after the end there is nothing to mix with, and the jump stays.
#[must_use]
pub fn close(frames: &[Vec<Vec3>], start: usize, count: usize, blend: usize) -> Vec<Vec<Vec3>> {
    let mut out: Vec<Vec<Vec3>> = frames[start..(start + count).min(frames.len())].to_vec();
    for (i, frame) in out.iter_mut().enumerate().take(blend) {
        let Some(after) = frames.get(start + count + i) else {
            break;
        };
        let t = (i as f32 + 1.0) / (blend as f32 + 1.0);
        let share = t * t * (3.0 - 2.0 * t);
        for (p, q) in frame.iter_mut().zip(after) {
            *p = q.lerp(*p, share);
        }
    }
    out
}

/// Smooth vertex normals of a mesh, weighted by the area of the triangles around; +z where there is none.
#[must_use]
pub fn normals(positions: &[Vec3], indices: &[[u32; 3]]) -> Vec<Vec3> {
    let mut normals = vec![Vec3::ZERO; positions.len()];
    for t in indices {
        let [a, b, c] = t.map(|i| positions[i as usize]);
        let area = (b - a).cross(c - a);
        for i in t {
            normals[*i as usize] += area;
        }
    }
    normals
        .into_iter()
        .map(|n| n.try_normalize().unwrap_or(Vec3::Z))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One vertex on a circle, nine frames a turn, drifting slowly.
    fn turning(n: usize) -> Vec<Vec<Vec3>> {
        (0..n)
            .map(|i| {
                vec![Vec3::new(
                    (i as f32 / 9.0 * std::f32::consts::TAU).cos(),
                    (i as f32 / 9.0 * std::f32::consts::TAU).sin(),
                    i as f32 * 0.01,
                )]
            })
            .collect()
    }

    #[test]
    fn a_loop_has_no_jump() {
        let frames = turning(40);
        let (count, blend) = (18, 6);
        let out = close(&frames, 3, count, blend);
        assert_eq!(out.len(), count);
        let step = |a: &Vec<Vec3>, b: &Vec<Vec3>| a[0].distance(b[0]);
        let usual = step(&frames[0], &frames[1]);
        for i in 0..count {
            let s = step(&out[i], &out[(i + 1) % count]);
            // Without the blend the last step would be 0.18 longer along z.
            assert!(
                (s - usual).abs() < 0.06 * usual + 0.01,
                "step {i}: {s} instead of {usual}"
            );
        }
    }

    #[test]
    fn the_stretch_that_meets_itself_is_found() {
        // Only from frame 5 on does the motion repeat after 9 frames.
        let mut frames: Vec<Vec<Vec3>> = turning(30)
            .into_iter()
            .map(|f| vec![Vec3::new(f[0].x, f[0].y, 0.0)])
            .collect();
        for (i, f) in frames.iter_mut().enumerate().take(5) {
            f[0].z = 1.0 + i as f32;
        }
        assert!(best_start(&frames, 9, 3) >= 5);
        assert_eq!(best_start(&frames[..12], 9, 3), 0);
    }

    #[test]
    fn normals_of_a_flat_sheet_point_up() {
        let p = [Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y];
        assert_eq!(normals(&p, &[[0, 1, 2], [0, 2, 3]]), vec![Vec3::Z; 4]);
    }
}
