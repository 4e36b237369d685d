//! Generates sources before compilation: the messages of ROS from their definitions, and with
//! feature `web` the operator page. With feature `ur` it passes on the folder of the Python that
//! the program links to, so that the loader finds it beside another Python.

#[path = "generate/definition.rs"]
mod definition;
#[cfg(feature = "web")]
#[path = "generate/page.rs"]
mod page;
#[path = "generate/rust.rs"]
mod rust;

use std::path::Path;
use std::{env, fs};

use definition::Message;

/// The packages of ROS 2 that the node uses, each a folder of definitions.
const STANDARD: &str = "src/ros/messages/standard";
/// The package of the node itself, with folders `msg`, `srv` and `action`.
const OWN: &str = "../../msg";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=generate");
    #[cfg(feature = "ur")]
    pyo3_build_config::add_libpython_rpath_link_args();
    let mut messages = Vec::new();
    for package in entries(STANDARD)? {
        read(
            &package,
            package.rsplit('/').next().unwrap_or_default(),
            &mut messages,
        )?;
    }
    for kind in ["msg", "srv", "action"] {
        read(&format!("{OWN}/{kind}"), "touchup_msgs", &mut messages)?;
    }
    let made = env::var("OUT_DIR")?;
    let write = |name: &str, text: String| fs::write(Path::new(&made).join(name), text);
    write("messages.rs", rust::structs(&messages)?)?;
    write("carried.rs", rust::carried(&messages))?;
    write("conversions.rs", rust::conversions(&messages))?;
    write("stand_ins.rs", rust::stand_ins(&messages))?;
    #[cfg(feature = "web")]
    write(
        "page.rs",
        page::build(Path::new("../../web"), Path::new(&made))?,
    )?;
    Ok(())
}

/// All messages that the files of a folder define.
fn read(
    folder: &str,
    package: &str,
    messages: &mut Vec<Message>,
) -> Result<(), Box<dyn std::error::Error>> {
    for path in entries(folder)? {
        messages.extend(definition::parse(
            package,
            &path,
            &fs::read_to_string(&path)?,
        )?);
    }
    Ok(())
}

/// Entries of a folder, by name.
fn entries(folder: &str) -> std::io::Result<Vec<String>> {
    println!("cargo::rerun-if-changed={folder}");
    let paths = fs::read_dir(folder)?
        .map(|entry| Ok(format!("{folder}/{}", entry?.file_name().to_string_lossy())));
    let mut paths = paths.collect::<std::io::Result<Vec<_>>>()?;
    paths.sort();
    Ok(paths)
}
