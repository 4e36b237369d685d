//! Samples kept by the monitor, in bounded memory.

use nalgebra::{Point3, UnitQuaternion, Vector3};

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
