//! First intersection of a straight line with the mesh.

use nalgebra::{Point3, Vector3};

use touchup_geometry::mesh::{BoxQuery, FaceId, FaceTree, TriMesh};

/// Maximum number of pieces of a line: a void may be narrower than any number of pieces can be.
const MOST_PIECES: f64 = 1000.0;

/// Rounding of barycentric coordinates: a line through an edge slips through between its triangles
/// in no frame.
const ON_EDGE: f64 = 1e-9;

/// Casts rays through one mesh.
pub(in crate::features) struct Rays<'a> {
    mesh: &'a TriMesh,
    tree: &'a FaceTree,
    /// length of the pieces of a line, m: a box around a long one holds too many faces
    piece: f64,
    /// numbers of the faces in the whole mesh, if this is a part
    names: Option<&'a [u32]>,
    query: BoxQuery,
}

/// The first face on a line.
#[derive(Clone, Copy, Debug)]
pub(in crate::features) struct RayHit {
    /// from the start, m
    pub distance: f64,
    pub face: FaceId,
}

impl<'a> Rays<'a> {
    pub(crate) fn new(
        mesh: &'a TriMesh,
        tree: &'a FaceTree,
        piece: f64,
        names: Option<&'a [u32]>,
    ) -> Self {
        Self {
            mesh,
            tree,
            piece,
            names,
            query: BoxQuery::default(),
        }
    }

    /// The first face between `from` and the point `reach` (m) away along the unit vector
    /// `direction`.
    pub(crate) fn first(
        &mut self,
        from: &Point3<f64>,
        direction: &Vector3<f64>,
        reach: f64,
    ) -> Option<RayHit> {
        let count = (reach / self.piece).ceil().clamp(1.0, MOST_PIECES);
        let piece = reach / count;
        for i in 0..count as usize {
            let (a, b) = (
                from + direction * (piece * i as f64),
                from + direction * (piece * (i + 1) as f64),
            );
            self.tree
                .faces_in_box(&a.inf(&b), &a.sup(&b), &mut self.query);
            let found = self.query.faces.iter().filter_map(|&face| {
                let distance = crossing(&self.mesh.triangle(face), from, direction)?;
                (distance >= 0.0 && distance <= reach).then_some(RayHit { distance, face })
            });
            // a later box may hold the crossing of a face from this box, behind a nearer face that
            // is not here
            let nearest =
                found.min_by(|a, b| a.distance.total_cmp(&b.distance).then(a.face.cmp(&b.face)));
            if let Some(nearest) =
                nearest.filter(|nearest| nearest.distance <= piece * (i + 1) as f64)
            {
                let face = self
                    .names
                    .map_or(nearest.face, |names| FaceId(names[nearest.face.0 as usize]));
                return Some(RayHit { face, ..nearest });
            }
        }
        None
    }

    /// Free length of a line, at most `reach`, m.
    pub(crate) fn free(&mut self, from: &Point3<f64>, direction: &Vector3<f64>, reach: f64) -> f64 {
        self.first(from, direction, reach)
            .map_or(reach, |crossing| crossing.distance)
    }
}

/// Distance to the crossing of a line with a triangle, edges included.
fn crossing(
    [a, b, c]: &[Point3<f64>; 3],
    from: &Point3<f64>,
    direction: &Vector3<f64>,
) -> Option<f64> {
    let (ab, ac) = (b - a, c - a);
    let across = direction.cross(&ac);
    let volume = ab.dot(&across);
    let start = from - a;
    let v = start.dot(&across) / volume;
    let along = start.cross(&ab);
    let w = direction.dot(&along) / volume;
    // a triangle seen edge-on has no volume: all of this is NaN or infinite, and outside
    (v >= -ON_EDGE && w >= -ON_EDGE && v + w <= 1.0 + ON_EDGE).then(|| ac.dot(&along) / volume)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_of_two_floors_is_met() {
        let floor = |z: f64| [[0.0, 0.0, z], [4.0, 0.0, z], [0.0, 4.0, z]].map(Point3::from);
        let positions = [floor(1.0), floor(2.5)].concat();
        let mesh = TriMesh::new(positions, vec![[0, 1, 2], [3, 4, 5]]).unwrap();
        let tree = FaceTree::new(&mesh);
        let mut rays = Rays::new(&mesh, &tree, 0.7, None);
        let met = rays
            .first(&Point3::new(1.0, 1.0, 5.0), &-Vector3::z(), 10.0)
            .unwrap();
        assert_eq!((met.face, met.distance), (FaceId(1), 2.5));
        assert_eq!(
            rays.free(&Point3::new(1.0, 1.0, 5.0), &-Vector3::z(), 2.0),
            2.0,
            "too short"
        );
        assert_eq!(
            rays.free(&Point3::new(3.0, 3.0, 5.0), &-Vector3::z(), 9.0),
            9.0,
            "beside both"
        );
        let mut rays = Rays::new(&mesh, &tree, 1e-300, None);
        assert_eq!(
            rays.free(&Point3::new(1.0, 1.0, 5.0), &-Vector3::z(), 10.0),
            2.5,
            "however small the pieces are"
        );
    }
}
