//! Paths through free air that keep clear of the mesh.
//!
//! A path goes straight, or up, over and down at the lowest height at which all three parts keep
//! clear. A straight line is clear if the ball, and the shaft above it, stay farther from the mesh
//! than their radii and a margin: sphere tracing in steps of the remaining distance misses nothing,
//! as the distance changes no faster than the place.

use nalgebra::{Point3, Unit, Vector3};

use touchup_method::parameters;

parameters! {
    /// Tool of the arm, as far as it must keep clear: by default a probe of 3 mm on a shaft of 2
    /// mm.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Tool in "robot" {
        /// Radius of the ball, m.
        ball_radius: f64 = 1.5e-3;
        /// Radius of the shaft behind the ball.
        ///
        /// In m.
        shaft_radius: f64 = 1.0, "shaft_radius_mm" [MM, 0.05, 50];
        /// Length of the shaft, with the hand behind it, that must keep clear of the mesh.
        ///
        /// In m.
        shaft_length: f64 = 60.0, "shaft_length_mm" [MM, 0, 500];
        /// Margin for the error of the scan, in moves through free air.
        ///
        /// In m, of both.
        margin: f64 = 0.5, "margin_mm" [MM, 0, 50];
    }
}

/// Why there is no path.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum LinkError {
    /// A path that would begin in the part.
    #[error(
        "the probe is in or at the mesh at ({:.1} {:.1} {:.1}) mm: bring it into free air by hand, where its sensor can be zeroed",
        place_mm[0], place_mm[1], place_mm[2]
    )]
    InPart {
        /// place in O, mm
        place_mm: [f64; 3],
    },
    /// No room to turn.
    #[error(
        "the probe cannot be turned by {angle_deg:.0}° near ({:.1} {:.1} {:.1}) mm and keep clear of the mesh: bring it farther away",
        place_mm[0], place_mm[1], place_mm[2]
    )]
    NoTurn {
        /// place in O, mm
        place_mm: [f64; 3],
        /// angle of the turn, °
        angle_deg: f64,
    },
    /// No clear path.
    #[error(
        "no path to ({:.1} {:.1} {:.1}) mm keeps {margin_mm:.1} mm clear of the mesh: turn the part, or probe it by hand",
        place_mm[0], place_mm[1], place_mm[2]
    )]
    NoPath {
        /// place in O, mm
        place_mm: [f64; 3],
        /// margin, mm
        margin_mm: f64,
    },
}

/// Heights tried between a straight line and a path above all.
const HEIGHTS: usize = 6;
/// Least step along a line, m.
const LEAST_STEP: f64 = 20e-6;
/// Least step of a turn, rad: it moves the far end of a shaft of 60 mm by 0.06 mm.
const LEAST_TURN: f64 = 1e-3;

/// A tool near a mesh.
#[derive(Clone, Copy)]
pub(crate) struct Clearance<'a> {
    /// tool that must keep clear
    pub tool: &'a Tool,
    /// Direction from the ball to the handle: up.
    pub shaft: Unit<Vector3<f64>>,
    /// Distance of a place from the mesh, up to a reach, m.
    pub distance: &'a dyn Fn(&Point3<f64>, f64) -> f64,
}

impl Clearance<'_> {
    /// Lower bound of the room around the tool at a place, m; negative: in the mesh, or nearer than
    /// the margin, at an unknown depth.
    ///
    /// - `reach`: maximum room that matters, m.
    pub(crate) fn room(&self, centre: &Point3<f64>, reach: f64) -> f64 {
        let Tool {
            ball_radius,
            shaft_radius,
            shaft_length,
            margin,
        } = *self.tool;
        let reach = reach.max(LEAST_STEP);
        let around = |p: &Point3<f64>, radius: f64| {
            (self.distance)(p, radius + margin + reach) - radius - margin
        };
        let mut room = around(centre, ball_radius);
        // balls of a little more than the shaft's radius cover all of it
        let spacing = shaft_radius;
        let radius = shaft_radius * 1.25f64.sqrt();
        let count = (shaft_length / spacing).ceil() as usize;
        let mut at = 1;
        while at <= count && room >= 0.0 {
            let here = around(
                &(centre + self.shaft.into_inner() * (at as f64 * spacing)),
                radius,
            );
            // balls within half of the room here have at least the other half
            let skipped = (here / 2.0 / spacing).max(0.0) as usize;
            room = room.min(if skipped > 0 { here / 2.0 } else { here });
            at += 1 + skipped;
        }
        room
    }

    /// Whether a straight line is clear.
    fn is_clear(&self, from: &Point3<f64>, to: &Point3<f64>) -> bool {
        let length = (to - from).norm();
        let direction = (to - from)
            .try_normalize(0.0)
            .unwrap_or_else(Vector3::zeros);
        let room = |gone: f64| self.room(&(from + direction * gone), length - gone);
        is_clear_along(length, room, |room| room.max(LEAST_STEP))
    }

    /// Whether the tool keeps clear in a turn about the ball.
    ///
    /// - `angle`: of the turn, rad; `shaft`: after a share of it.
    fn can_turn(
        &self,
        centre: &Point3<f64>,
        angle: f64,
        shaft: &dyn Fn(f64) -> Unit<Vector3<f64>>,
    ) -> bool {
        let length = self.tool.shaft_length + self.tool.shaft_radius;
        // no point of the tool moves farther than its far end
        let room = |turned: f64| {
            Self {
                shaft: shaft(turned / angle),
                ..*self
            }
            .room(centre, length * (angle - turned))
        };
        is_clear_along(angle, room, |room| (room / length).max(LEAST_TURN))
    }

    /// Place for a clear turn of the tool about its ball: the present one, or the nearest out along
    /// its shaft.
    ///
    /// - `angle`: of the turn, rad; `shaft`: after a share of it, from the ball to the handle.
    ///
    /// # Errors
    /// [`LinkError::NoTurn`].
    pub(crate) fn turning_place(
        &self,
        from: &Point3<f64>,
        angle: f64,
        shaft: &dyn Fn(f64) -> Unit<Vector3<f64>>,
    ) -> Result<Point3<f64>, LinkError> {
        let places = (0..TURN_PLACES)
            .map(|times| from + self.shaft.into_inner() * (TURN_RAISE * times as f64));
        let mut reached = places.take_while(|place| self.is_clear(from, place));
        let no_turn = LinkError::NoTurn {
            place_mm: (from * 1e3).coords.into(),
            angle_deg: angle.to_degrees(),
        };
        reached
            .find(|place| self.can_turn(place, angle, shaft))
            .ok_or(no_turn)
    }

    /// Clear place at or above an entry: from there on down the arm is slow.
    ///
    /// # Errors
    /// [`LinkError::NoPath`].
    pub(super) fn entry(&self, entry: &Point3<f64>) -> Result<Point3<f64>, LinkError> {
        let mut raised =
            (0..RAISES).map(|times| entry + self.shaft.into_inner() * (RAISE * times as f64));
        raised
            .find(|entry| self.room(entry, 0.0) >= 0.0)
            .ok_or(self.no_path(entry))
    }

    /// Places on the path of the tool from one place to another, without the first; both are in
    /// free air.
    ///
    /// - `highest`: of the mesh along the shaft, m from the origin of O.
    ///
    /// # Errors
    /// [`LinkError::NoPath`].
    pub(super) fn path(
        &self,
        from: &Point3<f64>,
        to: &Point3<f64>,
        highest: f64,
    ) -> Result<Vec<Point3<f64>>, LinkError> {
        if self.is_clear(from, to) {
            return Ok(vec![*to]);
        }
        let height = |p: &Point3<f64>| p.coords.dot(&self.shaft);
        let lowest = height(from).max(height(to));
        // above all: the ball clears the highest place
        let top = (highest + self.tool.ball_radius + 2.0 * self.tool.margin).max(lowest);
        let lifted = |p: &Point3<f64>, to: f64| p + self.shaft.into_inner() * (to - height(p));
        for step in 1..=HEIGHTS {
            let at = lowest + (top - lowest) * step as f64 / HEIGHTS as f64;
            let places = [*from, lifted(from, at), lifted(to, at), *to];
            if places
                .windows(2)
                .all(|pair| self.is_clear(&pair[0], &pair[1]))
            {
                return Ok(places[1..].to_vec());
            }
        }
        Err(self.no_path(to))
    }

    fn no_path(&self, to: &Point3<f64>) -> LinkError {
        LinkError::NoPath {
            place_mm: (to * 1e3).coords.into(),
            margin_mm: self.tool.margin * 1e3,
        }
    }
}

/// Step outward to the next place for a turn, m.
const TURN_RAISE: f64 = 5e-3;
/// Number of places tried for a turn.
const TURN_PLACES: usize = 20;
/// Step upward from an entry that is not clear, m.
const RAISE: f64 = 2e-3;
/// Number of places tried for an entry.
const RAISES: usize = 30;

/// Whether there is room all along a path from 0 to an end.
///
/// - `step`: least step that a room allows.
fn is_clear_along(end: f64, room: impl Fn(f64) -> f64, step: impl Fn(f64) -> f64) -> bool {
    let mut at = 0.0;
    loop {
        let here = room(at);
        if here < 0.0 {
            return false;
        }
        if at >= end {
            return true;
        }
        at = (at + step(here)).min(end);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The part is below z = 0.
    fn above_a_plate(place: &Point3<f64>, reach: f64) -> f64 {
        place.z.min(reach)
    }

    fn upright(tool: &Tool) -> Clearance<'_> {
        Clearance {
            tool,
            shaft: Vector3::z_axis(),
            distance: &above_a_plate,
        }
    }

    #[test]
    fn an_entry_too_near_is_raised_until_it_is_clear() {
        let (tool, up) = (Tool::default(), Vector3::z_axis());
        let needed = tool.ball_radius + tool.margin;
        for height in [-5e-3, 0.0, 1e-3, needed - 1e-6, needed + 1e-6, 20e-3] {
            let entry = Point3::new(3e-3, -2e-3, height);
            let clear = upright(&tool).entry(&entry).unwrap();
            let raises = ((needed - height).max(0.0) / RAISE).ceil();
            assert!(
                (clear - entry - up.into_inner() * (raises * RAISE)).norm() < 1e-12,
                "from {height}: {clear}"
            );
            assert!(clear.z >= needed);
        }
    }

    #[test]
    fn an_entry_that_is_never_clear_is_refused() {
        let deep = Point3::new(0.0, 0.0, -1.0);
        let refused = upright(&Tool::default()).entry(&deep);
        assert_eq!(
            refused,
            Err(LinkError::NoPath {
                place_mm: [0.0, 0.0, -1e3],
                margin_mm: 0.5
            })
        );
    }

    /// Beside a wall on the side it turns to, a tool turns only above it.
    #[test]
    fn a_turn_that_would_meet_a_wall_is_made_above_it() {
        // the half space x > 10 mm below z = 50 mm
        let wall = |p: &Point3<f64>, reach: f64| {
            let (x, z) = (10e-3 - p.x, p.z - 50e-3);
            let far = if x > 0.0 && z > 0.0 {
                x.hypot(z)
            } else {
                x.max(z)
            };
            far.min(reach)
        };
        let tool = Tool::default();
        let shaft = |share: f64| {
            // upright first, towards the wall by 60° in the end
            let angle = share * std::f64::consts::FRAC_PI_3;
            Unit::new_normalize(Vector3::new(angle.sin(), 0.0, angle.cos()))
        };
        let upright = Clearance {
            tool: &tool,
            shaft: Vector3::z_axis(),
            distance: &wall,
        };
        let place = upright
            .turning_place(&Point3::origin(), std::f64::consts::FRAC_PI_3, &shaft)
            .unwrap();
        for step in 0..=100 {
            let direction = shaft(f64::from(step) / 100.0);
            for mm in 0..=600 {
                let p = place + direction.into_inner() * (f64::from(mm) * 1e-4);
                assert!(
                    wall(&p, 1.0) >= tool.shaft_radius + tool.margin - 1e-9,
                    "{p} at {step} %"
                );
            }
        }
        // away from the wall it turns where it is
        let away = |share: f64| Unit::new_normalize(Vector3::new(-share, 0.0, 1.0));
        let place = upright
            .turning_place(&Point3::origin(), std::f64::consts::FRAC_PI_4, &away)
            .unwrap();
        assert_eq!(place, Point3::origin());
    }

    proptest! {
        /// The room of a ball and a shaft among places of a mesh in closed form: the distance of a
        /// place from a segment.
        #[test]
        fn room_is_never_more_than_there_is(
            places in prop::collection::vec([-30e-3..30e-3f64, -30e-3..30e-3f64, -10e-3..80e-3f64], 1..6),
            lean in [-1.0..1.0f64, -1.0..1.0f64],
            reach in 0.0..50e-3f64,
        ) {
            let tool = Tool::default();
            let shaft = Unit::new_normalize(Vector3::new(lean[0], lean[1], 1.0));
            let distance = |p: &Point3<f64>, reach: f64| {
                places.iter().map(|place| (p - Point3::from(*place)).norm()).fold(reach, f64::min)
            };
            let room = Clearance { tool: &tool, shaft, distance: &distance }.room(&Point3::origin(), reach);
            let from_shaft = |place: &[f64; 3]| {
                let p = Vector3::from(*place);
                (p - shaft.into_inner() * p.dot(&shaft).clamp(0.0, tool.shaft_length)).norm()
            };
            let shaft_room = places.iter().map(from_shaft).fold(f64::INFINITY, f64::min) - tool.shaft_radius - tool.margin;
            let ball_room = distance(&Point3::origin(), 1.0) - tool.ball_radius - tool.margin;
            let least = shaft_room.min(ball_room);
            // only that part of the mesh is reported
            prop_assert!(room <= least + 1e-12 || (room < 0.0 && least < 0.0), "{room} of {shaft_room} {ball_room}");
            // and not less than half of the room beyond the balls that model the shaft
            let spare = tool.shaft_radius * (1.25f64.sqrt() - 1.0);
            let there = (shaft_room - spare).min(ball_room);
            prop_assert!(room >= (there / 2.0).min(there).min(reach / 2.0) - 1e-12, "{room} of {there}");
        }
    }
}
