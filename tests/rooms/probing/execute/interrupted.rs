//! A probing with an end from outside: the measured features are there, the command gives the
//! reason, and `--resume` goes on.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use serde_json::Value;
use tempfile::TempDir;
use touchup::io::probed_touches_file::{TouchLine, read_probed_touches};
use touchup::io::recording::{RecordingReader, Topics};
use touchup::io::tables::static_poses::read_static_poses;
use touchup::stylus::Message;

use super::command::cell;

/// Longest wait for a file of another process; it takes seconds.
const PATIENCE: Duration = Duration::from_secs(120);

/// An edge and a hole of the plate, each from a click beside it.
const FEATURES: [&str; 4] = ["--feature", "edge@59,23,12", "--feature", "hole@17,35,12"];

/// `touchup probe` of a cell, in a folder of its own.
struct Case {
    folder: TempDir,
    files: [String; 2],
}

impl Case {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let files = cell(folder.path(), |scene| scene);
        Self { folder, files }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn command(&self, out: &str, more: &[&str]) -> Command {
        let [scene, truth] = &self.files;
        let mut command = Command::new(env!("CARGO_BIN_EXE_touchup-tested"));
        let out = self.path(out);
        let arguments = [
            "probe",
            "--robot",
            "sim",
            "--scene",
            scene,
            "--truth",
            truth,
            "--out",
            out.to_str().unwrap(),
        ];
        command
            .args(arguments)
            .args(more)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        command
    }

    fn run(&self, out: &str, more: &[&str]) -> Output {
        self.command(out, more).output().unwrap()
    }

    /// Starts a probing of [`FEATURES`], and freezes it in the middle of the second one, after the
    /// end of the first.
    fn frozen_in_second(&self, out: &str) -> Child {
        let mut child = self.command(out, &FEATURES).spawn().unwrap();
        let begun = Instant::now();
        while !touches(&self.path(out)).iter().any(|touch| touch.flag == 2) {
            assert!(
                begun.elapsed() < PATIENCE && child.try_wait().unwrap().is_none(),
                "the second is never begun"
            );
            sleep(Duration::from_millis(5));
        }
        signal(&child, "STOP");
        // its last action is over once the system says so
        while !state_of(&child).starts_with('T') {
            assert!(begun.elapsed() < PATIENCE, "it does not stop");
            sleep(Duration::from_millis(5));
        }
        let records = records(&self.path(out));
        assert_eq!(
            records
                .iter()
                .map(|record| &record["flag"])
                .collect::<Vec<_>>(),
            [1]
        );
        child
    }
}

fn touches(out: &Path) -> Vec<TouchLine> {
    read_probed_touches(&out.join("probed_touches.jsonl")).unwrap()
}

fn records(out: &Path) -> Vec<Value> {
    let probed: Value =
        serde_json::from_slice(&fs::read(out.join("probed.json")).unwrap()).unwrap();
    probed["features"].as_array().unwrap().clone()
}

/// The samples of a recording, ns of each pose and wrench.
fn stamps(out: &Path) -> Vec<i64> {
    let topics = Topics {
        pose: "/probe/pose".to_owned(),
        wrench: "/probe/wrench".to_owned(),
        markers: None,
    };
    let reader = RecordingReader::open(&out.join("recording"), &topics).unwrap();
    reader
        .map_while(Result::ok)
        .map(|message: Message| message.stamp_ns())
        .collect()
}

fn signal(child: &Child, name: &str) {
    let sent = Command::new("kill")
        .args([&format!("-{name}"), &child.id().to_string()])
        .status()
        .unwrap();
    assert!(sent.success());
}

/// State letter of the system: R runs, S sleeps, T stands.
fn state_of(child: &Child) -> String {
    let status = fs::read_to_string(format!("/proc/{}/stat", child.id())).unwrap();
    status.rsplit(") ").next().unwrap().to_owned()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// All samples of each touch are on the disk.
fn recording_holds(touches: &[TouchLine], stamps: &[i64]) {
    let [first, last] = [stamps.iter().min().unwrap(), stamps.iter().max().unwrap()];
    for touch in touches {
        let (Some(begun), Some(ended)) = (touch.begun_ns, touch.ended_ns) else {
            continue;
        };
        assert!(
            begun >= *first && ended <= *last,
            "touch {} of {}",
            touch.index,
            touch.flag
        );
    }
}

/// The features equal those of an uninterrupted probing: sizes and places agree within three
/// standard deviations of their difference.
fn found_as_by(whole: &[Value], resumed: &[Value]) {
    assert_eq!(whole.len(), resumed.len());
    for (one, other) in whole.iter().zip(resumed) {
        assert_eq!(
            [&one["flag"], &one["kind"], &one["code"]],
            [&other["flag"], &other["kind"], &other["code"]]
        );
        let (one, other) = (&one["feature"], &other["feature"]);
        let allowed = |key: &str| {
            let std = |of: &Value| of["std"][key].as_f64().unwrap();
            3.0 * std(one).hypot(std(other))
        };
        if let (Some(a), Some(b)) = (one["diameter_mm"].as_f64(), other["diameter_mm"].as_f64()) {
            assert!((a - b).abs() < allowed("diameter_mm"), "{a} {b}");
        }
        let place = |of: &Value| [0, 1].map(|axis| of["center_mm"][axis].as_f64().unwrap());
        let across = match one["axis"].as_array().filter(|_| one["kind"] == "edge") {
            // the place along an edge is arbitrary
            Some(axis) => [-axis[1].as_f64().unwrap(), axis[0].as_f64().unwrap()],
            None => [1.0, 0.0],
        };
        let off = [0, 1].map(|axis| place(one)[axis] - place(other)[axis]);
        let off = off[0] * across[0] + off[1] * across[1];
        assert!(off.abs() < allowed("center_mm"), "{off} mm: {one} {other}");
    }
}

#[test]
#[ignore = "a slow proof"]
fn a_killed_probing_keeps_each_touch_and_goes_on_with_the_rest() {
    let case = Case::new();
    let out = case.path("out");
    let mut child = case.frozen_in_second("out");
    signal(&child, "KILL");
    child.wait().unwrap();
    let kept = touches(&out);
    assert!(kept.iter().filter(|touch| touch.flag == 2).count() > 0);
    recording_holds(&kept, &stamps(&out));

    // a rerun without `--resume` loses nothing
    let refused = case.run("out", &FEATURES);
    assert_eq!(refused.status.code(), Some(2), "{}", text(&refused.stderr));
    assert!(
        text(&refused.stderr).contains("1 of 2 features finished: go on with --resume"),
        "{}",
        text(&refused.stderr)
    );
    let other = case.run("out", &["--feature", "edge@59,23,12", "--resume"]);
    assert_eq!(other.status.code(), Some(2), "{}", text(&other.stderr));
    assert!(
        text(&other.stderr).contains("the list of features differs"),
        "{}",
        text(&other.stderr)
    );
    assert_eq!(touches(&out).len(), kept.len());

    let resumed = case.run("out", &[&FEATURES[..], &["--resume"]].concat());
    assert_eq!(resumed.status.code(), Some(0), "{}", text(&resumed.stderr));
    let all = touches(&out);
    let line = |touch: &TouchLine| serde_json::to_string(touch).unwrap();
    assert_eq!(
        all[..kept.len()].iter().map(line).collect::<Vec<_>>(),
        kept.iter().map(line).collect::<Vec<_>>()
    );
    assert!(
        all[kept.len()..].iter().all(|touch| touch.flag == 2),
        "the first feature was finished"
    );
    let stamps = stamps(&out);
    assert!(
        stamps.windows(2).all(|pair| pair[0] <= pair[1]),
        "the clock of the recording goes on"
    );
    recording_holds(&all, &stamps);

    assert_eq!(case.run("whole", &FEATURES).status.code(), Some(0));
    let whole = records(&case.path("whole"));
    let both = records(&out);
    assert_eq!(both[0], whole[0], "what was finished is as it was");
    found_as_by(&whole, &both);
    for name in ["refined.ply", "features.json", "touches.png"] {
        assert!(out.join(name).exists(), "{name}");
    }
}

#[test]
fn a_recording_of_something_else_is_not_written_over() {
    let case = Case::new();
    let recording = case.path("out/recording");
    fs::create_dir_all(&recording).unwrap();
    fs::write(recording.join("touch_0000.mcap"), "measured").unwrap();
    for (more, why) in [
        (&[][..], "out/recording is there and of no probing"),
        (&["--resume"], "holds no probing to go on with"),
    ] {
        let refused = case.run("out", &[&FEATURES[..], more].concat());
        assert_eq!(refused.status.code(), Some(2), "{}", text(&refused.stderr));
        assert!(
            text(&refused.stderr).contains(why),
            "{}",
            text(&refused.stderr)
        );
    }
    assert_eq!(
        fs::read(recording.join("touch_0000.mcap")).unwrap(),
        b"measured"
    );
}

#[test]
fn an_interrupted_probing_retracts_says_so_and_has_an_exit_code_of_its_own() {
    let case = Case::new();
    for name in ["INT", "TERM"] {
        let out = case.path(name);
        let child = case.frozen_in_second(name);
        let before = touches(&out).len();
        signal(&child, name);
        signal(&child, "CONT");
        let done = child.wait_with_output().unwrap();
        let (told, stderr) = (text(&done.stdout), text(&done.stderr));
        assert_eq!(done.status.code(), Some(130), "{stderr}");
        assert!(
            stderr.contains(
                "touchup: the arm stops and retracts; a second signal has it stay where it is"
            ),
            "{stderr}"
        );
        let last = stderr.lines().last().unwrap();
        let words = "touchup: interrupted: the arm stopped and retracted; 1 of 2 features are finished, the touches (";
        assert!(
            last.starts_with(words) && last.ends_with("--resume goes on"),
            "{stderr}"
        );
        assert!(
            told.contains("hole 2: cancelled: the arm stopped and retracted"),
            "{told}"
        );
        let codes: Vec<_> = records(&out)
            .iter()
            .map(|record| record["code"].clone())
            .collect();
        assert_eq!(codes, ["tolerance_reached", "cancelled"]);
        let touches = touches(&out);
        assert!(touches.len() >= before);
        recording_holds(&touches, &stamps(&out));
        // the recording has its proper end
        assert!(out.join("recording/metadata.yaml").exists());
    }
}

#[test]
fn a_check_that_is_interrupted_keeps_its_touches() {
    let case = Case::new();
    let ([scene, truth], path) = (&case.files, case.path("touches.jsonl"));
    let arguments = [
        "check",
        "--robot",
        "sim",
        "--scene",
        scene,
        "--truth",
        truth,
        "--spot",
        "45,8,12",
        "--touches",
        "100",
    ];
    let mut command = Command::new(env!("CARGO_BIN_EXE_touchup-tested"));
    command
        .args(arguments)
        .args(["--touches-out", path.to_str().unwrap()]);
    let mut child = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while read_probed_touches(&path).unwrap().len() < 2 {
        assert!(
            begun.elapsed() < PATIENCE && child.try_wait().unwrap().is_none(),
            "it does not touch"
        );
        sleep(Duration::from_millis(5));
    }
    signal(&child, "INT");
    let done = child.wait_with_output().unwrap();
    let stderr = text(&done.stderr);
    assert_eq!(done.status.code(), Some(130), "{stderr}");
    let made = read_probed_touches(&path).unwrap();
    assert!(made.len() >= 2 && made.len() < 100);
    let words = format!(
        "interrupted: the arm stopped and retracted; the touches ({}) are in {}",
        made.len(),
        path.display()
    );
    assert!(stderr.contains(&words), "{stderr}");
}

#[test]
fn a_payload_identification_that_is_interrupted_keeps_its_static_segments() {
    let case = Case::new();
    let ([scene, truth], path) = (&case.files, case.path("segments.csv"));
    let out = case.path("weighed.yaml");
    let identify = |more: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_touchup-tested"));
        command.args([
            "calibrate",
            "payload",
            "--robot",
            "sim",
            "--scene",
            scene,
            "--truth",
            truth,
        ]);
        command
            .args(["--truth-payload-kg", "1.17", "--out", out.to_str().unwrap()])
            .args(more);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    };
    let kept = ["--segments-out", path.to_str().unwrap()];
    let mut child = identify(&kept).spawn().unwrap();
    let begun = Instant::now();
    while fs::read_to_string(&path).map_or(0, |text| text.lines().count()) < 3 {
        assert!(
            begun.elapsed() < PATIENCE && child.try_wait().unwrap().is_none(),
            "it does not measure"
        );
        sleep(Duration::from_millis(5));
    }
    signal(&child, "INT");
    let done = child.wait_with_output().unwrap();
    let stderr = text(&done.stderr);
    assert_eq!(done.status.code(), Some(130), "{stderr}");
    let made = read_static_poses(&path).unwrap();
    assert!(made.len() >= 2 && made.len() < 13, "{}", made.len());
    let words = format!(
        "; the static segments ({}) are in {}",
        made.len(),
        path.display()
    );
    assert!(stderr.contains(&words), "{stderr}");
    assert!(!out.exists(), "nothing is concluded from a part of them");

    // the complete file is the input of the identification: its weight is that of 1.17 kg
    assert_eq!(identify(&kept).output().unwrap().status.code(), Some(0));
    let all = read_static_poses(&path).unwrap();
    let forces: Vec<_> = all
        .iter()
        .map(|(r_bf, wrench)| r_bf * wrench.force)
        .collect();
    // the bias turns with the flange, the weight does not: the mean over a cone has little across
    // it
    let mean = forces.iter().sum::<nalgebra::Vector3<f64>>() / forces.len() as f64;
    assert!(
        (mean.norm() - 1.17 * 9.81).abs() < 1.3,
        "{mean} N of {} segments",
        all.len()
    );
}
