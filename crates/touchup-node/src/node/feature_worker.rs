//! The feature thread: features detected on the mesh, measured by touches, or flagged.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use nalgebra::Vector3;

use super::channels::{ArmMeasurement, FeatureInput, NextTouches};
use super::feature_messages::{flagged, found, markers, related};
use super::shared::SharedNodeState;
use crate::ros::convert::header;
use crate::ros::messages::{
    DetectFeaturesRequest, DetectFeaturesResponse, Feature as FeatureMsg, FeatureArray,
    FlagFeatureResponse, UnflagFeatureResponse,
};
use crate::ros::parameters::KIND_NAMES;
use crate::ros::port::{Port, Publication};
use touchup_features::features::{Feature, FeatureKind, Tracker, relations};
use touchup_geometry::mesh::MeshError;
use touchup_method::stylus::ProbedPoint;
use touchup_probing::execute::Flag;
use touchup_probing::plan::{NextTouch, advise_next_touch};
use touchup_session::clock::Clock;

/// Time without a mesh change before the next detection.
const QUIET: Duration = Duration::from_secs(1);
/// Period of detections on a constantly changing mesh, in durations of the last detection.
const LOOKS_APART: u32 = 10;
/// Maximum number of flags.
const MOST_FLAGS: usize = 1000;
/// Maximum number of feature numbers in one answer, so that it fits into one packet.
const MOST_NAMED: usize = 128;
/// Maximum duration of a mesh change until the mesh is complete.
const SNAPSHOT_WAIT: Duration = Duration::from_secs(10);

/// State of the feature thread.
pub struct FeatureWorker {
    clock: Clock,
    port: Arc<dyn Port>,
    shared: Arc<SharedNodeState>,
    session: String,
    tracker: Tracker,
    touches: Vec<ProbedPoint>,
    /// by number; flags without a detected feature
    flags: BTreeMap<u32, Flag>,
    /// requested search radius around a detected feature, m, by its number
    radii: BTreeMap<u32, f64>,
    /// public number of a feature if it is the number of its flag
    names: BTreeMap<u32, u32>,
    /// measurements of an arm, by the number of the flag
    measured: BTreeMap<u32, ArmMeasurement>,
    /// version of the mesh and its newest stamp at the last detection
    looked: Option<(u64, i64)>,
    look_took: Duration,
    looked_at: Instant,
    changed_at: Instant,
    seen_version: u64,
    has_changes: bool,
    published_at: Option<Instant>,
}

impl FeatureWorker {
    /// Before the first input.
    pub fn new(
        clock: Clock,
        port: Arc<dyn Port>,
        shared: Arc<SharedNodeState>,
        session: String,
    ) -> Self {
        let now = clock.now();
        Self {
            clock,
            port,
            shared,
            session,
            tracker: Tracker::default(),
            touches: Vec::new(),
            flags: BTreeMap::new(),
            radii: BTreeMap::new(),
            names: BTreeMap::new(),
            measured: BTreeMap::new(),
            looked: None,
            look_took: Duration::ZERO,
            looked_at: now,
            changed_at: now,
            seen_version: 0,
            has_changes: true,
            published_at: None,
        }
    }

    /// Runs until all senders are gone.
    pub fn run(mut self, inputs: &Receiver<FeatureInput>) {
        loop {
            let period =
                Duration::from_secs_f64(1.0 / self.shared.parameters().double("features_rate_hz"));
            match self.clock.recv_timeout(inputs, period) {
                Ok(input) => {
                    self.take(input);
                    // simultaneous inputs belong to the next detection too
                    inputs
                        .try_iter()
                        .take(1000)
                        .for_each(|input| self.take(input));
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
            if self.is_due() {
                // an unavailable mesh is requested again
                let _ = self.look();
            }
            if self.has_changes
                && self
                    .published_at
                    .is_none_or(|at| self.clock.since(at) >= period)
            {
                (self.has_changes, self.published_at) = (false, Some(self.clock.now()));
                self.publish();
            }
        }
    }

    fn take(&mut self, input: FeatureInput) {
        match input {
            FeatureInput::Probed(changes) => {
                changes.apply_to(&mut self.touches);
                self.has_changes |= !self.tracker.update(&self.touches).is_empty();
            }
            FeatureInput::Session(session) => {
                *self = Self::new(
                    self.clock.clone(),
                    Arc::clone(&self.port),
                    Arc::clone(&self.shared),
                    session,
                );
            }
            FeatureInput::Flag(flag, reply) => {
                let answer = self.flag(flag);
                reply
                    .into_iter()
                    .for_each(|reply| reply.send(answer.clone()));
            }
            FeatureInput::Unflag(id, reply) => {
                reply.send(self.unflag(id));
            }
            FeatureInput::Targets(ids, reply) => {
                // the receiver may be gone
                let _ = reply.try_send(self.targets(&ids));
            }
            FeatureInput::Measured(measured) => {
                // a measurement belongs to its session only
                if measured.session == self.session {
                    self.measured.insert(measured.id, *measured);
                    self.has_changes = true;
                }
            }
            FeatureInput::Detect(request, reply) => {
                let looked = self.look();
                // published before the answer names its version
                (self.has_changes, self.published_at) = (false, Some(Instant::now()));
                self.publish();
                reply.send(self.answer(&request, looked));
            }
        }
    }

    /// Whether the mesh has changed since the last detection, and a detection is due.
    fn is_due(&mut self) -> bool {
        let version = self.shared.mesh.shape_version();
        if std::mem::replace(&mut self.seen_version, version) != version {
            self.changed_at = self.clock.now();
        }
        match self.looked {
            None => true,
            Some((looked, _)) if looked >= version => false,
            Some(_) => {
                let since_look = self.clock.since(self.looked_at);
                let is_quiet = self.clock.since(self.changed_at) >= QUIET;
                (is_quiet && since_look >= QUIET)
                    || since_look >= QUIET.max(self.look_took) * LOOKS_APART
            }
        }
    }

    fn look(&mut self) -> Result<(), String> {
        let started = self.clock.now();
        let snapshot = self
            .clock
            .recv_timeout(&self.shared.mesh.complete(), SNAPSHOT_WAIT)
            .ok();
        let snapshot = snapshot.filter(|snapshot| snapshot.session == self.session);
        let snapshot =
            snapshot.ok_or("the mesh was not complete in time: is it changing all the time?")?;
        let mesh = snapshot
            .mesh()
            .map_err(|error: MeshError| error.to_string())?;
        self.looked = Some((snapshot.version, snapshot.stamp_ns));
        // the next version need not be a copy
        drop(snapshot);
        self.tracker.renew(&mesh, &self.touches);
        self.name_found_flags();
        let now = self.clock.now();
        (self.look_took, self.looked_at, self.has_changes) =
            (now.saturating_duration_since(started), now, true);
        Ok(())
    }

    /// The public number of a feature.
    fn name_of(&self, feature: &Feature) -> u32 {
        self.name_of_id(feature.id)
    }

    /// The public number of a feature with this number of the detector.
    fn name_of_id(&self, id: u32) -> u32 {
        self.names.get(&id).copied().unwrap_or(id)
    }

    /// The nearest feature of the flagged kind at a flag. A region to explore stays one: a plane in
    /// it is no answer.
    fn nearest(&self, flag: &Flag, may_be: impl Fn(&Feature) -> bool) -> Option<&Feature> {
        let far = |feature: &&Feature| (feature.centre.value - flag.place).norm();
        let is_meant = |feature: &&Feature| {
            flag.kind == Some(feature.kind) && far(feature) <= flag.radius && may_be(feature)
        };
        self.tracker
            .features()
            .iter()
            .filter(is_meant)
            .min_by(|a, b| far(a).total_cmp(&far(b)))
    }

    /// Gives new features at a flag the number of that flag.
    fn name_found_flags(&mut self) {
        for (id, flag) in std::mem::take(&mut self.flags) {
            let is_new = |feature: &Feature| !self.names.contains_key(&feature.id);
            match self.nearest(&flag, is_new).map(|feature| feature.id) {
                Some(found) => {
                    self.names.insert(found, id);
                    self.radii.insert(id, flag.radius);
                }
                None => drop(self.flags.insert(id, flag)),
            }
        }
    }

    fn flag(&mut self, flag: Flag) -> FlagFeatureResponse {
        let kind = flag.kind.map_or("unknown", FeatureKind::name);
        if self.flags.len() >= MOST_FLAGS {
            let message = format!("{MOST_FLAGS} places are flagged already: take some back");
            return FlagFeatureResponse {
                success: false,
                message,
                id: 0,
            };
        }
        self.has_changes = true;
        if let Some(id) = self
            .nearest(&flag, |_| true)
            .map(|feature| self.name_of(feature))
        {
            self.radii.insert(id, flag.radius);
            return FlagFeatureResponse {
                success: true,
                message: format!("flagged {kind} {id}, known before"),
                id,
            };
        }
        let same = |other: &Flag| {
            other.kind == flag.kind && (other.place - flag.place).norm() <= flag.radius
        };
        let again = self
            .flags
            .iter()
            .find(|(_, other)| same(other))
            .map(|(id, _)| *id);
        let id = again.unwrap_or_else(|| self.tracker.fresh_id());
        self.flags.insert(id, Flag { id, ..flag });
        FlagFeatureResponse {
            success: true,
            message: format!("flagged a place for a {kind}: number {id}"),
            id,
        }
    }

    fn unflag(&mut self, id: u32) -> UnflagFeatureResponse {
        let (was_place, was_found) = (
            self.flags.remove(&id).is_some(),
            self.radii.remove(&id).is_some(),
        );
        let message = match (was_place, was_found) {
            (true, _) => format!("took flag {id} back"),
            (_, true) => format!("took the flag of {id} back; the feature stays"),
            _ => format!("nothing with the number {id} is flagged"),
        };
        self.has_changes |= was_place || was_found;
        UnflagFeatureResponse {
            success: was_place || was_found,
            message,
        }
    }

    /// The flagged features, or those with the given numbers.
    fn targets(&self, ids: &[u32]) -> Vec<Flag> {
        let default = self.shared.parameters().double("flag_radius_mm") / 1e3;
        let found = self.tracker.features().iter().map(|feature| {
            let id = self.name_of(feature);
            let (kind, place, radius) = (
                Some(feature.kind),
                feature.centre.value,
                self.radii.get(&id).copied(),
            );
            (
                radius.is_some(),
                Flag {
                    id,
                    kind,
                    place,
                    radius: radius.unwrap_or(default),
                },
            )
        });
        let is_wanted = |target: &Flag, is_flagged: bool| match ids.is_empty() {
            true => {
                is_flagged
                    && !self
                        .measured
                        .get(&target.id)
                        .is_some_and(|measured| measured.is_done)
            }
            false => ids.contains(&target.id),
        };
        let all = self.flags.values().map(|flag| (true, *flag)).chain(found);
        let mut targets: Vec<_> = all
            .filter(|(flagged, target)| is_wanted(target, *flagged))
            .map(|(_, t)| t)
            .collect();
        targets.sort_by_key(|target| ids.iter().position(|id| *id == target.id));
        targets
    }

    fn answer(
        &self,
        request: &DetectFeaturesRequest,
        looked: Result<(), String>,
    ) -> DetectFeaturesResponse {
        let FeatureArray {
            mut features,
            mesh_version,
            ..
        } = self.features();
        if let Err(message) = looked {
            return DetectFeaturesResponse {
                message,
                mesh_version,
                ..Default::default()
            };
        }
        features
            .retain(|feature| request.kinds.is_empty() || request.kinds.contains(&feature.kind));
        let counts = KIND_NAMES.iter().zip(0u8..).filter_map(|(name, kind)| {
            let is_such =
                |f: &&FeatureMsg| f.kind == kind && f.status != FeatureMsg::STATUS_FLAGGED;
            let count = features.iter().filter(is_such).count();
            (count > 0).then(|| format!("{count} {name}{}", if count == 1 { "" } else { "s" }))
        });
        let counts: Vec<_> = counts.collect();
        let message = if counts.is_empty() {
            "nothing found".to_owned()
        } else {
            counts.join(", ")
        };
        DetectFeaturesResponse {
            success: true,
            message,
            mesh_version,
            count: features.len() as u32,
            ids: features
                .iter()
                .map(|feature| feature.id)
                .take(MOST_NAMED)
                .collect(),
        }
    }

    fn features(&self) -> FeatureArray {
        let (version, stamp_ns) = self.looked.unwrap_or((1, 0));
        let stamp_ns = self
            .touches
            .last()
            .map_or(stamp_ns, |last| last.stamp_ns.max(stamp_ns));
        let known = self.tracker.features().iter().map(|feature| {
            let id = self.name_of(feature);
            found(feature, id, self.radii.get(&id).copied())
        });
        let measured = |id: u32| {
            let feature = &self.measured.get(&id)?.feature;
            let radius = self
                .radii
                .get(&id)
                .copied()
                .or_else(|| self.flags.get(&id).map(|flag| flag.radius));
            Some(FeatureMsg {
                status: FeatureMsg::STATUS_PROBED,
                ..found(feature, id, radius)
            })
        };
        // an arm's measurement is better than the mesh
        let mut features: Vec<_> = known
            .chain(self.flags.values().map(flagged))
            .map(|one| measured(one.id).unwrap_or(one))
            .collect();
        // measured features without a flag too
        let is_listed = |id: &&u32| features.iter().any(|one| one.id == **id);
        let others: Vec<_> = self
            .measured
            .keys()
            .filter(|id| !is_listed(id))
            .filter_map(|&id| measured(id))
            .collect();
        features.extend(others);
        features.sort_by_key(|feature| feature.id);
        let related = |relation| related(relation, |id| self.name_of_id(id));
        let relations = relations(self.tracker.features())
            .iter()
            .map(related)
            .collect();
        FeatureArray {
            header: header(stamp_ns, &self.shared.frame),
            session: self.session.clone(),
            mesh_version: version,
            features,
            relations,
            unexplained: self.tracker.unexplained().unwrap_or(f64::NAN),
        }
    }

    fn publish(&self) {
        let features = self.features();
        self.port.publish(Publication::Features(features.clone()));
        self.port
            .publish(Publication::FeatureMarkers(markers(&features)));
        self.shared.set_features(features, self.next_touches());
    }

    /// The next touch by hand for each feature; for a flag its position.
    fn next_touches(&self) -> NextTouches {
        let found = self.tracker.features().iter().filter_map(|feature| {
            let next = advise_next_touch(feature, &self.touches)?;
            Some((self.name_of(feature), next))
        });
        let flagged = self.flags.values().map(|flag| {
            (
                flag.id,
                NextTouch {
                    place: flag.place,
                    normal: Vector3::zeros(),
                },
            )
        });
        // a feature measured well enough by an arm needs no hand
        let is_open = |id: &u32| {
            !self
                .measured
                .get(id)
                .is_some_and(|measured| measured.is_done)
        };
        flagged.chain(found).filter(|(id, _)| is_open(id)).collect()
    }
}
