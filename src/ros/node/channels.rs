//! What the workers send each other.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::mpsc::SyncSender;

use nalgebra::Point3;

use super::replica::{Edits, MeshVersion};
use super::variances::Variances;
use crate::features::Feature;
use crate::live::TouchDelta;
use crate::probing::execute::Flag;
use crate::probing::plan::NextTouch;
use crate::ros::messages::{
    DetectFeaturesRequest, DetectFeaturesResponse, DiagnosticArray, FeatureArray,
    FlagFeatureResponse, UnflagFeatureResponse,
};
use crate::ros::port::Reply;

/// What goes to the view.
pub enum ViewInput {
    /// the mesh changed
    Edits(Box<Edits>),
    /// how well vertices are known is known
    Variances(Variances),
    /// a new session
    Session(Box<MeshVersion>),
    /// a face was touched so far from where the mesh had it, m; if tiles are coloured by that
    Mismatch(u32, f64),
    /// where the tip is
    Tip(LastTip),
    /// all features, and where a hand should touch them next
    Features(Arc<FeatureArray>, NextTouches),
    /// somebody wants the whole state on the topic
    Resync,
    /// once a second
    Diagnostics(Box<DiagnosticArray>),
    /// a parameter was set
    Parameters,
}

/// Where the tip was last.
#[derive(Clone, Copy, Debug)]
pub struct LastTip {
    /// of the sample, ns
    pub stamp_ns: i64,
    /// centre of the ball, m, in O
    pub centre: Point3<f64>,
    /// radius of the ball, m
    pub radius: f64,
    /// the closest point of the mesh, and how far the ball's surface is from it, m; `None` beyond
    /// the reach
    pub closest: Option<(Point3<f64>, f64)>,
}

/// What goes to the feature worker.
pub enum FeatureInput {
    /// touches came or went
    Probed(TouchDelta),
    /// a new session
    Session(String),
    /// somebody points at a place, which has no number yet
    Flag(Flag, Option<Reply<FlagFeatureResponse>>),
    /// takes that back
    Unflag(u32, Reply<UnflagFeatureResponse>),
    /// asks what is to be probed; no numbers: all that is flagged
    Targets(Vec<u32>, SyncSender<Vec<Flag>>),
    /// an arm has measured something
    Measured(Box<ArmMeasurement>),
    /// looks at the mesh now
    Detect(DetectFeaturesRequest, Reply<DetectFeaturesResponse>),
}

/// What an arm has measured.
#[derive(Clone, Debug)]
pub struct ArmMeasurement {
    /// in which it was flagged
    pub session: String,
    /// number of the flag
    pub id: u32,
    /// what it is
    pub feature: Feature,
    /// it is known as well as was wanted
    pub is_done: bool,
}

/// Where a hand should touch next, by the number of the feature.
pub type NextTouches = BTreeMap<u32, NextTouch>;
