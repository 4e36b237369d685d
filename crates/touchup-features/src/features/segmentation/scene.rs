//! A segmented mesh, with queries.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use super::bodies::{Bodies, Surroundings};
use super::facets::{Facets, NONE};
use super::grow::MeshScale;
use super::primitive::Primitive;
use super::segment::{Segment, Segmentation};
use crate::features::fit::Plane;
use touchup_geometry::mesh::{FaceTree, TriMesh, VertexId};
use touchup_geometry::numeric::tangent_basis;

/// A segmented mesh.
pub(in crate::features) struct SegmentedMesh<'a> {
    pub facets: Facets<'a>,
    pub tree: &'a FaceTree,
    pub bodies: Bodies,
    pub segmentation: Segmentation,
    /// rounding error of a drawing's corners, m; `None`: a measured mesh
    pub rounding: Option<f64>,
    /// diagonal of the box around all, m
    pub diagonal: f64,
    /// median length of an edge, m
    pub edge: f64,
}

/// Number of directions that examine the surroundings of an axis.
const AROUND: usize = 24;
/// Minimum area of a neighbour to name, in squared diagonals.
const LEAST_AREA: f64 = 1e-5;
/// Minimum area of a plane or a shaft to report, in squared diagonals.
const LARGE_AREA: f64 = 1e-3;
/// Minimum width of a segment to report untouched, in tolerances.
const SURE_WIDTH: f64 = 25.0;
/// A plane around an opening is square to the axis within 20°.
const SQUARE: f64 = 0.94;

/// The same surface with its faces in the order of their positions, from below, each from its first
/// corner on, and its vertices in the order of the faces. Results that depend on the order of faces
/// then depend on the surface alone.
pub(in crate::features) fn numbered_by_place(mesh: &TriMesh) -> TriMesh {
    let place = |vertex: u32| mesh.position(VertexId(vertex));
    let order = |&a: &u32, &b: &u32| {
        let (a, b) = (place(a), place(b));
        let axes = (0..3).rev().map(|axis| a[axis].total_cmp(&b[axis]));
        axes.fold(Ordering::Equal, Ordering::then)
    };
    let mut by_place: Vec<u32> = (0..mesh.vertex_slots() as u32)
        .filter(|&vertex| mesh.has_vertex(VertexId(vertex)))
        .collect();
    by_place.sort_unstable_by(order);
    let mut rank = vec![NONE; mesh.vertex_slots()];
    // vertices at one position have one rank
    for (number, alike) in by_place.chunk_by(|a, b| order(a, b).is_eq()).enumerate() {
        for &vertex in alike {
            rank[vertex as usize] = number as u32;
        }
    }
    let ranked = mesh.faces().map(|(_, corners)| {
        let mut corners = corners.map(|corner| (rank[corner.0 as usize], corner.0));
        let first = (0..3).min_by_key(|&at| corners[at].0).unwrap_or(0);
        corners.rotate_left(first);
        (
            corners.map(|(rank, _)| rank),
            corners.map(|(_, vertex)| vertex),
        )
    });
    let mut faces: Vec<_> = ranked.collect();
    faces.sort_unstable_by_key(|(ranks, _)| *ranks);
    let mut positions = Vec::with_capacity(by_place.len());
    let mut number = rank;
    number.fill(NONE);
    let mut renumbered = |vertex: u32| {
        let number = &mut number[vertex as usize];
        if *number == NONE {
            *number = positions.len() as u32;
            positions.push(place(vertex));
        }
        *number
    };
    let faces = faces
        .iter()
        .map(|(_, corners)| corners.map(&mut renumbered))
        .collect();
    TriMesh::new(positions, faces).expect("it was sound under its other numbers")
}

impl<'a> SegmentedMesh<'a> {
    pub(crate) fn of(mesh: &'a TriMesh, tree: &'a FaceTree) -> Self {
        let facets = Facets::of(mesh);
        let scale = MeshScale::of(&facets);
        let mut segmentation = Segmentation::of(&facets, scale);
        let exact = segmentation
            .segments
            .iter()
            .filter(|segment| segment.is_exact)
            .map(|segment| segment.tolerance);
        let rounding = exact.min_by(f64::total_cmp);
        segmentation.add_spheres(&facets, scale, rounding.is_some());
        segmentation.join_chords(&facets, scale.chords());
        let bodies = Bodies::of(&facets);
        Self {
            rounding,
            facets,
            bodies,
            tree,
            segmentation,
            diagonal: scale.diagonal,
            edge: scale.edge,
        }
    }

    pub(crate) fn segment(&self, number: usize) -> &Segment {
        &self.segmentation.segments[number]
    }

    /// Whether a segment is large enough to name beside others.
    pub(crate) fn is_strong(&self, number: usize) -> bool {
        self.segment(number).area > LEAST_AREA * self.diagonal * self.diagonal
    }

    /// Whether a surface of this area, m², is large enough to report.
    pub(crate) fn is_large(&self, area: f64) -> bool {
        area > LARGE_AREA * self.diagonal * self.diagonal
    }

    /// Whether a segment is wide enough beside its tolerance to report untouched.
    pub(crate) fn is_sure(&self, number: usize) -> bool {
        let segment = self.segment(number);
        segment.is_exact || segment.area > (SURE_WIDTH * segment.tolerance).powi(2)
    }

    /// The plane of a segment, if flat.
    pub(crate) fn plane(&self, number: usize) -> Option<&Plane> {
        self.segment(number).primitive.plane()
    }

    /// Numbers of the flat segments, each with a point and the normal.
    pub(crate) fn planes(&self) -> impl Iterator<Item = (usize, Point3<f64>, Vector3<f64>)> + '_ {
        let plane = |number| {
            self.plane(number)
                .map(|plane| (number, plane.point(), plane.normal()))
        };
        (0..self.segmentation.segments.len()).filter_map(plane)
    }

    /// Surroundings of a segment.
    pub(crate) fn around(&self, number: usize) -> Surroundings<'_> {
        self.bodies.around(
            self.segment(number).faces.first().copied(),
            self.facets.mesh,
            self.tree,
        )
    }

    /// The segment of the face closest to `p` within `reach`, m.
    pub(crate) fn segment_at(
        &self,
        around: &Surroundings,
        p: &Point3<f64>,
        reach: f64,
    ) -> Option<usize> {
        let number = self.segmentation.of_face[around.closest(p, reach)? as usize];
        (number != NONE).then_some(number as usize)
    }

    /// Distance from `from` along the unit vector `direction` to the exit from a segment's surface,
    /// m; `None`: no hit, a cone, or a sphere.
    pub(crate) fn exit(
        &self,
        number: usize,
        from: &Point3<f64>,
        direction: &Vector3<f64>,
    ) -> Option<f64> {
        match &self.segment(number).primitive {
            Primitive::Plane(plane) => plane.along(from, direction),
            Primitive::Cylinder(cylinder) => cylinder.exit(from, direction),
            Primitive::Cone(_) | Primitive::Sphere(_) => None,
        }
    }

    /// Whether a segment is a cylinder with the material inside.
    pub(crate) fn is_shaft(&self, number: usize) -> bool {
        matches!(self.segment(number).primitive, Primitive::Cylinder(cylinder) if !cylinder.concave)
    }

    /// The plane, or the cylinder with the material inside, under most of some rings, facing along
    /// `direction`, and its share of them.
    ///
    /// - as [`Self::plane_around`]
    pub(crate) fn land_around(
        &self,
        around: &Surroundings,
        middle: &Point3<f64>,
        direction: &Vector3<f64>,
        radii: &[f64],
        reach: f64,
    ) -> Option<(usize, f64)> {
        let is_land = |number: usize| {
            let primitive = &self.segment(number).primitive;
            let is_alike = primitive.distance_and_normal(middle).1.dot(direction) > SQUARE;
            is_alike && (primitive.plane().is_some() || self.is_shaft(number))
        };
        self.surface_around(around, middle, direction, radii, reach, is_land)
    }

    /// The plane under most of some rings, facing along `direction`, and its share of them.
    ///
    /// - `middle`, `radii`: of the rings, square to `direction`, m
    /// - `reach`: maximum distance of the plane, m
    pub(crate) fn plane_around(
        &self,
        around: &Surroundings,
        middle: &Point3<f64>,
        direction: &Vector3<f64>,
        radii: &[f64],
        reach: f64,
    ) -> Option<(usize, f64)> {
        let is_along = |number: usize| {
            self.plane(number)
                .is_some_and(|plane| plane.normal().dot(direction) >= SQUARE)
        };
        self.surface_around(around, middle, direction, radii, reach, is_along)
    }

    fn surface_around(
        &self,
        around: &Surroundings,
        middle: &Point3<f64>,
        direction: &Vector3<f64>,
        radii: &[f64],
        reach: f64,
        is_land: impl Fn(usize) -> bool,
    ) -> Option<(usize, f64)> {
        let [e, g] = tangent_basis(direction);
        let mut votes: BTreeMap<usize, usize> = BTreeMap::new();
        for (i, radius) in (0..AROUND).flat_map(|i| radii.iter().map(move |radius| (i, radius))) {
            let (sine, cosine) = (std::f64::consts::TAU * i as f64 / AROUND as f64).sin_cos();
            let p = middle + (e * cosine + g * sine) * *radius;
            let Some(number) = self.segment_at(around, &p, reach) else {
                continue;
            };
            if !is_land(number) {
                continue;
            }
            *votes.entry(number).or_default() += 1;
        }
        let (number, count) = votes
            .into_iter()
            .max_by_key(|&(number, count)| (count, usize::MAX - number))?;
        Some((number, count as f64 / (AROUND * radii.len()) as f64))
    }
}
