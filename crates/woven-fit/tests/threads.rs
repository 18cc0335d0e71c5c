//! The same bytes with 1, 2 and 8 threads.

use std::process::Command;

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let dir = tempfile::tempdir().unwrap();
    let csv = dir.path().join("scan.csv");
    // Two incidences of a known model: enough nodes for the parallel paths are not needed, the parallel loop over models is.
    let truth = woven_bsdf::model::find("ward").unwrap();
    let scan = woven_fit::synth::scan_of(truth, &[0.2, 0.3, 0.2, 0.35], &[0.0, 30.0], 0.01, 3);
    std::fs::write(&csv, scan.to_text()).unwrap();
    let matrix = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../assets/measurements/mecho_6216_goniometer.xml"
    );
    let run = |threads: &str, data: &str, models: &str| {
        let out = dir.path().join("out");
        let output = Command::new(env!("CARGO_BIN_EXE_woven-fit"))
            .env("RAYON_NUM_THREADS", threads)
            .args([
                "fit",
                data,
                "--model",
                models,
                "--starts",
                "2",
                "--out",
                out.to_str().unwrap(),
            ])
            .output()
            .unwrap();
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        (
            std::fs::read(out.join("fit.json")).unwrap(),
            std::fs::read(out.join("report.html")).unwrap(),
            output.stdout,
        )
    };
    for (data, models) in [
        (csv.to_str().unwrap(), "ward,hgf,ggx-mirrored"),
        (matrix, "ward"),
    ] {
        let one = run("1", data, models);
        for threads in ["2", "8"] {
            assert!(
                run(threads, data, models) == one,
                "{data} with {threads} threads"
            );
        }
    }
}
