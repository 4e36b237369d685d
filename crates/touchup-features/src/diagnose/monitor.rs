//! Collects samples in bounded memory and compares them with candidate corrections.

use nalgebra::Vector3;

use super::finding::{InputCause, InputFinding};
use super::input_record::{InputRecord, RecordMean, ThinnedRecords};
use super::judge::{FEWEST_PRESSES, InputJudge};
use super::monitor_params::InputMonitorParams;
use super::pose_course::PoseCourse;
use super::stamps::InputStamps;
use touchup_geometry::mesh::{FaceTree, TriMesh};
use touchup_geometry::numeric::median;
use touchup_method::stylus::{
    ClockEstimator, ClockEvidence, ClockOffset, Compensator, ContactSample, Message, Sample,
    SettingError,
};

/// Maximum number of kept samples: of 60 s at 1 kHz one in sixteen.
const MOST_RECORDS: usize = 4096;
/// Maximum number of kept presses: surfaces need neighbours on them.
const MOST_PRESSES: usize = 8192;
/// Maximum number of force steps for the noise estimate.
const MOST_STEPS: usize = 4096;
/// Median length of a vector of three standard normal components.
const MEDIAN_OF_THREE: f64 = 1.538;
/// Checks the input during replay or measurement. Memory is bounded, and a sample costs one
/// rotation.
#[derive(Clone, Debug)]
pub struct InputMonitor {
    params: InputMonitorParams,
    compensator: Compensator,
    stamps: InputStamps,
    poses: PoseCourse,
    clock: ClockEstimator,
    records: ThinnedRecords<MOST_RECORDS>,
    /// samples with a force above the contact threshold at the last place, and the means before
    press: RecordMean,
    presses: ThinnedRecords<MOST_PRESSES>,
    samples: u64,
    last_force: Option<Vector3<f64>>,
    /// |F − previous F|, N
    steps: Vec<f64>,
    /// changes of each component of the measured force
    changes: [ComponentChanges; 3],
    /// largest component of the measured force, N, and how often it had exactly that value
    largest: (f64, u64),
}

/// Changes of one component of the measured force, N.
#[derive(Clone, Copy, Debug)]
struct ComponentChanges {
    last: f64,
    smallest: f64,
    low: f64,
    high: f64,
    /// it had a third value
    has_others: bool,
}

impl Default for ComponentChanges {
    fn default() -> Self {
        let (last, smallest) = (f64::NAN, f64::INFINITY);
        let [low, high] = [f64::INFINITY, f64::NEG_INFINITY];
        Self {
            last,
            smallest,
            low,
            high,
            has_others: false,
        }
    }
}

impl ComponentChanges {
    fn push(&mut self, value: f64) {
        let change = (value - self.last).abs();
        if change > 0.0 {
            self.smallest = self.smallest.min(change);
        }
        self.has_others |= self.low < self.high && value != self.low && value != self.high;
        (self.low, self.high) = (self.low.min(value), self.high.max(value));
        self.last = value;
    }

    /// Smallest change; infinite for a two-valued force, which has no steps.
    fn step(&self) -> f64 {
        if self.has_others {
            self.smallest
        } else {
            f64::INFINITY
        }
    }
}

impl InputMonitor {
    /// An empty monitor.
    ///
    /// # Errors
    /// [`SettingError`] naming the first setting outside its range.
    pub fn new(params: InputMonitorParams) -> Result<Self, SettingError> {
        Ok(Self {
            compensator: Compensator::new(params.compensator)?,
            clock: ClockEstimator::new(params.tip.stiffness)?,
            stamps: InputStamps::default(),
            poses: PoseCourse::default(),
            records: ThinnedRecords::default(),
            press: RecordMean::new(params.tip.radius),
            params,
            presses: ThinnedRecords::default(),
            samples: 0,
            last_force: None,
            steps: Vec::new(),
            changes: Default::default(),
            largest: (0.0, 0),
        })
    }

    /// Takes a message as received.
    pub fn message(&mut self, message: &Message) {
        self.stamps.push(message);
    }

    /// Takes the common stamp of pose and wrench of a sample that came as one message.
    #[inline]
    pub fn paired_message(&mut self, stamp_ns: i64) {
        self.stamps.push_pair(stamp_ns);
    }

    /// Takes a sample made from the messages.
    pub fn sample(&mut self, sample: &Sample) {
        self.poses
            .push(sample.stamp_ns, sample.pose_ot.translation.vector);
        let force = sample.wrench.force;
        let size = force.amax();
        if size > self.largest.0 {
            self.largest = (size, 1);
        } else if size == self.largest.0 {
            self.largest.1 += 1;
        }
        for (changes, component) in self.changes.iter_mut().zip(&force) {
            changes.push(*component);
        }
        let tip = self.compensator.compensate(sample);
        let record = || InputRecord {
            stamp_ns: tip.stamp_ns,
            centre: tip.pose_ot.translation.vector.into(),
            rotation: tip.pose_ot.rotation,
            force_o: tip.force_o,
        };
        let on = self.params.gate.map_or(0.0, |gate| gate.on);
        if tip.force_o.norm_squared() > on * on
            && let Some(mean) = self.press.push(record())
        {
            self.presses.push(|| mean);
        }
        if let Some(number) = self.records.push(record)
            && let Some(last) = self.last_force
        {
            let step = (force - last).norm();
            if self.steps.len() == MOST_STEPS {
                let at = number as usize % MOST_STEPS;
                self.steps[at] = step;
            } else {
                self.steps.push(step);
            }
        }
        self.last_force = Some(force);
        self.samples += 1;
    }

    /// Takes a sample after the contact decision.
    pub fn contact(&mut self, sample: &ContactSample) {
        self.clock.push(sample);
    }

    /// Delay of the wrench; `None` if the contacts do not determine it. The stop of the ball
    /// between two poses is invisible and adds to the uncertainty of onsets, but not to that of
    /// sliding and lifting.
    pub fn clock_offset(&self) -> Option<ClockOffset> {
        let found = self.clock.offset()?;
        let unseen = match found.evidence {
            ClockEvidence::Onsets(_) => self.stamps.pose_period() / 2.0,
            ClockEvidence::Course(_) => 0.0,
        };
        Some(ClockOffset {
            sigma: found.sigma.hypot(unseen),
            ..found
        })
    }

    /// All doubts up to now, the surest and most basic first; empty: none.
    pub fn findings(&self, scan: &TriMesh, tree: &FaceTree) -> Vec<InputFinding> {
        let mut findings = self
            .stamps
            .findings(self.params.sync.largest_gap_ns, self.samples);
        if findings.iter().any(|finding| finding.is_sure) {
            return findings;
        }
        if self.records.kept.len() < FEWEST_PRESSES {
            let [poses, wrenches] = self.stamps.counts();
            let measured = format!(
                "{} of {wrenches} wrenches and {poses} poses became a sample",
                self.samples
            );
            let remedy = "each needs a pose shortly before and after it by the same clock: are the topics right?";
            findings.push(InputFinding::new(
                InputCause::NoSample,
                true,
                measured,
                remedy,
            ));
            return findings;
        }
        let noise =
            median(&mut self.steps.clone()).unwrap_or(0.0) / (MEDIAN_OF_THREE * 2f64.sqrt());
        let last = self.press.mean();
        let pressing: Vec<InputRecord> = self.presses.kept.iter().copied().chain(last).collect();
        let judge = InputJudge {
            params: &self.params,
            scan,
            tree,
            records: &self.records.kept,
            pressing: &pressing,
            noise,
            force_step: self
                .changes
                .iter()
                .fold(f64::INFINITY, |least, of| least.min(of.step())),
            largest: (self.largest.0, self.largest.1, self.samples),
            clock: self.clock_offset(),
        };
        findings.extend(self.poses.finding());
        findings.extend(judge.findings());
        findings.sort_by_key(|finding| (!finding.is_sure, finding.cause as usize));
        findings
    }
}
