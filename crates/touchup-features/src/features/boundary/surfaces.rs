//! The surface of each segment, as a CAD program describes it.

use nalgebra::{Point3, Vector3};

use crate::features::feature::FittedTo;
use crate::features::fit::{Cone, Cylinder, Ends, Fit, Freedom, Plane, Sphere, SurfaceModel};
use crate::features::holes::{Boss, Hole};
use crate::features::measure::{FittedSurface, Measure};
use crate::features::segmentation::primitive::Primitive;
use crate::features::segmentation::scene::SegmentedMesh;
use crate::features::voids::Slot;
use crate::features::walls::Wall;
use touchup_geometry::brep::{
    AnalyticSurface, AxisPlacement, StandardUncertainty, SurfaceShape, UncertaintyUnit,
};
use touchup_geometry::mesh::{FaceId, VertexId};
use touchup_geometry::numeric::{order_statistic, spreads};

/// Features that place the surfaces of a part.
pub(in crate::features) struct PartFeatures<'a> {
    pub walls: &'a [Wall],
    pub holes: &'a [Hole],
    pub bosses: &'a [Boss],
    /// slots and pockets
    pub slots: &'a [&'a Slot],
}

impl PartFeatures<'_> {
    /// Number of the plane to which a wall is square: around the opening of its hole, or at the foot
    /// of its boss.
    fn rim(&self, wall: usize) -> Option<usize> {
        let hole = self.holes.iter().find(|hole| hole.wall == wall);
        let boss = self.bosses.iter().find(|boss| boss.wall == wall);
        hole.and_then(|hole| hole.rim)
            .or_else(|| boss.map(|boss| boss.base))
    }
}

/// The surface of one or more segments.
#[derive(Clone, Debug)]
pub(super) struct PartSurface {
    pub surface: AnalyticSurface,
    /// whether the outward side of the surface is outside of the part
    pub is_outward: bool,
    pub is_touched: bool,
    pub uncertainties: Vec<StandardUncertainty>,
    /// maximum distance of an edge from it, m
    pub tolerance: f64,
}

/// The surfaces of all segments.
pub(super) struct PartSurfaces {
    pub all: Vec<PartSurface>,
    /// number of the surface of each segment; `None` for noise of a scan
    pub of_segment: Vec<Option<usize>>,
}

/// Maximum distance of the segments of a wall from its surface, in their tolerances: farther ones
/// are steps.
const ONE_WALL: f64 = 2.0;
/// Share of their corners that are so near: a rounded end is not.
const MOST: f64 = 0.8;
/// Minimum tolerance of a drawing's edges, in diagonals: ten roundings of single precision.
const DRAWN: f64 = 1e-5;
/// Minimum share of a turn of an untouched round surface of a scan: less is a wave.
const LEAST_TURN: f64 = 0.2;
/// Spread of a strip across, in its width: that of an even distribution.
const SPREAD: f64 = 0.289;
/// Maximum number of faces in the test for a wall.
const MOST_FACES: usize = 400;

impl PartSurfaces {
    /// One surface for each wall, wall of a slot, and end of it, as the features have, and for each
    /// other segment.
    ///
    /// - `least_size`: radius of untouched round surfaces of a scan, and width of planes, m: smaller
    ///   ones are blurred edges.
    pub(super) fn of(measure: &Measure, of_part: &PartFeatures, least_size: f64) -> Self {
        let parted = measure.observed.parted;
        let count = parted.segmentation.segments.len();
        let (mut all, mut of_segment) = (Vec::new(), vec![None; count]);
        let mut add = |surface: PartSurface, segments: &[usize]| {
            for &number in segments {
                if of_segment[number].is_none() && is_on(parted, number, &surface) {
                    of_segment[number] = Some(all.len());
                }
            }
            all.push(surface);
        };
        for slot in of_part.slots {
            for (number, surface) in of_slot(measure, slot) {
                let mut walls = of_part.walls.iter().map(|wall| &wall.segments);
                match walls.find(|segments| segments.contains(&number)) {
                    Some(of_end) => add(surface, of_end),
                    None => add(surface, &[number]),
                }
            }
        }
        for (at, wall) in of_part.walls.iter().enumerate() {
            add(of_wall(measure, wall, of_part.rim(at)), &wall.segments);
        }
        let mut number_of = |(number, known): (usize, Option<usize>)| {
            known.unwrap_or_else(|| {
                all.push(of_segment_alone(measure, number));
                all.len() - 1
            })
        };
        let known = of_segment.into_iter().enumerate();
        let mut of_segment: Vec<_> = known.map(|known| Some(number_of(known))).collect();
        if parted.rounding.is_some() {
            let least = DRAWN * parted.diagonal;
            let tolerances = all.iter_mut().map(|surface| &mut surface.tolerance);
            tolerances.for_each(|tolerance| *tolerance = tolerance.max(least));
        }
        for (number, surface) in of_segment.iter_mut().enumerate() {
            let is_felt = surface.is_some_and(|surface| all[surface].is_touched);
            if !is_felt
                && parted.rounding.is_none()
                && !is_seen(parted, of_part.walls, number, least_size)
            {
                *surface = None;
            }
        }
        Self { all, of_segment }
    }
}

/// Whether an untouched segment of a scan is more than its noise.
fn is_seen(parted: &SegmentedMesh, walls: &[Wall], number: usize, least_size: f64) -> bool {
    let of_wall = walls.iter().find(|wall| wall.segments.contains(&number));
    let is_round =
        of_wall.is_some_and(|wall| wall.coverage >= LEAST_TURN && wall.radius() >= least_size);
    let segment = parted.segment(number);
    let places = segment.faces.iter();
    let places = places.map(|&face| parted.facets.mesh.barycentre(FaceId(face)).coords);
    let [_, across, _] = spreads(places);
    let is_wide = match &segment.primitive {
        Primitive::Plane(_) => across >= SPREAD * least_size,
        Primitive::Sphere(sphere) => sphere.radius >= least_size,
        _ => is_round,
    };
    parted.is_large(segment.area) && parted.is_sure(number) && is_wide
}

fn is_on(parted: &SegmentedMesh, number: usize, surface: &PartSurface) -> bool {
    let segment = parted.segment(number);
    let near = ONE_WALL * segment.tolerance.max(surface.tolerance);
    let faces = &segment.faces;
    let some = faces
        .iter()
        .step_by(faces.len().div_ceil(MOST_FACES).max(1));
    let corners = some.flat_map(|&face| parted.facets.triangle(face));
    let off = corners.map(|p| surface.surface.signed_distance(&p).abs());
    order_statistic(&mut off.collect::<Vec<_>>(), MOST).is_none_or(|off| off <= near)
}

/// The surfaces of the walls and ends of a slot, which touch each other, by their segments.
fn of_slot(measure: &Measure, slot: &Slot) -> Vec<(usize, PartSurface)> {
    let found = measure.stadium(slot);
    let (pose, width, length) = (
        found.surface.pose_of,
        found.surface.width,
        found.surface.length,
    );
    let surface = |number: usize| {
        let segment = measure.observed.parted.segment(number);
        let surface = match segment.primitive {
            Primitive::Plane(plane) => {
                let normal = pose.inverse_transform_vector(&plane.normal());
                let (out, half) = if normal.x.abs() > normal.y.abs() {
                    (Vector3::x() * normal.x.signum(), length / 2.0)
                } else {
                    (Vector3::y() * normal.y.signum(), width / 2.0)
                };
                AnalyticSurface::along(
                    pose * Point3::from(-out * half),
                    pose * out,
                    SurfaceShape::Plane,
                )
            }
            Primitive::Cylinder(end) if slot.shape == Ends::Round => {
                let side = pose.inverse_transform_point(&end.center()).x.signum();
                let centre = Vector3::x() * (side * (length - width) / 2.0);
                let radius = width / 2.0;
                let shape = SurfaceShape::Cylinder { radius };
                AnalyticSurface::along(pose * Point3::from(centre), pose * Vector3::z(), shape)
            }
            _ => return None,
        };
        let is_outward = surface.shape == SurfaceShape::Plane;
        let at = surface.placement.origin;
        let own = fitted(&found, surface, is_outward, segment.tolerance, |fit| {
            let position = if is_outward {
                fit.std_at(&at)
            } else {
                fit.middle_std()
            };
            let mut known = vec![
                ("position_mm", position, LENGTH),
                ("direction_deg", fit.axis_std(), ANGLE),
            ];
            if !is_outward {
                let diameter = fit.std_by(&[(Freedom::Size, 1.0)]);
                known.push(("diameter_mm", diameter, LENGTH));
            }
            known
        });
        let is_touched = own.is_touched && !measure.observed.touches_of(&[number]).is_empty();
        Some((number, PartSurface { is_touched, ..own }))
    };
    slot.segments().filter_map(surface).collect()
}

/// - `rim`: number of the plane to which it is square.
fn of_wall(measure: &Measure, wall: &Wall, rim: Option<usize>) -> PartSurface {
    let tolerance = measure.observed.parted.segment(wall.segments[0]).tolerance;
    match measure.cone(wall) {
        Some(cone) => of_cone(&cone, tolerance),
        None => of_cylinder(&measure.cylinder(wall, rim), tolerance),
    }
}

fn of_segment_alone(measure: &Measure, number: usize) -> PartSurface {
    let parted = measure.observed.parted;
    let segment = parted.segment(number);
    if let Some(plane) = measure.plane(number) {
        let middle = middle_of(parted, &segment.faces);
        return of_plane(&plane, &middle, segment.tolerance);
    }
    if let Some(cylinder) = measure.shaft(number) {
        return of_cylinder(&cylinder, segment.tolerance);
    }
    if let Some(sphere) = measure.sphere(number) {
        let middle = middle_of(parted, &segment.faces);
        return of_sphere(&sphere, &middle, segment.tolerance);
    }
    let wall = Wall::of_faces(
        &parted.facets,
        &segment.primitive,
        &segment.faces,
        vec![number],
    );
    match (wall.and_then(|wall| measure.cone(&wall)), segment.primitive) {
        (Some(cone), _) => of_cone(&cone, segment.tolerance),
        (None, primitive) => of_primitive(&primitive, segment.tolerance),
    }
}

/// A surface without a fit.
fn of_primitive(primitive: &Primitive, tolerance: f64) -> PartSurface {
    let (surface, is_outward) = match primitive {
        Primitive::Plane(plane) => (plane_at(plane, &plane.point()), true),
        Primitive::Cylinder(cylinder) => (cylinder_of(cylinder), !cylinder.concave),
        Primitive::Cone(cone) => (cone_of(cone), !cone.concave),
        Primitive::Sphere(sphere) => (sphere_of(sphere, Vector3::z()), !sphere.concave),
    };
    PartSurface {
        surface,
        is_outward,
        is_touched: false,
        uncertainties: Vec::new(),
        tolerance,
    }
}

fn fitted<S: SurfaceModel>(
    found: &FittedSurface<S>,
    surface: AnalyticSurface,
    is_outward: bool,
    tolerance: f64,
    uncertainties: impl FnOnce(&Fit<S>) -> Vec<(&'static str, Option<f64>, UncertaintyUnit)>,
) -> PartSurface {
    let known = found.confirmed().map(uncertainties).unwrap_or_default();
    let known = known.into_iter().filter_map(|(name, value, unit)| {
        let value = value? * factor(unit);
        Some(StandardUncertainty {
            name: name.to_owned(),
            value,
            unit,
        })
    });
    PartSurface {
        surface,
        is_outward,
        is_touched: found.to == FittedTo::Touches,
        uncertainties: known.collect(),
        tolerance,
    }
}

/// Units in one m or rad.
fn factor(unit: UncertaintyUnit) -> f64 {
    match unit {
        UncertaintyUnit::Millimetre => 1e3,
        UncertaintyUnit::Degree => 1f64.to_degrees(),
    }
}

const LENGTH: UncertaintyUnit = UncertaintyUnit::Millimetre;
const ANGLE: UncertaintyUnit = UncertaintyUnit::Degree;

fn of_plane(plane: &FittedSurface<Plane>, middle: &Point3<f64>, tolerance: f64) -> PartSurface {
    let surface = plane_at(&plane.surface, middle);
    let middle = surface.placement.origin;
    fitted(plane, surface, true, tolerance, |fit| {
        vec![
            ("position_mm", fit.std_at(&middle), LENGTH),
            ("direction_deg", fit.axis_std(), ANGLE),
        ]
    })
}

fn of_cylinder(cylinder: &FittedSurface<Cylinder>, tolerance: f64) -> PartSurface {
    let own = &cylinder.surface;
    let (surface, middle) = (cylinder_of(own), own.center());
    fitted(cylinder, surface, !own.concave, tolerance, |fit| {
        vec![
            ("diameter_mm", fit.std_by(&[(Freedom::Size, 2.0)]), LENGTH),
            ("position_mm", fit.lateral_std(&middle), LENGTH),
            ("direction_deg", fit.axis_std(), ANGLE),
        ]
    })
}

fn of_cone(cone: &FittedSurface<Cone>, tolerance: f64) -> PartSurface {
    let own = &cone.surface;
    fitted(cone, cone_of(own), !own.concave, tolerance, |fit| {
        let angle = fit.std_by(&[(Freedom::Second, 2.0)]);
        vec![
            ("cone_angle_deg", angle, ANGLE),
            ("direction_deg", fit.axis_std(), ANGLE),
        ]
    })
}

/// - `middle`: of its faces; the pole is there, so that no edge runs over it.
fn of_sphere(sphere: &FittedSurface<Sphere>, middle: &Point3<f64>, tolerance: f64) -> PartSurface {
    let own = &sphere.surface;
    let surface = sphere_of(own, middle - own.center());
    fitted(sphere, surface, !own.concave, tolerance, |fit| {
        vec![
            ("diameter_mm", fit.std_by(&[(Freedom::Size, 2.0)]), LENGTH),
            ("position_mm", fit.centre_std(), LENGTH),
        ]
    })
}

/// - `near`: its foot is the origin.
fn plane_at(plane: &Plane, near: &Point3<f64>) -> AnalyticSurface {
    let normal = plane.normal();
    let foot = near - normal * plane.distance(near);
    AnalyticSurface::along(foot, normal, SurfaceShape::Plane)
}

fn cylinder_of(cylinder: &Cylinder) -> AnalyticSurface {
    let shape = SurfaceShape::Cylinder {
        radius: cylinder.radius,
    };
    AnalyticSurface::along(cylinder.center(), cylinder.axis(), shape)
}

/// Its axis is turned to the wide side.
fn cone_of(cone: &Cone) -> AnalyticSurface {
    let shape = SurfaceShape::Cone {
        radius: cone.radius,
        half_angle: cone.half_angle.abs(),
    };
    let placement = AxisPlacement::along(cone.center(), cone.axis() * cone.half_angle.signum());
    AnalyticSurface { placement, shape }
}

/// - `pole`: of any length but 0.
fn sphere_of(sphere: &Sphere, pole: Vector3<f64>) -> AnalyticSurface {
    let shape = SurfaceShape::Sphere {
        radius: sphere.radius,
    };
    AnalyticSurface::along(sphere.center(), pole, shape)
}

fn middle_of(parted: &SegmentedMesh, faces: &[u32]) -> Point3<f64> {
    let facets = &parted.facets;
    let weighted = faces.iter().map(|&face| {
        let middle = facets.mesh.barycentre(FaceId(face));
        (middle.coords * facets.area(face), facets.area(face))
    });
    let sum = |a: (Vector3<f64>, f64), b: (Vector3<f64>, f64)| (a.0 + b.0, a.1 + b.1);
    let (sum, area) = weighted.fold((Vector3::zeros(), 0.0), sum);
    if area > 0.0 {
        (sum / area).into()
    } else {
        facets.mesh.position(VertexId(0))
    }
}
