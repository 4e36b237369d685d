//! Surfaces of features, fitted to touches or to the mesh.

use std::cell::RefCell;
use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use super::feature::{FittedTo, MeasuredValue};
use super::fit::{
    Cone, Cylinder, Ends, Fit, FitParams, Freedom, Observation, Plane, Sphere, Stadium,
    SurfaceModel, fit, fit_mesh,
};
use super::observe::SegmentTouches;
use super::segmentation::primitive::Primitive;
use super::voids::Slot;
use super::walls::{ALL_AROUND, Wall};
use touchup_geometry::numeric::{order_statistic, spreads, tangent_basis};
use touchup_method::stylus::ProbedPoint;

/// A fitted surface and its data.
#[derive(Clone, Debug)]
pub(super) struct FittedSurface<S> {
    pub surface: S,
    /// `None` if no fit held: the surface comes from the segments
    pub fit: Option<Fit<S>>,
    /// numbers of the used touches
    pub touches: Vec<u32>,
    pub to: FittedTo,
    /// root mean square residual, m
    pub uneven: f64,
    /// whether the residuals give the error of the surface: true for touches, and for a mesh
    /// without touches; beside touches, an untouched surface may be off as a whole
    pub is_confirmed: bool,
}

/// Fits surfaces; each plane once.
pub(super) struct Measure<'a> {
    pub observed: &'a SegmentTouches<'a>,
    planes: RefCell<BTreeMap<usize, FittedSurface<Plane>>>,
}

/// Minimum number of touches on a surface; fewer leave it to the mesh.
pub const LEAST_TOUCHES: usize = 12;
/// Minimum touched share of a turn; less leaves the wall to the mesh.
pub const LEAST_TURN: f64 = 0.4;
/// Minimum ratio of transverse to longest spread of touches on a plane; less leaves it to the mesh.
const LEAST_SPREAD: f64 = 0.1;
/// Minimum ratio of the transverse spread of touches beside an edge to the spread of the mesh.
const LEAST_STRIP: f64 = 0.4;
/// Number of parts of a turn.
const PARTS: usize = 24;
/// Minimum touched height of a wall for an axis of its own, in diameters; below it the plane around
/// the wall gives the axis.
const SHORT: f64 = 0.35;
/// Maximum distance of a touch from the outline of its slot, in widths of the slot.
const BESIDE: f64 = 0.15;
/// Maximum distance from an end of a wall to a touch of the edge there, in radii of the ball.
const OVER_END: f64 = 0.3;
/// Minimum lean of the normal at that edge towards the end of the wall, rad: 15°.
const OVER_END_LEAN: f64 = 0.26;
/// Maximum leans in order of trial, sines: 9°, which friction leaves, and 12°.
const LEANS: [f64; 2] = [0.15, 0.2];
/// Perpendicularity of a drilled hole or milled slot to the plane around it, rad: 0.5°.
const DRILLED: f64 = 0.0087;

/// Whether the ball touched the edge at an end of a wall: there the ball is nearer to the axis, or
/// farther from it, than beside the wall.
fn is_over_end(touch: &ProbedPoint, wall: &Wall) -> bool {
    let along = (touch.point - wall.origin).dot(&wall.axis);
    let lean = touch.normal.dot(&wall.axis);
    let to_end = if lean > 0.0 {
        wall.ends[1] - along
    } else {
        along - wall.ends[0]
    };
    lean.abs() > OVER_END_LEAN && to_end < OVER_END * touch.radius
}

impl<'a> Measure<'a> {
    pub(crate) fn new(observed: &'a SegmentTouches<'a>) -> Self {
        Self {
            observed,
            planes: RefCell::new(BTreeMap::new()),
        }
    }

    /// The plane of a segment.
    pub(crate) fn plane(&self, number: usize) -> Option<FittedSurface<Plane>> {
        if let Some(known) = self.planes.borrow().get(&number) {
            return Some(known.clone());
        }
        let guess = self.observed.parted.plane(number)?;
        // two lines far apart are as good as a field
        let fitted = self.plane_by(number, guess, |[_, second, first]| {
            second > LEAST_SPREAD * first
        });
        self.planes.borrow_mut().insert(number, fitted.clone());
        Some(fitted)
    }

    /// The plane of a segment beside an edge: a strip of touches along the edge places the plane,
    /// if wide in comparison with the mesh of the plane. `None` for other segments.
    pub(crate) fn plane_beside_edge(&self, number: usize) -> Option<FittedSurface<Plane>> {
        let plane = self.plane(number)?;
        if plane.to == FittedTo::Touches {
            return Some(plane);
        }
        let guess = self.observed.parted.plane(number)?;
        let [_, of_mesh, _] = spreads(
            self.observed
                .of_mesh(&[number])
                .iter()
                .map(|one| one.point - guess.point()),
        );
        let is_wide = |[_, second, _]: [f64; 3]| second > LEAST_STRIP * of_mesh;
        let first = self.plane_by(number, guess, is_wide);
        // a mesh rounds the corner between two walls and leans there: the first plane selects other
        // touches than the mesh does
        let is_felt = first.to == FittedTo::Touches;
        Some(if is_felt {
            self.plane_by(number, &first.surface, is_wide)
        } else {
            first
        })
    }

    /// - `is_wide`: whether touches with these spreads in three directions, m, ascending, are
    ///   enough.
    fn plane_by(
        &self,
        number: usize,
        guess: &Plane,
        is_wide: impl Fn([f64; 3]) -> bool,
    ) -> FittedSurface<Plane> {
        let all = self.observed.touches_of(&[number]);
        let is_inside = self.inside(&all, &guess.normal());
        let spread = |touches: &[u32]| {
            spreads(
                touches
                    .iter()
                    .map(|&number| self.observed.touch(number).point - guess.point()),
            )
        };
        let is_enough =
            |touches: &[u32]| touches.len() >= LEAST_TOUCHES && is_wide(spread(touches));
        let lean = |touch: &ProbedPoint| {
            (1.0 - touch.normal.dot(&guess.normal()).powi(2))
                .max(0.0)
                .sqrt()
        };
        let touches = self.squarest(all, lean, is_inside, is_enough);
        self.fitted(
            guess,
            touches,
            &self.observed.of_mesh(&[number]),
            None,
            None,
        )
    }

    /// The cylinder of a segment; `None` for other segments.
    pub(crate) fn shaft(&self, number: usize) -> Option<FittedSurface<Cylinder>> {
        let Primitive::Cylinder(guess) = self.observed.parted.segment(number).primitive else {
            return None;
        };
        Some(self.fitted_if_felt(number, &guess))
    }

    /// The sphere of a segment; `None` for other segments.
    pub(crate) fn sphere(&self, number: usize) -> Option<FittedSurface<Sphere>> {
        let Primitive::Sphere(guess) = self.observed.parted.segment(number).primitive else {
            return None;
        };
        Some(self.fitted_if_felt(number, &guess))
    }

    /// A surface by the touches of its segment, if enough, else by its mesh.
    fn fitted_if_felt<S: SurfaceModel>(&self, number: usize, guess: &S) -> FittedSurface<S> {
        let mut touches = self.observed.touches_of(&[number]);
        if touches.len() < LEAST_TOUCHES {
            touches.clear();
        }
        let of_mesh = self.observed.of_mesh(&[number]);
        self.fitted(guess, touches, &of_mesh, None, None)
    }

    /// The cylinder of a wall.
    ///
    /// - `rim`: number of the plane around its opening.
    pub(crate) fn cylinder(&self, wall: &Wall, rim: Option<usize>) -> FittedSurface<Cylinder> {
        let mut touches = self.touches_around(wall);
        let mut observations = self.observed.of_touches(&touches);
        if touches.is_empty() {
            // the ball rolled over its edge alone
            let (at_edge, of_edge) = self.observed.of_edges(&wall.segments);
            if at_edge.len() >= LEAST_TOUCHES && self.turn(&at_edge, wall) >= LEAST_TURN {
                (touches, observations) = (at_edge, of_edge);
            }
        }
        let (mut axis, mut axis_sigma) = (wall.axis, None);
        let height = if touches.is_empty() {
            wall.height()
        } else {
            self.height(&touches, wall)
        };
        if height < SHORT * 2.0 * wall.radius()
            && let Some(plane) = rim.and_then(|rim| self.plane(rim))
        {
            (axis, axis_sigma) = (plane.surface.normal(), Some(DRILLED));
        }
        let guess = Cylinder::new(
            wall.at(wall.middle()),
            &axis,
            wall.radius(),
            wall.is_concave,
        );
        self.fitted_to(
            (touches, observations),
            &guess,
            &self.observed.of_mesh(&wall.segments),
            axis_sigma,
            rim,
        )
    }

    /// The cone of a wall; `None` for a cylinder.
    pub(crate) fn cone(&self, wall: &Wall) -> Option<FittedSurface<Cone>> {
        let guess = Cone::new(
            wall.at(wall.middle()),
            &wall.axis,
            wall.radius(),
            wall.half_angle?,
            wall.is_concave,
        );
        Some(self.fitted(
            &guess,
            self.touches_around(wall),
            &self.observed.of_mesh(&wall.segments),
            None,
            None,
        ))
    }

    /// The touches of a wall, if enough in number and around the axis; else none.
    fn touches_around(&self, wall: &Wall) -> Vec<u32> {
        let mut touches = self.observed.touches_of(&wall.segments);
        touches.retain(|&number| !is_over_end(self.observed.touch(number), wall));
        let is_enough = |touches: &[u32]| {
            touches.len() >= LEAST_TOUCHES && self.turn(touches, wall) >= LEAST_TURN
        };
        if wall.is_cone() {
            return if is_enough(&touches) {
                touches
            } else {
                Vec::new()
            };
        }
        // beside a gap of the wall the ball rolls over an edge along the axis too
        let is_whole = self.turn(&touches, wall) > ALL_AROUND;
        self.squarest(
            touches,
            |touch| {
                if is_whole {
                    return touch.normal.dot(&wall.axis).abs();
                }
                let v = touch.centre - wall.origin;
                let radial = v - wall.axis * v.dot(&wall.axis);
                radial.cross(&touch.normal).norm() / radial.norm()
            },
            |_| true,
            is_enough,
        )
    }

    /// The touches whose normals lean least off the normals of their surface, if enough; none if
    /// all are too few. A ball that rolls over an edge leans more and more, and its centre comes
    /// nearer to the surface than its radius.
    ///
    /// - `lean`: sine of the angle between the normal of a touch and the normals of the surface.
    /// - `is_inside`: whether a leaning touch is on the surface and not on its edge.
    fn squarest(
        &self,
        mut touches: Vec<u32>,
        lean: impl Fn(&ProbedPoint) -> f64,
        is_inside: impl Fn(&ProbedPoint) -> bool,
        is_enough: impl Fn(&[u32]) -> bool,
    ) -> Vec<u32> {
        for most in LEANS {
            let is_square = |&number: &u32| lean(self.observed.touch(number)) < most;
            let square: Vec<u32> = touches.iter().copied().filter(is_square).collect();
            if is_enough(&square) {
                return square;
            }
        }
        touches.retain(|&number| is_inside(self.observed.touch(number)));
        if is_enough(&touches) {
            touches
        } else {
            Vec::new()
        }
    }

    /// Whether the centre of a ball is above the touched part of a plane: over an edge the centre
    /// goes on while the contact stays.
    fn inside(
        &self,
        touches: &[u32],
        normal: &Vector3<f64>,
    ) -> impl Fn(&ProbedPoint) -> bool + use<> {
        let [u, v] = tangent_basis(normal);
        let farthest = [u, -u, v, -v, u + v, u - v, v - u, -u - v].map(|way| {
            let along = touches
                .iter()
                .map(|&number| self.observed.touch(number).point.coords.dot(&way));
            (way, along.fold(f64::NEG_INFINITY, f64::max))
        });
        move |touch| {
            let mut all = farthest.iter();
            all.all(|(way, most)| touch.centre.coords.dot(way) <= *most)
        }
    }

    /// The walls of a slot or pocket.
    pub(crate) fn stadium(&self, slot: &Slot) -> FittedSurface<Stadium> {
        let ends = slot.shape;
        let land = self
            .plane(slot.land)
            .map_or(slot.out, |land| land.surface.normal());
        let centre = slot.centre - slot.out * (slot.depth / 2.0);
        let guess = Stadium::new(
            centre,
            &land,
            &slot.direction,
            [slot.width, slot.length],
            ends,
            true,
        );
        // walls and ends may go on beyond the slot, and its corners may be round
        let is_of = |p: &Point3<f64>, is_wall: bool| {
            let q = guess.pose_of.inverse_transform_point(p);
            let room = BESIDE * slot.width * if ends == Ends::Round { 1.0 } else { -1.0 };
            let (half_length, half_width) = (slot.length / 2.0, slot.width / 2.0);
            if is_wall {
                q.x.abs() < half_length + room.min(0.0)
            } else {
                q.y.abs() < half_width + room
            }
        };
        let of_part = |segments: &[usize], is_wall: bool| {
            let mut of_mesh: Vec<Observation> = segments
                .iter()
                .flat_map(|&number| self.observed.of_mesh_surface(number))
                .collect();
            of_mesh.retain(|observation| is_of(&observation.point, is_wall));
            of_mesh
        };
        let ends_of: Vec<usize> = slot.ends.into_iter().flatten().collect();
        let of_mesh = [of_part(&slot.walls, true), of_part(&ends_of, false)].concat();
        let felt = self.felt_walls(slot, &guess, |p| is_of(p, true));
        self.fitted_to(felt, &guess, &of_mesh, Some(DRILLED), Some(slot.land))
    }

    /// The touches on the walls and ends of a slot, with their observations: else those on the edges
    /// of these; none if they are too few on one side.
    ///
    /// - `is_of_wall`: whether a place along the slot is on its walls.
    fn felt_walls(
        &self,
        slot: &Slot,
        guess: &Stadium,
        is_of_wall: impl Fn(&Point3<f64>) -> bool,
    ) -> (Vec<u32>, Vec<Observation>) {
        let is_on_side = |number: &&u32, side: f64| {
            let point = self.observed.touch(**number).point;
            let q = guess.pose_of.inverse_transform_point(&point);
            q.y * side > 0.25 * slot.width && is_of_wall(&point)
        };
        let is_enough = |touches: &[u32]| {
            [1.0, -1.0].iter().all(|&side| {
                let on_side = touches.iter().filter(|number| is_on_side(number, side));
                on_side.count() >= LEAST_TOUCHES / 2
            })
        };
        let is_deep = |p: &Point3<f64>| {
            (0.0..slot.depth + BESIDE * slot.width).contains(&(slot.centre - p).dot(&slot.out))
        };
        let touches = self.squarest(
            self.observed.touches_on(guess, is_deep),
            |touch| touch.normal.dot(&slot.out).abs(),
            |_| false,
            is_enough,
        );
        if !touches.is_empty() {
            let observations = self.observed.of_touches(&touches);
            return (touches, observations);
        }
        let segments: Vec<usize> = slot.segments().collect();
        let at_edge = self.observed.of_edges(&segments);
        if is_enough(&at_edge.0) {
            at_edge
        } else {
            Default::default()
        }
    }

    /// Fits to touches; without touches, or if that fit fails, to the mesh.
    ///
    /// - `around`: number of the plane that gives the unevenness of the mesh: a small surface
    ///   follows the waves of the mesh.
    fn fitted<S: SurfaceModel>(
        &self,
        guess: &S,
        touches: Vec<u32>,
        of_mesh: &[Observation],
        axis_sigma: Option<f64>,
        around: Option<usize>,
    ) -> FittedSurface<S> {
        let observations = self.observed.of_touches(&touches);
        self.fitted_to((touches, observations), guess, of_mesh, axis_sigma, around)
    }

    /// As [`Self::fitted`], with the observations of the touches.
    fn fitted_to<S: SurfaceModel>(
        &self,
        (touches, observations): (Vec<u32>, Vec<Observation>),
        guess: &S,
        of_mesh: &[Observation],
        axis_sigma: Option<f64>,
        around: Option<usize>,
    ) -> FittedSurface<S> {
        let params = FitParams {
            axis_sigma,
            ..self.observed.fit_params(&touches)
        };
        if !touches.is_empty()
            && let Ok(found) = fit(guess, &observations, &params)
        {
            let touches = touches
                .into_iter()
                .zip(&found.used)
                .filter(|&(_, used)| *used)
                .map(|(touch, _)| touch);
            let touches = touches.collect();
            let (surface, to) = (found.surface.clone(), FittedTo::Touches);
            let uneven = found.unevenness(&observations);
            return FittedSurface {
                surface,
                fit: Some(found),
                touches,
                to,
                uneven,
                is_confirmed: true,
            };
        }
        let params = FitParams {
            axis_sigma,
            ..FitParams::default()
        };
        let is_confirmed = !self.observed.has_touches();
        let found = if is_confirmed {
            let radius = guess.section_radius();
            let facets = radius.map_or(0.0, |radius| self.observed.sagitta(radius));
            let uneven = around.and_then(|number| self.plane(number));
            let uneven = uneven.map_or(0.0, |plane| plane.uneven);
            fit_mesh(guess, of_mesh, &params, uneven, facets)
        } else {
            fit(guess, of_mesh, &params)
        };
        let found = found.ok();
        let surface = found
            .as_ref()
            .map_or_else(|| guess.clone(), |found| found.surface.clone());
        let uneven = found
            .as_ref()
            .map_or(0.0, |found| found.unevenness(of_mesh));
        FittedSurface {
            surface,
            fit: found,
            touches: Vec::new(),
            to: FittedTo::Mesh,
            uneven,
            is_confirmed,
        }
    }

    /// Share of a turn around a wall that touches cover.
    pub(crate) fn turn(&self, touches: &[u32], wall: &Wall) -> f64 {
        let [e, g] = tangent_basis(&wall.axis);
        let mut parts = [false; PARTS];
        for &number in touches {
            let v = self.observed.touch(number).point - wall.origin;
            let turn = v.dot(&g).atan2(v.dot(&e)) / std::f64::consts::TAU;
            parts[((turn * PARTS as f64).floor() as i64).rem_euclid(PARTS as i64) as usize] = true;
        }
        parts.iter().filter(|&&part| part).count() as f64 / PARTS as f64
    }

    /// Distance between the lowest and the highest tenth of touches along the axis of a wall, m.
    fn height(&self, touches: &[u32], wall: &Wall) -> f64 {
        let along =
            |&number: &u32| (self.observed.touch(number).point - wall.origin).dot(&wall.axis);
        let mut along: Vec<f64> = touches.iter().map(along).collect();
        let [lowest, highest] =
            [0.1, 0.9].map(|share| order_statistic(&mut along, share).unwrap_or(0.0));
        highest - lowest
    }
}

impl FittedSurface<Plane> {
    /// Intersection of a line with the plane, m; its uncertainty is along the normal.
    pub(crate) fn met(
        &self,
        from: &Point3<f64>,
        direction: &Vector3<f64>,
    ) -> Option<MeasuredValue<Point3<f64>>> {
        Some(self.place(from + direction * self.surface.along(from, direction)?))
    }
}

impl FittedSurface<Cylinder> {
    /// Exit of a line from the cylinder, m; its uncertainty is along the normal there.
    pub(crate) fn met(
        &self,
        from: &Point3<f64>,
        direction: &Vector3<f64>,
    ) -> Option<MeasuredValue<Point3<f64>>> {
        Some(self.place(from + direction * self.surface.exit(from, direction)?))
    }
}

impl<S: SurfaceModel> FittedSurface<S> {
    /// A place on the surface, m; its uncertainty is along the normal.
    fn place(&self, value: Point3<f64>) -> MeasuredValue<Point3<f64>> {
        let std = self.confirmed().and_then(|fit| fit.std_at(&value));
        MeasuredValue::new(value, std, self.touches.clone())
    }

    /// Standard deviation at a place without the common error of all touches, m: two surfaces of a
    /// mesh have no common error.
    pub(crate) fn own_std_at(&self, place: &Point3<f64>) -> Option<f64> {
        self.confirmed().and_then(|fit| match self.to {
            FittedTo::Touches => fit.own_std_at(place),
            FittedTo::Mesh => fit.std_at(place),
        })
    }

    /// The fit, if its standard deviations hold for the surface.
    pub(crate) fn confirmed(&self) -> Option<&Fit<S>> {
        self.fit.as_ref().filter(|_| self.is_confirmed)
    }

    /// The direction of the surface, oriented along `direction`.
    pub(crate) fn axis(&self, direction: &Vector3<f64>) -> MeasuredValue<Vector3<f64>> {
        let value = self.surface.axis_towards(direction);
        MeasuredValue::new(
            value,
            self.confirmed().and_then(Fit::axis_std),
            self.touches.clone(),
        )
    }

    /// A number with its uncertainty, if the fit is confirmed.
    pub(crate) fn number(&self, value: f64, by: &[(Freedom, f64)]) -> MeasuredValue<f64> {
        MeasuredValue::new(
            value,
            self.confirmed().and_then(|fit| fit.std_by(by)),
            self.touches.clone(),
        )
    }
}
