//! `touchup features` at the boundary of the process.

use std::process::{Command, Output};

use serde_json::Value;

use crate::shared::shared;

fn features(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_touchup-tested"))
        .arg("features")
        .args(arguments)
        .env_remove("RUST_LOG")
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

/// Field by field as in docs/features.md, on one blind, one through, one countersunk hole, a slot,
/// an edge and a plane.
#[test]
fn json_has_the_fields_that_are_promised() {
    let Some(folder) = shared("parts/permissive") else {
        return;
    };
    let path = folder.join("trimesh_plate_holes.STL");
    let out = std::env::temp_dir().join(format!("touchup-features-{}.json", std::process::id()));
    let output = features(&[
        path.to_str().unwrap(),
        "--json",
        "--out",
        out.to_str().unwrap(),
    ]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    let written: Value = serde_json::from_slice(&std::fs::read(&out).unwrap()).unwrap();
    std::fs::remove_file(&out).unwrap();
    assert_eq!(printed, written);
    let all = printed["features"].as_array().unwrap();
    let ids: Vec<u64> = all
        .iter()
        .map(|feature| feature["id"].as_u64().unwrap())
        .collect();
    assert_eq!(ids, (0..all.len() as u64).collect::<Vec<_>>());
    let sunk: Vec<&Value> = all
        .iter()
        .filter(|feature| feature.get("cone_angle_deg").is_some())
        .collect();
    assert_eq!(sunk.len(), 4);
    for hole in sunk {
        assert_eq!(hole["kind"], "hole");
        assert_eq!(
            (hole["through"].as_bool(), hole["fitted_to"].as_str()),
            (Some(true), Some("mesh"))
        );
        assert_eq!(
            (
                hole["touched"].as_f64(),
                hole.get("touches"),
                hole.get("width_mm")
            ),
            (Some(0.0), None, None)
        );
        assert_eq!(
            [&hole["center_mm"], &hole["axis"]].map(|v| v.as_array().unwrap().len()),
            [3, 3]
        );
        assert!((hole["diameter_mm"].as_f64().unwrap() - 6.7564).abs() < 1e-3);
        for number in ["center_mm", "axis_deg", "diameter_mm", "cone_angle_deg"] {
            assert!(
                hole["std"][number].as_f64().unwrap() < 0.01,
                "{number}: {hole}"
            );
        }
    }
    let groups: Vec<&Value> = all
        .iter()
        .filter_map(|feature| feature.get("group"))
        .collect();
    assert!(groups.len() == 2 && groups[0] == groups[1], "{groups:?}");
    assert!(printed["unexplained"].as_f64().unwrap() < 0.2);
}

#[test]
fn the_table_counts_in_plain_words() {
    let Some(folder) = shared("parts/permissive") else {
        return;
    };
    let path = folder.join("godel_Tool_Mounting_Plate.STL");
    let output = features(&[path.to_str().unwrap(), "--mesh-unit", "m"]);
    let table = text(&output.stdout);
    assert!(table.contains("features: 21 holes, 1 boss, "), "{table}");
    assert!(table.contains("through"), "{table}");
}

#[test]
fn a_missing_mesh_and_a_mesh_of_points_are_refused() {
    let output = features(&["/nowhere/part.stl"]);
    assert!(
        !output.status.success() && text(&output.stderr).contains("/nowhere/part.stl"),
        "{output:?}"
    );
    let Some(path) = shared("nasty/assimp_PLY_points.ply") else {
        return;
    };
    let output = features(&[path.to_str().unwrap(), "--json"]);
    assert!(
        !output.status.success() && output.stdout.is_empty(),
        "{output:?}"
    );
    assert!(
        text(&output.stderr).contains("only 4 of its 4 points are of use"),
        "{output:?}"
    );
}
