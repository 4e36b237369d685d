//! Calls of the node.

use std::sync::Arc;
use std::sync::mpsc::TrySendError;
use std::time::Duration;

use nalgebra::Point3;
use tracing::warn;

use super::channels::{FeatureInput, ViewInput};
use super::error::NodeError;
use super::feature_messages::kind_of;
use super::refinement::RefinementWorker;
use super::session::write_result;
use super::take_out::BUSY;
use crate::ros::convert::{header, point_of, stamp_ns, trigger};
use crate::ros::messages::{
    DetectFeaturesResponse, FlagFeatureRequest, FlagFeatureResponse, PointStamped, ProbeResult,
    ResyncMeshResponse, SaveMeshRequest, SaveMeshResponse, UndoRequest, UndoResponse,
    UnflagFeatureResponse,
};
use crate::ros::parameters::ParameterValue;
use crate::ros::port::{Call, Endpoint, Reply};
use crate::ros::stop::NO_ARM;
use touchup_features::features::FeatureKind;
use touchup_io::session_folder::SessionFolder;
use touchup_probing::execute::Flag;
use touchup_session::live::EngineResult;
use touchup_session::session::ResultFiles;
use touchup_session::session::{StrokeChange, UndoStep};

/// Maximum radius of a flag, m.
const LARGEST_RADIUS: f64 = 1.0;
/// Maximum number of strokes undone by one call.
const MOST_STROKES: u32 = 1000;
/// Maximum wait for the complete mesh and patch of a file.
const COPY_WAIT: Duration = Duration::from_secs(30);
/// Maximum number of concurrent saves: each has a copy of all touches.
const MOST_SAVING: usize = 4;

impl RefinementWorker {
    pub(super) fn call(&mut self, call: Call) {
        if self.session.keeping.is_replayed() {
            return Self::refuse_in_replay(call);
        }
        match call {
            Call::Flag(request, reply) => match self.flag_of(&request) {
                Ok(flag) => self.ask_features(FeatureInput::Flag(flag, Some(reply))),
                Err(message) => reply.send(FlagFeatureResponse {
                    success: false,
                    message,
                    id: 0,
                }),
            },
            Call::Unflag(request, reply) => {
                self.ask_features(FeatureInput::Unflag(request.id, reply))
            }
            Call::Detect(request, reply) => self.ask_features(FeatureInput::Detect(request, reply)),
            Call::Save(request, reply) => self.save(&request, reply),
            Call::Resync(_, reply) => self.resync(reply),
            Call::Undo(request, reply) => reply.send(self.change_strokes(&request, true)),
            Call::Redo(request, reply) => reply.send(self.change_strokes(&request, false)),
            Call::TakeOut(request, reply) => self.take_out_touch(&request, reply),
            Call::Reset(reply) => {
                let begun = self
                    .begin_again()
                    .map(|name| format!("begun again: session {name}"));
                reply.send(trigger(begun.map_err(|error| error.to_string())));
            }
            Call::Arm(order) => {
                let header = header(self.port.now_ns(), &self.setup.shared.frame);
                match &self.arm {
                    Some(arm) => arm.order(order, self.session.folder.path(), header),
                    None => order.refuse(header, ProbeResult::NO_ARM, NO_ARM),
                }
            }
            Call::ArmState(reply) => reply.send(match &self.arm {
                Some(arm) => arm.state(),
                None => trigger(Err(NO_ARM.to_owned())),
            }),
        }
    }

    fn ask_features(&self, input: FeatureInput) {
        let Err(TrySendError::Full(input) | TrySendError::Disconnected(input)) =
            self.features.try_send(input)
        else {
            return;
        };
        let message =
            "the thread of the features is behind: nothing was done; call again".to_owned();
        match input {
            FeatureInput::Flag(_, Some(reply)) => reply.send(FlagFeatureResponse {
                message,
                ..Default::default()
            }),
            FeatureInput::Unflag(_, reply) => reply.send(UnflagFeatureResponse {
                message,
                ..Default::default()
            }),
            FeatureInput::Detect(_, reply) => reply.send(DetectFeaturesResponse {
                message,
                ..Default::default()
            }),
            _ => warn!("{message}"),
        }
    }

    fn flag_of(&self, request: &FlagFeatureRequest) -> Result<Flag, String> {
        let radius = self.search_radius(request.search_radius)?;
        let place = self.point_in_object(&request.point)?;
        Ok(Flag {
            id: 0,
            kind: kind_of(request.kind)?,
            place,
            radius,
        })
    }

    /// Search radius around a position, m.
    ///
    /// - `given`: of a request; 0: the parameter.
    pub(super) fn search_radius(&self, given: f64) -> Result<f64, String> {
        let radius = if given == 0.0 {
            self.flag_radius()
        } else {
            given
        };
        let is_usable = radius > 0.0 && radius <= LARGEST_RADIUS;
        is_usable.then_some(radius).ok_or_else(|| {
            format!("search_radius is {radius} m: it may be up to {LARGEST_RADIUS} m, or 0 for flag_radius_mm")
        })
    }

    fn flag_radius(&self) -> f64 {
        self.setup.shared.parameters().double("flag_radius_mm") / 1e3
    }

    pub(super) fn point_in_object(&self, clicked: &PointStamped) -> Result<Point3<f64>, String> {
        let stamp_ns =
            match stamp_ns(&clicked.header.stamp).ok_or("the stamp of the point is no time")? {
                0 => self.session.last_ns.unwrap_or_else(|| self.port.now_ns()),
                stamp_ns => stamp_ns,
            };
        let frame = self
            .resolver
            .object_from(&clicked.header.frame_id, stamp_ns)
            .map_err(|why| why.to_string())?;
        let point = frame * point_of(&clicked.point);
        let is_sound = point
            .coords
            .iter()
            .all(|x| x.abs() <= touchup_method::stylus::LARGEST_POSITION);
        is_sound
            .then_some(point)
            .ok_or_else(|| "the point is not finite, or absurdly far".to_owned())
    }

    /// Flags a point from RViz's Publish Point.
    pub(super) fn flag_clicked(&mut self, clicked: &PointStamped) {
        let parameters = self.setup.shared.parameters();
        let kind = FeatureKind::of_name(parameters.string("flag_kind"));
        match self.point_in_object(clicked) {
            Ok(place) => {
                self.ask_features(FeatureInput::Flag(
                    Flag {
                        id: 0,
                        kind,
                        place,
                        radius: self.flag_radius(),
                    },
                    None,
                ));
            }
            Err(why) => {
                warn!(why, "a clicked point was not taken");
                self.session.counters.refuse("clicked_point");
            }
        }
    }

    fn resync(&mut self, reply: Reply<ResyncMeshResponse>) {
        let sent = self.view.try_send(ViewInput::Resync).is_ok();
        let message = if sent {
            "it comes on mesh_patch"
        } else {
            "the view is behind: ask again"
        };
        reply.send(ResyncMeshResponse {
            success: sent,
            message: message.to_owned(),
            session: self.session.name.clone(),
            version: self.session.version,
        });
    }

    fn change_strokes(&mut self, request: &UndoRequest, is_undo: bool) -> UndoResponse {
        if self.is_taking_out() {
            return UndoResponse {
                message: BUSY.to_owned(),
                ..Default::default()
            };
        }
        let wanted = request.strokes.clamp(1, MOST_STROKES);
        let (mut strokes, mut why) = (0, None);
        while strokes < wanted {
            let engine = &mut self.session.engine;
            let changed = if is_undo {
                engine.undo()
            } else {
                engine.redo()
            };
            match changed {
                Ok(true) => strokes += 1,
                Ok(false) => break,
                Err(error) => {
                    (why, self.fault) = (Some(error.to_string()), Some(error.to_string()));
                    break;
                }
            }
            let after_ns = self.session.last_ns.unwrap_or(i64::MIN);
            let exchange = UndoStep {
                after_ns,
                stroke_ns: self.session.engine.changed_stroke_ns(),
            };
            self.note_stroke(if is_undo {
                StrokeChange::Undo(exchange)
            } else {
                StrokeChange::Redo(exchange)
            });
        }
        self.session.version += u64::from(strokes > 0);
        let verb = if is_undo { "took back" } else { "did again" };
        let message = match (strokes, why) {
            (_, Some(why)) => why,
            (0, None) => format!(
                "there is no stroke to be {}",
                if is_undo { "taken back" } else { "done again" }
            ),
            (1, None) => format!("{verb} 1 stroke"),
            (count, None) => format!("{verb} {count} strokes"),
        };
        UndoResponse {
            success: strokes > 0,
            message,
            strokes,
            mesh_version: self.session.version,
        }
    }

    /// Begins the next session; a side thread ends the previous one.
    pub(super) fn begin_again(&mut self) -> Result<String, NodeError> {
        let next = self.session.next(&self.setup)?;
        if !next.keeping.is_replayed() {
            self.finish_samples();
        }
        let report = self.report();
        let name = next.name.clone();
        let before = self.change_session(next);
        let setup = Arc::clone(&self.setup);
        let end = move || {
            if let Err(error) = before.end(&setup, report) {
                warn!(%error, "the session before was not written whole");
            }
        };
        self.side_work.begin("ending", end)?;
        self.fault = None;
        // both receivers take these despite any backlog
        let _ = self.view.send(ViewInput::Session(name.clone()));
        self.setup.shared.mesh.announce_session();
        let _ = self.features.send(FeatureInput::Session(name.clone()));
        Ok(name)
    }

    /// Takes the samples held back for later messages.
    pub(super) fn finish_samples(&mut self) {
        self.session.sync.finish();
        while let Some(sample) = self.session.sync.next_sample() {
            self.sample(&sample, None);
        }
    }

    fn save(&mut self, request: &SaveMeshRequest, reply: Reply<SaveMeshResponse>) {
        let refused = |message| SaveMeshResponse {
            message,
            ..Default::default()
        };
        match self.saving(request) {
            Ok(saved) => {
                let work = move || reply.send(saved().unwrap_or_else(refused));
                if let Err(error) = self.side_work.begin("save", work) {
                    warn!(%error, "no thread to save on: the caller gets no answer");
                }
            }
            Err(message) => reply.send(refused(message)),
        }
    }

    /// Returns a function that writes the result of `touchup refine` for the samples up to now.
    fn saving(
        &mut self,
        request: &SaveMeshRequest,
    ) -> Result<impl FnOnce() -> Result<SaveMeshResponse, String> + Send + use<>, String> {
        if self.side_work.count() >= MOST_SAVING {
            return Err(format!(
                "{MOST_SAVING} meshes are being saved: save again when they are done"
            ));
        }
        let files = files_of(&self.session.folder, request)?;
        let patcher = self
            .session
            .engine
            .copy_patcher()
            .map_err(|error| error.to_string())?;
        self.send_edits();
        let snapshot = self.setup.shared.mesh.complete();
        // while the mesh moves no version equals the written file
        let (engine, setup) = (&self.session.engine, Arc::clone(&self.setup));
        let mesh_version = if engine.is_settled() {
            self.session.version
        } else {
            0
        };
        Ok(move || {
            let late = |_| "mesh and touches were not complete in time: save again".to_owned();
            let patcher = patcher.map(|patcher| setup.clock.recv_timeout(&patcher, COPY_WAIT));
            let result = match patcher.transpose().map_err(late)? {
                Some(patcher) => EngineResult::Touched(patcher.into()),
                None => {
                    let snapshot = setup.clock.recv_timeout(&snapshot, COPY_WAIT);
                    let mesh = snapshot.map_err(late)?.mesh();
                    EngineResult::Moved(mesh.map_err(|why| why.to_string())?.into())
                }
            };
            let written = write_result(&setup, result, &files);
            let (outcome, step) = written.map_err(|why| why.to_string())?;
            let [vertices, faces] = outcome.counts;
            let path = files.mesh.display().to_string();
            let (success, faces_in_words) = match step {
                None => (true, String::new()),
                Some(Ok(step)) => (true, format!(", and a STEP file: {step}")),
                Some(Err(why)) => (false, format!(", and no STEP file: {why}")),
            };
            Ok(SaveMeshResponse {
                success,
                message: format!("wrote {path}{faces_in_words}"),
                path,
                mesh_version,
                vertex_count: vertices as u32,
                face_count: faces as u32,
            })
        })
    }

    pub(super) fn set_parameter(
        &mut self,
        name: &str,
        value: &ParameterValue,
    ) -> Result<(), String> {
        let mut parameters = (*self.setup.shared.parameters()).clone();
        parameters
            .set_live(name, value)
            .map_err(|why| why.to_string())?;
        self.mismatch_rate_hz = parameters.double("mismatch_rate_hz");
        self.setup.shared.set_parameters(parameters);
        Ok(())
    }

    pub(super) fn note_endpoint(&mut self, endpoint: Endpoint) {
        if let Some(why) = &endpoint.mismatch {
            warn!(
                topic = endpoint.topic,
                why, "somebody on this topic cannot be heard"
            );
        }
        self.endpoints.insert(endpoint.topic.clone(), endpoint);
    }
}

/// The files of one call of `~/save_mesh`.
fn files_of(folder: &SessionFolder, request: &SaveMeshRequest) -> Result<ResultFiles, String> {
    let name = if request.name.is_empty() {
        ResultFiles::MESH
    } else {
        &request.name
    };
    let place = |name: &str| {
        folder
            .place(name, request.overwrite)
            .map_err(|why| why.to_string())
    };
    let mesh = place(name)?;
    touchup_io::mesh_file::check_target(&mesh).map_err(|why| why.to_string())?;
    let stem = mesh
        .file_stem()
        .map(|stem| stem.to_string_lossy().into_owned())
        .unwrap_or_default();
    let beside = |ending: &str| {
        request
            .with_features
            .then(|| place(&format!("{stem}.{ending}")))
            .transpose()
    };
    Ok(ResultFiles {
        features: beside(ResultFiles::FEATURES)?,
        touches: beside(ResultFiles::TOUCHES)?,
        step: request
            .with_step
            .then(|| place(&format!("{stem}.step")))
            .transpose()?,
        mesh,
    })
}
