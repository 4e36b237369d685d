//! Messages between the workers.

use std::collections::BTreeMap;
use std::sync::mpsc::SyncSender;

use nalgebra::Point3;

use crate::ros::mesh_feed::{Edits, VertexUncertainty};
use crate::ros::messages::{
    DetectFeaturesRequest, DetectFeaturesResponse, FlagFeatureResponse, UnflagFeatureResponse,
};
use crate::ros::port::Reply;
use touchup_features::features::Feature;
use touchup_probing::execute::Flag;
use touchup_probing::plan::NextTouch;
use touchup_session::live::TouchDelta;

/// Input of the view.
pub enum ViewInput {
    /// a change of the mesh
    Edits(Box<Edits>),
    /// version of the mesh with this uncertainty of its vertices
    Uncertainty(u64, VertexUncertainty),
    /// name of a new session
    Session(String),
    /// a touched face and its signed distance, m; only with tiles coloured by mismatch
    Mismatch(u32, f64),
    /// position of the tip
    Tip(LastTip),
    /// a request for the whole state on the topic
    Resync,
}

/// Last position of the tip.
#[derive(Clone, Copy, Debug)]
pub struct LastTip {
    /// stamp of the sample, ns
    pub stamp_ns: i64,
    /// centre of the ball, m, in O
    pub centre: Point3<f64>,
    /// radius of the ball, m
    pub radius: f64,
    /// the closest point of the mesh, and its distance from the ball's surface, m; `None` beyond
    /// the reach
    pub closest: Option<(Point3<f64>, f64)>,
}

/// Input of the feature worker.
pub enum FeatureInput {
    /// new or removed touches
    Probed(TouchDelta),
    /// a new session
    Session(String),
    /// a flag without a number yet
    Flag(Flag, Option<Reply<FlagFeatureResponse>>),
    /// removal of a flag
    Unflag(u32, Reply<UnflagFeatureResponse>),
    /// request for features to probe; no numbers: all flagged ones
    Targets(Vec<u32>, SyncSender<Vec<Flag>>),
    /// a measurement of an arm
    Measured(Box<ArmMeasurement>),
    /// request for a detection on the current mesh
    Detect(DetectFeaturesRequest, Reply<DetectFeaturesResponse>),
}

/// A feature measured by an arm.
#[derive(Clone, Debug)]
pub struct ArmMeasurement {
    /// session of the flag
    pub session: String,
    /// number of the flag
    pub id: u32,
    /// measured feature
    pub feature: Feature,
    /// the requested accuracy is reached
    pub is_done: bool,
}

/// Next touches by hand, by the number of the feature.
pub type NextTouches = BTreeMap<u32, NextTouch>;
