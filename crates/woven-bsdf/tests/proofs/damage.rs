//! Damaged files: bytes changed, cut, doubled and moved, for every reader; no panic, and a sentence or a sound result.

use crate::made;
use woven_bsdf::fabric::Fabric;
use woven_bsdf::measured::csv::Scan;
use woven_bsdf::measured::klems::Klems;
use woven_bsdf::measured::merl::Merl;
use woven_bsdf::measured::pab::Pab;
use woven_bsdf::measured::rgl::Rgl;
use woven_bsdf::measured::tensor_tree::TensorTree;
use woven_bsdf::vec3::Vec3;
use woven_bsdf::weave::wif;

/// A reader under attack.
pub(crate) struct Target {
    pub(crate) name: &'static str,
    pub(crate) seeds: Vec<Vec<u8>>,
    /// Rounds that take about a second.
    pub(crate) rounds: usize,
    /// Reads the bytes and uses what was read; whether they were read. Panics when what was read is unsound.
    pub(crate) check: fn(&[u8]) -> bool,
}

/// SplitMix64.
pub(crate) struct Bits(pub(crate) u64);

impl Bits {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
}

/// One to four changes of `seed`: bits, digits, pieces cut out, doubled or moved, ends cut off, numbers made absurd.
pub(crate) fn mutate(seed: &[u8], rng: &mut Bits) -> Vec<u8> {
    const ODD: [&[u8]; 18] = [
        b"-1",
        b"0",
        b"99999999999999999999",
        b"1e999",
        b"nan",
        b"-0.0",
        b"\xff\xfe",
        b"=",
        b",",
        b"[",
        b"<",
        b"\0",
        b"&x;",
        b"1e-320",
        b"{",
        b"}",
        b"\xff\xff\xff\x7f",
        b"\0\0\xc0\x7f",
    ];
    let mut out = seed.to_vec();
    // One change half of the time: more seldom leave a file that is still read.
    for _ in 0..1 + rng.next() % 2 * (rng.next() % 4) {
        if out.is_empty() {
            break;
        }
        let at = rng.next() as usize % out.len();
        let end = (at + 1 + rng.next() as usize % 40).min(out.len());
        match rng.next() % 8 {
            0 => out[at] ^= 1 << (rng.next() % 8),
            1 => out[at] = b'0' + (rng.next() % 10) as u8,
            2 => {
                out.drain(at..end);
            }
            3 => {
                let piece = out[at..end].to_vec();
                let to = rng.next() as usize % out.len();
                out.splice(to..to, piece);
            }
            4 => out.truncate(at),
            5 => out[at] = rng.next() as u8,
            _ => {
                let odd = ODD[rng.next() as usize % ODD.len()];
                out.splice(at..end.min(at + 3), odd.iter().copied());
            }
        }
    }
    out
}

/// Some pairs of directions on both sides.
const DIRECTIONS: [(f64, f64); 4] = [(0.0, 0.0), (0.7, 1.0), (2.5, -2.0), (1.5, 3.0)];

fn sound(f: impl Fn(Vec3<f64>, Vec3<f64>) -> f64) {
    for (a, b) in DIRECTIONS {
        for (c, d) in DIRECTIONS {
            let f = f(Vec3::from_angles(a, b), Vec3::from_angles(c, d));
            assert!(f.is_finite() && f >= 0.0, "{f}");
        }
    }
}

fn text(bytes: &[u8], check: impl Fn(&str) -> bool) -> bool {
    std::str::from_utf8(bytes).is_ok_and(check)
}

/// All readers.
pub(crate) fn targets() -> Vec<Target> {
    let target = |name, seeds: Vec<Vec<u8>>, rounds, check| Target {
        name,
        seeds,
        rounds,
        check,
    };
    vec![
        target("wif", vec![made::WIF.into()], 20_000, |bytes| {
            wif::parse(bytes).is_ok_and(|draft| {
                assert!((0.0..=1.0).contains(&draft.warp_share()));
                draft.longest_floats();
                true
            })
        }),
        target("klems", vec![made::klems().into_bytes()], 5_000, |bytes| {
            text(bytes, |t| {
                Klems::parse(t).is_ok_and(|file| {
                    for block in &file.blocks {
                        let sums = (0..file.patches.len()).map(|i| file.directional(block, i));
                        sums.for_each(|s| assert!(s.is_finite()));
                    }
                    true
                })
            })
        }),
        target("pab", vec![made::PAB.into(), made::PAB_XYZ.into()], 20_000, |bytes| {
            text(bytes, |t| {
                Pab::parse(t).is_ok_and(|pab| {
                    let scan = pab.scan();
                    assert!(scan.samples.iter().all(|s| s.f.is_finite() && s.v.z.is_finite()));
                    assert_eq!(Pab::parse(&pab.to_text()).expect("its own text").points, pab.points);
                    true
                })
            })
        }),
        target("merl", vec![made::merl([2, 3, 2], |b, c| (b[0] + b[1] + b[2] + c) as f64)], 20_000, |bytes| {
            Merl::parse(bytes).is_ok_and(|merl| {
                sound(|l, v| merl.eval(l, v)[1]);
                true
            })
        }),
        target("rgl", vec![made::rgl(0, 2, 2), made::rgl(1, 3, 2)], 10_000, |bytes| {
            Rgl::parse(bytes).is_ok_and(|rgl| {
                sound(|l, v| rgl.eval(l, v, 1));
                true
            })
        }),
        target(
            "tensor tree",
            vec![
                made::tree(3, "Transmission Front", "{{1}{1}{1}{1}{1}{1}{1}{1 2 3 4 5 6 7 8}}").into_bytes(),
                made::tree(4, "Reflection Back", "{1 2 3 4, 5 6 7 8, 9 10 11 12, 13 14 15 16}").into_bytes(),
            ],
            10_000,
            |bytes| {
                text(bytes, |t| {
                    TensorTree::parse(t).is_ok_and(|tree| {
                        sound(|l, v| tree.eval("Visible", l, v));
                        true
                    })
                })
            },
        ),
        target(
            "csv",
            vec![b"# ogm merge a.ogm\n# direct,0,0,0.113,0.002\ntheta_l_deg,phi_l_deg,theta_v_deg,phi_v_deg,f,sigma\n0,0,170,0,0.0143,0.0002\n30,45,150,-90,1.5e-3,\n".to_vec()],
            20_000,
            |bytes| {
                text(bytes, |t| {
                    Scan::parse(t).is_ok_and(|scan| {
                        let finite = |s: &woven_bsdf::measured::csv::Sample| s.f.is_finite() && s.l.x.is_finite() && s.v.z.is_finite();
                        assert!(scan.samples.iter().all(finite));
                        true
                    })
                })
            },
        ),
        target(
            "fabric",
            vec![b"name = \"lace\"\n[weave]\nwarp_diameter_mm = 0.3\nwarp_pitch_mm = 0.5\nweft_diameter_mm = 0.3\nweft_pitch_mm = 0.5\n[optics]\nmodel = \"sheet\"\n\
                parameters = { t_d = 0.3, k_t = 0.1, alpha_x = 0.2 }\n[optics.colors]\nt_d = [1.0, 0.9, 0.8]\n[mechanics]\nareal_density_kg_m2 = 0.1\n".to_vec()],
            2_000,
            |bytes| {
                text(bytes, |t| {
                    Fabric::from_toml(t).is_ok_and(|fabric| {
                        let optics = fabric.optics().expect("checked when read");
                        assert!(optics.shape.iter().all(|x| x.is_finite()), "{t}");
                        true
                    })
                })
            },
        ),
    ]
}
