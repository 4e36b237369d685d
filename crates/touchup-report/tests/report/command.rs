//! `touchup-report` at the boundary of the process.

use std::fs;
use std::process::{Command, Output};

use serde_json::Value;

fn report(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_touchup-report"))
        .args(arguments)
        .env_remove("RUST_LOG")
        .output()
        .unwrap()
}

#[test]
fn a_folder_that_cannot_be_and_a_chapter_that_is_not_are_wrong_usage() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a");
    fs::write(&file, "kept").unwrap();
    let file = file.to_str().unwrap();
    for arguments in [
        &[][..],
        &["--out", file],
        &["--out", "x", "--only", "nothing"],
    ] {
        let output = report(arguments);
        assert_eq!(
            (output.status.code(), output.stdout.len()),
            (Some(2), 0),
            "{arguments:?}"
        );
    }
    assert_eq!(fs::read_to_string(file).unwrap(), "kept");
}

#[test]
fn one_chapter_is_measured_written_and_printed() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("made/anew");
    let output = report(&[
        "--out",
        out.to_str().unwrap(),
        "--quick",
        "--json",
        "--only",
        "work-precision",
    ]);
    assert_eq!(
        output.status.code(),
        Some(0),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    let written: Value =
        serde_json::from_slice(&fs::read(out.join("report.json")).unwrap()).unwrap();
    assert_eq!(printed, written);
    assert_eq!(printed["chapters"].as_array().unwrap().len(), 1);
    assert!(
        printed["command"]
            .as_str()
            .unwrap()
            .ends_with("--quick --only work-precision")
    );
    assert!(
        !printed["machine"].as_str().unwrap().is_empty()
            && !printed["commit"].as_str().unwrap().is_empty()
    );
    let html = fs::read_to_string(out.join("report.html")).unwrap();
    for figure in printed["chapters"][0]["figures"].as_array().unwrap() {
        let id = figure["id"].as_str().unwrap();
        for name in [format!("{id}.csv"), format!("{id}.svg")] {
            assert!(
                out.join(&name).is_file() && html.contains(&format!("href=\"{name}\"")),
                "{name}"
            );
        }
    }
    assert!(String::from_utf8_lossy(&output.stderr).contains("work-precision"));
}
