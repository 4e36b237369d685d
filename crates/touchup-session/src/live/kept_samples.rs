//! Samples that arrive while the evidence is rebuilt.

use touchup_method::stylus::Sample;

/// Maximum number of kept samples: 4 minutes at 1 kHz, 29 MB.
const MOST_KEPT: usize = 1 << 18;

/// Samples in order, or their number if they exceed the maximum.
#[derive(Debug)]
pub(super) struct KeptSamples {
    samples: Vec<Sample>,
    most: usize,
    /// number of all samples, dropped if more than `most`
    dropped: u64,
}

impl Default for KeptSamples {
    fn default() -> Self {
        Self {
            samples: Vec::new(),
            most: MOST_KEPT,
            dropped: 0,
        }
    }
}

impl KeptSamples {
    /// Keeps a sample; beyond the maximum it drops all, as partial evidence would describe another
    /// touch.
    pub fn push(&mut self, sample: &Sample) {
        if self.dropped > 0 {
            self.dropped += 1;
        } else if self.samples.len() < self.most {
            self.samples.push(*sample);
        } else {
            self.dropped = self.samples.len() as u64 + 1;
            self.samples = Vec::new();
        }
    }

    /// All samples.
    ///
    /// # Errors
    /// The number of dropped samples.
    pub fn all(&self) -> Result<&[Sample], u64> {
        if self.dropped > 0 {
            Err(self.dropped)
        } else {
            Ok(&self.samples)
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};
    use touchup_method::stylus::Wrench;

    use super::*;

    #[test]
    fn all_samples_are_kept_or_none_of_them_and_those_are_counted() {
        let wrench = Wrench {
            force: Vector3::zeros(),
            torque: Vector3::zeros(),
        };
        let sample = |stamp_ns| Sample {
            stamp_ns,
            pose_ot: Isometry3::identity(),
            wrench,
        };
        let mut kept = KeptSamples {
            most: 3,
            ..KeptSamples::default()
        };
        let stamps = |kept: &KeptSamples| {
            kept.all()
                .map(|all| all.iter().map(|sample| sample.stamp_ns).collect::<Vec<_>>())
        };
        for (stamp_ns, expected) in [
            (5, Ok(vec![5])),
            (6, Ok(vec![5, 6])),
            (7, Ok(vec![5, 6, 7])),
            (8, Err(4)),
            (9, Err(5)),
        ] {
            kept.push(&sample(stamp_ns));
            assert_eq!(stamps(&kept), expected);
        }
        assert_eq!(kept.samples.capacity(), 0, "their memory is free again");
    }
}
