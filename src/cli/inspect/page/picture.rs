//! The part with a numbered balloon at each feature.

use std::f64::consts::TAU;
use std::fmt::Write;

use nalgebra::Point3;

use super::decisions::{DecisionLook, look_of};
use super::html::base64;
use super::input::ReportInput;
use crate::cli::{CliError, not_written};
use crate::compare::{PartView, PicturePanel, PictureParams, Rgb, draw_part};
use crate::conformity::Decision;
use crate::io::mesh_file::read_vertex_columns;
use crate::io::png::png_bytes;
use crate::scan::{Scan, read_scan};

/// Of the part without what is around it, pixels.
const WIDTH: u32 = 1100;
/// Around it, for balloons.
const MARGIN: f64 = 70.0;
/// Of a balloon.
const RADIUS: f64 = 21.0;
const TOUCHED: Rgb = [150, 184, 214];
const SCANNED: Rgb = [205, 208, 213];

/// The section; says so where there is no mesh.
pub(super) fn picture(input: &ReportInput<'_>) -> Result<String, CliError> {
    let Some(path) = &input.source.mesh else {
        return Ok(
            "<h2>Picture</h2>\n<p class=\"small\">No mesh was given (--mesh): there is no picture.</p>\n".to_owned()
        );
    };
    let Scan { mesh, .. } = read_scan(path, input.mesh_unit)?;
    let [touched] = read_vertex_columns(path, input.mesh_unit, &mesh, ["touched"])?;
    let is_touched =
        |vertex: usize| touched.as_ref().and_then(|column| column.get(vertex)).is_some_and(|share| *share >= 1.0);
    let slots = mesh.vertex_slots();
    let paint: Vec<Rgb> = (0..slots).map(|vertex| if is_touched(vertex) { TOUCHED } else { SCANNED }).collect();
    let weights: Option<Vec<f64>> = touched
        .as_ref()
        .filter(|column| column.iter().any(|share| *share >= 1.0))
        .map(|_| (0..slots).map(|vertex| f64::from(u8::from(is_touched(vertex)))).collect());
    let placed: Vec<_> = input.inspected.balloons.iter().filter(|balloon| balloon.place_mm.is_some()).collect();
    let places: Vec<_> =
        placed.iter().filter_map(|balloon| balloon.place_mm).map(|mm| Point3::from(mm) * 1e-3).collect();
    let panel = PicturePanel { paint: Some(&paint), ..PicturePanel::of(&mesh) };
    let params =
        PictureParams { width: WIDTH, from: input.view, weights: weights.as_deref(), ..PictureParams::default() };
    let PartView { picture, places } = draw_part(&panel, &params, &places);
    let png = png_bytes(picture.size, &picture.pixels).map_err(not_written(path))?;
    let [width, height] = picture.size.map(f64::from);
    let mut svg = format!(
        "<svg class=\"part\" viewBox=\"0 0 {} {}\" role=\"img\" aria-label=\"the part with numbered features\"><rect width=\"100%\" height=\"100%\" fill=\"#e9ecf0\"/><image x=\"{MARGIN}\" y=\"{MARGIN}\" width=\"{width}\" height=\"{height}\" href=\"data:image/png;base64,{}\"/>",
        width + 2.0 * MARGIN,
        height + 2.0 * MARGIN,
        base64(&png)
    );
    let is_inside = |[x, y]: &[f64; 2]| (0.0..=width).contains(x) && (0.0..=height).contains(y);
    let (placed, places): (Vec<_>, Vec<_>) =
        placed.into_iter().zip(places).filter(|(_, place)| is_inside(place)).unzip();
    let seats = balloon_seats(&places, [width, height]);
    for ((balloon, place), seat) in placed.iter().zip(&places).zip(&seats) {
        let decisions = balloon.characteristics.iter().map(|&at| &*input.inspected.record.characteristics[at].decision);
        let worst = decisions
            .max_by_key(|name| Decision::ALL.iter().position(|decision| decision.name() == *name))
            .unwrap_or("undecided");
        draw_balloon(&mut svg, balloon.number, worst, balloon.feature.is_some(), place.map(|x| x + MARGIN), *seat);
    }
    svg += "</svg>";
    let unseen = input.inspected.balloons.len() - placed.len();
    let unseen =
        if unseen == 0 { String::new() } else { format!(" {unseen} without a place on the mesh are not drawn.") };
    let caption = format!(
        "Blue was touched, grey is the scan. A balloon has the colour and sign of the worst decision of its feature; dashed: not found, at its nominal place.{unseen}"
    );
    Ok(format!("<figure>{svg}<figcaption>{caption}</figcaption></figure>\n"))
}

fn draw_balloon(svg: &mut String, number: usize, decision: &str, is_found: bool, [x, y]: [f64; 2], [u, v]: [f64; 2]) {
    let DecisionLook { fill, ink, sign } = look_of(decision);
    let dash = if is_found { "" } else { " stroke-dasharray=\"6 4\"" };
    let _ = write!(
        svg,
        "<path d=\"M{x:.1} {y:.1} L{u:.1} {v:.1}\" stroke=\"#1d2129\" stroke-width=\"2\"{dash}/><circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"5\" fill=\"#1d2129\" stroke=\"#fff\" stroke-width=\"2\"/>\
         <circle cx=\"{u:.1}\" cy=\"{v:.1}\" r=\"{RADIUS}\" fill=\"{fill}\" stroke=\"#1d2129\" stroke-width=\"2\"{dash}/>\
         <text x=\"{u:.1}\" y=\"{:.1}\" font-size=\"21\" font-weight=\"700\" text-anchor=\"middle\" fill=\"{ink}\">{number}{sign}</text>",
        v + 7.0
    );
}

/// Places of the balloons around the part, each in the direction of its feature, apart from one another.
///
/// - `size`: of the picture, pixels.
fn balloon_seats(places: &[[f64; 2]], [width, height]: [f64; 2]) -> Vec<[f64; 2]> {
    let middle = [width / 2.0 + MARGIN, height / 2.0 + MARGIN];
    let [a, b] = [width / 2.0 + MARGIN - 1.3 * RADIUS, height / 2.0 + MARGIN - 1.3 * RADIUS];
    let mut seats: Vec<(usize, f64)> = places
        .iter()
        .map(|[x, y]| ((y + MARGIN - middle[1]) / b).atan2((x + MARGIN - middle[0]) / a))
        .enumerate()
        .collect();
    seats.sort_by(|one, other| one.1.total_cmp(&other.1));
    // as far apart as a balloon is wide where there is room, else all around
    let apart = (2.6 * RADIUS / a.min(b)).min(TAU / places.len().max(1) as f64);
    for _ in 0..200 {
        for at in 0..seats.len() {
            let next = (at + 1) % seats.len();
            let turn = if next == 0 { TAU } else { 0.0 };
            let short = apart - (seats[next].1 + turn - seats[at].1);
            if next != at && short > 1e-9 {
                seats[at].1 -= short / 2.0;
                seats[next].1 += short / 2.0;
            }
        }
    }
    let mut placed = vec![[0.0; 2]; places.len()];
    for (at, angle) in seats {
        placed[at] = on_rectangle(angle, [a, b], middle);
    }
    placed
}

/// Where a ray from the middle leaves a rectangle, the corners cut.
fn on_rectangle(angle: f64, [a, b]: [f64; 2], [x, y]: [f64; 2]) -> [f64; 2] {
    let (sine, cosine) = angle.sin_cos();
    // a superellipse: nearly a rectangle, and smooth
    let reach = (cosine.abs().powi(6) + sine.abs().powi(6)).powf(-1.0 / 6.0);
    [x + a * cosine * reach, y + b * sine * reach]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forty_balloons_keep_apart_and_inside() {
        let places: Vec<_> = (0..40).map(|at| [500.0 + f64::from(at % 7), 300.0 + f64::from(at / 7)]).collect();
        let seats = balloon_seats(&places, [1100.0, 600.0]);
        for (at, one) in seats.iter().enumerate() {
            assert!((RADIUS..1100.0 + 2.0 * MARGIN - RADIUS).contains(&one[0]), "{one:?}");
            assert!((RADIUS..600.0 + 2.0 * MARGIN - RADIUS).contains(&one[1]), "{one:?}");
            for other in &seats[at + 1..] {
                assert!((one[0] - other[0]).hypot(one[1] - other[1]) > 2.0 * RADIUS, "{one:?} {other:?}");
            }
        }
    }

    #[test]
    fn a_balloon_stands_on_the_side_of_its_feature() {
        let seats = balloon_seats(&[[1000.0, 300.0], [100.0, 310.0]], [1100.0, 600.0]);
        assert!(seats[0][0] > 1000.0 && seats[1][0] < 200.0, "{seats:?}");
    }
}
