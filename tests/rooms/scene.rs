//! The scene file from outside: the shipped file, refusals, and the resulting parameters.

mod parameters;

use std::collections::BTreeSet;

use nalgebra::{Point3, vector};
use proptest::prelude::*;
use touchup::haptic::{
    ContactModel, DynamicsParams, MotionDirection, RefineParams, Refiner, RoiSize, SigmoidParams,
    StepRule,
};
use touchup::io::mesh_file::MeshUnit;
use touchup::io::recording::TableColumns;
use touchup::mesh::TriMesh;
use touchup::reconstruct::{Patcher, PatcherParams};
use touchup::scene::{
    CompensationSection, GravityAxes, LeftOut, MarkersSection, Mode, PayloadSection, RobotSection,
    ScanToSpaceSection, Scene, SceneError, Setting,
};
use touchup::stylus::{
    BiasParams, SensorBias, SensorMount, SyncParams, TipParams, TipShape, WrenchFrame,
};

const DEFAULT_YAML: &str = include_str!("../../config/default.yaml");

/// The file with its settings that are off taken in: `#key` is one, `# prose` is not.
fn with_all_settings() -> String {
    let taken_in = |line: &str| {
        let (indent, rest) = line.split_at(line.len() - line.trim_start().len());
        let setting = rest
            .strip_prefix('#')
            .filter(|after| !after.starts_with(' ') || after.starts_with("  "));
        setting.map_or_else(|| line.to_owned(), |setting| format!("{indent}{setting}"))
    };
    DEFAULT_YAML
        .lines()
        .map(taken_in)
        .collect::<Vec<_>>()
        .join("\n")
}

#[test]
fn the_shipped_file_is_the_default() {
    assert_eq!(Scene::from_yaml(DEFAULT_YAML).unwrap(), Scene::default());
    let whole = Scene::from_yaml(&with_all_settings()).unwrap();
    assert_eq!(whole.markers, Some(MarkersSection::default()));
    assert_eq!(whole.bias_tracking, Some(BiasParams::default()));
    let compensation = whole.compensation.clone().unwrap();
    assert_eq!(compensation.payload, Some(PayloadSection::default()));
    assert_eq!(
        whole.compensator_params(WrenchFrame::Sensor).pose_ts,
        nalgebra::Isometry3::identity()
    );
    let mount = SensorMount {
        orientation_xyzw: None,
        ..compensation.mount
    };
    let plain = CompensationSection {
        payload: None,
        bias: None,
        mount,
    };
    assert_eq!(plain, CompensationSection::default());
}

#[test]
fn the_scene_of_the_demo_is_the_default_with_a_scan() {
    let path = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../config/demo.yaml"));
    let mut demo = Scene::read(path).unwrap();
    let (scan, unit) = demo.scan_file(path).unwrap();
    assert_eq!(
        (scan, unit),
        (
            path.parent().unwrap().join("../out/scan.ply"),
            MeshUnit::Millimetre
        )
    );
    demo.scan.as_mut().unwrap().file = None;
    assert_eq!(demo, Scene::default());
    assert_eq!(demo.scan_file(path), None);
    let inches = Scene::from_yaml("scan: { file: /parts/a.stl, unit: inch }").unwrap();
    assert_eq!(
        inches.scan_file(path).unwrap(),
        ("/parts/a.stl".into(), MeshUnit::Inch)
    );
}

/// Every key that the code knows, asked by giving each section a key that none has: the refusal
/// lists the known ones.
#[test]
fn every_key_of_the_code_is_in_the_shipped_file_and_documented() {
    let mut known = BTreeSet::new();
    let inner = [
        "compensation.payload",
        "compensation.bias",
        "robot.ros2_control",
    ];
    let outer = [
        "",
        "sync",
        "columns",
        "markers",
        "scan_to_space",
        "changes",
        "compensation",
        "bias_tracking",
        "contact",
        "tip",
        "scan",
        "sliding",
        "carve",
        "guard",
        "patch",
        "uncertainty",
        "robot",
        "refine",
    ];
    let sections = [&outer[..], &inner].concat();
    for section in sections {
        let path: Vec<_> = section.split('.').filter(|name| !name.is_empty()).collect();
        let yaml =
            path.iter()
                .rev()
                .fold("{ no_such_key: 1 }".to_owned(), |inner, name| match *name {
                    "changes" => format!("{{ {name}: [{inner}] }}"),
                    _ => format!("{{ {name}: {inner} }}"),
                });
        let error = Scene::from_yaml(&yaml).unwrap_err().to_string();
        let list = error
            .split("expected one of")
            .nth(1)
            .unwrap_or_else(|| panic!("{section}: {error}"));
        let list = list.split(" at line").next().unwrap();
        known.extend(
            list.split([',', ' ', '`', ';'])
                .filter(|key| key.contains(|c: char| c.is_alphabetic()))
                .map(str::to_owned),
        );
    }
    let whole = with_all_settings();
    let mut in_file = BTreeSet::new();
    for line in whole
        .lines()
        .filter(|line| !line.trim_start().starts_with('#'))
    {
        let key = line.split_once(':').map(|(key, _)| key.trim());
        in_file.extend(key.map(|key| key.trim_start_matches("- ").to_owned()));
    }
    assert_eq!(in_file, known);
    assert!(known.len() >= 35, "{known:?}");
}

/// The presets of the room are the defaults of a user.
#[test]
fn the_default_scene_is_the_preset_of_each_mode() {
    let tip = TipParams {
        radius: 1.5e-3,
        stiffness: Some(2e4),
    };
    let mut scene = Scene::default();
    assert_eq!(
        scene.refine_params(WrenchFrame::Sensor),
        Some(RefineParams::robust(tip))
    );
    scene.refine.as_mut().unwrap().mode = Mode::Paper;
    assert_eq!(
        scene.refine_params(WrenchFrame::Sensor),
        Some(RefineParams::paper(tip))
    );
    let mut scene = Scene::default();
    scene.tip.as_mut().unwrap().ball.stiffness = None;
    let rigid = RefineParams::robust(TipParams {
        stiffness: None,
        ..tip
    });
    assert_eq!(scene.refine_params(WrenchFrame::Sensor), Some(rigid));
}

/// Sections that a right result needs are present unless the scene says `off`; those of some
/// sensors are present if it names them.
#[test]
#[expect(clippy::too_many_lines)]
fn a_scene_says_what_differs() {
    assert_eq!(Scene::from_yaml("{}").unwrap(), Scene::default());
    // a scene that once had neither gate nor patch, and repaired nothing
    let little = Scene::from_yaml("sync:\ntip: { radius_mm: 1.5 }\nscan:\nrefine:\n").unwrap();
    assert_eq!(little, Scene::default());
    assert!(
        little
            .refine_params(WrenchFrame::Sensor)
            .unwrap()
            .gate
            .is_some()
            && little.patcher_params().is_some()
    );
    let more = Scene::from_yaml("{ tip: , contact: { on_n: 1 }, bias_tracking: }").unwrap();
    assert_eq!(
        (more.contact.unwrap().on, more.bias_tracking),
        (1.0, Some(BiasParams::default()))
    );

    let all_off = Scene::from_yaml(
        "sync: off\nclock: off\nmarkers: off\nscan_to_space: off\ncompensation: off\nbias_tracking: off\ncontact: off\n\
         tip: off\nscan: off\nsliding: off\ncarve: off\nguard: off\npatch: off\nuncertainty: off\nrobot: off\nrefine: off\n",
    );
    let none = all_off.unwrap();
    assert!(
        none.refine_params(WrenchFrame::Sensor).is_none()
            && none.contact.is_none()
            && none.clock.is_none()
    );
    assert!(none.patcher_params().is_none());
    let SyncParams {
        reorder_ns,
        largest_gap_ns,
        ..
    } = none.sync_params();
    assert_eq!((reorder_ns, largest_gap_ns), (0, 0));
    assert_eq!(none.compensator_params(WrenchFrame::Object).payload, None);
    assert_eq!(none.built(&[], &[]).built, Vec::<&str>::new());
    assert_eq!(
        none.tip_params(),
        TipParams {
            radius: 0.0,
            stiffness: None
        }
    );

    let loop_alone =
        "{ contact: off, tip: off, scan: off, sliding: off, carve: off, guard: off, patch: off }";
    let loop_alone = Scene::from_yaml(loop_alone)
        .unwrap()
        .refine_params(WrenchFrame::Object)
        .unwrap();
    assert_eq!(
        (
            loop_alone.gate,
            loop_alone.sliding,
            loop_alone.carve,
            loop_alone.guard
        ),
        (None, None, None, None)
    );
    assert_eq!(
        (loop_alone.tip, loop_alone.scan_noise),
        (
            TipParams {
                radius: 0.0,
                stiffness: None
            },
            0.0
        )
    );
    assert_eq!(loop_alone.compensator.wrench_frame, WrenchFrame::Object);

    // YAML 1.1 reads off as false
    assert_eq!(
        Scene::from_yaml("patch: false").unwrap(),
        Scene::from_yaml("{ patch: off }").unwrap()
    );
    let inner = Scene::from_yaml("compensation: { payload: off, bias: }")
        .unwrap()
        .compensation
        .unwrap();
    assert_eq!(
        (inner.payload, inner.bias),
        (None, Some(SensorBias::default()))
    );
}

/// The default radius has no source, and a point has no radius.
#[test]
fn a_radius_is_told_by_somebody() {
    let told = |yaml: &str| {
        let scene = Scene::from_yaml(yaml).unwrap();
        scene
            .require_radius(yaml)
            .map(|()| scene.tip_params().radius)
    };
    assert_eq!(told("tip: { radius_mm: 2 }").unwrap(), 2e-3);
    assert_eq!(told("{ tip: off, patch: off }").unwrap(), 0.0);
    for untold in [
        "{}",
        "tip:",
        "tip: { stiffness_n_per_mm: 20 }",
        "tip: { radius_mm: ~ }",
    ] {
        if Scene::from_yaml(untold).is_ok() {
            assert!(
                matches!(told(untold), Err(SceneError::NoRadius)),
                "{untold}"
            );
        }
    }
}

/// Each section of the shipped file by its header alone: the keys below it are off.
#[test]
fn a_header_alone_takes_the_defaults() {
    let lines: Vec<_> = DEFAULT_YAML.lines().collect();
    let name_of = |line: &str| {
        let name = line.strip_prefix('#').unwrap_or(line).strip_suffix(':')?;
        name.chars()
            .all(|c| c.is_ascii_lowercase() || c == '_')
            .then(|| name.to_owned())
    };
    let mut sections = 0;
    for at in 0..lines.len() {
        let Some(name) = name_of(lines[at]) else {
            continue;
        };
        let end = lines[at..]
            .iter()
            .position(|line| line.is_empty())
            .map_or(lines.len(), |length| at + length);
        let edited = |(i, line): (usize, &&str)| match i {
            _ if i == at => format!("{name}:"),
            _ if (at..end).contains(&i) && line.starts_with(' ') => format!("#{line}"),
            _ => (*line).to_owned(),
        };
        let yaml = lines
            .iter()
            .enumerate()
            .map(edited)
            .collect::<Vec<_>>()
            .join("\n");
        let scene = Scene::from_yaml(&yaml).unwrap_or_else(|error| panic!("{name}: {error}"));
        let mut expected = Scene::default();
        match name.as_str() {
            "columns" => expected.columns = Some(TableColumns::default()),
            "markers" => expected.markers = Some(MarkersSection::default()),
            "scan_to_space" => expected.scan_to_space = Some(ScanToSpaceSection::default()),
            "compensation" => expected.compensation = Some(CompensationSection::default()),
            "bias_tracking" => expected.bias_tracking = Some(BiasParams::default()),
            "robot" => expected.robot = Some(RobotSection::default()),
            _ => {}
        }
        assert_eq!(scene, expected, "{name}");
        sections += 1;
    }
    assert_eq!(sections, 18);
    let inner = Scene::from_yaml("compensation:\n  payload:\n  bias:\n")
        .unwrap()
        .compensation
        .unwrap();
    assert_eq!(
        (inner.payload, inner.bias),
        (Some(PayloadSection::default()), Some(SensorBias::default()))
    );
}

#[test]
fn friction_and_free_space_are_parts_of_the_update_and_of_the_patch_or_of_neither() {
    let parts = |yaml: &str| {
        let scene = Scene::from_yaml(&format!(
            "{{ contact: , tip: , patch: , refine: , {yaml} }}"
        ))
        .unwrap();
        let refiner = scene.refine_params(WrenchFrame::Sensor).unwrap();
        let patcher = scene.patcher_params().unwrap();
        assert_eq!(
            refiner.sliding.map(|sliding| sliding.cone_cosine),
            patcher.touches.cone_cosine
        );
        assert_eq!(refiner.carve.is_some(), patcher.free_space);
        (patcher.touches.cone_cosine, patcher.free_space)
    };
    assert_eq!(parts("sliding: off, carve: off"), (None, false));
    assert_eq!(parts("carve: off"), (Some(0.9135), false));
    assert_eq!(parts("sliding: { cone_cosine: 0.8 }"), (Some(0.8), true));
    assert_eq!(parts("sliding: off"), (None, true));
}

#[test]
fn the_patch_needs_a_ball_and_a_gate_and_is_no_part_of_the_paper() {
    let radius = "patch needs tip.radius_mm above 0: name it, or say `patch: off`";
    let contact = "patch needs contact: name it, or say `patch: off`";
    for (yaml, expected) in [
        ("tip: off", radius),
        ("tip: { radius_mm: 0 }", radius),
        ("contact: off", contact),
    ] {
        assert_eq!(
            Scene::from_yaml(yaml).unwrap_err().to_string(),
            expected,
            "{yaml}"
        );
        for without in ["patch: off", "refine: { mode: paper }"] {
            assert!(
                Scene::from_yaml(&format!("{yaml}\n{without}")).is_ok(),
                "{yaml}, {without}"
            );
        }
    }
    let yaml = "tip: { radius_mm: 2 }\ncontact: { on_n: 1, off_n: 0.5 }\nscan: { noise_mm: 2 }\n\
                patch: { tolerance_mm: 0.02 }";
    let params = Scene::from_yaml(yaml).unwrap().patcher_params().unwrap();
    // the pitch: √(16 · 2 mm · 0.02 mm)
    assert!((params.tolerance - 0.02e-3).abs() < 1e-18 && (params.pitch() - 0.8e-3).abs() < 1e-15);
    assert_eq!(params.touches.stiffness, Some(2e4));
    assert_eq!(
        (params.evidence.radius, params.evidence.scan_reach),
        (2e-3, 6e-3)
    );
    let default = Scene::default().patcher_params();
    let usual = PatcherParams {
        is_usual_tolerance: true,
        ..PatcherParams::new(1.5e-3, Some(2e4), 0.6e-3)
    };
    assert_eq!(default, Some(usual));
    let paper = Scene::from_yaml("tip:\ncontact:\npatch:\nrefine: { mode: paper }").unwrap();
    assert!(paper.patcher_params().is_none());
}

#[test]
fn keys_of_refine_override_its_mode() {
    let yaml = "tip: { radius_mm: 2, stiffness_n_per_mm: 0.1 }
refine: { mode: paper, contact_model: spring, alpha_m_per_n_s: 0.5, beta_per_n2_s: 0, step: corrected, along: force, roi_mm: 4 }";
    let params = Scene::from_yaml(yaml)
        .unwrap()
        .refine_params(WrenchFrame::Sensor)
        .unwrap();
    let DynamicsParams {
        model,
        alpha_m_per_n_s,
        beta_per_n2_s,
        rule,
        along,
        take_out_rigid_offset,
    } = params.dynamics;
    assert_eq!(
        model,
        ContactModel::Spring {
            stiffness_n_per_m: 100.0
        }
    );
    assert_eq!((alpha_m_per_n_s, beta_per_n2_s), (0.5, 0.0));
    assert_eq!(
        (rule, along, take_out_rigid_offset),
        (StepRule::DriftCorrected, MotionDirection::Force, false)
    );
    assert_eq!((params.roi, params.gate), (RoiSize::Radius(0.004), None));

    let yaml = "tip: { stiffness_n_per_mm: 20 }\nrefine: { contact_model: sigmoid, f_max_n: 20, h_min_mm: 2, delta: 3 }";
    let params = Scene::from_yaml(yaml)
        .unwrap()
        .refine_params(WrenchFrame::Sensor)
        .unwrap();
    assert_eq!(
        params.dynamics.model,
        ContactModel::Sigmoid(SigmoidParams {
            f_max: 20.0,
            h_min: 0.002,
            delta: 3.0
        })
    );
    assert!(params.dynamics.take_out_rigid_offset);
}

#[test]
fn units_are_turned_into_si_once() {
    let scene = Scene::from_yaml(
        "sync: { reorder_ms: 1.5, largest_gap_ms: 0, largest_jump_s: 2, wrench_offset_ms: -1.8, wrench_drift_ppm: 50, capacity: 10 }
compensation:
  sensor_position_mm: [0, 0, 120]
  sensor_orientation_xyzw: [0, 0, 1, 0]
  payload: { mass_kg: 0.2, centre_mm: [1, 2, 3], gravity_m_per_s2: [0, 9.8, 0] }
  bias: { force_n: [1, 2, 3], torque_nm: [4, 5, 6] }",
    )
    .unwrap();
    let expected = SyncParams {
        reorder_ns: 1_500_000,
        largest_gap_ns: 0,
        largest_jump_ns: 2_000_000_000,
        wrench_offset_ns: -1_800_000,
        wrench_drift: 50e-6,
        capacity: 10,
    };
    assert_eq!(scene.sync_params(), expected);
    let params = scene.compensator_params(WrenchFrame::Object);
    assert_eq!(params.wrench_frame, WrenchFrame::Object);
    assert_eq!(params.pose_ts.translation.vector, vector![0.0, 0.0, 0.12]);
    assert_eq!(
        params.pose_ts.rotation * vector![1.0, 0.0, 0.0],
        vector![-1.0, 0.0, 0.0],
        "half a turn about z"
    );
    let payload = params.payload.unwrap();
    assert_eq!(
        (payload.mass, payload.p_sc),
        (0.2, vector![0.001, 0.002, 0.003])
    );
    assert_eq!(params.bias_s.unwrap().torque, vector![4.0, 5.0, 6.0]);
}

/// Scenes with one mistake each, and parts of the message that it gets.
const MISTAKES: &[(&str, &[&str])] = &[
    (
        "sync:\n  reordr_ms: 3\n",
        &["reordr_ms", "did you mean `reorder_ms`", "line 2"],
    ),
    (
        "contcat: {}",
        &["contcat", "did you mean `contact`", "line 1"],
    ),
    (
        "refine: { moed: paper }",
        &["moed", "did you mean `mode`", "line 1"],
    ),
    ("contact:\n  on_n: much\n", &["line 2", "column 9"]),
    (
        "contact: { on_n: 1 }\ncontact: {}",
        &["duplicate", "line 2"],
    ),
    (
        "contact: { on_n: 0.1 }",
        &["contact.on_n is 0.1", "contact.off_n to"],
    ),
    (
        "contact: { off_n: .nan }",
        &["contact.off_n is NaN", "0 to 1000 N"],
    ),
    (
        "tip: { radius_mm: -1 }",
        &["tip.radius_mm is -1", "0 to 1000 mm"],
    ),
    (
        "tip: { stiffness_n_per_mm: 0 }",
        &["tip.stiffness_n_per_mm is 0", "leave it out for rigid"],
    ),
    ("tip: { shape: cube }", &["cube", "ball", "flat", "cone"]),
    (
        "tip: { shape: cone }",
        &["tip.shape: cone needs tip.half_angle_deg"],
    ),
    (
        "tip: { shape: cone, half_angle_deg: 85 }",
        &["tip.half_angle_deg is 85", "1 to 80 degrees", "flat"],
    ),
    (
        "tip: { shape: flat, edge_radius_mm: 2 }",
        &["tip.edge_radius_mm is 2", "0 mm to tip.radius_mm"],
    ),
    (
        "tip: { shape: flat, radius_mm: 0 }",
        &["tip.radius_mm is 0", "for a flat tip"],
    ),
    (
        "tip: { shape: flat, length_mm: 0 }",
        &["tip.length_mm is 0", "1000 mm"],
    ),
    ("scan: { noise_mm: .inf }", &["scan.noise_mm is inf"]),
    (
        "sync: { largest_gap_ms: -3 }",
        &["sync.largest_gap_ms is -3", "0 to 60000 ms"],
    ),
    ("sync: { capacity: 1 }", &["sync.capacity is 1"]),
    (
        "tip: {stiffness_n_per_mm: null}\nrefine: { contact_model: spring }",
        &["spring needs tip.stiffness_n_per_mm"],
    ),
    ("refine: { mode: rough }", &["rough", "robust", "line 1"]),
    ("refine: { h_min_mm: 0 }", &["refine.h_min_mm is 0"]),
    (
        "carve: { contact_tolerance_mm: -1 }",
        &["carve.contact_tolerance_mm is -1", "0 to 1000"],
    ),
    (
        "sliding: { cone_cosine: -1 }",
        &["sliding.cone_cosine is -1", "0 to 1"],
    ),
    (
        "compensation: { payload: { mass_kg: -2 } }",
        &["compensation.payload.mass_kg is -2"],
    ),
    (
        "compensation: { sensor_orientation_xyzw: [0, 0, 0, 0] }",
        &["sensor_orientation_xyzw is 0", "length"],
    ),
    ("compensation: { bias: { force_n: [1, 2] } }", &["line 1"]),
    (
        "patch: on",
        &["expected keys with values, or off", "line 1"],
    ),
    ("patch: 3", &["expected keys with values, or off", "line 1"]),
    (
        "changes: [{ shift_mm: [1, 0, 0] }]",
        &["changes needs changes.from_s"],
    ),
    (
        "changes: [{ from_s: 2, to_s: 1 }]",
        &["changes.to_s is 1", "changes.from_s or later"],
    ),
    (
        "changes: [{ cause: tip_bent, from_s: 2, turn_deg: [0, 0, 3] }]",
        &["changes.turn_deg is 3", "0 for a tip"],
    ),
    (
        "changes: [{ cause: scan_moved, from_s: 2 }]",
        &["scan_moved", "tip_bent", "line 1"],
    ),
    ("[", &["line"]),
];

#[test]
fn each_mistake_is_refused_in_one_line_with_place_and_cause() {
    for &(yaml, parts) in MISTAKES {
        let error = Scene::from_yaml(yaml).unwrap_err().to_string();
        assert!(!error.contains('\n'), "{error}");
        assert!(
            parts.iter().all(|part| error.contains(part)),
            "{yaml:?}: {error}"
        );
    }
}

#[test]
fn the_shape_of_the_tip_reaches_refiner_and_patcher() {
    let shapes = |yaml: &str| {
        let scene = Scene::from_yaml(&format!(
            "{{ contact: , refine: , patch: , tip: {{ {yaml} }} }}"
        ))
        .unwrap();
        let refiner = scene.refine_params(WrenchFrame::Sensor).unwrap();
        let patcher = scene.patcher_params().unwrap();
        assert_eq!(
            (refiner.shape, refiner.tip.radius),
            (patcher.touches.shape, patcher.touches.radius)
        );
        let corners = [[0.0, 0.0], [0.01, 0.0], [0.0, 0.01]].map(|[x, y]| Point3::new(x, y, 0.0));
        let mesh = TriMesh::new(corners.to_vec(), vec![[0, 1, 2]]).unwrap();
        let radius = patcher.evidence.radius;
        assert!(Refiner::new(mesh, refiner).is_ok() && Patcher::new(patcher).is_ok());
        (refiner.shape, radius)
    };
    assert_eq!(shapes("radius_mm: 1.5"), (TipShape::Ball, 1.5e-3));
    let flat = TipShape::Flat {
        edge_radius: 0.25e-3,
        length: 8e-3,
    };
    assert_eq!(
        shapes("shape: flat, radius_mm: 2, edge_radius_mm: 0.25"),
        (flat, 2e-3)
    );
    let cone = TipShape::Cone {
        half_angle: 20f64.to_radians(),
        length: 6e-3,
    };
    // the hand limits the resolution of a sharp nose
    assert_eq!(
        shapes("shape: cone, radius_mm: 0.25, half_angle_deg: 20, length_mm: 6"),
        (cone, 1e-3)
    );
}

#[test]
fn a_missing_file_is_named() {
    let error = Scene::read(std::path::Path::new("no/such/scene.yaml"))
        .unwrap_err()
        .to_string();
    assert!(error.contains("no/such/scene.yaml"), "{error}");
}

#[test]
fn bias_tracking_is_built_only_when_named_and_not_in_the_paper() {
    let bias = |yaml: &str| {
        Scene::from_yaml(yaml)
            .unwrap()
            .refine_params(WrenchFrame::Sensor)
            .unwrap()
            .bias
    };
    assert_eq!(bias("refine:"), None);
    assert_eq!(
        bias("{ refine: , bias_tracking: }"),
        Some(BiasParams::default())
    );
    let named = bias("{ refine: , bias_tracking: { settle_ms: 20, time_s: 2 } }");
    assert_eq!(
        named,
        Some(BiasParams {
            settle_ns: 20_000_000,
            time: 2.0
        })
    );
    assert_eq!(bias("{ refine: { mode: paper }, bias_tracking: }"), None);
    let text = Scene::from_yaml("bias_tracking: { time_s: 0 }")
        .unwrap_err()
        .to_string();
    assert!(text.contains("bias_tracking.time_s is 0"), "{text}");
}

// ---- settings put into the text

/// A scene in a user's writing, with the values of each calibration.
fn calibrated(yaml: &str) -> Result<String, SceneError> {
    let mut expected = if yaml.trim().is_empty() {
        Scene::default()
    } else {
        Scene::from_yaml(yaml).unwrap()
    };
    let section = ScanToSpaceSection {
        position: vector![1.5, -2.0, 3.25] / 1e3,
        orientation_xyzw: [0.0, 0.6, 0.0, 0.8],
    };
    expected.scan_to_space = Some(section);
    expected.tip.get_or_insert_default().offset = Some(vector![0.5, 0.0, -142.0] / 1e3);
    let compensation = expected.compensation.get_or_insert_default();
    let payload = compensation.payload.get_or_insert_default();
    (payload.payload.mass, payload.gravity_axes) = (0.25, GravityAxes::Space);
    compensation.bias.get_or_insert_default().force = vector![1.0, 2.0, 3.0];
    let settings = [
        Setting::list("scan_to_space.position_mm", &[1.5, -2.0, 3.25]),
        Setting::list("scan_to_space.orientation_xyzw", &[0.0, 0.6, 0.0, 0.8]),
        Setting::list("tip.offset_mm", &[0.5, 0.0, -142.0]),
        Setting::number("compensation.payload.mass_kg", 0.25),
        Setting::word("compensation.payload.gravity_axes", "space"),
        Setting::list("compensation.bias.force_n", &[1.0, 2.0, 3.0]),
    ];
    let text = Scene::edited(yaml, &settings, "by a test")?;
    assert_eq!(Scene::from_yaml(&text)?, expected, "{text}");
    Ok(text)
}

/// Expected values by hand: the units are in the keys.
#[test]
fn settings_are_set_by_key_in_its_unit() {
    let mut scene = Scene::from_yaml("{ tip: off, patch: off, uncertainty: off }").unwrap();
    let settings = [
        Setting::number("tip.stiffness_n_per_mm", 12.5),
        Setting::number("uncertainty.radius_sigma_mm", 0.25),
        Setting::file("scan.file", std::path::Path::new("it's.ply")).unwrap(),
        Setting::word("scan.unit", "inch"),
        Setting::list("robot.tip_position_mm", &[1.0, -2.0, 0.5]),
        Setting::word("refine.step", "dp5"),
    ];
    scene.set(&settings).unwrap();
    let tip = scene.tip.as_ref().unwrap();
    assert_eq!(
        (tip.ball.radius, tip.ball.stiffness),
        (1.5e-3, Some(12.5e3))
    );
    assert_eq!(scene.uncertainty.unwrap().calibration.radius, 0.25e-3);
    let scan = scene.scan.as_ref().unwrap();
    assert_eq!(scan.file.as_deref(), Some(std::path::Path::new("it's.ply")));
    assert_eq!((scan.unit, scan.quality.noise), (MeshUnit::Inch, 0.6e-3));
    assert_eq!(
        scene.robot.as_ref().unwrap().tip_position,
        vector![1e-3, -2e-3, 0.5e-3]
    );
    assert_eq!(
        scene.refine.as_ref().unwrap().step,
        Some(StepRule::DormandPrince)
    );

    for unwritable in ["two\nlines.ply", "bell\u{7}.ply"] {
        let error = Setting::file("scan.file", std::path::Path::new(unwritable)).unwrap_err();
        assert!(matches!(error, SceneError::CannotEdit { .. }), "{error}");
    }
    let mut told = Scene::from_yaml("tip: { radius_mm: 2 }").unwrap();
    told.set(&[Setting::number("tip.radius_mm", 3.0)]).unwrap();
    assert_eq!(told.tip_params().radius, 3e-3);

    for wrong in [
        Setting::number("tip.radius", 1.0),
        Setting::number("tip", 1.0),
        Setting::number("tip.radius_mm.of", 1.0),
        Setting::number("tip.stiffness_n_per_mm.of", 1.0),
        Setting::word("tip.radius_mm", "wide"),
    ] {
        let error = Scene::default().set(&[wrong]).unwrap_err();
        assert!(matches!(error, SceneError::Yaml { .. }), "{error}");
    }
    for not_finite in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let mut scene = Scene::default();
        let radius = [Setting::number("tip.radius_mm", not_finite)];
        scene.set(&radius).unwrap();
        let error = scene.validate().unwrap_err().to_string();
        let said = format!("tip.radius_mm is {not_finite}; it must be 0 to 1000 mm");
        assert!(error.starts_with(&said), "{error}");
    }
}

/// The lines of `before` that are not in `after`, in order.
fn lost<'a>(before: &'a str, after: &str) -> Vec<&'a str> {
    let mut rest = after.lines();
    before
        .lines()
        .filter(|line| {
            !rest.clone().any(|other| other == *line) || !rest.any(|other| other == *line)
        })
        .collect()
}

#[test]
fn what_the_user_wrote_survives_a_calibration() {
    let after = calibrated(DEFAULT_YAML).unwrap();
    assert_eq!(lost(DEFAULT_YAML, &after), Vec::<&str>::new(), "{after}");
    assert_eq!(
        calibrated(&after).unwrap(),
        after,
        "done twice is done once"
    );
    assert_eq!(after.matches("# touchup calibrate by a test").count(), 1);

    let written = "\
# my cell
refine:            # all defaults
tip:
    # measured on Tuesday
    radius_mm: 1.0  # ruby
    offset_mm:
      # by hand
      - 1
      - 2
      - 3
    stiffness_n_per_mm: 20

compensation: { payload: { mass_kg: 1, centre_mm: [1, 2, 3] }, # the new sensor
  sensor_position_mm: [0, 0, 9] }
# the end
";
    let after = calibrated(written).unwrap();
    let gone = [
        "    offset_mm:",
        "      - 1",
        "      - 2",
        "      - 3",
        "compensation: { payload: { mass_kg: 1, centre_mm: [1, 2, 3] }, # the new sensor",
        "  sensor_position_mm: [0, 0, 9] }",
    ];
    assert_eq!(lost(written, &after), gone, "{after}");
    for kept in [
        "      # by hand",
        "# the new sensor",
        "sensor_position_mm: [0, 0, 9]",
        "# all defaults",
    ] {
        assert!(after.contains(kept), "{kept}: {after}");
    }
}

/// For any form of a scene the result is right (which `edited` checks itself), or the error names
/// the remedy.
#[test]
fn every_form_of_writing_is_edited_or_refused() {
    let forms = [
        "",
        "# only a comment",
        "tip:",
        "tip: ~",
        "tip: null # none\nscan:",
        "{}",
        "{ tip: , contact: { on_n: 3 } }",
        "{\n  tip: { radius_mm: 2, }, # a ball, of 2: { mm }\n}\n",
        "---\ntip:\n  radius_mm: 2",
        "---\ntip:\n  radius_mm: 2\n...\n",
        "  tip:\n    radius_mm: 2\n  contact: { on_n: 1 }\n",
        "\"tip\":\n  'offset_mm' : [1, 2, 3] # old\ncontact:\r\n  on_n: 1\r\n",
        "compensation:\n  bias:\n  payload: {mass_kg: 3}\n  # last\n\n\n\ntip: {offset_mm: [1,\n 2, 3]}",
        "compensation:\n  bias: {}\n  payload: ~\n",
        "scan_to_space: {}\ntip:\n  # nothing\n#tail\n",
        "scan_to_space: off\ncompensation: off # none\n",
        "{ compensation: off, scan_to_space: off }",
    ];
    for form in forms {
        let after = calibrated(form).unwrap_or_else(|error| panic!("{form:?}: {error}"));
        assert_eq!(calibrated(&after).unwrap(), after, "{form:?} twice");
        let comments = |text: &str| {
            text.lines()
                .filter(|line| line.trim_start().starts_with('#'))
                .count()
        };
        assert!(comments(&after) >= comments(form), "{form:?}: {after}");
    }
    for form in [
        "tip: &t { radius_mm: 2 }\n",
        "tip: !!map\n  radius_mm: 2\n",
        "? tip\n: { radius_mm: 2 }\n",
    ] {
        if Scene::from_yaml(form).is_err() {
            continue;
        }
        match calibrated(form) {
            Ok(_) => {}
            Err(error) => {
                assert!(
                    error
                        .to_string()
                        .contains("by hand: scan_to_space.position_mm: [1.5, -2, 3.25]"),
                    "{error}"
                )
            }
        }
    }
}

proptest! {
    /// Sections in any order, in lines or in braces, set in by two or four, with comments and empty
    /// lines anywhere.
    #[test]
    fn any_plain_scene_is_edited_and_keeps_its_comments(
        order in Just(vec![0usize, 1, 2, 3]).prop_shuffle(),
        in_braces in prop::array::uniform4(any::<bool>()),
        deep in any::<bool>(),
        remarks in prop::array::uniform8(any::<bool>()),
    ) {
        let sections: [(&str, &[&str]); 4] = [
            ("tip", &["radius_mm: 2", "offset_mm: [1, 2, 3]"]),
            ("compensation", &["sensor_position_mm: [0, 0, 9]", "payload: { mass_kg: 3 }"]),
            ("contact", &["on_n: 1"]),
            ("scan_to_space", &["position_mm: [9, 9, 9]"]),
        ];
        let indent = if deep { "    " } else { "  " };
        let mut yaml = String::new();
        for &i in &order {
            let (name, keys) = sections[i];
            if remarks[i] {
                yaml += &format!("\n# about {name}\n\n");
            }
            if in_braces[i] {
                yaml += &format!("{name}: {{ {} }} # in braces: {{ {name}\n", keys.join(", "));
                continue;
            }
            yaml += &format!("{name}:{}\n", if remarks[i + 4] { "  # named" } else { "" });
            for key in keys {
                yaml += &format!("{indent}# about {key}\n{indent}{key}   # why\n");
            }
        }
        let after = calibrated(&yaml).unwrap();
        let remarks = |text: &str| text.matches('#').count();
        prop_assert!(remarks(&after) >= remarks(&yaml), "{yaml}\n{after}");
        prop_assert_eq!(calibrated(&after).unwrap(), after);
    }
}

#[test]
fn gravity_in_the_axes_of_space_turns_with_the_scan() {
    let scene = |axes: &str, space: &str| {
        let yaml = format!(
            "{{ compensation: {{ payload: {{ mass_kg: 1, gravity_axes: {axes} }} }}, {space} }}"
        );
        Scene::from_yaml(&yaml)
            .unwrap()
            .compensator_params(WrenchFrame::Sensor)
            .payload
            .unwrap()
            .gravity_o
    };
    // the scan has a turn of 90° about x of space: its y points up
    let turned = "scan_to_space: { orientation_xyzw: [0.7071068, 0, 0, 0.7071068] }";
    assert!(
        (scene("space", turned) - vector![0.0, -9.81, 0.0]).norm() < 1e-6,
        "{}",
        scene("space", turned)
    );
    assert_eq!(scene("object", turned), vector![0.0, 0.0, -9.81]);
    assert_eq!(scene("space", "tip: "), vector![0.0, 0.0, -9.81]);
    for bad in [
        "scan_to_space: { orientation_xyzw: [0, 0, 0, 0.9] }",
        "tip: { offset_mm: [0, 0, 1e9] }",
    ] {
        assert!(
            matches!(Scene::from_yaml(bad), Err(SceneError::Setting(_))),
            "{bad}"
        );
    }
    assert_eq!(Scene::default().placement(), None);
}

/// Names as in the YAML, in its order, listed here by hand; each omitted one with its reason.
#[test]
fn a_scene_reports_what_is_built_of_it_and_what_is_left_out() {
    let unused = [
        LeftOut {
            part: "robot",
            reason: "no arm here",
        },
        LeftOut {
            part: "clock",
            reason: "no clock here",
        },
    ];
    let built = |yaml: &str| {
        Scene::from_yaml(yaml)
            .unwrap()
            .built(&unused, &[("feature x", false)])
    };
    let text = built("{}").to_string();
    let unnamed = "markers, scan_to_space, changes, compensation, bias_tracking, scan.region, robot (not named in the scene)";
    assert_eq!(
        text,
        format!(
            "built: sync, contact, tip, scan, sliding, carve, guard, patch, uncertainty, refine; left out: clock (no clock \
             here); {unnamed}; feature x (not in this build of touchup)"
        )
    );
    let off = built("{ guard: off, patch: off, robot: , clock: off }").to_string();
    let left_out = "clock, guard, patch (off in the scene); markers, scan_to_space, changes, compensation, bias_tracking, scan.region (not named \
                    in the scene); uncertainty (of the patch, which is left out); robot (no arm here)";
    assert!(
        off.starts_with(&format!(
            "built: sync, contact, tip, scan, sliding, carve, refine; left out: {left_out}"
        )),
        "{off}"
    );
    // the mode of the paper takes neither contact, sliding, carving, guard nor a patch, even if the
    // scene names them
    let paper = built(
        "contact:\ntip:\nsliding:\ncarve:\npatch:\nuncertainty:\nguard:\nrefine: { mode: paper }",
    );
    assert_eq!(paper.built, ["sync", "tip", "scan", "refine"]);
    let published = paper
        .left_out
        .iter()
        .filter(|left| left.reason == "the published rule has none");
    assert_eq!(
        published.map(|left| left.part).collect::<Vec<_>>(),
        ["contact", "sliding", "carve", "guard", "patch"],
        "{paper}"
    );
    let json = serde_json::to_value(&paper).unwrap();
    assert_eq!(
        json["left_out"][0],
        serde_json::json!({ "part": "clock", "reason": "no clock here" })
    );
    // all parts are either built or left out, once
    assert_eq!(paper.built.len() + paper.left_out.len(), 19);
}

/// The settings lack everything in the list of omissions: of a section that the scene names and the
/// published rule lacks, nothing remains.
#[test]
fn what_is_left_out_is_not_in_the_settings() {
    let settings = |yaml: &str| {
        let scene = Scene::from_yaml(&format!("refine: {{ mode: paper }}\n{yaml}")).unwrap();
        (
            scene.refine_params(WrenchFrame::Sensor),
            scene.patcher_params(),
        )
    };
    let parts = [
        "bias_tracking",
        "contact",
        "sliding",
        "carve",
        "guard",
        "patch",
        "uncertainty",
    ];
    let [named, off] =
        ["", "off"].map(|value| parts.map(|part| format!("{part}: {value}\n")).concat());
    assert_eq!(settings(&named), settings(&off));
    assert_eq!(settings(&named).1, None);
    let scene = Scene::from_yaml(&format!("refine: {{ mode: paper }}\n{named}")).unwrap();
    let left_out: Vec<_> = scene
        .built(&[], &[])
        .left_out
        .iter()
        .map(|left| left.part)
        .collect();
    assert!(
        parts.iter().all(|part| left_out.contains(part)),
        "{left_out:?}"
    );
}

/// Seven joints, one after the other, 100 mm apart and turned by a right angle from one to the
/// next.
fn urdf_of_seven_joints() -> String {
    let quarter = std::f64::consts::FRAC_PI_2;
    let joint = |number: usize| {
        format!(
            r#"<link name="link{number}"/><joint name="j{number}" type="revolute"><parent link="{}"/><child link="link{number}"/>
            <origin xyz="0 0 0.1" rpy="{} 0 0"/><axis xyz="0 0 1"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>"#,
            if number == 1 {
                "base_link".to_owned()
            } else {
                format!("link{}", number - 1)
            },
            if number.is_multiple_of(2) {
                quarter
            } else {
                -quarter
            },
        )
    };
    format!(
        r#"<robot name="seven"><link name="base_link"/>{}</robot>"#,
        (1..=7).map(joint).collect::<String>()
    )
}

#[test]
fn an_arm_that_is_no_ur_is_read_from_the_urdf_beside_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.yaml");
    let read = |robot: &str| {
        std::fs::write(
            &scene,
            format!("tip: {{ radius_mm: 1.5 }}\nrobot: {{ model: urdf, {robot} }}"),
        )
        .unwrap();
        Scene::read(&scene).map(|scene| scene.probing().unwrap().0.geometry)
    };
    std::fs::write(folder.path().join("arm.urdf"), urdf_of_seven_joints()).unwrap();
    let geometry = read("urdf: arm.urdf, flange_link: link7, link_radius_mm: 30").unwrap();
    assert_eq!(geometry.joint_count(), 7);
    // at zero the frames turn to and fro: of the last, four steps are up and three aside
    let flange = geometry.flange(&[0.0; 7].into());
    assert!(
        (flange.translation.vector - vector![0.0, 0.3, 0.4]).norm() < 1e-14,
        "{flange}"
    );
    let error = |robot: &str| read(robot).unwrap_err().to_string();
    assert!(
        error("urdf: arm.urdf").contains("there is no link `tool0`; there are base_link, link1")
    );
    assert!(error("urdf: other.urdf").contains("cannot read the URDF"));
    assert!(
        error("flange_link: link7")
            .ends_with("robot.model: urdf needs robot.urdf: name both or neither")
    );
}
