//! The surfaces of features, measured: fitted to what was touched, or to the mesh.

use std::cell::RefCell;
use std::collections::BTreeMap;

use nalgebra::{Point3, Vector3};

use super::feature::{FittedTo, Measured};
use super::fit::{
    Cone, Cylinder, Ends, Fit, FitParams, Freedom, Observation, Plane, Stadium, Surface, fit,
    fit_mesh,
};
use super::observe::Observed;
use super::primitive::Primitive;
use super::slots::Slot;
use super::walls::Wall;
use crate::numeric::{order_statistic, spreads, tangent_basis};
use crate::stylus::ProbedPoint;

/// A fitted surface and what it was fitted to.
#[derive(Clone, Debug)]
pub(super) struct Fitted<S> {
    pub surface: S,
    /// `None` where no fit held: the surface is that of the segments
    pub fit: Option<Fit<S>>,
    /// numbers of the touches that were used
    pub touches: Vec<u32>,
    pub to: FittedTo,
    /// of a mesh the root mean square of its residuals, m
    pub uneven: f64,
    /// whether the residuals say how far the surface is off: those of touches do, and those of a
    /// mesh that nothing touched; beside touches they are of a surface that nobody felt, which may
    /// be off as a whole
    pub is_confirmed: bool,
}

/// Fits surfaces; each plane once.
pub(super) struct Measure<'a> {
    pub observed: &'a Observed<'a>,
    planes: RefCell<BTreeMap<usize, Fitted<Plane>>>,
}

/// Fewer touches than this on a surface are left to the mesh.
pub const LEAST_TOUCHES: usize = 12;
/// Touches around less of a turn than this are left to the mesh.
pub const LEAST_TURN: f64 = 0.4;
/// Touches on a plane that spread less than this share across their longest direction are left to
/// the mesh; beside an edge they are enough when they spread over this share of what the mesh has.
const LEAST_SPREAD: f64 = 0.1;
const LEAST_STRIP: f64 = 0.4;
/// Into so many parts a turn is divided.
const PARTS: usize = 24;
/// A wall touched over less than this many diameters of its height has its axis from the plane
/// around it.
const SHORT: f64 = 0.35;
/// A touch beside the outline of a slot by less than this share of its width is of it.
const BESIDE: f64 = 0.15;
/// A touch is of the edge at an end of a wall when it is nearer to it than this, in radii of the
/// ball …
const OVER_END: f64 = 0.3;
/// … and its normal leans towards it by more than this, rad: 15°.
const OVER_END_LEAN: f64 = 0.26;
/// Leans that are tried in turn, sines: 9°, which friction leaves, and 12°.
const LEANS: [f64; 2] = [0.15, 0.2];
/// Perpendicularity of a drilled hole or milled slot to the plane around it, rad: 0.5°.
const DRILLED: f64 = 0.0087;

/// Whether the ball touched the edge at an end of a wall: there it is nearer to the axis, or
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
    pub fn new(observed: &'a Observed<'a>) -> Self {
        Self {
            observed,
            planes: RefCell::new(BTreeMap::new()),
        }
    }

    /// The plane of a segment.
    pub fn plane(&self, number: usize) -> Option<Fitted<Plane>> {
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

    /// The plane of a segment beside an edge: a strip of touches along the edge places it, where it
    /// is wide beside what the mesh has of the plane. `None` where the segment is none.
    pub fn plane_beside_edge(&self, number: usize) -> Option<Fitted<Plane>> {
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
        // a mesh rounds the corner between two walls and leans there: touches by the first plane
        // are others than by the mesh
        let is_felt = first.to == FittedTo::Touches;
        Some(if is_felt {
            self.plane_by(number, &first.surface, is_wide)
        } else {
            first
        })
    }

    /// - `is_wide`: whether touches that spread so far in three directions, m, the least first, are
    ///   enough.
    fn plane_by(
        &self,
        number: usize,
        guess: &Plane,
        is_wide: impl Fn([f64; 3]) -> bool,
    ) -> Fitted<Plane> {
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

    /// The plane through touches, about square to `normal`; `None` where there are none.
    pub fn felt_plane(
        &self,
        touches: &[u32],
        point: &Point3<f64>,
        normal: &Vector3<f64>,
    ) -> Option<Fitted<Plane>> {
        let is_felt = !touches.is_empty();
        is_felt.then(|| {
            self.fitted(
                &Plane::new(*point, normal),
                touches.to_vec(),
                &[],
                Some(DRILLED),
                None,
            )
        })
    }

    /// The cylinder of a segment; `None` where it is none.
    pub fn shaft(&self, number: usize) -> Option<Fitted<Cylinder>> {
        let Primitive::Cylinder(guess) = self.observed.parted.segment(number).primitive else {
            return None;
        };
        let touches = self.observed.touches_of(&[number]);
        let touches = if touches.len() < LEAST_TOUCHES {
            Vec::new()
        } else {
            touches
        };
        Some(self.fitted(
            &guess,
            touches,
            &self.observed.of_mesh(&[number]),
            None,
            None,
        ))
    }

    /// The cylinder of a wall.
    ///
    /// - `rim`: number of the plane around its opening.
    pub fn cylinder(&self, wall: &Wall, rim: Option<usize>) -> Fitted<Cylinder> {
        let touches = self.touches_around(wall);
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
        self.fitted(
            &guess,
            touches,
            &self.observed.of_mesh(&wall.segments),
            axis_sigma,
            rim,
        )
    }

    /// The cone of a wall; `None` for a cylinder.
    pub fn cone(&self, wall: &Wall) -> Option<Fitted<Cone>> {
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

    /// The touches of a wall, where they are enough around it; else none.
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
        self.squarest(
            touches,
            |touch| touch.normal.dot(&wall.axis).abs(),
            |_| true,
            is_enough,
        )
    }

    /// The touches whose normals lean least off that of their surface, where they are enough; none
    /// where all are not. A ball that rolls over an edge leans more and more, and its centre comes
    /// nearer to the surface than its radius.
    ///
    /// - `lean`: sine of the angle between the normal of a touch and the normals of the surface.
    /// - `is_inside`: whether a touch that leans is of the surface and not of its edge.
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

    /// Whether a ball is above what some touches felt of a plane: over an edge its centre goes on
    /// while its contact stays.
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
    pub fn stadium(&self, slot: &Slot) -> Fitted<Stadium> {
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
        // its walls and ends may go on beyond it, and its corners may be round
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
        let is_deep = |p: &Point3<f64>| {
            (0.0..slot.depth + BESIDE * slot.width).contains(&(slot.centre - p).dot(&slot.out))
        };
        let touches = self.observed.touches_on(&guess, is_deep);
        let on_wall = |touches: &[u32], side: f64| {
            let is_there = |number: &&u32| {
                let q = guess
                    .pose_of
                    .inverse_transform_point(&self.observed.touch(**number).point);
                q.y * side > 0.25 * slot.width && is_of(&self.observed.touch(**number).point, true)
            };
            touches.iter().filter(is_there).count()
        };
        let is_enough = |touches: &[u32]| {
            [1.0, -1.0]
                .iter()
                .all(|&side| on_wall(touches, side) >= LEAST_TOUCHES / 2)
        };
        let touches = self.squarest(
            touches,
            |touch| touch.normal.dot(&slot.out).abs(),
            |_| true,
            is_enough,
        );
        self.fitted(&guess, touches, &of_mesh, Some(DRILLED), Some(slot.land))
    }

    /// Fits to touches; where there are none, or it fails, to the mesh.
    ///
    /// - `around`: number of the plane that says how uneven the mesh is there: a small surface
    ///   follows its waves.
    fn fitted<S: Surface>(
        &self,
        guess: &S,
        touches: Vec<u32>,
        of_mesh: &[Observation],
        axis_sigma: Option<f64>,
        around: Option<usize>,
    ) -> Fitted<S> {
        let [common_sigma, shift_sigma] = self.observed.systematic(&touches);
        let params = FitParams {
            common_sigma,
            shift_sigma,
            axis_sigma,
            ..FitParams::default()
        };
        if !touches.is_empty()
            && let Ok(found) = fit(guess, &self.observed.of_touches(&touches), &params)
        {
            let touches = touches
                .into_iter()
                .zip(&found.used)
                .filter(|&(_, used)| *used)
                .map(|(touch, _)| touch);
            let touches = touches.collect();
            let (surface, to) = (found.surface.clone(), FittedTo::Touches);
            return Fitted {
                surface,
                fit: Some(found),
                touches,
                to,
                uneven: 0.0,
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
        Fitted {
            surface,
            fit: found,
            touches: Vec::new(),
            to: FittedTo::Mesh,
            uneven,
            is_confirmed,
        }
    }

    /// Share of a turn around a wall that touches cover.
    pub fn turn(&self, touches: &[u32], wall: &Wall) -> f64 {
        let [e, g] = tangent_basis(&wall.axis);
        let mut parts = [false; PARTS];
        for &number in touches {
            let v = self.observed.touch(number).point - wall.origin;
            let turn = v.dot(&g).atan2(v.dot(&e)) / std::f64::consts::TAU;
            parts[((turn * PARTS as f64).floor() as i64).rem_euclid(PARTS as i64) as usize] = true;
        }
        parts.iter().filter(|&&part| part).count() as f64 / PARTS as f64
    }

    /// Between the lowest and the highest tenth of the touches along the axis of a wall, m.
    fn height(&self, touches: &[u32], wall: &Wall) -> f64 {
        let along =
            |&number: &u32| (self.observed.touch(number).point - wall.origin).dot(&wall.axis);
        let mut along: Vec<f64> = touches.iter().map(along).collect();
        let [lowest, highest] =
            [0.1, 0.9].map(|share| order_statistic(&mut along, share).unwrap_or(0.0));
        highest - lowest
    }
}

impl Fitted<Plane> {
    /// Where a line meets the plane, m; its uncertainty is along the normal.
    pub fn met(
        &self,
        from: &Point3<f64>,
        direction: &Vector3<f64>,
    ) -> Option<Measured<Point3<f64>>> {
        Some(self.place(from + direction * self.surface.along(from, direction)?))
    }
}

impl Fitted<Cylinder> {
    /// Where a line leaves the cylinder, m; its uncertainty is along the normal there.
    pub fn met(
        &self,
        from: &Point3<f64>,
        direction: &Vector3<f64>,
    ) -> Option<Measured<Point3<f64>>> {
        Some(self.place(from + direction * self.surface.exit(from, direction)?))
    }
}

impl<S: Surface> Fitted<S> {
    /// A place on the surface, m; its uncertainty is along the normal.
    fn place(&self, value: Point3<f64>) -> Measured<Point3<f64>> {
        let std = self.confirmed().and_then(|fit| fit.std_at(&value));
        Measured::new(value, std, self.touches.clone())
    }

    /// The standard deviation at a place without what all touches have in common, m: of a mesh two
    /// surfaces have nothing in common.
    pub fn own_std_at(&self, place: &Point3<f64>) -> Option<f64> {
        self.confirmed().and_then(|fit| match self.to {
            FittedTo::Touches => fit.own_std_at(place),
            FittedTo::Mesh => fit.std_at(place),
        })
    }

    /// The fit, where its standard deviations are those of the surface.
    pub fn confirmed(&self) -> Option<&Fit<S>> {
        self.fit.as_ref().filter(|_| self.is_confirmed)
    }

    /// The direction of the surface, oriented along `direction`.
    pub fn axis(&self, direction: &Vector3<f64>) -> Measured<Vector3<f64>> {
        let value = self.surface.axis_towards(direction);
        Measured::new(
            value,
            self.confirmed().and_then(Fit::axis_std),
            self.touches.clone(),
        )
    }

    /// A fitted number, or its value without a fit.
    pub fn number(&self, value: f64, by: &[(Freedom, f64)]) -> Measured<f64> {
        Measured::new(
            value,
            self.confirmed().and_then(|fit| fit.std_by(by)),
            self.touches.clone(),
        )
    }
}
