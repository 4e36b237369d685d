//! Findings about forces, places, wrench and clock, each with a remedy.

use std::collections::BTreeSet;

use nalgebra::{Point3, Vector3};

use super::finding::{InputCause, InputFinding};
use super::forces::{ForceLevels, NOISES, SensorWeight};
use super::input_record::InputRecord;
use super::mends::PlaceMend;
use super::monitor_params::InputMonitorParams;
use super::places::{
    ALIKE, BallFit, LEAST_TOLERANCE, SHARE_ON_SCAN, ScanScale, error_of_median, is_in_hole,
};
use super::wrench::{ReadPress, course_at, judge_wrench};
use touchup_geometry::mesh::{FaceTree, TriMesh};
use touchup_geometry::numeric::{SIGMA_OF_MEDIAN, VoxelKey, counted, median, voxel_of};
use touchup_method::stylus::{ClockOffset, TipParams, TipShape, WrenchFrame};

/// Minimum number of presses for a finding.
pub(super) const FEWEST_PRESSES: usize = 20;
/// Minimum number of places: six unknowns of a rigid motion and one more.
const FEWEST_PLACES: usize = 7;
/// Maximum size of a place, as a share of the scan.
const PLACE_SHARE: f64 = 1.0 / 16.0;
/// Presses within this distance share the scan's errors, in edges of the scan.
pub(super) const PLACE_EDGES: f64 = 2.0;
/// Presses within this distance have similar scan normals, in edges of the scan.
const WIDE_EDGES: f64 = 4.0;
/// Maximum number of presses compared with the scan.
const MOST_PRESSES: usize = 400;
/// Minimum lift of a free ball above a pressing one, m.
const LEAST_LIFT: f64 = 0.3e-3;
/// Minimum lift in standard errors of the scan, which may be that low under all resting samples.
const LIFT_ERRORS: f64 = 3.0;
/// Minimum share of free samples beyond the lift; of presses, half lie beyond the median.
const SHARE_OF_FREE: f64 = 0.55;
/// Finest resolution of any force sensor, N.
const LEAST_NOISE: f64 = 0.5e-3;
/// Maximum force of a hand or a light arm, N.
const LARGEST_PRESS: f64 = 150.0;
/// Maximum bend of an elastic stylus, m, for forces above [`HARD_PRESS`].
const LARGEST_BEND: f64 = 8e-3;
/// Minimum force for the check of the bend, N.
const HARD_PRESS: f64 = 40.0;
/// Maximum rest, in multiples of the zero's uncertainty.
const LARGEST_REST: f64 = 1.6;
/// Minimum tare that makes an input refusable, N.
const LEAST_TARE: f64 = 0.4;
/// Minimum radius of a ball, m.
pub(super) const LEAST_BALL: f64 = 20e-6;
/// Minimum cosine between a straight press and the scan's normal.
const STRAIGHT: f64 = 0.8;
/// The radius is doubtful if the centre is off by the first multiple of the scan's noise, and
/// surely wrong by the second.
pub(super) const DOUBTED_NOISES: f64 = 1.0;
pub(super) const SURE_NOISES: f64 = 1.5;
/// Tolerated error of the bend, as a share of the bend: uncertainty of the stiffness.
const OTHER_SINK: f64 = 0.2;
/// Maximum share of force-free samples in which the ball is nearer than its radius.
const NEARER_SHARE: f64 = 0.1;
/// Maximum noise of any scanner, m.
pub(super) const LARGEST_SCAN_NOISE: f64 = 2e-3;

/// The samples beside the scan.
#[derive(Debug)]
pub(super) struct InputJudge<'a> {
    pub params: &'a InputMonitorParams,
    pub scan: &'a TriMesh,
    pub tree: &'a FaceTree,
    pub records: &'a [InputRecord],
    /// samples with a force above the contact threshold
    pub pressing: &'a [InputRecord],
    /// standard deviation of one force axis, N
    pub noise: f64,
    /// smallest change of a component of the measured force, N
    pub force_step: f64,
    /// largest component of the measured force, N; how often it had exactly that value; total count
    pub largest: (f64, u64, u64),
    pub clock: Option<ClockOffset>,
}

/// Presses, and the scan's scale for their comparison.
#[derive(Debug)]
pub(super) struct Presses<'a> {
    pub records: Vec<&'a InputRecord>,
    pub levels: ForceLevels,
    pub scale: ScanScale,
    /// maximum sink of the reported centre below one radius, m
    pub sunk: f64,
    /// tolerance of the distance between centre and surface, m
    pub tolerance: f64,
}

/// A press straight on the scan.
#[derive(Clone, Copy, Debug)]
pub(super) struct StraightPress {
    pub centre: Point3<f64>,
    /// outward normal of the scan under it
    pub normal: Vector3<f64>,
    /// distance of the centre from the scan, m
    pub distance: f64,
    /// N
    pub force: f64,
}

impl InputJudge<'_> {
    /// All doubts.
    pub(crate) fn findings(&self) -> Vec<InputFinding> {
        let (presses, resting) = match self.presses() {
            Ok(found) => found,
            Err(untouched) => return untouched,
        };
        let mut findings = Vec::new();
        let few = self.few_places(&presses);
        self.judge_forces(&presses, resting, &mut findings);
        findings.extend(self.judge_steps(&presses.levels));
        let place = self.judge_places(&presses, few.is_some());
        let is_placed = place.as_ref().is_none_or(|(_, is_placed)| *is_placed);
        findings.extend(place.map(|(finding, _)| finding));
        let is_of_poses = |finding: &InputFinding| finding.cause.is_read_off_the_scan();
        let is_doubted_place = findings.iter().any(is_of_poses);
        let wrench = is_placed.then(|| self.judge_wrench(&presses)).flatten();
        if let Some(few) = few {
            let wrench = wrench.map(|(finding, _)| finding);
            let is_explained = is_doubted_place || wrench.is_some();
            findings.extend(if is_explained { wrench } else { Some(few) });
            return findings;
        }
        self.judge_many(&presses, findings, wrench)
    }

    /// Doubts with enough places.
    ///
    /// - `findings`: of forces and places. `wrench`: another reading of it; whether it is a turn by any
    ///   angle.
    fn judge_many(
        &self,
        presses: &Presses,
        mut findings: Vec<InputFinding>,
        wrench: Option<(InputFinding, bool)>,
    ) -> Vec<InputFinding> {
        let is_of_poses = |finding: &InputFinding| finding.cause.is_read_off_the_scan();
        let is_doubted_place = findings.iter().any(is_of_poses);
        let is_turned = wrench.as_ref().is_some_and(|(_, is_turned)| *is_turned);
        let mut wrench = wrench.map(|(finding, _)| finding);
        // forces in other axes select other presses, and show other surfaces
        let is_read = wrench.is_none() || is_turned;
        let is_first = |finding: &InputFinding| {
            finding.is_sure && !matches!(finding.cause, InputCause::Frame | InputCause::Tare)
        };
        let mut of_session = if is_read && !findings.iter().any(is_first) {
            self.judge_session(presses)
        } else {
            Vec::new()
        };
        // of the touches alone: a changed zero looks like a turned sensor
        let is_doubted = wrench.as_ref().is_none_or(|finding| !finding.is_sure);
        let is_of_sensor =
            |finding: &InputFinding| finding.is_of_sensor() && (finding.is_sure || is_doubted);
        if of_session.iter().any(is_of_sensor) {
            wrench = None;
            findings.retain(|finding| finding.cause != InputCause::Tare);
        }
        let is_read = wrench.is_none();
        // contacts of two places are on no scan
        if is_read && of_session.iter().any(InputFinding::is_of_change) {
            let clock = self.judge_clock().filter(|finding| finding.is_sure);
            findings.retain(|finding| !is_of_poses(finding));
            findings.extend(clock.map_or(of_session, |clock| vec![clock]));
            return findings;
        }
        let is_read = is_read && !is_doubted_place;
        if !is_read {
            of_session.clear();
        }
        // a ball at another place looks like a scan at another one
        let registration = (is_read && of_session.is_empty())
            .then(|| self.judge_registration(presses))
            .flatten();
        findings.extend(registration);
        // each of these changes the contacts, and the course of the force
        let changes_course =
            |finding: &InputFinding| finding.is_sure || finding.cause == InputCause::Tare;
        if wrench.is_none() && !findings.iter().any(changes_course) {
            findings.extend(self.judge_clock());
        }
        let is_other =
            |finding: &InputFinding| finding.is_sure && finding.cause != InputCause::Tare;
        if findings.iter().any(is_other) {
            of_session.clear();
        }
        // radius last: a wrong place or stiffness moves the centre as far
        let is_explained = wrench.is_some() || !of_session.is_empty() || is_doubted_place;
        let radius = (!is_explained)
            .then(|| self.judge_radius(presses))
            .flatten();
        findings.extend(of_session);
        findings.extend(radius);
        findings.extend(wrench);
        findings
    }

    /// The finding for a source in free motion: zero and weight of the sensor explain all of its
    /// force, F = b + Rᵀ w. `None` otherwise.
    fn untouched(&self) -> Option<Vec<InputFinding>> {
        let SensorWeight { mean_t, size, left } = SensorWeight::of(self.records)?;
        let free = self.params.gate?.free;
        // for forces in another unit `free` is no bound
        let least = if self.noise < LEAST_NOISE { 0.0 } else { free };
        let measured = format!(
            "nothing is touched yet, and the sensor reads its zero and weight, ({:.2}, {:.2}, {:.2}) N in the axes of the stylus on average",
            mean_t.x, mean_t.y, mean_t.z
        );
        let no_contact = no_contact("zero and weight of the sensor explain its force".to_owned());
        let tare = InputFinding::new(InputCause::Tare, size > LEAST_TARE, measured, TARE_REMEDY);
        let tare = (size > LARGEST_REST * free).then_some(tare);
        (left <= least.max(NOISES * self.noise))
            .then(|| [no_contact].into_iter().chain(tare).collect())
    }

    /// The presses, and the number of free samples in the mean of the rest, if there is a rest.
    ///
    /// # Errors
    /// The finding for a source in free motion.
    fn presses(&self) -> Result<(Presses<'_>, Option<usize>), Vec<InputFinding>> {
        let TipParams { radius, stiffness } = self.params.tip;
        let scale = ScanScale::of(self.scan);
        let tolerance = scale.tolerance(self.params.scan_noise, radius, 1.0);
        let mut levels = ForceLevels::of(self.records, self.noise);
        let of = |is: &dyn Fn(&InputRecord) -> bool| {
            thinned(self.records.iter().filter(|record| is(record)))
        };
        let resting = of(&|record| levels.is_resting(record));
        let rest_fit = self.fit(&resting, tolerance);
        let press_fit = self.fit(&of(&|record| levels.is_pressing(record)), tolerance);
        let is_on_scan = press_fit.share.max(rest_fit.share) >= SHARE_ON_SCAN;
        if let Some(untouched) = self.untouched().filter(|_| !is_on_scan) {
            return Err(untouched);
        }
        // samples that rest on the surface all press: then the rest is no force of free motion
        let places = places_of(&resting, WIDE_EDGES * scale.edge.max(LEAST_BALL)).len();
        let error = self.params.scan_noise.max(scale.noise) / (places.max(1) as f64).sqrt();
        let lift = LEAST_LIFT.max(LIFT_ERRORS * error);
        let is_free = rest_fit.share_beyond(press_fit.distance.abs() + lift) > SHARE_OF_FREE;
        if !is_free {
            levels = levels.without_rest(self.records);
        }
        let pressing = thinned(
            self.records
                .iter()
                .filter(|record| levels.is_pressing(record)),
        );
        if pressing.len() < FEWEST_PRESSES || levels.largest <= 4.0 * self.noise {
            let measured = format!("no force stands out of the noise of {:.4} N", self.noise);
            return Err(vec![no_contact(measured)]);
        }
        let bend = stiffness.map_or(0.0, |stiffness| levels.largest / stiffness);
        let presses = Presses {
            records: pressing,
            levels,
            scale,
            sunk: bend.min(scale.extent * 0.05),
            tolerance,
        };
        Ok((presses, is_free.then_some(resting.len())))
    }

    /// Too few places fix no rigid motion of the scan: they fit almost anywhere.
    fn few_places(&self, presses: &Presses) -> Option<InputFinding> {
        // the radius setting may be wrong
        let ball = (2.0 * self.params.tip.radius).min(PLACE_SHARE * presses.scale.extent);
        let size = ball.max(2.0 * LEAST_TOLERANCE);
        let places = places_of(&presses.records, size);
        let measured = format!(
            "only {} touched",
            counted(
                places.len(),
                "place of the part was",
                "places of the part were"
            )
        );
        let remedy = "touch more of it: so few fit almost anywhere, and nothing can be said of poses, tip and clock";
        (places.len() < FEWEST_PLACES)
            .then(|| InputFinding::new(InputCause::FewContacts, false, measured, remedy))
    }

    pub(super) fn fit(&self, records: &[&InputRecord], tolerance: f64) -> BallFit {
        self.fit_at(records.iter().map(|record| record.centre), tolerance)
    }

    pub(super) fn fit_at(
        &self,
        centres: impl Iterator<Item = Point3<f64>>,
        tolerance: f64,
    ) -> BallFit {
        BallFit::of(
            self.scan,
            self.tree,
            centres,
            self.params.tip.radius,
            tolerance,
        )
    }

    /// - `resting`: number of free samples in the mean of the rest, if there is a rest.
    fn judge_forces(
        &self,
        presses: &Presses,
        resting: Option<usize>,
        findings: &mut Vec<InputFinding>,
    ) {
        let levels = &presses.levels;
        findings.extend(self.judge_press(levels));
        let is_unit = findings
            .iter()
            .any(|finding| finding.cause == InputCause::ForceUnit);
        let rest = || resting.and_then(|count| self.judge_rest(levels, count));
        findings.extend((!is_unit).then(rest).flatten());
        findings.extend(self.judge_saturation(levels));
    }

    /// Presses of a size that shows another unit, or that the contact gate misses.
    fn judge_press(&self, levels: &ForceLevels) -> Option<InputFinding> {
        let ForceLevels { noise, largest, .. } = *levels;
        let on = self.params.gate.map_or(0.0, |gate| gate.on);
        let bend = self
            .params
            .tip
            .stiffness
            .map_or(0.0, |stiffness| largest / stiffness);
        let (cause, measured, remedy) = if largest < LEAST_NOISE * 40.0 && noise < LEAST_NOISE {
            (
                InputCause::ForceUnit,
                format!("the stylus presses with {largest:.5} N, above a noise of {noise:.6} N"),
                "the forces look like kN: give the wrench in N",
            )
        } else if largest > LARGEST_PRESS || largest > HARD_PRESS && bend > LARGEST_BEND {
            let mut measured =
                format!("the stylus presses with {largest:.0} N, above a noise of {noise:.2} N");
            if bend > 0.0 {
                measured += &format!(", and would bend by {:.1} mm", bend * 1e3);
            }
            let remedy = "the forces look like grams or mN: give the wrench in N";
            (InputCause::ForceUnit, measured, remedy)
        } else if largest < on {
            let measured = format!(
                "the contacts reach {largest:.2} N ± {noise:.3} N and contact.on_n is {on:.2} N"
            );
            let remedy = "press harder, or give contact.on_n and contact.off_n below that and above the noise";
            (InputCause::LightTouch, measured, remedy)
        } else {
            return None;
        };
        Some(InputFinding::new(cause, true, measured, remedy))
    }

    /// A force far from the scan, above the uncertainty of its zero.
    ///
    /// - `count`: number of free samples in the mean of the rest.
    fn judge_rest(&self, levels: &ForceLevels, count: usize) -> Option<InputFinding> {
        let ForceLevels { rest_t, noise, .. } = *levels;
        let (gate, rest) = (self.params.gate?, rest_t.norm());
        let error = noise / (count as f64 / ALIKE).sqrt();
        let measured = format!(
            "far from the scan the force is ({:.2}, {:.2}, {:.2}) ± {error:.2} N in the axes of the stylus",
            rest_t.x, rest_t.y, rest_t.z
        );
        (rest > LARGEST_REST * gate.free)
            .then(|| InputFinding::new(InputCause::Tare, rest > LEAST_TARE, measured, TARE_REMEDY))
    }

    /// Samples at the end of the sensor's range.
    fn judge_saturation(&self, levels: &ForceLevels) -> Option<InputFinding> {
        let (clip, times, samples) = self.largest;
        // with repeating noise a repeated value proves nothing
        let is_saturated = levels.noise > 0.0
            && times > 20
            && times as f64 > 0.002 * samples as f64
            && clip > 0.5 * levels.largest;
        let measured =
            format!("{times} samples have a force component of exactly {clip:.3} N, the largest");
        let remedy = "the sensor is saturated: press less, or choose a wider range";
        let is_sure = times as f64 > 0.01 * samples as f64;
        is_saturated.then(|| InputFinding::new(InputCause::Saturation, is_sure, measured, remedy))
    }

    /// Force steps coarser than the noise, which would average them out, and than the zero's
    /// uncertainty.
    fn judge_steps(&self, levels: &ForceLevels) -> Option<InputFinding> {
        let (gate, step) = (self.params.gate?, self.force_step);
        let is_coarse = step.is_finite() && step / 2.0 > gate.free.max(levels.noise);
        let measured = format!(
            "the forces come in steps of {step:.2} N, and contact.on_n is {:.2} N",
            gate.on
        );
        let remedy =
            "record the wrench before it is rounded, or choose a finer range of the sensor";
        is_coarse
            .then(|| InputFinding::new(InputCause::ForceSteps, step > gate.on, measured, remedy))
    }

    /// Checks sign and axes of the wrench by the presses on the scan.
    ///
    /// The flag: a turn by any angle explains it best.
    fn judge_wrench(&self, presses: &Presses) -> Option<(InputFinding, bool)> {
        let other_frame = match self.params.compensator.wrench_frame {
            WrenchFrame::Sensor => "read in the frame of the poses",
            WrenchFrame::Object => "read in the axes of the stylus",
        };
        judge_wrench(&self.read_presses(presses), other_frame)
    }

    /// All presses on the scan, except around holes of the scan: there the scan is wrong as well.
    fn read_presses(&self, presses: &Presses) -> Vec<ReadPress> {
        let Presses {
            levels,
            scale,
            tolerance,
            sunk,
            ..
        } = presses;
        let radius = self.params.tip.radius;
        let edge = scale.edge.max(LEAST_BALL);
        let pressing: Vec<usize> = (0..self.records.len())
            .filter(|at| levels.is_pressing(&self.records[*at]))
            .collect();
        let centre = |at: &usize| self.records[*at].centre;
        let fit = self.fit_at(pressing.iter().map(centre), *tolerance);
        let place = |at: &usize| voxel_of(&centre(at), PLACE_EDGES * edge);
        let is_deep = |at: &usize, distance: f64, normal: &Vector3<f64>| {
            let force = levels.force_o(&self.records[*at]);
            is_in_hole(distance + tolerance, normal, &force, radius)
        };
        let pressed = || pressing.iter().zip(fit.distances.iter().zip(&fit.normals));
        let holes: BTreeSet<_> = pressed()
            .filter(|(at, (distance, normal))| is_deep(at, **distance, normal))
            .map(|(at, _)| place(at))
            .collect();
        let is_on_scan = |distance: f64| (distance - radius).abs() <= tolerance + sunk;
        pressed()
            .filter(|(at, (distance, _))| is_on_scan(**distance) && !holes.contains(&place(at)))
            .map(|(at, (_, normal))| {
                let place = voxel_of(&centre(at), WIDE_EDGES * edge);
                let course = course_at(self.records, levels, *at, normal);
                self.read_press(&self.records[*at], levels, place, [*normal, course])
            })
            .collect()
    }

    /// A press with its force in every reading.
    fn read_press(
        &self,
        record: &InputRecord,
        levels: &ForceLevels,
        place: VoxelKey,
        [normal, course]: [Vector3<f64>; 2],
    ) -> ReadPress {
        let placement = &self.params.placement;
        let turn_wo = placement
            .pose_wo
            .map(|pose_wo| pose_wo.rotation)
            .unwrap_or_default();
        let force_o = levels.force_o(record);
        let force_t = record.rotation.inverse() * force_o;
        let (axes, in_other_frame) = match self.params.compensator.wrench_frame {
            WrenchFrame::Sensor => (record.rotation.inverse(), turn_wo.inverse() * force_t),
            WrenchFrame::Object => (turn_wo, record.rotation * (turn_wo * force_o)),
        };
        let by_w_first = PlaceMend::w_first().rotation(placement, record) * force_t;
        ReadPress::new(
            place,
            &axes,
            [normal, course],
            [force_o, in_other_frame, by_w_first],
        )
    }

    /// Checks whether straight presses lie one radius off the scan; leaning presses lie at edges
    /// and in holes, which the scan shows poorly.
    fn judge_radius(&self, presses: &Presses) -> Option<InputFinding> {
        let Presses { levels, scale, .. } = presses;
        let TipParams { radius, stiffness } = self.params.tip;
        if self.params.shape != TipShape::Ball {
            return None;
        }
        let compliance = stiffness.map_or(0.0, f64::recip);
        let straight = self.straight_presses(presses);
        let mut distances: Vec<f64> = straight
            .iter()
            .map(|press| press.distance + compliance * press.force)
            .collect();
        let count = distances.len();
        // a negative radius is impossible
        let distance =
            median(&mut distances).filter(|distance| count >= FEWEST_PRESSES && *distance > 0.0)?;
        distances
            .iter_mut()
            .for_each(|x| *x = (*x - distance).abs());
        let scatter = median(&mut distances)?;
        let error = error_of_median(scatter, count);
        // only differences between contacts show slow variation over the scan
        let roughness = scale
            .noise
            .max(SIGMA_OF_MEDIAN * scatter)
            .min(LARGEST_SCAN_NOISE);
        let noise = roughness.max(self.params.scan_noise.min(LARGEST_SCAN_NOISE));
        // a ball touches the peaks of a rough scan, above its mean
        let off =
            (distance + 0.5 * roughness - radius).abs() - OTHER_SINK * compliance * levels.largest;
        let is_doubted = off - 3.0 * error > (DOUBTED_NOISES * noise).max(LEAST_TOLERANCE);
        let is_sure = off - 4.0 * error > (SURE_NOISES * noise).max(2.0 * LEAST_TOLERANCE);
        is_doubted.then(|| {
            self.early_force(presses, distance)
                .unwrap_or_else(|| InputFinding {
                    is_sure,
                    ..off_by_radius(distance, error, radius)
                })
        })
    }

    /// A force too early instead of another radius: free of force, the ball comes nearer to the
    /// scan than any ball of that radius can.
    ///
    /// - `distance`: of the pressing centre from the scan, m.
    pub(super) fn early_force(&self, presses: &Presses, distance: f64) -> Option<InputFinding> {
        let Presses {
            levels, tolerance, ..
        } = presses;
        let resting = thinned(
            self.records
                .iter()
                .filter(|record| levels.is_resting(record)),
        );
        let near = -tolerance..(distance + self.params.tip.radius) / 2.0;
        let fit = self.fit(&resting, *tolerance);
        let nearer = fit.distances.iter().filter(|x| near.contains(x)).count();
        let share = nearer as f64 / resting.len().max(1) as f64;
        let measured = format!(
            "the ball's centre is {:.2} mm off the scan where it presses, and nearer than {:.2} mm in {:.0} % of the time in which it does not",
            distance * 1e3,
            near.end * 1e3,
            share * 100.0
        );
        let remedy = "the wrench is stamped later or earlier than the pose: record strokes that slide and turn back, which show by how much";
        (distance > near.end && share > NEARER_SHARE)
            .then(|| InputFinding::new(InputCause::Delay, true, measured, remedy))
    }

    /// All straight presses on the scan.
    pub(super) fn straight_presses(&self, presses: &Presses) -> Vec<StraightPress> {
        let Presses {
            records,
            levels,
            tolerance,
            sunk,
            ..
        } = presses;
        let fit = self.fit(records, tolerance + sunk);
        let of = fit.distances.iter().zip(&fit.normals);
        let pressed = records.iter().zip(of);
        pressed
            .filter_map(|(record, (&distance, &normal))| {
                let force = levels.force_o(record);
                let is_straight = force.dot(&normal) > STRAIGHT * force.norm();
                (is_straight && distance > -tolerance).then(|| StraightPress {
                    centre: record.centre,
                    normal,
                    distance,
                    force: force.norm(),
                })
            })
            .collect()
    }
}

pub(super) const TARE_REMEDY: &str =
    "tare the sensor in free air, or give payload and bias (touchup calibrate payload)";

fn no_contact(measured: String) -> InputFinding {
    let remedy = "the stylus never touched, or the wrench is not that of the stylus";
    InputFinding::new(InputCause::NoContact, true, measured, remedy)
}

/// - `distance`: of the ball's centre from the scan, m; `error`: its standard uncertainty.
pub(super) fn off_by_radius(distance: f64, error: f64, radius: f64) -> InputFinding {
    let measured = format!(
        "the ball's centre is {:.2} ± {:.2} mm off the scan where it presses, and its radius is said to be {:.4} mm",
        distance * 1e3,
        error * 1e3,
        radius * 1e3
    );
    let remedy = "give the radius in mm (--tip-radius-mm, tip.radius_mm); the stiffness, and the scan's offset, act alike";
    InputFinding::new(InputCause::Radius, true, measured, remedy)
}

/// Positions of some records, in cubes of `size`, m.
fn places_of(records: &[&InputRecord], size: f64) -> BTreeSet<VoxelKey> {
    let place = |record: &&InputRecord| voxel_of(&record.centre, size);
    records.iter().map(place).collect()
}

/// At most [`MOST_PRESSES`], spread over all.
fn thinned<'a>(records: impl Iterator<Item = &'a InputRecord>) -> Vec<&'a InputRecord> {
    let all: Vec<&InputRecord> = records.collect();
    let step = all.len().div_ceil(MOST_PRESSES).max(1);
    all.into_iter().step_by(step).collect()
}
