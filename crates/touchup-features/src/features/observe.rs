//! Assignment of touches to segments, and the observations of both for a fit.

use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use super::fit::{FitParams, Observation, SurfaceModel, TouchNoise, Visit};
use super::segmentation::facets::NONE;
use super::segmentation::marks::NumberSet;
use super::segmentation::primitive::Primitive;
use super::segmentation::scene::SegmentedMesh;
use touchup_geometry::mesh::{FaceId, TriMesh, VertexId};
use touchup_geometry::numeric::{PointGrid, VoxelKey, distinct, voxel_of};
use touchup_method::stylus::ProbedPoint;

/// The touches on a segmented mesh.
pub(super) struct SegmentTouches<'a> {
    pub parted: &'a SegmentedMesh<'a>,
    touches: &'a [ProbedPoint],
    /// numbers of the touches of each segment
    of_segment: Vec<Vec<u32>>,
    /// group with a shared error, by touch
    group: Vec<u32>,
    /// numbers of the touches by place
    grid: PointGrid,
    /// errors of the touches that do not repeat
    pub noise: TouchNoise,
    /// maximum distance from a touch to a touched place, m
    reach: f64,
}

/// Touches of one stroke within this time share their error: the smoothing window, and half of it
/// again.
const SHARED_NS: i64 = 100_000_000;
/// Maximum step between the numbers of two groups: 7 min, beyond each wander, so that a clock that
/// jumps by years leaves numbers for all groups.
const FARTHEST: i64 = 4096;
/// Share of the common errors of touches on one plane that those of another do not have: poses
/// wander slowly, and the stylus leans otherwise.
pub(super) const NOT_ALIKE: f64 = 0.33;
/// Maximum distance of a touch from its segment, in tolerances.
const NEAR_TOLERANCES: f64 = 3.0;
/// The same, as a share of the radius of the ball: for errors of the scan and noise.
const NEAR_RADII: f64 = 0.15;
/// Cosine of the tolerance of its normal: 40°, friction and edges.
const ALIKE: f64 = 0.77;
/// Cosine of the maximum lean of a normal from a face: 14°, friction; on an edge it leans more.
const ON_FACE: f64 = 0.97;
/// Maximum distance of a touched place for a tip without a ball, m.
const REACH: f64 = 1e-3;
/// Minimum standard deviation, m: unstated ones follow from the residuals.
const LEAST_SIGMA: f64 = 1e-6;
/// Minimum weight of a touch.
const LEAST_WEIGHT: f64 = 0.01;
/// Number of points of a flat face of a drawing in a fit.
const SAMPLES: usize = 60;
/// Maximum number of vertices in a fit.
const MOST_VERTICES: usize = 1500;
/// Minimum number of selected vertices; with fewer, all count.
const LEAST_ON: usize = 8;
/// Maximum number of faces around a vertex for the chord test.
const MOST_AROUND: usize = 32;
/// Cosine of the tolerance between a line and the straight lines of a round surface: 25°.
const STRAIGHT: f64 = 0.9;
/// Maximum number of faces that are tested for touches.
const MOST_FACES: usize = 400;
/// Vertices of a measured mesh within this number of edges share their error.
const SHARED_EDGES: f64 = 3.0;

impl<'a> SegmentTouches<'a> {
    /// - `of_face`: the segment of each face, seams included.
    pub(crate) fn of(
        parted: &'a SegmentedMesh<'a>,
        of_face: &[u32],
        touches: &'a [ProbedPoint],
    ) -> Self {
        let reach = touches.iter().map(|touch| touch.radius).fold(0.0, f64::max);
        let reach = if reach > 0.0 { reach } else { REACH };
        let mut observed = Self {
            parted,
            touches,
            of_segment: vec![Vec::new(); parted.segmentation.segments.len()],
            group: groups(touches),
            grid: PointGrid::new(reach),
            noise: TouchNoise::default(),
            reach,
        };
        let mut is_placed = vec![false; touches.len()];
        for (segment, of) in parted.segmentation.segments.iter().enumerate() {
            for felt in &of.felt {
                is_placed[felt.touch as usize] = true;
                observed.grid.insert(felt.touch, &felt.place);
            }
            observed.of_segment[segment].extend(of.touches());
        }
        for (number, touch) in touches
            .iter()
            .enumerate()
            .filter(|(number, touch)| !touch.is_rejected && !is_placed[*number])
        {
            if let Some(segment) = observed.segment_of(of_face, touch) {
                observed.of_segment[segment].push(number as u32);
                observed.grid.insert(number as u32, &touch.point);
            }
        }
        observed
            .of_segment
            .iter_mut()
            .for_each(|of| of.sort_unstable());
        let visits = (0..observed.of_segment.len()).map(|segment| observed.visits(segment));
        observed.noise = TouchNoise::of(visits, reach);
        observed
    }

    /// Visits of the stylus to a segment, without touches of its edges.
    fn visits(&self, segment: usize) -> Vec<Visit> {
        let primitive = &self.parted.segment(segment).primitive;
        let on_face = |&number: &u32| {
            let touch = self.touch(number);
            let (distance, normal) = primitive.distance_and_normal(&touch.centre);
            let visit = Visit {
                group: self.group[number as usize],
                // its error must not choose its place
                point: touch.centre - normal * distance,
                residual: distance - touch.radius,
            };
            (normal.dot(&touch.normal) > ON_FACE).then_some(visit)
        };
        let touches: Vec<Visit> = self.of_segment[segment]
            .iter()
            .filter_map(on_face)
            .collect();
        touches
            .chunk_by(|a, b| a.group == b.group)
            .map(Visit::joined)
            .collect()
    }

    fn segment_of(&self, of_face: &[u32], touch: &ProbedPoint) -> Option<usize> {
        let hit = self
            .parted
            .tree
            .closest(self.parted.facets.mesh, &touch.point, self.reach)?;
        let number = of_face[hit.face.0 as usize];
        if number == NONE {
            return None;
        }
        let segment = self.parted.segment(number as usize);
        let near = (NEAR_TOLERANCES * segment.tolerance).max(NEAR_RADII * self.reach);
        let (distance, normal) = segment.primitive.distance_and_normal(&touch.centre);
        let is_of = (distance - touch.radius).abs() < near && normal.dot(&touch.normal) > ALIKE;
        is_of.then_some(number as usize)
    }

    /// Numbers of the touches of some segments, in ascending order.
    pub(crate) fn touches_of(&self, segments: &[usize]) -> Vec<u32> {
        let mut touches: Vec<u32> = segments
            .iter()
            .flat_map(|&number| &self.of_segment[number])
            .copied()
            .collect();
        touches.sort_unstable();
        touches
    }

    /// Numbers of the touches on a surface, in ascending order.
    ///
    /// - `is_of`: whether a point of the surface is in the relevant part.
    pub(crate) fn touches_on(
        &self,
        surface: &impl SurfaceModel,
        is_of: impl Fn(&Point3<f64>) -> bool,
    ) -> Vec<u32> {
        let is_on = |touch: &ProbedPoint| {
            let (distance, normal) = surface.distance_and_normal(&touch.centre);
            let is_near = (distance - touch.radius).abs() < NEAR_RADII * self.reach;
            is_near && normal.dot(&touch.normal) > ALIKE && is_of(&touch.point)
        };
        let numbers = (0..)
            .zip(self.touches)
            .filter(|(_, touch)| !touch.is_rejected && is_on(touch));
        numbers.map(|(number, _)| number).collect()
    }

    /// Observations of touches for a fit.
    pub(crate) fn of_touches(&self, numbers: &[u32]) -> Vec<Observation> {
        let observation = |&number: &u32| {
            observation(&self.touches[number as usize], self.group[number as usize])
        };
        numbers.iter().map(observation).collect()
    }

    /// Places of edges of some segments over which the ball rolled, as observations, with the
    /// numbers of their touches.
    pub(crate) fn of_edges(&self, segments: &[usize]) -> (Vec<u32>, Vec<Observation>) {
        let felt = segments
            .iter()
            .flat_map(|&number| &self.parted.segment(number).felt);
        let at_edge = felt.filter_map(|felt| {
            let number = felt.touch;
            let observation = observation(self.touch(number), self.group[number as usize]);
            let sigma = observation.sigma * felt.at_edge?;
            Some((
                number,
                Observation {
                    point: felt.place,
                    offset: 0.0,
                    sigma,
                    ..observation
                },
            ))
        });
        at_edge.unzip()
    }

    /// As [`fit_params`].
    pub(crate) fn fit_params(&self, numbers: &[u32]) -> FitParams {
        fit_params(self.systematic(numbers), self.noise)
    }

    /// Standard deviations that do not average out, m: common error of all touches along their
    /// normals, and their common displacement.
    pub(crate) fn systematic(&self, numbers: &[u32]) -> [f64; 2] {
        systematic(numbers.iter().map(|&number| &self.touches[number as usize]))
    }

    /// Whether the part has any touch.
    pub(crate) fn has_touches(&self) -> bool {
        !self.touches.is_empty()
    }

    /// Maximum distance from a touch to a touched place, m: the radius of the ball.
    pub(crate) fn reach(&self) -> f64 {
        self.reach
    }

    pub(crate) fn touch(&self, number: u32) -> &ProbedPoint {
        &self.touches[number as usize]
    }

    /// Observations of the mesh for a fit.
    pub(crate) fn of_mesh(&self, segments: &[usize]) -> Vec<Observation> {
        let mesh = self.parted.facets.mesh;
        let vertices = self.vertices_of(segments);
        let step = vertices.len().div_ceil(MOST_VERTICES).max(1);
        let segment = self.parted.segment(segments[0]);
        // in a drawing the residuals show errors above rounding
        let sigma = self.parted.rounding.unwrap_or(segment.tolerance) / 6.0;
        let cell = SHARED_EDGES * self.parted.edge;
        let mut cells: BTreeMap<VoxelKey, u32> = BTreeMap::new();
        let observation = |(own, vertex): (u32, VertexId)| {
            let point = mesh.position(vertex);
            let group = match self.parted.rounding {
                Some(_) => own,
                None => *cells.entry(voxel_of(&point, cell)).or_insert(own),
            };
            Observation {
                point,
                offset: 0.0,
                sigma,
                group,
            }
        };
        (0..)
            .zip(vertices.into_iter().step_by(step))
            .map(observation)
            .collect()
    }

    /// Distance of a measured mesh's faces from a surface of a radius, m; 0 in a drawing, with
    /// corners on it.
    pub(crate) fn sagitta(&self, radius: f64) -> f64 {
        match self.parted.rounding {
            Some(_) => 0.0,
            None => self.parted.edge.powi(2) / (8.0 * radius),
        }
    }

    /// Observations of a segment for a fit: its vertices, or points all over it if it is flat in a
    /// drawing, as its few corners may all lie at its ends.
    pub(crate) fn of_mesh_surface(&self, number: usize) -> Vec<Observation> {
        match self
            .parted
            .rounding
            .filter(|_| self.parted.plane(number).is_some())
        {
            None => self.of_mesh(&[number]),
            Some(rounding) => {
                let point = |(group, point)| Observation {
                    point,
                    offset: 0.0,
                    sigma: rounding / 6.0,
                    group,
                };
                (0..).zip(samples(self.parted, number)).map(point).collect()
            }
        }
    }

    /// The vertices of some segments, in ascending order; of round ones in a drawing without those
    /// on chords: a tessellation puts corners of neighbours there, off the surface.
    fn vertices_of(&self, segments: &[usize]) -> Vec<VertexId> {
        let SegmentedMesh {
            facets,
            segmentation,
            rounding,
            ..
        } = self.parted;
        let mesh = facets.mesh;
        let mut vertices = NumberSet::below(mesh.vertex_slots());
        for &face in segments
            .iter()
            .flat_map(|&number| &self.parted.segment(number).faces)
        {
            mesh.corners(FaceId(face))
                .iter()
                .for_each(|vertex| vertices.add(vertex.0));
        }
        let vertices: Vec<VertexId> = vertices.iter().map(VertexId).collect();
        let primitive = self.parted.segment(segments[0]).primitive;
        let Some(rounding) = rounding.filter(|_| primitive.plane().is_none()) else {
            return vertices;
        };
        let is_of =
            |face: &FaceId| segments.contains(&(segmentation.of_face[face.0 as usize] as usize));
        let is_on = |&vertex: &VertexId| {
            let faces: Vec<FaceId> = mesh.star(vertex).iter().copied().filter(is_of).collect();
            !is_on_chord(mesh, vertex, &faces, &primitive, rounding)
        };
        let on: Vec<VertexId> = vertices.iter().copied().filter(is_on).collect();
        if on.len() < LEAST_ON { vertices } else { on }
    }

    /// Touched share of the area of some segments.
    pub(crate) fn touched_share(&self, segments: &[usize]) -> f64 {
        if self.touches.is_empty() {
            return 0.0;
        }
        let (mut touched, mut all) = (0.0, f64::MIN_POSITIVE);
        for &number in segments {
            let faces = &self.parted.segment(number).faces;
            for &face in faces
                .iter()
                .step_by(faces.len().div_ceil(MOST_FACES).max(1))
            {
                let area = self.parted.facets.area(face);
                let middle = self.parted.facets.mesh.barycentre(FaceId(face));
                all += area;
                if self.is_touched(&middle) {
                    touched += area;
                }
            }
        }
        touched / all
    }

    /// Touched share of a line between two places.
    pub(crate) fn touched_along(&self, [from, to]: &[Point3<f64>; 2]) -> f64 {
        let count = (((to - from).norm() / self.reach).ceil() as usize).clamp(1, MOST_FACES);
        let at = |i: usize| from + (to - from) * ((i as f64 + 0.5) / count as f64);
        (0..count).filter(|&i| self.is_touched(&at(i))).count() as f64 / count as f64
    }

    /// Touched share of some places.
    pub(crate) fn touched_at(&self, places: &[Point3<f64>]) -> f64 {
        places.iter().filter(|p| self.is_touched(p)).count() as f64 / places.len().max(1) as f64
    }

    fn is_touched(&self, p: &Point3<f64>) -> bool {
        self.grid.near(p, self.reach).next().is_some()
    }
}

/// Observation of a touch for a fit.
pub(super) fn observation(touch: &ProbedPoint, group: u32) -> Observation {
    let ProbedPoint {
        centre,
        radius,
        sigma,
        weight,
        ..
    } = *touch;
    let sigma = (sigma / weight.max(LEAST_WEIGHT).sqrt()).max(LEAST_SIGMA);
    Observation {
        point: centre,
        offset: radius,
        sigma,
        group,
    }
}

/// Parameters of a fit to touches, without a prior axis.
///
/// - `systematic`: as of [`SegmentTouches::systematic`].
pub(super) fn fit_params(systematic: [f64; 2], noise: TouchNoise) -> FitParams {
    let [common_sigma, shift_sigma] = systematic;
    FitParams {
        common_sigma,
        shift_sigma,
        noise,
        ..FitParams::default()
    }
}

/// As [`SegmentTouches::systematic`]: a displacement of some of the touches against the others, by
/// what changed between them, is in the sizes.
pub(super) fn systematic<'a>(touches: impl Iterator<Item = &'a ProbedPoint>) -> [f64; 2] {
    let (sums, count) = touches.fold(
        ([0.0; 3], 0.0f64),
        |([common, shift, square], count), touch| {
            let ProbedPoint {
                calibration, place, ..
            } = *touch;
            (
                [common + calibration, shift + place, square + place * place],
                count + 1.0,
            )
        },
    );
    let [common, shift, square] = sums.map(|sum| sum / count.max(1.0));
    let spread = (square - shift * shift).max(0.0).sqrt();
    [common.hypot(spread), shift]
}

/// Points of a segment, spread over its faces.
fn samples(parted: &SegmentedMesh, number: usize) -> Vec<Point3<f64>> {
    let faces = &parted.segment(number).faces;
    let step = faces.len().div_ceil(SAMPLES).max(1);
    let each = (SAMPLES / faces.len().max(1)).clamp(1, 16);
    let rows = (each as f64).sqrt() as usize;
    let mut points = Vec::new();
    for &face in faces.iter().step_by(step) {
        let [a, b, c] = parted.facets.triangle(face);
        for k in 0..rows * rows {
            // a lattice of the unit square, folded onto the triangle
            let (u, v) = ((k % rows) as f64 + 0.4, (k / rows) as f64 + 0.4);
            let (u, v) = (u / rows as f64, v / rows as f64);
            let (u, v) = if u + v > 1.0 {
                (1.0 - u, 1.0 - v)
            } else {
                (u, v)
            };
            points.push(a + (b - a) * u + (c - a) * v);
        }
    }
    points
}

/// Whether a vertex is between two others of its faces on a line other than the straight lines of
/// the surface.
fn is_on_chord(
    mesh: &TriMesh,
    vertex: VertexId,
    faces: &[FaceId],
    primitive: &Primitive,
    rounding: f64,
) -> bool {
    if faces.len() > MOST_AROUND {
        return false;
    }
    let p = mesh.position(vertex);
    let straight = match primitive {
        Primitive::Plane(_) => return false,
        Primitive::Cylinder(cylinder) => cylinder.axis(),
        Primitive::Cone(cone) => cone
            .apex()
            .and_then(|apex| (p - apex).try_normalize(0.0))
            .unwrap_or_default(),
        // it has no straight lines
        Primitive::Sphere(_) => Vector3::zeros(),
    };
    let around = distinct(faces.iter().flat_map(|&face| mesh.corners(face)));
    let around: Vec<Point3<f64>> = around
        .into_iter()
        .map(|other| mesh.position(other))
        .filter(|q| *q != p)
        .collect();
    let is_between = |a: &Point3<f64>, b: &Point3<f64>| {
        if (p - a).dot(&(p - b)) >= 0.0 {
            return false;
        }
        let Some(direction) = (b - a).try_normalize(0.0) else {
            return false;
        };
        let v = p - a;
        let off = (v - direction * v.dot(&direction)).norm();
        off < rounding && direction.dot(&straight).abs() < STRAIGHT
    };
    around
        .iter()
        .any(|a| around.iter().any(|b| is_between(a, b)))
}

/// Numbers of the groups of touches that share their error, by their time: they ascend, by one in
/// [`SHARED_NS`] or, for a new stroke, earlier.
pub(super) fn groups(touches: &[ProbedPoint]) -> Vec<u32> {
    // stamp of group 0
    let mut origin = touches.first().map_or(0, |touch| touch.stamp_ns);
    // stroke, begin and number of the last group
    let mut last: Option<(u32, i64, u32)> = None;
    let mut number = |touch: &ProbedPoint| match last {
        Some((stroke, begun, group))
            if touch.stroke == stroke
                && (-SHARED_NS..SHARED_NS).contains(&touch.stamp_ns.saturating_sub(begun)) =>
        {
            group
        }
        before => {
            let next = before.map_or(0, |(.., group)| i64::from(group) + 1);
            let by_time = touch.stamp_ns.saturating_sub(origin) / SHARED_NS;
            let group = by_time.clamp(next, next + FARTHEST);
            let is_back = before.is_some_and(|(_, begun, _)| touch.stamp_ns < begun);
            if is_back || by_time > group {
                // another clock
                origin = touch.stamp_ns.saturating_sub(group * SHARED_NS);
            }
            let group = u32::try_from(group).unwrap_or(u32::MAX);
            last = Some((touch.stroke, touch.stamp_ns, group));
            group
        }
    };
    touches.iter().map(&mut number).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn touch((ms, stroke): (i64, u32)) -> ProbedPoint {
        ProbedPoint {
            stamp_ns: 7_000_000_000 + ms * 1_000_000,
            stroke,
            centre: Point3::origin(),
            radius: 1e-3,
            point: Point3::origin(),
            normal: Vector3::z(),
            sigma: 1e-6,
            calibration: 0.0,
            place: 0.0,
            weight: 1.0,
            is_rejected: false,
        }
    }

    /// Half of the touches displaced by ± 4 µm against the others, or all of them.
    #[test]
    fn a_displacement_between_touches_is_in_their_sizes() {
        let of = |places: [f64; 4]| {
            let touches = places.map(|place| ProbedPoint {
                calibration: 1e-6,
                place: place * 1e-6,
                ..touch((0, 0))
            });
            systematic(touches.iter()).map(|sigma| sigma * 1e6)
        };
        let is = |found: [f64; 2], expected: [f64; 2]| {
            let off = [0, 1].map(|at| (found[at] - expected[at]).abs());
            assert!(off[0].max(off[1]) < 1e-9, "{found:?}");
        };
        is(of([0.0, 0.0, 4.0, 4.0]), [5f64.sqrt(), 2.0]);
        is(of([4.0; 4]), [1.0, 4.0]);
    }

    /// Stamps in ms and strokes; the third touch begins a group of its own, and the second stroke
    /// another one within the same tenth of a second.
    #[test]
    fn numbers_of_groups_tell_their_time() {
        let touches = [
            (0, 0),
            (99, 0),
            (100, 0),
            (5000, 0),
            (5020, 1),
            (5119, 1),
            (4000, 2),
            // the clock went back, and goes on from there
            (4600, 2),
            // twenty years
            (630_000_000_000, 2),
            (630_000_001_000, 2),
        ];
        let numbers = [0, 0, 1, 50, 51, 51, 52, 58, 4155, 4165];
        assert_eq!(groups(&touches.map(touch)), numbers);
        assert!(groups(&[]).is_empty());
    }
}
