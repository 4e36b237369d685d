//! Numerical stability: maps over twelve decades of every parameter, and the exact sub-flows
//! against 32 digits.

mod bounded_steps;
mod face_runs;
mod integrators;
mod mesh_runs;
mod shares;
mod sub_flows;
mod text;

use rand::SeedableRng;
use rand_pcg::Pcg64;

pub use bounded_steps::{BoundedStepError, bounded_steps};
pub use face_runs::RunEnding;
pub use integrators::Integrator;
pub use mesh_runs::BadShape;
pub use shares::EndingCounts;
pub use sub_flows::SubFlowError;

use super::{Effort, Panel};
use face_runs::FaceRun;
use mesh_runs::MeshRun;
use shares::{share, share_map, stable_from, stable_up_to};

/// Largest error of an exact sub-flow, as a share of its scale.
pub const LARGEST_SUB_FLOW_ERROR: f64 = 1e-10;
/// Same report on every machine.
const SEED: u64 = 4;
/// Stiffness of position and normal in the maps: powers of ten.
const STIFFNESS: std::ops::Range<f64> = -12.0..12.0;

/// Ends of the runs of one integrator on one face.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceShares {
    /// integrator
    pub integrator: Integrator,
    /// counts over all runs
    pub endings: EndingCounts,
    /// share in which the integrator itself kept |n| = 1, before normalisation
    pub unit_share: f64,
    /// largest α f_max dt / h_min below which all runs are stable, in the columns of the map;
    /// `None` if even the first column is not
    pub stable_up_to: Option<f64>,
    /// x: α f_max dt / h_min, y: β f_max² dt; for the sigmoid and for the spring
    pub by_stiffness: [Panel; 2],
    /// x: step length, s; y: h_min, m
    pub by_step: Panel,
}

/// Ends of the runs of the default, Lie in the robust mode, on whole meshes. The mode turns the
/// normal by itself, so that the drift-corrected step is the same there.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshShares {
    /// shape of the triangles
    pub shape: BadShape,
    /// counts over all runs
    pub endings: EndingCounts,
    /// smallest altitude over longest side from which on all runs are stable, in the rows of the
    /// map; `None` if even the last row is not
    pub stable_from_quality: Option<f64>,
    /// x: α k dt, y: altitude over longest side
    pub by_quality: Panel,
}

/// Results on stability.
#[derive(Clone, Debug, PartialEq)]
pub struct Stability {
    /// one for each integrator
    pub faces: Vec<FaceShares>,
    /// one for each shape of triangles
    pub meshes: Vec<MeshShares>,
    /// one for each sub-flow and regime
    pub sub_flows: Vec<SubFlowError>,
    /// errors of the error-bounded step, one for each contact model and direction
    pub bounded_steps: Vec<BoundedStepError>,
}

/// Runs all of it; the same numbers on every machine.
pub fn stability(effort: Effort, progress: &mut dyn FnMut(&str)) -> Stability {
    let runs = effort.choose(12_000, 150_000);
    let faces = Integrator::ALL.map(|integrator| {
        progress(&format!("stability map, {}", integrator.name()));
        // in stiff cases this integrator takes ten milliseconds for nothing
        let runs = if integrator == Integrator::DormandPrince {
            effort.choose(400, 4_000)
        } else {
            runs
        };
        face_shares(integrator, runs)
    });
    progress("stability map, mesh quality");
    let meshes = BadShape::ALL
        .map(|shape| mesh_shares(shape, effort.choose(600, 8_000)))
        .into();
    progress("exact sub-flows against 32 digits");
    let sub_flows =
        sub_flows::sub_flows(&mut Pcg64::seed_from_u64(SEED), effort.choose(300, 2_000));
    progress("step with an error bound against 32 digits");
    let bounded_steps = bounded_steps(SEED, effort.choose(50, 2_500));
    Stability {
        faces: faces.into(),
        meshes,
        sub_flows,
        bounded_steps,
    }
}

fn face_shares(integrator: Integrator, count: usize) -> FaceShares {
    let mut rng = Pcg64::seed_from_u64(SEED);
    let run = |i: usize| {
        let run = FaceRun::draw(&mut rng, i % 2 == 1);
        (run, run.judge(integrator))
    };
    let runs: Vec<(FaceRun, (RunEnding, bool))> = (0..count).map(run).collect();
    let by_stiffness = [("sigmoid", 0), ("spring", 1)].map(|(name, first)| {
        let of_model = runs.iter().skip(first).step_by(2);
        let stiffness = of_model.map(|(run, (ending, _))| (run.stiffness(), *ending));
        share_map(name, [&STIFFNESS; 2], stiffness)
    });
    let steps = runs
        .iter()
        .map(|(run, (ending, _))| ([run.held.dt, run.h_min], *ending));
    FaceShares {
        integrator,
        endings: EndingCounts::of(runs.iter().map(|(_, (ending, _))| *ending)),
        unit_share: share(
            runs.iter().filter(|(_, (_, kept_unit))| *kept_unit).count(),
            count,
        ),
        stable_up_to: by_stiffness
            .iter()
            .map(stable_up_to)
            .reduce(|a, b| Some(a?.min(b?)))
            .flatten(),
        by_stiffness,
        by_step: share_map(
            integrator.name(),
            [&face_runs::STEP, &face_runs::H_MIN],
            steps,
        ),
    }
}

fn mesh_shares(shape: BadShape, count: usize) -> MeshShares {
    let mut rng = Pcg64::seed_from_u64(SEED);
    let run = |_| {
        let run = MeshRun::draw(&mut rng, shape);
        ([run.stiffness, run.quality], run.judge())
    };
    let runs: Vec<([f64; 2], RunEnding)> = (0..count).map(run).collect();
    let by_quality = share_map(
        shape.name(),
        [&(-6.0..6.0), &mesh_runs::QUALITY],
        runs.iter().copied(),
    );
    let endings = EndingCounts::of(runs.iter().map(|(_, ending)| *ending));
    MeshShares {
        shape,
        endings,
        stable_from_quality: stable_from(&by_quality),
        by_quality,
    }
}

impl Stability {
    /// Whether the default integrator, Lie, was stable in every run of one face.
    pub fn is_default_stable(&self) -> bool {
        let mut of_default = self
            .faces
            .iter()
            .filter(|shares| shares.integrator == Integrator::Lie);
        of_default.all(|shares| shares.endings.stable_share() == 1.0)
    }

    /// The smallest altitude over longest side from which on every press of the default is stable;
    /// `None` if even the best quality is not.
    pub fn default_stable_from_quality(&self) -> Option<f64> {
        self.meshes
            .iter()
            .map(|shares| shares.stable_from_quality)
            .reduce(|a, b| Some(a?.max(b?)))
            .flatten()
    }

    /// Whether the error-bounded step kept its bound in every sample, and refused none.
    pub fn is_bound_kept(&self) -> bool {
        self.bounded_steps
            .iter()
            .all(|group| group.refused == 0 && group.position <= 1.0 && group.normal <= 1.0)
    }

    /// The largest error of all sub-flows, over the scale.
    pub fn largest_sub_flow_error(&self) -> f64 {
        self.sub_flows
            .iter()
            .map(|flow| flow.largest_error)
            .fold(0.0, f64::max)
    }
}
