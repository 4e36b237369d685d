//! Repair of the triangles of a file to a usable mesh, with a report of the faults.

mod orient;
mod pieces;
mod weld;

use std::fmt;

use nalgebra::Point3;
use serde::Serialize;

use super::closest::greater;
use super::stars::Valences;
use super::tri_mesh::{FARTHEST, MeshError, TriMesh};
use crate::numeric::counted;
use orient::{Edges, boundary_loops};

/// Two times the area of a face without area, relative to its longest edge times its largest
/// coordinate: at least one rounding (digits of the file, unit) of each coordinate, by up to ε/2 of
/// itself, moves an edge by as much. 16 leaves room for the roundings of the cross product.
const ZERO_AREA: f64 = 16.0 * f64::EPSILON;

/// Findings and changes of [`repair`]. Numbers only, no lengths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RepairReport {
    /// vertices merged into an earlier one at the same position
    pub welded_vertices: usize,
    /// faces left out for a coordinate that is not a number within [`FARTHEST`]
    pub dropped_not_finite: usize,
    /// faces left out for a repeated vertex or zero area
    pub dropped_zero_area: usize,
    /// faces left out for the same three vertices as an earlier face
    pub dropped_duplicates: usize,
    /// faces turned over to agree with neighbours and to have outward normals on closed pieces
    pub flipped_faces: usize,
    /// vertices left out, without a face
    pub unused_vertices: usize,
    /// edges of three faces or more; they stay
    pub non_manifold_edges: usize,
    /// edges of one face; they stay
    pub boundary_edges: usize,
    /// chains of boundary edges: holes and outer rims; rims that touch in a vertex count as one
    pub boundary_loops: usize,
    /// pieces connected over edges of two faces
    pub components: usize,
}

impl fmt::Display for RepairReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let dropped = self.dropped_not_finite + self.dropped_zero_area + self.dropped_duplicates;
        write!(
            f,
            "welded {}, left out {} and {} ({} not finite, {} without area, {} twice), turned over {}; {}, {} in {}, {}",
            counted(self.welded_vertices, "vertex", "vertices"),
            counted(self.unused_vertices, "unused one", "unused ones"),
            counted(dropped, "face", "faces"),
            self.dropped_not_finite,
            self.dropped_zero_area,
            self.dropped_duplicates,
            self.flipped_faces,
            counted(self.components, "piece", "pieces"),
            counted(self.boundary_edges, "boundary edge", "boundary edges"),
            counted(self.boundary_loops, "loop", "loops"),
            counted(
                self.non_manifold_edges,
                "non-manifold edge",
                "non-manifold edges"
            )
        )
    }
}

/// Makes a mesh of any triangles: welds vertices at the same position, leaves out faces that are
/// not finite, have no area or are repeated, turns faces over until they agree, and leaves out
/// vertices without a face.
///
/// The rest keeps its order, so a clean mesh comes out unchanged. Holes, non-manifold edges and
/// self-intersections stay: to close or cut is to invent surface.
///
/// - `positions`: V × 3, m, in O; NaN and infinity are allowed.
/// - `faces`: F × 3.
///
/// # Errors
/// [`MeshError::VertexOutOfRange`], [`MeshError::TooMany`]; [`MeshError::Empty`] if no face
/// remains.
///
/// # Example
/// ```
/// use nalgebra::Point3;
/// let p = |x, y| Point3::new(x, y, 0.0);
/// // two triangles as STL has them: each with its own three vertices; the second one lies upside down
/// let corners = vec![p(0.0, 0.0), p(1.0, 0.0), p(0.0, 1.0), p(1.0, 0.0), p(0.0, 1.0), p(1.0, 1.0)];
/// let (mesh, report) = touchup_geometry::mesh::repair(corners, vec![[0, 1, 2], [3, 4, 5]])?;
/// assert_eq!((mesh.vertex_count(), mesh.face_count()), (4, 2));
/// assert_eq!((report.welded_vertices, report.flipped_faces), (2, 1));
/// # Ok::<(), touchup_geometry::mesh::MeshError>(())
/// ```
pub fn repair(
    mut positions: Vec<Point3<f64>>,
    mut faces: Vec<[u32; 3]>,
) -> Result<(TriMesh, RepairReport), MeshError> {
    check(&positions, &faces)?;
    let mut report = RepairReport {
        welded_vertices: weld::weld(&mut positions, &mut faces),
        ..Default::default()
    };
    let mut valences = drop_faces(&positions, &mut faces, &mut report);
    report.unused_vertices = drop_unused(&mut valences, &mut positions, &mut faces);
    if faces.is_empty() {
        return Err(MeshError::Empty);
    }
    let (mut mesh, edges) =
        without_duplicates(TriMesh::of_sound(positions, faces, valences), &mut report)?;
    report.boundary_edges = edges.boundary.len();
    report.boundary_loops = boundary_loops(&edges.boundary);
    report.non_manifold_edges = edges.non_manifold;
    (report.flipped_faces, report.components) = edges.orient(&mut mesh);
    Ok((mesh, report))
}

/// Checks counts and indices.
fn check(positions: &[Point3<f64>], faces: &[[u32; 3]]) -> Result<(), MeshError> {
    // 32 bits count two ends of three edges of every face
    for (what, count, limit) in [
        ("vertices", positions.len(), u32::MAX - 1),
        ("faces", faces.len(), u32::MAX / 6),
    ] {
        if count > limit as usize {
            return Err(MeshError::TooMany { what, count });
        }
    }
    let (vertices, used) = (positions.len(), faces.as_flattened());
    let is_beyond = |v: u32| v as usize >= vertices;
    // finds the highest without a branch for each
    if used.iter().copied().max().is_some_and(is_beyond)
        && let Some(at) = used.iter().position(|&v| is_beyond(v))
    {
        return Err(MeshError::VertexOutOfRange {
            face: at / 3,
            vertex: used[at],
            vertices,
        });
    }
    Ok(())
}

/// Leaves out faces that are not finite or have no area; counts the others at their vertices.
fn drop_faces(
    positions: &[Point3<f64>],
    faces: &mut Vec<[u32; 3]>,
    report: &mut RepairReport,
) -> Valences {
    let mut valences = Valences::new(positions.len());
    faces.retain(|corners| {
        let [a, b, c] = corners.map(|v| positions[v as usize]);
        let (u, v) = (b - a, c - a);
        let double_area_2 = u.cross(&v).norm_squared();
        let longest_2 = greater(
            u.norm_squared(),
            greater(v.norm_squared(), (c - b).norm_squared()),
        );
        let limit_2 = longest_2
            * (ZERO_AREA * greater(largest(&a), greater(largest(&b), largest(&c)))).powi(2);
        // false for NaN, the result of any coordinate that is not a number
        let is_near = greater(largest(&a), greater(largest(&b), largest(&c))) <= FARTHEST;
        let stays = double_area_2 > limit_2 && is_near;
        if stays {
            valences.add(corners);
        } else if double_area_2.is_finite() && is_near {
            report.dropped_zero_area += 1;
        } else {
            report.dropped_not_finite += 1;
        }
        stays
    });
    valences
}

/// The largest absolute coordinate.
#[inline]
fn largest(p: &Point3<f64>) -> f64 {
    greater(p.x.abs(), greater(p.y.abs(), p.z.abs()))
}

/// Leaves out vertices that no face uses; returns their number.
fn drop_unused(
    valences: &mut Valences,
    positions: &mut Vec<Point3<f64>>,
    faces: &mut [[u32; 3]],
) -> usize {
    let unused = valences.used().filter(|used| !used).count();
    if unused > 0 {
        let mut kept = 0;
        let renamed: Vec<u32> = valences
            .used()
            .map(|used| (kept, kept += u32::from(used)).0)
            .collect();
        let mut used = valences.used();
        positions.retain(|_| used.next() == Some(true));
        drop(used);
        valences.retain_used();
        for vertex in faces.as_flattened_mut() {
            *vertex = renamed[*vertex as usize];
        }
    }
    unused
}

/// The mesh with one face for each three vertices, and its edges.
fn without_duplicates(
    mesh: TriMesh,
    report: &mut RepairReport,
) -> Result<(TriMesh, Edges), MeshError> {
    let edges = Edges::of(&mesh);
    if edges.duplicates.is_empty() {
        return Ok((mesh, edges));
    }
    report.dropped_duplicates = edges.duplicates.len();
    let kept = mesh
        .faces()
        .filter(|(face, _)| edges.duplicates.binary_search(&face.0).is_err());
    let faces = kept.map(|(_, corners)| corners.map(|v| v.0)).collect();
    let mesh = TriMesh::new(mesh.positions().to_vec(), faces)?;
    let edges = Edges::of(&mesh);
    Ok((mesh, edges))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use proptest::prelude::*;

    use super::*;
    use crate::mesh::FaceId;

    /// A cube of edge 1, 12 faces, normals outside.
    fn cube(at: f64) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
        let corner = |i: u32| {
            Point3::new(
                at + f64::from(i & 1),
                f64::from(i >> 1 & 1),
                f64::from(i >> 2),
            )
        };
        let quads = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        (
            (0..8).map(corner).collect(),
            quads
                .iter()
                .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
                .collect(),
        )
    }

    /// Volume by the divergence theorem.
    fn volume(mesh: &TriMesh) -> f64 {
        mesh.faces()
            .map(|(f, _)| mesh.barycentre(f).coords.dot(&mesh.double_area_normal(f)) / 6.0)
            .sum()
    }

    #[test]
    fn a_clean_cube_comes_out_as_it_went_in() {
        let (positions, faces) = cube(0.0);
        let (mesh, report) = repair(positions.clone(), faces.clone()).unwrap();
        assert_eq!(mesh.positions(), positions);
        assert_eq!(
            mesh.faces()
                .map(|(_, c)| c.map(|v| v.0))
                .collect::<Vec<_>>(),
            faces
        );
        assert_eq!(
            report,
            RepairReport {
                components: 1,
                ..Default::default()
            }
        );
    }

    #[test]
    fn scrambled_cubes_are_turned_outside_and_keep_their_face_ids() {
        let (positions, faces) = cube(5.0);
        for pattern in 0..1 << 12 {
            let mut scrambled = faces.clone();
            for (bit, face) in scrambled.iter_mut().enumerate() {
                if pattern >> bit & 1 == 1 {
                    face.swap(0, 2);
                }
            }
            let (mesh, report) = repair(positions.clone(), scrambled).unwrap();
            assert!((volume(&mesh) - 1.0).abs() < 1e-12, "pattern {pattern:b}");
            assert_eq!(report.flipped_faces, u32::count_ones(pattern) as usize);
            for (id, face) in faces.iter().enumerate() {
                let mut corners = mesh.corners(FaceId(id as u32)).map(|v| v.0);
                let mut wanted = *face;
                corners.sort_unstable();
                wanted.sort_unstable();
                assert_eq!(corners, wanted);
            }
        }
    }

    #[test]
    fn an_open_patch_keeps_the_side_of_its_larger_area() {
        // unit square in two halves of equal area and a flap three times as large, upside down
        let p = |x, y| Point3::new(x, y, 0.0);
        let positions = vec![
            p(0.0, 0.0),
            p(1.0, 0.0),
            p(1.0, 1.0),
            p(0.0, 1.0),
            p(-6.0, 0.5),
        ];
        let (mesh, report) = repair(positions, vec![[0, 1, 2], [0, 2, 3], [0, 4, 3]]).unwrap();
        assert_eq!(
            (
                report.flipped_faces,
                report.boundary_edges,
                report.boundary_loops
            ),
            (2, 5, 1)
        );
        assert!(mesh.faces().all(|(f, _)| mesh.normal(f).z == -1.0));
    }

    #[test]
    fn two_inverted_cubes_that_share_an_edge_are_both_turned() {
        // the second cube is the first one moved by (1, 1, 0): they share the edge x = y = 1
        let (mut positions, mut faces) = cube(0.0);
        let (mut moved, more) = cube(1.0);
        moved.iter_mut().for_each(|p| p.y += 1.0);
        positions.extend(moved);
        faces.extend(more.iter().map(|f| f.map(|v| v + 8)));
        faces.iter_mut().for_each(|f| f.swap(0, 1));
        let (mesh, report) = repair(positions, faces).unwrap();
        assert_eq!(
            (
                report.non_manifold_edges,
                report.components,
                report.flipped_faces
            ),
            (1, 2, 24)
        );
        assert_eq!((report.welded_vertices, mesh.vertex_count()), (2, 14));
        assert!((volume(&mesh) - 2.0).abs() < 1e-12);
    }

    #[test]
    fn useless_faces_and_vertices_are_left_out_and_counted() {
        let (mut positions, mut faces) = cube(0.0);
        positions.push(Point3::new(0.5, 0.0, 0.0)); // 8: on the edge 0–1, used only by a face without area
        positions.push(Point3::new(f64::NAN, 0.0, 0.0)); // 9
        positions.push(Point3::new(1e300, 0.0, 0.0)); // 10: finite, but no area can be worked out
        positions.push(Point3::new(-0.0, 0.0, 0.0)); // 11: vertex 0 again
        faces.extend([
            [0, 8, 1],
            [0, 0, 1],
            [0, 11, 2],
            [1, 2, 9],
            [1, 2, 10],
            [3, 0, 2],
            [2, 3, 0],
        ]);
        let (mesh, report) = repair(positions, faces).unwrap();
        let wanted = RepairReport {
            welded_vertices: 1,
            dropped_not_finite: 2,
            dropped_zero_area: 3,
            dropped_duplicates: 2,
            unused_vertices: 3,
            components: 1,
            ..Default::default()
        };
        assert_eq!(report, wanted);
        assert_eq!((mesh.vertex_count(), mesh.face_count()), (8, 12));
    }

    #[test]
    fn thin_faces_far_from_the_origin_stay_while_they_differ_from_a_line() {
        // at 10⁶ m a coordinate has a rounding of 1.2e-10 m: a height of 1e-6 m is real, one of
        // 2e-10 m is not
        for (height, kept) in [(1e-6, 1), (2e-10, 0)] {
            let p = |x: f64, y: f64| Point3::new(1e6 + x, 1e6 + y, 1e6);
            let outcome = repair(
                vec![p(0.0, 0.0), p(1e-3, 0.0), p(5e-4, height)],
                vec![[0, 1, 2]],
            );
            assert_eq!(
                outcome.map_or(0, |(mesh, _)| mesh.face_count()),
                kept,
                "height {height} m"
            );
        }
    }

    #[test]
    fn what_cannot_be_repaired_is_refused() {
        let (positions, _) = cube(0.0);
        let refusal = |faces| repair(positions.clone(), faces).map(|_| ()).unwrap_err();
        assert_eq!(refusal(vec![]), MeshError::Empty);
        assert_eq!(refusal(vec![[0, 1, 1]]), MeshError::Empty);
        assert_eq!(
            refusal(vec![[0, 1, 2], [0, 8, 1]]),
            MeshError::VertexOutOfRange {
                face: 1,
                vertex: 8,
                vertices: 8
            }
        );
    }

    proptest! {
        /// Any triangles over the 27 points of a small lattice: many shared, folded, flat and
        /// repeated ones.
        #[test]
        fn tangles_are_counted_right_and_a_second_repair_finds_nothing(
            points in prop::collection::vec((0..3u8, 0..3u8, 0..3u8), 3..40),
            picks in prop::collection::vec(any::<[prop::sample::Index; 3]>(), 1..60),
        ) {
            let positions: Vec<_> = points.iter().map(|&(x, y, z)| Point3::new(x.into(), y.into(), z.into())).collect();
            let faces = picks.iter().map(|pick| pick.map(|i| i.index(points.len()) as u32)).collect();
            let Ok((mesh, report)) = repair(positions, faces) else { return Ok(()) };
            let corners: Vec<_> = mesh.faces().map(|(_, c)| c.map(|v| v.0)).collect();
            let mut edges = BTreeMap::<[u32; 2], usize>::new();
            for [a, b, c] in &corners {
                for (p, q) in [(a, b), (b, c), (c, a)] {
                    *edges.entry([*p.min(q), *p.max(q)]).or_default() += 1;
                }
            }
            prop_assert_eq!(report.boundary_edges, edges.values().filter(|&&n| n == 1).count());
            prop_assert_eq!(report.non_manifold_edges, edges.values().filter(|&&n| n > 2).count());
            let (again, second) = repair(mesh.positions().to_vec(), corners.clone()).unwrap();
            prop_assert_eq!(again.positions(), mesh.positions());
            prop_assert!(again.faces().map(|(_, c)| c.map(|v| v.0)).eq(corners));
            let RepairReport { boundary_edges, boundary_loops, non_manifold_edges, components, .. } = report;
            let clean = RepairReport { boundary_edges, boundary_loops, non_manifold_edges, components, ..Default::default() };
            prop_assert_eq!(second, clean);
        }
    }
}
