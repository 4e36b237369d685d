//! One feature, its numbers, and the data behind them.

use nalgebra::{Point3, Vector3};

use super::fit::{Cylinder, Stadium};
use touchup_geometry::form::{Element, FlatForm, RoundForm};
use touchup_method::names;

names! {
    /// Kind of a feature.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
    pub enum FeatureKind {
        /// round, through or blind; a stepped hole is several holes of one group
        Hole = "hole",
        /// between two parallel walls
        Slot = "slot",
        /// closed all around, with a floor
        Pocket = "pocket",
        /// round, standing on a plane
        Boss = "boss",
        /// straight, between two planes
        Edge = "edge",
        /// intersection of three planes
        Corner = "corner",
        /// flat
        #[default]
        Plane = "plane",
        /// round, with the material inside, and no boss: a shaft or its steps
        Cylinder = "cylinder",
        /// a round cut at the rim of the part, open to the side
        Notch = "notch",
        /// a dome, a seat, or the end of a ball-nosed tool
        Sphere = "sphere",
    }
}

names! {
    /// Data behind the numbers of a feature.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum FittedTo {
        /// touches
        Touches = "touches",
        /// the mesh, with too few touches
        #[default]
        Mesh = "mesh",
    }
}

/// A number, its uncertainty, and its touches.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeasuredValue<T> {
    /// m, rad, or a point, m
    pub value: T,
    /// standard uncertainty, m or rad; `None` if undetermined
    pub std: Option<f64>,
    /// numbers of the touches, in ascending order; none for a fit to the mesh
    pub touches: Vec<u32>,
    /// whether the value is a lower bound: a touched extent with an untouched end
    pub is_at_least: bool,
}

impl<T> MeasuredValue<T> {
    /// A value other than a bound.
    pub fn new(value: T, std: Option<f64>, touches: Vec<u32>) -> Self {
        Self {
            value,
            std,
            touches,
            is_at_least: false,
        }
    }
}

/// A feature of the part, in O.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Feature {
    /// constant during refinement
    pub id: u32,
    /// kind of feature
    pub kind: FeatureKind,
    /// intersection of the axis with the opening; middle of a boss' foot, of a shaft's shoulder or
    /// else of its length, of an edge, of a plane; the corner; the centre of a sphere. Its
    /// uncertainty is the root mean square distance across the axis, for a plane along the normal,
    /// for a corner or sphere in space.
    pub centre: MeasuredValue<Point3<f64>>,
    /// out of the opening, along an edge, the outward normal of a plane; unit vector. Its
    /// uncertainty is an angle, rad.
    pub axis: Option<MeasuredValue<Vector3<f64>>>,
    /// along a slot, unit vector
    pub direction: Option<Vector3<f64>>,
    /// of a hole, notch, boss, cylinder or sphere, m
    pub diameter: Option<MeasuredValue<f64>>,
    /// of a slot, pocket, edge or cylinder, m; `None`: the ends of touched walls are untouched
    pub length: Option<MeasuredValue<f64>>,
    /// of a slot or pocket, m
    pub width: Option<MeasuredValue<f64>>,
    /// from opening to floor, or the height of a boss, or of a step of a shaft above its shoulder,
    /// m
    pub depth: Option<MeasuredValue<f64>>,
    /// whether a hole or slot goes through; `None` if the mesh ends before the hole does, or its
    /// floor is untouched
    pub through: Option<bool>,
    /// full angle of the countersink, rad
    pub cone_angle: Option<MeasuredValue<f64>>,
    /// features of one number belong together: holes that are steps on one axis, a slot with its
    /// undercuts
    pub group: Option<u32>,
    /// both ends of an edge or slot, m
    pub points: Vec<Point3<f64>>,
    /// whether the material is inside of an edge or sphere
    pub is_convex: Option<bool>,
    /// touched share of its surface
    pub touched: f64,
    /// data behind its numbers
    pub fitted_to: FittedTo,
    /// walls that its sizes describe, if any
    pub walls: Option<Walls>,
    /// deviation of its surface from the ideal form, if fitted to touches or drawn
    pub form: Option<Form>,
    /// in a drawing, distance of the flat facets of its round walls inside the surface through
    /// their corners, m; `None` if they do not lie inside
    pub facets: Option<f64>,
    /// its axis or plane as an element of relations, if fitted to touches
    pub element: Option<Element>,
}

/// Form of a feature over its touched surface.
#[derive(Clone, Debug, PartialEq)]
pub enum Form {
    /// of a hole, notch, boss or cylinder
    Round(RoundForm),
    /// of a plane
    Flat(FlatForm),
}

/// The walls of a feature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Walls {
    /// of a hole or boss
    Round(Cylinder),
    /// of a slot or pocket
    Slot(Stadium),
}

impl Feature {
    /// Numbers of the touches behind its sizes, with repetitions.
    pub fn touch_numbers(&self) -> impl Iterator<Item = u32> {
        let sizes = [&self.diameter, &self.width, &self.length]
            .into_iter()
            .flatten();
        sizes.flat_map(|size| size.touches.iter().copied())
    }

    /// A feature with no numbers but its centre.
    pub(super) fn new(
        kind: FeatureKind,
        centre: MeasuredValue<Point3<f64>>,
        touched: f64,
        fitted_to: FittedTo,
    ) -> Self {
        Self {
            kind,
            centre,
            touched,
            fitted_to,
            ..Self::default()
        }
    }
}
