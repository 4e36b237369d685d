//! The surfaces that the touches of a feature fit, each with its contacts, for the reconstruction.
//!
//! Walls end at the surface around them and at their floor, faces at their common edge.

use nalgebra::{Point3, Vector3};

use super::search_context::SearchContext;
use touchup_features::features::End;
use touchup_features::features::fit::{
    Cylinder, Ends, Fit, Observation, Plane, Stadium, SurfaceModel,
};
use touchup_geometry::brep::{AnalyticSurface, SurfaceShape};
use touchup_method::reconstruct::KnownSurface;

/// A fit and the observations that it was made of.
pub(super) type FitTo<'a, M> = (&'a Fit<M>, &'a [Observation]);

/// Share of a normal along a slot above which a contact is on an end with straight walls.
const ACROSS: f64 = 0.5;

/// Places of the part at the kept observations.
fn contacts<M: SurfaceModel>((fit, observations): FitTo<'_, M>) -> Vec<Point3<f64>> {
    let kept = observations
        .iter()
        .zip(&fit.used)
        .filter(|(_, used)| **used);
    kept.map(|(o, _)| {
        let (_, normal) = fit.surface.distance_and_normal(&o.point);
        o.point - normal * o.offset
    })
    .collect()
}

/// A place moved along a direction onto a plane; where it is if they are parallel.
fn onto(plane: &AnalyticSurface, place: &Point3<f64>, along: &Vector3<f64>) -> Point3<f64> {
    let steepness = along.dot(&plane.placement.axis);
    if steepness == 0.0 {
        return *place;
    }
    place - along * (plane.signed_distance(place) / steepness)
}

fn analytic(plane: &Plane) -> AnalyticSurface {
    AnalyticSurface::along(plane.point(), plane.normal(), SurfaceShape::Plane)
}

impl SearchContext {
    /// A surface of a fit; `None` if the fit leaves it undetermined somewhere.
    fn known<M: SurfaceModel>(
        &self,
        fit: &Fit<M>,
        (surface, is_concave): (AnalyticSurface, bool),
        [contacts, others, ends]: [Vec<Point3<f64>>; 3],
    ) -> Option<KnownSurface> {
        let std = |place: &Point3<f64>| {
            let shared = &self.params.shared;
            let common = shared.along(place, &surface.normal(place));
            Some(fit.std_at(place)?.hypot(common))
        };
        let places = contacts.iter().chain(&ends);
        let sigma = places
            .map(std)
            .try_fold(0.0, |most, std| Some(f64::max(most, std?)))?;
        (!contacts.is_empty()).then_some(KnownSurface {
            surface,
            is_concave,
            sigma,
            contacts,
            others,
            ends,
        })
    }

    fn known_plane(&self, plane: FitTo<'_, Plane>, ends: Vec<Point3<f64>>) -> Option<KnownSurface> {
        let surface = (analytic(&plane.0.surface), false);
        self.known(plane.0, surface, [contacts(plane), Vec::new(), ends])
    }

    /// The face at the end of walls: a floor, square to them.
    ///
    /// - `ends`: of the walls on it.
    fn known_floor<M: SurfaceModel>(
        &self,
        walls: &Fit<M>,
        (floor, contact): (AnalyticSurface, &End),
        ends: Vec<Point3<f64>>,
    ) -> Option<KnownSurface> {
        let farthest = ends.iter().map(|end| (end - contact.point).norm());
        let lean = walls.axis_std()? * farthest.fold(0.0, f64::max);
        let shared = &self.params.shared;
        let common = shared.along(&contact.point, &floor.placement.axis);
        Some(KnownSurface {
            surface: floor,
            is_concave: false,
            sigma: contact.sigma.hypot(lean).hypot(common),
            contacts: vec![contact.point],
            others: Vec::new(),
            ends,
        })
    }

    /// Surfaces of a plane that is probed alone.
    pub(crate) fn surfaces_of_plane(&self, plane: FitTo<'_, Plane>) -> Vec<KnownSurface> {
        self.known_plane(plane, Vec::new()).into_iter().collect()
    }

    /// Surfaces of a hole: the one around it, its wall, its floor.
    pub(crate) fn surfaces_of_hole(
        &self,
        wall: FitTo<'_, Cylinder>,
        around: FitTo<'_, Plane>,
        floor: Option<&End>,
    ) -> Vec<KnownSurface> {
        let out = wall.0.surface.axis_towards(&around.0.surface.normal());
        let floor = floor.map(|end| {
            let floor = AnalyticSurface::along(end.point, out, SurfaceShape::Plane);
            (floor, end)
        });
        let touched = contacts(wall);
        let moved =
            |plane: &AnalyticSurface| touched.iter().map(|p| onto(plane, p, &out)).collect();
        let rim: Vec<_> = moved(&analytic(&around.0.surface));
        let foot: Vec<_> = floor
            .as_ref()
            .map_or_else(Vec::new, |(floor, _)| moved(floor));
        let ends = [rim.clone(), foot.clone()].concat();
        [
            self.known_round(wall, ends),
            self.known_plane(around, rim),
            floor.and_then(|floor| self.known_floor(wall.0, floor, foot)),
        ]
        .into_iter()
        .flatten()
        .collect()
    }

    /// Surfaces of a boss: its wall, the ground, its top.
    pub(crate) fn surfaces_of_boss(
        &self,
        wall: FitTo<'_, Cylinder>,
        ground: FitTo<'_, Plane>,
        top: Option<FitTo<'_, Plane>>,
    ) -> Vec<KnownSurface> {
        let (touched, axis) = (contacts(wall), wall.0.surface.axis());
        let moved = |plane: FitTo<'_, Plane>| {
            let plane = analytic(&plane.0.surface);
            let moved = touched.iter().map(|p| onto(&plane, p, &axis));
            moved.collect::<Vec<_>>()
        };
        let ends = [Some(ground), top].into_iter().flatten().flat_map(moved);
        let faces = [Some(ground), top].into_iter().flatten();
        let faces = faces.filter_map(|face| self.known_plane(face, moved(face)));
        let wall = self.known_round(wall, ends.collect());
        wall.into_iter().chain(faces).collect()
    }

    fn known_round(
        &self,
        wall: FitTo<'_, Cylinder>,
        ends: Vec<Point3<f64>>,
    ) -> Option<KnownSurface> {
        let Cylinder {
            radius, concave, ..
        } = wall.0.surface;
        let (centre, axis) = (wall.0.surface.center(), wall.0.surface.axis());
        let surface = AnalyticSurface::along(centre, axis, SurfaceShape::Cylinder { radius });
        self.known(
            wall.0,
            (surface, concave),
            [contacts(wall), Vec::new(), ends],
        )
    }

    /// Surfaces of an edge: its two faces, up to their common line.
    pub(crate) fn surfaces_of_edge(&self, faces: [FitTo<'_, Plane>; 2]) -> Vec<KnownSurface> {
        let [a, b] = faces.map(|face| analytic(&face.0.surface));
        let touched = faces.map(contacts).concat();
        let along = |plane: &AnalyticSurface, other: &AnalyticSurface| {
            let (n, m) = (plane.placement.axis, other.placement.axis);
            m - n * n.dot(&m)
        };
        let on_line = |place: &Point3<f64>| {
            let on_a = onto(&a, place, &a.placement.axis);
            onto(&b, &on_a, &along(&a, &b))
        };
        let line: Vec<_> = touched.iter().map(on_line).collect();
        let known = faces.map(|face| self.known_plane(face, line.clone()));
        known.into_iter().flatten().collect()
    }

    /// Surfaces of a slot: the one around it, its walls and ends, its floor.
    pub(crate) fn surfaces_of_slot(
        &self,
        walls: FitTo<'_, Stadium>,
        around: FitTo<'_, Plane>,
        floor: Option<&End>,
    ) -> Vec<KnownSurface> {
        let slot = &walls.0.surface;
        let out = slot.axis_towards(&around.0.surface.normal());
        let floor = floor.map(|end| {
            let floor = AnalyticSurface::along(end.point, out, SurfaceShape::Plane);
            (floor, end)
        });
        let levels = [
            Some(analytic(&around.0.surface)),
            floor.as_ref().map(|(floor, _)| *floor),
        ];
        let touched = contacts(walls);
        let lowest = touched
            .iter()
            .map(|p| (p - slot.center()).dot(&out))
            .fold(0.0, f64::min);
        let at_level = |level: usize, place: &Point3<f64>| match &levels[level] {
            Some(plane) => onto(plane, place, &out),
            None => place + out * (lowest - (place - slot.center()).dot(&out)),
        };
        let level = |level: usize, places: &[Point3<f64>]| {
            let moved = places.iter().map(|place| at_level(level, place));
            moved.collect::<Vec<_>>()
        };
        let mut known = Vec::new();
        for (surface, corners, is_of) in slot_parts(slot) {
            let (own, others): (Vec<_>, Vec<_>) = touched.iter().partition(|place| is_of(place));
            let ends = [&own, &corners].map(|places| [level(0, places), level(1, places)].concat());
            known.extend(self.known(walls.0, surface, [own, others, ends.concat()]));
        }
        known.extend(self.known_plane(around, level(0, &touched)));
        known.extend(floor.and_then(|floor| self.known_floor(walls.0, floor, level(1, &touched))));
        known
    }
}

/// A wall or an end of a slot: its surface and whether that is concave, the places at which it ends
/// at others, and whether a contact is of it.
type SlotPart<'a> = (
    (AnalyticSurface, bool),
    Vec<Point3<f64>>,
    Box<dyn Fn(&Point3<f64>) -> bool + 'a>,
);

/// Two walls and two ends. Round ends begin where their walls end; the corners of straight ends are
/// open.
fn slot_parts(slot: &Stadium) -> Vec<SlotPart<'_>> {
    let (half, radius) = ((slot.length - slot.width) / 2.0, slot.width / 2.0);
    let is_round = slot.ends == Ends::Round;
    let is_of_end = move |q: &Vector3<f64>| match is_round {
        true => q.x.abs() > half,
        false => slot.distance_at(q).normal.x.abs() > ACROSS,
    };
    let place = |x: f64, y: f64| slot.pose_of * Point3::new(x, y, 0.0);
    let plane = |point: Point3<f64>, normal: Vector3<f64>| {
        let normal = slot.pose_of.rotation * normal;
        let surface = AnalyticSurface::along(point, normal, SurfaceShape::Plane);
        (surface, false)
    };
    let mut parts: Vec<SlotPart<'_>> = Vec::new();
    for sign in [1.0, -1.0] {
        let wall = plane(place(0.0, sign * radius), Vector3::y() * -sign);
        let end = if is_round {
            let shape = SurfaceShape::Cylinder { radius };
            let surface = AnalyticSurface::along(place(sign * half, 0.0), slot.axis(), shape);
            (surface, true)
        } else {
            plane(place(sign * slot.length / 2.0, 0.0), Vector3::x() * -sign)
        };
        let [of_wall, of_end] = if is_round {
            [
                vec![place(half, sign * radius), place(-half, sign * radius)],
                vec![place(sign * half, radius), place(sign * half, -radius)],
            ]
        } else {
            [Vec::new(), Vec::new()]
        };
        let (to_f, to_g) = (slot.to_own(), slot.to_own());
        let is_wall = move |p: &Point3<f64>| !is_of_end(&to_f(p)) && to_f(p).y * sign > 0.0;
        let is_end = move |p: &Point3<f64>| is_of_end(&to_g(p)) && to_g(p).x * sign > 0.0;
        parts.push((wall, of_wall, Box::new(is_wall)));
        parts.push((end, of_end, Box::new(is_end)));
    }
    parts
}
