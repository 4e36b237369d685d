//! The commit that the program is built from, which only the build knows.

use std::path::Path;
use std::process::Command;

/// What is built, from the root of the checkout.
const SOURCES: [&str; 4] = ["src", "crates", "Cargo.toml", "Cargo.lock"];

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!(
        "cargo::rustc-env=TOUCHUP_COMMIT={}",
        commit().unwrap_or_else(|| "unknown".to_owned())
    );
}

/// `None` without git, and where this is no checkout of its own: a tarball, or inside another
/// repository.
fn commit() -> Option<String> {
    git(&["ls-files", "--error-unmatch", "build.rs"])?;
    // asked again when HEAD moves, and when a source changes, which is built again anyway
    let branch = git(&["symbolic-ref", "--quiet", "HEAD"]);
    for name in ["HEAD", "logs/HEAD", branch.as_deref().unwrap_or("HEAD")] {
        // a path that is not there would be asked for at every build
        git(&["rev-parse", "--git-path", name])
            .filter(|path| Path::new(path).exists())
            .into_iter()
            .for_each(watch);
    }
    SOURCES
        .iter()
        .for_each(|path| watch(format!("../../{path}")));
    let hash = git(&["rev-parse", "--short=12", "HEAD"])?;
    let sources = SOURCES.map(|path| format!(":/{path}"));
    let mut status = vec!["status", "--porcelain", "--untracked-files=no", "--"];
    status.extend(sources.iter().map(String::as_str));
    let changed = git(&status)?;
    Some(if changed.is_empty() {
        hash
    } else {
        format!("{hash}, with changes")
    })
}

fn watch(path: String) {
    println!("cargo::rerun-if-changed={path}");
}

/// What it prints; `None` where it fails.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}
