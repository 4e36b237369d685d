//! Output of the sample thread to the others: each mismatch, the position of the tip, mesh changes,
//! touches.

use std::sync::mpsc::TrySendError;
use std::time::Duration;

use nalgebra::{Point3, Vector3};

use super::channels::{FeatureInput, LastTip, ViewInput};
use super::refinement::RefinementWorker;
use super::viewing::tiles::ColourBy;
use super::viewing::view::colour_by;
use crate::ros::convert::{header, point, vector};
use crate::ros::mesh_feed::Edits;
use crate::ros::messages::HapticMismatch;
use crate::ros::port::Publication;
use touchup_method::haptic::{Case, Mismatch, Update};

/// Period of the distance query at the tip.
const TIP_EVERY: Duration = Duration::from_millis(25);
/// Maximum distance of that query, m.
const TIP_REACH: f64 = 0.02;
/// Time without samples after which a mesh inside an unfinished change is shown.
const TORN_AFTER: Duration = Duration::from_millis(200);

impl RefinementWorker {
    pub(super) fn send_probed(&mut self) {
        if self.session.probed.is_empty() {
            return;
        }
        if let Err(
            TrySendError::Full(FeatureInput::Probed(changes))
            | TrySendError::Disconnected(FeatureInput::Probed(changes)),
        ) = self.features.try_send(FeatureInput::Probed(std::mem::take(
            &mut self.session.probed,
        ))) {
            self.session.probed = changes;
        }
    }

    pub(super) fn publish_mismatch(&mut self, update: &Update) {
        let Some(tip) = self
            .session
            .engine
            .refiner()
            .contacts()
            .latest()
            .map(|contact| contact.tip)
        else {
            return;
        };
        let rate_hz = self.mismatch_rate_hz;
        let is_due = rate_hz <= 0.0
            || tip.stamp_ns.saturating_sub(self.mismatch_ns) as f64 * 1e-9 >= 1.0 / rate_hz;
        if !is_due {
            return;
        }
        self.mismatch_ns = tip.stamp_ns;
        let centre = tip.pose_ot.translation.vector.into();
        let found = update.mismatch.as_ref();
        // without a near face nothing is expected, and the measured force is the mismatch
        let actual_force = found.map_or(tip.force_o, |found| found.expected_force_o + found.linear);
        let of = |part: fn(&Mismatch) -> Vector3<f64>| found.map_or_else(Vector3::zeros, part);
        let message = HapticMismatch {
            header: header(tip.stamp_ns, &self.setup.shared.frame),
            contact_case: number_of(update.case),
            face: found
                .and_then(|found| self.session.engine.shown_face(found.face))
                .map_or(HapticMismatch::NO_FACE, |face| face.0),
            mesh_version: self.session.version,
            tip: point(&centre),
            actual_force: vector(&actual_force),
            expected_force: vector(&of(|found| found.expected_force_o)),
            linear: vector(&found.map_or(actual_force, |found| found.linear)),
            rotational: vector(&of(|found| found.rotational)),
            signed_distance: found.map_or(f64::NAN, |found| found.distance),
        };
        let shared = &self.setup.shared;
        if found.is_some() && colour_by(shared) == ColourBy::Mismatch {
            let coloured = ViewInput::Mismatch(message.face, message.signed_distance);
            shared.offer(&self.view, coloured);
        }
        // the answer waits for no other thread of the node
        self.port.publish(Publication::Mismatch(message));
        let now = self.setup.clock.now();
        if now.saturating_duration_since(self.tip_published) >= TIP_EVERY {
            self.tip_published = now;
            self.publish_tip(tip.stamp_ns, centre);
        }
    }

    fn publish_tip(&self, stamp_ns: i64, centre: Point3<f64>) {
        let refiner = self.session.engine.refiner();
        let radius = self.setup.input.scene.tip_params().radius;
        let closest = refiner.closest_face(&centre, TIP_REACH).map(|hit| {
            let off: Vector3<f64> = centre - hit.point;
            let side = if off.dot(&refiner.mesh().normal(hit.face)) < 0.0 {
                -1.0
            } else {
                1.0
            };
            (hit.point, side * off.norm() - radius)
        });
        let tip = LastTip {
            stamp_ns,
            centre,
            radius,
            closest,
        };
        self.setup.shared.offer(&self.view, ViewInput::Tip(tip));
    }

    /// Sends mesh changes, as far as the view has taken earlier ones.
    pub(super) fn send_edits(&mut self) {
        let is_idle = self.setup.clock.since(self.sampled) >= TORN_AFTER;
        while let Some(edits) = self.next_edits(is_idle) {
            let complete = edits.is_complete.then_some(edits.version);
            if let Err(TrySendError::Full(ViewInput::Edits(back))) =
                self.view.try_send(ViewInput::Edits(edits))
            {
                self.edits = Some(back);
                return;
            }
            complete
                .into_iter()
                .for_each(|version| self.setup.shared.mesh.announce(version));
        }
    }

    /// The changes refused by a full view, or the next ones, if a free list is here and there are
    /// changes.
    fn next_edits(&mut self, is_idle: bool) -> Option<Box<Edits>> {
        if let Some(refused) = self.edits.take_if(|edits| edits.is_filled()) {
            return Some(refused);
        }
        if self.session.is_sent() {
            return None;
        }
        let edits_now = self.session.engine.edits();
        let mut edits = self.edits.take().or_else(|| self.spare.try_recv().ok())?;
        let stamp_ns = self.session.last_ns.unwrap_or(0);
        let (scan, version) = (&self.setup.input.scan.0, self.session.version);
        if let Err(error) = edits.fill(&mut self.session.engine, scan, version, stamp_ns, is_idle) {
            self.fail(&error);
            return None;
        }
        if !edits.is_filled() {
            self.edits = Some(edits);
            return None;
        }
        if edits.is_complete {
            (self.session.sent_version, self.session.sent_edits) =
                (self.session.version, edits_now);
        }
        Some(edits)
    }
}

fn number_of(case: Case) -> u8 {
    match case {
        Case::Free => HapticMismatch::FREE,
        Case::MeshOnly => HapticMismatch::MESH_ONLY,
        Case::SurfaceOnly => HapticMismatch::SURFACE_ONLY,
        Case::Both => HapticMismatch::BOTH,
    }
}
