//! Collects samples in bounded memory and compares what they say with what would mend it.

use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3};

use super::finding::{InputCause, InputFinding};
use super::forces::{ForceLevels, signed_permutations};
use super::input_record::InputRecord;
use super::places::{BallFit, ScanScale, extent_of, place_mistakes};
use super::stamps::InputStamps;
use crate::mesh::{FaceTree, TriMesh};
use crate::numeric::median;
use crate::stylus::{
    ClockEstimator, ClockOffset, Compensator, CompensatorParams, ContactSample, Message, Sample, SettingError,
    SyncParams, TipParams, TipShape,
};

/// Samples that are kept: 60 s at 1 kHz are one in sixteen.
const MOST_RECORDS: usize = 4096;
/// Force steps that the noise is estimated from.
const MOST_STEPS: usize = 4096;
/// Presses that are compared with the scan.
const MOST_PRESSES: usize = 400;
/// Fewer presses say nothing.
const FEWEST_PRESSES: usize = 20;
/// Median length of a vector of three standard normal components.
const MEDIAN_OF_THREE: f64 = 1.538;
/// Presses that follow each other share the same error of the scan: so many count as one.
const ALIKE: f64 = 10.0;
/// The sign and axes of a wrench are right when the force leans from the normal by less than this on average, as cosine.
const LEANS: f64 = 0.5;
/// A delay moves each touch along the path by this at most, m; a half of it is said.
const LARGEST_PATH: f64 = 0.4e-3;
/// A speed of the stylus over the part, m/s.
const USUAL_SPEED: f64 = 0.04;
/// A ball that is free is farther from the surface than one that presses by this at least, m.
const LEAST_LIFT: f64 = 0.3e-3;
/// … and by so many deviations of the scan: the scan may be that low under all of what rests.
const LIFT_NOISES: f64 = 1.5;
/// Half of what presses is beyond the median; of what is free, more than this is.
const SHARE_OF_FREE: f64 = 0.55;
/// Contacts are on the scan when this share of them is: where the scan lacks a wall or a hole, they are not.
const SHARE_ON_SCAN: f64 = 0.5;
/// The touched part is no smaller and no larger than this share of the scan.
const SHARES_OF_SCAN: std::ops::RangeInclusive<f64> = 0.05..=1.5;
/// Contacts do not span more than this many times the scan.
const LARGEST_SPREAD: f64 = 5.0;
/// No cell resolves less, N.
const LEAST_NOISE: f64 = 0.5e-3;
/// What a hand or a light arm presses with at most, N.
const LARGEST_PRESS: f64 = 150.0;

/// What the input is taken for.
#[derive(Clone, Copy, Debug)]
pub struct InputMonitorParams {
    /// weight, constant bias, frames
    pub compensator: CompensatorParams,
    /// size and stiffness of the tip
    pub tip: TipParams,
    /// of any other than a ball the radius is not checked
    pub shape: TipShape,
    /// standard deviation of the scan, m; 0: not known
    pub scan_noise: f64,
    /// a force above this begins a contact, N; `None`: every sample is contact
    pub contact_on: Option<f64>,
    /// of the pairing
    pub sync: SyncParams,
}

/// Doubts the input while it is replayed or measured. Memory is bounded, and a sample costs a rotation.
#[derive(Clone, Debug)]
pub struct InputMonitor {
    params: InputMonitorParams,
    compensator: Compensator,
    stamps: InputStamps,
    clock: ClockEstimator,
    records: Vec<InputRecord>,
    samples: u64,
    /// one of so many is kept
    stride: u64,
    last_force: Option<Vector3<f64>>,
    /// |F − F of the sample before|, N
    steps: Vec<f64>,
    /// largest component of the measured force, N, and how often it was exactly that
    largest: (f64, u64),
}

impl InputMonitor {
    /// A monitor that has seen nothing.
    ///
    /// # Errors
    /// [`SettingError`] naming the first setting outside its range.
    pub fn new(params: InputMonitorParams) -> Result<Self, SettingError> {
        Ok(Self {
            compensator: Compensator::new(params.compensator)?,
            clock: ClockEstimator::new(params.tip.stiffness)?,
            params,
            stamps: InputStamps::default(),
            records: Vec::new(),
            samples: 0,
            stride: 1,
            last_force: None,
            steps: Vec::new(),
            largest: (0.0, 0),
        })
    }

    /// Takes a message as it came.
    pub fn message(&mut self, message: &Message) {
        self.stamps.push(message);
    }

    /// Takes a sample that was made of the messages.
    pub fn sample(&mut self, sample: &Sample) {
        let force = sample.wrench.force;
        let size = force.amax();
        if size > self.largest.0 {
            self.largest = (size, 1);
        } else if size == self.largest.0 {
            self.largest.1 += 1;
        }
        let is_kept = self.samples.is_multiple_of(self.stride);
        if is_kept {
            if self.records.len() == MOST_RECORDS {
                let mut at = 0;
                self.records.retain(|_| {
                    at += 1;
                    at % 2 == 1
                });
                self.stride *= 2;
            }
            let tip = self.compensator.compensate(sample);
            self.records.push(InputRecord {
                centre: tip.pose_ot.translation.vector.into(),
                rotation: tip.pose_ot.rotation,
                force_o: tip.force_o,
            });
            if let Some(last) = self.last_force {
                if self.steps.len() == MOST_STEPS {
                    let at = (self.samples / self.stride) as usize % MOST_STEPS;
                    self.steps[at] = (force - last).norm();
                } else {
                    self.steps.push((force - last).norm());
                }
            }
        }
        self.last_force = Some(force);
        self.samples += 1;
    }

    /// Takes what was decided about the contact of a sample.
    pub fn contact(&mut self, sample: &ContactSample) {
        self.clock.push(sample);
    }

    /// How late the wrench reads; `None` where the contacts do not determine it.
    pub fn clock_offset(&self) -> Option<ClockOffset> {
        self.clock.offset()
    }

    /// All doubts so far, the surest and most basic first; empty: none.
    pub fn findings(&self, scan: &TriMesh, tree: &FaceTree) -> Vec<InputFinding> {
        let mut findings = self.stamps.findings(self.params.sync.largest_gap_ns, self.samples);
        if findings.iter().any(|finding| finding.is_sure) {
            return findings;
        }
        if self.records.len() < FEWEST_PRESSES {
            let [poses, wrenches] = self.stamps.counts();
            let measured = format!("{} of {wrenches} wrenches and {poses} poses became a sample", self.samples);
            let remedy = "each needs a pose shortly before and after it by the same clock: are the topics right?";
            findings.push(InputFinding::new(InputCause::NoSample, true, measured, remedy));
            return findings;
        }
        self.judge(scan, tree, &mut findings);
        findings.sort_by_key(|finding| !finding.is_sure);
        findings
    }

    fn judge(&self, scan: &TriMesh, tree: &FaceTree, findings: &mut Vec<InputFinding>) {
        let scale = ScanScale::of(scan);
        let noise = median(&mut self.steps.clone()).unwrap_or(0.0) / (MEDIAN_OF_THREE * 2f64.sqrt());
        let mut levels = ForceLevels::of(&self.records, noise);
        let resting: Vec<&InputRecord> = thinned(self.records.iter().filter(|record| levels.is_resting(record)));
        let tolerance = scale.tolerance(self.params.scan_noise, self.params.tip.radius, 1.0);
        let rest_fit = self.fit(scan, tree, &resting, tolerance);
        let pressing: Vec<&InputRecord> = thinned(self.records.iter().filter(|record| levels.is_pressing(record)));
        let press_fit = self.fit(scan, tree, &pressing, tolerance);
        // what rests on the surface presses all the time: then the rest is no force of free motion
        let lift = LEAST_LIFT.max(LIFT_NOISES * self.params.scan_noise.max(scale.noise));
        let is_free = rest_fit.share_beyond(press_fit.distance.abs() + lift) > SHARE_OF_FREE;
        if !is_free {
            levels = levels.without_rest(&self.records);
        }
        let pressing: Vec<&InputRecord> = thinned(self.records.iter().filter(|record| levels.is_pressing(record)));
        if pressing.len() < FEWEST_PRESSES || levels.largest <= 4.0 * noise {
            let measured = format!("no force stands out of the noise of {noise:.4} N");
            let remedy = "the stylus never touched, or the wrench is not that of the stylus";
            findings.push(InputFinding::new(InputCause::NoContact, true, measured, remedy));
            return;
        }
        self.judge_forces(&levels, is_free.then_some(resting.len()), findings);
        let fits = self.judge_places(scan, tree, &scale, &pressing, &levels, findings);
        if fits && self.judge_wrench(scan, tree, &pressing, &levels, tolerance, findings) {
            self.judge_clock(findings);
        }
    }

    fn fit(&self, scan: &TriMesh, tree: &FaceTree, records: &[&InputRecord], tolerance: f64) -> BallFit {
        let centres = records.iter().map(|record| record.centre);
        BallFit::of(scan, tree, centres, self.params.tip.radius, tolerance)
    }

    /// - `resting`: how many free samples the rest is the mean of, where it is one.
    fn judge_forces(&self, levels: &ForceLevels, resting: Option<usize>, findings: &mut Vec<InputFinding>) {
        let ForceLevels { rest_t, noise, largest } = *levels;
        let on = self.params.contact_on.unwrap_or(0.0);
        if largest < LEAST_NOISE * 40.0 && noise < LEAST_NOISE {
            let measured = format!("the stylus presses with {largest:.5} N, above a noise of {noise:.6} N");
            let remedy = "the forces look like kN: give the wrench in N";
            findings.push(InputFinding::new(InputCause::ForceUnit, true, measured, remedy));
        } else if largest > LARGEST_PRESS {
            let measured = format!("the stylus presses with {largest:.0} N, above a noise of {noise:.2} N");
            let remedy = "the forces look like grams or mN: give the wrench in N";
            findings.push(InputFinding::new(InputCause::ForceUnit, true, measured, remedy));
        } else if largest < on {
            let measured = format!("the contacts reach {largest:.2} N ± {noise:.3} N and contact.on_n is {on:.2} N");
            let remedy = "press harder, or give contact.on_n and contact.off_n below that and above the noise";
            findings.push(InputFinding::new(InputCause::LightTouch, true, measured, remedy));
        }
        let rest = rest_t.norm();
        let is_unit = findings.iter().any(|finding| finding.cause == InputCause::ForceUnit);
        if let Some(count) = resting.filter(|_| on > 0.0 && rest > 0.6 * on && !is_unit) {
            let error = noise / (count as f64 / ALIKE).sqrt();
            let measured = format!(
                "far from the scan the force is ({:.2}, {:.2}, {:.2}) ± {error:.2} N in the axes of the stylus",
                rest_t.x, rest_t.y, rest_t.z
            );
            let remedy = "tare the sensor in free air, or give payload and bias (touchup calibrate payload)";
            findings.push(InputFinding::new(InputCause::Tare, rest > on, measured, remedy));
        }
        let (clip, times) = self.largest;
        // where even the noise repeats itself, a value that does says nothing
        if noise > 0.0 && times > 20 && times as f64 > 0.002 * self.samples as f64 && clip > 0.5 * largest {
            let measured = format!("{times} samples have a force component of exactly {clip:.3} N, the largest");
            let remedy = "the sensor is saturated: press less, or choose a wider range";
            let is_sure = times as f64 > 0.01 * self.samples as f64;
            findings.push(InputFinding::new(InputCause::Saturation, is_sure, measured, remedy));
        }
    }

    /// Returns whether the presses are on the scan.
    fn judge_places(
        &self,
        scan: &TriMesh,
        tree: &FaceTree,
        scale: &ScanScale,
        pressing: &[&InputRecord],
        levels: &ForceLevels,
        findings: &mut Vec<InputFinding>,
    ) -> bool {
        let TipParams { radius, stiffness } = self.params.tip;
        let bend = stiffness.map_or(0.0, |stiffness| levels.largest / stiffness);
        let tolerance = scale.tolerance(self.params.scan_noise, radius, 1.0);
        // how far the reported centre may sink below one radius
        let sunk = bend.min(scale.extent * 0.05);
        let reported = self.fit(scan, tree, pressing, tolerance + sunk);
        let is_ball = self.params.shape == TipShape::Ball;
        // by how much the median distance is uncertain: presses that follow each other are alike
        let noise = scale.noise.max(self.params.scan_noise).min(LARGEST_SCAN_NOISE);
        let error = reported.error(pressing.len());
        if reported.share >= SHARE_ON_SCAN && (reported.distance - radius).abs() <= tolerance + sunk {
            // a scan's own offset is within the tolerance; a radius in another unit is not a matter of tolerance
            let is_other = reported.distance > LEAST_RATIO * radius && reported.distance > 3.0 * error;
            if is_ball && is_other {
                findings.push(off_by_radius(&reported, radius, error));
            }
            return true;
        }
        let shown = |scale: f64| 1e3 * scale;
        let extent = extent_of(pressing.iter().map(|record| record.centre)) / scale.extent;
        let best = place_mistakes()
            .into_iter()
            .filter(|mistake| !mistake.is_unit || SHARES_OF_SCAN.contains(&(extent * mistake.undo[(0, 0)])))
            .map(|mistake| {
                let unit = mistake.radius_factor;
                let radius = radius * unit;
                let tolerance = scale.tolerance(0.0, radius, unit) + sunk * unit;
                let centres = pressing.iter().map(|record| Point3::from(mistake.undo * record.centre.coords));
                (BallFit::of(scan, tree, centres, radius, tolerance), mistake)
            })
            .max_by(|a, b| a.0.share.total_cmp(&b.0.share));
        if let Some((fit, mistake)) =
            best.filter(|(fit, _)| fit.share >= SHARE_ON_SCAN && fit.share > reported.share + 0.3)
        {
            let cause = if mistake.is_unit { InputCause::LengthUnit } else { InputCause::PositionAxes };
            let measured = format!(
                "{}: {:.0} % of the contacts are then on the scan, and {:.0} % as it is",
                mistake.says,
                100.0 * fit.share,
                100.0 * reported.share
            );
            let remedy = if mistake.is_unit {
                "poses are in m, the scan as --mesh-unit says"
            } else {
                "give the positions in the axes of the scan, or scan_to_space"
            };
            findings.push(InputFinding::new(cause, true, measured, remedy));
            return false;
        }
        if extent > LARGEST_SPREAD {
            let measured = format!("the contacts span {extent:.3} times the scan");
            let remedy = "poses are in m, the scan as --mesh-unit says: is one of them in another unit?";
            findings.push(InputFinding::new(InputCause::LengthUnit, true, measured, remedy));
            return false;
        }
        // all as far from the surface as each other: another ball
        let may_be_ball = is_ball && (0.0..LARGEST_BALL * scale.extent).contains(&reported.distance);
        if may_be_ball && reported.scatter <= noise + 0.2 * scale.edge + 0.1e-3 {
            findings.push(off_by_radius(&reported, radius, error));
            return true;
        }
        let measured = format!(
            "the ball's centre is {:.2} ± {:.2} mm off the scan where it presses, and its radius is {:.2} mm; {:.0} % of \
             the contacts are on the scan",
            shown(reported.distance),
            shown(reported.scatter),
            shown(radius),
            100.0 * reported.share
        );
        let remedy = "are the poses those of the ball in the frame of the scan (scan_to_space, tip.offset_mm)?";
        // a rough scan: most are less than a radius off, and hardly one is far
        let wide = radius.max(tolerance) + sunk;
        let share_within = |distance: f64| self.fit(scan, tree, pressing, distance).share;
        let is_near = (reported.distance - radius).abs() <= wide
            && share_within(wide) >= SHARE_ON_SCAN
            && share_within(FAR * wide) >= SHARE_NOT_FAR;
        findings.push(InputFinding::new(InputCause::Frame, !is_near, measured, remedy));
        is_near
    }

    /// Returns whether the forces follow the normal.
    fn judge_wrench(
        &self,
        scan: &TriMesh,
        tree: &FaceTree,
        pressing: &[&InputRecord],
        levels: &ForceLevels,
        tolerance: f64,
        findings: &mut Vec<InputFinding>,
    ) -> bool {
        let normals = self.fit(scan, tree, pressing, tolerance).normals;
        let forces: Vec<Vector3<f64>> = pressing.iter().map(|record| record.force_t() - levels.rest_t).collect();
        let lean = |force_o: &dyn Fn(usize) -> Vector3<f64>| {
            let cosines = (0..forces.len()).map(|at| force_o(at).normalize().dot(&normals[at]));
            cosines.sum::<f64>() / forces.len() as f64
        };
        let as_read = lean(&|at| pressing[at].rotation * forces[at]);
        if as_read >= LEANS {
            return true;
        }
        let sign = lean(&|at| -(pressing[at].rotation * forces[at]));
        let as_object = lean(&|at| forces[at]);
        let as_sensor = lean(&|at| pressing[at].rotation * (pressing[at].rotation * forces[at]));
        let turned = signed_permutations()
            .map(|axes| (lean(&|at| pressing[at].rotation * (axes * forces[at])), axes))
            .max_by(|a, b| a.0.total_cmp(&b.0));
        let degrees = |cosine: f64| cosine.clamp(-1.0, 1.0).acos().to_degrees();
        let before = format!("where the ball presses, the force leans {:.0}° from the scan's normal", degrees(as_read));
        let w_first = lean(&|at| w_first(&pressing[at].rotation) * forces[at]);
        let best_turned = turned.as_ref().map_or(0.0, |(turned, _)| *turned);
        if w_first > LEANS && w_first > best_turned {
            let remedy = "give the orientation as x, y, z, w";
            let measured = format!("{before}, and {:.0}° with w first in the quaternion", degrees(w_first));
            findings.push(InputFinding::new(InputCause::QuaternionOrder, true, measured, remedy));
            return false;
        }
        if sign > LEANS && sign > best_turned - 0.05 {
            let remedy = "reverse the wrench: it is what the part does to the stylus";
            let measured = format!("{before}, and {:.0}° reversed", degrees(sign));
            findings.push(InputFinding::new(InputCause::WrenchSign, true, measured, remedy));
            return false;
        }
        if best_turned.max(as_object).max(as_sensor) < as_read + 0.1 {
            // no other axes explain the forces better
            return true;
        }
        let (turned, says) = match turned {
            Some((turned, axes)) if turned > as_object.max(as_sensor) => {
                let name = |row: usize| {
                    let column = (0..3).find(|&column| axes[(row, column)] != 0.0).unwrap_or(0);
                    format!("{}{}", if axes[(row, column)] < 0.0 { "−" } else { "" }, ["x", "y", "z"][column])
                };
                (turned, format!("with its axes taken as ({}, {}, {})", name(0), name(1), name(2)))
            }
            _ if as_object > as_sensor => (as_object, "read in the frame of the scan".to_owned()),
            _ => (as_sensor, "read in the axes of the stylus".to_owned()),
        };
        let is_sure = turned > LEANS && turned > as_read + 0.3;
        let measured = format!("{before}, and {:.0}° {says}", degrees(turned));
        let remedy =
            "the frame_id of the wrench names its axes: that of the pose the scan's, any other the stylus' own";
        findings.push(InputFinding::new(InputCause::WrenchFrame, is_sure, measured, remedy));
        false
    }

    fn judge_clock(&self, findings: &mut Vec<InputFinding>) {
        let Some(ClockOffset { offset, sigma, onsets }) = self.clock.offset() else { return };
        let path = (offset.abs() - 2.0 * sigma) * USUAL_SPEED;
        if path > LARGEST_PATH / 2.0 {
            let measured = format!(
                "the wrench reads {:+.1} ± {:.1} ms beyond the pose, by {onsets} onsets of contact",
                offset * 1e3,
                sigma * 1e3
            );
            let remedy = "add it to sync.wrench_offset_ms";
            findings.push(InputFinding::new(InputCause::Delay, path > LARGEST_PATH, measured, remedy));
        }
    }
}

/// The orientation that was meant where w stands in front of x, y and z.
fn w_first(read: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(Quaternion::new(read.i, read.j, read.k, read.w))
}

/// A ball this much farther from the surface than its radius is another one.
const LEAST_RATIO: f64 = 20.0;
/// Of contacts on a rough scan this share is not farther off than so many times what most are.
const SHARE_NOT_FAR: f64 = 0.9;
const FAR: f64 = 3.0;
/// No ball is larger than this share of the scan that it is for.
const LARGEST_BALL: f64 = 0.25;
/// No scanner is worse, m.
const LARGEST_SCAN_NOISE: f64 = 2e-3;

fn off_by_radius(fit: &BallFit, radius: f64, error: f64) -> InputFinding {
    let measured = format!(
        "the ball's centre is {:.2} ± {:.2} mm off the scan where it presses, and its radius is said to be {:.4} mm",
        fit.distance * 1e3,
        error * 1e3,
        radius * 1e3
    );
    let remedy =
        "give the radius in mm (--tip-radius-mm, tip.radius_mm); the stiffness, and the scan's offset, act alike";
    InputFinding::new(InputCause::Radius, true, measured, remedy)
}

/// Not more than [`MOST_PRESSES`], spread over all.
fn thinned<'a>(records: impl Iterator<Item = &'a InputRecord>) -> Vec<&'a InputRecord> {
    let all: Vec<&InputRecord> = records.collect();
    let step = all.len().div_ceil(MOST_PRESSES).max(1);
    all.into_iter().step_by(step).collect()
}
