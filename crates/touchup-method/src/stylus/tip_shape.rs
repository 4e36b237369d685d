//! Touching tip: a ball, the flat end of a cylinder, or a cone with a small nose.
//!
//! All three are bodies of revolution about z of the tip frame T, which points from the tip to the
//! handle, and all are a *core* grown by a radius: a point for a ball, a cylinder for a flat end, a
//! cone for a cone. The half profile (0, z₀)–(a₀, z₀)–(a₁, z₁)–(0, z₁) bounds the core, so one
//! closed form serves all: the support point is the point of the core plus the radius along the
//! direction, the distance is the distance from the core minus the radius.

use nalgebra::{Isometry3, Point3, Vector2, Vector3, vector};

use super::SettingError;
use crate::parameters;
use touchup_geometry::numeric::tangent_basis;

/// Tip shape; the radius is a setting of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum TipShape {
    /// A ball; the origin of T is its centre.
    #[default]
    Ball,
    /// The end of a cylinder of the tip's radius; the origin of T is the middle of its face.
    Flat {
        /// radius of the rounded edge, m; 0 for a sharp one
        edge_radius: f64,
        /// known reach of the cylinder from the face, m
        length: f64,
    },
    /// A cone whose nose is a ball of the tip's radius; the origin of T is the centre of that ball.
    Cone {
        /// angle between axis and flank, rad
        half_angle: f64,
        /// known reach of the cone from the centre of the nose, m
        length: f64,
    },
}

/// Place of a tip: a body of revolution needs no more of its pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipPlace {
    /// origin of T, m, in O
    pub centre: Point3<f64>,
    /// z of T: from the tip to the handle, unit, in O
    pub axis: Vector3<f64>,
}

impl From<&Isometry3<f64>> for TipPlace {
    fn from(pose_ot: &Isometry3<f64>) -> Self {
        Self {
            centre: pose_ot.translation.vector.into(),
            axis: pose_ot.rotation * Vector3::z(),
        }
    }
}

/// Contact of a tip with a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TipContact {
    /// point of the surface, m, in O
    pub point: Point3<f64>,
    /// outward normal of the surface, unit, in O
    pub normal: Vector3<f64>,
    /// whether a whole line or face of the tip may touch; `point` is then its point nearest to the
    /// end of the tip
    pub is_vague: bool,
}

parameters! {
    /// Sizes that only some tips have.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct TipSizes in "tip" {
        /// Radius of the rounded edge of a flat tip, no more than radius_mm; left out: sharp.
        edge_radius: Option<f64> = None, "edge_radius_mm" [MM, 0, 1000] like "0.2";
        /// Angle between the axis and the flank of a cone.
        ///
        /// A blunter cone is a flat tip, a more pointed one a needle, which bends.
        half_angle: Option<f64> = None, "half_angle_deg" [DEG, 1, 80, "take shape: flat for a blunter one"] like "20";
        /// Known length of a flat or conical tip from its origin, more than edge_radius_mm; left
        /// out: two diameters, no less than 5 mm.
        length: Option<f64> = None, "length_mm" [MM, 0.001, 1000] like "6";
    }
}

/// A tip of known size and shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TipBody {
    shape: TipShape,
    radius: f64,
    /// growth of the core, m
    round: f64,
    /// (a₀, z₀), m
    low: Vector2<f64>,
    /// (a₁, z₁), m
    high: Vector2<f64>,
    /// outward normal of the flank: away from the axis, along it
    flank: Vector2<f64>,
}

/// Resolution limit of a sharp tip, m: spacing of strokes by hand.
const HAND: f64 = 1e-3;
/// Largest flush angle, between the normal and a face or line of the tip that touches as a whole,
/// in standard deviations of the normal.
const FLUSH_SIGMAS: f64 = 1.5;
/// Lower bound of the flush angle, rad: a degree, the axis error of an optical tracker.
const LEAST_FLUSH: f64 = 0.0175;

/// Distance from the axis, as a share of the length, below which it is mere rounding.
const ON_AXIS: f64 = 1e-9;

impl TipBody {
    /// A ball of `radius` (m).
    pub(crate) fn ball(radius: f64) -> Self {
        let core = Vector2::zeros();
        Self {
            shape: TipShape::Ball,
            radius,
            round: radius,
            low: core,
            high: core,
            flank: Vector2::x(),
        }
    }

    /// A tip of `shape` with `radius` (m): of the ball, of the flat end, or of the nose of the
    /// cone.
    ///
    /// # Errors
    /// [`SettingError`] for sizes of no possible tip.
    pub fn new(shape: TipShape, radius: f64) -> Result<Self, SettingError> {
        SettingError::check("tip.radius_mm", radius * 1e3, radius >= 0.0, "0 to 1000 mm")?;
        let sizes = TipSizes::default();
        let (round, low, high) = match shape {
            TipShape::Ball => return Ok(Self::ball(radius)),
            TipShape::Flat {
                edge_radius,
                length,
            } => {
                SettingError::check(
                    "tip.radius_mm",
                    radius * 1e3,
                    radius > 0.0,
                    "more than 0 mm for a flat tip",
                )?;
                TipSizes {
                    edge_radius: Some(edge_radius),
                    length: Some(length),
                    ..sizes
                }
                .check()?;
                let (is_edge, is_length) = (edge_radius <= radius, length > edge_radius);
                SettingError::check(
                    "tip.edge_radius_mm",
                    edge_radius * 1e3,
                    is_edge,
                    "0 mm to tip.radius_mm",
                )?;
                let allowed = "more than tip.edge_radius_mm, to 1000 mm";
                SettingError::check("tip.length_mm", length * 1e3, is_length, allowed)?;
                (
                    edge_radius,
                    vector![radius - edge_radius, edge_radius],
                    vector![radius - edge_radius, length],
                )
            }
            TipShape::Cone { half_angle, length } => {
                TipSizes {
                    half_angle: Some(half_angle),
                    length: Some(length),
                    ..sizes
                }
                .check()?;
                (
                    radius,
                    Vector2::zeros(),
                    vector![length * half_angle.tan(), length],
                )
            }
        };
        let side = high - low;
        let flank = vector![side.y, -side.x] / side.x.hypot(side.y);
        Ok(Self {
            shape,
            radius,
            round,
            low,
            high,
            flank,
        })
    }

    /// Tip shape.
    pub fn shape(&self) -> TipShape {
        self.shape
    }

    /// Radius of the ball, of the flat end, or of the nose of the cone, m.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Whether the tip is a plain ball.
    #[inline]
    pub(crate) fn is_ball(&self) -> bool {
        self.shape == TipShape::Ball
    }

    /// Resolution, m: the radius, but for a cone with a sharp nose no less than the spacing of
    /// strokes by hand.
    pub fn scale(&self) -> f64 {
        match self.shape {
            TipShape::Cone { .. } => self.radius.max(HAND),
            _ => self.radius,
        }
    }

    /// Support point: point of the tip farthest along `direction` (unit, in O), m, in O.
    pub fn support(&self, place: &TipPlace, direction: &Vector3<f64>) -> Point3<f64> {
        if self.is_ball() {
            return place.centre + direction * self.round;
        }
        let (along, across, outward) = split(&place.axis, direction);
        let height = |corner: &Vector2<f64>| corner.x * across + corner.y * along;
        let corner = if height(&self.high) > height(&self.low) {
            self.high
        } else {
            self.low
        };
        place.centre + outward * corner.x + place.axis * corner.y + direction * self.round
    }

    /// Signed distance of `x` (m, in O) from the tip, m: negative inside.
    #[inline]
    pub fn signed_distance(&self, place: &TipPlace, x: &Point3<f64>) -> f64 {
        if self.is_ball() {
            (x - place.centre).norm() - self.round
        } else {
            self.shortest_exit(place, x).0
        }
    }

    /// Signed distance of `x` (m, in O), and the direction in which it grows, unit, in O; zero if
    /// there is none.
    pub(crate) fn shortest_exit(&self, place: &TipPlace, x: &Point3<f64>) -> (f64, Vector3<f64>) {
        let arm = x - place.centre;
        let height = arm.dot(&place.axis);
        let across = arm - place.axis * height;
        let from_axis = across.norm();
        let (distance, out) = self.core_distance(&vector![from_axis, height]);
        let outward = across
            .try_normalize(ON_AXIS * self.radius)
            .unwrap_or_else(|| tangent_basis(&place.axis)[0]);
        (distance - self.round, outward * out.x + place.axis * out.y)
    }

    /// Signed distance of a point of the half plane from the core, m, and its gradient there.
    fn core_distance(&self, p: &Vector2<f64>) -> (f64, Vector2<f64>) {
        let &Self {
            low, high, flank, ..
        } = self;
        let sides = [
            (low.y - p.y, vector![0.0, -1.0]),
            ((p - low).dot(&flank), flank),
            (p.y - high.y, Vector2::y()),
        ];
        let deepest = if sides[1].0 > sides[0].0 {
            sides[1]
        } else {
            sides[0]
        };
        let deepest = if sides[2].0 > deepest.0 {
            sides[2]
        } else {
            deepest
        };
        if deepest.0 <= 0.0 {
            return deepest;
        }
        let closest = [
            (vector![0.0, low.y], low),
            (low, high),
            (high, vector![0.0, high.y]),
        ]
        .map(|(a, b)| {
            let (along, arm) = (b - a, p - a);
            let share = along.dot(&arm) / along.dot(&along).max(f64::MIN_POSITIVE);
            arm - along * share.clamp(0.0, 1.0)
        });
        let arm = closest
            .into_iter()
            .min_by(|a, b| a.x.hypot(a.y).total_cmp(&b.x.hypot(b.y)))
            .unwrap_or_default();
        let distance = arm.x.hypot(arm.y).max(f64::MIN_POSITIVE);
        (distance, arm / distance)
    }

    /// Contact of the tip with a surface that faces `normal` (unit, in O), uncertain by `sigma`
    /// (rad).
    ///
    /// A flat end touches with its whole face if its axis may be the normal, else with the point of
    /// its rim; the side of a cylinder may lie on a wall or lean on an edge. `None` for the flank
    /// of a cone and the shaft behind it: the force does not determine the point along it.
    pub(crate) fn touched(
        &self,
        place: &TipPlace,
        normal: &Vector3<f64>,
        sigma: f64,
    ) -> Option<TipContact> {
        let sharp = |point| {
            Some(TipContact {
                point,
                normal: *normal,
                is_vague: false,
            })
        };
        if self.is_ball() {
            return sharp(place.centre - normal * self.round);
        }
        let (along, across, outward) = split(&place.axis, &-normal);
        let flush = (FLUSH_SIGMAS * sigma).max(LEAST_FLUSH);
        let lean = across.atan2(-along);
        if lean < flush && self.low.x > 0.0 {
            let point = place.centre + place.axis * (self.low.y - self.round);
            return Some(TipContact {
                point,
                normal: place.axis,
                is_vague: false,
            });
        }
        let is_vague = lean > self.flank.x.atan2(-self.flank.y) - flush;
        let is_beyond = lean > self.flank.x.atan2(-self.flank.y) + flush;
        if is_beyond || (is_vague && self.low.x != self.high.x) {
            return None;
        }
        let point =
            place.centre + outward * self.low.x + place.axis * self.low.y - normal * self.round;
        Some(TipContact {
            point,
            normal: *normal,
            is_vague,
        })
    }

    /// Heights on the axis of balls of one radius that together cover the tip, and that radius, m.
    pub(crate) fn cover(&self) -> (Vec<f64>, f64) {
        if self.is_ball() {
            return (vec![0.0], self.round);
        }
        let length = self.high.y - self.low.y;
        // finer than the width of the tip gains nothing, coarser covers space beside it
        let widest = self.low.x.max(self.high.x);
        let count = (length / (widest + self.round)).ceil().clamp(1.0, 64.0);
        let half = 0.5 * length / count;
        let heights = (0..count as usize)
            .map(|i| self.low.y + half * (2.0 * i as f64 + 1.0))
            .collect();
        (heights, widest.hypot(half) + self.round)
    }

    /// Height on the axis of the centre of a ball that holds the tip, and its radius, m.
    pub(crate) fn bound(&self) -> (f64, f64) {
        let half = 0.5 * (self.high.y - self.low.y);
        let widest = self.low.x.max(self.high.x);
        (self.low.y + half, widest.hypot(half) + self.round)
    }
}

/// Splits a direction: its part along the axis, the size of its part across, the direction of the
/// latter.
fn split(axis: &Vector3<f64>, direction: &Vector3<f64>) -> (f64, f64, Vector3<f64>) {
    let along = direction.dot(axis);
    let across = direction - axis * along;
    let size = across.norm();
    (
        along,
        size,
        if size > ON_AXIS {
            across / size
        } else {
            tangent_basis(axis)[0]
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    const FLAT: TipShape = TipShape::Flat {
        edge_radius: 0.2e-3,
        length: 5e-3,
    };
    const CONE: TipShape = TipShape::Cone {
        half_angle: 0.5,
        length: 4e-3,
    };

    fn bodies() -> [TipBody; 4] {
        [
            TipBody::ball(1.5e-3),
            TipBody::new(FLAT, 2e-3).unwrap(),
            TipBody::new(
                TipShape::Flat {
                    edge_radius: 0.0,
                    length: 3e-3,
                },
                2e-3,
            )
            .unwrap(),
            TipBody::new(CONE, 0.4e-3).unwrap(),
        ]
    }

    /// Directions all around, also for the axis of a tip.
    fn directions() -> Vec<Vector3<f64>> {
        let turn =
            |i: i32| UnitQuaternion::from_euler_angles(f64::from(i), 1.7 * f64::from(i), 0.3);
        (0..40).map(|i| turn(i) * Vector3::z()).collect()
    }

    fn place(axis: Vector3<f64>) -> TipPlace {
        TipPlace {
            centre: Point3::new(1e-3, -2e-3, 3e-3),
            axis,
        }
    }

    #[test]
    fn the_support_point_is_on_the_tip_and_no_point_of_it_is_farther() {
        for body in bodies() {
            for axis in directions() {
                let place = place(axis);
                for direction in directions() {
                    let farthest = body.support(&place, &direction);
                    assert!(
                        body.signed_distance(&place, &farthest).abs() < 1e-12,
                        "{body:?}"
                    );
                    // the whole tip is behind the plane there: a point in front of it has at least
                    // this distance
                    let beyond = farthest + direction * 1e-3;
                    assert!((body.signed_distance(&place, &beyond) - 1e-3).abs() < 1e-12);
                    for other in directions() {
                        let point = body.support(&place, &other);
                        assert!((point - farthest).dot(&direction) < 1e-12);
                    }
                }
            }
        }
    }

    #[test]
    fn the_distance_is_what_a_walk_to_the_surface_takes() {
        for body in bodies() {
            for (i, axis) in directions().into_iter().enumerate() {
                let place = place(axis);
                for (j, direction) in directions().into_iter().enumerate() {
                    let x = place.centre + direction * (((7 * i + j) % 13) as f64 * 0.4e-3);
                    let (distance, out) = body.shortest_exit(&place, &x);
                    let there = x - out * distance;
                    assert!(
                        body.signed_distance(&place, &there).abs() < 1e-9,
                        "{body:?} {distance}"
                    );
                }
            }
        }
    }

    #[test]
    fn sizes_by_hand() {
        let up = TipPlace {
            centre: Point3::origin(),
            axis: Vector3::z(),
        };
        let [ball, flat, sharp, cone] = bodies();
        assert_eq!(
            ball.support(&up, &-Vector3::z()),
            Point3::new(0.0, 0.0, -1.5e-3)
        );
        // the face is at z = 0, the side at 2 mm
        assert!(
            flat.signed_distance(&up, &Point3::new(1e-3, 0.0, 0.0))
                .abs()
                < 1e-15
        );
        assert!(
            flat.signed_distance(&up, &Point3::new(0.0, 2e-3, 3e-3))
                .abs()
                < 1e-15
        );
        assert!((flat.signed_distance(&up, &Point3::new(0.0, 0.0, 1.5e-3)) + 1.5e-3).abs() < 1e-15);
        assert!(
            (sharp.signed_distance(&up, &Point3::new(2.3e-3, 0.0, -0.4e-3)) - 0.5e-3).abs() < 1e-15
        );
        // 3 mm up, the flank is 0.4 mm away from a cone of 0.5 rad: tan 0.5 · 3 mm + 0.4 mm / cos
        // 0.5
        let flank = Point3::new(0.5f64.tan() * 3e-3 + 0.4e-3 / 0.5f64.cos(), 0.0, 3e-3);
        assert!(cone.signed_distance(&up, &flank).abs() < 1e-15);
        assert!(
            cone.signed_distance(&up, &Point3::new(0.0, 0.0, -0.4e-3))
                .abs()
                < 1e-15
        );
    }

    #[test]
    fn a_flat_end_touches_with_its_face_or_with_its_rim() {
        let flat = TipBody::new(
            TipShape::Flat {
                edge_radius: 0.0,
                length: 5e-3,
            },
            2e-3,
        )
        .unwrap();
        let tilted = |degrees: f64| {
            let axis = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), degrees.to_radians())
                * Vector3::z();
            flat.touched(
                &TipPlace {
                    centre: Point3::origin(),
                    axis,
                },
                &Vector3::z(),
                2f64.to_radians(),
            )
        };
        let face = tilted(2.5).unwrap();
        assert_eq!(face.point, Point3::origin());
        assert!((face.normal.angle(&Vector3::z()).to_degrees() - 2.5).abs() < 1e-9);
        // tilted by 10°, the rim at +x is 2 mm · sin 10° below the middle
        let rim = tilted(10.0).unwrap();
        assert!((rim.point - Point3::new(2e-3 * 0.984_808, 0.0, -2e-3 * 0.173_648)).norm() < 1e-8);
        assert_eq!((rim.normal, rim.is_vague), (Vector3::z(), false));
        // the side on a wall
        assert!(tilted(88.0).unwrap().is_vague && !tilted(85.0).unwrap().is_vague);
        assert_eq!(tilted(95.0), None, "the shaft, somewhere");
    }

    #[test]
    fn a_cone_says_nothing_of_where_its_flank_touches() {
        let cone = TipBody::new(CONE, 0.4e-3).unwrap();
        let up = TipPlace {
            centre: Point3::origin(),
            axis: Vector3::z(),
        };
        let facing = |angle: f64| Vector3::new(-angle.sin(), 0.0, angle.cos());
        let nose = cone.touched(&up, &facing(0.8), 0.03).unwrap();
        assert!((nose.point - Point3::from(facing(0.8) * -0.4e-3)).norm() < 1e-15);
        let flank = std::f64::consts::FRAC_PI_2 - 0.5;
        assert_eq!(cone.touched(&up, &facing(flank), 0.03), None);
        assert!(cone.touched(&up, &facing(flank - 0.06), 0.03).is_some());
    }

    #[test]
    fn balls_on_the_axis_cover_the_tip() {
        for body in bodies() {
            let (heights, radius) = body.cover();
            let (middle, bound) = body.bound();
            for axis in directions() {
                let place = place(axis);
                for direction in directions() {
                    let point = body.support(&place, &direction);
                    let near = |height: &f64| {
                        (point - (place.centre + axis * *height)).norm() <= radius + 1e-12
                    };
                    assert!(heights.iter().any(near), "{body:?}");
                    assert!((point - (place.centre + axis * middle)).norm() <= bound + 1e-12);
                }
            }
        }
    }

    #[test]
    fn impossible_tips_are_refused_by_name_value_and_remedy() {
        let refused = |shape, radius| TipBody::new(shape, radius).unwrap_err().to_string();
        let wide = TipShape::Flat {
            edge_radius: 3e-3,
            length: 5e-3,
        };
        assert_eq!(
            refused(wide, 2e-3),
            "tip.edge_radius_mm is 3; it must be 0 mm to tip.radius_mm"
        );
        let blunt = TipShape::Cone {
            half_angle: 1.5,
            length: 5e-3,
        };
        assert!(refused(blunt, 1e-3).starts_with("tip.half_angle_deg is 85.9"));
        assert!(
            refused(
                TipShape::Cone {
                    half_angle: 0.3,
                    length: 0.0
                },
                1e-3
            )
            .contains("length")
        );
        assert!(
            refused(
                TipShape::Flat {
                    edge_radius: 0.0,
                    length: f64::NAN
                },
                1e-3
            )
            .contains("length")
        );
        assert!(refused(FLAT, 0.0).contains("radius"));
        assert!(refused(TipShape::Ball, -1.0).contains("radius"));
    }
}
