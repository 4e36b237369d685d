//! Each stage by itself, over the same samples.

use std::hint::black_box;
use std::io::Cursor;

use nalgebra::{Point3, Vector3};

use super::pushes::{side_of, touched_plate};
use super::replay::messages;
use super::turns::{PerSample, TimedCase, Timing, in_turns, spread};
use crate::error::{MeasureError, MeasureResult};
use crate::{Spread, timed};
use touchup_features::features::detect;
use touchup_geometry::mesh::{FaceId, FaceTree, NearbyLeaves, RefitPlan, TriMesh};
use touchup_io::recording::{RecordingWriter, Topics};
use touchup_method::haptic::{FaceDynamics, FaceState, RefineError, RefineParams};
use touchup_method::reconstruct::Patcher;
use touchup_method::stylus::{
    BiasTracker, Compensator, ContactEstimator, ContactEstimatorParams, ContactGate, ContactSample,
    Sample, Synchroniser, Tip, TipMotion, TipParams, WrenchFrame,
};
use touchup_session::replay::ReplayError;
use touchup_session::scene::Scene;
use touchup_sim::wavy::{RADIUS, STIFFNESS};

/// One stage on one scan.
#[derive(Clone, Debug, PartialEq)]
pub struct StageCost {
    /// work of the stage
    pub stage: String,
    /// faces of the scan
    pub faces: usize,
    /// cost of one sample
    pub per_sample: PerSample,
}

/// Occasional work, not at each sample.
#[derive(Clone, Debug, PartialEq)]
pub struct SeldomCost {
    /// description
    pub work: String,
    /// faces of the scan
    pub faces: usize,
    /// time of one execution, ms
    pub time_ms: Spread,
}

/// Samples between two renewals of the patch: 8 ms at 1 kHz, as beside a stylus.
const RENEWAL: usize = 8;

/// Contact point of the ball.
pub(super) fn touching(sample: &Sample) -> Point3<f64> {
    let force = &sample.wrench.force;
    Point3::from(sample.pose_ot.translation.vector) + force / STIFFNESS - force.normalize() * RADIUS
}

/// The contact state of each sample.
fn contacts_of(samples: &[Sample], tip: TipParams) -> MeasureResult<Vec<ContactSample>> {
    let mut estimator = ContactEstimator::new(ContactEstimatorParams::new(tip))?;
    let observe = |sample| Ok(*estimator.observe(sample).map_err(RefineError::from)?);
    samples.iter().map(observe).collect()
}

/// Times every stage that is callable by itself, on a scan of edges of 1 mm.
pub(super) fn stage_costs(faces: usize, timing: Timing) -> MeasureResult<Vec<StageCost>> {
    let (mesh, samples) = touched_plate(faces, side_of(faces), timing.samples())?;
    let tree = FaceTree::new(&mesh);
    let scene = Scene::default();
    let params = scene
        .refine_params(WrenchFrame::Sensor)
        .ok_or(MeasureError::NothingMoves)?;

    let plain = Compensator::new(params.compensator)?;
    let tips: Vec<Tip> = samples
        .iter()
        .map(|sample| plain.compensate(sample))
        .collect();
    let contacts = contacts_of(&samples, params.tip)?;
    let points: Vec<_> = samples.iter().map(touching).collect();
    let writer = RecordingWriter::new(Cursor::new(Vec::new()), &Topics::default());
    let mut writer = writer.map_err(ReplayError::from)?;
    let mut patcher = Patcher::new(scene.patcher_params().ok_or(MeasureError::NothingMoves)?)?;

    let mut cases = stylus_cases(&scene, &params, &plain, &samples, &tips)?;
    let dynamics = FaceDynamics::new(params.dynamics).map_err(RefineError::from)?;
    cases.extend(surface_cases(&mesh, &tree, dynamics, &samples, &points));
    cases.extend([
        TimedCase::each("recording (on a thread of its own)", &samples, |sample| {
            let mut written = messages(sample)
                .into_iter()
                .map(|message| writer.write(message, "object"));
            Ok(written.try_for_each(|one| one).map_err(ReplayError::from)?)
        }),
        TimedCase::each("patch: touches found and kept", &contacts, |contact| {
            patcher.push(contact);
            Ok(())
        }),
    ]);
    let timed = in_turns(&mut cases, timing)?;
    let faces = mesh.face_count();
    cases
        .iter()
        .zip(&timed)
        .map(|(case, timed)| {
            Ok(StageCost {
                stage: case.name.to_owned(),
                faces,
                per_sample: timed.per_sample()?,
            })
        })
        .collect()
}

/// Stages from messages to a moving ball.
fn stylus_cases<'a>(
    scene: &Scene,
    params: &RefineParams,
    plain: &'a Compensator,
    samples: &'a [Sample],
    tips: &'a [Tip],
) -> MeasureResult<Vec<TimedCase<'a>>> {
    let contact = scene.contact.unwrap_or_default();
    let mut sync = Synchroniser::new(scene.sync_params())?;
    let mut bias = BiasTracker::new(Default::default())?;
    let mut gate = ContactGate::new(contact)?;
    let mut motion = TipMotion::new(params.sliding.unwrap_or_default(), params.tip);
    Ok(vec![
        TimedCase::each("sync", samples, move |sample| {
            for message in messages(sample) {
                sync.push(message);
            }
            Ok(sync.next_sample())
        }),
        TimedCase::each("compensation (nothing to take off)", samples, |sample| {
            Ok(plain.compensate(black_box(sample)))
        }),
        TimedCase::each("bias tracking", tips, move |tip| {
            Ok(bias.compensate(tip, |rest| rest.norm() < contact.free))
        }),
        TimedCase::each("contact gate", tips, move |tip| {
            Ok(gate.update(tip.stamp_ns, &tip.force_o))
        }),
        TimedCase::each("sliding and friction", tips, move |tip| {
            let ball = motion.update(tip, 1e-3, 0.03);
            Ok(motion.surface_normal(&ball, 1e-3))
        }),
    ])
}

/// Stages at the surface.
fn surface_cases<'a>(
    mesh: &'a TriMesh,
    tree: &'a FaceTree,
    dynamics: FaceDynamics,
    samples: &'a [Sample],
    points: &'a [Point3<f64>],
) -> [TimedCase<'a>; 4] {
    let (mut last, mut nearby) = (None, NearbyLeaves::default());
    let mut moving = MovingMesh {
        mesh: mesh.clone(),
        tree: tree.clone(),
        plan: RefitPlan::default(),
        at: None,
    };
    let face = FaceState {
        b: Point3::origin(),
        n: Vector3::z(),
    };
    [
        TimedCase::each("closest face, from the root", points, |p| {
            Ok(tree.closest(mesh, p, RADIUS))
        }),
        TimedCase::each("closest face, from the last one", points, move |p| {
            let hit = match last {
                Some(hint) => tree.closest_nearby(mesh, p, hint, RADIUS, &mut nearby),
                None => tree.closest(mesh, p, RADIUS),
            };
            last = hit.map(|hit| hit.face).or(last);
            Ok(())
        }),
        TimedCase::each("face dynamics", samples, move |sample| {
            let p = Point3::new(0.0, 0.0, -0.05e-3);
            Ok(dynamics
                .step(black_box(&face), &p, &sample.wrench.force, 1e-3)
                .map_err(RefineError::from)?)
        }),
        TimedCase::each("tree update around one face", points, move |p| {
            Ok(moving.follow(p))
        }),
    ]
}

/// A separate mesh whose boxes follow it.
struct MovingMesh {
    mesh: TriMesh,
    tree: FaceTree,
    plan: RefitPlan,
    at: Option<FaceId>,
}

impl MovingMesh {
    /// Updates the boxes around the face under the tip, and returns the face. Looks up face and
    /// boxes once per millimetre of travel, as the refiner does once per face.
    fn follow(&mut self, p: &Point3<f64>) -> Option<FaceId> {
        let Self {
            mesh,
            tree,
            plan,
            at,
        } = self;
        let is_far = at.is_none_or(|face| (mesh.barycentre(face) - p).norm_squared() > 1e-6);
        if is_far {
            *at = tree.closest(mesh, p, RADIUS).map(|hit| hit.face);
            let corners = at.iter().flat_map(|&face| mesh.corners(face));
            let faces: Vec<FaceId> = corners
                .flat_map(|vertex| mesh.star(vertex))
                .copied()
                .collect();
            tree.plan(&faces, plan);
        }
        tree.refit_planned(mesh, plan, f64::INFINITY, 0.0);
        *at
    }
}

/// Times the occasional work.
pub(super) fn seldom_costs(faces: usize, repeats: usize) -> MeasureResult<Vec<SeldomCost>> {
    let (mesh, samples) = touched_plate(faces, side_of(faces), 1000 + RENEWAL * repeats)?;
    let tree = FaceTree::new(&mesh);
    let faces = mesh.face_count();
    let scene = Scene::default();
    let mut patcher = Patcher::new(scene.patcher_params().ok_or(MeasureError::NothingMoves)?)?;
    let contacts = contacts_of(&samples, scene.tip_params())?;
    let mut renew = |contacts: &[ContactSample]| {
        contacts.iter().for_each(|contact| patcher.push(contact));
        timed(|| patcher.renewed(&mesh, &tree)).0 * 1e3
    };
    // the first renewal covers all earlier samples
    renew(&contacts[..1000]);
    let renewals = spread(contacts[1000..].chunks_exact(RENEWAL).map(renew))?;
    let looks = spread((0..repeats.clamp(1, 3)).map(|_| timed(|| detect(&mesh, &[])).0 * 1e3))?;
    let cost = |work: &str, time_ms| SeldomCost {
        work: work.to_owned(),
        faces,
        time_ms,
    };
    Ok(vec![
        cost(
            "one renewal of the patch, each 8 ms, on a thread of its own",
            renewals,
        ),
        cost("one look for features, on a thread of its own", looks),
    ])
}
