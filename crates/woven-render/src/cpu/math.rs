//! Elementary functions written out, so that CPU and GPU round alike; the pair of `shader/math.wgsl`.
//!
//! Polynomials after S. Moshier's Cephes (single precision), absolute errors below 3e-7.

use glam::Vec4;
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

/// sin and cos of 2π `u`, u in 0..1.
#[inline(always)]
pub(crate) fn sincos_turn(u: f32) -> (f32, f32) {
    let quarter = (u * 4.0 + 0.5).floor();
    let x = (u * 4.0 - quarter) * FRAC_PI_2;
    let z = x * x;
    let s = ((-1.951_529_6e-4 * z + 8.332_161e-3) * z - 1.666_665_5e-1) * z * x + x;
    let c = ((2.443_315_7e-5 * z - 1.388_731_6e-3) * z + 4.166_664_6e-2) * z * z - 0.5 * z + 1.0;
    match quarter as i32 & 3 {
        0 => (s, c),
        1 => (c, -s),
        2 => (-s, -c),
        _ => (-c, s),
    }
}

/// Coefficients of the arc tangent; from this tangent on it is taken from π/4.
const ATAN: [f32; 4] = [8.053_744_5e-2, 1.387_768_6e-1, 1.997_771_1e-1, 3.333_295e-1];
const FAR_TANGENT: f32 = 0.414_213_57;

/// Arc tangent of `x` ≥ 0.
#[inline(always)]
fn atan_positive(x: f32) -> f32 {
    let (base, x) = if x > 2.414_213_6 {
        (FRAC_PI_2, -1.0 / x)
    } else if x > FAR_TANGENT {
        (FRAC_PI_4, (x - 1.0) / (x + 1.0))
    } else {
        (0.0, x)
    };
    let z = x * x;
    base + (((ATAN[0] * z - ATAN[1]) * z + ATAN[2]) * z - ATAN[3]) * z * x + x
}

/// Angle of the point (x, y) in (-π, π]; 0 at the origin.
#[inline(always)]
pub(crate) fn atan2(y: f32, x: f32) -> f32 {
    if y == 0.0 && x == 0.0 {
        return 0.0;
    }
    let (ax, ay) = (x.abs(), y.abs());
    let a = if ax >= ay {
        atan_positive(ay / ax)
    } else {
        FRAC_PI_2 - atan_positive(ax / ay)
    };
    let a = if x < 0.0 { PI - a } else { a };
    if y < 0.0 { -a } else { a }
}

/// Arc cosine of `x`, limited to -1..1.
#[inline(always)]
pub(crate) fn acos(x: f32) -> f32 {
    let x = x.clamp(-1.0, 1.0);
    2.0 * atan2((1.0 - x).sqrt(), (1.0 + x).sqrt())
}

/// [`acos`] of four numbers, with the same bits.
#[inline(always)]
pub(crate) fn acos4(x: Vec4) -> Vec4 {
    let x = x.max(Vec4::NEG_ONE).min(Vec4::ONE);
    // The angle of the point (c, s), which lies in the first quarter.
    let s = [1.0 - x.x, 1.0 - x.y, 1.0 - x.z, 1.0 - x.w].map(f32::sqrt);
    let c = [1.0 + x.x, 1.0 + x.y, 1.0 + x.z, 1.0 + x.w].map(f32::sqrt);
    let (s, c) = (Vec4::from(s), Vec4::from(c));
    let flat = c.cmpge(s);
    let t = Vec4::select(flat, s, c) / Vec4::select(flat, c, s);
    let far = t.cmpgt(Vec4::splat(FAR_TANGENT));
    let base = Vec4::select(far, Vec4::splat(FRAC_PI_4), Vec4::ZERO);
    let t = Vec4::select(far, (t - 1.0) / (t + 1.0), t);
    let z = t * t;
    let p = [ATAN[0], ATAN[1], ATAN[2], ATAN[3]].map(Vec4::splat);
    let a = base + (((p[0] * z - p[1]) * z + p[2]) * z - p[3]) * z * t + t;
    2.0 * Vec4::select(flat, a, Vec4::splat(FRAC_PI_2) - a)
}

/// sin and cos of an angle in radians of moderate size.
#[inline(always)]
pub(crate) fn sincos(a: f32) -> (f32, f32) {
    let u = a * (1.0 / TAU);
    sincos_turn(u - u.floor())
}

/// Luminance of linear Rec.709.
#[inline(always)]
pub(crate) fn luminance(c: glam::Vec3) -> f32 {
    c.dot(glam::Vec3::new(0.2126, 0.7152, 0.0722))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_agree_with_the_library() {
        let mut worst = [0.0_f64; 3];
        for i in 0..20_000 {
            let u = i as f32 / 20_000.0;
            let (s, c) = sincos_turn(u);
            let exact = f64::from(u) * std::f64::consts::TAU;
            worst[0] = worst[0]
                .max((f64::from(s) - exact.sin()).abs())
                .max((f64::from(c) - exact.cos()).abs());
            let x = 2.0 * u - 1.0;
            worst[1] = worst[1].max((f64::from(acos(x)) - f64::from(x).acos()).abs());
            let (s, c) = (3.0 * s, 3.0 * c);
            // Modulo a turn: on the negative axis -0 is a zero here (π), while the library tells it apart (-π).
            let turns =
                (f64::from(atan2(s, c)) - f64::from(s).atan2(f64::from(c))) / std::f64::consts::TAU;
            worst[2] = worst[2].max((turns - turns.round()).abs() * std::f64::consts::TAU);
        }
        // A few roundings of f32 at π (2.4e-7 each).
        assert!(worst.iter().all(|&w| w < 7e-7), "{worst:?}");
        assert_eq!(atan2(0.0, 0.0), 0.0);
    }

    #[test]
    fn four_arc_cosines_have_the_bits_of_one() {
        for i in 0..20_000 {
            let x = i as f32 / 9_000.0 - 1.1;
            let four = [x, -x, 0.5 * x, x * x];
            let all: [f32; 4] = acos4(Vec4::from(four)).into();
            assert_eq!(all.map(f32::to_bits), four.map(|x| acos(x).to_bits()));
        }
    }
}
