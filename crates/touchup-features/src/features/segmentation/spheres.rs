//! Spheres: domes, seats of balls, ends of ball-nosed tools.
//!
//! Planes and cylinders part a sphere into many pieces, as each explains a little of it. Around
//! faces that curve both ways the sphere through their corners grows over all connected faces on
//! it. It takes the pieces that lie on it as a whole, and leaves the others what is theirs. It
//! counts if no cone or cylinder explains the rest nearly as well, and if no three cylinders of its
//! own radius run into it: that is the corner of fillets.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Point3, Vector2, Vector3};

use super::facets::{Facets, NONE};
use super::flats::SMOOTH;
use super::grow::{MeshScale, SHARPNESS, SPREAD};
use super::primitive::{NormalSpread, Primitive, belongs, refined};
use super::segment::{Segment, Segmentation};
use crate::features::fit::{Cone, Sphere, SurfaceModel, fit_sphere};
use touchup_geometry::numeric::{distinct, flood, mean, scatter};

/// Numbers of faces around a seed, in turn: two rings of a sphere drawn with 12 sides, and a patch of
/// a scan that bends more than its noise.
const NEAR: [usize; 3] = [24, 90, 300];
/// Maximum number of rounds in which a region grows, and least growth of a further one.
const ROUNDS: usize = 12;
const GROWTH: f64 = 1.02;
/// Share of its area with which a segment is a piece of a sphere, beside corners that it rounds off.
const PIECE: f64 = 0.7;
/// Maximum share of a sphere in one piece: an equator drawn with 8 sides has a fifth, a cylinder or
/// plane that looks like a sphere all of it.
const ONE_PIECE: f64 = 0.5;
/// Minimum share of the region that others leave: less is mostly their edge.
const LEFT: f64 = 0.5;
/// Minimum share of corners nearer than the closeness of a seed: a sphere has nearly all, a region
/// that ends at the tolerance, three times as far, has half of them or less.
const CLOSE: f64 = 0.75;
/// Minimum distance (root mean square) from the best cone, in the closeness: waves stay within one.
const FROM_CONE: f64 = 3.0;
/// Minimum solid angle of a sphere of a scan, sr: 33° around its pole. A flatter cap looks like any
/// wave of a curved surface.
const LEAST_SOLID_ANGLE: f64 = 1.0;
/// Number of cylinders that run into the corner of fillets, and tolerance of their radii, as a share;
/// two run into the end of a slot.
const OF_CORNER: usize = 3;
const SAME_RADIUS: f64 = 0.15;
/// Width of the seam between a sphere and what is beside it, faces.
const SEAM: usize = 3;

impl Segmentation {
    /// Adds the spheres of a mesh, which replace their pieces.
    pub(in crate::features) fn add_spheres(
        &mut self,
        facets: &Facets,
        scale: MeshScale,
        is_drawn: bool,
    ) {
        let mut search = SphereSearch {
            facets,
            of: self,
            diagonal: scale.diagonal,
            is_drawn,
            seen: vec![0; facets.slots()],
            round: 0,
            closeness: 0.0,
            tolerance: 0.0,
        };
        for (closeness, tolerance) in scale.of_spheres(is_drawn) {
            (search.closeness, search.tolerance) = (closeness, tolerance);
            let mut is_tried = vec![false; facets.slots()];
            for seed in 0..facets.slots() as u32 {
                if !is_tried[seed as usize] && search.may_begin_at(seed) {
                    search.try_from(seed, &mut is_tried);
                }
            }
        }
    }
}

struct SphereSearch<'a> {
    facets: &'a Facets<'a>,
    of: &'a mut Segmentation,
    /// of the mesh, m
    diagonal: f64,
    is_drawn: bool,
    /// the round in which a face was last examined
    seen: Vec<u32>,
    round: u32,
    /// maximum distance of the corners around a seed, m
    closeness: f64,
    /// maximum distance of other corners, m
    tolerance: f64,
}

impl SphereSearch<'_> {
    /// Whether a face may be on a sphere: not on another one, not on a plane wider than a cap of the
    /// largest sphere within twice its tolerance, and not level with all its neighbours.
    fn may_begin_at(&self, seed: u32) -> bool {
        let segment = self
            .of
            .segments
            .get(self.of.of_face[seed as usize] as usize);
        let is_taken = segment.is_some_and(|segment| match segment.primitive {
            Primitive::Sphere(_) => true,
            Primitive::Plane(_) => {
                segment.area > std::f64::consts::TAU * self.diagonal * segment.tolerance
            }
            _ => false,
        });
        let normal = self.facets.normal(seed);
        let mut beside = self.facets.beside(seed);
        !is_taken
            && self.facets.area(seed) > 0.0
            && beside.any(|(_, other)| normal.cross(&self.facets.normal(other)).norm() > 1e-6)
    }

    fn try_from(&mut self, seed: u32, is_tried: &mut [bool]) {
        let mut before = 0;
        for most in NEAR {
            let near = self.near(seed, most);
            if before == 0 {
                near.iter().for_each(|&face| is_tried[face as usize] = true);
            }
            if near.len() <= before {
                return;
            }
            before = near.len();
            let spread = NormalSpread::of(self.facets, &near);
            if spread.is_none_or(|spread| spread.cylinder_axis().is_some()) {
                continue;
            }
            let start = self.through(&near);
            let start = start.filter(|start| SPREAD * self.misfit(start, &near) <= self.closeness);
            let found = start.and_then(|start| self.grown(near, start));
            if let Some(sphere) = found.and_then(|(sphere, faces)| self.rest(sphere, faces)) {
                sphere
                    .faces
                    .iter()
                    .for_each(|&face| is_tried[face as usize] = true);
                self.of.add(self.facets, sphere);
                return;
            }
        }
    }

    /// Faces around a seed, connected over smooth edges, the nearest first.
    fn near(&mut self, seed: u32, most: usize) -> Vec<u32> {
        self.round += 1;
        self.seen[seed as usize] = self.round;
        let (mut found, mut at) = (vec![seed], 0);
        while at < found.len() && found.len() < most {
            let face = found[at];
            at += 1;
            for (_, other) in self.facets.beside(face) {
                let is_smooth = self.facets.normal(face).dot(&self.facets.normal(other)) > SMOOTH;
                if is_smooth && self.seen[other as usize] != self.round {
                    self.seen[other as usize] = self.round;
                    found.push(other);
                }
            }
        }
        found
    }

    /// The sphere through the corners of faces.
    fn through(&self, faces: &[u32]) -> Option<Primitive> {
        let corners = distinct(faces.iter().flat_map(|&face| {
            let corners = self
                .facets
                .mesh
                .corners(touchup_geometry::mesh::FaceId(face));
            corners.map(|corner| corner.0)
        }));
        let place = |&corner: &u32| {
            let corner = touchup_geometry::mesh::VertexId(corner);
            self.facets.mesh.position(corner)
        };
        let found = fit_sphere(&corners.iter().map(place).collect::<Vec<_>>())?;
        let outward = |&face: &u32| {
            let off = self.facets.triangle(face)[0] - found.centre;
            off.dot(&self.facets.normal(face)) * self.facets.area(face)
        };
        let is_concave = faces.iter().map(outward).sum::<f64>() < 0.0;
        let sphere = Sphere::new(found.centre, found.radius, is_concave);
        self.is_sound(&sphere).then_some(Primitive::Sphere(sphere))
    }

    fn is_sound(&self, sphere: &Sphere) -> bool {
        sphere.radius < self.diagonal && self.closeness <= SHARPNESS * sphere.radius
    }

    /// Root mean square distance of the corners of faces, m.
    fn misfit(&self, primitive: &Primitive, faces: &[u32]) -> f64 {
        let corners = faces.iter().flat_map(|&face| self.facets.triangle(face));
        let squares = corners.map(|p| primitive.distance(&p).powi(2)).sum::<f64>();
        (squares / (3 * faces.len().max(1)) as f64).sqrt()
    }

    /// The sphere and all faces on it that are connected with these.
    fn grown(&mut self, mut faces: Vec<u32>, mut sphere: Primitive) -> Option<(Sphere, Vec<u32>)> {
        for _ in 0..ROUNDS {
            let before = faces.len() as f64;
            self.round += 1;
            let (facets, tolerance, round) = (self.facets, self.tolerance, self.round);
            let seen = &mut self.seen;
            let mut is_on = |face: u32| {
                let is_new = std::mem::replace(&mut seen[face as usize], round) != round;
                is_new && belongs(facets, face, &sphere, tolerance)
            };
            faces.retain(|&face| is_on(face));
            let beside = |face: u32| facets.beside(face).map(|(_, other)| other);
            faces = flood(faces, beside, is_on);
            sphere = refined(&sphere, facets, &faces)?;
            if faces.len() as f64 <= GROWTH * before {
                break;
            }
        }
        match sphere {
            Primitive::Sphere(sphere) if self.is_sound(&sphere) => Some((sphere, faces)),
            _ => None,
        }
    }

    /// The faces of a region that no larger segment has, as one sphere; `None`: a segment has most of
    /// them already. The segments that they had go.
    fn rest(&mut self, sphere: Sphere, mut faces: Vec<u32>) -> Option<Segment> {
        let whole = self.facets.area_of(&faces);
        let mut shares: BTreeMap<u32, f64> = BTreeMap::new();
        for &face in &faces {
            *shares.entry(self.of.of_face[face as usize]).or_default() += self.facets.area(face);
        }
        shares.remove(&NONE);
        if shares.values().any(|&share| share > ONE_PIECE * whole) {
            return None;
        }
        shares.retain(|&label, share| {
            let segment = &self.of.segments[label as usize];
            *share >= PIECE * segment.area && !matches!(segment.primitive, Primitive::Sphere(_))
        });
        faces.retain(|&face| {
            let label = self.of.of_face[face as usize];
            label == NONE || shares.contains_key(&label)
        });
        let area = self.facets.area_of(&faces);
        let primitive = refined(&Primitive::Sphere(sphere), self.facets, &faces)?;
        let is_own = area >= LEFT * whole
            && (self.is_drawn || area >= LEAST_SOLID_ANGLE * sphere.radius.powi(2))
            && self.is_close(&primitive, &faces)
            && self.is_no_cone(&sphere, &faces)
            && !self.is_corner(&sphere, &faces);
        if !is_own {
            return None;
        }
        for &label in shares.keys() {
            let piece = &mut self.of.segments[label as usize];
            piece.area = 0.0;
            for face in std::mem::take(&mut piece.faces) {
                self.of.of_face[face as usize] = NONE;
            }
        }
        Some(Segment {
            primitive,
            faces,
            area,
            tolerance: self.tolerance,
            is_exact: self.is_drawn,
            felt: Vec::new(),
        })
    }

    fn is_close(&self, sphere: &Primitive, faces: &[u32]) -> bool {
        let corners = faces.iter().flat_map(|&face| self.facets.triangle(face));
        let close = corners.filter(|p| sphere.distance(p).abs() <= self.closeness);
        close.count() as f64 >= CLOSE * (3 * faces.len()) as f64
    }

    /// Whether no cone explains the faces nearly as well; cylinders and planes are cones too.
    fn is_no_cone(&self, sphere: &Sphere, faces: &[u32]) -> bool {
        let corners: Vec<Vector3<f64>> = faces
            .iter()
            .flat_map(|&face| self.facets.triangle(face))
            .map(|p| p - sphere.center())
            .collect();
        let middle = mean(corners.iter().copied());
        let spread: Matrix3<f64> = scatter(corners.iter().map(|v| v - middle));
        let axes = spread.symmetric_eigen().eigenvectors;
        let least = FROM_CONE * self.closeness;
        (0..3).all(|i| {
            let start = cone_about(&axes.column(i).into_owned(), sphere, &corners);
            let best = refined(&start, self.facets, faces).unwrap_or(start);
            self.misfit(&best, faces).min(self.misfit(&start, faces)) > least
        })
    }

    /// Whether fillets meet in it.
    fn is_corner(&mut self, sphere: &Sphere, faces: &[u32]) -> bool {
        self.round += 1;
        faces
            .iter()
            .for_each(|&face| self.seen[face as usize] = self.round);
        let (mut front, mut beside) = (faces.to_vec(), Vec::new());
        for _ in 0..=SEAM {
            let mut next = Vec::new();
            for other in front
                .iter()
                .flat_map(|&face| self.facets.beside(face))
                .map(|(_, other)| other)
            {
                if std::mem::replace(&mut self.seen[other as usize], self.round) == self.round {
                    continue;
                }
                match self.of.of_face[other as usize] {
                    NONE => next.push(other),
                    label => beside.push(label),
                }
            }
            front = next;
        }
        let is_alike = |&label: &u32| match self.of.segments[label as usize].primitive {
            Primitive::Cylinder(fillet) => {
                fillet.concave == sphere.concave
                    && (fillet.radius - sphere.radius).abs() < SAME_RADIUS * sphere.radius
            }
            _ => false,
        };
        distinct(beside)
            .iter()
            .filter(|label| is_alike(label))
            .count()
            >= OF_CORNER
    }
}

/// The cone about an axis through the centre of a sphere, by the straight line through the corners
/// over their heights.
///
/// - `corners`: from the centre, m
fn cone_about(axis: &Vector3<f64>, sphere: &Sphere, corners: &[Vector3<f64>]) -> Primitive {
    /// Keeps planes and cylinders cones.
    const HALF_ANGLES: [f64; 2] = [1e-6, 1.57];
    let place = |v: &Vector3<f64>| {
        let height = v.dot(axis);
        Vector2::new((v - axis * height).norm(), height)
    };
    let middle = mean(corners.iter().map(place));
    let spread = scatter(corners.iter().map(|v| place(v) - middle));
    let eigen = spread.symmetric_eigen();
    let along = eigen.eigenvectors.column(eigen.eigenvalues.imax());
    let half_angle = along.x.abs().atan2(along.y.abs());
    // wider along the axis
    let axis = axis * (along.x * along.y).signum();
    let height = middle.y * (along.x * along.y).signum();
    Primitive::Cone(Cone::new(
        Point3::from(sphere.center() + axis * height),
        &axis,
        middle.x,
        half_angle.clamp(HALF_ANGLES[0], HALF_ANGLES[1]),
        sphere.concave,
    ))
}
