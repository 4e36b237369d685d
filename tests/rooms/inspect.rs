//! `touchup inspect` at the boundary of the process: hand-made features against hand-made drawings.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

use serde_json::{Value, json};
use touchup::io::mesh_file::{MeshUnit, write_mesh};
use touchup::sim::Plate;

const HEADER: &str = "name,kind,quantity,nominal_mm,tolerance_mm,lower_deviation_mm,upper_deviation_mm,center_x_mm,center_y_mm,center_z_mm";

/// A folder with features.json and, on request, a drawing.
struct Part {
    folder: tempfile::TempDir,
}

impl Part {
    /// A hole of 8.003 mm ± 2 × 0.004 mm at (16 36 12), one of the mesh at (60 10 12), and a blind
    /// one whose floor was not touched.
    fn new() -> Self {
        let hole = |id: u32, center: [f64; 3], diameter: f64| {
            json!({
                "id": id, "kind": "hole", "center_mm": center, "axis": [0, 0, 1], "diameter_mm": diameter, "touched": 0.9,
                "std": {"center_mm": 0.006, "axis_deg": 0.05, "diameter_mm": 0.004}, "fitted_to": "touches",
                "form": {"roundness_mm": 0.0, "std": {"roundness_mm": 0.005}, "coverage": 1.0}
            })
        };
        let mut blind = hole(4, [32.0, 34.0, 12.0], 6.0);
        blind["depth_mm"] = json!(6.4);
        blind["depth_is_at_least"] = json!(true);
        let untouched = json!({
            "id": 3, "kind": "hole", "center_mm": [60, 10, 12], "axis": [0, 0, 1], "diameter_mm": 5.0, "fitted_to": "mesh"
        });
        let part = Self {
            folder: tempfile::tempdir().unwrap(),
        };
        let features =
            json!({ "features": [hole(0, [16.0, 36.0, 12.0], 8.003), untouched, blind] });
        part.write("features.json", &features.to_string());
        part
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap();
    }

    fn inspect(&self, more: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_touchup-tested"));
        command
            .current_dir(self.folder.path())
            .args(["inspect", "features.json"])
            .args(more);
        command.env_remove("RUST_LOG").output().unwrap()
    }

    /// Inspects against rows of a drawing.
    fn against(&self, rows: &[&str], more: &[&str]) -> Output {
        self.write("n.csv", &format!("{HEADER}\n{}\n", rows.join("\n")));
        self.inspect(&[&["--nominal", "n.csv"], more].concat())
    }

    /// Inspects against rows of a drawing; returns the characteristics of the JSON.
    fn characteristics(&self, rows: &[&str], more: &[&str]) -> Vec<Value> {
        let output = self.against(rows, &[&["--json"], more].concat());
        let record: Value =
            serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{output:?}"));
        record["characteristics"].as_array().unwrap().clone()
    }
}

fn code(output: &Output) -> i32 {
    output.status.code().expect("no signal ended it")
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

const BORE: &str = "bore,hole,diameter_mm,8,0.02,,,16,36,12";

#[test]
fn what_conforms_ends_with_0_and_nothing_on_stderr() {
    let output = Part::new().against(&[BORE], &[]);
    assert_eq!(
        (code(&output), text(&output.stderr)),
        (0, ""),
        "{}",
        text(&output.stdout)
    );
    assert!(
        text(&output.stdout).contains("PASS: 1 pass, 0 fail, 0 undecided; rule iso14253, 95 %")
    );
}

#[test]
fn what_does_not_ends_with_4_and_one_line_that_names_it() {
    let rows = [
        BORE,
        "wide,hole,roundness_mm,,0.02,,,16,36,12",
        "narrow,hole,diameter_mm,6.1,0.02,,,32,34,12",
    ];
    let output = Part::new().against(
        &[&rows[..], &["lost,hole,diameter_mm,3,0.1,,,70,40,12"]].concat(),
        &[],
    );
    assert_eq!(code(&output), 4);
    let expected =
        "touchup: done with losses: 1 of 4 out of tolerance: narrow; 1 of 4 undecided: lost\n";
    assert_eq!(text(&output.stderr), expected);
}

/// 8.003 ± 0.004: guard bands of 1.645 × 0.004 = 0.0066 mm, so that ± 0.011 passes, ± 0.009 does
/// not, and neither fails.
#[test]
fn guard_bands_leave_a_value_near_its_limit_undecided_unless_the_rule_is_simple() {
    let part = Part::new();
    let decided = |tolerance: &str, more: &[&str]| {
        let found = part.characteristics(
            &[&format!("bore,hole,diameter_mm,8,{tolerance},,,16,36,12")],
            more,
        );
        found[0]["decision"].as_str().unwrap().to_owned()
    };
    assert_eq!(
        ["0.011", "0.009", "0.002"].map(|tolerance| decided(tolerance, &[])),
        ["pass", "undecided", "undecided"]
    );
    let simple = ["--rule", "simple"];
    assert_eq!(
        ["0.009", "0.002"].map(|tolerance| decided(tolerance, &simple)),
        ["pass", "fail"]
    );
    assert_eq!(decided("0.009", &["--confidence", "0.9"]), "pass");
}

#[test]
fn what_is_not_known_is_undecided_with_its_reason() {
    let rows = [
        "of the mesh,hole,diameter_mm,5,0.1,,,60,10,12",
        "bound,hole,depth_mm,8,0.2,,,32,34,12",
        "beyond,hole,depth_mm,8,0.2,,,16,36,12",
        "far off,hole,diameter_mm,8,0.2,,,5,5,12",
    ];
    let found = Part::new().characteristics(&rows, &[]);
    let reasons = [
        "fitted to the mesh",
        "lower bound",
        "was not measured",
        "no hole was found near (5.0 5.0 12.0) mm",
    ];
    for (one, reason) in found.iter().zip(reasons) {
        assert_eq!(one["decision"], "undecided", "{one}");
        assert!(one["reason"].as_str().unwrap().contains(reason), "{one}");
        assert!(
            one.get("conformance_probability").is_none() && one.get("risk").is_none(),
            "{one}"
        );
    }
}

#[test]
fn a_lower_bound_beyond_the_upper_limit_fails() {
    let found = Part::new().characteristics(&["shallow,hole,depth_mm,5,0.2,,,32,34,12"], &[]);
    assert_eq!(
        (&found[0]["decision"], &found[0]["is_at_least"]),
        (&json!("fail"), &json!(true))
    );
}

#[test]
fn two_features_that_could_be_the_same_are_not_guessed() {
    let part = Part::new();
    let found = part.characteristics(
        &[
            "a,hole,diameter_mm,8,0.1,,,15.2,36,12",
            "b,hole,diameter_mm,8,0.1,,,16.8,36,12",
        ],
        &[],
    );
    for one in &found {
        assert_eq!(one["decision"], "undecided");
        assert!(
            one["reason"]
                .as_str()
                .unwrap()
                .contains("hole 0 could also be another one"),
            "{one}"
        );
    }
    let anywhere = part.characteristics(&["a,hole,diameter_mm,8,5,,,,,"], &["--match-mm", "5"]);
    let reason = anywhere[0]["reason"].as_str().unwrap();
    assert!(
        reason.starts_with("it could be hole") && reason.contains("column feature"),
        "{reason}"
    );
}

#[test]
fn a_bad_drawing_is_3_with_its_line_and_what_to_do() {
    let part = Part::new();
    let output = part.against(
        &[BORE, "bore,hole,diameter_mm,6,0.1,,,32,34,12"],
        &["--json"],
    );
    assert_eq!((code(&output), text(&output.stdout)), (3, ""));
    let error: Value = serde_json::from_slice(&output.stderr).unwrap();
    assert_eq!(error["kind"], "nominal");
    assert_eq!(
        error["message"],
        "n.csv, line 3: the name \"bore\" is that of line 2: give each its own"
    );
    let without = part.against(&["bore,hole,diameter_mm,8,,,,16,36,12"], &[]);
    assert_eq!(code(&without), 3);
    assert!(text(&without.stderr).contains(
        "bore has no tolerance: fill in tolerance_mm or limit deviations, or name a general one"
    ));
    let form = part.against(
        &["round,hole,roundness_mm,,,,,16,36,12"],
        &["--general", "iso2768-m"],
    );
    assert!(
        text(&form.stderr).contains("the general one is for sizes, not for roundness_mm"),
        "{form:?}"
    );
}

#[test]
fn a_general_tolerance_is_that_of_its_class_and_size() {
    let found = Part::new().characteristics(
        &["bore,hole,diameter_mm,8,,,,16,36,12"],
        &["--general", "iso2768-m"],
    );
    let one = &found[0];
    assert_eq!(
        (
            &one["lower_limit_mm"],
            &one["upper_limit_mm"],
            &one["tolerance_from"]
        ),
        (&json!(7.8), &json!(8.2), &json!("iso2768-m"))
    );
}

#[test]
fn wrong_usage_is_2_before_anything_is_read() {
    let part = Part::new();
    part.write("n.csv", HEADER);
    let cases: [(&[&str], &str); 6] = [
        (&[], "--nominal"),
        (
            &["--nominal", "n.csv", "--csv", "n.csv"],
            "--csv would write over n.csv",
        ),
        (
            &["--nominal", "n.csv", "--out", "report.pdf"],
            "must end in .html",
        ),
        (
            &["--nominal", "n.csv", "--confidence", "0.4"],
            "above 0.5 and below 1",
        ),
        (&["--nominal", "n.csv", "--k", "0"], "--k 0 must be above 0"),
        (
            &["--nominal", "n.csv", "--general", "iso2768-x"],
            "iso2768-f, iso2768-m, iso2768-c, iso2768-v",
        ),
    ];
    for (arguments, expected) in cases {
        let output = part.inspect(arguments);
        assert_eq!(
            (code(&output), text(&output.stdout)),
            (2, ""),
            "{arguments:?}"
        );
        assert!(
            text(&output.stderr).contains(expected),
            "{arguments:?}: {}",
            text(&output.stderr)
        );
    }
}

#[test]
fn a_folder_without_features_says_who_writes_them() {
    let empty = tempfile::tempdir().unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_touchup-tested"))
        .args(["inspect", "--nominal", "n.csv"])
        .arg(empty.path())
        .output()
        .unwrap();
    assert_eq!(code(&output), 2);
    assert!(
        text(&output.stderr).contains("has no features.json: refine --features-out"),
        "{output:?}"
    );
}

#[test]
fn a_report_asks_for_nothing_outside_and_keeps_names_as_text() {
    let part = Part::new();
    let row = "<script>alert(1)</script> & \u{dc}ber,hole,diameter_mm,8,0.02,,,16,36,12";
    let output = part.against(
        &[row],
        &[
            "--out",
            "r.html",
            "--qif",
            "r.qif",
            "--part",
            "</style><script>\"'",
        ],
    );
    assert_eq!(code(&output), 0, "{output:?}");
    let page = fs::read_to_string(part.path("r.html")).unwrap();
    for foreign in [
        "<script", "http:", "https:", "url(", "@import", "<link", "src=",
    ] {
        assert!(!page.contains(foreign), "{foreign}");
    }
    assert!(page.contains("&lt;script&gt;alert(1)&lt;/script&gt; &amp; \u{dc}ber"));
    assert_eq!(page.matches("</style>").count(), 1);
    let qif = fs::read_to_string(part.path("r.qif")).unwrap();
    assert!(qif.contains("<Name>&lt;script&gt;alert(1)&lt;/script&gt; &amp; \u{dc}ber</Name>"));
}

#[test]
fn touches_of_another_measurement_are_refused() {
    let part = Part::new();
    let mut features: Value =
        serde_json::from_slice(&fs::read(part.path("features.json")).unwrap()).unwrap();
    features["features"][0]["touches"] = json!({ "diameter_mm": [[10, 20]] });
    part.write("features.json", &features.to_string());
    part.write(
        "touches.csv",
        &format!("{}\n", touchup::io::touches_file::HEADER),
    );
    let output = part.against(&[BORE], &[]);
    assert_eq!(code(&output), 3);
    assert!(
        text(&output.stderr)
            .contains("has 0 touches and the features name touch 20: it is of another measurement")
    );
}

#[test]
fn nominal_values_written_from_features_are_read_again() {
    let part = Part::new();
    let written = part.inspect(&["--write-nominal", "t.csv"]);
    assert_eq!(code(&written), 0, "{written:?}");
    assert!(text(&written.stdout).contains("3 characteristics; fill in the tolerances"));
    assert!(
        fs::read_to_string(part.path("t.csv"))
            .unwrap()
            .contains("MEASURED features: replace them")
    );
    let output = part.inspect(&["--nominal", "t.csv", "--general", "iso2768-m", "--json"]);
    let record: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        record["counts"],
        json!({"pass": 2, "fail": 0, "undecided": 1}),
        "the one of the mesh is not decided"
    );
}

/// The plate has one hole of 8 mm at (16 36) and a blind one of 6 mm, 8 mm deep, at (32 34).
#[test]
fn features_of_a_cad_mesh_are_nominal_values() {
    let part = Part::new();
    write_mesh(
        &part.path("cad.ply"),
        &Plate::default().mesh(10e-6).unwrap(),
        MeshUnit::Millimetre,
    )
    .unwrap();
    let without = part.inspect(&["--nominal", "cad.ply"]);
    assert_eq!(code(&without), 2);
    assert!(text(&without.stderr).contains("a CAD mesh has no tolerances"));
    let output = part.inspect(&["--nominal", "cad.ply", "--general", "iso2768-m", "--json"]);
    let record: Value = serde_json::from_slice(&output.stdout).unwrap();
    let of_hole = |id: u64| {
        let all = record["characteristics"].as_array().unwrap().iter();
        all.filter(move |one| one["feature"] == id)
            .map(|one| {
                (
                    one["quantity"].as_str().unwrap(),
                    one["decision"].as_str().unwrap(),
                )
            })
            .collect::<Vec<_>>()
    };
    assert_eq!(of_hole(0), [("diameter_mm", "pass")], "{record}");
    assert_eq!(
        of_hole(4),
        [("diameter_mm", "pass"), ("depth_mm", "undecided")],
        "{record}"
    );
    let missing: Vec<_> = record["characteristics"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|one| one.get("feature").is_none())
        .collect();
    assert!(
        missing.iter().all(|one| one["decision"] == "undecided") && missing.len() >= 5,
        "slot and boss are not in the features: {record}"
    );
    assert_eq!(record["without_characteristic"], json!([3]));
}

/// A flag whose hole the second to the fourth of its touches measured, numbered from 1 on.
#[test]
#[expect(clippy::too_many_lines)]
fn the_folder_of_a_probing_is_inspected_by_the_features_of_its_flags() {
    let part = Part::new();
    let touch = |index: usize, x: f64, y: f64| {
        let (centre, approach) = ([16.0 + 2.5 * x, 36.0 + 2.5 * y, 9.0], [x, y, 0.0]);
        let curve = [
            [0.0, 0.0, 0.0, 0.0],
            [0.1, 0.2, 1.5, 0.1],
            [0.2, 0.3, 3.0, 0.1],
        ];
        json!({
            "flag": 7, "index": index, "begun_ns": 100 * index, "ended_ns": 100 * index + 50, "verdict": "clean", "accepted": true,
            "from_mm": [16, 36, 9], "approach": approach, "search_mm": 4.0, "centre_mm": centre, "sigma_mm": 0.01,
            "tip_radius_mm": 1.5, "curve": curve
        })
        .to_string()
    };
    let touches = [
        touch(0, 1.0, 0.0),
        touch(1, 1.0, 0.0),
        touch(2, 0.0, 1.0),
        touch(3, -1.0, 0.0),
    ];
    part.write("probed_touches.jsonl", &(touches.join("\n") + "\n"));
    let mut features: Value =
        serde_json::from_slice(&fs::read(part.path("features.json")).unwrap()).unwrap();
    let mut hole = features["features"][0].take();
    hole["diameter_mm"] = json!(8.0);
    hole["touches"] = json!({ "diameter_mm": [[2, 4]] });
    part.write(
        "probed.json",
        &json!({ "features": [{ "flag": 7, "feature": hole }, { "flag": 8 }] }).to_string(),
    );
    part.write("n.csv", &format!("{HEADER}\n{BORE}\n"));
    let output = Command::new(env!("CARGO_BIN_EXE_touchup-tested"))
        .current_dir(part.folder.path())
        .args([
            "inspect",
            ".",
            "--nominal",
            "n.csv",
            "--out",
            "r.html",
            "--json",
        ])
        .output()
        .unwrap();
    assert_eq!(code(&output), 0, "{output:?}");
    let record: Value = serde_json::from_slice(&output.stdout).unwrap();
    let one = &record["characteristics"][0];
    assert_eq!((&one["feature"], &one["touches"]), (&json!(7), &json!(3)));
    assert!(
        record["notes"][0]
            .as_str()
            .unwrap()
            .starts_with("Measured by an arm")
    );
    let page = fs::read_to_string(part.path("r.html")).unwrap();
    assert!(page.contains("1.1: force of 3 touches of the arm, 0 of them rejected"));
    // each ball touches the wall of 8 mm: its centre 2.5 mm from the axis, its radius 1.5 mm
    assert!(
        page.contains("<td>3</td><td>0.0</td><td>0.0</td><td>10.0</td>"),
        "touches, rms, largest and stated, in um"
    );
}
