//! Prints the share of light that the mirrored GGX lobe loses to masking, by quadrature over visible normals, as CSV:
//! the ground of the closed form in `term/albedo.rs`, which `examples/fit_loss.py` chooses by a linear program.

use woven_bsdf::term::ggx;
use woven_bsdf::vec3::Vec3;

/// Widths, 0.02 to 1 in equal ratios.
const WIDTHS: usize = 14;
/// Visible normals of one quadrature: azimuth, height.
const NORMALS: (usize, usize) = (80, 500);

fn loss(v: Vec3<f64>, ax: f64, ay: f64) -> f64 {
    let mut kept = 0.0;
    for i in 0..NORMALS.0 {
        for j in 0..NORMALS.1 {
            let u1 = (i as f64 + 0.5) / NORMALS.0 as f64;
            let u2 = (j as f64 + 0.5) / NORMALS.1 as f64;
            let l = ggx::sample(v, ax, ay, u1, u2);
            if l.z > 0.0 {
                kept += ggx::g1(l, ax, ay);
            }
        }
    }
    1.0 - kept / (NORMALS.0 * NORMALS.1) as f64
}

fn main() {
    println!("alpha_x,alpha_y,cos_theta,phi,loss");
    let width = |i: usize| 0.02 * 50f64.powf(i as f64 / (WIDTHS - 1) as f64);
    for i in 0..WIDTHS {
        for j in i..WIDTHS {
            for (n, cos) in [
                0.009, 0.02, 0.045, 0.08, 0.12, 0.17, 0.24, 0.33, 0.45, 0.6, 0.8, 1.0,
            ]
            .into_iter()
            .enumerate()
            {
                for deg in [0.0, 6.0, 18.0, 40.0, 65.0, 82.0, 90.0] {
                    // The pole has one azimuth; alternate rings are turned a little.
                    let phi = f64::clamp(deg + if n % 2 == 0 { 0.0 } else { 4.0 }, 0.0, 90.0)
                        .to_radians();
                    let sin = f64::sqrt(1.0 - cos * cos);
                    let v = Vec3::new(sin * phi.cos(), sin * phi.sin(), cos);
                    let (ax, ay) = (width(i), width(j));
                    println!("{ax},{ay},{cos},{phi},{}", loss(v, ax, ay));
                    if cos == 1.0 {
                        break;
                    }
                }
            }
        }
    }
}
