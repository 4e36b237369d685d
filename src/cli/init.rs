//! `touchup init`: a scene with every key explained, to edit and to pass as --scene.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;

use super::common::told::ToldFlags;
use super::{CliError, Losses, check_place, not_written, print_result, require};
use touchup_io::atomic::write_atomically;
use touchup_io::mesh_file::MeshUnit;
use touchup_session::scene::{Scene, Setting};

#[derive(Debug, Args)]
#[command(mut_arg("tip_radius_mm", |flag| flag.required(true).help("Radius of the ball, mm")))]
#[command(mut_arg("stiffness_n_per_mm", |flag| flag.help("Stiffness of stylus and holder at the ball, N/mm; default: 20")))]
#[command(mut_arg("scan_noise_mm", |flag| flag.help("Standard deviation of the scan from the true surface, mm; default: 0.6")))]
pub(super) struct InitArguments {
    /// Scene to write; an existing file is never overwritten
    #[arg(value_name = "YAML", default_value = "scene.yaml")]
    out: PathBuf,
    #[command(flatten)]
    told: ToldFlags,
    /// Scan: mesh (PLY, STL, OBJ) or point cloud (PLY, PCD, XYZ, E57); relative to the scene's
    /// folder
    #[arg(long, value_name = "MESH")]
    scan: Option<PathBuf>,
    /// Unit of the coordinates in the scan's file
    #[arg(long, value_name = "U", default_value = "mm")]
    mesh_unit: MeshUnit,
}

/// Runs `touchup init`: writes the scene.
pub(super) fn init(arguments: &InitArguments) -> Result<Losses, CliError> {
    let InitArguments {
        out,
        told,
        scan,
        mesh_unit,
    } = arguments;
    let is_there = out.symlink_metadata().is_ok();
    require(
        !is_there,
        format!(
            "{} is there already: name another file, or remove it",
            out.display()
        ),
    )?;
    check_place(out)?;
    let mut settings = told.settings();
    if let Some(file) = scan {
        settings.push(Setting::file("scan.file", file)?);
    }
    settings.push(Setting::word("scan.unit", mesh_unit));

    let mut scene = Scene::default();
    scene.set(&settings)?;
    told.tell(&mut scene, "")?;
    let text = Scene::edited(&Scene::template(), &settings, "touchup init")?;
    write_atomically(out, |file| file.write_all(text.as_bytes())).map_err(not_written(out))?;
    print_result(&format!(
        "wrote {0}: touchup refine --scene {0} --bag RECORDING --out refined.ply",
        out.display()
    ))?;
    Ok(Losses::new())
}
