//! The operator's page: npm builds it from `web/` in the folder of the build, and every file of it
//! becomes a constant.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{fs, io};

const NO_NPM: &str = "feature `web` needs npm (Debian: apt-get install npm; https://nodejs.org), or build without it";

/// Builds the page; Rust with the constant `PAGE`.
pub fn build(web: &Path, out: &Path) -> Result<String, Box<dyn Error>> {
    let place = out.join("web");
    let sources = files(web, Path::new(""))?;
    // removed files must not stay in the build
    for old in ["src", "dist"] {
        remove(&place.join(old))?;
    }
    for source in &sources {
        println!("cargo::rerun-if-changed={}", web.join(source).display());
        let to = place.join(source);
        fs::create_dir_all(to.parent().unwrap_or(&place))?;
        fs::copy(web.join(source), to)?;
    }
    println!("cargo::rerun-if-changed={}", web.display());
    // the build's packages change seldom
    let lock = fs::read(place.join("package-lock.json"))?;
    let installed = place.join("installed.lock");
    if fs::read(&installed).ok().as_ref() != Some(&lock) {
        npm(
            &place,
            &[
                "ci",
                "--ignore-scripts",
                "--no-audit",
                "--no-fund",
                "--loglevel=error",
            ],
        )?;
        fs::write(&installed, &lock)?;
    }
    npm(&place, &["run", "build", "--silent"])?;
    constants(&place.join("dist"))
}

fn npm(place: &Path, arguments: &[&str]) -> Result<(), Box<dyn Error>> {
    let ended = Command::new("npm")
        .args(arguments)
        .current_dir(place)
        .output();
    let ended = ended.map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => NO_NPM.to_owned(),
        _ => format!("npm: {error}"),
    })?;
    if ended.status.success() {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&ended.stdout).into_owned()
        + &String::from_utf8_lossy(&ended.stderr);
    Err(format!("npm {}: {}\n{said}", arguments.join(" "), ended.status).into())
}

fn remove(folder: &Path) -> io::Result<()> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// The files below a folder, relative to it, except installed packages and build results.
fn files(root: &Path, folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(root.join(folder))? {
        let entry = entry?;
        let path = folder.join(entry.file_name());
        if !entry.file_type()?.is_dir() {
            found.push(path);
        } else if !["node_modules", "dist"]
            .iter()
            .any(|made| path.as_path() == Path::new(made))
        {
            found.extend(files(root, &path)?);
        }
    }
    found.sort();
    Ok(found)
}

fn constants(dist: &Path) -> Result<String, Box<dyn Error>> {
    let mut text =
        "/// All files of the page.\npub(super) const PAGE: &[PageFile] = &[\n".to_owned();
    for file in files(dist, Path::new(""))? {
        let path = dist.join(&file);
        let name = file
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let content_type = match file
            .extension()
            .and_then(|ending| ending.to_str())
            .unwrap_or_default()
        {
            "gz" => continue,
            "html" => "text/html; charset=utf-8",
            "js" => "text/javascript; charset=utf-8",
            "css" => "text/css; charset=utf-8",
            "svg" => "image/svg+xml",
            "png" => "image/png",
            "json" | "webmanifest" => "application/manifest+json",
            other => {
                return Err(
                    format!("{}: what is a file .{other} of the page?", path.display()).into(),
                );
            }
        };
        let compressed = PathBuf::from(format!("{}.gz", path.display()));
        let gzip = match compressed.exists() {
            true => format!("Some(include_bytes!({compressed:?}))"),
            false => "None".to_owned(),
        };
        text += &format!(
            "    PageFile {{ name: {name:?}, content_type: {content_type:?}, bytes: include_bytes!({path:?}), gzip: {gzip} }},\n"
        );
    }
    Ok(text + "];\n")
}
