//! Outline of the part in a scan, seen along the normal at a flag: no touch goes beyond it.

use nalgebra::{Isometry3, Point2, Point3, Unit, Vector2, Vector3};

use touchup_geometry::mesh::TriMesh;
use touchup_geometry::numeric::turned_to;

/// Outline of a scan, seen along the normal at a flag. An opening that the part encloses counts as
/// part: the search for a hole is the same whether the scan shows it or has nothing there.
///
/// Only the scan within reach of touches below the flag counts: not the table under a part.
#[derive(Clone, Debug)]
pub(crate) struct Outline {
    /// maps O to the frame of the flag
    pose_fo: Isometry3<f64>,
    /// low corner of the first cell, m
    lowest: Point2<f64>,
    /// side of a cell, m
    cell: f64,
    columns: usize,
    /// row after row; with a margin of one row and one column around the scan
    is_outside: Vec<bool>,
}

/// Minimum side of a cell, m.
const CELL: f64 = 0.2e-3;
/// Maximum number of cells along one side of a scan.
const MOST: f64 = 1024.0;
/// Tested places around a place.
const AROUND: usize = 12;

impl Outline {
    /// - `scan`: in O; `flag`, `normal`: in O; `deep`: reach of touches below the flag, m.
    pub(crate) fn new(
        scan: &TriMesh,
        flag: &Point3<f64>,
        normal: &Unit<Vector3<f64>>,
        deep: f64,
    ) -> Self {
        let pose_fo = Isometry3::from_parts(flag.coords.into(), turned_to(normal)).inverse();
        let triangles = || {
            scan.faces()
                .map(|(face, _)| scan.triangle(face).map(|p| pose_fo * p))
        };
        let near = || triangles().filter(|corners| corners.iter().any(|p| p.z > -deep));
        let (low, high) =
            near()
                .flatten()
                .fold((Point2::origin(), Point2::origin()), |(low, high), p| {
                    let p = p.xy();
                    (
                        Point2::from(low.coords.inf(&p.coords)),
                        Point2::from(high.coords.sup(&p.coords)),
                    )
                });
        let size = high - low;
        let cell = CELL.max(size.max() / MOST);
        let [columns, rows] = [size.x, size.y].map(|length| (length / cell).ceil() as usize + 3);
        // the first cells are empty
        let lowest = low - Vector2::repeat(cell * 1.5);
        let mut is_part = vec![false; columns * rows];
        for corners in near() {
            let corners = corners.map(|p| (p.xy() - lowest) / cell);
            cover(corners, |column, row| {
                is_part[row * columns + column] = true
            });
        }
        Self {
            pose_fo,
            lowest,
            cell,
            columns,
            is_outside: reached_from_border(&is_part, columns),
        }
    }

    fn is_outside(&self, p: &Point2<f64>) -> bool {
        let at = (p - self.lowest) / self.cell;
        let rows = self.is_outside.len() / self.columns;
        let is_in = at.x >= 0.0 && at.y >= 0.0 && at.x < self.columns as f64 && at.y < rows as f64;
        !is_in || self.is_outside[at.y as usize * self.columns + at.x as usize]
    }

    /// Whether the disc of a radius (m) about a place of O is all over or under the part.
    pub(crate) fn is_part(&self, place: &Point3<f64>, radius: f64) -> bool {
        let place = (self.pose_fo * place).xy();
        let turn = |at: usize| at as f64 / AROUND as f64 * std::f64::consts::TAU;
        let around =
            (0..AROUND).map(|at| place + Vector2::new(turn(at).cos(), turn(at).sin()) * radius);
        std::iter::once(place)
            .chain(around)
            .all(|p| !self.is_outside(&p))
    }
}

/// Cells whose middle a triangle covers, seen from above; column and row. The corners are in cells.
fn cover(corners: [Vector2<f64>; 3], mut found: impl FnMut(usize, usize)) {
    let [a, b, c] = corners;
    let area = (b - a).perp(&(c - a));
    let [low, high] = [a.inf(&b).inf(&c), a.sup(&b).sup(&c)];
    // middles of cells are half a cell beside their numbers
    let from = |low: f64| (low - 0.5).ceil().max(0.0) as usize;
    let to = |high: f64| (high - 0.5).floor();
    let turned = if area < 0.0 { -1.0 } else { 1.0 };
    for row in (from(low.y)..).take_while(|row| *row as f64 <= to(high.y)) {
        for column in (from(low.x)..).take_while(|column| *column as f64 <= to(high.x)) {
            let p = Vector2::new(column as f64 + 0.5, row as f64 + 0.5);
            let is_left =
                |u: Vector2<f64>, v: Vector2<f64>| (v - u).perp(&(p - u)) * turned >= -INCLUDED;
            if is_left(a, b) && is_left(b, c) && is_left(c, a) {
                found(column, row);
            }
        }
    }
}

/// Tolerance for a middle on the edge of a triangle, against rounding; in cells.
const INCLUDED: f64 = 1e-9;

/// Empty cells joined with the border of the grid by empty cells, side by side.
fn reached_from_border(is_part: &[bool], columns: usize) -> Vec<bool> {
    // the border is empty, and so is the first cell
    let mut is_reached = vec![false; is_part.len()];
    let mut waiting = vec![0];
    is_reached[0] = true;
    while let Some(at) = waiting.pop() {
        let (column, rows) = (at % columns, is_part.len() / columns);
        let beside = [
            (column > 0).then(|| at - 1),
            (column + 1 < columns).then(|| at + 1),
            (at >= columns).then(|| at - columns),
            (at / columns + 1 < rows).then(|| at + columns),
        ];
        for next in beside.into_iter().flatten() {
            if !is_part[next] && !is_reached[next] {
                is_reached[next] = true;
                waiting.push(next);
            }
        }
    }
    is_reached
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame of 20 × 20 mm around an opening of 8 × 8 mm, in z = 0, open towards +x on request;
    /// by hand.
    fn frame(is_open: bool) -> TriMesh {
        let (mut positions, mut faces) = (Vec::new(), Vec::new());
        let mut block = |x: [f64; 2], y: [f64; 2]| {
            let first = positions.len() as u32;
            let corners = [[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]];
            positions.extend(corners.map(|[x, y]| Point3::new(x * 1e-3, y * 1e-3, 0.0)));
            faces.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        };
        block([-10.0, 10.0], [-10.0, -4.0]);
        block([-10.0, 10.0], [4.0, 10.0]);
        block([-10.0, -4.0], [-4.0, 4.0]);
        if !is_open {
            block([4.0, 10.0], [-4.0, 4.0]);
        }
        TriMesh::new(positions, faces).unwrap()
    }

    fn outline(scan: &TriMesh) -> Outline {
        Outline::new(scan, &Point3::origin(), &Vector3::z_axis(), 5e-3)
    }

    #[test]
    fn an_opening_that_the_part_encloses_is_part_and_one_that_is_open_is_not() {
        let (closed, open) = (outline(&frame(false)), outline(&frame(true)));
        let at = |x: f64, y: f64| Point3::new(x * 1e-3, y * 1e-3, 1e-3);
        for (place, radius, [of_closed, of_open]) in [
            (at(0.0, 0.0), 0.0, [true, false]),
            (at(7.0, 7.0), 2.5e-3, [true, true]),
            (at(-9.5, 0.0), 0.0, [true, true]),
            (at(-9.5, 0.0), 1e-3, [false, false]),
            (at(-10.5, 0.0), 0.0, [false, false]),
            (at(7.0, 0.0), 0.0, [true, false]),
            (at(300.0, 0.0), 0.0, [false, false]),
        ] {
            let found = [&closed, &open].map(|outline| outline.is_part(&place, radius));
            assert_eq!(found, [of_closed, of_open], "{place} {radius}");
        }
    }

    /// A table of 100 × 100 mm, 6 mm below the flag, is deeper than the reach of touches.
    #[test]
    fn what_is_deeper_than_touches_reach_is_no_part() {
        let table = [[-50.0, -50.0], [50.0, -50.0], [50.0, 50.0], [-50.0, 50.0]];
        let table = table.map(|[x, y]| Point3::new(x * 1e-3, y * 1e-3, -6e-3));
        let table = TriMesh::new(table.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        assert!(!outline(&table).is_part(&Point3::origin(), 0.0));
        let reaching = Outline::new(&table, &Point3::origin(), &Vector3::z_axis(), 7e-3);
        assert!(reaching.is_part(&Point3::origin(), 0.0));
    }
}
