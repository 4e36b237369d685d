//! Pictures of an arm's planned path, and of its touches.

use std::path::Path;

use nalgebra::{Point3, Vector3};

use crate::cli::common::pictures::write_picture;
use crate::cli::{CliError, counted};
use touchup_features::compare::{DrawnMesh, PicturePanel, PictureParams, Rgb};
use touchup_geometry::mesh::TriMesh;
use touchup_io::probed_touches_file::TouchLine;
use touchup_probing::execute::{Flag, FlagResult, Plan, PlannedMotion};

const PART: Rgb = [206, 209, 214];
const FLAG: Rgb = [20, 20, 20];
const PATH: Rgb = [110, 170, 220];
const SEARCH: Rgb = [0, 80, 160];
const HELD_BACK: Rgb = [213, 94, 0];
const TOUCHED: Rgb = [0, 114, 178];
const MISS: Rgb = [213, 94, 0];
const REFUSED: Rgb = [240, 200, 30];
/// Line width and size of places, relative to the diagonal of the part.
const LINE: f64 = 0.0012;
const PLACE: f64 = 0.005;
/// Height of a flag's pin, relative to the diagonal of the part.
const PIN: f64 = 0.13;
/// Direction of view.
const FROM: [f64; 3] = [-0.45, -0.75, 1.0];

fn diagonal(mesh: &TriMesh) -> f64 {
    let [low, high] = mesh.bounds();
    (high - low).norm()
}

fn write(
    drawing: DrawnMesh,
    [title, what]: [&str; 2],
    note: &str,
    legend: &[(Rgb, &str)],
    path: &Path,
) -> Result<(), CliError> {
    let (mesh, paint) = drawing.finish()?;
    let panel = PicturePanel {
        paint: Some(&paint),
        title: what,
        note,
        ..PicturePanel::of(&mesh)
    };
    let params = PictureParams {
        title,
        from: Some(Vector3::from(FROM)),
        legend,
        ..PictureParams::default()
    };
    write_picture(path, &[panel], &params)
}

fn flagged(drawing: &mut DrawnMesh, flags: &[Flag], size: f64) {
    for flag in flags {
        let head = flag.place + Vector3::z() * (PIN * size);
        drawing.line(&flag.place, &head, 2.0 * LINE * size, FLAG);
        drawing.place(&head, 2.0 * PLACE * size, FLAG);
    }
}

/// Draws the scan with the planned path of the arm.
pub(super) fn draw_plan(
    scan: &TriMesh,
    plans: &[Plan],
    flags: &[Flag],
    path: &Path,
) -> Result<(), CliError> {
    let size = diagonal(scan);
    let mut drawing = DrawnMesh::of(scan, PART);
    for plan in plans {
        for pair in plan.path.windows(2) {
            drawing.line(&pair[0], &pair[1], LINE * size, PATH);
        }
        for (number, planned) in plan.touches.iter().enumerate() {
            let is_held_back = plan
                .held_back
                .iter()
                .any(|one| one.what == PlannedMotion::Touch(number));
            let colour = if is_held_back { HELD_BACK } else { SEARCH };
            drawing.line(&planned.from, &planned.end(), LINE * size, colour);
        }
    }
    flagged(&mut drawing, flags, size);
    let touches: usize = plans.iter().map(|plan| plan.touches.len()).sum();
    let note = format!(
        "{} if the part is as the scan has it",
        counted(touches, "touch", "touches")
    );
    let legend = [
        (FLAG, "flag"),
        (PATH, "path through free air"),
        (SEARCH, "search for the surface"),
        (HELD_BACK, "cannot be reached"),
    ];
    write(
        drawing,
        ["what the arm would do", "the scan"],
        &note,
        &legend,
        path,
    )
}

/// Draws the refined mesh with the touches.
///
/// - `probed`: features with their slides.
pub(super) fn draw_touches(
    mesh: &TriMesh,
    touches: &[TouchLine],
    probed: &[FlagResult],
    flags: &[Flag],
    path: &Path,
) -> Result<(), CliError> {
    let size = diagonal(mesh);
    let mut drawing = DrawnMesh::of(mesh, PART);
    let (mut touched, mut missed, mut refused) = (0, 0, 0);
    for touch in touches {
        let from = Point3::from(touch.from_mm) / 1e3;
        let (end, colour) = match (touch.centre_mm, touch.accepted) {
            (Some(centre_mm), true) => (Point3::from(centre_mm) / 1e3, TOUCHED),
            (_, false) => (from, REFUSED),
            (None, true) => (
                from + Vector3::from(touch.approach) * (touch.search_mm / 1e3),
                MISS,
            ),
        };
        match colour {
            TOUCHED => touched += 1,
            MISS => missed += 1,
            _ => refused += 1,
        }
        drawing.line(&from, &end, LINE * size, colour);
        drawing.place(&end, 0.5 * PLACE * size, colour);
    }
    for probed in probed.iter().flat_map(|one| &one.slides) {
        let reached = probed.record.as_ref().map_or(0, |record| record.reached);
        for pair in probed.slide.stations[..=reached].windows(2) {
            drawing.line(&pair[0].centre, &pair[1].centre, LINE * size, TOUCHED);
        }
    }
    flagged(&mut drawing, flags, size);
    let touched = counted(touched, "touch", "touches");
    let refused = counted(refused, "does not count", "do not count");
    let note = format!("{touched} reached the part, {missed} missed it, {refused}");
    let legend = [
        (FLAG, "flag"),
        (TOUCHED, "touched"),
        (MISS, "nothing there"),
        (REFUSED, "does not count"),
    ];
    write(
        drawing,
        ["what the arm touched", "the refined mesh"],
        &note,
        &legend,
        path,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::colour_vision::least_difference;

    #[test]
    fn states_are_apart_without_red_and_green() {
        assert!(least_difference(&[PART, FLAG, PATH, SEARCH, HELD_BACK]) > 23.0);
        assert!(least_difference(&[PART, FLAG, TOUCHED, MISS, REFUSED]) > 23.0);
    }
}
