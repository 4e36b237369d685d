//! A recording whose part moved half way: refused, and made one mesh by what the touches show.

use std::fs;
use std::path::Path;
use std::sync::LazyLock;

use nalgebra::{Isometry3, Point3, Vector3};
use touchup::diagnose::{InputCause, InputCorrection, InputFinding};
use touchup::io::mesh_file::{MeshUnit, write_mesh};
use touchup::io::recording::{Topics, write_recording};
use touchup::mesh::TriMesh;
use touchup::reconstruct::Support;
use touchup::refinement::{
    AcceptedScene, InputNames, RefinedScan, RefinementError, RefinementInput, RefinementOptions,
    refine,
};
use touchup::replay::Recording;
use touchup::scene::Scene;
use touchup::session::RefinedMesh;
use touchup::sim::{
    PathParams, Plate, ScannerParams, StylusParams, Surface, plan_demo, scan, touch,
};
use touchup::stylus::{
    ClockEvidence, ClockOffset, KnownChange, Message, ProbedPoint, StampedPose, WrenchFrame,
    motion_about,
};

use crate::cli::{code, json, text, touchup};

const SCENE: &str = "tip: { radius_mm: 1.5, stiffness_n_per_mm: 20 }\n";
/// Motion of the part: about this place, by this shift, m, and turn, rad.
const ABOUT: [f64; 3] = [30e-3, 25e-3, 10e-3];
const SHIFT: [f64; 3] = [0.5e-3, -0.4e-3, 0.6e-3];
const TURN: [f64; 3] = [4e-3, -6e-3, 8e-3];

/// The demo plate, scanned, and touched twice all over.
struct TouchedTwice {
    scan: TriMesh,
    messages: Vec<Message>,
    /// begin of the second time
    middle_ns: i64,
}

static TOUCHED_TWICE: LazyLock<TouchedTwice> = LazyLock::new(|| {
    let plate = Plate::default();
    let hand = PathParams {
        pitch: 3e-3,
        ..PathParams::default()
    };
    let once = plan_demo(&plate, &hand).unwrap();
    let path = [once.clone(), once].concat();
    let messages = touch(&plate, &path, &StylusParams::default(), 3)
        .unwrap()
        .messages;
    let stamps = || messages.iter().map(Message::stamp_ns);
    let [first, last] = [stamps().min(), stamps().max()].map(Option::unwrap);
    TouchedTwice {
        scan: scan(&plate, &ScannerParams::default()).unwrap(),
        middle_ns: first + (last - first) / 2,
        messages,
    }
});

fn motion() -> Isometry3<f64> {
    motion_about(&ABOUT.into(), &SHIFT.into(), &TURN.into())
}

/// The poses follow the part, which moved half way.
fn moved() -> Vec<Message> {
    let TouchedTwice {
        messages,
        middle_ns,
        ..
    } = &*TOUCHED_TWICE;
    let moved = |message: &Message| match *message {
        Message::Pose(StampedPose { stamp_ns, pose_ot }) if stamp_ns >= *middle_ns => {
            let pose_ot = motion() * pose_ot;
            Message::Pose(StampedPose { stamp_ns, pose_ot })
        }
        other => other,
    };
    messages.iter().map(moved).collect()
}

fn refined(
    scene: &Scene,
    messages: Vec<Message>,
    force: bool,
) -> Result<RefinedScan, RefinementError> {
    let input = RefinementInput::new(scene.clone(), TOUCHED_TWICE.scan.clone())?;
    let recording = Recording::of_messages(messages, WrenchFrame::Sensor);
    let names = InputNames {
        scan: Path::new("the scan"),
        recording: Path::new("the recording"),
    };
    let options = RefinementOptions {
        force,
        ..RefinementOptions::default()
    };
    refine(input, recording, None, options, names, &mut || {})
}

/// Root mean square distance of the touched vertices from the plate, m.
fn error(RefinedMesh { mesh, support, .. }: &RefinedMesh) -> f64 {
    let plate = Plate::default();
    let all = mesh.positions().iter().zip(support);
    let touched = all.filter(|(_, support)| **support == Support::Touched);
    let squares: Vec<f64> = touched
        .map(|(place, _)| plate.signed_distance(place).powi(2))
        .collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

fn unsound(refused: Result<RefinedScan, RefinementError>) -> InputFinding {
    match refused {
        Err(RefinementError::Unsound { finding, .. }) => *finding,
        other => panic!("{:?}", other.map(|refined| refined.summary)),
    }
}

#[test]
fn a_part_that_moved_half_way_is_taken_off() {
    let scene = Scene::from_yaml(SCENE).unwrap();
    let sound = refined(&scene, TOUCHED_TWICE.messages.clone(), false).unwrap();
    let finding = unsound(refined(&scene, moved(), false));
    assert_eq!(finding.cause, InputCause::PartMoved, "{finding}");
    assert!(
        finding.to_string().ends_with("touchup refine --accept"),
        "{finding}"
    );
    let forced = refined(&scene, moved(), true).unwrap();

    let mut accepted = AcceptedScene::new(scene);
    assert!(accepted.take_off(&finding).unwrap());
    let taken_off = refined(&accepted.scene, moved(), false).unwrap();
    let [of_sound, of_forced, of_taken_off] =
        [&sound, &forced, &taken_off].map(|of| error(&of.mesh));
    println!(
        "rms: sound {of_sound:.2e} m, forced {of_forced:.2e} m, taken off {of_taken_off:.2e} m"
    );
    assert!(of_taken_off < 1.1 * of_sound && of_forced > 2.5 * of_sound);

    let [change] = accepted.scene.changes[..] else {
        panic!("{:?}", accepted.scene.changes);
    };
    assert_is_motion(&change);
    // touches before the change are as they were, those after it as uncertain as the change, less what
    // an uncertain normal does not show
    let at_first = |touch: &&ProbedPoint| touch.stamp_ns < TOUCHED_TWICE.middle_ns;
    let touches = taken_off.mesh.touches.iter();
    let (before, after): (Vec<&ProbedPoint>, Vec<&ProbedPoint>) = touches.partition(at_first);
    assert!(before.len() > 100 && after.len() > 100);
    assert!(before.iter().all(|touch| touch.place == 2e-6));
    let most = |touch: &ProbedPoint| {
        let normal = (&touch.normal, 0.0);
        change.sigma_along(touch.stamp_ns, &touch.point, normal, &Vector3::z())
    };
    let [stated, most] = [
        after.iter().map(|touch| touch.place).sum::<f64>(),
        after.iter().map(|touch| most(touch)).sum(),
    ];
    assert!((0.8..1.1).contains(&(stated / most)), "{stated} {most}");
}

/// Within four standard uncertainties of the motion of the part, and in the time between two presses.
fn assert_is_motion(change: &KnownChange) {
    let off_s = (change.from.unwrap() - TOUCHED_TWICE.middle_ns) as f64 * 1e-9;
    assert!(change.to.is_none() && off_s.abs() < 3.0, "{off_s} s");
    // before it turns
    let shift = motion().rotation.inverse() * (motion() * change.about - change.about);
    let off = (change.shift - shift).component_div(&change.shift_sigma);
    assert!(off.amax() < 4.0, "{off} {change:?}");
    assert!(change.shift_sigma.amax() < 0.05e-3, "{change:?}");
    let off = (change.turn - Vector3::from(TURN)).component_div(&change.turn_sigma);
    assert!(off.amax() < 4.0, "{off} {change:?}");
}

#[test]
fn refine_takes_off_on_request_and_writes_the_scene_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    write_mesh(
        path("scan.ply").as_ref(),
        &TOUCHED_TWICE.scan,
        MeshUnit::Millimetre,
    )
    .unwrap();
    fs::write(path("scene.yaml"), format!("# mine\n{SCENE}")).unwrap();
    write_recording(
        path("touch.mcap").as_ref(),
        &Topics::default(),
        "object",
        "stylus",
        moved(),
    )
    .unwrap();
    fs::create_dir(path("out")).unwrap();
    let refine = |scene: &str, out: &str, more: &[&str]| {
        let [scan, bag, scene, out] = ["scan.ply", "touch.mcap", scene, out].map(path);
        let named = [
            "refine", "--scan", &scan, "--bag", &bag, "--scene", &scene, "--out", &out,
        ];
        touchup(&[&named, more].concat(), "")
    };
    let refused = refine("scene.yaml", "out/refused.ply", &[]);
    assert_eq!(code(&refused), 3, "{}", text(&refused.stderr));
    assert!(
        text(&refused.stderr).contains("the part lies"),
        "{}",
        text(&refused.stderr)
    );

    let accepted = refine("scene.yaml", "out/refined.ply", &["--accept", "--json"]);
    assert_eq!(code(&accepted), 0, "{}", text(&accepted.stderr));
    let summary = &json(&accepted)["taken_off"];
    assert_eq!(summary["scene"], path("out/accepted_scene.yaml"));
    let [finding] = &summary["findings"].as_array().unwrap()[..] else {
        panic!("{summary}");
    };
    assert_eq!(finding["cause"], "part_moved");
    let setting = finding["settings"][0].as_str().unwrap();
    assert!(
        setting.starts_with("changes: [{ cause: part_moved, from_s: "),
        "{setting}"
    );
    let yaml = fs::read_to_string(path("out/accepted_scene.yaml")).unwrap();
    assert!(
        yaml.starts_with("# taken off by touchup refine --accept: from "),
        "{yaml}"
    );
    assert!(
        yaml.contains("\n# mine\n") && yaml.contains(setting),
        "{yaml}"
    );

    let again = refine("out/accepted_scene.yaml", "again.ply", &[]);
    assert_eq!(code(&again), 0, "{}", text(&again.stderr));
    let bytes = |name: &str| fs::read(path(name)).unwrap();
    assert!(bytes("again.ply") == bytes("out/refined.ply"));
    let over = refine("out/accepted_scene.yaml", "out/over.ply", &["--accept"]);
    assert_eq!(code(&over), 2);
}

/// Settings of each correction, worked by hand.
#[test]
fn each_correction_becomes_settings_over_those_of_the_scene() {
    let scene = Scene::from_yaml(
        "tip: { radius_mm: 1.5, offset_mm: [1, 0, -100] }\nsync: { wrench_offset_ms: 2 }\n",
    )
    .unwrap();
    let settings = |correction| {
        let settings = scene.corrected(&correction);
        settings.iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    let place = InputCorrection::TipOffset {
        offset: Vector3::new(0.25e-3, 0.0, -0.5e-3),
        sigma: 0.01e-3,
    };
    let expected = [
        "tip: { offset_mm: [1.2500, 0.0000, -100.5000] }",
        "uncertainty: { place_sigma_mm: 0.0100 }",
    ];
    assert_eq!(settings(place), expected);
    let stiffness = InputCorrection::Compliance {
        compliance: 0.1e-3,
        sigma: 0.004e-3,
    };
    let expected = [
        "tip: { stiffness_n_per_mm: 10.0000 }",
        "uncertainty: { stiffness_percent: 4.0000 }",
    ];
    assert_eq!(settings(stiffness), expected);
    let clock = InputCorrection::WrenchClock(ClockOffset {
        offset: -5e-3,
        sigma: 1e-3,
        change: None,
        evidence: ClockEvidence::Onsets(30),
    });
    assert_eq!(settings(clock), ["sync: { wrench_offset_ms: -3.0000 }"]);
    let change = InputCorrection::Change(KnownChange {
        from: Some(1_795_212_850_500_000_000),
        to: Some(1_795_212_851_000_000_000),
        shift: Vector3::new(1e-3, 0.0, -2e-3),
        shift_sigma: Vector3::new(0.01e-3, 0.01e-3, 0.02e-3),
        about: Point3::origin(),
        ..KnownChange::default()
    });
    let entry = "{ cause: part_moved, from_s: 1795212850.500000000, to_s: 1795212851.000000000, \
                 shift_mm: [1.0000, 0.0000, -2.0000], shift_sigma_mm: [0.0100, 0.0100, 0.0200] }";
    assert_eq!(settings(change), [format!("changes: [{entry}]")]);
    // a second change comes after the first
    let mut twice = scene.clone();
    twice.set(&scene.corrected(&change)).unwrap();
    let settings = twice.corrected(&change);
    assert_eq!(settings[0].value, format!("[{entry}, {entry}]"));
    twice.set(&settings).unwrap();
    assert!(twice.changes.len() == 2 && twice.validate().is_ok());
}
