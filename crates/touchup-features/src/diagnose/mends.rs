//! Candidate mistakes in all poses or in the scan's unit, and their corrections.

use nalgebra::{Isometry3, Matrix3, Point3, Quaternion, UnitQuaternion, Vector3};

use super::finding::InputCause;
use super::forces::{axes_in_words, signed_permutations};
use super::input_record::InputRecord;
use touchup_method::stylus::Placement;

/// A correction of one mistake.
#[derive(Clone, Debug)]
pub(super) struct PlaceMend {
    /// corrected cause
    pub cause: InputCause,
    /// in words
    pub says: String,
    /// axes of the recorded positions, in the frame of the recording
    poses: Matrix3<f64>,
    /// the recording has w first in the quaternion, the reader took it last
    is_w_first: bool,
    /// length of a true 1 m in the scan as read, m
    pub scan_unit: f64,
    /// offset of the ball's centre from its assumed place, in the axes of T, m
    tip: Vector3<f64>,
}

impl PlaceMend {
    /// Corrected place of the ball, in the scan as read.
    pub(crate) fn centre(&self, placement: &Placement, record: &InputRecord) -> Point3<f64> {
        let pose = self.pose(placement, record);
        (pose.translation.vector + pose.rotation * self.tip)
            .scale(self.scan_unit)
            .into()
    }

    /// A force in O, if it shares the axes of the positions.
    pub(crate) fn turned(&self, force: &Vector3<f64>) -> Vector3<f64> {
        self.poses * force
    }

    /// Corrected rotation of the ball.
    pub(crate) fn rotation(
        &self,
        placement: &Placement,
        record: &InputRecord,
    ) -> UnitQuaternion<f64> {
        self.pose(placement, record).rotation
    }

    fn pose(&self, placement: &Placement, record: &InputRecord) -> Isometry3<f64> {
        let placed = Isometry3::from_parts(record.centre.into(), record.rotation);
        let recorded = placement.unplaced(record.stamp_ns, &placed);
        let rotation = if self.is_w_first {
            w_first(&recorded.rotation)
        } else {
            recorded.rotation
        };
        let position = self.poses * recorded.translation.vector;
        let mended = Isometry3::from_parts(position.into(), rotation);
        placement.placed(record.stamp_ns, &mended)
    }

    /// w first in the quaternion.
    pub(crate) fn w_first() -> Self {
        Self {
            cause: InputCause::QuaternionOrder,
            says: "the poses fit with w first in the quaternion".to_owned(),
            is_w_first: true,
            ..Self::of_poses(Matrix3::identity())
        }
    }

    fn of_poses(poses: Matrix3<f64>) -> Self {
        Self {
            cause: InputCause::PositionAxes,
            says: String::new(),
            poses,
            is_w_first: false,
            scan_unit: 1.0,
            tip: Vector3::zeros(),
        }
    }

    /// A ball farther along the stylus than the recorded point.
    ///
    /// - `tip`: from that point, in the axes of T, m.
    pub(crate) fn tip(tip: Vector3<f64>) -> Self {
        let [x, y, z] = [tip.x, tip.y, tip.z].map(|x| x * 1e3);
        Self {
            cause: InputCause::Frame,
            says: format!(
                "the ball is ({x:.0}, {y:.0}, {z:.0}) mm from the recorded point in the axes of the stylus"
            ),
            tip,
            ..Self::of_poses(Matrix3::identity())
        }
    }

    /// Usual length factors by which a file or driver is wrong.
    pub(crate) fn units() -> impl Iterator<Item = Self> {
        const UNITS: [(f64, f64, &str); 10] = [
            (1e-3, 1.0, "the poses look like mm, and are read as m"),
            (1e3, 1.0, "the poses look like km, and are read as m"),
            (
                25.4e-3,
                1.0,
                "the poses look like inches, and are read as m",
            ),
            (1e-2, 1.0, "the poses look like cm, and are read as m"),
            (1.0, 25.4, "the scan looks like mm, and is read as inches"),
            (1.0, 1e3, "the scan looks like mm, and is read as m"),
            (1.0, 1e-3, "the scan looks like m, and is read as mm"),
            (
                1.0,
                1.0 / 25.4,
                "the scan looks like inches, and is read as mm",
            ),
            (1.0, 25.4e-3, "the scan looks like m, and is read as inches"),
            (
                1.0,
                1e3 / 25.4,
                "the scan looks like inches, and is read as m",
            ),
        ];
        UNITS.into_iter().map(|(poses, scan_unit, says)| Self {
            cause: InputCause::LengthUnit,
            says: says.to_owned(),
            scan_unit,
            ..Self::of_poses(Matrix3::identity() * poses)
        })
    }

    /// Swapped and mirrored position axes.
    pub(crate) fn axes() -> impl Iterator<Item = Self> {
        signed_permutations().skip(1).map(|poses| Self {
            says: format!(
                "the positions fit with their axes taken as {}",
                axes_in_words(&poses)
            ),
            ..Self::of_poses(poses)
        })
    }
}

/// The intended orientation, for a source that puts w before x, y and z.
fn w_first(read: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(Quaternion::new(read.i, read.j, read.k, read.w))
}
