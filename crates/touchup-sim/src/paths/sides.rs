//! Paths of the hand over several sides of a part.

use nalgebra::{Unit, Vector3};

use super::habit::Habit;
use super::path::{PathParams, Stroke, free, plan_mesh};
use super::waterline::plan_waterlines;
use crate::error::SimError;
use crate::surfaces::surface::{Bounds, Surface};

/// Distance from the part between two sides, in radii of the ball.
const AWAY: f64 = 4.0;

/// Time for each other side, as a share of the first.
const ASIDE: f64 = 0.5;

/// Rasters from each side with a habit, and runs along all walls that the ball reaches from there.
/// On the first side each of the two takes at most [`PathParams::longest`], on the others half of
/// it.
///
/// - `sides`: unit vectors from the part towards the hand, in O.
///
/// # Errors
/// [`SimError::BadParameter`].
pub fn plan_sides(
    surface: &dyn Surface,
    sides: &[Unit<Vector3<f64>>],
    habit: Habit,
    params: &PathParams,
) -> Result<Vec<Stroke>, SimError> {
    let bounds = surface.bounds();
    let mut path: Vec<Stroke> = Vec::new();
    for (at, side) in sides.iter().enumerate() {
        if at > 0 {
            path.push(around(&bounds, &sides[at - 1], side, params.radius));
        }
        let view = -*side;
        let params = PathParams {
            longest: params.longest * if at == 0 { 1.0 } else { ASIDE },
            ..*params
        };
        path.extend(habit.led(plan_mesh(surface, &bounds, &view, &params)?));
        path.extend(plan_waterlines(surface, &bounds, &view, &params)?);
    }
    Ok(path)
}

/// A free move from above one side of the part to above another, outside of the ball around the
/// part.
fn around(
    bounds: &Bounds,
    from: &Unit<Vector3<f64>>,
    to: &Unit<Vector3<f64>>,
    radius: f64,
) -> Stroke {
    let away = 1.5 * bounds.size().norm() / 2.0 + AWAY * radius;
    let is_opposite = from.dot(to) < -0.5;
    let between = if is_opposite {
        Vector3::new(from.y, from.z, from.x)
    } else {
        **from + **to
    };
    free(
        [**from, between.normalize(), **to]
            .map(|direction| bounds.centre() + direction * away)
            .to_vec(),
    )
}
