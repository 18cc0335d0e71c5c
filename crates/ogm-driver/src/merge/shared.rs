//! What all values of a measurement are wrong by together: a fit that took them for scatter would state intervals that are too narrow.
//!
//! Each part is one standard normal number z for the whole file. In the CSV they are comment lines, `# shared,KIND,SIGMA`, each kind at most once:
//!
//! | kind | what a row really holds | rows |
//! |---|---|---|
//! | `scale` | value (1 + SIGMA z): direct beam, curvature of the detector | samples, direct |
//! | `solid_angle` | value (1 + SIGMA z): size of the aperture | samples |
//! | `floor` | f + SIGMA z / abs(cos θ_v): dark level; SIGMA in 1/sr | samples |
//! | `light_theta_deg`, `light_phi_deg` | the light stood at θ_l (φ_l) + SIGMA z, degrees | samples, direct |
//! | `view_theta_deg`, `view_phi_deg` | the detector stood at θ_v (φ_v) + SIGMA z | samples |
//!
//! The column `sigma` holds the whole standard error of a row, these parts with it. With an offset of the detector's angle the row holds
//! f(l, v) abs(cos θ_v) of where it stood over abs(cos θ_v) of where it was thought to be: the flux is what is read.
//!
//! What is a row's own stands in lines `# own,FIRST,s,s,…` (samples, counted from 0) and `# own_direct,FIRST,s,…`: the share 0 < s <= 1 of its `sigma`.

/// Standard deviations of the parts; 0 where there is none.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Shared {
    /// Relative error of every value.
    pub scale: f64,
    /// Relative error of every BSDF, none of the straight-through transmittances.
    pub solid_angle: f64,
    /// Error of f |cos θ_v|, 1/sr.
    pub floor: f64,
    /// Offset of each axis, degrees; the four are independent.
    pub angle_deg: f64,
}

impl Shared {
    /// The larger of both in each part.
    #[must_use]
    pub fn larger(self, other: Shared) -> Shared {
        Shared {
            scale: self.scale.max(other.scale),
            solid_angle: self.solid_angle.max(other.solid_angle),
            floor: self.floor.max(other.floor),
            angle_deg: self.angle_deg.max(other.angle_deg),
        }
    }

    /// The comment lines of the CSV, without the parts that are 0.
    pub fn lines(&self) -> Vec<String> {
        let parts = [
            ("scale", self.scale),
            ("solid_angle", self.solid_angle),
            ("floor", self.floor),
            ("light_theta_deg", self.angle_deg),
            ("light_phi_deg", self.angle_deg),
            ("view_theta_deg", self.angle_deg),
            ("view_phi_deg", self.angle_deg),
        ];
        parts
            .into_iter()
            .filter(|(_, sigma)| *sigma > 0.0 && sigma.is_finite())
            .map(|(kind, sigma)| format!("shared,{kind},{sigma:.4e}"))
            .collect()
    }
}

/// Numbers of one line.
const A_LINE: usize = 16;

/// The shares of the standard errors that are the rows' own, as comment lines.
pub(super) fn own_lines(kind: &str, shares: impl Iterator<Item = f64>) -> Vec<String> {
    // A share that cannot be told is all of it.
    let text = |s: f64| match s {
        s if s > 0.0 && s < 1.0 => format!("{:.5}", s.max(1e-5)),
        _ => "1".into(),
    };
    let all: Vec<String> = shares.map(text).collect();
    all.chunks(A_LINE)
        .enumerate()
        .map(|(k, chunk)| format!("{kind},{},{}", k * A_LINE, chunk.join(",")))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_there_has_a_line() {
        assert!(Shared::default().lines().is_empty());
        let a = Shared {
            scale: 4.1e-4,
            ..Shared::default()
        };
        assert_eq!(a.lines(), ["shared,scale,4.1000e-4"]);
        let b = Shared {
            scale: 1e-5,
            angle_deg: 0.0577,
            ..Shared::default()
        };
        let both = a.larger(b);
        assert_eq!((both.scale, both.angle_deg), (4.1e-4, 0.0577));
        assert_eq!(both.lines()[4], "shared,view_phi_deg,5.7700e-2");
        let own = own_lines("own", [0.5, f64::NAN, 1e-9].into_iter().cycle().take(17));
        assert_eq!(own.len(), 2);
        assert!(own[0].starts_with("own,0,0.50000,1,0.00001,0.5"));
        assert_eq!(own[1], "own,16,1");
    }
}
