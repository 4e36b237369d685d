//! Sign and axes of the wrench: a force points out of the pressed surface and, if the ball slides,
//! against its motion.
//!
//! Each candidate reading of the wrench turns the measured forces. Its score is the mean cosine
//! between the forces and n − μ t, with the scan's normal n, the sliding direction t, and the best
//! friction μ for that reading. One reading is any rotation [Wahba 1965]: it must be clearly better
//! than the readings without free parameters.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::finding::{InputCause, InputFinding};
use super::forces::{ForceLevels, axes_in_words, signed_permutations};
use super::input_record::InputRecord;
use touchup_geometry::numeric::{VoxelKey, jackknife_variance, mean};

/// Length of the sliding path, m: short enough to be straight, long enough to average pose noise.
const COURSE: std::ops::RangeInclusive<f64> = 0.3e-3..=10e-3;
/// Maximum number of earlier records in the search for that path.
const MOST_BACK: usize = 16;
/// Maximum steepness of a sliding path, as cosine to the normal.
const STEEP: f64 = 0.5;
/// Minimum mean cosine of a right reading.
const LEANS: f64 = 0.5;
/// Minimum gain in mean cosine of a better reading.
const LEAST_GAIN: f64 = 0.02;
/// Minimum gain of a better reading, in standard errors.
const CLEAR_ERRORS: f64 = 3.0;
/// Minimum number of presses, and of places, for a finding.
const FEWEST: usize = 32;
const FEWEST_PLACES: usize = 6;
/// Minimum number of places for a rotation, which has three free parameters.
const FEWEST_TURNED: usize = 24;
/// Maximum friction of a dry surface.
const MOST_FRICTION: f64 = 0.8;
/// Rounds of friction and rotation.
const ROUNDS: usize = 4;
/// Maximum angle to swapped and reversed axes for naming them, rad.
const NAMED_ANGLE: f64 = 0.2;
const WRENCH_FRAME_REMEDY: &str = "the frame_id of the wrench names its axes: that of the pose the scan's, any other the stylus' own";
const W_LAST: &str = "give the orientation as x, y, z, w";

/// A press on the scan, in the axes of the wrench as read.
pub(super) struct ReadPress {
    /// place on which presses share the errors of the scan
    pub place: VoxelKey,
    /// outward normal of the scan; a unit vector
    pub normal: Vector3<f64>,
    /// sliding direction of the ball over the scan; 0 if it does not slide
    pub course: Vector3<f64>,
    /// the measured force as a unit vector: as read, and by the other readings
    pub force: Vector3<f64>,
    pub in_other_frame: Vector3<f64>,
    pub w_first: Vector3<f64>,
}

/// A reading of the wrench, with its score.
struct WrenchReading {
    cause: Option<InputCause>,
    says: String,
    remedy: &'static str,
    cosines: Vec<f64>,
    mean: f64,
}

impl WrenchReading {
    /// - `force`: under this reading.
    fn of(
        presses: &[ReadPress],
        (cause, says, remedy): (Option<InputCause>, &str, &'static str),
        force: impl Fn(&ReadPress) -> Vector3<f64>,
    ) -> Self {
        let friction = friction_of(presses, &force);
        let cosines: Vec<f64> = presses
            .iter()
            .map(|press| force(press).dot(&press.expected(friction)))
            .collect();
        Self {
            cause,
            says: says.to_owned(),
            remedy,
            mean: mean(cosines.iter().copied()),
            cosines,
        }
    }

    /// Lead over another reading, in standard errors.
    fn errors_beyond(&self, other: &Self, presses: &[ReadPress]) -> f64 {
        let gains: Vec<f64> = self
            .cosines
            .iter()
            .zip(&other.cosines)
            .map(|(one, other)| one - other)
            .collect();
        errors_of_mean(presses, &gains)
    }
}

impl ReadPress {
    fn expected(&self, friction: f64) -> Vector3<f64> {
        (self.normal - self.course * friction).normalize()
    }
}

/// Best friction of a reading.
fn friction_of(presses: &[ReadPress], force: &impl Fn(&ReadPress) -> Vector3<f64>) -> f64 {
    let slides = || {
        presses
            .iter()
            .filter(|press| press.course != Vector3::zeros())
    };
    let sum = |of: &dyn Fn(&ReadPress) -> Vector3<f64>| {
        slides()
            .map(|press| force(press).dot(&of(press)))
            .sum::<f64>()
    };
    let [along, against] = [sum(&|press| press.normal), sum(&|press| -press.course)];
    (against / along.max(f64::MIN_POSITIVE)).clamp(0.0, MOST_FRICTION)
}

/// The rotation that brings the forces nearest to their expected directions; with `is_mirrored` the
/// best rotation with reversal.
fn best_turn(presses: &[ReadPress], is_mirrored: bool) -> Option<Matrix3<f64>> {
    let mut turn = Matrix3::identity() * if is_mirrored { -1.0 } else { 1.0 };
    for _ in 0..ROUNDS {
        let friction = friction_of(presses, &|press| turn * press.force);
        let sum: Matrix3<f64> = presses
            .iter()
            .map(|press| press.expected(friction) * press.force.transpose())
            .sum();
        let svd = sum.svd(true, true);
        let (u, v_t) = (svd.u?, svd.v_t?);
        let wanted = if is_mirrored { -1.0 } else { 1.0 };
        let least = svd.singular_values.imin();
        let mut signs = Vector3::repeat(1.0);
        signs[least] = wanted * (u.determinant() * v_t.determinant()).signum();
        turn = u * Matrix3::from_diagonal(&signs) * v_t;
    }
    Some(turn)
}

/// Name of a wrench rotation: swapped and reversed axes, or an angle about an axis.
fn turn_in_words(turn: &Matrix3<f64>) -> String {
    let off = |axes: &Matrix3<f64>| (axes.transpose() * turn).trace();
    let near = signed_permutations().max_by(|a, b| off(a).total_cmp(&off(b)));
    if let Some(axes) = near.filter(|axes| off(axes) > 1.0 + 2.0 * NAMED_ANGLE.cos()) {
        return format!("with its axes taken as {}", axes_in_words(&axes));
    }
    let is_mirrored = turn.determinant() < 0.0;
    let rotation = Rotation3::from_matrix(&if is_mirrored { -turn } else { *turn });
    let axis = rotation.scaled_axis().normalize();
    format!(
        "{}turned by {:.0}° about its ({:.2}, {:.2}, {:.2})",
        if is_mirrored { "reversed and " } else { "" },
        rotation.angle().to_degrees(),
        axis.x,
        axis.y,
        axis.z
    )
}

/// Readings without free parameters, the best first.
fn fixed_readings(presses: &[ReadPress], other_frame: &str) -> [WrenchReading; 3] {
    let sign = "reverse the wrench: it is what the part does to the stylus";
    let named = |cause, says, remedy| (Some(cause), says, remedy);
    let mut readings = [
        WrenchReading::of(
            presses,
            named(InputCause::WrenchSign, "reversed", sign),
            |press| -press.force,
        ),
        WrenchReading::of(
            presses,
            named(InputCause::WrenchFrame, other_frame, WRENCH_FRAME_REMEDY),
            |press| press.in_other_frame,
        ),
        WrenchReading::of(
            presses,
            named(
                InputCause::QuaternionOrder,
                "with w first in the quaternion",
                W_LAST,
            ),
            |press| press.w_first,
        ),
    ];
    readings.sort_by(|a, b| b.mean.total_cmp(&a.mean));
    readings
}

/// The best rotation of the forces, or rotation and reversal.
fn turned_reading(presses: &[ReadPress]) -> Option<WrenchReading> {
    [false, true]
        .into_iter()
        .filter_map(|is_mirrored| {
            let turn = best_turn(presses, is_mirrored)?;
            let says = turn_in_words(&turn);
            let named = (
                Some(InputCause::WrenchFrame),
                says.as_str(),
                WRENCH_FRAME_REMEDY,
            );
            Some(WrenchReading::of(presses, named, |press| {
                turn * press.force
            }))
        })
        .max_by(|a, b| a.mean.total_cmp(&b.mean))
}

/// The fault in sign or axes of the wrench; `None` if no reading explains the forces better than
/// the given one. The flag: it is a turn by any angle.
///
/// - `presses`: on the scan.
/// - `other_frame`: the other possible axes of the wrench, in words.
pub(super) fn judge_wrench(
    presses: &[ReadPress],
    other_frame: &str,
) -> Option<(InputFinding, bool)> {
    let places: BTreeSet<VoxelKey> = presses.iter().map(|press| press.place).collect();
    if presses.len() < FEWEST || places.len() < FEWEST_PLACES {
        return None;
    }
    let as_read = WrenchReading::of(presses, (None, "", ""), |press| press.force);
    let others = fixed_readings(presses, other_frame);
    let turned = (places.len() >= FEWEST_TURNED)
        .then(|| turned_reading(presses))
        .flatten();
    let is_better = |one: &WrenchReading, other: &WrenchReading| {
        one.mean > other.mean + LEAST_GAIN && one.errors_beyond(other, presses) > CLEAR_ERRORS
    };
    // with another quaternion order the stylus stands upside down
    let is_possible = |other: &&WrenchReading| {
        other.cause != Some(InputCause::QuaternionOrder) || as_read.mean < LEANS
    };
    let fixed = others
        .iter()
        .find(|other| is_possible(other))
        .filter(|first| first.mean > as_read.mean)
        .unwrap_or(&as_read);
    let turned = turned.as_ref();
    let turned = turned.filter(|turned| turned.mean > fixed.mean + LEAST_GAIN);
    let best = turned.unwrap_or(fixed);
    let cause = best.cause.filter(|_| is_better(best, &as_read))?;
    // with w first and an upright stylus, the wrench is right in the axes of the poses
    let is_order = cause == InputCause::QuaternionOrder;
    let is_refuted =
        |other: &WrenchReading| is_order || other.cause == best.cause || is_better(best, other);
    let is_sure = best.mean > LEANS && others.iter().filter(is_possible).all(is_refuted);
    let degrees = |cosine: f64| cosine.clamp(-1.0, 1.0).acos().to_degrees();
    let measured = format!(
        "where the ball presses, the force leans {:.0}° from where the scan's normal and its sliding have it, and {:.0}° {}",
        degrees(as_read.mean),
        degrees(best.mean),
        best.says
    );
    let finding = InputFinding::new(cause, is_sure, measured, best.remedy);
    Some((finding, turned.is_some()))
}

/// The unit vector along the scan, in O, of the sliding that ends at record `at`, from an earlier
/// press with only presses between; 0 without sliding.
///
/// - `normal`: of the scan under it.
pub(super) fn course_at(
    records: &[InputRecord],
    levels: &ForceLevels,
    at: usize,
    normal: &Vector3<f64>,
) -> Vector3<f64> {
    let record = &records[at];
    records[at.saturating_sub(MOST_BACK)..at]
        .iter()
        .rev()
        .take_while(|other| levels.is_pressing(other))
        .map(|other| record.centre - other.centre)
        .find(|way| way.norm() >= *COURSE.start())
        .filter(|way| COURSE.contains(&way.norm()))
        .map(|way| way.normalize())
        .filter(|way| way.dot(normal).abs() < STEEP)
        .map_or_else(Vector3::zeros, |way| {
            (way - normal * way.dot(normal)).normalize()
        })
}

impl ReadPress {
    /// - `axes`: rotation from O to the axes of the wrench as read.
    pub(crate) fn new(
        place: VoxelKey,
        axes: &UnitQuaternion<f64>,
        [normal, course]: [Vector3<f64>; 2],
        [force, in_other_frame, w_first]: [Vector3<f64>; 3],
    ) -> Self {
        let unit = |force: Vector3<f64>| axes * force.try_normalize(0.0).unwrap_or_default();
        Self {
            place,
            normal: axes * normal,
            course: axes * course,
            force: unit(force),
            in_other_frame: unit(in_other_frame),
            w_first: unit(w_first),
        }
    }
}

/// A mean in standard errors, by the jackknife over places: all presses on one place share the
/// error of the scan's normal.
fn errors_of_mean(presses: &[ReadPress], values: &[f64]) -> f64 {
    let mut places: BTreeMap<VoxelKey, (f64, usize)> = BTreeMap::new();
    for (press, value) in presses.iter().zip(values) {
        let (sum, count) = places.entry(press.place).or_default();
        (*sum, *count) = (*sum + value, *count + 1);
    }
    let (sum, count) = (values.iter().sum::<f64>(), values.len());
    let without: Vec<f64> = places
        .values()
        .map(|(of_place, some)| (sum - of_place) / (count - some).max(1) as f64)
        .collect();
    mean(values.iter().copied()) / jackknife_variance(&without).sqrt().max(f64::MIN_POSITIVE)
}
