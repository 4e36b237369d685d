//! Colours and texture coordinates of a mesh, and their transfer to another mesh.

use nalgebra::{Point3, Vector2};

use super::workers::map_by;
use super::{FaceHit, FaceId, FaceTree, TriMesh, VertexId, Workers};

/// Texture of the faces of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Texture {
    /// texture coordinates (u, v) of the corners of each face slot, in the order of
    /// [`TriMesh::corners`]
    pub corners: Vec<[[f32; 2]; 3]>,
    /// index into `images` for each face slot
    pub shown: Vec<u32>,
    /// files of the images; empty if unknown
    pub images: Vec<std::path::PathBuf>,
}

/// Vertex colours: red, green, blue, and an optional opacity.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum VertexColours {
    /// by vertex id
    Rgb(Vec<[u8; 3]>),
    /// by vertex id
    Rgba(Vec<[u8; 4]>),
}

/// Colours and texture of a mesh.
#[derive(Clone, Debug)]
pub struct Appearance {
    mesh: TriMesh,
    tree: FaceTree,
    colours: Option<VertexColours>,
    texture: Option<Texture>,
}

/// Largest difference between the texture coordinates of a corner on another face and those
/// extrapolated from the face of the triangle's middle, as a share of their distance from the
/// middle; a larger difference marks a seam.
const ON_ONE_CHART: f32 = 0.5;

impl Appearance {
    /// - `mesh`: without removed faces; coordinates m.
    /// - `colours`, `texture`: one entry for each vertex, and for each face.
    pub fn new(mesh: TriMesh, colours: Option<VertexColours>, texture: Option<Texture>) -> Self {
        let tree = FaceTree::new(&mesh);
        Self {
            mesh,
            tree,
            colours,
            texture,
        }
    }

    /// Colours at `places` (m, in O): the colours of the nearest vertex of the nearest face.
    pub fn colours_at(
        &self,
        places: &[Point3<f64>],
        workers: &dyn Workers,
    ) -> Option<VertexColours> {
        let nearest = |at: usize| {
            self.hit(&places[at])
                .map_or(0, |hit| nearest_corner(&self.mesh, &hit, &places[at]))
        };
        Some(match self.colours.as_ref()? {
            VertexColours::Rgb(of) => {
                VertexColours::Rgb(map_by(workers, places.len(), |at| of[nearest(at)]))
            }
            VertexColours::Rgba(of) => {
                VertexColours::Rgba(map_by(workers, places.len(), |at| of[nearest(at)]))
            }
        })
    }

    /// Texture of `mesh`: each face takes image and texture coordinates from the face nearest to
    /// its middle, except at corners on other faces without a seam in between.
    ///
    /// - `places`: position of each vertex on this mesh, m in O.
    pub fn texture_on(
        &self,
        mesh: &TriMesh,
        places: &[Point3<f64>],
        workers: &dyn Workers,
    ) -> Option<Texture> {
        let texture = self.texture.as_ref()?;
        let of_face = |slot: usize| {
            let face = FaceId(slot as u32);
            if !mesh.has_face(face) {
                return ([[0.0; 2]; 3], 0);
            }
            self.corners_at(
                texture,
                mesh.corners(face).map(|v: VertexId| places[v.0 as usize]),
            )
        };
        let (corners, shown) = map_by(workers, mesh.face_slots(), of_face)
            .into_iter()
            .unzip();
        Some(Texture {
            corners,
            shown,
            images: texture.images.clone(),
        })
    }

    /// Texture coordinates of a triangle, and the index of its image.
    fn corners_at(&self, texture: &Texture, triangle: [Point3<f64>; 3]) -> ([[f32; 2]; 3], u32) {
        let [a, b, c] = &triangle;
        let middle = Point3::from((a.coords + b.coords + c.coords) / 3.0);
        let Some(hit) = self.hit(&middle) else {
            return ([[0.0; 2]; 3], 0);
        };
        let shown = texture.shown[hit.face.0 as usize];
        let centre = at_point(&self.mesh, texture, hit.face, &hit.point);
        let corners = triangle.map(|corner| {
            let own = self
                .mesh
                .triangle(hit.face)
                .iter()
                .position(|p| *p == corner);
            if let Some(own) = own {
                return texture.corners[hit.face.0 as usize][own];
            }
            let onward = at_point(&self.mesh, texture, hit.face, &corner);
            let there = self
                .hit(&corner)
                .filter(|there| texture.shown[there.face.0 as usize] == shown);
            let found = there.map(|there| at_point(&self.mesh, texture, there.face, &there.point));
            let is_beside = |found: &Vector2<f32>| {
                (found - onward).norm() <= ON_ONE_CHART * (onward - centre).norm()
            };
            found.filter(is_beside).unwrap_or(onward).into()
        });
        (corners, shown)
    }

    fn hit(&self, place: &Point3<f64>) -> Option<FaceHit> {
        self.tree.closest(&self.mesh, place, f64::INFINITY)
    }
}

/// The corner of the hit face nearest to `place`.
fn nearest_corner(mesh: &TriMesh, hit: &FaceHit, place: &Point3<f64>) -> usize {
    let off = |v: &VertexId| (mesh.position(*v) - place).norm_squared();
    let nearest = mesh
        .corners(hit.face)
        .into_iter()
        .min_by(|v, w| off(v).total_cmp(&off(w)));
    nearest.map_or(0, |v| v.0 as usize)
}

/// Texture coordinates in the plane of a face, inside or outside of it: u = Σ λᵢ uᵢ.
fn at_point(mesh: &TriMesh, texture: &Texture, face: FaceId, point: &Point3<f64>) -> Vector2<f32> {
    let [a, b, c] = mesh.triangle(face);
    let normal = (b - a).cross(&(c - a));
    let of = |p: &Point3<f64>, q: &Point3<f64>| {
        (q - p).cross(&(point - p)).dot(&normal) / normal.norm_squared()
    };
    let shares = [of(&b, &c), of(&c, &a), of(&a, &b)];
    let corners = texture.corners[face.0 as usize];
    corners
        .iter()
        .zip(shares)
        .map(|(corner, share)| Vector2::from(*corner) * share as f32)
        .sum()
}

#[cfg(test)]
mod tests {
    use super::super::SerialWorkers;
    use super::*;

    /// A roof over x = 0 … 4 with its ridge at x = 2, two triangles a side; the second side uses
    /// another corner of the image.
    fn roof() -> (Vec<Point3<f64>>, Vec<[u32; 3]>, Texture) {
        let heights = [(0.0, 0.0), (2.0, 1.0), (4.0, 0.0)];
        let positions = heights
            .iter()
            .flat_map(|&(x, z)| [0.0, 2.0].map(|y| Point3::new(x, y, z)))
            .collect();
        let faces: Vec<[u32; 3]> = vec![[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5]];
        let uv = |v: u32, side: usize| {
            [
                (v / 2) as f32 / 8.0 + 0.5 * side as f32,
                (v % 2) as f32 / 8.0,
            ]
        };
        let corners = faces
            .iter()
            .enumerate()
            .map(|(at, face)| face.map(|v| uv(v, at / 2)))
            .collect();
        (
            positions,
            faces,
            Texture {
                corners,
                shown: vec![7, 7, 9, 9],
                images: Vec::new(),
            },
        )
    }

    fn appearance() -> Appearance {
        let (positions, faces, texture) = roof();
        let colours = VertexColours::Rgb((0..6).map(|v| [v, 10 * v, 100]).collect());
        Appearance::new(
            TriMesh::new(positions, faces).unwrap(),
            Some(colours),
            Some(texture),
        )
    }

    #[test]
    fn a_new_vertex_has_the_colour_of_the_nearest_one() {
        let places = [[0.1, 0.2, 0.5], [2.0, 1.9, 3.0], [4.0, 2.0, 0.0]].map(Point3::from);
        let colours = appearance().colours_at(&places, &SerialWorkers).unwrap();
        assert_eq!(
            colours,
            VertexColours::Rgb(vec![[0, 0, 100], [3, 30, 100], [5, 50, 100]])
        );
    }

    #[test]
    fn what_was_not_changed_keeps_its_texture_bit_for_bit() {
        let (positions, mut faces, texture) = roof();
        // corners in another order
        faces[1].rotate_left(1);
        let mesh = TriMesh::new(positions.clone(), faces).unwrap();
        let mut expected = texture.clone();
        expected.corners[1].rotate_left(1);
        assert_eq!(
            appearance().texture_on(&mesh, &positions, &SerialWorkers),
            Some(expected)
        );
    }

    /// By hand: u = x / 16 on the first side, plus 1/2 on the second; v = y / 16.
    #[test]
    fn a_new_face_is_on_one_side_of_a_seam_and_reaches_over_faces_of_its_own() {
        let places = [
            [0.5, 0.5, 0.25],
            [1.8, 0.5, 0.9],
            [1.8, 1.9, 0.9],
            [2.3, 1.0, 0.85],
        ]
        .map(Point3::from);
        let mesh = TriMesh::new(places.to_vec(), vec![[0, 1, 2], [1, 3, 2]]).unwrap();
        let texture = appearance()
            .texture_on(&mesh, &places, &SerialWorkers)
            .unwrap();
        assert_eq!(texture.shown, [7, 7]);
        let by_hand =
            [[0.5, 0.5], [1.8, 0.5], [1.8, 1.9]].map(|place: [f32; 2]| place.map(|x| x / 16.0));
        for (found, expected) in texture.corners[0].iter().zip(by_hand) {
            assert!(
                (Vector2::from(*found) - Vector2::from(expected)).norm() < 1e-6,
                "{found:?} {expected:?}"
            );
        }
        // the second face has its middle on the first side and its second corner on the other: u
        // goes straight on there, 0.3 along x and 0.15 down on a slope of 1 in 2
        let along = 2.0 + (2.0 * 0.3 - 0.15) / 5.0 * 2.0;
        let [u, v] = texture.corners[1][1];
        assert!(
            (u - along / 16.0).abs() < 1e-6 && (v - 1.0 / 16.0).abs() < 1e-6,
            "{u} {v} {along}"
        );
    }

    #[test]
    fn a_mesh_that_has_no_colour_gives_none() {
        let (positions, faces, _) = roof();
        let plain = Appearance::new(
            TriMesh::new(positions.clone(), faces.clone()).unwrap(),
            None,
            None,
        );
        assert_eq!(plain.colours_at(&positions, &SerialWorkers), None);
        assert_eq!(
            plain.texture_on(
                &TriMesh::new(positions.clone(), faces).unwrap(),
                &positions,
                &SerialWorkers
            ),
            None
        );
    }
}
