//! The error budget beyond noise: angles that are not quite right, and the aperture that blurs the peak.
//!
//! Both need the slope and the curvature of f, which are taken from the neighbours of the same incidence.

use super::Value;
use crate::pose::angle_between;
use crate::rig::DetectorData;

/// Adds to each value's standard error: slope times the angles' uncertainty (two arms, so √2 of one axis), what the detector arm's error does to the
/// foreshortening 1/cosθ_v, and what the aperture's blur changes, R²/8 ∇²f for a round aperture of radius R (the second moment of a disc),
/// and the solid angle's uncertainty.
pub(super) fn widen(samples: &mut [Value], detector: &DetectorData) {
    let angle = detector.angle_deg.to_radians() * std::f64::consts::SQRT_2;
    let radius = (detector.aperture_deg / 2.0).to_radians();
    let mut order: Vec<usize> = (0..samples.len()).collect();
    let key = |i: usize, s: &[Value]| (s[i].pose.theta_l, s[i].pose.phi_l);
    order.sort_by(|&a, &b| {
        let (p, q) = (key(a, samples), key(b, samples));
        p.0.total_cmp(&q.0)
            .then(p.1.total_cmp(&q.1))
            .then(a.cmp(&b))
    });
    let before = samples.to_vec();
    for group in order.chunk_by(|&a, &b| key(a, &before) == key(b, &before)) {
        for &i in group {
            let (slope, curvature) = local_shape(&before, group, i);
            let blur = radius * radius / 8.0 * 2.0 * curvature;
            let c = samples[i].pose.view()[2].abs();
            let tilt = (1.0 - c * c).max(0.0).sqrt() / c.max(1e-3);
            let foreshortening = samples[i].f * tilt * detector.angle_deg.to_radians();
            let size = samples[i].f * detector.solid_angle_sigma();
            let parts = [slope * angle, foreshortening, blur, size];
            samples[i].sigma = parts.into_iter().fold(samples[i].sigma, f64::hypot);
        }
    }
}

/// Magnitudes of slope (per radian) and curvature (per square radian) of f at sample `i`, along the direction of its nearest neighbours:
/// a parabola through the sample and its six nearest within 15°.
fn local_shape(samples: &[Value], group: &[usize], i: usize) -> (f64, f64) {
    let here = samples[i].pose.view();
    let same_side = |j: &usize| samples[*j].pose.view()[2] * here[2] > 0.0;
    let mut near: Vec<(f64, usize)> = group
        .iter()
        .filter(|j| **j != i && same_side(j))
        .map(|&j| (angle_between(here, samples[j].pose.view()), j))
        .filter(|(a, _)| *a > 0.01 && *a < 15.0)
        .collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    near.truncate(6);
    let Some(&(_, first)) = near.first() else {
        return (0.0, 0.0);
    };
    // The direction to the nearest neighbour is the axis; others count by their projection on it.
    let towards = |j: usize| {
        let v = samples[j].pose.view();
        [v[0] - here[0], v[1] - here[1], v[2] - here[2]]
    };
    let axis = towards(first);
    let length = axis.iter().map(|c| c * c).sum::<f64>().sqrt();
    let points: Vec<(f64, f64)> = near
        .iter()
        .filter_map(|&(_, j)| {
            let d = towards(j);
            let along = (d[0] * axis[0] + d[1] * axis[1] + d[2] * axis[2]) / length;
            let whole = d.iter().map(|c| c * c).sum::<f64>().sqrt();
            // Far off the axis a neighbour tells of another direction.
            (along.abs() > 0.8 * whole).then_some((along, samples[j].f - samples[i].f))
        })
        .collect();
    // f - f0 = g s + h s²/2 by least squares, weighted towards the near ones.
    let (mut a, mut b, mut c, mut p, mut q) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (s, df) in &points {
        let w = 1.0 / (s * s);
        let (u, v) = (*s, 0.5 * s * s);
        a += w * u * u;
        b += w * u * v;
        c += w * v * v;
        p += w * u * df;
        q += w * v * df;
    }
    let det = a * c - b * b;
    if points.len() < 2 || det <= 1e-9 * a * c {
        return ((p / a.max(1e-300)).abs(), 0.0);
    }
    (((c * p - b * q) / det).abs(), ((a * q - b * p) / det).abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::Pose;

    #[test]
    fn slope_and_curvature_of_a_known_lobe() {
        let s = 0.1_f64; // radians
        let f = |t: f64| (-(t * t) / (2.0 * s * s)).exp();
        let samples: Vec<Value> = (-20..=20)
            .map(|k| {
                let deg = f64::from(k);
                let phi = if deg < 0.0 { 180.0 } else { 0.0 };
                Value {
                    pose: Pose::new(0.0, 0.0, 180.0 - deg.abs(), phi),
                    f: f(deg.to_radians()),
                    sigma: 1e-9,
                    own: 1e-9,
                }
            })
            .collect();
        let group: Vec<usize> = (0..samples.len()).collect();
        for i in [20, 23, 26, 14] {
            let t = (f64::from(i as i32) - 20.0).to_radians();
            let (g, h) = local_shape(&samples, &group, i);
            let (g0, h0) = (
                (t / (s * s) * f(t)).abs(),
                ((t * t / (s * s) - 1.0) / (s * s) * f(t)).abs(),
            );
            // The six neighbours reach 3°, half of the lobe's width: a tenth of the largest slope and curvature.
            assert!(
                (g - g0).abs() < 0.06 / s && (h - h0).abs() < 0.1 / (s * s),
                "{i}: {g} {g0} {h} {h0}"
            );
        }
    }
}
