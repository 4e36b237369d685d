//! From a mesh and touches to features.

use nalgebra::{Matrix3, Point3, Vector3};

use super::borders::{Borders, StraightEdge, borders, straight_edges, without_seams};
use super::boundary::{PartBoundary, PartFeatures, boundary};
use super::cones::add_cones;
use super::feature::{Feature, FeatureKind, FittedTo, Form, MeasuredValue, Walls};
use super::fit::{Fit, Freedom, Plane, Stadium, SurfaceModel, TouchNoise};
use super::holes::{Boss, Hole, bosses, groups, holes};
use super::measure::{FittedSurface, Measure};
use super::observe::{NOT_ALIKE, SegmentTouches};
use super::rims::{OpeningOutline, RoundOpening, outlines, rims};
use super::segmentation::primitive::Primitive;
use super::segmentation::scene::{SegmentedMesh, numbered_by_place};
use super::shafts::is_shaft;
use super::spheres::sphere_features;
use super::surfaces::{claim, touched_surfaces};
use super::voids::{Slot, undercut_groups, voids};
use super::walls::{ALL_AROUND, SAME_WALL, Wall};
use touchup_geometry::mesh::{FaceTree, TriMesh};
use touchup_geometry::numeric::distinct;
use touchup_method::stylus::ProbedPoint;

/// Features detected on a mesh.
#[derive(Clone, Debug)]
pub struct Detection {
    /// by kind, the largest first; numbered from 0 on
    pub features: Vec<Feature>,
    /// share of the area that no plane, cylinder, cone or sphere explains
    pub unexplained: f64,
    /// errors of the touches that do not repeat
    pub noise: TouchNoise,
}

/// Diameter of the ball's own path in the coarse mesh, in diameters of the ball.
const OF_BALL: std::ops::Range<f64> = 0.97..1.12;
/// Maximum distance of a ball's centre from the axis of its path, in diameters, and minimum number of
/// touches there.
const IN_PATH: f64 = 0.2;
const LEAST_IN_PATH: usize = 3;

/// Detects the features of a mesh, measured by touches if there are any. With touches the same
/// surface gives the same features for any numbering of vertices and faces: live and saved meshes
/// number them in order of creation. A drawing keeps the order of its file.
///
/// - `touches`: as in [`touchup_method::reconstruct::Patcher::probed`]; features refer to them by index.
pub fn detect(mesh: &TriMesh, touches: &[ProbedPoint]) -> Detection {
    detected(mesh, touches, |_, _| ()).0
}

/// As [`detect`], with the boundary of the part.
pub fn detect_boundary(mesh: &TriMesh, touches: &[ProbedPoint]) -> (Detection, PartBoundary) {
    detected(mesh, touches, boundary)
}

/// Detects features, and derives something else from the same segments.
fn detected<T>(
    mesh: &TriMesh,
    touches: &[ProbedPoint],
    derive: impl FnOnce(&Measure, &PartFeatures) -> T,
) -> (Detection, T) {
    let numbered = (!touches.is_empty()).then(|| numbered_by_place(mesh));
    let mesh = numbered.as_ref().unwrap_or(mesh);
    let tree = FaceTree::new(mesh);
    let mut parted = SegmentedMesh::of(mesh, &tree);
    join_planes(&mut parted);
    let radius = touches.iter().map(|touch| touch.radius).fold(0.0, f64::max);
    claim(&mut parted, &touched_surfaces(touches), radius);
    // contact walls took faces from planes of the mesh; equal planes join again
    join_planes(&mut parted);
    let mut walls = Wall::all(&parted.facets, &parted.segmentation);
    add_cones(&mut parted, &mut walls);
    let of_face = without_seams(&parted);
    let borders = borders(&parted, &of_face);
    let (slots, pockets) = voids(&parted, &walls, &of_face, radius);
    let (holes, slots) = without_ends(holes(&parted, &walls, touches), slots, &walls);
    let edges = sure_edges(&parted, &borders);
    let observed = SegmentTouches::of(&parted, &of_face, touches);
    let measure = Measure::new(&observed);
    let mut features = hole_features(&measure, &walls, &holes, touches);
    let bosses = bosses(&parted, &walls);
    let is_shaft = |at: &usize| {
        bosses.iter().all(|boss| boss.wall != *at) && is_shaft(&measure, &borders, &walls[*at])
    };
    let shafts: Vec<usize> = (0..walls.len()).filter(is_shaft).collect();
    let round = round_walls(&walls, &holes, &bosses, &shafts);
    let flat: Vec<&Slot> = slots.iter().chain(&pockets).collect();
    let (raised, cut): (Vec<Feature>, Vec<Feature>) = of_other_outline(&measure, &round, &flat)
        .into_iter()
        .partition(|feature| feature.kind == FeatureKind::Boss);
    features.extend(cut);
    let mut features = without_second_walls(features);
    features.extend(slot_features(&measure, &slots, &pockets, holes.len()));
    let raised = bosses
        .iter()
        .map(|boss| boss_feature(&measure, &walls, boss))
        .chain(raised)
        .collect();
    features.extend(without_second_walls(raised));
    let shafts = shafts.iter();
    features.extend(shafts.map(|&at| cylinder_feature(&measure, &walls[at])));
    features.extend(sphere_features(&measure));
    features.extend(edges.iter().filter_map(|edge| edge_feature(&measure, edge)));
    features.extend(corners(&parted, &measure, &edges));
    features.extend(plane_features(&measure));
    for (id, feature) in features.iter_mut().enumerate() {
        feature.id = id as u32;
    }
    let detection = Detection {
        features,
        unexplained: unexplained(&parted),
        noise: observed.noise,
    };
    let of_part = PartFeatures {
        walls: &walls,
        holes: &holes,
        bosses: &bosses,
        slots: &flat,
    };
    (detection, derive(&measure, &of_part))
}

/// Holes that are no end of a slot, and slots of which no end is a bore with contacts all around.
fn without_ends(
    mut holes: Vec<Hole>,
    mut slots: Vec<Slot>,
    walls: &[Wall],
) -> (Vec<Hole>, Vec<Slot>) {
    let felt_bores: Vec<&Wall> = holes
        .iter()
        .map(|hole| &walls[hole.wall])
        .filter(|wall| wall.felt_turn >= ALL_AROUND)
        .collect();
    slots.retain(|slot| {
        felt_bores
            .iter()
            .all(|wall| !is_slot_end(wall, std::slice::from_ref(slot)))
    });
    holes.retain(|hole| !is_slot_end(&walls[hole.wall], &slots));
    (holes, slots)
}

/// Straight edges between sure planes.
fn sure_edges(parted: &SegmentedMesh, borders: &Borders) -> Vec<StraightEdge> {
    let is_sure = |edge: &StraightEdge| edge.planes.iter().all(|&number| parted.is_sure(number));
    straight_edges(parted, borders)
        .into_iter()
        .filter(is_sure)
        .collect()
}

/// Walls of holes with their countersinks, then of bosses and shafts.
fn round_walls<'a>(
    walls: &'a [Wall],
    holes: &[Hole],
    bosses: &[Boss],
    shafts: &[usize],
) -> Vec<&'a Wall> {
    let of_holes = holes
        .iter()
        .flat_map(|hole| [Some(hole.wall), hole.countersink]);
    let of_bosses = bosses.iter().map(|boss| boss.wall);
    of_holes
        .flatten()
        .chain(of_bosses)
        .chain(shafts.iter().copied())
        .map(|wall| &walls[wall])
        .collect()
}

/// Large sure planes.
fn plane_features(measure: &Measure) -> Vec<Feature> {
    let parted = measure.observed.parted;
    let is_large = |number: usize| parted.is_large(parted.segment(number).area);
    parted
        .planes()
        .filter(|&(number, ..)| parted.is_sure(number) && is_large(number))
        .filter_map(|(number, ..)| plane_feature(measure, number))
        .collect()
}

/// Holes by their walls, then by their rims alone.
fn hole_features(
    measure: &Measure,
    walls: &[Wall],
    holes: &[Hole],
    touches: &[ProbedPoint],
) -> Vec<Feature> {
    let of_ball = touches
        .iter()
        .map(|touch| 2.0 * touch.radius)
        .fold(0.0, f64::max);
    // a ball in it that touched something else: its path through an unscanned region
    let is_way_of_ball = |feature: &Feature| {
        let (Some(diameter), Some(axis), Some(depth)) =
            (&feature.diameter, &feature.axis, &feature.depth)
        else {
            return false;
        };
        let is_inside = |touch: &&ProbedPoint| {
            let v = touch.centre - feature.centre.value;
            let along = v.dot(&axis.value);
            (-depth.value..0.0).contains(&along)
                && (v - axis.value * along).norm() < IN_PATH * diameter.value
        };
        let is_of_ball = OF_BALL.contains(&(diameter.value / of_ball));
        feature.fitted_to == FittedTo::Mesh
            && (is_of_ball || touches.iter().filter(is_inside).count() >= LEAST_IN_PATH)
    };
    let mut features = Vec::new();
    for (hole, group) in holes.iter().zip(groups(walls, holes)) {
        features.push(Feature {
            group,
            ..hole_feature(measure, walls, hole)
        });
    }
    let is_new = |rim: &RoundOpening| holes.iter().all(|hole| !is_rim_of(&walls[hole.wall], rim));
    features.extend(
        rims(measure.observed.parted)
            .iter()
            .filter(|rim| is_new(rim))
            .map(|rim| rim_feature(measure, rim)),
    );
    features.retain(|feature| !is_way_of_ball(feature));
    features
}

/// Slots, then pockets.
///
/// - `grouped`: number of smaller numbers that groups may have.
fn slot_features(
    measure: &Measure,
    slots: &[Slot],
    pockets: &[Slot],
    grouped: usize,
) -> Vec<Feature> {
    let is_reported = |slot: &Slot, feature: &Feature| {
        // in a measured mesh a void open all around may be a gap between pieces
        let is_shut = slot.floor.is_some() || slot.is_closed;
        is_shut
            || measure.observed.parted.rounding.is_some()
            || feature.fitted_to == FittedTo::Touches
    };
    let groups = undercut_groups(slots);
    let measured = slots.iter().zip(groups).map(|(slot, group)| {
        let group = group.map(|at| (grouped + at) as u32);
        let feature = slot_feature(measure, slot, FeatureKind::Slot);
        (slot, Feature { group, ..feature })
    });
    let measured = measured
        .filter(|(slot, feature)| is_reported(slot, feature))
        .map(|(_, feature)| feature);
    let pockets = pockets
        .iter()
        .map(|pocket| slot_feature(measure, pocket, FeatureKind::Pocket));
    measured.chain(pockets).collect()
}

/// Share of the area of a mesh in no segment.
fn unexplained(parted: &SegmentedMesh) -> f64 {
    let all: f64 = parted.facets.areas.iter().sum();
    let explained: f64 = parted
        .segmentation
        .segments
        .iter()
        .map(|segment| segment.area)
        .sum();
    if all > 0.0 {
        (1.0 - explained / all).max(0.0)
    } else {
        0.0
    }
}

/// Joins adjacent segments of one plane.
fn join_planes(parted: &mut SegmentedMesh) {
    let beside: Vec<_> = borders(parted, &without_seams(parted))
        .into_keys()
        .collect();
    parted
        .segmentation
        .join_planes(&parted.facets, beside.into_iter());
}

/// Two holes, or bosses, have one wall if their axes agree within 11° and, at their overlap, within
/// this share of the diameter, and their diameters within the same share.
const ONE_AXIS: f64 = 0.98;
const ONE_WALL: f64 = 0.15;

/// Removes duplicates of holes, or of bosses: one hole from its other end, or mesh of a wall beside
/// its touched part. The duplicate with the most touches stays, without touches the deeper one.
fn without_second_walls(mut features: Vec<Feature>) -> Vec<Feature> {
    let depth = |feature: &Feature| feature.depth.as_ref().map_or(0.0, |depth| depth.value);
    let touches = |feature: &Feature| {
        feature
            .diameter
            .as_ref()
            .map_or(0, |diameter| diameter.touches.len())
    };
    let is_second = |at: usize, of: usize| {
        let (one, other) = (&features[at], &features[of]);
        let rank = |feature: &Feature| (touches(feature), depth(feature));
        let is_less = rank(one) < rank(other) || (rank(one) == rank(other) && at > of);
        at != of && is_less && is_one_wall(one, other)
    };
    let first: Vec<usize> = (0..features.len())
        .filter(|&at| !(0..features.len()).any(|of| is_second(at, of)))
        .collect();
    first
        .into_iter()
        .map(|at| std::mem::take(&mut features[at]))
        .collect()
}

/// Whether two holes, or two bosses, of the same width overlap along one axis over more than half
/// of the shorter one. A wall with an untouched end goes on in an untouched wall no farther off
/// than pieces of one wall are.
fn is_one_wall(one: &Feature, other_feature: &Feature) -> bool {
    // bottom or foot, axis, depth to the opening or top, diameter
    let wall = |feature: &Feature| {
        let (axis, depth) = (feature.axis.as_ref()?.value, feature.depth.as_ref()?.value);
        let is_hole = matches!(feature.kind, FeatureKind::Hole | FeatureKind::Notch);
        let bottom = feature.centre.value - axis * if is_hole { depth } else { 0.0 };
        (depth > 0.0).then_some((bottom, axis, depth, feature.diameter.as_ref()?.value))
    };
    let (Some((bottom, axis, depth, wide)), Some(other)) = (wall(one), wall(other_feature)) else {
        return false;
    };
    let (other_bottom, other_axis, other_depth, other_wide) = other;
    let from = (other_bottom - bottom).dot(&axis);
    let to = from + other_depth * other_axis.dot(&axis);
    let overlap = from.max(to).min(depth) - from.min(to).max(0.0);
    let middle = other_bottom + other_axis * (other_depth / 2.0) - bottom;
    let aside = (middle - axis * middle.dot(&axis)).norm();
    let near = ONE_WALL * wide.min(other_wide);
    let is_along = axis.dot(&other_axis).abs() > ONE_AXIS;
    let goes_on = |felt: &Feature, rest: &Feature| {
        let is_open = felt.depth.as_ref().is_some_and(|depth| depth.is_at_least);
        is_open && rest.fitted_to == FittedTo::Mesh
    };
    let is_rest = (goes_on(one, other_feature) || goes_on(other_feature, one))
        && overlap > -SAME_WALL * wide / 2.0;
    is_along
        && (is_rest || overlap > 0.5 * depth.min(other_depth))
        && (wide - other_wide).abs() < near
        && aside < near
}

/// Whether a wall is the half-round end of a slot: with the corners it may look like more than half
/// a turn.
fn is_slot_end(wall: &Wall, slots: &[Slot]) -> bool {
    slots.iter().any(|slot| {
        let is_wide = (2.0 * wall.radius() - slot.width).abs() < ALIKE * slot.width;
        let v = wall.at(wall.middle()) - slot.centre;
        let across = slot.out.cross(&slot.direction);
        let is_inside = v.dot(&across).abs() < ALIKE * slot.width
            && v.dot(&slot.direction).abs() < slot.length / 2.0;
        is_wide && is_inside
    })
}

/// Maximum difference of width and place between a slot and its end wall, in widths.
const ALIKE: f64 = 0.2;

/// Intersection of an axis with a surface, or end of the axis.
#[derive(Clone, Debug, Default)]
struct AxisEnd {
    /// place, with its uncertainty along the axis
    place: MeasuredValue<Point3<f64>>,
    /// standard deviation along the axis without the common error of all touches, m
    own_std: Option<f64>,
    /// common error of its touches along the axis, m
    systematic: f64,
}

/// Distance between two parallel ends along `direction`, with its uncertainty.
fn between(from: &AxisEnd, to: &AxisEnd, direction: &Vector3<f64>) -> MeasuredValue<f64> {
    // touched from one side, both ends share most of the common error of touches
    let common = NOT_ALIKE * from.systematic.hypot(to.systematic);
    let std = from
        .own_std
        .zip(to.own_std)
        .map(|(a, b)| a.hypot(b).hypot(common));
    let touches = distinct(from.place.touches.iter().chain(&to.place.touches).copied());
    MeasuredValue::new(
        (from.place.value - to.place.value).dot(direction).abs(),
        std,
        touches,
    )
}

/// Maximum residual of a touch over the edge of a wall that passes for one on the wall, in root mean
/// square residuals.
const OVER_SIGMAS: f64 = 3.0;

/// Distance between the ends of a wall. An untouched end of a touched wall may be a guess: the
/// distance is then the touched extent of the wall, a lower bound; `None`: it is touched along an edge
/// alone.
fn extent<S>(
    measure: &Measure,
    fitted: &FittedSurface<S>,
    from: &AxisEnd,
    to: &AxisEnd,
    out: &Vector3<f64>,
) -> Option<MeasuredValue<f64>> {
    let is_felt = [from, to].map(|end| !end.place.touches.is_empty());
    if fitted.to == FittedTo::Mesh || is_felt == [true; 2] {
        return Some(between(from, to, out));
    }
    let side = (to.place.value - from.place.value).dot(out).signum();
    let along = |point: &Point3<f64>| (point - from.place.value).dot(out) * side;
    let of_wall = || {
        fitted
            .touches
            .iter()
            .map(|&number| measure.observed.touch(number))
    };
    // of a touch the less far of its centre and its point by the measured normal
    let heights = of_wall().map(|touch| [along(&touch.centre), along(&touch.point)]);
    let (lowest, highest) = heights.fold((f64::MAX, f64::MIN), |(low, high), [a, b]| {
        (low.min(a.max(b)), high.max(a.min(b)))
    });
    let radius = of_wall().map(|touch| touch.radius).fold(0.0, f64::max);
    // over the edge the ball leaves the wall by its radius less its cosine
    let beyond = (2.0 * radius * OVER_SIGMAS * fitted.uneven).sqrt();
    let begin = if is_felt[0] { 0.0 } else { lowest + beyond };
    let end = if is_felt[1] {
        along(&to.place.value)
    } else {
        highest - beyond
    };
    (end > begin).then(|| MeasuredValue {
        value: end - begin,
        touches: fitted.touches.clone(),
        is_at_least: true,
        ..MeasuredValue::default()
    })
}

impl AxisEnd {
    /// Exit of the axis from plane or cylinder number `land`; else `point`.
    fn on(
        measure: &Measure,
        land: Option<usize>,
        point: &Point3<f64>,
        axis: &Vector3<f64>,
    ) -> Self {
        let on_plane = |number: usize| {
            let fitted = measure.plane(number)?;
            let place = fitted.met(point, axis)?;
            Some((fitted.own_std_at(&place.value), place))
        };
        let on_shaft = |number: usize| {
            let fitted = measure.shaft(number)?;
            let place = fitted.met(point, axis)?;
            Some((fitted.own_std_at(&place.value), place))
        };
        let met = land.and_then(|number| on_plane(number).or_else(|| on_shaft(number)));
        met.map_or_else(
            || Self::unknown(point),
            |(own_std, place)| Self::at(measure, place, own_std),
        )
    }

    fn at(measure: &Measure, place: MeasuredValue<Point3<f64>>, own_std: Option<f64>) -> Self {
        let [common, shift] = measure.observed.systematic(&place.touches);
        Self {
            place,
            own_std,
            systematic: common.hypot(shift),
        }
    }

    fn unknown(point: &Point3<f64>) -> Self {
        Self {
            place: MeasuredValue {
                value: *point,
                ..MeasuredValue::default()
            },
            ..Self::default()
        }
    }

    /// Centre of a feature with a fitted surface, at this end.
    ///
    /// - `std`: standard deviation of the centre, from the fit, m.
    fn centre<S: SurfaceModel>(
        &self,
        fitted: &FittedSurface<S>,
        std: impl Fn(&Fit<S>) -> Option<f64>,
    ) -> MeasuredValue<Point3<f64>> {
        let touches = distinct(fitted.touches.iter().chain(&self.place.touches).copied());
        MeasuredValue::new(self.place.value, fitted.confirmed().and_then(std), touches)
    }
}

/// Minimum touched share of a turn of a hole; less at a rim is a notch.
const WHOLE_TURN: f64 = 0.8;

fn hole_feature(measure: &Measure, walls: &[Wall], hole: &Hole) -> Feature {
    let wall = &walls[hole.wall];
    let fitted = measure.cylinder(wall, hole.rim);
    let axis = fitted.axis(&hole.out);
    let opening = AxisEnd::on(
        measure,
        hole.rim,
        &fitted.surface.nearest_on_axis(&hole.opening),
        &axis.value,
    );
    let bottom = fitted
        .surface
        .nearest_on_axis(&(hole.opening - hole.out * hole.depth));
    let floor = AxisEnd::on(measure, hole.floor, &bottom, &axis.value);
    // beside a touched wall an untouched floor may be a guess
    let is_known =
        hole.floor.is_none() || fitted.to == FittedTo::Mesh || !floor.place.touches.is_empty();
    let centre = opening.centre(&fitted, |fit| fit.lateral_std(&opening.place.value));
    let touched = measure.observed.touched_share(&wall.segments);
    // at a gap of the mesh the touches may go all around
    let is_notch =
        hole.is_notch && measure.turn(&fitted.touches, wall).max(wall.felt_turn) < WHOLE_TURN;
    let cone = hole.countersink.and_then(|cone| measure.cone(&walls[cone]));
    Feature {
        diameter: Some(fitted.number(2.0 * fitted.surface.radius, &[(Freedom::Size, 2.0)])),
        depth: extent(measure, &fitted, &opening, &floor, &axis.value),
        axis: Some(axis),
        through: hole.through.filter(|_| is_known),
        walls: Some(Walls::Round(fitted.surface)),
        form: measure.round_form(&fitted, &wall.segments).map(Form::Round),
        facets: measure.facets(&fitted.surface, &wall.segments),
        element: measure.axis_element(&fitted),
        cone_angle: cone.map(|cone| {
            cone.number(
                2.0 * cone.surface.half_angle.abs(),
                &[(Freedom::Second, 2.0)],
            )
        }),
        ..Feature::new(
            if is_notch {
                FeatureKind::Notch
            } else {
                FeatureKind::Hole
            },
            centre,
            touched,
            fitted.to,
        )
    }
}

/// Maximum distance of a rim from the axis, and from the ends, of its wall, in radii.
const OF_WALL: f64 = 0.5;

/// Whether a round opening is an end of a hole with this wall.
fn is_rim_of(wall: &Wall, rim: &RoundOpening) -> bool {
    let (v, near) = (rim.centre - wall.origin, OF_WALL * wall.radius());
    let along = v.dot(&wall.axis);
    let is_between = along > wall.ends[0] - near && along < wall.ends[1] + near;
    is_between && (v - wall.axis * along).norm() < near
}

/// A hole without a wall: its depth, and whether it goes through, are unknown.
fn rim_feature(measure: &Measure, rim: &RoundOpening) -> Feature {
    let (surface, fit, is_confirmed) = (
        rim.fit.surface,
        Some(rim.fit.clone()),
        !measure.observed.has_touches(),
    );
    let fitted = FittedSurface {
        surface,
        fit,
        touches: Vec::new(),
        to: FittedTo::Mesh,
        uneven: 0.0,
        is_confirmed,
    };
    let std = fitted
        .confirmed()
        .and_then(|fit| fit.lateral_std(&rim.centre));
    let centre = MeasuredValue::new(rim.centre, std, Vec::new());
    Feature {
        diameter: Some(fitted.number(2.0 * fitted.surface.radius, &[(Freedom::Size, 2.0)])),
        axis: Some(fitted.axis(&rim.out)),
        ..Feature::new(
            FeatureKind::Hole,
            centre,
            measure.observed.touched_at(&rim.corners),
            FittedTo::Mesh,
        )
    }
}

/// Maximum radius of an outline around the axis of its wall, in radii of the wall: broken edges and
/// fillets are between both.
const BROKEN_EDGE: f64 = 1.25;

/// Cuts into the planes of a drawing, and bosses on them, of any outline, except for these walls,
/// slots and pockets, and for spheres.
fn of_other_outline(measure: &Measure, round: &[&Wall], flat: &[&Slot]) -> Vec<Feature> {
    let parted = measure.observed.parted;
    if parted.rounding.is_none() {
        return Vec::new();
    }
    let mut is_known = vec![false; parted.segmentation.segments.len()];
    let of_round = round.iter().flat_map(|wall| wall.segments.iter().copied());
    let of_flat = flat.iter().flat_map(|slot| slot.segments());
    of_round
        .chain(of_flat)
        .for_each(|number| is_known[number] = true);
    for (is_known, segment) in is_known.iter_mut().zip(&parted.segmentation.segments) {
        *is_known |= matches!(segment.primitive, Primitive::Sphere(_));
    }
    let is_new = |outline: &OpeningOutline| {
        let (rim, radius) = (&outline.rim, outline.rim.fit.surface.radius);
        let is_broken = |wall: &&Wall| is_rim_of(wall, rim) && radius < BROKEN_EDGE * wall.radius();
        let is_of_slot = |slot: &&Slot| {
            let v = rim.centre - slot.centre;
            (v - slot.out * v.dot(&slot.out)).norm() < ALIKE * slot.width
        };
        !round.iter().any(is_broken) && !flat.iter().any(is_of_slot)
    };
    let named = |outline: OpeningOutline| Feature {
        kind: outline.kind,
        depth: Some(MeasuredValue::new(outline.depth, None, Vec::new())),
        through: outline.through,
        form: Some(Form::Round(outline.form)),
        ..rim_feature(measure, &outline.rim)
    };
    outlines(parted, &is_known)
        .into_iter()
        .filter(is_new)
        .map(named)
        .collect()
}

fn boss_feature(measure: &Measure, walls: &[Wall], boss: &Boss) -> Feature {
    let wall = &walls[boss.wall];
    let fitted = measure.cylinder(wall, Some(boss.base));
    let axis = fitted.axis(&boss.out);
    let foot = fitted.surface.nearest_on_axis(&boss.foot);
    let foot = AxisEnd::on(measure, Some(boss.base), &foot, &axis.value);
    let top = fitted
        .surface
        .nearest_on_axis(&(boss.foot + boss.out * boss.height));
    let top = AxisEnd::on(measure, boss.top, &top, &axis.value);
    let centre = foot.centre(&fitted, |fit| fit.lateral_std(&foot.place.value));
    Feature {
        diameter: Some(fitted.number(2.0 * fitted.surface.radius, &[(Freedom::Size, 2.0)])),
        depth: extent(measure, &fitted, &foot, &top, &axis.value),
        axis: Some(axis),
        walls: Some(Walls::Round(fitted.surface)),
        form: measure.round_form(&fitted, &wall.segments).map(Form::Round),
        facets: measure.facets(&fitted.surface, &wall.segments),
        element: measure.axis_element(&fitted),
        ..Feature::new(
            if boss.is_turned {
                FeatureKind::Cylinder
            } else {
                FeatureKind::Boss
            },
            centre,
            measure.observed.touched_share(&wall.segments),
            fitted.to,
        )
    }
}

fn cylinder_feature(measure: &Measure, wall: &Wall) -> Feature {
    let fitted = measure.cylinder(wall, None);
    let middle = fitted.surface.nearest_on_axis(&wall.at(wall.middle()));
    let std = fitted.confirmed().and_then(|fit| fit.lateral_std(&middle));
    let centre = MeasuredValue::new(middle, std, fitted.touches.clone());
    Feature {
        diameter: Some(fitted.number(2.0 * fitted.surface.radius, &[(Freedom::Size, 2.0)])),
        length: Some(MeasuredValue::new(wall.height(), None, Vec::new())),
        axis: Some(fitted.axis(&wall.axis)),
        walls: Some(Walls::Round(fitted.surface)),
        form: measure.round_form(&fitted, &wall.segments).map(Form::Round),
        facets: measure.facets(&fitted.surface, &wall.segments),
        element: measure.axis_element(&fitted),
        ..Feature::new(
            FeatureKind::Cylinder,
            centre,
            measure.observed.touched_share(&wall.segments),
            fitted.to,
        )
    }
}

fn slot_feature(measure: &Measure, slot: &Slot, kind: FeatureKind) -> Feature {
    let fitted = measure.stadium(slot);
    let axis = fitted.axis(&slot.out);
    let Stadium { width, length, .. } = fitted.surface;
    let is_fixed = |freedom: Freedom| {
        fitted
            .fit
            .as_ref()
            .is_some_and(|fit| fit.std(freedom).is_some())
    };
    let direction =
        fitted.surface.direction() * fitted.surface.direction().dot(&slot.direction).signum();
    // along the slot only its ends determine its position
    let start = fitted.surface.center();
    let along = if is_fixed(Freedom::X) {
        0.0
    } else {
        (slot.centre - start).dot(&direction)
    };
    let near = start + direction * along + axis.value * (slot.centre - start).dot(&axis.value);
    let opening = AxisEnd::on(measure, Some(slot.land), &near, &axis.value);
    let bottom = near - axis.value * slot.depth;
    let floor = AxisEnd::on(measure, slot.floor, &bottom, &axis.value);
    let centre = opening.centre(&fitted, Fit::middle_std);
    // touched walls end where the touches do, often far before the slot
    let has_length = fitted.to == FittedTo::Mesh || is_fixed(Freedom::Second);
    let length = if is_fixed(Freedom::Second) {
        length
    } else {
        slot.length
    };
    let half = direction * (length / 2.0);
    let touched = measure.observed.touched_share(&slot.walls);
    let depth = if slot.through == Some(true) && fitted.to == FittedTo::Mesh {
        Some(MeasuredValue::new(slot.depth, None, Vec::new()))
    } else {
        extent(measure, &fitted, &opening, &floor, &axis.value)
    };
    let segments: Vec<usize> = slot.segments().collect();
    Feature {
        facets: measure.facets(&fitted.surface, &segments),
        direction: Some(direction),
        width: Some(fitted.number(width, &[(Freedom::Size, 1.0)])),
        length: has_length.then(|| fitted.number(length, &[(Freedom::Second, 1.0)])),
        depth,
        axis: Some(axis),
        through: slot.through,
        walls: Some(Walls::Slot(fitted.surface)),
        points: vec![opening.place.value - half, opening.place.value + half],
        ..Feature::new(kind, centre, touched, fitted.to)
    }
}

/// [`FittedTo::Touches`] if all planes are fitted to touches, else the mesh.
fn fitted_to(planes: &[&FittedSurface<Plane>]) -> FittedTo {
    let is_touched = planes.iter().all(|plane| plane.to == FittedTo::Touches);
    if is_touched {
        FittedTo::Touches
    } else {
        FittedTo::Mesh
    }
}

/// Offset from both walls at which a concave edge counts as touched, in radii of the ball: touches
/// cover places within a radius.
const IN_CORNER: f64 = 0.5;

fn edge_feature(measure: &Measure, edge: &StraightEdge) -> Option<Feature> {
    let [a, b] = edge.planes.map(|number| measure.plane_beside_edge(number));
    let (a, b) = (a?, b?);
    let std_at = |side: usize, point: &Point3<f64>| [&a, &b][side].confirmed()?.std_at(point);
    let touches = distinct(a.touches.iter().chain(&b.touches).copied());
    let (axis, _, found) = Feature::crossing(
        [&a.surface, &b.surface],
        std_at,
        &edge.ends,
        edge.is_convex,
        touches,
    )?;
    // a ball that rests in a corner touches its walls one radius off the edge
    let reached = if edge.is_convex {
        0.0
    } else {
        IN_CORNER * measure.observed.reach()
    };
    let off = (a.surface.normal() + b.surface.normal()) * reached;
    let touched = measure
        .observed
        .touched_along(&[found.points[0] + off, found.points[1] + off]);
    Some(Feature {
        axis: Some(axis),
        touched,
        fitted_to: fitted_to(&[&a, &b]),
        ..found
    })
}

/// Maximum distance from a corner to the ends of its edges, in diagonals; the second for exact
/// planes: a larger distance means a round corner.
const SAME_CORNER: f64 = 0.02;
const SAME_EXACT_CORNER: f64 = 1e-4;

fn corners(parted: &SegmentedMesh, measure: &Measure, edges: &[StraightEdge]) -> Vec<Feature> {
    let mut found: Vec<([usize; 3], Feature)> = Vec::new();
    for (at, first) in edges.iter().enumerate() {
        for second in &edges[..at] {
            let planes = distinct([first.planes, second.planes].concat());
            let &[i, j, k] = planes.as_slice() else {
                continue;
            };
            let Some(corner) = corner_of(measure, [i, j, k]) else {
                continue;
            };
            let is_exact = planes.iter().all(|&number| parted.segment(number).is_exact);
            let near = if is_exact {
                SAME_EXACT_CORNER
            } else {
                SAME_CORNER
            } * parted.diagonal;
            let ends = |edge: &StraightEdge| {
                edge.ends
                    .iter()
                    .any(|end| (end - corner.centre.value).norm() < near)
            };
            let is_new = found.iter().all(|(planes, _)| *planes != [i, j, k]);
            if is_new && ends(first) && ends(second) {
                found.push(([i, j, k], corner));
            }
        }
    }
    found.into_iter().map(|(_, corner)| corner).collect()
}

/// Minimum volume that three unit normals span: 10° from a common plane.
const SPATIAL: f64 = 0.17;

fn corner_of(measure: &Measure, planes: [usize; 3]) -> Option<Feature> {
    let [a, b, c] = planes.map(|number| measure.plane(number));
    let planes = [a?, b?, c?];
    let normals = Matrix3::from_rows(&[0, 1, 2].map(|i| planes[i].surface.normal().transpose()));
    if normals.determinant().abs() < SPATIAL {
        return None;
    }
    let inverse = normals.try_inverse()?;
    let heights = Vector3::from_fn(|i, _| {
        planes[i]
            .surface
            .normal()
            .dot(&planes[i].surface.point().coords)
    });
    let point = Point3::from(inverse * heights);
    let stds = [0, 1, 2].map(|i| planes[i].confirmed().and_then(|fit| fit.std_at(&point)));
    let std = if let [Some(s), Some(t), Some(u)] = stds {
        let heights = Matrix3::from_diagonal(&Vector3::new(s * s, t * t, u * u));
        Some((inverse * heights * inverse.transpose()).trace().sqrt())
    } else {
        None
    };
    let touches = distinct(
        planes
            .iter()
            .flat_map(|plane| plane.touches.iter().copied()),
    );
    let touched = measure.observed.touched_along(&[point, point]);
    let to = fitted_to(&[&planes[0], &planes[1], &planes[2]]);
    Some(Feature::new(
        FeatureKind::Corner,
        MeasuredValue::new(point, std, touches),
        touched,
        to,
    ))
}

fn plane_feature(measure: &Measure, number: usize) -> Option<Feature> {
    let fitted = measure.plane(number)?;
    let (point, normal) = measure
        .observed
        .parted
        .plane(number)
        .map(|plane| (plane.point(), plane.normal()))?;
    let touched = measure.observed.touched_share(&[number]);
    let feature = Feature::new(
        FeatureKind::Plane,
        fitted.met(&point, &normal)?,
        touched,
        fitted.to,
    );
    Some(Feature {
        axis: Some(fitted.axis(&normal)),
        form: measure.flat_form(&fitted).map(Form::Flat),
        element: measure.plane_element(&fitted),
        ..feature
    })
}
