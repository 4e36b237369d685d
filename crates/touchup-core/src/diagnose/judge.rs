//! What the samples say of forces, places, wrench and clock, and what would mend it.

use nalgebra::{Point3, Vector2, Vector3};

use super::axes::{OtherAxes, WRENCH_FRAME_REMEDY};
use super::finding::{InputCause, InputFinding};
use super::forces::{ForceLevels, NOISES, axes_in_words, signed_permutations};
use super::input_record::InputRecord;
use super::mends::PlaceMend;
use super::monitor_params::InputMonitorParams;
use super::places::{ALIKE, BallFit, LEAST_TOLERANCE, ScanScale, error_of_median, extent_of};
use super::shift::{ContactShift, best_shift};
use crate::mesh::{FaceTree, TriMesh};
use crate::numeric::{NormalEquations, SIGMA_OF_MEDIAN, jackknife_variance, median};
use crate::stylus::{ClockDrift, ClockOffset, TipParams, TipShape, WrenchFrame};

/// Fewer presses say nothing.
pub(super) const FEWEST_PRESSES: usize = 20;
/// Presses that are compared with the scan.
const MOST_PRESSES: usize = 400;
/// The sign and axes of a wrench are right when the force leans from the normal by less than this
/// on average, as cosine.
const LEANS: f64 = 0.5;
/// A delay moves each touch along the path by this at most, m; a half of it is said.
const LARGEST_PATH: f64 = 0.32e-3;
/// A speed of the stylus over the part, m/s.
const USUAL_SPEED: f64 = 0.04;
/// A ball that is free is farther from the surface than one that presses by this at least, m.
const LEAST_LIFT: f64 = 0.3e-3;
/// … and by so many deviations of the scan: the scan may be that low under all of what rests.
const LIFT_NOISES: f64 = 1.5;
/// Half of what presses is beyond the median; of what is free, more than this is.
const SHARE_OF_FREE: f64 = 0.55;
/// Contacts are on the scan when this share of them is: where the scan lacks a wall or a hole, they
/// are not.
const SHARE_ON_SCAN: f64 = 0.5;
/// What mends an input brings so many more onto the scan.
const MENDED_SHARE: f64 = 0.3;
/// The touched part is no smaller and no larger than this share of the scan …
const SHARES_OF_SCAN: std::ops::RangeInclusive<f64> = 0.05..=1.5;
/// … and larger than so many tolerances: less lies on anything.
const LEAST_SPREAD: f64 = 8.0;
/// Contacts do not span more than this many times the scan.
const LARGEST_SPREAD: f64 = 5.0;
/// A shift is one when it is longer than so many tolerances …
const LEAST_SHIFT: f64 = 4.0;
/// … brings all but some contacts onto the scan …
const SHIFTED_SHARE: f64 = 0.85;
/// … and this many more than are there as it is.
const SHIFT_GAIN: f64 = 0.15;
/// No cell resolves less, N.
const LEAST_NOISE: f64 = 0.5e-3;
/// What a hand or a light arm presses with at most, N.
const LARGEST_PRESS: f64 = 150.0;
/// … and with a stylus that bends, no more than bends it by this, m, …
const LARGEST_BEND: f64 = 8e-3;
/// … above this force, N.
const HARD_PRESS: f64 = 40.0;
/// A rest is one beyond so many times what the zero may be off by.
const LARGEST_REST: f64 = 1.6;
/// A smaller one is no reason to refuse, N.
const LEAST_TARE: f64 = 0.4;
/// A ball this much farther from the surface than its radius is another one.
const LEAST_RATIO: f64 = 20.0;
/// Of contacts on a rough scan this share is not farther off than so many times what most are.
const SHARE_NOT_FAR: f64 = 0.9;
const FAR: f64 = 3.0;
/// No ball is larger than this share of the scan that it is for.
const LARGEST_BALL: f64 = 0.25;
/// No ball is smaller, m.
const LEAST_BALL: f64 = 20e-6;
/// Stretches of a recording that what the stylus bends is estimated from.
const STRETCHES: usize = 16;
/// The compliance is another one when it differs by this share of the larger …
const OTHER_COMPLIANCE: f64 = 0.4;
/// … and the ball sinks by so much less or more, m.
const LEAST_SUNK: f64 = 0.15e-3;
/// A force presses straight when the cosine to the scan's normal is larger.
const STRAIGHT: f64 = 0.8;
/// The ball is another one when its centre is so many deviations of the scan from where it should
/// be, and surely with so many.
const DOUBTED_NOISES: f64 = 1.0;
const SURE_NOISES: f64 = 1.5;
/// … beyond this share of what the stylus bends by: so far its stiffness may be off.
const OTHER_SINK: f64 = 0.2;
/// No scanner is worse, m.
const LARGEST_SCAN_NOISE: f64 = 2e-3;

/// The samples beside the scan.
#[derive(Debug)]
pub(super) struct InputJudge<'a> {
    pub params: &'a InputMonitorParams,
    pub scan: &'a TriMesh,
    pub tree: &'a FaceTree,
    pub records: &'a [InputRecord],
    /// of one axis of the force, N
    pub noise: f64,
    /// largest component of the measured force, N, how often it was exactly that, and of how many
    pub largest: (f64, u64, u64),
    pub clock: Option<ClockOffset>,
}

/// What presses, and what it is compared with.
#[derive(Debug)]
struct Presses<'a> {
    records: Vec<&'a InputRecord>,
    levels: ForceLevels,
    scale: ScanScale,
    /// how far the reported centre may sink below one radius, m
    sunk: f64,
    /// of the distance of a centre from the surface, m
    tolerance: f64,
}

impl InputJudge<'_> {
    /// All doubts.
    #[expect(clippy::too_many_lines)]
    pub fn findings(&self) -> Vec<InputFinding> {
        let TipParams { radius, stiffness } = self.params.tip;
        let scale = ScanScale::of(self.scan);
        let tolerance = scale.tolerance(self.params.scan_noise, radius, 1.0);
        let mut levels = ForceLevels::of(self.records, self.noise);
        let resting = thinned(
            self.records
                .iter()
                .filter(|record| levels.is_resting(record)),
        );
        let rest_fit = self.fit(&resting, tolerance);
        let pressing = thinned(
            self.records
                .iter()
                .filter(|record| levels.is_pressing(record)),
        );
        let press_fit = self.fit(&pressing, tolerance);
        // what rests on the surface presses all the time: then the rest is no force of free motion
        let lift = LEAST_LIFT.max(LIFT_NOISES * self.params.scan_noise.max(scale.noise));
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
            let remedy = "the stylus never touched, or the wrench is not that of the stylus";
            return vec![InputFinding::new(
                InputCause::NoContact,
                true,
                measured,
                remedy,
            )];
        }
        let bend = stiffness.map_or(0.0, |stiffness| levels.largest / stiffness);
        let sunk = bend.min(scale.extent * 0.05);
        let presses = Presses {
            records: pressing,
            levels,
            scale,
            sunk,
            tolerance,
        };
        let mut findings = Vec::new();
        self.judge_forces(&presses, is_free.then_some(resting.len()), &mut findings);
        let place = self.judge_places(&presses);
        let is_doubted_place = place.is_some();
        let is_placed = place.as_ref().is_none_or(|(_, is_placed)| *is_placed);
        findings.extend(place.map(|(finding, _)| finding));
        let is_of_poses = |finding: &InputFinding| {
            matches!(
                finding.cause,
                InputCause::LengthUnit | InputCause::PositionAxes | InputCause::QuaternionOrder
            )
        };
        let wrench = || {
            self.judge_wrench(&presses)
                .or_else(|| self.judge_axes(&presses))
        };
        let wrench = is_placed.then(wrench).flatten();
        // what turns the force turns its course too
        if wrench.is_none() && !findings.iter().any(is_of_poses) {
            findings.extend(self.judge_clock());
        }
        let stiffness = (wrench.is_none() && findings.is_empty())
            .then(|| self.judge_stiffness(&presses))
            .flatten();
        // as far off as a place or a stiffness that is wrong has it
        let is_explained = wrench.is_some() || stiffness.is_some() || is_doubted_place;
        let radius = (!is_explained)
            .then(|| self.judge_radius(&presses))
            .flatten();
        findings.extend(stiffness.or(radius));
        findings.extend(wrench);
        findings
    }

    fn fit(&self, records: &[&InputRecord], tolerance: f64) -> BallFit {
        self.fit_at(records.iter().map(|record| record.centre), tolerance)
    }

    fn fit_at(&self, centres: impl Iterator<Item = Point3<f64>>, tolerance: f64) -> BallFit {
        BallFit::of(
            self.scan,
            self.tree,
            centres,
            self.params.tip.radius,
            tolerance,
        )
    }

    /// - `resting`: how many free samples the rest is the mean of, where it is one.
    #[expect(clippy::too_many_lines)]
    fn judge_forces(
        &self,
        presses: &Presses,
        resting: Option<usize>,
        findings: &mut Vec<InputFinding>,
    ) {
        let ForceLevels {
            rest_t,
            noise,
            largest,
        } = presses.levels;
        let gate = self.params.gate;
        let on = gate.map_or(0.0, |gate| gate.on);
        let bend = self
            .params
            .tip
            .stiffness
            .map_or(0.0, |stiffness| largest / stiffness);
        if largest < LEAST_NOISE * 40.0 && noise < LEAST_NOISE {
            let measured =
                format!("the stylus presses with {largest:.5} N, above a noise of {noise:.6} N");
            let remedy = "the forces look like kN: give the wrench in N";
            findings.push(InputFinding::new(
                InputCause::ForceUnit,
                true,
                measured,
                remedy,
            ));
        } else if largest > LARGEST_PRESS || largest > HARD_PRESS && bend > LARGEST_BEND {
            let mut measured =
                format!("the stylus presses with {largest:.0} N, above a noise of {noise:.2} N");
            if bend > 0.0 {
                measured += &format!(", and would bend by {:.1} mm", bend * 1e3);
            }
            let remedy = "the forces look like grams or mN: give the wrench in N";
            findings.push(InputFinding::new(
                InputCause::ForceUnit,
                true,
                measured,
                remedy,
            ));
        } else if largest < on {
            let measured = format!(
                "the contacts reach {largest:.2} N ± {noise:.3} N and contact.on_n is {on:.2} N"
            );
            let remedy = "press harder, or give contact.on_n and contact.off_n below that and above the noise";
            findings.push(InputFinding::new(
                InputCause::LightTouch,
                true,
                measured,
                remedy,
            ));
        }
        let rest = rest_t.norm();
        let is_unit = findings
            .iter()
            .any(|finding| finding.cause == InputCause::ForceUnit);
        let is_rest = !is_unit && gate.is_some_and(|gate| rest > LARGEST_REST * gate.free);
        if let Some(count) = resting.filter(|_| is_rest) {
            let error = noise / (count as f64 / ALIKE).sqrt();
            let measured = format!(
                "far from the scan the force is ({:.2}, {:.2}, {:.2}) ± {error:.2} N in the axes of the stylus",
                rest_t.x, rest_t.y, rest_t.z
            );
            let remedy =
                "tare the sensor in free air, or give payload and bias (touchup calibrate payload)";
            findings.push(InputFinding::new(
                InputCause::Tare,
                rest > LEAST_TARE,
                measured,
                remedy,
            ));
        }
        let (clip, times, samples) = self.largest;
        // where even the noise repeats itself, a value that does says nothing
        if noise > 0.0
            && times > 20
            && times as f64 > 0.002 * samples as f64
            && clip > 0.5 * largest
        {
            let measured = format!(
                "{times} samples have a force component of exactly {clip:.3} N, the largest"
            );
            let remedy = "the sensor is saturated: press less, or choose a wider range";
            let is_sure = times as f64 > 0.01 * samples as f64;
            findings.push(InputFinding::new(
                InputCause::Saturation,
                is_sure,
                measured,
                remedy,
            ));
        }
    }

    /// What is wrong with where the presses are, and whether they are on the scan even so.
    #[expect(clippy::too_many_lines)]
    fn judge_places(&self, presses: &Presses) -> Option<(InputFinding, bool)> {
        let Presses {
            records,
            scale,
            sunk,
            tolerance,
            ..
        } = presses;
        let radius = self.params.tip.radius;
        let reported = self.fit(records, tolerance + sunk);
        let is_ball = self.params.shape == TipShape::Ball;
        // by how much the median distance is uncertain: presses that follow each other are alike
        let noise = scale
            .noise
            .max(self.params.scan_noise)
            .min(LARGEST_SCAN_NOISE);
        let error = error_of_median(reported.scatter, records.len());
        let off_by_radius = || (off_by_radius(reported.distance, error, radius), true);
        let is_on_scan = reported.share >= SHARE_ON_SCAN
            && (reported.distance - radius).abs() <= tolerance + sunk;
        if is_on_scan && is_ball {
            // a scan's own offset is within the tolerance; a radius in another unit is not a matter
            // of tolerance
            let is_other =
                reported.distance > LEAST_RATIO * radius && reported.distance > 3.0 * error;
            // a tip of radius 0 is a point
            if (radius > 0.0 && radius < LEAST_BALL) || is_other {
                return Some(off_by_radius());
            }
        }
        if !is_on_scan && let Some(finding) = self.mend(presses, &reported) {
            return Some((finding, false));
        }
        let extent = extent_of(records.iter().map(|record| record.centre)) / scale.extent;
        if extent > LARGEST_SPREAD {
            let measured = format!("the contacts span {extent:.3} times the scan");
            let remedy =
                "poses are in m, the scan as --mesh-unit says: is one of them in another unit?";
            return Some((
                InputFinding::new(InputCause::LengthUnit, true, measured, remedy),
                false,
            ));
        }
        // all as far from the surface as each other: another ball
        let may_be_ball =
            is_ball && (0.0..LARGEST_BALL * scale.extent).contains(&reported.distance);
        let is_off = (reported.distance - radius).abs() > tolerance + sunk;
        if is_off && may_be_ball && reported.scatter <= noise + 0.2 * scale.edge + 0.1e-3 {
            return Some(off_by_radius());
        }
        let shown = |scale: f64| 1e3 * scale;
        let mut measured = format!(
            "the ball's centre is {:.2} ± {:.2} mm off the scan where it presses, and its radius is {:.2} mm; {:.0} % of \
             the contacts are on the scan",
            shown(reported.distance),
            shown(reported.scatter),
            shown(radius),
            100.0 * reported.share
        );
        if let Some(ContactShift { shift, share }) = self.shift(presses, &reported) {
            let [x, y, z] = [shift.x, shift.y, shift.z].map(shown);
            measured += &format!(
                ", and shifted by ({x:.1}, {y:.1}, {z:.1}) mm {:.0} % are",
                100.0 * share
            );
            return Some((
                InputFinding::new(InputCause::Frame, true, measured, FRAME_REMEDY),
                is_on_scan,
            ));
        }
        if is_on_scan {
            return None;
        }
        // a rough scan: most are less than a radius off, and hardly one is far
        let wide = radius.max(*tolerance) + sunk;
        let share_within = |distance: f64| self.fit(records, distance).share;
        let is_near = (reported.distance - radius).abs() <= wide
            && share_within(wide) >= SHARE_ON_SCAN
            && share_within(FAR * wide) >= SHARE_NOT_FAR;
        Some((
            InputFinding::new(InputCause::Frame, !is_near, measured, FRAME_REMEDY),
            is_near,
        ))
    }

    /// Another unit, other axes or another order of the quaternion, with which the contacts are on
    /// the scan.
    fn mend(&self, presses: &Presses, reported: &BallFit) -> Option<InputFinding> {
        let Presses {
            records,
            scale,
            sunk,
            ..
        } = presses;
        let radius = self.params.tip.radius;
        let placement = &self.params.placement;
        let fit = |mend: PlaceMend| {
            let unit = mend.scan_unit;
            let tolerance = scale.tolerance(0.0, radius * unit, unit) + sunk * unit;
            let centres: Vec<Point3<f64>> = records
                .iter()
                .map(|record| mend.centre(placement, record))
                .collect();
            let extent = extent_of(centres.iter().copied());
            let is_spread = SHARES_OF_SCAN.contains(&(extent / scale.extent))
                && extent > LEAST_SPREAD * tolerance;
            is_spread.then(|| {
                (
                    BallFit::of(
                        self.scan,
                        self.tree,
                        centres.into_iter(),
                        radius * unit,
                        tolerance,
                    )
                    .share,
                    mend,
                )
            })
        };
        let mends = PlaceMend::units()
            .chain([PlaceMend::w_first()])
            .chain(PlaceMend::axes());
        let (share, mend) = mends.filter_map(fit).max_by(|a, b| a.0.total_cmp(&b.0))?;
        let is_mended = share >= SHARE_ON_SCAN && share > reported.share + MENDED_SHARE;
        let measured = format!(
            "{}: {:.0} % of the contacts are then on the scan, and {:.0} % as it is",
            mend.says,
            100.0 * share,
            100.0 * reported.share
        );
        let remedy = match mend.cause {
            InputCause::LengthUnit => "poses are in m, the scan as --mesh-unit says",
            InputCause::QuaternionOrder => W_LAST,
            _ => "give the positions in the axes of the scan, or scan_to_space",
        };
        is_mended.then(|| InputFinding::new(mend.cause, true, measured, remedy))
    }

    /// The shift of all contacts that brings many more of them onto the scan; `None` where none
    /// does.
    fn shift(&self, presses: &Presses, reported: &BallFit) -> Option<ContactShift> {
        let Presses {
            records,
            sunk,
            tolerance,
            ..
        } = presses;
        if reported.share + SHIFT_GAIN > 1.0 {
            return None;
        }
        let centres: Vec<Point3<f64>> = records.iter().map(|record| record.centre).collect();
        let tolerance = tolerance + sunk;
        let best = best_shift(
            self.scan,
            self.tree,
            &centres,
            self.params.tip.radius,
            tolerance,
        )?;
        let is_one = best.shift.norm() > LEAST_SHIFT * tolerance
            && best.share >= SHIFTED_SHARE
            && best.share >= reported.share + SHIFT_GAIN;
        is_one.then_some(best)
    }

    /// What is wrong with the direction of the forces.
    #[expect(clippy::too_many_lines)]
    fn judge_wrench(&self, presses: &Presses) -> Option<InputFinding> {
        let Presses {
            records,
            levels,
            tolerance,
            ..
        } = presses;
        let placement = &self.params.placement;
        let normals = self.fit(records, *tolerance).normals;
        let forces: Vec<Vector3<f64>> = records
            .iter()
            .map(|record| record.force_t() - levels.rest_t)
            .collect();
        let lean = |force_o: &dyn Fn(usize) -> Vector3<f64>| {
            let cosines = (0..forces.len()).map(|at| force_o(at).normalize().dot(&normals[at]));
            cosines.sum::<f64>() / forces.len() as f64
        };
        let as_read = lean(&|at| records[at].rotation * forces[at]);
        if as_read >= LEANS {
            return None;
        }
        let w_first = PlaceMend::w_first();
        let sign = lean(&|at| -(records[at].rotation * forces[at]));
        let as_w_first = lean(&|at| w_first.rotation(placement, records[at]) * forces[at]);
        let turn_ow = placement
            .pose_wo
            .map(|pose_wo| pose_wo.rotation.inverse())
            .unwrap_or_default();
        let (as_other, says) = match self.params.compensator.wrench_frame {
            WrenchFrame::Sensor => (
                lean(&|at| turn_ow * forces[at]),
                "read in the frame of the poses",
            ),
            WrenchFrame::Object => {
                let turned = |at: usize| turn_ow.inverse() * (records[at].rotation * forces[at]);
                (
                    lean(&|at| records[at].rotation * turned(at)),
                    "read in the axes of the stylus",
                )
            }
        };
        let turned = signed_permutations()
            .map(|axes| (lean(&|at| records[at].rotation * (axes * forces[at])), axes))
            .max_by(|a, b| a.0.total_cmp(&b.0));
        let degrees = |cosine: f64| cosine.clamp(-1.0, 1.0).acos().to_degrees();
        let before = format!(
            "where the ball presses, the force leans {:.0}° from the scan's normal",
            degrees(as_read)
        );
        let best_turned = turned.as_ref().map_or(0.0, |(turned, _)| *turned);
        if as_w_first > LEANS && as_w_first > best_turned {
            let measured = format!(
                "{before}, and {:.0}° with w first in the quaternion",
                degrees(as_w_first)
            );
            return Some(InputFinding::new(
                InputCause::QuaternionOrder,
                true,
                measured,
                W_LAST,
            ));
        }
        if sign > LEANS && sign > best_turned - 0.05 {
            let remedy = "reverse the wrench: it is what the part does to the stylus";
            let measured = format!("{before}, and {:.0}° reversed", degrees(sign));
            return Some(InputFinding::new(
                InputCause::WrenchSign,
                true,
                measured,
                remedy,
            ));
        }
        if best_turned.max(as_other) < as_read + 0.1 {
            // no other axes explain the forces better
            return None;
        }
        let (turned, says) = match turned {
            Some((turned, axes)) if turned > as_other => (
                turned,
                format!("with its axes taken as {}", axes_in_words(&axes)),
            ),
            _ => (as_other, says.to_owned()),
        };
        let is_sure = turned > LEANS && turned > as_read + 0.3;
        let measured = format!("{before}, and {:.0}° {says}", degrees(turned));
        Some(InputFinding::new(
            InputCause::WrenchFrame,
            is_sure,
            measured,
            WRENCH_FRAME_REMEDY,
        ))
    }

    /// How far the reported centre sinks with the force: the slope of its distance from the scan
    /// over |F|, by least squares, with the jackknife's uncertainty over stretches of the
    /// recording.
    fn judge_stiffness(&self, presses: &Presses) -> Option<InputFinding> {
        let Presses {
            levels,
            tolerance,
            sunk,
            ..
        } = presses;
        let radius = self.params.tip.radius;
        let records: Vec<&InputRecord> = self
            .records
            .iter()
            .filter(|record| levels.off_rest(record) > NOISES * levels.noise)
            .collect();
        let fit = self.fit(&records, *tolerance);
        let rows: Vec<(f64, f64)> = records
            .iter()
            .zip(&fit.distances)
            .filter(|(_, distance)| (*distance - radius).abs() <= tolerance + sunk)
            .map(|(record, distance)| (levels.off_rest(record), *distance))
            .collect();
        let stretches: Vec<&[(f64, f64)]> =
            rows.chunks(rows.len().div_ceil(STRETCHES).max(1)).collect();
        if stretches.len() < STRETCHES / 2 {
            return None;
        }
        let compliance = |left_out: Option<usize>| {
            let some = stretches
                .iter()
                .enumerate()
                .filter(|(at, _)| Some(*at) != left_out);
            let rows = some.flat_map(|(_, stretch)| stretch.iter());
            let equations = NormalEquations::of(
                rows.map(|(force, distance)| (Vector2::new(1.0, *force), *distance)),
            );
            Some(-equations.solution()?.y)
        };
        let found = compliance(None)?;
        let without: Vec<f64> = (0..stretches.len())
            .map(|at| compliance(Some(at)))
            .collect::<Option<_>>()?;
        let sigma = jackknife_variance(&without).sqrt();
        let told = self.params.tip.stiffness.map_or(0.0, f64::recip);
        let off = (told - found).abs();
        let is_doubted = off > 4.0 * sigma + OTHER_COMPLIANCE * told.max(found)
            && off * levels.largest > LEAST_SUNK;
        let measured = format!(
            "the ball sinks by {:.3} ± {:.3} mm/N where it presses, and by its stiffness it sinks by {:.4} mm/N",
            found * 1e3,
            sigma * 1e3,
            told * 1e3
        );
        let remedy = "give the stiffness in N/mm (--stiffness-n-per-mm, tip.stiffness_n_per_mm; touchup calibrate tip)";
        let is_sure = off > 6.0 * sigma + OTHER_COMPLIANCE * told.max(found);
        is_doubted.then(|| InputFinding::new(InputCause::Stiffness, is_sure, measured, remedy))
    }

    /// Whether other axes explain the forces better, where they lean from the scan no more than
    /// others do.
    fn judge_axes(&self, presses: &Presses) -> Option<InputFinding> {
        let Presses {
            levels, tolerance, ..
        } = presses;
        let turn_wo = self
            .params
            .placement
            .pose_wo
            .map(|pose_wo| pose_wo.rotation)
            .unwrap_or_default();
        let axes = |record: &InputRecord| match self.params.compensator.wrench_frame {
            WrenchFrame::Sensor => record.rotation.inverse(),
            WrenchFrame::Object => turn_wo,
        };
        let normals = |slides: &[&InputRecord]| self.fit(slides, *tolerance).normals;
        OtherAxes::of(self.records, levels, normals, axes)?.finding()
    }

    /// Whether the ball is as far from the scan as its radius where it presses straight on it; what
    /// leans is at edges and in holes, of which the scan knows little.
    fn judge_radius(&self, presses: &Presses) -> Option<InputFinding> {
        let Presses {
            records,
            levels,
            scale,
            tolerance,
            sunk,
        } = presses;
        let TipParams { radius, stiffness } = self.params.tip;
        if self.params.shape != TipShape::Ball {
            return None;
        }
        let compliance = stiffness.map_or(0.0, f64::recip);
        let fit = self.fit(records, tolerance + sunk);
        let mut distances: Vec<f64> = records
            .iter()
            .zip(&fit.distances)
            .zip(&fit.normals)
            .filter_map(|((record, distance), normal)| {
                let force = record.rotation * (record.force_t() - levels.rest_t);
                let is_straight =
                    force.dot(normal) > STRAIGHT * force.norm() && *distance > -tolerance;
                is_straight.then(|| distance + compliance * force.norm())
            })
            .collect();
        let count = distances.len();
        let distance = median(&mut distances).filter(|_| count >= FEWEST_PRESSES)?;
        distances
            .iter_mut()
            .for_each(|x| *x = (*x - distance).abs());
        let scatter = median(&mut distances)?;
        let error = error_of_median(scatter, count);
        // what differs slowly over the scan is seen between the contacts alone
        let roughness = scale
            .noise
            .max(SIGMA_OF_MEDIAN * scatter)
            .min(LARGEST_SCAN_NOISE);
        let noise = roughness.max(self.params.scan_noise.min(LARGEST_SCAN_NOISE));
        // the nearest of what is rough is above its mean
        let off =
            (distance + 0.5 * roughness - radius).abs() - OTHER_SINK * compliance * levels.largest;
        let is_doubted = off - 3.0 * error > (DOUBTED_NOISES * noise).max(LEAST_TOLERANCE);
        let is_sure = off - 4.0 * error > (SURE_NOISES * noise).max(2.0 * LEAST_TOLERANCE);
        is_doubted.then(|| InputFinding {
            is_sure,
            ..off_by_radius(distance, error, radius)
        })
    }

    fn judge_clock(&self) -> Option<InputFinding> {
        let ClockOffset {
            offset,
            sigma,
            drift,
            evidence,
        } = self.clock?;
        let largest = drift.map_or(offset.abs(), |of| {
            of.offset_at_first.abs().max(of.offset_at_last.abs())
        });
        let sigma = drift.map_or(sigma, |of| of.sigma_at_ends(sigma));
        let path = (largest - 3.0 * sigma) * USUAL_SPEED;
        let [ms, sigma_ms] = [offset, sigma].map(|x| x * 1e3);
        let (measured, remedy) = match drift {
            None => (
                format!(
                    "the wrench reads {ms:+.1} ± {sigma_ms:.1} ms beyond the pose, by {evidence}"
                ),
                "add it to sync.wrench_offset_ms",
            ),
            Some(ClockDrift {
                rate,
                rate_sigma,
                offset_at_first,
                offset_at_last,
            }) => {
                let [first_ms, last_ms] = [offset_at_first, offset_at_last].map(|x| x * 1e3);
                let [ppm, ppm_sigma] = [rate, rate_sigma].map(|x| x * 1e6);
                (
                    format!(
                        "the clock of the wrench gains {ppm:+.1} ± {ppm_sigma:.1} ppm on that of the pose and reads \
                         {first_ms:+.1} ± {sigma_ms:.1} ms beyond it at first, {last_ms:+.1} ms at last, by {evidence}"
                    ),
                    "add the first two to sync.wrench_drift_ppm and sync.wrench_offset_ms",
                )
            }
        };
        let is_sure = path > LARGEST_PATH;
        (path > LARGEST_PATH / 2.0)
            .then(|| InputFinding::new(InputCause::Delay, is_sure, measured, remedy))
    }
}

const FRAME_REMEDY: &str =
    "are the poses those of the ball in the frame of the scan (scan_to_space, tip.offset_mm)?";
const W_LAST: &str = "give the orientation as x, y, z, w";

/// - `distance`: of the ball's centre from the scan, m; `error`: its standard uncertainty.
fn off_by_radius(distance: f64, error: f64, radius: f64) -> InputFinding {
    let measured = format!(
        "the ball's centre is {:.2} ± {:.2} mm off the scan where it presses, and its radius is said to be {:.4} mm",
        distance * 1e3,
        error * 1e3,
        radius * 1e3
    );
    let remedy = "give the radius in mm (--tip-radius-mm, tip.radius_mm); the stiffness, and the scan's offset, act alike";
    InputFinding::new(InputCause::Radius, true, measured, remedy)
}

/// Not more than [`MOST_PRESSES`], spread over all.
fn thinned<'a>(records: impl Iterator<Item = &'a InputRecord>) -> Vec<&'a InputRecord> {
    let all: Vec<&InputRecord> = records.collect();
    let step = all.len().div_ceil(MOST_PRESSES).max(1);
    all.into_iter().step_by(step).collect()
}
