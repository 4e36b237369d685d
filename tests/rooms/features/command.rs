//! `touchup features`, and features of `touchup refine`, at the boundary of the process: exit
//! codes, files, stdout.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

use serde_json::Value;
use touchup::io::mesh_file::{MeshUnit, write_mesh};
use touchup::io::touches_file::HEADER;
use touchup::sim::wavy;

fn touchup(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_touchup-tested"))
        .args(arguments)
        .env_remove("RUST_LOG")
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

fn parts_of(output: &Output) -> (i32, &str, &str) {
    (
        output.status.code().expect("no signal ended it"),
        text(&output.stdout),
        text(&output.stderr),
    )
}

fn done(output: &Output) -> &str {
    let (code, stdout, stderr) = parts_of(output);
    assert_eq!((code, stderr), (0, ""));
    stdout
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn name(&self, name: &str) -> String {
        self.path(name).to_str().unwrap().to_owned()
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap()
    }

    fn json(&self, name: &str) -> Value {
        serde_json::from_slice(&self.bytes(name)).unwrap()
    }
}

/// The plate by its drawing, and a file of one touch.
fn drawn() -> Folder {
    let folder = Folder::new();
    let plate = touchup::sim::Plate::default().mesh(10e-6).unwrap();
    write_mesh(&folder.path("plate.ply"), &plate, MeshUnit::Millimetre).unwrap();
    fs::write(folder.path("touches.csv"), format!("{HEADER}\n{TOUCH}\n")).unwrap();
    folder
}

const TOUCH: &str =
    "0,1000000000,0,10.0,10.0,13.5,1.5,10.0,10.0,12.0,0.0,0.0,1.0,0.01,0.002,0.0,1.0,0";

#[test]
fn bad_input_is_3_in_one_line_that_names_it() {
    let folder = drawn();
    let (plate, out) = (folder.name("plate.ply"), folder.name("out.json"));
    let with_touches = |content: &str| {
        fs::write(folder.path("bad.csv"), content).unwrap();
        touchup(&[
            "features",
            &plate,
            "--touches",
            &folder.name("bad.csv"),
            "--out",
            &out,
        ])
    };
    let second = TOUCH.replacen("0,", "1,", 1);
    let cases = [
        (
            touchup(&["features", &folder.name("no.ply"), "--out", &out]),
            "no.ply",
        ),
        (
            touchup(&["features", &folder.name("touches.csv"), "--out", &out]),
            "touches.csv",
        ),
        (
            touchup(&[
                "features",
                &plate,
                "--touches",
                &folder.name("no.csv"),
                "--out",
                &out,
            ]),
            "no.csv",
        ),
        (
            with_touches(&format!(
                "{HEADER}\n{TOUCH}\n{}\n",
                second.replacen("12.0", "nan", 1)
            )),
            "bad.csv, line 3",
        ),
        (
            with_touches(&format!("{HEADER}\n\n{TOUCH}\n{}\n", &second[..30])),
            "bad.csv, line 4",
        ),
        (
            with_touches(&format!("{TOUCH}\n")),
            "touchup refine --touches-out",
        ),
        (with_touches(""), "bad.csv"),
    ];
    for (output, named) in &cases {
        let (code, stdout, stderr) = parts_of(output);
        assert_eq!((code, stdout), (3, ""), "{named}: {stderr}");
        assert!(
            stderr.contains(named) && stderr.lines().count() == 1,
            "{named}: {stderr}"
        );
    }
    assert!(!folder.path("out.json").exists());
}

#[test]
fn outputs_over_inputs_are_refused() {
    let folder = drawn();
    for (input, flag) in [("plate.ply", "MESH"), ("touches.csv", "--touches")] {
        let (before, out) = (folder.bytes(input), folder.name(&format!("./{input}")));
        let output = touchup(&[
            "features",
            &folder.name("plate.ply"),
            "--touches",
            &folder.name("touches.csv"),
            "--out",
            &out,
        ]);
        let (code, stdout, stderr) = parts_of(&output);
        assert!(
            (code, stdout) == (2, "") && stderr.contains(&format!("which {flag} reads")),
            "{code}: {stderr}"
        );
        assert_eq!(folder.bytes(input), before);
    }
    let nowhere = touchup(&[
        "features",
        &folder.name("plate.ply"),
        "--out",
        &folder.name("no/out.json"),
    ]);
    let (code, stdout, stderr) = parts_of(&nowhere);
    assert!(
        (code, stdout) == (1, "") && stderr.contains("out.json"),
        "{code}: {stderr}"
    );
}

#[test]
fn a_mesh_with_nothing_on_it_gives_an_empty_list() {
    let folder = Folder::new();
    write_mesh(
        &folder.path("wavy.ply"),
        &wavy::wavy_plate(20_000).unwrap(),
        MeshUnit::Millimetre,
    )
    .unwrap();
    let features = [
        "features",
        &folder.name("wavy.ply"),
        "--out",
        &folder.name("out.json"),
    ];
    let words = done(&touchup(&features)).to_owned();
    assert!(
        words.contains("no features") && words.contains("out.json"),
        "{words}"
    );
    assert_eq!(folder.json("out.json")["features"], serde_json::json!([]));
    let report: Value =
        serde_json::from_str(done(&touchup(&[&features[..], &["--json"]].concat()))).unwrap();
    assert_eq!(report, folder.json("out.json"));
    assert!(
        words.contains("not looked at") && report["unexplained"].as_f64().unwrap() > 0.1,
        "{words} {report}"
    );
}

/// Fields that the issue names for each kind, without those that only touches give.
fn documented(kind: &str) -> &'static [&'static str] {
    match kind {
        "hole" => &[
            "axis",
            "center_mm",
            "depth_mm",
            "diameter_mm",
            "facets_mm",
            "form",
            "through",
        ],
        "boss" => &[
            "axis",
            "center_mm",
            "depth_mm",
            "diameter_mm",
            "facets_mm",
            "form",
        ],
        "slot" => &[
            "axis",
            "center_mm",
            "depth_mm",
            "direction",
            "facets_mm",
            "length_mm",
            "points_mm",
            "through",
            "width_mm",
        ],
        "edge" => &["axis", "center_mm", "convex", "length_mm", "points_mm"],
        "corner" => &["center_mm"],
        "plane" => &["axis", "center_mm"],
        other => panic!("the plate has no {other}"),
    }
}

#[test]
#[expect(clippy::too_many_lines)]
fn json_has_the_documented_fields() {
    let folder = drawn();
    let output = touchup(&["features", &folder.name("plate.ply"), "--json"]);
    let stdout = done(&output);
    assert_eq!(stdout.lines().count(), 1);
    let file: Value = serde_json::from_str(stdout).unwrap();
    let features = file["features"].as_array().unwrap();
    let count = |kind: &str| {
        features
            .iter()
            .filter(|feature| feature["kind"] == kind)
            .count()
    };
    // a block with a step is a prism over a hexagon: 18 edges, 12 corners; the slot lies between y
    // = 10 and 18 mm
    assert_eq!(
        ["hole", "pocket", "boss", "corner"].map(count),
        [2, 0, 1, 12]
    );
    let is_of_slot = |feature: &&Value| {
        let at = |i: usize| feature["center_mm"][i].as_f64().unwrap();
        (14.0..36.0).contains(&at(0)) && (10.0..18.0).contains(&at(1))
    };
    let edges: Vec<_> = features
        .iter()
        .filter(|feature| feature["kind"] == "edge")
        .collect();
    assert_eq!(edges.iter().filter(|edge| !is_of_slot(edge)).count(), 18);
    for (at, feature) in features.iter().enumerate() {
        assert_eq!(feature["id"], at);
        assert!(
            feature["fitted_to"] == "mesh" && feature["touched"] == 0.0,
            "{feature}"
        );
        let mut wanted = [
            documented(feature["kind"].as_str().unwrap()),
            &["fitted_to", "id", "kind", "touched"],
        ]
        .concat();
        wanted.sort_unstable();
        let given = feature
            .as_object()
            .unwrap()
            .keys()
            .map(String::as_str)
            .filter(|key| *key != "std");
        assert_eq!(given.collect::<Vec<_>>(), wanted, "{feature}");
        for (name, std) in feature["std"].as_object().into_iter().flatten() {
            let is_number =
                feature.get(name).is_some() || name == "axis_deg" && feature.get("axis").is_some();
            assert!(
                is_number && std.as_f64().unwrap() >= 0.0,
                "{name} of {feature}"
            );
        }
    }
    let hole = |diameter: f64| {
        let is = |hole: &&Value| {
            hole["kind"] == "hole" && (hole["diameter_mm"].as_f64().unwrap() - diameter).abs() < 0.1
        };
        features.iter().find(is).unwrap()
    };
    assert_eq!(
        (&hole(8.0)["through"], &hole(6.0)["through"]),
        (&true.into(), &false.into())
    );
}

#[test]
#[ignore = "a slow proof"]
#[expect(clippy::too_many_lines)]
fn features_of_the_files_are_those_of_refine() {
    let folder = Folder::new();
    done(&touchup(&["demo", "--out", &folder.name("")]));
    let [refined, touches, scan, bag] =
        ["refined.ply", "touches.csv", "scan.ply", "touch.mcap"].map(|n| folder.name(n));
    for out in ["one.json", "two.json"] {
        done(&touchup(&[
            "features",
            &refined,
            "--touches",
            &touches,
            "--out",
            &folder.name(out),
        ]));
        assert!(folder.bytes("features.json") == folder.bytes(out), "{out}");
    }
    let output = touchup(&["features", &refined, "--touches", &touches, "--json"]);
    let printed: Value = serde_json::from_str(done(&output)).unwrap();
    assert_eq!(printed, folder.json("features.json"));
    done(&touchup(&[
        "features",
        &refined,
        "--out",
        &folder.name("untouched.json"),
    ]));
    let fitted_to = |name: &str, to: &str| {
        let file = folder.json(name);
        file["features"]
            .as_array()
            .unwrap()
            .iter()
            .filter(|feature| feature["fitted_to"] == to)
            .count()
    };
    assert!(
        fitted_to("features.json", "touches") >= 4 && fitted_to("untouched.json", "touches") == 0
    );

    // by refine itself, once more
    let again = ["features_2.json", "touches_2.csv", "refined_2.ply"].map(|name| folder.name(name));
    let refine = [
        "refine",
        "--scan",
        &scan,
        "--bag",
        &bag,
        "--features-out",
        &again[0],
        "--touches-out",
        &again[1],
    ];
    let tip = ["--tip-radius-mm", "1.5"];
    done(&touchup(
        &[&refine[..], &tip, &["--out", &again[2], "--json"]].concat(),
    ));
    for (first, again) in [
        ("features.json", "features_2.json"),
        ("touches.csv", "touches_2.csv"),
        ("refined.ply", "refined_2.ply"),
    ] {
        assert!(folder.bytes(first) == folder.bytes(again), "{first}");
    }

    // refuses to overwrite inputs and its own outputs
    let out = folder.name("out.ply");
    let flags = |features: &str, touches: &str| {
        let refine = [
            "refine",
            "--scan",
            &scan,
            "--bag",
            &bag,
            "--out",
            &out,
            "--tip-radius-mm",
            "1.5",
        ];
        touchup(
            &[
                &refine[..],
                &["--features-out", features, "--touches-out", touches],
            ]
            .concat(),
        )
    };
    let before = [folder.bytes("scan.ply"), folder.bytes("touch.mcap")];
    let free = folder.name("free");
    for (features, touches, named) in [
        (&scan, &free, "which --scan reads"),
        (&free, &scan, "which --scan reads"),
        (&bag, &free, "which --bag reads"),
        (&free, &bag, "which --bag reads"),
        (&free, &free, "--features-out"),
        (&out, &free, "--out"),
        (&free, &out, "--out"),
    ] {
        let output = flags(features, touches);
        let (code, stdout, stderr) = parts_of(&output);
        assert!(
            (code, stdout) == (2, "") && stderr.contains(named),
            "{features} {touches}: {code} {stderr}"
        );
    }
    let nowhere = folder.name("no/file");
    for (features, touches) in [(&nowhere, &free), (&free, &nowhere)] {
        let output = flags(features, touches);
        let (code, stdout, stderr) = parts_of(&output);
        assert!(
            (code, stdout) == (1, "") && stderr.contains("no/file"),
            "{code} {stderr}"
        );
    }
    assert!(!folder.path("out.ply").exists() && !folder.path("free").exists());
    assert!(before == [folder.bytes("scan.ply"), folder.bytes("touch.mcap")]);
}
