//! `touchup init`: a scene with every key explained, to edit and to pass as --scene.

use std::io::Write;
use std::path::PathBuf;

use clap::Args;

use super::{CliError, Losses, check_place, not_written, print_result, require};
use touchup_io::atomic::write_atomically;
use touchup_io::mesh_file::MeshUnit;
use touchup_session::scene::{Scene, Setting};

#[derive(Debug, Args)]
pub(super) struct InitArguments {
    /// Scene to write; an existing file is never overwritten
    #[arg(value_name = "YAML", default_value = "scene.yaml")]
    out: PathBuf,
    /// Radius of the ball, mm
    #[arg(long, value_name = "R", allow_negative_numbers = true)]
    tip_radius_mm: f64,
    /// Stiffness of stylus and holder at the ball, N/mm; default: 20
    #[arg(long, value_name = "K", allow_negative_numbers = true)]
    stiffness_n_per_mm: Option<f64>,
    /// Standard deviation of the scan from the true surface, mm; default: 0.6
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    scan_noise_mm: Option<f64>,
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
        tip_radius_mm,
        stiffness_n_per_mm,
        scan_noise_mm,
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
    let mut settings = vec![Setting::scalar("tip.radius_mm", tip_radius_mm)];
    settings.extend(stiffness_n_per_mm.map(|k| Setting::scalar("tip.stiffness_n_per_mm", k)));
    settings.extend(
        scan.as_ref()
            .map(|file| Setting::scalar("scan.file", format!("'{}'", file.display()))),
    );
    settings.push(Setting::scalar("scan.unit", mesh_unit));
    settings.extend(scan_noise_mm.map(|noise| Setting::scalar("scan.noise_mm", noise)));

    let mut expected = Scene::default();
    let (tip, part) = (
        expected.tip.get_or_insert_default(),
        expected.scan.get_or_insert_default(),
    );
    tip.ball.radius = tip_radius_mm / 1e3;
    if let Some(k) = stiffness_n_per_mm {
        tip.ball.stiffness = Some(k * 1e3);
    }
    (part.file, part.unit) = (scan.clone(), *mesh_unit);
    if let Some(noise_mm) = scan_noise_mm {
        part.quality.noise = noise_mm / 1e3;
    }
    expected.validate().map_err(CliError::usage)?;
    let text = Scene::edited(&Scene::template(), &settings, "touchup init", &expected)?;
    write_atomically(out, |file| file.write_all(text.as_bytes())).map_err(not_written(out))?;
    print_result(&format!(
        "wrote {0}: touchup refine --scene {0} --bag RECORDING --out refined.ply",
        out.display()
    ))?;
    Ok(Losses::new())
}
