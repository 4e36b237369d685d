//! Checks whether the presses lie on the scan, and finds remedies that bring them there.

use nalgebra::{Point3, Vector3};

use super::finding::{InputCause, InputFinding};
use super::input_record::InputRecord;
use super::judge::{InputJudge, LARGEST_SCAN_NOISE, LEAST_BALL, Presses, off_by_radius};
use super::mends::PlaceMend;
use super::places::{BallFit, SHARE_ON_SCAN, ScanAgreement, error_of_median, extent_of};
use super::shift::{ContactShift, best_shift};
use touchup_method::stylus::{TipShape, WrenchFrame};

/// Minimum gain of a remedy: additional share of presses on the scan.
const MENDED_SHARE: f64 = 0.3;
/// Minimum lead of a sure remedy over any other, in share of presses on the scan.
const REFUTED_SHARE: f64 = 0.1;
/// Plausible extent of the touched part, as a share of the scan.
const SHARES_OF_SCAN: std::ops::RangeInclusive<f64> = 0.05..=1.5;
/// Minimum extent of the touched part, in tolerances: a smaller one fits anywhere.
const LEAST_SPREAD: f64 = 8.0;
/// Maximum span of the contacts, in spans of the scan.
const LARGEST_SPREAD: f64 = 5.0;
/// Minimum length of a shift, in tolerances.
const LEAST_SHIFT: f64 = 4.0;
/// Minimum share of contacts on the scan after a shift.
pub(super) const SHIFTED_SHARE: f64 = 0.85;
/// Minimum gain of a shift, in share of contacts on the scan.
const SHIFT_GAIN: f64 = 0.15;
/// Minimum ratio of distance to radius for a radius in another unit.
const LEAST_RATIO: f64 = 20.0;
/// Minimum share of contacts on a rough scan within [`FAR`] tolerances.
const SHARE_NOT_FAR: f64 = 0.9;
const FAR: f64 = 3.0;
/// Maximum radius of a ball, as a share of the scan.
const LARGEST_BALL: f64 = 0.25;
/// Maximum distance of a ball from the recorded point of the stylus, m.
const LONGEST_TIP: f64 = 0.4;
/// Maximum number of presses in the search for that distance.
const TIP_JUDGES: usize = 60;
pub(super) const FRAME_REMEDY: &str =
    "are the poses those of the ball in the frame of the scan (scan_to_space, tip.offset_mm)?";

/// The presses on the scan as reported.
struct ReportedPlacement {
    fit: BallFit,
    centres: Vec<Point3<f64>>,
    /// in O, N
    forces: Vec<Vector3<f64>>,
    /// tolerance of the distance from one radius, m
    tolerance: f64,
    is_on_scan: bool,
    /// too few touched places: almost any motion and ball explains them
    is_few: bool,
}

impl InputJudge<'_> {
    /// The fault in the places of the presses, and whether they still lie on the scan.
    ///
    /// - `is_few`: too few touched places: almost any motion and ball explains them.
    pub(crate) fn judge_places(
        &self,
        presses: &Presses,
        is_few: bool,
    ) -> Option<(InputFinding, bool)> {
        let Presses { records, .. } = presses;
        let radius = self.params.tip.radius;
        let tolerance = presses.tolerance + presses.sunk;
        let fit = self.fit(records, tolerance);
        let reported = ReportedPlacement {
            is_on_scan: fit.share >= SHARE_ON_SCAN && (fit.distance - radius).abs() <= tolerance,
            fit,
            centres: records.iter().map(|record| record.centre).collect(),
            forces: records
                .iter()
                .map(|record| presses.levels.force_o(record))
                .collect(),
            tolerance,
            is_few,
        };
        if let Some(inside) = self.inside_out(&reported) {
            return Some((inside, false));
        }
        if let Some(ball) = self.ball_of_other_unit(presses, &reported) {
            return Some((ball, true));
        }
        let other_ball = self.other_ball(presses, &reported);
        if !reported.is_on_scan {
            let tried = self.mends(presses, is_few, other_ball.is_none());
            if let Some(finding) = self.mend(presses, &reported, tried) {
                return Some((finding, false));
            }
        }
        let extent = extent_of(reported.centres.iter().copied()) / presses.scale.extent;
        if extent > LARGEST_SPREAD {
            let measured = format!("the contacts span {extent:.3} times the scan");
            let remedy =
                "poses are in m, the scan as --mesh-unit says: is one of them in another unit?";
            return Some((
                InputFinding::new(InputCause::LengthUnit, true, measured, remedy),
                false,
            ));
        }
        if let Some(ball) = other_ball {
            return Some((
                self.early_force(presses, reported.fit.distance)
                    .unwrap_or(ball),
                true,
            ));
        }
        self.judge_frame(presses, &reported)
    }

    /// A scan with inward faces: the centres lie a radius below its surface, and the forces point
    /// into it.
    fn inside_out(&self, reported: &ReportedPlacement) -> Option<InputFinding> {
        let ReportedPlacement {
            fit,
            forces,
            tolerance,
            ..
        } = reported;
        let radius = self.params.tip.radius;
        let inwards = BallFit {
            distances: fit.distances.iter().map(|distance| -distance).collect(),
            normals: fit.normals.iter().map(|normal| -normal).collect(),
            ..fit.clone()
        };
        let [as_read, inwards] =
            [fit, &inwards].map(|fit| fit.explained(forces, radius, *tolerance).on_scan());
        // a reversed wrench leaves the centres a radius above it
        let is_below = (fit.distance + radius).abs() < (fit.distance - radius).abs();
        let is_found = is_below && inwards >= SHARE_ON_SCAN && inwards > as_read + MENDED_SHARE;
        is_found.then(|| {
            let measured = format!(
                "{:.0} % of the contacts are on the scan from within, where their forces point, and {:.0} % from outside",
                100.0 * inwards,
                100.0 * as_read
            );
            let remedy = "turn the faces of the scan: they are counter-clockwise seen from outside";
            InputFinding::new(InputCause::InsideOut, true, measured, remedy)
        })
    }

    /// A radius in another unit, beyond any tolerance.
    fn ball_of_other_unit(
        &self,
        presses: &Presses,
        reported: &ReportedPlacement,
    ) -> Option<InputFinding> {
        let radius = self.params.tip.radius;
        let BallFit {
            distance, scatter, ..
        } = reported.fit;
        let error = error_of_median(scatter, presses.records.len());
        let is_other = distance > LEAST_RATIO * radius && distance > 3.0 * error;
        // a tip of radius 0 is a point
        let is_none = radius > 0.0 && radius < LEAST_BALL;
        let is_ball = self.params.shape == TipShape::Ball;
        (is_ball && !reported.is_few && reported.is_on_scan && (is_none || is_other))
            .then(|| off_by_radius(distance, error, radius))
    }

    /// Presses at one common distance from the surface: another ball.
    fn other_ball(&self, presses: &Presses, reported: &ReportedPlacement) -> Option<InputFinding> {
        let Presses { records, scale, .. } = presses;
        let BallFit {
            distance, scatter, ..
        } = reported.fit;
        let radius = self.params.tip.radius;
        let may_be_ball = self.params.shape == TipShape::Ball
            && !reported.is_few
            && (0.0..LARGEST_BALL * scale.extent).contains(&distance);
        let noise = scale
            .noise
            .max(self.params.scan_noise)
            .min(LARGEST_SCAN_NOISE);
        let is_off = (distance - radius).abs() > reported.tolerance;
        (is_off && may_be_ball && scatter <= noise + 0.2 * scale.edge + 0.1e-3)
            .then(|| off_by_radius(distance, error_of_median(scatter, records.len()), radius))
    }

    /// Contacts off the scan, or a common shift that brings many more onto it.
    fn judge_frame(
        &self,
        presses: &Presses,
        reported: &ReportedPlacement,
    ) -> Option<(InputFinding, bool)> {
        let ReportedPlacement {
            fit,
            forces,
            tolerance,
            is_on_scan,
            is_few,
            ..
        } = reported;
        let radius = self.params.tip.radius;
        let shown = |x: f64| 1e3 * x;
        let mut measured = format!(
            "the ball's centre is {:.2} ± {:.2} mm off the scan where it presses, and its radius is {:.2} mm; {:.0} % of \
             the contacts are on the scan",
            shown(fit.distance),
            shown(fit.scatter),
            shown(radius),
            100.0 * fit.share
        );
        let as_it_is = fit.explained(forces, radius, *tolerance);
        let shift = (!is_few).then(|| self.shift(reported, &as_it_is)).flatten();
        if let Some(ContactShift { shift, share }) = shift {
            let [x, y, z] = [shift.x, shift.y, shift.z].map(shown);
            measured += &format!(
                ", and shifted by ({x:.1}, {y:.1}, {z:.1}) mm {:.0} % are",
                100.0 * share
            );
            return Some((
                InputFinding::new(InputCause::Frame, true, measured, FRAME_REMEDY),
                *is_on_scan,
            ));
        }
        if *is_on_scan || as_it_is.on_scan_or_in_holes() >= SHARE_NOT_FAR {
            return None;
        }
        // a rough scan: most are less than a radius off, and hardly any is far
        let wide = radius.max(presses.tolerance) + presses.sunk;
        let share_within = |distance: f64| self.fit(&presses.records, distance).share;
        let is_near = (fit.distance - radius).abs() <= wide
            && share_within(wide) >= SHARE_ON_SCAN
            && share_within(FAR * wide) >= SHARE_NOT_FAR;
        let is_sure = !is_near && as_it_is.on_scan_or_in_holes() < SHARE_ON_SCAN;
        Some((
            InputFinding::new(InputCause::Frame, is_sure, measured, FRAME_REMEDY),
            is_near,
        ))
    }

    /// Another unit, other axes, another quaternion order or another point of the stylus.
    ///
    /// - `is_few`: too few contacts for any correction but a unit.
    /// - `is_far`: no other ball explains them as well as another point of the stylus.
    fn mends(&self, presses: &Presses, is_few: bool, is_far: bool) -> Vec<PlaceMend> {
        let mut mends: Vec<PlaceMend> = PlaceMend::units().collect();
        if !is_few {
            mends.push(PlaceMend::w_first());
            mends.extend(PlaceMend::axes());
        }
        if !is_few && is_far {
            mends.extend(self.best_tip(presses));
        }
        mends
    }

    /// The one of `tried` that puts the contacts on the scan.
    fn mend(
        &self,
        presses: &Presses,
        reported: &ReportedPlacement,
        tried: Vec<PlaceMend>,
    ) -> Option<InputFinding> {
        let as_it_is = reported.fit.share;
        let mut mends: Vec<(f64, PlaceMend)> = tried
            .into_iter()
            .filter_map(|mend| Some((self.mended(presses, &presses.records, &mend)?, mend)))
            .filter(|(share, _)| *share >= SHARE_ON_SCAN && *share > as_it_is + MENDED_SHARE)
            .collect();
        mends.sort_by(|a, b| b.0.total_cmp(&a.0));
        let (share, best) = mends.first()?;
        let other = mends.iter().find(|(_, mend)| mend.cause != best.cause);
        let mut measured = format!(
            "{}: {:.0} % of the contacts are then on the scan, and {:.0} % as it is",
            best.says,
            100.0 * share,
            100.0 * as_it_is
        );
        let remedy = match best.cause {
            InputCause::LengthUnit => "poses are in m, the scan as --mesh-unit says",
            InputCause::QuaternionOrder => "give the orientation as x, y, z, w",
            InputCause::PositionAxes => {
                "give the positions in the axes of the scan, or scan_to_space"
            }
            _ => "give the place of the ball as tip.offset_mm (touchup calibrate tip)",
        };
        match other.filter(|(other, _)| *other > share - REFUTED_SHARE) {
            Some((share, other)) => {
                measured += &format!("; or {}: {:.0} %", other.says, 100.0 * share);
                Some(InputFinding::new(
                    InputCause::Frame,
                    true,
                    measured,
                    FRAME_REMEDY,
                ))
            }
            None => Some(InputFinding::new(best.cause, true, measured, remedy)),
        }
    }

    /// Share of `records` that the scan explains after a correction; `None` if they would lie too
    /// close together to prove anything, or much wider apart than the scan.
    fn mended(&self, presses: &Presses, records: &[&InputRecord], mend: &PlaceMend) -> Option<f64> {
        let Presses {
            levels,
            scale,
            sunk,
            ..
        } = presses;
        let (placement, unit) = (&self.params.placement, mend.scan_unit);
        let radius = self.params.tip.radius * unit;
        let tolerance = scale.tolerance(0.0, radius, unit) + sunk * unit;
        let centres: Vec<Point3<f64>> = records
            .iter()
            .map(|record| mend.centre(placement, record))
            .collect();
        let extent = extent_of(centres.iter().copied());
        let is_spread =
            SHARES_OF_SCAN.contains(&(extent / scale.extent)) && extent > LEAST_SPREAD * tolerance;
        let rotation = |record: &InputRecord| match self.params.compensator.wrench_frame {
            WrenchFrame::Sensor => mend.rotation(placement, record),
            WrenchFrame::Object => record.rotation,
        };
        let forces: Vec<Vector3<f64>> = records
            .iter()
            .map(|record| rotation(record) * (record.force_t() - levels.rest_t))
            .collect();
        // a mistake in the position axes often repeats in the orientation
        let turned: Vec<Vector3<f64>> = forces.iter().map(|force| mend.turned(force)).collect();
        is_spread.then(|| {
            let fit = BallFit::of(self.scan, self.tree, centres.into_iter(), radius, tolerance);
            let [as_it_is, turned] =
                [forces, turned].map(|forces| fit.explained(&forces, radius, tolerance).on_scan());
            as_it_is.max(turned)
        })
    }

    /// The place of the ball along a stylus axis that puts most presses on the scan; `None` if the
    /// stylus turned too little to tell it from a part that lies elsewhere.
    fn best_tip(&self, presses: &Presses) -> Option<PlaceMend> {
        let records = &presses.records;
        let every = records.len().div_ceil(TIP_JUDGES).max(1);
        let judges: Vec<&InputRecord> = records.iter().step_by(every).copied().collect();
        let step = presses.tolerance;
        let count = (LONGEST_TIP / step) as i64;
        let at = |axis: usize, steps: i64| PlaceMend::tip(Vector3::ith(axis, steps as f64 * step));
        let share = |mend: &PlaceMend| self.mended(presses, &judges, mend).unwrap_or(0.0);
        let (_, steps, mend) = (0..3)
            .flat_map(|axis| (-count..=count).map(move |steps| (steps, at(axis, steps))))
            .map(|(steps, mend)| (share(&mend), steps, mend))
            .max_by(|a, b| a.0.total_cmp(&b.0))?;
        let moved =
            |record: &InputRecord| mend.centre(&self.params.placement, record) - record.centre;
        let moves = judges.iter().map(|record| moved(record).into());
        let is_turned = extent_of(moves) > presses.tolerance;
        // a maximum at the end of the search range is no optimum
        (steps.abs() < count && is_turned).then_some(mend)
    }

    /// The common shift that brings many more contacts onto the scan, and explains more of them
    /// than holes in the scan do; `None` if there is none.
    fn shift(
        &self,
        reported: &ReportedPlacement,
        as_it_is: &ScanAgreement,
    ) -> Option<ContactShift> {
        let ReportedPlacement {
            centres,
            forces,
            tolerance,
            ..
        } = reported;
        if as_it_is.on_scan().max(reported.fit.share) + SHIFT_GAIN > 1.0 {
            return None;
        }
        let best = best_shift(
            self.scan,
            self.tree,
            (centres, forces),
            self.params.tip.radius,
            *tolerance,
        )?;
        let is_one = best.shift.norm() > LEAST_SHIFT * tolerance
            && best.share >= SHIFTED_SHARE
            && best.share >= as_it_is.on_scan() + SHIFT_GAIN
            && best.share > as_it_is.on_scan_or_in_holes();
        is_one.then_some(best)
    }
}
