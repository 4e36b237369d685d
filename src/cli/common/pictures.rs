//! Common functions of the drawing verbs.

use std::path::Path;
use std::time::SystemTime;

use chrono::{DateTime, Utc};
use clap::Args;
use nalgebra::Vector3;

use super::error::{CliError, require};
use super::output::not_written;
use touchup_features::compare::{PicturePanel, PictureParams, Rgb, draw_picture};
use touchup_geometry::mesh::TriMesh;
use touchup_io::mesh_file::{MeshUnit, VertexColumn, write_mesh_with};
use touchup_io::png::write_png;

/// Date of the system clock (UTC), for pictures.
pub(in crate::cli) fn today() -> String {
    DateTime::<Utc>::from(SystemTime::now())
        .format("%Y-%m-%d")
        .to_string()
}

/// Last part of a path.
pub(in crate::cli) fn file_name(path: &Path) -> String {
    path.file_name()
        .map_or(String::new(), |name| name.to_string_lossy().into_owned())
}

/// Direction of view.
#[derive(Debug, Default, Args)]
pub(in crate::cli) struct ViewFlag {
    /// View direction of the picture; default: the touched side
    #[arg(
        long,
        value_name = "X,Y,Z",
        value_delimiter = ',',
        num_args = 3,
        allow_negative_numbers = true
    )]
    view: Option<Vec<f64>>,
}

impl ViewFlag {
    /// Direction; `None`: the touched side.
    pub fn direction(&self) -> Result<Option<Vector3<f64>>, CliError> {
        let is_direction =
            |view: &Vec<f64>| view.iter().all(|x| x.is_finite()) && view.iter().any(|x| *x != 0.0);
        require(
            self.view.as_ref().is_none_or(is_direction),
            "--view must be a direction, such as 1,-1,0.5",
        )?;
        Ok(self.view.as_deref().map(Vector3::from_column_slice))
    }
}

/// Draws panels beside each other into a file.
pub(in crate::cli) fn write_picture(
    path: &Path,
    panels: &[PicturePanel<'_>],
    params: &PictureParams<'_>,
) -> Result<(), CliError> {
    let picture = draw_picture(panels, params);
    write_png(path, picture.size, &picture.pixels).map_err(not_written(path))
}

/// Writes a mesh as a PLY in colours, with further columns.
pub(in crate::cli) fn write_coloured(
    path: &Path,
    mesh: &TriMesh,
    unit: MeshUnit,
    colours: &[Rgb],
    further: impl IntoIterator<Item = VertexColumn>,
) -> Result<(), CliError> {
    let channel = |at: usize| {
        colours
            .iter()
            .map(|colour| colour[at])
            .collect::<Vec<u8>>()
            .into()
    };
    let named = ["red", "green", "blue"].into_iter().enumerate();
    let channels = named.map(|(at, name)| VertexColumn {
        name,
        values: channel(at),
    });
    let columns: Vec<_> = channels.chain(further).collect();
    write_mesh_with(path, mesh, &columns, None, unit).map_err(CliError::not_written)
}
