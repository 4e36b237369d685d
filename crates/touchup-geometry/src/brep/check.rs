//! Sound boundaries.

use std::collections::BTreeMap;

use nalgebra::Point3;

use super::error::BrepError;
use super::parts::{BrepFace, BrepParts, FaceLoop, OrientedEdge};
use super::placement::is_finite;
use super::turning::encloses;
use crate::numeric::DisjointSets;

/// Faces that hang together by edges.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BrepShell {
    /// in rising order
    pub faces: Vec<usize>,
    /// whether its faces use each edge twice, in opposite directions
    pub is_closed: bool,
}

/// A sound boundary: all numbers finite, all references valid, every vertex on its edges, every
/// edge on the surfaces of its faces, every loop closed with its face on the left, every edge used
/// once, or twice in opposite directions.
#[derive(Clone, Debug, PartialEq)]
pub struct Brep {
    parts: BrepParts,
    shells: Vec<BrepShell>,
    tolerance: f64,
}

impl Brep {
    /// Checks the parts, and finds their shells.
    ///
    /// - `tolerance`: largest distance of a vertex off its curve, and of an edge off its surfaces,
    ///   m.
    ///
    /// # Errors
    /// [`BrepError`]: the first fault.
    pub fn new(parts: BrepParts, tolerance: f64) -> Result<Self, BrepError> {
        if parts.faces.is_empty() {
            return Err(BrepError::Empty);
        }
        let check = Check {
            parts: &parts,
            tolerance,
        };
        let is_tolerance = tolerance > 0.0 && tolerance.is_finite();
        is_number(is_tolerance, || "tolerance".to_owned())?;
        for (at, vertex) in parts.vertices.iter().enumerate() {
            is_number(is_finite(vertex), || format!("vertex {at}"))?;
        }
        (0..parts.edges.len()).try_for_each(|edge| check.edge(edge))?;
        let faces = parts.faces.iter().enumerate();
        faces
            .clone()
            .try_for_each(|(at, face)| check.face(at, face))?;
        let uses = check.uses()?;
        let shells = shells(parts.faces.len(), &uses);
        Ok(Self {
            parts,
            shells,
            tolerance,
        })
    }

    /// Its elements.
    pub fn parts(&self) -> &BrepParts {
        &self.parts
    }

    /// In the order of their first faces.
    pub fn shells(&self) -> &[BrepShell] {
        &self.shells
    }

    /// Largest distance between elements that meet, m.
    pub fn tolerance(&self) -> f64 {
        self.tolerance
    }
}

fn is_number(is: bool, place: impl FnOnce() -> String) -> Result<(), BrepError> {
    if is {
        Ok(())
    } else {
        Err(BrepError::BadNumber { place: place() })
    }
}

struct Check<'a> {
    parts: &'a BrepParts,
    tolerance: f64,
}

impl Check<'_> {
    fn edge(&self, at: usize) -> Result<(), BrepError> {
        let edge = &self.parts.edges[at];
        is_number(edge.curve.is_sound(), || format!("edge {at}"))?;
        if edge.start == edge.end && !edge.curve.may_close() {
            return Err(BrepError::EmptyLine { edge: at });
        }
        for vertex in [edge.start, edge.end] {
            let point = self.vertex(vertex, || format!("edge {at}"))?;
            let off = edge.curve.distance(&point);
            if off.is_nan() || off > self.tolerance {
                return Err(BrepError::VertexOffCurve {
                    edge: at,
                    vertex,
                    off,
                    tolerance: self.tolerance,
                });
            }
        }
        Ok(())
    }

    fn vertex(&self, at: usize, place: impl FnOnce() -> String) -> Result<Point3<f64>, BrepError> {
        let missing = || BrepError::Missing {
            place: place(),
            used: format!("vertex {at}"),
        };
        self.parts.vertices.get(at).copied().ok_or_else(missing)
    }

    fn face(&self, at: usize, face: &BrepFace) -> Result<(), BrepError> {
        let place = || format!("face {at} ({})", face.name);
        let is_uncertainty = |value: f64| value.is_finite() && value >= 0.0;
        let are_numbers = face.surface.is_sound()
            && face
                .uncertainties
                .iter()
                .all(|one| is_uncertainty(one.value));
        is_number(are_numbers, place)?;
        let mut bounds = Vec::new();
        for (number, face_loop) in face.loops.iter().enumerate() {
            match face_loop {
                FaceLoop::Vertex(vertex) => {
                    let point = self.vertex(*vertex, place)?;
                    self.is_on_surface((at, face), &[point], || format!("vertex {vertex}"))?;
                }
                FaceLoop::Edges(edges) => bounds.push(self.bound((at, face), number, edges)?),
            }
        }
        if face.loops.is_empty() || !encloses(&face.surface, &bounds) {
            return Err(BrepError::Unbounded {
                face: at,
                name: face.name.clone(),
            });
        }
        Ok(())
    }

    /// Points along one loop, seen from the outward side of the surface.
    fn bound(
        &self,
        (at, face): (usize, &BrepFace),
        number: usize,
        edges: &[OrientedEdge],
    ) -> Result<Vec<Point3<f64>>, BrepError> {
        let (mut all, mut joints) = (Vec::new(), Vec::new());
        for one in edges {
            let missing = || BrepError::Missing {
                place: format!("face {at} ({})", face.name),
                used: format!("edge {}", one.edge),
            };
            self.parts.edges.get(one.edge).ok_or_else(missing)?;
            let points = self.parts.points(one);
            self.is_on_surface((at, face), &points, || format!("edge {}", one.edge))?;
            joints.push(self.parts.ends(one));
            all.extend(points);
        }
        let before = joints.iter().cycle().skip(joints.len().saturating_sub(1));
        let mut joined = edges.iter().zip(before.zip(&joints));
        if let Some((edge, _)) = joined.find(|(_, (before, after))| before[1] != after[0]) {
            return Err(BrepError::OpenLoop {
                face: at,
                name: face.name.clone(),
                at: number,
                edge: edge.edge,
            });
        }
        if !face.is_outward {
            all.reverse();
        }
        Ok(all)
    }

    fn is_on_surface(
        &self,
        (at, face): (usize, &BrepFace),
        points: &[Point3<f64>],
        bound: impl FnOnce() -> String,
    ) -> Result<(), BrepError> {
        let distances = points.iter().map(|p| face.surface.signed_distance(p).abs());
        if distances.clone().all(|off| off <= self.tolerance) {
            return Ok(());
        }
        let off = distances.fold(0.0, f64::max);
        Err(BrepError::BoundOffSurface {
            face: at,
            name: face.name.clone(),
            bound: bound(),
            off,
            tolerance: self.tolerance,
        })
    }

    /// Of each edge its faces, each with the direction.
    fn uses(&self) -> Result<BTreeMap<usize, Vec<(usize, bool)>>, BrepError> {
        let edges = 0..self.parts.edges.len();
        let mut uses: BTreeMap<_, Vec<_>> = edges.map(|edge| (edge, Vec::new())).collect();
        for (at, face) in self.parts.faces.iter().enumerate() {
            for one in face.edges() {
                uses.entry(one.edge).or_default().push((at, one.is_forward));
            }
        }
        for (&edge, of_edge) in &uses {
            match of_edge[..] {
                [_] => {}
                [(_, one), (_, other)] if one != other => {}
                [_, _] => return Err(BrepError::SameDirection { edge }),
                _ => {
                    let count = of_edge.len();
                    return Err(BrepError::WrongUses { edge, count });
                }
            }
        }
        Ok(uses)
    }
}

fn shells(faces: usize, uses: &BTreeMap<usize, Vec<(usize, bool)>>) -> Vec<BrepShell> {
    let mut sets = DisjointSets::of(faces);
    for of_edge in uses.values() {
        if let [(one, _), (other, _)] = of_edge[..] {
            sets.join(one as u32, other as u32);
        }
    }
    let mut shells: BTreeMap<u32, BrepShell> = BTreeMap::new();
    for face in 0..faces {
        let shell = shells.entry(sets.root(face as u32));
        let empty = || BrepShell {
            faces: Vec::new(),
            is_closed: true,
        };
        shell.or_insert_with(empty).faces.push(face);
    }
    for of_edge in uses.values() {
        if let [(face, _)] = of_edge[..]
            && let Some(shell) = shells.get_mut(&sets.root(face as u32))
        {
            shell.is_closed = false;
        }
    }
    shells.into_values().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brep::{AnalyticSurface, AxisPlacement, SpaceCurve, SurfaceShape};
    use nalgebra::Vector3;

    const TOLERANCE: f64 = 1e-9;

    type Change<'a> = &'a dyn Fn(&mut BrepParts);

    /// A box of 1 by 2 by 3 cm; faces without the first ones.
    fn cuboid(without: usize) -> BrepParts {
        let mut parts = BrepParts::default();
        for corner in 0..8 {
            let at = |bit: usize, size: f64| if corner >> bit & 1 == 1 { size } else { 0.0 };
            parts.vertex(Point3::new(at(0, 0.01), at(1, 0.02), at(2, 0.03)));
        }
        let sides = [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ];
        for corners in &sides[without..] {
            let [a, b, c, _] = corners.map(|corner| parts.vertices[corner]);
            let surface = AnalyticSurface::along(a, (b - a).cross(&(c - b)), SurfaceShape::Plane);
            let outer = parts.polygon(corners);
            let face = BrepFace::new("side", surface, true, vec![outer]);
            parts.faces.push(face);
        }
        parts
    }

    /// A tube of cylinder and two circles.
    fn tube() -> BrepParts {
        let mut parts = BrepParts::default();
        let mut ring = |z: f64| {
            let placement = AxisPlacement::along(Point3::new(0.0, 0.0, z), Vector3::z());
            parts.ring(&SpaceCurve::Circle {
                placement,
                radius: 0.01,
            })
        };
        let (bottom, top) = (ring(0.0), ring(0.02));
        let shape = SurfaceShape::Cylinder { radius: 0.01 };
        let surface = AnalyticSurface::along(Point3::origin(), Vector3::z(), shape);
        let loops = [bottom, top.reversed()].map(|one| FaceLoop::Edges(vec![one]));
        let face = BrepFace::new("tube", surface, true, loops.into());
        parts.faces.push(face);
        parts
    }

    fn closed(parts: &BrepParts) -> Vec<(usize, bool)> {
        let brep = Brep::new(parts.clone(), TOLERANCE).unwrap();
        let shells = brep.shells().iter();
        shells
            .map(|shell| (shell.faces.len(), shell.is_closed))
            .collect()
    }

    fn said(parts: BrepParts) -> String {
        Brep::new(parts, TOLERANCE).unwrap_err().to_string()
    }

    /// Euler: 8 − 12 + 6 = 2.
    #[test]
    fn a_shell_is_closed_if_its_faces_use_each_edge_twice() {
        let parts = cuboid(0);
        assert_eq!((parts.vertices.len(), parts.edges.len()), (8, 12));
        assert_eq!(closed(&parts), [(6, true)]);
        assert_eq!(closed(&cuboid(1)), [(5, false)]);
        // without floor and lid, then without a wall, then two walls that do not touch
        assert_eq!(closed(&cuboid(2)), [(4, false)]);
        let apart = cuboid(4);
        assert_eq!(closed(&apart), [(1, false), (1, false)]);
        let rings = tube();
        assert_eq!(closed(&rings), [(1, false)]);
    }

    #[test]
    fn each_fault_is_refused_with_its_place() {
        let changed = |change: Change| {
            let mut parts = cuboid(0);
            change(&mut parts);
            said(parts)
        };
        let reversed = |parts: &mut BrepParts, face: usize| {
            if let FaceLoop::Edges(edges) = &mut parts.faces[face].loops[0] {
                edges.reverse();
                edges.iter_mut().for_each(|one| *one = one.reversed());
            }
        };
        let cases: [(Change, &str); 10] = [
            (&|p| p.faces.clear(), "no faces"),
            (
                &|p| p.vertices[3].x = f64::NAN,
                "vertex 3: a number is not finite",
            ),
            (&|p| p.edges[2].start = 9, "edge 2 uses vertex 9"),
            (&|p| p.vertices[7].x += 1e-6, "vertex 7 is "),
            (
                &|p| p.faces[1].surface.placement.origin.z += 1e-6,
                "face 1 (side): its edge",
            ),
            (
                &|p| p.faces[0].loops = vec![FaceLoop::Edges(vec![OrientedEdge::forward(0)])],
                "face 0 (side): loop 0 does not close at edge 0",
            ),
            (
                &|p| reversed(p, 4),
                "face 4 (side): its loops enclose no part",
            ),
            (
                &|p| {
                    reversed(p, 4);
                    p.faces[4].is_outward = false;
                },
                "both of its faces use it in the same direction",
            ),
            (&|p| p.faces.push(p.faces[0].clone()), "bounds 3 faces"),
            (
                &|p| {
                    let line = p.edges[0].curve.clone();
                    p.edge(&line, 0, 0);
                },
                "edge 12: a line needs two different vertices",
            ),
        ];
        for (change, wanted) in cases {
            let found = changed(change);
            assert!(found.contains(wanted), "{found}");
        }
    }

    #[test]
    fn a_tube_needs_both_circles_in_opposite_directions() {
        let mut half = tube();
        half.faces[0].loops.pop();
        half.edges.pop();
        assert!(said(half).contains("enclose no part"));
        let mut inside_out = tube();
        inside_out.faces[0].is_outward = false;
        assert!(said(inside_out).contains("enclose no part"));
        let mut open = tube();
        open.faces[0].loops = vec![FaceLoop::Edges(Vec::new())];
        assert!(said(open).contains("enclose no part"));
    }
}
