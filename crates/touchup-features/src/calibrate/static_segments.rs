//! Static segments of a recording: neither the stylus turns nor the wrench changes.
//!
//! Averages over blocks of a fifth of a second take the noise out of the rates; blocks with slow
//! changes of pose and wrench in between make a segment, and a long enough segment is one static
//! pose.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use touchup_method::stylus::{Sample, Wrench};

/// A static pose of the stylus: means over a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StaticPose {
    /// Orientation of T (or of H, with the same axes) in the frame of the poses.
    pub r_wt: UnitQuaternion<f64>,
    /// Measured wrench, N and N·m.
    pub wrench: Wrench,
    /// Standard deviation of one reading of the force, per axis, N; `None` if unknown.
    pub noise: Option<f64>,
    /// Number of readings in the means.
    pub samples: usize,
}

/// Settings of a [`StaticSegmentFinder`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StaticSegmentParams {
    /// Length of a block, ns. Default 0.2 s.
    pub block_ns: i64,
    /// Shortest segment, ns. Default 0.6 s: three blocks.
    pub least_ns: i64,
    /// Largest rotation rate at rest, rad/s. Default 0.02: a robot's settling oscillation, less
    /// than the tremor of a hand over a block.
    pub turning: f64,
    /// Largest rate of the force at rest, N/s. Default 0.3: a sensor with 0.05 N of noise at 200 Hz
    /// reaches a third of it by chance.
    pub force_rate: f64,
    /// Largest rate of the torque at rest, N·m/s. Default 0.03.
    pub torque_rate: f64,
    /// Largest rotation since the start of a segment, rad. Default 0.03.
    pub largest_turn: f64,
}

impl Default for StaticSegmentParams {
    fn default() -> Self {
        Self {
            block_ns: 200_000_000,
            least_ns: 600_000_000,
            turning: 0.02,
            force_rate: 0.3,
            torque_rate: 0.03,
            largest_turn: 0.03,
        }
    }
}

/// A block, or joined blocks.
#[derive(Clone, Copy, Debug)]
pub struct SampleBlock {
    begin_ns: i64,
    /// stamp of the last sample
    pub end_ns: i64,
    count: usize,
    /// Σ q, each on the hemisphere of the first
    orientation: Quaternion<f64>,
    force: Vector3<f64>,
    torque: Vector3<f64>,
    /// Σ |fᵢ − fᵢ₋₁|² within blocks, and its number of terms
    squares: f64,
    differences: usize,
    last_force: Vector3<f64>,
}

impl SampleBlock {
    /// A block of one sample.
    pub fn of(sample: &Sample) -> Self {
        let Sample {
            stamp_ns,
            pose_ot,
            wrench,
        } = sample;
        let orientation = *pose_ot.rotation.quaternion();
        Self {
            begin_ns: *stamp_ns,
            end_ns: *stamp_ns,
            count: 1,
            orientation,
            force: wrench.force,
            torque: wrench.torque,
            squares: 0.0,
            differences: 0,
            last_force: wrench.force,
        }
    }

    /// Appends a sample.
    pub fn add(&mut self, sample: &Sample) {
        let mut other = Self::of(sample);
        other.squares = (sample.wrench.force - self.last_force).norm_squared();
        other.differences = 1;
        self.join(&other);
    }

    fn join(&mut self, other: &Self) {
        let half = if self.orientation.dot(&other.orientation) < 0.0 {
            -1.0
        } else {
            1.0
        };
        self.orientation += other.orientation * half;
        self.end_ns = other.end_ns;
        self.count += other.count;
        self.force += other.force;
        self.torque += other.torque;
        self.squares += other.squares;
        self.differences += other.differences;
        self.last_force = other.last_force;
    }

    fn rotation(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_quaternion(self.orientation)
    }

    /// Mean pose and wrench, and the noise of the force.
    pub fn static_pose(&self) -> StaticPose {
        let n = self.count as f64;
        // a difference of two readings has twice the variance of one, on three axes
        let noise =
            (self.differences > 0).then(|| (self.squares / (6 * self.differences) as f64).sqrt());
        let wrench = Wrench {
            force: self.force / n,
            torque: self.torque / n,
        };
        StaticPose {
            r_wt: self.rotation(),
            wrench,
            noise,
            samples: self.count,
        }
    }
}

/// Finds the static segments of samples in order of time.
///
/// # Example
/// ```
/// # use touchup_features::calibrate::{StaticSegmentFinder, StaticSegmentParams};
/// # use touchup_method::stylus::{Sample, Wrench};
/// # use nalgebra::Isometry3;
/// let mut finder = StaticSegmentFinder::new(StaticSegmentParams::default());
/// for ms in 0..1000 {
///     finder.push(&Sample { stamp_ns: ms * 1_000_000, pose_ot: Isometry3::identity(), wrench: Wrench::default() });
/// }
/// assert_eq!(finder.finish().len(), 1);
/// ```
#[derive(Debug)]
pub struct StaticSegmentFinder {
    params: StaticSegmentParams,
    block: Option<SampleBlock>,
    /// the last complete block
    last: Option<SampleBlock>,
    /// joined blocks of the open segment, and its first block
    phase: Option<(SampleBlock, SampleBlock)>,
    found: Vec<StaticPose>,
}

impl StaticSegmentFinder {
    /// A finder without samples.
    pub fn new(params: StaticSegmentParams) -> Self {
        Self {
            params,
            block: None,
            last: None,
            phase: None,
            found: Vec::new(),
        }
    }

    /// Adds one sample; skips invalid samples and samples not after the one before.
    pub fn push(&mut self, sample: &Sample) {
        if sample.check().is_err()
            || self
                .block
                .is_some_and(|block| sample.stamp_ns <= block.end_ns)
        {
            return;
        }
        match &mut self.block {
            Some(block)
                if sample.stamp_ns.saturating_sub(block.begin_ns) < self.params.block_ns =>
            {
                block.add(sample)
            }
            block => {
                let whole = block.replace(SampleBlock::of(sample));
                whole.into_iter().for_each(|whole| self.take(whole));
            }
        }
    }

    /// The static segments, in order of time.
    pub fn finish(mut self) -> Vec<StaticPose> {
        self.block
            .take()
            .into_iter()
            .for_each(|block| self.take(block));
        self.close();
        self.found
    }

    fn take(&mut self, block: SampleBlock) {
        let is_static = self.last.is_some_and(|last| self.is_static(&last, &block));
        match &mut self.phase {
            Some((phase, first))
                if is_static && is_near(first, &block, self.params.largest_turn) =>
            {
                phase.join(&block)
            }
            _ => {
                self.close();
                self.phase = Some((block, block));
            }
        }
        self.last = Some(block);
    }

    fn close(&mut self) {
        let Some((phase, _)) = self.phase.take() else {
            return;
        };
        if phase.end_ns.saturating_sub(phase.begin_ns) >= self.params.least_ns {
            self.found.push(phase.static_pose());
        }
    }

    fn is_static(&self, before: &SampleBlock, after: &SampleBlock) -> bool {
        let apart_ns = after.begin_ns.saturating_sub(before.begin_ns).max(1);
        let seconds = apart_ns as f64 * 1e-9;
        let change = |of: fn(&SampleBlock) -> Vector3<f64>| {
            (of(after) / after.count as f64 - of(before) / before.count as f64).norm() / seconds
        };
        let StaticSegmentParams {
            block_ns,
            turning,
            force_rate,
            torque_rate,
            ..
        } = self.params;
        // a pause ends a segment
        apart_ns < block_ns.saturating_mul(3)
            && before.rotation().angle_to(&after.rotation()) < turning * seconds
            && change(|block| block.force) < force_rate
            && change(|block| block.torque) < torque_rate
    }
}

fn is_near(first: &SampleBlock, block: &SampleBlock, largest_turn: f64) -> bool {
    first.rotation().angle_to(&block.rotation()) < largest_turn
}
