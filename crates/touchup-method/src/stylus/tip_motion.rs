//! Ball centre, sliding direction and surface normal, from past samples alone.

use nalgebra::{Point3, Vector3};

use super::friction::WIDEST_CONE_COSINE;
use super::{Friction, FrictionCoefficient, NormalEstimate, Sliding, Tip};
use crate::parameters;

parameters! {
    /// The ball at the end of stylus or probe: by default a 3 mm ruby ball on a usual stylus.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct TipParams in "tip" {
        /// Radius of the ball, of the flat end, or of the nose of the cone.
        ///
        /// In m; 0 for a point.
        radius: f64 = 1.5, "radius_mm" [MM, 0, 1000];
        /// Stiffness of stylus and holder at the ball; left out: rigid.
        ///
        /// In N/m; `None` if rigid or unknown.
        stiffness: Option<f64> = Some(20.0), "stiffness_n_per_mm" [N_PER_MM, 0.001, 1e9, "leave it out for rigid"];
    }
}

impl TipParams {
    /// Real ball centre, m: the pose assumes a rigid stylus, and the force F bends it back by F/k.
    pub(crate) fn centre(&self, reported: &Point3<f64>, force_o: &Vector3<f64>) -> Point3<f64> {
        self.stiffness
            .map_or(*reported, |stiffness| reported + force_o / stiffness)
    }
}

parameters! {
    /// Parameters of [`TipMotion`] and of the normal under the ball.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct SlidingParams in "sliding" {
        /// Time constant of the filter on position and force.
        ///
        /// In s; 0 filters nothing. 6 ms are three poses at 500 Hz: 0.2 mm of pose noise becomes
        /// 0.1 mm, while a hand at 50 mm/s lags 0.3 mm behind, along the surface.
        smoothing: f64 = 6.0, "smoothing_ms" [MS, 0, 10000];
        /// Time constant of the filter on the velocity.
        ///
        /// In s. With 0.2 mm of pose noise and μ = 0.4 half of the normals are then within 3° (12
        /// ms: 4°); for a hand that turns by 5 rad/s they lag 6° behind, along the surface.
        velocity_smoothing: f64 = 20.0, "velocity_smoothing_ms" [MS, 0, 10000];
        /// Uncertainty of the velocity; below this speed the sliding direction hardly determines
        /// the normal.
        ///
        /// In m/s: 2.5 times the noise of the velocity for 0.2 mm of pose noise.
        slowest: f64 = 8.0, "slowest_mm_per_s" [MM_PER_S, 0, 1e6];
        /// Cosine of the widest accepted friction cone; 0.9135 is 24 degrees, a friction
        /// coefficient of 0.45.
        ///
        /// Maximum angle between normal and force: dry metal on metal.
        cone_cosine: f64 = WIDEST_CONE_COSINE, "cone_cosine" [ONE, 0, 1];
    }
}

/// The ball by causally smoothed position and force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Reported ball centre (of a rigid stylus), smoothed, m, in O.
    pub reported: Point3<f64>,
    /// Real ball centre: reported centre plus deflection of the stylus, m, in O.
    pub centre: Point3<f64>,
    /// Force of the object on the stylus, smoothed likewise, N, in O.
    pub force_o: Vector3<f64>,
    /// Force smoothed once more, as the velocity is, for equal delays, N, in O.
    pub force_with_velocity: Vector3<f64>,
    /// Velocity of the real centre, m/s, in O: with the reported centre a change of force would
    /// appear as motion.
    pub velocity: Vector3<f64>,
}

/// Smooths position and force with one time constant, to keep them in step, and differentiates the
/// position.
#[derive(Clone, Debug)]
pub struct TipMotion {
    params: SlidingParams,
    tip: TipParams,
    last: Option<Ball>,
    friction: Friction,
    /// time in contact, s
    touched_for: f64,
}

/// Transient of the filters after contact onset, in time constants.
const TRANSIENT: f64 = 4.0;

/// Noise of the velocity, as a share of [`SlidingParams::slowest`].
const VELOCITY_NOISE: f64 = 0.4;

impl TipMotion {
    /// A filter without samples yet.
    pub fn new(params: SlidingParams, tip: TipParams) -> Self {
        let friction = Friction::new(params.cone_cosine.clamp(-1.0, 1.0).acos());
        Self {
            params,
            tip,
            last: None,
            friction,
            touched_for: 0.0,
        }
    }

    /// Takes the next tip, `dt` (s) after the previous one; a pause longer than `largest_gap` (s)
    /// restarts the filter.
    pub fn update(&mut self, tip: &Tip, dt: f64, largest_gap: f64) -> Ball {
        let (here, force) = (Point3::from(tip.pose_ot.translation.vector), tip.force_o);
        let ball = match self.last {
            Some(last) if dt > 0.0 && dt <= largest_gap => {
                let gain = follow(dt, self.params.smoothing);
                let reported = last.reported + (here - last.reported) * gain;
                let force_o = last.force_o + (force - last.force_o) * gain;
                let centre = self.tip.centre(&reported, &force_o);
                let velocity_now = (centre - last.centre) / dt;
                let slow_gain = follow(dt, self.params.velocity_smoothing);
                let velocity = last.velocity + (velocity_now - last.velocity) * slow_gain;
                let force_with_velocity =
                    last.force_with_velocity + (force_o - last.force_with_velocity) * slow_gain;
                Ball {
                    reported,
                    centre,
                    force_o,
                    force_with_velocity,
                    velocity,
                }
            }
            _ => self.unfiltered(tip),
        };
        self.last = Some(ball);
        ball
    }

    /// The ball of a single tip, for uses without velocity: no smoothing, no state.
    pub(crate) fn unfiltered(&self, tip: &Tip) -> Ball {
        let (reported, force_o) = (Point3::from(tip.pose_ot.translation.vector), tip.force_o);
        let centre = self.tip.centre(&reported, &force_o);
        Ball {
            reported,
            centre,
            force_o,
            force_with_velocity: force_o,
            velocity: Vector3::zeros(),
        }
    }

    /// Outward normal of the surface under the ball, in contact for the last `dt` (s); `None`
    /// without a force.
    pub fn surface_normal(&mut self, ball: &Ball, dt: f64) -> Option<NormalEstimate> {
        let velocity_sigma = VELOCITY_NOISE * self.params.slowest;
        let sliding = Sliding {
            force_o: ball.force_o,
            velocity: ball.velocity,
            velocity_sigma,
        };
        self.touched_for += dt;
        if self.touched_for > TRANSIENT * (self.params.smoothing + self.params.velocity_smoothing) {
            self.friction.observe(
                &Sliding {
                    force_o: ball.force_with_velocity,
                    ..sliding
                },
                dt,
            );
        }
        self.friction.normal(&sliding)
    }

    /// Notes that the ball is free.
    pub(crate) fn lift(&mut self) {
        self.touched_for = 0.0;
        self.friction.lift();
    }

    /// Measured kinetic friction; `None` until the ball has slid far enough.
    pub(crate) fn friction(&self) -> Option<FrictionCoefficient> {
        self.friction.coefficient()
    }
}

/// Step response of a first-order filter after `dt`.
fn follow(dt: f64, time_constant: f64) -> f64 {
    if time_constant > 0.0 {
        -(-dt / time_constant).exp_m1()
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Isometry3;

    const RIGID: TipParams = TipParams {
        radius: 1.5e-3,
        stiffness: None,
    };

    fn tip(x: f64) -> Tip {
        Tip {
            stamp_ns: 0,
            pose_ot: Isometry3::translation(x, 0.0, 0.0),
            force_o: Vector3::new(-0.3, 0.0, 2.0),
            torque_o: Vector3::zeros(),
        }
    }

    #[test]
    fn friction_does_not_tilt_the_normal_of_a_sliding_ball() {
        let mut motion = TipMotion::new(SlidingParams::default(), RIGID);
        let mut ball = motion.update(&tip(0.0), 0.0, 0.03);
        assert_eq!(
            motion.surface_normal(&ball, 0.0).unwrap().normal,
            ball.force_o.normalize(),
            "at rest the force is all there is"
        );
        // 20 mm/s along x, for 0.4 s: 20 time constants of the velocity
        for i in 1..400 {
            ball = motion.update(&tip(i as f64 * 2e-5), 1e-3, 0.03);
        }
        assert!((ball.velocity - Vector3::new(0.02, 0.0, 0.0)).norm() < 1e-6);
        let first = motion.surface_normal(&ball, 1e-3).unwrap().normal;
        assert!(
            first.angle(&Vector3::z()).to_degrees() < 2.0,
            "before the friction is known: {first}"
        );
        // 40 mm: eight stretches
        for _ in 0..2000 {
            motion.surface_normal(&ball, 1e-3);
        }
        // assumed noise of 3.2 mm/s: 2 · 3.2² / 20² = 5 % of atan 0.15 remain
        assert!(
            motion
                .surface_normal(&ball, 1e-3)
                .unwrap()
                .normal
                .angle(&Vector3::z())
                .to_degrees()
                < 0.6
        );
        assert!((motion.friction().unwrap().mu - 0.15).abs() < 5e-3);
    }

    #[test]
    fn a_changing_force_on_an_elastic_tip_is_no_motion() {
        let mut motion = TipMotion::new(
            SlidingParams::default(),
            TipParams {
                stiffness: Some(1e4),
                ..RIGID
            },
        );
        let mut ball = None;
        for i in 0..100 {
            // the real centre stays at x = 0 while the force rises by 2 N
            let force_o = Vector3::x() * (1.0 + 0.02 * f64::from(i));
            let pressed = Tip {
                force_o,
                ..tip(-force_o.x / 1e4)
            };
            ball = Some(motion.update(&pressed, 1e-3, 0.03));
        }
        assert!(ball.unwrap().velocity.norm() < 1e-12);
    }

    #[test]
    fn a_pause_restarts_the_filter() {
        let mut motion = TipMotion::new(SlidingParams::default(), RIGID);
        motion.update(&tip(0.0), 0.0, 0.03);
        let ball = motion.update(&tip(0.01), 0.5, 0.03);
        assert_eq!((ball.reported.x, ball.velocity), (0.01, Vector3::zeros()));
    }
}
