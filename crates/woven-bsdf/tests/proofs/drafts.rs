//! Drafts: the fractions of the shared files, built-in weaves, tolerance, damage.

use std::path::{Path, PathBuf};
use woven_bsdf::weave::draft::{Draft, Side};
use woven_bsdf::weave::{openness, wif};

fn shared() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/wif");
    path.is_dir().then_some(path)
}

#[test]
fn shared_drafts() {
    let Some(folder) = shared() else {
        println!("skipped: there is no shared/data/wif beside the workspace");
        return;
    };
    // From the data's own README.
    let known = [
        ("32-shaft_twill.wif", 62, 62, 0.5315),
        ("two_color_single_treadles.wif", 4, 6, 0.6667),
        ("two_color_multiple_treadles.wif", 4, 6, 0.7083),
        ("two_color_liftplan.wif", 4, 6, 0.7083),
        ("eighteen_shaft_liftplan.wif", 4, 6, 0.7083),
        ("many_color_multiple_treadles_and_zeros.wif", 5, 6, 0.4333),
        ("thunderloom_54235plain.wif", 2, 2, 0.5),
        ("thunderloom_2229.wif", 24, 24, 0.4167),
        ("thunderloom_41753.wif", 48, 48, 0.2222),
        ("thunderloom_8452.wif", 84, 100, 0.3671),
    ];
    for (name, ends, picks, share) in known {
        let draft = wif::read(&folder.join(name)).unwrap();
        assert_eq!((draft.ends(), draft.picks()), (ends, picks), "{name}");
        assert!(
            (draft.warp_share() - share).abs() < 5e-5,
            "{name}: {}",
            draft.warp_share()
        );
        let c = draft.color(Side::Face).expect(name);
        assert!(c.iter().all(|c| (0.0..=1.0).contains(c)));
        // Yarn thicker than its spacing counts as closed cloth.
        assert!(draft.warp.gamma().is_none_or(|g| g <= 1.0));
    }
    let [a, b] = ["two_color_multiple_treadles.wif", "two_color_liftplan.wif"]
        .map(|n| wif::read(&folder.join(n)).unwrap());
    for i in 0..24 {
        assert_eq!(
            a.warp_up(i % 4, i / 4),
            b.warp_up(i % 4, i / 4),
            "the same cloth twice"
        );
    }
}

/// A draft as text: 2/1 twill on three shafts, with gaps, comments, mixed case, a hole in the palette, CR line ends.
const TWILL: &str = "[wif]\r\nVersion=1.1\r\n; a comment\r\n[Text]\r\nTitle=small\r\n[WEAVING]\r\nRising Shed=1  \r\n\
    [threading]\r\n1=1\r\n2=2\r\n3=3\r\n[TieUp]\r\n1=1,2\r\n2=2,3\r\n3=3,1\r\n[Treadling]\r\n1=1\r\n2=2\r\n3=0,3\r\n\
    [Warp]\r\nThreads=3\r\nColor=1\r\nSpacing=0.05\r\nThickness=0.03\r\nUnits=Centimeters\r\n[Weft]\r\nThreads=3\r\nColor=9\r\n\
    [COLOR PALETTE]\r\nRange=0,999\r\n[COLOR TABLE]\r\n1=999,0,0\r\n3=0,999,0\r\n";

#[test]
fn a_small_draft() {
    let draft = wif::parse(TWILL.as_bytes()).unwrap();
    assert_eq!(
        (draft.name.as_str(), draft.ends(), draft.picks()),
        ("small", 3, 3)
    );
    let rows: Vec<String> = (0..3)
        .map(|p| {
            (0..3)
                .map(|e| if draft.warp_up(e, p) { 'x' } else { '.' })
                .collect()
        })
        .collect();
    assert_eq!(rows, ["xx.", ".xx", "x.x"]);
    assert_eq!(draft.longest_floats(), (2, 1));
    assert!((draft.warp.gamma().unwrap() - 0.6).abs() < 1e-12 && draft.weft.gamma().is_none());
    // Two thirds red warp, one third weft whose colour 9 is a hole: grey.
    let c = draft.color(Side::Face).unwrap();
    assert!((c[0] - (2.0 + 0.5) / 3.0).abs() < 1e-12 && (c[1] - 0.5 / 3.0).abs() < 1e-12);
    // With a sinking shed the other yarn is on top everywhere.
    let sinking = wif::parse(TWILL.replace("Shed=1", "Shed=no").as_bytes()).unwrap();
    assert!((sinking.warp_share() - 1.0 / 3.0).abs() < 1e-12);
}

#[test]
fn refusals() {
    for (text, needle) in [
        ("", "not a WIF"),
        ("hello", "not a WIF"),
        ("[WIF]", "[THREADING]"),
        ("[WIF]\n[THREADING]\n1=1", "[LIFTPLAN]"),
        (
            "[WIF]\n[THREADING]\n1=1\n[LIFTPLAN]\n1=1\n[WARP]\nThreads=99999999",
            "Threads = 99999999",
        ),
        (
            "[WIF]\n[THREADING]\n1=1\n[LIFTPLAN]\n1=1\n[WARP]\nThreads=0",
            "Threads = 0",
        ),
    ] {
        let e = wif::parse(text.as_bytes()).unwrap_err().to_string();
        assert!(e.contains(needle), "{e:?} lacks {needle:?}");
    }
}

#[test]
fn built_in_weaves() {
    let satin = Draft::satin(5, 2).unwrap();
    // (weave, warp share, longest floats of warp and weft)
    for (draft, share, floats) in [
        (Draft::plain(), 0.5, (1, 1)),
        (Draft::twill(2, 2), 0.5, (2, 2)),
        (Draft::twill(3, 1), 0.75, (3, 1)),
        (satin, 0.8, (4, 1)),
        (Draft::leno(), 0.5, (2, 1)),
        (Draft::lace(), 0.5, (3, 3)),
    ] {
        assert_eq!(draft.warp_share(), share, "{}", draft.name);
        assert_eq!(draft.longest_floats(), floats, "{}", draft.name);
        for (a, b) in [(0.5, 0.5), (0.9, 0.3), (1.0, 1.0)] {
            let face = draft.visible(Side::Face, a, b);
            let back = draft.visible(Side::Back, a, b);
            for v in [face, back] {
                assert!((v.warp + v.weft + v.gap - 1.0).abs() < 1e-12);
                let straight = woven_bsdf::vec3::Vec3::new(0.0, 0.0, 1.0);
                assert!((v.gap - openness(a, b, 1.0, straight)).abs() < 1e-12);
            }
            // What the face hides, the back shows: the crossings are shared.
            assert!((face.warp + back.warp - (2.0 * a - a * b)).abs() < 1e-12);
        }
    }
    assert!(
        Draft::satin(6, 2).is_none()
            && Draft::satin(5, 1).is_none()
            && Draft::satin(5, 4).is_none()
    );
}
