//! Disagreements of touch and scan, without a true part: scanner errors, changes of the part since
//! the scan, and bad touches.
//!
//! A rigid offset of the scan beyond its noise is removed first. Touched places away from edges,
//! which the scanner sees well, then give its error: offset b, noise σ and correlation length ℓ,
//! Cov = σ² exp(−r²/2ℓ²). The mean over a region of area A has the variance σ²/(1 + A/2πℓ²); a
//! region off by many times its root was changed. The scan misses places narrower than a few edges
//! of its triangles, and it rounds edges: it cuts convex ones and fills concave ones. Near an edge
//! a disagreement of the other sign is not the scanner's rounding, but remains unsure.

mod bad_touches;
mod edges;
mod places;
mod regions;
mod rigid_offset;
mod scanner;

use nalgebra::Point3;

pub use self::bad_touches::BadTouches;
use self::edges::SharpEdges;
use self::places::VertexProperties;
pub use self::places::{Class, RefinedShape, VertexBasis};
pub use self::regions::{DisagreementRegion, RegionEvidence};
pub use self::rigid_offset::RigidOffset;
pub use self::scanner::Scanner;
use super::deviation::{at_closest_places, closest_places, signed};
use super::sampling::nearest_corner;
use super::{CompareError, IndexedMesh};
use touchup_geometry::mesh::{FaceHit, SerialWorkers, TriMesh, VertexId};
use touchup_method::stylus::ProbedPoint;

/// A mesh with its classes.
#[derive(Clone, Debug, PartialEq)]
pub struct ClassMap {
    /// by vertex slot, m: distance of the touched surface outside of the scan; 0 for untouched
    /// places
    pub disagreement: Vec<f64>,
    /// by vertex slot
    pub classes: Vec<Class>,
    /// of each of [`Class::ALL`], m²
    pub areas: [f64; 7],
}

/// Disagreements of touch and scan.
#[derive(Clone, Debug, PartialEq)]
pub struct Disagreement {
    /// offset of the whole scan, removed before the analysis of the remainder; `None` if the noise
    /// of the scan explains it
    pub rigid_offset: Option<RigidOffset>,
    /// error model of the scanner; `None` after too few touches for an estimate: then no place
    /// counts as changed
    pub scanner: Option<Scanner>,
    /// the refined mesh
    pub refined: ClassMap,
    /// the scan
    pub scan: ClassMap,
    /// connected regions, the largest first: changed, unsure, and scanner errors beyond its noise
    pub regions: Vec<DisagreementRegion>,
    /// touches that others contradict, in order of time
    pub bad_touches: Vec<BadTouches>,
}

/// Maximum disagreement of an agreeing place, in standard deviations of the scan.
const AGREES: f64 = 2.0;

/// Minimum cosine between normals of scan and touch on the same side of the part: 60°.
const FACING: f64 = 0.5;

/// Finds disagreements of touch and scan, and their causes as far as the data determine them.
///
/// - `scan`: before refinement.
/// - `refined`: the refined mesh.
/// - `touches`: the touches of the refinement.
///
/// # Errors
/// [`CompareError::NoFaces`] if either mesh has none.
pub fn disagreement(
    scan: IndexedMesh<'_>,
    refined: &RefinedShape<'_>,
    touches: &[ProbedPoint],
) -> Result<Disagreement, CompareError> {
    if refined.shape.mesh.face_count() == 0 {
        return Err(CompareError::NoFaces);
    }
    let mut places = VertexProperties::of(scan, refined)?;
    let mut off = places.off.clone();
    let mut scanner = Scanner::of(&places);
    let mut rigid_offset = None;
    if let Some(fit) = rigid_offset::OffsetFit::of(&places) {
        places.take_off(&fit);
        let placed = Scanner::of(&places);
        rigid_offset = placed.as_ref().and_then(|placed| fit.significant(placed));
        if rigid_offset.is_some() {
            scanner = placed;
        } else {
            places.off.copy_from_slice(&off);
        }
    }
    let bad_touches = bad_touches::find(refined, touches)?;
    let mut classes = places.first_classes(refined, scanner.as_ref());
    let regions = scanner.as_ref().map_or_else(Vec::new, |scanner| {
        regions::find(
            &regions::RegionInput {
                refined,
                places: &places,
                scanner,
                touches,
            },
            &mut classes,
        )
    });
    bad_touches::mark(refined, touches, &bad_touches, &mut classes);
    off.iter_mut()
        .zip(&classes)
        .filter(|(_, class)| !class.is_touched())
        .for_each(|(off, _)| *off = 0.0);
    let on_scan = carried(scan, refined, &classes)?;
    Ok(Disagreement {
        rigid_offset,
        scanner,
        refined: ClassMap::of(refined.shape.mesh, off, classes),
        scan: on_scan,
        regions,
        bad_touches,
    })
}

impl VertexProperties {
    fn of(scan: IndexedMesh<'_>, refined: &RefinedShape<'_>) -> Result<Self, CompareError> {
        let mesh = refined.shape.mesh;
        let mut off = vec![0.0; mesh.vertex_slots()];
        let mut is_seen = vec![false; mesh.vertex_slots()];
        let mut faces_alike = vec![false; mesh.vertex_slots()];
        let (normals, areas) = vertex_normals(mesh);
        closest_places(mesh.positions(), scan.mesh, scan.tree, |at, hit| {
            let p = mesh.position(VertexId(at as u32));
            off[at] = signed(&p, scan.mesh, hit);
            is_seen[at] = !is_on_rim(scan.mesh, hit) && refined.known[at] == VertexBasis::Touched;
            faces_alike[at] = scan.mesh.normal(hit.face).dot(&normals[at]) > FACING;
        })?;
        let edges = SharpEdges::of(scan.mesh, mesh, &is_seen);
        let places = || mesh.positions().iter().zip(&normals).enumerate();
        let may_be = |(at, (p, normal))| {
            if is_seen[at] {
                edges.may_be(mesh, p, normal)
            } else {
                [true; 2]
            }
        };
        let may_be = places().map(may_be).collect();
        let is_wide = |(at, (p, normal))| {
            is_seen[at] && faces_alike[at] && edges.is_wide(&refined.shape, p, normal)
        };
        let is_wide: Vec<bool> = places().map(is_wide).collect();
        let is_open = places()
            .map(|(at, (p, _))| is_wide[at] && !edges.is_near(p))
            .collect();
        Ok(Self {
            positions: mesh.positions().to_vec(),
            off,
            is_seen,
            is_wide,
            is_open,
            edges,
            may_be,
            normals,
            areas,
        })
    }

    fn take_off(&mut self, rigid_offset: &rigid_offset::OffsetFit) {
        let both = self.positions.iter().zip(&self.normals);
        self.off
            .iter_mut()
            .zip(both)
            .for_each(|(off, (p, normal))| *off -= rigid_offset.at(p, normal));
    }

    fn first_classes(&self, refined: &RefinedShape<'_>, scanner: Option<&Scanner>) -> Vec<Class> {
        let class = |(at, known): (usize, &VertexBasis)| match (known, scanner) {
            (VertexBasis::NotTouched, _) => Class::NeverTouched,
            (VertexBasis::Unreachable, _) => Class::Unreachable,
            (VertexBasis::Touched, None) => Class::Unsure,
            (VertexBasis::Touched, Some(scanner)) if self.is_seen[at] => {
                match scanner.is_noise(self.off[at], AGREES) {
                    true => Class::Agrees,
                    // at an edge, but by more than a rounded edge
                    false if self.is_wide[at] && !scanner.may_round(self.off[at], AGREES) => {
                        Class::Unsure
                    }
                    false => Class::ScannerError,
                }
            }
            // the scan has a gap there
            (VertexBasis::Touched, Some(_)) => Class::ScannerError,
        };
        refined.known.iter().enumerate().map(class).collect()
    }
}

impl ClassMap {
    fn of(mesh: &TriMesh, disagreement: Vec<f64>, classes: Vec<Class>) -> Self {
        let mut areas = [0.0; 7];
        for (face, corners) in mesh.faces() {
            let third = mesh.double_area_normal(face).norm() / 6.0;
            corners
                .into_iter()
                .for_each(|v| areas[classes[v.0 as usize] as usize] += third);
        }
        Self {
            disagreement,
            classes,
            areas,
        }
    }
}

/// Whether the surface ends at `hit`.
fn is_on_rim(mesh: &TriMesh, hit: &FaceHit) -> bool {
    let corners = mesh.corners(hit.face);
    let is_rim = |a: VertexId, b: VertexId| mesh.faces_at_edge(a, b).count() < 2;
    let on: Vec<VertexId> = (0..3)
        .filter(|&i| hit.barycentric[i] > 0.0)
        .map(|i| corners[i])
        .collect();
    match on[..] {
        [vertex] => {
            let around = mesh
                .star(vertex)
                .iter()
                .flat_map(|&face| mesh.corners(face));
            around
                .into_iter()
                .any(|other| other != vertex && is_rim(vertex, other))
        }
        [a, b] => is_rim(a, b),
        _ => false,
    }
}

fn vertex_normals(mesh: &TriMesh) -> (Vec<nalgebra::Vector3<f64>>, Vec<f64>) {
    let mut normals = vec![nalgebra::Vector3::zeros(); mesh.vertex_slots()];
    let mut areas = vec![0.0; mesh.vertex_slots()];
    for (face, corners) in mesh.faces() {
        let double = mesh.double_area_normal(face);
        for vertex in corners {
            normals[vertex.0 as usize] += double;
            areas[vertex.0 as usize] += double.norm() / 6.0;
        }
    }
    normals
        .iter_mut()
        .for_each(|n| *n = n.try_normalize(0.0).unwrap_or_default());
    (normals, areas)
}

/// The classes at the closest places of the refined mesh, for each vertex of the scan.
fn carried(
    scan: IndexedMesh<'_>,
    refined: &RefinedShape<'_>,
    classes: &[Class],
) -> Result<ClassMap, CompareError> {
    let mesh = scan.mesh;
    let place = |p: &Point3<f64>, hit: &FaceHit| {
        let class = classes
            [nearest_corner(refined.shape.mesh.corners(hit.face), &hit.barycentric).0 as usize];
        (
            if class.is_touched() {
                -signed(p, refined.shape.mesh, hit)
            } else {
                0.0
            },
            class,
        )
    };
    let places = at_closest_places(
        mesh.positions(),
        refined.shape.mesh,
        refined.shape.tree,
        &SerialWorkers,
        place,
    )?;
    let (off, carried) = places.into_iter().unzip();
    Ok(ClassMap::of(mesh, off, carried))
}
