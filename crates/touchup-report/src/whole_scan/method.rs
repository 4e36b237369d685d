//! The methods by which a scan is refined, and how long each takes.

use std::time::{Duration, Instant};

use serde::Serialize;

use super::WholeScanError;
use super::contact_points::ContactSculptor;
use super::gaussian::{GaussianParams, GaussianSurface};
use super::part::Part;
use touchup_core::haptic::{RefineParams, RoiSize, StepRule};
use touchup_core::mesh::{FaceTree, TriMesh};
use touchup_core::reconstruct::PatcherParams;
use touchup_session::live::{Engine, Renewal};

/// Standard deviation of a contact point for the Gaussian process, m: that of a good tracking system.
const CONTACT_NOISE: f64 = 0.05e-3;
/// Number of samples between two checks of the time limit.
const CLOCK_EVERY: usize = 64;

/// Radius of the region that follows a touched face.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Reach {
    /// the face alone
    Handle,
    /// its neighbours
    OneRing,
    /// vertices within so many radii of the ball
    TipRadii(f64),
}

/// A method that refines a scan by touch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum RefineMethod {
    /// the published rule, integrated by Dormand–Prince 5(4), the pair of ode45
    PaperOde45,
    /// the published rule in exact steps
    PaperLie,
    /// the repaired rule: the haptic update alone
    Robust(Reach),
    /// the repaired rule with the touched part remeshed, as `touchup refine` does it
    Patch,
    /// contact points alone, a baseline
    ContactPoints,
    /// a Gaussian-process implicit surface, a baseline
    GaussianProcess,
}

impl RefineMethod {
    /// The region that the robust mode has by default.
    pub const HAPTIC: Self = Self::Robust(Reach::TipRadii(1.0));

    /// All of them.
    pub const ALL: [Self; 10] = [
        Self::PaperOde45,
        Self::PaperLie,
        Self::Robust(Reach::Handle),
        Self::Robust(Reach::OneRing),
        Self::Robust(Reach::TipRadii(0.5)),
        Self::HAPTIC,
        Self::Robust(Reach::TipRadii(2.0)),
        Self::Patch,
        Self::ContactPoints,
        Self::GaussianProcess,
    ];

    /// Those that are tried on finer and coarser scans too.
    pub const BY_DENSITY: [Self; 3] = [Self::HAPTIC, Self::Patch, Self::ContactPoints];

    /// As the report calls it.
    pub fn name(self) -> String {
        match self {
            Self::PaperOde45 => "paper, ode45".to_owned(),
            Self::PaperLie => "paper, Lie step".to_owned(),
            Self::Robust(Reach::Handle) => "robust, handle alone".to_owned(),
            Self::Robust(Reach::OneRing) => "robust, one ring".to_owned(),
            Self::Robust(Reach::TipRadii(radii)) => format!("robust, {radii} tip radii"),
            Self::Patch => "robust with patch".to_owned(),
            Self::ContactPoints => "contact points alone (baseline)".to_owned(),
            Self::GaussianProcess => "Gaussian process (baseline)".to_owned(),
        }
    }
}

/// What a run may take.
#[derive(Clone, Copy, Debug)]
pub(super) struct RunLimits {
    /// a run that takes longer is stopped
    pub longest: Duration,
    /// touches that the Gaussian process gets
    pub touches: usize,
}

/// A run from the scan to the result.
pub(super) struct Run {
    pub mesh: TriMesh,
    /// before the first sample
    pub build: Duration,
    /// all samples
    pub samples: Duration,
    /// after the last one
    pub end: Duration,
    /// samples or touches that were given to it
    pub given: usize,
    /// and what it would have been given without a bound
    pub offered: usize,
    /// samples that were refused, and why the first of them
    pub refused: usize,
    pub why: Option<String>,
    /// updates, and those that were cut back
    pub moved: u64,
    pub cut_back: u64,
    /// seconds that each touch took, where that grows with their number
    pub each: Vec<f64>,
}

/// Refines `scan` by one method.
pub(super) fn run(
    method: RefineMethod,
    part: &Part,
    scan: &TriMesh,
    bounds: &RunLimits,
) -> Result<Run, WholeScanError> {
    match method {
        RefineMethod::ContactPoints => Ok(sculpt(part, scan, bounds)),
        RefineMethod::GaussianProcess => Ok(fit_gaussian(part, scan, bounds)),
        _ => refine(method, part, scan, bounds),
    }
}

fn params(method: RefineMethod, part: &Part) -> RefineParams {
    let mut params = match method {
        RefineMethod::PaperOde45 | RefineMethod::PaperLie => RefineParams::paper(part.tip),
        _ => RefineParams::robust(part.tip),
    };
    match method {
        RefineMethod::PaperOde45 => params.dynamics.rule = StepRule::DormandPrince,
        RefineMethod::Robust(Reach::Handle) => params.roi = RoiSize::Handle,
        RefineMethod::Robust(Reach::OneRing) => params.roi = RoiSize::OneRing,
        RefineMethod::Robust(Reach::TipRadii(radii)) => params.roi = RoiSize::Radius(radii * part.tip.radius),
        _ => {}
    }
    (params.compensator, params.scan_noise) = (part.compensator, part.scan_noise);
    params
}

/// The haptic update, with the patch where the method has one.
fn refine(method: RefineMethod, part: &Part, scan: &TriMesh, bounds: &RunLimits) -> Result<Run, WholeScanError> {
    let copy = scan.clone();
    let begun = Instant::now();
    let patch = (method == RefineMethod::Patch)
        .then(|| PatcherParams::new(part.tip.radius, part.tip.stiffness, part.scan_noise));
    let mut engine = Engine::new(copy, params(method, part), patch, Renewal::AtEnd)?;
    let built = Instant::now();
    let (mut given, mut refused, mut why) = (0, 0, None);
    for sample in &part.samples {
        if given % CLOCK_EVERY == 0 && built.elapsed() > bounds.longest {
            break;
        }
        given += 1;
        if let Err(error) = engine.push(sample) {
            refused += 1;
            why.get_or_insert_with(|| error.to_string());
        }
    }
    let pushed = Instant::now();
    let (refiner, patcher) = engine.finish()?;
    let counts = *refiner.counts();
    let mesh = match patcher {
        None => refiner.into_mesh(),
        Some(mut patcher) => {
            patcher.flush();
            patcher.patched(scan, &FaceTree::new(scan))?.mesh
        }
    };
    Ok(Run {
        mesh,
        build: built - begun,
        samples: pushed - built,
        end: pushed.elapsed(),
        given,
        offered: part.samples.len(),
        refused,
        why,
        moved: counts.moved,
        cut_back: counts.cut_back,
        each: Vec::new(),
    })
}

impl Run {
    /// A baseline's, which refuses `refused` of the contacts it is given.
    fn of_baseline(mesh: TriMesh, given: usize, refused: usize, offered: usize) -> Self {
        Self {
            mesh,
            build: Duration::ZERO,
            samples: Duration::ZERO,
            end: Duration::ZERO,
            given,
            offered,
            refused,
            why: (refused > 0).then(|| "the place has no normal, or is another touch's".to_owned()),
            moved: (given - refused) as u64,
            cut_back: 0,
            each: Vec::new(),
        }
    }
}

fn sculpt(part: &Part, scan: &TriMesh, bounds: &RunLimits) -> Run {
    let begun = Instant::now();
    let mut sculptor = ContactSculptor::new(scan, part.tip.radius, part.tip.radius);
    let built = Instant::now();
    let (mut given, mut refused) = (0, 0);
    for contact in &part.contacts {
        if given % CLOCK_EVERY == 0 && built.elapsed() > bounds.longest {
            break;
        }
        given += 1;
        refused += usize::from(sculptor.push(&contact.reported).is_none());
    }
    let pushed = Instant::now();
    let run = Run::of_baseline(sculptor.into_mesh(), given, refused, part.contacts.len());
    Run { build: built - begun, samples: pushed - built, ..run }
}

fn fit_gaussian(part: &Part, scan: &TriMesh, bounds: &RunLimits) -> Run {
    let process = GaussianParams {
        amplitude: part.scan_noise.max(CONTACT_NOISE),
        length: 2.0 * part.tip.radius,
        noise: CONTACT_NOISE,
    };
    let stride = part.contacts.len().div_ceil(bounds.touches).max(1);
    let begun = Instant::now();
    let mut surface = GaussianSurface::new(scan, process);
    let built = Instant::now();
    let (mut given, mut refused, mut each) = (0, 0, Vec::new());
    let mut last = built;
    for contact in part.contacts.iter().step_by(stride) {
        if built.elapsed() > bounds.longest {
            break;
        }
        given += 1;
        refused += usize::from(!surface.push(contact.point));
        let now = Instant::now();
        each.push((now - last).as_secs_f64());
        last = now;
    }
    let mesh = surface.mesh();
    let run = Run::of_baseline(mesh, given, refused, part.contacts.len());
    Run { build: built - begun, samples: last - built, end: last.elapsed(), each, ..run }
}
