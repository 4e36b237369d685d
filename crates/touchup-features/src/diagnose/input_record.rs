//! Samples kept by the monitor, in bounded memory.

use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3, Vector4};

/// One kept sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct InputRecord {
    pub stamp_ns: i64,
    pub centre: Point3<f64>,
    pub rotation: UnitQuaternion<f64>,
    pub force_o: Vector3<f64>,
}

impl InputRecord {
    pub(crate) fn force_t(&self) -> Vector3<f64> {
        self.rotation.inverse_transform_vector(&self.force_o)
    }
}

/// Records at equal steps, at most [`Self::MOST`]: when full, every second one goes, and only every
/// second later one stays.
#[derive(Clone, Debug)]
pub(super) struct ThinnedRecords<const MOST: usize> {
    pub kept: Vec<InputRecord>,
    seen: u64,
    /// one record in this number stays
    stride: u64,
}

impl<const MOST: usize> Default for ThinnedRecords<MOST> {
    fn default() -> Self {
        Self {
            kept: Vec::new(),
            seen: 0,
            stride: 1,
        }
    }
}

impl<const MOST: usize> ThinnedRecords<MOST> {
    /// Takes the next record, made only if it stays; then returns its number in steps.
    pub(crate) fn push(&mut self, record: impl FnOnce() -> InputRecord) -> Option<u64> {
        let number = self
            .seen
            .is_multiple_of(self.stride)
            .then_some(self.seen / self.stride);
        if number.is_some() {
            if self.kept.len() == MOST {
                let mut at = 0;
                self.kept.retain(|_| {
                    at += 1;
                    at % 2 == 1
                });
                self.stride *= 2;
            }
            self.kept.push(record());
        }
        self.seen += 1;
        number
    }
}

/// Longest duration of samples in one mean, ns.
const LONGEST_MEAN_NS: i64 = 100_000_000;
/// Longest way of the ball in one mean, in its radii.
const MEAN_WAY: f64 = 0.35;
/// Minimum cosine between its forces.
const MEAN_LEAN: f64 = 0.94;

/// Means of samples at one place: a tracker's noise from sample to sample goes down.
#[derive(Clone, Debug)]
pub(super) struct RecordMean {
    /// longest way, m
    way: f64,
    first: Option<InputRecord>,
    count: f64,
    /// mean time since the first, ns
    since_ns: f64,
    centre: Vector3<f64>,
    force: Vector3<f64>,
    turn: Vector4<f64>,
}

impl RecordMean {
    /// - `radius`: of the ball, m.
    pub(crate) fn new(radius: f64) -> Self {
        Self {
            way: MEAN_WAY * radius,
            first: None,
            count: 0.0,
            since_ns: 0.0,
            centre: Vector3::zeros(),
            force: Vector3::zeros(),
            turn: Vector4::zeros(),
        }
    }

    /// Takes a sample; returns the mean of those before it, if it is at another place.
    pub(crate) fn push(&mut self, record: InputRecord) -> Option<InputRecord> {
        let is_near = |first: &InputRecord| {
            record.stamp_ns.saturating_sub(first.stamp_ns) < LONGEST_MEAN_NS
                && (record.centre - first.centre).norm() <= self.way
                && record.force_o.dot(&first.force_o)
                    > MEAN_LEAN * record.force_o.norm() * first.force_o.norm()
        };
        let is_near = self.first.as_ref().is_some_and(is_near);
        let done = if is_near { None } else { self.mean() };
        if !is_near {
            *self = Self {
                first: Some(record),
                ..Self::new(self.way / MEAN_WAY)
            };
        }
        let first = self.first.unwrap_or(record);
        let turn = record.rotation.coords;
        let side = turn.dot(&first.rotation.coords).signum();
        self.count += 1.0;
        self.since_ns += record.stamp_ns.saturating_sub(first.stamp_ns) as f64;
        self.centre += record.centre - first.centre;
        self.force += record.force_o;
        self.turn += turn * side;
        done
    }

    /// Of the samples since the last change of place.
    pub(crate) fn mean(&self) -> Option<InputRecord> {
        let first = self.first?;
        let turn = Quaternion::from_vector(self.turn);
        Some(InputRecord {
            stamp_ns: first.stamp_ns + (self.since_ns / self.count) as i64,
            centre: first.centre + self.centre / self.count,
            rotation: UnitQuaternion::new_normalize(turn),
            force_o: self.force / self.count,
        })
    }
}
