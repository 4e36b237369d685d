//! `touchup sweep` and `touchup whatif` at the boundary of the process: ids, results that are whole
//! or not there, tables, and reported changes.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use nalgebra::UnitQuaternion;
use serde_json::{Value, json};
use touchup::io::recording::{Topics, write_recording};
use touchup::sweep::{GivenInput, JobRunner, JobsFile};

use crate::cli::{code, flat_scan, json as one_object, text, touch, touchup};

/// A folder with a scan and a recording of [`touch`], for sweeps.
struct Sweep {
    folder: tempfile::TempDir,
}

impl Sweep {
    fn new(grid: &str) -> Self {
        Self::named(grid, ["scan.ply", "touch.mcap"])
    }

    fn named(grid: &str, [scan, recording]: [&str; 2]) -> Self {
        let sweep = Self {
            folder: tempfile::tempdir().unwrap(),
        };
        fs::write(sweep.path(scan), flat_scan()).unwrap();
        let messages = touch(UnitQuaternion::identity(), false);
        write_recording(
            &sweep.path(recording),
            &Topics::default(),
            "object",
            "stylus",
            messages,
        )
        .unwrap();
        let files = format!("scan: {scan}\nrecordings: [{recording}]\n");
        fs::write(sweep.path("grid.yaml"), files + grid).unwrap();
        sweep
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn name(&self, name: &str) -> String {
        self.path(name).to_str().unwrap().to_owned()
    }

    fn plan(&self) -> Output {
        touchup(
            &[
                "sweep",
                "plan",
                &self.name("grid.yaml"),
                "--out",
                &self.name("jobs.jsonl"),
            ],
            "",
        )
    }

    /// The lines of a plan.
    fn jobs(&self) -> Vec<Value> {
        let planned = self.plan();
        assert_eq!((code(&planned), text(&planned.stderr)), (0, ""));
        let lines = fs::read_to_string(self.path("jobs.jsonl")).unwrap();
        lines
            .lines()
            .map(|line| serde_json::from_str(line).unwrap())
            .collect()
    }

    fn ids(&self) -> Vec<String> {
        self.jobs()
            .iter()
            .map(|job| job["id"].as_str().unwrap().to_owned())
            .collect()
    }

    fn run(&self, flags: &[&str]) -> Output {
        touchup(
            &[&["sweep", "run", &self.name("jobs.jsonl")], flags].concat(),
            "",
        )
    }

    fn run_in_background(&self, flags: &[&str]) -> std::process::Child {
        let mut command = Command::new(env!("CARGO_BIN_EXE_touchup-tested"));
        command
            .args(["sweep", "run", &self.name("jobs.jsonl")])
            .args(flags);
        command
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    }

    /// Each file of a result by its name.
    fn result(&self, results: &str, id: &str) -> BTreeMap<String, Vec<u8>> {
        let entries = fs::read_dir(self.path(results).join(id))
            .unwrap()
            .map(Result::unwrap);
        entries
            .map(|entry| {
                (
                    entry.file_name().into_string().unwrap(),
                    fs::read(entry.path()).unwrap(),
                )
            })
            .collect()
    }

    /// The entries of the folder of the results, hidden names too.
    fn names_in(&self, results: &str) -> Vec<String> {
        names_in(&self.path(results))
    }
}

fn names_in(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

const ONE_JOB: &str = "keys: { tip.radius_mm: 1.5 }\n";

// ---- plan

#[test]
fn a_plan_has_every_setting_with_every_recording_in_the_order_of_the_alphabet() {
    let sweep = Sweep::new(
        "keys: { tip.radius_mm: 1.5, tip.stiffness_n_per_mm: [10, 20], contact.on_n: { from: 0.4, to: 0.8, steps: 3 } }\n",
    );
    fs::copy(sweep.path("touch.mcap"), sweep.path("again.mcap")).unwrap();
    let planned = touchup(
        &[
            "sweep",
            "plan",
            &sweep.name("grid.yaml"),
            &sweep.name("again.mcap"),
            "--out",
            &sweep.name("jobs.jsonl"),
        ],
        "",
    );
    assert_eq!(code(&planned), 0, "{}", text(&planned.stderr));
    let lines = fs::read_to_string(sweep.path("jobs.jsonl")).unwrap();
    let jobs: Vec<Value> = lines
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(jobs.len(), 3 * 2 * 2);
    let row = |job: &Value| {
        let number = |key: &str| job["keys"][key].as_f64().unwrap();
        (
            number("contact.on_n"),
            number("tip.stiffness_n_per_mm"),
            job["recording"].as_str().unwrap().to_owned(),
        )
    };
    let expected = [
        (0.4, 10.0, "touch.mcap"),
        (0.4, 10.0, "again.mcap"),
        (0.4, 20.0, "touch.mcap"),
        (0.4, 20.0, "again.mcap"),
        (0.6, 10.0, "touch.mcap"),
    ];
    let first: Vec<_> = jobs.iter().take(5).map(row).collect();
    assert_eq!(
        first,
        expected.map(|(on, k, name)| (on, k, name.to_owned()))
    );
    assert_eq!(
        jobs[0]["id"], jobs[1]["id"],
        "recordings of the same content are one job"
    );
    assert!(
        jobs.iter()
            .zip(0_u64..)
            .all(|(job, number)| job["job"] == number)
    );
    assert_eq!(jobs[0]["scan"], "scan.ply");
}

/// The hash of the recording is that of `sha256sum`.
#[test]
fn ids_depend_on_content_and_not_on_paths() {
    let one = Sweep::new("scene: a.yaml\nkeys: { contact.on_n: [0.4, 0.5] }\n");
    fs::write(one.path("a.yaml"), "tip: { radius_mm: 1.5 }\n").unwrap();
    let other = Sweep::named(
        "scene: deep/b.yaml\nkeys: { contact.on_n: [0.4, 0.5] }\n",
        ["part.ply", "monday.mcap"],
    );
    fs::create_dir(other.path("deep")).unwrap();
    fs::write(
        other.path("deep/b.yaml"),
        "# the same in other words\ntip:\n  radius_mm: 1.50\nsync:\n",
    )
    .unwrap();
    assert_eq!(one.ids(), other.ids());
    let sum = Command::new("sha256sum")
        .arg(one.path("touch.mcap"))
        .output()
        .unwrap();
    assert_eq!(
        one.jobs()[0]["recording_sha256"].as_str(),
        text(&sum.stdout).split_whitespace().next()
    );

    let before = other.ids();
    fs::write(other.path("deep/b.yaml"), "tip: { radius_mm: 1.6 }\n").unwrap();
    assert!(
        other.ids().iter().zip(&before).all(|(a, b)| a != b),
        "another scene"
    );
    fs::write(other.path("deep/b.yaml"), "tip: { radius_mm: 1.5 }\n").unwrap();
    assert_eq!(other.ids(), before);
    fs::write(other.path("part.ply"), flat_scan() + "\n").unwrap();
    assert!(
        other.ids().iter().zip(&before).all(|(a, b)| a != b),
        "another scan"
    );
}

#[test]
fn a_misspelt_key_is_refused_with_its_line_and_the_key_that_is_meant() {
    let sweep = Sweep::new("keys:\n  tip.radius_mm: 1.5\n  tip.stifness_n_per_mm: [10, 20]\n");
    let refused = sweep.plan();
    let said = text(&refused.stderr);
    assert_eq!((code(&refused), text(&refused.stdout)), (3, ""));
    assert!(
        said.contains("grid.yaml: line 5: tip.stifness_n_per_mm"),
        "{said}"
    );
    assert!(
        said.contains("did you mean `stiffness_n_per_mm`?"),
        "{said}"
    );
    assert!(!sweep.path("jobs.jsonl").exists());
    for (grid, code_of, expected) in [
        ("keys: { tip.radius_mm: -1 }\n", 3, "tip.radius_mm is -1"),
        ("keys: {}\n", 3, "the radius of the ball is not known"),
        ("keyes: {}\n", 3, "did you mean `keys`?"),
        (
            "keys: { tip.radius_mm: { from: 1, to: 2 } }\n",
            3,
            "a grid needs steps",
        ),
        (
            "keys: { robot.speed_mm_per_s: [1] }\n",
            3,
            "changes nothing of a refinement",
        ),
        (
            "keys: { tip.radius_mm: { from: 1, to: 2, steps: 1001 }, contact.on_n: { from: 1, to: 2, steps: 1000 } }\n",
            2,
            "1001000 jobs are too many",
        ),
    ] {
        let sweep = Sweep::new(grid);
        let refused = sweep.plan();
        assert_eq!(code(&refused), code_of, "{grid}: {}", text(&refused.stderr));
        assert!(
            text(&refused.stderr).contains(expected),
            "{grid}: {}",
            text(&refused.stderr)
        );
    }
}

// ---- run

#[test]
fn a_result_has_the_same_bytes_wherever_and_under_whatever_names_it_is_made() {
    let one = Sweep::new(ONE_JOB);
    let other = Sweep::named(ONE_JOB, ["part.ply", "monday.mcap"]);
    let ids = [one.ids(), other.ids()];
    assert_eq!(ids[0], ids[1]);
    let id = &ids[0][0];
    for sweep in [&one, &other] {
        let ran = sweep.run(&["--job", "0", "--json"]);
        assert_eq!((code(&ran), text(&ran.stderr)), (0, ""));
        assert_eq!(one_object(&ran)["was_there"], false);
    }
    let result = one.result("results", id);
    let names: Vec<_> = result.keys().map(String::as_str).collect();
    assert_eq!(
        names,
        [
            "SHA256SUMS",
            "features.json",
            "job.json",
            "refined.ply",
            "summary.json"
        ]
    );
    assert_eq!(result, other.result("results", id));
    for (name, bytes) in &result {
        let said = String::from_utf8_lossy(bytes);
        let is_named = [one.folder.path(), other.folder.path()]
            .iter()
            .any(|folder| said.contains(folder.to_str().unwrap()));
        assert!(!is_named && !said.contains("mcap"), "{name}");
    }
    let summary: Value = serde_json::from_slice(&result["summary.json"]).unwrap();
    assert_eq!(
        (
            &summary["samples"],
            &summary["accepted"],
            &summary["contacts"]
        ),
        (&1001.into(), &1001.into(), &1.into())
    );

    let again = one.run(&["--job", "0", "--json"]);
    assert_eq!(one_object(&again)["was_there"], true);
    assert_eq!(one_object(&again)["summary"], summary);
    assert_eq!(code(&one.run(&["--job", "0", "--again"])), 0);
    assert_eq!(one.result("results", id), result);
    assert_eq!(one.names_in("results"), std::slice::from_ref(id));
}

/// As the Python package runs one whose files an engine has brought along.
#[test]
fn a_job_of_given_bytes_is_that_of_its_files() {
    let sweep = Sweep::new(ONE_JOB);
    let id = sweep.ids().remove(0);
    let job = JobsFile::job(&sweep.path("jobs.jsonl"), 0).unwrap();
    let run = |results: &str, given: GivenInput<'_>| {
        let runner = JobRunner::new(&sweep.path("jobs.jsonl"), Some(sweep.path(results)));
        runner.run(&job, given, false, &mut || {})
    };
    run("by_files", GivenInput::default()).unwrap();
    let [scan, recording] = ["scan.ply", "touch.mcap"].map(|name| {
        let bytes = fs::read(sweep.path(name)).unwrap();
        fs::remove_file(sweep.path(name)).unwrap();
        bytes
    });
    let given = |scan| GivenInput {
        scan: Some(scan),
        recording: Some(&recording),
    };
    let report = run("by_bytes", given(&scan)).unwrap();
    assert!(!report.was_there && report.failed.is_none());
    assert_eq!(sweep.result("by_files", &id), sweep.result("by_bytes", &id));
    let refused = run("by_others", given(&[&scan[..], b" "].concat())).unwrap_err();
    assert!(
        refused.to_string().contains("not what was planned"),
        "{refused}"
    );
}

/// The mesh and the features are those of `touchup refine` with the same scene.
#[test]
fn a_job_is_what_refine_does() {
    let sweep = Sweep::new("keys: { tip.radius_mm: 1.5, tip.stiffness_n_per_mm: 20 }\n");
    let id = sweep.ids().remove(0);
    assert_eq!(code(&sweep.run(&[])), 0);
    let [scan, bag, out, features] =
        ["scan.ply", "touch.mcap", "refined.ply", "features.json"].map(|name| sweep.name(name));
    let flags = [
        "--features-out",
        &features,
        "--tip-radius-mm",
        "1.5",
        "--stiffness-n-per-mm",
        "20",
    ];
    let refined = touchup(
        &[
            &["refine", "--scan", &scan, "--bag", &bag, "--out", &out],
            &flags[..],
        ]
        .concat(),
        "",
    );
    assert_eq!(code(&refined), 0);
    let result = sweep.result("results", &id);
    for name in ["refined.ply", "features.json"] {
        assert_eq!(result[name], fs::read(sweep.path(name)).unwrap(), "{name}");
    }
}

/// First while it waits for its scan, a pipe without a writer; then at any point of its work once
/// its first file is there.
#[test]
fn a_killed_job_leaves_nothing_half_and_the_next_one_gives_the_same_bytes() {
    let sweep = Sweep::new(ONE_JOB);
    let id = sweep.ids().remove(0);
    assert_eq!(
        code(&sweep.run(&["--job", "0", "--results", &sweep.name("clean")])),
        0
    );
    let clean = sweep.result("clean", &id);
    fs::rename(sweep.path("scan.ply"), sweep.path("kept.ply")).unwrap();
    assert!(
        Command::new("mkfifo")
            .arg(sweep.path("scan.ply"))
            .status()
            .unwrap()
            .success()
    );
    let left = |suffix: &str| {
        let names = if sweep.path("results").exists() {
            sweep.names_in("results")
        } else {
            Vec::new()
        };
        names
            .into_iter()
            .find(|name| name.ends_with(suffix))
            .map(|name| sweep.path("results").join(name))
    };
    let mut job = sweep.run_in_background(&["--job", "0"]);
    let part = std::iter::repeat_with(|| left(".part"))
        .find_map(|part| part)
        .unwrap();
    job.kill().unwrap();
    job.wait().unwrap();
    assert!(part.is_dir() && !sweep.path("results").join(&id).exists());

    fs::remove_file(sweep.path("scan.ply")).unwrap();
    fs::rename(sweep.path("kept.ply"), sweep.path("scan.ply")).unwrap();
    let mut job = sweep.run_in_background(&["--job", "0"]);
    let has_begun = || left(".part").is_some_and(|part| part.join("job.json").exists());
    while !has_begun() && job.try_wait().unwrap().is_none() {
        std::thread::yield_now();
    }
    job.kill().unwrap();
    job.wait().unwrap();
    if sweep.path("results").join(&id).exists() {
        assert_eq!(sweep.result("results", &id), clean, "it was whole already");
    }
    assert_eq!(code(&sweep.run(&["--job", "0"])), 0);
    assert_eq!(sweep.result("results", &id), clean);
    assert_eq!(sweep.names_in("results"), [id]);
}

#[test]
fn two_runs_of_one_job_at_once_are_one_result() {
    let sweep = Sweep::new(ONE_JOB);
    let id = sweep.ids().remove(0);
    let jobs: Vec<_> = (0..4)
        .map(|_| sweep.run_in_background(&["--job", "0", "--json"]))
        .collect();
    let ended: Vec<_> = jobs
        .into_iter()
        .map(|job| job.wait_with_output().unwrap())
        .collect();
    assert!(ended.iter().all(|one| code(one) == 0));
    let made = ended
        .iter()
        .filter(|one| one_object(one)["was_there"] == false)
        .count();
    assert_eq!(made, 1, "the others waited for it");
    assert_eq!(sweep.names_in("results"), [id]);
}

#[test]
fn a_file_that_is_not_what_was_planned_is_refused_and_nothing_is_written() {
    let sweep = Sweep::new("scene: scene.yaml\n");
    fs::write(sweep.path("scene.yaml"), "tip: { radius_mm: 1.5 }\n").unwrap();
    sweep.ids();
    for name in ["scan.ply", "touch.mcap", "scene.yaml"] {
        let kept = fs::read(sweep.path(name)).unwrap();
        fs::write(sweep.path(name), [&kept[..], b" "].concat()).unwrap();
        let refused = sweep.run(&["--job", "0"]);
        let said = text(&refused.stderr);
        assert!(
            code(&refused) == 3 && said.contains(name) && said.contains("not what was planned"),
            "{said}"
        );
        fs::write(sweep.path(name), kept).unwrap();
    }
    assert!(
        sweep
            .names_in("results")
            .iter()
            .all(|name| name.starts_with('.'))
    );
    let none = sweep.run(&["--job", "1"]);
    assert!(
        code(&none) == 2 && text(&none.stderr).contains("has no job 1: it has 1"),
        "{}",
        text(&none.stderr)
    );
    let line = fs::read_to_string(sweep.path("jobs.jsonl")).unwrap();
    fs::write(
        sweep.path("jobs.jsonl"),
        line.replace("\"keys\":{}", "\"keys\":{\"contact.on_n\":0.9}"),
    )
    .unwrap();
    let other = sweep.run(&["--job", "0"]);
    assert!(
        code(&other) == 3 && text(&other.stderr).contains("not the one that its id names"),
        "{}",
        text(&other.stderr)
    );
}

// ---- table

/// The touch presses with 2 N: a threshold of 3 N sees no contact, which refine refuses.
#[test]
#[expect(clippy::too_many_lines)]
fn a_job_that_fails_is_in_the_table_with_its_reason_and_a_missing_one_is_named() {
    let sweep = Sweep::new("keys: { tip.radius_mm: 1.5, contact.on_n: [0.4, 3] }\n");
    let ids = sweep.ids();
    let none = sweep.path("none.csv");
    let table = |out: &str| {
        touchup(
            &[
                "sweep",
                "table",
                &sweep.name("jobs.jsonl"),
                "--out",
                &sweep.name(out),
                "--features-out",
                &sweep.name("features.csv"),
            ],
            "",
        )
    };
    let empty = table("none.csv");
    assert!(
        code(&empty) == 4 && text(&empty.stderr).contains("2 jobs have no result: 0, 1"),
        "{}",
        text(&empty.stderr)
    );
    assert!(none.exists());

    for _ in 0..2 {
        let ran = sweep.run(&[]);
        assert_eq!(code(&ran), 4);
        assert!(
            text(&ran.stderr)
                .contains("job 1 failed: the recording on the scan: the contacts reach 2.00 N"),
            "{}",
            text(&ran.stderr)
        );
    }
    let one = sweep.run(&["--job", "1"]);
    assert!(
        code(&one) == 3 && text(&one.stderr).contains("job 1 failed"),
        "{}",
        text(&one.stderr)
    );
    assert_eq!(
        sweep.result("results", &ids[1]).keys().collect::<Vec<_>>(),
        ["SHA256SUMS", "failed.json", "job.json"]
    );

    assert_eq!(code(&table("table.csv")), 0);
    let csv = fs::read_to_string(sweep.path("table.csv")).unwrap();
    let rows: Vec<Vec<&str>> = csv.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 3);
    let first = [
        "job",
        "id",
        "recording",
        "seed",
        "contact.on_n",
        "tip.radius_mm",
        "failed",
    ];
    assert_eq!(rows[0][..7], first);
    assert_eq!(
        rows[1][..7],
        ["0", &*ids[0], "touch.mcap", "", "0.4", "1.5", ""]
    );
    assert_eq!(rows[2][..6], ["1", &*ids[1], "touch.mcap", "", "3", "1.5"]);
    // findings before it have commas
    let behind = rows[0].iter().rev().position(|name| *name == "samples");
    let samples = |row: &[&str]| row[row.len() - 1 - behind.unwrap()].to_owned();
    assert_eq!(
        (samples(&rows[1]), samples(&rows[2])),
        ("1001".into(), "".into())
    );
    let features: Value =
        serde_json::from_slice(&sweep.result("results", &ids[0])["features.json"]).unwrap();
    let listed = fs::read_to_string(sweep.path("features.csv"))
        .unwrap()
        .lines()
        .count();
    assert_eq!(
        listed.saturating_sub(1),
        features["features"].as_array().unwrap().len()
    );
    assert_eq!(code(&table("table.parquet")), 0);
    assert!(
        fs::read(sweep.path("table.parquet"))
            .unwrap()
            .starts_with(b"PAR1")
    );

    fs::remove_dir_all(sweep.path("results").join(&ids[0])).unwrap();
    let less = table("less.csv");
    assert!(
        code(&less) == 4 && text(&less.stderr).contains("1 job has no result: 0"),
        "{}",
        text(&less.stderr)
    );
    assert_eq!(
        fs::read_to_string(sweep.path("less.csv"))
            .unwrap()
            .lines()
            .count(),
        2
    );
}

/// Every file of a result, changed in each way that a disk or a hand may.
#[test]
#[expect(clippy::too_many_lines)]
fn a_damaged_result_names_its_job_and_how_it_is_made_anew_and_others_go_on() {
    let sweep = Sweep::new("keys: { tip.radius_mm: 1.5, contact.on_n: [0.4, 0.5, 3] }\n");
    let ids = sweep.ids();
    assert_eq!(code(&sweep.run(&[])), 4, "job 2 fails by its input");
    let table = |out: &str| {
        let (jobs, out) = (sweep.name("jobs.jsonl"), sweep.name(out));
        let ran = touchup(&["sweep", "table", &jobs, "--out", &out], "");
        let rows = fs::read_to_string(out).unwrap().lines().count() - 1;
        (code(&ran), text(&ran.stderr).to_owned(), rows)
    };
    let (whole_code, _, whole_rows) = table("whole.csv");
    assert_eq!((whole_code, whole_rows), (0, 3));
    let folders = ids.iter().map(|id| sweep.path("results").join(id));
    let folders: Vec<_> = folders.collect();
    let sums = Command::new("sha256sum")
        .current_dir(&folders[0])
        .args(["--check", "--strict", "SHA256SUMS"])
        .output()
        .unwrap();
    assert!(sums.status.success(), "{}", text(&sums.stdout));
    let edited = |bytes: &[u8]| {
        let at = bytes.iter().rposition(u8::is_ascii_digit).unwrap_or(0);
        [&bytes[..at], b"7", b"7", &bytes[at + 1..]].concat()
    };
    let garbage = |_: &[u8]| b"\xff{garbage".to_vec();
    let cut = |bytes: &[u8]| bytes[..bytes.len() / 2].to_vec();
    type Damage = fn(&[u8]) -> Vec<u8>;
    let ways: [Damage; 3] = [edited, garbage, cut];
    let mut damages = Vec::new();
    for (job, names) in [
        (
            0,
            &[
                "features.json",
                "job.json",
                "refined.ply",
                "summary.json",
                "SHA256SUMS",
            ][..],
        ),
        (2, &["failed.json", "job.json", "SHA256SUMS"]),
    ] {
        for name in names {
            damages.extend(ways.map(|way| (job, *name, Some(way))));
            damages.push((job, *name, None));
        }
    }
    for (job, name, way) in damages {
        let place: PathBuf = folders[job].join(name);
        let whole = fs::read(&place).unwrap();
        match way {
            Some(way) => fs::write(&place, way(&whole)).unwrap(),
            None => fs::remove_file(&place).unwrap(),
        }
        let (code_of_table, said, rows) = table("less.csv");
        let named = format!("job {job}: ");
        let remedy = format!("touchup sweep run --job {job} --again");
        assert!(
            code_of_table == 4 && rows == 2 && said.contains(&named) && said.contains(&remedy),
            "{name}: {code_of_table}, {rows} rows, {said}"
        );
        fs::write(&place, whole).unwrap();
    }
    // another job's result under its name
    fs::remove_dir_all(&folders[1]).unwrap();
    fs::create_dir(&folders[1]).unwrap();
    for entry in fs::read_dir(&folders[0]).unwrap() {
        let entry = entry.unwrap();
        fs::copy(entry.path(), folders[1].join(entry.file_name())).unwrap();
    }
    let (code_of_table, said, rows) = table("less.csv");
    assert_eq!((code_of_table, rows), (4, 2), "{said}");
    let all = sweep.run(&[]);
    let said = text(&all.stderr);
    assert!(
        code(&all) == 4 && said.contains("job 1: ") && said.contains("job 2 failed"),
        "{said}"
    );
    assert_eq!(code(&sweep.run(&["--job", "1"])), 3);
    assert_eq!(code(&sweep.run(&["--job", "1", "--again"])), 0);
    assert_eq!(table("again.csv").2, 3);
    let [whole, again] = ["whole.csv", "again.csv"].map(|name| fs::read(sweep.path(name)).unwrap());
    assert_eq!(whole, again);
}

// ---- whatif

/// A result as a job leaves it: a sheet of 21 × 21 vertices that rises by `step` mm from column to
/// column, known to `sigma` mm.
fn sheet_result(
    folder: &Path,
    scan: &str,
    stiffness: i32,
    step: f64,
    sigma: f64,
    features: &Value,
) -> String {
    fs::create_dir(folder).unwrap();
    let mut lines = flat_scan().lines().map(str::to_owned).collect::<Vec<_>>();
    let head = lines.iter().position(|line| line == "end_header").unwrap();
    for line in &mut lines[head + 1..head + 1 + 21 * 21] {
        let place: Vec<f64> = line.split(' ').map(|word| word.parse().unwrap()).collect();
        *line = format!(
            "{} {} {} {sigma}",
            place[0],
            place[1],
            (place[0] + 10.0) * step
        );
    }
    lines.insert(head - 2, "property float sigma_mm".to_owned());
    fs::write(folder.join("refined.ply"), lines.join("\n") + "\n").unwrap();
    let record = json!({ "id": "0", "touchup": "0", "scan_sha256": scan, "mesh_unit": "mm", "recording_sha256": "1", "recorded": {},
        "scene": { "tip": { "radius_mm": 1.5, "stiffness_n_per_mm": stiffness } } });
    for (name, value) in [
        ("job.json", &record),
        ("features.json", &json!({ "features": features })),
        ("summary.json", &json!({})),
    ] {
        fs::write(folder.join(name), value.to_string()).unwrap();
    }
    let mut sums = Command::new("sha256sum");
    sums.current_dir(folder)
        .args(["features.json", "job.json", "refined.ply", "summary.json"]);
    fs::write(folder.join("SHA256SUMS"), sums.output().unwrap().stdout).unwrap();
    folder.to_str().unwrap().to_owned()
}

/// By hand: column c rises by c · 0.01 mm; ± is 2 · 0.05 mm, the larger of both; so columns 11 to
/// 20 move, 21 vertices each. The hole's diameter grows by 0.05 mm with ± 2 · 0.02 mm.
#[test]
#[expect(clippy::too_many_lines)]
fn vertices_and_features_that_moved_by_more_than_the_larger_plus_minus_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let hole = |diameter: f64, std: f64| {
        json!([{ "id": 4, "kind": "hole", "center_mm": [0, 0, 0], "axis": [0, 0, 1], "diameter_mm": diameter,
            "std": { "center_mm": 0.01, "diameter_mm": std } }])
    };
    let at = |name: &str| folder.path().join(name);
    let a = sheet_result(&at("a"), "s", 20, 0.0, 0.02, &hole(6.0, 0.01));
    let b = sheet_result(&at("b"), "s", 10, 0.01, 0.05, &hole(6.05, 0.02));
    let [page, vertices, features, mesh] =
        ["page.html", "v.csv", "f.csv", "m.ply"].map(|name| at(name).to_str().unwrap().to_owned());
    let outs = [
        "--out",
        &page,
        "--vertices-out",
        &vertices,
        "--features-out",
        &features,
        "--mesh-out",
        &mesh,
    ];
    let found = touchup(&[&["whatif", &a, &b, "--json"], &outs[..]].concat(), "");
    assert_eq!((code(&found), text(&found.stderr)), (0, ""));
    let report = one_object(&found);
    assert_eq!(
        report["keys"],
        json!({ "tip.stiffness_n_per_mm": [20, 10] })
    );
    assert_eq!(
        (
            &report["vertices_a"]["vertices"],
            &report["vertices_a"]["moved"]
        ),
        (&441.into(), &210.into())
    );
    assert!(
        report.get("vertices_b").is_none(),
        "both have the same vertices"
    );
    let near = |value: &Value, expected: f64| (value.as_f64().unwrap() - expected).abs() < 1e-6;
    assert!(
        near(&report["vertices_a"]["farthest_mm"], 0.2)
            && near(&report["vertices_a"]["farthest_plus_minus_mm"], 0.1),
        "{report}"
    );
    assert_eq!(
        (
            &report["features_moved"],
            &report["features"][0]["numbers"][2]["moved"]
        ),
        (&1.into(), &true.into())
    );

    let rows = fs::read_to_string(&vertices).unwrap();
    assert_eq!(
        rows.lines().next(),
        Some("mesh,vertex,x_mm,y_mm,z_mm,displacement_mm,plus_minus_mm,moved")
    );
    assert_eq!(
        (
            rows.lines().count(),
            rows.lines().filter(|row| row.ends_with(",true")).count()
        ),
        (442, 210)
    );
    assert_eq!(
        fs::read_to_string(&features)
            .unwrap()
            .lines()
            .filter(|row| row.contains(",true"))
            .count(),
        1
    );
    assert!(String::from_utf8_lossy(&fs::read(&mesh).unwrap()).contains("displacement_mm"));
    let html = fs::read_to_string(&page).unwrap();
    for expected in [
        "What if tip.stiffness_n_per_mm is 10 instead of 20?",
        "210 of 441",
        "hole 4",
        "data:image/png;base64,",
    ] {
        assert!(html.contains(expected), "{expected}");
    }
    assert!(
        !html.contains("<script") && !html.contains("http"),
        "it asks for nothing outside of it"
    );
    let words = touchup(&["whatif", &a, &b], "");
    assert!(
        text(&words.stdout).contains("diameter_mm 6.000 → 6.050 (+0.050, ± 0.040)"),
        "{}",
        text(&words.stdout)
    );

    let other = sheet_result(&at("c"), "t", 20, 0.0, 0.02, &json!([]));
    let refused = touchup(&["whatif", &a, &other], "");
    assert!(
        code(&refused) == 2 && text(&refused.stderr).contains("different scans"),
        "{}",
        text(&refused.stderr)
    );
    let none = touchup(&["whatif", &a, folder.path().to_str().unwrap()], "");
    assert!(
        code(&none) == 3 && text(&none.stderr).contains("is no result of a job"),
        "{}",
        text(&none.stderr)
    );
    let number = touchup(&["whatif", "0", "1"], "");
    assert!(
        code(&number) == 2 && text(&number.stderr).contains("need --jobs"),
        "{}",
        text(&number.stderr)
    );
}

/// 2 N bend the stylus: of 20 N/mm by 0.1 mm, of 10 N/mm by 0.2 mm. So the touched place comes out
/// 0.1 mm higher.
#[test]
fn a_softer_stylus_lifts_the_touched_place_by_the_difference_of_its_bending() {
    let sweep = Sweep::new("keys: { tip.radius_mm: 1.5, tip.stiffness_n_per_mm: [20, 10] }\n");
    assert_eq!(sweep.jobs().len(), 2);
    assert_eq!(code(&sweep.run(&[])), 0);
    let found = touchup(
        &[
            "whatif",
            "0",
            "1",
            "--jobs",
            &sweep.name("jobs.jsonl"),
            "--json",
        ],
        "",
    );
    assert_eq!((code(&found), text(&found.stderr)), (0, ""));
    let report = one_object(&found);
    assert_eq!(
        report["keys"],
        json!({ "tip.stiffness_n_per_mm": [20, 10] })
    );
    let farthest = report["vertices_b"]["farthest_mm"].as_f64().unwrap();
    assert!((farthest - 0.1).abs() < 0.01, "{report}");
    let same = touchup(
        &[
            "whatif",
            "0",
            "0",
            "--jobs",
            &sweep.name("jobs.jsonl"),
            "--json",
        ],
        "",
    );
    assert_eq!(one_object(&same)["vertices_a"]["moved"], 0);
    assert_eq!(one_object(&same)["keys"], json!({}));
}

/// On the plate of the demo, with a stiffness stated below the true one, every touched surface
/// comes out farther by the same bending: the top rises by it, holes and slot shrink and the boss
/// grows by twice as much. Directions, free of bending, stay.
#[test]
#[ignore = "a slow proof"]
#[expect(clippy::too_many_lines)]
fn the_plate_touched_by_a_softer_stylus_grows_everywhere_by_its_bending() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let keys = "keys: { tip.radius_mm: 1.5, tip.stiffness_n_per_mm: [20, 15] }\n";
    fs::write(
        at("grid.yaml"),
        format!("simulate: {{ part: plate, seeds: [1] }}\n{keys}"),
    )
    .unwrap();
    let planned = touchup(
        &[
            "sweep",
            "plan",
            &at("grid.yaml"),
            "--out",
            &at("jobs.jsonl"),
        ],
        "",
    );
    assert_eq!(code(&planned), 0, "{}", text(&planned.stderr));
    assert_eq!(code(&touchup(&["sweep", "run", &at("jobs.jsonl")], "")), 0);
    // the plan lists the stiffnesses in their order
    let report = one_object(&touchup(
        &["whatif", "0", "1", "--jobs", &at("jobs.jsonl"), "--json"],
        "",
    ));
    assert_eq!(
        report["keys"],
        json!({ "tip.stiffness_n_per_mm": [20, 15] })
    );
    let features = report["features"].as_array().unwrap();
    let number = |feature: &Value, name: &str| {
        let numbers = feature["numbers"].as_array().unwrap();
        numbers
            .iter()
            .find(|number| number["name"] == name)
            .cloned()
            .unwrap()
    };
    let top = features
        .iter()
        .find(|one| one["kind"] == "plane" && one["center_mm"][2].as_f64().unwrap() > 11.9)
        .unwrap();
    let rise = number(top, "center_mm")["change"].as_f64().unwrap();
    assert!(
        number(top, "center_mm")["moved"] == true && rise > 0.0,
        "{top}"
    );
    for (kind, name, sign) in [
        ("hole", "diameter_mm", -2.0),
        ("slot", "width_mm", -2.0),
        ("boss", "diameter_mm", 2.0),
    ] {
        for feature in features.iter().filter(|one| one["kind"] == kind) {
            let size = number(feature, name);
            let (change, known) = (
                size["change"].as_f64().unwrap(),
                size["plus_minus"].as_f64().unwrap(),
            );
            assert!(
                (change - sign * rise).abs() <= known && size["moved"] == true,
                "{kind}: {change} for {rise} ± {known}"
            );
            assert_eq!(number(feature, "axis_deg")["moved"], false, "{feature}");
        }
    }
}

// ---- simulated

/// The scan of `touchup demo` with the same seed, byte for byte.
#[test]
fn a_simulated_part_is_that_of_the_demo_by_its_seed() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    fs::write(
        at("grid.yaml"),
        "simulate: { part: plate, seeds: [3, 1] }\nkeys: { tip.radius_mm: [1.5, 1.6] }\n",
    )
    .unwrap();
    let planned = touchup(
        &[
            "sweep",
            "plan",
            &at("grid.yaml"),
            "--out",
            &at("jobs.jsonl"),
        ],
        "",
    );
    assert_eq!((code(&planned), text(&planned.stderr)), (0, ""));
    let lines = fs::read_to_string(at("jobs.jsonl")).unwrap();
    let seeds: Vec<_> = lines
        .lines()
        .map(|line| {
            serde_json::from_str::<Value>(line).unwrap()["seed"]
                .as_u64()
                .unwrap()
        })
        .collect();
    assert_eq!(seeds, [3, 1, 3, 1]);
    assert_eq!(
        names_in(&folder.path().join("simulated")),
        ["plate_1", "plate_3"]
    );
    assert_ne!(
        fs::read(at("simulated/plate_1/scan.ply")).unwrap(),
        fs::read(at("simulated/plate_3/scan.ply")).unwrap()
    );
}
