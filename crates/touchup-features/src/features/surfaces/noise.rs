//! Errors of contacts, by their neighbours.

use nalgebra::SVector;

use super::contact::ContactCell;
use touchup_geometry::numeric::{NormalEquations, SIGMA_OF_MEDIAN, median, tangent_basis};

/// Cosine between normals of one flat place: 25°.
const ALIKE: f64 = 0.906;
/// Minimum number of neighbours that show the noise of a contact, and of those of one side.
const LEAST_NEAR: usize = 10;
const LEAST_OF_SIDE: usize = 3;
/// Number of places that show the noise.
const MOST_PLACES: usize = 400;
/// Variance of the difference of a contact from the mean of other passes, in that of one pass: they
/// are two as a rule.
const OF_DIFFERENCE: f64 = 1.5;
/// Minimum standard deviation of a centre, in radii of the ball, and of a normal, rad: what friction
/// and a told tip leave.
const LEAST_CENTRE: f64 = 0.004;
const LEAST_NORMAL: f64 = 0.06;
/// Standard deviation of a normal on the part, in that among neighbours: these lean alike.
const OF_NEIGHBOURS: f64 = 1.5;

/// Standard deviations of contacts.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactNoise {
    /// of a centre along the normal, m: passes over one place differ by it
    pub centre: f64,
    /// of a normal in each of two directions, rad
    pub normal: f64,
}

/// Errors at one place.
struct PlaceErrors {
    /// how much the surface bends there
    bend: f64,
    /// distances of the contact from others of its stroke and of other strokes, m
    of_stroke: Option<f64>,
    of_others: Option<f64>,
    /// squared turn of its normal from those around it
    turn: f64,
}

impl ContactNoise {
    /// Usual errors where the surface bends least.
    pub(super) fn of(all: &[ContactCell], beside: &[Vec<u32>], radius: f64) -> Self {
        let step = all.len().div_ceil(MOST_PLACES).max(1);
        let places = (0..all.len()).step_by(step);
        let mut places: Vec<PlaceErrors> =
            places.filter_map(|at| errors_at(all, beside, at)).collect();
        places.sort_by(|a, b| a.bend.total_cmp(&b.bend));
        places.truncate(places.len().div_ceil(2));
        let usual = |error: fn(&PlaceErrors) -> Option<f64>| {
            median(&mut places.iter().filter_map(error).collect::<Vec<_>>()).unwrap_or(0.0)
        };
        let of_stroke = SIGMA_OF_MEDIAN * usual(|place| place.of_stroke);
        let of_others = SIGMA_OF_MEDIAN * usual(|place| place.of_others);
        // the median of the square of an error in two directions is 2 ln 2 of its variance in one
        let turn = (usual(|place| Some(place.turn)) / (2.0 * std::f64::consts::LN_2)).sqrt();
        Self {
            centre: of_stroke
                .max(of_others / OF_DIFFERENCE.sqrt())
                .max(LEAST_CENTRE * radius),
            normal: (OF_NEIGHBOURS * turn).max(LEAST_NORMAL),
        }
    }
}

fn errors_at(all: &[ContactCell], beside: &[Vec<u32>], at: usize) -> Option<PlaceErrors> {
    let own = &all[at];
    let around = beside[at].iter().map(|&other| &all[other as usize]);
    let near: Vec<&ContactCell> = around
        .filter(|other| other.normal.dot(&own.normal) > ALIKE)
        .collect();
    if near.len() < LEAST_NEAR {
        return None;
    }
    let [e, g] = tangent_basis(&own.normal);
    // a plane through a component of their normals
    let straight = |along: nalgebra::Vector3<f64>| {
        let row = |one: &&ContactCell| {
            let v = (one.centre - own.centre) / own.radius;
            (
                SVector::<f64, 3>::from([1.0, v.dot(&e), v.dot(&g)]),
                one.normal.dot(&along),
            )
        };
        NormalEquations::of(near.iter().map(row)).solution()
    };
    let (u, v) = (straight(e)?, straight(g)?);
    // a chord of a parabola is square to the mean of its end normals
    let apart =
        |one: &&ContactCell| (one.centre - own.centre).dot(&(one.normal + own.normal)) / 2.0;
    let (of_stroke, of_others): (Vec<&ContactCell>, Vec<&ContactCell>) =
        near.iter().partition(|one| one.stroke == own.stroke);
    let mean = |some: &[&ContactCell]| {
        let sum = some.iter().map(apart).sum::<f64>();
        (some.len() >= LEAST_OF_SIDE).then(|| (sum / some.len() as f64).abs())
    };
    Some(PlaceErrors {
        bend: u.fixed_rows::<2>(1).norm_squared() + v.fixed_rows::<2>(1).norm_squared(),
        of_stroke: mean(&of_stroke),
        of_others: mean(&of_others),
        turn: u[0] * u[0] + v[0] * v[0],
    })
}
