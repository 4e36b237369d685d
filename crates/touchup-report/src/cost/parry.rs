//! An alternative index for users: the tree of boxes of `parry3d`, in double precision, updated
//! leaf by leaf.

use std::time::{Duration, Instant};

use nalgebra::{Point3, Vector3};
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy};
use parry3d_f64::query::PointProjection;

use super::minimal::{REACH, gain};
use super::stages::touching;
use touchup_geometry::mesh::{FaceId, TriMesh, VertexId, triangle};
use touchup_method::stylus::Sample;
use touchup_sim::wavy::{FORCE, RADIUS};

/// A mesh that follows the ball of [`touchup_sim::wavy`] within one radius of the tip, with the
/// index of a peer.
pub struct ParryLoop {
    /// current mesh
    pub mesh: TriMesh,
    tree: Bvh,
    region: MovedRegion,
}

/// Region that a touch moves.
#[derive(Default)]
struct MovedRegion {
    vertices: Vec<VertexId>,
    faces: Vec<FaceId>,
    /// by vertex and by face: number of the last touch that included it
    taken: [Vec<u32>; 2],
    touches: u32,
}

impl MovedRegion {
    fn of(mesh: &TriMesh) -> Self {
        Self {
            taken: [vec![0; mesh.vertex_slots()], vec![0; mesh.face_slots()]],
            ..Self::default()
        }
    }

    /// Finds the corners of a face, all vertices connected to them within one radius of the tip,
    /// and the faces around.
    fn find(&mut self, mesh: &TriMesh, (face, touched): (FaceId, Point3<f64>)) {
        let Self {
            vertices,
            faces,
            taken: [by_vertex, by_face],
            touches,
        } = self;
        *touches += 1;
        vertices.clear();
        faces.clear();
        let mut take = |vertex: VertexId, vertices: &mut Vec<VertexId>| {
            let last = &mut by_vertex[vertex.0 as usize];
            if *last != *touches {
                *last = *touches;
                vertices.push(vertex);
            }
        };
        mesh.corners(face)
            .into_iter()
            .for_each(|vertex| take(vertex, vertices));
        let mut next = 0;
        while let Some(&vertex) = vertices.get(next) {
            next += 1;
            for &face in mesh.star(vertex) {
                let last = &mut by_face[face.0 as usize];
                if *last == *touches {
                    continue;
                }
                *last = *touches;
                faces.push(face);
                for corner in mesh.corners(face) {
                    if (mesh.position(corner) - touched).norm_squared() <= RADIUS * RADIUS {
                        take(corner, vertices);
                    }
                }
            }
        }
    }
}

fn vector(p: &Point3<f64>) -> Vector {
    Vector::new(p.x, p.y, p.z)
}

fn aabb(mesh: &TriMesh, face: FaceId) -> Aabb {
    let [a, b, c] = mesh.triangle(face).map(|p| vector(&p));
    Aabb::new(a.min(b).min(c), a.max(b).max(c))
}

impl ParryLoop {
    /// Builds the tree.
    pub fn new(mesh: TriMesh) -> Self {
        let leaves = mesh
            .faces()
            .map(|(face, _)| (face.0 as usize, aabb(&mesh, face)));
        let tree = Bvh::from_iter(BvhBuildStrategy::Binned, leaves);
        Self {
            tree,
            region: MovedRegion::of(&mesh),
            mesh,
        }
    }

    /// The closest face, and its closest point.
    pub fn closest(&self, p: &Point3<f64>) -> Option<(FaceId, Point3<f64>)> {
        let Self { tree, mesh, .. } = self;
        let project = |face: u32, _| {
            let (point, _) = triangle::closest_point(p, &mesh.triangle(FaceId(face)));
            Some(PointProjection::new(false, vector(&point)))
        };
        let (face, (_, PointProjection { point, .. })) =
            tree.project_point(vector(p), REACH, project)?;
        Some((FaceId(face), Point3::new(point.x, point.y, point.z)))
    }

    /// Takes one sample; returns the time of closest face and tree, without the search for the
    /// vertices and their move.
    pub fn push(&mut self, sample: &Sample) -> Option<Duration> {
        let p = touching(sample);
        let normal: Vector3<f64> = sample.wrench.force / FORCE;
        let started = Instant::now();
        let hit = self.closest(&p)?;
        let query = started.elapsed();
        let Self { mesh, tree, region } = self;
        region.find(mesh, hit);
        let step = normal * (gain() * (p - hit.1).dot(&normal));
        region
            .vertices
            .iter()
            .for_each(|&vertex| mesh.set_position(vertex, mesh.position(vertex) + step));
        let started = Instant::now();
        for &face in &region.faces {
            // grows the boxes above until they contain it
            tree.insert(aabb(mesh, face), face.0);
        }
        Some(query + started.elapsed())
    }

    /// Vertices that the last sample moved.
    pub fn moved_vertices(&self) -> &[VertexId] {
        &self.region.vertices
    }
}
