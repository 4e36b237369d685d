//! Form of a flat wall: flatness.

use std::ops::Range;

use nalgebra::{Point3, SVector, SymmetricEigen, Vector2, Vector3};

use super::profile::{DesignRow, FormPoint, Profile};
use super::round_form::Deviation;
use super::zone::linear_zone;
use crate::numeric::{scatter, tangent_basis};

/// Form of the touched part of a flat wall.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FlatForm {
    /// distance of two parallel planes
    pub flatness: Deviation,
    /// share of the rectangle around the touches that they cover: the form of the rest is unknown
    pub coverage: f64,
}

/// Maximum degree of the polynomials in both directions together: three undulations over the wall.
const MOST_DEGREE: usize = 6;
/// Places of the deviation in each direction of the rectangle, from edge to edge.
const PLACES: usize = 17;

/// Legendre's polynomials at x, −1 to 1.
fn legendre(x: f64) -> [f64; MOST_DEGREE + 1] {
    let mut p = [1.0; MOST_DEGREE + 1];
    p[1] = x;
    for n in 1..MOST_DEGREE {
        let k = n as f64;
        p[n + 1] = ((2.0 * k + 1.0) * x * p[n] - k * p[n - 1]) / (k + 1.0);
    }
    p
}

/// Products of polynomials by their degree: the first three are the plane.
fn terms([x, y]: [f64; 2]) -> Vec<f64> {
    let (p, q) = (legendre(x), legendre(y));
    (0..=MOST_DEGREE)
        .flat_map(|degree| (0..=degree).map(move |i| p[degree - i] * q[i]))
        .collect()
}

/// Degree of a term.
fn degree_of(term: usize) -> usize {
    (0..=MOST_DEGREE)
        .find(|degree| term < (degree + 1) * (degree + 2) / 2)
        .unwrap_or(MOST_DEGREE)
}

/// Number of terms of the plane.
const REFERENCE: usize = 3;

/// Flatness of a wall; `None` if the points do not determine it.
///
/// - `on_plane`, `normal`: of the fitted plane, m and a unit vector, in O.
pub fn flat_form(
    points: &[FormPoint],
    on_plane: &Point3<f64>,
    normal: &Vector3<f64>,
) -> Option<FlatForm> {
    let [u, v] = long_sides(points, on_plane, normal)?;
    let local: Vec<[f64; 2]> = points
        .iter()
        .map(|p| [u.dot(&(p.point - on_plane)), v.dot(&(p.point - on_plane))])
        .collect();
    let range = |i: usize| {
        let (low, high) = local.iter().fold((f64::MAX, f64::MIN), |(low, high), q| {
            (low.min(q[i]), high.max(q[i]))
        });
        [
            (low + high) / 2.0,
            ((high - low) / 2.0).max(f64::MIN_POSITIVE),
        ]
    };
    let ranges = [range(0), range(1)];
    let unit =
        |q: &[f64; 2]| [0, 1].map(|i| ((q[i] - ranges[i][0]) / ranges[i][1]).clamp(-1.0, 1.0));
    let places: Vec<[f64; 2]> = local.iter().map(unit).collect();
    let row = |(p, place): (&FormPoint, &[f64; 2])| DesignRow {
        terms: terms(*place),
        value: normal.dot(&(p.point - on_plane)),
        sigma: p.sigma,
        group: p.group,
    };
    let rows: Vec<DesignRow> = points.iter().zip(&places).map(row).collect();
    let count = terms([0.0; 2]).len();
    let blocks: Vec<Range<usize>> = (REFERENCE..count).map(|term| term..term + 1).collect();
    let profile = Profile::of(&rows, REFERENCE, blocks)?;

    // within a quarter of the shortest undulation of a touch: a polynomial of degree n has n/2
    // undulations over a length of 2
    let shortest = profile
        .sought
        .iter()
        .map(|&number| degree_of(REFERENCE + number))
        .max()?;
    let near = 1.0 / shortest as f64;
    let at = |i: usize| 2.0 * i as f64 / (PLACES - 1) as f64 - 1.0;
    let mut is_touched = [[false; PLACES]; PLACES];
    for place in &places {
        let [rows, columns] =
            place.map(|x| (0..PLACES).filter(move |&i| (at(i) - x).abs() <= near));
        rows.for_each(|i| columns.clone().for_each(|j| is_touched[i][j] = true));
    }
    let all = (0..PLACES).flat_map(|i| (0..PLACES).map(move |j| (i, j)));
    let wall: Vec<Vec<f64>> = all
        .filter(|&(i, j)| is_touched[i][j])
        .map(|(i, j)| terms([at(i), at(j)]))
        .collect();
    let plane: Vec<SVector<f64, 4>> = wall
        .iter()
        .map(|place| SVector::from([place[0], place[1], place[2], 0.0]))
        .collect();
    let flatness = profile.sizes(
        |_| true,
        &wall,
        |values| linear_zone(&plane, values).map(|zone| [zone.minimum_zone, zone.least_squares]),
    )?;
    Some(FlatForm {
        flatness: Deviation::of(flatness),
        coverage: wall.len() as f64 / (PLACES * PLACES) as f64,
    })
}

/// Unit vectors in a plane along the sides of the rectangle around its points: along their
/// principal axes.
fn long_sides(
    points: &[FormPoint],
    on_plane: &Point3<f64>,
    normal: &Vector3<f64>,
) -> Option<[Vector3<f64>; 2]> {
    let [u, v] = tangent_basis(normal);
    let local = points
        .iter()
        .map(|p| Vector2::new(u.dot(&(p.point - on_plane)), v.dot(&(p.point - on_plane))));
    let scatter = scatter(local);
    if !scatter.iter().all(|x| x.is_finite()) {
        return None;
    }
    let eigen = SymmetricEigen::new(scatter);
    Some([0, 1].map(|i| u * eigen.eigenvectors[(0, i)] + v * eigen.eigenvectors[(1, i)]))
}
