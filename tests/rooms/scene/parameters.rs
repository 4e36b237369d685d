//! The declaration of the parameters against a hand-written table, and generated files against the
//! declaration.

use std::fs;
use std::path::Path;

use touchup::scene::Scene;
use touchup_method::parameters::{Parameter, Section};

/// Key, unit, default (`-`: left out), smallest, largest.
const NUMBERS: &str = "
sync.reorder_ms ms 20 0 60000
sync.largest_gap_ms ms 30 0 60000
sync.largest_jump_s s 0.1 0 1e6
sync.wrench_offset_ms ms 0 -60000 60000
sync.wrench_drift_ppm ppm 0 -1000 1000
sync.capacity messages 4096 2 1e6
markers.positions_mm mm [[28,0,120],[-20,22,128],[-16,-26,140],[18,24,155],[-30,2,168],[6,-22,180]] -10000 10000
markers.spring_hz Hz 12 0.001 1e6
markers.damping - 1 0.5 100
markers.noise_mm mm 0.15 1e-6 1000
markers.gate_mm mm 4 1e-6 1000
markers.coast_ms ms 30 0.001 10000
markers.period_ms ms 1 0.05 10000
markers.reorder_ms ms 20 0 60000
scan_to_space.position_mm mm [0,0,0] -1e6 1e6
scan_to_space.orientation_xyzw length [0,0,0,1] 0.999 1.001
changes.from_s s - 0 9e9
changes.to_s s - 0 9e9
changes.shift_mm mm [0,0,0] -1000 1000
changes.turn_deg degrees [0,0,0] -180 180
changes.about_mm mm [0,0,0] -1e6 1e6
changes.shift_sigma_mm mm [0,0,0] 0 1000
changes.turn_sigma_deg degrees [0,0,0] 0 180
compensation.sensor_position_mm mm [0,0,0] -100000 100000
compensation.sensor_orientation_xyzw length - 0.999 1.001
compensation.payload.mass_kg kg 0 0 1000
compensation.payload.centre_mm mm [0,0,0] -10000 10000
compensation.payload.gravity_m_per_s2 m/s² [0,0,-9.81] -100 100
compensation.bias.force_n N [0,0,0] -10000 10000
compensation.bias.torque_nm N·m [0,0,0] -10000 10000
bias_tracking.settle_ms ms 60 0.001 60000
bias_tracking.time_s s 0.3 1e-6 1e6
contact.on_n N 0.4 0 1000
contact.off_n N 0.22 0 1000
contact.free_n N 0.15 0 1000
tip.radius_mm mm 1.5 0 1000
tip.edge_radius_mm mm - 0 1000
tip.half_angle_deg degrees - 1 80
tip.length_mm mm - 0.001 1000
tip.stiffness_n_per_mm N/mm 20 0.001 1e9
tip.offset_mm mm - -10000 10000
scan.noise_mm mm 0.6 0 1000
scan.region_low_mm mm - -1e6 1e6
scan.region_high_mm mm - -1e6 1e6
sliding.smoothing_ms ms 6 0 10000
sliding.velocity_smoothing_ms ms 20 0 10000
sliding.slowest_mm_per_s mm/s 8 0 1e6
sliding.cone_cosine - 0.9135 0 1
carve.rate_per_s 1/s 300 0 1e6
carve.tolerance_mm mm 0.05 0 1000
carve.contact_tolerance_mm mm 0.2 0 1000
guard.smallest_quality - 0.15 0 0.87
guard.smallest_turn_cosine - 0.5 -1 1
guard.smallest_evidence_cosine - 0 -1 1
guard.smallest_fold_cosine - -0.85 -1 1
guard.gap_edges edges 0.01 0 1
patch.tolerance_mm mm - 1e-6 100
uncertainty.radius_sigma_mm mm 0.001 0 1000
uncertainty.place_sigma_mm mm 0.002 0 1000
uncertainty.stiffness_percent % 2 0 100
uncertainty.gate_sigmas deviations 4 0.5 1e6
robot.payload_kg kg 0.25 0 50
robot.payload_centre_mm mm [0,0,50] -1000 1000
robot.ros2_control.sensor_position_mm mm [0,0,0] -1000 1000
robot.ros2_control.sensor_orientation_xyzw length [0,0,0,1] 0.999 1.001
robot.tip_position_mm mm [0,0,150] -2000 2000
robot.tip_orientation_xyzw length [1,0,0,0] 0.999 1.001
robot.workspace_low_mm mm [0,0,0] -5000 5000
robot.workspace_high_mm mm [0,0,0] -5000 5000
robot.arm_low_mm mm - -5000 5000
robot.arm_high_mm mm - -5000 5000
robot.touch_force_n N 3 0.1 100
robot.trigger_n N 1 0.05 80
robot.largest_force_n N 15 0.1 100
robot.force_noise_n N 0.15 0.0001 10
robot.link_mm_per_s mm/s 50 0.1 250
robot.link_radius_mm mm 60 1 1000
robot.search_mm_per_s mm/s 10 0.1 250
robot.measure_mm_per_s mm/s 2 0.05 250
robot.slide_mm_per_s mm/s 10 0.1 250
robot.largest_mm_per_s mm/s 100 0.1 250
robot.largest_joint_deg_per_s degrees/s 90 1 360
robot.acceleration_mm_per_s2 mm/s² 500 10 5000
robot.fault_stop_mm_per_s2 mm/s² 5000 10 10000
robot.largest_tare_n N 5 0.1 100
robot.search_mm mm 15 0.5 100
robot.latency_ms ms 20 0 200
robot.time_s s 600 1 86400
robot.check_days days 30 0.01 3650
robot.temperature_c °C - -50 100
robot.least_dexterity - 0.02 0 1
robot.clearance_mm mm 3 0.5 50
robot.depth_mm mm 5 0 100
robot.shaft_radius_mm mm 1 0.05 50
robot.shaft_length_mm mm 60 0 500
robot.margin_mm mm 0.5 0 50
robot.tolerance_mm mm 0.05 0.0001 10
robot.confidence - 0.95 0.5 0.9999
robot.touches touches 39 1 10000
robot.square_sigma_deg degrees 0.13 1e-3 20
robot.touch_sigma_mm mm 0.03 1e-5 1
robot.radius_sigma_mm mm 0.001 0 10
robot.place_sigma_mm mm 0 0 100
robot.turn_sigma_deg degrees 0 0 20
robot.growth_mm_per_m mm/m 0 0 100
robot.registered_at_mm mm [0,0,0] -1e6 1e6
refine.f_max_n N 10 1e-6 1e6
refine.h_min_mm mm 0.5 1e-9 1e6
refine.delta - 5 -50 50
refine.alpha_m_per_n_s m/(N·s) - 0 1e6
refine.beta_per_n2_s 1/(N²·s) - 0 1e9
refine.turning_per_s 1/s - 0 1e6
refine.roi_mm mm - 0 1000
";

/// Key, default, the words to choose from (`-`: any).
const WORDS: &str = "
columns.time - -
columns.position - -
columns.orientation - -
columns.force - -
columns.torque - -
columns.wrench_axes pose pose,tip
changes.cause part_moved part_moved,tip_bent
compensation.payload.gravity_axes object object,space
tip.shape ball ball,flat,cone
scan.file - -
scan.unit mm m,mm,inch
robot.model ur5e ur3e,ur5e,ur10e,ur16e,urdf
robot.urdf - -
robot.check - -
robot.ros2_control.joint_states_topic '/joint_states' -
robot.ros2_control.wrench_topic '/force_torque_sensor_broadcaster/wrench' -
robot.ros2_control.trajectory_topic '/joint_trajectory_controller/joint_trajectory' -
robot.ros2_control.wrench_frame 'tool0' -
robot.base_link 'base_link' -
robot.flange_link 'tool0' -
robot.allow_motion false -
robot.host '' -
robot.site_packages '' -
refine.mode robust robust,paper
refine.contact_model - sigmoid,spring
refine.step - lie,corrected,bounded,dp5
refine.along - normal0,force
";

/// The sections, and whether the default scene builds them.
const SECTIONS: [(&str, bool); 21] = [
    ("sync", true),
    ("columns", false),
    ("clock", true),
    ("markers", false),
    ("scan_to_space", false),
    ("changes", false),
    ("compensation", false),
    ("compensation.payload", false),
    ("compensation.bias", false),
    ("bias_tracking", false),
    ("contact", true),
    ("tip", true),
    ("scan", true),
    ("sliding", true),
    ("carve", true),
    ("guard", true),
    ("patch", true),
    ("uncertainty", true),
    ("robot", false),
    ("robot.ros2_control", false),
    ("refine", true),
];

struct Row {
    key: &'static str,
    unit: &'static str,
    default: Option<&'static str>,
    low: f64,
    high: f64,
}

fn rows() -> impl Iterator<Item = Row> {
    NUMBERS.trim().lines().map(|line| {
        let [key, unit, default, low, high] =
            line.split(' ').collect::<Vec<_>>().try_into().unwrap();
        let default = (default != "-").then_some(default);
        Row {
            key,
            unit,
            default,
            low: low.parse().unwrap(),
            high: high.parse().unwrap(),
        }
    })
}

fn declared() -> Vec<Parameter> {
    fn below(parameter: Parameter, all: &mut Vec<Parameter>) {
        all.push(parameter.clone());
        parameter
            .inner
            .into_iter()
            .for_each(|inner| below(inner, all));
    }
    let mut all = vec![];
    Scene::parameters()
        .into_iter()
        .for_each(|section| below(section, &mut all));
    all
}

/// In the order of their names.
fn sorted(mut lines: Vec<String>) -> Vec<String> {
    lines.sort();
    lines
}

#[test]
fn each_parameter_is_declared_as_in_the_table_by_hand() {
    let (mut by_hand, mut of_code) = (vec![], vec![]);
    for Row {
        key,
        unit,
        default,
        low,
        high,
    } in rows()
    {
        by_hand.push(format!("{key} {unit} {default:?} {low} {high}"));
    }
    for one in declared().iter().filter(|one| one.range.is_some()) {
        let [low, high] = one.range.unwrap();
        // a word of the unit's full name
        let known = ["length", "edges", "deviations", "scan"]
            .into_iter()
            .find(|word| one.unit.symbol.contains(word));
        let unit = if one.unit.symbol.is_empty() {
            "-"
        } else {
            known.unwrap_or(one.unit.symbol)
        };
        let default = one
            .default
            .as_ref()
            .map(|default| default.replace(", ", ","));
        of_code.push(format!("{} {unit} {default:?} {low} {high}", one.name()));
    }
    assert_eq!(sorted(of_code), sorted(by_hand));

    let or_none = |text: &str| {
        if text.is_empty() {
            "-".to_owned()
        } else {
            text.to_owned()
        }
    };
    let words = declared()
        .into_iter()
        .filter(|one| one.range.is_none() && !one.is_section)
        .map(|one| {
            format!(
                "{} {} {}",
                one.name(),
                one.default.clone().unwrap_or_else(|| "-".into()),
                or_none(&one.words.join(","))
            )
        });
    assert_eq!(
        sorted(words.collect()),
        sorted(WORDS.trim().lines().map(str::to_owned).collect())
    );
    let sections = declared().into_iter().filter(|one| one.is_section);
    let sections: Vec<_> = sections
        .map(|one| (one.name(), one.default.is_some()))
        .collect();
    assert_eq!(
        sections,
        SECTIONS.map(|(name, is_built)| (name.to_owned(), is_built))
    );
}

#[test]
fn each_parameter_is_explained_and_has_its_unit_in_its_key() {
    let suffixes = [
        ("mm", "_mm"),
        ("ms", "_ms"),
        ("s", "_s"),
        ("days", "_days"),
        ("°C", "_c"),
        ("N", "_n"),
        ("N·m", "_nm"),
        ("kg", "_kg"),
        ("Hz", "_hz"),
        ("1/s", "_per_s"),
        ("mm/s", "_mm_per_s"),
        ("mm/s²", "_mm_per_s2"),
        ("m/s²", "_m_per_s2"),
        ("N/mm", "_n_per_mm"),
        ("m/(N·s)", "_m_per_n_s"),
        ("1/(N²·s)", "_per_n2_s"),
        ("%", "_percent"),
        ("degrees", "_deg"),
        ("degrees/s", "_deg_per_s"),
    ];
    for one in declared() {
        let summary = one.summary();
        assert!(
            summary.len() > 8 && summary.ends_with('.'),
            "{}: {summary}",
            one.name()
        );
        if let Some((_, suffix)) = suffixes
            .iter()
            .find(|(symbol, _)| *symbol == one.unit.symbol)
        {
            assert!(one.key.ends_with(suffix), "{} has no {suffix}", one.name());
        }
        assert!(
            one.default.is_some() || one.is_section || !one.example.is_empty(),
            "{}: no example",
            one.name()
        );
    }
}

/// `key: value` as one scene, with the other keys that it requires.
fn scene(key: &str, value: &str) -> String {
    let (section, name) = key.rsplit_once('.').unwrap();
    let speeds =
        "link_mm_per_s: 0.1, search_mm_per_s: 0.1, measure_mm_per_s: 0.1, slide_mm_per_s: 0.1, ";
    let with = match key {
        "changes.from_s" => "",
        _ if section == "changes" => "from_s: 0, ",
        "contact.on_n" => "off_n: 0, ",
        "contact.off_n" => "on_n: 1000, ",
        "scan.region_low_mm" => "region_high_mm: [1e6, 1e6, 1e6], ",
        "scan.region_high_mm" => "region_low_mm: [-1e6, -1e6, -1e6], ",
        "robot.workspace_low_mm" => "workspace_high_mm: [5000, 5000, 5000], ",
        "robot.workspace_high_mm" => "workspace_low_mm: [-5000, -5000, -5000], ",
        "robot.touch_force_n" => "trigger_n: 0.05, largest_force_n: 100, ",
        "robot.trigger_n" => "touch_force_n: 100, largest_force_n: 100, ",
        "robot.largest_force_n" => "trigger_n: 0.05, touch_force_n: 0.1, ",
        "robot.largest_mm_per_s" => speeds,
        _ if key.ends_with("mm_per_s") && section == "robot" => "largest_mm_per_s: 250, ",
        "markers.gate_mm" => "positions_mm: [[0, 0, 5000], [0, 5000, 0], [5000, 0, 0]], ",
        _ => "",
    };
    let inner =
        section
            .rsplit('.')
            .fold(format!("{with}{name}: {value}"), |inner, name| match name {
                "changes" => format!("{name}: [{{ {inner} }}]"),
                _ => format!("{name}: {{ {inner} }}"),
            });
    // a ball of radius 0 has no patch
    let others = [("tip", ""), ("contact", ""), ("patch", "off")]
        .into_iter()
        .filter(|(other, _)| *other != section);
    let others = others.map(|(other, value)| format!(", {other}: {value}"));
    format!("{{ {inner}{} }}", others.collect::<String>())
}

/// The value as the key has it: in a vector, in a quaternion, in a list of markers.
fn written(row: &Row, x: f64) -> String {
    let is_vector = [
        "position_mm",
        "centre_mm",
        "gravity_m_per_s2",
        "bias.force_n",
        "torque_nm",
        "offset_mm",
        "region_",
        "workspace_",
        "robot.arm_",
        "registered_at_mm",
        "changes.shift",
        "changes.turn",
        "changes.about",
    ];
    match row.key {
        _ if row.unit == "length" => format!("[{x}, 0, 0, 0]"),
        "markers.positions_mm" => format!("[[0, 0, {x}], [0, 50, 0], [50, 0, 0]]"),
        "sync.wrench_offset_ms" => x.to_string(),
        key if is_vector.iter().any(|part| key.contains(part)) => format!("[{x}, {x}, {x}]"),
        _ => x.to_string(),
    }
}

#[test]
fn a_number_is_taken_up_to_its_limits_and_refused_beyond_them() {
    let mut wrong = vec![];
    for row in rows() {
        let Row { key, low, high, .. } = row;
        let is_whole = ["sync.capacity", "robot.touches"].contains(&key);
        let by = |limit: f64| {
            if is_whole {
                1.0
            } else if limit == 0.0 {
                0.01
            } else {
                0.01 * limit.abs()
            }
        };
        for x in [low, high] {
            // a corner of the scan's box at the other one is no box
            let is_empty_box =
                key.starts_with("scan.region") && (x > 0.0) == key.ends_with("low_mm");
            if is_empty_box
                || key == "markers.positions_mm"
                || (key == "markers.gate_mm" && x > 0.0)
            {
                continue;
            }
            if let Err(error) = Scene::from_yaml(&scene(key, &written(&row, x))) {
                wrong.push(format!("{key} {x} is refused: {error}"));
            }
        }
        let beyond: &[f64] = if is_whole {
            &[]
        } else {
            &[f64::NAN, f64::INFINITY, f64::NEG_INFINITY]
        };
        for x in [low - by(low), high + by(high)].iter().chain(beyond) {
            let yaml = written(&row, *x)
                .replace("NaN", ".nan")
                .replace("inf", ".inf");
            match Scene::from_yaml(&scene(key, &yaml)) {
                Ok(_) => wrong.push(format!("{key} {x} is taken")),
                Err(error) => {
                    let error = error.to_string();
                    let names_range =
                        error.contains(&format!("{key} is ")) && error.contains("; it must be ");
                    if !names_range {
                        wrong.push(format!("{key} {x}: {error}"));
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// `TOUCHUP_WRITE=1 cargo test -p touchup-tests --test rooms written_from_the_definition` writes
/// them.
#[test]
fn the_shipped_scene_and_the_page_of_parameters_are_written_from_the_definition() {
    for (file, text) in [
        ("config/default.yaml", Scene::template()),
        ("docs/scene.md", Scene::table()),
    ] {
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join(file);
        if std::env::var_os("TOUCHUP_WRITE").is_some() {
            fs::write(&path, &text).unwrap();
        }
        let is_same = fs::read_to_string(&path).is_ok_and(|shipped| shipped == text);
        assert!(
            is_same,
            "{file} is not as the parameters are declared: run this test with TOUCHUP_WRITE=1"
        );
    }
}
