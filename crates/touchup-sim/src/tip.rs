//! A tip of any shape as rigidly connected balls: results for a ball against a surface hold for it.
//!
//! A cone is the balls that fit into it along its axis; a flat end is rings of balls that touch
//! both its face and its side, from the edge's radius to the cylinder's, and more of the latter
//! along the shaft. Distances to a surface change no faster than the balls move, so only balls that
//! could touch need a query.

use std::f64::consts::TAU;

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::ball::{BallContact, TipBall, push_balls};
use super::error::SimError;
use crate::surfaces::surface::Surface;
use touchup_method::stylus::{TipBody, TipShape};

/// Balls around a rim: between two of them a rim of 2 mm is 4 µm too small.
const AROUND: usize = 48;
/// Rounding of a sharp edge, m.
const SHARP: f64 = 0.05e-3;
/// Maximum shortfall of the tip between two balls, m.
const SCALLOP: f64 = 4e-6;

/// A tip led over a surface.
pub(super) struct SimTip {
    /// in T
    balls: Vec<TipBall>,
    /// lower bound of each ball's distance from the surface, m
    clearance: Vec<f64>,
    /// pose of the tip for these bounds
    place: (Point3<f64>, UnitQuaternion<f64>),
    /// balls that could touch, in O
    near: Vec<TipBall>,
}

impl SimTip {
    /// # Errors
    /// [`SimError::Tip`] for impossible sizes of a tip, [`SimError::StartsInside`].
    pub fn new(
        shape: TipShape,
        radius: f64,
        surface: &dyn Surface,
        start: &Point3<f64>,
        upright: UnitQuaternion<f64>,
    ) -> Result<Self, SimError> {
        let balls = balls_of(&TipBody::new(shape, radius)?);
        let clearance: Vec<f64> = balls
            .iter()
            .map(|ball| surface.signed_distance(&(start + upright * ball.offset)) - ball.radius)
            .collect();
        let least = clearance
            .iter()
            .fold(f64::INFINITY, |least, x| least.min(*x));
        if least < 0.0 {
            let clearance_m = surface.signed_distance(start);
            return Err(SimError::StartsInside {
                clearance_m,
                radius_m: clearance_m - least,
            });
        }
        Ok(Self {
            balls,
            clearance,
            place: (*start, upright),
            near: Vec::new(),
        })
    }

    /// Moves the tip, in its new orientation, from `from` towards `to`; returns the resting place
    /// of its origin and the contacts there.
    pub fn push(
        &mut self,
        surface: &dyn Surface,
        from: &Point3<f64>,
        to: &Point3<f64>,
        orientation: UnitQuaternion<f64>,
    ) -> (Point3<f64>, Vec<BallContact>) {
        let step = (to - from).norm();
        let moved = (from - self.place.0).norm();
        let turned = self.place.1.angle_to(&orientation);
        self.place = (*from, orientation);
        self.near.clear();
        for (ball, clearance) in self.balls.iter().zip(&mut self.clearance) {
            *clearance -= moved + turned * ball.offset.norm();
            if *clearance < 2.0 * step {
                let offset = orientation * ball.offset;
                *clearance = surface.signed_distance(&(from + offset)) - ball.radius;
                if *clearance < 2.0 * step {
                    self.near.push(TipBall { offset, ..*ball });
                }
            }
        }
        if self.near.is_empty() {
            return (*to, Vec::new());
        }
        push_balls(surface, from, to, &self.near)
    }
}

fn balls_of(tip: &TipBody) -> Vec<TipBall> {
    let radius = tip.radius();
    match tip.shape() {
        TipShape::Ball => vec![TipBall {
            offset: Vector3::zeros(),
            radius,
        }],
        TipShape::Cone { half_angle, length } => stack([0.0, length], |height| {
            radius.max(SHARP) + height * half_angle.sin()
        })
        .collect(),
        TipShape::Flat {
            edge_radius,
            length,
        } => {
            let edge = edge_radius.max(SHARP.min(radius / 2.0));
            let (mut wide, mut balls) = (edge, Vec::new());
            while wide < radius {
                balls.extend(ring(radius - wide, wide, radius - edge));
                wide += apart(wide);
            }
            balls.extend(stack([radius, length], |_| radius));
            balls
        }
    }
}

/// Balls along the axis between two heights (m), of a radius that depends on the height.
fn stack(
    [from, to]: [f64; 2],
    radius: impl Fn(f64) -> f64 + Copy,
) -> impl Iterator<Item = TipBall> {
    std::iter::successors(Some(from), move |height| {
        Some(height + apart(radius(*height)))
    })
    .take_while(move |height| *height <= to)
    .map(move |height| TipBall {
        offset: Vector3::z() * height,
        radius: radius(height),
    })
}

/// Distance between balls of this radius (m) in a row, m.
fn apart(radius: f64) -> f64 {
    (8.0 * radius * SCALLOP).sqrt()
}

/// Balls of one radius on a circle, resting on the face, as close to each other as on the rim.
fn ring(from_axis: f64, radius: f64, rim: f64) -> impl Iterator<Item = TipBall> {
    let count = (AROUND as f64 * from_axis / rim.max(f64::MIN_POSITIVE))
        .ceil()
        .clamp(1.0, AROUND as f64) as usize;
    (0..count).map(move |i| {
        let angle = TAU * i as f64 / count as f64;
        TipBall {
            offset: Vector3::new(from_axis * angle.cos(), from_axis * angle.sin(), radius),
            radius,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use touchup_method::stylus::TipPlace;

    #[test]
    fn the_balls_fill_the_tip_and_do_not_stand_out() {
        let flat = TipShape::Flat {
            edge_radius: 0.2e-3,
            length: 4e-3,
        };
        let cone = TipShape::Cone {
            half_angle: 0.4,
            length: 5e-3,
        };
        let up = TipPlace {
            centre: Point3::origin(),
            axis: Vector3::z(),
        };
        // the cone ends in a cut, beyond which its last ball bulges
        for (shape, radius, slack, highest) in [
            (TipShape::Ball, 1.5e-3, 1e-12, 1.0),
            (flat, 2e-3, 5e-6, 0.0),
            (cone, 0.3e-3, 5e-6, -0.4),
        ] {
            let tip = TipBody::new(shape, radius).unwrap();
            let balls = balls_of(&tip);
            for i in 0..200 {
                let turn = UnitQuaternion::from_euler_angles(
                    0.37 * f64::from(i),
                    0.91 * f64::from(i),
                    0.0,
                );
                let direction = turn * Vector3::z();
                let reach =
                    |ball: &TipBall| (ball.offset + direction * ball.radius).dot(&direction);
                let farthest = balls.iter().map(reach).fold(f64::NEG_INFINITY, f64::max);
                let wanted = tip.support(&up, &direction).coords.dot(&direction);
                if direction.z < highest {
                    assert!(
                        farthest > wanted - slack && farthest < wanted + 1e-12,
                        "{shape:?} {direction}"
                    );
                }
            }
        }
    }
}
