//! Passes the commit of the sources to the program.

use std::path::Path;
use std::process::Command;

/// Sources of the program, relative to the root of the checkout.
const SOURCES: [&str; 4] = ["src", "crates", "Cargo.toml", "Cargo.lock"];

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!(
        "cargo::rustc-env=TOUCHUP_COMMIT={}",
        commit().unwrap_or_else(|| "unknown".to_owned())
    );
}

/// `None` without git, and for a tree that is no checkout of its own: a tarball, or a folder inside
/// another repository.
fn commit() -> Option<String> {
    git(&["ls-files", "--error-unmatch", "build.rs"])?;
    // cargo reruns this when HEAD moves; a changed source reruns it anyway
    let branch = git(&["symbolic-ref", "--quiet", "HEAD"]);
    for name in ["HEAD", "logs/HEAD", branch.as_deref().unwrap_or("HEAD")] {
        // cargo would rerun this at every build for a missing path
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

/// Output of git; `None` if it fails.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}
