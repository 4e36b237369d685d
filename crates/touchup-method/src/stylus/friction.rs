//! Normal of the touched surface under a force that friction tilts.
//!
//! The contact force of a sliding ball is F = N (n − μ t), with the direction of sliding t: F lies
//! at φ = atan μ from the normal n, in the plane of the two, behind. Two methods measure φ. The
//! first uses this instant alone: t is at right angles to n, hence sin φ = −F̂·t; this needs no μ,
//! but an error of t out of the surface becomes an error of n, degree for degree. The second uses
//! all earlier samples: over a stretch of sliding, the working share of the force, ∫ −F·dx / ∫ |F|
//! |dx|, is sin φ, and hardly depends on the noise of the positions. With φ known, t only has to
//! give the direction *along* the surface, and its error enters by the factor φ.
//! [`Friction::normal`] weights the two by their variances.
//!
//! At speeds below the noise of the velocity t is unknown too; the force then decides alone, within
//! the cone.

use nalgebra::Vector3;

use touchup_geometry::numeric::direction;

/// Cosine of the widest friction cone accepted by default: cos 24° (μ = 0.45, dry metal on metal).
/// It bounds the angle between normal and force, for the haptic update and for the evidence of the
/// reconstruction.
pub(crate) const WIDEST_CONE_COSINE: f64 = 0.9135;

/// Velocity and contact force of the ball at one instant, averaged over a short time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sliding {
    /// force of the object on the stylus, N, in O
    pub force_o: Vector3<f64>,
    /// velocity of the real centre of the ball, m/s, in O
    pub velocity: Vector3<f64>,
    /// standard deviation of each component of the velocity, m/s
    pub velocity_sigma: f64,
}

/// The measured normal of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalEstimate {
    /// outward unit normal, in O
    pub normal: Vector3<f64>,
    /// standard deviation of its direction, rad
    pub sigma: f64,
}

impl NormalEstimate {
    /// The force itself, for use without a friction estimate; `None` without a force.
    ///
    /// - `force_o`: force of the object on the stylus, N, in O.
    pub(crate) fn of_force(force_o: &Vector3<f64>) -> Option<Self> {
        direction(force_o).map(|normal| Self {
            normal,
            sigma: LEAST_SIGMA,
        })
    }
}

/// A coefficient of kinetic friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionCoefficient {
    /// median over the stretches of sliding
    pub mu: f64,
    /// standard error of that median
    pub sigma: f64,
    /// standard deviation between stretches, by the quartiles
    pub spread: f64,
    /// number of stretches
    pub stretches: u32,
}

/// Friction estimated while the ball slides.
///
/// # Example
/// ```
/// use nalgebra::Vector3;
/// use touchup_method::stylus::{Friction, Sliding};
///
/// // 1 s at 25 mm/s along x on a floor, μ = 0.2
/// let mut friction = Friction::new(0.42);
/// let slide = Sliding {
///     force_o: Vector3::new(-0.4, 0.0, 2.0),
///     velocity: Vector3::new(25e-3, 0.0, 0.0),
///     velocity_sigma: 1e-3,
/// };
/// for _ in 0..1000 {
///     friction.observe(&slide, 1e-3);
/// }
/// assert!((friction.coefficient().ok_or("nothing slid")?.mu - 0.2).abs() < 5e-3);
/// // an error of the velocity out of the surface hardly tilts the normal any more
/// let lifted = Sliding { velocity: Vector3::new(25e-3, 0.0, 5e-3), velocity_sigma: 5e-3, ..slide };
/// let estimate = friction.normal(&lifted).ok_or("no force")?;
/// assert!(estimate.normal.angle(&Vector3::z()).to_degrees() < 1.5);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Friction {
    /// rad
    widest: f64,
    stretch: SlidingStretch,
    /// the whole path, until the coefficient is known
    early: SlidingStretch,
    /// number of stretches with a coefficient within each bin
    bins: [u32; BINS],
    known: Option<FrictionCoefficient>,
    /// φ = atan μ and its standard deviation for one more place, rad
    angle: [f64; 2],
}

/// A piece of sliding, for one coefficient.
#[derive(Clone, Copy, Debug, Default)]
struct SlidingStretch {
    /// m
    length: f64,
    /// ∫ −F·dx, J
    work: f64,
    /// ∫ |F| |dx|, J
    most_work: f64,
}

impl SlidingStretch {
    fn extend(&mut self, piece: &Self) {
        self.length += piece.length;
        self.work += piece.work;
        self.most_work += piece.most_work;
    }
}

/// Width of a bin: half of it tilts a normal by 0.03°.
const BIN: f64 = 0.001;
/// Bins from 0 to 1.
const BINS: usize = 1000;
/// Length of a stretch, m: 0.2 s of a calm hand, long enough for the noise of the positions to
/// vanish.
const STRETCH: f64 = 5e-3;
/// Minimum number of stretches for a coefficient.
const FEWEST: u32 = 4;
/// Standard deviation of φ before [`FEWEST`] stretches, rad: friction varies with place and
/// direction.
const EARLY_SIGMA: f64 = 0.03;
/// Error of the ends of the path before [`FEWEST`] stretches, m: 0.2 mm of pose noise, smoothed.
const EARLY_PATH: f64 = 0.1e-3;
/// Speed of creep, at which friction is undecided, m/s.
const CREEP: f64 = 1e-3;
/// Speed below which the ball may be at rest, in standard deviations of the velocity.
const CLEAR: f64 = 3.0;
/// Maximum friction of a dry surface.
const MOST_FRICTION: f64 = 0.8;
/// φ and its standard deviation before any measurement, rad: μ from 0.05 to 0.3.
const USUAL_ANGLE: [f64; 2] = [0.17, 0.12];
/// Lower bound of the error of friction and force, rad: bias and noise of a usual force sensor,
/// 0.05 N of 2.5 N.
const LEAST_SIGMA: f64 = 0.015;
/// Difference of the two methods for φ from which they contradict each other, in standard
/// deviations.
const CONTRADICTION: f64 = 3.0;

impl Friction {
    /// Friction before the first sample.
    ///
    /// - `widest`: angle of the widest friction cone accepted, rad.
    pub fn new(widest: f64) -> Self {
        let (stretch, early) = (SlidingStretch::default(), SlidingStretch::default());
        Self {
            widest,
            stretch,
            early,
            bins: [0; BINS],
            known: None,
            angle: USUAL_ANGLE,
        }
    }

    /// Takes in the motion of the ball in contact during `dt` (s).
    pub fn observe(&mut self, sliding: &Sliding, dt: f64) {
        let Sliding {
            force_o,
            velocity,
            velocity_sigma,
        } = sliding;
        // two of the three components are along the surface, where noise makes the path longer
        let speed = (velocity.norm_squared() - 2.0 * velocity_sigma * velocity_sigma)
            .max(0.0)
            .sqrt();
        if speed < CREEP.max(CLEAR * velocity_sigma) {
            return;
        }
        let (length, work) = (speed * dt, -force_o.dot(velocity) * dt);
        let piece = SlidingStretch {
            length,
            work,
            most_work: force_o.norm() * length,
        };
        self.stretch.extend(&piece);
        if self.known.is_none() {
            self.early.extend(&piece);
            self.guess();
        }
        if self.stretch.length >= STRETCH {
            let SlidingStretch {
                work, most_work, ..
            } = std::mem::take(&mut self.stretch);
            if most_work > 0.0 {
                self.note(work / most_work);
            }
        }
    }

    /// Notes that the ball has left the surface: the next contact begins another stretch.
    pub(crate) fn lift(&mut self) {
        self.stretch = SlidingStretch::default();
    }

    /// The friction; `None` until the ball has slid far enough, and beyond any real friction:
    /// motion and force then do not belong together.
    pub fn coefficient(&self) -> Option<FrictionCoefficient> {
        self.known.filter(|found| found.mu <= MOST_FRICTION)
    }

    /// Normal under the ball; `None` without a force.
    pub fn normal(&self, sliding: &Sliding) -> Option<NormalEstimate> {
        let along_force = direction(&sliding.force_o)?;
        let [usual, usual_sigma] = self.angle;
        let (speed, noise) = (sliding.velocity.norm(), sliding.velocity_sigma);
        let across_force = sliding.velocity - along_force * sliding.velocity.dot(&along_force);
        let across_speed = across_force.norm();
        if across_speed <= 0.0 {
            return Some(NormalEstimate {
                normal: along_force,
                sigma: usual.hypot(usual_sigma),
            });
        }
        // error of the sliding direction, rad
        let astray = (noise / speed).min(1.0).hypot(LEAST_SIGMA);
        let measured = (-sliding.velocity.dot(&along_force) / speed)
            .clamp(-1.0, 1.0)
            .asin();
        let contradiction = (measured - usual).powi(2);
        let bound = CONTRADICTION * CONTRADICTION * (astray * astray + usual_sigma * usual_sigma);
        let [measured_weight, usual_weight] = [astray.powi(-2), usual_sigma.powi(-2)];
        let mut variance = 1.0 / (measured_weight + usual_weight);
        let angle = ((measured * measured_weight + usual * usual_weight) * variance)
            .clamp(0.0, self.widest);
        if contradiction > bound {
            // another friction, two surfaces at once, or no sliding at all
            variance += contradiction;
        }
        // distinctness of the direction along the surface from noise
        let squared = across_speed * across_speed;
        let clear = squared / (squared + 2.0 * noise * noise + CREEP * CREEP);
        variance += angle * angle * (astray * astray + 1.0 - clear * clear).min(1.0);
        let normal =
            (along_force + across_force * (angle.tan() * clear / across_speed)).normalize();
        Some(NormalEstimate {
            normal,
            sigma: variance.sqrt(),
        })
    }

    /// Counts a stretch with this sin φ.
    fn note(&mut self, sine: f64) {
        let sine = sine.clamp(0.0, std::f64::consts::FRAC_1_SQRT_2);
        let mu = sine / (1.0 - sine * sine).sqrt();
        self.bins[((mu / BIN) as usize).min(BINS - 1)] += 1;
        let stretches = self
            .bins
            .iter()
            .fold(0u32, |sum, &count| sum.saturating_add(count));
        if stretches >= FEWEST {
            let [low, mu, high] =
                [0.25, 0.5, 0.75].map(|share| self.quantile(share * f64::from(stretches)));
            // of a normal distribution: the quartiles are 1.349 standard deviations apart, and the
            // median varies by √(π/2) times as much as the mean
            let spread = (high - low) / 1.349;
            let sigma = 1.2533 * spread / f64::from(stretches).sqrt();
            self.known = Some(FrictionCoefficient {
                mu,
                sigma,
                spread,
                stretches,
            });
            let per_angle = 1.0 / (1.0 + mu * mu);
            self.angle = [
                mu.atan(),
                (spread.hypot(sigma) * per_angle).hypot(LEAST_SIGMA),
            ];
        }
    }

    /// Estimates φ from too few stretches.
    fn guess(&mut self) {
        let SlidingStretch {
            length,
            work,
            most_work,
        } = self.early;
        let sine =
            (work / most_work.max(f64::MIN_POSITIVE)).clamp(0.0, std::f64::consts::FRAC_1_SQRT_2);
        let ([usual, usual_sigma], measured_sigma) =
            (USUAL_ANGLE, EARLY_SIGMA.hypot(EARLY_PATH / length));
        let [measured, before] = [measured_sigma, usual_sigma].map(|sigma| sigma.powi(-2));
        let mean = (sine.asin() * measured + usual * before) / (measured + before);
        self.angle = [mean, (measured + before).powf(-0.5).hypot(EARLY_SIGMA)];
    }

    /// The coefficient below which `rank` stretches lie, interpolated within its bin.
    fn quantile(&self, rank: f64) -> f64 {
        let mut below = 0.0;
        for (at, &count) in (0u32..).zip(&self.bins) {
            let count = f64::from(count);
            if below + count >= rank && count > 0.0 {
                return BIN * (f64::from(at) + (rank - below) / count);
            }
            below += count;
        }
        1.0
    }
}
