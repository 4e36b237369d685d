//! `touchup probe --robot ur`: from a flag to a feature through the real client.

use std::path::Path;
use std::process::Command;

use serde_json::Value;
use tempfile::TempDir;
use touchup::io::mesh_file::{MeshUnit, write_mesh};
use touchup::sim::{Plate, ScannerParams, scan};

use super::stand_in::StandIn;
use super::with_library;

/// A folder with the scan of the demo, and with its scene, which has the controller on a loopback
/// address.
pub fn cell(stand_in: &StandIn, packages: &Path) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let scanned = scan(&Plate::default(), &ScannerParams::default()).unwrap();
    write_mesh(
        &folder.path().join("scan.ply"),
        &scanned,
        MeshUnit::Millimetre,
    )
    .unwrap();
    let robot = format!(
        "robot:\n  host: {}\n  site_packages: {}\n",
        stand_in.address,
        packages.display()
    );
    let scene = include_str!("../../config/probe.yaml").replace("robot:\n", &robot);
    std::fs::write(folder.path().join("scene.yaml"), scene).unwrap();
    folder
}

/// The through hole of the plate, Ø 8 mm at (16, 36), invisible in the scan.
#[test]
#[ignore = "a slow proof"]
fn a_ur_probes_a_hole_from_one_click() {
    with_library(|packages| {
        let stand_in = StandIn::start(&["--start-mm", "20,30,60"]);
        let folder = cell(&stand_in, packages);
        let out = folder.path().join("out");
        let done = Command::new(env!("CARGO_BIN_EXE_touchup-tested"))
            .env("TOUCHUP_UR_LOCK_STEP", "1")
            .args([
                "probe",
                "--robot",
                "ur",
                "--feature",
                "hole@17.5,34.8,12",
                "--json",
            ])
            .arg("--scene")
            .arg(folder.path().join("scene.yaml"))
            .arg("--out")
            .arg(&out)
            .output()
            .unwrap();
        let stderr = String::from_utf8_lossy(&done.stderr).into_owned();
        let summary: Value =
            serde_json::from_slice(&done.stdout).unwrap_or_else(|_| panic!("{stderr}"));
        let hole = &summary["features"][0];
        assert_eq!(hole["code"], "tolerance_reached", "{stderr}");
        let number = |key: &str| hole["feature"][key].as_f64().unwrap();
        let centre: Vec<f64> = hole["feature"]["center_mm"]
            .as_array()
            .unwrap()
            .iter()
            .map(|x| x.as_f64().unwrap())
            .collect();
        let off = (centre[0] - 16.0).hypot(centre[1] - 36.0);
        let (touches, force) = (
            hole["touches"].as_u64().unwrap(),
            hole["largest_force_n"].as_f64().unwrap(),
        );
        println!(
            "{touches} touches, {:.0} s, {force:.1} N; place {off:.4} mm, diameter {:+.4} mm",
            hole["duration_s"].as_f64().unwrap(),
            number("diameter_mm") - 8.0
        );
        assert!(off < 0.05 && (number("diameter_mm") - 8.0).abs() < 0.05);
        assert!(touches < 40 && force < 4.5, "{touches} touches, {force} N");
        assert!(out.join("touches.png").exists() && out.join("probed_touches.jsonl").exists());
        Ok(())
    });
}
