//! The part with a numbered balloon at each feature.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use maud::{Markup, html};
use nalgebra::Point3;
use touchup_document::picture_address;

use super::decisions::{DecisionLook, look_of};
use super::input::ReportInput;
use crate::InspectionError;
use crate::params::PartPicture;
use crate::rows::Balloon;
use touchup_features::compare::{PartView, PicturePanel, PictureParams, Rgb, draw_part};
use touchup_features::conformity::Decision;
use touchup_io::file_error::FileError;
use touchup_io::mesh_file::read_vertex_columns;
use touchup_io::png::png_bytes;
use touchup_session::scan::{Scan, read_scan};

/// Width of the part without margin, pixels.
const WIDTH: u32 = 1100;
/// Margin for balloons.
const MARGIN: f64 = 70.0;
/// Radius of a balloon.
const RADIUS: f64 = 21.0;
const TOUCHED: Rgb = [150, 184, 214];
const SCANNED: Rgb = [205, 208, 213];

/// The section; without a mesh a note.
pub(super) fn picture(input: &ReportInput<'_>) -> Result<Markup, InspectionError> {
    let Some(path) = &input.source.mesh else {
        return Ok(html! {
            h2 { "Picture" }
            p.small { "No mesh was given (--mesh): there is no picture." }
        });
    };
    let placed = input.inspected.balloons.iter();
    let placed =
        placed.filter_map(|balloon| Some((balloon, Point3::from(balloon.place_mm?) * 1e-3)));
    let (balloons, places): (Vec<_>, Vec<_>) = placed.unzip();
    let PartView { picture, places } = part_view(path, input.picture, &places)?;
    let png = png_bytes(picture.size, &picture.pixels).map_err(|source| FileError::Write {
        path: path.clone(),
        source,
    })?;
    let [width, height] = picture.size.map(f64::from);
    let is_inside = |[x, y]: &[f64; 2]| (0.0..=width).contains(x) && (0.0..=height).contains(y);
    let drawn = balloons
        .into_iter()
        .zip(places)
        .filter(|(_, place)| is_inside(place));
    let (balloons, places): (Vec<_>, Vec<_>) = drawn.unzip();
    let unseen = input.inspected.balloons.len() - balloons.len();
    let seats = balloon_seats(&places, [width, height]);
    let balloons = balloons
        .iter()
        .zip(&places)
        .zip(&seats)
        .map(|((one, place), seat)| {
            draw_balloon(one, worst(input, one), place.map(|x| x + MARGIN), *seat)
        });
    Ok(html! {
        figure {
            svg.part viewBox={ "0 0 " (width + 2.0 * MARGIN) " " (height + 2.0 * MARGIN) } role="img"
                aria-label="the part with numbered features" {
                rect width="100%" height="100%" fill="#e9ecf0" {}
                image x=(MARGIN) y=(MARGIN) width=(width) height=(height) href=(picture_address(&png)) {}
                @for balloon in balloons { (balloon) }
            }
            figcaption {
                "Blue was touched, grey is the scan. A balloon has the colour and sign of the worst decision of its \
                feature; dashed: not found, at its nominal place."
                @if unseen > 0 { " " (unseen) " without a place on the mesh are not drawn." }
            }
        }
    })
}

/// The part in the colours of touch and scan, with places on it.
fn part_view(
    path: &Path,
    PartPicture { mesh_unit, view }: PartPicture,
    places: &[Point3<f64>],
) -> Result<PartView, InspectionError> {
    let Scan { mesh, .. } = read_scan(path, mesh_unit)?;
    let [touched] = read_vertex_columns(path, mesh_unit, &mesh, ["touched"])?;
    let touched = touched.unwrap_or_default();
    let is_touched = |vertex| touched.get(vertex).is_some_and(|share| *share >= 1.0);
    let vertices = 0..mesh.vertex_slots();
    let paint = vertices
        .clone()
        .map(|vertex| if is_touched(vertex) { TOUCHED } else { SCANNED });
    let paint: Vec<Rgb> = paint.collect();
    let weights: Vec<f64> = vertices
        .map(|vertex| f64::from(u8::from(is_touched(vertex))))
        .collect();
    let params = PictureParams {
        width: WIDTH,
        from: view,
        weights: weights.contains(&1.0).then_some(&*weights),
        ..PictureParams::default()
    };
    let panel = PicturePanel {
        paint: Some(&paint),
        ..PicturePanel::of(&mesh)
    };
    Ok(draw_part(&panel, &params, places))
}

/// Worst decision of a feature.
fn worst<'a>(input: &ReportInput<'a>, balloon: &Balloon) -> &'a str {
    let rank = |name: &&str| {
        Decision::ALL
            .iter()
            .position(|decision| decision.name() == *name)
    };
    let characteristics = &input.inspected.record.characteristics;
    let decisions = balloon
        .characteristics
        .iter()
        .map(|&at| &*characteristics[at].decision);
    decisions.max_by_key(rank).unwrap_or("undecided")
}

fn draw_balloon(balloon: &Balloon, decision: &str, place: [f64; 2], seat: [f64; 2]) -> Markup {
    let DecisionLook { fill, ink, sign } = look_of(decision);
    let dash = balloon.feature.is_none().then_some("6 4");
    let [[x, y], [u, v]] = [place, seat].map(|at| at.map(|x| format!("{x:.1}")));
    html! {
        path d={ "M" (x) " " (y) " L" (u) " " (v) } stroke="#1d2129" stroke-width="2" stroke-dasharray=[dash] {}
        circle cx=(x) cy=(y) r="5" fill="#1d2129" stroke="#fff" stroke-width="2" {}
        circle cx=(u) cy=(v) r=(RADIUS) fill=(fill) stroke="#1d2129" stroke-width="2" stroke-dasharray=[dash] {}
        text x=(u) y=(format!("{:.1}", seat[1] + 7.0)) font-size="21" font-weight="700" text-anchor="middle" fill=(ink) {
            (balloon.number) (sign)
        }
    }
}

/// Number of outline points as candidate balloon places.
const OUTLINE_POINTS: usize = 720;
/// Desired distance between balloons along the outline, in radii.
const APART: f64 = 2.8;

/// Balloon places around the part, each in the direction of its feature, spaced apart.
///
/// - `size`: size of the picture, pixels.
fn balloon_seats(places: &[[f64; 2]], [width, height]: [f64; 2]) -> Vec<[f64; 2]> {
    let middle = [width / 2.0 + MARGIN, height / 2.0 + MARGIN];
    let half = [
        width / 2.0 + MARGIN - 1.3 * RADIUS,
        height / 2.0 + MARGIN - 1.3 * RADIUS,
    ];
    let angle_of = |point: f64| TAU * point / OUTLINE_POINTS as f64 - PI;
    let outline: Vec<_> = (0..=OUTLINE_POINTS)
        .map(|point| on_rectangle(angle_of(point as f64), half, middle))
        .collect();
    // arc length from the first point to each
    let mut along = vec![0.0];
    for (one, next) in outline.iter().zip(&outline[1..]) {
        along.push(along[along.len() - 1] + (next[0] - one[0]).hypot(next[1] - one[1]));
    }
    let mut seats: Vec<(usize, f64)> = places
        .iter()
        .map(|[x, y]| {
            ((y + MARGIN - middle[1]) / half[1]).atan2((x + MARGIN - middle[0]) / half[0])
        })
        .map(|angle| {
            along[((angle + PI) / TAU * OUTLINE_POINTS as f64).round() as usize % OUTLINE_POINTS]
        })
        .enumerate()
        .collect();
    seats.sort_by(|one, other| one.1.total_cmp(&other.1));
    let wanted: Vec<f64> = seats.iter().map(|(_, along)| *along).collect();
    let mut placed = vec![[0.0; 2]; places.len()];
    for ((feature, _), seat) in
        seats
            .into_iter()
            .zip(spread(&wanted, along[OUTLINE_POINTS], APART * RADIUS))
    {
        placed[feature] = outline[along
            .partition_point(|length| *length < seat)
            .min(OUTLINE_POINTS)];
    }
    placed
}

/// Places along a closed line of this length, nearest to the wanted ones by least squares, at this
/// distance apart, or evenly around if the line is too short.
///
/// - `wanted`: ascending. Less the length that earlier places need, they have to ascend too:
///   pooling merges violators \[Barlow et al. 1972\].
fn spread(wanted: &[f64], length: f64, apart: f64) -> Vec<f64> {
    let count = wanted.len();
    let apart = apart.min(length / count.max(1) as f64);
    // mean and size of each pool
    let mut pools: Vec<(f64, usize)> = Vec::new();
    for (at, place) in wanted.iter().enumerate() {
        pools.push((place - at as f64 * apart, 1));
        while let [.., (mean, of), (next, more)] = pools[..]
            && mean >= next
        {
            pools.pop();
            pools.pop();
            let all = of + more;
            pools.push(((mean * of as f64 + next * more as f64) / all as f64, all));
        }
    }
    let means = pools
        .into_iter()
        .flat_map(|(mean, of)| std::iter::repeat_n(mean, of));
    let placed: Vec<f64> = means
        .enumerate()
        .map(|(at, mean)| mean + at as f64 * apart)
        .collect();
    let reach = placed
        .last()
        .zip(placed.first())
        .map_or(0.0, |(last, first)| last - first);
    let (first, step) = match placed.first() {
        // the last would overlap the first
        Some(first) if reach > length - apart => (*first, Some(length / count as f64)),
        Some(first) => (*first, None),
        None => (0.0, None),
    };
    let place = |(at, place): (usize, f64)| {
        step.map_or(place, |step| first + at as f64 * step)
            .rem_euclid(length)
    };
    placed.into_iter().enumerate().map(place).collect()
}

/// Point at which a ray from the middle leaves a rectangle with cut corners.
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
        let places: Vec<_> = (0..40)
            .map(|at| [500.0 + f64::from(at % 7), 300.0 + f64::from(at / 7)])
            .collect();
        let seats = balloon_seats(&places, [1100.0, 600.0]);
        for (at, one) in seats.iter().enumerate() {
            assert!(
                (RADIUS..1100.0 + 2.0 * MARGIN - RADIUS).contains(&one[0]),
                "{one:?}"
            );
            assert!(
                (RADIUS..600.0 + 2.0 * MARGIN - RADIUS).contains(&one[1]),
                "{one:?}"
            );
            for other in &seats[at + 1..] {
                assert!(
                    (one[0] - other[0]).hypot(one[1] - other[1]) > 2.0 * RADIUS,
                    "{one:?} {other:?}"
                );
            }
        }
    }

    #[test]
    fn places_along_a_line_are_moved_by_no_more_than_they_need() {
        assert_eq!(spread(&[10.0, 50.0], 100.0, 10.0), [10.0, 50.0]);
        // three at one place: the middle one stays
        assert_eq!(spread(&[50.0, 50.0, 50.0], 100.0, 10.0), [40.0, 50.0, 60.0]);
        // across the beginning of the line
        assert_eq!(spread(&[2.0, 2.0, 2.0], 100.0, 10.0), [92.0, 2.0, 12.0]);
        // no room: evenly around
        assert_eq!(spread(&[0.0, 1.0, 2.0, 3.0], 20.0, 10.0).len(), 4);
        let mut around = spread(&[0.0, 1.0, 2.0, 3.0], 20.0, 10.0);
        around.sort_by(f64::total_cmp);
        assert!(
            around
                .windows(2)
                .all(|pair| pair[1] - pair[0] >= 5.0 - 1e-9),
            "{around:?}"
        );
        assert!(spread(&[], 100.0, 10.0).is_empty());
    }

    #[test]
    fn a_balloon_stands_on_the_side_of_its_feature() {
        let seats = balloon_seats(&[[1000.0, 300.0], [100.0, 310.0]], [1100.0, 600.0]);
        assert!(seats[0][0] > 1000.0 && seats[1][0] < 200.0, "{seats:?}");
    }
}
